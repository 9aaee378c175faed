"""A curve as it was followed."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import Any

import numpy as np

from saltus.continuation.end import CurveEnd, End


@dataclass(frozen=True, eq=False)
class Course:
    """A curve as it was followed: its points in order, the special ones, the reasons for both ends."""

    points: tuple[Any, ...]
    special: tuple[Any, ...]
    ends: tuple[End, End]
    missed: tuple[str, ...]  # test functions that changed their sign where no zero was located

    @cached_property
    def parameters(self) -> np.ndarray:
        """The parameter along it, (n,), or several, (n, k)."""
        values = np.array([point.parameters for point in self.points])
        return values[:, 0] if values.shape[1:] == (1,) else values

    @property
    def closed(self) -> bool:
        """Whether it is a loop."""
        return self.ends[0].reason is CurveEnd.CLOSED

    def solved_at(self, value: float, index: int = -1) -> list[Any]:
        """All its points at a value of one number of their places, solved there."""
        found = []
        for a, b in pairwise(self.points):
            start, end = a.place[index], b.place[index]
            if start == end or (start - value) * (end - value) > 0.0 or end == value or not a.curve.joins(b.curve):
                continue
            guess = a.place + (value - start) / (end - start) * (b.place - a.place)
            guess[index] = value
            point = a.curve.solve_at(guess, a.tangent, index)
            found += [] if point is None else [point]
        return found + [point for point in self.points[-1:] if point.place[index] == value]
