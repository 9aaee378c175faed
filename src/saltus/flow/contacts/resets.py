"""Resets of the state in the kernel: a map of all coordinates and velocities that the model gives,
applied where the side of a surface becomes +1.

The values of the map, and its derivatives along the tangent's columns, are among the numbers that
`matrices` and `matrix_slopes` fill, behind what coordinates of first order become at impacts. They
are taken at the event: there the columns hold u + v dt and z + a dt, with the event's shift dt, so
that the derivatives of the map make of them what they are after it.

Its compiled part goes into one module with that of `kernel.py`; the words of `motion` are those of
`flow/kernel/memory.py`.
"""

from __future__ import annotations

from saltus.flow.contacts.closings import contact_impact
from saltus.flow.contacts.frictions import note_jumps
from saltus.flow.contacts.impacts import (
    fill_contact_matrices,
    jump_place,
    measure_gap,
    record_contact_event,
)
from saltus.flow.contacts.tangent import fill_slopes, note_shifts, slope
from saltus.flow.kernel.contact_layout import (
    ContactColumn,
    FrictionColumn,
    contact_position,
    ground_speed,
    is_function,
    is_relay,
    is_surface,
    jumping,
)
from saltus.flow.kernel.layout import EventCode, Status
from saltus.flow.kernel.steps import clear_shifts, expand, move_columns
from saltus.taylor import lean_jit

# --- compiled from here on ---------------------------------------------------

# A gap after a reset is 0 if it is a smaller share of the coordinate and the contact's position.
RESET_ROUNDING = 2.0**-50
# Two resets at one surface accumulate if the time between them is a smaller share of the instant.
ACCUMULATED = 2.0**-40


@lean_jit
def resets_state(motion, k, which):
    """Whether the motion, at the event of a guard, is at a surface that resets its state."""
    resets = motion.frictions[k, FrictionColumn.RESETS]
    slides = motion.frictions[k, FrictionColumn.SLIDES]
    return which == 2 and resets * slides < 0


@lean_jit
def reset_state(motion, k, t):
    """Reset the state, with the tangent's columns, at the event of the surface `k`, and record the
    event. PAUSED; OUTSIDE where the state then lies beyond a contact; UNRESOLVED where resets
    accumulate.
    """
    own = motion.own
    if follows_at_once(motion, k, t):
        return Status.UNRESOLVED
    record_contact_event(motion, EventCode.CROSSING, 1 << (motion.contacts.shape[0] + k), t)
    note_shifts(motion, motion.shifts)
    fill_contact_matrices(motion)
    number = abs(motion.frictions[k, FrictionColumn.RESETS]) - 1
    first = jump_place(motion, motion.contacts.shape[0], 0) + 2 * own * number
    if motion.columns > 0:
        fill_slopes(motion)
    for j in range(motion.columns):
        for i in range(own):
            motion.coordinates[own * (1 + j) + i] = slope(motion, j, first + i)
        for i in range(own - motion.first_order):
            motion.velocities[own * (1 + j) + i] = slope(motion, j, first + own + i)
    for i in range(own):
        motion.coordinates[i] = motion.solver_numbers[first + i]
    for i in range(own - motion.first_order):
        motion.velocities[i] = motion.solver_numbers[first + own + i]
    for i in range(own):
        motion.event_values[motion.recorded_events - 1, 1 + own + i] = jumping(motion, i)
    fill_contact_matrices(motion)
    read_sides(motion, k)
    hit = place_contacts(motion)
    if hit < 0:
        return Status.OUTSIDE
    if hit > 0:
        if motion.columns > 0:
            expand(motion, t, 1.0, 0)
            move_columns(motion, -1.0)
            clear_shifts(motion)
        return contact_impact(motion, t, hit)
    return Status.PAUSED


@lean_jit
def follows_at_once(motion, k, t):
    """Whether the last event was at the surface `k` too, and as good as at the same instant."""
    last = motion.recorded_events - 1
    if last < 0 or motion.event_labels[last, 2] != 1 << (motion.contacts.shape[0] + k):
        return False
    since = t - motion.event_values[last, 0]
    here = motion.event_labels[last, 0] == motion.period
    return here and since <= ACCUMULATED * (abs(t) + motion.origin)


@lean_jit
def read_sides(motion, k):
    """Read the sides of all surfaces anew, after a reset at the event of the surface `k`."""
    if is_relay(motion, k):
        motion.frictions[k, FrictionColumn.SLIDES] *= -1
    note_jumps(motion)
    for i in range(motion.frictions.shape[0]):
        if not is_surface(motion, i):
            continue
        motion.frictions[i, FrictionColumn.REACHED] = 0
        motion.frictions[i, FrictionColumn.SKIP] = 0
        if is_function(motion, i):
            continue
        place = motion.frictions[i, FrictionColumn.COORDINATE]
        distance = motion.coordinates[place] - ground_speed(motion, i)
        if distance != 0.0:
            motion.frictions[i, FrictionColumn.SLIDES] = 1 if distance > 0.0 else -1


@lean_jit
def place_contacts(motion):
    """Measure the gaps of all contacts after a reset. The contacts into which the motion moves, as
    bits; -1 if it lies beyond one.
    """
    hit = 0
    for i in range(motion.contacts.shape[0]):
        row = motion.contacts[i]
        place = row[ContactColumn.COORDINATE]
        position = contact_position(motion, i)
        gap = motion.signs[i] * (motion.coordinates[place] - position)
        rate = motion.signs[i] * motion.velocities[place]
        row[ContactColumn.RELEASED] = 0
        row[ContactColumn.WAITS] = 0
        row[ContactColumn.CLOSED] = 0
        row[ContactColumn.SKIP] = 0
        if abs(gap) <= RESET_ROUNDING * (abs(motion.coordinates[place]) + abs(position)):
            motion.coordinates[place] = position
            row[ContactColumn.SKIP] = 1
            row[ContactColumn.CLOSED] = 1 if rate == 0.0 else 0
            hit |= 1 << i if rate < 0.0 else 0
        elif gap < 0.0:
            return -1
        measure_gap(motion, i)
    return hit
