"""Codimension-two points: where something more happens along a curve of special points, and where along the curve."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from saltus.flow import segments as at
from saltus.orbits.conditions import Singular, cubic, quadratic
from saltus.orbits.grazing import TOGETHER, removed
from saltus.orbits.orbit import PeriodicOrbit

if TYPE_CHECKING:
    from saltus.orbits.special_curve import LocusPoint

NARROW = 1e-15  # bracket, in the step that contains the point
CAP = 1.0  # of the room that a motion has before another grazing, which may be infinite
KINDS = {
    "CP": "cusp: two folds meet",
    "GPD": "degenerate period doubling: the doubled orbit changes the side on which it lies",
    "DBPC": "degenerate symmetry breaking: the unsymmetric orbits change the side on which they lie",
    "LP-GR": "fold and grazing at once",
    "PD-GR": "period doubling and grazing at once",
    "BPC-GR": "symmetry breaking and grazing at once",
    "LP-PD-GR": "a grazing at which folds and period doublings of the orbits with more impacts both end",
    "LP-BPC-GR": "the same, with symmetry breakings of symmetric orbits",
    "GR-GR": "two grazings at once",
}


@dataclass(frozen=True)
class CodimensionTwoEvidence:
    """What a codimension-two point is known by."""

    residual: float  # of the orbit's equations and of the curve's condition
    bracket: tuple[float, float]  # widths in both parameters within which the test function changes its sign
    before: float  # the test function at the ends of the step that contains the point
    after: float
    value: float  # and at the point itself


@dataclass(frozen=True, eq=False)
class CodimensionTwo:
    """A point of a curve of special points at which a second condition holds."""

    kind: str  # one of KINDS
    parameters: tuple[float, float]
    orbit: PeriodicOrbit
    evidence: CodimensionTwoEvidence
    point: LocusPoint

    def __repr__(self) -> str:
        first, second = self.parameters
        return f"CodimensionTwo({self.kind} at ({first:.9g}, {second:.9g}), bracket {max(self.evidence.bracket):.1g})"


Test = Callable[["LocusPoint"], float]


def tests_of(kind: str, symmetric: bool) -> list[tuple[str, Test]]:
    """The test functions along a curve of a kind, by the codimension-two point at which each vanishes.

    Beside a grazing the trace of the multipliers' matrix of the orbits with more impacts is (a number) / v. Where that number
    vanishes, both a multiplier +1 and one -1 come as near to the grazing as one likes.
    """
    if kind == "LP":
        return [("CP", lambda point: quadratic(point.judged))]
    if kind in ("PD", "BPC"):
        return [("GPD" if kind == "PD" else "DBPC", normal_form)]
    flip = "BPC" if symmetric else "PD"
    return [
        ("LP-GR", lambda point: without(point, 1.0)),
        (f"{flip}-GR", lambda point: without(point, -1.0)),
        (f"LP-{flip}-GR", lambda point: determinant(point, 1.0)),
    ]


def normal_form(point: LocusPoint) -> float:
    """The cubic coefficient of a PD or BPC."""
    return cubic(cast(Singular, point.condition), point.solution, point.judged)


def room(point: LocusPoint) -> float:
    """How far the motion is from another grazing: the least speed of an impact and inner minimum of the gap, at most `CAP`.

    Those of the grazing that the curve itself consists of are left out.
    """
    orbit, touching = point.orbit, point.touching
    n = len(orbit.signature.sides)
    speeds = np.delete(point.solution.unknowns[1::2], touching) if n else np.empty(0)
    looks = point.solution.equations.looks
    humps, phases = looks[:, at.HUMP], looks[:, at.HUMP_TIME] * orbit.frequency
    if touching:
        touch = point.solution.unknowns[2 * touching[0]]
        away = np.abs(np.array([phases - touch + turn * orbit.problem.closing for turn in (-1, 0, 1)])).min(axis=0)
        humps = humps[~(away < TOGETHER)]
    return min(CAP, float(speeds.min(initial=np.inf)), float(humps.min(initial=np.inf)))


def determinant(point: LocusPoint, closing: float) -> float:
    """Of the equations for perturbations that return as they were, or with the other sign, with rows of length 1."""
    return _scaled(point.solution.equations.jacobian(closing))


def without(point: LocusPoint, closing: float) -> float:
    """The same for the orbit on the other side of the grazing, without the impacts that have no speed; 1 if there is none."""
    other = removed(cast(Any, point))
    equations = None if isinstance(other, str) else other[0].evaluate(other[1], point.solution.values)
    return 1.0 if equations is None else _scaled(equations.jacobian(closing))


def _scaled(matrix: np.ndarray) -> float:
    lengths = np.linalg.norm(matrix, axis=1)
    return float(np.linalg.det(matrix / lengths[:, None])) if (lengths > 0).all() else 0.0


def located(kind: str, test: Test, a: LocusPoint, b: LocusPoint) -> CodimensionTwo | None:
    """The point between a and b at which a test function goes through zero; None if the curve cannot be followed between."""
    from scipy.optimize import brentq

    chord, known = b.place - a.place, {0.0: (a, test(a)), 1.0: (b, test(b))}

    def value_at(share: float) -> float:
        if share not in known:
            point = a.near(a.place + share * chord, chord)
            if point is None:
                raise ArithmeticError
            known[share] = (point, test(point))
        return known[share][1]

    before, after = value_at(0.0), value_at(1.0)
    if before * after > 0.0 or not np.isfinite([before, after]).all():
        return None
    try:
        brentq(value_at, 0.0, 1.0, xtol=NARROW, rtol=1e-15)
    except (ArithmeticError, RuntimeError):
        return None
    point, value = min(known.values(), key=lambda pair: abs(pair[1]))
    here = point.solution.values
    sides = [[np.abs(p.solution.values - here) for p, v in known.values() if (v > 0) == positive] for positive in (True, False)]
    first, second = np.max([np.min(side, axis=0) for side in sides if side], axis=0)
    evidence = CodimensionTwoEvidence(point.residual, (float(first), float(second)), before, after, value)
    return CodimensionTwo(kind, (float(here[0]), float(here[1])), point.orbit, evidence, point)
