"""The loop of both scalar kernels: steps, forcing periods, and the reasons to return.

Its compiled part goes into one module with that of `one_contact/kernel.py`, or with that of
`contacts/kernel.py`, which has functions of the same names.
"""

from __future__ import annotations

from saltus.flow.kernel.layout import BATCH, Status
from saltus.flow.kernel.memory import ADVANCE, MotionMemory
from saltus.flow.kernel.steps import next_target, state_arrays
from saltus.flow.one_contact.kernel import (
    at_corner,
    begin,
    is_smooth,
    one_pass,
    parts_of,
    settle,
    spare_events,
    waits,
)
from saltus.taylor import by_reference, cached_jit, lean_jit

# --- compiled from here on ---------------------------------------------------


@lean_jit
def advance_batch(motion):
    """Advance a motion by a batch of steps at most; returns why it stops."""
    for batch in range(BATCH):
        if motion.until_smooth > 0 and batch > 0 and is_smooth(motion):
            return Status.SMOOTH
        full = motion.recorded_steps >= motion.step_spans.shape[0] - 4
        if full or motion.recorded_events >= motion.event_values.shape[0] - spare_events(motion):
            return Status.FULL
        motion.origin = motion.period * motion.period_length
        last = motion.period == motion.last_period
        t_end = motion.end if last else motion.period_length
        if motion.time >= t_end and not (last and waits(motion)):
            if last:
                return Status.DONE
            motion.period += 1
            motion.time -= t_end
            if motion.repeats > 0:
                motion.piece = 0
            continue
        target = next_target(motion, t_end)
        if motion.corner_column > 0 and motion.new_piece > 0:
            at_corner(motion)
        status = one_pass(motion, target, t_end)
        if status != Status.PAUSED:
            return status
    return Status.PAUSED


@lean_jit
def advance_with(numbers, parts):
    """`advance` with the parts of its memory in one named tuple."""
    motion = by_reference(MotionMemory(numbers, parts))
    begin(motion)
    status = advance_batch(motion)
    settle(motion)
    return status


@cached_jit(ADVANCE)
def advance(numbers, state, env, functions, rows, buffers):
    """Advance a motion until it ends, a buffer is full, or a batch of steps is done; returns the
    reason.

    All of the motion's state is in `numbers`, a record MOTION, in `state`, and in the `rows` of
    contacts and frictions. So a call goes on where the last one stopped. `env` = (parameters,
    constants, record breakpoints, record table); `buffers` are those of steps and of events.
    """
    record = numbers[0]
    parts = parts_of(record, state_arrays(record, state), env, functions, rows, buffers)
    return advance_with(record, parts)
