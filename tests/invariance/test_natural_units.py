"""The natural units of a system scale with the units of its user, and depend on nothing else."""

from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
import pytest
from shared_systems import forced

import saltus
from saltus.systems import natural_units

SCALES = [(1e-9, 1.0), (1e6, 1.0), (1.0, 1e-3), (1.0, 1e6), (1e-6, 1e3)]


def stopped(length=1.0, rate=1.0, phase=0.3, force=0.6):
    """An oscillator between stops, in units in which lengths are `length` and rates are `rate`."""
    model = saltus.TwoStops(stiffness=rate**2, damping=0.1 * rate, left=-length, right=1.7 * length)
    force = saltus.Harmonic(force * rate**2 * length, phase=phase)
    return saltus.System(
        model=model,
        load=saltus.Load(frequency=0.9 * rate, force=force),
        impact=saltus.NewtonImpact(e=0.7),
    )


def beam(length=1.0, rate=1.0):
    """Four masses in a row, of which the last one hits a stop."""
    stiffness = rate**2 * (2.0 * np.eye(4) - np.eye(4, k=1) - np.eye(4, k=-1))
    model = saltus.Structure(
        mass=np.eye(4),
        stiffness=stiffness,
        damping=0.05 / rate * stiffness,
        contacts=[saltus.Contact(name="stop", coordinate=3, position=0.2 * length, sign=-1)],
        forces={"f": 0},
    )
    force = saltus.Harmonic(0.05 * rate**2 * length)
    return saltus.System(
        model=model,
        load=saltus.Load(frequency=0.24 * rate, f=force),
        impact=saltus.NewtonImpact(e=0.6),
    )


@pytest.mark.parametrize(("length", "rate"), SCALES)
@pytest.mark.parametrize("make", [stopped, beam])
def test_units_scale_as_what_they_measure(make, length, rate):
    of_one = natural_units(make())
    scaled = natural_units(make(length, rate))
    np.testing.assert_allclose(scaled.lengths, of_one.lengths * length, rtol=1e-12)
    assert scaled.time == pytest.approx(of_one.time / rate, rel=1e-14)
    assert scaled.speed == pytest.approx(of_one.speed * length * rate, rel=1e-12)


def test_powers_of_two_are_exact_and_near():
    units = natural_units(stopped(1e-9, 1e6))
    for value, rounded in (
        (units.time, units.powers_of_two.time),
        (units.length, units.powers_of_two.length),
    ):
        assert np.frexp(rounded)[0] == 0.5
        assert 2.0**-0.5 <= rounded / value <= 2.0**0.5


@pytest.mark.parametrize("force", [0.6, 0.01])
def test_a_shift_of_the_load_changes_nothing(force):
    lengths = [natural_units(stopped(phase=phase, force=force)).length for phase in (0.0, 0.4, 2.9)]
    np.testing.assert_allclose(lengths, lengths[0], rtol=1e-12)


def test_angles_have_the_unit_of_one_radian():
    assert natural_units(forced(H=1e-4)).length == 1.0


def test_under_constant_loads_they_are_the_distance_to_the_contact_and_the_free_oscillation():
    """x'' = 3 - 4 x is at rest at x = 3/4; the wall is 5/4 away from there, and the rate is 2."""
    load = saltus.Load(force=3.0)
    system = saltus.System(model=saltus.WallOscillator(stiffness=4.0, wall=2.0), load=load)
    units = natural_units(system)
    assert (units.length, units.time) == pytest.approx((1.25, 0.5), rel=1e-14)


class Walled(saltus.ContactModel):
    """An oscillator about `origin` between walls, declared in any order."""

    coordinates: ClassVar[tuple] = ("x",)
    channels: ClassVar[tuple] = ("force",)
    origin: ClassVar[float] = 0.0
    walls: ClassVar[tuple] = ((-1.0, 1), (1.5, -1))

    @property
    def contacts(self):
        return tuple(
            saltus.Contact(name=f"wall_{i}", coordinate="x", position=self.origin + p, sign=sign)
            for i, (p, sign) in enumerate(self.walls)
        )

    def force(self, t, x, velocity, load):
        return load.force(t) - (x - self.origin)


def test_origin_order_and_far_contacts_change_nothing():
    load = saltus.Load(frequency=1.1, force=saltus.Harmonic(0.3))

    def units_of(**changes):
        model = type("Moved", (Walled,), changes)()
        return natural_units(saltus.System(model=model, load=load)).length

    usual = units_of()
    assert units_of(walls=Walled.walls[::-1]) == usual
    assert units_of(walls=(Walled.walls[0], (1e6, -1))) == units_of(walls=Walled.walls[:1])
    far = units_of(walls=((-1e4, 1), (1e5, -1)))
    assert far == pytest.approx(units_of(walls=()), rel=1e-9)
    assert units_of(origin=1024.0) == pytest.approx(usual, rel=1e-12)


def test_friction_gives_a_length_where_nothing_else_does():
    """A mass on a belt: the spring of 1 holds against a friction of 0.2 at 0.2 from its end."""
    belt = saltus.BeltOscillator(kinetic=0.2, static=0.3, belt_speed=0.1)
    units = natural_units(saltus.System(model=belt))
    assert (units.length, units.time) == pytest.approx((0.2, 1.0))
    doubled = replace(belt, kinetic=0.4, static=0.6)
    assert natural_units(saltus.System(model=doubled)).length == pytest.approx(0.4)


@dataclass(frozen=True, kw_only=True)
class AtWall(saltus.ContactModel):
    """An oscillator at a wall."""

    coordinates: ClassVar[tuple[str, ...]] = ("x",)
    channels: ClassVar[tuple[str, ...]] = ("force",)
    contacts: ClassVar[tuple[saltus.Contact, ...]] = (
        saltus.Contact(name="wall", coordinate="x", sign=-1, position=1.0),
    )

    def force(self, t, q, velocity, load):
        return load.force(t) - 0.1 * velocity - 4.0 * q


@dataclass(frozen=True, kw_only=True)
class WithSurface(AtWall):
    """The same with a surface across which nothing changes."""

    surfaces: ClassVar[tuple[saltus.Surface, ...]] = (
        saltus.Surface(name="inert", coordinate="x", position=0.21),
    )

    def force(self, t, q, velocity, load, sides):
        return load.force(t) - 0.1 * velocity - 4.0 * q


def test_a_surface_without_effect_changes_no_unit():
    """The stiffness is read beside a surface too: its own time is 1 / 2."""
    one, other = (
        natural_units(
            saltus.System(
                model=model,
                load=saltus.Load(frequency=0.8, force=saltus.Harmonic(0.6)),
                impact=saltus.NewtonImpact(e=0.8),
            )
        )
        for model in (AtWall(), WithSurface())
    )
    assert other.own_time == pytest.approx(0.5, rel=1e-14)
    assert (other.length, other.time, other.own_time) == (one.length, one.time, one.own_time)


@dataclass(frozen=True, kw_only=True)
class Harvester(saltus.ContactModel):
    """A mass before a wall, with a voltage that follows its speed and a charge that follows that,
    in any units."""

    length: float = 1.0
    time: float = 1.0
    volt: float = 1.0
    coordinates: ClassVar[tuple] = ("x", "voltage", "charge")
    first_order: ClassVar[tuple] = ("voltage", "charge")
    channels: ClassVar[tuple] = ("force",)

    @property
    def contacts(self):
        return (saltus.Contact(name="wall", coordinate="x", position=0.4 * self.length, sign=-1),)

    def force(self, t, q, velocity, load):
        x, voltage, charge = q
        push = load.force(t) - x / self.time**2
        pushed = push - 0.3 * voltage * self.length / self.volt / self.time**2
        filled = (0.8 * x / self.length * self.volt - 0.6 * voltage) / self.time
        return pushed, filled, (voltage / self.volt - 0.2 * charge) / self.time


@dataclass(frozen=True, kw_only=True)
class Filter(saltus.Model):
    """A voltage that follows a source, in any units."""

    time: float = 1.0
    coordinates: ClassVar[tuple] = ("voltage",)
    first_order: ClassVar[tuple] = ("voltage",)
    channels: ClassVar[tuple] = ("source",)

    def acceleration(self, t, theta, velocity, side, load):
        return (load.source(t) - theta) / self.time


@pytest.mark.parametrize("volt", [1e-6, 1e3])
@pytest.mark.parametrize(("length", "rate"), SCALES)
def test_coordinates_of_first_order_have_units_of_their_own(length, rate, volt):
    """The unit of one was mixed with the unit of the other ones, in a sum of squares."""

    def made(length=1.0, time=1.0, volt=1.0):
        force = saltus.Harmonic(0.5 * length / time**2)
        load = saltus.Load(frequency=1.1 / time, force=force)
        return saltus.System(model=Harvester(length=length, time=time, volt=volt), load=load)

    of_one = natural_units(made())
    scaled = natural_units(made(length, 1.0 / rate, volt))
    np.testing.assert_allclose(scaled.lengths, of_one.lengths * [length, volt, 1.0], rtol=1e-12)
    assert scaled.time * rate == pytest.approx(of_one.time, rel=1e-12)
    assert scaled.own_time * rate == pytest.approx(of_one.own_time, rel=1e-12)
    assert of_one.lengths.min() > 0.1


@pytest.mark.parametrize(("volt", "rate"), SCALES)
@pytest.mark.parametrize("frequency", [None, 2.0])
def test_coordinates_of_first_order_alone(frequency, volt, rate):
    """Under a constant source of 3 the voltage is 3 in the end, and its time is its own."""

    def made(volt=1.0, rate=1.0):
        source = 3.0 * volt if frequency is None else saltus.Harmonic(3.0 * volt)
        load = saltus.Load(frequency=None if frequency is None else frequency * rate, source=source)
        return saltus.System(model=Filter(time=1.0 / rate), load=load)

    units = natural_units(made(volt, rate))
    assert units.time * rate == pytest.approx(1.0 if frequency is None else 0.5, rel=1e-12)
    if frequency is None:
        assert units.lengths[0] / volt == pytest.approx(3.0, rel=1e-12)
    of_one = natural_units(made())
    assert units.lengths[0] / volt == pytest.approx(of_one.lengths[0], rel=1e-12)


@dataclass(frozen=True, kw_only=True)
class Chain(saltus.ContactModel):
    """Three masses on springs, about an origin of each: a wall before the first one, a stop of the
    second one on the third, and a soft stop."""

    origins: tuple[float, float, float] = (0.0, 0.0, 0.0)
    coordinates: ClassVar[tuple] = ("x", "y", "z")
    channels: ClassVar[tuple] = ("force",)

    @property
    def contacts(self):
        a, b, c = self.origins
        return (
            saltus.Contact(name="wall", coordinate="x", position=a - 0.3),
            saltus.Contact(name="stop", coordinate={"z": 1.0, "y": -1.0}, position=c - b - 0.2),
        )

    @property
    def surfaces(self):
        return (saltus.Surface(name="soft", coordinate="y", position=self.origins[1] + 0.4),)

    def force(self, t, q, velocity, load, sides):
        x, y, z = (value - origin for value, origin in zip(q, self.origins, strict=True))
        soft = 3.0 * (1.0 + sides.soft) / 2.0 * (y - 0.4)
        return load.force(t) - 2.0 * x + y, x - 3.0 * y + z - soft, y - 1.5 * z


@pytest.mark.parametrize("seed", range(4))
def test_several_coordinates_do_not_depend_on_their_origins(seed):
    """The places of contacts set the coordinates that they do not hold to 0."""
    load = saltus.Load(frequency=1.1, force=saltus.Harmonic(0.3, mean=0.05))
    origins = tuple(np.random.default_rng(seed).uniform(-30.0, 30.0, 3).tolist())
    usual, moved = (
        natural_units(saltus.System(model=Chain(origins=o), load=load))
        for o in ((0.0, 0.0, 0.0), origins)
    )
    np.testing.assert_allclose(moved.lengths, usual.lengths, rtol=1e-9)
    assert moved.own_time == pytest.approx(usual.own_time, rel=1e-9)
    assert moved.speed == pytest.approx(usual.speed, rel=1e-9)
