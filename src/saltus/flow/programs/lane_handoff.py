"""The scalar kernel's part in a group of lanes, one lane at a time, through pointers: roots and
extrema where the bounds for all lanes leave them open, and rare events (rest, slow impacts that may
accumulate, touches, limits), through which it moves a lane.

Its compiled part goes into one module with that of `one_contact/lane_handoff.py`, or of
`contacts/lane_handoff.py`. If it were linked into its callers, it would be compiled again with each
of them.
"""

from __future__ import annotations

import numpy as np

from saltus.flow.kernel.layout import Mode, Status
from saltus.flow.kernel.memory import MOTION, EventBuffers, StepBuffers
from saltus.flow.kernel.roots import SIMPLE, first_root, horner, scale_gap
from saltus.flow.lane_steps.function_types import LANE_ROOT, SCALAR_MOTION, TURNING_RANGE
from saltus.flow.lane_steps.memory import NO_ROOT, TOUCH, Control, natural_time_of
from saltus.flow.one_contact.lane_handoff import (
    begin_scalar,
    end_scalar,
    event_numbers,
    functions_of,
    is_captured,
    record_events,
)
from saltus.taylor import cached_jit, jit, lean_jit
from saltus.taylor.load_tables import own_records

# --- compiled from here on ---------------------------------------------------

MOST_TURNS = 16  # the most turning points that are looked for within one step
BUFFER_LENGTH = 64  # steps of one call
EVENT_LENGTH = 64  # events of one call, beside those that one pass may record


# --- roots and extrema -------------------------------------------------------


@cached_jit(LANE_ROOT)
def first_root_of(lane, row, start, sign, h, skip):
    """The first root of one lane's gap by `roots.first_root`: its time, NO_ROOT, or TOUCH where it
    touches zero before.

    The gap is `sign` times coordinate `row`, measured from the contact: `start` at the start of the
    step. If `skip` is 1, the step starts at the contact.
    """
    series = lane.positions[row]
    order = lane.sizes.order
    gap = lane.gap
    poly = lane.polynomial
    for k in range(1, order + 1):
        gap[k] = sign * series[k]
    gap[0] = sign * start
    scale_gap(gap, skip, order, h, poly)
    kind, u, touch = first_root(poly, order - skip)
    if touch <= 1.0:
        return TOUCH
    return u * h if kind == SIMPLE else NO_ROOT


@lean_jit
def shift_start(p, n, u):
    """Replace p(s) by p(u + (1 - u) s)."""
    for k in range(n):
        for j in range(n - 1, k - 1, -1):
            p[j] += u * p[j + 1]
    power = 1.0
    for k in range(n + 1):
        p[k] *= power
        power *= 1.0 - u


@cached_jit(TURNING_RANGE)
def turning_range(q, order, begin, h, p):
    """The largest and the smallest value of a series on (begin, h], at its end or where its
    derivative vanishes before.
    """
    high = low = horner(q, order, h)
    n = order - 1
    power = 1.0
    for k in range(order):
        p[k] = (k + 1) * q[k + 1] * power
        power *= h
    start = begin / h
    left = 1.0 - begin / h
    if begin > 0.0:
        shift_start(p, n, start)
    for _ in range(MOST_TURNS):
        while n > 0 and p[0] == 0.0:
            for k in range(n):
                p[k] = p[k + 1]
            n -= 1
        if p[0] < 0.0:
            for k in range(n + 1):
                p[k] = -p[k]
        kind, u, _ = first_root(p, n)
        if kind != SIMPLE or u >= 1.0:
            break
        start += u * left
        left *= 1.0 - u
        x = horner(q, order, start * h)
        high = max(high, x)
        low = min(low, x)
        shift_start(p, n, u)
        p[0] = 0.0
    return high, low


# --- rare events -------------------------------------------------------------


@jit
def scalar_state(lane):
    """The scalar kernel's memory for a lane: an array of one record MOTION, and the state (see
    `kernel/memory.py`).
    """
    numbers = np.zeros(1, dtype=MOTION)
    sizes = lane.sizes
    motion = numbers[0]
    state = np.zeros(2 * sizes.rows + sizes.columns)
    period = int(lane.period)
    length = lane.period_length
    last = lane.last_period
    motion.period = motion.last_period = period
    motion.mode = lane.mode
    motion.rested = lane.held
    motion.side = int(lane.side)
    motion.piece = lane.piece
    motion.leave_by = lane.leave_by
    motion.skip = (lane.at_contact >> lane.index) & 1 if lane.mode == Mode.ARC else lane.skip
    motion.order = sizes.scalar_order
    motion.dense = sizes.extrema
    motion.until_smooth = 1
    motion.dof = sizes.rows
    motion.margin_count = sizes.margins
    motion.workspace_rows = sizes.workspace
    motion.sides = sizes.sides
    motion.checked = sizes.checked
    motion.own = sizes.own
    motion.columns = sizes.columns
    motion.first_order = sizes.first_order
    motion.local = sizes.local
    motion.repeats = sizes.repeats
    motion.contact_numbers = sizes.contact_numbers
    motion.time = lane.now
    motion.chatter_speed = lane.chatter_speed
    motion.pull = lane.pull
    motion.fastest = lane.fastest
    for row in range(2 * sizes.rows):  # in both memories velocities follow the positions
        state[row] = lane.position[row]
    motion.period_length = length
    motion.tolerance = lane.settings.tolerance
    motion.natural_time = natural_time_of(lane)
    motion.end = lane.end_time if period == last else lane.period_start + length
    motion.horizon = (last - period) * length + lane.end_time
    return numbers, state


@jit
def own_env(lane):
    """The scalar kernel's `env` for a lane."""
    trajectory = lane.trajectory
    breaks, table = own_records(lane.work.tables, trajectory)
    return lane.work.parameters[trajectory], lane.constants_of[lane.index], breaks, table


@jit
def buffers(motion, numbers, rows):
    """Buffers for steps, and for events of so many numbers before their shifts, of so many contacts
    and frictions.
    """
    steps = StepBuffers(
        np.empty((BUFFER_LENGTH, 2), np.int64),
        np.empty((BUFFER_LENGTH, 2)),
        np.empty((BUFFER_LENGTH, motion.own, motion.order + 2)),
    )
    length = EVENT_LENGTH + 4 + 2 * rows  # `spare_events`
    return steps, EventBuffers(
        np.empty((length, 4), np.int64), np.empty((length, numbers + motion.columns))
    )


@lean_jit
def record_extrema(lane, motion, steps):
    """Record the extrema of the scalar kernel's last call, and forget its steps and events."""
    for i in range(motion.recorded_steps):
        for row in range(motion.own):
            series = steps.step_series[i, row]
            h = steps.step_spans[i, 1]
            moved = 0.0
            power = h
            for k in range(1, motion.order + 1):
                moved += abs(series[k]) * power
                power *= h
            # else it certainly stays between them
            if series[0] + moved > lane.highest or series[0] - moved < lane.lowest:
                above, below = turning_range(series, motion.order, 0.0, h, lane.polynomial)
                lane.highest = max(lane.highest, above)
                lane.lowest = min(lane.lowest, below)
    motion.recorded_steps = motion.recorded_events = 0


@lean_jit
def put_state(lane, motion, state):
    """Put the scalar kernel's state into the lane."""
    rows = lane.sizes.rows
    bit = 1 << lane.index
    lane.mode = motion.mode
    lane.held = motion.rested
    lane.skip = motion.skip
    lane.piece = motion.piece
    lane.now = motion.time
    lane.side = float(motion.side)
    lane.pull = motion.pull
    lane.fastest = motion.fastest
    for row in range(2 * rows):
        lane.position[row] = state[row]
    for j in range(motion.columns):  # the shifts of the last event, for `finish`
        lane.after_position[j] = state[2 * rows + j]
    lane.chatter_speed = motion.chatter_speed if motion.mode == Mode.CHATTER else 0.0
    arc = motion.mode == Mode.ARC and motion.skip <= 1
    lane.scalar = lane.scalar & ~bit if arc else lane.scalar | bit
    lane.at_contact = lane.at_contact | bit if arc and motion.skip == 1 else lane.at_contact & ~bit


@cached_jit(SCALAR_MOTION)
def scalar_motion(lane):
    """Move a lane by the scalar kernel until it moves smoothly again, or its forcing period or its
    motion ends.

    Returns (PAUSED, 0), or why the motion ends and which margin reached zero.
    """
    advance = lane.helpers.advance
    numbers, state = scalar_state(lane)
    motion = numbers[0]
    rows = lane.contact_rows[lane.index]
    env = own_env(lane)
    functions = functions_of(lane)
    begin_scalar(lane)
    steps, events = buffers(motion, event_numbers(lane), rows.shape[0])
    while True:
        status = advance(numbers, state, env, functions, rows, (steps, events))
        detail = record_events(lane, motion, events)
        record_extrema(lane, motion, steps)
        many = lane.impacts > lane.next_check  # then the driver checks their number
        over = many or lane.work.control[Control.MOST_PERIODS] == 0
        if (status != Status.FULL and status != Status.PAUSED) or over:
            break
    put_state(lane, motion, state)
    end_scalar(lane, motion)
    if status in (Status.DONE, Status.SMOOTH, Status.FULL, Status.PAUSED):
        return Status.CAPTURED if is_captured(lane, motion, state) else Status.PAUSED, 0
    return status, detail
