"""Branches of symmetric systems, with a declared mirror, with one that is found, and without one:
both stops are grazed at once, and the branch goes on as a symmetric one."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
import pytest

import saltus
from saltus.continuation import CurveEnd
from saltus.orbits.branches.retrace import comes_along_itself
from saltus.systems.loads.load import reversed_load

FREQUENCY = "load.frequency"
AMPLITUDE = "load.force.amplitude"


@dataclass(frozen=True, kw_only=True)
class Absorber(saltus.ContactModel):
    """x'' + .05 x' + x + p = F, .2 y'' = p = .2 (x - y) + .01 (x' - y'), abs(y - x) <= .4."""

    coordinates: ClassVar[tuple[str, ...]] = ("x", "y")
    channels: ClassVar[tuple[str, ...]] = ("force",)
    room: float = 0.4
    mass: float = 0.2

    @property
    def contacts(self) -> tuple[saltus.Contact, ...]:
        apart = {"y": 1.0, "x": -1.0}
        return (
            saltus.Contact(name="left", coordinate=apart, position=-self.room),
            saltus.Contact(name="right", coordinate=apart, position=self.room, sign=-1),
        )

    def mass_matrix(self, q: Any) -> Any:
        return [[1.0, 0.0], [0.0, self.mass]]

    def force(self, t: Any, q: Any, v: Any, load: Any) -> Any:
        push = 0.2 * (q[0] - q[1]) + 0.01 * (v[0] - v[1])
        return load.force(t) - q[0] - 0.05 * v[0] - push, push


@dataclass(frozen=True, kw_only=True)
class DeclaredAbsorber(Absorber):
    def mirror(self, load: Any) -> Any:
        return reversed_load(load, "force")


@dataclass(frozen=True, kw_only=True)
class WithoutMirror(Absorber):
    def mirror(self, load: Any) -> Any:
        return None


@dataclass(frozen=True, kw_only=True)
class Stops(saltus.ContactModel):
    """`saltus.TwoStops` written by a user, who declares no mirror."""

    coordinates: ClassVar[tuple[str, ...]] = ("x",)
    channels: ClassVar[tuple[str, ...]] = ("force",)
    contacts = (
        saltus.Contact(name="left", coordinate="x", position=-1.0),
        saltus.Contact(name="right", coordinate="x", position=1.0, sign=-1),
    )
    stiffness: float = 0.2
    damping: float = 0.1

    def force(self, t: Any, x: Any, velocity: Any, load: Any) -> Any:
        return load.force(t) - self.damping * velocity - self.stiffness * x


@dataclass(frozen=True, kw_only=True)
class Pair(saltus.ContactModel):
    """`saltus.ImpactPair` in the coordinates of case and mass."""

    coordinates: ClassVar[tuple[str, ...]] = ("case", "mass")
    channels: ClassVar[tuple[str, ...]] = ("force",)
    ratio: float = 0.3

    @property
    def contacts(self) -> tuple[saltus.Contact, ...]:
        apart = {"mass": 1.0, "case": -1.0}
        return (
            saltus.Contact(name="left", coordinate=apart, position=-1.0),
            saltus.Contact(name="right", coordinate=apart, position=1.0, sign=-1),
        )

    def mass_matrix(self, q: Any) -> Any:
        return [[1.0, 0.0], [0.0, self.ratio]]

    def force(self, t: Any, q: Any, v: Any, load: Any) -> Any:
        return load.force(t) - q[0] - 0.02 * v[0], 0.0


def under(
    model: Any, amplitude: float, frequency: float, e: float = 0.7, **signal: float
) -> saltus.System:
    force = saltus.Harmonic(amplitude, **signal)
    load = saltus.Load(frequency=frequency, force=force)
    return saltus.System(model=model, load=load, impact=saltus.NewtonImpact(e=e))


def branch_of(model: Any) -> saltus.Branch:
    orbit = saltus.find_orbit(under(model, 0.3, 0.7), x=0.0, y=0.0)
    return saltus.continue_orbit(orbit, FREQUENCY, (0.65, 0.87))


def told(branch: saltus.Branch) -> list[tuple[str, float]]:
    return [(str(point.kind), point.parameter) for point in branch.special]


@pytest.fixture(scope="module")
def found() -> saltus.Branch:
    return branch_of(Absorber())


def test_a_mirror_that_is_found_gives_the_branch_of_one_that_is_declared(
    found: saltus.Branch,
) -> None:
    declared = branch_of(DeclaredAbsorber())
    assert told(found) == told(declared)
    assert [end.reason for end in found.ends] == [CurveEnd.BOUND] * 2
    assert [end.parameter for end in found.ends] == [0.65, 0.87]
    assert all(orbit.symmetric for orbit in found.orbits)


def test_without_a_mirror_the_branch_goes_on_where_both_stops_are_grazed_at_once(
    found: saltus.Branch,
) -> None:
    """By the equations over the full period, and the other orbits that begin there are named."""
    full = branch_of(WithoutMirror())
    assert [end.parameter for end in full.ends] == [0.65, 0.87]
    for (kind, value), (other, place) in zip(told(full), told(found), strict=True):
        assert kind == other
        assert value == pytest.approx(place, abs=1e-8)
    for orbit in full.orbits:
        half = orbit.impact_count // 2
        assert orbit.impact_count == 2 * half
        times, speeds = orbit.impact_times, orbit.speeds
        assert times[half:] - times[:half] == pytest.approx(0.5 * orbit.duration, abs=1e-7)
        assert speeds[half:] == pytest.approx(speeds[:half], abs=1e-7)
        if orbit.grazes:
            # Rounding eps decides whether its motion strikes a stop that it touches: it then leaves
            # the orbit by sqrt(eps), and at the other stop's touch by the fourth root, about 1e-4.
            continue
        motion = orbit.motion()
        (x, y), _ = motion.at(motion.start + orbit.duration * np.array([0.21, 0.71]))
        # rounding grows with the largest multiplier, which has no bound beside a grazing
        rounding = 1e-14 * max(1e5, abs(orbit.multipliers[0]))
        assert x[0] == pytest.approx(-x[1], abs=rounding)
        assert y[0] == pytest.approx(-y[1], abs=rounding)
    for branch in (full, found):
        touching = [point for point in branch.special if point.note]
        assert [str(point.kind) for point in touching] == ["GR"]
        for name in ("left", "right"):
            assert f"orbits with an impact of {name} alone begin there" in touching[0].note
        assert touching[0].note in repr(touching[0])


def test_branches_of_the_losses_of_symmetry_are_mirror_images(found: saltus.Branch) -> None:
    for point in found.special:
        if point.kind != "BPC":
            continue
        near = (point.parameter - 0.004, point.parameter + 0.004)
        born = saltus.switch_branch(point, near)
        assert len(born) == 2
        for branch in born:
            assert len(branch.orbits) > 3
            assert not branch.orbits[-1].symmetric


@pytest.mark.parametrize(
    ("own", "given", "start", "amplitude", "frequency", "path", "bounds"),
    [
        (
            Stops(),
            saltus.TwoStops(stiffness=0.2, damping=0.1),
            {"x": 0.0},
            0.8,
            1.0,
            AMPLITUDE,
            (0.6, 1.0),
        ),
    ],
)
def test_a_model_of_one_s_own_has_the_branch_of_the_one_with_a_mirror(
    own: Any,
    given: Any,
    start: dict[str, float],
    amplitude: float,
    frequency: float,
    path: str,
    bounds: tuple[float, float],
) -> None:
    branches = [
        saltus.continue_orbit(
            saltus.find_orbit(under(model, amplitude, frequency), **start), path, bounds
        )
        for model in (own, given)
    ]
    one, other = map(told, branches)
    assert "BPC" in {kind for kind, _ in one}
    assert [kind for kind, _ in one] == [kind for kind, _ in other]
    np.testing.assert_allclose(
        [value for _, value in one], [value for _, value in other], rtol=0, atol=1e-10
    )


def test_an_impact_pair_of_one_s_own_has_the_branch_of_the_library_s() -> None:
    """In other coordinates: the multipliers and the special points are the same."""
    own = saltus.find_orbit(under(Pair(), 0.2, 1.0, 0.6), case=0.0, mass=0.0, velocity=(0.0, 0.1))
    library = saltus.ImpactPair(mass_ratio=0.3, clearance=1.0, damping=0.02)
    given = saltus.find_orbit(under(library, 0.2, 1.0, 0.6), z=0.0, x=0.0, velocity=(0.0, 0.1))
    assert own.symmetric
    assert given.symmetric
    np.testing.assert_allclose(own.multipliers, given.multipliers, rtol=0, atol=1e-8)
    one, other = (saltus.continue_orbit(orbit, AMPLITUDE, (0.15, 0.25)) for orbit in (own, given))
    assert [kind for kind, _ in told(one)] == [kind for kind, _ in told(other)]
    np.testing.assert_allclose(
        [value for _, value in told(one)], [value for _, value in told(other)], rtol=0, atol=1e-9
    )
    assert [end.reason for end in one.ends] == [end.reason for end in other.ends]


@dataclass(frozen=True, kw_only=True)
class Squared(saltus.ContactModel):
    """A Duffing oscillator under the square of its load, which has half of the load's period."""

    coordinates: ClassVar[tuple[str, ...]] = ("x",)
    channels: ClassVar[tuple[str, ...]] = ("force",)
    contacts = (saltus.Contact(name="far", coordinate="x", position=-50.0),)

    def force(self, t: Any, x: Any, velocity: Any, load: Any) -> Any:
        return load.force(t) ** 2 - 0.3 * velocity + x - x**3


def test_a_doubling_under_a_load_that_acts_through_its_square_says_what_it_is() -> None:
    """The half period's own multiplier is -1 there: the orbit of half the period is that under
    F^2 = A^2 (1 - cos 2 W t) / 2, whose frequency is twice as large."""
    orbit = saltus.find_orbit(under(Squared(), 0.4, 0.7), x=1.0)
    branch = saltus.continue_orbit(orbit, AMPLITUDE, (0.3, 1.2))
    point = next(one for one in branch.special if one.kind == "BPC")
    assert "period doubling of an orbit of half the period" in point.note
    squared = point.parameter**2

    @dataclass(frozen=True, kw_only=True)
    class Direct(Squared):
        def force(self, t: Any, x: Any, velocity: Any, load: Any) -> Any:
            return load.force(t) - 0.3 * velocity + x - x**3

    half = saltus.Harmonic(0.5 * squared, mean=0.5 * squared, phase=-0.5 * np.pi)
    system = saltus.System(
        model=Direct(),
        load=saltus.Load(frequency=1.4, force=half),
        impact=saltus.NewtonImpact(e=0.7),
    )
    own = saltus.find_orbit(
        system, x=point.orbit.x, velocity=point.orbit.velocity, settle=0, period=1
    )
    assert np.abs(own.multipliers + 1.0).min() < 1e-6


def test_a_branch_that_comes_back_along_itself_is_seen_and_no_other(found: saltus.Branch) -> None:
    """Points between those of the branch, in the other direction; folds and the branch itself do
    not count."""
    points = found.points
    assert not any(comes_along_itself(points[: k + 1]) for k in range(len(points)))
    runs = [i for i in range(4, len(points) - 5) if points[i].curve is points[i - 4].curve]
    for i in (runs[0], runs[-1]):
        ways = [(points[i - k], points[i - k - 1]) for k in range(4)]
        back = [
            a.curve.solve(0.4 * a.place + 0.6 * b.place, -a.tangent)
            for a, b in ways
            if not np.array_equal(a.place, b.place)
        ]
        assert comes_along_itself([*points[: i + 1], *back])
        assert not comes_along_itself([*points[: i + 1], back[0]])
