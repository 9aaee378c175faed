"""The robust scalar flow: arcs, impacts, rest and release, accumulations of impacts, chatter.

Together with `roots.py` it is compiled once, for every model: the functions that `emit.py` generates for one structure,
`series`, `contact_series`, `reset` and `contact_damping`, are its arguments. It uses plain loops and the decorator `jit`.

A motion is in one of four modes. ARC: a smooth motion on one side. CONTACT: at the contact, to be decided. REST: held at the
contact until an acceleration points outward. CHATTER: impacts without loss, too small and too many to follow one by one.

`env` = (parameters, constants, record breakpoints, record table). `model` = (the four functions; the coordinate at contact and
the gap's rate of change with the coordinate there, on sides +1 and -1). `work` = (q, v, a, g, m, w, poly, b, end): the Taylor
coefficients of coordinates, velocities, accelerations, gap and margins, the workspace of their recurrences, a scaled
polynomial, the contact accelerations of both sides, and the first five once more at the end of a step.
"""

from __future__ import annotations

import math

import numpy as np

from saltus.flow.jit import ADVANCE, jit
from saltus.flow.jit import not_here as cached_jit
from saltus.flow.roots import NEVER, SIMPLE, first_root, horner, scale_gap

# --- compiled from here on -----------------------------------------------------------------------------------------------

ARC, CONTACT, REST, CHATTER = 0, 1, 2, 3  # modes
DONE, FULL, PAUSED, NOT_UNIQUE, NO_IMPACT, NOT_FINITE, STALLED, LIMITED = 0, 1, 2, 3, 4, 5, 6, 7  # why `advance` returns
CROSSING, GRAZING, RESTING, RELEASE, CHATTERING, LIMIT = 0, 1, 2, 3, 4, 5  # events
PERIOD, MODE, SIDE, SKIP, PIECE, STEPS = 0, 1, 2, 3, 4, 5  # in `where`,
EVENTS, LAST, ORDER, DENSE, FORCED, HELD = 6, 7, 8, 9, 10, 11
DOF, STOPS, ROWS, SIDES = 12, 13, 14, 15  # and the structure's: coordinates, margins, workspace rows, sides of the contact,
STEEP = 16  # whether it has functions whose bends a series may not see
TIME, SPEED, STATE = 0, 1, 2  # in `state`: local time, chatter speed, then the coordinates and the velocities
LENGTH, END, TOLERANCE = 0, 1, 2  # in `settings`: the forcing period, the local time at the end, the tolerance

SAFETY = 0.9  # of a step: its error is then a tenth of tol, and 1000 periods add up to a drift in energy below 1e-12
DEFECT = 100.0  # between a series and the equation at the end of a step, in tol size / h: sound steps stay below 4
SMALLEST = 1e-6  # size below which a step's error is absolute, not relative
ZERO = 1e-14  # an acceleration at contact below this is zero: it is a difference of loads of order 1
EXACT = 1e-15  # at rest a small error of the load would decide whether a touch is a release, and there steps cost little
SLOW = 1e-2  # a faster impact cannot be the end of an accumulation, and is not tested for it
CHATTER_SPEED = 1e-5  # the averaged law is then wrong by 5e-5 of the speed; following on takes 1e5 impacts a unit of time
LOSSLESS = 1e-12  # a loss of speed over two impacts below this is rounding
BATCH = 100_000  # passes of the loop before the caller may look (Ctrl-C)
GAUSS_NODES = np.array([0.0694318442029737, 0.3300094782075719, 0.6699905217924281, 0.9305681557970263])
GAUSS_WEIGHTS = np.array([0.1739274225687269, 0.3260725774312731, 0.3260725774312731, 0.1739274225687269])


@jit
def step_size(coefficients, order, size, tol):
    """h such that the last two terms of the series are below tol, relative to `size`."""
    last, before = 0.0, 0.0
    for i in range(coefficients.shape[0]):
        last = max(last, abs(coefficients[i, order]))
        before = max(before, abs(coefficients[i, order - 1]))
    bound = max(size, SMALLEST) * tol
    h = (bound / last) ** (1.0 / order) if last > 0.0 else np.inf
    return SAFETY * (min(h, (bound / before) ** (1.0 / (order - 1))) if before > 0.0 else h)


@jit
def leaps(where, env, model, work, t, origin, h, size, tol):
    """Whether a step goes past what its series cannot see, such as the bend of a saturated tanh, below rounding from afar.

    The acceleration at the end of the step is then not the one that the series gives there.
    """
    q, v, a, _, _, w, _, _, (q_end, v_end, a_end, g_end, m_end) = work
    order = where[ORDER]
    for i in range(where[DOF]):
        q_end[i, 0], v_end[i, 0] = horner(q[i], order, h), horner(v[i], order, h)
    model[0](t + h, origin, float(where[SIDE]), env, where[PIECE], q_end, v_end, a_end, g_end, m_end, w, 0)
    defect = 0.0
    for i in range(where[DOF]):
        defect = max(defect, abs(a_end[i, 0] - horner(a[i], order, h)))
    return defect > DEFECT * tol * max(size, SMALLEST) / h


@jit
def record_event(where, events, kind, side, detail, t, before, after):
    """Append an event: (period, kind, side, detail) and (local time, velocity before, velocity after)."""
    labels, values = events
    i = where[EVENTS]
    labels[i, 0], labels[i, 1], labels[i, 2], labels[i, 3] = where[PERIOD], kind, side, detail
    values[i, 0], values[i, 1], values[i, 2] = t, before, after
    where[EVENTS] = i + 1


@jit
def record_step(where, steps, side, t, h, q):
    """Append a step of the dense output: where it starts, how long it is, and the coordinates' series."""
    if where[DENSE] == 0:
        return
    labels, spans, coefficients = steps
    i = where[STEPS]
    labels[i, 0], labels[i, 1] = where[PERIOD], side
    spans[i, 0], spans[i, 1] = t, h
    for d in range(q.shape[0]):
        for k in range(where[ORDER] + 2):
            coefficients[i, d, k] = q[d, k]
    where[STEPS] = i + 1


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
    change of the accelerations. CHATTER: of impacts without loss, below CHATTER_SPEED.
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
    if abs(loss) < LOSSLESS:
        return CHATTER if speed < CHATTER_SPEED else ARC, 0.0
    if not loss > 0.0:
        return ARC, 0.0
    left = 2.0 * speed * (1.0 / abs(here) + first / abs(there)) / loss
    change = 1.0 + abs(slope_here / here) + abs(slope_there / there)
    return REST if 0.1 * left * left * change <= tol else ARC, left


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
        if where[MODE] == ARC and where[HELD] != 0:
            record_event(where, events, RELEASE, where[SIDE], where[SKIP], t, 0.0, 0.0)
        where[HELD] = 1 if where[MODE] == REST else 0
        hold(where, state, model, q)
        return PAUSED
    where[MODE], where[SKIP], where[HELD] = ARC, 1, 0
    speed = rate_of(model, float(where[SIDE])) * velocity
    if speed < SLOW:
        mode, left = accumulation(where, env, model, work, speed, t, origin, settings[TOLERANCE])
        if mode == REST and where[PERIOD] == where[LAST] and t + left > t_end:
            mode = ARC  # the motion ends before the accumulation does
        if mode == REST:
            record_event(where, events, RESTING, 0, 0, t + left, 0.0, 0.0)
            hold(where, state, model, q)
            state[TIME] = min(t + left, t_end)
            record_step(where, steps, 0, t, state[TIME] - t, q)
        if mode == CHATTER:
            record_event(where, events, CHATTERING, where[SIDE], 0, t, velocity, velocity)
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
        record_event(where, events, GRAZING, where[SIDE], 0, t, before, 0.0)
        return PAUSED
    next_side, after = model[2](t, origin, before, side, env, piece)
    if not rate_of(model, next_side) * after >= 0.0:
        return NO_IMPACT
    record_event(where, events, CROSSING, where[SIDE], int(next_side), t, before, after)
    where[SIDE], state[STATE + where[DOF]] = int(next_side), after
    return PAUSED


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
        size = max(size, abs(q[i, 0]), abs(v[i, 0]))
    model[0](t, origin, float(where[SIDE]), env, where[PIECE], q, v, a, g, m, w, order)
    natural = step_size(v, order, size, settings[TOLERANCE])
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
        finite = finite and math.isfinite(state[STATE + i]) and math.isfinite(state[STATE + where[DOF] + i])
    if not finite or not h >= 0.0:
        return NOT_FINITE
    state[TIME] = target if hit < 0 and h == target - t else t + tau
    where[SKIP] = 0
    if hit == where[STOPS]:
        return impact(where, state, env, model, events, state[TIME], origin, state[STATE + where[DOF]])
    if hit >= 0:
        record_event(where, events, LIMIT, where[SIDE], hit, state[TIME], state[STATE + where[DOF]], state[STATE + where[DOF]])
        return LIMITED
    return PAUSED if state[TIME] > t or h == target - t else STALLED


@jit
def chatter_sums(where, env, model, work, h, x, factor, t, origin):
    """The sums over the sides of g v / abs(a) and v / abs(a), g the damping, for unit speed, at x of a step."""
    b, order = work[7], where[ORDER]
    damping, duration = 0.0, 0.0
    for i in range(where[SIDES]):
        side = 1.0 - 2.0 * i
        pull = abs(horner(b[i], order, x * h))
        share = (1.0 if side == where[SIDE] else factor) / pull
        damping += share * model[3](t + x * h, origin, side, env, where[PIECE])
        duration += share
    return damping, duration


@jit
def chatter_decay(where, state, env, model, work, h, origin):
    """Advance the chatter speed over a step: the action, v^2 times the duration sum v_s/abs(a_s), decays as the mean damping."""
    t, side = state[TIME], float(where[SIDE])
    contact_accelerations(where, env, model, work, t, origin)
    next_side, after = model[2](t, origin, -state[SPEED] / rate_of(model, side), side, env, where[PIECE])
    factor = rate_of(model, next_side) * after / state[SPEED]
    decay = 0.0
    for j in range(GAUSS_NODES.size):
        damping, duration = chatter_sums(where, env, model, work, h, GAUSS_NODES[j], factor, t, origin)
        decay += GAUSS_WEIGHTS[j] * h * damping / duration
    _, before = chatter_sums(where, env, model, work, h, 0.0, factor, t, origin)
    _, after_step = chatter_sums(where, env, model, work, h, 1.0, factor, t, origin)
    state[SPEED] *= (math.exp(-decay) * before / after_step) ** (1.0 / 3.0)


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
    for _ in range(BATCH):
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
