"""Natural-parameter continuation: curves that have one solution at each value of one parameter and never fold."""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Callable

import numpy as np

from saltus.continuation.curve import Curve, P

LOCATED_WITHIN = 1e-12  # relative precision of the parameter at an end or a change that no test function locates


class NaturalCurve(Curve[P]):
    """A curve that has the parameter as its coordinate, from bound to bound; whether a solution exists is found by trying."""

    count = 1
    scale: float  # of the parameter in the norm
    bounds: tuple[float, float]

    @property
    def weights(self) -> np.ndarray:
        """The weight of the parameter, which is the only number of a place."""
        return np.array([1.0 / self.scale])

    @abstractmethod
    def solution_at(self, value: float) -> P | None:
        """The solution at a value of the parameter near to the one for which this curve was made; None where there is none."""

    @abstractmethod
    def turn(self, a: P, b: P) -> float:
        """A measure of the difference of two solutions."""

    def solve(self, guess: np.ndarray, direction: np.ndarray) -> P | None:
        """The solution at the parameter of the guess, whatever the direction."""
        return self.solution_at(float(guess[-1]))

    def solve_at(self, guess: np.ndarray, direction: np.ndarray, index: int = -1) -> P | None:
        """The solution at the parameter of the guess."""
        return self.solution_at(float(guess[-1]))

    def advance(self, before: P | None, point: P, step: float) -> P | None:
        """The solution a step further; the step ends at the bound if it would lead beyond it."""
        ahead = self.solution_at(self.ahead(point, step))
        return ahead if ahead is None or point.tangent[-1] > 0.0 else ahead.turned()

    def ahead(self, point: P, step: float) -> float:
        """The parameter a step further, at most the bound."""
        bound = self._bound(point)
        if step >= self.reach(point):
            return bound
        return point.parameter + math.copysign(step * self.scale, point.tangent[-1])

    def reach(self, point: P) -> float:
        """The distance from the bound ahead."""
        return abs(self._bound(point) - point.parameter) / self.scale

    def joins(self, other: Curve[P]) -> bool:
        """Whether two curves are one: always, as there is one solution at each value of the parameter."""
        return True

    def _bound(self, point: P) -> float:
        return self.bounds[1] if point.tangent[-1] > 0.0 else self.bounds[0]


def bisected(point: P, beyond: float, holds: Callable[[P], bool]) -> tuple[P, float]:
    """The last point of a natural curve at which a condition holds, and a parameter just beyond at which it does not.

    The condition holds at the given point. It does not at the parameter `beyond`, where there may be no solution at all.
    """
    while abs(beyond - point.parameter) > LOCATED_WITHIN * max(abs(point.parameter), abs(beyond)):
        middle = 0.5 * (point.parameter + beyond)
        found = point.curve.solution_at(middle)
        if found is not None and holds(found):
            point = found
        else:
            beyond = middle
    return point, beyond
