"""What is recorded of a trajectory while it runs: extrema of its first coordinate, and whether it has settled on a cycle.

This text is compiled together with the lanes (see `driver.py`).
"""

from __future__ import annotations

from saltus.flow.jit import lean_jit
from saltus.flow.lanes.layout import *
from saltus.flow.lanes.steps import both_at
from saltus.flow.lanes.vector import *

# --- compiled from here on -----------------------------------------------------------------------------------------------

LONGEST_CYCLE = 16  # forcing periods
CLOSE = 1e-10  # two states that count as one, relative to their size or to 1
DOUBTFUL = 1e4  # times CLOSE: not so far apart that they are surely two


@lean_jit
def turning_value(m, at, order, h, v0, chosen):
    """The position where the velocity, monotonic and of two signs at the ends of the step, vanishes."""
    low, high, tau = splat(0.0), h, 0.5 * h
    active, x = chosen, splat(0.0)
    for _ in range(60):
        x, v = both_at(m, at[POSITIONS], at[VELOCITIES], order, load(m, at[POSITION]), tau)
        before = mask(bits(v * v0 > 0.0))
        low, high = select(before, tau, low), select(before, high, tau)
        slope = splat(0.0)
        for k in range(order - 1, -1, -1):
            slope = fma(slope, tau, load(m, at[ACCELERATIONS] + k))
        following = tau - v / slope
        inside = mask(bits(following >= low) & bits(following <= high))
        following = select(inside, following, 0.5 * (low + high))
        moved = absolute(following - tau)
        tau = select(mask(active), following, tau)  # a lane stays where it has converged, whatever the others do
        active &= bits(moved > 1e-9 * h)
        if active == 0:
            break
    x, v = both_at(m, at[POSITIONS], at[VELOCITIES], order, load(m, at[POSITION]), tau)
    return x


@lean_jit
def watch_range(m, at, sizes, h, tau, bend, chosen, helpers, poly, gap):
    """Take the extrema of the first coordinate within this step into HIGHEST and LOWEST, for the chosen lanes."""
    order = sizes[LANE_ORDER]
    x, v = load(m, at[NEW_POSITION]), load(m, at[NEW_VELOCITY])
    high, low = load(m, HIGHEST), load(m, LOWEST)
    v0, first = load(m, at[VELOCITY]), 2.0 * load(m, at[POSITIONS] + 2) * h * h
    last = first + 6.0 * load(m, at[POSITIONS] + 3) * (h * h * h)
    monotonic = bits(minimum(first, last) > bend) | bits(maximum(first, last) < -bend)
    turns = bits(v0 * v < 0.0) & monotonic & chosen
    top, bottom = maximum(high, x), minimum(low, x)
    if turns:
        turning = turning_value(m, at, order, tau, v0, turns)
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
                above, below = helpers[TURNS_ALONE](gap, order, vector_lane(tau, lane), poly)
                m[HIGHEST * WIDTH + lane] = max(m[HIGHEST * WIDTH + lane], above)
                m[LOWEST * WIDTH + lane] = min(m[LOWEST * WIDTH + lane], below)


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
