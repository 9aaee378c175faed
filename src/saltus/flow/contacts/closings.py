"""Contacts that close, one alone or several at one instant, as in cells that move alike.

Contacts whose coordinates neither the mass matrix nor E couples belong to different blocks. They do not act on one another at an
impact, since no impulse of one changes the rate of another's gap, and their impacts are applied one after the other. In a
neighbouring motion these impacts happen at different instants, shifted by t_1 and t_2. Let f be the time derivative of the state
(f_0 before the impacts, f_1 and f_2 after one of them alone, f_12 after both), and R_1, R_2 the derivatives of the impact maps.
At a fixed time the columns x of the tangent then become

    R_2 (R_1 (x + f_0 t_1) + f_1 (t_2 - t_1)) - f_12 t_2,

which is linear in x. It is the derivative if the other order of impacts gives the same result, that is, if

    (R_2 f_1 + R_1 f_2 - R_2 R_1 f_0 - f_12) (t_2 - t_1) = 0.

Otherwise there are only one-sided derivatives. Both orders are therefore tried. With springs between cells, whose forces do not
jump, they agree. With a damper between them they differ: the impact of one mass changes the damper's force on the other mass, and
the other mass's own impact reverses the effect of this force only if it comes later (no difference remains with e = 0, where the
impact leaves no speed). Contacts of one block that close together have a derivative along columns that keep them together.

Accumulations of impacts in several blocks that end at one instant are also treated one after the other. Their order makes no
difference, as no speed is left. At a release nothing jumps, however many contacts open.

Its compiled part goes into one module with that of `kernel.py`, whose docstring defines the arguments.
"""

from __future__ import annotations

import math

import numpy as np

from saltus.flow.contacts.choice import choose_closed
from saltus.flow.contacts.frictions import hold_frictions
from saltus.flow.contacts.impacts import (
    bring_to_rest,
    closed_bits,
    couple,
    fill_after,
    hold_coordinates,
    impact_impulses,
    push,
    record_contact_event,
    settle_contact,
)
from saltus.flow.contacts.layout import APART, ContactColumn, ImpactDetail, Solver
from saltus.flow.contacts.solver_memory import copy_all
from saltus.flow.contacts.tangent import (
    clear_shifts,
    closing_columns,
    fill_slopes,
    hold_columns,
    impulse_columns,
    lift,
    move_columns,
    note_shifts,
    note_velocities,
    rest_columns,
    slope,
)
from saltus.flow.kernel.layout import Status, Where, Work
from saltus.flow.kernel.memory_layout import EventCode, State
from saltus.flow.kernel.steps import expand, forget
from saltus.taylor import jit, lean_jit

# --- compiled from here on -----------------------------------------------------------------------------------------------


@lean_jit
def is_there(where, solver, own, count, place):
    """Whether one of the entries of `NUMBERS`, or its derivative along a column, is not 0."""
    found = solver[Solver.NUMBERS][place] != 0.0
    for j in range(where[Where.COLUMNS]):
        found = found or slope(solver, own, count, j, place) != 0.0
    return found


@jit
def block_of(where, state, env, model, contacts, solver, hit, backwards):
    """The block of the first contact in `hit`, or of the last: the contacts that the mass matrix or E couples with it, as
    bits."""
    own, count = where[Where.OWN], contacts.shape[0]
    joined, start, grows, block = np.zeros(own, np.bool_), 0, True, 0
    couple(where, state, env, model, contacts, solver)
    while hit >> start != 1 if backwards else not hit >> start & 1:
        start += 1
    joined[contacts[start, ContactColumn.COORDINATE]] = True
    if where[Where.COLUMNS] > 0:
        fill_slopes(where, state, env, model, solver)
    while grows:
        grows = False
        for a in range(own):
            for b in range(own):
                if joined[a] and not joined[b] and is_there(where, solver, own, count, own * a + b):
                    joined[b] = grows = True
        for i in range(count):
            for k in range(count):
                a, b = contacts[i, ContactColumn.COORDINATE], contacts[k, ContactColumn.COORDINATE]
                if joined[a] != joined[b] and is_there(where, solver, own, count, own * own + count * i + k):
                    joined[a] = joined[b] = grows = True
    for i in range(count):
        block |= 1 << i if joined[contacts[i, ContactColumn.COORDINATE]] else 0
    return block


@lean_jit
def impact_of(where, state, env, model, contacts, work, solver, t, origin, hit):
    """Apply the impact law to the contacts in `hit` and to those that are closed; an `ImpactDetail`, or -1 if it fails."""
    own, count, detail = where[Where.OWN], contacts.shape[0], int(ImpactDetail.REGULAR)
    regular, chosen = couple(where, state, env, model, contacts, solver), hit
    for i in range(count):
        chosen |= contacts[i, ContactColumn.CLOSED] << i
    if where[Where.COLUMNS] > 0:
        detail = int(closing_columns(where, state, env, model, contacts, work, solver, t, origin, hit))
        note_velocities(where, state, solver, 0.0)
    for i in range(count):  # a contact that is reached without a speed, to within the working precision
        if hit >> i & 1:
            solver[Solver.RATES][i] = min(solver[Solver.RATES][i], 0.0)
        solver[Solver.GAPS][i] = solver[Solver.RATES][i]
    acts = impact_impulses(solver, own, count, chosen, solver[Solver.RATES]) if regular else -1
    if acts < 0:
        return -1
    push(where, state, model, contacts, solver)
    for i in range(count):
        if chosen >> i & 1:
            settle_contact(where, state, model, contacts, solver, i, solver[Solver.RATES][i])
    if where[Where.COLUMNS] > 0 and detail != ImpactDetail.NO_SPEED:
        note_velocities(where, state, solver, -1.0)
        impulse_columns(where, state, env, model, contacts, solver, acts, chosen)
        hold_columns(where, state, contacts, solver, chosen)
    return detail


@lean_jit
def rates_between(where, state, env, model, contacts, frictions, work, solver, t, origin, hit):
    """Fill the accelerations between two impacts in a row, after that of `hit`; returns the closed contacts that open, as
    bits."""
    candidates = closed_bits(contacts)
    if candidates & hit and not choose_closed(
        where, state, env, model, contacts, frictions, work, solver, candidates, 0, t, origin
    ):
        for i in range(contacts.shape[0]):
            contacts[i, ContactColumn.CLOSED] = candidates >> i & 1
    hold_coordinates(where, env, contacts)
    hold_frictions(where, env, frictions)
    expand(where, state, env, model, work, t, origin, 1.0, 0)
    return candidates & ~closed_bits(contacts)


@lean_jit
def undecide(where, state, contacts, opened):
    """Close those contacts in `opened` again that are at rest: which of them stay closed is decided later."""
    for i in range(contacts.shape[0]):
        if opened >> i & 1 and state[State.COORDINATES + where[Where.DOF] + contacts[i, ContactColumn.COORDINATE]] == 0.0:
            contacts[i, ContactColumn.CLOSED] = 1


@lean_jit
def is_apart(one, other):
    """Whether two shifts differ by more than rounding, so that the events are not at one instant in neighbouring motions."""
    return not abs(one - other) <= APART * (abs(one) + abs(other))


@jit
def impacts_in_a_row(where, state, env, model, contacts, frictions, work, solver, t, origin, hit, backwards):
    """The impacts of contacts that close at one instant, block by block; an `ImpactDetail`, or -1 if one of them fails.

    `IMPULSES` then holds the impulses of all, and `EVENT_SHIFTS` the shift of the event, nan for columns along which the blocks'
    instants differ. The columns are those at the last impact, with the accelerations after it.
    """
    total, opened, shifts = np.zeros(contacts.shape[0]), 0, State.COORDINATES + 2 * where[Where.DOF]
    found, begun, together = int(ImpactDetail.REGULAR), False, solver[Solver.EVENT_SHIFTS]
    while hit:
        block = hit & block_of(where, state, env, model, contacts, solver, hit, backwards) if hit & (hit - 1) else hit
        hit &= ~block
        detail = impact_of(where, state, env, model, contacts, work, solver, t, origin, block)
        if detail < 0:
            return -1
        if found != ImpactDetail.NO_SPEED and detail != ImpactDetail.REGULAR:
            found = detail
        for i in range(total.size):
            total[i] += solver[Solver.IMPULSES][i]
        for j in range(where[Where.COLUMNS]):
            shift = state[shifts + j]
            together[j] = math.nan if begun and is_apart(together[j], shift) else shift
        begun = True
        if hit and where[Where.COLUMNS] > 0:
            opened |= rates_between(where, state, env, model, contacts, frictions, work, solver, t, origin, block)
            move_columns(where, state, work, -1.0)
            clear_shifts(where, state)
    undecide(where, state, contacts, opened)
    copy_all(total, solver[Solver.IMPULSES])
    return found


@lean_jit
def compare_orders(where, state, work, other):
    """Set the shifts of columns to nan that, taken back to a fixed time, differ from those of the other order of impacts; returns
    whether there is any such column."""
    own, dof, a, differs = where[Where.OWN], where[Where.DOF], work[Work.ACCELERATIONS], False
    for j in range(where[Where.COLUMNS]):
        u, shift, size, apart = State.COORDINATES + own * (1 + j), state[State.COORDINATES + 2 * dof + j], 0.0, 0.0
        for i in range(own):
            v = state[State.COORDINATES + dof + i]
            size = max(size, abs(state[u + i]), abs(state[u + dof + i]), abs(shift * v), abs(shift * a[i, 0]))
            apart = max(apart, abs(state[u + i] - shift * v - other[u + i]))
            apart = max(apart, abs(state[u + dof + i] - shift * a[i, 0] - other[u + dof + i]))
        if apart > APART * size:
            state[State.COORDINATES + 2 * dof + j], differs = math.nan, True
    return differs


@jit
def impacts_in_any_order(where, state, env, model, contacts, frictions, work, solver, t, origin, hit):
    """As `impacts_in_a_row`, in both orders; columns are nan where the order of the blocks makes a difference."""
    start, rows = state.copy(), contacts.copy()
    impacts_in_a_row(where, state, env, model, contacts, frictions, work, solver, t, origin, hit, True)
    rates_between(where, state, env, model, contacts, frictions, work, solver, t, origin, hit)
    move_columns(where, state, work, -1.0)
    other = state.copy()
    copy_all(start, state)
    for i in range(contacts.shape[0]):
        copy_all(rows[i], contacts[i])
    hold_coordinates(where, env, contacts)
    hold_frictions(where, env, frictions)
    detail = impacts_in_a_row(where, state, env, model, contacts, frictions, work, solver, t, origin, hit, False)
    opened = rates_between(where, state, env, model, contacts, frictions, work, solver, t, origin, hit)
    if compare_orders(where, state, work, other) and detail == ImpactDetail.REGULAR:
        detail = int(ImpactDetail.ORDERED)
    undecide(where, state, contacts, opened)
    return detail


@jit
def contact_impact(where, state, env, model, contacts, frictions, work, solver, events, t, origin, hit):
    """Apply the impact law to all contacts whose gap is 0, of which those in `hit` have just closed. PAUSED, or NO_IMPACT."""
    record_contact_event(where, state, contacts, events, EventCode.IMPACT, hit, t)
    if hit & (hit - 1) and where[Where.COLUMNS] > 0:
        detail = impacts_in_any_order(where, state, env, model, contacts, frictions, work, solver, t, origin, hit)
    else:
        detail = impacts_in_a_row(where, state, env, model, contacts, frictions, work, solver, t, origin, hit, False)
    if detail < 0:
        return Status.NO_IMPACT
    fill_after(where, state, contacts, solver, events)
    if where[Where.COLUMNS] > 0:
        events[0][where[Where.EVENTS] - 1, 3] = detail
        if detail == ImpactDetail.NO_SPEED:
            forget(where, state)
        else:
            note_shifts(where, state, contacts, events, solver[Solver.EVENT_SHIFTS], 0)
    return Status.PAUSED


@jit
def rests_in_a_row(where, state, env, model, contacts, frictions, work, solver, t, origin, near):
    """Bring the contacts in `near`, whose impacts accumulate, to rest: each block at the instant of its own last impact."""
    total, jumped, first = np.zeros(contacts.shape[0]), 0, State.COORDINATES + 2 * where[Where.DOF]
    for i in range(contacts.shape[0]):
        jumped |= 1 << i if near >> i & 1 and solver[Solver.GAPS][i] == 0.0 and solver[Solver.RATES][i] > 0.0 else 0
    several = jumped & (jumped - 1) != 0
    while near:
        block = near & block_of(where, state, env, model, contacts, solver, jumped, False) if jumped & (jumped - 1) else near
        if several and where[Where.COLUMNS] > 0:
            hold_coordinates(where, env, contacts)
            hold_frictions(where, env, frictions)
            expand(where, state, env, model, work, t, origin, 1.0, 0)
            move_columns(where, state, work, -1.0)
            clear_shifts(where, state)
            couple(where, state, env, model, contacts, solver)
            fill_slopes(where, state, env, model, solver)
            for i in range(contacts.shape[0]):
                for j in range(where[Where.COLUMNS] if jumped & block & 1 << i else 0):
                    state[first + j] = -lift(where, state, model, contacts, solver, j, i) / solver[Solver.RATES][i]
            move_columns(where, state, work, 1.0)
        near, jumped = near & ~block, jumped & ~block
        bring_to_rest(where, state, model, contacts, solver, block)
        if where[Where.COLUMNS] > 0:
            rest_columns(where, state, env, model, contacts, solver, block)
        for i in range(total.size):
            total[i] += solver[Solver.IMPULSES][i]
    copy_all(total, solver[Solver.IMPULSES])
