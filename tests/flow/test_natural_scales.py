"""Decisions of the kernels that do not depend on how large numbers are: balls on floors far from 0,
bodies with large loads, motions that rest on a surface until their load begins.
"""

import contextlib
import math
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest

import saltus
from saltus import Contact, Friction, NewtonImpact, Surface
from saltus.errors import MotionError
from saltus.flow.motion.kernel_state import SLOW_LOAD, natural_time, natural_times
from saltus.flow.programs.compiled import program


@dataclass(frozen=True, kw_only=True)
class Ball(saltus.ContactModel):
    """A ball above a floor, with a friction along its coordinate."""

    floor: float = 0.0
    gravity: float = 1.0
    rub: float = 0.0

    coordinates = ("y",)

    @property
    def contacts(self) -> tuple[Contact, ...]:
        return (Contact(name="floor", coordinate="y", position=self.floor),)

    @property
    def frictions(self) -> tuple[Friction, ...]:
        return (Friction(name="rub", coordinate="y", kinetic=self.rub),)

    def force(self, t: Any, y: Any, velocity: Any, load: Any) -> Any:
        return -self.gravity

    def normal_forces(self, t: Any, y: Any, velocity: Any, load: Any) -> Any:
        return (1.0,)


@pytest.mark.parametrize("e", [0.5, 0.8])
@pytest.mark.parametrize("gravity", [1e-9, 9.81, 9810.0, 1e6])
@pytest.mark.parametrize("floor", [0.0, 1.0, -1000.0, 1e6])
def test_a_ball_comes_to_rest_on_a_floor_anywhere(floor: float, gravity: float, e: float) -> None:
    """It rests after sqrt(2 h / g) (1 + 2 e / (1 - e))."""
    height = 1.0
    model = Ball(floor=floor, gravity=gravity)
    fall = math.sqrt(2.0 * height / gravity)
    rest = fall * (1.0 + 2.0 * e / (1.0 - e))
    ball = saltus.System(model=model, impact=NewtonImpact(e))
    motion = saltus.simulate(ball, y=floor + height, duration=1.5 * rest)
    assert motion.stop is saltus.Stop.REST
    assert motion.position == floor
    assert motion.rest_time == pytest.approx(rest, rel=1e-9 + 1e-14 * abs(floor))
    many = saltus.simulate_many(ball, y=floor + height, duration=1.5 * rest)
    assert float(many.y) == floor


def test_friction_shortens_the_bounces_of_a_ball_in_millimetres() -> None:
    """Up with g + mu, down with g - mu: each bounce has e sqrt((g - mu) / (g + mu)) of the
    speed.
    """
    gravity, mu, e, floor = 9810.0, 1962.0, 0.6, 1000.0
    ball = saltus.System(model=Ball(floor=floor, gravity=gravity, rub=mu), impact=NewtonImpact(e))
    motion = saltus.simulate(ball, y=floor + 500.0, duration=3.0)
    down, up = gravity - mu, gravity + mu
    speed = math.sqrt(2.0 * down * 500.0)
    time = speed / down
    ratio = e * math.sqrt(down / up)
    first = e * speed * (1.0 / up + 1.0 / math.sqrt(up * down))
    assert motion.impacts.time[:3] == pytest.approx(
        [time, time + first, time + first * (1.0 + ratio)], rel=1e-12
    )
    assert motion.rest_time == pytest.approx(time + first / (1.0 - ratio), rel=1e-9)


@dataclass(frozen=True, kw_only=True)
class Block(saltus.ContactModel):
    """A block that slides and hops on a floor with friction."""

    gravity: float = 1.0

    coordinates = ("x", "y")
    channels = ("fx", "fy")
    contacts = (Contact(name="floor", coordinate="y"),)
    frictions = (Friction(name="rub", coordinate="x", contact="floor", kinetic=0.25),)

    def force(self, t: Any, q: Any, velocity: Any, load: Any) -> Any:
        return load.fx(t), load.fy(t) - self.gravity


@pytest.mark.parametrize("length", [1e-9, 1e4, 1e6])
def test_a_hopping_block_is_followed_whatever_its_loads_are(length: float) -> None:
    for seed in range(12):
        rng = np.random.default_rng(seed)
        frequency, across, up = rng.uniform([0.5, 0.2, 0.2], [2.0, 2.0, 1.5])
        e, height = rng.uniform([0.0, 0.1], [0.8, 2.0])
        ends = []
        for unit in (1.0, length):
            load = saltus.Load(
                frequency=frequency,
                fx=saltus.Harmonic(amplitude=across * unit),
                fy=saltus.Harmonic(amplitude=up * unit, phase=1.0),
            )
            system = saltus.System(
                model=Block(gravity=unit), load=load, impact=NewtonImpact(float(e))
            )
            start = {"x": 0.0, "y": height * unit, "velocity": (0.2 * unit, 0.0)}
            motion = saltus.simulate(system, **start, periods=4)
            ends.append((len(motion.events), *np.divide(motion.position, unit)))
        assert ends[0][0] == ends[1][0]
        assert ends[1] == pytest.approx(ends[0], abs=1e-7)


@dataclass(frozen=True, kw_only=True)
class Bilinear(saltus.ContactModel):
    """A spring with other stiffnesses above and below 0."""

    above: float = 0.0
    below: float = 0.0

    coordinates = ("x",)
    channels = ("force",)
    surfaces = (Surface(name="middle", coordinate="x"),)

    def force(self, t: Any, x: Any, velocity: Any, load: Any, sides: Any) -> Any:
        s = sides.middle
        return load.force(t) - 0.5 * ((self.above + self.below) + (self.above - self.below) * s) * x


DELAYED = {
    "record": saltus.Record([0.0, 0.1, 0.2, 10.0], [0.0, 0.0, 1.0, 1.0]),
    "ramp": saltus.Ramp(amplitude=1.0, start=0.1, duration=0.1),
}


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("name", DELAYED)
def test_a_motion_leaves_a_surface_to_either_side_when_its_load_begins(
    name: str, sign: float
) -> None:
    """Without a stiffness x is the load's second integral: 0.1^2 / 6 at 0.2, then a parabola."""
    signal: Any = DELAYED[name]
    field = "amplitude" if name == "ramp" else "value"
    values = {"amplitude": sign} if name == "ramp" else {"value": sign * signal.value}
    load = saltus.Load(force=type(signal)(**{**vars_of(signal), field: values[field]}))
    motion = saltus.simulate(saltus.System(model=Bilinear(), load=load), x=0.0, duration=1.0)
    exact = 0.01 / 6.0 + 0.05 * 0.8 + 0.5 * 0.64
    assert motion.position == pytest.approx(sign * exact, abs=1e-14)
    assert motion.sides == {"middle": int(sign)}
    # with the stiffness of that side, the same oscillator without a surface
    model = Bilinear(above=4.0, below=1.0)
    motion = saltus.simulate(saltus.System(model=model, load=load), x=0.0, duration=1.2)
    k = 4.0 if sign > 0.0 else 1.0
    plain = saltus.System(model=saltus.WallOscillator(stiffness=k, wall=1e9), load=load)
    assert motion.position == pytest.approx(
        saltus.simulate(plain, x=0.0, duration=1.2).position, abs=1e-13
    )


def vars_of(signal: Any) -> dict[str, Any]:
    """The numbers of a signal."""
    names = ("time", "value") if isinstance(signal, saltus.Record) else ("start", "duration")
    return {name: getattr(signal, name) for name in names}


@pytest.mark.parametrize("scale", [1e-14, 1e-12, 1e-9])
def test_a_pressed_mass_is_let_go_however_small_the_forces_are(scale: float) -> None:
    """The load 1 - 1.2 sin(t) presses until asin(1 / 1.2)."""
    load = saltus.Load(
        frequency=1.0, force=saltus.Harmonic(amplitude=-1.2 * scale, mean=1.0 * scale)
    )
    system = saltus.System(
        model=saltus.TwoStops(left=-1e9, right=0.0, stiffness=0.0),
        load=load,
        impact=NewtonImpact(0.5),
    )
    motion = saltus.simulate(system, x=0.0, duration=2.0)
    released = motion.events.of(saltus.flow.EventKind.RELEASE)
    assert [event.time for event in released] == pytest.approx([math.asin(1.0 / 1.2)], abs=1e-12)


def test_no_motion_is_beyond_its_floor() -> None:
    """A bounce below the rounding of the floor's position cannot be followed."""
    ball = saltus.System(model=Ball(floor=1e15, gravity=1.0), impact=NewtonImpact(0.9))
    with contextlib.suppress(MotionError):
        motion = saltus.simulate(ball, y=1e15 + 1.0, duration=60.0)
        assert motion.position >= 1e15


@pytest.mark.parametrize("frequency", [1e-3, 1e-6])
@pytest.mark.parametrize("amplitude", [0.0, 1e-12])
@pytest.mark.parametrize(
    "model", [saltus.WallOscillator(wall=0.0), saltus.TwoStops(left=-50.0, right=0.0, damping=0.0)]
)
def test_a_load_slower_than_the_motion_hides_no_impacts(
    model: Any, amplitude: float, frequency: float
) -> None:
    """x'' = 1/2 - x beside a wall at 0: after an impact with the speed v the next one follows in 2
    arctan(2 v), with any loss; without loss so many of these fit into the motion.
    """
    force = saltus.Harmonic(amplitude=amplitude, mean=0.5)
    load = saltus.Load(frequency=frequency, force=force)
    lossless = saltus.System(model=model, load=load, impact=NewtonImpact(1.0))
    start: dict[str, Any] = {"x": 0.0, "velocity": -1.0, "duration": 60.0}
    count = int(60.0 / (2.0 * math.atan(2.0)))
    assert len(saltus.simulate(lossless, **start).impacts) == count
    assert int(saltus.simulate_many(lossless, **start).impact_count) == count
    lossy = saltus.System(model=model, load=load, impact=NewtonImpact(0.8))
    rest = math.fsum(2.0 * math.atan(2.0 * 0.8**n) for n in range(200))
    assert saltus.simulate(lossy, **start).rest_time == pytest.approx(rest, abs=1e-9)


@pytest.mark.parametrize("frequency", [1e-8, 1e-12, 1e-20, 1e-60, 1e-99])
@pytest.mark.parametrize("many", [False, True])
def test_a_load_slower_than_the_motion_without_end_acts_as_one_that_stands_still(frequency, many):
    """Two layers, one of which stays pressed; the constant load is the slow one's value at 0. The
    derivatives of the motion in the load's time were scales in which the reaction was lost.
    """
    model = saltus.TwoLayer(beta0=1.31, damping=0.146, mass_ratio=0.204)
    impact = saltus.NewtonImpact(e=0.0226, transfer=0.329)
    slow = saltus.Load(
        frequency=frequency, vertical=-0.358, horizontal=saltus.Harmonic(0.564, phase=1.71)
    )
    still = saltus.Load(vertical=-0.358, horizontal=0.564 * math.sin(1.71))
    ends = []
    for load in (slow, still):
        system = saltus.System(model=model, load=load, impact=impact)
        start = {"theta": (0.2, 0.0), "velocity": (0.0, 0.0), "duration": 5.0}
        if many:
            found = saltus.simulate_many(system, **start)
            names = ("theta_1", "theta_2", "theta_1_velocity", "theta_2_velocity", "impact_count")
            ends.append([float(found[name]) for name in names])
        else:
            motion = saltus.simulate(system, **start)
            ends.append([*motion.position, *motion.velocity, len(motion.impacts)])
    assert ends[0] == pytest.approx(ends[1], abs=1e-7 if frequency > 1e-9 else 1e-11)


def test_a_load_whose_period_is_no_size_of_a_time_is_refused():
    system = saltus.System(
        model=saltus.TwoLayer(beta0=1.31),
        load=saltus.Load(frequency=1e-120, horizontal=saltus.Harmonic(0.5)),
    )
    with pytest.raises(saltus.ParameterError, match="the period of the load must be at most 1e"):
        saltus.simulate(system, theta=(0.2, 0.0), duration=1.0)


def between_stops(frequency, time=1.0):
    """An oscillator between two stops, in units in which times are `time`."""
    model = saltus.TwoStops(stiffness=1.0 / time**2, damping=0.05 / time, left=-0.8, right=1.0)
    force = saltus.Harmonic(0.8 / time**2, phase=0.4)
    load = saltus.Load(frequency=frequency / time, force=force)
    return saltus.System(model=model, load=load, impact=NewtonImpact(0.7))


@pytest.mark.parametrize("time", [1e-9, 1e-6, 1e6, 1e9])
@pytest.mark.parametrize("frequency", [1.0, 1e-3, 1e-6, 1e-12])
def test_which_load_is_slow_does_not_depend_on_the_unit_of_time(frequency, time):
    """Under a frequency of 1e-12 steps shrank to nothing where times were 1e-9: the period was then
    compared with a number of the usual units.
    """
    found = []
    for unit in (1.0, time):
        system = between_stops(frequency, unit)
        motion = saltus.simulate(system, x=0.3, velocity=2.0 / unit, duration=30.0 * unit)
        lane = saltus.simulate_many(system, x=0.3, velocity=2.0 / unit, duration=30.0 * unit)
        run = program(system)
        natural = natural_time(system, system.load.period, run) / unit
        found.append([len(motion.impacts), motion.position, natural, float(lane["x"])])
        # a page finds it from these numbers, whatever frequency is chosen there
        numbers = natural_times(system)
        assert numbers["without_period"] is None
        assert min(system.load.period / (2.0 * math.pi), numbers["slow_time"]) == pytest.approx(
            natural * unit
        )
    assert found[1] == pytest.approx(found[0], rel=1e-9)
    assert found[0][3] == pytest.approx(found[0][1], abs=1e-12)
    # the oscillator's own time is 1
    assert found[0][2] == pytest.approx(min(1.0 / frequency, SLOW_LOAD), rel=1e-9)
