"""The scalar flow of one motion: arcs, impacts, rest and release, accumulations of impacts, chatter.

The compiled parts of `kernel/layout.py`, `kernel/roots.py`, `kernel/steps.py`, `impacts.py`, `chatter.py` and this file are
compiled as one module, once for all models: the functions that are generated for a structure (see `kernel/compiled.py`) are
arguments. These files therefore consist of plain loops under the decorators of `saltus.taylor`, and share one namespace.

A motion is in one of the modes of `Mode`. If a tangent is asked for (see `kernel/event_derivatives.py`), its columns are further
coordinates, which `series` expands with the others. The steps are chosen by the motion itself, so that its impacts are the same
to the last bit with and without tangent, except where a column needs shorter steps. At an event the structure's function
`tangent` computes the new columns and the shift of the event, which are nan where there is no derivative.

`where`, `state` and `settings` are arrays in the places of `Where`, `State` and `Setting`; `env` = (parameters, constants, record
breakpoints, record table); `model` holds the functions of the structure in the places of `ModelPart`, and `work` the arrays of a
step in those of `Work`.
"""

from __future__ import annotations

import numpy as np

from saltus.flow.kernel.function_types import ADVANCE
from saltus.flow.kernel.layout import (
    BATCH,
    CHATTER_SPEED,
    EXACT,
    ROUGHER,
    SHORTEST,
    GrazingDetail,
    Mode,
    ModelPart,
    Setting,
    Status,
    Where,
    Work,
)
from saltus.flow.kernel.memory_layout import EventCode, State
from saltus.flow.kernel.roots import NEVER, SIMPLE, contact_root, first_root, horner, leading, margin_root, scale_gap
from saltus.flow.kernel.steps import (
    column_step,
    expand,
    leaps,
    move,
    next_target,
    record_event,
    record_shift,
    record_step,
    step_size,
    work_arrays,
)
from saltus.flow.one_contact.chatter import chatter_decay
from saltus.flow.one_contact.impacts import contact_accelerations, decide, hold, impact, rate_of
from saltus.taylor import by_reference, cached_jit, lean_jit

# --- compiled from here on -----------------------------------------------------------------------------------------------


@lean_jit
def arc_step(where, settings, env, model, work, t, origin, target, size):
    """The step that the series of an arc allow, beyond `target` or not."""
    order, tol = where[Where.ORDER], settings[Setting.TOLERANCE]
    q, v, a = work[Work.POSITIONS], work[Work.VELOCITIES], work[Work.ACCELERATIONS]
    natural = step_size(v[: where[Where.OWN]], order, size, tol)
    if where[Where.COLUMNS] > 0:
        natural = min(natural, column_step(where, q, v, a, order, ROUGHER * tol))
    while where[Where.CHECKED] > 0 and leaps(
        where, env, model, work, t, origin, float(where[Where.SIDE]), min(natural, target - t), size, tol
    ):
        natural = 0.5 * min(natural, target - t)
    return natural


@lean_jit
def first_margin(where, m, order, h, poly, hit, first):
    """The margin that reaches zero first within the step, and its instant, if this is before `first`; else `hit` and `first`."""
    for j in range(where[Where.MARGINS]):
        u = margin_root(m[j], order, h, poly)
        if u < first:
            hit, first = j, u
    return hit, first


@lean_jit
def arc(where, state, settings, env, model, work, steps, events, origin, target):
    """One step of a smooth motion, up to the first zero of the gap or of a margin. Returns PAUSED, or why the motion ends."""
    q, v, _, g, m, _, poly, _, _ = work
    order, t, side = where[Where.ORDER], state[State.TIME], where[Where.SIDE]
    size = expand(where, state, env, model, work, t, origin, float(side), order)
    natural = arc_step(where, settings, env, model, work, t, origin, target, size)
    h = min(natural, target - t)
    hit, first, touch = -1, NEVER, NEVER
    if where[Where.SIDES] > 0:
        kind, u, touch = contact_root(g, where[Where.SKIP], order, h, poly)
        if kind == SIMPLE:
            hit, first = where[Where.MARGINS], u
        elif 0.75 < touch <= 1.0 and h == natural:  # a touch near the end of a step could be found again in the next one
            h, touch = 0.5 * h, NEVER
    hit, first = first_margin(where, m, order, h, poly, hit, first)
    if touch < first and touch <= 1.0:
        record_event(
            where, events, EventCode.GRAZING, side, GrazingDetail.TOUCH, t + touch * h, horner(v[0], order, touch * h), 0.0
        )
    tau = first * h if hit >= 0 else h
    record_step(where, steps, side, t, tau, q)
    if not move(where, state, q, v, tau) or not h >= 0.0:
        return Status.NOT_FINITE
    state[State.TIME] = target if hit < 0 and h == target - t else t + tau
    where[Where.SKIP] = 0
    velocity = state[State.COORDINATES + where[Where.DOF]]
    if hit == where[Where.MARGINS]:
        return impact(where, state, env, model, events, state[State.TIME], origin, velocity)
    if hit >= 0:
        record_event(where, events, EventCode.LIMIT, side, hit, state[State.TIME], velocity, velocity)
        if where[Where.COLUMNS] > 0:
            model[ModelPart.TANGENT](EventCode.LIMIT, hit, state[State.TIME], origin, float(side), env, where[Where.PIECE], state)
            record_shift(where, state, events)
        return Status.LIMITED
    unit = min(settings[Setting.LENGTH], 1.0) if settings[Setting.LENGTH] > 0.0 else 1.0
    return Status.PAUSED if natural > SHORTEST * unit or h == target - t else Status.STALLED


@lean_jit
def first_release(where, b, order, h, poly):
    """The first instant at which a contact acceleration points outward, as a share of the step, and its side; 0 and 0 if one does
    already at the start."""
    first, released = NEVER, 0
    for i in range(where[Where.SIDES]):
        skip = leading(b[i], 0, order)
        if skip < order and b[i, skip] > 0.0:
            first, released = 0.0, 0
        elif skip < order:
            for k in range(order + 1):
                b[i, k] = -b[i, k]
            scale_gap(b[i], skip, order, h, poly)
            kind, u, _ = first_root(poly, order - skip)
            if kind == SIMPLE and u < first:
                first, released = u, 1 - 2 * i
    return first, released


@lean_jit
def held(where, state, settings, env, model, work, steps, origin, target):
    """One step of REST or CHATTER, up to the first instant at which a contact acceleration points outward."""
    q, b = work[Work.POSITIONS], work[Work.CONTACT]
    order, t = where[Where.ORDER], state[State.TIME]
    h = target - t
    contact_accelerations(where, env, model, work, t, origin)
    for i in range(where[Where.SIDES]):
        h = min(h, step_size(b[i : i + 1], order, max(1.0, abs(b[i, 0])), min(settings[Setting.TOLERANCE], EXACT)))
    first, released = first_release(where, b, order, h, work[Work.POLYNOMIAL])
    tau = min(first, 1.0) * h
    if where[Where.MODE] == Mode.CHATTER and tau > 0.0:
        chatter_decay(where, state, env, model, work, tau, origin)
    hold(where, state, model, q)
    record_step(where, steps, 0, t, tau, q)
    if first > 1.0:
        state[State.TIME] = target if h == target - t else t + tau
        grown = state[State.CHATTER_SPEED] > 2.0 * CHATTER_SPEED
        if where[Where.MODE] == Mode.CHATTER and grown:  # the impacts are followed one by one from here on
            where[Where.MODE], where[Where.SKIP], where[Where.HELD] = Mode.CONTACT, 0, 0
            velocity = state[State.CHATTER_SPEED] / rate_of(model, float(where[Where.SIDE]))
            state[State.COORDINATES + where[Where.DOF]] = velocity
    else:
        where[Where.MODE], where[Where.SKIP] = Mode.CONTACT, released
        state[State.TIME] = t + tau if t + tau > t or released == 0 else np.nextafter(t, np.inf)  # time must increase


@lean_jit
def advance_with(where, state, settings, env_of, model_of, arrays, steps, events):
    """`advance` with the arrays of `Work`."""
    env, model, work = by_reference(env_of), by_reference(model_of), by_reference(arrays)
    for batch in range(BATCH):
        if where[Where.UNTIL_SMOOTH] > 0 and batch > 0 and where[Where.MODE] == Mode.ARC and where[Where.SKIP] <= 1:
            return Status.SMOOTH
        if where[Where.STEPS] >= steps[1].shape[0] - 4 or where[Where.EVENTS] >= events[1].shape[0] - 4:
            return Status.FULL
        origin = where[Where.PERIOD] * settings[Setting.LENGTH]
        t_end = settings[Setting.END] if where[Where.PERIOD] == where[Where.LAST_PERIOD] else settings[Setting.LENGTH]
        if state[State.TIME] >= t_end:
            if where[Where.PERIOD] == where[Where.LAST_PERIOD]:
                return Status.DONE
            where[Where.PERIOD] += 1
            state[State.TIME] -= t_end
            continue
        target = next_target(where, state, env[2], origin, t_end)
        status = Status.PAUSED
        if where[Where.MODE] == Mode.ARC:
            status = arc(where, state, settings, env, model, work, steps, events, origin, target)
        elif where[Where.SIDES] > 0 and where[Where.MODE] == Mode.CONTACT:
            status = decide(where, state, settings, env, model, work, steps, events, origin, t_end)
        elif where[Where.SIDES] > 0:
            held(where, state, settings, env, model, work, steps, origin, target)
        if status != Status.PAUSED:
            return status
    return Status.PAUSED


@cached_jit(ADVANCE)
def advance(where, state, settings, env, model, steps, events):
    """Advance a motion until it ends, a buffer is full, or a batch of steps is done; returns the reason.

    All of the motion's state is in `where` and `state`, so a call goes on where the last one stopped.
    """
    return advance_with(where, state, settings, env, model, work_arrays(where), steps, events)
