"""The curve of the orbits of one signature along parameters, as a problem of the room
`continuation`.

Each of its test functions vanishes at one kind of special point.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import cache, cached_property, lru_cache
from typing import Any

import numpy as np

from saltus.bounds import area_contraction
from saltus.continuation import (
    STEPS,
    Corrected,
    EquationCurve,
    Point,
    TestFunction,
    Units,
    Zero,
    arithmetic,
    bordered,
)
from saltus.flow import SegmentColumn, SegmentValue
from saltus.orbits.beyond.special_point import SpecialKind, SpecialPoint, UserFunction
from saltus.orbits.contract.equations import FARTHEST, OrbitEquations, OrbitEvaluation, Solution
from saltus.orbits.orbit import PeriodicOrbit

# With a multiplier above this, neighbouring motions separate so fast that an orbit cannot be solved
# for.
STEEPEST = 1e8


@dataclass(frozen=True, eq=False)
class OrbitPoint(Point):
    """An orbit as a point of a curve: `place` is its unknowns and the parameters."""

    evaluation: OrbitEvaluation

    zero_type = SpecialPoint

    @cached_property
    def solution(self) -> Solution:
        """The solution of the orbit's equations."""
        n = self.curve.equations.size
        units = self.curve.equations.units
        return Solution(self.place[:n], self.place[n:], self.evaluation, self.iterations, units)

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
    """The orbits of one problem along its parameters, measured by a norm that depends neither on
    the number of impacts nor on units: of the parameters, of length or of time."""

    equations: OrbitEquations
    scales: tuple[float, ...]  # of the parameters
    symmetric: bool = False  # whether the system has the mirror symmetry all along it
    # how much larger than natural its first orbit is; states are measured in so many natural units
    stretch: float = 1.0

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
        stretch = np.where(self.equations.is_phase, 1.0, self.stretch)
        units = self.equations.units.unknowns * stretch
        return np.append((2.0 / n) ** 0.5 / units, 1.0 / np.array(self.scales))

    @property
    def units(self) -> Units:
        return self.equations.units

    def evaluate(self, place: np.ndarray, thorough: bool) -> Any:
        """The orbit's equations, with the extrema between the impacts if `thorough`."""
        n = self.equations.size
        return self.equations.evaluate(place[:n], place[n:], with_extremes=thorough)

    def residual(self, place: np.ndarray) -> np.ndarray | None:
        n = self.equations.size
        # derivatives take some n motions
        return self.equations.residual(place[:n], place[n:]) if n > self.iterations else None

    def derivatives_at(self, point: OrbitPoint) -> np.ndarray:
        return point.evaluation.derivatives()

    def point_at(self, found: Corrected[Any], tangent: np.ndarray) -> OrbitPoint:
        return OrbitPoint(self, found.place, tangent, found.iterations, found.evaluation)

    def advance(
        self, before: OrbitPoint | None, point: OrbitPoint, step: float
    ) -> OrbitPoint | None:
        """The point a step further. A short step may go round a corner of the curve, where the
        state at phase 0 passes the contact (see `_seen_from`)."""
        ahead = super().advance(before, point, step)
        if ahead is not None or step > STEPS.restart or not self.equations.passes_contact:
            return ahead
        ahead = self.solve(point.place + step * point.tangent, point.tangent)
        if ahead is None or self.norm(ahead.place - point.place) > 2.0 * step:
            return None
        return (
            ahead
            if self.norm(_seen_from(point, ahead).tangent - point.tangent) < STEPS.off
            else None
        )

    def turn(self, a: OrbitPoint, b: OrbitPoint) -> float:
        """The angle between the tangents, without the part that such a corner makes."""
        angle = super().turn(a, b)
        if not self.equations.passes_contact or self.norm(b.place - a.place) > 2.0 * STEPS.restart:
            return angle
        return min(angle, super().turn(a, _seen_from(a, b)))

    def with_equations(self, equations: OrbitEquations) -> OrbitCurve:
        """The curve of another problem of the same system."""
        return OrbitCurve(equations, self.scales, self.symmetric, self.stretch)

    def known(self, unknowns: np.ndarray, values: np.ndarray) -> Corrected[OrbitEvaluation] | None:
        """An orbit whose unknowns are known, with its equations evaluated there; None where its
        motion cannot be followed.
        """
        place = np.concatenate([unknowns, values])
        evaluation = self.evaluate(place, thorough=True)
        return None if evaluation is None else Corrected(place, evaluation, 0)


def _seen_from(a: OrbitPoint, b: OrbitPoint) -> OrbitPoint:
    """The point b with the tangent that it would have if its orbit were, at phase 0, on the same
    side of the contact as a's.

    Where an orbit passes the contact just at phase 0, its curve has a corner if the acceleration
    jumps there, as by a damper on one side: the instant of the passage moves by -dx/v, and the
    velocity at phase 0 by that times the jump. The corner is in the unknowns alone, not in the
    orbit.
    """
    own = a.curve.equations.own
    first, second = (
        point.evaluation.ends[0, SegmentValue.FIRST_STATE + 3 * own :] for point in (a, b)
    )
    if own > 1 or second[1] == 0.0:
        return b
    tangent = b.tangent.copy()
    tangent[1] -= (second[2] - first[2]) / second[1] * tangent[0]
    return replace(b, tangent=tangent / b.curve.norm(tangent))


def start(orbit: PeriodicOrbit, symmetric: bool, scale: float) -> OrbitPoint:
    """A known orbit as the first point of its curve, to be followed towards larger parameters."""
    solution = orbit.solution
    curve = OrbitCurve(orbit.equations, (scale,), symmetric, orbit.equations.stretch(solution))
    found = Corrected(
        np.append(solution.unknowns, solution.values), solution.evaluation, solution.iterations
    )
    upwards = np.append(np.zeros(orbit.equations.size), scale)
    return curve.with_tangent(found, upwards) or curve.along_kernel(found)


Test = TestFunction


def fold(point: OrbitPoint) -> float:
    """The parameter's part of the tangent."""
    return float(point.tangent[-1])


@lru_cache(maxsize=4)  # a point ends one step and begins the next
def flip(point: OrbitPoint) -> float:
    """The determinant of the equations for perturbations that change their sign each (half)
    period.
    """
    units = point.curve.equations.units.unknowns
    return scaled_determinant(point.evaluation.jacobian(-1.0), units)


@lru_cache(maxsize=4)
def crossing(point: OrbitPoint) -> float:
    """The determinant of the equations with the tangent below them: it changes its sign where two
    branches cross.
    """
    weights = point.curve.weights
    matrix = bordered(point.evaluation.derivatives(), point.tangent * weights**2)
    return scaled_determinant(matrix, 1.0 / weights)


def scaled_determinant(matrix: np.ndarray, units: np.ndarray) -> float:
    """The determinant of the matrix with its columns in units of the unknowns, and with its rows
    scaled to length 1: the same sign, with rounding errors of one size.
    """
    return arithmetic().scaled_determinant(matrix, units)


def torus(point: OrbitPoint) -> float:
    """The product of (a b - 1) over all pairs (a, b) of multipliers: smooth, and 0 where a complex
    pair has the modulus 1.

    It is 0 at a real pair with a b = 1 as well, which is no special point; `BranchEvents.distinct`
    removes these zeros. A value within rounding of 0 is given as 0, as all along a branch of a
    system without loss. At a grazing the multipliers jump, and its sign may, so that it is nan
    there. For two multipliers a b comes from the determinants of the segments' maps: their product
    keeps its digits where one multiplier is large.
    """
    if point.orbit.grazes:
        return math.nan
    half = None if point.orbit.equations.following.size else point.evaluation.area_factor()
    if half is not None:
        product = (half**2 if point.orbit.symmetric else half) - 1.0
    else:
        product = _over_pairs(point.orbit.multipliers)
    return (
        0.0
        if abs(product) <= MULTIPLIER_ROUNDING
        else product
        if math.isfinite(product)
        else math.nan
    )


def _over_pairs(values: np.ndarray) -> float:
    """The product of (a b - 1) over all pairs (a, b) of multipliers."""
    if len(values) == 2:  # the larger one first
        first, second = values.tolist()
        negligible = not abs(second) > MULTIPLIER_ROUNDING * abs(first)
        return float((first * (0.0 if negligible else second) - 1.0).real)
    largest = np.abs(values).max(initial=0.0)  # some cycles have none
    with np.errstate(all="ignore"):
        values = np.where(np.abs(values) > MULTIPLIER_ROUNDING * largest, values, 0.0)
        one, other = _pairs(len(values))
        return float(np.prod(values[one] * values[other] - 1.0).real)


@cache
def _pairs(count: int) -> tuple[np.ndarray, np.ndarray]:
    """The places of both numbers of all pairs of so many."""
    first, second = np.triu_indices(count, 1)
    return first, second


# The multiplier that an orbit has at special points of these kinds. The multipliers of symmetric
# orbits are those of the whole period, the squares of those of a half.
CRITICAL: dict[str, float] = {SpecialKind.LP: 1.0, SpecialKind.BPC: 1.0, SpecialKind.PD: -1.0}
# How far rounding leaves this multiplier from its value: as far as the root of rounding, of an
# order that is the number of multipliers which come together there.
NEAR_CRITICAL = 0.1


def has_critical_multiplier(kind: str, orbit: PeriodicOrbit) -> bool:
    """Whether an orbit has the multiplier of a kind of special point, as far as it has multipliers
    and the kind has one; an orbit that grazes has no multipliers.
    """
    value = CRITICAL.get(kind)
    found = orbit.multipliers
    if value is None or not found.size or not np.isfinite(found).all():
        return True
    return bool(np.abs(found - value).min() < NEAR_CRITICAL)


def may_pass(kind: str, first: PeriodicOrbit, last: PeriodicOrbit) -> bool:
    """Whether a multiplier may have passed the value of a kind of special point between two orbits:
    not if as many real ones, up to an even number, are beyond this value at both.
    """
    value = CRITICAL.get(kind)
    counts = []
    for orbit in (first, last):
        found = orbit.multipliers
        # those of a symmetric orbit are squares, whose roots may have either sign
        if value is None or orbit.symmetric or not found.size or not np.isfinite(found).all():
            return True
        counts.append(int(((found.imag == 0.0) & (found.real * value > 1.0)).sum()))
    return (counts[1] - counts[0]) % 2 == 1


def complex_pairs(orbit: PeriodicOrbit) -> np.ndarray:
    """The moduli of the complex pairs of multipliers, (n,).

    Closed contacts make multipliers 0, and rounding turns these into small complex pairs, which do
    not count.
    """
    values = orbit.multipliers
    return np.asarray(np.abs(values[(values.imag > 1e-9) & (np.abs(values) > VANISHING)]))


def never_torus(orbit: PeriodicOrbit) -> bool:
    """Whether the flow never enlarges areas of the state plane, so that no complex pair can leave
    the unit circle (errata 22).
    """
    return area_contraction(orbit.system) is not None


def grazing(point: OrbitPoint) -> float:
    """The least of the impacts' speeds, of the gap's minima between impacts, and of `pressing`, in
    natural units: where it is negative the solution of the equations is no motion.

    Where the contact is no singularity, orbits exist on both sides of a grazing and a branch need
    not stop there: inf.
    """
    orbit = point.orbit
    return math.inf if orbit.equations.passes_contact else orbit.room


def touching(point: OrbitPoint) -> float:
    """How far an orbit is from touching a contact that is no singularity; the sign changes with
    each additional pair of passages through the contact."""
    orbit = point.orbit
    extremes = point.evaluation.extremes
    pairs = int(extremes[:, SegmentColumn.CROSSINGS].sum()) // 2
    least = min(orbit.clearance, orbit.shallowest) / orbit.equations.natural.length
    return float((-1) ** pairs * min(FARTHEST, least))


# Multipliers smaller than the largest one by this factor are rounding errors of 0: their products
# with it have no meaning. In a system without loss rounding makes this difference of a product of
# multipliers from 1.
MULTIPLIER_ROUNDING = 1e-12
# a complex pair of smaller modulus is a double multiplier 0: rounding moves it by the root of its
# size
VANISHING = 1e-4


CHANGES = {"decisive": True, "guides": True}  # tests whose zeros are smooth changes of stability
FLIP = {
    symmetric: Test(SpecialKind.BPC if symmetric else SpecialKind.PD, flip, **CHANGES)
    for symmetric in (True, False)
}
FOLD = Test(SpecialKind.LP, fold, **CHANGES)
CROSSING = Test(SpecialKind.BPC, crossing, singular=True, **CHANGES)
TORUS = Test(SpecialKind.NS, torus, decisive=True)
TOUCHING = Test(SpecialKind.GR, touching)
# narrower than others: beside a grazing an error grows to its square root
GRAZING = Test(SpecialKind.GR, grazing, 1e-15)


def branch_tests(point: OrbitPoint, functions: dict[str, UserFunction]) -> Iterator[Test]:
    """All test functions of a branch at a point, but that of grazings at a contact that is a
    singularity (`GRAZING`).
    """
    yield from (FOLD, FLIP[point.orbit.symmetric], CROSSING, TORUS)
    if point.orbit.equations.passes_contact:
        yield TOUCHING
    yield from orbit_tests(point.orbit, functions)


def orbit_tests(orbit: PeriodicOrbit, functions: dict[str, UserFunction]) -> Iterator[Test]:
    """The model's margins and the functions of the user as test functions, each by its name."""

    def margin(name: str) -> Callable[[Any], float]:
        return lambda point: float(point.orbit.margins[name])

    def value(function: UserFunction) -> Callable[[Any], float]:
        return lambda point: float(function(point.orbit))

    for name in orbit.equations.margins:
        yield Test(name, margin(name))
    for name, function in functions.items():
        yield Test(name, value(function))


def with_witness(zero: Zero) -> Zero:
    """A change of an orbit's events whose evidence names what vanishes there."""
    point = zero.point
    known = point.orbit.equations.witnesses(point.solution)
    if not known:
        return zero
    grazes = zero.kind == SpecialKind.GR
    of_kind = [witness for witness in known if witness.grazes == grazes] or known
    least = min(of_kind, key=lambda witness: abs(witness.value))
    return replace(zero, evidence=replace(zero.evidence, witness=least.what))


def curve_test(kind: SpecialKind, value: Callable[[Any], float]) -> TestFunction:
    """A test function along a curve of special points."""
    return TestFunction(kind, value, GRAZING.width)
