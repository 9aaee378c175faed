"""The saltation of the tangent's columns at the events of several contacts (see
`taylor/tracing.py`).

An event's instant depends on the parameter c of a column. The columns (u, z) of coordinates and
velocities are first taken to the derivatives of the state *at the event*, u + v dt and z + a dt.
Here dt is the shift of the event, and a the acceleration before it. The event's map is
differentiated there, with the contacts that act. Once it is known which contacts are closed
afterwards, the columns are taken back to a fixed time with the velocity and acceleration after the
event. Nothing jumps at a simple release, so that its saltation is the identity.

Its compiled part goes into one module with that of `kernel.py`; the words of `motion` are those of
`flow/kernel/memory.py`.
"""

from __future__ import annotations

import math

import numpy as np

from saltus.flow.contacts.complementarity import (
    acting,
    fill_rubbing,
    invert,
    is_pressed,
    push,
    tell_instant,
)
from saltus.flow.contacts.held_rows import fill_pushes, left_of, onto, row_lift
from saltus.flow.contacts.impacts import frozen_accumulation, jump_place, press_of
from saltus.flow.contacts.rows import gives, row_series
from saltus.flow.kernel.contact_layout import (
    APART,
    RELATIVE_STEP,
    TIED,
    ImpactDetail,
    PartColumn,
    Reached,
    Touch,
    copy_all,
    restitution,
)
from saltus.flow.kernel.layout import EventCode
from saltus.flow.kernel.steps import columns_at_event, expand, move_columns
from saltus.taylor import jit, lean_jit

# --- compiled from here on ---------------------------------------------------


@lean_jit
def fill_slopes(motion):
    """The derivatives of mass matrix, E and positions along each column."""
    tell_instant(motion)
    motion.matrix_slopes(motion.env, motion.piece, motion.state, motion.slopes)


@lean_jit
def slope(motion, j, place):
    """The derivative of one of the entries of `NUMBERS` along column j."""
    return motion.slopes[j * motion.solver_numbers.size + place]


@lean_jit
def gap_derivative(motion, j, i):
    """The derivative of a contact's gap along column j."""
    if motion.multipliers > 0:
        return left_of(motion, i, 0, j)
    own = motion.own
    count = motion.contacts.shape[0]
    coordinate = motion.contacts[i, PartColumn.COORDINATE]
    moved = slope(motion, j, motion.local * motion.local + count * count + i)
    return motion.signs[i] * (motion.coordinates[own * (1 + j) + coordinate] - moved)


@lean_jit
def lift_rate(motion, j, i):
    """The derivative of the rate of a contact's gap along column j."""
    if motion.multipliers > 0:
        return row_lift(motion, j, i, motion.velocities)
    own = motion.own
    coordinate = motion.contacts[i, PartColumn.COORDINATE]
    return motion.signs[i] * motion.velocities[own * (1 + j) + coordinate]


@lean_jit
def jump_columns(motion, hit):
    """The columns of coordinates of first order at an impact, as `jump_first_order`, which
    follows.
    """
    own = motion.own
    first = motion.first_order
    if first > 0 and motion.columns > 0:
        fill_slopes(motion)
        for i in range(motion.contacts.shape[0]):
            for k in range(first if hit >> i & 1 else 0):
                for j in range(motion.columns):
                    motion.coordinates[own * (2 + j) - first + k] = slope(
                        motion, j, jump_place(motion, i, k)
                    )


@lean_jit
def hold_columns(motion, chosen):
    """Set the columns of coordinates at the contacts in `chosen`: they move with the contact's
    position and, if it is closed, have no velocity."""
    if motion.multipliers > 0:
        fill_slopes(motion)
        for j in range(motion.columns):
            onto(motion, chosen, 0, j)
        return
    own = motion.own
    count = motion.contacts.shape[0]
    for j in range(motion.columns):
        for i in range(count):
            if chosen >> i & 1:
                place = own * (1 + j) + motion.contacts[i, PartColumn.COORDINATE]
                motion.coordinates[place] = slope(
                    motion, j, motion.local * motion.local + count * count + i
                )
                if motion.contacts[i, PartColumn.STATE] == Touch.CLOSED:
                    motion.velocities[place] = 0.0


@lean_jit
def release_shifts(motion, t, i):
    """The shifts of the instant at which a reaction reaches 0, from the reaction's series."""
    columns_at_event(motion, EventCode.RELEASE, i, t, 1.0)
    for j in range(motion.columns):
        motion.shifts[j] /= -motion.margin_series[i, 1]


@lean_jit
def release_columns(motion, t, released):
    """Take the columns to the instant at which a reaction reaches 0.

    `EVENT_SHIFTS` are the shifts of this instant, nan where another reaction reaches 0 at the same
    instant with another shift.
    """
    shifts = motion.event_shifts
    expand(motion, t, 1.0, 1)
    release_shifts(motion, t, released)
    for j in range(motion.columns):
        shifts[j] = motion.shifts[j]
    for i in range(motion.contacts.shape[0]):
        if (
            i != released
            and motion.contacts[i, PartColumn.STATE] == Touch.CLOSED
            and abs(motion.margin_series[i, 0]) <= TIED * press_of(motion, i)
        ):
            release_shifts(motion, t, i)
            for j in range(motion.columns):
                if abs(motion.shifts[j] - shifts[j]) > APART * (
                    abs(motion.shifts[j]) + abs(shifts[j])
                ):
                    shifts[j] = math.nan
    release_shifts(motion, t, released)
    move_columns(motion, 1.0)


@lean_jit
def closing_columns(motion, t, hit):
    """Take the columns to the instant at which the contacts in `hit` close; returns an
    `ImpactDetail`.
    """
    detail = ImpactDetail.REGULAR
    expand(motion, t, 1.0, 0)
    fill_slopes(motion)
    for j in range(motion.columns):
        known = False
        for i in range(motion.contacts.shape[0]):
            if not hit >> i & 1:
                continue
            rate = motion.rates[i]
            if rate >= 0.0:
                return ImpactDetail.NO_SPEED
            shift = -gap_derivative(motion, j, i) / rate
            if known and abs(shift - motion.shifts[j]) > APART * (
                abs(shift) + abs(motion.shifts[j])
            ):
                shift = math.nan
                detail = ImpactDetail.APART
            motion.shifts[j] = shift
            known = True
    move_columns(motion, 1.0)
    return detail


@jit
def impulse_columns(motion, acts, chosen):
    """Differentiate an impact at which the contacts in `acts` have impulses and those in `chosen`
    enter its law.

    M w = S J with the jump w of the velocities; the rates of the acting gaps after it are -E v-, or
    0 if `chosen` is empty:

        M dw + dM w = S dJ,    (dw)_i = -dv_i - sum_j (E_ij dv_j + dE_ij v_j)  of the acting
        contacts, along their signs.

    `solver` holds the coupling, the inverse of M, the rates before the impact (in `GAPS`) and w (in
    `JUMP`). For a dependent sum, w = g w of the others, dg w is added.
    """
    own = motion.own
    local = motion.local
    count = motion.contacts.shape[0]
    signs = motion.signs
    inverse = motion.inverse
    twist = np.zeros(local)
    turned = np.zeros(local)
    right = motion.right
    moving = local - motion.first_order
    fill_slopes(motion)
    for j in range(motion.columns):
        for a in range(local):  # dM w, and then M^-1 dM w
            turned[a] = 0.0
            for c in range(moving):
                turned[a] += slope(motion, j, local * a + c) * motion.jump[c]
            twist[a] = turned[a] if a >= moving else 0.0
        for b in range(moving):
            if turned[b] != 0.0:
                for a in range(local):
                    twist[a] += inverse[a, b] * turned[b]
        for i in range(count):
            right[i] = (
                lift_rate(motion, j, i)
                - signs[i] * twist[motion.contacts[i, PartColumn.COORDINATE]]
            )
            for k in range(count):
                if chosen >> k & 1:
                    right[i] += restitution(motion, i, k) * lift_rate(motion, j, k)
                    right[i] += slope(motion, j, local * local + count * i + k) * motion.gaps[k]
        acting(motion.coupling, right, count, acts, motion.block, motion.tried)
        for a in range(local):
            place = own * (1 + j) + a
            motion.velocities[place] -= twist[a]
            for i in range(count):
                motion.velocities[place] += (
                    inverse[a, motion.contacts[i, PartColumn.COORDINATE]]
                    * signs[i]
                    * motion.tried[i]
                )


@lean_jit
def note_velocities(motion, before):
    """Put the velocities plus `before` times the present `JUMP` into `JUMP`: with 0 the velocities
    before an impact, then, with -1, their jump."""
    for a in range(motion.local):
        velocity = motion.velocities[a]
        motion.jump[a] = velocity if before == 0.0 else velocity + before * motion.jump[a]


@lean_jit
def note_shifts(motion, shifts):
    """Record with the last event its shift along each column, which are the numbers of `shifts`
    from `first` on.
    """
    for j in range(motion.columns):
        motion.event_values[
            motion.recorded_events - 1, 1 + 2 * motion.own + motion.contacts.shape[0] + j
        ] = shifts[j]


@jit
def row_pull_slopes(motion, t):
    """`pull_slopes` of contacts with rows, whose second derivatives are margins of their own."""
    shifts = motion.shifts.copy()
    expand(motion, t, 1.0, 2)
    move_columns(motion, -1.0)
    for i in range(motion.contacts.shape[0]):
        place = row_series(motion, motion.multipliers) + i
        columns_at_event(motion, EventCode.RELEASE, place, t, 1.0)
        for j in range(motion.columns):
            moved = shifts[j] * motion.margin_series[place, 1]
            motion.pull_slopes[j, i] = motion.shifts[j] + moved
    copy_all(shifts, motion.shifts)
    move_columns(motion, 1.0)


@lean_jit
def pull_slopes(motion, t):
    """Fill `PULL_SLOPES`, the derivatives of the gaps' second derivatives with all contacts open,
    at an event.

    All coordinates must be free, and the columns must have been taken to the event.
    """
    if motion.multipliers > 0:
        row_pull_slopes(motion, t)
        return
    own = motion.own
    a = motion.acceleration_series
    expand(motion, t, 1.0, 0)
    move_columns(motion, -1.0)
    expand(motion, t, 1.0, 2)
    for j in range(motion.columns):
        for i in range(motion.contacts.shape[0]):
            coordinate = motion.contacts[i, PartColumn.COORDINATE]
            change = a[own * (1 + j) + coordinate, 0] + motion.shifts[j] * a[coordinate, 1]
            motion.pull_slopes[j, i] = motion.signs[i] * change
    move_columns(motion, 1.0)


@lean_jit
def numbers_of_impacts(motion):
    """How many of the numbers decide on impacts without friction: M and E, or all with rows."""
    if motion.multipliers > 0:
        return motion.solver_numbers.size
    return motion.local * motion.local + motion.contacts.shape[0] * motion.contacts.shape[0]


@lean_jit
def perturb(motion, j, step):
    """Move all quantities on which the duration of an accumulation depends by a step along column
    j; gaps and rates that are 0 stay 0."""
    local = motion.local
    count = motion.contacts.shape[0]
    signs = motion.signs
    numbers = motion.solver_numbers
    for i in range(count):
        if motion.gaps[i] != 0.0:
            motion.gaps[i] += step * gap_derivative(motion, j, i)
        if motion.rates[i] != 0.0:
            motion.rates[i] += step * lift_rate(motion, j, i)
        motion.pulls[i] += step * motion.pull_slopes[j, i]
    for k in range(numbers_of_impacts(motion)):
        numbers[k] += step * slope(motion, j, k)
    invert(numbers, local, motion.first_order, motion.block, motion.inverse)
    if motion.multipliers > 0:
        fill_pushes(motion)
    for i in range(count):
        for k in range(count):
            if motion.multipliers > 0:
                motion.coupling[i, k] = gives(motion, i, k)
                continue
            entry = motion.inverse[
                motion.contacts[i, PartColumn.COORDINATE],
                motion.contacts[k, PartColumn.COORDINATE],
            ]
            motion.coupling[i, k] = signs[i] * signs[k] * entry
    if is_pressed(motion):
        fill_rubbing(motion)


@jit
def accumulation_shifts(motion, near, t):
    """Add to `EVENT_SHIFTS`, which hold the shifts of the last impact, those of the time left until
    the accumulation ends: central differences of this time over the gaps, rates, accelerations and
    numbers."""
    count = motion.contacts.shape[0]
    fill_slopes(motion)
    pull_slopes(motion, t)
    gaps = motion.gaps.copy()
    rates = motion.rates.copy()
    pulls = motion.pulls.copy()
    numbers = motion.solver_numbers.copy()
    for j in range(motion.columns):
        largest = 0.0  # the largest relative change along the column
        for i in range(count):
            if near >> i & 1:
                largest = max(largest, abs(motion.pull_slopes[j, i] / pulls[i]))
                if rates[i] != 0.0:
                    largest = max(largest, abs(lift_rate(motion, j, i) / rates[i]))
                if gaps[i] != 0.0:
                    largest = max(largest, abs(gap_derivative(motion, j, i) / gaps[i]))
        for k in range(numbers_of_impacts(motion)):
            largest = max(largest, abs(slope(motion, j, k)))
        change = 0.0
        step = RELATIVE_STEP / max(largest, 1e-300)
        for sign in (1.0, -1.0):
            perturb(motion, j, sign * step)
            left = frozen_accumulation(motion, near, near, np.inf)
            change += sign * (left if left >= 0.0 else math.nan)
            copy_all(gaps, motion.gaps)
            copy_all(rates, motion.rates)
            copy_all(pulls, motion.pulls)
            copy_all(numbers, motion.solver_numbers)
        motion.event_shifts[j] += 0.5 * change / step if largest > 0.0 else 0.0
    perturb(motion, 0, 0.0)


@lean_jit
def project(motion, closed, vector):
    """Add M^-1 S z to a vector, with the z for which the gaps in `closed` change by -`right`."""
    count = motion.contacts.shape[0]
    acting(motion.coupling, motion.right, count, closed, motion.block, motion.tried)
    for a in range(motion.local):
        for i in range(count):
            vector[a] += push(motion, a, i) * motion.tried[i]


@jit
def fall_back(motion, t, closed, j):
    """Column j for a start at closed contacts, see `start_columns`."""
    own = motion.own
    local = motion.local
    count = motion.contacts.shape[0]
    right = motion.right
    u = motion.coordinates[own * (1 + j) : own * (2 + j)]
    z = motion.velocities[own * (1 + j) : own * (2 + j)]
    given = u.copy()
    rates = z.copy()
    for i in range(count):
        right[i] = gap_derivative(motion, j, i)
    project(motion, closed, u)
    after = u.copy()
    lost = np.zeros(own)
    fallen = given - after  # K h
    # the odd parts of a_v K h and M' K h, without the effect of parameters
    for sign in (0.5, -0.5):
        for a in range(own):
            u[a], z[a] = 0.0, math.copysign(1.0, sign) * fallen[a]
        expand(motion, t, 1.0, 0)
        for a in range(own):
            gained = (
                motion.velocity_series
                if a >= own - motion.first_order
                else motion.acceleration_series
            )
            lost[a] += sign * gained[own * (1 + j) + a, 0]
            u[a] = math.copysign(1.0, sign) * motion.velocities[a]
        motion.shifts[j] = math.copysign(1.0, sign)
        fill_slopes(motion)
        motion.shifts[j] = 0.0
        for a in range(local - motion.first_order):
            for b in range(local):
                for c in range(local):
                    lost[a] += (
                        sign * motion.inverse[a, b] * slope(motion, j, local * b + c) * fallen[c]
                    )
    for a in range(own):
        u[a], z[a] = after[a], rates[a] - lost[a]
        if a >= own - motion.first_order:
            u[a] = given[a] - lost[a]
    if motion.first_order > 0:  # rates of dependent sums
        expand(motion, t, 1.0, 0)
    for i in range(count):
        right[i] = lift_rate(motion, j, i)
    project(motion, closed, z)
    fill_slopes(motion)


@lean_jit
def start_columns(motion, t, closed):
    """The one-sided derivatives of a motion that starts with contacts closed, to the side on which
    their gaps open.

    A small gap h closes, and its bounces end, within a time of the order of sqrt(h). The impulses
    of these contacts do not change the velocities y = (1 - K S') v with K = M^-1 S (S' M^-1 S)^-1,
    so that to first order in h

        u+ = u - K h,    z+ = (1 - K S') (z - a_v K h) + K' h,

    where K' is the time derivative of K. Where impacts lose nothing the bounces never end, and
    there is no derivative.
    """
    own = motion.own
    count = motion.contacts.shape[0]
    if motion.multipliers > 0:
        return  # what is held takes them onto it
    fill_slopes(motion)
    if is_pressed(motion):
        fill_rubbing(motion)
    for j in range(motion.columns):
        lifted = 0.0
        lossless = False
        for i in range(count):
            if closed >> i & 1:
                opened = abs(gap_derivative(motion, j, i))
                size = max(opened, abs(lift_rate(motion, j, i)))
                lifted = max(lifted, size)
                lossless = lossless or (size > 0.0 and restitution(motion, i, i) >= 1.0)
        if lifted == 0.0:
            continue
        place = own * (1 + j)
        if lossless:
            for a in range(own):
                motion.coordinates[place + a] = motion.velocities[place + a] = math.nan
            continue
        fall_back(motion, t, closed, j)
    hold_columns(motion, closed)


@lean_jit
def is_apart(one, other):
    """Whether two shifts differ by more than rounding, so that the events are not at one instant in
    neighbouring motions.
    """
    return not abs(one - other) <= APART * (abs(one) + abs(other))


@lean_jit
def event_shifts(motion):
    """Fill `EVENT_SHIFTS` with the shifts in the state, or with those recorded for an impact at
    this instant, which are nan if contacts close at several instants in neighbouring motions."""
    for i in range(motion.contacts.shape[0]):
        if motion.contacts[i, PartColumn.REACHED] == Reached.FIRST:
            return  # `release_columns` has filled them
    first = 1 + 2 * motion.own + motion.contacts.shape[0]
    for j in range(motion.columns):
        motion.event_shifts[j] = motion.shifts[j]
        begun = False
        last = motion.recorded_events - 1
        while (
            last >= 0
            and motion.event_labels[last, 1] == EventCode.IMPACT
            and motion.event_values[last, 0] == motion.time
        ):
            shift = motion.event_values[last, first + j]
            if begun and is_apart(motion.event_shifts[j], shift):
                shift = math.nan
            motion.event_shifts[j] = shift
            begun = True
            last -= 1
