"""Events at one instant: which of them rounding puts first decides nothing.

`NUDGE` of the kernel's inputs moves the events of one contact or friction by units in the last
place, as another processor would.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
import pytest
from scipy.linalg import expm

import saltus
import saltus.flow.motion.kernel_state as kernel_state

ULPS = (None, (1, 1.0), (1, -4.0), (1, 64.0), (2, 1.0), (2, 4.0), (2, -64.0))
DAMPING, COUPLING, FREQUENCY, RESTITUTION = 0.1, 0.4, 0.9, 0.6


@dataclass(frozen=True, kw_only=True)
class Pipe(saltus.ContactModel):
    """Both ends of a pipe between equal stops: a'' = F - a - C a' - k (a - b), and b likewise."""

    room: float = 0.6

    coordinates: ClassVar[tuple[str, ...]] = ("a", "b")
    channels: ClassVar[tuple[str, ...]] = ("force",)

    @property
    def contacts(self) -> tuple[saltus.Contact, ...]:
        return tuple(
            saltus.Contact(name=f"stop_{c}", coordinate=c, position=self.room, sign=-1)
            for c in "ab"
        )

    def force(self, t: Any, theta: Any, velocity: Any, load: Any) -> Any:
        (a, b), (v, w), force = theta, velocity, load.force(t)
        apart = COUPLING * (a - b)
        return force - a - DAMPING * v - apart, force - b - DAMPING * w + apart


@dataclass(frozen=True, kw_only=True)
class Blocks(saltus.ContactModel):
    """Two blocks on rough ground, as the ends of the pipe, that slip, stick and turn round."""

    kinetic: float = 0.3
    static: float = 0.4

    coordinates: ClassVar[tuple[str, ...]] = ("a", "b")
    channels: ClassVar[tuple[str, ...]] = ("force",)
    force = Pipe.force

    @property
    def frictions(self) -> tuple[saltus.Friction, ...]:
        return tuple(
            saltus.Friction(
                name=f"ground_{c}", coordinate=c, kinetic=self.kinetic, static=self.static
            )
            for c in "ab"
        )

    def normal_forces(self, t: Any, q: Any, v: Any, load: Any) -> Any:
        return 1.0, 1.0


def system_of(model: Any, amplitude: float) -> saltus.System:
    load = saltus.Load(frequency=FREQUENCY, force=saltus.Harmonic(amplitude=amplitude))
    law = {"impact": saltus.NewtonImpact(e=RESTITUTION)} if model.contacts else {}
    return saltus.System(model=model, load=load, **law)


def at_nudges(monkeypatch: pytest.MonkeyPatch, what: Callable[[], Any]) -> list[Any]:
    """A result with events as they come, and with those of one part moved."""
    results = []
    for nudge in ULPS:
        monkeypatch.setattr(kernel_state, "NUDGE", nudge)
        results.append(what())
    monkeypatch.setattr(kernel_state, "NUDGE", None)
    return results


@pytest.mark.parametrize(("model", "amplitude"), [(Pipe(), 0.5), (Blocks(), 0.5), (Blocks(), 1.2)])
def test_events_at_one_instant_count_the_same_however_rounding_orders_them(
    monkeypatch: pytest.MonkeyPatch, model: Any, amplitude: float
) -> None:
    system = system_of(model, amplitude)

    def counts() -> tuple[Counter[tuple[str, str]], np.ndarray]:
        motion = saltus.simulate(system, a=0.0, b=0.0, periods=5)
        state = np.array([motion.position, motion.velocity])
        return Counter((str(event.kind), event.contact) for event in motion.events), state

    (first, state), *others = at_nudges(monkeypatch, counts)
    assert sum(first.values()) >= 8
    names = sorted({name[-1] for _, name in first} - {"b"})
    assert names == ["a"]
    for (kind, name), count in first.items():
        assert first[kind, name[:-1] + "b"] == count
    for other, state_of_other in others:
        assert other == first
        np.testing.assert_allclose(state_of_other, state, rtol=0, atol=1e-11)


def test_derivatives_of_two_ends_are_those_of_their_sum_and_difference(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Multipliers in closed form: each mode is a linear oscillator, whose columns an impact changes
    by the saltation of one mass at its wall, which is the same for both masses.
    """
    system = system_of(Pipe(), 0.5)
    orbit = saltus.find_orbit(system, a=0.0, b=0.0)
    motion = orbit.motion(tol=1e-14)
    instants = sorted(set(np.round(motion.impacts.time, 9)))
    assert len(motion.impacts) == 2 * len(instants) > 0
    expected = []
    for stiffness in (1.0, 1.0 + 2.0 * COUPLING):
        smooth = np.array([[0.0, 1.0], [-stiffness, -DAMPING]])
        total, time = np.eye(2), motion.start
        for impact in motion.impacts.time[::2]:
            speed = motion.at(impact - 1e-9)[1][0]
            pull = float(system.load.force(impact)) - 0.6
            before = pull - DAMPING * speed
            after = pull + DAMPING * RESTITUTION * speed
            jump = np.array(
                [
                    [-RESTITUTION, 0.0],
                    [(after + RESTITUTION * before) / speed, -RESTITUTION],
                ]
            )
            total, time = jump @ expm(smooth * (impact - time)) @ total, impact
        end = motion.start + 2.0 * np.pi / FREQUENCY
        expected += np.linalg.eigvals(expm(smooth * (end - time)) @ total).tolist()

    def multipliers() -> tuple[np.ndarray, np.ndarray]:
        start = orbit.start()
        state = saltus.sensitivities(system, **start, periods=1, tol=1e-13).state
        return saltus.find_orbit(system, a=0.0, b=0.0).multipliers, np.linalg.eigvals(state)

    for pair in at_nudges(monkeypatch, multipliers):
        for found in pair:
            apart = np.abs(found[:, None] - np.array(expected))
            assert apart.min(axis=0).max() < 1e-7


def test_a_branch_of_two_ends_that_move_alike_ends_at_its_bounds() -> None:
    """Nothing happens along it: the time between its impacts is rounding."""
    system = system_of(Pipe(), 0.5)
    orbit = saltus.find_orbit(system, a=0.0, b=0.0)
    branch = saltus.continue_orbit(orbit, "load.frequency", (0.85, 0.95))
    assert [str(end) for end in branch.ends] == ["bound 0.85", "bound 0.95"]
    assert not branch.special


@pytest.mark.thorough
def test_a_branch_of_three_cells_that_move_alike_goes_on_where_their_contacts_open_together() -> (
    None
):
    """Three contacts open at one instant: the reactions of the later two vanish at the event of the
    first, all along the branch. It ended within 1e-5 of where it began.
    """
    load = saltus.Load(frequency=1.0, vertical=-0.5, horizontal=saltus.Harmonic(amplitude=0.4))
    model = saltus.CellChain(beta0=np.deg2rad(80), cells=3, coupling=0.5, damping=0.1)
    system = saltus.System(model=model, load=load, impact=saltus.NewtonImpact(e=0.0))
    start = {name: 0.4 if name.startswith("lower") else 0.0 for name in model.coordinates}
    orbit = saltus.find_orbit(system, **start)
    branch = saltus.continue_orbit(orbit, "load.horizontal.amplitude", (0.398, 0.402))
    assert [str(end) for end in branch.ends] == ["bound 0.398", "bound 0.402"]
    assert not branch.special


@pytest.mark.thorough
def test_a_branch_of_cells_that_move_alike_ends_where_excursions_of_all_vanish_at_once() -> None:
    """At the SW of a single cell. Beside it speeds of these excursions are below rounding: GR, PD
    and BPC were listed that do not exist.
    """
    load = saltus.Load(frequency=1.0, vertical=-0.5, horizontal=saltus.Harmonic(amplitude=0.4))
    path, impact = "load.horizontal.amplitude", saltus.NewtonImpact(e=0.0)
    one = saltus.System(
        model=saltus.TwoLayer(beta0=np.deg2rad(80), damping=0.1), load=load, impact=impact
    )
    orbit = saltus.find_orbit(one, theta_1=0.0, theta_2=-0.4)
    (change,) = saltus.continue_orbit(orbit, path, (0.39, 0.401)).special
    assert change.kind == "SW"
    model = saltus.CellChain(beta0=np.deg2rad(80), cells=2, coupling=0.5, damping=0.1)
    start = {name: 0.4 if name.startswith("lower") else 0.0 for name in model.coordinates}
    orbit = saltus.find_orbit(saltus.System(model=model, load=load, impact=impact), **start)
    branch = saltus.continue_orbit(orbit, path, (0.39, 0.401))
    assert not branch.special
    assert [end.reason.name for end in branch.ends] == ["TWO_AT_ONCE", "BOUND"]
    assert 0.0 < branch.ends[0].parameter - change.parameter < 1e-4


@dataclass(frozen=True, kw_only=True)
class Cradle(saltus.ContactModel):
    """Three balls in a row, of which the outer two come from both sides at once."""

    coordinates: ClassVar[tuple[str, ...]] = ("x", "y", "z")
    contacts = (
        saltus.Contact(name="left", coordinate={"y": 1.0, "x": -1.0}),
        saltus.Contact(name="right", coordinate={"z": 1.0, "y": -1.0}),
    )

    def force(self, t: Any, q: Any, v: Any, load: Any) -> Any:
        return 0.0, 0.0, 0.0


def test_validity_says_where_contacts_that_act_on_one_another_close_together() -> None:
    system = saltus.System(model=Cradle(), impact=saltus.NewtonImpact(e=0.5))
    motion = saltus.simulate(system, x=-1.0, y=0.0, z=1.0, velocity=(1.0, 0.0, -1.0), duration=1.5)
    assert motion.validity.together == 1
    assert motion.validity.first_together == pytest.approx(1.0, abs=1e-13)
    assert "contacts that act on one another close together" in str(motion.validity)
    one = saltus.simulate(system, x=-1.0, y=0.0, z=2.0, velocity=(1.0, 0.0, 0.0), duration=1.5)
    assert one.validity.together == 0


@dataclass(frozen=True, kw_only=True)
class DampedBlocks(Blocks):
    """The two blocks with a damper between them, which carries the jump of one to the other."""

    damper: float = 0.4

    def force(self, t: Any, theta: Any, velocity: Any, load: Any) -> Any:
        (a, b), (v, w), force = theta, velocity, load.force(t)
        between = self.damper * (v - w)
        return force - a - DAMPING * v - between, force - b - DAMPING * w + between


@pytest.mark.parametrize("damper", [0.0, 0.4])
def test_slips_at_one_instant_have_a_derivative_where_their_order_makes_no_difference(
    damper: float,
) -> None:
    """Both blocks begin to slide at one instant. The static force is larger than the kinetic one, so
    that the first to slide jerks the other by the damper. Differences from both sides tell.
    """
    system = system_of(DampedBlocks(kinetic=0.3, static=0.5, damper=damper), 1.2)
    start = {"a": 0.0, "b": 0.0, "velocity": (0.0, 0.0), "duration": 5.0}
    found = saltus.sensitivities(system, **start, tol=1e-13)
    slips = [event.time for event in found.motion.events if event.kind == "slip"]
    assert len(slips) == 2
    assert slips[1] == pytest.approx(slips[0], abs=1e-12)

    def end(a: float) -> np.ndarray:
        motion = saltus.simulate(system, **{**start, "a": a}, tol=1e-14, dense=False)
        return np.concatenate([motion.position, motion.velocity])

    step = 1e-6
    sides = [(end(step) - end(0.0)) / step, (end(0.0) - end(-step)) / step]
    if damper == 0.0:
        assert found.undefined is None
        np.testing.assert_allclose(sides, [found.state[:, 0]] * 2, rtol=0, atol=2e-6)
    else:
        assert np.abs(sides[0] - sides[1]).max() > 1e-3
        assert np.isnan(found.state[:, 0]).all()
        assert found.undefined is not None
        assert "ground_a and ground_b change at one instant" in found.undefined


@pytest.mark.parametrize("damper", [0.0, 0.4])
def test_orbits_have_multipliers_where_the_order_of_slips_makes_no_difference(
    damper: float,
) -> None:
    """Both blocks slip at one instant in each half period. Without the damper each has the multiplier
    of a block alone; with it an orbit would have one-sided multipliers."""
    model = DampedBlocks(kinetic=0.3, static=0.5, damper=damper)
    system = system_of(model, 0.7).with_({"load.frequency": 0.4})
    start = {"a": 0.0, "b": 0.0, "velocity": (0.0, 0.0)}
    if damper:
        with pytest.raises(saltus.MotionError, match=r"change at one instant"):
            saltus.find_orbit(system, **start)
        return
    orbit = saltus.find_orbit(system, **start)
    values = np.sort(np.abs(orbit.multipliers))
    assert values[2] == pytest.approx(values[3], rel=1e-9)
    assert values[1] < 1e-12


def test_a_fit_needs_the_derivatives_to_its_own_unknowns_alone() -> None:
    """With the damper the derivatives to the start of one block are one-sided, that to the friction
    of both is not."""
    system = system_of(DampedBlocks(kinetic=0.3, static=0.5), 1.2)
    motion = saltus.simulate(system, a=0.0, b=0.0, duration=5.0)
    times = np.linspace(0.5, 5.0, 20)
    values = {"a": motion.at(times)[0][0]}
    measured = saltus.Measurement(time=times, values=values, start={"a": 0.0, "b": 0.0})
    with pytest.raises(saltus.MotionError):
        saltus.fit(system, measured, {"start.a": (-1e-9, 1e-9)}, starts=1)
    near = system.with_({"model.kinetic": 0.31})
    fit = saltus.fit(near, measured, ["model.kinetic"], starts=1)
    assert fit.values["model.kinetic"] == pytest.approx(0.3, abs=1e-8)


def test_a_pipe_as_a_structure_has_the_orbit_and_the_branch_of_the_pipe() -> None:
    """The same equations from matrices; all along the branch both ends meet their stops at once."""
    stiffness = np.array([[1.0 + COUPLING, -COUPLING], [-COUPLING, 1.0 + COUPLING]])
    model = saltus.Structure(
        mass=np.eye(2),
        stiffness=stiffness,
        damping=DAMPING * np.eye(2),
        names=("a", "b"),
        forces={"force": {"a": 1.0, "b": 1.0}},
        contacts=[
            saltus.Contact(name=f"stop_{c}", coordinate=c, position=0.6, sign=-1) for c in "ab"
        ],
    )
    system = system_of(model, 0.5)
    orbit = saltus.find_orbit(system, **model.start([0.0, 0.0], [0.0, 0.0]))
    pipe = saltus.find_orbit(system_of(Pipe(), 0.5), a=0.0, b=0.0)
    assert orbit.amplitude == pytest.approx(pipe.amplitude, abs=1e-12)
    found, expected = np.sort_complex(orbit.multipliers), np.sort_complex(pipe.multipliers)
    apart = np.abs(found[:, None] - expected)
    assert apart.min(axis=0).max() < 1e-9
    branch = saltus.continue_orbit(orbit, "load.frequency", (0.8, 1.0))
    assert [str(end) for end in branch.ends] == ["bound 0.8", "bound 1"]
    assert not branch.special


@dataclass(frozen=True, kw_only=True)
class BallsInTheAir(saltus.ContactModel):
    """Three balls above one another, of which a force presses the lowest one down."""

    channels: ClassVar[tuple[str, ...]] = ("push",)
    coordinates: ClassVar[tuple[str, ...]] = ("low", "middle", "high")
    contacts: ClassVar[tuple[saltus.Contact, ...]] = (
        saltus.Contact(name="floor", coordinate="low"),
        saltus.Contact(name="lower", coordinate={"middle": 1.0, "low": -1.0}),
        saltus.Contact(name="upper", coordinate={"high": 1.0, "middle": -1.0}),
    )

    def force(self, t: Any, q: Any, velocity: Any, load: Any) -> Any:
        return -1.0 - load.push(t), -1.0, -1.0


@dataclass(frozen=True, kw_only=True)
class BallsFromAbove(BallsInTheAir):
    coordinates: ClassVar[tuple[str, ...]] = BallsInTheAir.coordinates[::-1]
    contacts: ClassVar[tuple[saltus.Contact, ...]] = BallsInTheAir.contacts[::-1]

    def force(self, t: Any, q: Any, velocity: Any, load: Any) -> Any:
        return -1.0, -1.0, -1.0 - load.push(t)


@pytest.mark.parametrize("model", [BallsInTheAir, BallsFromAbove])
@pytest.mark.parametrize("frequency", [0.7, 1.0, 2.0, 3.1])
@pytest.mark.parametrize("push", [0.1, 0.2, 0.37])
def test_balls_that_fall_alike_touch_without_pressing(
    model: type, frequency: float, push: float
) -> None:
    """The lowest one leaves the others, which fall freely at one speed: nothing holds them together
    or apart but the rounding of forces that cancel."""
    load = saltus.Load(frequency=frequency, push=saltus.Harmonic(push))
    system = saltus.System(model=model(), load=load, impact=saltus.NewtonImpact(0.6))
    speeds = {"low": -0.5, "middle": -0.4, "high": -0.4}
    velocity = tuple(speeds[name] for name in model.coordinates)
    start = dict.fromkeys(model.coordinates, 0.3)
    motion = saltus.simulate(system, **start, velocity=velocity, duration=0.3)
    place = dict(zip(model.coordinates, motion.position, strict=True))
    assert place["middle"] == pytest.approx(0.3 - 0.4 * 0.3 - 0.5 * 0.3**2, abs=1e-14)
    assert place["high"] == pytest.approx(place["middle"], abs=1e-15)
    assert len(motion.impacts) == 0
