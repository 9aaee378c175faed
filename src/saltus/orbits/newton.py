"""Newton's method for the equations of a periodic orbit."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from saltus.orbits.problem import Equations, Problem

ITERATIONS = 12
CONVERGED = 5e-14  # residual, relative to the unknowns: a few dozen roundings of a motion over a period
STALLED = 1e-10  # what Newton's last step may leave where rounding keeps the residual above that


@dataclass(frozen=True)
class Solution:
    """A point that solves the equations, and what was evaluated there."""

    unknowns: np.ndarray
    values: np.ndarray
    equations: Equations
    iterations: int

    @property
    def residual(self) -> float:
        """The largest residual."""
        return float(np.abs(self.equations.residual).max())


def solve(problem: Problem, unknowns: np.ndarray, values: np.ndarray, iterations: int = ITERATIONS) -> Solution | None:
    """The orbit near a first guess at fixed parameters, or None where Newton's method does not converge."""
    return solve_along(problem, unknowns, values, None, None, iterations)


def solve_along(
    problem: Problem,
    unknowns: np.ndarray,
    values: np.ndarray,
    normal: np.ndarray | None,
    through: np.ndarray | None,
    iterations: int = ITERATIONS,
) -> Solution | None:
    """The orbit near a guess at fixed parameters, or, given a `normal`, in the hyperplane normal (y - `through`) = 0.

    y is (unknowns, first parameter). The last equations are evaluated at the solution itself, with a look at what lies between
    the ends.
    """
    y = np.append(unknowns, values[0]) if normal is not None else unknowns.copy()
    size, before = unknowns.size, np.inf
    for iteration in range(iterations + 1):
        at = np.append(y[size:], values[1:]) if normal is not None else values
        equations = problem.evaluate(y[:size], at, look=iteration > 0)
        if equations is None:
            return None
        error, scale = np.abs(equations.residual).max(), max(1.0, np.abs(y).max())
        converged = error <= CONVERGED * scale
        if converged or (error <= STALLED * scale and error > 0.3 * before):
            looked = equations if iteration > 0 else problem.evaluate(y[:size], at, look=True)
            return None if looked is None else Solution(y[:size].copy(), at.copy(), looked, iteration)
        if not error < 1e6:
            return None
        before = error
        try:
            if normal is None:
                step = np.linalg.solve(equations.jacobian(), -equations.residual)
            else:
                matrix = np.vstack([np.column_stack([equations.jacobian(), equations.parameters[:, 0]]), normal])
                step = np.linalg.solve(matrix, -np.append(equations.residual, normal @ (y - through)))
        except np.linalg.LinAlgError:
            return None
        if not np.isfinite(step).all():
            return None
        longest = np.abs(step).max()
        y = y + step * min(1.0, 1.0 / longest if longest > 0 else 1.0)  # never more than a radian or a unit of speed at once
    return None
