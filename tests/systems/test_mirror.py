"""The mirror symmetry of a system, found from its equations."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, ClassVar

import numpy as np
import pytest
from shared_systems import Row

import saltus
import saltus.systems.mirror as mirror_module
from saltus.orbits import is_symmetric
from saltus.systems import image_of, mirror_of
from saltus.systems.loads.load import reversed_load

STIFFNESS = np.array([[2.0, -1.0], [-1.0, 1.0]])


@dataclass(frozen=True, kw_only=True)
class Absorber(saltus.ContactModel):
    """A mass on a spring with a mass between two stops in it."""

    mass: float = 0.2
    left: float = 0.4
    right: float = 0.4
    static: float = 0.0
    even: float = 0.0
    coordinates: ClassVar[tuple[str, ...]] = ("x", "y")
    channels: ClassVar[tuple[str, ...]] = ("force",)

    @property
    def contacts(self) -> tuple[saltus.Contact, ...]:
        apart = {"y": 1.0, "x": -1.0}
        return (
            saltus.Contact(name="left", coordinate=apart, position=-self.left),
            saltus.Contact(name="right", coordinate=apart, position=self.right, sign=-1),
        )

    def mass_matrix(self, q: Any) -> Any:
        return [[1.0, 0.0], [0.0, self.mass]]

    def force(self, t: Any, q: Any, v: Any, load: Any) -> Any:
        push = 0.2 * (q[0] - q[1]) + 0.01 * (v[0] - v[1])
        own = -q[0] - 0.05 * v[0] - self.even * q[0] ** 2
        return load.force(t) + self.static + own - push, push


@dataclass(frozen=True, kw_only=True)
class Declared(Absorber):
    def mirror(self, load: Any) -> Any:
        return reversed_load(load, "force")


@dataclass(frozen=True, kw_only=True)
class Swapped(saltus.ContactModel):
    """Two alike masses, each before a stop of its own: the mirror swaps them."""

    second: float = 1.0
    coordinates: ClassVar[tuple[str, ...]] = ("a", "b")
    channels: ClassVar[tuple[str, ...]] = ("force",)

    @property
    def contacts(self) -> tuple[saltus.Contact, ...]:
        return (
            saltus.Contact(name="low", coordinate="a", position=-1.0),
            saltus.Contact(name="high", coordinate="b", position=self.second, sign=-1),
        )

    def force(self, t: Any, q: Any, v: Any, load: Any) -> Any:
        (a, b), push = q, load.force(t)
        return push - a + 0.3 * (b - a) - 0.1 * v[0], push - b + 0.3 * (a - b) - 0.1 * v[1]


@dataclass(frozen=True, kw_only=True)
class Coupled(saltus.ContactModel):
    """The same on springs of their own and one between them, far from the origin."""

    rest: float = 0.0
    stiffness: float = 1.0
    second: float | None = None  # the other spring's stiffness, where it differs
    coupling: float = 0.0
    coordinates: ClassVar[tuple[str, ...]] = ("a", "b")
    channels: ClassVar[tuple[str, ...]] = ("force",)

    @property
    def contacts(self) -> tuple[saltus.Contact, ...]:
        return (
            saltus.Contact(name="low", coordinate="a", position=self.rest - 1.0),
            saltus.Contact(name="high", coordinate="b", position=self.rest + 1.0, sign=-1),
        )

    def force(self, t: Any, q: Any, v: Any, load: Any) -> Any:
        a, b, push = q[0] - self.rest, q[1] - self.rest, load.force(t)
        second = self.stiffness if self.second is None else self.second
        return (
            push - self.stiffness * a - self.coupling * b - 0.1 * v[0],
            push - second * b - self.coupling * a - 0.1 * v[1],
        )


@dataclass(frozen=True, kw_only=True)
class Smooth(saltus.Model):
    """A Duffing oscillator with a further force far away, beyond `stop`."""

    even: float = 0.0
    far: float = 0.0
    stop: float = 2000.0
    coordinates: ClassVar[tuple[str, ...]] = ("x",)
    channels: ClassVar[tuple[str, ...]] = ("force",)

    def acceleration(self, t: Any, x: Any, velocity: Any, side: Any, load: Any) -> Any:
        beyond = 1.0 + np.tanh(x - self.stop)
        return load.force(t) - 0.1 * velocity - x - x**3 - self.even * x**2 - self.far * beyond


@dataclass(frozen=True, kw_only=True)
class Rubbing(saltus.ContactModel):
    """Two masses on a floor, with friction on it and between them."""

    speed: float = 0.0
    coordinates: ClassVar[tuple[str, ...]] = ("x", "y")
    channels: ClassVar[tuple[str, ...]] = ("force",)

    @property
    def frictions(self) -> tuple[saltus.Friction, ...]:
        return (
            saltus.Friction(
                name="floor", coordinate="x", kinetic=0.1, static=0.2, ground_speed=self.speed
            ),
            saltus.Friction(name="joint", coordinate={"y": 1.0, "x": -1.0}, kinetic=0.1),
        )

    def force(self, t: Any, q: Any, v: Any, load: Any) -> Any:
        return load.force(t) - q[0], -q[1]


@dataclass(frozen=True, kw_only=True)
class Walls(saltus.ContactModel):
    """A mass between two walls that move with the ground."""

    right: float = 1.0  # by which share of its displacement the right one does
    coordinates: ClassVar[tuple[str, ...]] = ("x",)
    channels: ClassVar[tuple[str, ...]] = ("ground",)

    @property
    def contacts(self) -> tuple[saltus.Contact, ...]:
        left, right = ({"x": 1.0, "ground": -share} for share in (1.0, self.right))
        return (
            saltus.Contact(name="left", coordinate=left, position=-1.0),
            saltus.Contact(name="right", coordinate=right, position=1.0, sign=-1),
        )

    def force(self, t: Any, x: Any, velocity: Any, load: Any) -> Any:
        return -0.1 * velocity - x


@dataclass(frozen=True, kw_only=True)
class DeclaredWalls(Walls):
    """The same with a mirror of its own, about 0."""

    def mirror(self, load: Any) -> Any:
        return reversed_load(load, "ground")


@dataclass(frozen=True, kw_only=True)
class Rubbed(saltus.ContactModel):
    """Two bodies, of which one rubs on a floor, and the other on a ceiling whose reaction acts on
    a sum with a factor."""

    factor: float = 1.0
    above: float = 0.3  # coefficient of friction
    coordinates: ClassVar[tuple[str, ...]] = ("x", "y", "u", "w")
    channels: ClassVar[tuple[str, ...]] = ("force",)

    @property
    def contacts(self) -> tuple[saltus.Contact, ...]:
        high = {"w": self.factor}
        return (
            saltus.Contact(name="low", coordinate="y", position=-0.4),
            saltus.Contact(name="high", coordinate=high, position=0.4 * self.factor, sign=-1),
        )

    @property
    def frictions(self) -> tuple[saltus.Friction, ...]:
        return (
            saltus.Friction(name="floor", coordinate="x", kinetic=0.3, contact="low"),
            saltus.Friction(name="ceiling", coordinate="u", kinetic=self.above, contact="high"),
        )

    def force(self, t: Any, q: Any, v: Any, load: Any) -> Any:
        push = load.force(t)
        return tuple(
            share * push - x - 0.1 * rate
            for share, x, rate in zip((1.0, 3.0, 1.0, 3.0), q, v, strict=True)
        )


@dataclass(frozen=True, kw_only=True)
class Joint(saltus.ContactModel):
    """Two bodies with friction between them, on springs that are each other's images."""

    bend: float = 0.2
    coordinates: ClassVar[tuple[str, ...]] = ("a", "b")
    channels: ClassVar[tuple[str, ...]] = ("force",)

    @property
    def frictions(self) -> tuple[saltus.Friction, ...]:
        return (saltus.Friction(name="joint", coordinate={"a": 1.0, "b": -1.0}, kinetic=0.1),)

    def force(self, t: Any, q: Any, v: Any, load: Any) -> Any:
        (a, b), push = q, load.force(t)
        return push - a - 0.2 * a**2, push - b + self.bend * b**2


def structure(stiffness: float = 0.3, right: float = 0.5) -> saltus.Structure:
    """Two masses between hard stops and springs with a gap."""
    return saltus.Structure(
        mass=np.eye(2),
        damping=0.05 * STIFFNESS,
        stiffness=STIFFNESS,
        contacts=[
            saltus.Contact(name="left", coordinate=1, position=-0.5),
            saltus.Contact(name="right", coordinate=1, position=right, sign=-1),
        ],
        surfaces=[
            saltus.Surface(name="one", coordinate=0, position=-0.3, sign=-1, stiffness=0.3),
            saltus.Surface(name="other", coordinate=0, position=0.3, stiffness=stiffness),
        ],
        forces={"force": 1},
    )


def under(model: Any, channel: str = "force", **signal: float) -> saltus.System:
    load = {channel: saltus.Harmonic(**{"amplitude": 0.3} | signal)}
    law = {"impact": saltus.NewtonImpact(e=0.7)} if getattr(model, "contacts", ()) else {}
    return saltus.System(model=model, load=saltus.Load(frequency=0.7, **load), **law)


SYMMETRIC = {
    "two contacts of a sum": under(Absorber()),
    "rounded": under(Absorber(left=0.4 * (1 + 1e-13), right=0.4 * (1 - 1e-13))),
    "two stops, rounded": under(saltus.TwoStops(left=-1.0, right=1.0 + 1e-13)),
    "static force, about another place": under(Absorber(static=1e-9)),
    "mean of the load, about another place": under(Absorber(), mean=1e-9),
    "swapped": under(Swapped()),
    "smooth": under(Smooth()),
    "third harmonic": under(Smooth(), order=3),
    "frictions": under(Rubbing()),
    "walls that move": under(Walls(), "ground"),
    "structure": under(structure()),
    "bodies between walls": under(Row()),
    "small bodies between walls": under(Row(length=2e-3), amplitude=3e-4),
    "bodies that hit each other": under(Row(walls=False)),
    "friction between two that are swapped": under(Joint()),
    "friction by a reaction on a multiple": under(Rubbed(factor=2.0, above=0.6)),
    "walls whose mirror is declared": under(DeclaredWalls(), "ground"),
}
OTHER = {
    "stops": under(Absorber(left=0.41)),
    "even spring": under(Absorber(even=1e-6)),
    "mean of the load": under(Smooth(), mean=1e-9),
    "static force of a curved spring": under(Smooth(even=0.1)),
    "second harmonic": under(Absorber(), order=2),
    "stop of one of two": under(Swapped(second=1.1)),
    "even term": under(Smooth(even=1e-3)),
    "force far away": under(Smooth(far=1.0)),
    "belt that moves": under(Rubbing(speed=1e-3)),
    "walls beside the middle": under(Walls(), "ground", mean=0.2),
    "declared walls beside the middle": under(DeclaredWalls(), "ground", mean=0.2),
    "walls that shake eight times": under(Walls(), "ground", order=8),
    "friction by another reaction": under(Rubbed(factor=2.0)),
    "other mass in a row": under(Row(second=1.1)),
    "other spring behind a joint": under(Joint(bend=0.21)),
    "soft stops": under(structure(stiffness=0.31)),
    "hard stops": under(structure(right=0.51)),
    "laws": under(Absorber()).with_(impact=saltus.NewtonImpact(e=(0.7, 0.6))),
}


@pytest.mark.parametrize("name", SYMMETRIC)
def test_the_image_of_a_motion_half_a_period_later_is_a_motion(name: str) -> None:
    system = SYMMETRIC[name]
    assert is_symmetric(system)
    n = len(system.model.coordinates)
    state = np.random.default_rng(5).uniform(-0.2, 0.2, 2 * n)
    if isinstance(system.model, Row):  # between its walls
        state[:n] += 0.5, 1.5
        state *= 0.5 * system.model.length
    period = system.load.period
    ends = []
    for begin, time in ((state, 0.0), (image_of(system, state), 0.5 * period)):
        names = dict(zip(system.model.coordinates, begin[:n].tolist(), strict=True))
        velocity = begin[n] if n == 1 else tuple(begin[n:].tolist())
        motion = saltus.simulate(system, **names, velocity=velocity, time=time, periods=3)
        ends.append(motion.final_state)
    np.testing.assert_allclose(image_of(system, ends[0]), ends[1], rtol=0, atol=1e-10)


@pytest.mark.parametrize("name", OTHER)
def test_what_breaks_the_symmetry_is_seen(name: str) -> None:
    assert not is_symmetric(OTHER[name])


@pytest.mark.parametrize("scale", [1e-9, 1e-3, 1e6])
def test_units_do_not_matter(scale: float) -> None:
    """Lengths in other units: the same answers, for a mean that is 1e-9 of the amplitude too."""
    model = saltus.TwoStops(left=-scale, right=scale)
    assert is_symmetric(under(model, amplitude=0.3 * scale))
    assert not is_symmetric(under(model, amplitude=0.3 * scale, mean=0.3e-9 * scale))
    assert not is_symmetric(under(saltus.TwoStops(left=-scale, right=1.001 * scale)))


@pytest.mark.parametrize("rest", [1.0, 1e3, 3e4])
def test_rounding_far_from_the_origin_does_not_break_a_symmetry(rest: float) -> None:
    """There, places have the rounding of their origin, of which springs may leave all."""
    random = np.random.default_rng(8)
    for stiffness, coupling in random.uniform((1.0, -0.5), (3.0, 0.5), (60, 2)).tolist():
        model = Coupled(rest=rest, stiffness=stiffness, coupling=coupling)
        assert is_symmetric(under(model, amplitude=0.1)), model
    assert not is_symmetric(under(replace(model, second=stiffness * (1.0 + 1e-6))))


def test_walls_that_move_towards_each_other_have_no_known_mirror() -> None:
    """In coordinates of gaps the image of one gap is the other one, and moves beside its negative."""
    system = under(Walls(right=-1.0), "ground", order=2)
    assert not is_symmetric(system)
    assert mirror_of(system.in_gap_coordinates) is None


def test_a_mirror_that_is_found_is_the_one_that_is_declared() -> None:
    found, declared = mirror_of(under(Absorber())), mirror_of(under(Declared()))
    assert found is not None
    assert declared is not None
    assert (found.load, found.parts, found.centre) == (
        declared.load,
        declared.parts,
        declared.centre,
    )
    np.testing.assert_array_equal(found.turn, declared.turn)
    assert found.parts == (1, 0)


def test_a_declared_mirror_that_is_none_is_refused_and_one_that_is_not_given_is_kept() -> None:
    with pytest.raises(saltus.errors.ParameterError, match="not a symmetry of its equations"):
        mirror_of(under(Declared(even=0.3)))

    @dataclass(frozen=True, kw_only=True)
    class Without(Absorber):
        def mirror(self, load: Any) -> Any:
            return None

    assert mirror_of(under(Without())) is None


def test_no_centre_is_looked_for_where_a_contact_has_no_image(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """It takes long for many coordinates, and none is the centre of a stop on one side."""
    looked_for = []
    monkeypatch.setattr(mirror_module, "_balanced", lambda *_: looked_for.append(1))
    stop = saltus.Contact(name="stop", coordinate=0, position=0.3, sign=-1)
    for stops in ([stop], [stop, saltus.Contact(name="other", coordinate=0, position=-0.1)]):
        chain = saltus.Structure(
            mass=np.eye(3), stiffness=np.diag([2.0, 2.0, 1.0]), contacts=stops, forces={"push": 2}
        )
        load = saltus.Load(frequency=1.0, push=saltus.Harmonic(0.1))
        system = saltus.System(model=chain, load=load, impact=saltus.NewtonImpact(0.5))
        assert mirror_module.mirror_of(system) is None
        assert len(looked_for) > 0 if len(stops) > 1 else not looked_for
