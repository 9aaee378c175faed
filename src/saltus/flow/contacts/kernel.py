"""The flow of a motion with several contacts: smooth steps, impacts, releases, accumulations of
impacts, rest.

The compiled parts of the files that `programs/compiled.py` names, of this file and of
`programs/loop.py`, which calls it, are compiled as one module, once for every model. All of a
motion's memory is in `motion` (see `kernel/memory.py`): `motion.contacts` has a row for each
contact, in the columns of `PartColumn`, and the last of `motion.parameters` say for each
coordinate whether it is free (1) or held (0).

In a smooth step the closed contacts hold their coordinates, and the model's series are those of the
constrained motion. Each contact has a guard: the gap if it is open, the reaction if it is closed.
If a gap reaches 0, the impact law acts. After this, and if a reaction reaches 0 or the load jumps,
it is decided again which of the contacts that are at rest at their positions stay closed. Frictions
and surfaces have rows behind those of the contacts (`parts.py`), and it is decided together which of
them stick.
"""

from __future__ import annotations

import math

import numpy as np

from saltus.flow.contacts.closings import (
    block_of,
    choose_closed,
    contact_impact,
    is_undetermined,
    note_ties,
    rests_in_a_row,
)
from saltus.flow.contacts.complementarity import is_pressed, slides_on
from saltus.flow.contacts.frictions import all_stand, stick_columns, sticking, tear_loose
from saltus.flow.contacts.functions import any_to_read, choose_sides, note_jumps
from saltus.flow.contacts.held_rows import (
    away_in_rows,
    end_in_rows,
    measure_slides,
    note_terms,
    onto_rows,
)
from saltus.flow.contacts.impacts import (
    closed_bits,
    contact_step_size,
    fill_contact_matrices,
    frozen_accumulation,
    hold_coordinates,
    keep_gap,
    lost_share,
    measure_gap,
    near_contacts,
    note_press,
    note_rubs,
    open_gap_series,
    press_of,
    record_contact_event,
    slow_impacts,
    smaller_set,
)
from saltus.flow.contacts.part_events import (
    first_sided,
    reach_guard,
    record_sides,
    sided_step_size,
    undecided,
)
from saltus.flow.contacts.parts import hold_sides, side_bits, states_before
from saltus.flow.contacts.propagators import (
    carries_columns,
    carry_columns,
    carry_on,
    columns_from_modes,
    input_step,
)
from saltus.flow.contacts.resets import keep_reached, lead_to_events, reset_state, resets_state
from saltus.flow.contacts.rows import (
    has_speed,
    is_nearly_rounding,
    largest_pull,
    limits_begin,
    row_series,
)
from saltus.flow.contacts.rubbing import (
    free_pulls,
    frozen_limit,
    rubbed_accumulation,
    turns_with,
    unknown_shifts,
)
from saltus.flow.contacts.surfaces import begin_on_surfaces, on_surfaces
from saltus.flow.contacts.tangent import (
    accumulation_shifts,
    event_shifts,
    fill_slopes,
    note_shifts,
    release_columns,
    start_columns,
)
from saltus.flow.kernel.contact_layout import (
    EXCESS,
    FADING_CHANGE,
    GAP_ROUNDING,
    MOST_TRIED,
    NEAR,
    TIED,
    TRIED_AGAIN,
    FrictionImpact,
    Guard,
    NoPress,
    PartColumn,
    PartKind,
    Reached,
    Touch,
    contact_position,
    first_flag,
    guard_level,
    is_function,
    solver_arrays,
)
from saltus.flow.kernel.layout import PENETRATED, ZERO, EventCode, Mode, Status
from saltus.flow.kernel.memory import ContactsParts
from saltus.flow.kernel.roots import (
    NEVER,
    SIMPLE,
    contact_root,
    horner,
    margin_root,
    nudged_share,
    value_and_slope,
)
from saltus.flow.kernel.steps import (
    clear_shifts,
    columns_at_event,
    columns_from_corner,
    columns_to_corner,
    expand,
    forget,
    in_modes,
    is_away,
    mode_arrays,
    motion_end,
    move,
    move_columns,
    natural_speed,
    note_impact,
    record_step,
    shortest_step,
    step_arrays,
    time_scale,
)
from saltus.taylor import jit, lean_jit

# --- compiled from here on ---------------------------------------------------


@lean_jit
def rest_after(motion, near, beside, limit):
    """`frozen_accumulation` where frictions in contacts go on as they do, else -1."""
    return frozen_accumulation(motion, near, beside, limit) if slides_on(motion, near) else -1.0


@lean_jit
def end_accumulation_of(motion, t):
    """Bring contacts to rest whose impacts accumulate soon; returns the end of the accumulation, or
    t if there is none.
    """
    count = motion.contacts.shape[0]
    if not fill_contact_matrices(motion):
        return t
    slow = slow_impacts(motion)
    slowest = np.inf
    last = -1
    fades = False
    for i in range(count):
        if not (0.0 < motion.rates[i] <= slowest and motion.gaps[i] == 0.0):
            continue
        faded = is_nearly_rounding(motion, i)
        if faded or motion.rates[i] <= slow * lost_share(motion, i):
            slowest = motion.rates[i]
            last = i
            fades = faded
    if last >= 0 and motion.contacts[last, PartColumn.WAITS] > 0 and not fades:
        motion.contacts[last, PartColumn.WAITS] -= 1
        last = -1
    if last < 0:
        return t
    slow = max(slow, slowest)
    share = FADING_CHANGE if fades else math.sqrt(10.0 * motion.tolerance)
    free_pulls(motion, t)
    near = near_contacts(motion, slow)
    turns = turns_with(motion, last)
    if turns and near != 0:
        near = near & closed_bits(motion) | 1 << last
    if near == 0 or (turns and not slides_on(motion, near)):
        return t
    limit = min(frozen_limit(motion, near, share), motion_end(motion) - t)
    together = near
    left = (
        rubbed_accumulation(motion, t, near & ~(1 << last), last, limit)
        if turns
        else rest_after(motion, near, -1, limit)
    )
    if left < 0.0 and not turns:
        near = smaller_set(motion, near)
        again = rest_after(motion, near, -1, limit) if near != 0 else -1.0
        left = again if again >= 0.0 else left + again
    # other blocks, which do not act on this one, may be bouncing too
    if left < 0.0 and not turns and count > MOST_TRIED:
        block = block_of(motion, 1 << last, False)
        if together & ~block:
            near = together & block
            again = rest_after(motion, near, block, limit)
            left = again if again >= 0.0 else left + again
    # on ever smaller scales, as of bodies beside others that still move
    while left < 0.0 and slow >= slowest and not turns:
        slow *= 1e-3
        slower = near_contacts(motion, slow)
        if slower != near and slower != 0:
            near = slower
            again = rest_after(motion, near, -1, limit)
            left = again if again >= 0.0 else left + again
    if left < 0.0:
        motion.contacts[last, PartColumn.WAITS] = int(-left) // TRIED_AGAIN
        return t
    if motion.columns > 0:
        if turns:
            unknown_shifts(motion)
        else:
            accumulation_shifts(motion, near, t)
    rests_in_a_row(motion, t, near, t + left)
    return t + left


@lean_jit
def decide_columns(motion, t):
    """Take the columns from an event back to a fixed time, or from the start on, once it is known
    which contacts are closed.
    """
    if motion.columns == 0:
        return
    if motion.leave_by == 1:
        first = first_flag(motion)
        for i in range(first, motion.parameters.size):
            motion.parameters[i] = 1.0
        start_columns(motion, t, closed_bits(motion))
        hold_coordinates(motion)
        hold_sides(motion)
    if motion.sided.shape[0] > 0 or motion.multipliers > 0:
        if is_pressed(motion) or motion.multipliers > 0:
            fill_contact_matrices(motion)
        fill_slopes(motion)
        stick_columns(motion, motion.contacts.shape[0])
    expand(motion, t, 1.0, 0)
    move_columns(motion, -1.0)
    clear_shifts(motion)


@lean_jit
def choose_holding(motion, candidates, still, held, t):
    """Decide which of the candidates stay closed and which frictions in `still` stick; False if no
    choice is consistent.
    """
    if (not candidates and not still) or choose_closed(motion, candidates, still, held, t, ZERO):
        return True
    note_ties(motion, candidates, t)
    # where nothing presses, what an accumulation leaves of gaps decides nothing
    return choose_closed(motion, candidates, still, held, t, ZERO) or choose_closed(
        motion, candidates, still, held, t, 1e3 * TIED
    )


@lean_jit
def choose_all(motion, candidates, still, held, t):
    """`choose_holding`, together with the sides of the surfaces on which the motion is; False if no
    choice is consistent, or the sides are not unique.

    What holds decides where the motion leaves a surface to, and the forces on its sides decide what
    holds.
    """
    on = on_surfaces(motion)
    read = any_to_read(motion)
    if motion.leave_by == 1 and on and begin_on_surfaces(motion, t) == 0:
        return False
    if read:
        choose_sides(motion, t)
    for _ in range(3 if on or read else 1):
        if not choose_holding(motion, candidates, still, held, t):
            return False
        hold_coordinates(motion)
        hold_sides(motion)
        moved = begin_on_surfaces(motion, t) if on else 1
        if read and moved > 0:
            turned = choose_sides(motion, t)
            moved = max(moved, turned) if turned > 0 else 0
        if moved < 2:
            return moved == 1
    return False


@lean_jit
def first_press(motion, t):
    """Begin the natural size of what presses, from the accelerations without contacts and their
    first derivatives in the natural time of the load."""
    span = motion.natural_time
    if motion.multipliers > 0:
        first_row_press(motion, t, span)
        return
    first = first_flag(motion)
    for i in range(motion.local):
        motion.parameters[first + i] = 1.0
    expand(motion, t, 1.0, 3)  # one more than is read, for coordinates of first order
    for row in range(motion.contacts.shape[0] + motion.sided.shape[0]):
        place = 0
        if row < motion.contacts.shape[0]:
            place = motion.contacts[row, PartColumn.COORDINATE]
        else:
            k = row - motion.contacts.shape[0]
            inert = motion.sided[k, PartColumn.PRESSED] == NoPress.INERT
            if inert or is_function(motion, k):
                continue
            place = motion.sided[k, PartColumn.COORDINATE]
        a = motion.acceleration_series[place]
        size = max(abs(a[0]), abs(a[1]) * span, 2.0 * abs(a[2]) * span * span)
        motion.press = max(motion.press, size)
    hold_coordinates(motion)
    hold_sides(motion)


@lean_jit
def first_row_press(motion, t, span):
    """`first_press` where contacts and frictions are rows."""
    first = first_flag(motion)
    for r in range(motion.multipliers):
        motion.parameters[first + r] = 1.0
    expand(motion, t, 1.0, 4)
    for r in range(motion.multipliers):
        if r < motion.contacts.shape[0] or has_speed(motion, r - motion.contacts.shape[0]):
            motion.press = max(motion.press, largest_pull(motion, r, span))
    hold_coordinates(motion)
    hold_sides(motion)


@lean_jit
def settle(motion):
    """Put columns that are carried in eigenmodes into the state, before anything reads them."""
    if motion.carried.size > 0 and motion.carried[0] > 0.0:
        carry_columns(motion, motion.carried[1])
        columns_from_modes(motion)
        motion.carried[0] = 0.0


@lean_jit
def decide_contacts(motion):
    """Decide which contacts are closed and which frictions stick from here on.

    Returns PAUSED to go on, NOT_UNIQUE, or UNRESOLVED where resets accumulate.
    """
    t = motion.time
    count = motion.contacts.shape[0]
    rested = motion.rested == 1
    settle(motion)
    event_shifts(motion)
    if motion.press == 0.0:
        first_press(motion, t)
    settled = end_accumulation_of(motion, t)
    candidates = closed_bits(motion)
    before = states_before(motion)
    fill_contact_matrices(motion)
    still = undecided(motion)
    held = sticking(motion, before)
    kept = keep_reached(motion, t)
    if not choose_all(motion, candidates, still, held, t):
        return Status.NOT_UNIQUE
    if kept and not lead_to_events(motion, t):
        return Status.UNRESOLVED
    if motion.multipliers > 0 and is_undetermined(motion, candidates, still, held, t):
        return Status.NOT_UNIQUE
    hold_coordinates(motion)
    hold_sides(motion)
    opened = candidates & ~closed_bits(motion)
    if opened and motion.leave_by == 0:
        for i in range(count):
            if opened >> i & 1:
                record_contact_event(motion, EventCode.RELEASE, 1 << i, t)
                if opened & (opened - 1):
                    note_shifts(motion, motion.event_shifts)
                else:
                    note_shifts(motion, motion.shifts)
    if motion.leave_by == 0:
        record_sides(motion, before, t)
    if motion.multipliers > 0:
        for k in range(motion.sided.shape[0]):
            motion.sided[k, PartColumn.STRUCK] = FrictionImpact.NOT
        onto_rows(motion)
    decide_columns(motion, t)
    motion.leave_by = 0
    motion.rested = 1 if all_stand(motion) else 0
    for i in range(count):
        motion.contacts[i, PartColumn.REACHED] = Reached.NO
    for k in range(motion.sided.shape[0]):
        motion.sided[k, PartColumn.REACHED] = Reached.NO
        if is_function(motion, k):
            motion.sided[k, PartColumn.STRUCK] = FrictionImpact.NOT
    if motion.rested == 1 and not rested:
        all_bits = closed_bits(motion)
        for k in range(motion.sided.shape[0]):
            if motion.sided[k, PartColumn.PRESSED] != NoPress.INERT:
                all_bits |= 1 << (count + k)
        record_contact_event(motion, EventCode.REST, all_bits, settled)
        note_shifts(motion, motion.event_shifts)
    motion.mode = Mode.REST if motion.rested == 1 else Mode.ARC
    motion.side = 1 + (closed_bits(motion) | side_bits(motion, count))
    return Status.PAUSED


# Series of a lower order than usual, for a step to the next impact on the same contact.
# In natural speeds: after a faster impact the usual order is needed to reach the next one.
FAST_IMPACT = 0.3
# A series of order n is assumed to be exact up to this, in natural times, times the n-th root of
# the tolerance.
RADIUS = 0.5
LEAST_ORDER = 6  # At lower orders the last coefficients may all vanish by symmetry.
WORTH = 0.8  # A lower order is tried only below this share of the usual one.


@lean_jit
def first_guard(motion, h, whole):
    """The contact whose guard reaches 0 first within the step, the instant, and whether the step is
    too long to decide on a touch near its end."""
    order = motion.order
    count = motion.contacts.shape[0]
    hit = -1
    first = NEVER
    shorter = False
    for i in range(count):
        skip = motion.contacts[i, PartColumn.SKIP]
        guard = motion.gap_series
        if motion.contacts[i, PartColumn.STATE] == Touch.CLOSED:
            if motion.contacts[i, PartColumn.IDLE] == 1:
                continue
            guard = motion.margin_series[i]
            if skip == 0 and guard[0] < -ZERO * press_of(motion, i):
                return i, 0.0, False
            if skip >= order:
                continue
        else:
            open_gap_series(motion, i, order, guard)
        kind, u, touch = contact_root(guard, skip, order, h, motion.polynomial)
        if motion.nudged == 1 + i:
            u = nudged_share(motion, u, h)
        if kind == SIMPLE and u < first:
            hit = i
            first = u
        shorter = shorter or (kind != SIMPLE and 0.75 < touch <= 1.0 and whole)
    return hit, first, shorter and hit < 0


# The share of a step up to which guards are looked at once more for earlier zeros: in units of what
# a gap is there, the rounding of the whole step's series is the inverse square of it.
SMALL_SHARE = 2.0**-5
EARLIER = 1.0 - 2.0**-20  # A zero before this share of the shorter step is another instant.


@lean_jit
def earlier_guard(motion, h, hit, rubs, first):
    """The contact, the friction and the share of the step of the first event, where another gap
    reaches 0 before the event that the step's whole length has shown.

    A gap of a bounce that is far shorter than the step reaches 0 and rises again within the
    rounding of a series that is scaled to the step.
    """
    for i in range(motion.contacts.shape[0]):
        open_beside = i != hit and motion.contacts[i, PartColumn.STATE] == Touch.OPEN
        if not open_beside or not 0.0 < first < SMALL_SHARE:
            continue
        open_gap_series(motion, i, motion.order, motion.gap_series)
        skip = motion.contacts[i, PartColumn.SKIP]
        kind, share, _ = contact_root(
            motion.gap_series, skip, motion.order, first * h, motion.polynomial
        )
        if kind == SIMPLE and share < EARLIER:
            hit = i
            rubs = -1
            first *= share
    return hit, rubs, first


@lean_jit
def contacts_closing_with(motion, hit, tau):
    """The open contacts that close with `hit` at `tau` within the step, to within rounding, as
    bits.
    """
    order = motion.order
    count = motion.contacts.shape[0]
    bits = 1 << hit
    g = motion.gap_series
    for i in range(count):
        if i == hit or motion.contacts[i, PartColumn.STATE] == Touch.CLOSED:
            continue
        open_gap_series(motion, i, order, g)
        size = (
            abs(g[0])
            + abs(g[1]) * tau
            + abs(g[2]) * tau * tau
            + GAP_ROUNDING * abs(contact_position(motion, i))
        )
        value, slope = value_and_slope(g, order, tau)
        if value <= NEAR * size and slope < 0.0:
            bits |= 1 << i
    return bits


@lean_jit
def short_order(motion, t):
    """The order of the series for a step to the next impact of a contact that has just impacted:
    lower than usual if that suffices.

    Until its next impact the gap is nearly a parabola, whose duration is known. Most impacts of
    accumulations are so close.
    """
    order = motion.order
    if motion.contacts.shape[0] == 0 or motion.multipliers > 0:
        return order
    flight = np.inf
    fast = FAST_IMPACT * natural_speed(motion)
    radius = RADIUS * time_scale(motion)
    for i in range(motion.contacts.shape[0]):
        rate = motion.signs[i] * motion.velocities[motion.contacts[i, PartColumn.COORDINATE]]
        if (
            motion.contacts[i, PartColumn.STATE] == Touch.OPEN
            and motion.contacts[i, PartColumn.SKIP] == 1
            and 0.0 < rate < fast
        ):
            if flight == np.inf:
                expand(motion, t, 1.0, 0)
            pull = (
                motion.signs[i]
                * motion.acceleration_series[motion.contacts[i, PartColumn.COORDINATE], 0]
            )
            if pull < 0.0:
                flight = min(flight, -2.0 * rate / pull)
    if not flight < radius:
        return order
    lower = max(LEAST_ORDER, math.ceil(math.log(motion.tolerance) / math.log(flight / radius)))
    return lower if lower < WORTH * order else order


@lean_jit
def seek_event(motion, t, target):
    """Expand the motion, and find the first zero of a guard or of a margin within a step.

    Returns the length of the step, and the length that the series allow; the contact, the friction
    and the margin, of which the one with the first zero is given and the others are -1; which of
    the friction's guards it is; and the share of the step of the zero.
    """
    order = motion.order
    count = motion.contacts.shape[0]
    margins = motion.margin_count
    carried = carries_columns(motion)
    if motion.eigenmodes.size > 0 and (carried or motion.columns == 0):
        size = in_modes(motion, t, order)
    else:
        size = expand(motion, t, 1.0, order)
    note_press(motion)
    note_rubs(motion)
    natural = contact_step_size(motion, t, target, size, not carried)
    if carried and natural > 0.0:
        natural = min(natural, input_step(motion, order, min(natural, target - t)))
    natural = sided_step_size(motion, count, natural, target - t)
    h = min(natural, target - t)
    whole = h == natural
    hit, first, shorter = first_guard(motion, h, whole)
    rubs, first_rub, which, shorter_rub = first_sided(motion, count, h, whole)
    if rubs >= 0 and first_rub < first:
        hit = -1
        first = first_rub
    else:
        rubs = -1
    if (shorter or shorter_rub) and hit < 0 and rubs < 0:
        h = 0.5 * h
    hit, rubs, first = earlier_guard(motion, h, hit, rubs, first)
    limit = -1
    first_limit = NEVER
    for j in range(limits_begin(motion), margins):
        u = margin_root(motion.margin_series[j], order, h, motion.polynomial)
        if u < first_limit:
            limit = j
            first_limit = u
    if first_limit <= first and limit >= 0:
        hit = -1
        rubs = -1
        first = first_limit
    else:
        limit = -1
    return h, natural, hit, rubs, limit, which, first


@lean_jit
def keep_gaps(motion, tau):
    """Take the gaps of open contacts that are not at 0 to `tau` within the step."""
    g = motion.gap_series
    for i in range(motion.contacts.shape[0] if motion.multipliers == 0 else 0):
        if (
            contact_position(motion, i) != 0.0
            and motion.contacts[i, PartColumn.STATE] == Touch.OPEN
        ):
            open_gap_series(motion, i, motion.order, g)
            motion.open_gaps[i] = horner(g, motion.order, tau)


@lean_jit
def measure_gaps(motion):
    """Set the gaps of contacts that are closed, or at 0, and keep those of the others."""
    for i in range(motion.contacts.shape[0] if motion.multipliers == 0 else 0):
        if (
            contact_position(motion, i) == 0.0
            or motion.contacts[i, PartColumn.STATE] == Touch.CLOSED
        ):
            measure_gap(motion, i)
        else:
            keep_gap(motion, i)


@lean_jit
def note_hit(motion, bits, tau):
    """Note the speeds and the accelerations of the contacts in `bits`, which close at `tau`, for the
    natural scales."""
    for i in range(motion.contacts.shape[0]):
        if bits >> i & 1 and motion.multipliers > 0:
            series = motion.margin_series[row_series(motion, i)]
            speed = 0.0
            pull = 0.0
            for k in range(motion.order, 0, -1):
                pull = pull * tau + speed
                speed = speed * tau + k * series[k]
            note_impact(motion, speed, pull)
        elif bits >> i & 1:
            place = motion.contacts[i, PartColumn.COORDINATE]
            speed, pull = value_and_slope(motion.velocity_series[place], motion.order, tau)
            note_impact(motion, speed, pull)


@lean_jit
def passes(motion, bits, rubs, tau):
    """Whether, at the end of a step of the length `tau`, the motion is somewhere else by more than
    rounding: beyond an open contact, away from a contact in `bits` that closes, or away from the
    surface `rubs` that it reaches.
    """
    # gaps of rows are looked at in `away_in_rows`
    first = motion.contacts.shape[0] if motion.multipliers > 0 else 0
    for row in range(first, motion.contacts.shape[0] + motion.sided.shape[0]):
        i = row
        k = row - motion.contacts.shape[0]
        place = 0
        position = 0.0
        gap = 0.0
        if k < 0 and motion.contacts[i, PartColumn.STATE] == Touch.OPEN:
            place = motion.contacts[i, PartColumn.COORDINATE]
            position = contact_position(motion, i)
            gap = motion.signs[i] * (motion.coordinates[place] - position)
            gap = -abs(gap) if bits >> i & 1 else gap
        if k >= 0 and k == rubs and motion.sided[k, PartColumn.KIND] == PartKind.SURFACE:
            place = motion.sided[k, PartColumn.COORDINATE]
            position = guard_level(motion, k)
            gap = -abs(motion.coordinates[place] - position)
        if gap < 0.0 and is_away(motion, gap, place, position, tau):
            return True
    return False


@lean_jit
def contact_arc(motion, target):
    """One smooth step, up to the first zero of a guard or of a margin.

    Returns PAUSED, or why the motion ends.
    """
    order = motion.order
    t = motion.time
    count = motion.contacts.shape[0]
    held = limits_begin(motion)
    motion.order = short_order(motion, t)
    h, natural, hit, rubs, limit, which, first = seek_event(motion, t, target)
    if motion.order < order and hit < 0:  # the impact does not come as soon as it seemed
        motion.order = order
        h, natural, hit, rubs, limit, which, first = seek_event(motion, t, target)
    found = hit >= 0 or rubs >= 0
    tau = first * h if found or limit >= 0 else h
    bits = 0
    if hit >= 0 and motion.contacts[hit, PartColumn.STATE] == Touch.OPEN:
        bits = contacts_closing_with(motion, hit, tau)
    note_hit(motion, bits, tau)
    keep_gaps(motion, tau)
    carried = carries_columns(motion)
    if carried:
        carry_on(motion, tau)
    finite = move(motion, tau, motion.own if carried else motion.dof)
    if found or limit >= 0:
        settle(motion)
    measure_gaps(motion)
    passed = passes(motion, bits, rubs if which == Guard.ITSELF else -1, tau)
    if motion.multipliers > 0 and finite:
        motion.time = t + tau
        finite = end_in_rows(motion, tau)
        passed = passed or away_in_rows(motion, bits, tau, PENETRATED + 10.0 * motion.tolerance)
    for i in range(motion.dof):
        for k in range(motion.order + 2, order + 2):
            motion.coordinate_series[i, k] = 0.0
    motion.order = order
    record_step(motion, motion.side, t, tau)
    if not finite or not h >= 0.0:
        return Status.NOT_FINITE
    if passed:
        return Status.PASSED
    motion.time = target if not found and limit < 0 and h == target - t else t + tau
    for i in range(count):
        motion.contacts[i, PartColumn.SKIP] = 0
    for k in range(motion.sided.shape[0]):
        # at an event at the same instant as the last one, what has just begun to slide goes on
        if tau > 0.0 or k == rubs or bits != 0:
            motion.sided[k, PartColumn.SKIP] = 0
    if bits != 0:  # the sign is the bit of the 64th contact
        note_jumps(motion)
        motion.mode = Mode.CONTACT
        t = motion.time
        return contact_impact(motion, t, bits)
    if hit >= 0:
        if motion.columns > 0:
            release_columns(motion, motion.time, hit)
        motion.mode = Mode.CONTACT
        motion.contacts[hit, PartColumn.REACHED] = Reached.FIRST if first > 0.0 else Reached.NO
        if first > 0.0:
            tear_loose(motion, hit)
    if rubs >= 0:
        fill_slopes(motion)
        resets = resets_state(motion, rubs, which)
        reach_guard(motion, count, motion.time, rubs, which, first > 0.0)
        motion.mode = Mode.CONTACT
        if resets:
            return reset_state(motion, rubs, motion.time)
    if limit >= 0:
        record_contact_event(motion, EventCode.LIMIT, 0, motion.time)
        motion.event_labels[motion.recorded_events - 1, 3] = limit - held
        if motion.columns > 0:
            columns_at_event(motion, EventCode.LIMIT, limit - held, motion.time, 1.0)
            note_shifts(motion, motion.shifts)
        return Status.LIMITED
    ended = found or natural > 0.1 * shortest_step(motion) or h == target - t
    return Status.PAUSED if ended else Status.STALLED


@lean_jit
def begin(motion):
    """Fill the memory that depends on the contacts and on the state."""
    fill_contact_matrices(motion)
    if motion.multipliers > 0:
        note_terms(motion)
        measure_slides(motion)
    for i in range(motion.contacts.shape[0] if motion.multipliers == 0 else 0):
        excess = motion.contacts[i, PartColumn.EXCESS]
        measure_gap(motion, i)
        if excess != 0:
            motion.open_gaps[i] += excess * EXCESS * abs(contact_position(motion, i))
            motion.contacts[i, PartColumn.EXCESS] = excess
    hold_coordinates(motion)
    hold_sides(motion)


@lean_jit
def waits(motion):
    """Whether a decision is due before the motion may end."""
    return motion.mode == Mode.CONTACT


@lean_jit
def spare_events(motion):
    """The number of events that one pass may record at most: impacts, or ends of accumulations and
    releases, of all contacts, what all frictions do, and a rest.
    """
    return 4 + 2 * (motion.contacts.shape[0] + motion.sided.shape[0])


@lean_jit
def at_corner(motion):
    """Transform the columns where the load has just had a corner. If anything is held, they are
    taken back from it once it is known what holds behind it."""
    settle(motion)
    if motion.mode == Mode.CONTACT:  # an impact at the same instant
        forget(motion)
        return
    columns_to_corner(motion, 1.0)
    if closed_bits(motion) == 0 and motion.sided.shape[0] == 0:
        columns_from_corner(motion, 1.0)


@lean_jit
def one_pass(motion, target, t_end):
    """A step up to `target` at most, or a decision. Returns PAUSED, or why the motion ends."""
    held = closed_bits(motion) != 0 or motion.sided.shape[0] > 0
    if motion.new_piece > 0 and held and motion.mode != Mode.CONTACT:
        motion.mode = Mode.CONTACT
        note_jumps(motion)
    if motion.mode == Mode.CONTACT:
        return decide_contacts(motion)
    # a motion that has left a singular start may be beyond it by rounding
    return contact_arc(motion, max(target, motion.time))


@jit
def parts_of(numbers, state, env, functions, rows, buffers):
    """The memory of a motion but for its numbers as one named tuple; `rows` are those of contacts,
    then of frictions.
    """
    count = functions.signs.size
    steps = step_arrays(numbers)
    contacts = rows[:count]
    frictions = rows[count:]
    solver = solver_arrays(
        numbers.local,
        count,
        numbers.columns,
        frictions.shape[0],
        numbers.contact_numbers,
        numbers.multipliers,
    )
    modes = mode_arrays(numbers, functions.eigenmodes)
    return ContactsParts(
        state, env, env[0], env[2], functions, contacts, frictions, steps, modes, solver, *buffers
    )
