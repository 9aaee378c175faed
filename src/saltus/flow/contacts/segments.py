"""Smooth segments of motions with several contacts, from event to event, with their derivatives:
the parts of periodic orbits.

The events, their times and the contacts that are closed between them are given. The motion is
followed whatever the signs of the gaps and the reactions; the orbit's equations make each event's
guard 0 (see `orbits/equations/contacts.py`). A family of orbits therefore goes smoothly through the
point at which one of its events disappears.

Its compiled part goes into one module with those of the files that it imports from.
"""

from __future__ import annotations

import math

import numpy as np

from saltus.flow.contacts.complementarity import acting
from saltus.flow.contacts.extremes import (
    extremes_at_end,
    extremes_at_section,
    extremes_at_start,
    extremes_at_step,
    gap_beside,
)
from saltus.flow.contacts.impacts import (
    apply_impulses,
    contact_step_size,
    fill_contact_matrices,
    hold_coordinates,
    impact_impulses,
    jump_first_order,
    note_press,
)
from saltus.flow.contacts.propagators import (
    begin_remainders,
    carry_columns,
    columns_from_modes,
    columns_into_modes,
    input_step,
    parameter_remainders,
    push_columns,
    state_remainders,
)
from saltus.flow.contacts.tangent import (
    fill_slopes,
    gap_derivative,
    hold_columns,
    impulse_columns,
    jump_columns,
    note_velocities,
)
from saltus.flow.kernel.contact_layout import (
    PartColumn,
    SegmentEnd,
    SegmentPlan,
    contact_position,
    restitution,
    solver_arrays,
)
from saltus.flow.kernel.layout import EventCode
from saltus.flow.kernel.memory import CONTACT_SEGMENTS, ContactsSegmentParts, MotionMemory
from saltus.flow.kernel.roots import value_and_slope
from saltus.flow.kernel.steps import (
    columns_at_event,
    expand,
    in_modes,
    mode_arrays,
    move,
    state_arrays,
    step_arrays,
)
from saltus.taylor import by_reference, cached_jit, jit, lean_jit

# --- compiled from here on ---------------------------------------------------

# of one segment: only near a singular mass matrix do steps become so short that more would be
# needed
MOST_STEPS = 10_000
# The duration, in natural times, below which the guard of an excursion is an integral. That of a
# longer one is its gap, which says that it begins at the contact, too: it may last a whole period.
SHORT_EXCURSION = 0.05


@lean_jit
def unit_columns(motion):
    """Set the columns to the derivatives of the present state to itself, the unit matrix, and to
    the parameters, 0.
    """
    own = motion.own
    for j in range(motion.columns):
        for i in range(own):
            place = own * (1 + j) + i
            motion.coordinates[place] = 1.0 if j == i else 0.0
            motion.velocities[place] = 1.0 if j == own + i else 0.0


@lean_jit
def hold_contacts(motion, closed):
    """Close the contacts in `closed` and no others: their coordinates are put at the contacts'
    positions, also in the columns.
    """
    count = motion.contacts.shape[0]
    fill_slopes(motion)
    for i in range(count):
        motion.contacts[i, PartColumn.STATE] = closed >> i & 1
        if closed >> i & 1:
            place = motion.contacts[i, PartColumn.COORDINATE]
            motion.coordinates[place], motion.velocities[place] = contact_position(motion, i), 0.0
    hold_columns(motion, closed)
    hold_coordinates(motion)


@lean_jit
def in_propagators(motion, power, begin, end):
    """Whether the columns of a segment are carried by propagators: those of a structure, but for
    an excursion of one step, whose guard is made of their series.
    """
    if motion.eigenmodes.size == 0 or end <= begin:
        return False
    if power == 0:
        return True
    size = expand(motion, begin, 1.0, motion.order)
    return contact_step_size(motion, begin, end, size, True) < abs(end - begin)


@lean_jit
def follow_segment(motion, begin, end, carried, row, slopes, units, seen):
    """Follow one segment of the plan with the present contacts closed; returns the number of steps,
    or 0 if it cannot be followed. Whether the columns are `carried` by propagators was decided
    before.

    Of an excursion of a contact, with a power > 0, the integrals of `end_excursion` are taken, in
    `slopes` for the columns.
    """
    contact = row[SegmentPlan.CONTACT]
    power = row[SegmentPlan.POWER]
    after_event = row[SegmentPlan.KIND] >= 0
    order = motion.order
    t = begin
    forwards = end >= begin
    if carried:
        columns_into_modes(motion)
    if power > 0:
        for k in range(motion.excursion.size):
            motion.excursion[k] = 0.0
        for j in range(motion.columns):
            slopes[j] = 0.0
        if carried:
            begin_remainders(motion, contact, power, slopes)
    for count in range(MOST_STEPS):
        size = in_modes(motion, t, order) if carried else expand(motion, t, 1.0, order)
        note_press(motion)
        natural = contact_step_size(motion, t, t + abs(end - t), size, not carried)
        if carried:
            natural = input_step(motion, order, min(natural, end - t))
        if not natural > 0.0:
            return 0
        last = natural >= abs(end - t)
        h = end - t if last else (natural if forwards else -natural)
        if seen.size > 1 and h > 0.0:
            extremes_at_step(motion, t, h, begin, end, after_event, units, seen)
        if power > 0 and not (last and count == 0 and not carried):
            along_excursion(motion, contact, power, end - t, h, carried, slopes)
        if carried:
            push_columns(motion, order, h)
        move(motion, h, motion.own if carried else motion.dof)
        if last:
            if carried:
                if power == 0 and row[SegmentPlan.KIND] == EventCode.RELEASE:
                    reaction, rate = value_and_slope(motion.margin_series[contact], order, h)
                    motion.excursion[0] = reaction
                    motion.excursion[1] = rate
                if power > 0:
                    state_remainders(motion, contact, power, end - begin, slopes)
                carry_columns(motion, end - begin)
                columns_from_modes(motion)
                if power > 0:
                    parameter_remainders(motion, contact, end - begin, slopes)
            return count + 1
        t += h
    return 0


@lean_jit
def stays_closed(motion, count, acts, after):
    """Whether an impact opens none of the contacts in `after`: it opens a contact without an
    impulse that is coupled to the contacts in `acts`, which have one."""
    for i in range(count):
        if after >> i & 1 and not acts >> i & 1:
            for k in range(count):
                if acts >> k & 1 and motion.coupling[i, k] != 0.0:
                    return False
    return True


@lean_jit
def given_impact(motion, hit, after):
    """Apply the impact of the contact `hit` whatever the sign of its speed; the contacts that act
    are those of an impact of unit speed.

    Returns False if the impact law has no solution, or if the impact opens one of the contacts in
    `after`, which are to be closed.
    """
    count = motion.contacts.shape[0]
    unit = motion.falling_rates
    fill_contact_matrices(motion)
    chosen = 1 << hit
    for i in range(count):
        chosen |= motion.contacts[i, PartColumn.STATE] << i
        unit[i] = -1.0 if i == hit else 0.0
        motion.gaps[i] = motion.rates[i]
    solved, acts = impact_impulses(motion, chosen, unit)
    if not solved or not stays_closed(motion, count, acts, after):
        return False
    note_velocities(motion, 0.0)
    jump_columns(motion, 1 << hit)
    jump_first_order(motion, 1 << hit)
    for i in range(count):
        motion.right[i] = motion.rates[i]
        for k in range(count):
            if chosen >> k & 1:
                motion.right[i] += restitution(motion, i, k) * motion.rates[k]
    acting(motion.coupling, motion.right, count, acts, motion.block, motion.impulses)
    apply_impulses(motion)
    for i in range(count):
        if acts >> i & 1:
            rate = 0.0
            place = motion.contacts[i, PartColumn.COORDINATE]
            for k in range(count):
                if chosen >> k & 1:
                    rate -= restitution(motion, i, k) * motion.gaps[k]
            motion.velocities[place] = motion.signs[i] * rate + 0.0
    for a in range(motion.local):  # the jump of the velocities
        motion.jump[a] = motion.velocities[a] - motion.jump[a]
    impulse_columns(motion, acts, chosen)
    return True


@lean_jit
def copy_numbers(motion, ends, first):
    """Put the state and its rates into `ends` from `first` on."""
    own = motion.own
    for i in range(own):
        ends[first + i], ends[first + own + i] = motion.coordinates[i], motion.velocities[i]
        ends[first + 2 * own + i] = motion.velocities[i]
        ends[first + 3 * own + i] = motion.acceleration_series[i, 0]


@lean_jit
def copy_columns(motion, columns):
    """Put the columns into the rows of an array: coordinates, then velocities."""
    own = motion.own
    for j in range(motion.columns):
        for i in range(own):
            place = own * (1 + j) + i
            columns[i, j] = motion.coordinates[place]
            columns[own + i, j] = motion.velocities[place]


@lean_jit
def start_slope(motion, ends, slopes):
    """The derivative of a guard to the time of the segment's start, for a fixed state there: minus
    the derivative along the motion."""
    total = 0.0
    for j in range(2 * motion.own):
        total -= slopes[j] * ends[SegmentEnd.NUMBERS + 2 * motion.own + j]
    return total


@lean_jit
def excursion_guard(motion, contact, power, h, ends, slopes):
    """The gap at the end of an excursion of one step, divided by a power p of its duration h, and
    its derivatives.

    A contact that is released where its reaction is 0 opens with h^3, and one that opens from rest
    after an impact with h^2. The series without its first p terms, which are 0, gives a quotient
    that is regular for all h, also at h = 0, where the excursion appears. With the gap's
    coefficients c_k, their derivatives w_k to the time of the start, and Q = sum c_k h^(k-p):

        dQ/dh = sum (k-p) c_k h^(k-p-1),    dQ/dt_start = sum (w_k + (k+1) c_(k+1)) h^(k-p) - dQ/dh.
    """
    own = motion.own
    sign = motion.signs[contact]
    coordinate = motion.contacts[contact, PartColumn.COORDINATE]
    q = motion.coordinate_series
    value = 0.0
    by_length = 0.0
    by_start = 0.0
    for j in range(motion.columns):
        slopes[j] = 0.0
    for k in range(motion.order, power - 1, -1):
        by_length = by_length * h + value
        value = value * h + sign * q[coordinate, k]
        by_start = by_start * h + (k + 1) * sign * q[coordinate, k + 1]
        for j in range(motion.columns):
            slopes[j] = slopes[j] * h + sign * q[own * (1 + j) + coordinate, k]
    ends[SegmentEnd.GUARD] = value
    ends[SegmentEnd.BY_END] = by_length
    ends[SegmentEnd.BY_START] = by_start + start_slope(motion, ends, slopes) - by_length


@lean_jit
def remainder(c, derivative, power, order, left, h):
    """The integral over a step of the length h of (T - s)^(p-1) / (p-1)! times a derivative of a
    series; T is `left` at its start, and p, 1 to 3, is `power`.
    """
    total = 0.0
    for k in range(order + 1 - derivative, -1, -1):
        rate = c[k + derivative]
        for i in range(derivative):
            rate *= k + derivative - i
        weight = 1.0 / (k + 1)
        if power == 2:
            weight = left / (k + 1) - h / (k + 2)
        if power == 3:
            weight = 0.5 * (left * left / (k + 1) - 2.0 * left * h / (k + 2) + h * h / (k + 3))
        total = total * h + rate * weight
    return total * h


@lean_jit
def along_excursion(motion, contact, power, left, h, carried, slopes):
    """Add a step of an excursion of several steps to what `end_excursion` divides."""
    own = motion.own
    order = motion.order
    place = motion.contacts[contact, PartColumn.COORDINATE]
    q = motion.coordinate_series[place]
    motion.excursion[0] += remainder(q, power, power, order, left, h)
    motion.excursion[1] += remainder(q, power, power - 1, order, left, h)
    motion.excursion[2] += remainder(q, power + 1, power, order, left, h)
    if not carried:
        for j in range(motion.columns):
            u = motion.coordinate_series[own * (1 + j) + place]
            slopes[j] += remainder(u, power, power, order, left, h)


@lean_jit
def end_excursion(motion, contact, power, h, ends, slopes):
    """The guard of a short excursion of several steps and its derivatives, as those of
    `excursion_guard`: without the first p terms, which are 0,

        Q = 1 / h^p times the integral over s of (h - s)^(p-1) / (p-1)! q^(p)(s),

    which has no differences of nearly equal numbers, however short the excursion is.
    """
    sign = motion.signs[contact]
    divisor = h**power
    value = sign * motion.excursion[0] / divisor
    rate = sign * motion.excursion[1] * h / divisor
    by_length = (rate - power * value) / h
    for j in range(motion.columns):
        slopes[j] *= sign / divisor
    ends[SegmentEnd.GUARD] = value
    ends[SegmentEnd.BY_END] = by_length
    by_start = sign * motion.excursion[2] / divisor
    ends[SegmentEnd.BY_START] = by_start + start_slope(motion, ends, slopes) - by_length


@lean_jit
def divide_guard(motion, power, h, ends, slopes):
    """Divide the guard of a long excursion, and its derivatives, by the power of its duration."""
    divisor = h**power
    ends[SegmentEnd.GUARD] /= divisor
    turned = power * ends[SegmentEnd.GUARD] / h
    ends[SegmentEnd.BY_END] = ends[SegmentEnd.BY_END] / divisor - turned
    ends[SegmentEnd.BY_START] = ends[SegmentEnd.BY_START] / divisor + turned
    for j in range(motion.columns):
        slopes[j] /= divisor


@lean_jit
def guard_at_end(motion, t, kind, contact, carried, ends, slopes):
    """The guard of a segment's event, its rate, and its derivatives along the columns.

    The reaction of a structure is that of its eigenmodes where these were followed: computed from
    the state it is a small difference of large forces.
    """
    fill_slopes(motion)
    if kind == EventCode.RELEASE:
        ends[SegmentEnd.GUARD] = motion.margin_series[contact, 0]
        ends[SegmentEnd.RATE] = motion.margin_series[contact, 1]
        if carried:
            ends[SegmentEnd.GUARD] = motion.excursion[0]
            ends[SegmentEnd.RATE] = motion.excursion[1]
        ends[SegmentEnd.BY_END] = ends[SegmentEnd.RATE]
        columns_at_event(motion, EventCode.RELEASE, contact, t, 1.0)
        for j in range(motion.columns):
            slopes[j] = motion.shifts[j]
            motion.shifts[j] = 0.0
        return
    sign = motion.signs[contact]
    place = motion.contacts[contact, PartColumn.COORDINATE]
    ends[SegmentEnd.GUARD] = sign * (motion.coordinates[place] - contact_position(motion, contact))
    ends[SegmentEnd.BY_END] = ends[SegmentEnd.RATE] = sign * motion.velocities[place]
    for j in range(motion.columns):
        slopes[j] = gap_derivative(motion, j, contact)


@lean_jit
def pass_event(motion, row, ends, maps):
    """Take the state through the event of a row of the plan, with the derivatives of its map; False
    if the event is impossible."""
    own = motion.own
    unit_columns(motion)
    impact = row[SegmentPlan.KIND] == EventCode.IMPACT
    after = row[SegmentPlan.AFTER]
    if impact and not given_impact(motion, row[SegmentPlan.CONTACT], after):
        return False
    hold_contacts(motion, after)
    copy_columns(motion, maps)
    for a in range(own):
        ends[SegmentEnd.NUMBERS + 8 * own + a] = motion.coordinates[a]
        ends[SegmentEnd.NUMBERS + 9 * own + a] = motion.velocities[a]
    return True


@jit
def follow_with(numbers, parts, request, results):
    """`follow_contact_segments` with the parts of the motion's memory in one named tuple."""
    motion = by_reference(MotionMemory(numbers, parts))
    own = numbers.own
    plan = request.plan
    times = request.times
    first = request.first
    units = request.units
    ends = results.ends
    columns = results.columns
    maps = results.maps
    extremes = results.extremes
    nothing = np.zeros(1)
    for a in range(own):
        motion.coordinates[a], motion.velocities[a] = first[a], first[own + a]
    fill_contact_matrices(motion)
    for s in range(plan.shape[0]):
        begin = times[s]
        end = times[s + 1]
        kind = plan[s, SegmentPlan.KIND]
        contact = plan[s, SegmentPlan.CONTACT]
        unit_columns(motion)
        hold_contacts(motion, plan[s, SegmentPlan.ALONG])
        expand(motion, begin, 1.0, 1)
        copy_numbers(motion, ends[s], SegmentEnd.NUMBERS)
        seen = extremes[s] if extremes.shape[0] > 0 else nothing
        if extremes.shape[0] > 0:
            extremes_at_start(motion, plan[s, SegmentPlan.HIT], units, seen)
            if kind < 0:
                extremes_at_section(motion, begin, units, seen)
        power = plan[s, SegmentPlan.POWER]
        carried = in_propagators(motion, power, begin, end)
        steps = follow_segment(
            motion, begin, end, carried, plan[s], columns[s, 2 * own], units, seen
        )
        if steps == 0:
            return s
        single = power > 0 and steps == 1 and not carried
        if single:
            excursion_guard(motion, contact, power, end - begin, ends[s], columns[s, 2 * own])
        short = power > 0 and abs(end - begin) < SHORT_EXCURSION * units[1]
        if short and not single:
            end_excursion(motion, contact, power, end - begin, ends[s], columns[s, 2 * own])
        expand(motion, end, 1.0, 1)
        copy_numbers(motion, ends[s], SegmentEnd.NUMBERS + 4 * own)
        copy_columns(motion, columns[s])
        if not math.isfinite(ends[s, SegmentEnd.NUMBERS + 8 * own - 1]):
            return s
        if extremes.shape[0] > 0:
            extremes_at_end(motion, contact if kind == EventCode.RELEASE else -1, units, seen)
        if kind >= 0:
            if single or short:
                velocity = motion.velocities[motion.contacts[contact, PartColumn.COORDINATE]]
                ends[s, SegmentEnd.RATE] = motion.signs[contact] * velocity
            else:
                guard_at_end(motion, end, kind, contact, carried, ends[s], columns[s, 2 * own])
                ends[s, SegmentEnd.BY_START] = start_slope(motion, ends[s], columns[s, 2 * own])
                if power > 0:
                    divide_guard(motion, power, end - begin, ends[s], columns[s, 2 * own])
            if not pass_event(motion, plan[s], ends[s], maps[s]):
                return s
            if extremes.shape[0] > 0 and kind == EventCode.IMPACT:
                gap_beside(motion, plan, s, end - begin, ends[s], units, seen)
    return plan.shape[0]


@cached_jit(CONTACT_SEGMENTS, nogil=True)
def follow_contact_segments(numbers, env, functions, contacts, request, results):
    """Follow segments one after the other, each from the state after the event before it; returns
    how many were followed.

    In `request`, `plan` describes each segment (`SegmentPlan`), `times` (n + 1) are the times of
    the segments' ends, and `first` is the state at the first of them. In `results` are filled:
    `ends`, in the places of `SegmentEnd`; `columns`, the derivatives of the state at the end, at a
    fixed time, and of the guard, to the state at the start and to the parameters; `maps`, the
    derivatives of the state after the event to the state before it and to the parameters; and, if
    it has rows, `extremes`, in the places of `SegmentExtremes`.
    """
    record = numbers[0]
    count = contacts.shape[0]
    state = state_arrays(record, np.zeros(2 * record.dof + record.columns))
    solver = solver_arrays(record.local, count, record.columns, 0, record.contact_numbers, 0)
    parts = ContactsSegmentParts(
        state,
        env,
        env[0],
        functions,
        contacts,
        contacts[:0],
        step_arrays(record),
        mode_arrays(record, functions.eigenmodes),
        solver,
        np.zeros(record.order + 2),
        np.zeros(2),
        np.zeros(3),
    )
    return follow_with(record, parts, request, results)
