"""The flow of a motion with several contacts: smooth steps, impacts, releases, accumulations of impacts, rest.

The compiled parts of `kernel/layout.py`, `kernel/roots.py`, `kernel/steps.py`, `layout.py`, `complementarity.py`,
`impacts.py` and this file are compiled as one, once for every model. `where`, `state`, `settings`, `env`, `steps` and
`events` are as in `one_contact/kernel.py`; the last numbers in the parameters of `env` say for each coordinate whether it is
free (1) or held (0). `contacts` has a row for each contact in the columns of `ContactColumn`, `model` holds the functions of
the structure in the places of `ContactPart`, and `solver` the arrays of `Solver`.

In a smooth step the closed contacts hold their coordinates, and the model's series are those of the constrained motion. Each
contact has a guard: the gap if it is open, the reaction if it is closed. If a gap reaches 0, the impact law acts. After this, and
if a reaction reaches 0 or the load jumps, it is decided again which of the contacts that are at rest at their positions stay
closed. Frictions have rows behind those of the contacts (`frictions.py`), and it is decided together which of them stick.
"""

from __future__ import annotations

import math

import numpy as np

from saltus.flow.contacts.closings import contact_impact
from saltus.flow.contacts.decisions import decide_contacts
from saltus.flow.contacts.frictions import first_friction, friction_step_size, hold_frictions, reach
from saltus.flow.contacts.impacts import (
    closed_bits,
    contact_position,
    contact_step_size,
    couple,
    gap_series,
    hold_coordinates,
    is_smooth,
    record_contact_event,
)
from saltus.flow.contacts.layout import (
    GAP_ROUNDING,
    NEAR,
    ContactColumn,
    ContactPart,
    FrictionColumn,
)
from saltus.flow.contacts.solver_memory import solver_arrays
from saltus.flow.contacts.tangent import (
    fill_slopes,
    note_shifts,
    release_columns,
)
from saltus.flow.kernel.function_types import ADVANCE_CONTACTS
from saltus.flow.kernel.layout import BATCH, SHORTEST, ZERO, Mode, Setting, Status, Where, Work
from saltus.flow.kernel.memory_layout import EventCode, State
from saltus.flow.kernel.roots import NEVER, SIMPLE, contact_root, horner, horner_slope, margin_root
from saltus.flow.kernel.steps import expand, move, next_target, record_step, work_arrays
from saltus.taylor import by_reference, cached_jit, lean_jit

# --- compiled from here on -----------------------------------------------------------------------------------------------

# Series of a lower order than usual, for a step to the next impact on the same contact.
FAST_IMPACT = 0.3  # After a faster impact the usual order is needed to reach the next one.
RADIUS = 0.5  # A series of order n is assumed to be exact up to this times the n-th root of the tolerance.
LEAST_ORDER = 6  # At lower orders the last coefficients may all vanish by symmetry.
WORTH = 0.8  # A lower order is tried only below this share of the usual one.


@lean_jit
def first_guard(where, model, contacts, work, solver, h, whole):
    """The contact whose guard reaches 0 first within the step, the instant, and whether the step is too long to decide on a touch
    near its end."""
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
def short_order(where, state, settings, env, model, contacts, work, t, origin):
    """The order of the series for a step to the next impact of a contact that has just impacted: lower than usual if that
    suffices.

    Until its next impact the gap is nearly a parabola, whose duration is known. Most impacts of accumulations are so close.
    """
    order, first, flight = where[Where.ORDER], State.COORDINATES + where[Where.DOF], np.inf
    for i in range(contacts.shape[0]):
        rate = model[ContactPart.SIGNS][i] * state[first + contacts[i, ContactColumn.COORDINATE]]
        if contacts[i, ContactColumn.CLOSED] == 0 and contacts[i, ContactColumn.SKIP] == 1 and 0.0 < rate < FAST_IMPACT:
            if flight == np.inf:
                expand(where, state, env, model, work, t, origin, 1.0, 0)
            pull = model[ContactPart.SIGNS][i] * work[Work.ACCELERATIONS][contacts[i, ContactColumn.COORDINATE], 0]
            if pull < 0.0:
                flight = min(flight, -2.0 * rate / pull)
    if not flight < RADIUS:
        return order
    lower = max(LEAST_ORDER, math.ceil(math.log(settings[Setting.TOLERANCE]) / math.log(flight / RADIUS)))
    return lower if lower < WORTH * order else order


@lean_jit
def seek_event(where, state, settings, env, model, contacts, frictions, work, solver, t, origin, target):
    """Expand the motion, and find the first zero of a guard or of a margin within a step.

    Returns the length of the step, and the length that the series allow; the contact, the friction and the margin, of which the
    one with the first zero is given and the others are -1; which of the friction's guards it is; and the share of the step of the
    zero.
    """
    order, count, margins = where[Where.ORDER], contacts.shape[0], where[Where.MARGINS]
    size = expand(where, state, env, model, work, t, origin, 1.0, order)
    natural = contact_step_size(where, settings, env, model, contacts, work, t, origin, target, size)
    natural = friction_step_size(where, settings, frictions, count, work, natural)
    h = min(natural, target - t)
    whole = h == natural
    hit, first, shorter = first_guard(where, model, contacts, work, solver, h, whole)
    rubs, first_rub, which, shorter_rub = first_friction(where, frictions, count, work, solver, h, whole)
    if rubs >= 0 and first_rub < first:
        hit, first = -1, first_rub
    else:
        rubs = -1
    if (shorter or shorter_rub) and hit < 0 and rubs < 0:
        h = 0.5 * h
    limit, first_limit, held = -1, NEVER, count + 2 * frictions.shape[0]
    for j in range(held, margins):
        u = margin_root(work[Work.MARGINS][j], order, h, work[Work.POLYNOMIAL])
        if u < first_limit:
            limit, first_limit = j, u
    if first_limit <= first and limit >= 0:
        hit, rubs, first = -1, -1, first_limit
    else:
        limit = -1
    return h, natural, hit, rubs, limit, which, first


@lean_jit
def contact_arc(where, state, settings, env, model, contacts, frictions, work, solver, steps, events, origin, target):
    """One smooth step, up to the first zero of a guard or of a margin. Returns PAUSED, or why the motion ends."""
    order, t, count = where[Where.ORDER], state[State.TIME], contacts.shape[0]
    held = count + 2 * frictions.shape[0]
    where[Where.ORDER] = short_order(where, state, settings, env, model, contacts, work, t, origin)
    h, natural, hit, rubs, limit, which, first = seek_event(
        where, state, settings, env, model, contacts, frictions, work, solver, t, origin, target
    )
    if where[Where.ORDER] < order and hit < 0:  # the impact does not come as soon as it seemed
        where[Where.ORDER] = order
        h, natural, hit, rubs, limit, which, first = seek_event(
            where, state, settings, env, model, contacts, frictions, work, solver, t, origin, target
        )
    found = hit >= 0 or rubs >= 0
    tau = first * h if found or limit >= 0 else h
    bits = 0
    if hit >= 0 and contacts[hit, ContactColumn.CLOSED] == 0:
        bits = together(where, model, contacts, work, solver, hit, tau)
    finite = move(where, state, work[Work.POSITIONS], work[Work.VELOCITIES], tau)
    for i in range(where[Where.OWN]):
        for k in range(where[Where.ORDER] + 2, order + 2):
            work[Work.POSITIONS][i, k] = 0.0
    where[Where.ORDER] = order
    record_step(where, steps, where[Where.SIDE], t, tau, work[Work.POSITIONS])
    if not finite or not h >= 0.0:
        return Status.NOT_FINITE
    state[State.TIME] = target if not found and limit < 0 and h == target - t else t + tau
    for i in range(count):
        contacts[i, ContactColumn.SKIP] = 0
    for k in range(frictions.shape[0]):
        frictions[k, FrictionColumn.SKIP] = 0
    if bits > 0:
        where[Where.MODE] = Mode.CONTACT
        t = state[State.TIME]
        return contact_impact(where, state, env, model, contacts, frictions, work, solver, events, t, origin, bits)
    if hit >= 0:
        if where[Where.COLUMNS] > 0:
            release_columns(where, state, env, model, contacts, work, solver, state[State.TIME], origin, hit)
        where[Where.MODE], contacts[hit, ContactColumn.RELEASED] = Mode.CONTACT, 1 if first > 0.0 else 0
    if rubs >= 0:
        fill_slopes(where, state, env, model, solver)
        reach(where, state, env, model, work, solver, frictions, count, state[State.TIME], origin, rubs, which, first > 0.0)
        where[Where.MODE] = Mode.CONTACT
    if limit >= 0:
        record_contact_event(where, state, contacts, events, EventCode.LIMIT, 0, state[State.TIME])
        events[0][where[Where.EVENTS] - 1, 3] = limit - held
        if where[Where.COLUMNS] > 0:
            piece, shifts = where[Where.PIECE], State.COORDINATES + 2 * where[Where.DOF]
            model[ContactPart.TANGENT](EventCode.LIMIT, limit - held, state[State.TIME], origin, 1.0, env, piece, state)
            note_shifts(where, state, contacts, events, state, shifts)
        return Status.LIMITED
    unit = min(settings[Setting.LENGTH], 1.0) if settings[Setting.LENGTH] > 0.0 else 1.0
    ended = found or natural > 0.1 * SHORTEST * unit or h == target - t
    return Status.PAUSED if ended else Status.STALLED


@lean_jit
def advance_contacts_with(where, state, settings, env_of, model_of, contacts, frictions, arrays, solver_of, steps, events):
    """`advance_contacts` with the arrays of `Work` and of `Solver`."""
    env, model, work, solver = by_reference(env_of), by_reference(model_of), by_reference(arrays), by_reference(solver_of)
    couple(where, state, env, model, contacts, solver)
    hold_coordinates(where, env, contacts)
    hold_frictions(where, env, frictions)
    for batch in range(BATCH):
        if where[Where.UNTIL_SMOOTH] > 0 and batch > 0 and frictions.shape[0] == 0 and is_smooth(where, contacts):
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
        held = closed_bits(contacts) != 0 or frictions.shape[0] > 0
        if where[Where.PIECE] != piece and held and where[Where.MODE] != Mode.CONTACT:
            where[Where.MODE] = Mode.CONTACT  # the load may have jumped
        status = Status.PAUSED
        if where[Where.MODE] == Mode.CONTACT:
            status = decide_contacts(where, state, settings, env, model, contacts, frictions, work, solver, events, origin)
        else:
            status = contact_arc(
                where, state, settings, env, model, contacts, frictions, work, solver, steps, events, origin, target
            )
        if status != Status.PAUSED:
            return status
    return Status.PAUSED


@cached_jit(ADVANCE_CONTACTS)
def advance_contacts(where, state, settings, env, model, rows, steps, events):
    """Advance a motion until it ends, a buffer is full, or a batch of steps is done; returns the reason.

    `rows` has the rows of the contacts, then those of the frictions.
    """
    count = model[ContactPart.SIGNS].size
    contacts, frictions = rows[:count], rows[count:]
    solver = solver_arrays(where[Where.OWN], count, where[Where.COLUMNS], frictions.shape[0])
    return advance_contacts_with(
        where, state, settings, env, model, contacts, frictions, work_arrays(where), solver, steps, events
    )
