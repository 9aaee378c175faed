"""Resets of the state in the kernel: a map of all coordinates and velocities that the model gives,
applied where the side of a surface becomes +1.

The values of the map, and its derivatives along the tangent's columns, are among the numbers that
`matrices` and `matrix_slopes` fill, behind what coordinates of first order become at impacts. They
are taken at the event: there the columns hold u + v dt and z + a dt, with the event's shift dt, so
that the derivatives of the map make of them what they are after it.

A surface with a reset has the number of the reset in RESETS, and answers the questions 7 and 8 of
`parts.py` here: its event resets the state (`reset_state`), behind which all sides are read anew
(`read_sides`) and contacts may be hit (`place_contacts`). At the instant of another event it keeps
its side and has its own event next (`keep_reached`, `lead_to_events`).

Its compiled part goes into one module with that of `kernel.py`; the words of `motion` are those of
`flow/kernel/memory.py`.
"""

from __future__ import annotations

from saltus.flow.contacts.closings import contact_impact
from saltus.flow.contacts.functions import IS_ON, VANISHES, note_jumps, span_of_terms
from saltus.flow.contacts.impacts import (
    fill_contact_matrices,
    jump_place,
    measure_gap,
    record_contact_event,
)
from saltus.flow.contacts.parts import guard_series
from saltus.flow.contacts.tangent import fill_slopes, note_shifts, slope
from saltus.flow.kernel.contact_layout import (
    FrictionImpact,
    Guard,
    Kept,
    PartColumn,
    Reached,
    Touch,
    contact_position,
    guard_level,
    is_function,
    is_remembered,
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
# The order of two resets makes a difference if the states differ by a larger share of their numbers.
DISAGREES = 2.0**-30


@lean_jit
def resets_state(motion, k, which):
    """Whether the motion, at the event of a guard, is at a surface that resets its state."""
    resets = motion.sided[k, PartColumn.RESETS]
    slides = motion.sided[k, PartColumn.STATE]
    return which == Guard.ITSELF and resets * slides < 0


@lean_jit
def reset_state(motion, k, t):
    """Reset the state, with the tangent's columns, at the event of the surface `k`, and record the
    event. PAUSED; OUTSIDE where the state then lies beyond a contact; UNRESOLVED where resets
    accumulate, UNORDERED where another one at the same instant would give another state first;
    NO_STATE where the map has no values.
    """
    own = motion.own
    if follows_at_once(motion, k, t):
        return Status.UNRESOLVED
    if some_disagree(motion, k, t):
        return Status.UNORDERED
    expand(motion, t, 1.0, motion.order)
    guard_series(motion, k, 1.0 * motion.sided[k, PartColumn.STATE], 0, motion.gap_series)
    before = motion.gap_series[0]
    record_contact_event(motion, EventCode.CROSSING, 1 << (motion.contacts.shape[0] + k), t)
    note_shifts(motion, motion.shifts)
    fill_contact_matrices(motion)
    number = abs(motion.sided[k, PartColumn.RESETS]) - 1
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
    if not is_finite_state(motion):
        return Status.NO_STATE
    for i in range(own):
        motion.event_values[motion.recorded_events - 1, 1 + own + i] = jumping(motion, i)
    fill_contact_matrices(motion)
    read_sides(motion, k, t, before)
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
def is_finite_state(motion):
    """Whether coordinates and velocities are numbers."""
    total = 0.0
    for i in range(motion.own):
        total += 0.0 * motion.coordinates[i] + 0.0 * motion.velocities[i]
    return total == 0.0


@lean_jit
def follows_at_once(motion, k, t):
    """Whether one of the last events was at the surface `k` too, and as good as at the same
    instant."""
    for event in range(motion.recorded_events - 1, -1, -1):
        since = t - motion.event_values[event, 0]
        here = motion.event_labels[event, 0] == motion.period
        if not here or since > ACCUMULATED * (abs(t) + motion.origin):
            return False
        if motion.event_labels[event, 2] == 1 << (motion.contacts.shape[0] + k):
            return True
    return False


@lean_jit
def would_reset(motion, k):
    """Whether a row is that of a surface that resets the state where the motion goes on through
    it."""
    resets = motion.sided[k, PartColumn.RESETS]
    return resets * motion.sided[k, PartColumn.STATE] < 0


@lean_jit
def size_of_guard(motion, k):
    """The size of the terms of a surface's guard, whose series on its side is in `gap_series`
    afterwards."""
    side = 1.0 * motion.sided[k, PartColumn.STATE]
    guard_series(motion, k, side, motion.order, motion.gap_series)
    unit = span_of_terms(motion)
    size = 0.0
    power = 1.0
    for i in range(1, motion.order + 1):
        power *= unit
        size = max(size, abs(motion.gap_series[i]) * power)
    return size


@lean_jit
def is_at(motion, k):
    """Whether the motion is at a surface, apart from rounding, by the series of its guard, which is
    in `gap_series` afterwards."""
    bound = IS_ON * size_of_guard(motion, k)
    if not is_function(motion, k):
        place = motion.coordinates[motion.sided[k, PartColumn.COORDINATE]]
        bound += RESET_ROUNDING * (abs(place) + abs(guard_level(motion, k)))
    return abs(motion.gap_series[0]) <= bound


@lean_jit
def keep_reached(motion, t):
    """Let surfaces that would reset the state, and that the motion is at behind another event, stay
    on their sides: the motion has come to them itself, and no jump has taken it across. Whether
    there are any.
    """
    found = False
    expanded = False
    for k in range(motion.sided.shape[0]):
        row = motion.sided[k]
        passes_on = row[PartColumn.KEPT] == Kept.PASSED
        row[PartColumn.KEPT] = Kept.NO
        begins = motion.leave_by != 0 or row[PartColumn.REACHED] != Reached.NO
        if begins or passes_on or not would_reset(motion, k):
            continue
        if not expanded:
            expand(motion, t, 1.0, motion.order)
            expanded = True
        if is_at(motion, k):
            row[PartColumn.KEPT] = Kept.ON_ITS_SIDE
            row[PartColumn.STRUCK] = FrictionImpact.NOT
            found = True
    return found


@lean_jit
def lead_to_events(motion, t):
    """Note how the motion goes on from surfaces that it is at and has not passed. Whether it reaches
    all that it passes with a speed; one that it passes without would reset the state for ever.
    """
    expand(motion, t, 1.0, motion.order)
    for k in range(motion.sided.shape[0]):
        row = motion.sided[k]
        if row[PartColumn.KEPT] == Kept.NO:
            continue
        row[PartColumn.KEPT] = Kept.NO
        size = size_of_guard(motion, k)
        unit = span_of_terms(motion)
        power = 1.0
        leading = 0
        for i in range(1, motion.order + 1):
            power *= unit
            term = motion.gap_series[i] * power
            leading = i
            if term != 0.0 and abs(term) >= VANISHES * size:
                break
        passes_it = motion.gap_series[leading] < 0.0
        row[PartColumn.SKIP] = 0 if passes_it else leading
        if passes_it and leading > 1:
            return False
    return True


@lean_jit
def take_map(motion, number):
    """Set coordinates and velocities, without columns, to what the reset `number` makes of them."""
    own = motion.own
    fill_contact_matrices(motion)
    first = jump_place(motion, motion.contacts.shape[0], 0) + 2 * own * number
    for i in range(own):
        motion.coordinates[i] = motion.solver_numbers[first + i]
    for i in range(own - motion.first_order):
        motion.velocities[i] = motion.solver_numbers[first + own + i]


@lean_jit
def note_state(motion, row):
    """Note the state in the place of an event that is not recorded yet."""
    own = motion.own
    for i in range(own):
        motion.event_values[row, i] = motion.coordinates[i]
        motion.event_values[row, own + i] = motion.velocities[i]


@lean_jit
def some_disagree(motion, k, t):
    """Whether, at the event of the surface `k`, the motion reaches another one too that resets the
    state, and the order of the two makes a difference."""
    expanded = False
    for other in range(motion.sided.shape[0]):
        if other == k or not would_reset(motion, other):
            continue
        if not expanded:
            expand(motion, t, 1.0, motion.order)
            expanded = True
        if is_at(motion, other) and motion.gap_series[1] < 0.0 and disagree(motion, k, other):
            return True
    return False


@lean_jit
def disagree(motion, k, other):
    """Whether the resets of two surfaces, one after the other, give another state in the other
    order."""
    own = motion.own
    one = abs(motion.sided[k, PartColumn.RESETS]) - 1
    two = abs(motion.sided[other, PartColumn.RESETS]) - 1
    here = motion.recorded_events  # places of events that this pass may still record
    there = here + 1
    note_state(motion, here)
    take_map(motion, one)
    take_map(motion, two)
    note_state(motion, there)
    for i in range(own):
        motion.coordinates[i] = motion.event_values[here, i]
        motion.velocities[i] = motion.event_values[here, own + i]
    take_map(motion, two)
    take_map(motion, one)
    found = False
    for i in range(own):
        place = motion.event_values[there, i]
        rate = motion.event_values[there, own + i]
        size = abs(place) + abs(motion.event_values[here, i])
        speed = abs(rate) + abs(motion.event_values[here, own + i])
        found = found or abs(motion.coordinates[i] - place) > DISAGREES * size
        moves = i < own - motion.first_order
        found = found or (moves and abs(motion.velocities[i] - rate) > DISAGREES * speed)
    for i in range(own):
        motion.coordinates[i] = motion.event_values[here, i]
        motion.velocities[i] = motion.event_values[here, own + i]
    fill_contact_matrices(motion)
    return found


@lean_jit
def read_sides(motion, k, t, before):
    """Read the sides of all surfaces anew, after a reset at the event of the surface `k`, whose
    guard was `before`."""
    note_jumps(motion)
    expand(motion, t, 1.0, motion.order)
    for i in range(motion.sided.shape[0]):
        if not is_surface(motion, i):
            continue
        row = motion.sided[i]
        row[PartColumn.REACHED] = Reached.NO
        row[PartColumn.SKIP] = 0
        row[PartColumn.KEPT] = Kept.NO
        size = size_of_guard(motion, i)
        if i == k and abs(motion.gap_series[0] - before) <= RESET_ROUNDING * size:
            row[PartColumn.KEPT] = Kept.PASSED
        if is_function(motion, i):
            continue
        distance = motion.coordinates[row[PartColumn.COORDINATE]] - guard_level(motion, i)
        stays_there = would_reset(motion, i) and is_at(motion, i)
        if distance != 0.0 and not stays_there:
            row[PartColumn.STATE] = 1 if distance > 0.0 else -1
    if is_remembered(motion, k):
        motion.sided[k, PartColumn.STATE] *= -1


@lean_jit
def place_contacts(motion):
    """Measure the gaps of all contacts after a reset. The contacts into which the motion moves, as
    bits; -1 if it lies beyond one.
    """
    hit = 0
    for i in range(motion.contacts.shape[0]):
        row = motion.contacts[i]
        place = row[PartColumn.COORDINATE]
        position = contact_position(motion, i)
        gap = motion.signs[i] * (motion.coordinates[place] - position)
        rate = motion.signs[i] * motion.velocities[place]
        row[PartColumn.REACHED] = Reached.NO
        row[PartColumn.WAITS] = 0
        row[PartColumn.STATE] = Touch.OPEN
        row[PartColumn.SKIP] = 0
        if abs(gap) <= RESET_ROUNDING * (abs(motion.coordinates[place]) + abs(position)):
            motion.coordinates[place] = position
            row[PartColumn.SKIP] = 1
            row[PartColumn.STATE] = 1 if rate == 0.0 else 0
            hit |= 1 << i if rate < 0.0 else 0
        elif gap < 0.0:
            return -1
        measure_gap(motion, i)
    return hit
