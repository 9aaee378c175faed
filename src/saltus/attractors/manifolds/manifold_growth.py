"""Growing a curve: the image of a short segment under one forcing period after another, refined where it stretches or bends."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

ROUNDS = 40  # of refinement: each may halve the gaps
NARROWEST = 1e-13  # between two parameters on the segment
BEND = 0.15  # rad, between two chords that are longer than a tenth of the step
SHORT = 0.1  # of the step: shorter chords are not divided for their bend
TORN = 2.0  # steps
REACH = 3.0  # half widths of the window beyond which points are dropped

Flow = Callable[[np.ndarray, int], np.ndarray]  # states (n, 2) and forcing periods -> states (n, 2), nan where there are none


@dataclass(frozen=True, eq=False)
class Level:
    """The image of the segment after `periods` forcing periods: points in order along it, nan where they have left."""

    periods: int
    places: np.ndarray  # (n,): the parameter on the segment, in [0, 1]
    points: np.ndarray  # (n, 2)


@dataclass(frozen=True)
class Window:
    """The rectangle of the section that is to be covered, and how finely."""

    centre: np.ndarray  # (2,)
    half: np.ndarray  # (2,), half widths
    step: float  # the longest chord, in half widths

    def scaled(self, points: np.ndarray) -> np.ndarray:
        """Points in half widths from the centre."""
        scaled: np.ndarray = (points - self.centre) / self.half
        return scaled

    def far(self, points: np.ndarray) -> np.ndarray:
        """Which points have left for good, (n,)."""
        return ~(np.abs(self.scaled(points)) <= REACH).all(axis=1)


def grow(
    segment: Callable[[np.ndarray], np.ndarray], flow: Flow, levels: int, window: Window, most: int
) -> tuple[list[Level], str]:
    """The images of a segment, a function of [0, 1], under 0, 1, 2, ... forcing periods, and why there are no more.

    Each is as fine as the window asks for: a new point begins on the segment and is followed through all periods, so it lies on
    the curve as exactly as the flow is known.
    """
    places = np.linspace(0.0, 1.0, 9)
    points = segment(places)
    done: list[Level] = []
    total = 0
    for periods in range(levels + 1):
        if periods:
            points = _advance(flow, points, 1, window)
        places, points, full = _refine(segment, flow, periods, places, points, window, most - total)
        if full:
            return done, f"{most} points"
        done.append(Level(periods, *_parted(places, points, window)))
        total += len(places)
        if np.isnan(points).all():
            return done, "all of it has left the window"
    return done, f"{levels} forcing periods"


def _advance(flow: Flow, points: np.ndarray, periods: int, window: Window) -> np.ndarray:
    result = np.full_like(points, np.nan)
    alive = np.flatnonzero(np.isfinite(points).all(axis=1))
    if alive.size:
        result[alive] = flow(points[alive], periods)
        result[window.far(result)] = np.nan
    return result


def _refine(
    segment: Callable[[np.ndarray], np.ndarray],
    flow: Flow,
    periods: int,
    places: np.ndarray,
    points: np.ndarray,
    window: Window,
    most: int,
) -> tuple[np.ndarray, np.ndarray, bool]:
    """Insert points until no two neighbours are farther apart than the step; True where there is no room for more."""
    for _ in range(ROUNDS):
        gaps = np.flatnonzero(_coarse(places, points, window))
        if not gaps.size:
            return places, points, False
        if len(places) + gaps.size > most:
            return places, points, True
        between = 0.5 * (places[gaps] + places[gaps + 1])
        fresh = segment(between)
        fresh = _advance(flow, fresh, periods, window) if periods else fresh
        places, points = np.insert(places, gaps + 1, between), np.insert(points, gaps + 1, fresh, axis=0)
    return places, points, False


def _parted(places: np.ndarray, points: np.ndarray, window: Window) -> tuple[np.ndarray, np.ndarray]:
    """The points with nan between neighbours that refinement has not brought together: the image is torn there."""
    chords = np.abs(np.diff(window.scaled(points), axis=0)).max(axis=1)
    torn = np.flatnonzero(chords > TORN * window.step) + 1
    torn = torn[_may_cross(window.scaled(points))[torn - 1] | (np.abs(window.scaled(points)) <= 1.0).all(axis=1)[torn]]
    return np.insert(places, torn, places[torn]), np.insert(points, torn, np.nan, axis=0)


def _coarse(places: np.ndarray, points: np.ndarray, window: Window) -> np.ndarray:
    """Which gaps between neighbours are to be divided, (n - 1,): long chords, bends, and the last steps on the way out."""
    scaled = window.scaled(points)
    chords = np.diff(scaled, axis=0)
    length = np.hypot(chords[:, 0], chords[:, 1])
    inside = (np.abs(scaled) <= 1.0 + window.step).all(axis=1)
    near = inside[:-1] | inside[1:]
    with np.errstate(invalid="ignore"):
        long = (length > window.step) | np.isnan(length)
        bent = np.zeros(len(length), dtype=bool)
        angle = np.arctan2(chords[:, 1], chords[:, 0])
        turn = np.abs((np.diff(angle) + np.pi) % (2.0 * np.pi) - np.pi) > BEND
        bent[:-1] |= turn
        bent[1:] |= turn
        bent &= length > SHORT * window.step
    crossing = ~near & long & _may_cross(scaled)
    return ((near & (long | bent)) | crossing) & (np.diff(places) > NARROWEST)


def _may_cross(scaled: np.ndarray) -> np.ndarray:
    """Which chords with both ends outside the window may pass through it: not those whose ends lie beyond one of its sides."""
    beyond = np.stack([scaled[:, 0] > 1, scaled[:, 0] < -1, scaled[:, 1] > 1, scaled[:, 1] < -1], axis=1)
    same = (beyond[:-1] & beyond[1:]).any(axis=1)
    known = np.isfinite(scaled).all(axis=1)
    return ~same & known[:-1] & known[1:]
