"""The values of the test functions along a curve, and the search between two points that finds all
of their zeros.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from saltus.continuation.curve import Zero
from saltus.continuation.pseudo_arclength import arc, between
from saltus.continuation.test_functions import Events


@dataclass(frozen=True)
class TrailSettings:
    """How closely the test functions are examined between two points of a curve."""

    # The most points solved for within one step; more would be needed only if a function is nearly
    # 0 in it.
    most_looks: int = 40
    # An interval narrower than this share of its step is not divided: two zeros in it count as one.
    narrowest: float = 1e-6
    # A step is taken again if a value differs from the parabola through the last three by more than
    # this share of them.
    unexpected: float = 0.5
    # The uncertainty of the cubic through four points, in units of its term of third order.
    doubt: float = 1.0
    # Places in an interval at which the cubic and its uncertainty are compared with 0.
    grid: int = 17
    # A new point is no nearer to an end of the interval than this share of it: little would be
    # gained.
    inner: float = 0.1
    # How far before an event, and behind one, the functions are read too, as a share of the way to
    # the next point: at the event itself some have no value, and grow without bound beside it.
    beside_event: float = 1e-2
    # A value at the zero of another test function that is smaller than this share of the values at
    # both ends of the interval is rounding of 0.
    rounding: float = 1e-6


SETTINGS = TrailSettings()
GRID = np.linspace(0.0, 1.0, SETTINGS.grid)


@dataclass(frozen=True, eq=False)
class TrailPoint:
    """A point of a curve with the values of all test functions."""

    point: Any
    arc: float  # the length of the curve up to it
    values: np.ndarray  # that of the barrier first if there is one
    outside: int | None  # see `Events.outside`


class Trail:
    """The last points of a curve, with the values of its test functions.

    Between two points a test function is approximated by the cubic through them and the two nearest
    other points. The cubic's uncertainty is its term of third order, which is large where the
    function turns unexpectedly. If the cubic, within its uncertainty, may have more zeros than its
    values at both ends show, a point between is solved for, and so on.
    """

    def __init__(self, events: Events, first: Any) -> None:
        self.events = events
        self.begin(first)

    def begin(self, point: Any) -> None:
        """Begin anew at a point at which the equations have changed."""
        self.barrier = self.events.barrier(point)
        self.tests = [*([] if self.barrier is None else [self.barrier]), *self.events.tests(point)]
        self.guides = np.array([test.guides for test in self.tests], dtype=bool)
        self.decisive = np.array([test.decisive for test in self.tests], dtype=bool)
        self.seen: list[TrailPoint] = []
        self.latest = self._at(point, 0.0)
        self.last = [self.latest]

    def explains(self, ahead: Any) -> bool:
        """Whether the smooth test functions at a point ahead are near to the values extrapolated
        from their last three values.
        """
        if len(self.last) < 3 or not self.guides.any():
            return True
        (a, b, c) = self.last
        point = self._sample(ahead)
        x = point.arc
        values = np.array([sample.values[self.guides] for sample in self.last])
        expected = (
            (x - b.arc) * (x - c.arc) / ((a.arc - b.arc) * (a.arc - c.arc)) * values[0]
            + (x - a.arc) * (x - c.arc) / ((b.arc - a.arc) * (b.arc - c.arc)) * values[1]
            + (x - a.arc) * (x - b.arc) / ((c.arc - a.arc) * (c.arc - b.arc)) * values[2]
        )
        found = point.values[self.guides]
        size = np.maximum(np.abs(values).max(axis=0), np.abs(found))
        return bool((np.abs(found - expected) <= SETTINGS.unexpected * size).all())

    def values_at(self, point: Any) -> np.ndarray:
        """The values of all test functions at the last point or at one ahead of it."""
        return self.last[-1].values if point is self.last[-1].point else self._sample(point).values

    def go_on(self, samples: list[TrailPoint]) -> None:
        """Take the points of a step, which begins with the last one."""
        self.last = [*self.last[:-1], *samples][-3:]

    def to_barrier(self, ahead: Any) -> list[TrailPoint]:
        """The points of a step up to the first one at which the barrier is negative."""
        samples = self.up_to([], ahead)
        # a curve may begin on the barrier
        if self.barrier is None or samples[-1].values[0] < 0.0 or len(self.last) == 1:
            return samples
        samples = self.examined(samples)
        beyond = next((i for i, sample in enumerate(samples) if i and sample.values[0] < 0.0), None)
        return samples if beyond is None else samples[: beyond + 1]

    def up_to(self, samples: list[TrailPoint], ahead: Any) -> list[TrailPoint]:
        """The points of a step that ends at a point, given those of a longer one."""
        if samples and samples[-1].point is ahead:
            return samples
        before = self.last[-1]
        last = self._sample(ahead)
        return [*(sample for sample in samples[:-1] or [before] if sample.arc < last.arc), last]

    def examined(self, samples: list[TrailPoint]) -> list[TrailPoint]:
        """The points of a step, with as many further points between as are needed to see every zero
        of the test functions.
        """
        if samples is self.seen:
            return samples
        samples = self._with_points_beside_events(samples)
        looks = 0
        i = 0
        known = self.last[:-1]
        narrowest = SETTINGS.narrowest * (samples[-1].arc - samples[0].arc)
        while i + 1 < len(samples) and looks < SETTINGS.most_looks:
            a, b = samples[i : i + 2]
            near = sorted(
                [*[*known, *samples[:i]][-2:], *samples[i + 2 : i + 4]],
                key=lambda s: max(a.arc - s.arc, s.arc - b.arc),
            )
            share = None
            if b.arc - a.arc > narrowest:
                share = _where_to_look(a, b, near[:2]) or (None if self.explained(a, b) else 0.5)
            middle = None if share is None else self._middle(a, b, share)
            if middle is None:
                i += 1
            else:
                samples, looks = [*samples[: i + 1], middle, *samples[i + 1 :]], looks + 1
        self.seen = samples
        return samples

    def _with_points_beside_events(self, samples: list[TrailPoint]) -> list[TrailPoint]:
        """The points of a step, with a further one beside each end at which an event has no count
        of `Events.outside`, so that what happens up to the event is seen."""
        first = samples[0]
        last = samples[-1]
        found = list(samples)
        if last.outside is None and last is not first:
            beside = self._middle(samples[-2], last, 1.0 - SETTINGS.beside_event)
            found[-1:-1] = [] if beside is None else [beside]
        if first.outside is None and last is not first:
            beside = self._middle(first, found[1], SETTINGS.beside_event)
            found[1:1] = [] if beside is None else [beside]
        return found

    def explained(self, a: TrailPoint, b: TrailPoint) -> bool:
        """Whether the counts of `Events.outside` at two points are equal, or a decisive test
        function changes its sign between."""
        if a.outside == b.outside or None in (a.outside, b.outside):
            return True
        return bool((a.values * b.values <= 0.0)[self.decisive].any())

    def with_zeros(self, a: TrailPoint, b: TrailPoint, zeros: Sequence[Zero]) -> list[TrailPoint]:
        """The two points with the zeros of test functions between them, in order; values there that
        are 0 up to rounding are given as 0.
        """
        within = []
        chord = a.point.curve.weights**2 * (b.point.place - a.point.place)
        least = SETTINGS.rounding * np.maximum(np.abs(a.values), np.abs(b.values))
        # an infinite value is none that others are compared with
        least = np.where(np.isfinite(least), least, 0.0)
        for zero in zeros:
            if zero.point is a.point or zero.point is b.point:
                continue
            share = float((zero.point.place - a.point.place) @ chord)
            there = self._at(zero.point, share)
            values = np.where(np.abs(there.values) <= least, 0.0, there.values)
            within.append(replace(there, values=values))
        return [a, *sorted(within, key=lambda sample: sample.arc), b]

    def unchanged(self, a: TrailPoint, b: TrailPoint) -> np.ndarray:
        """Which test functions have the same sign at two points."""
        return np.asarray(np.sign(a.values) * np.sign(b.values) > 0.0)

    def _middle(self, a: TrailPoint, b: TrailPoint, share: float) -> TrailPoint | None:
        """The trail point at a share of the way between two, or None if the curve cannot be solved
        for there.
        """
        chord = b.point.place - a.point.place
        curve = a.point.curve
        point = curve.solve_beside(
            between(a.point, b.point, share), chord / curve.norm(chord), a.point
        )
        if point is None:
            return None
        first = arc(a.point, point)
        second = arc(point, b.point)
        return self._at(point, a.arc + (b.arc - a.arc) * first / (first + second))

    def _sample(self, ahead: Any) -> TrailPoint:
        """A point ahead of the last one, as a trail point."""
        if self.latest.point is not ahead:
            before = self.last[-1]
            self.latest = self._at(ahead, before.arc + arc(before.point, ahead))
        return self.latest

    def _at(self, point: Any, length: float) -> TrailPoint:
        """A point at a length along the curve, with the values of all test functions."""
        return TrailPoint(
            point,
            length,
            np.array([test.value(point) for test in self.tests]),
            self.events.outside(point),
        )


def _where_to_look(a: TrailPoint, b: TrailPoint, near: Sequence[TrailPoint]) -> float | None:
    """The share of the way from a to b at which a test function may have zeros that its values at
    both ends do not show; None if there is no such place."""
    begin = a.values
    end = b.values
    with np.errstate(all="ignore"):
        rise = end - begin
        bend, twist, unsure, lever = _higher(a, b, near)
        signs = np.sign(begin) * np.sign(end)
        room = np.where(signs > 0, 4.0 * np.minimum(np.abs(begin), np.abs(end)), np.abs(rise))
        swing = np.abs(bend) + 1.25 * np.abs(lever).max() * (np.abs(twist) + unsure)
        doubtful = (room <= swing) & (signs != 0) & np.isfinite(swing)
    worst = 0.0
    place = None
    parabola = GRID * (1.0 - GRID)
    for row in np.flatnonzero(doubtful):
        cubic = begin[row] + rise[row] * GRID - parabola * (bend[row] + twist[row] * lever)
        margin = SETTINGS.doubt * parabola * unsure[row] * np.abs(lever)
        if signs[row] > 0:
            least = np.sign(begin[row]) * cubic - margin
            k = int(np.argmin(least))
            depth = -least[k] / max(abs(begin[row]), abs(end[row]))
            if depth > worst:
                worst = depth
                place = float(np.clip(GRID[k], SETTINGS.inner, 1.0 - SETTINGS.inner))
        elif any(
            np.count_nonzero(np.diff(np.sign(side))) > 1
            for side in (cubic - margin, cubic + margin)
        ):
            worst, place = max(worst, 1.0), place or 0.5
    return place


def _higher(a: TrailPoint, b: TrailPoint, near: Sequence[TrailPoint]) -> tuple[np.ndarray, ...]:
    """The coefficients of second and third order, the uncertainty, and the factor of the last two
    at the places of the grid.

    With fewer than two further points the last known term is the uncertain one; for a straight line
    this is half of its rise.
    """
    begin = a.values
    end = b.values
    length = b.arc - a.arc
    slope = (end - begin) / length
    nothing = np.zeros(len(begin))
    everywhere = np.ones(GRID.size)
    seconds = [((end - c.values) / (b.arc - c.arc) - slope) / (c.arc - a.arc) for c in near]
    if len(near) < 2:
        bend = length**2 * seconds[0] if near else nothing
        return bend, nothing, np.abs(bend if near else end - begin), everywhere
    third = (seconds[1] - seconds[0]) / (near[1].arc - near[0].arc)
    twist = length**2 * third
    return length**2 * seconds[0], twist, np.abs(twist), a.arc + length * GRID - near[0].arc
