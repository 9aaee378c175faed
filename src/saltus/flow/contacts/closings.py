"""Contacts that close: one, or several at one instant, as those of cells that move alike.

Contacts of different blocks of the mass matrix, which E does not connect either, do not act on one another at an impact: no
impulse of one changes the rate of another's gap. They are taken one after the other. Beside the motion their instants differ, by
t_1 and t_2; with the rates f of the state, f_1 those after the first impact alone, and the derivatives R of the impacts, the
columns x then become

    R_2 (R_1 (x + f_0 t_1) + f_1 (t_2 - t_1)) - f_12 t_2

at a fixed time, which is linear in x. It is the derivative if the other order gives the same, so if

    (R_2 f_1 + R_1 f_2 - R_2 R_1 f_0 - f_12) (t_2 - t_1) = 0,

and else only that from one side. Both orders are tried. Springs between cells, whose forces do not jump, pass; a damper between
them does not: what it gives to a mass in between, after the impact of the other one, is turned round by its own impact, or is
not. (It passes where that leaves no speed, with e = 0.) Contacts of one block that close together have a derivative to what
keeps them together.

Impacts that die away in several blocks at one instant end in a row likewise. Their order makes no difference, as they leave no
speed. Nothing jumps at a release, of however many contacts.

Its compiled part goes into one module with that of `contacts_kernel.py`, whose docstring defines the arguments.
"""

from __future__ import annotations

import math

import numpy as np

from saltus.flow.contacts.contact_choice import choose_closed
from saltus.flow.contacts.contact_impacts import (
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
from saltus.flow.contacts.contact_layout import APART, ContactColumn, ImpactDetail, Solver
from saltus.flow.contacts.contact_tangent import (
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
from saltus.flow.contacts.frictions import hold_frictions
from saltus.flow.contacts.solver_memory import copy_all
from saltus.flow.kernel_layout import Status, Where, Work
from saltus.flow.memory_layout import EventCode, State
from saltus.flow.steps import expand, forget
from saltus.taylor import jit, lean_jit

# --- compiled from here on -----------------------------------------------------------------------------------------------


@lean_jit
def is_there(where, solver, own, count, place):
    """Whether one of the numbers of the contacts, or its derivative along a column, is not 0."""
    found = solver[Solver.NUMBERS][place] != 0.0
    for j in range(where[Where.COLUMNS]):
        found = found or slope(solver, own, count, j, place) != 0.0
    return found


@jit
def block_of(where, state, env, model, contacts, solver, hit, backwards):
    """The contacts that mass matrix or E connect with the first of those in `hit`, or with the last, as bits."""
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
    """Apply the impact law to all contacts whose gap is 0 but those that close later; an `ImpactDetail`, or -1 if it fails."""
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
    """Fill the accelerations after some of the impacts, of `hit` the last; returns the closed contacts that open, as bits."""
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
    """Close the contacts in `opened` again that are at rest, for it is decided later which of them stay closed."""
    for i in range(contacts.shape[0]):
        if opened >> i & 1 and state[State.COORDINATES + where[Where.DOF] + contacts[i, ContactColumn.COORDINATE]] == 0.0:
            contacts[i, ContactColumn.CLOSED] = 1


@lean_jit
def is_apart(one, other):
    """Whether two shifts are not of one instant."""
    return not abs(one - other) <= APART * (abs(one) + abs(other))


@jit
def impacts_in_a_row(where, state, env, model, contacts, frictions, work, solver, t, origin, hit, backwards):
    """The impacts of contacts that close at one instant, block by block; an `ImpactDetail`, or -1 if one of them fails.

    Their impulses are then in `IMPULSES`, and the shift of the event in `EVENT_SHIFTS`, nan where the blocks' instants differ.
    The columns are those of the last one, with the accelerations after it.
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
    """Set those columns to nan that, taken back to a fixed time, are not those of the other order; returns whether any is."""
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
    """The same, with columns that are nan where the order of the blocks makes a difference."""
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
    """Bring the contacts in `near` to rest, whose impacts die away; those of each block at the instant of its own last impact."""
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
