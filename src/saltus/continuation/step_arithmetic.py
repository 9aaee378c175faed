"""The arithmetic of a step of a continuation on plain arrays, compiled: for the few numbers of most
curves, NumPy's calls would take many times longer than what they compute.

The corrector's step and the tangent, the equations of a motion's segments, of which a matrix is made
block by block, and the judgement of the test functions' last values. The functions keep none of
their arrays; sizes are for any number of unknowns.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Callable
from functools import cache
from typing import NamedTuple

import numpy as np

from saltus.taylor import cached_jit, compiled_part, entry_point, jit, load_module

FLOAT = np.dtype(float)
HEADER = """import math

import numpy as np

from saltus.taylor.private_numba import cached_jit, jit
"""


class Arithmetic(NamedTuple):
    """The compiled functions that are called from outside, with arrays of floats (`as_floats`)."""

    sizes_of: Callable[..., tuple[float, float, float]]
    newton_step: Callable[..., float]
    border: Callable[..., None]
    tangent_along: Callable[..., float]
    arc_length: Callable[..., float]
    place_ahead: Callable[..., None]
    fill_blocks: Callable[..., None]
    product_of_maps: Callable[..., bool]
    product_of_areas: Callable[..., float]
    scaled_determinant: Callable[..., float]
    is_expected: Callable[..., bool]
    where_to_look: Callable[..., float]


@cache
def arithmetic() -> Arithmetic:
    """The functions, compiled once for all curves."""
    module = load_module("arithmetic", HEADER + compiled_part(sys.modules[__name__]))
    return Arithmetic._make(entry_point(getattr(module, name)) for name in Arithmetic._fields)


def as_floats(*arrays: np.ndarray) -> list[np.ndarray]:
    """Arrays as compiled functions take them, which would read integers as if they were floats."""
    return [array if array.dtype is FLOAT else np.asarray(array, dtype=float) for array in arrays]


# --- compiled from here on ---------------------------------------------------


@jit
def eliminate(matrix, right):
    """Solve linear equations with right-hand sides (n, m) in place, by elimination with the largest
    pivots; the determinant, and whether no pivot is 0: of many small ones the product may be.
    """
    n = matrix.shape[0]
    determinant = 1.0
    for k in range(n):
        pivot = k
        for i in range(k + 1, n):
            if abs(matrix[i, k]) > abs(matrix[pivot, k]):
                pivot = i
        if matrix[pivot, k] == 0.0:
            return 0.0, False
        if pivot != k:
            determinant = -determinant
            for j in range(k, n):
                matrix[k, j], matrix[pivot, j] = matrix[pivot, j], matrix[k, j]
            for j in range(right.shape[1]):
                right[k, j], right[pivot, j] = right[pivot, j], right[k, j]
        determinant *= matrix[k, k]
        for i in range(k + 1, n):
            factor = matrix[i, k] / matrix[k, k]
            if factor != 0.0:
                for j in range(k + 1, n):
                    matrix[i, j] -= factor * matrix[k, j]
                for j in range(right.shape[1]):
                    right[i, j] -= factor * right[k, j]
    for k in range(n - 1, -1, -1):
        for j in range(right.shape[1]):
            value = right[k, j]
            for i in range(k + 1, n):
                value -= matrix[k, i] * right[i, j]
            right[k, j] = value / matrix[k, k]
    return determinant, True


@jit
def solve_scaled(matrix, right, units, scaled):
    """Solve linear equations in place, if `scaled` in the units of the unknowns and with rows of one
    size: else the pivots, and how rounding grows, would depend on the units of the user. Whether
    that is possible.
    """
    n = matrix.shape[0]
    if scaled:
        for i in range(n):
            size = 0.0
            for j in range(n):
                matrix[i, j] *= units[j]
                size = max(size, abs(matrix[i, j]))
            if not size > 0.0:
                return False
            for j in range(n):
                matrix[i, j] /= size
            right[i, 0] /= size
    if not eliminate(matrix, right)[1]:
        return False
    if scaled:
        for i in range(n):
            right[i, 0] *= units[i]
    return True


@jit
def larger(size, value):
    """The larger of two numbers, of which nan is the largest."""
    return value if value > size or value != value else size


# --- Newton's method ---------------------------------------------------------


@cached_jit("UniTuple(f8, 3)(f8[:], f8[:], f8[:], f8[:], f8[:])")
def sizes_of(residual, place, unknowns, residuals, terms):
    """The largest residual in its unit, the same as a share of the terms, and the largest unknown in
    its unit, at least 1.
    """
    error = 0.0
    share = 0.0
    for i in range(residual.size):
        value = abs(residual[i] / residuals[i])
        error = larger(error, value)
        share = larger(share, value / terms[i])
    scale = 1.0
    for i in range(place.size):
        scale = larger(scale, abs(place[i] / unknowns[i]))
    return error, share, scale


@cached_jit("f8(f8[:, :], f8[:], f8[:], f8[:], b1[:], b1, f8, f8[:])")
def newton_step(matrix, right, place, units, bounded, scaled, longest, step):
    """Newton's step from a place, no longer than `longest`, and its largest component in units; nan
    where there is none.

    Components that are not `bounded` are measured by the largest of them at the place.
    """
    n = right.size
    work = np.empty((n, n))
    solution = np.empty((n, 1))
    for i in range(n):
        solution[i, 0] = right[i]
        for j in range(n):
            work[i, j] = matrix[i, j]
    if not solve_scaled(work, solution, units, scaled):
        return math.nan
    size = 1.0
    for i in range(n):
        if not bounded[i]:
            size = larger(size, abs(place[i] / units[i]))
    length = 0.0
    moved = 0.0
    for i in range(n):
        value = abs(solution[i, 0] / units[i])
        moved = larger(moved, value)
        length = larger(length, value if bounded[i] else value / size)
    if not length < math.inf:
        return math.nan
    share = longest / length if length > longest else 1.0
    for i in range(n):
        step[i] = share * solution[i, 0]
    return share * moved


@cached_jit("void(f8[:, :], f8[:], f8[:], f8[:], f8[:], f8[:, :], f8[:])")
def border(rows, residual, normal, place, guess, matrix, right):
    """The equations of Newton's step in the hyperplane through a guess with a normal."""
    n = place.size
    along = 0.0
    for j in range(n):
        for i in range(n - 1):
            matrix[i, j] = rows[i, j]
        matrix[n - 1, j] = normal[j]
        along += normal[j] * (place[j] - guess[j])
    for i in range(n - 1):
        right[i] = -residual[i]
    right[n - 1] = -along


@cached_jit("f8(f8[:, :], f8[:], f8[:], b1, f8[:])")
def tangent_along(rows, direction, weights, scaled, tangent):
    """The tangent that goes along a direction, of length 1 in the norm with these weights, and its
    length before; 0 where it is not unique.
    """
    n = direction.size
    matrix = np.empty((n, n))
    solution = np.zeros((n, 1))
    units = np.empty(n)
    for j in range(n):
        for i in range(n - 1):
            matrix[i, j] = rows[i, j]
        matrix[n - 1, j] = direction[j] * weights[j] * weights[j]
        units[j] = 1.0 / weights[j]
    solution[n - 1, 0] = 1.0
    if not solve_scaled(matrix, solution, units, scaled):
        return 0.0
    square = 0.0
    for i in range(n):
        square += (weights[i] * solution[i, 0]) ** 2
    length = math.sqrt(square)
    for i in range(n):
        tangent[i] = solution[i, 0] / length
    return length


# --- the cubic through two points with their tangents ------------------------


@cached_jit("f8(f8[:], f8[:], f8[:], f8[:], f8[:])")
def arc_length(weights, place, tangent, following, tangent_there):
    """The length of a curve between two points, to the order that the cubic needs."""
    chord = 0.0
    turn = 0.0
    for i in range(place.size):
        chord += (weights[i] * (following[i] - place[i])) ** 2
        turn += (weights[i] * (tangent_there[i] - tangent[i])) ** 2
    return math.sqrt(chord) * (1.0 + turn / 24.0)


@cached_jit("void(f8[:], f8[:], f8[:], f8[:], f8, f8, f8[:])")
def place_ahead(earlier, tangent_earlier, place, tangent, length, step, ahead):
    """The place a step beyond a point, on the cubic through it and an earlier one, with the length
    of the curve between them.
    """
    u = step / length
    for i in range(place.size):
        chord = place[i] - earlier[i]
        # the deviation of the cubic from the tangent has terms of second and of third order
        bend = tangent[i] * length - chord
        twist = tangent_earlier[i] * length - chord
        ahead[i] = (
            place[i] + step * tangent[i] + u**2 * (2.0 * bend + twist) + u**3 * (bend + twist)
        )


# --- equations of a motion's segments ----------------------------------------


@cached_jit("void(f8[:, :, :], f8[:, :, :], f8, f8[:, :])")
def fill_blocks(here, there, closing, matrix):
    """Write the derivatives of the equations of segments into a matrix of zeros: block row i has
    `here[i]` in the columns of segment i and `there[i]`, of the last one times `closing`, in those
    of the next one.
    """
    n = here.shape[0]
    d = here.shape[1]
    for s in range(n):
        first = d * s
        second = d * (s + 1) if s + 1 < n else 0
        factor = 1.0 if s + 1 < n else closing
        for i in range(d):
            for j in range(d):
                matrix[first + i, first + j] += here[s, i, j]
                matrix[first + i, second + j] += factor * there[s, i, j]


@cached_jit("b1(f8[:, :, :], f8[:, :, :], f8[:, :])")
def product_of_maps(here, there, product):
    """The product of the maps -there^-1 here of all segments; whether they all exist."""
    d = here.shape[1]
    work = np.empty((d, d))
    right = np.empty((d, d))
    for i in range(d):
        for j in range(d):
            product[i, j] = 1.0 if i == j else 0.0
    for s in range(here.shape[0]):
        for i in range(d):
            for j in range(d):
                work[i, j] = there[s, i, j]
                right[i, j] = -here[s, i, j]
        if not eliminate(work, right)[1]:
            return False
        for j in range(d):
            for i in range(d):
                work[i, 0] = 0.0
                for k in range(d):
                    work[i, 0] += right[i, k] * product[k, j]
            for i in range(d):
                product[i, j] = work[i, 0]
    return True


@cached_jit("f8(f8[:, :, :], f8[:, :, :])")
def product_of_areas(here, there):
    """The determinant of this product for segments with two unknowns."""
    product = 1.0
    for s in range(here.shape[0]):
        product *= (here[s, 0, 0] * here[s, 1, 1] - here[s, 0, 1] * here[s, 1, 0]) / (
            there[s, 0, 0] * there[s, 1, 1] - there[s, 0, 1] * there[s, 1, 0]
        )
    return product


@cached_jit("f8(f8[:, :], f8[:])")
def scaled_determinant(matrix, units):
    """The determinant of a matrix with its columns in units of the unknowns and its rows scaled to
    length 1: rounding errors are of one size then. 0 if a row is.
    """
    n = matrix.shape[0]
    work = np.empty((n, n))
    for i in range(n):
        square = 0.0
        for j in range(n):
            work[i, j] = matrix[i, j] * units[j]
            square += work[i, j] ** 2
        if not square > 0.0:
            return 0.0
        for j in range(n):
            work[i, j] /= math.sqrt(square)
    return eliminate(work, np.empty((n, 0)))[0]


# --- the values of test functions along a curve ------------------------------


@cached_jit("b1(f8[:, :], f8[:], f8[:], f8, b1[:], f8)")
def is_expected(values, arcs, found, arc, guides, share):
    """Whether the values found at a length of the curve are near the parabolas through the last
    three, (3, m). Those that are guides may differ by a share of the largest value.
    """
    a, b, c = arcs
    first = (arc - b) * (arc - c) / ((a - b) * (a - c))
    second = (arc - a) * (arc - c) / ((b - a) * (b - c))
    third = (arc - a) * (arc - b) / ((c - a) * (c - b))
    for i in range(found.size):
        if not guides[i]:
            continue
        expected = first * values[0, i] + second * values[1, i] + third * values[2, i]
        size = abs(found[i])
        for k in range(3):
            size = larger(size, abs(values[k, i]))
        if not abs(found[i] - expected) <= share * size:
            return False
    return True


@jit
def second_order(end, value, rise, arcs, i):
    """The divided difference of second order with the point i."""
    return ((end - value) / (arcs[1] - arcs[i]) - rise / (arcs[1] - arcs[0])) / (arcs[i] - arcs[0])


@cached_jit("f8(f8[:], f8[:], f8[:, :], f8[:], f8, f8, i8)")
def where_to_look(begin, end, near, arcs, doubt, inner, count):
    """The share of the way between two points at which a test function may have zeros that its
    values `begin` and `end` do not show; nan if there is no such place.

    The cubic through these and up to two further points, with values `near` (k, m), is compared
    with its uncertainty at `count` places. Without these points the last known term is the
    uncertain one; for a straight line this is half of its rise. `arcs` are the lengths of the
    curve up to the points, in that order.
    """
    length = arcs[1] - arcs[0]
    # the factor of third order along the way, of the form `lever + slope * share`
    lever = arcs[0] - arcs[2] if near.shape[0] > 1 else 1.0
    slope = length if near.shape[0] > 1 else 0.0
    longest = max(abs(lever), abs(lever + slope))
    worst = 0.0
    place = math.nan
    for row in range(begin.size):
        rise = end[row] - begin[row]
        bend = 0.0
        twist = 0.0
        unsure = abs(rise)
        if near.shape[0] > 0:
            bend = length**2 * second_order(end[row], near[0, row], rise, arcs, 2)
            unsure = abs(bend)
        if near.shape[0] > 1:
            other = length**2 * second_order(end[row], near[1, row], rise, arcs, 3)
            twist = (other - bend) / (arcs[3] - arcs[2])
            unsure = abs(twist)
        same = (begin[row] > 0.0) == (end[row] > 0.0)
        room = 4.0 * min(abs(begin[row]), abs(end[row])) if same else abs(rise)
        swing = abs(bend) + 1.25 * longest * (abs(twist) + unsure)
        if begin[row] == 0.0 or end[row] == 0.0 or not room <= swing < math.inf:
            continue
        sign = 1.0 if begin[row] > 0.0 else -1.0
        least = math.inf
        turns_below = 0
        turns_above = 0
        share = 0.0
        last_below = 0.0
        last_above = 0.0
        for k in range(count):
            x = k / (count - 1.0)
            parabola = x * (1.0 - x)
            factor = lever + slope * x
            cubic = begin[row] + rise * x - parabola * (bend + twist * factor)
            margin = doubt * parabola * unsure * abs(factor)
            below = np.sign(cubic - margin)
            above = np.sign(cubic + margin)
            if k > 0:
                turns_below += below != last_below
                turns_above += above != last_above
            last_below = below
            last_above = above
            if sign * cubic - margin < least:
                least = sign * cubic - margin
                share = x
        if same:
            depth = -least / max(abs(begin[row]), abs(end[row]))
            if depth > worst:
                worst = depth
                place = min(max(share, inner), 1.0 - inner)
        elif max(turns_below, turns_above) > 1:
            worst = max(worst, 1.0)
            place = 0.5 if place != place else place
    return place
