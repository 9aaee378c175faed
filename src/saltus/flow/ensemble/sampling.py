"""What is recorded of a trajectory: extrema of its first coordinate, the ends of its legs, whether it has settled on a cycle.

This text is compiled together with the lanes (see `driver.py`).
"""

from __future__ import annotations

import numpy as np

from saltus.flow.ensemble.lane_layout import (
    BOTTOM,
    COUNT,
    ENDED_HIGHEST,
    ENDED_IMPACT_COUNT,
    ENDED_LEAST,
    ENDED_LOWEST,
    ENDED_POSITION,
    ENDED_SIDE,
    ENDED_VELOCITY,
    HIGHEST,
    IMPACT_COUNT,
    LANE_ORDER,
    LEAST,
    LOWEST,
    NEXT_LOOK,
    NOW,
    POSITION,
    POSITIONS,
    SIDE_NOW,
    SLOWEST,
    STRIDE,
    TARGET,
    TOP,
    TURNS_ALONE,
    VELOCITIES,
    VELOCITY,
    WATCH,
)
from saltus.flow.ensemble.lane_steps import both_at, motion_at, sizes_rows
from saltus.taylor import WIDTH, absolute, bits, lean_jit, load, mask, maximum, minimum, select, splat, store, vector_lane

# --- compiled from here on -----------------------------------------------------------------------------------------------

LONGEST_CYCLE = 16  # forcing periods
CLOSE = 1e-10  # two states that count as one, relative to their size or to 1
DOUBTFUL = 1e4  # times CLOSE: not so far apart that they are surely two


@lean_jit
def turning_value(m, at, order, low, high, v0, chosen):
    """The position where the velocity, monotonic and of two signs at the ends, the first that of `v0`, vanishes."""
    h, tau = high - low, 0.5 * (low + high)
    active, start = chosen, load(m, at[POSITION])
    for _ in range(60):
        _, v, a, _ = motion_at(m, at, order, start, tau)
        before = mask(bits(v * v0 > 0.0))
        low, high = select(before, tau, low), select(before, high, tau)
        following = tau - v / a
        inside = mask(bits(following >= low) & bits(following <= high))
        following = select(inside, following, 0.5 * (low + high))
        moved = absolute(following - tau)
        tau = select(mask(active), following, tau)  # a lane stays where it has converged, whatever the others do
        active &= bits(moved > 1e-9 * h)
        if active == 0:
            break
    return both_at(m, at[POSITIONS], at[VELOCITIES], order, start, tau)[0]


@lean_jit
def watch_range(m, at, sizes, h, bend, begin, v_begin, end, x, v, chosen, helpers, poly, gap):
    """Take the extrema of the first coordinate from `begin` to `end` of this step into HIGHEST and LOWEST, for chosen lanes."""
    order = sizes[LANE_ORDER]
    high, low = load(m, HIGHEST), load(m, LOWEST)
    v0, first = load(m, at[VELOCITY]), 2.0 * load(m, at[POSITIONS] + 2) * h * h
    last = first + 6.0 * load(m, at[POSITIONS] + 3) * (h * h * h)
    monotonic = bits(minimum(first, last) > bend) | bits(maximum(first, last) < -bend)
    turns = bits(v_begin * v < 0.0) & monotonic & chosen
    top, bottom = maximum(high, x), minimum(low, x)
    if turns:
        turning = turning_value(m, at, order, begin, end, v_begin, turns)
        top, bottom = select(mask(turns), maximum(top, turning), top), select(mask(turns), minimum(bottom, turning), bottom)
    store(m, HIGHEST, select(mask(chosen), top, high))
    store(m, LOWEST, select(mask(chosen), bottom, low))
    straight = bits(absolute(v0) * h > absolute(first) + 0.5 * absolute(last - first) + bend * (1.0 / 3.0))
    unclear = chosen & ~monotonic & ~straight
    if unclear:
        for lane in range(WIDTH):
            if (unclear >> lane) & 1:
                for k in range(order + 1):
                    gap[k] = m[(at[POSITIONS] + k) * WIDTH + lane]
                above, below = helpers[TURNS_ALONE](gap, order, vector_lane(begin, lane), vector_lane(end, lane), poly)
                m[HIGHEST * WIDTH + lane] = max(m[HIGHEST * WIDTH + lane], above)
                m[LOWEST * WIDTH + lane] = min(m[LOWEST * WIDTH + lane], below)


@lean_jit
def pass_ends(m, at, sizes, h, bend, past, helpers, poly, gap):
    """In lanes whose step goes past the end of their leg, take what they were then for its end, and record anew.

    The state there is what the step's series say. Compare `legs.end_here`.
    """
    order, since, anew = sizes[LANE_ORDER], load(m, TARGET) - load(m, NOW), mask(past)
    for row in range(sizes_rows(at)):
        series = at[POSITIONS] + row * STRIDE
        x, v = both_at(m, series, at[VELOCITIES] + row * STRIDE, order, load(m, series), since)
        store(m, at[ENDED_POSITION] + row, select(anew, x, load(m, at[ENDED_POSITION] + row)))
        store(m, at[ENDED_VELOCITY] + row, select(anew, v, load(m, at[ENDED_VELOCITY] + row)))
    x, v = load(m, at[ENDED_POSITION]), load(m, at[ENDED_VELOCITY])
    if sizes[WATCH] > 0:
        watch_range(m, at, sizes, h, bend, splat(0.0), load(m, at[VELOCITY]), since, x, v, past, helpers, poly, gap)
    high, low, least, impacts = load(m, HIGHEST), load(m, LOWEST), load(m, LEAST), load(m, IMPACT_COUNT)
    store(m, ENDED_SIDE, select(anew, load(m, SIDE_NOW), load(m, ENDED_SIDE)))
    store(m, ENDED_HIGHEST, select(anew, high, load(m, ENDED_HIGHEST)))
    store(m, ENDED_LOWEST, select(anew, low, load(m, ENDED_LOWEST)))
    store(m, ENDED_LEAST, select(anew, least, load(m, ENDED_LEAST)))
    store(m, ENDED_IMPACT_COUNT, select(anew, impacts, load(m, ENDED_IMPACT_COUNT)))
    store(m, TOP, select(anew, maximum(load(m, TOP), high), load(m, TOP)))
    store(m, BOTTOM, select(anew, minimum(load(m, BOTTOM), low), load(m, BOTTOM)))
    store(m, SLOWEST, select(anew, minimum(load(m, SLOWEST), least), load(m, SLOWEST)))
    store(m, COUNT, select(anew, load(m, COUNT) + impacts, load(m, COUNT)))
    store(m, HIGHEST, select(anew, x, high))
    store(m, LOWEST, select(anew, x, low))
    store(m, LEAST, select(anew, splat(np.inf), least))
    store(m, IMPACT_COUNT, select(anew, splat(0.0), impacts))
    store(m, NEXT_LOOK, select(anew, load(m, NEXT_LOOK) - impacts, load(m, NEXT_LOOK)))


@lean_jit
def cycle_length(ring, streak, legs, own):
    """The length in forcing periods of the cycle on which a trajectory has settled, or 0; `ring` holds its last states.

    It has settled on q periods when 2 q + 2 states in a row agree with those q periods before. The smallest q counts,
    and none while the states of a part of it are not clearly apart.
    """
    here, found, near = legs % (2 * LONGEST_CYCLE), 0, 0
    for q in range(1, min(LONGEST_CYCLE, legs - 1) + 1):
        there, apart = (legs - q) % (2 * LONGEST_CYCLE), 0.0
        for i in range(2 * own):
            apart = max(apart, abs(ring[here, i] - ring[there, i]) / max(1.0, abs(ring[here, i])))
        streak[q] = streak[q] + 1 if apart <= CLOSE else 0
        if apart <= DOUBTFUL * CLOSE:
            near |= 1 << q
        if found == 0 and streak[q] >= 2 * q + 2:
            found = q
    for d in range(1, found):  # a shorter cycle that is still being approached
        if found % d == 0 and (near >> d) & 1:
            return 0
    return found
