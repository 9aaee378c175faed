"""What is recorded of a trajectory: extrema of its coordinates, the ends of its forcing periods, whether it repeats itself.

Its compiled part goes into one module with that of `driver.py`.
"""

from __future__ import annotations

import numpy as np

from saltus.flow.ensemble.lane_layout import Helper, Size, Slot
from saltus.flow.ensemble.lane_steps import both_at, motion_at, row_count, sweep
from saltus.flow.memory_layout import SERIES_LENGTH, LanePart
from saltus.taylor import (
    WIDTH,
    absolute,
    bits,
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

LONGEST_RECURRENCE = 16  # forcing periods, up to which a recurrence is looked for
RECURRENT = 1e-10  # largest distance of two states, relative to their size or to 1, at which they count as one
NEARLY_RECURRENT = 1e4  # largest distance, in units of RECURRENT, at which they may still be approaching one another
MOST_MOVES = 60  # steps of Newton's method to a turning point: more than bisection needs for the same digits


@lean_jit
def turning_value(m, at, row, order, low, high, v0, chosen):
    """The position where a velocity, monotonic and of two signs at the ends, the first that of `v0`, vanishes."""
    h, tau = high - low, 0.5 * (low + high)
    before = row * SERIES_LENGTH
    active, start = chosen, load(m, at[LanePart.POSITIONS] + before)
    for _ in range(MOST_MOVES):
        _, v, a, _ = motion_at(m, at, row, order, start, tau)
        first = mask(bits(v * v0 > 0.0))
        low, high = select(first, tau, low), select(first, high, tau)
        following = tau - v / a
        inside = mask(bits(following >= low) & bits(following <= high))
        following = select(inside, following, 0.5 * (low + high))
        moved = absolute(following - tau)
        tau = select(mask(active), following, tau)  # a lane stays where it has converged, whatever the others do
        active &= bits(moved > 1e-9 * h)
        if active == 0:
            break
    return both_at(m, at[LanePart.POSITIONS] + before, at[LanePart.VELOCITIES] + before, order, start, tau)[0]


@lean_jit
def record_range(m, at, row, sizes, h, bend, begin, v_begin, end, x, v, chosen, helpers, poly, series):
    """Take the extrema of a coordinate from `begin` to `end` of this step into HIGHEST and LOWEST, for chosen lanes.

    Where the velocity is monotonic for certain, by its derivative at the start and the bound `bend` of how far that strays, an
    extremum within the step is where it vanishes. Where neither that is certain nor that the velocity keeps its sign, all
    turning points are looked for, lane by lane.
    """
    order, positions = sizes[Size.ORDER], at[LanePart.POSITIONS] + row * SERIES_LENGTH
    high, low = load(m, Slot.HIGHEST), load(m, Slot.LOWEST)
    v0, first = load(m, at[LanePart.VELOCITIES] + row * SERIES_LENGTH), 2.0 * load(m, positions + 2) * h * h
    last = first + 6.0 * load(m, positions + 3) * (h * h * h)
    monotonic = bits(minimum(first, last) > bend) | bits(maximum(first, last) < -bend)
    turns = bits(v_begin * v < 0.0) & monotonic & chosen
    top, bottom = maximum(high, x), minimum(low, x)
    if turns:
        turning = turning_value(m, at, row, order, begin, end, v_begin, turns)
        top, bottom = select(mask(turns), maximum(top, turning), top), select(mask(turns), minimum(bottom, turning), bottom)
    store(m, Slot.HIGHEST, select(mask(chosen), top, high))
    store(m, Slot.LOWEST, select(mask(chosen), bottom, low))
    one_sign = bits(absolute(v0) * h > absolute(first) + 0.5 * absolute(last - first) + bend * (1.0 / 3.0))
    unclear = chosen & ~monotonic & ~one_sign
    if unclear:
        for lane in range(WIDTH):
            if (unclear >> lane) & 1:
                for k in range(order + 1):
                    series[k] = get(m, positions + k, lane)
                turning_range = helpers[Helper.TURNING_RANGE]
                above, below = turning_range(series, order, vector_lane(begin, lane), vector_lane(end, lane), poly)
                put(m, Slot.HIGHEST, lane, max(get(m, Slot.HIGHEST, lane), above))
                put(m, Slot.LOWEST, lane, min(get(m, Slot.LOWEST, lane), below))


@lean_jit
def record_others(m, at, sizes, h, past, end, chosen, helpers, poly, series):
    """`record_range` of all coordinates but the first, up to the new state; in lanes `past` a period's end, from there on."""
    since, order = load(m, Slot.PERIOD_END) - load(m, Slot.NOW), sizes[Size.ORDER]
    for row in range(1, sizes[Size.OWN]):
        _, _, _, bend = sweep(m, at, row, order, load(m, at[LanePart.POSITION] + row), h)
        begin = select(mask(past), since, splat(0.0))
        v_begin = select(mask(past), load(m, at[LanePart.ENDED_VELOCITY] + row), load(m, at[LanePart.VELOCITY] + row))
        x, v = load(m, at[LanePart.NEW_POSITION] + row), load(m, at[LanePart.NEW_VELOCITY] + row)
        record_range(m, at, row, sizes, h, bend, begin, v_begin, end, x, v, chosen, helpers, poly, series)


@lean_jit
def pass_ends(m, at, sizes, h, bend, past, helpers, poly, series):
    """End the forcing period in lanes whose step goes past its end: keep its records and begin new ones.

    The state at the end is what the step's series give there. `forcing_periods.end_here` does the same for one lane that stands
    at the end.
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
            w_begin, (_, _, _, bent) = load(m, at[LanePart.VELOCITY] + row), sweep(m, at, row, order, q, h)
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
    """After how many forcing periods a trajectory repeats itself, or 0; `states` holds its last stroboscopic states.

    It repeats itself after q periods when 2 q + 2 states in a row agree with those q periods before. The smallest q counts, and
    none while the states of a part of it are not clearly apart, as a recurrence of fewer periods may still be approached.
    """
    here, found, near = done % (2 * LONGEST_RECURRENCE), 0, 0
    for q in range(1, min(LONGEST_RECURRENCE, done - 1) + 1):
        there, apart = (done - q) % (2 * LONGEST_RECURRENCE), 0.0
        for i in range(2 * own):
            apart = max(apart, abs(states[here, i] - states[there, i]) / max(1.0, abs(states[here, i])))
        agreements[q] = agreements[q] + 1 if apart <= RECURRENT else 0
        if apart <= NEARLY_RECURRENT * RECURRENT:
            near |= 1 << q
        if found == 0 and agreements[q] >= 2 * q + 2:
            found = q
    for d in range(1, found):
        if found % d == 0 and (near >> d) & 1:
            return 0
    return found
