"""The equation more that singles out special orbits along curves in two parameters, and its derivatives.

With the orbit's equations F(y, p) = 0 (`problem.py`, J their derivatives to the unknowns y) it is one of

    fold LP:  g = 0 of  [[J, b], [c^T, 0]] (u, g) = (0, 1),         grazing GR:  v_i = 0;

period doubling PD, and symmetry breaking BPC with the half map, as LP, with J of perturbations that change their sign each time.
b and c are fixed near the null vectors, so the left vector d of the transposed system gives dg = -d^T (dJ) u.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from saltus.errors import ParameterError
from saltus.orbits.newton import CONVERGED, STALLED, Solution
from saltus.orbits.problem import Problem
from saltus.orbits.signature import Signature

ITERATIONS = 9
SHIFT = 1e-4  # along the null vector: its square, and rounding over it, are the derivatives' errors
LONG_SHIFT = 4e-3  # for third differences: rounding over its cube, its fourth power


@dataclass(frozen=True, eq=False)
class Judgement:
    """A condition's value at a point, and its derivatives to (unknowns, parameters)."""

    value: float
    gradient: np.ndarray
    right: np.ndarray  # u, empty where there is none
    left: np.ndarray  # d


class Singular:
    """Perturbations that return after the period of the equations: as they were (closing +1), or with the other sign (-1)."""

    def __init__(self, problem: Problem, closing: float, border: tuple[np.ndarray, np.ndarray]) -> None:
        self.problem, self.closing, self.border = problem, closing, border

    @classmethod
    def near(cls, problem: Problem, solution: Solution, closing: float) -> Singular:
        """The condition bordered by the null vectors of a point at which it nearly holds."""
        left, _, right = np.linalg.svd(solution.equations.jacobian(closing))
        return cls(problem, closing, (left[:, -1], right[-1]))

    def moved(self, judgement: Judgement) -> Singular:
        """The condition bordered by the null vectors of a later point."""
        left, right = (x / np.linalg.norm(x) for x in (judgement.left, judgement.right))
        following = Singular(self.problem, self.closing, (left, right))
        following.__dict__["twice"] = self.twice  # compiled and cached, and the same for all points
        return following

    @cached_property
    def twice(self) -> Problem | None:
        """The problem of two (half) periods, in which perturbations of alternating sign are periodic; None without impacts."""
        signature = self.problem.signature
        if self.closing > 0 or not signature.sides:
            return None
        periods = signature.period * (1 if signature.symmetric else 2)
        second = tuple(-s for s in signature.sides) if signature.symmetric else signature.sides
        return self.problem.with_signature(Signature((*signature.sides, *second), periods))

    def judge(self, solution: Solution) -> Judgement | None:
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
        return Judgement(float(right[n]), -self.along(left[:n]) @ bend @ self._same(), right[:n], left[:n])

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
        y, step = self.doubled(solution.unknowns), SHIFT / np.linalg.norm(vector)
        ahead, behind = (problem.evaluate(y + s * step * self.along(vector), solution.values) for s in (1, -1))
        if ahead is None or behind is None:
            return None
        return np.asarray(
            np.column_stack([ahead.jacobian() - behind.jacobian(), ahead.parameters - behind.parameters]) / (2.0 * step)
        )

    def doubled(self, unknowns: np.ndarray) -> np.ndarray:
        """An orbit's unknowns over two (half) periods."""
        if self.twice is None:
            return unknowns
        later = unknowns.copy()
        later[::2] += self.problem.closing
        return np.concatenate([unknowns, later])


class Slow:
    """An impact without speed: that which the signature on the other side of a grazing has more."""

    def __init__(self, problem: Problem, index: int) -> None:
        self.problem, self.index = problem, index

    def moved(self, judgement: Judgement) -> Slow:
        """The condition as seen from another point: the same."""
        return self

    def judge(self, solution: Solution) -> Judgement:
        """v_i."""
        gradient = np.zeros(self.problem.size + len(self.problem.paths))
        gradient[2 * self.index + 1] = 1.0
        return Judgement(float(solution.unknowns[2 * self.index + 1]), gradient, np.empty(0), np.empty(0))


Condition = Singular | Slow


def quadratic(judgement: Judgement) -> float:
    """d^T F_yy u u at a fold, where it folds the branch; 0 at a cusp. LP only."""
    return -float(judgement.gradient[: judgement.right.size] @ judgement.right)


def cubic(condition: Singular, solution: Solution, judgement: Judgement) -> float:
    """The coefficient of a^3 in the equation of the amplitude a of the orbits born at a PD or BPC, with d scaled to unit length.

    They lie on the other side of the parameter where it changes its sign (GPD, DBPC). Perturbed by +-a u + a^2 h / 2, J h =
    -F_yy u u, over two (half) periods in turn, the part of the equations along +-d is odd in a: here its third difference,
    refined once.

    Raises:
        ParameterError: a motion so near to another kind that it cannot be followed at the perturbed orbit.
    """
    u, d = (x / np.linalg.norm(x) for x in (judgement.right, judgement.left))
    bend, n = condition.bend(solution, u), u.size
    if bend is None:
        raise ParameterError("the motion beside the special point cannot be followed, so no normal form can be given")
    curvature = bend[:n, : bend.shape[0]] @ condition.along(u)
    h = np.linalg.solve(solution.equations.jacobian(), -curvature)
    coarse, fine = (_third(condition, solution, u, d, h, step) for step in (2.0 * LONG_SHIFT, LONG_SHIFT))
    return (4.0 * fine - coarse) / 3.0


def _third(condition: Singular, solution: Solution, u: np.ndarray, d: np.ndarray, h: np.ndarray, a: float) -> float:
    one, other = solution.unknowns + a * u + 0.5 * a**2 * h, solution.unknowns - a * u + 0.5 * a**2 * h
    if condition.twice is not None:
        other[::2] += condition.problem.closing
        equations = condition.twice.evaluate(np.concatenate([one, other]), solution.values)
        parts = None if equations is None else np.split(equations.residual, 2)
    else:  # without impacts the equations are (state a period later) - unknowns
        ends = [condition.problem.evaluate(y, solution.values) for y in (one, other)]
        parts = (
            None
            if ends[0] is None or ends[1] is None
            else [e.residual + s * (one - other) for e, s in zip(ends, (1, -1), strict=True) if e]
        )
    if parts is None:
        raise ParameterError("the motion beside the special point cannot be followed, so no normal form can be given")
    return 3.0 * float(d @ (parts[0] - parts[1])) / a**3


def corrected(problem: Problem, condition: Condition, guess: np.ndarray, normal: np.ndarray) -> tuple[Solution, Judgement] | None:
    """The point of the curve of special orbits near a guess (unknowns, parameters), in the hyperplane through it with a normal.

    None where Newton's method does not converge.
    """
    z, n, before = guess.copy(), problem.size, np.inf
    for iteration in range(ITERATIONS + 1):
        equations = problem.evaluate(z[:n], z[n:])
        if equations is None:
            return None
        solution = Solution(z[:n], z[n:], equations, iteration)
        judged = condition.judge(solution)
        if judged is None:
            return None
        residual, scale = np.append(equations.residual, judged.value), max(1.0, np.abs(z[:n]).max())
        error = np.abs(residual).max()
        if error <= CONVERGED * scale or (error <= STALLED * scale and error > 0.3 * before):
            looked = problem.evaluate(z[:n], z[n:], look=True)
            return None if looked is None else (Solution(z[:n], z[n:], looked, iteration), judged)
        before = error
        try:
            step = np.linalg.solve(matrix(solution, judged, normal), -np.append(residual, normal @ (z - guess)))
        except np.linalg.LinAlgError:
            return None
        longest = np.abs(step).max()
        if not (error < 1e6 and np.isfinite(longest)):
            return None
        z = z + step * min(1.0, 1.0 / longest if longest > 0 else 1.0)
    return None


def matrix(solution: Solution, judged: Judgement, normal: np.ndarray) -> np.ndarray:
    """The derivatives of all equations to (unknowns, parameters), and below them a normal."""
    return np.vstack([np.column_stack([solution.equations.jacobian(), solution.equations.parameters]), judged.gradient, normal])
