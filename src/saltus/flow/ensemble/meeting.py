"""Whether the lanes meet a contact within a step, and when.

Its compiled part goes into one module with that of `driver.py`.
"""

from __future__ import annotations

from saltus.flow.ensemble.lane_layout import TOUCH, Helper
from saltus.flow.ensemble.lane_steps import lane_value, only_root, shape
from saltus.flow.memory_layout import SERIES_LENGTH, LanePart
from saltus.taylor import WIDTH, bits, inline_jit, load, mask, select, vector_lane, with_lane

# --- compiled from here on -----------------------------------------------------------------------------------------------


@inline_jit
def meet(at, row, m, order, h, sign, start, end, bend, skip, alive, helpers, space):
    """Which of the lanes in `alive` meet a contact within the step, which are in doubt, when, and with what velocity.

    The contact is met where `sign` times a coordinate falls to 0. `start` is the coordinate from the contact on at the start of
    the step, `end` position, velocity and acceleration at its end. `skip` are the lanes in which the step starts at the contact.
    """
    x, v, _ = end
    g0, first = sign * start, at[LanePart.POSITIONS] + row * SERIES_LENGTH
    g1, g2 = sign * load(m, first + 1) * h, sign * load(m, first + 2) * (h * h)
    cubic = (g0, g1, g2, sign * load(m, first + 3) * (h * h * h))
    doubtful = ((bits(g0 <= 0.0) & ~skip) | (bits(g1 <= 0.0) & skip)) & alive
    clear, falls, concave, convex = shape(cubic, bend, skip)
    over = bits(sign * x <= 0.0)
    single = concave | (falls & ~skip) | (convex & over)
    hit = alive & ~doubtful & ~clear & single & over
    tau, at_root = h, v
    if hit:
        root, speed = only_root(m, at, row, order, h, start, sign, cubic, end, hit)
        tau, at_root = select(mask(hit), root, h), select(mask(hit), speed, v)
    velocities = at[LanePart.VELOCITIES] + row * SERIES_LENGTH
    unclear = alive & ~doubtful & ~clear & ~single
    for lane in range(WIDTH if unclear else 0):
        if (unclear >> lane) & 1:
            root = scalar_root(at, row, m, order, lane, h, sign, g0, (skip >> lane) & 1, helpers, space)
            if root == TOUCH:
                doubtful |= 1 << lane
            elif root >= 0.0:
                hit |= 1 << lane
                tau = with_lane(tau, lane, root)
                at_root = with_lane(at_root, lane, lane_value(m, velocities, order, lane, root))
    return hit, doubtful, tau, at_root


@inline_jit
def scalar_root(at, row, m, order, lane, h, sign, g0, skip, helpers, space):
    """The first root of one lane's gap, NO_ROOT or TOUCH, by the scalar kernel's search."""
    step, gap_sign, start = vector_lane(h, lane), vector_lane(sign, lane), vector_lane(g0, lane)
    search = helpers[Helper.FIRST_ROOT]
    return search(m, at[LanePart.POSITIONS] + row * SERIES_LENGTH, order, lane, step, gap_sign, start, skip, space[0], space[1])
