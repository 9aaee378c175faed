"""What multipliers hold, from step to step: the numbers of rows, what is idle, and the state on what
is held (`rows.py`).

Its compiled part goes into one module with that of `kernel.py`; the words of `motion` are those of
`flow/kernel/memory.py`.
"""

from __future__ import annotations

from saltus.flow.contacts.complementarity import invert, tell_instant
from saltus.flow.contacts.rows import (
    gives,
    has_speed,
    independence,
    is_held,
    rate_at,
    row_entry,
    row_gap,
    row_series,
    size_of_terms,
    told_rate,
)
from saltus.flow.kernel.contact_layout import (
    PULLED,
    SPANNED,
    FrictionImpact,
    PartColumn,
    Reached,
    Side,
    Touch,
    first_flag,
    first_row,
    is_surface,
)
from saltus.flow.kernel.layout import Mode
from saltus.flow.kernel.steps import log_of_tolerance, state_size, step_size, time_scale
from saltus.taylor import lean_jit

# --- compiled from here on ---------------------------------------------------


@lean_jit
def fill_pushes(motion):
    """Fill what unit impulses along the rows give, from the inverse of the mass matrix."""
    for r in range(motion.multipliers):
        for a in range(motion.local):
            total = 0.0
            for b in range(motion.local):
                total += motion.inverse[a, b] * row_entry(motion, r, b)
            motion.pushes[a, r] = total
        motion.mobilities[r] = gives(motion, r, r)


@lean_jit
def fill_numbers(motion):
    """Fill the numbers of the present state and what follows from the mass matrix; False if this is
    singular."""
    tell_instant(motion)
    motion.matrices(motion.env, motion.piece, motion.state, motion.solver_numbers)
    regular = invert(
        motion.solver_numbers, motion.local, motion.first_order, motion.block, motion.inverse
    )
    fill_pushes(motion)
    return regular


@lean_jit
def fill_rows(motion):
    """`fill_contact_matrices` for contacts with rows. Gaps of contacts that touch are exactly 0."""
    regular = fill_numbers(motion)
    count = motion.contacts.shape[0]
    for i in range(count):
        for j in range(count):
            motion.coupling[i, j] = gives(motion, i, j)
        closed = motion.contacts[i, PartColumn.STATE] == Touch.CLOSED
        touches = closed or motion.contacts[i, PartColumn.SKIP] > 0
        motion.gaps[i] = 0.0 if touches else row_gap(motion, i)
        motion.rates[i] = 0.0 if closed else told_rate(motion, i)
    return regular


@lean_jit
def forget_idle(motion):
    """Let nothing be idle."""
    for i in range(motion.contacts.shape[0]):
        motion.contacts[i, PartColumn.IDLE] = 0
    for k in range(motion.sided.shape[0]):
        motion.sided[k, PartColumn.IDLE] = 0


@lean_jit
def mark_idle(motion, candidates, still):
    """Let those that would open or slide, and whose rows follow from what is held, be idle; False
    if what is held depends on one another, or the choice has no meaning."""
    count = motion.contacts.shape[0]
    if independence(motion, -1, -1) <= SPANNED:
        return False
    for i in range(count):
        opens = candidates >> i & 1 and motion.contacts[i, PartColumn.STATE] == Touch.OPEN
        if opens and independence(motion, -1, i) <= SPANNED:
            motion.contacts[i, PartColumn.STATE] = Touch.CLOSED
            motion.contacts[i, PartColumn.IDLE] = 1
    for k in range(motion.sided.shape[0]):
        row = motion.sided[k]
        if not has_speed(motion, k):
            continue
        pressed = row[PartColumn.PRESSED] - 1
        lifted = row[PartColumn.STATE] == Side.OFF
        if lifted and pressed >= 0 and motion.contacts[pressed, PartColumn.STATE] == Touch.CLOSED:
            # in an idle contact, which does not press it
            rate = motion.slide_rates[k]
            row[PartColumn.STATE] = 1 if rate >= 0.0 else -1
            if rate == 0.0 and independence(motion, -1, count + k) > SPANNED:
                return False
            lifted = False
        resting = still >> k & 1 and abs(row[PartColumn.STATE]) == 1
        if resting and not lifted and independence(motion, -1, count + k) <= SPANNED:
            row[PartColumn.IDLE] = row[PartColumn.STATE]
            row[PartColumn.STATE] = Side.HELD
    return True


@lean_jit
def stays_idle(motion, r):
    """Whether the series of an idle row shows that what is held keeps its gap, or its speed, at 0."""
    first = 2 if r < motion.contacts.shape[0] else 1
    series = motion.margin_series[row_series(motion, r)]
    size = state_size(motion, 0, motion.own)
    log_tol = log_of_tolerance(motion)
    span = step_size(motion.velocity_series[: motion.own], motion.order, size, log_tol)
    span = min(span, time_scale(motion))
    power = 1.0
    for k in range(first, motion.order):
        if not abs(series[k]) * power <= PULLED * motion.press:
            return False
        power *= span
    return True


@lean_jit
def some_idle(motion):
    """Whether anything is idle."""
    found = False
    for i in range(motion.contacts.shape[0]):
        found = found or motion.contacts[i, PartColumn.IDLE] != 0
    for k in range(motion.sided.shape[0]):
        found = found or motion.sided[k, PartColumn.IDLE] != 0
    return found


@lean_jit
def all_idle_stay(motion):
    """`stays_idle` of all that are idle."""
    count = motion.contacts.shape[0]
    for i in range(count):
        if motion.contacts[i, PartColumn.IDLE] != 0 and not stays_idle(motion, i):
            return False
    for k in range(motion.sided.shape[0]):
        if motion.sided[k, PartColumn.IDLE] != 0 and not stays_idle(motion, count + k):
            return False
    return True


@lean_jit
def hold_rows(motion):
    """Tell the model's functions which contacts with rows are held, and that frictions are free."""
    first = first_flag(motion)
    for r in range(motion.multipliers):
        motion.parameters[first + r] = 1.0
    for i in range(motion.contacts.shape[0]):
        if is_held(motion, i):
            motion.parameters[first + i] = 0.0


@lean_jit
def measure_slides(motion):
    """Measure the sliding speeds of frictions with rows: exactly 0 where one sticks, and no impact
    has changed the velocities, and where an impact stopped it."""
    count = motion.contacts.shape[0]
    struck = False
    for i in range(count):
        struck = struck or motion.contacts[i, PartColumn.SKIP] > 0
    struck = struck and motion.mode == Mode.CONTACT
    for k in range(motion.sided.shape[0]):
        row = motion.sided[k]
        if is_surface(motion, k):
            continue
        sticks = row[PartColumn.STATE] == Side.HELD
        if struck:
            sticks = row[PartColumn.STRUCK] == FrictionImpact.STUCK
        sticks = sticks or row[PartColumn.REACHED] == Reached.GUARD
        motion.slide_rates[k] = 0.0 if sticks else told_rate(motion, count + k)


@lean_jit
def note_terms(motion):
    """Note the sizes of the terms of all rates, of which rounding is a share."""
    for r in range(motion.multipliers):
        motion.row_terms[r] = size_of_terms(motion, r)


@lean_jit
def takes_part(motion, r, bits):
    """Whether a row is held or, with `bits`, is that of one of these contacts."""
    if bits == 0:
        return is_held(motion, r)
    return r < motion.contacts.shape[0] and (bits >> r & 1) == 1


@lean_jit
def row_lift(motion, j, r, velocities):
    """The derivative of a row's rate along a column of the tangent, at some velocities."""
    first = first_row(motion) + r * (motion.local + 1)
    place = j * motion.solver_numbers.size + first
    total = motion.slopes[place + motion.local]
    for a in range(motion.local):
        total += motion.slopes[place + a] * velocities[a]
        total += row_entry(motion, r, a) * motion.velocities[motion.own * (1 + j) + a]
    return total


@lean_jit
def left_of(motion, r, level, j):
    """What is to become 0: a gap (level 0) or the rate of a row (1), or with j >= 0 its derivative
    along a column of the tangent."""
    size = motion.solver_numbers.size
    if level == 0 and j < 0:
        return row_gap(motion, r)
    if level == 0:
        return motion.slopes[(j + 1) * size - motion.contacts.shape[0] + r]
    if j < 0:
        return rate_at(motion, r, motion.velocities)
    return row_lift(motion, j, r, motion.velocities)


@lean_jit
def onto(motion, bits, level, j):
    """Take the coordinates (level 0) or the velocities (1) onto what is held, or with `bits` onto
    the gaps of these contacts, by one step of Newton's method in the metric of M. Rows that follow
    from those before them are left out. With j >= 0 so is a column of the tangent, by the slopes of
    the numbers."""
    count = motion.contacts.shape[0]
    block = motion.block
    rows = count if level == 0 else motion.multipliers
    size = 0
    for r in range(rows):
        size += 1 if takes_part(motion, r, bits) else 0
    row = 0
    for r in range(rows):
        if not takes_part(motion, r, bits):
            continue
        column = 0
        for s in range(rows):
            if takes_part(motion, s, bits):
                block[row, column] = gives(motion, r, s)
                column += 1
        block[row, size] = left_of(motion, r, level, j)
        row += 1
    row = 0
    for r in range(rows):
        if not takes_part(motion, r, bits):
            continue
        if block[row, row] <= SPANNED * motion.mobilities[r]:
            block[row, row] = 0.0
        for other in range(row + 1, size if block[row, row] > 0.0 else 0):
            factor = block[other, row] / block[row, row]
            for column in range(row, size + 1):
                block[other, column] -= factor * block[row, column]
        row += 1
    for r in range(rows - 1, -1, -1):
        if not takes_part(motion, r, bits):
            continue
        row -= 1
        share = block[row, size]
        for column in range(row + 1, size):
            share -= block[row, column] * block[column, size]
        share = share / block[row, row] if block[row, row] > 0.0 else 0.0
        block[row, size] = share
        for a in range(motion.local):
            if level == 0:
                motion.coordinates[motion.own * (1 + j) + a] -= motion.pushes[a, r] * share
            else:
                motion.velocities[motion.own * (1 + j) + a] -= motion.pushes[a, r] * share


@lean_jit
def onto_rows(motion):
    """Take the state onto what is held, first the coordinates and then the velocities. False where
    the mass matrix is singular."""
    held = False
    for r in range(motion.multipliers):
        held = held or is_held(motion, r)
    if not held:
        return True
    onto(motion, 0, 0, -1)
    regular = fill_numbers(motion)
    onto(motion, 0, 1, -1)
    return regular


@lean_jit
def end_in_rows(motion, tau):
    """At the end of a step of the length `tau`, take the state onto what is held, and measure rates
    there. False where the mass matrix is singular."""
    regular = fill_numbers(motion)
    regular = onto_rows(motion) and regular
    count = motion.contacts.shape[0]
    for r in range(motion.multipliers):
        # the terms along the step, as a speed that has just become 0 has none at its end
        terms = 0.0
        series = motion.margin_series[row_series(motion, r)]
        for k in range(motion.order, 0, -1):
            terms = terms * tau + (k * abs(series[k]) if r < count else abs(series[k]))
        if r >= count:
            terms = terms * tau + abs(series[0])
        terms = max(terms, size_of_terms(motion, r))
        motion.row_terms[r] = terms if tau > 0.0 else max(terms, motion.row_terms[r])
    measure_slides(motion)
    return regular


@lean_jit
def stop_row(motion, r):
    """Take from the velocities the rate of a row, by an impulse along it."""
    rate = rate_at(motion, r, motion.velocities)
    for a in range(motion.local):
        motion.velocities[a] -= motion.pushes[a, r] * rate / motion.mobilities[r]


# The coefficients that a series begins with where the first ones are 0, as at a release.
FIRST_OF_SERIES = 4


@lean_jit
def size_along(series, span, last):
    """The largest of the first terms of a series at the end of a span."""
    size = 0.0
    power = 1.0
    for k in range(last + 1):
        size = max(size, abs(series[0, k]) * power)
        power *= span
    return size


# Each time the step is found from what a series is along the last one, to within the 10th root.
STEPS_TRIED = 5


@lean_jit
def guard_step(motion, place, natural, longest):
    """The step, at most `natural`, that the series at a place among the margins allows, where no
    step is longer than `longest`."""
    series = motion.margin_series[place : place + 1]
    order = motion.order
    for _ in range(STEPS_TRIED):
        span = min(natural, longest)
        size = size_along(series, span, FIRST_OF_SERIES)
        if not size > 0.0:
            size = size_along(series, span, order // 2)
        if not size > 0.0:
            break
        shorter = step_size(series, order, size, log_of_tolerance(motion))
        if not shorter < span:
            break
        natural = shorter
    return natural


@lean_jit
def row_step(motion, natural, longest):
    """The step, at most `natural`, that the series of open gaps and of sliding speeds allow, where
    no step is longer than `longest`."""
    count = motion.contacts.shape[0]
    for r in range(motion.multipliers):
        watched = r < count and motion.contacts[r, PartColumn.STATE] == Touch.OPEN
        if r >= count and has_speed(motion, r - count):
            watched = abs(motion.sided[r - count, PartColumn.STATE]) == 1
        if not watched:
            continue
        natural = guard_step(motion, row_series(motion, r), natural, longest)
    return natural


@lean_jit
def all_rows_stand(motion):
    """Whether as many rows as there are coordinates are held, on ground that never moves."""
    held = 0
    for r in range(motion.multipliers):
        if is_held(motion, r):
            held += 1
            if row_entry(motion, r, motion.local) != 0.0:
                return False
    return held == motion.local and motion.fixed_rows > 0


@lean_jit
def away_in_rows(motion, bits, tau, penetrated):
    """Whether, at the end of a step, a gap is negative, or one in `bits` that closes is not 0, by
    more than rounding of the terms of its series."""
    for i in range(motion.contacts.shape[0]):
        if motion.contacts[i, PartColumn.STATE] == Touch.CLOSED:
            continue
        gap = row_gap(motion, i)
        gap = -abs(gap) if bits >> i & 1 else gap
        if gap >= 0.0:
            continue
        terms = 0.0
        series = motion.margin_series[row_series(motion, i)]
        for k in range(motion.order, -1, -1):
            terms = terms * tau + abs(series[k])
        for a in range(motion.local):
            terms += abs(row_entry(motion, i, a) * motion.coordinates[a])
        if -gap > penetrated * terms:
            return True
    return False
