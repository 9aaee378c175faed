"""Motions under loads that jump and repeat themselves: against DOP853 begun anew at each corner, and
against the same load written in other ways.
"""

import itertools
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import expm

from saltus import (
    Contact,
    ContactModel,
    Harmonic,
    Load,
    Model,
    NewtonImpact,
    Pulse,
    Record,
    Sawtooth,
    Square,
    Step,
    System,
    Table,
    Triangle,
    VelocityReduction,
    WallOscillator,
    frequency_sweep,
    sensitivities,
    simulate,
    simulate_many,
)
from saltus.errors import ParameterError

W = 1.3
T = 2 * np.pi / W
# Signals, with the shares of the period at which they have corners and a formula by the share.
LOADS = {
    "square": (Square(2.0, mean=0.3, phase=0.3, duty=0.25), (0.0, 0.25),
               lambda s: 2.3 if s < 0.25 else -1.7),
    "triangle": (Triangle(2.0, phase=-2.0), (0.25, 0.75),
                 lambda s: 8 * s if s < 0.25 else 2 - 8 * (s - 0.25) if s < 0.75 else 8 * s - 8),
    "sawtooth": (Sawtooth(1.0, mean=0.2, phase=1.0), (0.0,), lambda s: 2 * s - 0.8),
    "table": (Table([0.0, 0.5, 0.5, 2.0, 4.0], [0.0, 1.0, -1.0, 2.0, 0.0]), (0.0, 0.125, 0.5),
              lambda s: 8 * s if s < 0.125 else -1 + 8 * (s - 0.125) if s < 0.5 else 4 - 4 * s),
    "steps": (Table([1.0, 2.0, 3.0, 5.0], [0.5, 1.0, -1.0, 0.5], interpolation="previous"),
              (0.25, 0.5, 0.75), lambda s: 0.5 if 0.25 <= s < 0.5 else 1.0 if 0.5 <= s < 0.75 else -1.0),
}  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class Duffing(Model):
    """x'' = F - 0.2 x' - x - x^3."""

    coordinates: ClassVar = ("x",)
    channels: ClassVar = ("force",)

    def acceleration(self, t, x, v, side, load):
        return load.force(t) - 0.2 * v - x - x**3


@dataclass(frozen=True, kw_only=True)
class Bounded(ContactModel):
    """The oscillator at a wall as a model with contacts."""

    coordinates: ClassVar = ("x",)
    channels: ClassVar = ("force",)
    contacts = (Contact(name="wall", coordinate="x", position=0.3, sign=-1),)

    def force(self, t, q, velocity, load):
        return load.force(t) - 0.1 * velocity - q


def reference(name, end, state, cubic=0.0, damping=0.1, wall=np.inf, e=0.8):
    """The state at `end` by DOP853, which begins anew at each corner and each impact."""
    signal, shares, formula = LOADS[name] if isinstance(name, str) else name
    ahead = float(getattr(signal, "phase", 0.0)) / (2 * np.pi)
    corners = sorted((k + s - ahead) * T for k in range(-3, 40) for s in shares)
    ends = [0.0, *(t for t in corners if 0.0 < t < end), end]
    y = np.array(state)
    for a, b in itertools.pairwise(ends):
        t = a
        while t < b:

            def rate(s, y, a=a, b=b):
                # the share as it is within this piece
                inside = min(max(s, a + 1e-13 * T), b - 1e-13 * T)
                force = formula((inside / T + ahead) % 1.0)
                return [y[1], force - damping * y[1] - y[0] - cubic * y[0] ** 3]

            def gap(s, y):
                return wall - y[0]

            gap.terminal, gap.direction = True, -1
            found = solve_ivp(
                rate,
                (t, b),
                y,
                "DOP853",
                rtol=1e-13,
                atol=1e-14,
                max_step=0.01 * T,  # short hops and touches are within a step
                events=gap if wall < np.inf else None,
            )
            t, y = found.t[-1], found.y[:, -1]
            if found.status == 1:
                y = np.array([wall, -e * y[1]])
    return y


@pytest.mark.parametrize("name", LOADS)
def test_a_smooth_motion_is_that_of_dop853(name):
    system = System(model=Duffing(), load=Load(frequency=W, force=LOADS[name][0]))
    motion = simulate(system, x=0.1, velocity=0.2, duration=20.0)
    expected = reference(name, 20.0, [0.1, 0.2], cubic=1.0, damping=0.2)
    assert (motion.x, motion.velocity) == pytest.approx(expected, abs=1e-11)


@pytest.mark.parametrize("name", ["square", "triangle", "sawtooth"])
def test_impacts_are_those_of_dop853_in_both_kernels_and_in_lanes(name):
    load = Load(frequency=W, force=LOADS[name][0])
    expected = reference(name, 40.0, [-0.5, 0.1], wall=0.3)
    one = System(
        model=WallOscillator(wall=0.3, damping=0.1), load=load, impact=VelocityReduction(0.8)
    )
    for system in (one, System(model=Bounded(), load=load, impact=NewtonImpact(0.8))):
        motion = simulate(system, x=-0.5, velocity=0.1, duration=40.0)
        assert (motion.x, motion.velocity) == pytest.approx(expected, abs=1e-11)
        amplitude = load.channels["force"].amplitude
        columns = {"load.force.amplitude": amplitude * np.array([1.0, 0.9, 1.1, 0.4])}
        many = simulate_many(system, x=-0.5, velocity=0.1, duration=40.0, parameters=columns)
        assert (many.x[0], many.velocity[0]) == pytest.approx(expected, abs=1e-11)


def test_a_shift_by_whole_periods_and_other_starts_change_nothing():
    """A motion is that of another start later on, alone and in lanes that begin at its phase."""
    system = System(model=Duffing(), load=Load(frequency=W, force=LOADS["square"][0]))
    whole = simulate(system, x=0.1, velocity=0.2, duration=17.0)
    half = simulate(system, x=0.1, velocity=0.2, duration=5.9)
    later = {"x": half.x, "velocity": half.velocity, "duration": 17.0 - 5.9}
    for time in (5.9, 5.9 + 7 * T):
        rest = simulate(system, **later, time=time)
        many = simulate_many(system, **later, time=time)
        for end in (rest, many):
            found = float(end.x), float(end.velocity)
            assert found == pytest.approx((whole.x, whole.velocity), abs=1e-11)


def test_one_load_in_several_ways():
    """A square wave is a table, a sum of two others, and a record over the time of the motion."""
    times = np.repeat(np.arange(9) * T / 2, 2)[1:-1]
    values = np.repeat([(-1.0) ** i for i in range(8)], 2)
    ways = [
        Load(frequency=W, force=Square(2.0)),
        Load(frequency=W, force=Table([0.0, 0.5, 0.5, 1.0], [2.0, 2.0, -2.0, -2.0])),
        Load(frequency=W, force=Table([0.0, 3.0, 6.0], [2.0, -2.0, 2.0], interpolation="previous")),
        Load(frequency=W, force=Square(1.5) + Square(0.5) + Harmonic(0.0)),
        Load(force=Record(times, 2.0 * values)),
        Load(force=[2.0, *(Step(amplitude=-4.0 * (-1) ** i, start=(i + 1) * T / 2) for i in range(8))]),
        Load(force=[-2.0, *(Pulse(amplitude=4.0, start=i * T, duration=T / 2) for i in range(4))]),
    ]  # fmt: skip
    ends = []
    for load in ways:
        motion = simulate(System(model=Duffing(), load=load), x=0.1, velocity=0.2, duration=3.9 * T)
        ends.append((motion.x, motion.velocity))
    assert np.ptp(ends, axis=0).max() < 1e-12


def test_a_load_of_no_size_changes_nothing():
    states = []
    for force in (0.0, Square(0.0), Table([0.0, 0.5, 0.5, 1.0], [1.0, 1.0, 0.0, 1.0], scale=0.0)):
        system = System(model=Duffing(), load=Load(frequency=W, force=force))
        motion = simulate(system, x=0.1, velocity=0.2, duration=20.0)
        states.append((motion.x, motion.velocity))
    assert np.ptp(states, axis=0).max() < 1e-12


def test_a_step_moves_an_oscillator_about_another_place():
    """x = A (1 - cos w s) / w^2 after the step, from rest."""
    system = System(
        model=WallOscillator(stiffness=4.0, wall=10.0), load=Load(force=Step(amplitude=2.0, start=1.0))
    )  # fmt: skip
    motion = simulate(system, x=0.0, velocity=0.0, duration=7.3)
    assert motion.x == pytest.approx(0.5 * (1 - np.cos(2 * 6.3)), abs=1e-13)


def test_the_ground_moves_as_its_acceleration_says():
    """A linear oscillator on a shaken base is one under minus the base's acceleration; and the
    displacement is twice differentiated that acceleration, with the mean 0."""
    shaken = Load(frequency=W, ground=Square(0.7, quantity="acceleration"))
    pushed = Load(frequency=W, force=Square(-0.7))
    ends = [
        simulate(System(model=WallOscillator(wall=50.0, damping=0.1), load=load), x=0.2, duration=9.0)
        for load in (shaken, pushed)
    ]  # fmt: skip
    assert ends[0].x == pytest.approx(ends[1].x, abs=1e-13)
    times = np.arange(4000) / 4000 * T
    ground = shaken.ground
    assert np.mean(ground(times)) == pytest.approx(0.0, abs=1e-7)
    # parabolas through the corners, of which the first rises from 0
    expected = np.where(
        times < T / 2, 0.35 * times * (times - T / 2), -0.35 * (times - T / 2) * (times - T)
    )
    assert ground(times) == pytest.approx(expected, abs=1e-13)


def test_derivatives_are_differences():
    system = System(
        model=WallOscillator(wall=0.3, damping=0.1),
        load=Load(frequency=W, force=LOADS["square"][0]),
        impact=VelocityReduction(0.8),
    )
    paths = ["load.force.amplitude", "model.damping"]
    tangent = sensitivities(system, parameters=paths, x=-0.5, velocity=0.1, duration=9.0)
    for path in paths:
        h = 1e-6
        ends = [
            simulate(system.with_({path: system.get(path) + d}), x=-0.5, velocity=0.1, duration=9.0)
            for d in (h, -h)
        ]
        slope = [(ends[0].x - ends[1].x) / (2 * h), (ends[0].velocity - ends[1].velocity) / (2 * h)]
        found = tangent.parameters[:, paths.index(path)]
        assert found == pytest.approx(slope, abs=1e-7)


@pytest.mark.parametrize(
    ("make", "sentence"),
    [
        (lambda: Load(force=Square(1.0)), "load.frequency must be given"),
        (lambda: Load(frequency=1.0, force=[Square(1.0), Step(amplitude=1.0)]), "happens once"),
        (lambda: Square(1.0, quantity="displacement"), "jumps at its corners"),
        (lambda: Triangle(1.0, quantity="displacement"), "velocity of a ground .* jumps"),
        (lambda: Square(1.0, mean=0.1, quantity="acceleration"), "drifts away"),
        (lambda: Square(1.0, duty=0.3, quantity="acceleration"), "a Table whose values have the mean 0"),
        (lambda: Square(1.0, duty=1.5), "duty must"),
        (lambda: Table([0.0, 1.0, 0.5], [0.0, 1.0, 0.0]), "must not decrease"),
        (lambda: Table([0.0, 0.0, 0.0, 1.0], [0.0, 1.0, 2.0, 0.0]), "too near"),
        (lambda: Table([0.0, 1.0], [0.0, 1.0], periodic=False), "is a Record"),
        (lambda: Table([0.0, 0.3, 0.3, 1.0], [0.0, 1.0, 2.0, 0.0], interpolation="cubic"), "spline"),
        (lambda: Load(frequency=1.0, ground=Square(1.0)), "ground takes"),
    ],
)  # fmt: skip
def test_what_cannot_be_is_refused(make, sentence):
    with pytest.raises(ParameterError, match=sentence):
        make()


@pytest.mark.parametrize("name", LOADS)
def test_a_system_comes_back_from_toml(name):
    system = System(
        model=WallOscillator(wall=0.3), load=Load(frequency=W, force=[LOADS[name][0], Harmonic(0.1)])
    )  # fmt: skip
    assert System.from_toml(system.to_toml()) == system


@pytest.mark.parametrize("name", ["square", "triangle", "sawtooth"])
@pytest.mark.parametrize("rests", [False, True])
def test_derivatives_to_the_frequency_that_moves_the_corners(name, rests):
    """Corners move with the frequency: differences of fourth order, also through rests that the
    jump ends."""
    force = [LOADS[name][0], 1.0] if rests else LOADS[name][0]
    wall, e = (0.0, 0.3) if rests else (0.3, 0.8)

    @dataclass(frozen=True, kw_only=True)
    class At(Bounded):
        contacts = (Contact(name="wall", coordinate="x", position=wall, sign=-1),)

    load = Load(frequency=W, force=force)
    one = WallOscillator(wall=wall, damping=0.1)
    start = {"x": -0.5, "velocity": 0.1, "duration": 17.3}
    for system in (
        System(model=one, load=load, impact=VelocityReduction(e)),
        System(model=At(), load=load, impact=NewtonImpact(e)),
    ):
        tangent = sensitivities(system, parameters=["load.frequency"], **start)
        h = 1e-6
        ends = []
        for step in (h, -h, 2 * h, -2 * h):
            motion = simulate(system.with_({"load.frequency": W + step}), **start)
            ends.append(np.array([motion.x, motion.velocity]))
        slope = (8 * (ends[0] - ends[1]) - (ends[2] - ends[3])) / (12 * h)
        assert tangent.undefined is None
        assert tangent.parameters[:, 0] == pytest.approx(slope, abs=2e-7)


def test_ensembles_have_no_derivative_to_a_frequency_that_moves_jumps():
    system = System(model=Duffing(), load=Load(frequency=W, force=Square(1.0)))
    with pytest.raises(ParameterError, match=r"take saltus\.sensitivities"):
        simulate_many(system, x=[0.1], periods=2, sensitivities=["load.frequency"])


@pytest.mark.parametrize("name", LOADS)
def test_a_load_backward_and_half_a_period_later(name):
    signal = LOADS[name][0]
    times = np.linspace(0.013, 3.0 * T, 97)
    forward = Load(frequency=W, force=signal)
    for changed, at in ((signal.backward(), -times), (signal.half_a_period_later(), times + T / 2)):
        other = Load(frequency=W, force=changed)
        assert other.force(times) == pytest.approx(forward.force(at), abs=1e-12)


def test_meissners_equation_has_the_multipliers_of_its_two_halves():
    """x'' + 0.1 x' + (1.5 +- 0.8) x = 0 in each half of a period: a stiffness that is switched."""

    @dataclass(frozen=True, kw_only=True)
    class Meissner(Model):
        coordinates: ClassVar = ("x",)
        channels: ClassVar = ("stiffness",)

        def acceleration(self, t, x, v, side, load):
            return -0.1 * v - load.stiffness(t) * x

    system = System(model=Meissner(), load=Load(frequency=W, stiffness=Square(0.8, mean=1.5)))
    tangent = sensitivities(system, x=0.1, velocity=0.2, periods=1)
    halves = [expm(0.5 * T * np.array([[0.0, 1.0], [-k, -0.1]])) for k in (2.3, 0.7)]
    assert tangent.state == pytest.approx(halves[1] @ halves[0], abs=1e-12)


@pytest.mark.parametrize("periods", [3, 2.5])
def test_derivatives_at_the_end_of_a_period_that_is_a_corner(periods):
    """The end moves with the corner, so that the rates before the jump count."""
    system = System(
        model=WallOscillator(wall=0.3, damping=0.1),
        load=Load(frequency=W, force=Square(0.8)),
        impact=VelocityReduction(0.8),
    )
    start = {"x": -0.5, "velocity": 0.1, "periods": periods}
    tangent = sensitivities(system, parameters=["load.frequency"], **start)
    h = 1e-6
    ends = []
    for step in (h, -h, 2 * h, -2 * h):
        motion = simulate(system.with_({"load.frequency": W + step}), **start)
        ends.append(np.array([motion.x, motion.velocity]))
    slope = (8 * (ends[0] - ends[1]) - (ends[2] - ends[3])) / (12 * h)
    assert tangent.parameters[:, 0] == pytest.approx(slope, abs=2e-7)


def random_load(random):
    """A signal, the shares of its corners and its formula."""
    size, mean = random.uniform(0.3, 2.0), random.uniform(-0.3, 0.3)
    phase, duty = random.uniform(-6.0, 6.0), random.uniform(0.1, 0.9)
    kind = random.integers(3)
    if kind == 0:
        square = Square(size, mean, phase, duty=duty)
        return square, (0.0, duty), lambda s: mean + (size if s < duty else -size)
    if kind == 1:
        saw = Sawtooth(size, mean, phase)
        return saw, (0.0,), lambda s: mean + size * (2 * s - 1)
    times = np.sort(np.append(random.uniform(0.0, 1.0, 3), [0.0, 1.0]))
    values = random.uniform(-1.5, 1.5, 5)
    steps = Table(times, values, interpolation="previous")
    return steps, times[:-1], lambda s: values[np.searchsorted(times, s, side="right") - 1]


@pytest.mark.parametrize(
    "seeds", [range(6), pytest.param(range(6, 150), marks=pytest.mark.thorough)]
)
def test_random_loads_are_those_of_dop853(seeds):
    for seed in seeds:
        random = np.random.default_rng(seed)
        entry = random_load(random)
        wall, e, end = random.uniform(0.0, 0.6), random.uniform(0.4, 0.9), random.uniform(5.0, 25.0)
        system = System(
            model=WallOscillator(wall=wall, damping=0.1),
            load=Load(frequency=W, force=entry[0]),
            impact=VelocityReduction(e),
        )
        motion = simulate(system, x=wall - 0.5, velocity=0.1, duration=end)
        slowest = np.abs(motion.impacts.velocity_before).min(initial=1.0)
        if {str(event.kind) for event in motion.events} - {"impact"} or slowest < 0.1:
            continue  # DOP853 follows no accumulation, and steps over touches
        expected = reference(entry, end, [wall - 0.5, 0.1], wall=wall, e=e)
        assert (motion.x, motion.velocity) == pytest.approx(expected, abs=1e-9), seed


def test_nothing_is_computed_along_a_setting():
    model = WallOscillator(stiffness=1.0, damping=0.1, wall=1.0)
    load = Load(frequency=1.1, force=Square(0.5))
    system = System(model=model, load=load, impact=VelocityReduction(0.8))
    with pytest.raises(ParameterError, match=r"is a setting, along which nothing .* with_"):
        frequency_sweep(system, [0.3, 0.5], path="load.force.duty", x=0.0)
