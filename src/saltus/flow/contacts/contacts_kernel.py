"""The flow of a motion with several contacts: smooth steps, impacts, releases, accumulations of impacts, rest.

The compiled parts of `kernel_layout.py`, `roots.py`, `steps.py`, `contact_layout.py`, `complementarity.py`,
`contact_impacts.py` and this file are compiled as one, once for every model. `where`, `state`, `settings`, `env`, `steps` and
`events` are as in `kernel.py`; the last numbers in the parameters of `env` say of each coordinate whether it is free (1) or held
(0). `contacts` has a row for each contact in the columns of `ContactColumn`, `model` holds the functions of the structure in the
places of `ContactPart`, and `solver` the arrays of `Solver`.

In a smooth step the closed contacts hold their coordinates, and the model's series are those of the constrained motion. Each
contact has a guard: the gap of an open one, the reaction of a closed one. Where a gap reaches 0 the impact law acts; where a
reaction does, or anything has changed, it is decided anew which of the contacts that are at rest at 0 stay closed.
"""

from __future__ import annotations

import numpy as np

from saltus.flow.contacts.contact_impacts import (
    bring_to_rest,
    closed_bits,
    contact_position,
    contact_step_size,
    couple,
    fill_after,
    frozen_accumulation,
    gap_series,
    hold_coordinates,
    impact_impulses,
    is_smooth,
    near_contacts,
    push,
    record_contact_event,
    settle_contact,
    slow_impacts,
    smaller_set,
    solver_arrays,
)
from saltus.flow.contacts.contact_layout import GAP_ROUNDING, NEAR, TRIED_AGAIN, ContactColumn, ContactPart, ImpactDetail, Solver
from saltus.flow.contacts.contact_tangent import (
    accumulation_shifts,
    closing_columns,
    decide_columns,
    hold_columns,
    impulse_columns,
    note_shifts,
    note_velocities,
    release_columns,
    rest_columns,
)
from saltus.flow.function_types import ADVANCE_CONTACTS
from saltus.flow.kernel_layout import BATCH, SHORTEST, ZERO, Mode, Setting, Status, Where, Work
from saltus.flow.memory_layout import EventCode, State
from saltus.flow.roots import NEVER, SIMPLE, contact_root, horner, horner_slope, leading, margin_root
from saltus.flow.steps import (
    expand,
    forget,
    motion_end,
    move,
    next_target,
    record_step,
    work_arrays,
)
from saltus.taylor import lean_jit
from saltus.taylor import not_here as cached_jit

# --- compiled from here on -----------------------------------------------------------------------------------------------

TIED = 1e-12  # A smaller reaction vanishes together with that of another contact: rounding of the loads that hold them.


@lean_jit
def contact_impact(where, state, env, model, contacts, work, solver, events, t, origin, hit):
    """Apply the impact law to all contacts whose gap is 0, of which those in `hit` have just closed. PAUSED, or NO_IMPACT."""
    own, count, first, detail = where[Where.OWN], contacts.shape[0], State.COORDINATES + where[Where.DOF], ImpactDetail.REGULAR
    regular, chosen = couple(where, state, env, model, contacts, solver), hit
    for i in range(count):
        chosen |= contacts[i, ContactColumn.CLOSED] << i
    record_contact_event(where, state, contacts, events, EventCode.IMPACT, hit, t)
    if where[Where.COLUMNS] > 0:
        detail = closing_columns(where, state, env, model, contacts, work, solver, t, origin, hit)
        events[0][where[Where.EVENTS] - 1, 3] = detail
        note_velocities(where, state, solver, 0.0)
    for i in range(count):  # a contact that is reached without a speed, to within the working precision
        if hit >> i & 1:
            solver[Solver.RATES][i] = min(solver[Solver.RATES][i], 0.0)
        solver[Solver.GAPS][i] = solver[Solver.RATES][i]
    acts = impact_impulses(solver, own, count, chosen, solver[Solver.RATES]) if regular else -1
    if acts < 0:
        return Status.NO_IMPACT
    push(where, state, model, contacts, solver)
    for i in range(count):
        if chosen >> i & 1:
            settle_contact(where, state, model, contacts, solver, i, solver[Solver.RATES][i])
    fill_after(where, state, contacts, solver, events)
    if detail == ImpactDetail.NO_SPEED:
        forget(where, state)
    elif where[Where.COLUMNS] > 0:
        note_velocities(where, state, solver, -1.0)
        impulse_columns(where, state, env, model, contacts, solver, acts, chosen)
        hold_columns(where, state, contacts, solver, chosen)
        note_shifts(where, state, contacts, events, state, first + where[Where.DOF])
    return Status.PAUSED


@lean_jit
def holds(where, model, contacts, work, solver, candidates):
    """Whether the first Taylor coefficients that are not 0 confirm which of the candidates are closed; notes how many are 0."""
    order, g, own, count = where[Where.ORDER], work[Work.GAP], where[Where.OWN], contacts.shape[0]
    for i in range(count):
        if not candidates >> i & 1:
            continue
        known = contacts[i, ContactColumn.RELEASED]
        if contacts[i, ContactColumn.CLOSED] == 1:
            k = leading(work[Work.MARGINS][i], known, order)
            if k < order and work[Work.MARGINS][i, k] < 0.0:
                return False
        else:
            gap_series(model, contacts, work, i, contact_position(solver, own, count, i), order, g)
            k = leading(g, 2 + known, order)
            if k == order or g[k] < 0.0:
                return False
        contacts[i, ContactColumn.SKIP] = k
    return True


@lean_jit
def choose_closed(where, state, env, model, contacts, work, solver, candidates, t, origin):
    """Decide which of the candidates, which are at rest at their positions, stay closed; False if nothing is consistent.

    0 <= reaction _|_ second derivative of the gap >= 0, and where both are 0 the same of their first derivatives that are not.
    """
    count = contacts.shape[0]
    for choice in range(1 << count):  # the bits of those that open
        if choice & ~candidates:
            continue
        for i in range(count):
            if candidates >> i & 1:
                contacts[i, ContactColumn.CLOSED] = 1 - (choice >> i & 1)
        hold_coordinates(where, env, contacts)
        expand(where, state, env, model, work, t, origin, 1.0, where[Where.ORDER])
        if holds(where, model, contacts, work, solver, candidates):
            return True
    return False


@lean_jit
def note_ties(where, state, env, model, contacts, work, candidates, t, origin):
    """Note that the reactions vanish of all candidates of which they do to within rounding, as they do of one that is released.

    Cells of a chain that move alike let go at one instant, of which each has its own rounding.
    """
    for i in range(contacts.shape[0]):
        if candidates >> i & 1:
            contacts[i, ContactColumn.CLOSED] = 1
    hold_coordinates(where, env, contacts)
    expand(where, state, env, model, work, t, origin, 1.0, 2)
    for i in range(contacts.shape[0]):
        if candidates >> i & 1 and abs(work[Work.MARGINS][i, 0]) <= TIED:
            contacts[i, ContactColumn.RELEASED] = 1


@lean_jit
def free_pulls(where, state, env, model, contacts, work, solver, t, origin):
    """Fill the second derivatives of the gaps with no contact closed; returns by how much they change, relatively, in time."""
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
def end_accumulation_of(where, state, settings, env, model, contacts, work, solver, events, t, origin):
    """Bring to rest what impacts that get smaller and smaller bring to rest soon; returns when, or t."""
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
        note_shifts(where, state, contacts, events, solver[Solver.HELD_SHIFTS], 0)
    bring_to_rest(where, state, model, contacts, solver, near)
    fill_after(where, state, contacts, solver, events)
    if where[Where.COLUMNS] > 0:
        rest_columns(where, state, env, model, contacts, solver, near)
    return t + left


@lean_jit
def decide_contacts(where, state, settings, env, model, contacts, work, solver, events, origin):
    """Find out which contacts are closed from here on. Returns PAUSED to go on, or NOT_UNIQUE."""
    t, count = state[State.TIME], contacts.shape[0]
    rested, shifts = where[Where.HELD] == 1, State.COORDINATES + 2 * where[Where.DOF]
    for j in range(where[Where.COLUMNS]):
        solver[Solver.HELD_SHIFTS][j] = state[shifts + j]
    settled = end_accumulation_of(where, state, settings, env, model, contacts, work, solver, events, t, origin)
    candidates = closed_bits(contacts)
    couple(where, state, env, model, contacts, solver)
    if candidates and not choose_closed(where, state, env, model, contacts, work, solver, candidates, t, origin):
        note_ties(where, state, env, model, contacts, work, candidates, t, origin)
        if not choose_closed(where, state, env, model, contacts, work, solver, candidates, t, origin):
            return Status.NOT_UNIQUE
    hold_coordinates(where, env, contacts)
    opened = candidates & ~closed_bits(contacts)
    if opened and where[Where.LEAVE_BY] == 0:
        record_contact_event(where, state, contacts, events, EventCode.RELEASE, opened, t)
        note_shifts(where, state, contacts, events, state, shifts)
    decide_columns(where, state, env, model, contacts, work, solver, t, origin)
    where[Where.LEAVE_BY] = 0
    where[Where.HELD] = 1
    for i in range(env[0].size - where[Where.OWN], env[0].size):
        if env[0][i] != 0.0:
            where[Where.HELD] = 0
    for i in range(count):
        contacts[i, ContactColumn.RELEASED] = 0
    if where[Where.HELD] == 1 and not rested:
        record_contact_event(where, state, contacts, events, EventCode.RESTING, closed_bits(contacts), settled)
        note_shifts(where, state, contacts, events, solver[Solver.HELD_SHIFTS], 0)
    where[Where.MODE] = Mode.REST if where[Where.HELD] == 1 else Mode.ARC
    where[Where.SIDE] = 1 + closed_bits(contacts)
    return Status.PAUSED


@lean_jit
def first_guard(where, model, contacts, work, solver, h, whole):
    """The contact whose guard reaches 0 first within the step, when, and whether a touch at the step's end makes it too long."""
    order, own, count = where[Where.ORDER], where[Where.OWN], contacts.shape[0]
    hit, first, shorter = -1, NEVER, False
    for i in range(count):
        skip, guard = contacts[i, ContactColumn.SKIP], work[Work.GAP]
        if contacts[i, ContactColumn.CLOSED] == 1:
            guard = work[Work.MARGINS][i]
            if skip == 0 and guard[0] < -ZERO:
                return i, 0.0, False
            if skip >= order:
                continue
        else:
            gap_series(model, contacts, work, i, contact_position(solver, own, count, i), order, guard)
        kind, u, touch = contact_root(guard, skip, order, h, work[Work.POLYNOMIAL])
        if kind == SIMPLE and u < first:
            hit, first = i, u
        shorter = shorter or (kind != SIMPLE and 0.75 < touch <= 1.0 and whole)
    return hit, first, shorter and hit < 0


@lean_jit
def together(where, model, contacts, work, solver, hit, tau):
    """The open contacts that close with `hit` at `tau` within the step, to within rounding, as bits."""
    order, own, count, bits, g = where[Where.ORDER], where[Where.OWN], contacts.shape[0], 1 << hit, work[Work.GAP]
    for i in range(count):
        if i == hit or contacts[i, ContactColumn.CLOSED] == 1:
            continue
        gap_series(model, contacts, work, i, contact_position(solver, own, count, i), order, g)
        size = abs(g[0]) + abs(g[1]) * tau + abs(g[2]) * tau * tau + GAP_ROUNDING * abs(contact_position(solver, own, count, i))
        if horner(g, order, tau) <= NEAR * size and horner_slope(g, order, tau) < 0.0:
            bits |= 1 << i
    return bits


@lean_jit
def contact_arc(where, state, settings, env, model, contacts, work, solver, steps, events, origin, target):
    """One smooth step, up to the first zero of a guard or of a margin. Returns PAUSED, or why the motion ends."""
    order, t, count, margins = where[Where.ORDER], state[State.TIME], contacts.shape[0], where[Where.MARGINS]
    size = expand(where, state, env, model, work, t, origin, 1.0, order)
    natural = contact_step_size(where, settings, env, model, contacts, work, t, origin, target, size)
    h = min(natural, target - t)
    hit, first, shorter = first_guard(where, model, contacts, work, solver, h, h == natural)
    if shorter:
        h = 0.5 * h
    limit, first_limit = -1, NEVER
    for j in range(count, margins):
        u = margin_root(work[Work.MARGINS][j], order, h, work[Work.POLYNOMIAL])
        if u < first_limit:
            limit, first_limit = j, u
    if first_limit <= first and limit >= 0:
        hit, first = -1, first_limit
    else:
        limit = -1
    tau = first * h if hit >= 0 or limit >= 0 else h
    record_step(where, steps, where[Where.SIDE], t, tau, work[Work.POSITIONS])
    bits = 0
    if hit >= 0 and contacts[hit, ContactColumn.CLOSED] == 0:
        bits = together(where, model, contacts, work, solver, hit, tau)
    if not move(where, state, work[Work.POSITIONS], work[Work.VELOCITIES], tau) or not h >= 0.0:
        return Status.NOT_FINITE
    state[State.TIME] = target if hit < 0 and limit < 0 and h == target - t else t + tau
    for i in range(count):
        contacts[i, ContactColumn.SKIP] = 0
    if bits > 0:
        where[Where.MODE] = Mode.CONTACT
        return contact_impact(where, state, env, model, contacts, work, solver, events, state[State.TIME], origin, bits)
    if hit >= 0:
        if where[Where.COLUMNS] > 0:
            release_columns(where, state, env, model, work, state[State.TIME], origin, hit)
        where[Where.MODE], contacts[hit, ContactColumn.RELEASED] = Mode.CONTACT, 1 if first > 0.0 else 0
    if limit >= 0:
        record_contact_event(where, state, contacts, events, EventCode.LIMIT, 0, state[State.TIME])
        events[0][where[Where.EVENTS] - 1, 3] = limit - count
        if where[Where.COLUMNS] > 0:
            piece, shifts = where[Where.PIECE], State.COORDINATES + 2 * where[Where.DOF]
            model[ContactPart.TANGENT](EventCode.LIMIT, limit - count, state[State.TIME], origin, 1.0, env, piece, state)
            note_shifts(where, state, contacts, events, state, shifts)
        return Status.LIMITED
    unit = min(settings[Setting.LENGTH], 1.0) if settings[Setting.LENGTH] > 0.0 else 1.0
    ended = hit >= 0 or natural > 0.1 * SHORTEST * unit or h == target - t
    return Status.PAUSED if ended else Status.STALLED


@cached_jit(ADVANCE_CONTACTS)
def advance_contacts(where, state, settings, env, model, contacts, steps, events):
    """Advance a motion until it ends, a buffer is full, or a batch of steps is done; returns the reason."""
    work, solver = work_arrays(where), solver_arrays(where[Where.OWN], contacts.shape[0], where[Where.COLUMNS])
    couple(where, state, env, model, contacts, solver)
    hold_coordinates(where, env, contacts)
    for batch in range(BATCH):
        if where[Where.UNTIL_SMOOTH] > 0 and batch > 0 and is_smooth(where, contacts):
            return Status.SMOOTH
        if where[Where.STEPS] >= steps[1].shape[0] - 4 or where[Where.EVENTS] >= events[1].shape[0] - 4:
            return Status.FULL
        origin = where[Where.PERIOD] * settings[Setting.LENGTH]
        t_end = settings[Setting.END] if where[Where.PERIOD] == where[Where.LAST_PERIOD] else settings[Setting.LENGTH]
        if state[State.TIME] >= t_end and (where[Where.MODE] != Mode.CONTACT or where[Where.PERIOD] < where[Where.LAST_PERIOD]):
            if where[Where.PERIOD] == where[Where.LAST_PERIOD]:
                return Status.DONE
            where[Where.PERIOD] += 1
            state[State.TIME] -= t_end
            continue
        piece = where[Where.PIECE]
        target = next_target(where, state, env[2], origin, t_end)
        if where[Where.PIECE] != piece and closed_bits(contacts) and where[Where.MODE] != Mode.CONTACT:
            where[Where.MODE] = Mode.CONTACT  # the load may have jumped
        status = Status.PAUSED
        if where[Where.MODE] == Mode.CONTACT:
            status = decide_contacts(where, state, settings, env, model, contacts, work, solver, events, origin)
        else:
            status = contact_arc(where, state, settings, env, model, contacts, work, solver, steps, events, origin, target)
        if status != Status.PAUSED:
            return status
    return Status.PAUSED
