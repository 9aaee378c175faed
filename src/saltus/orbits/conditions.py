"""The equation more that singles out special orbits along curves in two parameters, and its derivatives.

With the orbit's equations F(y, p) = 0 (`problem.py`, J their derivatives to the unknowns y) it is one of

    fold LP:  g = 0 of  [[J, b], [c^T, 0]] (u, g) = (0, 1),         grazing GR:  v_i = 0;

period doubling PD, and symmetry breaking BPC with the half map, as LP, with J of perturbations that change their sign each time.
b and c are fixed near the null vectors, so the left vector d of the transposed system gives dg = -d^T (dJ) u. Central differences
along u give (dJ) u, of motions that begin at y + s u and end a period later at y + s u, or, for PD and BPC, at y - s u.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from saltus.orbits.newton import Solution
from saltus.orbits.orbit import PeriodicOrbit
from saltus.orbits.problem import Equations, Problem


@dataclass(frozen=True)
class DifferenceSettings:
    """The steps of the central differences along null vectors, which are of length 1."""

    shift: float = 1e-4  # step of second derivatives: their error is its square plus rounding divided by it
    long_shift: float = 4e-3  # step of third differences: their error is its fourth power plus rounding divided by its cube
    # The largest second-order part of a step of third differences, which are taken over shorter steps where it would be more.
    # With eight times as much they change their sign where the coefficient does not, and with phases of impacts moved by 20 rad
    # the motions took 500 times as long to follow.
    farthest: float = 5e-3


SETTINGS = DifferenceSettings()


@dataclass(frozen=True, eq=False)
class ConditionValue:
    """A condition's value at a point, and its derivatives to (unknowns, parameters)."""

    value: float
    gradient: np.ndarray
    right: np.ndarray  # u, empty where there is none
    left: np.ndarray  # d


@dataclass(frozen=True, eq=False)
class Singular:
    """Perturbations that return after the period of the equations: as they were (closing +1), or with the other sign (-1)."""

    problem: Problem
    closing: float
    border: tuple[np.ndarray, np.ndarray]

    @classmethod
    def near(cls, orbit: PeriodicOrbit, closing: float) -> Singular:
        """The condition bordered by the null vectors of an orbit at which it nearly holds."""
        left, _, right = np.linalg.svd(orbit.solution.equations.jacobian(closing))
        return cls(orbit.problem, closing, (left[:, -1], right[-1]))

    def moved(self, at: ConditionValue) -> Singular:
        """The condition bordered by the null vectors of a later point."""
        left, right = (x / np.linalg.norm(x) for x in (at.left, at.right))
        return replace(self, border=(left, right))

    def evaluate(self, solution: Solution) -> ConditionValue | None:
        """g and its derivatives, or None where the motion cannot be followed."""
        n = self.problem.size
        matrix = np.zeros((n + 1, n + 1))
        matrix[:n, :n], (matrix[:n, n], matrix[n, :n]) = solution.equations.jacobian(self.closing), self.border
        unit = np.append(np.zeros(n), 1.0)
        try:
            right, left = np.linalg.solve(matrix, unit), np.linalg.solve(matrix.T, unit)
        except np.linalg.LinAlgError:
            return None
        step = SETTINGS.shift / np.linalg.norm(right[:n])
        beside = self.beside(solution, step * right[:n])
        if beside is None:
            return None
        bend = (beside[0].derivatives() - beside[1].derivatives()) / (2.0 * step)
        if not np.isfinite(bend).all():
            return None
        return ConditionValue(float(right[n]), -left[:n] @ bend, right[:n], left[:n])

    def curvature(self, solution: Solution, vector: np.ndarray) -> np.ndarray | None:
        """The second derivative of the equations along a perturbation of length 1 that returns as the condition asks."""
        beside = self.beside(solution, SETTINGS.shift * vector)
        if beside is None:
            return None
        ahead, behind = (equations.jacobian(self.closing) @ vector for equations in beside)
        return np.asarray((ahead - behind) / (2.0 * SETTINGS.shift))

    def beside(self, solution: Solution, shift: np.ndarray) -> tuple[Equations, Equations] | None:
        """The equations of motions beside an orbit, by +shift and by -shift, which return shifted as the condition asks."""
        both = (solution.unknowns + shift, solution.unknowns - shift)
        ends = both if self.closing > 0 else both[::-1]
        ahead, behind = (self.problem.evaluate(y, solution.values, later=end) for y, end in zip(both, ends, strict=True))
        return None if ahead is None or behind is None else (ahead, behind)


@dataclass(frozen=True, eq=False)
class Slow:
    """An impact without speed: that which the signature on the other side of a grazing has more."""

    problem: Problem
    index: int

    def moved(self, at: ConditionValue) -> Slow:
        """The condition as seen from another point: the same."""
        return self

    def evaluate(self, solution: Solution) -> ConditionValue:
        """v_i."""
        gradient = np.zeros(self.problem.size + len(self.problem.paths))
        gradient[2 * self.index + 1] = 1.0
        return ConditionValue(float(solution.unknowns[2 * self.index + 1]), gradient, np.empty(0), np.empty(0))


Condition = Singular | Slow


def quadratic(at: ConditionValue) -> float:
    """d^T F_yy u u at a fold, where it folds the branch; 0 at a cusp. LP only."""
    return -float(at.gradient[: at.right.size] @ at.right)


def cubic(condition: Singular, solution: Solution, at: ConditionValue) -> float:
    """The coefficient of a^3 in the equation of the amplitude a of the orbits born at a PD or BPC, with d scaled to unit length.

    They lie on the other side of the parameter where it changes its sign (GPD, DBPC). Perturbed by +-a u + a^2 h / 2, J h =
    -F_yy u u, over two (half) periods in turn, the part of the equations along +-d is odd in a: here its third difference,
    refined once. NaN where J is singular, or so nearly that h says nothing of motions beside this one, or where the motion is so
    near to another kind that it cannot be followed when it is perturbed.
    """
    u, d = (x / np.linalg.norm(x) for x in (at.right, at.left))
    curvature = condition.curvature(solution, u)
    if curvature is None:
        return math.nan
    try:
        h = np.linalg.solve(solution.equations.jacobian(), -curvature)
    except np.linalg.LinAlgError:
        return math.nan
    step = min(SETTINGS.long_shift, math.sqrt(0.5 * SETTINGS.farthest / max(float(np.linalg.norm(h)), 1e-300)))
    if not step >= SETTINGS.shift:
        return math.nan

    def third(a: float) -> float:
        one, other = (solution.unknowns + s * a * u + 0.5 * a**2 * h for s in (1, -1))
        first = condition.problem.evaluate(one, solution.values, later=other)
        second = condition.problem.evaluate(other, solution.values, later=one)
        return math.nan if first is None or second is None else 3.0 * float(d @ (first.residual - second.residual)) / a**3

    return (4.0 * third(step) - third(2.0 * step)) / 3.0
