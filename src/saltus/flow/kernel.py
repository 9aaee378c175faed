"""The robust scalar flow: arcs, impacts, rest and release, accumulations of impacts, chatter.

The texts of `layout.py`, `roots.py`, `steps.py`, `contact.py`, `chatter.py` and this file are compiled as one, once for every
model: the functions that are generated for a structure (see `compiled.py`), `series`, `contact_series`, `reset` and
`contact_damping`, are arguments. So these files are plain loops under the decorator `jit`, and share one namespace.

A motion is in one of four modes. ARC: a smooth motion on one side. CONTACT: at the contact, to be decided. REST: held at the
contact until an acceleration points outward. CHATTER: impacts without loss, too small and too many to follow one by one.

With a tangent (see `tangent.py`) its columns are further coordinates, which `series` expands with the others. The steps are the
motion's own, so its impacts are the same to the last bit, except where a column needs shorter ones. What an event makes of the
columns, and how it moves, is the structure's function `tangent`; where it has none, it is nan.

`env` = (parameters, constants, record breakpoints, record table). `model` = (the four functions; the coordinate at contact and
the gap's rate of change with the coordinate there, on sides +1 and -1; `tangent`). `work` = (q, v, a, g, m, w, poly, b, end):
the Taylor coefficients of coordinates, velocities, accelerations, gap and margins, the workspace of their recurrences, a scaled
polynomial, the contact accelerations of both sides, and the first five once more at the end of a step.
"""

from __future__ import annotations

import math

import numpy as np

from saltus.flow.chatter import chatter_decay
from saltus.flow.contact import contact_accelerations, decide, hold, impact, leading, rate_of
from saltus.flow.function_types import ADVANCE
from saltus.flow.kernel_layout import (
    ARC,
    BATCH,
    CHATTER,
    CHATTER_SPEED,
    COLUMNS,
    CONTACT,
    DOF,
    DONE,
    END,
    EVENTS,
    EXACT,
    FULL,
    GRAZING,
    HELD,
    LAST,
    LENGTH,
    LIMIT,
    LIMITED,
    MODE,
    NOT_FINITE,
    ORDER,
    OWN,
    PAUSED,
    PERIOD,
    PIECE,
    ROUGHER,
    ROWS,
    SHORTEST,
    SIDE,
    SIDES,
    SKIP,
    SPEED,
    STALLED,
    STATE,
    STEEP,
    STEPS,
    STOPS,
    TIME,
    TOLERANCE,
    VISIT,
    VISITED,
)
from saltus.flow.roots import NEVER, SIMPLE, first_root, horner, scale_gap
from saltus.flow.steps import column_step, leaps, record_event, record_shift, record_step, step_size
from saltus.taylor import jit
from saltus.taylor import not_here as cached_jit

# --- compiled from here on -----------------------------------------------------------------------------------------------


@jit
def contact_root(g, skip, order, h, poly):
    """The first zero of the gap within the step, its known zero of order `skip` at the start left out."""
    if skip == 0 and g[0] <= 0.0:  # rounding left the last step's end on the wrong side of the contact
        if g[1] < 0.0:
            return SIMPLE, 0.0, NEVER
        skip = 1
    while skip < order - 2 and g[skip] <= 0.0:  # leaving from rest: lower coefficients are zero up to rounding
        skip += 1
    scale_gap(g, skip, order, h, poly)
    return first_root(poly, order - skip)


@jit
def arc(where, state, settings, env, model, work, steps, events, origin, target):
    """One step of a smooth motion, up to the first zero of the gap or of a margin. Returns PAUSED, or why the motion ends."""
    q, v, a, g, m, w, poly, _, _ = work
    order, t, size = where[ORDER], state[TIME], 0.0
    for i in range(where[DOF]):
        q[i, 0], v[i, 0] = state[STATE + i], state[STATE + where[DOF] + i]
        if i < where[OWN]:
            size = max(size, abs(q[i, 0]), abs(v[i, 0]))
    model[0](t, origin, float(where[SIDE]), env, where[PIECE], q, v, a, g, m, w, order)
    natural = step_size(v[: where[OWN]], order, size, settings[TOLERANCE])
    if where[COLUMNS] > 0:
        natural = min(natural, column_step(where, q, v, a, order, ROUGHER * settings[TOLERANCE]))
    while where[STEEP] > 0 and leaps(where, env, model, work, t, origin, min(natural, target - t), size, settings[TOLERANCE]):
        natural = 0.5 * min(natural, target - t)
    h = min(natural, target - t)
    hit, first, touch = -1, NEVER, NEVER
    if where[SIDES] > 0:
        kind, u, touch = contact_root(g, where[SKIP], order, h, poly)
        if kind == SIMPLE:
            hit, first = where[STOPS], u
        elif 0.75 < touch <= 1.0 and h == natural:  # keep a touch away from the end of a step, where it would be seen twice
            h, touch = 0.5 * h, NEVER
    for j in range(where[STOPS]):
        if m[j, 0] <= 0.0:
            hit, first = j, 0.0
        else:
            scale_gap(m[j], 0, order, h, poly)
            kind, u, _ = first_root(poly, order)
            if kind == SIMPLE and u < first:
                hit, first = j, u
    if touch < first and touch <= 1.0:
        record_event(where, events, GRAZING, where[SIDE], 0, t + touch * h, horner(v[0], order, touch * h), 0.0)
    tau = first * h if hit >= 0 else h
    record_step(where, steps, where[SIDE], t, tau, q)
    finite = True
    for i in range(where[DOF]):
        state[STATE + i], state[STATE + where[DOF] + i] = horner(q[i], order, tau), horner(v[i], order, tau)
        if i < where[OWN]:
            finite = finite and math.isfinite(state[STATE + i]) and math.isfinite(state[STATE + where[DOF] + i])
    if not finite or not h >= 0.0:
        return NOT_FINITE
    state[TIME] = target if hit < 0 and h == target - t else t + tau
    where[SKIP] = 0
    if hit == where[STOPS]:
        return impact(where, state, env, model, events, state[TIME], origin, state[STATE + where[DOF]])
    if hit >= 0:
        record_event(where, events, LIMIT, where[SIDE], hit, state[TIME], state[STATE + where[DOF]], state[STATE + where[DOF]])
        if where[COLUMNS] > 0:
            model[5](LIMIT, hit, state[TIME], origin, float(where[SIDE]), env, where[PIECE], state)
            record_shift(where, state, events)
        return LIMITED
    unit = min(settings[LENGTH], 1.0) if settings[LENGTH] > 0.0 else 1.0
    return PAUSED if natural > SHORTEST * unit or h == target - t else STALLED


@jit
def held(where, state, settings, env, model, work, steps, origin, target):
    """One step of REST or CHATTER, up to the first instant at which a contact acceleration points outward."""
    q, poly, b = work[0], work[6], work[7]
    order, t = where[ORDER], state[TIME]
    h, first, released = target - t, NEVER, 0
    contact_accelerations(where, env, model, work, t, origin)
    for i in range(where[SIDES]):
        h = min(h, step_size(b[i : i + 1], order, max(1.0, abs(b[i, 0])), min(settings[TOLERANCE], EXACT)))
    for i in range(where[SIDES]):
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
    tau = min(first, 1.0) * h
    if where[MODE] == CHATTER and tau > 0.0:
        chatter_decay(where, state, env, model, work, tau, origin)
    hold(where, state, model, q)
    record_step(where, steps, 0, t, tau, q)
    if first > 1.0:
        state[TIME] = target if h == target - t else t + tau
        if where[MODE] == CHATTER and state[SPEED] > 2.0 * CHATTER_SPEED:  # grown again: followed one by one from here on
            where[MODE], where[SKIP], where[HELD] = CONTACT, 0, 0
            state[STATE + where[DOF]] = state[SPEED] / rate_of(model, float(where[SIDE]))
    else:
        where[MODE], where[SKIP] = CONTACT, released
        state[TIME] = t + tau if t + tau > t or released == 0 else np.nextafter(t, np.inf)  # time must go on


@cached_jit(ADVANCE)
def advance(where, state, settings, env, model, steps, events):
    """Advance a motion until it ends, a buffer is full, or a batch of steps is done; returns the reason.

    All of the motion's state is in `where` and `state`, so a call goes on where the last one stopped.
    """
    order = where[ORDER]
    dof, breaks = where[DOF], env[2]
    work = (
        np.zeros((dof, order + 2)),
        np.zeros((dof, order + 2)),
        np.zeros((dof, order + 2)),
        np.zeros(order + 2),
        np.zeros((max(where[STOPS], 1), order + 2)),
        np.zeros((where[ROWS], order + 6)),
        np.zeros(order + 2),
        np.zeros((2, order + 2)),
        (np.zeros((dof, 2)), np.zeros((dof, 2)), np.zeros((dof, 2)), np.zeros(2), np.zeros((max(where[STOPS], 1), 2))),
    )
    for batch in range(BATCH):
        if where[VISIT] > 0 and batch > 0 and where[MODE] == ARC and where[SKIP] <= 1:
            return VISITED
        if where[STEPS] >= steps[1].shape[0] - 4 or where[EVENTS] >= events[1].shape[0] - 4:
            return FULL
        origin = where[PERIOD] * settings[LENGTH]
        t_end = settings[END] if where[PERIOD] == where[LAST] else settings[LENGTH]
        if state[TIME] >= t_end:
            if where[PERIOD] == where[LAST]:
                return DONE
            where[PERIOD] += 1
            state[TIME] -= t_end
            continue
        while where[PIECE] < breaks.size and breaks[where[PIECE]] - origin <= state[TIME]:
            where[PIECE] += 1
        target = t_end
        if where[PIECE] < breaks.size:
            target = min(target, breaks[where[PIECE]] - origin)
        status = PAUSED
        if where[MODE] == ARC:
            status = arc(where, state, settings, env, model, work, steps, events, origin, target)
        elif where[SIDES] > 0 and where[MODE] == CONTACT:
            status = decide(where, state, settings, env, model, work, steps, events, origin, t_end)
        elif where[SIDES] > 0:
            held(where, state, settings, env, model, work, steps, origin, target)
        if status != PAUSED:
            return status
    return PAUSED
