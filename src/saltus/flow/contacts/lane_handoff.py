"""What `programs/lane_handoff.py` needs of a model with several contacts, to let the scalar kernel move a
lane.

Its compiled part goes into one module with that of `programs/lane_handoff.py`, in the place of
`one_contact/lane_handoff.py`.
"""

from __future__ import annotations

from saltus.flow.contacts.impacts import only_open
from saltus.flow.contacts.lane_impacts import read_contacts, write_closed
from saltus.flow.kernel.layout import EventCode, Mode
from saltus.taylor import inline_jit, jit, lean_jit

# --- compiled from here on ---------------------------------------------------


@jit
def functions_of(lane):
    """The functions of the structure that the scalar kernel calls."""
    (functions,) = lane.kernel
    return functions


@inline_jit
def event_numbers(lane):
    """How many numbers an event has before its shifts."""
    return 1 + 2 * lane.sizes.own + lane.sizes.contacts


@inline_jit
def begin_scalar(lane):
    """Prepare the scalar kernel's rows of contacts, unless it has moved the lane last."""
    if not lane.scalar >> lane.index & 1:
        read_contacts(lane, lane.contact_rows[lane.index])


@lean_jit
def record_events(lane, motion, events):
    """Record the impacts of the scalar kernel's last call; returns the last event's detail."""
    detail = 0
    for i in range(motion.recorded_events):
        kind = events.event_labels[i, 1]
        hit = events.event_labels[i, 2]
        detail = events.event_labels[i, 3]
        if kind == EventCode.IMPACT:
            lane.impacts += 1.0
            for k in range(lane.sizes.contacts):
                if hit >> k & 1:
                    lane.least_speed = min(
                        lane.least_speed, abs(events.event_values[i, 1 + lane.sizes.coordinates[k]])
                    )
    return detail


@inline_jit
def end_scalar(lane, motion):
    """Put into the lane which contacts are closed, and whether the scalar kernel must go on."""
    contacts = lane.contact_rows[lane.index][: lane.sizes.contacts]
    write_closed(lane, contacts)
    lane.leave_by = motion.leave_by
    followed = lane.sizes.frictions > 0 or functions_of(lane).eigenmodes.size > 0
    if followed or motion.mode != Mode.ARC or not only_open(contacts):
        lane.scalar |= 1 << lane.index


@inline_jit
def is_captured(lane, motion, state):
    """Whether a motion is proved to be captured: at rest."""
    return motion.mode == Mode.REST and lane.capture_speed > 0.0
