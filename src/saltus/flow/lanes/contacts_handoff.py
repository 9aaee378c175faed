"""The scalar kernel as it is used for one lane of a model with several contacts, and the impacts of a lane.

Its compiled part goes into one module with that of `lane_state.py`; the driver calls it through pointers.
"""

from __future__ import annotations

import numpy as np

from saltus.flow.contacts.impacts import closed_bits, couple, impact_impulses, only_open, push, settle_contact
from saltus.flow.contacts.layout import ContactColumn
from saltus.flow.kernel.layout import Mode, Status
from saltus.flow.kernel.memory import EventBuffers, LaneImpactParts, MotionMemory, StepBuffers
from saltus.flow.kernel.memory_layout import EventCode, LanePart
from saltus.flow.kernel.steps import state_arrays
from saltus.flow.lanes.contact_function_types import CONTACTS_IMPACT, SCALAR_MOTION
from saltus.flow.lanes.contacts_of_lane import contacts_of, tell_closed
from saltus.flow.lanes.lane_layout import Flag, LaneArray, LaneLabel, LaneSetting, Size, Slot
from saltus.flow.lanes.lane_state import BUFFER_LENGTH, put_state, record_extrema, scalar_state
from saltus.taylor import by_reference, cached_jit, get, lean_jit, own_records, put

# --- compiled from here on -----------------------------------------------------------------------------------------------


@lean_jit
def impact_speed(contacts, values, hit):
    """The least speed before an impact of the contacts in `hit`, from the values of its event."""
    speed = np.inf
    for i in range(contacts.shape[0]):
        if hit >> i & 1:
            speed = min(speed, abs(values[1 + contacts[i, ContactColumn.COORDINATE]]))
    return speed


@lean_jit
def record_impacts(lane, motion, m, contacts, events):
    """Record the impacts of the scalar kernel's last call; returns the last event's detail."""
    detail = 0
    for i in range(motion.recorded_events):
        detail = events.event_labels[i, 3]
        if events.event_labels[i, 1] == EventCode.IMPACT:
            speed = impact_speed(contacts, events.event_values[i], events.event_labels[i, 2])
            put(m, Slot.IMPACTS, lane, get(m, Slot.IMPACTS, lane) + 1.0)
            put(m, Slot.LEAST_SPEED, lane, min(get(m, Slot.LEAST_SPEED, lane), speed))
    return detail


@cached_jit(SCALAR_MOTION)
def scalar_motion(lane, scalar, sizes, at, m, flags, settings, lanes, parameters, tables, poly, control):
    """Move a lane by the scalar kernel until it moves smoothly again, or its forcing period or its motion ends.

    Returns (PAUSED, 0), or why the motion ends and which margin reached zero.
    """
    (advance, model), rows = scalar, lanes[LaneArray.CONTACTS][lane]
    contacts = rows[: sizes[Size.CONTACTS]]
    array, state = scalar_state(lane, sizes, at, m, flags, settings, lanes)
    motion = array[0]
    if not flags[Flag.SCALAR] >> lane & 1:
        contacts_of(lane, sizes, at, m, contacts)
    trajectory, own = lanes[LaneArray.LABELS][lane, LaneLabel.TRAJECTORY], sizes[Size.OWN]
    breaks, table = own_records(tables, trajectory)
    env = (parameters[trajectory], lanes[LaneArray.CONSTANTS][lane], breaks, table)
    steps = StepBuffers(
        np.empty((BUFFER_LENGTH, 2), np.int64),
        np.empty((BUFFER_LENGTH, 2)),
        np.empty((BUFFER_LENGTH, own, motion.order + 2)),
    )
    events = EventBuffers(
        np.empty((BUFFER_LENGTH, 4), np.int64),
        np.empty((BUFFER_LENGTH, 1 + 2 * own + contacts.shape[0] + sizes[Size.COLUMNS])),
    )
    while True:
        status = advance(array, state, env, model, rows, (steps, events))
        detail = record_impacts(lane, motion, m, contacts, events)
        record_extrema(lane, motion, m, steps, poly)
        many = get(m, Slot.IMPACTS, lane) > get(m, Slot.NEXT_CHECK, lane)  # then the driver checks their number
        if (status != Status.FULL and status != Status.PAUSED) or many or control[0] != 0:
            break
    put_state(lane, at, m, flags, lanes, motion, state)
    put(m, Slot.SIDE, lane, 1.0 + tell_closed(lane, at, m, contacts))
    lanes[LaneArray.LABELS][lane, LaneLabel.LEAVE_BY] = motion.leave_by
    if sizes[Size.FRICTIONS] > 0 or motion.mode != Mode.ARC or not only_open(contacts):
        flags[Flag.SCALAR] |= 1 << lane
    if status in (Status.DONE, Status.SMOOTH, Status.FULL, Status.PAUSED):
        captured = motion.mode == Mode.REST and get(m, Slot.CAPTURE_SPEED, lane) > 0.0
        return Status.CAPTURED if captured else Status.PAUSED, 0
    return status, detail


@cached_jit(CONTACTS_IMPACT)
def contacts_impact(lane, hit, scalar, sizes, at, m, settings, lanes, parameters, tables, space):
    """Apply the impact law to a lane at its new state, where the contacts in `hit` close; returns 1 if that was enough.

    Otherwise it returns 0 and leaves the lane unchanged, for the scalar kernel to take over: where the law has no solution, where
    the remaining speeds are so small that an accumulation may end, and where everything is at rest.
    """
    _, _, array, state, contacts, solver = space
    own, count, labels, rates = sizes[Size.OWN], sizes[Size.CONTACTS], lanes[LaneArray.LABELS], solver.rates
    trajectory = labels[lane, LaneLabel.TRAJECTORY]
    breaks, table = own_records(tables, trajectory)
    env = (parameters[trajectory], lanes[LaneArray.CONSTANTS][lane], breaks, table)
    numbers = array[0]
    numbers.dof, numbers.own, numbers.piece = own, own, labels[lane, LaneLabel.PIECE]
    parts = state_arrays(numbers, state)
    motion = by_reference(MotionMemory(numbers, LaneImpactParts(parts, env, env[0], scalar[1], contacts, solver)))
    for row in range(2 * own):  # velocities follow the positions in both memories
        state[row] = get(m, at[LanePart.NEW_POSITION] + row, lane)
    contacts_of(lane, sizes, at, m, contacts)
    regular, chosen, speed = couple(motion), hit | closed_bits(motion), np.inf
    for i in range(count):
        if hit >> i & 1:
            speed = min(speed, -rates[i])
    if not regular or not speed > 0.0 or impact_impulses(motion, chosen, rates) < 0:
        return 0
    push(motion)
    free = (1 << own) - 1
    for i in range(count):
        if chosen >> i & 1:
            settle_contact(motion, i, rates[i])
            if rates[i] == 0.0:
                free &= ~(1 << contacts[i, ContactColumn.COORDINATE])
            elif rates[i] <= settings[LaneSetting.SLOWEST_IMPACT]:
                return 0
    if free == 0:
        return 0
    put(m, Slot.NEW_SPEED, lane, speed)
    put(m, Slot.NEW_SIDE, lane, 1.0 + tell_closed(lane, at, m, contacts))
    for row in range(2 * own):
        put(m, at[LanePart.AFTER_POSITION] + row, lane, state[row])
    return 1
