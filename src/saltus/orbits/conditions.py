"""The equation more that singles out special orbits along curves in two parameters, and its derivatives.

With the orbit's equations F(y, p) = 0 (`problem.py`, J their derivatives to the unknowns y) it is one of

    fold LP:  g = 0 of  [[J, b], [c^T, 0]] (u, g) = (0, 1),         grazing GR:  v_i = 0;

period doubling PD, and symmetry breaking BPC with the half map, as LP, with J of perturbations that change their sign each time.
b and c are fixed near the null vectors, so the left vector d of the transposed system gives dg = -d^T (dJ) u.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from saltus.orbits.newton import Solution
from saltus.orbits.orbit import PeriodicOrbit
from saltus.orbits.problem import Problem
from saltus.orbits.signature import Signature


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
    twice: Problem | None  # of two (half) periods, in which alternating perturbations are periodic; None without impacts

    @classmethod
    def near(cls, orbit: PeriodicOrbit, closing: float) -> Singular:
        """The condition bordered by the null vectors of an orbit at which it nearly holds."""
        left, _, right = np.linalg.svd(orbit.solution.equations.jacobian(closing))
        twice = _of_two_periods(orbit.problem) if closing < 0 and orbit.signature.sides else None
        return cls(orbit.problem, closing, (left[:, -1], right[-1]), twice)

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
        bend = self.bend(solution, right[:n])
        if bend is None or not np.isfinite(bend).all():
            return None
        return ConditionValue(float(right[n]), -self.along(left[:n]) @ bend @ self._same(), right[:n], left[:n])

    def along(self, vector: np.ndarray) -> np.ndarray:
        """A perturbation of the problem in whose terms `bend` is."""
        return vector if self.twice is None else np.concatenate([vector, -vector])

    def _same(self) -> np.ndarray:
        """What (unknowns, parameters) do to those of `bend`; half of it, as two (half) periods count twice."""
        n, count = self.problem.size, len(self.problem.paths)
        if self.twice is None:
            return np.eye(n + count)
        both = np.zeros((2 * n + count, n + count))
        both[:n, :n] = both[n : 2 * n, :n] = 0.5 * np.eye(n)
        both[2 * n :, n:] = 0.5 * np.eye(count)
        return both

    def bend(self, solution: Solution, vector: np.ndarray) -> np.ndarray | None:
        """The second derivatives of the equations along a vector and to (unknowns, parameters), by central differences."""
        problem = self.twice or self.problem
        y, step = self.doubled(solution.unknowns), SETTINGS.shift / np.linalg.norm(vector)
        ahead, behind = (problem.evaluate(y + s * step * self.along(vector), solution.values) for s in (1, -1))
        if ahead is None or behind is None:
            return None
        return np.asarray((ahead.derivatives() - behind.derivatives()) / (2.0 * step))

    def doubled(self, unknowns: np.ndarray) -> np.ndarray:
        """An orbit's unknowns over two (half) periods."""
        return unknowns if self.twice is None else self.problem.repeated(unknowns)


def _of_two_periods(problem: Problem) -> Problem:
    """The problem of twice the time that a problem covers."""
    signature = problem.signature
    periods = signature.period * (1 if signature.symmetric else 2)
    second = tuple(-s for s in signature.sides) if signature.symmetric else signature.sides
    return problem.with_signature(Signature((*signature.sides, *second), periods))


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
    bend, n = condition.bend(solution, u), u.size
    if bend is None:
        return math.nan
    curvature = bend[:n, : bend.shape[0]] @ condition.along(u)
    try:
        h = np.linalg.solve(solution.equations.jacobian(), -curvature)
    except np.linalg.LinAlgError:
        return math.nan
    step = min(SETTINGS.long_shift, math.sqrt(0.5 * SETTINGS.farthest / max(float(np.linalg.norm(h)), 1e-300)))
    if not step >= SETTINGS.shift:
        return math.nan

    def third(a: float) -> float:
        pair = [solution.unknowns + s * a * u + 0.5 * a**2 * h for s in (1, -1)]
        parts = _over_both(condition, solution.values, *pair)
        return math.nan if parts is None else 3.0 * float(d @ (parts[0] - parts[1])) / a**3

    return (4.0 * third(step) - third(2.0 * step)) / 3.0


def _over_both(condition: Singular, values: np.ndarray, one: np.ndarray, other: np.ndarray) -> Any:
    """The residuals over two (half) periods of a motion that is at `one` in the first and at `other` in the second; or None."""
    if condition.twice is not None:
        later = other.copy()
        later[::2] += condition.problem.closing
        equations = condition.twice.evaluate(np.concatenate([one, later]), values)
        return None if equations is None else np.split(equations.residual, 2)
    first, second = condition.problem.evaluate(one, values), condition.problem.evaluate(other, values)
    if first is None or second is None:
        return None
    return first.residual + (one - other), second.residual - (one - other)  # as equations without impacts are (end) - unknowns
