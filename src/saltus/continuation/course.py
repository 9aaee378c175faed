"""A curve as it was followed, and its points at given values of one component."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any, Generic, TypeVar

import numpy as np

from saltus.checks import check_count, with_answers
from saltus.continuation.end import CurveEnd, End, Missed
from saltus.continuation.pseudo_arclength import STEPS, between, cubic
from saltus.continuation.test_functions import TestFunction, located


def solved_between(a: Any, b: Any, index: int, value: float) -> list[Any]:
    """The points from a up to before b at which the component `index` of the place has a value,
    solved there.

    Each lies near the cubic through a and b. If Newton's method at this value leads to another
    solution, the curve is followed to the value first.
    """
    found = []
    for first, last in _rising_parts(a, b, index):
        start = first.place[index] - value
        end = last.place[index] - value
        if end == 0.0 or start * end > 0.0:
            continue
        point = first if start == 0.0 else _solved(first, last, index, value)
        found += [] if point is None else [point]
    return found


def _rising_parts(a: Any, b: Any, index: int) -> list[tuple[Any, Any]]:
    """The way from a to b, divided at the extremum of a component of the place."""
    turn = turning_point(a, b, index)
    return [(a, b)] if turn is None else [(a, turn), (turn, b)]


def turning_point(a: Any, b: Any, index: int) -> Any:
    """The point near which a component of the place has an extremum between a and b; None if it has
    none.
    """
    if not a.tangent[index] * b.tangent[index] < 0.0:
        return None
    shares = np.linspace(0.0, 1.0, 33)
    values = cubic(a, b, index)(shares)
    place = int(np.argmax(values) if a.tangent[index] > 0.0 else np.argmin(values))
    return None if place in (0, len(shares) - 1) else _at_share(a, b, float(shares[place]))


def _solved(a: Any, b: Any, index: int, value: float) -> Any:
    """The point between a and b at which a component that is monotonic between them has a value;
    None if it cannot be found.
    """
    share = _share(a, b, index, value)
    point = _near(a, b, between(a, b, share), index, value)
    if point is not None:
        return point
    zero = located(TestFunction("value", lambda other: other.place[index] - value), a, b)
    if zero is None:
        return None
    return _near(a, b, zero.point.place, index, value)


def _near(a: Any, b: Any, guess: np.ndarray, index: int, value: float) -> Any:
    """The solution at a value, near to a guess and with a tangent along a to b; None if Newton's
    method finds another one.
    """
    guess = guess.copy()
    guess[index] = value
    chord = b.place - a.place
    point = a.curve.solve_at(guess, chord, index)
    length = a.curve.norm(chord)
    if point is None or a.curve.norm(point.place - guess) > STEPS.beside * length:
        return None
    return point if max(a.curve.turn(a, point), a.curve.turn(point, b)) < STEPS.most else None


def middle_of(a: Any, b: Any) -> Any:
    """The point halfway from a to b; None if Newton's method finds none near the cubic through
    both.
    """
    point = _at_share(a, b, 0.5)
    if point is None:
        return None
    off = a.curve.norm(point.place - between(a, b, 0.5))
    return point if off <= STEPS.beside * a.curve.norm(b.place - a.place) else None


def _at_share(a: Any, b: Any, share: float) -> Any:
    """The point at a share of the way."""
    chord = b.place - a.place
    return a.curve.solve_beside(between(a, b, share), chord / a.curve.norm(chord), a)


def _share(a: Any, b: Any, index: int, value: float) -> float:
    """The share of the way at which the cubic has the value, by bisection."""
    low = 0.0
    high = 1.0
    component = cubic(a, b, index)
    below = a.place[index] < value
    while high - low > 1e-9:
        middle = 0.5 * (low + high)
        if (component(middle) < value) == below:
            low = middle
        else:
            high = middle
    return 0.5 * (low + high)


Point = TypeVar("Point", bound=Any)
Special = TypeVar("Special")


@with_answers
@dataclass(frozen=True, eq=False)
class Course(Generic[Point, Special]):
    """A curve as it was followed: its points in order, its special points, and the reasons for both
    ends.
    """

    points: tuple[Point, ...]
    special: tuple[Special, ...]
    ends: tuple[End, End]
    # special points between neighbouring points that were noticed but not located
    missed: tuple[Missed, ...]

    @cached_property
    def parameters(self) -> np.ndarray:
        """The parameter along it, (n,), or several, (n, k)."""
        values = np.array([point.parameters for point in self.points])
        return values[:, 0] if values.shape[1:] == (1,) else values

    @property
    def closed(self) -> bool:
        """Whether it is a loop."""
        return self.ends[0].reason is CurveEnd.CLOSED

    def is_joined(self, before: int) -> bool:
        """Whether the point with this number and the next one solve the same equations, with the
        same order of unknowns.

        The last point of a loop is its first one again, with the equations with which it was begun.
        """
        check_count("before", before, 0, len(self.points) - 2)
        a = self.points[before]
        b = self.points[before + 1]
        if a.curve.joins(b.curve):
            return True
        closing = self.closed and before == len(self.points) - 2 and a.place.size == b.place.size
        return bool(closing and a.curve.norm(b.place - a.place) <= 2.0 * STEPS.longest)

    def solved_at(self, value: float, index: int = -1) -> list[Point]:
        """All points of the curve at which one component of the place has a value, solved there, in
        order.
        """
        found = [
            point
            for i in self._around(value, index)
            for point in self.solved_between(i, value, index)
        ]
        return found + [point for point in self.points[-1:] if point.place[index] == value]

    def _around(self, value: float, index: int) -> list[int]:
        """The numbers of the points from which, to the next point, a component of the place may
        take a value: because the value lies between theirs, or because the component has an
        extremum between them."""
        places, tangents = self._last if index == -1 else _numbers(self.points, index)
        beyond = places - value
        return np.flatnonzero(
            (beyond[:-1] * beyond[1:] <= 0.0) | (tangents[:-1] * tangents[1:] < 0.0)
        ).tolist()

    @cached_property
    def _last(self) -> tuple[np.ndarray, np.ndarray]:
        return _numbers(self.points, -1)

    def solved_between(self, before: int, value: float, index: int = -1) -> list[Point]:
        """The points at which one component of the place has a value, from the point with number
        `before` up to before the next."""
        check_count("before", before, 0, len(self.points) - 2)
        a = self.points[before]
        b = self.points[before + 1]
        check_count("index", index, -a.place.size, a.place.size - 1)
        return solved_between(a, b, index, value) if self.is_joined(before) else []


def _numbers(points: tuple[Any, ...], index: int) -> tuple[np.ndarray, np.ndarray]:
    """One component of the places of points, and its derivative along the curve, (n,) each."""
    for point in points:
        check_count("index", index, -point.place.size, point.place.size - 1)
    return np.array([point.place[index] for point in points]), np.array(
        [point.tangent[index] for point in points]
    )
