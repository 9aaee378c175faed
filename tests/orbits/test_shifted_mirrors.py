"""The mirror symmetry of a system about any place: a shifted model has the same orbits."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
import pytest

import saltus
from saltus.systems import image_of, mirror_of

FREQUENCY = "load.frequency"


@dataclass(frozen=True, kw_only=True)
class Shifted(saltus.ContactModel):
    """x'' + .05 x' + .2 (x - o) + .1 (x - o)^3 = F between stops at o - 1 and o + 1."""

    coordinates: ClassVar[tuple[str, ...]] = ("x",)
    channels: ClassVar[tuple[str, ...]] = ("force",)
    origin: float = 0.0

    @property
    def contacts(self) -> tuple[saltus.Contact, ...]:
        return (
            saltus.Contact(name="left", coordinate="x", position=self.origin - 1.0),
            saltus.Contact(name="right", coordinate="x", position=self.origin + 1.0, sign=-1),
        )

    def force(self, t: Any, x: Any, velocity: Any, load: Any) -> Any:
        moved = x - self.origin
        return load.force(t) - 0.05 * velocity - 0.2 * moved - 0.1 * moved**3


@dataclass(frozen=True, kw_only=True)
class Carried(saltus.ContactModel):
    """A mass y without stops of its own on a mass x between stops, each with an origin."""

    coordinates: ClassVar[tuple[str, ...]] = ("x", "y")
    channels: ClassVar[tuple[str, ...]] = ("force",)
    origin: float = 0.0
    rest_length: float = 0.0

    @property
    def contacts(self) -> tuple[saltus.Contact, ...]:
        return (
            saltus.Contact(name="left", coordinate="x", position=self.origin - 0.4),
            saltus.Contact(name="right", coordinate="x", position=self.origin + 0.4, sign=-1),
        )

    def mass_matrix(self, q: Any) -> Any:
        return [[1.0, 0.0], [0.0, 0.3]]

    def force(self, t: Any, q: Any, v: Any, load: Any) -> Any:
        apart = q[1] - q[0] - self.rest_length
        pull = 0.3 * (apart + 0.5 * apart**3) + 0.02 * (v[1] - v[0])
        x = q[0] - self.origin
        return load.force(t) - x - 0.1 * v[0] + pull, -pull


@dataclass(frozen=True, kw_only=True)
class Swapped(saltus.ContactModel):
    """Two masses, each with one stop, that are images of one another."""

    coordinates: ClassVar[tuple[str, ...]] = ("x", "y")
    channels: ClassVar[tuple[str, ...]] = ("force",)
    origin: float = 0.0
    other: float = 0.0

    @property
    def contacts(self) -> tuple[saltus.Contact, ...]:
        return (
            saltus.Contact(name="low", coordinate="x", position=self.origin - 1.0),
            saltus.Contact(name="high", coordinate="y", position=self.other + 1.0, sign=-1),
        )

    def force(self, t: Any, q: Any, v: Any, load: Any) -> Any:
        x = q[0] - self.origin
        y = q[1] - self.other
        pull = 0.3 * (y - x)
        push = load.force(t)
        return push - 0.8 * x - 0.1 * v[0] + pull, push - 0.8 * y - 0.1 * v[1] - pull


@dataclass(frozen=True, kw_only=True)
class Rubbing(saltus.ContactModel):
    """x'' + .1 x' + x = F + friction."""

    coordinates: ClassVar[tuple[str, ...]] = ("x",)
    channels: ClassVar[tuple[str, ...]] = ("force",)
    frictions = (saltus.Friction(name="rub", coordinate="x", kinetic=0.1),)

    def normal_forces(self, t: Any, x: Any, velocity: Any, load: Any) -> Any:
        return (1.0,)

    def force(self, t: Any, x: Any, velocity: Any, load: Any) -> Any:
        return load.force(t) - 0.1 * velocity - x


def under(model: Any, *more: Any, frequency: float = 1.2, amplitude: float = 0.8) -> saltus.System:
    signal: Any = saltus.Harmonic(amplitude)
    for term in more:
        signal = signal + term
    load = saltus.Load(frequency=frequency, force=signal)
    law = {"impact": saltus.NewtonImpact(e=0.7)} if model.contacts else {}
    return saltus.System(model=model, load=load, **law)


def told(branch: saltus.Branch, shift: float) -> list[Any]:
    return [
        (str(p.kind), p.parameter, p.orbit.symmetric, p.orbit.highest - shift)
        for p in branch.special
    ]


@pytest.mark.parametrize("origin", [3.0, -0.3, 1e-4, 1000.0 / 7.0])
def test_a_shifted_model_has_the_same_branch(origin: float) -> None:
    branches = []
    for at in (0.0, origin):
        orbit = saltus.find_orbit(under(Shifted(origin=at)), x=at, velocity=0.5)
        assert orbit.symmetric
        assert orbit.lowest + orbit.highest == pytest.approx(2.0 * at, abs=1e-12)
        branches.append(saltus.continue_orbit(orbit, FREQUENCY, (0.7, 1.5)))
    one, other = branches
    assert any(kind == "BPC" for kind, *_ in told(one, 0.0))
    for (kind, value, *rest), (same, place, *more) in zip(
        told(one, 0.0), told(other, origin), strict=True
    ):
        assert (kind, rest[0]) == (same, more[0])
        assert place == pytest.approx(value, abs=1e-9)
        assert more[1] == pytest.approx(rest[1], abs=1e-7)
    assert [end.reason for end in one.ends] == [end.reason for end in other.ends]
    breaking = next(p for p in other.special if str(p.kind) == "BPC")
    start = saltus.switch_branch(breaking, (0.7, 1.5))[0]
    assert not start.orbits[-1].symmetric


def test_the_centre_of_a_coordinate_without_contacts_follows_from_its_forces() -> None:
    orbits = []
    for at, length in ((0.0, 0.0), (2.0, 0.5), (-40.0, 7.0)):
        system = under(Carried(origin=at, rest_length=length), frequency=0.9, amplitude=0.5)
        mirror = mirror_of(system)
        assert mirror is not None
        assert mirror.centre == pytest.approx((at, at + length), abs=1e-12)
        orbits.append(saltus.find_orbit(system, x=at, y=at + length))
    assert orbits[0].symmetric
    assert orbits[0].impact_count
    for orbit in orbits[1:]:
        assert orbit.symmetric
        assert orbit.impact_times % orbit.duration == pytest.approx(
            orbits[0].impact_times % orbits[0].duration, abs=1e-8
        )
        for one, same in zip(orbit.multipliers, orbits[0].multipliers, strict=True):
            assert one == pytest.approx(same, abs=1e-9)


def test_swapped_coordinates_may_have_different_origins() -> None:
    """x = u + s, y = w + r with the symmetry (u, w) -> (-w, -u): x -> s + r - y."""
    system = under(Swapped(origin=2.0, other=-0.5), frequency=0.8)
    mirror = mirror_of(system)
    assert mirror is not None
    np.testing.assert_array_equal(mirror.turn, [[0.0, -1.0], [-1.0, 0.0]])
    assert mirror.centre == pytest.approx((0.75, 0.75))
    orbit = saltus.find_orbit(system, x=2.0, y=-0.5)
    same = saltus.find_orbit(under(Swapped(), frequency=0.8), x=0.0, y=0.0)
    assert orbit.symmetric
    assert same.symmetric
    assert orbit.multipliers == pytest.approx(same.multipliers, abs=1e-9)
    assert orbit.highest == pytest.approx(same.motion().extrema[0, 1] + 2.0, abs=1e-8)
    motion = orbit.motion()
    state = np.concatenate(motion.at(motion.start))
    later = np.concatenate(motion.at(motion.start + 0.5 * orbit.duration))
    assert image_of(system, state) == pytest.approx(later, abs=1e-8)


def test_a_constant_load_on_a_linear_spring_moves_the_centre() -> None:
    """x'' + .1 x' + x = .3 + F is x'' + .1 x' + x = F about x = .3."""
    plain = saltus.find_orbit(under(Rubbing(), frequency=0.7), x=0.0, velocity=0.1)
    pushed = saltus.find_orbit(under(Rubbing(), 0.3, frequency=0.7), x=0.3, velocity=0.1)
    assert plain.symmetric
    assert pushed.symmetric
    assert pushed.highest - 0.3 == pytest.approx(plain.highest, abs=1e-9)
    assert pushed.multipliers == pytest.approx(plain.multipliers, abs=1e-9)


def test_a_model_that_has_no_centre_is_not_symmetric() -> None:
    """The stops and the spring have their middles at different places, or a square has none."""

    class Askew(Shifted):
        def force(self, t: Any, x: Any, velocity: Any, load: Any) -> Any:
            return load.force(t) - 0.05 * velocity - 0.2 * x

    class Bent(Carried):
        def force(self, t: Any, q: Any, v: Any, load: Any) -> Any:
            x, y = super().force(t, q, v, load)
            return x, y - 0.1 * q[1] * q[1]

    assert mirror_of(under(Askew(origin=0.3))) is None
    assert mirror_of(under(Bent(origin=0.3))) is None
    # along the origin of the stops alone the centre is lost, along that of the model it moves
    orbit = saltus.find_orbit(under(Shifted(origin=0.5)), x=0.5, velocity=0.5)
    branch = saltus.continue_orbit(orbit, "model.origin", (0.4, 0.6))
    widths = [point.highest - point.system.model.origin for point in branch.orbits]
    assert widths == pytest.approx([widths[0]] * len(widths), abs=1e-8)
