"""The events at the contact: impacts, rest and release, the ends of accumulations of impacts, and
chatter.

Its compiled part goes into one module with that of `kernel.py`.
"""

from __future__ import annotations

import math

import numpy as np

from saltus.flow.kernel.layout import (
    CHATTER_SPEED,
    GAUSS_NODES,
    GAUSS_WEIGHTS,
    LEAST_LOSS,
    LOSSLESS,
    SLOWLY,
    TINY,
    ZERO,
    EventCode,
    Geometry,
    GrazingDetail,
    Mode,
    ReleaseDetail,
    RestDetail,
    Status,
)
from saltus.flow.kernel.roots import horner, leading
from saltus.flow.kernel.steps import (
    breakpoint_time,
    columns_at_event,
    expand,
    forget,
    motion_end,
    natural_speed,
    piece_end,
    record_event,
    record_shift,
    record_step,
    set_corner_shifts,
    slow_share,
)
from saltus.taylor import lean_jit

# --- compiled from here on ---------------------------------------------------


@lean_jit
def rate_of(motion, side):
    """The gap's rate of change with the coordinate at contact, on a side."""
    return motion.geometry[Geometry.RATE_UP] if side > 0.0 else motion.geometry[Geometry.RATE_DOWN]


@lean_jit
def set_state(motion, position, velocity):
    """Put the first coordinate and its velocity into the state."""
    motion.coordinates[0] = position
    motion.velocities[0] = velocity


@lean_jit
def hold(motion):
    """Put the system at rest at contact."""
    q = motion.coordinate_series
    set_state(motion, motion.geometry[Geometry.CONTACT], 0.0)
    for i in range(motion.dof):
        for k in range(q.shape[1]):
            q[i, k] = 0.0
        q[i, 0] = motion.coordinates[i]


@lean_jit
def contact_accelerations(motion, t):
    """Fill `b` with the Taylor series in time of the gap's second derivative at rest at contact, on
    side +1 and on side -1.
    """
    b = motion.pull_series
    w = motion.recurrences
    for i in range(min(motion.sides, 2)):
        motion.contact_series(
            t, motion.origin, 1.0 - 2.0 * i, motion.env, motion.piece, b[i], w, motion.order
        )


@lean_jit
def note_press(motion):
    """Note the contact accelerations, and those that follow from their derivatives in the natural
    time of the load, for the natural scales."""
    span = motion.natural_time
    b = motion.pull_series
    for i in range(motion.sides):
        size = max(abs(b[i, 0]), abs(b[i, 1]) * span, 2.0 * abs(b[i, 2]) * span * span)
        motion.press = max(motion.press, size, motion.pull)


@lean_jit
def largest_terms(motion, side):
    """The largest acceleration of the first coordinate that a contact has held back so far."""
    largest = max(motion.press, motion.pull)
    return largest / abs(rate_of(motion, side)) if largest > 0.0 else 0.0


@lean_jit
def leave_or_stay(motion):
    """Decide whether a system at rest at the contact leaves it on an ARC or stays in REST. False if
    that is not unique.

    On each side the sign of the first non-zero Taylor coefficient of the contact acceleration
    decides; `SKIP` holds the side, if any, on which the acceleration has just been found to be
    zero. If both sides point outward the motion is not unique, unless the caller has given the side
    (`LEAVE_BY`).
    """
    b = motion.pull_series
    order = motion.order
    released = motion.skip
    outward = 0
    contact_accelerations(motion, motion.time)
    note_press(motion)
    for i in range(motion.sides):
        side = 1 - 2 * i
        skip = leading(b[i], 1 if released == side else 0, order, ZERO, motion.press, 0, 0.0)
        if skip < order and b[i, skip] > 0.0 and (outward == 0 or motion.leave_by != motion.side):
            outward += 1
            motion.side = side
            motion.skip = skip + 2
    if outward == 2 and motion.leave_by != motion.side:
        return False
    motion.mode = Mode.ARC if outward > 0 else Mode.REST
    return True


@lean_jit
def contact_pull(motion, side, t):
    """The second derivative of the gap at rest at contact on one side, and the relative rates at
    which it changes and bends: over a time t by t times the first and by the square of t times the
    second."""
    b = motion.pull_series
    w = motion.recurrences
    motion.contact_series(t, motion.origin, side, motion.env, motion.piece, b[0], w, 2)
    size = abs(b[0, 0])
    if size == 0.0:
        return 0.0, 0.0, 0.0
    return b[0, 0], abs(b[0, 1]) / size, math.sqrt(abs(b[0, 2]) / size)


@lean_jit
def flight_change(motion, side, t):
    """The rates at which the motion itself changes its acceleration after an impact: by its damping,
    and by its stiffness, where the change over a time t is the square of rate times t. A load that
    is slower than both does not show it.
    """
    b = motion.pull_series[0]
    w = motion.recurrences
    motion.contact_series(t, motion.origin, side, motion.env, motion.piece, b, w, 2)
    expand(motion, t, side, 2)
    rate = rate_of(motion, side)
    a = motion.acceleration_series[0]
    damps = abs(rate * a[1] - b[1])
    bends = 2.0 * abs(rate * a[2] - b[2])
    return damps / abs(b[0]), math.sqrt(bends / abs(b[0]))


@lean_jit
def accumulation(motion, speed, t, tol, seen):
    """The mode that follows a small impact, and, for an accumulation, the time left until its end.

    REST: impacts accumulate soon. From the gap's speed v on side s the time left is 2 v (1/abs(a_s)
    + e1/abs(a_n)) / (1 - e1 e2), with a_s, a_n the contact accelerations on this and on the next
    side and e1, e2 the factors of the next two impacts; its error is of the order of the square of
    the time left. Times are counted in units of the time in which the accelerations change. Where
    they do not change the time left is exact. No breakpoint of the records may come before, and v
    must be less than `seen` times the lost share of the speed, above which impacts are to be seen.
    CHATTER: impacts lose nothing, are slower than CHATTER_SPEED, and the accelerations change
    slowly over two of them. ARC: neither of these.
    """
    side = float(motion.side)
    piece = motion.piece
    here, slope_here, bend_here = contact_pull(motion, side, t)
    if here >= 0.0:
        return Mode.ARC, 0.0
    next_side, after = motion.reset(
        t, motion.origin, -speed / rate_of(motion, side), side, motion.env, piece
    )
    there, slope_there, bend_there = contact_pull(motion, next_side, t)
    if there >= 0.0 or after != after:
        return Mode.ARC, 0.0
    motion.pull = max(motion.pull, abs(here), abs(there))
    next_speed = rate_of(motion, next_side) * after
    first = next_speed / speed
    second = 0.0
    if first > 0.0:
        third_side, last = motion.reset(t, motion.origin, -after, next_side, motion.env, piece)
        second = rate_of(motion, third_side) * last / next_speed
    loss = 1.0 - first * second
    cycle = 2.0 * speed * (1.0 / abs(here) + first / abs(there))
    damps, bends = flight_change(motion, side, t)
    slopes = slope_here + slope_there
    bend = max(bend_here, bend_there)
    if abs(loss) < LOSSLESS:
        slow = speed < CHATTER_SPEED * natural_speed(motion)
        # at the top of a flight of the time t stiffness has changed it by the share (t bends)^2 / 8
        slow = slow and cycle * (damps + slopes) + (cycle * bend) ** 2 < SLOWLY
        slow = slow and 0.125 * (cycle * bends) ** 2 < SLOWLY
        return Mode.CHATTER if slow else Mode.ARC, 0.0
    if not loss > 0.0:
        return Mode.ARC, 0.0
    left = cycle / loss
    change = max(damps, bends, math.sqrt(2.0) * bend) + slopes
    exact = 0.1 * (left * change) ** 2 <= tol and t + left <= piece_end(motion)
    lost = max(LEAST_LOSS, 1.0 - math.sqrt(max(first * second, 0.0)))
    return Mode.REST if exact and speed < seen * lost else Mode.ARC, left


@lean_jit
def slow_speed(motion):
    """The speed of the gap after an impact below which the end of an accumulation, or of chatter,
    may be near."""
    return max(slow_share(motion) * motion.fastest, CHATTER_SPEED * natural_speed(motion))


@lean_jit
def rest_columns(motion, t, tol):
    """The tangent at rest that begins at once; after an impact that leaves no speed, its instant
    moves as that of the impact.

    A motion that begins next to rest comes to rest soon, unless impacts lose nothing: then there is
    no derivative to the state.
    """
    mode, _ = accumulation(motion, TINY, t, tol, np.inf)
    detail = RestDetail.AT_ONCE if mode == Mode.REST else RestDetail.NEVER_AGAIN
    columns_at_event(motion, EventCode.REST, detail, t, float(motion.side))
    motion.event_labels[motion.recorded_events - 1, 3] = detail
    record_shift(motion)


@lean_jit
def release_columns(motion, t):
    """The tangent at a release. Its instant moves with the simple root of the contact acceleration;
    if a jump of the load releases the system, the instant is fixed."""
    piece = motion.piece
    detail = ReleaseDetail.AT_A_ROOT if motion.skip <= 3 else ReleaseDetail.AT_NONE
    if (
        motion.skip == 2
        and piece > 0
        and abs(breakpoint_time(motion, piece - 1) - t) <= 1e-12 * (abs(t) + abs(motion.origin))
    ):
        detail = ReleaseDetail.AT_A_JUMP
    columns_at_event(motion, EventCode.RELEASE, detail, t, float(motion.side))
    if detail == ReleaseDetail.AT_A_JUMP and motion.corner_column > 0:
        set_corner_shifts(motion)
        expand(motion, t, float(motion.side), 0)
        place = motion.own * motion.corner_column
        shift = motion.shifts[motion.corner_column - 1]
        motion.velocities[place] -= shift * motion.acceleration_series[0, 0]
    for j in range(motion.columns):
        if math.isnan(motion.coordinates[motion.own + j]):
            motion.shifts[j] = math.nan
    record_shift(motion)


@lean_jit
def decide_at_rest(motion):
    """Decide whether a system at rest at the contact stays or leaves.

    Returns PAUSED to go on, or NOT_UNIQUE.
    """
    t = motion.time
    if not leave_or_stay(motion):
        return Status.NOT_UNIQUE
    if motion.mode == Mode.REST and motion.rested == 0:
        record_event(motion, EventCode.REST, 0, t, 0.0, 0.0)
        if motion.columns > 0:
            rest_columns(motion, t, motion.tolerance)
    if motion.mode == Mode.ARC and motion.rested != 0:
        record_event(motion, EventCode.RELEASE, motion.skip, t, 0.0, 0.0)
        if motion.columns > 0:
            release_columns(motion, t)
    motion.rested = 1 if motion.mode == Mode.REST else 0
    hold(motion)
    return Status.PAUSED


@lean_jit
def end_accumulation(motion, left, t_end):
    """Come to rest after the time `left`, within which all further impacts of the accumulation take
    place.
    """
    t = motion.time
    record_event(motion, EventCode.REST, 0, t + left, 0.0, 0.0)
    if motion.columns > 0:
        columns_at_event(motion, EventCode.REST, RestDetail.AFTER_IMPACTS, t, float(motion.side))
        record_shift(motion)
    hold(motion)
    motion.time = min(t + left, t_end)
    record_step(motion, 0, t, motion.time - t)


@lean_jit
def decide(motion, t_end):
    """Find the next mode of a system at the contact.

    Returns PAUSED to go on, or why the motion ends.
    """
    t = motion.time
    velocity = motion.velocities[0]
    tol = motion.tolerance
    if velocity == 0.0:
        return decide_at_rest(motion)
    motion.mode = Mode.ARC
    motion.skip = 1
    motion.rested = 0
    speed = rate_of(motion, float(motion.side)) * velocity
    if motion.pull == 0.0:  # the motion begins at the contact
        for i in range(motion.sides):
            pull, _, _ = contact_pull(motion, 1.0 - 2.0 * i, t)
            motion.pull = max(motion.pull, abs(pull))
    if speed < slow_speed(motion):
        mode, left = accumulation(motion, speed, t, tol, slow_share(motion) * motion.fastest)
        if mode == Mode.REST and t + left > motion_end(motion):
            mode = Mode.ARC  # the motion ends before the accumulation does
        if mode == Mode.REST:
            end_accumulation(motion, left, t_end)
        if mode == Mode.CHATTER:
            record_event(motion, EventCode.CHATTER, 0, t, velocity, velocity)
            forget(motion)
            hold(motion)
            motion.chatter_speed = speed
            motion.skip = 0
        motion.mode = mode
        motion.rested = 0 if mode == Mode.ARC else 1
    return Status.PAUSED


@lean_jit
def impact(motion, t, before):
    """Apply the reset at time `t` to the velocity `before`.

    Returns PAUSED, or NO_IMPACT with the velocity left in the state.
    """
    side = float(motion.side)
    piece = motion.piece
    contact = motion.geometry[Geometry.CONTACT]
    motion.time = t
    set_state(motion, contact, before)
    motion.mode = Mode.CONTACT
    motion.skip = 0
    motion.rested = 0
    # a triple root of the gap within rounding: there is no closing speed
    if rate_of(motion, side) * before >= 0.0:
        set_state(motion, contact, 0.0)
        record_event(motion, EventCode.GRAZING, GrazingDetail.TRIPLE, t, before, 0.0)
        forget(motion)
        return Status.PAUSED
    next_side, after = motion.reset(t, motion.origin, before, side, motion.env, piece)
    if not rate_of(motion, next_side) * after >= 0.0:
        return Status.NO_IMPACT
    record_event(motion, EventCode.IMPACT, int(next_side), t, before, after)
    if motion.columns > 0:
        columns_at_event(motion, EventCode.IMPACT, 0, t, side)
        record_shift(motion)
    motion.side = int(next_side)
    set_state(motion, contact, after)
    return Status.PAUSED


# --- chatter: the averaged law of impacts that lose nothing ------------------
#
# The speeds v_s on the sides s are proportional to one speed v. The action v^2 sum v_s / abs(a_s)
# decays with the mean damping over a cycle, sum g_s v_s / abs(a_s) / sum v_s / abs(a_s), under any
# load that presses both contacts. The phase is lost.


@lean_jit
def chatter_sums(motion, h, x, factor, t):
    """The sums over the sides of g v / abs(a) and v / abs(a), with the damping g, for unit speed,
    at the share x of a step.
    """
    b = motion.pull_series
    order = motion.order
    damping = 0.0
    duration = 0.0
    for i in range(motion.sides):
        side = 1.0 - 2.0 * i
        pull = abs(horner(b[i], order, x * h))
        share = (1.0 if side == motion.side else factor) / pull
        damping += share * motion.contact_damping(
            t + x * h, motion.origin, side, motion.env, motion.piece
        )
        duration += share
    return damping, duration


@lean_jit
def chatter_decay(motion, h):
    """Advance the chatter speed over a step: the action, v^2 times the duration sum v_s/abs(a_s),
    decays as the mean damping.
    """
    t = motion.time
    side = float(motion.side)
    contact_accelerations(motion, t)
    next_side, after = motion.reset(
        t,
        motion.origin,
        -motion.chatter_speed / rate_of(motion, side),
        side,
        motion.env,
        motion.piece,
    )
    factor = rate_of(motion, next_side) * after / motion.chatter_speed
    decay = 0.0
    for j in range(GAUSS_NODES.size):
        damping, duration = chatter_sums(motion, h, GAUSS_NODES[j], factor, t)
        decay += GAUSS_WEIGHTS[j] * h * damping / duration
    _, before = chatter_sums(motion, h, 0.0, factor, t)
    _, after_step = chatter_sums(motion, h, 1.0, factor, t)
    motion.chatter_speed *= (math.exp(-decay) * before / after_step) ** (1.0 / 3.0)
