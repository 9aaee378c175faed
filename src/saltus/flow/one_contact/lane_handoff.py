"""What `programs/lane_handoff.py` needs of a model with one contact, to let the scalar kernel move a lane.

Its compiled part goes into one module with that of `programs/lane_handoff.py`; `contacts/lane_handoff.py`
takes its place for models with several contacts.
"""

from __future__ import annotations

from saltus.flow.kernel.layout import EventCode, Geometry, Mode
from saltus.flow.kernel.memory import OneContactFunctions
from saltus.taylor import inline_jit, jit, lean_jit

# --- compiled from here on ---------------------------------------------------


@jit
def functions_of(lane):
    """The functions of the structure that the scalar kernel calls."""
    ((series, contact_series, reset, contact_damping, tangent),) = lane.kernel
    return OneContactFunctions(
        series, contact_series, reset, contact_damping, lane.geometry[lane.index], tangent
    )


@inline_jit
def event_numbers(lane):
    """How many numbers an event has before its shifts."""
    return 3


@inline_jit
def begin_scalar(lane):
    """Prepare the scalar kernel's rows of contacts, of which there are none."""


@lean_jit
def record_events(lane, motion, events):
    """Record the impacts of the scalar kernel's last call; returns the last event's detail."""
    detail = 0
    for i in range(motion.recorded_events):
        kind = events.event_labels[i, 1]
        detail = events.event_labels[i, 3]
        if kind == EventCode.IMPACT:
            lane.impacts += 1.0
            lane.least_speed = min(lane.least_speed, abs(events.event_values[i, 1]))
        elif kind == EventCode.GRAZING:
            lane.grazings += 1
    return detail


@inline_jit
def end_scalar(lane, motion):
    """Put into the lane what else the scalar kernel has found: nothing."""


@lean_jit
def is_captured(lane, motion, state):
    """Whether a motion is proved to be captured: at rest, or at the contact with a speed of the gap
    below the capture speed.
    """
    threshold = lane.capture_speed
    if motion.mode == Mode.REST:
        return threshold > 0.0
    if motion.mode == Mode.CHATTER:
        return motion.chatter_speed < threshold
    if motion.mode != Mode.ARC or motion.skip != 1:
        return False
    geometry = lane.geometry[lane.index]
    rate = geometry[Geometry.RATE_UP] if motion.side > 0 else geometry[Geometry.RATE_DOWN]
    return rate * state[motion.dof] < threshold
