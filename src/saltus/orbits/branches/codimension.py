"""Codimension-two points: special points along a curve of special points, at which a second condition holds."""

from __future__ import annotations

import numpy as np

from saltus.continuation import End, TestFunction
from saltus.flow import SegmentColumn
from saltus.orbits.branches.beyond_grazing import removed
from saltus.orbits.branches.bifurcations import curve_test, scaled_determinant
from saltus.orbits.branches.conditions import Singular, cubic, quadratic
from saltus.orbits.branches.special_curve import SpecialCurvePoint
from saltus.orbits.branches.special_point import SpecialKind
from saltus.orbits.tolerances import TOLERANCES

CAP = 1.0  # upper limit of `room`, which would be infinite for a motion without impacts that never comes near the contact


def curve_tests(kind: str, symmetric: bool) -> list[TestFunction]:
    """The test functions along a curve of a kind, by the codimension-two point at which each vanishes.

    Beside a grazing, the monodromy matrix of the orbits with the additional impacts has a trace proportional to 1 / v, where v is
    their speed. Where the factor vanishes, both orbits with a multiplier +1 and with one -1 lie arbitrarily near to the grazing.
    """
    if kind == SpecialKind.LP:
        return [curve_test(SpecialKind.CP, lambda point: quadratic(point.condition_value))]
    if kind in (SpecialKind.PD, SpecialKind.BPC):
        return [curve_test(SpecialKind.GPD if kind == SpecialKind.PD else SpecialKind.DBPC, normal_form)]
    flip = "BPC" if symmetric else "PD"
    return [
        curve_test(SpecialKind.LP_GR, lambda point: without(point, 1.0)),
        curve_test(SpecialKind[f"{flip}_GR"], lambda point: without(point, -1.0)),
        curve_test(SpecialKind[f"LP_{flip}_GR"], lambda point: scaled_determinant(point.evaluation.jacobian(1.0))),
    ]


def normal_form(point: SpecialCurvePoint) -> float:
    """The cubic coefficient of the normal form of a PD or BPC."""
    condition = point.condition
    assert isinstance(condition, Singular)
    return cubic(condition, point.solution, point.condition_value)


def room(point: SpecialCurvePoint) -> float:
    """How far the motion is from another grazing: the least of the impacts' speeds and of the gap's minima, at most `CAP`.

    The impacts and the minimum of the grazing that the curve itself follows are left out.
    """
    orbit, touching = point.orbit, point.touching
    n = len(orbit.signature.sides)
    speeds = np.delete(point.solution.unknowns[1::2], touching) if n else np.empty(0)
    extremes = point.evaluation.extremes
    humps, phases = extremes[:, SegmentColumn.LOWEST_GAP], extremes[:, SegmentColumn.LOWEST_GAP_TIME] * orbit.frequency
    if touching:
        touch = point.solution.unknowns[2 * touching[0]]
        away = np.abs(np.array([phases - touch + turn * orbit.equations.closing for turn in (-1, 0, 1)])).min(axis=0)
        humps = humps[~(away < TOLERANCES.pair)]
    return min(CAP, float(speeds.min(initial=np.inf)), float(humps.min(initial=np.inf)))


def without(point: SpecialCurvePoint, closing: float) -> float:
    """The determinant of the equations for perturbations of the orbit on the other side of the grazing; 1 if there is none.

    That orbit lacks the impacts that have no speed. Perturbations return as they were (closing +1) or with the other sign (-1).
    """
    other = removed(point)
    evaluation = None if isinstance(other, End) else other[0].evaluate(other[1], point.solution.values)
    return 1.0 if evaluation is None else scaled_determinant(evaluation.jacobian(closing))
