"""A family of resting orbits along one parameter, through grazings, up to where a rest appears or is lost.

The multipliers are 0, so there is one orbit at each value of the parameter and the family never folds: the parameter itself is
the coordinate along it. It ends where a rest or a release is lost or a new one is born, at one of

* RL: at a release the load only just pulls (a double root of the contact acceleration), and the excursion shrinks to rest;
* CH: an accumulation of impacts ends just at the next release, and the rest before this release has no duration.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from saltus.continuation import (
    Continuation,
    Cut,
    End,
    Events,
    Evidence,
    NaturalCurve,
    Point,
    StepSettings,
    TestFunction,
    bisected,
)
from saltus.errors import SaltusError
from saltus.flow import Release, load_releases, peak_near
from saltus.orbits.branches.bifurcations import orbit_tests
from saltus.orbits.branches.special_point import OrbitEnd, SpecialKind, SpecialPoint, UserFunction
from saltus.orbits.equations.one_contact import OneContactEquations
from saltus.orbits.equations.resting import RestingOrbit, resting_orbit
from saltus.orbits.signature import Signature


@dataclass(frozen=True)
class RestingSettings:
    """How the events of a family of resting orbits are told apart from rounding errors, and how long its steps are."""

    smallest: float = 1e-7  # amplitude below which an orbit is about to shrink to rest
    narrow: float = 1e-12  # width, relative to the parameter, within which the loss of a release is located
    reach: float = 1e-9  # the first distance ahead, as a share of the range, at which the loss of a release is looked for
    behind: float = 0.05  # the peak of the pull is looked for from this phase before the release on, rad
    brief: float = 1e-3  # rad of phase: the rest that vanishes at the end of a family is shorter than this at the last orbit
    faint: float = 1e-3  # speed and clearance below which a change of the impacts is a grazing
    change: float = 0.06  # the change of extrema (rad) and of the phases of releases and rests that a step aims at
    most_change: float = 0.2  # the largest such change that is accepted
    first_step: float = 0.1  # the first step as a share of the longest
    short: float = 3e-6  # the shortest step, a millionth of the range: if even this fails the family ends


SETTINGS = RestingSettings()


@dataclass(frozen=True, eq=False)
class RestingPoint(Point):
    """A resting orbit as a point of its family."""

    orbit: RestingOrbit

    zero_type = SpecialPoint

    @property
    def residual(self) -> float:
        """The largest residual of the smooth segments between its impacts."""
        return self.orbit.residual


@dataclass(frozen=True, eq=False)
class RestingCurve(NaturalCurve[RestingPoint]):
    """The family near an orbit: at nearby values of the parameter, the orbits with the same sequence of releases."""

    near: RestingOrbit
    path: str
    bounds: tuple[float, float]

    @property
    def scale(self) -> float:  # type: ignore[override]
        """The unit of length along the parameter."""
        return (self.bounds[1] - self.bounds[0]) / 3.0

    def solution_at(self, value: float) -> RestingPoint | None:
        """The orbit at a nearby value; None if its sequence of releases is another one, or the motion cannot be followed."""
        try:
            found = _followed(self.near, self.path, value)
        except SaltusError:
            return None
        return self.point(found) if found is not None and _itinerary(found) == _itinerary(self.near) else None

    def point(self, orbit: RestingOrbit, value: float | None = None) -> RestingPoint:
        """An orbit as a point, at its own value of the parameter unless another one next to it is given."""
        place = np.array([float(orbit.system.get(self.path)) if value is None else value])
        return RestingPoint(replace(self, near=orbit), place, np.array([self.scale]), 0, orbit)

    def turn(self, a: RestingPoint, b: RestingPoint) -> float:
        """The largest difference between two orbits in their extrema and in the phases of their releases and rests."""
        one, other = a.orbit, b.orbit
        phases = [np.concatenate([o.releases, o.rests]) * o.frequency for o in (one, other)]
        turned = np.abs((phases[1] - phases[0] + math.pi) % (2.0 * math.pi) - math.pi).max()
        return max(float(turned), abs(other.highest - one.highest), abs(other.lowest - one.lowest))


def resting_steps(longest: float) -> StepSettings:
    """The control of the steps along a family."""
    first = SETTINGS.first_step * longest
    return StepSettings(SETTINGS.change, SETTINGS.most_change, longest, first, least=SETTINGS.short)


def first_point(orbit: RestingOrbit, path: str, bounds: tuple[float, float]) -> RestingPoint:
    """An orbit as the first point of its family, to be followed towards larger parameters."""
    begin = _followed(orbit, path, float(orbit.system.get(path)))
    assert begin is not None, "an orbit is followed to itself"
    return RestingCurve(begin, path, bounds).point(begin)


def _followed(orbit: RestingOrbit, path: str, value: float, index: int = 0) -> RestingOrbit | None:
    """The orbit at a value of a parameter that begins at the release which corresponds to release `index` of an orbit; None if
    the release is lost, or if the motion does not come back to it."""
    system = orbit.system.with_({path: value})
    phase, side = orbit.releases[index] * orbit.frequency, int(orbit.release_sides[index])
    frequency = system.load.frequency
    assert frequency is not None

    def apart(release: Release) -> float:
        return float(abs((release.time * frequency - phase + math.pi) % (2.0 * math.pi) - math.pi))

    nearest = min((release for release in load_releases(system) if release.side == side), key=apart, default=None)
    if nearest is None or apart(nearest) > SETTINGS.most_change:
        return None
    found = resting_orbit(OneContactEquations(system, Signature((), 1), (path,)), nearest, orbit.period)
    return found if found is not None and found.excursions[0, 0] == nearest.time else None


def _itinerary(orbit: RestingOrbit) -> tuple[int, bool, tuple[int, ...]]:
    return orbit.period, orbit.symmetric, tuple(map(int, orbit.release_sides))


def _shortest_rest(orbit: RestingOrbit) -> float:
    """The duration of the shortest rest, as a phase."""
    return float(orbit.rest_durations.min() * orbit.frequency)


@dataclass
class RestingEvents(Events):
    """The events along a family of resting orbits."""

    functions: dict[str, UserFunction]

    name = "family"

    def cut(self, point: RestingPoint, ahead: RestingPoint) -> Cut | None:
        """The orbit just beyond a change of the number of `touching` impacts; it is a grazing if that impact has no speed
        there."""
        count = len(point.orbit.touching)
        if count == len(ahead.orbit.touching):
            return None
        near, beyond = bisected(point, ahead.parameter, lambda other: len(other.orbit.touching) == count)
        after = near.curve.solution_at(beyond)
        assert after is not None, "an orbit with other impacts"
        few, many = sorted((near, after), key=lambda other: len(other.orbit.touching))
        speed, clearance = float(many.orbit.touching.min()), few.orbit.clearance
        graze = None
        if clearance < SETTINGS.faint and speed < SETTINGS.faint:
            evidence = Evidence(few.residual, (abs(beyond - near.parameter),), clearance, -speed, 0.0)
            graze = SpecialPoint(SpecialKind.GR, few, evidence)
        return Cut(after if point.tangent[-1] > 0.0 else after.turned(), graze)

    def tests(self, point: RestingPoint) -> Iterator[TestFunction]:
        """The margins of the model and the functions of the user."""
        return orbit_tests(point.orbit, self.functions)

    def ended(self, run: Continuation, ahead: RestingPoint, cut: Cut | None) -> End | None:
        """The end where the release is lost, looked for ahead of an orbit that has nearly shrunk to rest; None if a bound of the
        parameter comes first."""
        if ahead.orbit.amplitude >= SETTINGS.smallest:
            return None
        from scipy.optimize import brentq

        curve, orbit, value = ahead.curve, ahead.orbit, ahead.parameter

        def peak(at: float) -> float:
            system = orbit.system.with_({curve.path: at})
            turns = orbit.releases * orbit.frequency - SETTINGS.behind
            return min(peak_near(system, int(s), phi) for s, phi in zip(orbit.release_sides, turns, strict=True))

        reach, before = SETTINGS.reach * 3.0, peak(value)
        while reach < curve.reach(ahead):
            beyond = curve.ahead(ahead, reach)
            after = peak(beyond)
            if after < 0.0:
                narrow = SETTINGS.narrow * abs(beyond)
                lost = float(brentq(peak, value, beyond, xtol=narrow, rtol=1e-15))
                evidence = Evidence(orbit.residual, (SETTINGS.narrow * abs(lost),), before, after, peak(lost))
                run.special.append(SpecialPoint(SpecialKind.RL, curve.point(orbit, lost), evidence))
                side = int(orbit.release_sides[int(np.argmin(orbit.pulls))])
                what = "rest lasts" if len(orbit.releases) <= 2 else "the rests on both sides of that release are one"
                return End(OrbitEnd.NO_PULL, lost, SpecialKind.RL, f"{side:+d}, and {what}")
            reach *= 2.0
        return None

    def stalled(self, run: Continuation, point: RestingPoint, step: float) -> End:
        """The end of a family from whose last point no step leads on, with its kind, which the orbit beyond the end tells."""
        curve = point.curve
        last, beyond = bisected(point, curve.ahead(point, step), lambda other: curve.turn(point, other) <= SETTINGS.most_change)
        run.points.append(last if point.tangent[-1] > 0.0 else last.turned())
        orbit, value = last.orbit, last.parameter
        try:
            ways = (_followed(orbit, curve.path, beyond, i) for i in range(len(orbit.releases)))
            other = next((way for way in ways if way is not None), None)
        except SaltusError as error:
            return End(OrbitEnd.NO_ORBIT, value, detail=str(error))
        end, tests = _what_ends(last, other)
        if end.kind:
            run.special.append(SpecialPoint(end.kind, last, Evidence(last.residual, (abs(beyond - value),), *tests)))
        return end


def _what_ends(last: RestingPoint, other: RestingOrbit | None) -> tuple[End, tuple[float, float, float]]:
    """The end of a family, from its last orbit and the orbit beyond, with the test function before the end, after it and
    there."""
    orbit, value = last.orbit, last.parameter
    rest = _shortest_rest(orbit)
    if rest < SETTINGS.brief:
        return End(OrbitEnd.REST_VANISHES, value, SpecialKind.CH), (rest, 0.0, rest)
    if other is None:
        return End(OrbitEnd.OTHER_RESTS, value, detail=f"{orbit.releases[0]:.6g}"), (0.0, 0.0, 0.0)
    if (others := _shortest_rest(other)) < SETTINGS.brief:
        return End(OrbitEnd.REST_BEGINS, value, SpecialKind.CH), (0.0, others, 0.0)
    if _itinerary(other) == _itinerary(orbit):
        difference = last.curve.turn(last, last.curve.point(other))
        return End(OrbitEnd.LEAPS, value, detail=f"{difference:.3g}"), (0.0, 0.0, 0.0)
    if len(other.releases) == len(orbit.releases):
        return End(OrbitEnd.OTHER_RESTS, value, detail=f"{orbit.releases[0]:.6g}"), (0.0, 0.0, 0.0)
    reason = OrbitEnd.RELEASE_LOST if len(other.releases) < len(orbit.releases) else OrbitEnd.RELEASE_BORN
    return End(reason, value, SpecialKind.RL), (float(orbit.pulls.min()), float(other.pulls.min()), 0.0)
