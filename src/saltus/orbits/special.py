"""Special points of a branch: their test functions, and where along the branch these vanish."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from saltus.orbits.orbit import PeriodicOrbit
from saltus.orbits.path import Curve, Point, between
from saltus.orbits.signature import Signature

REACHES = 10.0 ** np.arange(-8, -0.9)  # along a parent's branch, until its special point is found between
NARROW = 1e-11  # bracket, in the step that contains the point; what is nearest to zero is nearer still,
GRAZING = 1e-15  # and nearest of all at a grazing, beside which motions part by the square root
KINDS = {
    "LP": "fold (limit point)",
    "PD": "period doubling",
    "BPC": "branch point: symmetry breaking, or a crossing of branches",
    "NS": "Neimark-Sacker",
    "GR": "grazing",
}


@dataclass(frozen=True)
class Evidence:
    """What a special point is known by."""

    residual: float  # of the orbit's equations
    bracket: float  # width in the parameter within which the test function changes its sign
    before: float  # the test function at the ends of the step that contains the point
    after: float
    value: float  # and at the point itself


@dataclass(frozen=True, eq=False)
class SpecialPoint:
    """A point of a branch at which the number or the stability of orbits changes, or a given function vanishes."""

    kind: str  # LP, PD, BPC, NS, GR, or the name of a margin or of the user's function
    orbit: PeriodicOrbit
    parameter: float
    evidence: Evidence
    point: Point

    @property
    def amplitude(self) -> float:
        """max abs(theta) of the orbit."""
        return self.orbit.amplitude

    @property
    def defect(self) -> float:
        """The distance of the orbit from itself a period later, by direct simulation."""
        return self.orbit.defect

    def __repr__(self) -> str:
        return (
            f"SpecialPoint(kind={self.kind!r}, parameter={self.parameter:.12g}, amplitude={self.amplitude:.9g}, "
            f"period {self.orbit.period}, {self.orbit.signature.impact_count} impacts, bracket {self.evidence.bracket:.1g})"
        )


Test = Callable[[Point], float]
UserFunction = Callable[[PeriodicOrbit], float]


def fold(point: Point) -> float:
    """The parameter's part of the tangent."""
    return float(point.tangent[-1])


@lru_cache(maxsize=4)  # a point ends one step and begins the next
def flip(point: Point) -> float:
    """The determinant of the equations for perturbations that change their sign each (half) period, scaled to be moderate."""
    return _determinant(point.solution.equations.jacobian(-1.0))


@lru_cache(maxsize=4)
def crossing(point: Point) -> float:
    """The determinant of the equations with the tangent below them: it changes its sign where two branches cross."""
    equations, curve = point.solution.equations, point.curve
    matrix = np.column_stack([equations.jacobian(), equations.parameters[:, 0]])
    return _determinant(np.vstack([matrix, point.tangent * curve.weights**2]))


def _determinant(matrix: np.ndarray) -> float:
    """With rows of length 1: rounding then is the same everywhere, and so is the sign."""
    lengths = np.linalg.norm(matrix, axis=1)
    return float(np.linalg.det(matrix / lengths[:, None])) if (lengths > 0).all() else 0.0


@lru_cache(maxsize=4)
def torus(point: Point) -> float:
    """The modulus of a complex pair of multipliers less 1; -1 where there is none.

    For one degree of freedom that the impacts and the damping contract there is never one (errata 22).
    """
    values = point.orbit.multipliers
    pairs = values[np.abs(values.imag) > 1e-9]
    return float(np.abs(pairs).max(initial=0.0)) - 1.0


def grazing(point: Point) -> float:
    """The least of the impacts' speeds and of the gap's inner minima: below 0 there is no orbit."""
    return min(point.orbit.slowest, point.orbit.clearance)


def asymmetry(point: Point) -> np.ndarray | None:
    """By how much the orbit differs from its own image: its mirror image half a period later for an odd period of a symmetric
    system, itself half a period later for an even one. None where it could not be its own image, or is by construction."""
    signature, n = point.curve.problem.signature, len(point.curve.problem.signature.sides)
    if signature.symmetric or n == 0 or n % 2:
        return None
    first, second = signature.sides[: n // 2], signature.sides[n // 2 :]
    expected = tuple(-s for s in first) if signature.period % 2 else first
    if second != expected or (signature.period % 2 and not point.curve.symmetric):
        return None
    halves = point.solution.unknowns.reshape(2, n // 2, 2).copy()
    halves[1, :, 0] -= np.pi * signature.period
    return np.asarray((halves[1] - halves[0]).ravel())


def located(kind: str, test: Test, a: Point, b: Point) -> SpecialPoint | None:
    """The point between a and b at which a test function goes through zero; None if the branch cannot be followed between."""
    from scipy.optimize import brentq

    chord, known = b.place - a.place, {0.0: a, 1.0: b}
    direction = chord / a.curve.norm(chord)

    def at(share: float) -> float:
        if share not in known:
            point = a.curve.solve(between(a, b, share), direction)
            if point is None:
                raise ArithmeticError
            known[share] = point
        return test(known[share])

    before, after = at(0.0), at(1.0)
    if before * after > 0.0 or not np.isfinite([before, after]).all():
        return None
    try:
        brentq(at, 0.0, 1.0, xtol=GRAZING if kind == "GR" else NARROW, rtol=1e-15)
    except (ArithmeticError, RuntimeError):
        return None
    values = {share: test(point) for share, point in known.items()}
    best = min(values, key=lambda share: abs(values[share]))
    sides = [[known[s].parameter for s, value in values.items() if (value > 0) == (before > 0)],
             [known[s].parameter for s, value in values.items() if (value > 0) != (before > 0)]]  # fmt: skip
    point = known[best]
    bracket = max((min(abs(p - point.parameter) for p in side) for side in sides if side), default=0.0)
    evidence = Evidence(point.solution.residual, bracket, before, after, values[best])
    return SpecialPoint(kind, point.orbit, point.parameter, evidence, point)


def parent_point(kind: str, a: Point, b: Point) -> SpecialPoint | None:
    """The special point at which a family was born that passes through an orbit that is its own image, on the parent's branch.

    There the family's own equations are singular; those of the parent, over half of the period, are not.
    """
    signature, n = a.curve.problem.signature, len(a.curve.problem.signature.sides)
    before, after = asymmetry(a), asymmetry(b)
    assert before is not None
    assert after is not None
    length = float(np.linalg.norm(before))
    share = length / (length + float(np.linalg.norm(after)))
    place = a.place + share * (b.place - a.place)
    halves = place[:-1].reshape(2, n // 2, 2).copy()
    halves[1, :, 0] -= np.pi * signature.period
    odd = bool(signature.period % 2)
    short = Signature(signature.sides[: n // 2], signature.period if odd else signature.period // 2, odd)
    curve = Curve(a.curve.problem.with_signature(short), a.curve.scale, a.curve.symmetric)
    guess = np.append(halves.mean(axis=0).ravel(), place[-1])
    upwards = np.append(np.zeros(curve.problem.size), 1.0)
    middle = curve.solve_at(guess, upwards)
    if middle is None:
        return None
    for reach in REACHES:
        ends = [curve.solve(middle.place + sign * reach * middle.tangent, middle.tangent) for sign in (-1.0, 1.0)]
        if ends[0] is not None and ends[1] is not None and flip(ends[0]) * flip(ends[1]) < 0.0:
            return located(kind, flip, ends[0], ends[1])
    return None


def tests_between(a: Point, b: Point, functions: dict[str, UserFunction]) -> Iterator[tuple[str, Test]]:
    """The test functions that change their sign from a to b."""
    candidates: list[tuple[str, Any]] = [
        ("LP", fold),
        ("BPC" if a.orbit.symmetric else "PD", flip),
        ("BPC", crossing),
        ("NS", torus),
    ]
    for name in a.curve.problem.margins:
        candidates.append((name, lambda point, name=name: point.orbit.margins[name]))
    for name, function in functions.items():
        candidates.append((name, lambda point, function=function: float(function(point.orbit))))
    for kind, test in candidates:
        before, after = test(a), test(b)
        if before * after < 0.0:
            yield kind, test
