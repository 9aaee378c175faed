"""Impacts of several contacts, and accumulations of them.

Its compiled part goes into one module with that of `kernel.py`, whose docstring defines `contacts`, `model`, `solver`.
"""

from __future__ import annotations

import math

import numpy as np

from saltus.flow.contacts.complementarity import acting, complementary, invert
from saltus.flow.contacts.layout import FINISHED, MOST_FROZEN_IMPACTS, VANISHED, ContactColumn, ContactPart, Solver
from saltus.flow.kernel.layout import CHATTER_SPEED, EXACT, ROUGHER, SLOW, Mode, Setting, Where, Work
from saltus.flow.kernel.memory_layout import State
from saltus.flow.kernel.steps import column_step, leaps, step_size
from saltus.taylor import lean_jit

# --- compiled from here on -----------------------------------------------------------------------------------------------


@lean_jit
def hold_coordinates(where, env, contacts):
    """Tell the model's functions, through `env`, which coordinates are free."""
    first = env[0].size - where[Where.OWN]
    for i in range(where[Where.OWN]):
        env[0][first + i] = 1.0
    for i in range(contacts.shape[0]):
        if contacts[i, ContactColumn.CLOSED] == 1:
            env[0][first + contacts[i, ContactColumn.COORDINATE]] = 0.0


@lean_jit
def closed_bits(contacts):
    """The contacts that are closed, as bits."""
    bits = 0
    for i in range(contacts.shape[0]):
        bits |= contacts[i, ContactColumn.CLOSED] << i
    return bits


@lean_jit
def gap_series(model, contacts, work, i, position, order, g):
    """The Taylor coefficients of a contact's gap."""
    sign, coordinate = model[ContactPart.SIGNS][i], contacts[i, ContactColumn.COORDINATE]
    for k in range(order + 1):
        g[k] = sign * work[Work.POSITIONS][coordinate, k]
    g[0] -= sign * position


@lean_jit
def contact_step_size(where, settings, env, model, contacts, work, t, origin, target, size):
    """The step that the series of the free coordinates and of the reactions allow."""
    order, tol, own = where[Where.ORDER], settings[Setting.TOLERANCE], where[Where.OWN]
    natural = step_size(work[Work.VELOCITIES][:own], order, size, tol)
    if where[Where.COLUMNS] > 0:
        q, v, a = work[Work.POSITIONS], work[Work.VELOCITIES], work[Work.ACCELERATIONS]
        natural = min(natural, column_step(where, q, v, a, order, ROUGHER * tol))
    sharp = min(tol, EXACT) if where[Where.MODE] == Mode.REST else tol
    for i in range(contacts.shape[0]):
        if contacts[i, ContactColumn.CLOSED] == 1:
            r = work[Work.MARGINS][i : i + 1]
            natural = min(natural, step_size(r, order, max(1.0, abs(r[0, 0])), sharp))
    while where[Where.CHECKED] > 0 and leaps(where, env, model, work, t, origin, 1.0, min(natural, target - t), size, tol):
        natural = 0.5 * min(natural, target - t)
    return natural


@lean_jit
def restitution(solver, own, count, i, j):
    """The entry E_ij of the restitution matrix."""
    return solver[Solver.NUMBERS][own * own + count * i + j]


@lean_jit
def contact_position(solver, own, count, i):
    """The position of a contact."""
    return solver[Solver.NUMBERS][own * own + count * count + i]


@lean_jit
def couple(where, state, env, model, contacts, solver):
    """Fill `NUMBERS`, `INVERSE`, `COUPLING`, `GAPS` and `RATES` of `solver` at the present state; False if the mass matrix is
    singular."""
    own, count, signs = where[Where.OWN], contacts.shape[0], model[ContactPart.SIGNS]
    model[ContactPart.MATRICES](env, where[Where.PIECE], state, solver[Solver.NUMBERS])
    regular = invert(solver[Solver.NUMBERS], own, solver[Solver.BLOCK], solver[Solver.INVERSE])
    for i in range(count):
        a = contacts[i, ContactColumn.COORDINATE]
        for j in range(count):
            b = contacts[j, ContactColumn.COORDINATE]
            solver[Solver.COUPLING][i, j] = signs[i] * signs[j] * solver[Solver.INVERSE][a, b]
        solver[Solver.GAPS][i] = signs[i] * (state[State.COORDINATES + a] - contact_position(solver, own, count, i))
        solver[Solver.RATES][i] = signs[i] * state[State.COORDINATES + where[Where.DOF] + a]
    return regular


@lean_jit
def reduce_to(solver, chosen, count):
    """Copy the coupling of the contacts in `chosen` to the first rows of `REDUCED`; returns the number of these contacts."""
    row = 0
    for i in range(count):
        if chosen >> i & 1:
            column = 0
            for j in range(count):
                if chosen >> j & 1:
                    solver[Solver.REDUCED][row, column] = solver[Solver.COUPLING][i, j]
                    column += 1
            row += 1
    return row


@lean_jit
def impact_impulses(solver, own, count, chosen, rates):
    """Find the impulses J of the contacts in `chosen`: 0 <= J _|_ v+ + E v- >= 0 with v+ = v- + G J.

    `rates` holds v- of all contacts, and afterwards v+. For a contact that acts v+ is set to -E v-, so that a rate of 0 is
    exactly 0. Returns the contacts that act as bits, or -1 if there is no solution.
    """
    size, row, after = reduce_to(solver, chosen, count), 0, solver[Solver.TRIED]
    for i in range(count):
        if chosen >> i & 1:
            solver[Solver.RIGHT][row] = rates[i]
            for j in range(count):
                if chosen >> j & 1:
                    solver[Solver.RIGHT][row] += restitution(solver, own, count, i, j) * rates[j]
            row += 1
    bits = complementary(
        solver[Solver.REDUCED], solver[Solver.RIGHT], size, solver[Solver.BLOCK], solver[Solver.TRIED], solver[Solver.IMPULSES]
    )
    if bits < 0:
        return -1
    acts, row = 0, 0
    for i in range(count):
        if chosen >> i & 1:
            acts |= (bits >> row & 1) << i
            row += 1
    for i in range(count - 1, -1, -1):  # spread them from the chosen to all contacts, the last one first
        if chosen >> i & 1:
            row -= 1
            solver[Solver.IMPULSES][i] = solver[Solver.IMPULSES][row]
        if not acts >> i & 1:
            solver[Solver.IMPULSES][i] = 0.0
    for i in range(count):
        after[i] = rates[i]
        if acts >> i & 1:
            after[i] = 0.0
            for j in range(count):
                if chosen >> j & 1:
                    after[i] -= restitution(solver, own, count, i, j) * rates[j]
        else:
            for j in range(count):
                after[i] += solver[Solver.COUPLING][i, j] * solver[Solver.IMPULSES][j]
            if chosen >> i & 1:
                after[i] = max(after[i], 0.0)
    for i in range(count):
        rates[i] = after[i] + 0.0
    return acts


@lean_jit
def push(where, state, model, contacts, solver):
    """Add the effect of the impulses to the velocities."""
    first = State.COORDINATES + where[Where.DOF]
    for i in range(where[Where.OWN]):
        for j in range(contacts.shape[0]):
            gain = solver[Solver.INVERSE][i, contacts[j, ContactColumn.COORDINATE]] * model[ContactPart.SIGNS][j]
            state[first + i] += gain * solver[Solver.IMPULSES][j]


@lean_jit
def record_contact_event(where, state, contacts, events, kind, which, t):
    """Append an event: (period, kind, bits of contacts, 0) and (local time, velocities before and after, impulses).

    The velocities before are those of the state at this call; `fill_after` completes the event.
    """
    labels, values = events
    i, own, first = where[Where.EVENTS], where[Where.OWN], State.COORDINATES + where[Where.DOF]
    labels[i, 0], labels[i, 1], labels[i, 2], labels[i, 3] = where[Where.PERIOD], kind, which, 0
    values[i, 0] = t
    for k in range(own):
        values[i, 1 + k] = values[i, 1 + own + k] = state[first + k]
    for k in range(contacts.shape[0]):
        values[i, 1 + 2 * own + k] = 0.0
    for j in range(where[Where.COLUMNS]):
        values[i, 1 + 2 * own + contacts.shape[0] + j] = math.nan  # until `note_shifts` sets them
    where[Where.EVENTS] = i + 1


@lean_jit
def fill_after(where, state, contacts, solver, events):
    """Complete the last event by the velocities after it and the impulses."""
    values, own, first = events[1], where[Where.OWN], State.COORDINATES + where[Where.DOF]
    i = where[Where.EVENTS] - 1
    for k in range(own):
        values[i, 1 + own + k] = state[first + k]
    for k in range(contacts.shape[0]):
        values[i, 1 + 2 * own + k] = solver[Solver.IMPULSES][k]


@lean_jit
def settle_contact(where, state, model, contacts, solver, i, rate):
    """Put the coordinate of a contact that takes part in an impact exactly at its position, with the rate after the impact."""
    own, count, coordinate = where[Where.OWN], contacts.shape[0], contacts[i, ContactColumn.COORDINATE]
    state[State.COORDINATES + coordinate] = contact_position(solver, own, count, i)
    state[State.COORDINATES + where[Where.DOF] + coordinate] = model[ContactPart.SIGNS][i] * rate + 0.0
    contacts[i, ContactColumn.CLOSED] = 1 if rate == 0.0 else 0
    contacts[i, ContactColumn.SKIP], contacts[i, ContactColumn.RELEASED] = 1, 0


@lean_jit
def closed_pulls(solver, own, count, near, b, x, u, pull):
    """The second derivatives of the gaps in `near`, where contacts at rest at 0 are closed if their reaction pushes; returns the
    contacts that are at rest, as bits."""
    still, row = 0, 0
    for i in range(count):
        if near >> i & 1 and x[i] == 0.0 and u[i] == 0.0:
            still |= 1 << i
    size = reduce_to(solver, still, count)
    for i in range(count):
        if still >> i & 1:
            solver[Solver.RIGHT][row] = b[i]
            row += 1
    bits = complementary(
        solver[Solver.REDUCED], solver[Solver.RIGHT], size, solver[Solver.BLOCK], solver[Solver.TRIED], solver[Solver.IMPULSES]
    )
    for i in range(count):
        pull[i], row = b[i], 0
        for j in range(count):
            if still >> j & 1:
                pull[i] += solver[Solver.COUPLING][i, j] * solver[Solver.IMPULSES][row] if bits >= 0 else 0.0
                row += 1
    row = 0
    for i in range(count):
        if still >> i & 1:
            if bits >= 0 and bits >> row & 1:
                pull[i] = 0.0
            row += 1
    return still


@lean_jit
def time_to_close(x, u, a):
    """The time at which x + u t + a t^2 / 2 falls to 0 from above; infinite if it never does.

    It is 0 for a gap of 0 that is closing: such a gap has become smaller than the least number, by impacts that square it each
    time.
    """
    if x == 0.0 and u < 0.0:
        return 0.0
    if x == 0.0:
        return -2.0 * u / a if a < 0.0 and u > 0.0 else np.inf
    square = u * u - 2.0 * a * x
    if square < 0.0 or (a >= 0.0 and u >= 0.0):
        return np.inf
    return 2.0 * x / (math.sqrt(square) - u)


@lean_jit
def frozen_accumulation(solver, own, count, near, limit):
    """The time in which the contacts in `near` lose all speed by impacts, if the accelerations stay constant.

    Each gap then follows parabolas between its impacts. No other contact may close meanwhile. If they do not lose their speed
    within `limit`, minus the number of impacts that were followed is returned. Which of the contacts stay closed is decided
    later.
    """
    time, first, b, pull = 0.0, 0.0, solver[Solver.PULLS], solver[Solver.FALLING_PULLS]
    x, u = solver[Solver.FALLING_GAPS], solver[Solver.FALLING_RATES]
    for i in range(count):
        x[i], u[i] = solver[Solver.GAPS][i], solver[Solver.RATES][i]
        if not near >> i & 1:
            limit = min(limit, 0.1 * time_to_close(x[i], u[i], b[i]))
        first = max(first, abs(u[i]) if near >> i & 1 else 0.0)
    for followed in range(MOST_FROZEN_IMPACTS):
        still = closed_pulls(solver, own, count, near, b, x, u, pull)
        flight = np.inf
        for i in range(count):
            if near >> i & 1 and not (still >> i & 1 and pull[i] <= 0.0):
                flight = min(flight, time_to_close(x[i], u[i], pull[i]))
        if flight == np.inf:
            return time if still == near and max_rate(u, pull, near, still, count) == 0.0 else -1.0 - followed
        time += flight
        if not time <= limit:
            return -1.0 - followed
        height, hit = 0.0, still
        for i in range(count):
            if near >> i & 1:
                height = max(height, abs(u[i]) * flight)
        for i in range(count):
            if near >> i & 1 and not (still >> i & 1 and pull[i] <= 0.0):
                x[i], u[i] = x[i] + flight * (u[i] + 0.5 * flight * pull[i]), u[i] + flight * pull[i]
                if x[i] <= 1e-12 * height and u[i] < 0.0:
                    x[i], hit = 0.0, hit | 1 << i
        if impact_impulses(solver, own, count, hit, u) < 0:
            return -1.0 - followed
        done = True
        for i in range(count):
            if x[i] == 0.0 and u[i] <= VANISHED * first:
                u[i] = 0.0
            if near >> i & 1 and u[i] * u[i] + 2.0 * abs(b[i]) * x[i] > (FINISHED * first) ** 2:
                done = False
        if done:
            return time
    return -1.0 * MOST_FROZEN_IMPACTS


@lean_jit
def max_rate(u, pull, near, still, count):
    """The largest of the speeds of the contacts in `near` and of the accelerations with which resting ones open."""
    largest = 0.0
    for i in range(count):
        if near >> i & 1:
            largest = max(largest, abs(u[i]))
            if still >> i & 1:
                largest = max(largest, pull[i])
    return largest


@lean_jit
def near_contacts(solver, count, slow):
    """The contacts that may take part in an accumulation with speeds up to `slow`, as bits; 0 if none of them bounces."""
    near, bounces = 0, False
    for i in range(count):
        x, u, b = solver[Solver.GAPS][i], solver[Solver.RATES][i], solver[Solver.PULLS][i]
        if abs(u) <= slow and x * max(abs(b), 1.0) <= slow * slow:
            near |= 1 << i
            bounces = bounces or u > 0.0
    return near if bounces else 0


@lean_jit
def smaller_set(solver, contacts, near):
    """The contacts in `near` whose gap is 0, for an accumulation on a smaller scale; 0 if these are all of `near`."""
    smaller = 0
    for i in range(contacts.shape[0]):
        if near >> i & 1 and solver[Solver.GAPS][i] == 0.0:
            smaller |= 1 << i
    return smaller if smaller != near else 0


@lean_jit
def bring_to_rest(where, state, model, contacts, solver, near):
    """Stop the contacts in `near` by impulses on these alone, and close them."""
    count, row = contacts.shape[0], 0
    size = reduce_to(solver, near, count)
    for i in range(count):
        if near >> i & 1:
            solver[Solver.RIGHT][row] = solver[Solver.RATES][i]
            row += 1
    acting(solver[Solver.REDUCED], solver[Solver.RIGHT], size, (1 << size) - 1, solver[Solver.BLOCK], solver[Solver.TRIED])
    row = 0
    for i in range(count):
        solver[Solver.IMPULSES][i] = 0.0
        if near >> i & 1:
            solver[Solver.IMPULSES][i] = solver[Solver.TRIED][row]
            row += 1
    push(where, state, model, contacts, solver)
    for i in range(count):
        if near >> i & 1:
            settle_contact(where, state, model, contacts, solver, i, 0.0)


@lean_jit
def slow_impacts(tol):
    """The speed of an impact below which the end of an accumulation may be near, as with one contact (`slow_speed`)."""
    return max(SLOW * math.sqrt(tol), CHATTER_SPEED)


@lean_jit
def is_smooth(where, contacts):
    """Whether a motion is on a smooth arc, and the only guards known to be 0 are the gaps of contacts that have just opened."""
    smooth = where[Where.MODE] == Mode.ARC
    for i in range(contacts.shape[0]):
        smooth = smooth and contacts[i, ContactColumn.SKIP] <= 1 - contacts[i, ContactColumn.CLOSED]
    return smooth
