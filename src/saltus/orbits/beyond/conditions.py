"""The additional equation that holds at special orbits only, along curves in two parameters, and
its derivatives.

At the points of codimension two along these curves a second condition holds.

With the orbit's equations F(y, p) = 0 (`equations/`; J is the matrix of their derivatives to the
unknowns y) it is one of

    fold LP:  g = 0 of  [[J, b], [c^T, 0]] (u, g) = (0, 1),         grazing GR:  v_i = 0;

Period doubling PD, and symmetry breaking BPC over half a period, have the equation of LP with the J
of perturbations that change their sign each (half) period. b and c are fixed near the null vectors
of J; then dg = -d^T (dJ) u, where d solves the transposed system. Central differences along u give
(dJ) u. Their motions begin at y + s u and end a period later at y + s u or, for PD and BPC, at y -
s u.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from saltus.continuation import End, TestFunction, Units
from saltus.flow import SegmentColumn
from saltus.orbits.beyond.grazing import removed
from saltus.orbits.beyond.orbit_curve import curve_test, scaled_determinant
from saltus.orbits.beyond.special_point import SpecialKind
from saltus.orbits.contract.equations import FARTHEST, OrbitEquations, OrbitEvaluation, Solution
from saltus.orbits.orbit import PeriodicOrbit
from saltus.orbits.signature import TOLERANCES

if TYPE_CHECKING:
    from saltus.orbits.branches.special_curve import SpecialCurvePoint


@dataclass(frozen=True)
class DifferenceSettings:
    """The steps of the central differences along null vectors, which are of length 1."""

    # step of second derivatives: their error is its square plus rounding divided by it
    shift: float = 1e-4
    # step of third differences: their error is its fourth power plus rounding divided by its cube
    long_shift: float = 4e-3
    # The largest second-order part of a step of third differences; steps with a larger one are
    # shortened. With eight times as much the differences change their sign where the coefficient
    # does not; and where that part moved phases of impacts by 20 rad, the motions took 500 times as
    # long to follow.
    farthest: float = 5e-3


SETTINGS = DifferenceSettings()


@dataclass(frozen=True, eq=False)
class ConditionValue:
    """A condition's value at a point, and its derivatives to (unknowns, parameters)."""

    value: float
    gradient: np.ndarray
    right: np.ndarray  # u in natural units, empty where there is none
    left: np.ndarray  # d, in these units too


@dataclass(frozen=True, eq=False)
class Singular:
    """The condition that a perturbation returns after the period of the equations: as it was
    (closing +1), or with the other sign (-1)."""

    equations: OrbitEquations
    closing: float
    border: tuple[np.ndarray, np.ndarray]

    @classmethod
    def near(cls, orbit: PeriodicOrbit, closing: float) -> Singular:
        """The condition bordered by the null vectors of an orbit at which it nearly holds."""
        rows = orbit.equations.in_units(orbit.solution.evaluation.jacobian(closing))
        left, _, right = np.linalg.svd(rows)
        return cls(orbit.equations, closing, (left[:, -1], right[-1]))

    def moved(self, at: ConditionValue) -> Singular:
        """The condition bordered by the null vectors of a later point."""
        left, right = (x / np.linalg.norm(x) for x in (at.left, at.right))
        return replace(self, border=(left, right))

    def evaluate(self, solution: Solution) -> ConditionValue | None:
        """g and its derivatives, or None where the motion cannot be followed."""
        n = self.equations.size
        matrix = np.zeros((n + 1, n + 1))
        equations = self.equations
        matrix[:n, :n] = equations.in_units(solution.evaluation.jacobian(self.closing))
        (matrix[:n, n], matrix[n, :n]) = self.border
        unit = np.append(np.zeros(n), 1.0)
        try:
            right = np.linalg.solve(matrix, unit)
            left = np.linalg.solve(matrix.T, unit)
        except np.linalg.LinAlgError:
            return None
        step = SETTINGS.shift / np.linalg.norm(right[:n])
        beside = self.beside(solution, step * right[:n])
        if beside is None:
            return None
        bend = (beside[0].derivatives() - beside[1].derivatives()) / (2.0 * step)
        if not np.isfinite(bend).all():
            return None
        gradient = -left[:n] @ equations.in_units(bend)
        gradient[:n] /= equations.units.unknowns
        return ConditionValue(float(right[n]), gradient, right[:n], left[:n])

    def curvature(self, solution: Solution, vector: np.ndarray) -> np.ndarray | None:
        """The second derivative of the equations along a perturbation of length 1, which returns as
        `closing` says.
        """
        beside = self.beside(solution, SETTINGS.shift * vector)
        if beside is None:
            return None
        ahead, behind = (
            self.equations.in_units(evaluation.jacobian(self.closing)) @ vector
            for evaluation in beside
        )
        return np.asarray((ahead - behind) / (2.0 * SETTINGS.shift))

    def beside(
        self, solution: Solution, shift: np.ndarray
    ) -> tuple[OrbitEvaluation, OrbitEvaluation] | None:
        """The equations of two motions that begin at +shift and -shift, in natural units, from an
        orbit, and return shifted as `closing` says.
        """
        moved = shift * self.equations.units.unknowns
        both = (solution.unknowns + moved, solution.unknowns - moved)
        ends = both if self.closing > 0 else both[::-1]
        ahead, behind = (
            self.equations.evaluate(y, solution.values, later=end)
            for y, end in zip(both, ends, strict=True)
        )
        return None if ahead is None or behind is None else (ahead, behind)


@dataclass(frozen=True, eq=False)
class Slow:
    """The condition that impact `index` has no speed: a grazing, in the signature that has this
    impact.
    """

    equations: OrbitEquations
    index: int

    def moved(self, at: ConditionValue) -> Slow:
        """The condition does not depend on the point."""
        return self

    def evaluate(self, solution: Solution) -> ConditionValue:
        """v_i."""
        gradient = np.zeros(self.equations.size + len(self.equations.paths))
        gradient[2 * self.index + 1] = 1.0
        return ConditionValue(
            float(solution.unknowns[2 * self.index + 1]), gradient, np.empty(0), np.empty(0)
        )


Condition = Singular | Slow


def quadratic(at: ConditionValue, units: Units) -> float:
    """The quadratic coefficient d^T F_yy u u of a fold (LP only); 0 at a cusp."""
    return -float((at.gradient[: at.right.size] * units.unknowns) @ at.right)


def cubic(condition: Singular, solution: Solution, at: ConditionValue) -> float:
    """The coefficient of a^3 in the equation of the amplitude a of the orbits born at a PD or BPC,
    with d scaled to unit length.

    Its sign says on which side of the PD or BPC these orbits lie; it changes at a GPD or DBPC. The
    orbit is perturbed by +-a u + a^2 h / 2 over two (half) periods in turn, where J h = -F_yy u u.
    The component of the equations along +-d is then odd in a, and its third difference,
    extrapolated once, is the coefficient. NaN where J is singular or nearly so, which makes h too
    large for an expansion, or where a perturbed motion has another signature and cannot be
    followed.
    """
    u, d = (x / np.linalg.norm(x) for x in (at.right, at.left))
    curvature = condition.curvature(solution, u)
    if curvature is None:
        return math.nan
    try:
        matrix = condition.equations.in_units(solution.evaluation.jacobian())
        h = np.linalg.solve(matrix, -curvature)
    except np.linalg.LinAlgError:
        return math.nan
    step = min(
        SETTINGS.long_shift,
        math.sqrt(0.5 * SETTINGS.farthest / max(float(np.linalg.norm(h)), 1e-300)),
    )
    if not step >= SETTINGS.shift:
        return math.nan

    def third(a: float) -> float:
        units = condition.equations.units
        one, other = (
            solution.unknowns + units.unknowns * (s * a * u + 0.5 * a**2 * h) for s in (1, -1)
        )
        first = condition.equations.evaluate(one, solution.values, later=other)
        second = condition.equations.evaluate(other, solution.values, later=one)
        return (
            math.nan
            if first is None or second is None
            else 3.0 * float(d @ ((first.residual - second.residual) / units.residuals)) / a**3
        )

    return (4.0 * third(step) - third(2.0 * step)) / 3.0


def curve_tests(kind: str, symmetric: bool) -> list[TestFunction]:
    """The test functions along a curve of a kind, by the codimension-two point at which each
    vanishes.

    Beside a grazing, the monodromy matrix of the orbits with the additional impacts has a trace
    proportional to 1 / v, where v is their speed. Where the factor vanishes, both orbits with a
    multiplier +1 and with one -1 lie arbitrarily near to the grazing.
    """
    if kind == SpecialKind.LP:
        return [
            curve_test(
                SpecialKind.CP,
                lambda point: quadratic(point.condition_value, point.curve.equations.units),
            )
        ]
    if kind in (SpecialKind.PD, SpecialKind.BPC):
        return [
            curve_test(SpecialKind.GPD if kind == SpecialKind.PD else SpecialKind.DBPC, normal_form)
        ]
    flip = "BPC" if symmetric else "PD"
    return [
        curve_test(SpecialKind.LP_GR, lambda point: without(point, 1.0)),
        curve_test(SpecialKind[f"{flip}_GR"], lambda point: without(point, -1.0)),
        curve_test(
            SpecialKind[f"LP_{flip}_GR"],
            lambda point: scaled_determinant(
                point.evaluation.jacobian(1.0), point.curve.equations.units.unknowns
            ),
        ),
    ]


def normal_form(point: SpecialCurvePoint) -> float:
    """The cubic coefficient of the normal form of a PD or BPC."""
    condition = point.condition
    assert isinstance(condition, Singular)
    return cubic(condition, point.solution, point.condition_value)


def room(point: SpecialCurvePoint) -> float:
    """How far the motion is from another grazing: the least of the impacts' speeds and of the gap's
    minima, at most `FARTHEST`.

    The impacts and the minimum of the grazing that the curve itself follows are left out.
    """
    orbit = point.orbit
    touching = point.touching
    n = len(orbit.signature.sides)
    natural = orbit.equations.natural
    speeds = np.delete(point.solution.unknowns[1::2], touching) if n else np.empty(0)
    speeds = speeds / natural.speed
    extremes = point.evaluation.extremes
    humps = extremes[:, SegmentColumn.LOWEST_GAP] / natural.length
    phases = extremes[:, SegmentColumn.LOWEST_GAP_TIME] * orbit.frequency
    if touching:
        touch = point.solution.unknowns[2 * touching[0]]
        away = np.abs(
            np.array([phases - touch + turn * orbit.equations.closing for turn in (-1, 0, 1)])
        ).min(axis=0)
        humps = humps[~(away < TOLERANCES.pair)]
    return min(FARTHEST, float(speeds.min(initial=np.inf)), float(humps.min(initial=np.inf)))


def without(point: SpecialCurvePoint, closing: float) -> float:
    """The determinant of the equations for perturbations of the orbit on the other side of the
    grazing; 1 if there is none.

    That orbit lacks the impacts that have no speed. Perturbations return as they were (closing +1)
    or with the other sign (-1).
    """
    other = removed(point)
    if isinstance(other, End):
        return 1.0
    equations, unknowns = other
    evaluation = equations.evaluate(unknowns, point.solution.values)
    if evaluation is None:
        return 1.0
    return scaled_determinant(evaluation.jacobian(closing), equations.units.unknowns)
