"""The state of one lane as the scalar kernel's arrays, and the records of its steps.

Its compiled part goes into one module with that of `scalar_handoff.py`, or of `contacts_handoff.py`.
"""

from __future__ import annotations

import numpy as np

from saltus.flow.kernel.layout import SETTING_COUNT, WHERE_LENGTH, Mode, Setting, Where
from saltus.flow.kernel.memory_layout import LanePart, State
from saltus.flow.lanes.lane_layout import Flag, LaneArray, LaneLabel, LaneNumber, LaneSetting, Size, Slot
from saltus.flow.lanes.scalar_fallback import turning_range
from saltus.taylor import get, jit, lean_jit, put

# --- compiled from here on -----------------------------------------------------------------------------------------------

BUFFER_LENGTH = 64  # steps, and events, of one call


@jit
def scalar_state(lane, sizes, at, m, flags, settings, lanes):
    """The scalar kernel's state for a lane: its arrays `where`, `state` and `settings` (see `kernel/layout.py`)."""
    labels, numbers = lanes[LaneArray.LABELS][lane], lanes[LaneArray.NUMBERS][lane]
    rows = at[LanePart.VELOCITY] - at[LanePart.POSITION]
    where = np.zeros(WHERE_LENGTH, dtype=np.int64)
    state, limits = np.zeros(State.COORDINATES + 2 * rows + sizes[Size.COLUMNS]), np.zeros(SETTING_COUNT)
    period, length = int(get(m, Slot.PERIOD, lane)), get(m, Slot.PERIOD_LENGTH, lane)
    where[Where.PERIOD], where[Where.LAST_PERIOD] = period, period
    where[Where.MODE], where[Where.HELD] = labels[LaneLabel.MODE], labels[LaneLabel.HELD]
    where[Where.SIDE], where[Where.PIECE] = int(get(m, Slot.SIDE, lane)), labels[LaneLabel.PIECE]
    where[Where.LEAVE_BY] = labels[LaneLabel.LEAVE_BY]
    at_contact = (flags[Flag.AT_CONTACT] >> lane) & 1
    where[Where.SKIP] = at_contact if labels[LaneLabel.MODE] == Mode.ARC else labels[LaneLabel.SKIP]
    where[Where.ORDER], where[Where.DENSE], where[Where.UNTIL_SMOOTH] = sizes[Size.SCALAR_ORDER], sizes[Size.EXTREMA], 1
    where[Where.DOF], where[Where.MARGINS], where[Where.ROWS] = rows, sizes[Size.MARGINS], sizes[Size.WORKSPACE]
    where[Where.SIDES], where[Where.CHECKED] = sizes[Size.SIDES], sizes[Size.CHECKED]
    where[Where.OWN], where[Where.COLUMNS] = sizes[Size.OWN], sizes[Size.COLUMNS]
    state[State.TIME], state[State.CHATTER_SPEED] = get(m, Slot.NOW, lane), numbers[LaneNumber.CHATTER_SPEED]
    for row in range(2 * rows):  # in both memories velocities follow the positions
        state[State.COORDINATES + row] = get(m, at[LanePart.POSITION] + row, lane)
    limits[Setting.LENGTH], limits[Setting.TOLERANCE] = length, settings[LaneSetting.TOLERANCE]
    last = labels[LaneLabel.LAST_PERIOD]
    limits[Setting.END] = numbers[LaneNumber.END_TIME] if period == last else get(m, Slot.PERIOD_START, lane) + length
    limits[Setting.HORIZON] = (last - period) * length + numbers[LaneNumber.END_TIME]
    return where, state, limits


@lean_jit
def record_extrema(lane, where, m, steps, poly):
    """Record the extrema of the scalar kernel's last call, and forget its steps and events."""
    for i in range(where[Where.STEPS]):
        for row in range(where[Where.OWN]):
            above, below = turning_range(steps[2][i, row], where[Where.ORDER], 0.0, steps[1][i, 1], poly)
            put(m, Slot.HIGHEST, lane, max(get(m, Slot.HIGHEST, lane), above))
            put(m, Slot.LOWEST, lane, min(get(m, Slot.LOWEST, lane), below))
    where[Where.STEPS] = where[Where.EVENTS] = 0


@lean_jit
def put_state(lane, at, m, flags, lanes, where, state):
    """Put the scalar kernel's state into the lane."""
    labels, bit = lanes[LaneArray.LABELS][lane], 1 << lane
    rows = at[LanePart.VELOCITY] - at[LanePart.POSITION]
    labels[LaneLabel.MODE], labels[LaneLabel.HELD] = where[Where.MODE], where[Where.HELD]
    labels[LaneLabel.SKIP], labels[LaneLabel.PIECE] = where[Where.SKIP], where[Where.PIECE]
    put(m, Slot.NOW, lane, state[State.TIME])
    put(m, Slot.SIDE, lane, float(where[Where.SIDE]))
    for row in range(2 * rows):
        put(m, at[LanePart.POSITION] + row, lane, state[State.COORDINATES + row])
    for j in range(where[Where.COLUMNS]):  # the shifts of the last event, for `finish`
        put(m, at[LanePart.AFTER_POSITION] + j, lane, state[State.COORDINATES + 2 * rows + j])
    chatter = where[Where.MODE] == Mode.CHATTER
    lanes[LaneArray.NUMBERS][lane, LaneNumber.CHATTER_SPEED] = state[State.CHATTER_SPEED] if chatter else 0.0
    arc = where[Where.MODE] == Mode.ARC and where[Where.SKIP] <= 1
    flags[Flag.SCALAR] = flags[Flag.SCALAR] & ~bit if arc else flags[Flag.SCALAR] | bit
    at_contact = arc and where[Where.SKIP] == 1
    flags[Flag.AT_CONTACT] = flags[Flag.AT_CONTACT] | bit if at_contact else flags[Flag.AT_CONTACT] & ~bit
