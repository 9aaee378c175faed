"""Linear complementarity problems of contacts: of a few solved by trying all sets of acting
contacts, of many by exchanges; and impulses of frictions.

An exchange adds the rows of which the inequality is violated to those that act, or takes them away.
All of them are exchanged as long as fewer and fewer are violated, and else the first one alone.
With the first one alone the method ends at the only solution of a problem with a positive definite
matrix (Murty 1974).

Its compiled part goes into one module with that of `kernel.py`.
"""

from __future__ import annotations

import numpy as np

from saltus.flow.contacts.rows import gives, independence, rate_at
from saltus.flow.kernel.contact_layout import (
    MOST_TRIED,
    SPANNED,
    VIOLATED,
    FrictionImpact,
    PartColumn,
    first_flag,
    guard_level,
    restitution,
    rub_coefficient,
)
from saltus.taylor import lean_jit

# --- compiled from here on ---------------------------------------------------


@lean_jit
def eliminate(block, size, columns):
    """Solve a linear system in place: the rows of `block` hold its matrix and its right-hand sides;
    False if it is singular.
    """
    for k in range(size):
        pivot = k
        for i in range(k + 1, size):
            if abs(block[i, k]) > abs(block[pivot, k]):
                pivot = i
        if block[pivot, k] == 0.0:
            return False
        for j in range(columns):
            block[k, j], block[pivot, j] = block[pivot, j], block[k, j]
        for i in range(size):
            if i != k and block[i, k] != 0.0:
                factor = block[i, k] / block[k, k]
                for j in range(k, columns):
                    block[i, j] -= factor * block[k, j]
        for j in range(columns - 1, k - 1, -1):
            block[k, j] /= block[k, k]
    return True


@lean_jit
def invert(numbers, size, first_order, block, inverse):
    """The inverse of a mass matrix that is given by its rows; False if it is singular.

    The last rows, of coordinates of first order, have minus the coefficients g of dependent sums
    (`InGapCoordinates`). In place of the inverse there are g M^-1, its transpose, and g M^-1 g', so
    that a force along a sum acts by the same entries as others; they are 0 for coordinates that are
    no sums.
    """
    for i in range(size):
        for j in range(size):
            block[i, j] = numbers[i * size + j]
            block[i, size + j] = 1.0 if i == j else 0.0
    regular = eliminate(block, size, 2 * size)
    for i in range(size):
        for j in range(size):
            inverse[i, j] = block[i, size + j]
    for d in range(size - first_order, size):
        for i in range(size):
            inverse[i, d] = 0.0
            for j in range(size - first_order):
                inverse[i, d] -= inverse[i, j] * numbers[d * size + j]
    return regular


@lean_jit
def acting(matrix, right, size, bits, block, z):
    """Find z such that right + matrix z = 0 in the rows in `bits`, with z = 0 in the other rows;
    False if there is none.
    """
    count = 0
    for i in range(size):
        z[i] = 0.0
        if bits >> i & 1:
            column = 0
            for j in range(size):
                if bits >> j & 1:
                    block[count, column] = matrix[i, j]
                    column += 1
            block[count, column] = -right[i]
            count += 1
    if not eliminate(block, count, count + 1):
        return False
    place = 0
    for i in range(size):
        if bits >> i & 1:
            z[i] = block[place, count]
            place += 1
    return True


@lean_jit
def exchanged(bits, wrong, least):
    """The bits after an exchange of those in `wrong`, and how few of them there have been."""
    count = 0
    left = wrong
    while left:
        left &= left - 1
        count += 1
    return bits ^ (wrong if count < least else wrong & -wrong), min(count, least)


@lean_jit
def by_exchange(matrix, right, size, rounding, block, z):
    """As `complementary`, by exchanges: whether a solution is found, and the bits of the rows that
    act.
    """
    bits = 0
    least = size + 1
    for _ in range(size * size):
        if not acting(matrix, right, size, bits, block, z):
            return False, 0
        wrong = 0
        for i in range(size):
            left = -z[i] * abs(matrix[i, i])
            if not bits >> i & 1:
                left = -right[i]
                for j in range(size):
                    left -= matrix[i, j] * z[j]
            wrong |= 1 << i if left > rounding else 0
        if not wrong:
            return True, bits
        bits, least = exchanged(bits, wrong, least)
    return False, 0


@lean_jit
def complementary(matrix, right, size, block, tried, z):
    """Find z with 0 <= z _|_ right + matrix z >= 0; returns whether there is one, and the bits of
    the rows that act (z > 0).

    The first set of acting rows that violates no inequality is taken; if all violate some, the set
    with the smallest violation, as long as that may be rounding.
    """
    found = 0
    least = np.inf
    scale = 0.0
    for i in range(size):
        scale = max(scale, abs(right[i]))
    if size > MOST_TRIED:
        return by_exchange(matrix, right, size, VIOLATED * scale, block, z)
    for bits in range(1 << size):
        if not acting(matrix, right, size, bits, block, tried):
            continue
        worst = 0.0
        for i in range(size):
            if bits >> i & 1:
                worst = max(worst, -tried[i] * abs(matrix[i, i]))
            else:
                left = right[i]
                for j in range(size):
                    left += matrix[i, j] * tried[j]
                worst = max(worst, -left)
        if worst < least:
            found = bits
            least = worst
            for i in range(size):
                z[i] = tried[i]
        if worst <= 0.0:
            break
    return least <= VIOLATED * scale, found


# --- impacts with friction ---------------------------------------------------


@lean_jit
def is_pressed(motion):
    """Whether the reaction of any contact presses a friction."""
    found = False
    for k in range(motion.sided.shape[0]):
        found = found or motion.sided[k, PartColumn.PRESSED] > 0
    return found


@lean_jit
def rub_of(motion, i):
    """The friction that a contact's reaction presses, or -1."""
    for k in range(motion.sided.shape[0]):
        if motion.sided[k, PartColumn.PRESSED] == i + 1:
            return k
    return -1


@lean_jit
def slip_sign(motion, k):
    """The direction in which a friction slides after the impact, +1 or -1; 0 if it has no impulse
    or sticks.
    """
    way = motion.sided[k, PartColumn.STRUCK]
    return (
        1.0 if way == FrictionImpact.FORWARDS else -1.0 if way == FrictionImpact.BACKWARDS else 0.0
    )


@lean_jit
def push(motion, a, i):
    """The velocity that an impulse 1 of a contact, with that of its friction if this slides, gives
    to coordinate a.
    """
    k = rub_of(motion, i)
    if motion.multipliers > 0:
        gain = motion.pushes[a, i]
        if k >= 0:
            slips = slip_sign(motion, k) * rub_coefficient(motion, k)
            gain -= slips * motion.pushes[a, motion.contacts.shape[0] + k]
        return gain
    gain = motion.inverse[a, motion.contacts[i, PartColumn.COORDINATE]] * motion.signs[i]
    if k >= 0:
        slips = slip_sign(motion, k) * rub_coefficient(motion, k)
        gain -= slips * motion.inverse[a, motion.sided[k, PartColumn.COORDINATE]]
    return gain


@lean_jit
def fill_rubbing(motion):
    """Let impulses of frictions in contacts act along with those of the contacts in `INVERSE` and
    `COUPLING`: they slide on in their directions, or go on having the speed of the ground."""
    local = motion.local
    inverse = motion.inverse
    if motion.multipliers > 0:
        fill_rubbing_rows(motion)
        return
    for k in range(motion.sided.shape[0]):
        if motion.sided[k, PartColumn.PRESSED] > 0:
            c = motion.sided[k, PartColumn.COORDINATE]
            rate = motion.velocities[c] - guard_level(motion, k)
            motion.sided[k, PartColumn.STRUCK] = (
                FrictionImpact.FORWARDS
                if rate > 0.0
                else FrictionImpact.BACKWARDS
                if rate < 0.0
                else FrictionImpact.STUCK
            )
            own_inverse = inverse[c, c]
            for a in range(local if rate == 0.0 else 0):
                across = inverse[a, c] / own_inverse
                for b in range(local):
                    if a != c:
                        inverse[a, b] -= across * inverse[c, b]
            for b in range(local if rate == 0.0 else 0):
                inverse[c, b] = 0.0
    for i in range(motion.contacts.shape[0]):
        for j in range(motion.contacts.shape[0]):
            motion.coupling[i, j] = motion.signs[i] * push(
                motion, motion.contacts[i, PartColumn.COORDINATE], j
            )


@lean_jit
def fill_rubbing_rows(motion):
    """`fill_rubbing` of frictions with rows: those at rest take what they stop from the pushes of
    all others."""
    local = motion.local
    count = motion.contacts.shape[0]
    for k in range(motion.sided.shape[0]):
        if motion.sided[k, PartColumn.PRESSED] <= 0:
            continue
        rate = motion.slide_rates[k]
        motion.sided[k, PartColumn.STRUCK] = (
            FrictionImpact.FORWARDS
            if rate > 0.0
            else FrictionImpact.BACKWARDS
            if rate < 0.0
            else FrictionImpact.STUCK
        )
        own = gives(motion, count + k, count + k)
        if rate != 0.0 or not own > SPANNED * motion.mobilities[count + k]:
            continue
        for r in range(motion.multipliers):
            share = gives(motion, count + k, r) / own if r != count + k else 0.0
            for a in range(local):
                motion.pushes[a, r] -= share * motion.pushes[a, count + k]
        for a in range(local):
            motion.pushes[a, count + k] = 0.0
    for i in range(count):
        for j in range(count):
            motion.coupling[i, j] = pushed(motion, i, j)


@lean_jit
def pushed(motion, r, j):
    """The rate that an impulse 1 of a contact, with that of its friction if this slides, gives to a
    row."""
    total = gives(motion, r, j)
    k = rub_of(motion, j)
    if k >= 0:
        slips = slip_sign(motion, k) * rub_coefficient(motion, k)
        total -= slips * gives(motion, r, motion.contacts.shape[0] + k)
    return total


@lean_jit
def friction_rate(motion, k):
    """The sliding speed of a friction, exactly 0 at rest."""
    if motion.multipliers > 0:
        return motion.slide_rates[k]
    place = motion.sided[k, PartColumn.COORDINATE]
    return motion.velocities[place] - guard_level(motion, k)


@lean_jit
def slides_on(motion, near):
    """Whether the frictions in the contacts in `near` will not change what they do while these
    contacts lose their speeds.

    If so they are let act along with them (`fill_rubbing`). A contact with the speed u and the
    restitution e has impulses of (1 + e) / (1 - e) u times its mass until it rests; where these are
    within the tolerance it does not matter what they do.
    """
    speed = 0.0
    on = True
    for i in range(motion.contacts.shape[0]):
        if near >> i & 1:
            e = restitution(motion, i, i)
            speed = max(speed, abs(motion.rates[i]) * (1.0 + e) / (1.0 - e) if e < 1.0 else np.inf)
    for k in range(motion.sided.shape[0]):
        i = motion.sided[k, PartColumn.PRESSED] - 1
        if i >= 0 and near >> i & 1:
            c = motion.sided[k, PartColumn.COORDINATE]
            mu = rub_coefficient(motion, k)
            rate = abs(friction_rate(motion, k))
            across = motion.contacts[i, PartColumn.COORDINATE]
            if motion.multipliers > 0:
                own = motion.mobilities[motion.contacts.shape[0] + k]
                other = gives(motion, motion.contacts.shape[0] + k, i)
            else:
                own = motion.inverse[c, c]
                other = motion.inverse[c, across]
            if rate == 0.0:
                on = on and abs(other) <= mu * own
            else:
                on = on and rate * motion.coupling[i, i] > mu * own * speed
    on = on or speed <= motion.tolerance
    if on and is_pressed(motion):
        fill_rubbing(motion)
    return on


@lean_jit
def choose_ways(motion, chosen, acts, number):
    """Let each friction that has an impulse at an impact stick or slide, by the base-3 digits of
    `number`; False if another one has a digit other than 0. `impulses` are those that the contacts
    have besides those of the contacts in `acts`."""
    for k in range(motion.sided.shape[0]):
        digit, number, contact = (
            number % 3,
            number // 3,
            motion.sided[k, PartColumn.PRESSED] - 1,
        )
        pushed = contact >= 0 and chosen >> contact & 1
        if pushed and (acts >> contact & 1 or motion.impulses[contact] > 0.0):
            motion.sided[k, PartColumn.STRUCK] = FrictionImpact.STUCK + digit
        else:
            motion.sided[k, PartColumn.STRUCK] = FrictionImpact.NOT
            if digit > 0:
                return False
    return True


@lean_jit
def fill_sticking(motion, row, a, acts, last):
    """Fill a row of `block` with what the impulses of the contacts in `acts`, then those of
    sticking frictions, give to coordinate a, or to a row that a multiplier holds; behind them comes
    `last`."""
    column = 0
    block = motion.block
    in_rows = motion.multipliers > 0
    for j in range(motion.contacts.shape[0]):
        if acts >> j & 1:
            block[row, column] = pushed(motion, a, j) if in_rows else push(motion, a, j)
            column += 1
    for k in range(motion.sided.shape[0]):
        if motion.sided[k, PartColumn.STRUCK] == FrictionImpact.STUCK:
            if in_rows:
                block[row, column] = gives(motion, a, motion.contacts.shape[0] + k)
            else:
                c = motion.sided[k, PartColumn.COORDINATE]
                block[row, column] = motion.inverse[a, c]
            column += 1
    block[row, column] = last


@lean_jit
def unknown_impulses(motion, acts):
    """The number of impulses that are solved for: those of contacts in `acts` and of sticking
    frictions.
    """
    size = 0
    for i in range(motion.contacts.shape[0]):
        size += acts >> i & 1
    for k in range(motion.sided.shape[0]):
        size += 1 if motion.sided[k, PartColumn.STRUCK] == FrictionImpact.STUCK else 0
    return size


@lean_jit
def struck_velocities(motion, acts, after):
    """Solve for the impulses of the contacts in `acts` with the ways of frictions that are chosen;
    `after` then has the velocities. False if there is no solution. The rates of these contacts
    become -`right`, and sticking coordinates have the speeds of their grounds.
    """
    local = motion.local
    count = motion.contacts.shape[0]
    row = 0
    size = unknown_impulses(motion, acts)
    in_rows = motion.multipliers > 0
    if in_rows and independence(motion, acts, -1) <= SPANNED:
        return False  # another choice stops the same by fewer
    for a in range(local):
        after[a] = motion.velocities[a]
        for j in range(count):
            after[a] += (
                push(motion, a, j) * motion.impulses[j] if motion.impulses[j] != 0.0 else 0.0
            )
    for i in range(count):
        if acts >> i & 1 and in_rows:
            fill_sticking(motion, row, i, acts, -motion.right[i] - rate_at(motion, i, after))
            row += 1
        elif acts >> i & 1:
            a = motion.contacts[i, PartColumn.COORDINATE]
            fill_sticking(motion, row, a, acts, -motion.signs[i] * motion.right[i] - after[a])
            row += 1
    for k in range(motion.sided.shape[0]):
        if motion.sided[k, PartColumn.STRUCK] == FrictionImpact.STUCK:
            a = motion.sided[k, PartColumn.COORDINATE]
            if in_rows:
                fill_sticking(motion, row, count + k, acts, -rate_at(motion, count + k, after))
            else:
                fill_sticking(motion, row, a, acts, guard_level(motion, k) - after[a])
            row += 1
    if not eliminate(motion.block, size, size + 1):
        return False
    add_unknown(motion, acts, after)
    return True


@lean_jit
def add_unknown(motion, acts, after):
    """Add to velocities what the impulses that were solved for give."""
    size = unknown_impulses(motion, acts)
    for a in range(motion.local):
        column = 0
        for j in range(motion.contacts.shape[0]):
            if acts >> j & 1:
                after[a] += push(motion, a, j) * motion.block[column, size]
                column += 1
        for k in range(motion.sided.shape[0]):
            if motion.sided[k, PartColumn.STRUCK] == FrictionImpact.STUCK:
                if motion.multipliers > 0:
                    gain = motion.pushes[a, motion.contacts.shape[0] + k]
                else:
                    gain = motion.inverse[a, motion.sided[k, PartColumn.COORDINATE]]
                after[a] += gain * motion.block[column, size]
                column += 1


@lean_jit
def worst_violation(motion, chosen, acts, after):
    """By how much, as a speed, the solution in `block` violates the inequalities of an impact with
    friction; `tried` then has the impulses of all contacts."""
    worst = 0.0
    count = motion.contacts.shape[0]
    size = unknown_impulses(motion, acts)
    column = 0
    in_rows = motion.multipliers > 0
    for i in range(count):
        motion.tried[i] = motion.impulses[i]
        if acts >> i & 1:
            worst = max(worst, -motion.block[column, size] * abs(motion.coupling[i, i]))
            motion.tried[i] += motion.block[column, size]
            column += 1
        elif chosen >> i & 1:
            if in_rows:
                rate = rate_at(motion, i, after)
            else:
                rate = motion.signs[i] * after[motion.contacts[i, PartColumn.COORDINATE]]
            worst = max(worst, -rate - motion.right[i])
    for k in range(motion.sided.shape[0]):
        way = motion.sided[k, PartColumn.STRUCK]
        c = motion.sided[k, PartColumn.COORDINATE]
        own = motion.mobilities[count + k] if in_rows else motion.inverse[c, c]
        if way == FrictionImpact.STUCK:
            most = (
                rub_coefficient(motion, k) * motion.tried[motion.sided[k, PartColumn.PRESSED] - 1]
            )
            worst = max(worst, (abs(motion.block[column, size]) - most) * own)
            column += 1
        elif way != FrictionImpact.NOT:
            if in_rows:
                slides = rate_at(motion, count + k, after)
            else:
                slides = after[c] - guard_level(motion, k)
            worst = max(worst, -slip_sign(motion, k) * slides)
    return worst


@lean_jit
def tell_instant(motion):
    """Tell the numbers of events, through `env`, the instant, which are functions of it where walls
    move.
    """
    first = first_flag(motion) - 2
    motion.parameters[first], motion.parameters[first + 1] = motion.time, motion.origin
