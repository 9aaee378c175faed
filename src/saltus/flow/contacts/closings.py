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
reverses the effect of this force only if it comes later. No difference remains with e = 0, where
the impact leaves no speed. Contacts of one block that close together have a derivative along
columns that keep them together.

Accumulations of impacts in several blocks that end at one instant are also treated one after the
other. Their order makes no difference, as no speed is left. At a release nothing jumps, however
many contacts open.

A contact is a part of the kind CONTACT. Its answers to the questions of `parts.py`:

1. A row before all others; COORDINATE is the one that it holds, or the row has entries that
   multipliers hold (`rows.py`).
2. The gap while it is open (`open_gap_series`).
3. Its state is OPEN or CLOSED; the functions read 0 for each coordinate, or row, that is not free.
4. While it is closed, its reaction, which only pushes. One that follows from what else is held is
   IDLE and carries nothing.
5. Gaps and reactions bound the step (`contact_step_size`).
6. The simple root of the gap or of the reaction (`first_guard`).
7. At 0 of the gap the impact law acts (`contact_impact`), and ends of accumulations are looked for
   (`end_accumulation_of`); at 0 of the reaction nothing jumps.
8. Contacts at rest at their positions stay closed or open, together with frictions
   (`choose_closed`).
9. IMPACT, GRAZING, RELEASE and REST.
10. The saltation of the impact law (`tangent.py`); a contact that closes takes its columns along.
11. Closed where gap and rate are 0; beyond it there is no start.

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
    leans,
    margin_size,
    rubs_along,
    slides_so,
)
from saltus.flow.contacts.held_rows import (
    all_idle_stay,
    forget_idle,
    mark_idle,
    measure_slides,
    onto,
    some_idle,
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
    press_of,
    record_contact_event,
    settle_contact,
    undecide,
)
from saltus.flow.contacts.parts import hold_sides
from saltus.flow.contacts.rows import gives, pull_of
from saltus.flow.contacts.rubbing import rest_columns, rubbing_impact
from saltus.flow.contacts.tangent import (
    closing_columns,
    fill_slopes,
    gap_derivative,
    hold_columns,
    impulse_columns,
    jump_columns,
    note_shifts,
    note_velocities,
    slope,
)
from saltus.flow.kernel.contact_layout import (
    APART,
    EQUAL_PUSH,
    LETS_GO,
    MOST_TRIED,
    ROW_ROUNDING,
    SAME_MOTION,
    TIED,
    ImpactDetail,
    PartColumn,
    Reached,
    Side,
    Touch,
    contact_position,
    copy_all,
    restitution,
)
from saltus.flow.kernel.layout import ZERO, EventCode, Status
from saltus.flow.kernel.roots import growth_of, leading
from saltus.flow.kernel.steps import clear_shifts, expand, forget, move_columns
from saltus.taylor import jit, lean_jit

# --- compiled from here on ---------------------------------------------------


@lean_jit
def deciding(motion, coefficients, start, zero, size, base):
    """`leading`, where a later coefficient may be all that is left of accelerations that cancel:
    these grow at a rate that it does not show.
    """
    order = motion.order
    k = leading(coefficients, start, order, zero, size, base, 0.0)
    if not start < k < order or not motion.press > 0.0:
        return k
    rate = 0.0
    for i in range(motion.local):
        rate = growth_of(motion.acceleration_series[i], 1, order - 1, motion.press, 0, rate)
    return leading(coefficients, start, order, zero, size, base, rate)


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
        if motion.multipliers > 0 and motion.contacts[i, PartColumn.IDLE] == 1:
            motion.contacts[i, PartColumn.SKIP] = 0
            continue  # see `all_idle_stay`
        known = motion.contacts[i, PartColumn.REACHED]
        if motion.contacts[i, PartColumn.STATE] == Touch.CLOSED:
            k = deciding(motion, motion.margin_series[i], known, zero, press_of(motion, i), 0)
            if k < order and motion.margin_series[i, k] < 0.0:
                wrong |= 1 << i
        else:
            gap_series(motion, i, contact_position(motion, i), order, g)
            if known == 1 and rubs_along(motion, i) and abs(g[2]) > ALIKE * motion.press:
                known = 0  # its friction has changed with the release
            k = deciding(motion, g, 2 + known, zero, motion.press, 2)
            if k == order or g[k] < 0.0:
                wrong |= 1 << i
        motion.contacts[i, PartColumn.SKIP] = k
    return wrong


@lean_jit
def set_choice(motion, candidates, still, number):
    """Let contacts and frictions do what a number says: its lowest bits open those of the
    `candidates`, as far as contacts are tried, and the base-3 digits of the rest are those of
    `choose_slides`. False if a friction whose contact is open has a digit other than 0.
    """
    count = motion.contacts.shape[0]
    if motion.multipliers > 0:
        forget_idle(motion)
    for i in range(count):
        if candidates >> i & 1:
            motion.contacts[i, PartColumn.STATE] = Touch.CLOSED
            if count <= MOST_TRIED:
                motion.contacts[i, PartColumn.STATE] = 1 - number % 2
                number //= 2
    return choose_slides(motion, still, number)


@lean_jit
def changes_of(motion, candidates, still, held):
    """How much the present choice changes: LETS_GO for each contact that opens and each friction
    in `held` that lets go, and 1 for each other friction in `still` that does not stick.
    """
    changes = 0
    for i in range(motion.contacts.shape[0]):
        if candidates >> i & 1 and motion.contacts[i, PartColumn.STATE] == Touch.OPEN:
            changes += LETS_GO
    for k in range(motion.sided.shape[0]):
        if still >> k & 1 and abs(motion.sided[k, PartColumn.STATE]) == 1:
            changes += LETS_GO if held >> k & 1 else 1
    return changes


# The order of the series that has the first coefficients of all guards.
FIRST_TERMS = 2


@lean_jit
def first_decide(motion, candidates, still, zero):
    """Whether the first coefficients of the guards of the present choice are more than rounding, so
    that `violated` and `slides_so` read no later ones.
    """
    count = motion.contacts.shape[0]
    if motion.multipliers > 0 and some_idle(motion):
        return False
    for i in range(count):
        if candidates >> i & 1:
            first = abs(motion.margin_series[i, 0])
            size = press_of(motion, i)
            if motion.contacts[i, PartColumn.STATE] == Touch.OPEN:
                place = motion.contacts[i, PartColumn.COORDINATE]
                first = abs(motion.coordinate_series[place, 2])
                if motion.multipliers > 0:
                    first = abs(pull_of(motion, i))
                size = motion.press
            if motion.contacts[i, PartColumn.REACHED] == Reached.FIRST or not first > zero * size:
                return False
    for k in range(motion.sided.shape[0]):
        slides = motion.sided[k, PartColumn.STATE]
        if not still >> k & 1 or slides == Side.OFF or leans(motion, k):
            continue
        row = count + 2 * k
        reached = motion.sided[k, PartColumn.REACHED]
        place = motion.sided[k, PartColumn.COORDINATE]
        first = abs(motion.velocity_series[place, 1])
        if motion.multipliers > 0:
            first = abs(pull_of(motion, count + k))
        size = motion.press
        if slides == Side.HELD:
            first = min(abs(motion.margin_series[row, 0]), abs(motion.margin_series[row + 1, 0]))
            size = margin_size(motion, k)
        known = slides == Side.HELD and (reached == Reached.FIRST or reached == Reached.SECOND)
        if known or not first > (ALIKE if reached != Reached.NO else ZERO) * size:
            return False
    return True


@lean_jit
def is_consistent(motion, candidates, still, held, t, zero):
    """Whether the present choice fulfils the laws of contacts and frictions.

    Where there are too many contacts for trying all choices, those of the contacts are found by
    exchanges (`complementarity.py`).
    """
    count = motion.contacts.shape[0]
    closed = candidates
    least = count + 1
    if motion.multipliers > 0 and not mark_idle(motion, candidates, still):
        return False
    for _ in range(count * count if count > MOST_TRIED else 1):
        hold_coordinates(motion)
        hold_sides(motion)
        expand(motion, t, 1.0, FIRST_TERMS)
        if not first_decide(motion, candidates, still, zero):
            expand(motion, t, 1.0, motion.order)
        if motion.multipliers > 0 and not all_idle_stay(motion):
            return False
        wrong = violated(motion, candidates, zero)
        if not wrong:
            return slides_so(motion, count, still, held if motion.leave_by == 0 else 0)
        if count > MOST_TRIED:
            closed, least = exchanged(closed, wrong, least)
            for i in range(count):
                if candidates >> i & 1:
                    motion.contacts[i, PartColumn.STATE] = closed >> i & 1
    return False


@lean_jit
def push_of(motion):
    """a' M a of the present choice, with the accelerations a: it does not depend on the order of
    coordinates.
    """
    local = motion.local
    total = 0.0
    a = motion.acceleration_series
    for i in range(local - motion.first_order):
        for j in range(local - motion.first_order):
            total += a[i, 0] * motion.solver_numbers[local * i + j] * a[j, 0]
    return total


@lean_jit
def note_motion(motion):
    """Note the accelerations of a choice, for `moves_alike`."""
    for i in range(motion.local):
        motion.jump[i] = motion.acceleration_series[i, 0]


@lean_jit
def moves_alike(motion):
    """Whether the accelerations are those noted, up to rounding."""
    alike = 0.0
    least = 0.0
    for i in range(motion.local):
        for j in range(motion.local):
            mass = motion.solver_numbers[motion.local * i + j]
            one = motion.acceleration_series[i, 0]
            other = motion.acceleration_series[j, 0]
            alike += (one - motion.jump[i]) * mass * (other - motion.jump[j])
            least += one * mass * other + motion.jump[i] * mass * motion.jump[j]
    # where nothing moves the accelerations are rounding of what presses
    for i in range(motion.contacts.shape[0]):
        least += motion.margin_series[i, 0] ** 2 * motion.mobilities[i]
    return alike <= SAME_MOTION * least


@lean_jit
def more_changes(motion, candidates, still, held, numbers, changes):
    """The least number of changes above `changes` of all choices, or -1."""
    least = -1
    for number in range(numbers):
        if set_choice(motion, candidates, still, number):
            more = changes_of(motion, candidates, still, held)
            if more > changes and (least < 0 or more < least):
                least = more
    return least


@lean_jit
def count_choices(motion, candidates, still):
    """The number of choices that `set_choice` takes."""
    numbers = 1
    for i in range(motion.contacts.shape[0]):
        if motion.contacts.shape[0] <= MOST_TRIED and candidates >> i & 1:
            numbers *= 2
    for k in range(motion.sided.shape[0]):
        if still >> k & 1:
            numbers *= 3
    return numbers


@lean_jit
def slides_alone(motion, still, held, t, zero, numbers):
    """Let the only undecided friction slide, as it cannot stick; False if neither direction is
    consistent.
    """
    for number in range(1, numbers):
        chosen = set_choice(motion, 0, still, number)
        if chosen and is_consistent(motion, 0, still, held, t, zero):
            return True
    return False


@lean_jit
def choose_closed(motion, candidates, still, held, t, zero):
    """Decide which of the candidates, which are at rest at their positions, stay closed; False if
    no choice is consistent.

    The choice fulfils 0 <= reaction _|_ second derivative of the gap >= 0; where both are 0, their
    first non-zero derivatives decide likewise. It is decided together which of the frictions in
    `still`, which have the speed of their ground, stick.

    With static coefficients above the kinetic ones several choices may be consistent. The one that
    changes least is taken (`changes_of`): what holds goes on holding if it can, and what has just
    come to the speed of its ground sticks if it can. Of several that change equally little it is
    the one with the least push (`push_of`), and `ties` counts the instant. If these are equal too,
    as in a symmetric system, one that changes more is taken if it is alone. So the order in which
    contacts, frictions and coordinates are declared decides nothing.
    """
    # all others change more, so that they are looked at only if this one fails
    unchanged = set_choice(motion, candidates, still, 0)
    if unchanged and is_consistent(motion, candidates, still, held, t, zero):
        return True
    numbers = count_choices(motion, candidates, still)
    single = still & (still - 1) == 0  # no two choices of one friction are consistent
    if single and candidates == 0:
        return slides_alone(motion, still, held, t, zero, numbers)
    changes = 0
    found = -1
    several = False
    while True:
        changes = more_changes(motion, candidates, still, held, numbers, changes)
        if changes < 0:
            break
        least = np.inf
        best = -1
        alike = False
        for number in range(numbers):
            if not set_choice(motion, candidates, still, number):
                continue
            if changes_of(motion, candidates, still, held) != changes:
                continue
            if not is_consistent(motion, candidates, still, held, t, zero):
                continue
            if single:
                return True
            if best >= 0 and motion.multipliers > 0 and moves_alike(motion):
                continue  # other reactions of the same motion
            push = push_of(motion)
            if motion.multipliers > 0:
                note_motion(motion)
            several = several or best >= 0
            if best < 0 or push < least - EQUAL_PUSH * abs(least):
                alike = False
                best = number
                least = push
            elif push <= least + EQUAL_PUSH * abs(least):
                alike = True
        if best >= 0 and not alike:
            found = best
            break
        if found < 0:
            found = best
    if found < 0:
        return False
    if several and motion.leave_by == 0:
        if motion.ties == 0:
            motion.tied_at = motion.origin + t
        motion.ties += 1
    set_choice(motion, candidates, still, found)
    return is_consistent(motion, candidates, still, held, t, zero)


@lean_jit
def slides_beside_idle(motion):
    """Whether a contact is idle while a friction slides in a closed one, so that its force depends
    on which of them carry."""
    idle = False
    slides = False
    for i in range(motion.contacts.shape[0]):
        idle = idle or motion.contacts[i, PartColumn.IDLE] == 1
    for k in range(motion.sided.shape[0]):
        pressed = motion.sided[k, PartColumn.PRESSED] > 0
        slides = slides or (pressed and abs(motion.sided[k, PartColumn.STATE]) == 1)
    return idle and slides


@jit
def is_undetermined(motion, candidates, still, held, t):
    """Whether another choice, with reactions on other contacts, gives another motion than the one
    that has just been made."""
    if not slides_beside_idle(motion):
        return False
    contacts = motion.contacts.copy()
    frictions = motion.sided.copy()
    note_motion(motion)
    differs = False
    for number in range(count_choices(motion, candidates, still)):
        if not set_choice(motion, candidates, still, number):
            continue
        consistent = is_consistent(motion, candidates, still, held, t, ZERO)
        differs = differs or (consistent and not moves_alike(motion))
    for i in range(motion.contacts.shape[0]):
        copy_all(contacts[i], motion.contacts[i])
    for k in range(motion.sided.shape[0]):
        copy_all(frictions[k], motion.sided[k])
    return differs


@lean_jit
def note_ties(motion, candidates, t):
    """Note for all candidates whose reaction is 0 within rounding that it is known to be 0, as for
    a contact that is released.

    Cells of a chain that move alike release their contacts at one instant, but with different
    rounding errors.
    """
    for i in range(motion.contacts.shape[0]):
        if candidates >> i & 1:
            motion.contacts[i, PartColumn.STATE] = Touch.CLOSED
    if motion.multipliers > 0:
        forget_idle(motion)
        if not mark_idle(motion, candidates, 0):
            return
    hold_coordinates(motion)
    expand(motion, t, 1.0, 2)
    for i in range(motion.contacts.shape[0]):
        if candidates >> i & 1 and abs(motion.margin_series[i, 0]) <= TIED * press_of(motion, i):
            motion.contacts[i, PartColumn.REACHED] = Reached.FIRST


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
    if motion.multipliers > 0:
        return block_of_rows(motion, hit, backwards)
    while not hit >> start & 1 or (backwards and start < count - 1 and hit >> start + 1):
        start += 1
    joined[motion.contacts[start, PartColumn.COORDINATE]] = True
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
                a = motion.contacts[i, PartColumn.COORDINATE]
                b = motion.contacts[k, PartColumn.COORDINATE]
                if joined[a] != joined[b] and is_there(motion, local * local + count * i + k):
                    joined[a] = joined[b] = grows = True
        for k in range(motion.sided.shape[0]):
            if motion.sided[k, PartColumn.PRESSED] > 0:
                a = motion.contacts[motion.sided[k, PartColumn.PRESSED] - 1, PartColumn.COORDINATE]
                b = motion.sided[k, PartColumn.COORDINATE]
                if joined[a] != joined[b]:
                    joined[a] = joined[b] = grows = True
    for i in range(count):
        block |= 1 << i if joined[motion.contacts[i, PartColumn.COORDINATE]] else 0
    return block


@lean_jit
def are_coupled(motion, i, j):
    """Whether an impact on one of two contacts with rows changes the rate of the other's gap, or of
    its friction."""
    count = motion.contacts.shape[0]
    if restitution(motion, i, j) != 0.0 or restitution(motion, j, i) != 0.0:
        return True
    for r in range(motion.multipliers):
        for s in range(motion.multipliers):
            one = r == i or (r >= count and motion.sided[r - count, PartColumn.PRESSED] == i + 1)
            other = s == j or (s >= count and motion.sided[s - count, PartColumn.PRESSED] == j + 1)
            size = math.sqrt(motion.mobilities[r] * motion.mobilities[s])
            if one and other and abs(gives(motion, r, s)) > ROW_ROUNDING * size:
                return True
    return False


@lean_jit
def block_of_rows(motion, hit, backwards):
    """`block_of` for contacts with rows."""
    count = motion.contacts.shape[0]
    start = 0
    while not hit >> start & 1 or (backwards and start < count - 1 and hit >> start + 1):
        start += 1
    block = 1 << start
    grows = True
    while grows:
        grows = False
        for i in range(count):
            for j in range(count):
                if block >> i & 1 and not block >> j & 1 and are_coupled(motion, i, j):
                    block |= 1 << j
                    grows = True
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
        chosen |= motion.contacts[i, PartColumn.STATE] << i
    if motion.multipliers > 0:
        onto(motion, chosen, 0, -1)
        regular = fill_contact_matrices(motion)
    if motion.columns > 0:
        detail = int(closing_columns(motion, t, hit))
        note_velocities(motion, 0.0)
    # a contact that is reached without a speed, to within the working precision
    for i in range(count):
        if hit >> i & 1:
            motion.rates[i] = min(motion.rates[i], 0.0)
        motion.gaps[i] = motion.rates[i]
    rubs = is_pressed(motion) or motion.multipliers > 0
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
    if motion.multipliers > 0:
        measure_slides(motion)
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
    if candidates & hit and not choose_closed(motion, candidates, 0, 0, t, ZERO):
        for i in range(motion.contacts.shape[0]):
            motion.contacts[i, PartColumn.STATE] = candidates >> i & 1
    hold_coordinates(motion)
    hold_sides(motion)
    expand(motion, t, 1.0, 0)
    return candidates & ~closed_bits(motion)


@jit
def impacts_in_a_row(motion, t, hit, backwards):
    """The impacts of contacts that close at one instant, block by block; an `ImpactDetail`, or -1
    if one of them fails.

    Each block has its own event, so that the number of events does not depend on whether rounding
    lets blocks that move alike close at one instant. The columns are those at the last impact,
    with the accelerations after it.
    """
    opened = 0
    found = int(ImpactDetail.REGULAR)
    while hit:
        block = hit & block_of(motion, hit, backwards) if hit & (hit - 1) else hit
        hit &= ~block
        record_contact_event(motion, EventCode.IMPACT, block, t)
        detail = impact_of(motion, t, block)
        if detail < 0:
            return -1
        fill_after(motion)
        if motion.columns > 0:
            motion.event_labels[motion.recorded_events - 1, 3] = detail
            if detail != ImpactDetail.NO_SPEED:
                note_shifts(motion, motion.shifts)
        if found != ImpactDetail.NO_SPEED and detail != ImpactDetail.REGULAR:
            found = detail
        if hit and motion.columns > 0:
            opened |= rates_between(motion, t, block)
            move_columns(motion, -1.0)
            clear_shifts(motion)
    undecide(motion, opened)
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
    recorded = motion.recorded_events
    impacts_in_a_row(motion, t, hit, True)
    motion.recorded_events = recorded
    rates_between(motion, t, hit)
    move_columns(motion, -1.0)
    other = motion.state.copy()
    copy_all(start, motion.state)
    for i in range(motion.contacts.shape[0]):
        copy_all(rows[i], motion.contacts[i])
    hold_coordinates(motion)
    hold_sides(motion)
    detail = impacts_in_a_row(motion, t, hit, False)
    opened = rates_between(motion, t, hit)
    if compare_orders(motion, other) and detail == ImpactDetail.REGULAR:
        detail = int(ImpactDetail.ORDERED)
        motion.event_labels[motion.recorded_events - 1, 3] = detail
    undecide(motion, opened)
    return detail


@jit
def contact_impact(motion, t, hit):
    """Apply the impact law to all contacts whose gap is 0, of which those in `hit` have just
    closed. PAUSED, or NO_IMPACT.
    """
    if hit & (hit - 1) and motion.columns > 0:
        detail = impacts_in_any_order(motion, t, hit)
    else:
        detail = impacts_in_a_row(motion, t, hit, False)
    if detail < 0:
        return Status.NO_IMPACT
    if motion.columns > 0 and detail == ImpactDetail.NO_SPEED:
        forget(motion)
    return Status.PAUSED


@jit
def rests_in_a_row(motion, t, near, end):
    """Bring the contacts in `near`, whose impacts accumulate until `end`, to rest: each block at
    the instant of its own last impact, with an event of its own.
    """
    moving = 0
    for i in range(motion.contacts.shape[0]):
        moving |= (1 << i) if near >> i & 1 and motion.rates[i] != 0.0 else 0
    jumped = 0
    for i in range(motion.contacts.shape[0]):
        jumped |= 1 << i if near >> i & 1 and motion.gaps[i] == 0.0 and motion.rates[i] > 0.0 else 0
    several = jumped & (jumped - 1) != 0
    while near:
        block = near & block_of(motion, jumped, False) if jumped & (jumped - 1) else near
        if several and motion.columns > 0:
            hold_coordinates(motion)
            hold_sides(motion)
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
        record_contact_event(motion, EventCode.HELD, moving & block, end)
        if motion.columns > 0:
            note_shifts(motion, motion.event_shifts)
        jump_columns(motion, block)
        jump_first_order(motion, block)
        if is_pressed(motion):
            fill_contact_matrices(motion)
            fill_rubbing(motion)
        bring_to_rest(motion, block)
        if motion.multipliers > 0:
            measure_slides(motion)
        if motion.columns > 0:
            rest_columns(motion, block)
        fill_after(motion)
