"""Rows that multipliers hold, in the kernel for several contacts: gaps and sliding speeds that are
functions of the state (`taylor/multipliers.py`).

A contact has the row W of its gap, g' = W v + b, and a friction the row T of its speed, u = T v +
w. They are among the last numbers that `matrices` fills, and their series behind the margins of the
frictions. What is held keeps its gap or speed at 0 along the series; after each step the state is
taken onto it by one step of Newton's method in the metric of M.

The rows that are held at one time are independent. Another closed contact, or sticking friction,
whose row follows from these is idle: the contact carries nothing, and the friction its static limit
in one direction. Reactions of rows that depend on one another are so a vertex of all that are
possible, and the motion does not depend on which.

Rates that are rounding of their terms count as exactly 0, as those of held coordinates are.

Its compiled part goes into one module with that of `kernel.py`; the words of `motion` are those of
`flow/kernel/memory.py`.
"""

from __future__ import annotations

import math

from saltus.flow.kernel.contact_layout import (
    LAST_BOUNCES,
    ROW_ROUNDING,
    SPANNED,
    FrictionImpact,
    NoPress,
    PartColumn,
    Side,
    Touch,
    first_row,
    is_function,
    is_surface,
)
from saltus.taylor import lean_jit

# --- compiled from here on ---------------------------------------------------


@lean_jit
def row_entry(motion, r, a):
    """The entry of a row of a contact or, behind the contacts, of a friction at a coordinate; its
    drift behind the last one."""
    return motion.solver_numbers[first_row(motion) + r * (motion.local + 1) + a]


@lean_jit
def row_gap(motion, i):
    """The gap of a contact with a row."""
    return motion.solver_numbers[motion.solver_numbers.size - motion.contacts.shape[0] + i]


@lean_jit
def rate_at(motion, r, velocities):
    """The rate of a row at some velocities."""
    total = row_entry(motion, r, motion.local)
    for a in range(motion.local):
        total += row_entry(motion, r, a) * velocities[a]
    return total


@lean_jit
def size_of_terms(motion, r):
    """The size of the terms of a row's rate."""
    total = abs(row_entry(motion, r, motion.local))
    for a in range(motion.local):
        total += abs(row_entry(motion, r, a) * motion.velocities[a])
    return total


@lean_jit
def told_rate(motion, r):
    """The rate of a row; exactly 0 where it is rounding of its terms, now or before an event at this
    instant."""
    rate = rate_at(motion, r, motion.velocities)
    terms = max(size_of_terms(motion, r), motion.row_terms[r])
    return rate if abs(rate) > ROW_ROUNDING * terms else 0.0


@lean_jit
def is_nearly_rounding(motion, i):
    """Whether the next impacts of a contact with a row would be rounding of the terms of its
    rate."""
    return motion.multipliers > 0 and motion.rates[
        i
    ] <= LAST_BOUNCES * ROW_ROUNDING * size_of_terms(motion, i)


@lean_jit
def gives(motion, r, s):
    """The rate that a unit impulse along a row s gives to a row r."""
    total = 0.0
    for a in range(motion.local):
        total += row_entry(motion, r, a) * motion.pushes[a, s]
    return total


@lean_jit
def has_speed(motion, k):
    """Whether a row behind those of the contacts is that of a friction with a force."""
    row = motion.sided[k]
    inert = row[PartColumn.PRESSED] == NoPress.INERT
    return not is_surface(motion, k) and not inert


@lean_jit
def is_held(motion, r):
    """Whether a multiplier holds a row."""
    count = motion.contacts.shape[0]
    if r < count:
        row = motion.contacts[r]
        return row[PartColumn.STATE] == Touch.CLOSED and row[PartColumn.IDLE] == 0
    if is_function(motion, r - count):
        return False
    friction = motion.sided[r - count]
    return friction[PartColumn.STATE] == Side.HELD and friction[PartColumn.IDLE] == 0


@lean_jit
def is_stopped(motion, r, acts):
    """Whether a row is among those of the contacts in `acts` and of the frictions that stick after
    an impact."""
    count = motion.contacts.shape[0]
    if r < count:
        return (acts >> r & 1) == 1
    return motion.sided[r - count, PartColumn.STRUCK] == FrictionImpact.STUCK


@lean_jit
def counts_in(motion, r, acts):
    """Whether a row is one of those that `independence` compares."""
    return is_held(motion, r) if acts < 0 else is_stopped(motion, r, acts)


@lean_jit
def independence(motion, acts, last):
    """How far the held rows, or with `acts` those of an impact, are from depending on one another,
    in the metric of M: the square of a sine. With a row `last` how far it is from following from
    these."""
    block = motion.block
    total = motion.multipliers
    least = 1.0
    size = 0
    for number in range(total + 1):
        r = last if number == total else number
        if r < 0 or (number < total and (r == last or not counts_in(motion, r, acts))):
            continue
        column = 0
        left = 1.0
        for s in range(min(number, total)):
            if s == last or not counts_in(motion, s, acts):
                continue
            size_of_both = math.sqrt(motion.mobilities[r] * motion.mobilities[s])
            share = gives(motion, r, s) / size_of_both if size_of_both > 0.0 else 1.0
            for k in range(column):
                share -= block[size, k] * block[column, k]
            share /= block[column, column]
            block[size, column] = share
            left -= share * share
            column += 1
        if not motion.mobilities[r] > 0.0:
            left = 0.0
        least = left if number == total else min(least, left)
        if left <= SPANNED:
            return left
        block[size, size] = math.sqrt(left)
        size += 1
    return least


@lean_jit
def row_series(motion, r):
    """The place among the margins of the series of a gap or, behind those, of a sliding speed."""
    return motion.contacts.shape[0] + 2 * motion.sided.shape[0] + r


@lean_jit
def limits_begin(motion):
    """The place of the first margin at which a motion ends."""
    first = row_series(motion, 0) + motion.multipliers
    if motion.multipliers > 0 and motion.columns > 0:
        first += motion.contacts.shape[0]  # the second derivatives of gaps
    return first


@lean_jit
def pull_of(motion, r):
    """The second derivative of a gap, or the first one of a sliding speed, from its series."""
    series = motion.margin_series[row_series(motion, r)]
    return 2.0 * series[2] if r < motion.contacts.shape[0] else series[1]


@lean_jit
def largest_pull(motion, r, span):
    """The largest of `pull_of` and of its first two derivatives in units of a time."""
    series = motion.margin_series[row_series(motion, r)]
    if r < motion.contacts.shape[0]:
        size = max(2.0 * abs(series[2]), 6.0 * abs(series[3]) * span)
        return max(size, 24.0 * abs(series[4]) * span * span)
    return max(abs(series[1]), 2.0 * abs(series[2]) * span, 6.0 * abs(series[3]) * span * span)
