"""The values of the test functions along a curve, and the search between two points that finds all
of their zeros.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from saltus.continuation.curve import Zero
from saltus.continuation.pseudo_arclength import arc, between
from saltus.continuation.step_arithmetic import arithmetic
from saltus.continuation.test_functions import Events, TestFunction


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
        self.singular = [i for i, test in enumerate(self.tests) if test.singular]
        self.seen: list[TrailPoint] = []
        self.latest = self._at(point, 0.0)
        self.last = [self.latest]

    def explains(self, ahead: Any) -> bool:
        """Whether the smooth test functions at a point ahead are near to the values extrapolated
        from their last three values.
        """
        if len(self.last) < 3 or not self.guides.any():
            return True
        point = self._sample(ahead)
        return arithmetic().is_expected(
            np.array([sample.values for sample in self.last]),
            np.array([sample.arc for sample in self.last]),
            point.values,
            point.arc,
            self.guides,
            SETTINGS.unexpected,
        )

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

    def explained(self, a: TrailPoint, b: TrailPoint, jumps: Sequence[TestFunction] = ()) -> bool:
        """Whether the counts of `Events.outside` at two points are equal, or a decisive test
        function changes its sign between that does not jump there.
        """
        if a.outside == b.outside or None in (a.outside, b.outside):
            return True
        changed = self.decisive & (a.values * b.values <= 0.0)
        return any(
            test not in jumps for test, sign in zip(self.tests, changed, strict=True) if sign
        )

    def narrowed(
        self, a: TrailPoint, b: TrailPoint, jumps: Sequence[TestFunction]
    ) -> tuple[TrailPoint, TrailPoint]:
        """Two nearer points between which the count of `Events.outside` changes as well, or a
        decisive test function that is none of `jumps` changes its sign.
        """
        narrowest = SETTINGS.narrowest * (b.arc - a.arc)
        while b.arc - a.arc > narrowest and not self.explained(a, b, jumps):
            middle = self._middle(a, b, 0.5)
            if middle is None or middle.outside is None:
                break
            a, b = (middle, b) if middle.outside == a.outside else (a, middle)
        return a, b

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
            np.array([test.value(point) for test in self.tests], dtype=float),
            self.events.outside(point),
        )


def _where_to_look(a: TrailPoint, b: TrailPoint, near: Sequence[TrailPoint]) -> float | None:
    """The share of the way from a to b at which a test function may have zeros that its values at
    both ends do not show; None if there is no such place."""
    values = np.array([sample.values for sample in near]).reshape(len(near), len(a.values))
    arcs = np.array([a.arc, b.arc, *(sample.arc for sample in near)])
    found = arithmetic().where_to_look(
        a.values, b.values, values, arcs, SETTINGS.doubt, SETTINGS.inner, SETTINGS.grid
    )
    return None if math.isnan(found) else found
