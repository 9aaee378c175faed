"""A family of resting orbits along one parameter, through grazings, up to where its rests are no longer what they were.

The multipliers are 0, so there is one orbit at each value of the parameter and the family never folds: it is followed by
the parameter itself. It ends where a rest or a release is lost or a further one is born, at one of

* RL, a release that the load only touches (a double root of the contact acceleration): the excursion after it shrinks to rest;
* CH, the impacts die away only at the instant of the next release: the rest before it has no duration.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from typing import TYPE_CHECKING

import numpy as np

from saltus.errors import SaltusError
from saltus.flow import Release, load_releases, peak_near
from saltus.orbits.branch import Branch
from saltus.orbits.orbit import PeriodicOrbit
from saltus.orbits.path import Curve, Point
from saltus.orbits.problem import Problem
from saltus.orbits.resting import RestingOrbit, resting_orbit
from saltus.orbits.signature import Signature
from saltus.orbits.special import Evidence, SpecialPoint, UserFunction
from saltus.orbits.walk import SMALLEST

if TYPE_CHECKING:
    import xarray

CHANGE = 0.06  # of extrema, in radians, and of the phases of releases and rests in a step, that is aimed at,
MOST_CHANGE = 0.2  # and the most that is accepted
FIRST_STEP = 0.1  # of the longest step
NARROW = 1e-12  # to within which, relative to the parameter, special points and ends are located
SHORT = 1e-6  # of the range: a step shorter than that is cut short by an end
BEHIND = 0.05  # rad before a release, from where its peak is looked for as the parameter changes
BRIEF = 1e-3  # rad of phase: a rest so short is the one that vanishes
FAINT = 1e-3  # speed and clearance by which a touch is told from other changes of the impacts
MOST_POINTS = 20_000


@dataclass(frozen=True, eq=False)
class RestingPoint(Point):
    """A point of a family of resting orbits: its curve is the parameter itself."""

    resting: RestingOrbit

    @cached_property
    def orbit(self) -> PeriodicOrbit:
        """The orbit."""
        return self.resting

    def turned(self) -> RestingPoint:
        """The same point, followed the other way."""
        return replace(self, tangent=-self.tangent)


@dataclass(frozen=True, eq=False, repr=False)
class RestingBranch(Branch):
    """A family of resting orbits; `special` holds grazings (GR), the zeros of margins and functions, and the ends RL and CH."""

    def at(self, value: float) -> list[PeriodicOrbit]:
        """The orbit of the family at a value of the parameter, in a list, which is empty outside the family."""
        if not self.parameters.min() <= value <= self.parameters.max():
            return []
        nearest = self.points[int(np.argmin(np.abs(self.parameters - value)))]
        assert isinstance(nearest, RestingPoint)
        orbit = orbit_at(nearest.resting, self.path, value)
        return [] if orbit is None else [orbit]

    def to_xarray(self) -> xarray.Dataset:
        """The family as a dataset, see `dataset.py`, with each orbit's `releases`, `rests` (times) and `rest_share`."""
        from saltus.orbits.branch_dataset import branch_dataset

        orbits = [point.resting for point in self.points if isinstance(point, RestingPoint)]
        data = branch_dataset(self)
        data["releases"] = (("point", "rest"), np.array([orbit.releases for orbit in orbits]))
        data["rests"] = (("point", "rest"), np.array([orbit.rests for orbit in orbits]))
        data["rest_share"] = ("point", np.array([orbit.rest_share for orbit in orbits]))
        return data


def orbit_at(orbit: RestingOrbit, path: str, value: float) -> RestingOrbit | None:
    """The orbit that continues another one at a value of a parameter nearby; None where its rests are others or it ends."""
    found = _followed(orbit, path, value)
    return found if found is not None and _itinerary(found) == _itinerary(orbit) else None


def _followed(orbit: RestingOrbit, path: str, value: float, index: int = 0) -> RestingOrbit | None:
    """The orbit that the motion from one of the releases leads to at a value of a parameter, through that release again."""
    system = orbit.system.with_({path: value})
    phase, side = orbit.releases[index] * orbit.frequency, int(orbit.release_sides[index])
    frequency = system.load.frequency
    assert frequency is not None

    def apart(release: Release) -> float:
        return abs((release.time * frequency - phase + math.pi) % (2.0 * math.pi) - math.pi)

    nearest = min((release for release in load_releases(system) if release.side == side), key=apart, default=None)
    if nearest is None or apart(nearest) > MOST_CHANGE:
        return None
    found = resting_orbit(Problem(system, Signature((), 1), (path,)), nearest, orbit.period)
    return found if found is not None and found.excursions[0, 0] == nearest.time else None


def _itinerary(orbit: RestingOrbit) -> tuple[int, bool, tuple[int, ...]]:
    return orbit.period, orbit.symmetric, tuple(map(int, orbit.release_sides))


def _change(a: RestingOrbit, b: RestingOrbit) -> float:
    """How much two orbits of one itinerary differ: in extrema, and in the phases of releases and rests."""
    turns = [np.concatenate([o.releases, o.rests]) * o.frequency for o in (a, b)]
    turned = np.abs((turns[1] - turns[0] + math.pi) % (2.0 * math.pi) - math.pi).max()
    return max(float(turned), abs(b.highest - a.highest), abs(b.lowest - a.lowest))


def _margin(name: str, orbit: PeriodicOrbit) -> float:
    return orbit.margins[name]


def _keeps_sign(test: UserFunction, value: float, orbit: RestingOrbit | None) -> bool:
    return orbit is not None and test(orbit) * value > 0.0


def continue_resting(
    orbit: RestingOrbit,
    path: str,
    bounds: tuple[float, float],
    functions: dict[str, UserFunction],
    step: float,
    progress: Callable[[float], object] | None,
) -> RestingBranch:
    """The family of a resting orbit along a parameter, both ways, as `continue_orbit` follows others."""
    value = float(orbit.system.get(path))
    begin = _followed(orbit, path, value)
    assert begin is not None, "an orbit is followed to itself"
    walks = []
    for bound in bounds:
        walk = _Walk(path, bound, bounds[1] - bounds[0], step, functions, progress)
        walk.follow(begin)
        walks.append(walk)
    back, ahead = walks
    points = (*(point.turned() for point in reversed(back.points[1:])), *ahead.points)
    return RestingBranch(path, points, (*reversed(back.special), *ahead.special), (back.reason, ahead.reason))


@dataclass
class _Walk:
    """One direction of a family while it is being followed."""

    path: str
    bound: float
    span: float
    step: float
    functions: dict[str, UserFunction]
    progress: Callable[[float], object] | None
    points: list[RestingPoint] = field(default_factory=list)
    special: list[SpecialPoint] = field(default_factory=list)
    reason: str = ""

    def follow(self, orbit: RestingOrbit) -> None:
        """Follow the family until it ends."""
        value = float(orbit.system.get(self.path))
        direction = 1.0 if self.bound > value else -1.0
        longest = self.step * self.span / 3.0
        step = FIRST_STEP * longest
        self._add(value, orbit)
        while not self.reason:
            if value == self.bound:
                self.reason = f"bound {value:g}"
                break
            if orbit.amplitude < SMALLEST and self._shrunk(value, orbit, direction):
                break
            ahead = self.bound if abs(self.bound - value) <= step else value + direction * step
            following = self._orbit_at(orbit, ahead)
            change = math.inf if following is None else _change(orbit, following)
            if following is None or change > MOST_CHANGE:
                step = 0.4 * abs(ahead - value)
                if step < SHORT * self.span:
                    self._end(value, orbit, ahead)
                continue
            step = min(longest, step * min(2.0, max(0.5, CHANGE / max(change, 1e-3))))
            value, orbit = self._note(value, orbit, ahead, following)
            self._add(value, orbit)
            if self.progress is not None:
                self.progress(value)
            if len(self.points) > MOST_POINTS:
                self.reason = f"more than {MOST_POINTS} points"

    def _add(self, value: float, orbit: RestingOrbit) -> None:
        curve = Curve(orbit.problem, self.span / 3.0, orbit.symmetric)
        tangent = np.append(np.zeros(orbit.solution.unknowns.size), math.copysign(curve.scale, self.bound - value))
        self.points.append(RestingPoint(curve, orbit.solution, tangent, orbit))

    def _orbit_at(self, orbit: RestingOrbit, value: float) -> RestingOrbit | None:
        """`orbit_at`, or None where the motion cannot be followed or the system refuses the value."""
        try:
            return orbit_at(orbit, self.path, value)
        except SaltusError:
            return None

    def _special(
        self, kind: str, orbit: RestingOrbit, width: float, tests: tuple[float, float, float], value: float | None = None
    ) -> None:
        """Keep a special point, at the parameter of its orbit or at a value next to it."""
        value = float(orbit.system.get(self.path)) if value is None else value
        curve = Curve(orbit.problem, self.span / 3.0, orbit.symmetric)
        tangent = np.append(np.zeros(orbit.solution.unknowns.size), curve.scale)
        point = RestingPoint(curve, orbit.solution, tangent, orbit)
        self.special.append(SpecialPoint(kind, orbit, value, Evidence(orbit.residual, width, *tests), point))

    def _note(self, value: float, orbit: RestingOrbit, ahead: float, following: RestingOrbit) -> tuple[float, RestingOrbit]:
        """Locate what is special on a step; returns where it ends, at a grazing with the orbit just beyond it."""
        if len(orbit.touching) != len(following.touching):
            near, beyond = self._bisect(value, orbit, ahead, lambda o: o is not None and len(o.touching) == len(orbit.touching))
            after = self._orbit_at(near, beyond)
            assert after is not None, "an orbit with other impacts"
            few, many = sorted((near, after), key=lambda o: len(o.touching))
            if few.clearance < FAINT and many.touching.min() < FAINT:
                self._special(
                    "GR", few, abs(beyond - float(near.system.get(self.path))), (few.clearance, -many.touching.min(), 0.0)
                )
            ahead, following = beyond, after
        tests: dict[str, UserFunction] = {name: partial(_margin, name) for name in orbit.margins}
        for name, test in (tests | self.functions).items():
            before, after_ = test(orbit), test(following)
            if before * after_ < 0.0:
                near, beyond = self._bisect(value, orbit, ahead, partial(_keeps_sign, test, before))
                self._special(name, near, abs(beyond - float(near.system.get(self.path))), (before, after_, test(near)))
        return ahead, following

    def _note_touch(self, near: RestingOrbit, after: RestingOrbit) -> None:
        """A grazing between two orbits hardly apart, if a touch is what tells their impacts apart."""
        few, many = sorted((near, after), key=lambda o: len(o.touching))
        speed, width = float(many.touching.min()), abs(float(after.system.get(self.path)) - float(near.system.get(self.path)))
        if few.clearance < FAINT and speed < FAINT:
            self._special("GR", few, width, (few.clearance, -speed, few.clearance))

    def _bisect(
        self, value: float, orbit: RestingOrbit, ahead: float, holds: Callable[[RestingOrbit | None], bool]
    ) -> tuple[RestingOrbit, float]:
        """The last orbit for which something holds, and the first value, hardly beyond, for which it does not."""
        while abs(ahead - value) > NARROW * max(abs(value), abs(ahead)):
            middle = 0.5 * (value + ahead)
            between = self._orbit_at(orbit, middle)
            if between is not None and holds(between):
                value, orbit = middle, between
            else:
                ahead = middle
        return orbit, ahead

    def _shrunk(self, value: float, orbit: RestingOrbit, direction: float) -> bool:
        """End where the release is lost, ahead of an orbit that has all but shrunk to rest; False if the bound is before."""

        def peak(at: float) -> float:
            system = orbit.system.with_({self.path: at})
            turns = orbit.releases * orbit.frequency - BEHIND
            return min(peak_near(system, int(s), phi) for s, phi in zip(orbit.release_sides, turns, strict=True))

        from scipy.optimize import brentq

        reach, before = 1e-9 * self.span, peak(value)
        while reach < abs(self.bound - value):
            ahead = value + direction * reach
            after = peak(ahead)
            if after < 0.0:
                lost = float(brentq(peak, value, ahead, xtol=NARROW * abs(ahead), rtol=1e-15))
                self._lost(lost, orbit, (before, after, peak(lost)))
                return True
            reach *= 2.0
        return False

    def _lost(self, lost: float, orbit: RestingOrbit, tests: tuple[float, float, float]) -> None:
        side = int(orbit.release_sides[int(np.argmin(orbit.pulls))])
        self._special("RL", orbit, NARROW * abs(lost), tests, lost)
        self.reason = (
            f"shrinks to rest at {lost:.10g}: from there on the load no longer pulls the contact open on side {side:+d}, "
            + ("and rest lasts" if len(orbit.releases) <= 2 else "and the rests on both sides of that release are one")
        )

    def _end(self, value: float, orbit: RestingOrbit, ahead: float) -> None:
        """Locate the end of the family between an orbit and a value at which it is no more, and say what lies beyond."""
        last, beyond = self._bisect(value, orbit, ahead, lambda o: o is not None and _change(orbit, o) <= MOST_CHANGE)
        value = float(last.system.get(self.path))
        self._add(value, last)
        width, rest = abs(beyond - value), float(last.rest_durations.min() * last.frequency)
        try:
            ways = (_followed(last, self.path, beyond, i) for i in range(len(last.releases)))
            other = next((way for way in ways if way is not None), None)
        except SaltusError as error:
            self.reason = f"beyond {value:.10g} there is no such motion: {error}"
            return
        others = math.inf if other is None else float(other.rest_durations.min() * other.frequency)
        if rest < BRIEF:
            self._special("CH", last, width, (rest, 0.0, rest))
            self.reason = (
                f"at {value:.10g} a rest has no duration left; beyond, the load pulls before the impacts have died away: "
                "find_orbit finds the orbit there"
            )
        elif others < BRIEF:
            self._special("CH", last, width, (0.0, others, 0.0))
            self.reason = (
                f"at {value:.10g} a further rest begins, as impacts die away before a release: find_orbit finds the orbit beyond"
            )
        elif other is not None and _itinerary(other) == _itinerary(last):
            self.reason = (
                f"at {value:.10g} the orbit leaps to one that differs by {_change(last, other):.3g}: find_orbit finds it"
            )
        elif other is None or len(other.releases) == len(last.releases):
            self.reason = f"beyond {value:.10g} no orbit with these rests follows from the release at {last.releases[0]:.6g}"
        else:
            fewer = len(other.releases) < len(last.releases)
            self._special("RL", last, width, (float(last.pulls.min()), float(other.pulls.min()), 0.0))
            self.reason = f"at {value:.10g} a release is {'lost' if fewer else 'born'}: find_orbit finds the orbit beyond"
