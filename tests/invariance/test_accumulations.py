"""The impacts before an accumulation is summed up: their number has no unit, and depends on nothing
that does not act on them.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
import pytest

import saltus

# In units of their own time and length: length, time, mass.
UNITS = [(1.0, 1.0, 1.0), (1e-9, 1.0, 1e6), (1e6, 1e-6, 1.0), (1.0, 1e6, 1e-6), (1e-3, 1e3, 1.0)]
TOLERANCE = 1e-12
# impacts are seen down to this, in the lost share of the speed, of the fastest one; 3 sqrt(tol) at
# tolerances above 1e-10
SEEN = 3e-5


@dataclass(frozen=True, kw_only=True)
class Ball(saltus.ContactModel):
    """A ball that falls on a floor."""

    g: float
    mass: float
    far: float
    rate: float

    coordinates: ClassVar[tuple[str, ...]] = ("x",)

    @property
    def contacts(self) -> tuple[saltus.Contact, ...]:
        return (saltus.Contact(name="floor", coordinate="x"),)

    def mass_matrix(self, q: Any) -> Any:
        return self.mass

    def force(self, t: Any, q: Any, v: Any, load: Any) -> Any:
        return -self.g * self.mass


@dataclass(frozen=True, kw_only=True)
class UnderCeiling(Ball):
    """The same under a ceiling that it does not reach."""

    @property
    def contacts(self) -> tuple[saltus.Contact, ...]:
        ceiling = saltus.Contact(name="ceiling", coordinate="x", sign=-1, position=self.far)
        return (ceiling, *super().contacts)


@dataclass(frozen=True, kw_only=True)
class Rubbed(Ball):
    """The same with a friction of 0."""

    frictions = (saltus.Friction(name="rub", coordinate="x", kinetic=0.0),)

    def normal_forces(self, t: Any, q: Any, v: Any, load: Any) -> Any:
        return (self.mass * self.g,)


@dataclass(frozen=True, kw_only=True)
class Passing(Ball):
    """The same through a surface without effect."""

    @property
    def surfaces(self) -> tuple[saltus.Surface, ...]:
        return (saltus.Surface(name="level", coordinate="x", position=0.001 * self.far),)

    def force(self, t: Any, q: Any, v: Any, load: Any, sides: Any) -> Any:
        return -self.g * self.mass


@dataclass(frozen=True, kw_only=True)
class Beside(Ball):
    """The same beside an oscillator on which the load acts alone."""

    coordinates: ClassVar[tuple[str, ...]] = ("x", "y")
    channels: ClassVar[tuple[str, ...]] = ("shaken",)

    def mass_matrix(self, q: Any) -> Any:
        return [[self.mass, 0.0], [0.0, self.mass]]

    def force(self, t: Any, q: Any, v: Any, load: Any) -> Any:
        pull = load.shaken(t) - self.rate**2 * q[1]
        return -self.g * self.mass, self.mass * pull


def falling(kind: type, e: float, units: tuple[float, float, float]) -> tuple[Any, dict[str, Any]]:
    """A system and its start: a ball falls by 0.7 of the unit of length under a gravity of 1.3."""
    length, time, mass = units
    model = kind(g=1.3 * length / time**2, mass=mass, far=50.0 * length, rate=1.7 / time)
    start: dict[str, Any] = {"x": 0.7 * length, "duration": 1e3 * time}
    load = saltus.Load()
    if kind is Beside:
        start |= {"y": 0.2 * length, "velocity": (0.0, 0.0)}
        load = saltus.Load(frequency=2.9 / time, shaken=saltus.Harmonic(length / time**2))
    return saltus.System(model=model, load=load, impact=saltus.NewtonImpact(e=e)), start


@pytest.mark.parametrize("kind", [Ball, UnderCeiling, Rubbed, Passing, Beside])
@pytest.mark.parametrize("e", [0.31, 0.77])
def test_a_ball_is_seen_to_bounce_down_to_a_share_of_its_fastest_impact(
    kind: type, e: float
) -> None:
    """The n-th impact has the speed e^(n-1) of the first, after which e^n is left."""
    share = SEEN * (1.0 - e)
    seen = math.ceil(math.log(share) / math.log(e))
    fall = math.sqrt(2.0 * 0.7 / 1.3)
    rest = fall * (1.0 + 2.0 * e / (1.0 - e))
    for units in UNITS:
        system, start = falling(kind, e, units)
        motion = saltus.simulate(system, **start, dense=False)
        impacts = [event.time for event in motion.events if event.kind == "impact"]
        assert len(impacts) == seen, units
        held = [event.time for event in motion.events if event.kind == "held"]
        assert held[0] == pytest.approx(rest * units[1], rel=1e-12), units
        many = saltus.simulate_many(system, **{**start, "x": np.full(3, start["x"])})
        assert many.impact_count.values.tolist() == [seen] * 3, units


@pytest.mark.parametrize("pull", [1.0, 0.0])
def test_one_contact_and_several_see_the_same_impacts(pull: float) -> None:
    """A wall of the one engine, and a contact of the other, beside a spring and without one."""
    for length, time, _ in UNITS:
        model: Any = saltus.WallOscillator(stiffness=pull / time**2, damping=0.0, wall=0.0)
        push = saltus.Load(force=1.3 * length / time**2)
        counts = set()
        for impact in (saltus.VelocityReduction(0.77), saltus.NewtonImpact(e=0.77)):
            wall = saltus.System(model=model, load=push, impact=impact)
            motion = saltus.simulate(wall, x=-0.7 * length, duration=1e3 * time, dense=False)
            counts.add(len(motion.impacts.time))
        stops = saltus.TwoStops(
            stiffness=pull / time**2, damping=0.0, left=-50.0 * length, right=0.0
        )
        between = saltus.System(model=stops, load=push, impact=saltus.NewtonImpact(e=0.77))
        motion = saltus.simulate(between, x=-0.7 * length, duration=1e3 * time, dense=False)
        counts.add(sum(event.kind == "impact" for event in motion.events))
        assert len(counts) == 1, (length, time, counts)


@dataclass(frozen=True, kw_only=True)
class Bed(saltus.ContactModel):
    """A body on a shaken one that rests on a floor."""

    g: float
    heavy: float
    light: float

    coordinates: ClassVar[tuple[str, ...]] = ("x", "y")
    channels: ClassVar[tuple[str, ...]] = ("force",)

    @property
    def contacts(self) -> tuple[saltus.Contact, ...]:
        return (
            saltus.Contact(name="floor", coordinate="x"),
            saltus.Contact(name="upper", coordinate={"y": 1.0, "x": -1.0}),
        )

    def mass_matrix(self, q: Any) -> Any:
        return [[self.heavy, 0.0], [0.0, self.light]]

    def force(self, t: Any, q: Any, v: Any, load: Any) -> Any:
        return load.force(t) - self.g * self.heavy, -self.g * self.light


@pytest.mark.parametrize("seed", range(3))
def test_a_bed_of_two_bodies_bounces_as_often_in_all_units(seed: int) -> None:
    rng = np.random.default_rng([43, seed])
    g, light, e = rng.uniform(0.8, 2.0), rng.uniform(0.2, 0.8), rng.uniform(0.2, 0.7)
    shake, rate = rng.uniform(0.0, 0.5), rng.uniform(0.7, 2.0)
    x, y = rng.uniform(0.1, 0.3), rng.uniform(0.4, 0.9)
    said = set()
    for length, time, mass in UNITS:
        acceleration = length / time**2
        model = Bed(g=g * acceleration, heavy=mass, light=light * mass)
        force = saltus.Harmonic(shake * mass * acceleration)
        load = saltus.Load(frequency=rate / time, force=force)
        system = saltus.System(model=model, load=load, impact=saltus.NewtonImpact(e=e))
        motion = saltus.simulate(
            system,
            x=x * length,
            y=y * length,
            velocity=(0.0, 0.0),
            duration=20.0 * time,
            dense=False,
        )
        said.add(tuple((str(event.kind), event.contact) for event in motion.events))
    assert len(said) == 1, [len(events) for events in said]
