"""The state of one lane as the scalar kernel's arrays, and the records of its steps.

Its compiled part goes into one module with that of `scalar_handoff.py`, or of `contacts_handoff.py`.
"""

from __future__ import annotations

import numpy as np

from saltus.flow.kernel.layout import Mode
from saltus.flow.kernel.memory import MOTION
from saltus.flow.kernel.memory_layout import LanePart
from saltus.flow.lanes.lane_layout import Flag, LaneArray, LaneLabel, LaneNumber, LaneSetting, Size, Slot
from saltus.flow.lanes.scalar_fallback import turning_range
from saltus.taylor import get, jit, lean_jit, put

# --- compiled from here on -----------------------------------------------------------------------------------------------

BUFFER_LENGTH = 64  # steps, and events, of one call


@jit
def scalar_state(lane, sizes, at, m, flags, settings, lanes):
    """The scalar kernel's memory for a lane: an array of one record MOTION, and the state (see `kernel/memory.py`)."""
    labels, numbers = lanes[LaneArray.LABELS][lane], lanes[LaneArray.NUMBERS][lane]
    rows = at[LanePart.VELOCITY] - at[LanePart.POSITION]
    array = np.zeros(1, dtype=MOTION)
    motion, state = array[0], np.zeros(2 * rows + sizes[Size.COLUMNS])
    period, length = int(get(m, Slot.PERIOD, lane)), get(m, Slot.PERIOD_LENGTH, lane)
    motion.period, motion.last_period = period, period
    motion.mode, motion.rested = labels[LaneLabel.MODE], labels[LaneLabel.HELD]
    motion.side, motion.piece = int(get(m, Slot.SIDE, lane)), labels[LaneLabel.PIECE]
    motion.leave_by = labels[LaneLabel.LEAVE_BY]
    at_contact = (flags[Flag.AT_CONTACT] >> lane) & 1
    motion.skip = at_contact if labels[LaneLabel.MODE] == Mode.ARC else labels[LaneLabel.SKIP]
    motion.order, motion.dense, motion.until_smooth = sizes[Size.SCALAR_ORDER], sizes[Size.EXTREMA], 1
    motion.dof, motion.margin_count, motion.workspace_rows = rows, sizes[Size.MARGINS], sizes[Size.WORKSPACE]
    motion.sides, motion.checked = sizes[Size.SIDES], sizes[Size.CHECKED]
    motion.own, motion.columns = sizes[Size.OWN], sizes[Size.COLUMNS]
    motion.time, motion.chatter_speed = get(m, Slot.NOW, lane), numbers[LaneNumber.CHATTER_SPEED]
    for row in range(2 * rows):  # in both memories velocities follow the positions
        state[row] = get(m, at[LanePart.POSITION] + row, lane)
    motion.period_length, motion.tolerance = length, settings[LaneSetting.TOLERANCE]
    last = labels[LaneLabel.LAST_PERIOD]
    motion.end = numbers[LaneNumber.END_TIME] if period == last else get(m, Slot.PERIOD_START, lane) + length
    motion.horizon = (last - period) * length + numbers[LaneNumber.END_TIME]
    return array, state


@lean_jit
def record_extrema(lane, motion, m, steps, poly):
    """Record the extrema of the scalar kernel's last call, and forget its steps and events."""
    for i in range(motion.recorded_steps):
        for row in range(motion.own):
            above, below = turning_range(steps.step_series[i, row], motion.order, 0.0, steps.step_spans[i, 1], poly)
            put(m, Slot.HIGHEST, lane, max(get(m, Slot.HIGHEST, lane), above))
            put(m, Slot.LOWEST, lane, min(get(m, Slot.LOWEST, lane), below))
    motion.recorded_steps = motion.recorded_events = 0


@lean_jit
def put_state(lane, at, m, flags, lanes, motion, state):
    """Put the scalar kernel's state into the lane."""
    labels, bit = lanes[LaneArray.LABELS][lane], 1 << lane
    rows = at[LanePart.VELOCITY] - at[LanePart.POSITION]
    labels[LaneLabel.MODE], labels[LaneLabel.HELD] = motion.mode, motion.rested
    labels[LaneLabel.SKIP], labels[LaneLabel.PIECE] = motion.skip, motion.piece
    put(m, Slot.NOW, lane, motion.time)
    put(m, Slot.SIDE, lane, float(motion.side))
    for row in range(2 * rows):
        put(m, at[LanePart.POSITION] + row, lane, state[row])
    for j in range(motion.columns):  # the shifts of the last event, for `finish`
        put(m, at[LanePart.AFTER_POSITION] + j, lane, state[2 * rows + j])
    chatter = motion.mode == Mode.CHATTER
    lanes[LaneArray.NUMBERS][lane, LaneNumber.CHATTER_SPEED] = motion.chatter_speed if chatter else 0.0
    arc = motion.mode == Mode.ARC and motion.skip <= 1
    flags[Flag.SCALAR] = flags[Flag.SCALAR] & ~bit if arc else flags[Flag.SCALAR] | bit
    at_contact = arc and motion.skip == 1
    flags[Flag.AT_CONTACT] = flags[Flag.AT_CONTACT] | bit if at_contact else flags[Flag.AT_CONTACT] & ~bit
