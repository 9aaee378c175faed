"""One step of a group of lanes: its length, the roots of the gap within it, and the new state.

Its compiled part goes into one module with that of `driver.py`.
"""

from __future__ import annotations

import math

import numpy as np

from saltus.flow.kernel.layout import DEFECT, PAIR_GAP, SMALLEST
from saltus.flow.lane_steps.memory import TOUCH
from saltus.taylor import inline_jit, lean_jit
from saltus.taylor.lane_memory import one
from saltus.taylor.lane_vectors import (
    ALL,
    absolute,
    bits,
    fma,
    mask,
    maximum,
    minimum,
    rough_exp2,
    rough_inverse,
    rough_log2,
    rough_root,
    select,
    splat,
    vector_lane,
    with_lane,
)
from saltus.taylor.vectors import WIDTH


def step_limits(
    order: int, tol: float
) -> tuple[float, tuple[float, float], float, tuple[float, float, float, float]]:
    """Constants of `row_step`: log2 of tol; log2 of the factor by which the radius of convergence
    may exceed the step from the last terms, by the upper half of a series, and this factor; what
    the pair of terms before the last counts more; and one over the orders of the last terms.
    """
    log_tol = math.log2(tol)
    half = -log_tol / order - LOG_GAP
    narrower = LOG_GAP - PAIR_GAP * math.log2(math.e) / order
    return (
        log_tol,
        (half, 2.0**half),
        2.0 ** ((order - LAST_TERMS - 1) * narrower + 1.0),  # mostly one of them is large
        (1.0 / (order - 3), 1.0 / (order - 2), 1.0 / (order - 1), 1.0 / order),
    )


# --- compiled from here on ---------------------------------------------------

ZERO_TERM = 1e-300
# the largest of so many last terms of a series limits the step: two of them may nearly vanish
# together
LAST_TERMS = 4
# like `kernel_layout.GAP`, but for the last four terms: if these vanish, so do others
LOG_GAP = 0.35 * math.log2(math.e)
# of the time, and of the slope: after a shorter move the root is exact to rounding, as its cube is
# rounding
NEARLY = 1e-5


@inline_jit
def rate_of_change(lanes, series, tau):
    """The derivative of a series at `tau`: of that of a velocity, the acceleration."""
    order = lanes.sizes.order
    value = (1.0 * order) * series[order]
    for k in range(order - 1, 0, -1):
        value = fma(value, tau, (1.0 * k) * series[k])
    return value


@inline_jit
def note_impacts(lanes, hit, speed, pull):
    """Note the speeds and the accelerations at impacts in the lanes `hit` for the natural scales
    (`steps.note_impact`).
    """
    chosen = mask(hit)
    lanes.fastest = select(chosen, maximum(lanes.fastest, absolute(speed)), lanes.fastest)
    lanes.pull = select(chosen, maximum(lanes.pull, absolute(pull)), lanes.pull)


@inline_jit
def natural_speeds(lanes):
    """The speed of each lane of which a share is slow: the natural one (`steps.natural_speed`), or
    that of the fastest impact.
    """
    length = lanes.period_length
    own = splat(lanes.settings.natural_time)
    of_load = length * (0.5 / math.pi)
    time = select(mask(bits(length > 0.0) & bits(of_load < own)), of_load, own)
    return maximum(lanes.pull * time, lanes.fastest)


@inline_jit
def state_size(lanes):
    """The size of the state, a speed (`steps.state_size`)."""
    return rows_size(lanes, 0, lanes.sizes.own)


@inline_jit
def rows_size(lanes, first, last):
    """The size of some rows of the state; the accelerations are coefficients of the velocities."""
    square = splat(0.0)
    largest = splat(0.0)
    for row in range(first, last):
        speed = lanes.velocities[row][0]
        pull = absolute(lanes.velocities[row][1])
        square = maximum(square, maximum(speed * speed, absolute(lanes.position[row]) * pull))
        largest = maximum(largest, pull)
    still = select(mask(bits(largest > 0.0)), largest, splat(SMALLEST))
    return select(mask(bits(square > 0.0)), rough_root(square), still)


@inline_jit
def natural_step(lanes, size):
    """The step that the series of all rows allow, including those of the tangent's columns,
    relative to the size of the state.
    """
    rows = lanes.sizes.own
    limits = lanes.settings.limits
    step = row_step(lanes.velocities[0], lanes.sizes.order, size, limits)
    for row in range(1, rows):
        step = minimum(step, row_step(lanes.velocities[row], lanes.sizes.order, size, limits))
    for first in range(rows, lanes.sizes.rows, rows):
        step = minimum(step, column_step(lanes, first))
    return step


@lean_jit
def column_step(lanes, first):
    """The step that the series of a column of the tangent allows, relative to its own size
    (`steps.column_step`).
    """
    size = rows_size(lanes, first, first + lanes.sizes.own)
    step = splat(np.inf)
    for row in range(first, first + lanes.sizes.own):
        step = minimum(
            step,
            row_step(lanes.velocities[row], lanes.sizes.order, size, lanes.settings.column_limits),
        )
    return step


@inline_jit
def row_step(series, order, size, limits):
    """The step at which the largest of a series' last terms is tol, relative to `size`.

    If the last terms vanish, the growth of the series is taken from all terms of its upper half; if
    they are only small, from the two terms before them, as in `steps.step_size`.
    """
    log_tol, of_half, of_pair, inverses = limits
    wanted = log_tol + rough_log2(size)
    step = splat(500.0)
    for j in range(LAST_TERMS):
        term = absolute(series[order - LAST_TERMS + 1 + j])
        step = minimum(step, (wanted - rough_log2(maximum(splat(ZERO_TERM), term))) * inverses[j])
    step = maximum(step, splat(-500.0))
    natural = rough_exp2(step)
    half = order // 2
    reach = natural * of_half[1]
    first = order - LAST_TERMS - 1
    pair = fma(absolute(series[first + 1]), reach, absolute(series[first]))
    upper = pair
    for k in range(first - 1, half - 1, -1):
        upper = fma(upper, reach, absolute(series[k]))
        pair = pair * reach
    # one logarithm tells whether either is too large
    scale = half * (step + of_half[0]) - (wanted - log_tol + 1.0)
    doubtful = bits(rough_log2(maximum(upper, pair * of_pair)) + scale > 0.0)
    if doubtful:
        log_size = wanted - log_tol
        shorter = rough_exp2(earlier_step(series, order, first, log_size, log_tol))
        natural = select(mask(doubtful), minimum(shorter, natural), natural)
        vanishing = bits(rough_log2(upper) + scale > 0.0)
        if vanishing:
            shorter = rough_exp2(earlier_step(series, order, half, log_size, log_tol))
            natural = select(mask(vanishing), minimum(shorter, natural), natural)
    return natural


@lean_jit
def earlier_step(series, order, first, log_size, log_tol):
    """log2 of the step that the terms of a series from `first` on allow, without its last ones."""
    step = splat(500.0)
    for k in range(first, order - LAST_TERMS + 1):
        growth = (rough_log2(maximum(splat(ZERO_TERM), absolute(series[k]))) - log_size) * (1.0 / k)
        step = minimum(step, log_tol / order - growth)
    return step


@inline_jit
def sweep(lanes, row, h):
    """The mean velocity of a coordinate over [0, h], its velocity and acceleration at h, and B =
    h^2 sum_{j>=2} abs(a_j) h^j.

    From the mean velocity follow both the coordinate at h and its distance from a contact, each
    with all of its digits: one from the other would lose them where the contact is far away, or
    near. B bounds the difference between the second derivative in u = t/h and that of the cubic q_0
    + ... + q_3 h^3 u^3.
    """
    order = lanes.sizes.order
    positions = lanes.positions[row]
    velocities = lanes.velocities[row]
    accelerations = lanes.accelerations[row]
    x = positions[order]
    v = velocities[order]
    a = accelerations[order - 1]
    bend = absolute(a)
    x, v = fma(x, h, positions[order - 1]), fma(v, h, velocities[order - 1])
    for k in range(order - 2, 1, -1):
        coefficient = accelerations[k]
        x, v = fma(x, h, positions[k]), fma(v, h, velocities[k])
        a, bend = fma(a, h, coefficient), fma(bend, h, absolute(coefficient))
    x, v, a = fma(x, h, positions[1]), fma(v, h, velocities[1]), fma(a, h, accelerations[1])
    square = h * h
    return x, fma(v, h, velocities[0]), fma(a, h, accelerations[0]), bend * (square * square)


@inline_jit
def motion_at(lanes, row, start, h):
    """Position (with `start` as its value at 0), velocity, acceleration, and half the
    acceleration's rate of change, at h.
    """
    order = lanes.sizes.order
    positions = lanes.positions[row]
    velocities = lanes.velocities[row]
    x = positions[order]
    v = velocities[order]
    a = splat(0.0)
    jerk = splat(0.0)
    for k in range(order - 1, 0, -1):
        jerk, a = fma(jerk, h, a), fma(a, h, v)
        v, x = fma(v, h, velocities[k]), fma(x, h, positions[k])
    jerk, a = fma(jerk, h, a), fma(a, h, v)
    return fma(x, h, start), fma(v, h, velocities[0]), a, jerk


@inline_jit
def both_at(lanes, row, h):
    """Position and velocity at h.

    Even and odd powers are summed apart, so that the processor works on four sums at once.
    """
    order = lanes.sizes.order
    positions = lanes.positions[row]
    velocities = lanes.velocities[row]
    square = h * h
    top = order - (order & 1)
    x = positions[top]
    v = velocities[top]
    y = splat(0.0)
    w = splat(0.0)
    if order & 1:
        y = positions[order]
        w = velocities[order]
    for k in range(top - 2, 0, -2):
        x, v = fma(x, square, positions[k]), fma(v, square, velocities[k])
        y, w = fma(y, square, positions[k + 1]), fma(w, square, velocities[k + 1])
    x, v = fma(x, square, positions[0]), fma(v, square, velocities[0])
    y, w = fma(y, square, positions[1]), fma(w, square, velocities[1])
    return fma(y, h, x), fma(w, h, v)


@inline_jit
def shape(cubic, bend, skip):
    """Properties that a gap p0 + p1 u + p2 u^2 + p3 u^3 + ... certainly has for u in [0, 1], from
    its cubic and the bound B of the other terms (see `sweep`).

    Returns bits of the lanes in which it has no root, in which it falls, in which it is concave,
    and in which it is convex. The root at 0 does not count where `skip` is set; by the Bernstein
    coefficients of the cubic, of its derivatives, or of the gap over u.
    """
    g0, g1, g2, g3 = cubic
    rest = bend * (1.0 / 12.0)
    end = g0 + g1 + g2 + g3
    low = minimum(
        minimum(g0, g0 + g1 * (1.0 / 3.0)), minimum(g0 + (2.0 * g1 + g2) * (1.0 / 3.0), end)
    )
    low = select(mask(skip), minimum(minimum(g1, g1 + 0.5 * g2), g1 + g2 + g3), low)
    steepest = maximum(maximum(g1, g1 + g2), g1 + 2.0 * g2 + 3.0 * g3)
    falls = bits(steepest < bend * (-1.0 / 3.0))
    first = 2.0 * g2
    last = 2.0 * g2 + 6.0 * g3
    return (
        bits(low > rest),
        falls,
        bits(maximum(first, last) < -bend),
        bits(minimum(first, last) > bend),
    )


@inline_jit
def root_move(value, inverse, second, third):
    """The distance of a root from an argument, from the Taylor coefficients there and the inverse
    of the slope, to O(move^4).
    """
    n = value * inverse
    a = second * inverse
    b = third * inverse
    return -n * fma(n, fma(n, fma(2.0 * a, a, -b), a), splat(1.0))


@inline_jit
def guess_from_end(cubic, end, sign, h):
    """The root in [0, h] of the sextic that has the gap's values and derivatives at both ends of a
    step.

    Scaled to a step of 1, the gap is g0 + g1 u + g2 u^2 + g3 u^3 + ... at the start; at the end it
    is f, with its slope and half its curvature, `pull`. The root is one move (`root_move`) from the
    root of the parabola at the end; d is its distance from the end.
    """
    f = sign * end[0]
    slope = sign * end[1] * h
    pull = 0.5 * sign * end[2] * (h * h)
    g0, g1, g2, g3 = cubic
    # the difference from the parabola at the start
    a = g0 - f + slope - pull
    b = g1 - slope + 2.0 * pull
    c = g2 - pull
    c3 = 20.0 * a + 10.0 * b + 4.0 * c + g3
    c4 = -45.0 * a - 25.0 * b - 11.0 * c - 3.0 * g3
    c5 = 36.0 * a + 21.0 * b + 10.0 * c + 3.0 * g3
    c6 = -10.0 * a - 6.0 * b - 3.0 * c - g3
    square = maximum(fma(slope, slope, -4.0 * f * pull), splat(0.0))
    d = minimum(2.0 * f * rough_inverse(slope - rough_root(square)), splat(1.0))
    p1 = fma(c6, d, c5)  # Horner's rule, repeated for the derivatives
    p2 = fma(p1, d, c4)
    p3 = fma(p2, d, c3)
    p4 = fma(p3, d, pull)
    p5 = fma(p4, d, -slope)
    q1 = fma(c6, d, p1)
    q2 = fma(q1, d, p2)
    q3 = fma(q2, d, p3)
    q4 = fma(q3, d, p4)
    r1 = fma(c6, d, q1)
    r2 = fma(r1, d, q2)
    r3 = fma(r2, d, q3)
    third = fma(fma(fma(c6, d, r1), d, r2), d, r3)
    d = d + root_move(fma(p5, d, f), rough_inverse(fma(q4, d, p5)), fma(r3, d, q4), third)
    return h - d * h


@inline_jit
def only_root(lanes, gap, guess, high, chosen):
    """The root in (0, high] of gaps that have exactly one there: not negative at 0 (if zero, then
    growing), negative at `high`.

    The search repeats `root_move` from a guess, with bisection if a move leaves the bracket. A lane
    that has converged is not changed any more, whatever the others do. Returns the root and the
    velocity there.
    """
    low = splat(0.0)
    speed = splat(0.0)
    active = chosen
    # the guess may have gone astray
    tau = select(mask(bits(guess > 0.0) & bits(guess <= high)), guess, 0.5 * high)
    for _ in range(60):
        x, v, a, jerk = motion_at(lanes, gap.row, gap.start, tau)
        inverse = rough_inverse(v)
        inverse = inverse * (2.0 - v * inverse)
        before = mask(bits(gap.sign * x > 0.0))
        low, high = select(before, tau, low), select(before, high, tau)
        following = tau + root_move(x, inverse, 0.5 * a, (1.0 / 3.0) * jerk)
        inside = mask(bits(following >= low) & bits(following <= high))
        following = select(inside, following, 0.5 * (low + high))
        move = following - tau
        going = mask(active)
        speed = select(going, fma(move, fma(move, jerk, a), v), speed)
        tau = select(going, following, tau)
        active &= bits(absolute(move) > NEARLY * tau) | bits(
            absolute(move * a) > NEARLY * absolute(v)
        )
        if active == 0:
            break
    return tau, speed


@lean_jit
def series_value(series, order, t):
    """The value of a series of one lane at t."""
    value = series[order]
    for k in range(order - 1, -1, -1):
        value = value * t + series[k]
    return value


@lean_jit
def margins_certain(lanes, h):
    """Bits of the lanes in which every margin certainly stays positive over the step."""
    sure = ALL
    for stop in range(lanes.sizes.margins):
        series = lanes.margins[stop]
        rest = splat(0.0)
        for k in range(lanes.sizes.order - 1, 0, -1):
            rest = fma(rest, h, absolute(series[k]))
        sure &= bits(series[0] > rest * h)
    return sure


@lean_jit
def series_true(lanes, h, size):
    """Bits of the lanes whose series give, at the end of the step, the acceleration that the model
    has there, of a coordinate of first order its velocity.

    The new state must be in place. See `steps.leaps`.
    """
    lanes.code.field(lanes.memory, lanes.places)
    defect = splat(0.0)
    for row in range(lanes.sizes.own):
        first_order = row >= lanes.sizes.own - lanes.sizes.first_order
        series = lanes.velocities[row] if first_order else lanes.accelerations[row]
        slope = splat(0.0)
        for k in range(lanes.sizes.order - 1, -1, -1):
            slope = fma(slope, h, series[k])
        defect = maximum(defect, absolute(lanes.after_velocity[row] - slope))
    return bits(defect * h <= (DEFECT * lanes.settings.tolerance) * size)


@inline_jit
def commit(lanes, moved, hit, speed):
    """Make the new state the state of the lanes in `moved`, and the state after the impact that of
    the lanes in `hit`.

    `speed` is the speed of the impacts.
    """
    going = mask(moved)
    impact = mask(hit)
    lanes.now = select(going, lanes.new_time, lanes.now)
    lanes.side = select(impact, lanes.new_side, lanes.side)
    lanes.least_speed = select(impact, minimum(lanes.least_speed, speed), lanes.least_speed)
    lanes.impacts = select(impact, lanes.impacts + 1.0, lanes.impacts)
    for row in range(2 * lanes.sizes.rows):  # the slots of velocities follow those of positions
        new = select(impact, lanes.after_position[row], lanes.new_position[row])
        lanes.position[row] = select(going, new, lanes.position[row])


@inline_jit
def find_contact(lanes, gap, h, end, alive, patient):
    """The lanes in `alive` that meet a contact within the step of length h, those in doubt, and
    those that wait for a shorter step; the times, and the velocities at these times.

    `end` are the coordinate at the end of the step, measured from the contact, its velocity and
    acceleration there, and the bound of `sweep`. `patient` are the lanes that may wait for a
    shorter step if nothing is certain.
    """
    (x, v, _, bend) = end
    sign = gap.sign
    skip = gap.skip
    series = lanes.positions[gap.row]
    g0 = sign * gap.start
    g1 = sign * series[1] * h
    g2 = sign * series[2] * (h * h)
    cubic = (g0, g1, g2, sign * series[3] * (h * h * h))
    doubtful = ((bits(g0 <= 0.0) & ~skip) | (bits(g1 <= 0.0) & skip)) & alive
    clear, falls, concave, convex = shape(cubic, bend, skip)
    over = bits(sign * x <= 0.0)
    short, flight = short_flight(cubic, bend)
    short &= skip & alive & ~doubtful
    single = concave | (falls & ~skip) | (convex & over) | short
    hit = (alive & ~doubtful & ~clear & single & over) | short
    tau = h
    at_root = v
    if hit:
        guess = flight
        high = h
        if hit & ~short:
            guess = guess_from_end(cubic, end, sign, h)
        if short:
            higher = sign * series[4] * (h * h) * (h * h), sign * series[5] * (h * h) * (h * h * h)
            guess = select(mask(short), guess_from_start(cubic, higher, flight) * h, guess)
            high = select(mask(short), 2.0 * flight * h, h)
        root, speed = only_root(lanes, gap, guess, high, hit)
        tau = select(mask(hit), root, h)
        at_root = select(mask(hit), speed, v)
    unclear = alive & ~doubtful & ~clear & ~single
    waits, unclear = unclear & patient, unclear & ~patient
    for i in range(WIDTH if unclear else 0):
        if (unclear >> i) & 1:
            lane = one(lanes, i)
            root = lane_root(lane, gap, h)
            if root == TOUCH:
                doubtful |= 1 << i
            elif root >= 0.0:
                hit |= 1 << i
                tau = with_lane(tau, i, root)
                at_root = with_lane(
                    at_root, i, series_value(lane.velocities[gap.row], lanes.sizes.order, root)
                )
    return hit, doubtful, waits, tau, at_root


@inline_jit
def short_flight(cubic, bend):
    """The lanes in which a flight from the contact certainly ends within twice the time that it
    would take if the acceleration stayed as at its start.

    Only this part of the step is considered, by the cubic and the bound of `shape`: later in the
    step the acceleration may change its sign. Returns bits of the lanes in which the gap is concave
    up to this time and negative then, and half of the time as a share of the step.
    """
    _, g1, g2, g3 = cubic
    flight = -g1 * rough_inverse(g2)
    end = 2.0 * flight
    rest = bend * (end * end)
    last = fma(6.0 * g3, end, 2.0 * g2)
    concave = bits(maximum(2.0 * g2, last) < -rest)
    over = bits(fma(fma(g3, end, g2), end, g1) + rest * end * (1.0 / 12.0) < 0.0)
    return concave & over & bits(end <= 1.0), flight


@inline_jit
def guess_from_start(cubic, higher, flight):
    """The end of a short flight, as a share of the step: one `root_move` from its end under the
    acceleration at its start.

    `higher` are the terms of fourth and fifth order of the gap; higher ones are neglected.
    """
    _, g1, g2, g3 = cubic
    g4, g5 = higher
    value = fma(fma(fma(fma(g5, flight, g4), flight, g3), flight, g2), flight, g1)
    slope = fma(fma(fma(4.0 * g5, flight, 3.0 * g4), flight, 2.0 * g3), flight, g2)
    second = fma(fma(6.0 * g5, flight, 3.0 * g4), flight, g3)
    third = fma(4.0 * g5, flight, g4)
    return flight + root_move(value, rough_inverse(slope), second, third)


@inline_jit
def lane_root(lane, gap, h):
    """The first root of one lane's gap, NO_ROOT or TOUCH, by the scalar kernel's search
    (`handoff.first_root_of`).
    """
    i = lane.index
    search = lane.helpers.first_root
    start = vector_lane(gap.start, i)
    sign = vector_lane(gap.sign, i)
    return search(lane, gap.row, start, sign, vector_lane(h, i), (gap.skip >> i) & 1)
