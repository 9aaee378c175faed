"""The test functions of a branch of orbits: each vanishes at one kind of special point."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from functools import lru_cache
from typing import Any

import numpy as np

from saltus.bounds import area_contraction
from saltus.continuation import TestFunction
from saltus.flow import SegmentColumn
from saltus.orbits.branches.orbit_curve import OrbitPoint
from saltus.orbits.branches.special_point import SpecialKind, UserFunction
from saltus.orbits.orbit import PeriodicOrbit

Test = TestFunction


def fold(point: OrbitPoint) -> float:
    """The parameter's part of the tangent."""
    return float(point.tangent[-1])


@lru_cache(maxsize=4)  # a point ends one step and begins the next
def flip(point: OrbitPoint) -> float:
    """The determinant of the equations for perturbations that change their sign each (half) period."""
    return scaled_determinant(point.evaluation.jacobian(-1.0))


@lru_cache(maxsize=4)
def crossing(point: OrbitPoint) -> float:
    """The determinant of the equations with the tangent below them: it changes its sign where two branches cross."""
    return scaled_determinant(np.vstack([point.evaluation.derivatives(), point.tangent * point.curve.weights**2]))


def scaled_determinant(matrix: np.ndarray) -> float:
    """The determinant of the matrix with its rows scaled to length 1: the same sign, with rounding errors of one size."""
    lengths = np.linalg.norm(matrix, axis=1)
    return float(np.linalg.det(matrix / lengths[:, None])) if (lengths > 0).all() else 0.0


def torus(point: OrbitPoint) -> float:
    """The product of (a b - 1) over all pairs (a, b) of multipliers: smooth, and 0 where a complex pair has the modulus 1.

    It is 0 at a real pair with a b = 1 as well, which is no special point; `BranchEvents.distinct` removes these zeros. A value
    within rounding of 0 is given as 0, as all along a branch of a system without loss; at a grazing the multipliers are unknown
    and it is -1. For two multipliers a b comes from the determinants of the segments' maps: their product keeps its digits
    where one multiplier is large.
    """
    values, evaluation = point.orbit.multipliers, point.evaluation
    if point.orbit.grazes:
        return -1.0
    with np.errstate(all="ignore"):
        if len(values) == 2:
            half = float(np.prod(_areas(evaluation.here) / _areas(evaluation.there)))
            product = (half**2 if point.orbit.symmetric else half) - 1.0
        else:
            values = np.where(np.abs(values) > MULTIPLIER_ROUNDING * np.abs(values).max(), values, 0.0)
            first, second = np.triu_indices(len(values), 1)
            product = float(np.prod(values[first] * values[second] - 1.0).real)
    return -1.0 if not math.isfinite(product) else product if abs(product) > PRODUCT_ROUNDING else 0.0


def _areas(maps: np.ndarray) -> np.ndarray:
    """The determinants of maps (..., d, d)."""
    if maps.shape[-1] != 2:
        return np.asarray(np.linalg.det(maps))
    return np.asarray(maps[..., 0, 0] * maps[..., 1, 1] - maps[..., 0, 1] * maps[..., 1, 0])


def complex_pair(orbit: PeriodicOrbit) -> float:
    """The largest modulus of a complex pair of multipliers; 0 where there is none.

    Closed contacts make multipliers 0, and rounding turns these into small complex pairs, which do not count.
    """
    values = orbit.multipliers
    return float(np.abs(values[(np.abs(values.imag) > 1e-9) & (np.abs(values) > VANISHING)]).max(initial=0.0))


def never_torus(orbit: PeriodicOrbit) -> bool:
    """Whether the flow never enlarges areas of the state plane, so that no complex pair can leave the unit circle (errata 22)."""
    return area_contraction(orbit.system) is not None


def grazing(point: OrbitPoint) -> float:
    """The least of the impacts' speeds, of the gap's minima between impacts, and of `pressing`: where it is negative the solution
    of the equations is no motion.

    Where the contact is no singularity, orbits exist on both sides of a grazing and a branch need not stop there: inf.
    """
    orbit = point.orbit
    return math.inf if orbit.equations.passes_contact else min(orbit.slowest, orbit.clearance, orbit.pressing)


def touching(point: OrbitPoint) -> float:
    """How far an orbit is from touching a contact that is no singularity; the sign changes with each additional pair of passages
    through the contact."""
    orbit, extremes = point.orbit, point.evaluation.extremes
    pairs = int(extremes[:, SegmentColumn.CROSSINGS].sum()) // 2
    return float((-1) ** pairs * min(NEAREST, orbit.clearance, orbit.shallowest))


PRODUCT_ROUNDING = 1e-12  # the difference of a product of multipliers from 1 that rounding makes in a system without loss
# Multipliers smaller than the largest one by this factor are rounding errors of 0: their products with it have no meaning.
MULTIPLIER_ROUNDING = 1e-12
VANISHING = 1e-4  # a complex pair of smaller modulus is a double multiplier 0: rounding moves it by the root of its size
NEAREST = 1.0  # upper limit of the distance of an orbit from a grazing, which is infinite for one whose gap has no minimum


CHANGES = {"decisive": True, "guides": True}  # tests whose zeros are smooth changes of stability
FLIP = {symmetric: Test(SpecialKind.BPC if symmetric else SpecialKind.PD, flip, **CHANGES) for symmetric in (True, False)}
FOLD, CROSSING = Test(SpecialKind.LP, fold, **CHANGES), Test(SpecialKind.BPC, crossing, singular=True, **CHANGES)
TORUS = Test(SpecialKind.NS, torus, decisive=True)
TOUCHING = Test(SpecialKind.GR, touching)
GRAZING = Test(SpecialKind.GR, grazing, 1e-15)  # narrower than others: beside a grazing an error grows to its square root


def branch_tests(point: OrbitPoint, functions: dict[str, UserFunction]) -> Iterator[Test]:
    """All test functions of a branch at a point, but that of grazings at a contact that is a singularity (`GRAZING`)."""
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


def curve_test(kind: SpecialKind, value: Callable[[Any], float]) -> TestFunction:
    """A test function along a curve of special points."""
    return TestFunction(kind, value, GRAZING.width)
