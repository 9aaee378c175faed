"""The curve of the orbits of one signature along parameters, as a problem of the room `continuation`."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from saltus.continuation import STEPS, Corrected, EquationCurve, Point
from saltus.flow import SegmentValue
from saltus.orbits.branches.special_point import SpecialPoint
from saltus.orbits.equations.contract import OrbitEquations, OrbitEvaluation, Solution
from saltus.orbits.orbit import PeriodicOrbit

# With a multiplier above this, neighbouring motions separate so fast that an orbit cannot be solved for.
STEEPEST = 1e8
SHRUNK_TO_REST = 1e-7  # An orbit of an amplitude below this has shrunk to rest.


@dataclass(frozen=True, eq=False)
class OrbitPoint(Point):
    """An orbit as a point of a curve: `place` is its unknowns and the parameters."""

    evaluation: OrbitEvaluation

    zero_type = SpecialPoint

    @cached_property
    def solution(self) -> Solution:
        """The solution of the orbit's equations."""
        n = self.curve.equations.size
        return Solution(self.place[:n], self.place[n:], self.evaluation, self.iterations)

    @cached_property
    def orbit(self) -> PeriodicOrbit:
        """The orbit."""
        return PeriodicOrbit(self.curve.equations, self.solution)

    @cached_property
    def halves(self) -> np.ndarray | None:
        """The unknowns of both halves of its period, see `OrbitEquations.halves`."""
        found: np.ndarray | None = self.curve.equations.halves(self.solution, self.curve.symmetric)
        return found

    @property
    def residual(self) -> float:
        """The largest residual of the orbit's equations."""
        return self.solution.residual


@dataclass(frozen=True, eq=False)
class OrbitCurve(EquationCurve[OrbitPoint]):
    """The orbits of one problem along its parameters, measured by a norm that depends neither on the number of impacts nor on
    the units of the parameters."""

    equations: OrbitEquations
    scales: tuple[float, ...]  # of the parameters
    symmetric: bool = False  # whether the system has the mirror symmetry all along it

    @property
    def count(self) -> int:  # type: ignore[override]
        """How many parameters there are."""
        return len(self.scales)

    @property
    def corrector_radius(self) -> float:  # type: ignore[override]
        """How far from the predicted point the corrector may look for the next one."""
        return self.equations.corrector_radius

    @property
    def residual_floor(self) -> float:  # type: ignore[override]
        """The largest residual that rounding may leave."""
        return self.equations.residual_floor

    @cached_property
    def weights(self) -> np.ndarray:
        """The weights of the unknowns and the parameters in the norm."""
        n = self.equations.size
        return np.append(np.full(n, (2.0 / n) ** 0.5), 1.0 / np.array(self.scales))

    def evaluate(self, place: np.ndarray, thorough: bool) -> Any:
        """The orbit's equations, with the extrema between the impacts if `thorough`."""
        n = self.equations.size
        return self.equations.evaluate(place[:n], place[n:], with_extremes=thorough)

    def point_at(self, found: Corrected[Any], tangent: np.ndarray) -> OrbitPoint:
        return OrbitPoint(self, found.place, tangent, found.iterations, found.evaluation)

    def advance(self, before: OrbitPoint | None, point: OrbitPoint, step: float) -> OrbitPoint | None:
        """The point a step further. A short step may go round a corner of the curve, where the state at phase 0 passes the
        contact (see `_seen_from`)."""
        ahead = super().advance(before, point, step)
        if ahead is not None or step > STEPS.restart or not self.equations.passes_contact:
            return ahead
        ahead = self.solve(point.place + step * point.tangent, point.tangent)
        if ahead is None or self.norm(ahead.place - point.place) > 2.0 * step:
            return None
        return ahead if self.norm(_seen_from(point, ahead).tangent - point.tangent) < STEPS.off else None

    def turn(self, a: OrbitPoint, b: OrbitPoint) -> float:
        """The angle between the tangents, without the part that such a corner makes."""
        angle = super().turn(a, b)
        if not self.equations.passes_contact or self.norm(b.place - a.place) > 2.0 * STEPS.restart:
            return angle
        return min(angle, super().turn(a, _seen_from(a, b)))

    def with_equations(self, equations: OrbitEquations) -> OrbitCurve:
        """The curve of another problem of the same system."""
        return OrbitCurve(equations, self.scales, self.symmetric)

    def known(self, unknowns: np.ndarray, values: np.ndarray) -> Corrected[OrbitEvaluation] | None:
        """An orbit whose unknowns are known, with its equations evaluated there; None where its motion cannot be followed."""
        place = np.concatenate([unknowns, values])
        evaluation = self.evaluate(place, thorough=True)
        return None if evaluation is None else Corrected(place, evaluation, 0)


def _seen_from(a: OrbitPoint, b: OrbitPoint) -> OrbitPoint:
    """The point b with the tangent that it would have if its orbit were, at phase 0, on the same side of the contact as a's.

    Where an orbit passes the contact just at phase 0, its curve has a corner if the acceleration jumps there, as by a damper on
    one side: the instant of the passage moves by -dx/v, and the velocity at phase 0 by that times the jump. The corner is in the
    unknowns alone, not in the orbit.
    """
    own = a.curve.equations.own
    first, second = (point.evaluation.ends[0, SegmentValue.FIRST_STATE + 3 * own :] for point in (a, b))
    if own > 1 or second[1] == 0.0:
        return b
    tangent = b.tangent.copy()
    tangent[1] -= (second[2] - first[2]) / second[1] * tangent[0]
    return replace(b, tangent=tangent / b.curve.norm(tangent))


def start(orbit: PeriodicOrbit, symmetric: bool, scale: float) -> OrbitPoint:
    """A known orbit as the first point of its curve, to be followed towards larger parameters."""
    curve = OrbitCurve(orbit.equations, (scale,), symmetric)
    solution = orbit.solution
    found = Corrected(np.append(solution.unknowns, solution.values), solution.evaluation, solution.iterations)
    upwards = np.append(np.zeros(orbit.equations.size), scale)
    return curve.with_tangent(found, upwards) or curve.along_kernel(found)
