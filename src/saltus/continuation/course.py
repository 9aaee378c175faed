"""A curve as it was followed."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any, Generic, TypeVar

import numpy as np

from saltus.checks import check_count
from saltus.continuation.end import CurveEnd, End
from saltus.continuation.missed import Missed
from saltus.continuation.solved_between import solved_between
from saltus.continuation.step_length import STEPS

Point = TypeVar("Point", bound=Any)
Special = TypeVar("Special")


@dataclass(frozen=True, eq=False)
class Course(Generic[Point, Special]):
    """A curve as it was followed: its points in order, its special points, and the reasons for both ends."""

    points: tuple[Point, ...]
    special: tuple[Special, ...]
    ends: tuple[End, End]
    missed: tuple[Missed, ...]  # special points between neighbouring points that were noticed but not located

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
        """Whether the point with this number and the next one solve the same equations, with the same order of unknowns.

        The last point of a loop is its first one again, with the equations with which it was begun.
        """
        check_count("before", before, 0, len(self.points) - 2)
        a, b = self.points[before], self.points[before + 1]
        if a.curve.joins(b.curve):
            return True
        closing = self.closed and before == len(self.points) - 2 and a.place.size == b.place.size
        return bool(closing and a.curve.norm(b.place - a.place) <= 2.0 * STEPS.longest)

    def solved_at(self, value: float, index: int = -1) -> list[Point]:
        """All points of the curve at which one component of the place has a value, solved there, in order."""
        found = [point for i in self._around(value, index) for point in self.solved_between(i, value, index)]
        return found + [point for point in self.points[-1:] if point.place[index] == value]

    def _around(self, value: float, index: int) -> list[int]:
        """The numbers of the points from which, to the next point, a component of the place may take a value: because the value
        lies between theirs, or because the component has an extremum between them."""
        places, tangents = self._last if index == -1 else _numbers(self.points, index)
        beyond = places - value
        return np.flatnonzero((beyond[:-1] * beyond[1:] <= 0.0) | (tangents[:-1] * tangents[1:] < 0.0)).tolist()

    @cached_property
    def _last(self) -> tuple[np.ndarray, np.ndarray]:
        return _numbers(self.points, -1)

    def solved_between(self, before: int, value: float, index: int = -1) -> list[Point]:
        """The points at which one component of the place has a value, from the point with number `before` up to before the
        next."""
        check_count("before", before, 0, len(self.points) - 2)
        a, b = self.points[before], self.points[before + 1]
        check_count("index", index, -a.place.size, a.place.size - 1)
        return solved_between(a, b, index, value) if self.is_joined(before) else []


def _numbers(points: tuple[Any, ...], index: int) -> tuple[np.ndarray, np.ndarray]:
    """One component of the places of points, and its derivative along the curve, (n,) each."""
    for point in points:
        check_count("index", index, -point.place.size, point.place.size - 1)
    return np.array([point.place[index] for point in points]), np.array([point.tangent[index] for point in points])
