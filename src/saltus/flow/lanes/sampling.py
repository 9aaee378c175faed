"""The records of a trajectory: extrema of its coordinates, the ends of its forcing periods, and its recurrence.

Its compiled part goes into one module with that of `driver.py`.
"""

from __future__ import annotations

import numpy as np

from saltus.flow.kernel.memory_layout import SERIES_LENGTH, LanePart
from saltus.flow.lanes.lane_layout import Helper, Size, Slot
from saltus.flow.lanes.lane_steps import both_at, motion_at, row_count, sweep
from saltus.taylor import (
    WIDTH,
    absolute,
    bits,
    fma,
    get,
    inline_jit,
    lean_jit,
    load,
    mask,
    maximum,
    minimum,
    put,
    replace,
    select,
    splat,
    store,
    vector_lane,
)

# --- compiled from here on -----------------------------------------------------------------------------------------------

LONGEST_RECURRENCE = 16  # the longest period for which a recurrence is looked for, in forcing periods
RECURRENT = 1e-10  # largest distance of two states, relative to their size or to 1, at which they count as one
NEARLY_RECURRENT = 1e4  # largest distance, in units of RECURRENT, at which two states may still approach one another
ROUNDED = 1e-14  # share of a bound that covers the rounding of a difference of two bounds
NEARLY_TURNED = 1e-4  # share of a span of time: the fourth power of a shorter move to a turning point is rounding
MOST_MOVES = 60  # steps of Newton's method to a turning point: more than bisection would need


@lean_jit
def turning_value(m, at, row, order, low, high, v_low, v_high, chosen):
    """The position at which the velocity vanishes, if it is monotonic and has different signs at the ends."""
    span, tau = high - low, low + (high - low) * (v_low / (v_low - v_high))
    before = row * SERIES_LENGTH
    active, start, value = chosen, load(m, at[LanePart.POSITIONS] + before), splat(0.0)
    for _ in range(MOST_MOVES):
        x, v, a, jerk = motion_at(m, at, row, order, start, tau)
        first = mask(bits(v * v_low > 0.0))
        low, high = select(first, tau, low), select(first, high, tau)
        newton = v / a
        following = tau - newton * fma(newton, jerk / a, splat(1.0))
        inside = mask(bits(following >= low) & bits(following <= high))
        move = select(inside, following, 0.5 * (low + high)) - tau
        going = mask(active)  # a lane stays where it has converged, whatever the others do
        value = select(going, fma(move, fma(move, fma(move, (1.0 / 3.0) * jerk, 0.5 * a), v), x), value)
        tau = select(going, tau + move, tau)
        active &= bits(absolute(move) > NEARLY_TURNED * span)
        if active == 0:
            break
    return value


@inline_jit
def course(m, at, row, end, ratio, bend):
    """Properties that a coordinate certainly has on [0, end], from the first six terms of its series and a bound of the others.

    `bend` is the bound of `sweep` for a step of end / `ratio`. Returns bits of the lanes in which the velocity is monotonic, bits
    of those in which it keeps its sign, and upper and lower bounds of the coordinate, all by Bernstein coefficients.
    """
    series, square = at[LanePart.POSITIONS] + row * SERIES_LENGTH, end * end
    cube = square * end
    g0, g1, g2, g3 = load(m, series), load(m, series + 1) * end, load(m, series + 2) * square, load(m, series + 3) * cube
    g4, g5 = load(m, series + 4) * (square * square), load(m, series + 5) * (square * cube)
    shrunk = ratio * ratio
    rest = bend * (shrunk * shrunk)
    rest = fma(maximum(rest - 12.0 * absolute(g4) - 20.0 * absolute(g5), splat(0.0)), shrunk, ROUNDED * rest)
    b1, b2 = fma(g2, splat(0.5), g1), g1 + g2 + 0.5 * g3
    b3, b4 = g1 + 1.5 * (g2 + g3) + g4, g1 + 2.0 * g2 + 3.0 * g3 + 4.0 * g4 + 5.0 * g5
    least, most = minimum(minimum(b1, b2), minimum(b3, minimum(g1, b4))), maximum(maximum(b1, b2), maximum(b3, maximum(g1, b4)))
    one_sign = bits(least > rest * 0.2) | bits(most < rest * -0.2)
    c0, c1, c2, c3 = b1 - g1, b2 - b1, b3 - b2, b4 - b3
    falls, rises = maximum(maximum(c0, c1), maximum(c2, c3)), minimum(minimum(c0, c1), minimum(c2, c3))
    monotonic = bits(rises > rest * 0.25) | bits(falls < rest * -0.25)
    x1 = fma(g1, splat(0.2), g0)
    x2 = fma(b1, splat(0.2), x1)
    x3 = fma(b2, splat(0.2), x2)
    x4 = fma(b3, splat(0.2), x3)
    x5, beyond = fma(b4, splat(0.2), x4), rest * (1.0 / 30.0)
    above = maximum(maximum(maximum(g0, x1), maximum(x2, x3)), maximum(x4, x5)) + beyond
    below = minimum(minimum(minimum(g0, x1), minimum(x2, x3)), minimum(x4, x5)) - beyond
    return monotonic, one_sign, above, below


@lean_jit
def record_range(m, at, row, sizes, h, bend, begin, v_begin, end, x, v, chosen, helpers, poly, series):
    """Update HIGHEST and LOWEST with the extrema of a coordinate from `begin` to `end` of this step, in chosen lanes.

    Lanes are skipped in forcing periods that are not recorded, and if the coordinate certainly stays between the recorded values.
    If the velocity is certainly monotonic, the extremum within the step is where it vanishes. If it is neither certainly
    monotonic nor certainly of one sign, all turning points are looked for, lane by lane.
    """
    chosen &= bits(load(m, Slot.PERIOD) >= load(m, Slot.RECORDED_FROM))
    if chosen == 0:
        return
    order, positions = sizes[Size.ORDER], at[LanePart.POSITIONS] + row * SERIES_LENGTH
    high, low = load(m, Slot.HIGHEST), load(m, Slot.LOWEST)
    top, bottom = maximum(high, x), minimum(low, x)
    monotonic, one_sign, above, below = course(m, at, row, end, end / h, bend)
    open_ = chosen & ~one_sign & (bits(above > top) | bits(below < bottom))
    turns = bits(v_begin * v < 0.0) & monotonic & open_
    if turns:
        turning = turning_value(m, at, row, order, begin, end, v_begin, v, turns)
        top, bottom = select(mask(turns), maximum(top, turning), top), select(mask(turns), minimum(bottom, turning), bottom)
    store(m, Slot.HIGHEST, select(mask(chosen), top, high))
    store(m, Slot.LOWEST, select(mask(chosen), bottom, low))
    unclear = open_ & ~monotonic
    if unclear:
        for lane in range(WIDTH):
            if (unclear >> lane) & 1:
                for k in range(order + 1):
                    series[k] = get(m, positions + k, lane)
                turning_range = helpers[Helper.TURNING_RANGE]
                high_there, low_there = turning_range(series, order, vector_lane(begin, lane), vector_lane(end, lane), poly)
                put(m, Slot.HIGHEST, lane, max(get(m, Slot.HIGHEST, lane), high_there))
                put(m, Slot.LOWEST, lane, min(get(m, Slot.LOWEST, lane), low_there))


@lean_jit
def record_others(m, at, sizes, h, past, end, chosen, helpers, poly, series):
    """`record_range` for all coordinates but the first, up to the new state; in lanes `past` the end of a period, from this
    end."""
    since, order = load(m, Slot.PERIOD_END) - load(m, Slot.NOW), sizes[Size.ORDER]
    for row in range(1, sizes[Size.OWN]):
        _, _, _, bend = sweep(m, at, row, order, h)
        begin = select(mask(past), since, splat(0.0))
        v_begin = select(mask(past), load(m, at[LanePart.ENDED_VELOCITY] + row), load(m, at[LanePart.VELOCITY] + row))
        x, v = load(m, at[LanePart.NEW_POSITION] + row), load(m, at[LanePart.NEW_VELOCITY] + row)
        record_range(m, at, row, sizes, h, bend, begin, v_begin, end, x, v, chosen, helpers, poly, series)


@lean_jit
def pass_ends(m, at, sizes, h, bend, past, helpers, poly, series):
    """End the forcing period in lanes whose step goes past its end: keep its records and begin new ones.

    The state at the end is evaluated from the step's series. `forcing_periods.end_here` does the same for one lane whose state is
    at the end of the period.
    """
    order, since = sizes[Size.ORDER], load(m, Slot.PERIOD_END) - load(m, Slot.NOW)
    chosen = mask(past)
    for row in range(row_count(at)):
        positions = at[LanePart.POSITIONS] + row * SERIES_LENGTH
        x, v = both_at(m, positions, at[LanePart.VELOCITIES] + row * SERIES_LENGTH, order, load(m, positions), since)
        replace(m, at[LanePart.ENDED_POSITION] + row, chosen, x)
        replace(m, at[LanePart.ENDED_VELOCITY] + row, chosen, v)
    if sizes[Size.EXTREMA] > 0:
        x, v = load(m, at[LanePart.ENDED_POSITION]), load(m, at[LanePart.ENDED_VELOCITY])
        v_begin = load(m, at[LanePart.VELOCITY])
        record_range(m, at, 0, sizes, h, bend, splat(0.0), v_begin, since, x, v, past, helpers, poly, series)
        for row in range(1, sizes[Size.OWN]):
            q, w = load(m, at[LanePart.ENDED_POSITION] + row), load(m, at[LanePart.ENDED_VELOCITY] + row)
            w_begin, (_, _, _, bent) = load(m, at[LanePart.VELOCITY] + row), sweep(m, at, row, order, h)
            record_range(m, at, row, sizes, h, bent, splat(0.0), w_begin, since, q, w, past, helpers, poly, series)
    keep_ended(m, at, sizes, past)


@inline_jit
def keep_ended(m, at, sizes, past):
    """Keep the records of a forcing period that is over in the lanes in `past`, and begin new ones at the state at its end."""
    chosen, x = mask(past), load(m, at[LanePart.ENDED_POSITION])
    high, low, least, impacts = load(m, Slot.HIGHEST), load(m, Slot.LOWEST), load(m, Slot.LEAST_SPEED), load(m, Slot.IMPACTS)
    replace(m, Slot.ENDED_SIDE, chosen, load(m, Slot.SIDE))
    replace(m, Slot.ENDED_HIGHEST, chosen, high)
    replace(m, Slot.ENDED_LOWEST, chosen, low)
    replace(m, Slot.ENDED_LEAST_SPEED, chosen, least)
    replace(m, Slot.ENDED_IMPACTS, chosen, impacts)
    replace(m, Slot.OVERALL_HIGHEST, chosen, maximum(load(m, Slot.OVERALL_HIGHEST), high))
    replace(m, Slot.OVERALL_LOWEST, chosen, minimum(load(m, Slot.OVERALL_LOWEST), low))
    replace(m, Slot.OVERALL_LEAST_SPEED, chosen, minimum(load(m, Slot.OVERALL_LEAST_SPEED), least))
    replace(m, Slot.OVERALL_IMPACTS, chosen, load(m, Slot.OVERALL_IMPACTS) + impacts)
    replace(m, Slot.HIGHEST, chosen, x)
    replace(m, Slot.LOWEST, chosen, x)
    for row in range(1, sizes[Size.OWN]):
        q = load(m, at[LanePart.ENDED_POSITION] + row)
        replace(m, Slot.HIGHEST, chosen, maximum(load(m, Slot.HIGHEST), q))
        replace(m, Slot.LOWEST, chosen, minimum(load(m, Slot.LOWEST), q))
    replace(m, Slot.LEAST_SPEED, chosen, splat(np.inf))
    replace(m, Slot.IMPACTS, chosen, splat(0.0))
    replace(m, Slot.NEXT_CHECK, chosen, load(m, Slot.NEXT_CHECK) - impacts)


@lean_jit
def recurrence_period(states, agreements, done, own):
    """The period of a trajectory that repeats itself, in forcing periods, or 0; and whether its last state agrees with an earlier
    one.

    `states` holds its last stroboscopic states. It repeats itself with the period q if 2 q + 2 states in a row agree with those q
    forcing periods before; the smallest such q counts. As long as states a divisor of q apart are still near to one another, 0 is
    returned, because the trajectory may be approaching a recurrence with this shorter period.
    """
    here, found, near, agrees = states[done % (2 * LONGEST_RECURRENCE)], 0, 0, False
    for q in range(1, min(LONGEST_RECURRENCE, done - 1) + 1):
        there, same, close = states[(done - q) % (2 * LONGEST_RECURRENCE)], True, True
        for i in range(2 * own):
            apart, allowed = abs(here[i] - there[i]), RECURRENT * max(1.0, abs(here[i]))
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
