"""Smooth segments of motions with several contacts, from event to event, with their derivatives: the parts of periodic orbits.

The events, their times and the contacts that are closed between them are given. The motion is followed whatever the signs of the
gaps and the reactions; the orbit's equations make each event's guard 0 (see `orbits/equations/contacts.py`). A family of orbits
therefore goes smoothly through the point at which one of its events disappears.

Its compiled part goes into one module with those of the files that it imports from.
"""

from __future__ import annotations

import math

import numpy as np

from saltus.flow.contacts.complementarity import acting
from saltus.flow.contacts.extremes import (
    extremes_at_end,
    extremes_at_section,
    extremes_at_start,
    extremes_at_step,
    gap_beside,
)
from saltus.flow.contacts.impacts import (
    contact_position,
    contact_step_size,
    couple,
    hold_coordinates,
    impact_impulses,
    push,
    restitution,
)
from saltus.flow.contacts.layout import ContactColumn, ContactPart, SegmentEnd, SegmentPlan, Solver
from saltus.flow.contacts.solver_memory import solver_arrays
from saltus.flow.contacts.tangent import fill_slopes, hold_columns, impulse_columns, lift, note_velocities
from saltus.flow.kernel.function_types import CONTACT_SEGMENTS
from saltus.flow.kernel.layout import Where, Work
from saltus.flow.kernel.memory_layout import EventCode, State
from saltus.flow.kernel.steps import expand, move, work_arrays
from saltus.taylor import by_reference, cached_jit, jit, lean_jit

# --- compiled from here on -----------------------------------------------------------------------------------------------

MOST_STEPS = 10_000  # of one segment: only near a singular mass matrix do steps become so short that more would be needed


@lean_jit
def unit_columns(where, state):
    """Set the columns to the derivatives of the present state to itself, the unit matrix, and to the parameters, 0."""
    own, dof = where[Where.OWN], where[Where.DOF]
    for j in range(where[Where.COLUMNS]):
        for i in range(own):
            place = State.COORDINATES + own * (1 + j) + i
            state[place], state[place + dof] = 1.0 if j == i else 0.0, 1.0 if j == own + i else 0.0


@lean_jit
def hold_contacts(where, state, env, model, contacts, solver, closed):
    """Close the contacts in `closed` and no others: their coordinates are put at the contacts' positions, also in the columns."""
    own, count = where[Where.OWN], contacts.shape[0]
    fill_slopes(where, state, env, model, solver)
    for i in range(count):
        contacts[i, ContactColumn.CLOSED] = closed >> i & 1
        if closed >> i & 1:
            place = State.COORDINATES + contacts[i, ContactColumn.COORDINATE]
            state[place], state[place + where[Where.DOF]] = contact_position(solver, own, count, i), 0.0
    hold_columns(where, state, contacts, solver, closed)
    hold_coordinates(where, env, contacts)


@lean_jit
def follow_segment(where, state, settings, env, model, contacts, work, solver, begin, end, roots, seen, least):
    """Follow one segment with the given contacts closed; returns the number of steps, or 0 if it cannot be followed."""
    order, t, forwards = where[Where.ORDER], begin, end >= begin
    for count in range(MOST_STEPS):
        size = expand(where, state, env, model, work, t, 0.0, 1.0, order)
        natural = contact_step_size(where, settings, env, model, contacts, work, t, 0.0, t + abs(end - t), size)
        if not natural > 0.0:
            return 0
        last = natural >= abs(end - t)
        h = end - t if last else (natural if forwards else -natural)
        if seen.size > 1 and h > 0.0:
            extremes_at_step(where, state, model, contacts, work, solver, t, h, begin, end, roots, seen, least)
        move(where, state, work[Work.POSITIONS], work[Work.VELOCITIES], h)
        if last:
            return count + 1
        t += h
    return 0


@lean_jit
def stays_closed(solver, count, acts, after):
    """Whether an impact opens none of the contacts in `after`: it opens a contact without an impulse that is coupled to the
    contacts in `acts`, which have one."""
    for i in range(count):
        if after >> i & 1 and not acts >> i & 1:
            for k in range(count):
                if acts >> k & 1 and solver[Solver.COUPLING][i, k] != 0.0:
                    return False
    return True


@lean_jit
def given_impact(where, state, env, model, contacts, solver, hit, after):
    """Apply the impact of the contact `hit` whatever the sign of its speed; the contacts that act are those of an impact of unit
    speed.

    Returns False if the impact law has no solution, or if the impact opens one of the contacts in `after`, which are to be
    closed.
    """
    own, count, unit = where[Where.OWN], contacts.shape[0], solver[Solver.FALLING_RATES]
    couple(where, state, env, model, contacts, solver)
    chosen = 1 << hit
    for i in range(count):
        chosen |= contacts[i, ContactColumn.CLOSED] << i
        unit[i] = -1.0 if i == hit else 0.0
        solver[Solver.GAPS][i] = solver[Solver.RATES][i]
    acts = impact_impulses(solver, own, count, chosen, unit)
    if acts < 0 or not stays_closed(solver, count, acts, after):
        return False
    note_velocities(where, state, solver, 0.0)
    for i in range(count):
        solver[Solver.RIGHT][i] = solver[Solver.RATES][i]
        for k in range(count):
            if chosen >> k & 1:
                solver[Solver.RIGHT][i] += restitution(solver, own, count, i, k) * solver[Solver.RATES][k]
    acting(solver[Solver.COUPLING], solver[Solver.RIGHT], count, acts, solver[Solver.BLOCK], solver[Solver.IMPULSES])
    push(where, state, model, contacts, solver)
    for i in range(count):
        if acts >> i & 1:
            rate, place = 0.0, State.COORDINATES + where[Where.DOF] + contacts[i, ContactColumn.COORDINATE]
            for k in range(count):
                if chosen >> k & 1:
                    rate -= restitution(solver, own, count, i, k) * solver[Solver.GAPS][k]
            state[place] = model[ContactPart.SIGNS][i] * rate + 0.0
    for a in range(own):  # the jump of the velocities
        solver[Solver.JUMP][a] = state[State.COORDINATES + where[Where.DOF] + a] - solver[Solver.JUMP][a]
    impulse_columns(where, state, env, model, contacts, solver, acts, chosen)
    return True


@lean_jit
def copy_numbers(where, state, work, ends, first):
    """Put the state and its rates into `ends` from `first` on."""
    own, coordinates, velocities = where[Where.OWN], State.COORDINATES, State.COORDINATES + where[Where.DOF]
    for i in range(own):
        ends[first + i], ends[first + own + i] = state[coordinates + i], state[velocities + i]
        ends[first + 2 * own + i] = state[velocities + i]
        ends[first + 3 * own + i] = work[Work.ACCELERATIONS][i, 0]


@lean_jit
def copy_columns(where, state, columns):
    """Put the columns into the rows of an array: coordinates, then velocities."""
    own = where[Where.OWN]
    for j in range(where[Where.COLUMNS]):
        for i in range(own):
            place = State.COORDINATES + own * (1 + j) + i
            columns[i, j], columns[own + i, j] = state[place], state[place + where[Where.DOF]]


@lean_jit
def start_slope(where, ends, slopes):
    """The derivative of a guard to the time of the segment's start, for a fixed state there: minus the derivative along the
    motion."""
    total = 0.0
    for j in range(2 * where[Where.OWN]):
        total -= slopes[j] * ends[SegmentEnd.NUMBERS + 2 * where[Where.OWN] + j]
    return total


@lean_jit
def excursion_guard(where, model, contacts, work, contact, power, h, ends, slopes):
    """The gap at the end of an excursion of one step, divided by a power p of its duration h, and its derivatives.

    A contact that is released where its reaction is 0 opens with h^3, and one that opens from rest after an impact with h^2. The
    series without its first p terms, which are 0, gives a quotient that is regular for all h, also at h = 0, where the excursion
    appears. With the gap's coefficients c_k, their derivatives w_k to the time of the start, and Q = sum c_k h^(k-p):

        dQ/dh = sum (k-p) c_k h^(k-p-1),    dQ/dt_start = sum (w_k + (k+1) c_(k+1)) h^(k-p) - dQ/dh.
    """
    own, sign, coordinate = where[Where.OWN], model[ContactPart.SIGNS][contact], contacts[contact, ContactColumn.COORDINATE]
    q, value, by_length, by_start = work[Work.POSITIONS], 0.0, 0.0, 0.0
    for j in range(where[Where.COLUMNS]):
        slopes[j] = 0.0
    for k in range(where[Where.ORDER], power - 1, -1):
        by_length = by_length * h + value
        value = value * h + sign * q[coordinate, k]
        by_start = by_start * h + (k + 1) * sign * q[coordinate, k + 1]
        for j in range(where[Where.COLUMNS]):
            slopes[j] = slopes[j] * h + sign * q[own * (1 + j) + coordinate, k]
    ends[SegmentEnd.GUARD], ends[SegmentEnd.BY_END] = value, by_length
    ends[SegmentEnd.BY_START] = by_start + start_slope(where, ends, slopes) - by_length


@lean_jit
def divide_guard(where, power, h, ends, slopes):
    """Divide the guard of an excursion of several steps, and its derivatives, as `excursion_guard` does for one step."""
    divisor = h**power
    ends[SegmentEnd.GUARD] /= divisor
    turned = power * ends[SegmentEnd.GUARD] / h
    ends[SegmentEnd.BY_END] = ends[SegmentEnd.BY_END] / divisor - turned
    ends[SegmentEnd.BY_START] = ends[SegmentEnd.BY_START] / divisor + turned
    for j in range(where[Where.COLUMNS]):
        slopes[j] /= divisor


@lean_jit
def guard_at_end(where, state, env, model, contacts, work, solver, t, kind, contact, ends, slopes):
    """The guard of a segment's event, its rate, and its derivatives along the columns."""
    own, count = where[Where.OWN], contacts.shape[0]
    fill_slopes(where, state, env, model, solver)
    if kind == EventCode.RELEASE:
        ends[SegmentEnd.GUARD], ends[SegmentEnd.RATE] = work[Work.MARGINS][contact, 0], work[Work.MARGINS][contact, 1]
        ends[SegmentEnd.BY_END] = ends[SegmentEnd.RATE]
        model[ContactPart.TANGENT](EventCode.RELEASE, contact, t, 0.0, 1.0, env, 0, state)
        for j in range(where[Where.COLUMNS]):
            slopes[j] = state[State.COORDINATES + 2 * where[Where.DOF] + j]
            state[State.COORDINATES + 2 * where[Where.DOF] + j] = 0.0
        return
    sign, place = model[ContactPart.SIGNS][contact], State.COORDINATES + contacts[contact, ContactColumn.COORDINATE]
    ends[SegmentEnd.GUARD] = sign * (state[place] - contact_position(solver, own, count, contact))
    ends[SegmentEnd.BY_END] = ends[SegmentEnd.RATE] = sign * state[place + where[Where.DOF]]
    for j in range(where[Where.COLUMNS]):
        slopes[j] = lift(where, state, model, contacts, solver, j, contact)


@lean_jit
def pass_event(where, state, env, model, contacts, solver, row, ends, maps):
    """Take the state through the event of a row of the plan, with the derivatives of its map; False if the event is
    impossible."""
    own, dof = where[Where.OWN], where[Where.DOF]
    unit_columns(where, state)
    impact = row[SegmentPlan.KIND] == EventCode.IMPACT
    after = row[SegmentPlan.AFTER]
    if impact and not given_impact(where, state, env, model, contacts, solver, row[SegmentPlan.CONTACT], after):
        return False
    hold_contacts(where, state, env, model, contacts, solver, after)
    copy_columns(where, state, maps)
    for a in range(own):
        ends[SegmentEnd.NUMBERS + 8 * own + a] = state[State.COORDINATES + a]
        ends[SegmentEnd.NUMBERS + 9 * own + a] = state[State.COORDINATES + dof + a]
    return True


@jit
def follow_with(
    where, settings, env_of, model_of, contacts, arrays, solver_of, plan, times, first, ends, columns, maps, extremes
):
    """`follow_contact_segments` with the arrays of `Work` and of `Solver`."""
    own, dof = where[Where.OWN], where[Where.DOF]
    env, model, work, solver = by_reference(env_of), by_reference(model_of), by_reference(arrays), by_reference(solver_of)
    roots, nothing, least = np.zeros(where[Where.ORDER] + 2), np.zeros(1), np.zeros(2)
    state = np.zeros(State.COORDINATES + 2 * dof + where[Where.COLUMNS])
    for a in range(own):
        state[State.COORDINATES + a], state[State.COORDINATES + dof + a] = first[a], first[own + a]
    couple(where, state, env, model, contacts, solver)
    for s in range(plan.shape[0]):
        begin, end, kind, contact = times[s], times[s + 1], plan[s, SegmentPlan.KIND], plan[s, SegmentPlan.CONTACT]
        unit_columns(where, state)
        hold_contacts(where, state, env, model, contacts, solver, plan[s, SegmentPlan.ALONG])
        expand(where, state, env, model, work, begin, 0.0, 1.0, 1)
        copy_numbers(where, state, work, ends[s], SegmentEnd.NUMBERS)
        seen = extremes[s] if extremes.shape[0] > 0 else nothing
        if extremes.shape[0] > 0:
            extremes_at_start(where, state, model, contacts, work, solver, plan[s, SegmentPlan.HIT], seen)
            if kind < 0:
                extremes_at_section(where, state, model, contacts, work, solver, begin, seen)
        steps = follow_segment(where, state, settings, env, model, contacts, work, solver, begin, end, roots, seen, least)
        if steps == 0:
            return s
        power = plan[s, SegmentPlan.POWER]
        single = power > 0 and steps == 1
        if single:
            excursion_guard(where, model, contacts, work, contact, power, end - begin, ends[s], columns[s, 2 * own])
        expand(where, state, env, model, work, end, 0.0, 1.0, 1)
        copy_numbers(where, state, work, ends[s], SegmentEnd.NUMBERS + 4 * own)
        copy_columns(where, state, columns[s])
        if not math.isfinite(ends[s, SegmentEnd.NUMBERS + 8 * own - 1]):
            return s
        if extremes.shape[0] > 0:
            extremes_at_end(work, contacts, contact if kind == EventCode.RELEASE else -1, seen)
        if kind >= 0:
            if single:
                velocity = state[State.COORDINATES + dof + contacts[contact, ContactColumn.COORDINATE]]
                ends[s, SegmentEnd.RATE] = model[ContactPart.SIGNS][contact] * velocity
            else:
                guard_at_end(where, state, env, model, contacts, work, solver, end, kind, contact, ends[s], columns[s, 2 * own])
                ends[s, SegmentEnd.BY_START] = start_slope(where, ends[s], columns[s, 2 * own])
                if power > 0:
                    divide_guard(where, power, end - begin, ends[s], columns[s, 2 * own])
            if not pass_event(where, state, env, model, contacts, solver, plan[s], ends[s], maps[s]):
                return s
            if extremes.shape[0] > 0 and kind == EventCode.IMPACT:
                gap_beside(where, model, contacts, solver, plan, s, end - begin, ends[s], seen)
    return plan.shape[0]


@cached_jit(CONTACT_SEGMENTS, nogil=True)
def follow_contact_segments(where, settings, env, model, contacts, plan, times, first, ends, columns, maps, extremes):
    """Follow segments one after the other, each from the state after the event before it; returns how many were followed.

    `plan` describes each segment (`SegmentPlan`), `times` (n + 1) are the times of the segments' ends, and `first` is the state
    at the first of them. Filled are `ends`, in the places of `SegmentEnd`; `columns`, the derivatives of the state at the end, at
    a fixed time, and of the guard, to the state at the start and to the parameters; `maps`, the derivatives of the state after
    the event to the state before it and to the parameters; and, if it has rows, `extremes`, in the places of `SegmentExtremes`.
    """
    solver = solver_arrays(where[Where.OWN], contacts.shape[0], where[Where.COLUMNS], 0)
    arrays = work_arrays(where)
    return follow_with(where, settings, env, model, contacts, arrays, solver, plan, times, first, ends, columns, maps, extremes)
