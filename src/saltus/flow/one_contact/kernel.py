"""The scalar flow of one motion: arcs, impacts, rest and release, accumulations of impacts,
chatter.

The compiled parts of `kernel/layout.py`, `kernel/roots.py`, `kernel/steps.py`, `impacts.py`, this
file and `programs/loop.py`, which calls it, are compiled as one module, once for all models with at
most one contact: the functions that are generated for a structure (see `programs/compiled.py`) are in
its memory. These files therefore consist of plain loops under the decorators of `saltus.taylor`,
and share one namespace. All of a motion's memory is in `motion` (see `kernel/memory.py`).

A motion is in one of the modes of `Mode`. If a tangent is asked for (see
`kernel/event_derivatives.py`), its columns are further coordinates, which `series` expands with the
others. The steps are chosen by the motion itself, so that its impacts are the same to the last bit
with and without tangent, except where a column needs shorter steps. At an event the structure's
function `tangent` computes the new columns and the shift of the event, which are nan where there is
no derivative.
"""

from __future__ import annotations

import math

import numpy as np

from saltus.flow.kernel.layout import (
    CHATTER_SPEED,
    EXACT,
    ZERO,
    EventCode,
    Geometry,
    GrazingDetail,
    Mode,
    Status,
)
from saltus.flow.kernel.memory import OneContactParts
from saltus.flow.kernel.roots import (
    NEVER,
    SIMPLE,
    contact_root,
    first_root,
    horner,
    leading,
    margin_root,
    scale_gap,
    value_and_slope,
)
from saltus.flow.kernel.steps import (
    column_step,
    columns_at_event,
    columns_from_corner,
    columns_to_corner,
    expand,
    forget,
    is_away,
    leaps,
    log_of_tolerance,
    move,
    natural_speed,
    note_impact,
    record_event,
    record_shift,
    record_step,
    shortest_step,
    step_arrays,
    step_size,
)
from saltus.flow.one_contact.impacts import (
    chatter_decay,
    contact_accelerations,
    decide,
    hold,
    impact,
    largest_terms,
    note_press,
    rate_of,
)
from saltus.taylor import jit, lean_jit

# --- compiled from here on ---------------------------------------------------


@lean_jit
def arc_step(motion, t, target, size):
    """The step that the series of an arc allow, beyond `target` or not."""
    log_tol = log_of_tolerance(motion)
    natural = step_size(motion.velocity_series[: motion.own], motion.order, size, log_tol)
    if motion.columns > 0:
        natural = min(natural, column_step(motion))
    side = float(motion.side)
    while motion.checked > 0 and leaps(
        motion, t, side, min(natural, target - t), size, largest_terms(motion, side)
    ):
        natural = 0.5 * min(natural, target - t)
    return natural


@lean_jit
def first_margin(motion, h, hit, first):
    """The margin that reaches zero first within the step, and its instant, if this is before
    `first`; else `hit` and `first`.
    """
    for j in range(motion.margin_count):
        u = margin_root(motion.margin_series[j], motion.order, h, motion.polynomial)
        if u < first:
            hit = j
            first = u
    return hit, first


@lean_jit
def passes(motion, closes, tau):
    """Whether, at the end of a step of the length `tau`, the motion is beyond the contact, or away
    from it where it `closes`, by more than rounding.
    """
    contact = motion.geometry[Geometry.CONTACT]
    gap = motion.coordinates[0] - contact
    gap = -abs(gap) if closes else math.copysign(gap, gap * rate_of(motion, float(motion.side)))
    return gap < 0.0 and is_away(motion, gap, 0, contact, tau)


@lean_jit
def arc(motion, target):
    """One step of a smooth motion, up to the first zero of the gap or of a margin.

    Returns PAUSED, or why the motion ends.
    """
    order = motion.order
    t = motion.time
    side = motion.side
    poly = motion.polynomial
    size = expand(motion, t, float(side), order)
    natural = arc_step(motion, t, target, size)
    h = min(natural, target - t)
    hit = -1
    first = NEVER
    touch = NEVER
    if motion.sides > 0:
        kind, u, touch = contact_root(motion.gap_series, motion.skip, order, h, poly)
        if kind == SIMPLE:
            hit = motion.margin_count
            first = u
        elif (
            0.75 < touch <= 1.0 and h == natural
        ):  # a touch near the end of a step could be found again in the next one
            h, touch = 0.5 * h, NEVER
    hit, first = first_margin(motion, h, hit, first)
    if touch < first and touch <= 1.0:
        record_event(
            motion,
            EventCode.GRAZING,
            GrazingDetail.TOUCH,
            t + touch * h,
            horner(motion.velocity_series[0], order, touch * h),
            0.0,
        )
    tau = first * h if hit >= 0 else h
    record_step(motion, side, t, tau)
    if hit == motion.margin_count:
        rate = rate_of(motion, float(side))
        speed, pull = value_and_slope(motion.velocity_series[0], order, tau)
        note_impact(motion, rate * speed, rate * pull)
    if not move(motion, tau, motion.dof) or not h >= 0.0:
        return Status.NOT_FINITE
    if motion.sides > 0 and passes(motion, hit == motion.margin_count, tau):
        return Status.PASSED
    motion.time = target if hit < 0 and h == target - t else t + tau
    motion.skip = 0
    velocity = motion.velocities[0]
    if hit == motion.margin_count:
        return impact(motion, motion.time, velocity)
    if hit >= 0:
        record_event(motion, EventCode.LIMIT, hit, motion.time, velocity, velocity)
        if motion.columns > 0:
            columns_at_event(motion, EventCode.LIMIT, hit, motion.time, float(side))
            record_shift(motion)
        return Status.LIMITED
    goes_on = natural > shortest_step(motion) or h == target - t
    return Status.PAUSED if goes_on else Status.STALLED


@lean_jit
def first_release(motion, b, order, h, poly):
    """The first instant at which a contact acceleration points outward, as a share of the step, and
    its side; 0 and 0 if one does already at the start."""
    first = NEVER
    released = 0
    for i in range(motion.sides):
        skip = leading(b[i], 0, order, ZERO, motion.press, 0, 0.0)
        if skip < order and b[i, skip] > 0.0:
            first = 0.0
            released = 0
        elif skip < order:
            for k in range(order + 1):
                b[i, k] = -b[i, k]
            scale_gap(b[i], skip, order, h, poly)
            kind, u, _ = first_root(poly, order - skip)
            if kind == SIMPLE and u < first:
                first = u
                released = 1 - 2 * i
    return first, released


@lean_jit
def wait_at_contact(motion, target):
    """One step of REST or CHATTER, up to the first instant at which a contact acceleration points
    outward.
    """
    b = motion.pull_series
    order = motion.order
    t = motion.time
    h = target - t
    contact_accelerations(motion, t)
    note_press(motion)
    for i in range(motion.sides):
        size = max(motion.press, abs(b[i, 0]))
        if size > 0.0:
            log_tol = math.log(min(motion.tolerance, EXACT))
            h = min(h, step_size(b[i : i + 1], order, size, log_tol))
    first, released = first_release(motion, b, order, h, motion.polynomial)
    tau = min(first, 1.0) * h
    if motion.mode == Mode.CHATTER and tau > 0.0:
        chatter_decay(motion, tau)
    hold(motion)
    record_step(motion, 0, t, tau)
    if first > 1.0:
        motion.time = target if h == target - t else t + tau
        grown = motion.chatter_speed > 2.0 * CHATTER_SPEED * natural_speed(motion)
        # the impacts are followed one by one from here on
        if motion.mode == Mode.CHATTER and grown:
            motion.mode = Mode.CONTACT
            motion.skip = 0
            motion.rested = 0
            velocity = motion.chatter_speed / rate_of(motion, float(motion.side))
            motion.velocities[0] = velocity
    else:
        motion.mode = Mode.CONTACT
        motion.skip = released
        # time must increase
        motion.time = t + tau if t + tau > t or released == 0 else np.nextafter(t, np.inf)


@lean_jit
def begin(motion):
    """Nothing has to be prepared for the steps of a call."""


@lean_jit
def settle(motion):
    """Nothing is left to do before a call returns."""


@lean_jit
def is_smooth(motion):
    """Whether a motion is on a smooth arc, which begins at most with a gap that has just opened."""
    return motion.mode == Mode.ARC and motion.skip <= 1


@lean_jit
def spare_events(motion):
    """The number of events that one pass may record at most."""
    return 4


@lean_jit
def waits(motion):
    """Whether a decision is due before the motion may end."""
    return False


@lean_jit
def at_corner(motion):
    """Transform the columns where the load has just had a corner; those of a motion at rest do not
    change."""
    if motion.mode == Mode.ARC:
        columns_to_corner(motion, float(motion.side))
        columns_from_corner(motion, float(motion.side))
    elif motion.mode == Mode.CONTACT:  # an impact at the same instant
        forget(motion)


@lean_jit
def one_pass(motion, target, t_end):
    """A step up to `target` at most, or a decision. Returns PAUSED, or why the motion ends."""
    if motion.mode == Mode.ARC:
        return arc(motion, target)
    if motion.sides > 0 and motion.mode == Mode.CONTACT:
        return decide(motion, t_end)
    if motion.sides > 0:
        wait_at_contact(motion, target)
    return Status.PAUSED


@jit
def parts_of(numbers, state, env, functions, rows, buffers):
    """The memory of a motion but for its numbers as one named tuple; there are no rows of
    contacts.
    """
    return OneContactParts(
        state, env, env[0], env[2], functions, step_arrays(numbers), buffers[0], buffers[1]
    )
