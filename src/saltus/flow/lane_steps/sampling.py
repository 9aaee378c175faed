"""The records of a trajectory: extrema of its coordinates, the ends of its forcing periods, and its
recurrence.

Its compiled part goes into one module with that of `driver.py`.
"""

from __future__ import annotations

import numpy as np

from saltus.flow.lane_steps.memory import LONGEST_RECURRENCE, Stretch
from saltus.flow.lane_steps.steps import both_at, motion_at, sweep
from saltus.taylor import inline_jit, lean_jit
from saltus.taylor.lane_memory import one
from saltus.taylor.lane_vectors import (
    absolute,
    bits,
    fma,
    mask,
    maximum,
    minimum,
    select,
    splat,
    vector_lane,
)
from saltus.taylor.vectors import WIDTH

# --- compiled from here on ---------------------------------------------------

# largest distance of two states, relative to their size or to natural units, at which they count
# as one
RECURRENT = 1e-10
# largest distance, in units of RECURRENT, at which two states may still approach one another
NEARLY_RECURRENT = 1e4
ROUNDED = 1e-14  # share of a bound that covers the rounding of a difference of two bounds
# share of a span of time: the fourth power of a shorter move to a turning point is rounding
NEARLY_TURNED = 1e-4
MOST_MOVES = 60  # steps of Newton's method to a turning point: more than bisection would need


@lean_jit
def turning_value(lanes, row, stretch, chosen):
    """The position at which the velocity vanishes, if it is monotonic and has different signs at
    the ends.
    """
    low = stretch.begin
    high = stretch.end
    v_low = stretch.v_begin
    span = high - low
    tau = low + (high - low) * (v_low / (v_low - stretch.v))
    active = chosen
    start = lanes.positions[row][0]
    value = splat(0.0)
    for _ in range(MOST_MOVES):
        x, v, a, jerk = motion_at(lanes, row, start, tau)
        first = mask(bits(v * v_low > 0.0))
        low, high = select(first, tau, low), select(first, high, tau)
        newton = v / a
        following = tau - newton * fma(newton, jerk / a, splat(1.0))
        inside = mask(bits(following >= low) & bits(following <= high))
        move = select(inside, following, 0.5 * (low + high)) - tau
        going = mask(active)  # a lane stays where it has converged, whatever the others do
        value = select(
            going, fma(move, fma(move, fma(move, (1.0 / 3.0) * jerk, 0.5 * a), v), x), value
        )
        tau = select(going, tau + move, tau)
        active &= bits(absolute(move) > NEARLY_TURNED * span)
        if active == 0:
            break
    return value


@inline_jit
def bounds_of(lanes, row, stretch):
    """Properties that a coordinate certainly has from the start of the step to the end of its
    stretch, from six terms of its series and a bound of the others.

    Returns bits of the lanes in which the velocity is monotonic, bits of those in which it keeps
    its sign, and bounds of the coordinate. All are found by Bernstein coefficients.
    """
    series = lanes.positions[row]
    end = stretch.end
    bend = stretch.bend
    square = end * end
    cube = square * end
    g0 = series[0]
    g1 = series[1] * end
    g2 = series[2] * square
    g3 = series[3] * cube
    g4 = series[4] * (square * square)
    g5 = series[5] * (square * cube)
    ratio = end / stretch.h
    shrunk = ratio * ratio
    rest = bend * (shrunk * shrunk)
    rest = fma(
        maximum(rest - 12.0 * absolute(g4) - 20.0 * absolute(g5), splat(0.0)),
        shrunk,
        ROUNDED * rest,
    )
    b1 = fma(g2, splat(0.5), g1)
    b2 = g1 + g2 + 0.5 * g3
    b3 = g1 + 1.5 * (g2 + g3) + g4
    b4 = g1 + 2.0 * g2 + 3.0 * g3 + 4.0 * g4 + 5.0 * g5
    least = minimum(minimum(b1, b2), minimum(b3, minimum(g1, b4)))
    most = maximum(maximum(b1, b2), maximum(b3, maximum(g1, b4)))
    one_sign = bits(least > rest * 0.2) | bits(most < rest * -0.2)
    c0 = b1 - g1
    c1 = b2 - b1
    c2 = b3 - b2
    c3 = b4 - b3
    falls = maximum(maximum(c0, c1), maximum(c2, c3))
    rises = minimum(minimum(c0, c1), minimum(c2, c3))
    monotonic = bits(rises > rest * 0.25) | bits(falls < rest * -0.25)
    x1 = fma(g1, splat(0.2), g0)
    x2 = fma(b1, splat(0.2), x1)
    x3 = fma(b2, splat(0.2), x2)
    x4 = fma(b3, splat(0.2), x3)
    x5 = fma(b4, splat(0.2), x4)
    beyond = rest * (1.0 / 30.0)
    above = maximum(maximum(maximum(g0, x1), maximum(x2, x3)), maximum(x4, x5)) + beyond
    below = minimum(minimum(minimum(g0, x1), minimum(x2, x3)), minimum(x4, x5)) - beyond
    return monotonic, one_sign, above, below


@lean_jit
def record_range(lanes, row, stretch, chosen):
    """Update `highest` and `lowest` with the extrema of a coordinate in its stretch, in chosen
    lanes.

    Lanes are skipped in forcing periods that are not recorded, and if the coordinate certainly
    stays between the recorded values. If the velocity is certainly monotonic, the extremum within
    the step is where it vanishes. If it is neither certainly monotonic nor certainly of one sign,
    all turning points are looked for, lane by lane.
    """
    chosen &= bits(lanes.period >= lanes.recorded_from)
    if chosen == 0:
        return
    high = lanes.highest
    low = lanes.lowest
    top = maximum(high, stretch.x)
    bottom = minimum(low, stretch.x)
    monotonic, one_sign, above, below = bounds_of(lanes, row, stretch)
    open_ = chosen & ~one_sign & (bits(above > top) | bits(below < bottom))
    turns = bits(stretch.v_begin * stretch.v < 0.0) & monotonic & open_
    if turns:
        turning = turning_value(lanes, row, stretch, turns)
        top, bottom = (
            select(mask(turns), maximum(top, turning), top),
            select(mask(turns), minimum(bottom, turning), bottom),
        )
    lanes.highest = select(mask(chosen), top, high)
    lanes.lowest = select(mask(chosen), bottom, low)
    unclear = open_ & ~monotonic
    for i in range(WIDTH if unclear else 0):
        if (unclear >> i) & 1:
            record_turns(
                one(lanes, i), row, vector_lane(stretch.begin, i), vector_lane(stretch.end, i)
            )


@lean_jit
def record_turns(lane, row, begin, end):
    """Record all turning points of a coordinate of one lane between two times of the step."""
    series = lane.gap
    order = lane.sizes.order
    positions = lane.positions[row]
    for k in range(order + 1):
        series[k] = positions[k]
    turning_range = lane.helpers.turning_range
    high, low = turning_range(series, order, begin, end, lane.polynomial)
    lane.highest, lane.lowest = max(lane.highest, high), min(lane.lowest, low)


@lean_jit
def record_others(lanes, step, past, chosen):
    """`record_range` for all coordinates but the first, up to the new state; in lanes `past` the
    end of a period, from this end."""
    begin = select(mask(past), lanes.period_end - lanes.now, splat(0.0))
    for row in range(1, lanes.sizes.own):
        _, _, _, bend = sweep(lanes, row, step.h)
        v_begin = select(mask(past), lanes.ended_velocity[row], lanes.velocities[row][0])
        x = lanes.new_position[row]
        v = lanes.new_velocity[row]
        record_range(lanes, row, Stretch(begin, step.taken, v_begin, x, v, step.h, bend), chosen)


@lean_jit
def pass_ends(lanes, step, past):
    """End the forcing period in lanes whose step goes past its end: keep its records and begin new
    ones.

    The state at the end is evaluated from the step's series. `forcing_periods.end_here` does the
    same for one lane whose state is at the end of the period.
    """
    since = lanes.period_end - lanes.now
    chosen = mask(past)
    for row in range(lanes.sizes.rows):
        x, v = both_at(lanes, row, since)
        lanes.ended_position[row] = select(chosen, x, lanes.ended_position[row])
        lanes.ended_velocity[row] = select(chosen, v, lanes.ended_velocity[row])
    for row in range(lanes.sizes.own if lanes.sizes.extrema > 0 else 0):
        bend = step.bend
        if row > 0:
            _, _, _, bend = sweep(lanes, row, step.h)
        x = lanes.ended_position[row]
        v = lanes.ended_velocity[row]
        record_range(
            lanes,
            row,
            Stretch(splat(0.0), since, lanes.velocities[row][0], x, v, step.h, bend),
            past,
        )
    keep_ended(lanes, past)


@inline_jit
def keep_ended(lanes, past):
    """Keep the records of a forcing period that is over in the lanes in `past`, and begin new ones
    at the state at its end.
    """
    chosen = mask(past)
    x = lanes.ended_position[0]
    high = lanes.highest
    low = lanes.lowest
    least = lanes.least_speed
    impacts = lanes.impacts
    lanes.ended_side = select(chosen, lanes.side, lanes.ended_side)
    lanes.ended_highest = select(chosen, high, lanes.ended_highest)
    lanes.ended_lowest = select(chosen, low, lanes.ended_lowest)
    lanes.ended_least_speed = select(chosen, least, lanes.ended_least_speed)
    lanes.ended_impacts = select(chosen, impacts, lanes.ended_impacts)
    lanes.overall_highest = select(
        chosen, maximum(lanes.overall_highest, high), lanes.overall_highest
    )
    lanes.overall_lowest = select(chosen, minimum(lanes.overall_lowest, low), lanes.overall_lowest)
    lanes.overall_least_speed = select(
        chosen, minimum(lanes.overall_least_speed, least), lanes.overall_least_speed
    )
    lanes.overall_impacts = select(chosen, lanes.overall_impacts + impacts, lanes.overall_impacts)
    lanes.highest = select(chosen, x, lanes.highest)
    lanes.lowest = select(chosen, x, lanes.lowest)
    for row in range(1, lanes.sizes.own):
        q = lanes.ended_position[row]
        lanes.highest = select(chosen, maximum(lanes.highest, q), lanes.highest)
        lanes.lowest = select(chosen, minimum(lanes.lowest, q), lanes.lowest)
    lanes.least_speed = select(chosen, splat(np.inf), lanes.least_speed)
    lanes.impacts = select(chosen, splat(0.0), lanes.impacts)
    lanes.next_check = select(chosen, lanes.next_check - impacts, lanes.next_check)


@lean_jit
def recurrence_period(states, agreements, done, own, length, speed):
    """The period of a trajectory that repeats itself, in forcing periods, or 0; and whether its
    last state agrees with an earlier one.

    `states` holds its last stroboscopic states. It repeats itself with the period q if 2 q + 2
    states in a row agree with those q forcing periods before; the smallest such q counts. As long
    as states a divisor of q apart are still near to one another, 0 is returned, because the
    trajectory may be approaching a recurrence with this shorter period.

    Coordinates are compared in the largest of them, or in the natural `length` where that is
    larger; velocities in the same size times `speed` / `length`, or in the largest of them.
    """
    here = states[done % (2 * LONGEST_RECURRENCE)]
    size = 1.0
    for i in range(own):
        size = max(size, max(abs(here[i]) / length, abs(here[own + i]) / speed))
    found = 0
    near = 0
    agrees = False
    for q in range(1, min(LONGEST_RECURRENCE, done - 1) + 1):
        there = states[(done - q) % (2 * LONGEST_RECURRENCE)]
        same = True
        close = True
        for i in range(2 * own):
            apart = abs(here[i] - there[i])
            allowed = RECURRENT * size * (length if i < own else speed)
            if not apart <= allowed:
                same = False
                if not apart <= NEARLY_RECURRENT * allowed:
                    close = False
                    break
        agreements[q] = agreements[q] + 1 if same else 0
        agrees |= same
        if close:
            near |= 1 << q
        if found == 0 and agreements[q] >= 2 * q + 2:
            found = q
    for d in range(1, found):
        if found % d == 0 and (near >> d) & 1:
            return 0, agrees
    return found, agrees
