"""At the contact: rest and release, impacts, and what small impacts are the end of.

This text is compiled together with the kernel (see `kernel.py`, which says what `env`, `model` and `work` are).
"""

from __future__ import annotations

import math

from saltus.flow.kernel_layout import (
    AFTER_IMPACTS,
    ARC,
    AT_A_JUMP,
    AT_A_ROOT,
    AT_NONE,
    AT_ONCE,
    CHATTER,
    CHATTER_SPEED,
    CHATTERING,
    COLUMNS,
    CONTACT,
    DOF,
    END,
    EVENTS,
    FORCED,
    GRAZING,
    HELD,
    HORIZON,
    IMPACT,
    LAST,
    LENGTH,
    LOSSLESS,
    MODE,
    NEVER_AGAIN,
    NO_IMPACT,
    NOT_UNIQUE,
    ORDER,
    OWN,
    PAUSED,
    PERIOD,
    PIECE,
    RELEASE,
    REST,
    RESTING,
    SIDE,
    SIDES,
    SKIP,
    SLOW,
    SLOWLY,
    SPEED,
    STATE,
    TIME,
    TINY,
    TOLERANCE,
    TRIPLE,
    VISIT,
    ZERO,
)
from saltus.flow.steps import forget, record_event, record_shift, record_step
from saltus.taylor import jit

# --- compiled from here on -----------------------------------------------------------------------------------------------


@jit
def rate_of(model, side):
    """The gap's rate of change with the coordinate at contact, on a side."""
    return model[4][1] if side > 0.0 else model[4][2]


@jit
def hold(where, state, model, q):
    """Put the system at rest at contact."""
    state[STATE] = model[4][0]
    state[STATE + where[DOF]] = 0.0
    for k in range(q.shape[1]):
        q[0, k] = 0.0
    q[0, 0] = state[STATE]


@jit
def leading(coefficients, start, order):
    """The index from `start` on of the first coefficient that is not zero to within ZERO; `order` if there is none."""
    for k in range(start, order):
        if abs(coefficients[k]) > ZERO:
            return k
    return order


@jit
def contact_accelerations(where, env, model, work, t, origin):
    """Fill `b` with the Taylor series in time of the gap's second derivative at rest at contact, on side +1 and on side -1."""
    for i in range(min(where[SIDES], 2)):
        model[1](t, origin, 1.0 - 2.0 * i, env, where[PIECE], work[7][i], work[5], where[ORDER])


@jit
def leave_or_stay(where, state, env, model, work, origin):
    """Decide where a system at rest at contact goes: on an ARC, or into REST. False if that is not unique.

    On each side the first non-zero Taylor coefficient of the contact acceleration decides; `SKIP` names the side, if any, on
    which it has just been found to be zero. If both sides point outward the motion is not unique, unless the caller has
    named the side.
    """
    b, order, released, outward = work[7], where[ORDER], where[SKIP], 0
    contact_accelerations(where, env, model, work, state[TIME], origin)
    for i in range(where[SIDES]):
        side = 1 - 2 * i
        skip = leading(b[i], 1 if released == side else 0, order)
        if skip < order and b[i, skip] > 0.0 and (outward == 0 or where[FORCED] != where[SIDE]):
            outward += 1
            where[SIDE], where[SKIP] = side, skip + 2
    if outward == 2 and where[FORCED] != where[SIDE]:
        return False
    where[MODE] = ARC if outward > 0 else REST
    return True


@jit
def contact_pull(side, env, model, piece, work, t, origin):
    """The second derivative of the gap at rest at contact on one side, and its rate of change."""
    b, w = work[7], work[5]
    model[1](t, origin, side, env, piece, b[0], w, 1)
    return b[0, 0], b[0, 1]


@jit
def accumulation(where, env, model, work, speed, t, origin, tol):
    """What a small impact at the contact is the end of: (mode, time left).

    ARC: of nothing. REST: of a Zeno accumulation. From the gap's speed v on side s the time left is
    2 v (1/abs(a_s) + e1/abs(a_n)) / (1 - e1 e2), with a_s, a_n the contact accelerations on this and on the next side and e1, e2
    the factors of the next two impacts; its error is of the order of the time left, squared, times the relative rate of
    change of the accelerations. CHATTER: of impacts without loss, below CHATTER_SPEED, while the
    accelerations change slowly over two of them.
    """
    side, piece = float(where[SIDE]), where[PIECE]
    here, slope_here = contact_pull(side, env, model, piece, work, t, origin)
    if here >= 0.0:
        return ARC, 0.0
    next_side, after = model[2](t, origin, -speed / rate_of(model, side), side, env, piece)
    there, slope_there = contact_pull(next_side, env, model, piece, work, t, origin)
    if there >= 0.0 or after != after:
        return ARC, 0.0
    next_speed = rate_of(model, next_side) * after
    first, second = next_speed / speed, 0.0
    if first > 0.0:
        third_side, last = model[2](t, origin, -after, next_side, env, piece)
        second = rate_of(model, third_side) * last / next_speed
    loss = 1.0 - first * second
    cycle = 2.0 * speed * (1.0 / abs(here) + first / abs(there))
    change = 1.0 + abs(slope_here / here) + abs(slope_there / there)
    if abs(loss) < LOSSLESS:
        return CHATTER if speed < CHATTER_SPEED and cycle * change < SLOWLY else ARC, 0.0
    if not loss > 0.0:
        return ARC, 0.0
    left = cycle / loss
    return REST if 0.1 * left * left * change <= tol else ARC, left


@jit
def slow_speed(tol):
    """The speed of the gap after an impact below which it may be the end of an accumulation."""
    return max(SLOW * math.sqrt(tol), CHATTER_SPEED)


@jit
def rest_columns(where, state, env, model, work, events, t, origin, tol):
    """The tangent at rest, which begins at once: after an impact that leaves no speed it moves as that impact does.

    A state next to one at rest comes to rest soon, unless impacts lose nothing: then there is no derivative to the state.
    """
    mode, _ = accumulation(where, env, model, work, TINY, t, origin, tol)
    detail = AT_ONCE if mode == REST else NEVER_AGAIN
    model[5](RESTING, detail, t, origin, float(where[SIDE]), env, where[PIECE], state)
    events[0][where[EVENTS] - 1, 3] = detail
    record_shift(where, state, events)


@jit
def release_columns(where, state, env, model, events, t, origin):
    """How a release moves: with the contact acceleration's simple root, and not with a jump of the load, which has its time."""
    breaks, piece = env[2], where[PIECE]
    detail = AT_A_ROOT if where[SKIP] <= 3 else AT_NONE
    if where[SKIP] == 2 and piece > 0 and abs(breaks[piece - 1] - origin - t) < 1e-12 * max(1.0, abs(origin)):
        detail = AT_A_JUMP
    model[5](RELEASE, detail, t, origin, float(where[SIDE]), env, piece, state)
    for j in range(where[COLUMNS]):
        if math.isnan(state[STATE + where[OWN] + j]):
            state[STATE + 2 * where[DOF] + j] = math.nan
    record_shift(where, state, events)


@jit
def motion_end(where, settings):
    """The time at which the motion ends, as counted from the present forcing period."""
    if where[VISIT] > 0:
        return settings[HORIZON]
    return (where[LAST] - where[PERIOD]) * settings[LENGTH] + settings[END]


@jit
def decide(where, state, settings, env, model, work, steps, events, origin, t_end):
    """At contact: find the next mode. Returns PAUSED to go on, or why the motion ends."""
    q = work[0]
    t, velocity = state[TIME], state[STATE + where[DOF]]
    if velocity == 0.0:
        if not leave_or_stay(where, state, env, model, work, origin):
            return NOT_UNIQUE
        if where[MODE] == REST and where[HELD] == 0:
            record_event(where, events, RESTING, 0, 0, t, 0.0, 0.0)
            if where[COLUMNS] > 0:
                rest_columns(where, state, env, model, work, events, t, origin, settings[TOLERANCE])
        if where[MODE] == ARC and where[HELD] != 0:
            record_event(where, events, RELEASE, where[SIDE], where[SKIP], t, 0.0, 0.0)
            if where[COLUMNS] > 0:
                release_columns(where, state, env, model, events, t, origin)
        where[HELD] = 1 if where[MODE] == REST else 0
        hold(where, state, model, q)
        return PAUSED
    where[MODE], where[SKIP], where[HELD] = ARC, 1, 0
    speed = rate_of(model, float(where[SIDE])) * velocity
    if speed < slow_speed(settings[TOLERANCE]):
        mode, left = accumulation(where, env, model, work, speed, t, origin, settings[TOLERANCE])
        if mode == REST and t + left > motion_end(where, settings):
            mode = ARC  # the motion ends before the accumulation does
        if mode == REST:
            record_event(where, events, RESTING, 0, 0, t + left, 0.0, 0.0)
            if where[COLUMNS] > 0:
                model[5](RESTING, AFTER_IMPACTS, t, origin, float(where[SIDE]), env, where[PIECE], state)
                record_shift(where, state, events)
            hold(where, state, model, q)
            state[TIME] = min(t + left, t_end)
            record_step(where, steps, 0, t, state[TIME] - t, q)
        if mode == CHATTER:
            record_event(where, events, CHATTERING, where[SIDE], 0, t, velocity, velocity)
            forget(where, state)
            hold(where, state, model, q)
            state[SPEED], where[SKIP] = speed, 0
        where[MODE], where[HELD] = mode, 0 if mode == ARC else 1
    return PAUSED


@jit
def impact(where, state, env, model, events, t, origin, before):
    """Apply the reset at time `t` to the velocity `before`. Returns PAUSED, or NO_IMPACT with the velocity left in the state."""
    side, piece = float(where[SIDE]), where[PIECE]
    state[TIME], state[STATE], state[STATE + where[DOF]] = t, model[4][0], before
    where[MODE], where[SKIP], where[HELD] = CONTACT, 0, 0
    if rate_of(model, side) * before >= 0.0:  # a triple contact to within the working precision: no speed is left
        state[STATE + where[DOF]] = 0.0
        record_event(where, events, GRAZING, where[SIDE], TRIPLE, t, before, 0.0)
        forget(where, state)
        return PAUSED
    next_side, after = model[2](t, origin, before, side, env, piece)
    if not rate_of(model, next_side) * after >= 0.0:
        return NO_IMPACT
    record_event(where, events, IMPACT, where[SIDE], int(next_side), t, before, after)
    if where[COLUMNS] > 0:
        model[5](IMPACT, 0, t, origin, side, env, piece, state)
        record_shift(where, state, events)
    where[SIDE], state[STATE + where[DOF]] = int(next_side), after
    return PAUSED
