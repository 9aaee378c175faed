"""Growing a curve: the images of a short segment under 1, 2, ... forcing periods, refined where they stretch or bend."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from saltus.window import Window


@dataclass(frozen=True)
class GrowthSettings:
    """When an image of the segment is fine enough."""

    rounds: int = 40  # The largest number of rounds of refinement, each of which halves the gaps.
    narrowest: float = 1e-13  # Gaps between parameters on the segment that are narrower than this are not halved.
    bend: float = 0.15  # The largest angle between neighbouring chords, rad.
    short: float = 0.1  # The angle at chords shorter than this, in steps, may be larger.
    torn: float = 2.0  # The image has a gap where neighbours stay farther apart than this, in steps.
    reach: float = 3.0  # Points farther than this from the middle of the window, in half widths, are dropped.


SETTINGS = GrowthSettings()
Flow = Callable[[np.ndarray, int], np.ndarray]  # states (n, 2) and forcing periods -> states (n, 2), nan where there are none
Segment = Callable[[np.ndarray], np.ndarray]  # places (n,) in [0, 1] -> states (n, 2)


class GrowthEnd(StrEnum):
    """Why a curve does not go on."""

    WINDOW = "all of it has left the window"
    PERIODS = "it was followed for all forcing periods asked for"
    POINTS = "it has as many points as were asked for"


@dataclass(frozen=True, eq=False)
class Level:
    """The image of the segment after `periods` forcing periods: points in order along it, nan if they have left the window."""

    periods: int
    places: np.ndarray  # (n,): the parameter on the segment, in [0, 1]
    points: np.ndarray  # (n, 2)


def has_left(window: Window, points: np.ndarray) -> np.ndarray:
    """Which points have left a window for good, (n,)."""
    return np.asarray(~(np.abs(window.scaled(points)) <= SETTINGS.reach).all(axis=1))


@dataclass(frozen=True)
class Growth:
    """A segment, the flow that maps it, the window in which its images are wanted, and how fine they are."""

    segment: Segment
    flow: Flow
    window: Window
    step: float  # the longest chord, in half widths of the window
    most: int  # the largest number of points of all images together

    def levels(self, count: int) -> tuple[list[Level], GrowthEnd]:
        """The images under 0, 1, 2, ..., `count` forcing periods, and why there are no more.

        Each is refined where it lies in the window. A new point begins on the segment and is followed through all periods, so it
        lies on the curve as exactly as the flow is known.
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

    def _refined(self, periods: int, places: np.ndarray, points: np.ndarray, room: int) -> tuple[np.ndarray, np.ndarray, bool]:
        """Insert points until no two neighbours are farther apart than the step; the flag is True if `room` does not suffice."""
        for _ in range(SETTINGS.rounds):
            gaps = np.flatnonzero(self._coarse(places, points))
            if not gaps.size:
                return places, points, False
            if len(places) + gaps.size > room:
                return places, points, True
            between = 0.5 * (places[gaps] + places[gaps + 1])
            fresh = self._advanced(self.segment(between), periods)
            places, points = np.insert(places, gaps + 1, between), np.insert(points, gaps + 1, fresh, axis=0)
        return places, points, False

    def _parted(self, places: np.ndarray, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The points with nan between neighbours that refinement has not brought close together: the image has a gap there."""
        scaled = self.window.scaled(points)
        torn = np.flatnonzero(np.abs(np.diff(scaled, axis=0)).max(axis=1) > SETTINGS.torn * self.step) + 1
        torn = torn[_may_cross(scaled)[torn - 1] | (np.abs(scaled) <= 1.0).all(axis=1)[torn]]
        return np.insert(places, torn, places[torn]), np.insert(points, torn, np.nan, axis=0)

    def _coarse(self, places: np.ndarray, points: np.ndarray) -> np.ndarray:
        """Which chords between neighbours are to be divided, (n - 1,): long ones, bends, and those that may cross the window."""
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
        return np.asarray(((near & (long | bent)) | crossing) & (np.diff(places) > SETTINGS.narrowest))


def _may_cross(scaled: np.ndarray) -> np.ndarray:
    """Which chords with both ends outside the window may pass through it: not those whose ends lie beyond one of its sides."""
    beyond = np.stack([scaled[:, 0] > 1, scaled[:, 0] < -1, scaled[:, 1] > 1, scaled[:, 1] < -1], axis=1)
    same = (beyond[:-1] & beyond[1:]).any(axis=1)
    known = np.isfinite(scaled).all(axis=1)
    return np.asarray(~same & known[:-1] & known[1:])
