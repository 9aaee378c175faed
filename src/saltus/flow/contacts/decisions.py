"""Decisions in the kernel for several contacts: which contacts stay closed, which frictions stick, and where impacts accumulate.

Its compiled part goes into one module with that of `kernel.py`, whose docstring defines the arguments.
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
from saltus.flow.contacts.layout import TRIED_AGAIN, ContactColumn, ContactPart, FrictionColumn, Solver
from saltus.flow.contacts.tangent import (
    accumulation_shifts,
    clear_shifts,
    fill_slopes,
    move_columns,
    note_shifts,
    start_columns,
)
from saltus.flow.kernel.layout import Mode, Setting, Status, Where, Work
from saltus.flow.kernel.memory_layout import EventCode, State
from saltus.flow.kernel.steps import expand, motion_end
from saltus.taylor import lean_jit

# --- compiled from here on -----------------------------------------------------------------------------------------------


@lean_jit
def free_pulls(where, state, env, model, contacts, work, solver, t, origin):
    """Fill the second derivatives of the gaps with all contacts open; returns 1 plus their largest relative rate of change."""
    own, change = where[Where.OWN], 0.0
    first = env[0].size - own
    for i in range(own):
        env[0][first + i] = 1.0
    expand(where, state, env, model, work, t, origin, 1.0, 2)
    for i in range(contacts.shape[0]):
        a = work[Work.ACCELERATIONS][contacts[i, ContactColumn.COORDINATE]]
        solver[Solver.PULLS][i] = model[ContactPart.SIGNS][i] * a[0]
        change = max(change, abs(a[1] / a[0]) if a[0] != 0.0 else np.inf)
    return 1.0 + change


@lean_jit
def end_accumulation_of(where, state, settings, env, model, contacts, frictions, work, solver, events, t, origin):
    """Bring contacts to rest whose impacts accumulate soon; returns the end of the accumulation, or t if there is none."""
    count, own, tol = contacts.shape[0], where[Where.OWN], settings[Setting.TOLERANCE]
    if not couple(where, state, env, model, contacts, solver):
        return t
    slowest, last = slow_impacts(tol), -1
    for i in range(count):
        if 0.0 < solver[Solver.RATES][i] <= slowest and solver[Solver.GAPS][i] == 0.0:
            slowest, last = solver[Solver.RATES][i], i
    if last < 0 or contacts[last, ContactColumn.WAITS] > 0:
        if last >= 0:
            contacts[last, ContactColumn.WAITS] -= 1
        return t
    change = free_pulls(where, state, env, model, contacts, work, solver, t, origin)
    near = near_contacts(solver, count, slow_impacts(tol))
    if near == 0:
        return t
    limit = min(np.sqrt(10.0 * tol / change), motion_end(where, settings) - t)
    left, moving = frozen_accumulation(solver, own, count, near, limit), 0
    if left < 0.0:
        near = smaller_set(solver, contacts, near)
        again = frozen_accumulation(solver, own, count, near, limit) if near > 0 else -1.0
        left = again if again >= 0.0 else left + again
    for i in range(count):
        moving |= (1 << i) if near >> i & 1 and solver[Solver.RATES][i] != 0.0 else 0
    if left < 0.0:
        contacts[last, ContactColumn.WAITS] = int(-left) // TRIED_AGAIN
        return t
    record_contact_event(where, state, contacts, events, EventCode.HELD, moving, t + left)
    if where[Where.COLUMNS] > 0:
        accumulation_shifts(where, state, env, model, contacts, work, solver, near, t, origin)
        note_shifts(where, state, contacts, events, solver[Solver.EVENT_SHIFTS], 0)
    rests_in_a_row(where, state, env, model, contacts, frictions, work, solver, t, origin, near)
    fill_after(where, state, contacts, solver, events)
    return t + left


@lean_jit
def event_shifts(where, state, contacts, events, solver):
    """Fill `EVENT_SHIFTS` with the shifts in the state, or with those recorded for an impact at this instant, which are nan if
    contacts close at several instants in neighbouring motions."""
    for i in range(contacts.shape[0]):
        if contacts[i, ContactColumn.RELEASED] == 1:
            return  # `release_columns` has filled them
    first, last = 1 + 2 * where[Where.OWN] + contacts.shape[0], where[Where.EVENTS] - 1
    for j in range(where[Where.COLUMNS]):
        solver[Solver.EVENT_SHIFTS][j] = state[State.COORDINATES + 2 * where[Where.DOF] + j]
        if last >= 0 and events[0][last, 1] == EventCode.IMPACT and events[1][last, 0] == state[State.TIME]:
            solver[Solver.EVENT_SHIFTS][j] = events[1][last, first + j]


@lean_jit
def decide_columns(where, state, env, model, contacts, frictions, work, solver, t, origin):
    """Take the columns from an event back to a fixed time, or from the start on, once it is known which contacts are closed."""
    if where[Where.COLUMNS] == 0:
        return
    if where[Where.LEAVE_BY] == 1:
        first = env[0].size - where[Where.OWN]
        for i in range(first, env[0].size):
            env[0][i] = 1.0
        start_columns(where, state, env, model, contacts, work, solver, t, origin, closed_bits(contacts))
        hold_coordinates(where, env, contacts)
        hold_frictions(where, env, frictions)
    if frictions.shape[0] > 0:
        fill_slopes(where, state, env, model, solver)
        stick_columns(where, state, solver, frictions, contacts.shape[0])
    expand(where, state, env, model, work, t, origin, 1.0, 0)
    move_columns(where, state, work, -1.0)
    clear_shifts(where, state)


@lean_jit
def decide_contacts(where, state, settings, env, model, contacts, frictions, work, solver, events, origin):
    """Decide which contacts are closed and which frictions stick from here on. Returns PAUSED to go on, or NOT_UNIQUE."""
    t, count = state[State.TIME], contacts.shape[0]
    rested, shifts = where[Where.HELD] == 1, State.COORDINATES + 2 * where[Where.DOF]
    event_shifts(where, state, contacts, events, solver)
    settled = end_accumulation_of(where, state, settings, env, model, contacts, frictions, work, solver, events, t, origin)
    candidates, before = closed_bits(contacts), slides_before(frictions)
    couple(where, state, env, model, contacts, solver)
    still = undecided(where, state, solver, frictions)
    if (candidates or still) and not choose_closed(
        where, state, env, model, contacts, frictions, work, solver, candidates, still, t, origin
    ):
        note_ties(where, state, env, model, contacts, work, candidates, t, origin)
        if not choose_closed(where, state, env, model, contacts, frictions, work, solver, candidates, still, t, origin):
            return Status.NOT_UNIQUE
    hold_coordinates(where, env, contacts)
    hold_frictions(where, env, frictions)
    opened = candidates & ~closed_bits(contacts)
    if opened and where[Where.LEAVE_BY] == 0:
        record_contact_event(where, state, contacts, events, EventCode.RELEASE, opened, t)
        if opened & (opened - 1):
            note_shifts(where, state, contacts, events, solver[Solver.EVENT_SHIFTS], 0)
        else:
            note_shifts(where, state, contacts, events, state, shifts)
    if where[Where.LEAVE_BY] == 0:
        record_slides(where, state, contacts, frictions, events, before, t, shifts)
    decide_columns(where, state, env, model, contacts, frictions, work, solver, t, origin)
    where[Where.LEAVE_BY] = 0
    where[Where.HELD] = 1 if all_stand(where, env, solver, frictions) else 0
    for i in range(count):
        contacts[i, ContactColumn.RELEASED] = 0
    for k in range(frictions.shape[0]):
        frictions[k, FrictionColumn.REACHED] = 0
    if where[Where.HELD] == 1 and not rested:
        all_bits = closed_bits(contacts) | ((1 << frictions.shape[0]) - 1) << count
        record_contact_event(where, state, contacts, events, EventCode.RESTING, all_bits, settled)
        note_shifts(where, state, contacts, events, solver[Solver.EVENT_SHIFTS], 0)
    where[Where.MODE] = Mode.REST if where[Where.HELD] == 1 else Mode.ARC
    where[Where.SIDE] = 1 + (closed_bits(contacts) | slide_bits(frictions, count))
    return Status.PAUSED
