"""The roots of the lanes: exact to rounding from any first guess, with the velocity there; and the
rough functions they use.
"""

import math
from typing import Any, NamedTuple

import numpy as np
import pytest
from numba import from_dtype, njit, types

from saltus.flow.kernel import layout as kernel_layout
from saltus.flow.kernel.layout import HIGHEST_ORDER, LOWEST_ORDER, SERIES_LENGTH
from saltus.flow.lane_steps import memory
from saltus.flow.lane_steps import steps as lane_steps
from saltus.flow.lane_steps.memory import FLAGS, ROW, SERIES, Gap
from saltus.taylor import compiled_part, lane_memory, lane_vectors, private_numba
from saltus.taylor.lane_memory import LanesType, named_tuple, shared_as
from saltus.taylor.lane_vectors import (
    ALL,
    load,
    mask,
    rough_exp2,
    rough_inverse,
    rough_log2,
    rough_root,
    select,
    splat,
    store,
)
from saltus.taylor.private_numba import OPTIONS
from saltus.taylor.vectors import WIDTH

EPS = 2.0**-52
H = 0.7  # the step
COMPILED = {"np": np, "math": math, "SERIES_LENGTH": SERIES_LENGTH}
COMPILED |= vars(lane_vectors) | vars(private_numba) | vars(lane_memory) | {"Gap": Gap}
for part in (kernel_layout, memory, lane_steps):
    exec(compiled_part(part), COMPILED)
motion_at, only_root, guess_from_end = (
    COMPILED["motion_at"],
    COMPILED["only_root"],
    COMPILED["guess_from_end"],
)
sweep, short_flight, guess_from_start = (
    COMPILED["sweep"],
    COMPILED["short_flight"],
    COMPILED["guess_from_start"],
)


class Order(NamedTuple):
    order: int


class Few(NamedTuple):
    """A group of lanes with the three series of one coordinate, and slots for what goes in and
    out.
    """

    memory: Any
    places: Any
    sizes: Any
    flags: Any
    rows: Any


PARTS = ("positions", "velocities", "accelerations")
SLOTS = ("step", "sign", "time", "speed", "certain")
STEP, SIGN, TIME, SPEED, CERTAIN = range(5)
PLACES = len(SLOTS) + SERIES_LENGTH * np.arange(3)
POSITIONS, VELOCITIES, ACCELERATIONS = PLACES
SIZE = len(SLOTS) + 3 * SERIES_LENGTH
LANES = LanesType("lanes of the tests of roots", SLOTS, PARTS, SERIES, "rows", "flags")
_ARRAYS = [types.Array(from_dtype(dtype), 1, "C") for dtype in (FLAGS, ROW)]
FEW = named_tuple(
    Few, types.float64[::1], types.int64[::1], named_tuple(Order, types.int64), *_ARRAYS
)
LanesType.tuples[LANES.name] = FEW
shared = shared_as(LANES)


def group(values, order):
    return Few(values.reshape(-1), PLACES, Order(order), np.zeros(1, FLAGS), np.zeros(WIDTH, ROW))


@njit(**OPTIONS)
def find(few):
    lanes = shared(few)
    h, sign, series = lanes.step, lanes.sign, lanes.positions[0]
    x, v, a, _ = motion_at(lanes, 0, series[0], h)
    cubic = (
        sign * series[0],
        sign * series[1] * h,
        sign * series[2] * (h * h),
        sign * series[3] * (h * h * h),
    )
    guess = guess_from_end(cubic, (x, v, a), sign, h)
    time, speed = only_root(lanes, Gap(0, series[0], sign, 0), guess, h, ALL)
    lanes.time = time
    lanes.speed = speed


@njit(**OPTIONS)
def find_short(few):
    lanes = shared(few)
    h, sign, series = lanes.step, lanes.sign, lanes.positions[0]
    _, _, _, bend = sweep(lanes, 0, h)
    square = h * h
    cubic = (
        sign * series[0],
        sign * series[1] * h,
        sign * series[2] * square,
        sign * series[3] * (square * h),
    )
    certain, flight = short_flight(cubic, bend)
    guess = guess_from_start(
        cubic, (sign * series[4] * square * square, sign * series[5] * square * square * h), flight
    )
    time, speed = only_root(lanes, Gap(0, series[0], sign, 0), guess * h, 2.0 * flight * h, certain)
    lanes.time = time
    lanes.speed = speed
    lanes.certain = select(mask(certain), splat(1.0), splat(0.0))


@njit(**OPTIONS)
def rough(m):
    store(m, 1, rough_log2(load(m, 0)))
    store(m, 2, rough_exp2(rough_log2(load(m, 0))))
    store(m, 3, rough_inverse(load(m, 0)))
    store(m, 4, rough_root(load(m, 0)))


def positions_of(kind, order, rng):
    """Coefficients of gaps that have one root in (0, H], their last terms from 1e-2, for guesses
    that are bad, to 1e-15.
    """
    k, digits = np.arange(order + 1), rng.choice([2, 6, 15], (WIDTH, 1))
    c = rng.normal(size=(WIDTH, order + 1)) * (10.0 ** (-digits / order) / H) ** k
    if kind == "falling":
        c[:, 0], c[:, 1] = rng.uniform(1e-3, 0.9, WIDTH), -3.0 / H
        c[:, 2:] *= 0.1
    else:  # concave: it comes from its summit, which is just above zero in some lanes
        summit, height = rng.uniform(0.0, 0.4, WIDTH) * H, 10.0 ** rng.uniform(-8, -1, WIDTH)
        c[:, 3:] *= 0.01
        c[:, 2] = -3.0 / H**2
        c[:, 1], c[:, 0] = -2.0 * c[:, 2] * summit, height + c[:, 2] * summit**2
        c[:, 0] = np.maximum(c[:, 0], 1e-9)  # with a summit so far away it leaves the contact
    return c


def root_of(c):
    """The root in (0, H], and the derivative there, in long doubles: bisection, then Newton's
    method.
    """
    p = np.polynomial.Polynomial(c.astype(np.longdouble))
    slope, low, high = p.deriv(), np.longdouble(0), np.longdouble(H)
    for _ in range(40):
        middle = (low + high) / 2
        low, high = (middle, high) if p(middle) > 0 else (low, middle)
    u = (low + high) / 2
    for _ in range(4):
        u = u - p(u) / slope(u)
    return u, slope(u)


@pytest.mark.skipif(np.finfo(np.longdouble).eps > 1e-18, reason="no long doubles on this machine")
@pytest.mark.parametrize("kind", ["falling", "concave"])
@pytest.mark.parametrize("order", [LOWEST_ORDER, HIGHEST_ORDER])
def test_roots_and_velocities_are_exact_to_rounding(kind, order):
    rng, errors = np.random.default_rng(order), []
    for _ in range(-(-400 // WIDTH)):
        c, values = positions_of(kind, order, rng), np.zeros((SIZE, WIDTH))
        sign = rng.choice([-1.0, 1.0], WIDTH)
        values[POSITIONS : POSITIONS + order + 1], values[STEP], values[SIGN] = (
            (sign[:, None] * c).T,
            H,
            sign,
        )
        values[VELOCITIES : VELOCITIES + order] = (
            sign[:, None] * c[:, 1:] * np.arange(1, order + 1)
        ).T
        find(group(values, order))
        for lane in range(WIDTH):
            root, slope = root_of(c[lane])
            size, bend = np.abs(c[lane] * H ** np.arange(order + 1)).sum(), 6.0 / H**2
            # what rounding of the gap does to its root
            late = 8 * EPS * max(size, 1.0) / abs(float(slope))
            errors.append(abs(float(values[TIME, lane] - root)) / (late + EPS * H))
            errors.append(
                abs(float(sign[lane] * values[SPEED, lane] - slope))
                / (bend * late + 16 * EPS * size / H)
            )
    assert max(errors) <= 1.0


def flights_of(order, rng):
    """Coefficients of gaps that begin at 0, for flights from 1e-6 of the step on under a pull that
    may turn round later in it.
    """
    k, share = np.arange(order + 1), 10.0 ** rng.uniform(-6, 0, WIDTH)
    c = rng.normal(size=(WIDTH, order + 1)) * 10.0 ** (
        rng.uniform(-2, 1, (WIDTH, 1)) - 6 * k / order
    )
    c[:, 0], c[:, 1], c[:, 2] = 0.0, share, -1.0
    return c / H**k, share * H


@pytest.mark.skipif(np.finfo(np.longdouble).eps > 1e-18, reason="no long doubles on this machine")
@pytest.mark.parametrize("order", [LOWEST_ORDER, HIGHEST_ORDER])
def test_short_flights_that_are_certain_have_one_root_to_relative_rounding(order):
    rng, errors, count, total = np.random.default_rng(order), [], 0, -(-2000 // WIDTH)
    for _ in range(total):
        (c, flight), values = flights_of(order, rng), np.zeros((SIZE, WIDTH))
        sign, k = rng.choice([-1.0, 1.0], WIDTH), np.arange(1, order + 1)
        velocity = c[:, 1:] * k
        values[POSITIONS : POSITIONS + order + 1], values[STEP], values[SIGN] = (
            (sign[:, None] * c).T,
            H,
            sign,
        )
        values[VELOCITIES : VELOCITIES + order] = (sign[:, None] * velocity).T
        values[ACCELERATIONS : ACCELERATIONS + order - 1] = (
            sign[:, None] * velocity[:, 1:] * k[:-1]
        ).T
        find_short(group(values, order))
        for lane in np.flatnonzero(values[CERTAIN]):
            p, time = (
                np.polynomial.Polynomial(c[lane, 1:].astype(np.longdouble)),
                np.longdouble(values[TIME, lane]),
            )
            along = p(2 * flight[lane] * np.linspace(0.0, 1.0, 200))
            assert (np.diff(along > 0) != 0).sum() == 1  # the gap over the time
            root = time - p(time) / p.deriv()(time)
            slope = root * p.deriv()(root)
            errors.append(abs(float((time - root) / root)) / EPS)
            errors.append(abs(float((sign[lane] * values[SPEED, lane] - slope) / slope)) / EPS)
            count += 1
    assert count > 0.3 * total * WIDTH
    assert max(errors) < 32


def test_rough_functions_are_as_good_as_they_say():
    rng = np.random.default_rng(0)
    for exponent in (-290, -20, -1, 0, 1, 20, 290):
        values = np.zeros((5, WIDTH))
        values[0] = rng.uniform(1.0, 10.0, WIDTH) * 10.0**exponent
        rough(values.reshape(-1))
        a, log, power, inverse, root = values
        assert np.abs(log - np.log2(a)).max() < 0.05
        assert np.abs(power / 2.0**log - 1.0).max() < 0.004
        assert np.abs(inverse * a - 1.0).max() < 1e-5
        assert np.abs(root / np.sqrt(a) - 1.0).max() < 0.002
    values[0] = np.linspace(-2.0, -1.0, WIDTH)
    rough(values.reshape(-1))
    assert np.abs(values[3] * values[0] - 1.0).max() < 1e-5
    values[0] = 0.0
    rough(values.reshape(-1))
    assert (values[4] == 0.0).all()
