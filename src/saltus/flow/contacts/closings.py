"""Which contacts at rest stay closed, and contacts that close, one alone or several at one instant,
as in cells that move alike.

Contacts whose coordinates neither the mass matrix nor E couples belong to different blocks. They do
not act on one another at an impact, since no impulse of one changes the rate of another's gap, and
their impacts are applied one after the other. In a neighbouring motion these impacts happen at
different instants, shifted by t_1 and t_2. Let f be the time derivative of the state (f_0 before
the impacts, f_1 and f_2 after one of them alone, f_12 after both), and R_1, R_2 the derivatives of
the impact maps. At a fixed time the columns x of the tangent then become

    R_2 (R_1 (x + f_0 t_1) + f_1 (t_2 - t_1)) - f_12 t_2,

which is linear in x. It is the derivative if the other order of impacts gives the same result, that
is, if

    (R_2 f_1 + R_1 f_2 - R_2 R_1 f_0 - f_12) (t_2 - t_1) = 0.

Otherwise there are only one-sided derivatives. Both orders are therefore tried. With springs
between cells, whose forces do not jump, they agree. With a damper between them they differ: the
impact of one mass changes the damper's force on the other mass, and the other mass's own impact
reverses the effect of this force only if it comes later (no difference remains with e = 0, where
the impact leaves no speed). Contacts of one block that close together have a derivative along
columns that keep them together.

Accumulations of impacts in several blocks that end at one instant are also treated one after the
other. Their order makes no difference, as no speed is left. At a release nothing jumps, however
many contacts open.

Its compiled part goes into one module with that of `kernel.py`; the words of `motion` are those of
`flow/kernel/memory.py`.
"""

from __future__ import annotations

import math

import numpy as np

from saltus.flow.contacts.complementarity import exchanged, fill_rubbing, is_pressed
from saltus.flow.contacts.frictions import (
    ALIKE,
    choose_slides,
    hold_frictions,
    rubs_along,
    slides_so,
)
from saltus.flow.contacts.impacts import (
    apply_impulses,
    bring_to_rest,
    closed_bits,
    fill_after,
    fill_contact_matrices,
    gap_series,
    hold_coordinates,
    impact_impulses,
    jump_first_order,
    record_contact_event,
    settle_contact,
    undecide,
)
from saltus.flow.contacts.layout import (
    APART,
    MOST_TRIED,
    TIED,
    ContactColumn,
    FrictionColumn,
    ImpactDetail,
    contact_position,
    copy_all,
)
from saltus.flow.contacts.rubbing import rest_columns, rubbing_impact
from saltus.flow.contacts.tangent import (
    clear_shifts,
    closing_columns,
    fill_slopes,
    gap_derivative,
    hold_columns,
    impulse_columns,
    jump_columns,
    move_columns,
    note_shifts,
    note_velocities,
    slope,
)
from saltus.flow.kernel.layout import ZERO, EventCode, Status
from saltus.flow.kernel.roots import leading
from saltus.flow.kernel.steps import expand, forget
from saltus.taylor import jit, lean_jit

# --- compiled from here on ---------------------------------------------------


@lean_jit
def violated(motion, candidates, zero):
    """The candidates of which the first Taylor coefficient of the guard above `zero` contradicts
    the choice of closed contacts, as bits; notes how many coefficients before it are 0."""
    order = motion.order
    g = motion.gap_series
    count = motion.contacts.shape[0]
    wrong = 0
    for i in range(count):
        if not candidates >> i & 1:
            continue
        known = motion.contacts[i, ContactColumn.RELEASED]
        if motion.contacts[i, ContactColumn.CLOSED] == 1:
            k = leading(motion.margin_series[i], known, order, zero)
            if k < order and motion.margin_series[i, k] < 0.0:
                wrong |= 1 << i
        else:
            gap_series(motion, i, contact_position(motion, i), order, g)
            if known == 1 and rubs_along(motion, i) and abs(g[2]) > ALIKE:
                known = 0  # its friction has changed with the release
            k = leading(g, 2 + known, order, zero)
            if k == order or g[k] < 0.0:
                wrong |= 1 << i
        motion.contacts[i, ContactColumn.SKIP] = k
    return wrong


@lean_jit
def exchange_closed(motion, candidates, still, t, zero):
    """As `choose_closed`, where there are too many contacts for trying all choices: by exchanges
    (`complementarity.py`).
    """
    count = motion.contacts.shape[0]
    for number in range(3 ** motion.frictions.shape[0]):
        if not choose_slides(motion, still, number):
            continue
        closed = candidates
        wrong = candidates
        least = count + 1
        for _ in range(count * count):
            for i in range(count):
                if candidates >> i & 1:
                    motion.contacts[i, ContactColumn.CLOSED] = closed >> i & 1
            hold_coordinates(motion)
            hold_frictions(motion)
            expand(motion, t, 1.0, motion.order)
            wrong = violated(motion, candidates, zero)
            if not wrong:
                break
            closed, least = exchanged(closed, wrong, least)
        if not wrong and slides_so(motion, count, still):
            return True
    return False


@lean_jit
def choose_closed(motion, candidates, still, t, zero):
    """Decide which of the candidates, which are at rest at their positions, stay closed; False if
    no choice is consistent.

    The choice fulfils 0 <= reaction _|_ second derivative of the gap >= 0; where both are 0, their
    first non-zero derivatives decide likewise. It is decided together which of the frictions in
    `still`, which have the speed of their ground, stick: all that can.
    """
    count = motion.contacts.shape[0]
    if count > MOST_TRIED:
        return exchange_closed(motion, candidates, still, t, zero)
    for number in range((1 << count) * 3 ** motion.frictions.shape[0]):
        choice = number & ((1 << count) - 1)  # the bits of those that open
        if choice & ~candidates:
            continue
        for i in range(count):
            if candidates >> i & 1:
                motion.contacts[i, ContactColumn.CLOSED] = 1 - (choice >> i & 1)
        if not choose_slides(motion, still, number >> count):
            continue
        hold_coordinates(motion)
        hold_frictions(motion)
        expand(motion, t, 1.0, motion.order)
        agrees = violated(motion, candidates, zero) == 0
        if agrees and slides_so(motion, count, still):
            return True
    return False


@lean_jit
def note_ties(motion, candidates, t):
    """Note for all candidates whose reaction is 0 within rounding that it is known to be 0, as for
    a contact that is released.

    Cells of a chain that move alike release their contacts at one instant, but with different
    rounding errors.
    """
    for i in range(motion.contacts.shape[0]):
        if candidates >> i & 1:
            motion.contacts[i, ContactColumn.CLOSED] = 1
    hold_coordinates(motion)
    expand(motion, t, 1.0, 2)
    for i in range(motion.contacts.shape[0]):
        if candidates >> i & 1 and abs(motion.margin_series[i, 0]) <= TIED:
            motion.contacts[i, ContactColumn.RELEASED] = 1


@lean_jit
def is_there(motion, place):
    """Whether one of the entries of `NUMBERS`, or its derivative along a column, is not 0."""
    found = motion.solver_numbers[place] != 0.0
    for j in range(motion.columns):
        found = found or slope(motion, j, place) != 0.0
    return found


@jit
def block_of(motion, hit, backwards):
    """The block of the first contact in `hit`, or of the last: the contacts that the mass matrix or
    E couples with it, as bits."""
    local = motion.local
    count = motion.contacts.shape[0]
    joined = np.zeros(local, np.bool_)
    start = 0
    grows = True
    block = 0
    fill_contact_matrices(motion)
    while not hit >> start & 1 or (backwards and start < count - 1 and hit >> start + 1):
        start += 1
    joined[motion.contacts[start, ContactColumn.COORDINATE]] = True
    if motion.columns > 0:
        fill_slopes(motion)
    while grows:
        grows = False
        for a in range(local):
            for b in range(local):
                if (
                    joined[a]
                    and not joined[b]
                    and (is_there(motion, local * a + b) or is_there(motion, local * b + a))
                ):
                    joined[b] = grows = True
        for i in range(count):
            for k in range(count):
                a = motion.contacts[i, ContactColumn.COORDINATE]
                b = motion.contacts[k, ContactColumn.COORDINATE]
                if joined[a] != joined[b] and is_there(motion, local * local + count * i + k):
                    joined[a] = joined[b] = grows = True
        for k in range(motion.frictions.shape[0]):
            if motion.frictions[k, FrictionColumn.PRESSED] > 0:
                a = motion.contacts[
                    motion.frictions[k, FrictionColumn.PRESSED] - 1, ContactColumn.COORDINATE
                ]
                b = motion.frictions[k, FrictionColumn.COORDINATE]
                if joined[a] != joined[b]:
                    joined[a] = joined[b] = grows = True
    for i in range(count):
        block |= 1 << i if joined[motion.contacts[i, ContactColumn.COORDINATE]] else 0
    return block


@lean_jit
def impact_of(motion, t, hit):
    """Apply the impact law to the contacts in `hit` and to those that are closed; an
    `ImpactDetail`, or -1 if it fails.
    """
    count = motion.contacts.shape[0]
    detail = int(ImpactDetail.REGULAR)
    regular = fill_contact_matrices(motion)
    chosen = hit
    for i in range(count):
        chosen |= motion.contacts[i, ContactColumn.CLOSED] << i
    if motion.columns > 0:
        detail = int(closing_columns(motion, t, hit))
        note_velocities(motion, 0.0)
    # a contact that is reached without a speed, to within the working precision
    for i in range(count):
        if hit >> i & 1:
            motion.rates[i] = min(motion.rates[i], 0.0)
        motion.gaps[i] = motion.rates[i]
    rubs = is_pressed(motion)
    solved = True
    acts = 0
    if not rubs:
        solved, acts = impact_impulses(motion, chosen, motion.rates)
    if not (regular and solved):
        return -1
    jump_columns(motion, hit)
    jump_first_order(motion, hit)
    if rubs:
        acts = rubbing_impact(motion, chosen, detail != ImpactDetail.NO_SPEED)
        if acts < 0:
            return -1
    else:
        apply_impulses(motion)
    for i in range(count):
        if chosen >> i & 1:
            settle_contact(motion, i, motion.rates[i])
    if motion.columns > 0 and detail != ImpactDetail.NO_SPEED:
        if not rubs:
            note_velocities(motion, -1.0)
            impulse_columns(motion, acts, chosen)
        hold_columns(motion, chosen)
    return detail


@lean_jit
def rates_between(motion, t, hit):
    """Fill the accelerations between two impacts in a row, after that of `hit`; returns the closed
    contacts that open, as bits."""
    candidates = closed_bits(motion)
    if candidates & hit and not choose_closed(motion, candidates, 0, t, ZERO):
        for i in range(motion.contacts.shape[0]):
            motion.contacts[i, ContactColumn.CLOSED] = candidates >> i & 1
    hold_coordinates(motion)
    hold_frictions(motion)
    expand(motion, t, 1.0, 0)
    return candidates & ~closed_bits(motion)


@lean_jit
def is_apart(one, other):
    """Whether two shifts differ by more than rounding, so that the events are not at one instant in
    neighbouring motions.
    """
    return not abs(one - other) <= APART * (abs(one) + abs(other))


@jit
def impacts_in_a_row(motion, t, hit, backwards):
    """The impacts of contacts that close at one instant, block by block; an `ImpactDetail`, or -1
    if one of them fails.

    `IMPULSES` then holds the impulses of all, and `EVENT_SHIFTS` the shift of the event, nan for
    columns along which the blocks' instants differ. The columns are those at the last impact, with
    the accelerations after it.
    """
    total = np.zeros(motion.contacts.shape[0])
    opened = 0
    found = int(ImpactDetail.REGULAR)
    begun = False
    together = motion.event_shifts
    while hit:
        block = hit & block_of(motion, hit, backwards) if hit & (hit - 1) else hit
        hit &= ~block
        detail = impact_of(motion, t, block)
        if detail < 0:
            return -1
        if found != ImpactDetail.NO_SPEED and detail != ImpactDetail.REGULAR:
            found = detail
        for i in range(total.size):
            total[i] += motion.impulses[i]
        for j in range(motion.columns):
            shift = motion.shifts[j]
            together[j] = math.nan if begun and is_apart(together[j], shift) else shift
        begun = True
        if hit and motion.columns > 0:
            opened |= rates_between(motion, t, block)
            move_columns(motion, -1.0)
            clear_shifts(motion)
    undecide(motion, opened)
    copy_all(total, motion.impulses)
    return found


@lean_jit
def compare_orders(motion, other):
    """Set the shifts of columns to nan that, taken back to a fixed time, differ from those of the
    other order of impacts; returns whether there is any such column."""
    own = motion.own
    dof = motion.dof
    a = motion.acceleration_series
    differs = False
    for j in range(motion.columns):
        u = own * (1 + j)
        shift = motion.shifts[j]
        size = 0.0
        apart = 0.0
        for i in range(own):
            v = motion.velocities[i]
            size = max(
                size,
                abs(motion.coordinates[u + i]),
                abs(motion.velocities[u + i]),
                abs(shift * v),
                abs(shift * a[i, 0]),
            )
            apart = max(apart, abs(motion.coordinates[u + i] - shift * v - other[u + i]))
            if i < own - motion.first_order:  # the velocities of the others follow from the state
                apart = max(
                    apart, abs(motion.velocities[u + i] - shift * a[i, 0] - other[u + dof + i])
                )
        if apart > APART * size:
            motion.shifts[j] = math.nan
            differs = True
    return differs


@jit
def impacts_in_any_order(motion, t, hit):
    """As `impacts_in_a_row`, in both orders; columns are nan where the order of the blocks makes a
    difference.
    """
    start = motion.state.copy()
    rows = motion.contacts.copy()
    impacts_in_a_row(motion, t, hit, True)
    rates_between(motion, t, hit)
    move_columns(motion, -1.0)
    other = motion.state.copy()
    copy_all(start, motion.state)
    for i in range(motion.contacts.shape[0]):
        copy_all(rows[i], motion.contacts[i])
    hold_coordinates(motion)
    hold_frictions(motion)
    detail = impacts_in_a_row(motion, t, hit, False)
    opened = rates_between(motion, t, hit)
    if compare_orders(motion, other) and detail == ImpactDetail.REGULAR:
        detail = int(ImpactDetail.ORDERED)
    undecide(motion, opened)
    return detail


@jit
def contact_impact(motion, t, hit):
    """Apply the impact law to all contacts whose gap is 0, of which those in `hit` have just
    closed. PAUSED, or NO_IMPACT.
    """
    record_contact_event(motion, EventCode.IMPACT, hit, t)
    if hit & (hit - 1) and motion.columns > 0:
        detail = impacts_in_any_order(motion, t, hit)
    else:
        detail = impacts_in_a_row(motion, t, hit, False)
    if detail < 0:
        return Status.NO_IMPACT
    fill_after(motion)
    if motion.columns > 0:
        motion.event_labels[motion.recorded_events - 1, 3] = detail
        if detail == ImpactDetail.NO_SPEED:
            forget(motion)
        else:
            note_shifts(motion, motion.event_shifts)
    return Status.PAUSED


@jit
def rests_in_a_row(motion, t, near):
    """Bring the contacts in `near`, whose impacts accumulate, to rest: each block at the instant of
    its own last impact.
    """
    total = np.zeros(motion.contacts.shape[0])
    jumped = 0
    for i in range(motion.contacts.shape[0]):
        jumped |= 1 << i if near >> i & 1 and motion.gaps[i] == 0.0 and motion.rates[i] > 0.0 else 0
    several = jumped & (jumped - 1) != 0
    while near:
        block = near & block_of(motion, jumped, False) if jumped & (jumped - 1) else near
        if several and motion.columns > 0:
            hold_coordinates(motion)
            hold_frictions(motion)
            expand(motion, t, 1.0, 0)
            move_columns(motion, -1.0)
            clear_shifts(motion)
            fill_contact_matrices(motion)
            fill_slopes(motion)
            for i in range(motion.contacts.shape[0]):
                for j in range(motion.columns if jumped & block & 1 << i else 0):
                    motion.shifts[j] = -gap_derivative(motion, j, i) / motion.rates[i]
            move_columns(motion, 1.0)
        near, jumped = near & ~block, jumped & ~block
        jump_columns(motion, block)
        jump_first_order(motion, block)
        if is_pressed(motion):
            fill_contact_matrices(motion)
            fill_rubbing(motion)
        bring_to_rest(motion, block)
        if motion.columns > 0:
            rest_columns(motion, block)
        for i in range(total.size):
            total[i] += motion.impulses[i]
    copy_all(total, motion.impulses)
