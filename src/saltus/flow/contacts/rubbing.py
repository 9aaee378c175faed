"""Impacts with friction, in one or two phases, and their derivatives; the accelerations that
accumulations follow from.

Its compiled part goes into one module with that of `kernel.py`; the words of `motion` are those of
`flow/kernel/memory.py`.
"""

from __future__ import annotations

import math

import numpy as np

from saltus.flow.contacts.complementarity import (
    add_unknown,
    choose_ways,
    eliminate,
    fill_sticking,
    friction_rate,
    invert,
    is_pressed,
    push,
    pushed,
    rub_of,
    slip_sign,
    struck_velocities,
    unknown_impulses,
    worst_violation,
)
from saltus.flow.contacts.frictions import rubs_along
from saltus.flow.contacts.held_rows import fill_pushes, row_lift
from saltus.flow.contacts.impacts import hold_coordinates, time_to_close
from saltus.flow.contacts.rows import gives, independence, row_entry, row_series, told_rate
from saltus.flow.contacts.tangent import (
    fill_slopes,
    hold_columns,
    impulse_columns,
    lift_rate,
    note_velocities,
    slope,
)
from saltus.flow.kernel.contact_layout import (
    SAME_IMPACT,
    SPANNED,
    VIOLATED,
    FrictionImpact,
    PartColumn,
    first_flag,
    first_row,
    guard_level,
    has_phases,
    restitution,
    rub_coefficient,
    zeros,
)
from saltus.flow.kernel.steps import change_rate, expand, piece_end
from saltus.taylor import jit, lean_jit

# --- compiled from here on ---------------------------------------------------


@lean_jit
def depends_on_choice(motion, chosen):
    """Whether the contacts in `chosen`, of which one has a friction, depend on one another, so that
    the impulses may not be the only ones."""
    for k in range(motion.sided.shape[0]):
        motion.sided[k, PartColumn.STRUCK] = FrictionImpact.NOT
    return is_pressed(motion) and independence(motion, chosen, -1) <= SPANNED


@lean_jit
def differs_by_choice(motion, one, other):
    """Whether velocities differ by more than rounding, in the metric of M."""
    apart = 0.0
    size = 0.0
    for a in range(motion.local):
        for b in range(motion.local):
            mass = motion.solver_numbers[motion.local * a + b]
            apart += (one[a] - other[a]) * mass * (one[b] - other[b])
            size += motion.velocities[a] * mass * motion.velocities[b]
            size += one[a] * mass * one[b]
    return apart > SAME_IMPACT * size


@jit
def rubbing_phase(motion, chosen, scale):
    """Solve an impact with friction, or one of its phases: with N = `impulses` + z of the contacts
    in `chosen`, and the impulses P of frictions,

        v+ = v- + M^-1 (S N + T P),    0 <= z _|_ S' v+ + `right` >= 0,    P = -mu N s with s =
        sign(T' v+ - w), or T' v+ = w and abs(P) <= mu N.

    All choices are tried, as in `complementary`, with speeds of the size `scale`. The velocities
    and `impulses` are set to those after it, and `STRUCK` of the frictions. Returns the contacts
    with z > 0 as bits, or -1 if there is no solution.
    """
    local = motion.local
    count = motion.contacts.shape[0]
    frictions = motion.sided.shape[0]
    after = np.zeros(local)
    found = -1
    ways = 0
    least = np.inf
    shared = motion.multipliers > 0 and depends_on_choice(motion, chosen)
    one = np.zeros(local if shared else 0)
    compares = False
    for number in range((1 << count) * 3**frictions):
        acts = number & ((1 << count) - 1)
        if acts & ~chosen or not choose_ways(motion, chosen, acts, number >> count):
            continue
        if struck_velocities(motion, acts, after):
            worst = worst_violation(motion, chosen, acts, after)
            if worst < least:
                found = acts
                ways = number >> count
                least = worst
            if shared and worst <= VIOLATED * scale:
                if compares and differs_by_choice(motion, one, after):
                    return -1  # rigid bodies do not determine it
                for a in range(local):
                    one[a] = after[a]
                compares = True
            if worst <= 0.0 and not shared:
                break
    if not least <= VIOLATED * scale:
        return -1
    choose_ways(motion, chosen, found, ways)
    struck_velocities(motion, found, after)
    worst_violation(motion, chosen, found, after)
    column = unknown_impulses(motion, found)
    for k in range(frictions - 1, -1 if motion.multipliers > 0 else frictions - 1, -1):
        motion.stuck_impulses[k] = 0.0
        if motion.sided[k, PartColumn.STRUCK] == FrictionImpact.STUCK:
            column -= 1
            motion.stuck_impulses[k] = motion.block[column, unknown_impulses(motion, found)]
    for a in range(local):
        motion.velocities[a] = after[a]
    for i in range(count):
        motion.impulses[i] = max(motion.tried[i], 0.0)
        if found >> i & 1 and motion.multipliers == 0:
            motion.velocities[motion.contacts[i, PartColumn.COORDINATE]] = (
                -motion.signs[i] * motion.right[i] + 0.0
            )
    for k in range(frictions if motion.multipliers == 0 else 0):
        if motion.sided[k, PartColumn.STRUCK] == FrictionImpact.STUCK:
            motion.velocities[motion.sided[k, PartColumn.COORDINATE]] = guard_level(motion, k)
    return found


@lean_jit
def begin_rubbing(motion, chosen):
    """Fill `right` by the restitution and clear the impulses; returns the size of the speeds at an
    impact.
    """
    scale = 0.0
    count = motion.contacts.shape[0]
    for i in range(count):
        motion.impulses[i] = motion.right[i] = 0.0
        scale = max(scale, abs(motion.rates[i]) if chosen >> i & 1 else 0.0)
        for j in range(count):
            motion.right[i] += (
                restitution(motion, i, j) * motion.rates[j] if chosen >> j & 1 else 0.0
            )
    for k in range(motion.sided.shape[0]):
        scale = max(scale, abs(friction_rate(motion, k)))
    return scale


@lean_jit
def has_one_impulse(motion, chosen):
    """Whether the impulses of frictions in the contacts in `chosen` are certainly the only ones:
    G_nn > mu abs(G_nt) of each.
    """
    for k in range(motion.sided.shape[0]):
        i = motion.sided[k, PartColumn.PRESSED] - 1
        if i >= 0 and chosen >> i & 1:
            a = motion.contacts[i, PartColumn.COORDINATE]
            c = motion.sided[k, PartColumn.COORDINATE]
            if motion.multipliers > 0:
                across = abs(gives(motion, i, motion.contacts.shape[0] + k))
                if not motion.mobilities[i] > rub_coefficient(motion, k) * across:
                    return False
            elif not motion.inverse[a, a] > rub_coefficient(motion, k) * abs(motion.inverse[a, c]):
                return False
    return True


@jit
def rubbing_impact(motion, chosen, slopes):
    """Apply the impact law with friction to the contacts in `chosen`, whose rates before it are in
    `rates`, which then has those after it; the velocities are changed, and the columns if they have
    `slopes`. Returns the contacts that act as bits, or -1 if there is no solution, or not only one.

    With phases the first one ends with rates of 0, and the second one has the impulses e times
    those of the first, and more where a contact would close again.
    """
    count = motion.contacts.shape[0]
    total = np.zeros(motion.contacts.shape[0])
    own_slopes = motion.pull_slopes
    scale = begin_rubbing(motion, chosen)
    acts = -1
    phases = has_phases(motion)
    if not has_one_impulse(motion, chosen):
        return -1
    for j in range(motion.columns):
        for i in range(count):
            own_slopes[j, i] = 0.0
    for _ in range(2 if phases else 1):
        for i in range(count if phases else 0):
            motion.right[i] = 0.0
            total[i] += motion.impulses[i]
            motion.impulses[i] *= restitution(motion, i, i)
        acts = rubbing_phase(motion, chosen, scale)
        if acts < 0:
            return -1
        if motion.columns > 0 and slopes:
            note_velocities(motion, -1.0)
            rubbing_columns(motion, acts, 0 if phases else chosen, total)
            note_velocities(motion, 0.0)
    for i in range(count):
        motion.impulses[i] += total[i]
        if motion.multipliers > 0:
            rate = told_rate(motion, i)
        else:
            rate = motion.signs[i] * motion.velocities[motion.contacts[i, PartColumn.COORDINATE]]
        motion.rates[i] = (
            -motion.right[i] + 0.0 if acts >> i & 1 else max(rate, 0.0) if chosen >> i & 1 else rate
        )
    return acts


@jit
def rubbing_columns(motion, acts, chosen, first):
    """Differentiate an impact with friction, with the directions in which frictions slide after it
    and those that stick.

    As `impulse_columns`, with M w = S N + T P: P = -mu s N of frictions that slide, and T' v+ = w
    of those that stick. N are `impulses`, of which e times `first`, those of an earlier phase, do
    not follow from the rates. `PULL_SLOPES` has the slopes of these, and then those of N.
    """
    own = motion.own
    local = motion.local
    count = motion.contacts.shape[0]
    if motion.multipliers > 0:
        rubbing_row_columns(motion, acts, chosen, first)
        return
    given = np.zeros(local)
    lifts = np.zeros(count)
    fill_slopes(motion)
    for j in range(motion.columns):
        z = motion.velocities[own * (1 + j) : own * (2 + j)]
        for i in range(count):
            lifts[i] = lift_rate(motion, j, i)
            motion.pull_slopes[j, i] *= restitution(motion, i, i)
            motion.pull_slopes[j, i] += slope(motion, j, local * local + (count + 1) * i) * first[i]
        for a in range(local):  # without the changes of the impulses
            given[a] = z[a]
            for b in range(local):
                for c in range(local):
                    given[a] -= (
                        motion.inverse[a, b] * slope(motion, j, local * b + c) * motion.jump[c]
                    )
            for i in range(count):
                given[a] += (
                    push_slope(motion, j, a, i) * motion.impulses[i]
                    + push(motion, a, i) * motion.pull_slopes[j, i]
                )
        row = 0
        size = unknown_impulses(motion, acts)
        for i in range(count):
            if acts >> i & 1:
                a = motion.contacts[i, PartColumn.COORDINATE]
                change = 0.0
                for k in range(count):
                    if chosen >> k & 1:
                        change += restitution(motion, i, k) * lifts[k]
                        change += slope(motion, j, local * local + count * i + k) * motion.gaps[k]
                fill_sticking(motion, row, a, acts, -motion.signs[i] * change - given[a])
                row += 1
        for k in range(motion.sided.shape[0]):
            if motion.sided[k, PartColumn.STRUCK] == FrictionImpact.STUCK:
                a = motion.sided[k, PartColumn.COORDINATE]
                place = motion.solver_numbers.size - motion.sided.shape[0] + k
                fill_sticking(motion, row, a, acts, slope(motion, j, place) - given[a])
                row += 1
        eliminate(motion.block, size, size + 1)
        add_unknown(motion, acts, given)
        row = 0
        for i in range(count):
            if acts >> i & 1:
                motion.pull_slopes[j, i] += motion.block[row, size]
                row += 1
        for a in range(local):
            z[a] = given[a]


@jit
def rubbing_row_columns(motion, acts, chosen, first):
    """`rubbing_columns` where contacts and frictions have rows, which change too:

    M dv+ = M dv- - dM w + sum (dB N + B dN) + sum (dT' P + T' dP),
    W dv+ + dW v+ + db = -d(E rates-) of the contacts that act,    T dv+ + dT v+ + dw = 0 of
    frictions that stick.
    """
    own = motion.own
    local = motion.local
    count = motion.contacts.shape[0]
    frictions = motion.sided.shape[0]
    size = motion.solver_numbers.size
    begin = first_row(motion)
    width = local + 1
    given = np.zeros(local)
    turned = np.zeros(local)
    before = np.zeros(local)
    after = np.zeros(local)
    lifts = np.zeros(count)
    stuck = np.zeros(frictions)
    fill_slopes(motion)
    unknown = unknown_impulses(motion, acts)
    for k in range(frictions):
        if motion.sided[k, PartColumn.STRUCK] == FrictionImpact.STUCK:
            stuck[k] = motion.stuck_impulses[k]
    for a in range(local):
        after[a] = motion.velocities[a]
        before[a] = after[a] - motion.jump[a]
    for j in range(motion.columns):
        z = motion.velocities[own * (1 + j) : own * (2 + j)]
        for i in range(count):
            lifts[i] = row_lift(motion, j, i, before)
            motion.pull_slopes[j, i] *= restitution(motion, i, i)
            motion.pull_slopes[j, i] += slope(motion, j, local * local + (count + 1) * i) * first[i]
        for b in range(local):
            turned[b] = 0.0
            for c in range(local):
                turned[b] -= slope(motion, j, local * b + c) * motion.jump[c]
            for i in range(count):
                turned[b] += motion.slopes[j * size + begin + i * width + b] * motion.impulses[i]
                k = rub_of(motion, i)
                if k >= 0:
                    slips = slip_sign(motion, k) * rub_coefficient(motion, k)
                    entry = motion.slopes[j * size + begin + (count + k) * width + b]
                    turned[b] -= slips * entry * motion.impulses[i]
                    moved = slope(motion, j, begin - 2 * frictions + k)
                    slid = slip_sign(motion, k) * moved * row_entry(motion, count + k, b)
                    turned[b] -= slid * motion.impulses[i]
            for k in range(frictions):
                entry = motion.slopes[j * size + begin + (count + k) * width + b]
                turned[b] += entry * stuck[k]
        for a in range(local):
            given[a] = z[a]
            for b in range(local):
                given[a] += motion.inverse[a, b] * turned[b]
            for i in range(count):
                given[a] += push(motion, a, i) * motion.pull_slopes[j, i]
        row = 0
        for i in range(count):
            if acts >> i & 1:
                change = 0.0
                for k in range(count):
                    if chosen >> k & 1:
                        change += restitution(motion, i, k) * lifts[k]
                        change += slope(motion, j, local * local + count * i + k) * motion.gaps[k]
                for a in range(local):
                    z[a] = given[a]
                fill_sticking(motion, row, i, acts, -change - row_lift(motion, j, i, after))
                row += 1
        for k in range(frictions):
            if motion.sided[k, PartColumn.STRUCK] == FrictionImpact.STUCK:
                for a in range(local):
                    z[a] = given[a]
                fill_sticking(motion, row, count + k, acts, -row_lift(motion, j, count + k, after))
                row += 1
        eliminate(motion.block, unknown, unknown + 1)
        add_unknown(motion, acts, given)
        row = 0
        for i in range(count):
            if acts >> i & 1:
                motion.pull_slopes[j, i] += motion.block[row, unknown]
                row += 1
        for a in range(local):
            z[a] = given[a]


@lean_jit
def push_slope(motion, j, a, i):
    """The derivative of `push` to the coefficient of friction alone, along column j."""
    k = rub_of(motion, i)
    if k < 0:
        return 0.0
    moved = slope(motion, j, motion.solver_numbers.size - 2 * motion.sided.shape[0] + k)
    return -slip_sign(motion, k) * moved * motion.inverse[a, motion.sided[k, PartColumn.COORDINATE]]


@lean_jit
def rest_row_columns(motion, near):
    """`rest_columns` where contacts have rows: the impulses of frictions that stick follow from
    those of the contacts, as they keep the sliding speeds at 0."""
    count = motion.contacts.shape[0]
    frictions = motion.sided.shape[0]
    invert(motion.solver_numbers, motion.local, motion.first_order, motion.block, motion.inverse)
    fill_pushes(motion)
    size = 0
    for k in range(frictions):
        size += 1 if motion.sided[k, PartColumn.STRUCK] == FrictionImpact.STUCK else 0
    row = 0
    for k in range(frictions):
        motion.stuck_impulses[k] = 0.0
        if motion.sided[k, PartColumn.STRUCK] != FrictionImpact.STUCK:
            continue
        column = 0
        left = 0.0
        for other in range(frictions):
            if motion.sided[other, PartColumn.STRUCK] == FrictionImpact.STUCK:
                motion.block[row, column] = gives(motion, count + k, count + other)
                column += 1
        for i in range(count):
            left -= pushed(motion, count + k, i) * motion.impulses[i]
        motion.block[row, size] = left
        row += 1
    if eliminate(motion.block, size, size + 1):
        row = 0
        for k in range(frictions):
            if motion.sided[k, PartColumn.STRUCK] == FrictionImpact.STUCK:
                motion.stuck_impulses[k] = motion.block[row, size]
                row += 1
    for j in range(motion.columns):
        for i in range(count):
            motion.pull_slopes[j, i] = 0.0
    rubbing_columns(motion, near, 0, zeros(count))


@lean_jit
def rest_columns(motion, near):
    """The columns at the end of an accumulation, where impulses on the contacts in `near` alone
    take their speeds.
    """
    local = motion.local
    for a in range(local):
        motion.jump[a] = 0.0
        for i in range(motion.contacts.shape[0]):
            motion.jump[a] += push(motion, a, i) * motion.impulses[i]
    if motion.multipliers > 0:
        rest_row_columns(motion, near)
    elif is_pressed(motion):
        invert(motion.solver_numbers, local, motion.first_order, motion.block, motion.inverse)
        for j in range(motion.columns):
            for i in range(motion.contacts.shape[0]):
                motion.pull_slopes[j, i] = 0.0
        rubbing_columns(motion, near, 0, zeros(motion.contacts.shape[0]))
    else:
        impulse_columns(motion, near, 0)
    hold_columns(motion, near)


@lean_jit
def free_pulls(motion, t):
    """Fill the second derivatives of the gaps with all contacts open, and in `falling_pulls` the
    relative rates at which they change.
    """
    if motion.multipliers > 0:
        free_row_pulls(motion, t)
        return
    first = first_flag(motion)
    for i in range(motion.local):
        motion.parameters[first + i] = 1.0
    expand(motion, t, 1.0, 3)  # one more than is read, for coordinates of first order
    for i in range(motion.contacts.shape[0]):
        a = motion.acceleration_series[motion.contacts[i, PartColumn.COORDINATE]]
        motion.pulls[i] = motion.signs[i] * a[0]
        # bodies that fall together do not press on one another, and go on so
        motion.falling_pulls[i] = change_rate(a)


@lean_jit
def free_row_pulls(motion, t):
    """`free_pulls` of contacts with rows."""
    first = first_flag(motion)
    for r in range(motion.multipliers):
        motion.parameters[first + r] = 1.0
    expand(motion, t, 1.0, 4)
    for i in range(motion.contacts.shape[0]):
        series = motion.margin_series[row_series(motion, i)]
        motion.polynomial[0] = 2.0 * series[2]
        motion.polynomial[1] = 6.0 * series[3]
        motion.polynomial[2] = 12.0 * series[4]
        motion.pulls[i] = motion.polynomial[0]
        motion.falling_pulls[i] = change_rate(motion.polynomial)


@lean_jit
def frozen_limit(motion, near, share):
    """The time for which the accelerations of the contacts in `near` may be taken as constant, as
    they change by at most this share, from what `free_pulls` has filled; at most up to the next
    breakpoint of the records.
    """
    change = 0.0
    for i in range(motion.contacts.shape[0]):
        if near >> i & 1:
            change = max(change, motion.falling_pulls[i])
    limit = piece_end(motion) - motion.time
    return min(limit, share / change) if change > 0.0 else limit


@lean_jit
def turns_with(motion, i):
    """1 plus the number of a friction on ground at rest along the coordinate of a contact, that
    turns with its bounces; or 0.
    """
    rubs = rubs_along(motion, i)
    return rubs if rubs and guard_level(motion, rubs - 1) == 0.0 else 0


OTHERS = 10.0  # A contact is beside an accumulation if it closes later by this factor.


@lean_jit
def fall_beside(motion, t, i, closed):
    """The acceleration with which a contact closes while those in `closed` are held; -1 if one of
    these does not press."""
    expand(motion, t, 1.0, 0)
    for j in range(motion.contacts.shape[0]):
        if closed >> j & 1 and not motion.margin_series[j, 0] > 0.0:
            return -1.0
    coordinate = motion.contacts[i, PartColumn.COORDINATE]
    return -motion.signs[i] * motion.acceleration_series[coordinate, 0]


@lean_jit
def rubbed_accumulation(motion, t, closed, i, limit):
    """The time in which a contact loses its speed by impacts, where a friction along its coordinate
    turns at the top of each flight. The accelerations are constant, b before the top and c after
    it:

        (u / b + u / sqrt(b c)) / (1 - e sqrt(c / b))    for a speed u.

    -1 if it does not lose it within `limit`, or if others take part: those in `closed` must press
    on their contacts before the top and after it, and open ones must not close by far.
    """
    u = motion.rates[i]
    k = rubs_along(motion, i) - 1
    for j in range(motion.contacts.shape[0]):
        if j != i and not closed >> j & 1:
            # the impacts change the rates of the others by about their own speeds
            rate = motion.rates[j] - OTHERS * u
            limit = min(limit, time_to_close(motion.gaps[j], rate, motion.pulls[j]) / OTHERS)
    hold_coordinates(motion)
    place = first_flag(motion)
    place += k - 2 - motion.sided.shape[0]
    motion.parameters[place] = motion.signs[i]
    rising = fall_beside(motion, t, i, closed)
    motion.parameters[place] = -motion.signs[i]
    falling = fall_beside(motion, t, i, closed)
    if not (rising > 0.0 and falling > 0.0):
        return -1.0
    left = 1.0 - restitution(motion, i, i) * math.sqrt(falling / rising)
    found = (u / rising + u / math.sqrt(rising * falling)) / left if left > 0.0 else np.inf
    return found if found <= limit else -1.0


@lean_jit
def unknown_shifts(motion):
    """Set the shifts of an event to nan."""
    for j in range(motion.columns):
        motion.event_shifts[j] = math.nan
