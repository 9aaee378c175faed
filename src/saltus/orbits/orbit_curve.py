"""The curve of the orbits of one signature along parameters, as a problem of the room `continuation`."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from saltus.continuation import Corrected, EquationCurve, Point
from saltus.orbits.newton import Solution
from saltus.orbits.orbit import PeriodicOrbit
from saltus.orbits.problem import Equations, Problem
from saltus.orbits.special_point import SpecialPoint


@dataclass(frozen=True, eq=False)
class OrbitPoint(Point):
    """An orbit as a point of a curve: `place` is its unknowns and the parameters."""

    equations: Equations

    zero_type = SpecialPoint

    @cached_property
    def solution(self) -> Solution:
        """The solution of the orbit's equations."""
        n = self.curve.problem.size
        return Solution(self.place[:n], self.place[n:], self.equations, self.iterations)

    @cached_property
    def orbit(self) -> PeriodicOrbit:
        """The orbit."""
        return PeriodicOrbit(self.curve.problem, self.solution)

    @property
    def residual(self) -> float:
        """The largest residual of the orbit's equations."""
        return self.solution.residual


@dataclass(frozen=True, eq=False)
class OrbitCurve(EquationCurve[OrbitPoint]):
    """The orbits of one problem along its parameters, measured by a norm that depends neither on the number of impacts nor on
    the units of the parameters."""

    problem: Problem
    scales: tuple[float, ...]  # of the parameters
    symmetric: bool = False  # whether the system has the mirror symmetry all along it

    @property
    def count(self) -> int:  # type: ignore[override]
        """How many parameters there are."""
        return len(self.scales)

    @cached_property
    def weights(self) -> np.ndarray:
        """The weights of the unknowns and the parameters in the norm."""
        n = self.problem.size
        return np.append(np.full(n, (2.0 / n) ** 0.5), 1.0 / np.array(self.scales))

    def evaluate(self, place: np.ndarray, thorough: bool) -> Any:
        """The orbit's equations, with the extrema between the impacts if `thorough`."""
        n = self.problem.size
        return self.problem.evaluate(place[:n], place[n:], look=thorough)

    def point_at(self, found: Corrected[Any], tangent: np.ndarray) -> OrbitPoint:
        return OrbitPoint(self, found.place, tangent, found.iterations, found.evaluation)

    def with_problem(self, problem: Problem) -> OrbitCurve:
        """The curve of another problem of the same system."""
        return OrbitCurve(problem, self.scales, self.symmetric)

    def known(self, unknowns: np.ndarray, values: np.ndarray) -> Corrected[Equations] | None:
        """An orbit that is known to be one, with its equations evaluated; None where its motion cannot be followed."""
        place = np.concatenate([unknowns, values])
        equations = self.evaluate(place, thorough=True)
        return None if equations is None else Corrected(place, equations, 0)


def start(orbit: PeriodicOrbit, symmetric: bool, scale: float) -> OrbitPoint:
    """A known orbit as the first point of its curve, to be followed towards larger parameters."""
    curve = OrbitCurve(orbit.problem, (scale,), symmetric)
    solution = orbit.solution
    found = Corrected(np.append(solution.unknowns, solution.values), solution.equations, solution.iterations)
    upwards = np.append(np.zeros(orbit.problem.size), scale)
    return curve.with_tangent(found, upwards) or curve.along_kernel(found)
