"""Decisions in the kernel for several contacts: which contacts stay closed, which frictions stick, and where impacts accumulate.

Its compiled part goes into one module with that of `kernel.py`; the words of `motion` are those of `flow/kernel/memory.py`.
"""

from __future__ import annotations

import numpy as np

from saltus.flow.contacts.choice import choose_closed, note_ties
from saltus.flow.contacts.closings import rests_in_a_row
from saltus.flow.contacts.frictions import (
    all_stand,
    hold_frictions,
    record_slides,
    slide_bits,
    slides_before,
    stick_columns,
    undecided,
)
from saltus.flow.contacts.impacts import (
    closed_bits,
    couple,
    fill_after,
    frozen_accumulation,
    hold_coordinates,
    near_contacts,
    record_contact_event,
    slow_impacts,
    smaller_set,
)
from saltus.flow.contacts.layout import TRIED_AGAIN, ContactColumn, FrictionColumn
from saltus.flow.contacts.tangent import (
    accumulation_shifts,
    clear_shifts,
    fill_slopes,
    move_columns,
    note_shifts,
    start_columns,
)
from saltus.flow.kernel.layout import Mode, Status
from saltus.flow.kernel.memory_layout import EventCode
from saltus.flow.kernel.steps import expand, motion_end
from saltus.taylor import lean_jit

# --- compiled from here on -----------------------------------------------------------------------------------------------


@lean_jit
def free_pulls(motion, t):
    """Fill the second derivatives of the gaps with all contacts open; returns 1 plus their largest relative rate of change."""
    own, change = motion.own, 0.0
    first = motion.parameters.size - own
    for i in range(own):
        motion.parameters[first + i] = 1.0
    expand(motion, t, 1.0, 2)
    for i in range(motion.contacts.shape[0]):
        a = motion.acceleration_series[motion.contacts[i, ContactColumn.COORDINATE]]
        motion.pulls[i] = motion.signs[i] * a[0]
        change = max(change, abs(a[1] / a[0]) if a[0] != 0.0 else np.inf)
    return 1.0 + change


@lean_jit
def end_accumulation_of(motion, t):
    """Bring contacts to rest whose impacts accumulate soon; returns the end of the accumulation, or t if there is none."""
    count, tol = motion.contacts.shape[0], motion.tolerance
    if not couple(motion):
        return t
    slowest, last = slow_impacts(tol), -1
    for i in range(count):
        if 0.0 < motion.rates[i] <= slowest and motion.gaps[i] == 0.0:
            slowest, last = motion.rates[i], i
    if last < 0 or motion.contacts[last, ContactColumn.WAITS] > 0:
        if last >= 0:
            motion.contacts[last, ContactColumn.WAITS] -= 1
        return t
    change = free_pulls(motion, t)
    near = near_contacts(motion, slow_impacts(tol))
    if near == 0:
        return t
    limit = min(np.sqrt(10.0 * tol / change), motion_end(motion) - t)
    left, moving = frozen_accumulation(motion, near, limit), 0
    if left < 0.0:
        near = smaller_set(motion, near)
        again = frozen_accumulation(motion, near, limit) if near > 0 else -1.0
        left = again if again >= 0.0 else left + again
    for i in range(count):
        moving |= (1 << i) if near >> i & 1 and motion.rates[i] != 0.0 else 0
    if left < 0.0:
        motion.contacts[last, ContactColumn.WAITS] = int(-left) // TRIED_AGAIN
        return t
    record_contact_event(motion, EventCode.HELD, moving, t + left)
    if motion.columns > 0:
        accumulation_shifts(motion, near, t)
        note_shifts(motion, motion.event_shifts)
    rests_in_a_row(motion, t, near)
    fill_after(motion)
    return t + left


@lean_jit
def event_shifts(motion):
    """Fill `EVENT_SHIFTS` with the shifts in the state, or with those recorded for an impact at this instant, which are nan if
    contacts close at several instants in neighbouring motions."""
    for i in range(motion.contacts.shape[0]):
        if motion.contacts[i, ContactColumn.RELEASED] == 1:
            return  # `release_columns` has filled them
    first, last = 1 + 2 * motion.own + motion.contacts.shape[0], motion.recorded_events - 1
    for j in range(motion.columns):
        motion.event_shifts[j] = motion.shifts[j]
        if last >= 0 and motion.event_labels[last, 1] == EventCode.IMPACT and motion.event_values[last, 0] == motion.time:
            motion.event_shifts[j] = motion.event_values[last, first + j]


@lean_jit
def decide_columns(motion, t):
    """Take the columns from an event back to a fixed time, or from the start on, once it is known which contacts are closed."""
    if motion.columns == 0:
        return
    if motion.leave_by == 1:
        first = motion.parameters.size - motion.own
        for i in range(first, motion.parameters.size):
            motion.parameters[i] = 1.0
        start_columns(motion, t, closed_bits(motion))
        hold_coordinates(motion)
        hold_frictions(motion)
    if motion.frictions.shape[0] > 0:
        fill_slopes(motion)
        stick_columns(motion, motion.contacts.shape[0])
    expand(motion, t, 1.0, 0)
    move_columns(motion, -1.0)
    clear_shifts(motion)


@lean_jit
def decide_contacts(motion):
    """Decide which contacts are closed and which frictions stick from here on. Returns PAUSED to go on, or NOT_UNIQUE."""
    t, count = motion.time, motion.contacts.shape[0]
    rested = motion.rested == 1
    event_shifts(motion)
    settled = end_accumulation_of(motion, t)
    candidates, before = closed_bits(motion), slides_before(motion)
    couple(motion)
    still = undecided(motion)
    if (candidates or still) and not choose_closed(motion, candidates, still, t):
        note_ties(motion, candidates, t)
        if not choose_closed(motion, candidates, still, t):
            return Status.NOT_UNIQUE
    hold_coordinates(motion)
    hold_frictions(motion)
    opened = candidates & ~closed_bits(motion)
    if opened and motion.leave_by == 0:
        record_contact_event(motion, EventCode.RELEASE, opened, t)
        if opened & (opened - 1):
            note_shifts(motion, motion.event_shifts)
        else:
            note_shifts(motion, motion.shifts)
    if motion.leave_by == 0:
        record_slides(motion, before, t)
    decide_columns(motion, t)
    motion.leave_by = 0
    motion.rested = 1 if all_stand(motion) else 0
    for i in range(count):
        motion.contacts[i, ContactColumn.RELEASED] = 0
    for k in range(motion.frictions.shape[0]):
        motion.frictions[k, FrictionColumn.REACHED] = 0
    if motion.rested == 1 and not rested:
        all_bits = closed_bits(motion) | ((1 << motion.frictions.shape[0]) - 1) << count
        record_contact_event(motion, EventCode.REST, all_bits, settled)
        note_shifts(motion, motion.event_shifts)
    motion.mode = Mode.REST if motion.rested == 1 else Mode.ARC
    motion.side = 1 + (closed_bits(motion) | slide_bits(motion, count))
    return Status.PAUSED
