"""The interface of a curve to the loop of a continuation: its norm, its points, the steps between
them, and its special points with their evidence."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass, replace
from typing import Any, ClassVar, Generic, Self, TypeVar

import numpy as np


@dataclass(frozen=True)
class Evidence:
    """The numbers that show that a special point is there.

    Attributes
    ----------
    residual
        The residual of the equations.
    brackets
        The width in each parameter within which the test function changes its sign.
    before
        The test function at the beginning of the step that contains the point.
    after
        The test function at the end of that step.
    value
        The test function at the point itself.
    witness
        At a change of an orbit's events, what vanishes there, such as "gap of stop"; else empty.
    proof
        What is proved of it, as `prove(branch).branch` has it; None if nobody has asked.

    Examples
    --------
    >>> fold = next(point for point in branch.special if point.kind == "LP")
    >>> fold.evidence.bracket < 1e-9, fold.evidence.before * fold.evidence.after < 0
    (True, True)
    """

    residual: float
    brackets: tuple[float, ...]
    before: float
    after: float
    value: float
    witness: str = ""
    proof: Any = None

    @property
    def bracket(self) -> float:
        """The largest of these widths."""
        return max(self.brackets)


@dataclass(frozen=True, eq=False)
class Zero:
    """A special point of a curve: the kind of its test function, the point, and the evidence."""

    kind: str
    point: Any
    evidence: Evidence

    @property
    def parameter(self) -> float:
        """The first parameter."""
        return float(self.point.parameter)

    @property
    def parameters(self) -> tuple[float, ...]:
        """All parameters."""
        return tuple(map(float, self.point.parameters))


P = TypeVar("P", bound="Point")


@dataclass(frozen=True, eq=False)
class Point:
    """A point of a curve, and the direction in which the curve is followed there."""

    curve: Any  # the `Curve` that it was solved on; its equations are those used for the next step
    place: np.ndarray  # unknowns y, then parameters p
    tangent: np.ndarray  # of length 1 in the norm of the curve
    iterations: int  # of the corrector that found it

    zero_type: ClassVar[type[Zero]] = Zero  # of its special points

    @property
    def parameters(self) -> np.ndarray:
        """The parameters, (k,)."""
        values: np.ndarray = self.place[-self.curve.count :]
        return values

    @property
    def parameter(self) -> float:
        """The first parameter."""
        return float(self.parameters[0])

    @property
    def residual(self) -> float:
        """The largest residual of the equations."""
        return 0.0

    def beside(self, step: float) -> Any:
        """The point of the curve a short step along the tangent, or None."""
        return self.curve.solve(self.place + step * self.tangent, self.tangent)

    def turned(self) -> Self:
        """The same point, followed the other way."""
        return replace(self, tangent=-self.tangent)


class Curve(ABC, Generic[P]):
    """The solutions of F(y, p) = 0 with one equation fewer than there are unknowns y and parameters
    p.
    """

    count: int  # of the parameters, which are the last numbers of a place

    @property
    @abstractmethod
    def weights(self) -> np.ndarray:
        """The weights of the unknowns and the parameters in the norm, (n + k,)."""

    @abstractmethod
    def solve(self, guess: np.ndarray, direction: np.ndarray) -> P | None:
        """The point near a guess, in the hyperplane through the guess that is normal to a direction
        of length 1.
        """

    def solve_beside(self, guess: np.ndarray, direction: np.ndarray, point: P) -> P | None:
        """`solve` beside a point that is known, whose derivatives may be used."""
        return self.solve(guess, direction)

    @abstractmethod
    def solve_at(self, guess: np.ndarray, direction: np.ndarray, index: int = -1) -> P | None:
        """The point near a guess that has the guess's value in the component `index`; its tangent
        points along the direction.
        """

    def beside_singular(self, place: np.ndarray, direction: np.ndarray) -> P | None:
        """The point at a place that solves the equations, with a given tangent, for use where the
        equations may be singular.
        """
        return self.solve(place, direction)

    @abstractmethod
    def advance(self, before: P | None, point: P, step: float) -> P | None:
        """The point a step further, given the point before if there is one; None where the step is
        too long.
        """

    @abstractmethod
    def turn(self, a: P, b: P) -> float:
        """A measure of the change of the curve from a point to the next, by which the length of the
        steps is controlled.
        """

    def reach(self, point: P) -> float:
        """The longest step from a point that makes sense."""
        return math.inf

    def joins(self, other: Curve[P]) -> bool:
        """Whether points of this curve and of the other one solve the same equations."""
        return self is other

    def norm(self, step: np.ndarray) -> float:
        """The length of a step."""
        scaled = self.weights * step
        return math.sqrt(scaled @ scaled)
