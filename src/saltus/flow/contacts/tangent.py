"""The saltation of the tangent's columns at the events of several contacts (see `taylor/derivatives.py`).

An event's instant depends on the parameter c of a column. The columns (u, z) of coordinates and velocities are first taken to the
derivatives of the state *at the event*, u + v dt and z + a dt, where dt is the shift of the event and a the acceleration before
it. The event's map is differentiated there, with the contacts that act. Once it is known which contacts are closed afterwards,
the columns are taken back to a fixed time with the velocity and acceleration after the event. Nothing jumps at a simple release,
so that its saltation is the identity.

Its compiled part goes into one module with that of `kernel.py`, whose docstring defines `contacts`, `model`, `solver`.
"""

from __future__ import annotations

import math

import numpy as np

from saltus.flow.contacts.complementarity import acting, invert
from saltus.flow.contacts.impacts import frozen_accumulation, restitution
from saltus.flow.contacts.layout import APART, RELATIVE_STEP, TIED, ContactColumn, ContactPart, ImpactDetail, Solver
from saltus.flow.contacts.solver_memory import copy_all
from saltus.flow.kernel.layout import Where, Work
from saltus.flow.kernel.memory_layout import EventCode, State
from saltus.flow.kernel.steps import expand
from saltus.taylor import jit, lean_jit

# --- compiled from here on -----------------------------------------------------------------------------------------------


@lean_jit
def move_columns(where, state, work, sign):
    """Take the columns to the event, whose instant moves (sign +1), or back from it to a fixed time (-1): u + v dt, z + a dt."""
    own, dof, a = where[Where.OWN], where[Where.DOF], work[Work.ACCELERATIONS]
    for j in range(where[Where.COLUMNS]):
        shift = sign * state[State.COORDINATES + 2 * dof + j]
        for i in range(own):
            place = State.COORDINATES + own * (1 + j) + i
            if shift != 0.0:
                state[place] += shift * state[State.COORDINATES + dof + i]
                state[place + dof] += shift * a[i, 0]


@lean_jit
def clear_shifts(where, state):
    """Set the shifts of the event to 0, after the columns have been taken back from it."""
    for j in range(where[Where.COLUMNS]):
        state[State.COORDINATES + 2 * where[Where.DOF] + j] = 0.0


@lean_jit
def fill_slopes(where, state, env, model, solver):
    """The derivatives of mass matrix, E and positions along each column."""
    model[ContactPart.SLOPES](env, where[Where.PIECE], state, solver[Solver.SLOPES])


@lean_jit
def slope(solver, own, count, j, place):
    """The derivative of one of the entries of `NUMBERS` along column j."""
    return solver[Solver.SLOPES][j * solver[Solver.NUMBERS].size + place]


@lean_jit
def lift(where, state, model, contacts, solver, j, i):
    """The derivative of a contact's gap along column j."""
    own, count, coordinate = where[Where.OWN], contacts.shape[0], contacts[i, ContactColumn.COORDINATE]
    moved = slope(solver, own, count, j, own * own + count * count + i)
    return model[ContactPart.SIGNS][i] * (state[State.COORDINATES + own * (1 + j) + coordinate] - moved)


@lean_jit
def lift_rate(where, state, model, contacts, j, i):
    """The derivative of the rate of a contact's gap along column j."""
    own, coordinate = where[Where.OWN], contacts[i, ContactColumn.COORDINATE]
    return model[ContactPart.SIGNS][i] * state[State.COORDINATES + where[Where.DOF] + own * (1 + j) + coordinate]


@lean_jit
def hold_columns(where, state, contacts, solver, chosen):
    """Set the columns of coordinates at the contacts in `chosen`: they move with the contact's position and, if it is closed,
    have no velocity."""
    own, count, dof = where[Where.OWN], contacts.shape[0], where[Where.DOF]
    for j in range(where[Where.COLUMNS]):
        for i in range(count):
            if chosen >> i & 1:
                place = State.COORDINATES + own * (1 + j) + contacts[i, ContactColumn.COORDINATE]
                state[place] = slope(solver, own, count, j, own * own + count * count + i)
                if contacts[i, ContactColumn.CLOSED] == 1:
                    state[place + dof] = 0.0


@lean_jit
def release_shifts(where, state, env, model, work, t, origin, i):
    """The shifts of the instant at which a reaction reaches 0, from the reaction's series."""
    model[ContactPart.TANGENT](EventCode.RELEASE, i, t, origin, 1.0, env, where[Where.PIECE], state)
    for j in range(where[Where.COLUMNS]):
        state[State.COORDINATES + 2 * where[Where.DOF] + j] /= -work[Work.MARGINS][i, 1]


@lean_jit
def release_columns(where, state, env, model, contacts, work, solver, t, origin, released):
    """Take the columns to the instant at which a reaction reaches 0.

    `EVENT_SHIFTS` are the shifts of this instant, nan where another reaction reaches 0 at the same instant with another shift.
    """
    first, shifts = State.COORDINATES + 2 * where[Where.DOF], solver[Solver.EVENT_SHIFTS]
    expand(where, state, env, model, work, t, origin, 1.0, 1)
    release_shifts(where, state, env, model, work, t, origin, released)
    for j in range(where[Where.COLUMNS]):
        shifts[j] = state[first + j]
    for i in range(contacts.shape[0]):
        if i != released and contacts[i, ContactColumn.CLOSED] == 1 and abs(work[Work.MARGINS][i, 0]) <= TIED:
            release_shifts(where, state, env, model, work, t, origin, i)
            for j in range(where[Where.COLUMNS]):
                if abs(state[first + j] - shifts[j]) > APART * (abs(state[first + j]) + abs(shifts[j])):
                    shifts[j] = math.nan
    release_shifts(where, state, env, model, work, t, origin, released)
    move_columns(where, state, work, 1.0)


@lean_jit
def closing_columns(where, state, env, model, contacts, work, solver, t, origin, hit):
    """Take the columns to the instant at which the contacts in `hit` close; returns an `ImpactDetail`."""
    detail, first = ImpactDetail.REGULAR, State.COORDINATES + 2 * where[Where.DOF]
    expand(where, state, env, model, work, t, origin, 1.0, 0)
    fill_slopes(where, state, env, model, solver)
    for j in range(where[Where.COLUMNS]):
        known = False
        for i in range(contacts.shape[0]):
            if not hit >> i & 1:
                continue
            rate = solver[Solver.RATES][i]
            if rate >= 0.0:
                return ImpactDetail.NO_SPEED
            shift = -lift(where, state, model, contacts, solver, j, i) / rate
            if known and abs(shift - state[first + j]) > APART * (abs(shift) + abs(state[first + j])):
                shift, detail = math.nan, ImpactDetail.APART
            state[first + j], known = shift, True
    move_columns(where, state, work, 1.0)
    return detail


@jit
def impulse_columns(where, state, env, model, contacts, solver, acts, chosen):
    """Differentiate an impact at which the contacts in `acts` have impulses and those in `chosen` enter its law.

    M w = S J with the jump w of the velocities; the rates of the acting gaps after it are -E v-, or 0 if `chosen` is empty:

        M dw + dM w = S dJ,    (dw)_i = -dv_i - sum_j (E_ij dv_j + dE_ij v_j)  of the acting contacts, along their signs.

    `solver` holds the coupling, the inverse of M, the rates before the impact (in `GAPS`) and w (in `JUMP`).
    """
    own, count, signs, dof = where[Where.OWN], contacts.shape[0], model[ContactPart.SIGNS], where[Where.DOF]
    inverse, twist, right = solver[Solver.INVERSE], np.zeros(own), solver[Solver.RIGHT]
    fill_slopes(where, state, env, model, solver)
    for j in range(where[Where.COLUMNS]):
        for a in range(own):  # M^-1 dM w
            twist[a] = 0.0
            for b in range(own):
                for c in range(own):
                    twist[a] += inverse[a, b] * slope(solver, own, count, j, own * b + c) * solver[Solver.JUMP][c]
        for i in range(count):
            right[i] = lift_rate(where, state, model, contacts, j, i) - signs[i] * twist[contacts[i, ContactColumn.COORDINATE]]
            for k in range(count):
                if chosen >> k & 1:
                    right[i] += restitution(solver, own, count, i, k) * lift_rate(where, state, model, contacts, j, k)
                    right[i] += slope(solver, own, count, j, own * own + count * i + k) * solver[Solver.GAPS][k]
        acting(solver[Solver.COUPLING], right, count, acts, solver[Solver.BLOCK], solver[Solver.TRIED])
        for a in range(own):
            place = State.COORDINATES + dof + own * (1 + j) + a
            state[place] -= twist[a]
            for i in range(count):
                state[place] += inverse[a, contacts[i, ContactColumn.COORDINATE]] * signs[i] * solver[Solver.TRIED][i]


@lean_jit
def note_velocities(where, state, solver, before):
    """Put the velocities plus `before` times the present `JUMP` into `JUMP`: with 0 the velocities before an impact, then, with
    -1, their jump."""
    for a in range(where[Where.OWN]):
        velocity = state[State.COORDINATES + where[Where.DOF] + a]
        solver[Solver.JUMP][a] = velocity if before == 0.0 else velocity + before * solver[Solver.JUMP][a]


@lean_jit
def note_shifts(where, state, contacts, events, shifts, first):
    """Record with the last event its shift along each column, which are the numbers of `shifts` from `first` on."""
    for j in range(where[Where.COLUMNS]):
        events[1][where[Where.EVENTS] - 1, 1 + 2 * where[Where.OWN] + contacts.shape[0] + j] = shifts[first + j]


@lean_jit
def pull_slopes(where, state, env, model, contacts, work, solver, t, origin):
    """Fill `PULL_SLOPES`, the derivatives of the gaps' second derivatives with all contacts open, at an event.

    All coordinates must be free, and the columns must have been taken to the event.
    """
    own, a, first = where[Where.OWN], work[Work.ACCELERATIONS], State.COORDINATES + 2 * where[Where.DOF]
    expand(where, state, env, model, work, t, origin, 1.0, 0)
    move_columns(where, state, work, -1.0)
    expand(where, state, env, model, work, t, origin, 1.0, 2)
    for j in range(where[Where.COLUMNS]):
        for i in range(contacts.shape[0]):
            coordinate = contacts[i, ContactColumn.COORDINATE]
            change = a[own * (1 + j) + coordinate, 0] + state[first + j] * a[coordinate, 1]
            solver[Solver.PULL_SLOPES][j, i] = model[ContactPart.SIGNS][i] * change
    move_columns(where, state, work, 1.0)


@lean_jit
def perturb(where, state, model, contacts, solver, j, step):
    """Move all quantities on which the duration of an accumulation depends by a step along column j; gaps and rates that are 0
    stay 0."""
    own, count, signs = where[Where.OWN], contacts.shape[0], model[ContactPart.SIGNS]
    numbers = solver[Solver.NUMBERS]
    for i in range(count):
        if solver[Solver.GAPS][i] != 0.0:
            solver[Solver.GAPS][i] += step * lift(where, state, model, contacts, solver, j, i)
        if solver[Solver.RATES][i] != 0.0:
            solver[Solver.RATES][i] += step * lift_rate(where, state, model, contacts, j, i)
        solver[Solver.PULLS][i] += step * solver[Solver.PULL_SLOPES][j, i]
    for k in range(own * own + count * count):
        numbers[k] += step * slope(solver, own, count, j, k)
    invert(numbers, own, solver[Solver.BLOCK], solver[Solver.INVERSE])
    for i in range(count):
        for k in range(count):
            entry = solver[Solver.INVERSE][contacts[i, ContactColumn.COORDINATE], contacts[k, ContactColumn.COORDINATE]]
            solver[Solver.COUPLING][i, k] = signs[i] * signs[k] * entry


@jit
def accumulation_shifts(where, state, env, model, contacts, work, solver, near, t, origin):
    """Add to `EVENT_SHIFTS`, which hold the shifts of the last impact, those of the time left until the accumulation ends:
    central differences of this time over the gaps, rates, accelerations and numbers."""
    own, count = where[Where.OWN], contacts.shape[0]
    fill_slopes(where, state, env, model, solver)
    pull_slopes(where, state, env, model, contacts, work, solver, t, origin)
    gaps, rates, pulls = solver[Solver.GAPS].copy(), solver[Solver.RATES].copy(), solver[Solver.PULLS].copy()
    numbers = solver[Solver.NUMBERS].copy()
    for j in range(where[Where.COLUMNS]):
        largest = 0.0  # the largest relative change along the column
        for i in range(count):
            if near >> i & 1:
                largest = max(largest, abs(solver[Solver.PULL_SLOPES][j, i] / pulls[i]))
                if rates[i] != 0.0:
                    largest = max(largest, abs(lift_rate(where, state, model, contacts, j, i) / rates[i]))
                if gaps[i] != 0.0:
                    largest = max(largest, abs(lift(where, state, model, contacts, solver, j, i) / gaps[i]))
        for k in range(own * own + count * count):
            largest = max(largest, abs(slope(solver, own, count, j, k)))
        change, step = 0.0, RELATIVE_STEP / max(largest, 1e-300)
        for sign in (1.0, -1.0):
            perturb(where, state, model, contacts, solver, j, sign * step)
            left = frozen_accumulation(solver, own, count, near, np.inf)
            change += sign * (left if left >= 0.0 else math.nan)
            copy_all(gaps, solver[Solver.GAPS])
            copy_all(rates, solver[Solver.RATES])
            copy_all(pulls, solver[Solver.PULLS])
            copy_all(numbers, solver[Solver.NUMBERS])
        solver[Solver.EVENT_SHIFTS][j] += 0.5 * change / step if largest > 0.0 else 0.0
    perturb(where, state, model, contacts, solver, 0, 0.0)


@lean_jit
def rest_columns(where, state, env, model, contacts, solver, near):
    """The columns at the end of an accumulation, where impulses on the contacts in `near` alone take their speeds."""
    own = where[Where.OWN]
    for a in range(own):
        solver[Solver.JUMP][a] = 0.0
        for i in range(contacts.shape[0]):
            gain = solver[Solver.INVERSE][a, contacts[i, ContactColumn.COORDINATE]] * model[ContactPart.SIGNS][i]
            solver[Solver.JUMP][a] += gain * solver[Solver.IMPULSES][i]
    impulse_columns(where, state, env, model, contacts, solver, near, 0)
    hold_columns(where, state, contacts, solver, near)


@lean_jit
def project(where, state, model, contacts, solver, closed, first, right):
    """Add M^-1 S z to the `own` numbers of the state from `first` on, with the z for which the gaps in `closed` change by
    -`right`."""
    own, count, signs = where[Where.OWN], contacts.shape[0], model[ContactPart.SIGNS]
    acting(solver[Solver.COUPLING], right, count, closed, solver[Solver.BLOCK], solver[Solver.TRIED])
    for a in range(own):
        for i in range(count):
            gain = solver[Solver.INVERSE][a, contacts[i, ContactColumn.COORDINATE]] * signs[i]
            state[first + a] += gain * solver[Solver.TRIED][i]


@jit
def fall_back(where, state, env, model, contacts, work, solver, t, origin, closed, j):
    """Column j for a start at closed contacts, see `start_columns`."""
    own, count, dof, right = where[Where.OWN], contacts.shape[0], where[Where.DOF], solver[Solver.RIGHT]
    u = State.COORDINATES + own * (1 + j)
    z, given = u + dof, state[u : u + own].copy()
    rates = state[z : z + own].copy()
    for i in range(count):
        right[i] = lift(where, state, model, contacts, solver, j, i)
    project(where, state, model, contacts, solver, closed, u, right)
    after, lost = state[u : u + own].copy(), np.zeros(own)
    fallen = given - after  # K h
    for sign in (0.5, -0.5):  # the odd parts of a_v K h and M' K h, without the effect of parameters
        for a in range(own):
            state[u + a], state[z + a] = 0.0, math.copysign(1.0, sign) * fallen[a]
        expand(where, state, env, model, work, t, origin, 1.0, 0)
        for a in range(own):
            lost[a] += sign * work[Work.ACCELERATIONS][own * (1 + j) + a, 0]
            state[u + a] = math.copysign(1.0, sign) * state[State.COORDINATES + dof + a]
        fill_slopes(where, state, env, model, solver)
        for a in range(own):
            for b in range(own):
                for c in range(own):
                    lost[a] += sign * solver[Solver.INVERSE][a, b] * slope(solver, own, count, j, own * b + c) * fallen[c]
    for a in range(own):
        state[u + a], state[z + a] = after[a], rates[a] - lost[a]
    for i in range(count):
        right[i] = lift_rate(where, state, model, contacts, j, i)
    project(where, state, model, contacts, solver, closed, z, right)
    fill_slopes(where, state, env, model, solver)


@lean_jit
def start_columns(where, state, env, model, contacts, work, solver, t, origin, closed):
    """The one-sided derivatives of a motion that starts with contacts closed, to the side on which their gaps open.

    A small gap h closes, and its bounces end, within a time of the order of sqrt(h). The impulses of these contacts do not change
    the velocities y = (1 - K S') v with K = M^-1 S (S' M^-1 S)^-1, so that to first order in h

        u+ = u - K h,    z+ = (1 - K S') (z - a_v K h) + K' h,

    where K' is the time derivative of K. Where impacts lose nothing the bounces never end, and there is no derivative.
    """
    own, count, dof = where[Where.OWN], contacts.shape[0], where[Where.DOF]
    fill_slopes(where, state, env, model, solver)
    for j in range(where[Where.COLUMNS]):
        lifted, lossless = 0.0, False
        for i in range(count):
            if closed >> i & 1:
                opened = abs(lift(where, state, model, contacts, solver, j, i))
                size = max(opened, abs(lift_rate(where, state, model, contacts, j, i)))
                lifted = max(lifted, size)
                lossless = lossless or (size > 0.0 and restitution(solver, own, count, i, i) >= 1.0)
        if lifted == 0.0:
            continue
        place = State.COORDINATES + own * (1 + j)
        if lossless:
            for a in range(own):
                state[place + a] = state[place + dof + a] = math.nan
            continue
        fall_back(where, state, env, model, contacts, work, solver, t, origin, closed, j)
    hold_columns(where, state, contacts, solver, closed)
