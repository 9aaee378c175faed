"""Dry friction with a known normal force: closed forms, an independent integration, balances,
derivatives, ensembles.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from math import asin, atan2, cos, hypot, pi, sin, sqrt
from typing import Any, ClassVar

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import saltus
from saltus.flow import Motion

GAUSS, WEIGHTS = np.polynomial.legendre.leggauss(24)


def belt(**numbers: float) -> saltus.System:
    """The belt oscillator without a load."""
    return saltus.System(model=saltus.BeltOscillator(**numbers))


def forced(frequency: float, amplitude: float, **numbers: float) -> saltus.System:
    """The same on a belt that stands still, by default with one coefficient, under a harmonic
    force.
    """
    given: dict[str, Any] = {"belt_speed": 0.0, "kinetic": 0.2, "static": 0.2} | numbers
    load = saltus.Load(frequency=frequency, force=saltus.Harmonic(amplitude=amplitude))
    return saltus.System(model=saltus.BeltOscillator(**given), load=load)


def integral(motion: Motion, value: Any) -> float:
    """The integral of value(t, x, v) along a motion with one coordinate, by Gauss between its
    events.
    """
    ends = np.unique(
        np.concatenate(
            [np.linspace(motion.start, motion.time, 200), [event.time for event in motion.events]]
        )
    )
    total = 0.0
    for begin, end in pairwise(ends):
        t = 0.5 * (begin + end) + 0.5 * (end - begin) * GAUSS
        total += 0.5 * (end - begin) * float(np.dot(WEIGHTS, value(t, *motion.at(t))))
    return total


@pytest.mark.parametrize(
    ("kinetic", "static", "speed"), [(0.2, 0.3, 0.1), (0.25, 0.25001, 0.4), (0.0, 0.5, 0.3)]
)
def test_stick_slip_on_a_belt_has_its_closed_form(
    kinetic: float, static: float, speed: float
) -> None:
    """It slips from x = mu_s about mu_k on a circle of the phase plane, and sticks from 2 mu_k -
    mu_s on.
    """
    motion = saltus.simulate(
        belt(kinetic=kinetic, static=static, belt_speed=speed),
        x=0.0,
        velocity=speed,
        duration=60.0,
        tol=1e-14,
    )
    slipping, sticking = 2 * (pi - atan2(static - kinetic, speed)), 2 * (static - kinetic) / speed
    kinds, times = (
        [str(event.kind) for event in motion.events],
        np.array([event.time for event in motion.events]),
    )
    assert kinds == [("slip", "stick")[i % 2] for i in range(len(kinds))]
    assert len(kinds) > 10
    cycles = (
        np.arange(len(kinds)) // 2 * (slipping + sticking) + np.arange(len(kinds)) % 2 * slipping
    )
    assert np.abs(times - (static / speed + cycles)).max() < 1e-9 * max(
        1.0, slipping / (static - kinetic) / 1e2
    )
    t = static / speed + np.linspace(0.0, 1.0, 50) * slipping
    angle, radius = t - t[0], np.hypot(static - kinetic, speed)
    start = atan2(speed, static - kinetic)
    assert np.abs(motion.at(t)[0] - kinetic - radius * np.cos(angle - start)).max() < 1e-12


def test_of_equal_coefficients_nothing_is_left_but_the_circle_that_touches_the_belt() -> None:
    """With mu_s = mu_k slip begins without an acceleration, and the mass stays within the circle of
    radius w about mu_k.
    """
    motion = saltus.simulate(
        belt(kinetic=0.3, static=0.3, belt_speed=0.2),
        x=-0.1,
        velocity=0.2,
        duration=40.0,
        tol=1e-14,
    )
    assert str(motion.events[0].kind) == "slip"
    assert abs(motion.events[0].time - 2.0) < 1e-12
    # where the circle touches the belt's speed rounding may let it stick, for no time
    later = [(str(event.kind), event.time) for event in motion.events[1:]]
    assert [kind for kind, _ in later] == ["stick", "slip"] * (len(later) // 2)
    times = np.array([time for _, time in later])
    assert (times[1::2] - times[::2] < 1e-6).all()
    x, v = motion.at(np.linspace(2.1, 40.0, 500))
    assert np.abs(np.hypot(x - 0.3, v) - 0.2).max() < 1e-12


@pytest.mark.parametrize(
    ("frequency", "amplitude", "friction"),
    [(0.7, 1.0, 0.2), (1.4, 1.0, 0.3), (2.3, 0.8, 0.1), (0.9, 1.0, 0.6)],
)
def test_motion_without_sticking_has_den_hartogs_amplitude(
    frequency: float, amplitude: float, friction: float
) -> None:
    """x_max^2 = (V P)^2 - (U F)^2, V = 1 / (1 - w^2), U = sin(pi / w) / (w (1 + cos(pi / w))) (Den
    Hartog 1931).
    """
    system = forced(frequency, amplitude, kinetic=friction, static=friction, damping=0.0)
    vee, you = 1 / (1 - frequency**2), sin(pi / frequency) / (frequency * (1 + cos(pi / frequency)))
    expected = sqrt((vee * amplitude) ** 2 - (you * friction) ** 2)
    motion = saltus.simulate(system, x=expected, velocity=0.0, periods=2000, tol=1e-14, dense=False)
    last = saltus.simulate(system, x=motion.x, velocity=motion.velocity, periods=3, tol=1e-14)
    assert {str(event.kind) for event in last.events} == {"reversal"}
    assert (
        np.abs(np.abs([last.at(event.time)[0] for event in last.events]) - expected).max() < 1e-10
    )


def test_a_slow_force_moves_it_in_two_stops_a_period() -> None:
    """Far below resonance it sticks before each reversal, and slips as the force less the spring's
    reaches mu N.
    """
    system = forced(0.1, 1.0, damping=0.4)
    motion = saltus.simulate(system, x=0.0, velocity=0.0, periods=6, tol=1e-13)
    kinds = [str(event.kind) for event in motion.events if event.time > 4 * system.load.period]
    # where it sticks on a belt that stands still nothing moves
    kinds = [kind for kind in kinds if kind != "rest"]
    assert kinds[-4:] in (["slip", "stick"] * 2, ["stick", "slip"] * 2)
    for event in motion.events.of(saltus.EventKind.SLIP):
        x, _ = motion.at(event.time)
        assert abs(abs(sin(0.1 * event.time) - x) - 0.2) < 1e-11


def test_the_work_of_friction_is_what_the_energy_lacks() -> None:
    """The force's work less the gain in energy less the damper's is the integral of mu N abs(v - w)
    and the belt's work.
    """
    load = saltus.Load(
        frequency=0.8,
        force=saltus.Harmonic(amplitude=0.7),
        normal=saltus.Harmonic(amplitude=0.4, order=2),
    )
    model = saltus.BeltOscillator(belt_speed=0.15, kinetic=0.3, static=0.4, damping=0.05)
    motion = saltus.simulate(
        saltus.System(model=model, load=load), x=0.4, velocity=-0.3, periods=10, tol=1e-13
    )
    assert {str(event.kind) for event in motion.events} >= {"stick", "slip"}

    def friction(t: Any, x: Any, v: Any) -> Any:
        sliding = v - 0.15
        inside = -0.3 * (1.0 + 0.4 * np.sin(1.6 * t)) * np.sign(sliding)
        return np.where(np.abs(sliding) > 1e-13, inside, x + 0.05 * v - 0.7 * np.sin(0.8 * t))

    gained = 0.5 * (motion.x**2 + motion.velocity**2) - 0.5 * (0.4**2 + 0.3**2)
    work = integral(
        motion, lambda t, x, v: (0.7 * np.sin(0.8 * t) - 0.05 * v + friction(t, x, v)) * v
    )
    lost = -integral(motion, lambda t, x, v: friction(t, x, v) * (v - 0.15))
    assert abs(gained - work) < 1e-11
    assert (
        abs(
            lost
            - integral(
                motion, lambda t, _, v: 0.3 * (1.0 + 0.4 * np.sin(1.6 * t)) * np.abs(v - 0.15)
            )
        )
        < 1e-11
    )


@pytest.mark.parametrize("seed", range(8))
def test_complementarity_on_random_systems(seed: int) -> None:
    """What sticks is held by at most mu_s N, and what slides does so against its friction; at 2000
    instants.
    """
    rng = np.random.default_rng(seed)
    kinetic = rng.uniform(0.05, 0.5)
    model = saltus.BeltOscillator(
        belt_speed=rng.uniform(-0.5, 0.5),
        kinetic=kinetic,
        static=kinetic + rng.choice([0.0, 0.2]),
        damping=rng.uniform(0, 0.2),
    )
    amplitude = rng.uniform(0.3, 1.5)
    load = saltus.Load(frequency=rng.uniform(0.2, 2.0), force=saltus.Harmonic(amplitude=amplitude))
    motion = saltus.simulate(
        saltus.System(model=model, load=load), x=0.2, velocity=0.3, periods=15, tol=1e-13
    )
    t = np.linspace(0.0, motion.time, 2000)
    x, v = motion.at(t)
    slides = motion.to_xarray(t)["sliding_belt"].values
    # what holds it where it sticks
    force = x + model.damping * v - amplitude * np.sin(load.frequency * t)
    assert np.all(np.abs(force[slides == 0]) <= model.static + 1e-12)
    assert np.all(v[slides == 0] == model.belt_speed)
    assert np.all(slides[slides != 0] * (v[slides != 0] - model.belt_speed) > -1e-12)


@dataclass(frozen=True, kw_only=True)
class TwoRubbed(saltus.ContactModel):
    """Two masses in each other, [[2, 1], [1, 2]] q'' = r, each rubbed by ground of its own."""

    mu: float = 0.3
    coordinates: ClassVar[tuple[str, ...]] = ("x", "y")
    channels: ClassVar[tuple[str, ...]] = ("force",)

    @property
    def frictions(self) -> tuple[saltus.Friction, ...]:
        return (
            saltus.Friction(name="first", coordinate="x", kinetic=self.mu),
            saltus.Friction(
                name="second",
                coordinate="y",
                kinetic=0.5 * self.mu,
                static=0.6 * self.mu,
                ground_speed=0.2,
            ),
        )

    def mass_matrix(self, q: Any) -> Any:
        return [[2.0, 1.0], [1.0, 2.0]]

    def force(self, t: Any, q: Any, v: Any, load: Any) -> tuple[Any, Any]:
        return load.force(t) - q[0] + 0.3 * q[1], 0.3 * q[0] - 0.8 * q[1]


def followed_by_dop853(
    model: TwoRubbed, amplitude: float, frequency: float, y0: np.ndarray, end: float
) -> np.ndarray:
    """The same motion by SciPy's DOP853, with a search of its own for what sticks at each event."""
    mass, most, least = (
        np.array([[2.0, 1.0], [1.0, 2.0]]),
        np.array([1.0, 0.6]) * model.mu,
        np.array([1.0, 0.5]) * model.mu,
    )
    ground = np.array([0.0, 0.2])

    def right(t: float, y: np.ndarray) -> np.ndarray:
        return np.array(
            [amplitude * sin(frequency * t) - y[0] + 0.3 * y[1], 0.3 * y[0] - 0.8 * y[1]]
        )

    def accelerations(t: float, y: np.ndarray, slides: np.ndarray) -> np.ndarray:
        free, a = slides != 0, np.zeros(2)
        if free.any():
            a[free] = np.linalg.solve(
                mass[np.ix_(free, free)], (right(t, y) - slides * least)[free]
            )
        return a

    def holding(t: float, y: np.ndarray, slides: np.ndarray) -> np.ndarray:
        return mass @ accelerations(t, y, slides) - right(t, y)

    def decided(t: float, y: np.ndarray, slides: np.ndarray) -> np.ndarray:
        still = y[2:] == ground
        choices = [np.array([i, j]) for i in (0, 1, -1) for j in (0, 1, -1)]
        later = t + 1e-7
        for new in choices:
            if np.any(~still & (new != slides)):
                continue
            # decided by what is a little later
            ahead = y + 1e-7 * np.concatenate([y[2:], accelerations(t, y, new)])
            a, force = accelerations(later, ahead, new), holding(later, ahead, new)
            if all(
                (abs(force[i]) <= most[i] if new[i] == 0 else new[i] * a[i] > 0)
                for i in range(2)
                if still[i]
            ):
                return new
        raise AssertionError("nothing is consistent")

    def guard(i: int, begin: float, slides: np.ndarray) -> Any:
        def sliding(s: float, z: np.ndarray) -> float:
            return float(slides[i] * (z[2 + i] - ground[i])) + (1e-13 if s <= begin + 1e-9 else 0.0)

        chosen: Any = sliding if slides[i] else lambda s, z: most[i] - abs(holding(s, z, slides)[i])
        chosen.terminal, chosen.direction = True, -1
        return chosen

    def flow(slides: np.ndarray) -> Any:
        return lambda s, z: np.concatenate([z[2:], accelerations(s, z, slides)])

    t, y, slides = 0.0, y0.copy(), np.sign(np.round(y0[2:] - ground, 15)).astype(int)
    y[2:][slides == 0] = ground[slides == 0]
    slides = decided(t, y, slides)
    while t < end:
        guards = [guard(i, t, slides.copy()) for i in range(2)]
        field = flow(slides.copy())
        run = solve_ivp(field, (t, end), y, method="DOP853", rtol=1e-13, atol=1e-14, events=guards)
        t, y = run.t[-1], run.y[:, -1].copy()
        for i in range(2):
            if len(run.t_events[i]) and slides[i]:
                y[2 + i] = ground[i]
        if t < end:
            slides = decided(t, y, slides)
    return y


@pytest.mark.parametrize("seed", range(5))
def test_two_frictions_move_as_an_independent_integration_says(seed: int) -> None:
    """Coupled by the mass matrix: what one does decides whether the other one sticks."""
    rng = np.random.default_rng(100 + seed)
    amplitude, frequency, start = (
        rng.uniform(0.8, 1.6),
        rng.uniform(0.4, 1.2),
        rng.uniform(-0.5, 0.5, 4),
    )
    model, end = TwoRubbed(), 25.0
    system = saltus.System(
        model=model,
        load=saltus.Load(frequency=frequency, force=saltus.Harmonic(amplitude=amplitude)),
    )
    motion = saltus.simulate(
        system, x=start[0], y=start[1], velocity=(start[2], start[3]), duration=end, tol=1e-14
    )
    assert len(motion.events) >= 5
    reference = followed_by_dop853(model, amplitude, frequency, start, end)
    assert np.abs(np.append(motion.position, motion.velocity) - reference).max() < 1e-9


@pytest.mark.parametrize(
    ("system", "start"),
    [
        (forced(0.6, 1.0, static=0.25), (0.1, 0.2)),
        (forced(0.15, 1.0, damping=0.1, static=0.25), (0.1, 0.2)),
        (forced(0.5, 0.6, belt_speed=0.3, kinetic=0.2, static=0.35), (0.4, -0.2)),
    ],
)
def test_sensitivities_are_the_differences_of_motions(
    system: saltus.System, start: tuple[float, float]
) -> None:
    """To the state and to coefficients, load and belt, across stick, slip and reversal, to what
    central differences show.
    """
    paths = (
        "model.kinetic",
        "model.static",
        "model.belt_speed",
        "load.frequency",
        "load.force.amplitude",
    )
    duration = 2.3 * float(system.load.period)
    given = saltus.sensitivities(
        system, x=start[0], velocity=start[1], duration=duration, parameters=paths, tol=1e-14
    )
    assert len(given.motion.events) >= 3

    def end(change: dict[str, float], x: float, v: float) -> np.ndarray:
        values = {path: float(system.get(path)) + step for path, step in change.items()}
        moved = saltus.simulate(system.with_(values), x=x, velocity=v, duration=duration, tol=1e-14)
        return np.array([moved.x, moved.velocity])

    step = 1e-5
    for j, shift in enumerate(((step, 0.0), (0.0, step))):
        one, other = (end({}, start[0] + s * shift[0], start[1] + s * shift[1]) for s in (1, -1))
        assert np.abs((one - other) / (2 * step) - given.state[:, j]).max() < 1e-7
    for j, path in enumerate(paths):
        one, other = (end({path: s * step}, *start) for s in (1, -1))
        assert np.abs((one - other) / (2 * step) - given.parameters[:, j]).max() < 1e-6 * max(
            1.0, np.abs(given.parameters).max()
        )


def test_what_has_stuck_has_forgotten_its_speed() -> None:
    """A stick drops the rank of the derivatives to the state."""
    given = saltus.sensitivities(forced(0.15, 1.0, damping=0.1), x=0.1, velocity=0.2, periods=2)
    assert "stick" in {str(event.kind) for event in given.motion.events}
    assert abs(np.linalg.det(given.state)) < 1e-14


def test_ensembles_move_as_single_motions() -> None:
    """With parameters and starts of their own; they are moved by the scalar kernel, so they are the
    same numbers.
    """
    system, mu = forced(0.3, 1.0, belt_speed=0.1), np.linspace(0.1, 0.5, 6)
    many = saltus.simulate_many(
        system,
        x=0.3,
        velocity=np.linspace(-1, 1, 6),
        parameters={"model.static": mu + 0.1},
        periods=7,
    )
    for i in range(6):
        one = saltus.simulate(
            system.with_({"model.static": mu[i] + 0.1}),
            x=0.3,
            velocity=float(np.linspace(-1, 1, 6)[i]),
            periods=7,
        )
        assert abs(float(many.x[i]) - one.x) < 1e-13
        assert abs(float(many.velocity[i]) - one.velocity) < 1e-13


def test_rest_within_the_friction_lasts() -> None:
    """A belt that stands still takes all speed of a free oscillator, in decrements of 2 mu N an
    excursion.
    """
    motion = saltus.simulate(
        belt(belt_speed=0.0, kinetic=0.1, static=0.1), x=1.05, velocity=0.0, duration=50.0
    )
    turning = [
        motion.at(event.time)[0]
        for event in motion.events
        if str(event.kind) in ("reversal", "stick")
    ]
    assert np.abs(np.abs(turning) - [0.85, 0.65, 0.45, 0.25, 0.05]).max() < 1e-11
    assert motion.stop is saltus.Stop.REST
    assert abs(motion.rest_time - 5 * pi) < 1e-9


def test_a_normal_force_that_vanishes_ends_the_motion_by_its_name() -> None:
    """Beyond it the mass would lift off, which the friction says nothing of."""
    load = saltus.Load(frequency=1.0, normal=saltus.Harmonic(amplitude=2.0))
    motion = saltus.simulate(
        saltus.System(model=saltus.BeltOscillator(), load=load), x=0.0, velocity=0.1, periods=2
    )
    assert motion.limit == "normal force of belt"
    assert abs(motion.time - (pi + np.arcsin(0.5))) < 1e-12


@dataclass(frozen=True, kw_only=True)
class Rubbed(saltus.ContactModel):
    """x'' = -x with whatever frictions it is given."""

    given: ClassVar[tuple[saltus.Friction, ...]] = ()
    coordinates: ClassVar[tuple[str, ...]] = ("x",)

    @property
    def frictions(self) -> tuple[saltus.Friction, ...]:
        return type(self).given

    def force(self, t: Any, x: Any, v: Any, load: Any) -> Any:
        return -x


@pytest.mark.parametrize(
    ("frictions", "sentence"),
    [
        ((saltus.Friction(name="a", coordinate="y", kinetic=0.1),), "none of x"),
        (
            tuple(saltus.Friction(name=n, coordinate="x", kinetic=0.1) for n in "ab"),
            "a coordinate can have one",
        ),
        (
            tuple(saltus.Friction(name="a", coordinate="x", kinetic=0.1) for _ in range(2)),
            "names of their own",
        ),
    ],
)
def test_frictions_without_meaning_are_refused(
    frictions: tuple[saltus.Friction, ...], sentence: str
) -> None:
    """With the friction's name."""
    model = type("Given", (Rubbed,), {"given": frictions})()
    with pytest.raises(saltus.ParameterError, match=sentence):
        saltus.System(model=model)


@pytest.mark.parametrize("beside", [-1e-11, -3e-13, -3e-14, 0.0, 3e-14, 3e-13, 1e-11])
def test_a_speed_that_is_reached_where_friction_can_just_bear_the_force_is_kept(beside):
    """x'' = -x + mu from x = mu - R, v = 0 with R^2 = (2 mu)^2 + w^2 has the speed w at x = -mu,
    where it needs all friction to keep it, and less from then on: it sticks up to x = mu. Rounding
    made it neither stick nor slide."""
    mu, speed = 0.4, 0.5
    reach = hypot(2 * mu, speed)
    motion = saltus.simulate(
        belt(kinetic=mu, static=mu, belt_speed=speed),
        x=mu - reach + beside,
        velocity=0.0,
        duration=4.0,
        tol=1e-14,
    )
    (slip,) = motion.events.of(saltus.EventKind.SLIP)
    assert slip.time == pytest.approx(asin(speed / reach) + 2 * mu / speed, abs=1e-9)
