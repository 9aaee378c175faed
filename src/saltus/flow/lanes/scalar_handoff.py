"""The scalar kernel as it moves one lane through rare events: rest, slow impacts that may accumulate, touches, limits.

Its compiled part goes into one module with that of `lane_state.py`; the driver calls it through a pointer.
"""

from __future__ import annotations

import numpy as np

from saltus.flow.kernel.layout import Geometry, Mode, Status
from saltus.flow.kernel.memory import EventBuffers, OneContactFunctions, StepBuffers
from saltus.flow.kernel.memory_layout import EventCode
from saltus.flow.lanes.function_types import SCALAR_MOTION
from saltus.flow.lanes.lane_layout import LaneArray, LaneLabel, Slot
from saltus.flow.lanes.lane_state import BUFFER_LENGTH, put_state, record_extrema, scalar_state
from saltus.taylor import cached_jit, get, lean_jit, own_records, put

# --- compiled from here on -----------------------------------------------------------------------------------------------


@lean_jit
def record_events(lane, motion, m, lanes, events):
    """Record the impacts of the scalar kernel's last call; returns the last event's detail."""
    detail = 0
    for i in range(motion.recorded_events):
        kind, detail = events.event_labels[i, 1], events.event_labels[i, 3]
        if kind == EventCode.IMPACT:
            put(m, Slot.IMPACTS, lane, get(m, Slot.IMPACTS, lane) + 1.0)
            put(m, Slot.LEAST_SPEED, lane, min(get(m, Slot.LEAST_SPEED, lane), abs(events.event_values[i, 1])))
        elif kind == EventCode.GRAZING:
            lanes[LaneArray.LABELS][lane, LaneLabel.GRAZINGS] += 1
    return detail


@lean_jit
def is_captured(motion, state, geometry, threshold):
    """Whether a motion is proved to be captured: at rest, or at the contact with a speed of the gap below the threshold."""
    if motion.mode == Mode.REST:
        return threshold > 0.0
    if motion.mode == Mode.CHATTER:
        return motion.chatter_speed < threshold
    if motion.mode != Mode.ARC or motion.skip != 1:
        return False
    rate = geometry[Geometry.RATE_UP] if motion.side > 0 else geometry[Geometry.RATE_DOWN]
    return rate * state[motion.dof] < threshold


@cached_jit(SCALAR_MOTION)
def scalar_motion(lane, scalar, sizes, at, m, flags, settings, lanes, parameters, tables, poly, control):
    """Move a lane by the scalar kernel until it is on an arc again, or its forcing period or its motion ends.

    Returns (PAUSED, 0), or why the motion ends and which margin reached zero.
    """
    advance, functions = scalar
    geometry = lanes[LaneArray.GEOMETRY][lane]
    array, state = scalar_state(lane, sizes, at, m, flags, settings, lanes)
    motion, rows = array[0], np.empty((0, 1), np.int64)
    trajectory = lanes[LaneArray.LABELS][lane, LaneLabel.TRAJECTORY]
    breaks, table = own_records(tables, trajectory)
    env = (parameters[trajectory], lanes[LaneArray.CONSTANTS][lane], breaks, table)
    model = OneContactFunctions(functions[0], functions[1], functions[2], functions[3], geometry, functions[4])
    steps = StepBuffers(
        np.empty((BUFFER_LENGTH, 2), np.int64),
        np.empty((BUFFER_LENGTH, 2)),
        np.empty((BUFFER_LENGTH, motion.own, motion.order + 2)),
    )
    events = EventBuffers(np.empty((BUFFER_LENGTH, 4), np.int64), np.empty((BUFFER_LENGTH, 3 + motion.columns)))
    while True:
        status = advance(array, state, env, model, rows, (steps, events))
        detail = record_events(lane, motion, m, lanes, events)
        record_extrema(lane, motion, m, steps, poly)
        if (status != Status.FULL and status != Status.PAUSED) or control[0] != 0:
            break
    put_state(lane, at, m, flags, lanes, motion, state)
    if status in (Status.DONE, Status.SMOOTH, Status.FULL, Status.PAUSED):
        captured = is_captured(motion, state, geometry, get(m, Slot.CAPTURE_SPEED, lane))
        return Status.CAPTURED if captured else Status.PAUSED, 0
    return status, detail
