"""The test functions of a branch of orbits: each vanishes at one kind of special point."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from functools import lru_cache
from typing import Any

import numpy as np

from saltus.bounds import area_contraction
from saltus.continuation import TestFunction
from saltus.flow import segments as at
from saltus.orbits.orbit import PeriodicOrbit
from saltus.orbits.orbit_curve import OrbitPoint
from saltus.orbits.special_point import SpecialKind, UserFunction

Test = TestFunction


def fold(point: OrbitPoint) -> float:
    """The parameter's part of the tangent."""
    return float(point.tangent[-1])


@lru_cache(maxsize=4)  # a point ends one step and begins the next
def flip(point: OrbitPoint) -> float:
    """The determinant of the equations for perturbations that change their sign each (half) period."""
    return scaled_determinant(point.equations.jacobian(-1.0))


@lru_cache(maxsize=4)
def crossing(point: OrbitPoint) -> float:
    """The determinant of the equations with the tangent below them: it changes its sign where two branches cross."""
    return scaled_determinant(np.vstack([point.equations.derivatives(), point.tangent * point.curve.weights**2]))


def scaled_determinant(matrix: np.ndarray) -> float:
    """The determinant of the matrix with its rows scaled to length 1: the same sign, with rounding errors of one size."""
    lengths = np.linalg.norm(matrix, axis=1)
    return float(np.linalg.det(matrix / lengths[:, None])) if (lengths > 0).all() else 0.0


def torus(point: OrbitPoint) -> float:
    """The product, over all pairs of multipliers, of their product less 1: smooth, and 0 where a complex pair has the modulus 1.

    A real pair may have that product as well, which is no special point. 0 where it is so but for rounding all along, and -1
    where it grazes, as it is not known there. Of two multipliers it is that of the segments' determinants, which no large
    multiplier hides.
    """
    values, equations = point.orbit.multipliers, point.equations
    if point.orbit.grazes:
        return -1.0
    with np.errstate(all="ignore"):
        if len(values) == 2:
            half = float(np.prod(_areas(equations.here) / _areas(equations.there)))
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

    Multipliers of 0, which contacts make, are such pairs by rounding.
    """
    values = orbit.multipliers
    return float(np.abs(values[(np.abs(values.imag) > 1e-9) & (np.abs(values) > VANISHING)]).max(initial=0.0))


def never_torus(orbit: PeriodicOrbit) -> bool:
    """Whether areas of states never grow, so that no pair of multipliers leaves the unit circle (errata 22)."""
    return area_contraction(orbit.system) is not None


def grazing(point: OrbitPoint) -> float:
    """The least of the impacts' speeds, the gap's inner minima and what holds closed contacts: below 0 there is no orbit.

    Where the contact is no singularity there is one on both sides, and nothing to stop at.
    """
    orbit = point.orbit
    return math.inf if orbit.problem.passes_contact else min(orbit.slowest, orbit.clearance, orbit.pressing)


def touching(point: OrbitPoint) -> float:
    """How far an orbit is from touching a contact that is no singularity; its sign turns with each pair of passages more."""
    orbit, extremes = point.orbit, point.equations.extremes
    pairs = int(extremes[:, at.CROSSINGS].sum()) // 2
    return float((-1) ** pairs * min(NEAREST, orbit.clearance, orbit.shallowest))


PRODUCT_ROUNDING = 1e-12  # by which a product of multipliers may differ from 1 where nothing is lost
# Multipliers smaller than the largest one by this factor are 0 but for rounding, whose product with it may have any size.
MULTIPLIER_ROUNDING = 1e-12
VANISHING = 1e-4  # modulus below which a complex pair of multipliers is one of zeros, by the root of rounding
NEAREST = 1.0  # upper limit of the distance of an orbit from a grazing, which would be infinite for one that never turns


CHANGES = {"decisive": True, "guides": True}  # of stability, smoothly
FLIP = {symmetric: Test(SpecialKind.BPC if symmetric else SpecialKind.PD, flip, **CHANGES) for symmetric in (True, False)}
FOLD, CROSSING = Test(SpecialKind.LP, fold, **CHANGES), Test(SpecialKind.BPC, crossing, singular=True, **CHANGES)
TORUS = Test(SpecialKind.NS, torus, decisive=True)
TOUCHING = Test(SpecialKind.GR, touching)
GRAZING = Test(SpecialKind.GR, grazing, 1e-15)  # narrower than others: beside a grazing motions part by the square root


def branch_tests(point: OrbitPoint, functions: dict[str, UserFunction]) -> Iterator[Test]:
    """The test functions of a branch at a point that are zero at a special point, but for grazings."""
    yield from (FOLD, FLIP[point.orbit.symmetric], CROSSING, TORUS)
    if point.orbit.problem.passes_contact:
        yield TOUCHING
    yield from orbit_tests(point.orbit, functions)


def orbit_tests(orbit: PeriodicOrbit, functions: dict[str, UserFunction]) -> Iterator[Test]:
    """The model's margins and the functions of the user as test functions, each by its name."""

    def margin(name: str) -> Callable[[Any], float]:
        return lambda point: float(point.orbit.margins[name])

    def value(function: UserFunction) -> Callable[[Any], float]:
        return lambda point: float(function(point.orbit))

    for name in orbit.problem.margins:
        yield Test(name, margin(name))
    for name, function in functions.items():
        yield Test(name, value(function))
