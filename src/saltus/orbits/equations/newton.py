"""Newton's method for the equations of a periodic orbit at fixed parameters."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from saltus.continuation import newton
from saltus.orbits.equations.one_contact import OneContactEquations, OrbitEvaluation

NEWTON_ITERATIONS = 12  # enough from a guess near the orbit; a motion that has not quite settled needs more


@dataclass(frozen=True)
class Solution:
    """A point that solves the equations, with the equations as evaluated there."""

    unknowns: np.ndarray
    values: np.ndarray  # of the parameters
    evaluation: OrbitEvaluation
    iterations: int

    @property
    def residual(self) -> float:
        """The largest residual."""
        return float(np.abs(self.evaluation.residual).max())


def solve(
    equations: OneContactEquations, unknowns: np.ndarray, values: np.ndarray, iterations: int = NEWTON_ITERATIONS
) -> Solution | None:
    """The orbit near a first guess at fixed parameters, or None where Newton's method does not converge."""

    def evaluate(place: np.ndarray, thorough: bool) -> OrbitEvaluation | None:
        return equations.evaluate(place, values, with_extremes=thorough)

    def linear(found: OrbitEvaluation, _: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return found.jacobian(), -found.residual

    found = newton(evaluate, linear, unknowns, iterations)
    return None if found is None else Solution(found.place, values, found.evaluation, found.iterations)
