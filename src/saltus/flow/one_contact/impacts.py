"""The events at the contact: impacts, rest and release, and the ends of accumulations of impacts.

Its compiled part goes into one module with that of `kernel.py`, whose docstring defines `env`, `model` and `work`.
"""

from __future__ import annotations

import math

from saltus.flow.kernel.layout import (
    CHATTER_SPEED,
    LOSSLESS,
    SLOW,
    SLOWLY,
    TINY,
    Geometry,
    GrazingDetail,
    Mode,
    ModelPart,
    Setting,
    Status,
    Where,
    Work,
)
from saltus.flow.kernel.memory_layout import EventCode, ReleaseDetail, RestDetail, State
from saltus.flow.kernel.roots import leading
from saltus.flow.kernel.steps import forget, motion_end, record_event, record_shift, record_step
from saltus.taylor import lean_jit

# --- compiled from here on -----------------------------------------------------------------------------------------------


@lean_jit
def rate_of(model, side):
    """The gap's rate of change with the coordinate at contact, on a side."""
    return model[ModelPart.GEOMETRY][Geometry.RATE_UP] if side > 0.0 else model[ModelPart.GEOMETRY][Geometry.RATE_DOWN]


@lean_jit
def set_state(where, state, position, velocity):
    """Put the first coordinate and its velocity into the state."""
    state[State.COORDINATES], state[State.COORDINATES + where[Where.DOF]] = position, velocity


@lean_jit
def hold(where, state, model, q):
    """Put the system at rest at contact."""
    set_state(where, state, model[ModelPart.GEOMETRY][Geometry.CONTACT], 0.0)
    for k in range(q.shape[1]):
        q[0, k] = 0.0
    q[0, 0] = state[State.COORDINATES]


@lean_jit
def contact_accelerations(where, env, model, work, t, origin):
    """Fill `b` with the Taylor series in time of the gap's second derivative at rest at contact, on side +1 and on side -1."""
    b, w = work[Work.CONTACT], work[Work.RECURRENCES]
    for i in range(min(where[Where.SIDES], 2)):
        model[ModelPart.CONTACT_SERIES](t, origin, 1.0 - 2.0 * i, env, where[Where.PIECE], b[i], w, where[Where.ORDER])


@lean_jit
def leave_or_stay(where, state, env, model, work, origin):
    """Decide whether a system at rest at the contact leaves it on an ARC or stays in REST. False if that is not unique.

    On each side the sign of the first non-zero Taylor coefficient of the contact acceleration decides; `SKIP` holds the side, if
    any, on which the acceleration has just been found to be zero. If both sides point outward the motion is not unique, unless
    the caller has given the side (`LEAVE_BY`).
    """
    b, order, released, outward = work[Work.CONTACT], where[Where.ORDER], where[Where.SKIP], 0
    contact_accelerations(where, env, model, work, state[State.TIME], origin)
    for i in range(where[Where.SIDES]):
        side = 1 - 2 * i
        skip = leading(b[i], 1 if released == side else 0, order)
        if skip < order and b[i, skip] > 0.0 and (outward == 0 or where[Where.LEAVE_BY] != where[Where.SIDE]):
            outward += 1
            where[Where.SIDE], where[Where.SKIP] = side, skip + 2
    if outward == 2 and where[Where.LEAVE_BY] != where[Where.SIDE]:
        return False
    where[Where.MODE] = Mode.ARC if outward > 0 else Mode.REST
    return True


@lean_jit
def contact_pull(side, env, model, piece, work, t, origin):
    """The second derivative of the gap at rest at contact on one side, and its rate of change."""
    b, w = work[Work.CONTACT], work[Work.RECURRENCES]
    model[ModelPart.CONTACT_SERIES](t, origin, side, env, piece, b[0], w, 1)
    return b[0, 0], b[0, 1]


@lean_jit
def accumulation(where, env, model, work, speed, t, origin, tol):
    """The mode that follows a small impact, and, for an accumulation, the time left until its end.

    REST: impacts accumulate soon. From the gap's speed v on side s the time left is
    2 v (1/abs(a_s) + e1/abs(a_n)) / (1 - e1 e2), with a_s, a_n the contact accelerations on this and on the next side and e1, e2
    the factors of the next two impacts; its error is of the order of the square of the time left times the relative rate of
    change of the accelerations. CHATTER: impacts lose nothing, are slower than CHATTER_SPEED, and the accelerations change slowly
    over two of them. ARC: neither of these.
    """
    side, piece = float(where[Where.SIDE]), where[Where.PIECE]
    here, slope_here = contact_pull(side, env, model, piece, work, t, origin)
    if here >= 0.0:
        return Mode.ARC, 0.0
    next_side, after = model[ModelPart.RESET](t, origin, -speed / rate_of(model, side), side, env, piece)
    there, slope_there = contact_pull(next_side, env, model, piece, work, t, origin)
    if there >= 0.0 or after != after:
        return Mode.ARC, 0.0
    next_speed = rate_of(model, next_side) * after
    first, second = next_speed / speed, 0.0
    if first > 0.0:
        third_side, last = model[ModelPart.RESET](t, origin, -after, next_side, env, piece)
        second = rate_of(model, third_side) * last / next_speed
    loss = 1.0 - first * second
    cycle = 2.0 * speed * (1.0 / abs(here) + first / abs(there))
    change = 1.0 + abs(slope_here / here) + abs(slope_there / there)
    if abs(loss) < LOSSLESS:
        return Mode.CHATTER if speed < CHATTER_SPEED and cycle * change < SLOWLY else Mode.ARC, 0.0
    if not loss > 0.0:
        return Mode.ARC, 0.0
    left = cycle / loss
    return Mode.REST if 0.1 * left * left * change <= tol else Mode.ARC, left


@lean_jit
def slow_speed(tol):
    """The speed of the gap after an impact below which the end of an accumulation may be near."""
    return max(SLOW * math.sqrt(tol), CHATTER_SPEED)


@lean_jit
def rest_columns(where, state, env, model, work, events, t, origin, tol):
    """The tangent at rest that begins at once; after an impact that leaves no speed, its instant moves as that of the impact.

    A motion that begins next to rest comes to rest soon, unless impacts lose nothing: then there is no derivative to the state.
    """
    mode, _ = accumulation(where, env, model, work, TINY, t, origin, tol)
    detail = RestDetail.AT_ONCE if mode == Mode.REST else RestDetail.NEVER_AGAIN
    model[ModelPart.TANGENT](EventCode.RESTING, detail, t, origin, float(where[Where.SIDE]), env, where[Where.PIECE], state)
    events[0][where[Where.EVENTS] - 1, 3] = detail
    record_shift(where, state, events)


@lean_jit
def release_columns(where, state, env, model, events, t, origin):
    """The tangent at a release. Its instant moves with the simple root of the contact acceleration; if a jump of the load
    releases the system, the instant is fixed."""
    breaks, piece = env[2], where[Where.PIECE]
    detail = ReleaseDetail.AT_A_ROOT if where[Where.SKIP] <= 3 else ReleaseDetail.AT_NONE
    if where[Where.SKIP] == 2 and piece > 0 and abs(breaks[piece - 1] - origin - t) < 1e-12 * max(1.0, abs(origin)):
        detail = ReleaseDetail.AT_A_JUMP
    model[ModelPart.TANGENT](EventCode.RELEASE, detail, t, origin, float(where[Where.SIDE]), env, piece, state)
    for j in range(where[Where.COLUMNS]):
        if math.isnan(state[State.COORDINATES + where[Where.OWN] + j]):
            state[State.COORDINATES + 2 * where[Where.DOF] + j] = math.nan
    record_shift(where, state, events)


@lean_jit
def decide_at_rest(where, state, settings, env, model, work, events, origin):
    """Decide whether a system at rest at the contact stays or leaves. Returns PAUSED to go on, or NOT_UNIQUE."""
    t = state[State.TIME]
    if not leave_or_stay(where, state, env, model, work, origin):
        return Status.NOT_UNIQUE
    if where[Where.MODE] == Mode.REST and where[Where.HELD] == 0:
        record_event(where, events, EventCode.RESTING, 0, 0, t, 0.0, 0.0)
        if where[Where.COLUMNS] > 0:
            rest_columns(where, state, env, model, work, events, t, origin, settings[Setting.TOLERANCE])
    if where[Where.MODE] == Mode.ARC and where[Where.HELD] != 0:
        record_event(where, events, EventCode.RELEASE, where[Where.SIDE], where[Where.SKIP], t, 0.0, 0.0)
        if where[Where.COLUMNS] > 0:
            release_columns(where, state, env, model, events, t, origin)
    where[Where.HELD] = 1 if where[Where.MODE] == Mode.REST else 0
    hold(where, state, model, work[Work.POSITIONS])
    return Status.PAUSED


@lean_jit
def end_accumulation(where, state, env, model, work, steps, events, origin, left, t_end):
    """Come to rest after the time `left`, within which all further impacts of the accumulation take place."""
    q, t = work[Work.POSITIONS], state[State.TIME]
    record_event(where, events, EventCode.RESTING, 0, 0, t + left, 0.0, 0.0)
    if where[Where.COLUMNS] > 0:
        side, piece = float(where[Where.SIDE]), where[Where.PIECE]
        model[ModelPart.TANGENT](EventCode.RESTING, RestDetail.AFTER_IMPACTS, t, origin, side, env, piece, state)
        record_shift(where, state, events)
    hold(where, state, model, q)
    state[State.TIME] = min(t + left, t_end)
    record_step(where, steps, 0, t, state[State.TIME] - t, q)


@lean_jit
def decide(where, state, settings, env, model, work, steps, events, origin, t_end):
    """Find the next mode of a system at the contact. Returns PAUSED to go on, or why the motion ends."""
    t, velocity, tol = state[State.TIME], state[State.COORDINATES + where[Where.DOF]], settings[Setting.TOLERANCE]
    if velocity == 0.0:
        return decide_at_rest(where, state, settings, env, model, work, events, origin)
    where[Where.MODE], where[Where.SKIP], where[Where.HELD] = Mode.ARC, 1, 0
    speed = rate_of(model, float(where[Where.SIDE])) * velocity
    if speed < slow_speed(tol):
        mode, left = accumulation(where, env, model, work, speed, t, origin, tol)
        if mode == Mode.REST and t + left > motion_end(where, settings):
            mode = Mode.ARC  # the motion ends before the accumulation does
        if mode == Mode.REST:
            end_accumulation(where, state, env, model, work, steps, events, origin, left, t_end)
        if mode == Mode.CHATTER:
            record_event(where, events, EventCode.CHATTERING, where[Where.SIDE], 0, t, velocity, velocity)
            forget(where, state)
            hold(where, state, model, work[Work.POSITIONS])
            state[State.CHATTER_SPEED], where[Where.SKIP] = speed, 0
        where[Where.MODE], where[Where.HELD] = mode, 0 if mode == Mode.ARC else 1
    return Status.PAUSED


@lean_jit
def impact(where, state, env, model, events, t, origin, before):
    """Apply the reset at time `t` to the velocity `before`. Returns PAUSED, or NO_IMPACT with the velocity left in the state."""
    side, piece, contact = float(where[Where.SIDE]), where[Where.PIECE], model[ModelPart.GEOMETRY][Geometry.CONTACT]
    state[State.TIME] = t
    set_state(where, state, contact, before)
    where[Where.MODE], where[Where.SKIP], where[Where.HELD] = Mode.CONTACT, 0, 0
    if rate_of(model, side) * before >= 0.0:  # a triple root of the gap within rounding: there is no closing speed
        set_state(where, state, contact, 0.0)
        record_event(where, events, EventCode.GRAZING, where[Where.SIDE], GrazingDetail.TRIPLE, t, before, 0.0)
        forget(where, state)
        return Status.PAUSED
    next_side, after = model[ModelPart.RESET](t, origin, before, side, env, piece)
    if not rate_of(model, next_side) * after >= 0.0:
        return Status.NO_IMPACT
    record_event(where, events, EventCode.IMPACT, where[Where.SIDE], int(next_side), t, before, after)
    if where[Where.COLUMNS] > 0:
        model[ModelPart.TANGENT](EventCode.IMPACT, 0, t, origin, side, env, piece, state)
        record_shift(where, state, events)
    where[Where.SIDE] = int(next_side)
    set_state(where, state, contact, after)
    return Status.PAUSED
