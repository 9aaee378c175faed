"""Stable and unstable manifolds of saddle orbits in the stroboscopic section; the stable ones are
the curves between basins.

The stroboscopic map P takes a state at phase 0 to the state a forcing period later. A saddle orbit
of period q has q points x_i with P(x_i) = x_{i+1}. There P^q has the multipliers mu_s, mu_u with
abs(mu_s) < 1 < abs(mu_u) and directions v_s, v_u. The stable manifold of x_0 is the union of the
images of its fundamental segment

    x_0 + d rho^s v_s,    0 <= s <= 1,    rho = 1 / abs(mu_s),

under P^{-q}, P^{-2q}, ..., with small d of both signs; the images under the other powers of P^{-1}
lie on the manifolds of the other points. P^{-1} is the flow of the reversed system over a period,
event by event, as exact as the forward flow.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum
from typing import TYPE_CHECKING, Any

import numpy as np

from saltus.attractors.attractor import state_plane, state_units
from saltus.attractors.stroboscopic_section import section_states
from saltus.checks import answered, check_count, check_number
from saltus.errors import MotionError, ParameterError
from saltus.flow import last_states, motions_from, sensitivities
from saltus.orbits import PeriodicOrbit
from saltus.result import Result, result_dataset
from saltus.systems import (
    Box,
    System,
    Window,
    arguments_of,
    check_window,
    natural_units,
    reversed_system,
)

if TYPE_CHECKING:
    import xarray


@dataclass(frozen=True)
class GrowthSettings:
    """When an image of the segment is fine enough."""

    rounds: int = 40  # The largest number of rounds of refinement, each of which halves the gaps.
    # Gaps between parameters on the segment that are narrower than this are not halved.
    narrowest: float = 1e-13
    bend: float = 0.15  # The largest angle between neighbouring chords, rad.
    short: float = 0.1  # The angle at chords shorter than this, in steps, may be larger.
    # The image has a gap where neighbours stay farther apart than this, in steps.
    torn: float = 2.0
    # Points farther than this from the middle of the window, in half widths, are dropped.
    reach: float = 3.0


SETTINGS = GrowthSettings()
# states (n, 2) and forcing periods -> states (n, 2), nan where there are none
Flow = Callable[[np.ndarray, int], np.ndarray]
Segment = Callable[[np.ndarray], np.ndarray]  # places (n,) in [0, 1] -> states (n, 2)


class GrowthEnd(StrEnum):
    """Why a curve does not go on."""

    WINDOW = "all of it has left the window"
    PERIODS = "it was followed for all forcing periods asked for"
    POINTS = "it has as many points as were asked for"


@dataclass(frozen=True, eq=False)
class Level:
    """The image of the segment after `periods` forcing periods: points in order along it, nan if
    they have left the window.
    """

    periods: int
    places: np.ndarray  # (n,): the parameter on the segment, in [0, 1]
    points: np.ndarray  # (n, 2)


def has_left(window: Window, points: np.ndarray) -> np.ndarray:
    """Which points have left a window for good, (n,)."""
    return np.asarray(~(np.abs(window.scaled(points)) <= SETTINGS.reach).all(axis=1))


@dataclass(frozen=True)
class Growth:
    """A segment, the flow that maps it, the window in which its images are wanted, and how fine
    they are.
    """

    segment: Segment
    flow: Flow
    window: Window
    step: float  # the longest chord, in half widths of the window
    most: int  # the largest number of points of all images together

    def levels(self, count: int) -> tuple[list[Level], GrowthEnd]:
        """The images under 0, 1, 2, ..., `count` forcing periods, and why there are no more.

        Each is refined where it lies in the window. A new point begins on the segment and is
        followed through all periods, so it lies on the curve as exactly as the flow is known.
        """
        places = np.linspace(0.0, 1.0, 9)
        points = self.segment(places)
        done: list[Level] = []
        total = 0
        for periods in range(count + 1):
            if periods:
                points = self._advanced(points, 1)
            places, points, full = self._refined(periods, places, points, self.most - total)
            if full:
                return done, GrowthEnd.POINTS
            done.append(Level(periods, *self._parted(places, points)))
            total += len(places)
            if np.isnan(points).all():
                return done, GrowthEnd.WINDOW
        return done, GrowthEnd.PERIODS

    def _advanced(self, points: np.ndarray, periods: int) -> np.ndarray:
        result = np.full_like(points, np.nan)
        alive = np.flatnonzero(np.isfinite(points).all(axis=1))
        if alive.size and periods:
            result[alive] = self.flow(points[alive], periods)
            result[has_left(self.window, result)] = np.nan
        return result if periods else points

    def _refined(
        self, periods: int, places: np.ndarray, points: np.ndarray, room: int
    ) -> tuple[np.ndarray, np.ndarray, bool]:
        """Insert points until no two neighbours are farther apart than the step; the flag is True
        if `room` does not suffice.
        """
        for _ in range(SETTINGS.rounds):
            gaps = np.flatnonzero(self._coarse(places, points))
            if not gaps.size:
                return places, points, False
            if len(places) + gaps.size > room:
                return places, points, True
            between = 0.5 * (places[gaps] + places[gaps + 1])
            fresh = self._advanced(self.segment(between), periods)
            places, points = (
                np.insert(places, gaps + 1, between),
                np.insert(points, gaps + 1, fresh, axis=0),
            )
        return places, points, False

    def _parted(self, places: np.ndarray, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The points with nan between neighbours that refinement has not brought close together:
        the image has a gap there.
        """
        scaled = self.window.scaled(points)
        torn = (
            np.flatnonzero(np.abs(np.diff(scaled, axis=0)).max(axis=1) > SETTINGS.torn * self.step)
            + 1
        )
        torn = torn[_may_cross(scaled)[torn - 1] | (np.abs(scaled) <= 1.0).all(axis=1)[torn]]
        return np.insert(places, torn, places[torn]), np.insert(points, torn, np.nan, axis=0)

    def _coarse(self, places: np.ndarray, points: np.ndarray) -> np.ndarray:
        """Which chords between neighbours are to be divided, (n - 1,): long ones, bends, and those
        that may cross the window.
        """
        scaled = self.window.scaled(points)
        chords = np.diff(scaled, axis=0)
        length = np.hypot(chords[:, 0], chords[:, 1])
        inside = (np.abs(scaled) <= 1.0 + self.step).all(axis=1)
        near = inside[:-1] | inside[1:]
        bent = np.zeros(len(length), dtype=bool)
        with np.errstate(invalid="ignore"):
            long = (length > self.step) | np.isnan(length)
            angle = np.arctan2(chords[:, 1], chords[:, 0])
            turn = np.abs((np.diff(angle) + np.pi) % (2.0 * np.pi) - np.pi) > SETTINGS.bend
            bent[:-1] |= turn
            bent[1:] |= turn
            bent &= length > SETTINGS.short * self.step
        crossing = ~near & long & _may_cross(scaled)
        return np.asarray(
            ((near & (long | bent)) | crossing) & (np.diff(places) > SETTINGS.narrowest)
        )


def _may_cross(scaled: np.ndarray) -> np.ndarray:
    """Which chords with both ends outside the window may pass through it: not those whose ends lie
    beyond one of its sides.
    """
    beyond = np.stack(
        [scaled[:, 0] > 1, scaled[:, 0] < -1, scaled[:, 1] > 1, scaled[:, 1] < -1], axis=1
    )
    same = (beyond[:-1] & beyond[1:]).any(axis=1)
    known = np.isfinite(scaled).all(axis=1)
    return np.asarray(~same & known[:-1] & known[1:])


@dataclass(frozen=True)
class ManifoldSettings:
    """Where manifolds begin, and how exactly they are followed."""

    # d, from the saddle, in natural units: the tangent misses the manifold by about d^2, and its
    # images by less and less.
    offset: float = 1e-6
    tolerance: float = 1e-13  # The error of a step of the motions along a manifold.
    hyperbolic: float = 1e-6  # The least difference of the multipliers' moduli from 1.


MANIFOLDS = ManifoldSettings()
HALF_WIDTH = 3.0  # of the window of the state plane if none is given, in natural units


def plane_window(window: Box | None, system: System) -> Window:
    """A window of the state plane; for None that with half widths of 3 natural units around the
    contact, or around 0 without one."""
    return check_window(window, system, HALF_WIDTH)


@dataclass(frozen=True, eq=False)
class ManifoldBranch:
    """One branch of a manifold of one point of the orbit: from the orbit on, nan where it is
    outside the window.
    """

    point: int  # the index of the orbit's point, `orbit_states[point]`
    side: int  # +1 or -1: along or against the direction
    states: np.ndarray  # (n, 2): coordinate and velocity at phase 0
    # (n,): s + (number of forcing periods) / q; the map (for a stable manifold its inverse) adds 1
    # / q
    place: np.ndarray
    end: GrowthEnd  # why it does not go on


@dataclass(frozen=True, eq=False, repr=False)
class Manifold(Result):
    """The stable or unstable manifold of a saddle orbit.

    Attributes
    ----------
    orbit
        The saddle orbit.
    stable
        Whether it is the stable manifold.
    multiplier
        mu_s or mu_u, over the orbit's period.
    orbit_states
        (q, 2): the orbit at phase 0.
    directions
        (q, 2): unit vectors along the manifold at these states.
    branches
        The branches to both sides of each point of the orbit.

    Examples
    --------
    >>> saddle = next(o for o in branch.at(0.88) if not o.stable)
    >>> saltus.stable_manifold(saddle, window=((-1.0, 1.0), (-1.0, 1.0))).stable
    True
    """

    orbit: PeriodicOrbit
    stable: bool
    multiplier: float
    orbit_states: np.ndarray
    directions: np.ndarray
    branches: tuple[ManifoldBranch, ...]

    @property
    def states(self) -> np.ndarray:
        """All branches in a row, (n, 2), with nan between them: as lines are drawn."""
        gap = np.full((1, 2), np.nan)
        return np.concatenate([part for branch in self.branches for part in (branch.states, gap)])

    @property
    def length(self) -> float:
        """The length of what was computed, in the units of the section."""
        chords = np.diff(self.states, axis=0)
        return float(np.nansum(np.hypot(chords[:, 0], chords[:, 1])))

    def to_xarray(self) -> xarray.Dataset:
        """The curves over `place`, nan between branches, and the orbit over `point`."""
        plane = state_plane(self.orbit.system)
        unit = state_units(self.orbit.system)
        columns: dict[str, tuple[Any, ...]] = {}
        for i, name in enumerate(plane):
            columns[name] = (
                "place",
                self.states[:, i],
                unit[name],
                f"{name} at phase 0 along the manifold",
            )
        for i, name in enumerate(plane):
            columns[f"orbit_{name}"] = (
                "point",
                self.orbit_states[:, i],
                unit[name],
                f"{name} of the orbit at phase 0",
            )
            columns[f"direction_{name}"] = (
                "point",
                self.directions[:, i],
                "1",
                f"{name} of the manifold's direction there",
            )
        facts = {
            "stable": int(self.stable),
            "multiplier": self.multiplier,
            "length": self.length,
            "plane": list(plane),
        }
        return result_dataset("manifold", columns, None, self.orbit.system, **facts)

    def __repr__(self) -> str:
        kind = "stable" if self.stable else "unstable"
        return (
            f"Manifold({kind}, of {self.orbit!r}, multiplier {self.multiplier:.6g}, length "
            f"{self.length:.4g})"
        )


@answered
def stable_manifold(
    orbit: PeriodicOrbit,
    *,
    window: Box | None = None,
    periods: int = 40,
    step: float = 0.01,
    points: int = 100_000,
) -> Manifold:
    """The states that the flow takes to a saddle orbit, as curves in the section at phase 0, at
    which basins meet.

    Parameters
    ----------
    orbit
        A saddle orbit: one multiplier is inside the unit circle and one outside.
    window
        ((least, largest coordinate), (least, largest velocity)), in which the curves are wanted;
        they are followed outside it up to three half widths from its middle. By default 3 natural
        units to both sides of the contact.
    periods
        The number of forcing periods for which the curves are followed backward.
    step
        The longest distance between neighbouring points in the window, in its half widths; they are
        closer in bends.
    points
        The largest number of points for each of the two sides.

    Raises
    ------
    ParameterError
        An orbit that is no saddle, or whose system cannot be run backward (v+ = e v- with e > 0
        can).
    MotionError
        The orbit is at the contact at phase 0, where the map has no derivative.

    Examples
    --------
    >>> saddle = next(o for o in branch.at(0.88) if not o.stable)
    >>> curve = saltus.stable_manifold(saddle, window=((-1.0, 1.0), (-1.0, 1.0)))
    >>> curve.states.shape[1]
    2
    """
    return _manifold(orbit, True, window, periods, step, points)


@answered
def unstable_manifold(
    orbit: PeriodicOrbit,
    *,
    window: Box | None = None,
    periods: int = 40,
    step: float = 0.01,
    points: int = 100_000,
) -> Manifold:
    """The states that the backward flow takes to a saddle orbit: as `stable_manifold`, with the
    time reversed.

    Parameters
    ----------
    orbit
        A saddle orbit.
    window
        A pair (low, high) for the coordinate and one for the velocity; by default 3 natural units to
        both sides of the contact.
    periods
        For how many forcing periods it is followed.
    step
        The longest distance between two points, in units of the window's half widths.
    points
        The largest number of points for each of the two sides.

    Examples
    --------
    >>> saddle = next(o for o in branch.at(0.88) if not o.stable)
    >>> curve = saltus.attractors.unstable_manifold(saddle, window=((-1.0, 1.0), (-1.0, 1.0)))
    >>> curve.states.shape[1]
    2
    """
    return _manifold(orbit, False, window, periods, step, points)


def _manifold(
    orbit: PeriodicOrbit, stable: bool, window: Any, periods: int, step: float, points: int
) -> Manifold:
    check_count("periods", periods, 1)
    check_count("points", points, 100)
    check_number("step", step, above=0.0, at_most=1.0)
    if not is_saddle(orbit):
        raise ParameterError(
            f"only a saddle has such manifolds; this orbit has the multipliers {orbit.multipliers}",
            "orbit",
        )
    system = orbit.system
    q = orbit.period
    area = plane_window(window, system)
    flow = _flow(reversed_system(system) if stable else system, stable)
    states = np.roll(section_states(system, np.array([orbit.state]), q)[0], 1, axis=0)
    multiplier, directions = _directions(system, states, stable)
    ratio = 1.0 / abs(multiplier) if stable else abs(multiplier)
    size = np.hypot(*(directions[0] / natural_units(system).state))
    offset = MANIFOLDS.offset / size * directions[0]
    branches: list[ManifoldBranch] = []
    for side in (1, -1):
        segment = _segment(states[0], side * offset, ratio)
        levels, end = Growth(segment, flow, area, step, points).levels(periods)
        branches += _branches(levels, q, side, stable, multiplier < 0.0, end)
    return Manifold(orbit, stable, multiplier, states, directions, tuple(branches))


def is_saddle(orbit: PeriodicOrbit) -> bool:
    """Whether an orbit has one multiplier inside the unit circle and one outside."""
    size = np.sort(np.abs(orbit.multipliers))
    return len(size) == 2 and bool(
        0.0 < size[0] < 1.0 - MANIFOLDS.hyperbolic and 1.0 + MANIFOLDS.hyperbolic < size[1] < np.inf
    )


def _directions(system: System, states: np.ndarray, stable: bool) -> tuple[float, np.ndarray]:
    """The multiplier and the unit vector along the manifold at each state of the orbit, carried on
    by the map's derivative.
    """
    maps = []
    for state in states:
        found = sensitivities(
            system, **arguments_of(system, state), periods=1, tol=MANIFOLDS.tolerance, dense=False
        )
        if found.undefined:
            raise MotionError(f"the orbit's map has no derivative at phase 0: {found.undefined}")
        maps.append(found.state)
    product = np.linalg.multi_dot([*reversed(maps)]) if len(maps) > 1 else maps[0]
    values, vectors = np.linalg.eig(product)
    chosen = int(np.argmin(np.abs(values)) if stable else np.argmax(np.abs(values)))
    directions = [np.real(vectors[:, chosen])]
    for step in maps[:-1]:
        directions.append(step @ directions[-1])
    unit = np.array([v / np.hypot(*v) for v in directions])
    return float(np.real(values[chosen])), unit


def _segment(point: np.ndarray, offset: np.ndarray, ratio: float) -> Segment:
    return lambda places: point + ratio ** np.asarray(places)[:, None] * offset


def _flow(system: System, backward: bool) -> Any:
    """The stroboscopic map, or its inverse by the reversed system, whose velocities have the other
    sign.
    """
    sign = np.array([1.0, -1.0 if backward else 1.0])

    def flow(states: np.ndarray, periods: int) -> np.ndarray:
        result = motions_from(
            system, states * sign, periods=periods, sample=(), tol=MANIFOLDS.tolerance
        )
        ends = sign * last_states(system, result)
        ends[result["periods"].values < periods] = np.nan
        return np.asarray(ends)

    return flow


def _branches(
    levels: list[Level], q: int, side: int, stable: bool, turns: bool, end: GrowthEnd
) -> list[ManifoldBranch]:
    """The levels joined to the branches of each point of the orbit, from the orbit on.

    If the multiplier is negative, the branches change sides each time that the orbit is back at
    point 0.
    """
    curves = []
    for first in range(min(q, len(levels))):
        own = levels[first::q]
        point = (-first if stable else first) % q
        parts: dict[int, list[Level]] = {}
        for level in own:
            rounds = -(-level.periods // q) if stable else level.periods // q
            parts.setdefault(side * (-1) ** rounds if turns else side, []).append(level)
        for sign, chosen in parts.items():
            states = np.concatenate([level.points for level in chosen])
            place = np.concatenate([level.places + level.periods / q for level in chosen])
            curves.append(ManifoldBranch(point, sign, states, place, end))
    return curves
