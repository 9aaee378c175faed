"""Dry friction in the kernel for several contacts: a sticking coordinate is held like one at a
closed contact, but its friction force is bounded on both sides.

The kernel's array of contacts has a row for each friction behind those of the contacts, in the
columns of `FrictionColumn`; `frictions` are these rows. The guard of a friction that slides is the
speed q' - w in its direction; a friction that sticks has two guards, its margins (`stick_margins`).
A surface has a row behind those of the frictions: its guard is the distance of the coordinate from
its position on its side, or its function, and when it is reached the side changes. Directions and sides are kept in
the parameters of `env`, before the numbers that say which coordinates are free.

Its compiled part goes into one module with that of `kernel.py`; the words of `motion` are those of
`flow/kernel/memory.py`.
"""

from __future__ import annotations

import numpy as np

from saltus.flow.contacts.complementarity import eliminate, friction_rate
from saltus.flow.contacts.held_rows import all_rows_stand, guard_step, onto, some_idle, stop_row
from saltus.flow.contacts.impacts import friction_mobility, record_contact_event
from saltus.flow.contacts.rows import row_series
from saltus.flow.contacts.tangent import fill_slopes, note_shifts, slope
from saltus.flow.kernel.contact_layout import (
    TOGETHER,
    ContactColumn,
    FrictionColumn,
    FrictionImpact,
    NoPress,
    first_flag,
    ground_speed,
    is_function,
    is_relay,
    is_sum,
    is_surface,
)
from saltus.flow.kernel.layout import EXACT, ZERO, EventCode, Mode
from saltus.flow.kernel.roots import NEVER, SIMPLE, contact_root, leading, nudged_share
from saltus.flow.kernel.steps import (
    column_step,
    columns_at_event,
    expand,
    move_columns,
    shortest_step,
    state_size,
    step_size,
    time_scale,
)
from saltus.taylor import lean_jit

# --- compiled from here on ---------------------------------------------------

# If mu_s = mu_k, the acceleration with which sliding begins is 0, that is, by rounding, smaller
# than this, in units of what presses (`note_press`). So is a margin of a friction that can only
# just stick when its speed becomes that of the ground. In both cases the next coefficients decide.
ALIKE = 1e-12
# A coefficient of a function is rounding if its term (`span_of_terms`) is a smaller share of the
# largest one.
VANISHES = 1e-13
# A motion is at 0 of a function if this is a smaller share of its terms.
IS_ON = 1e-12


@lean_jit
def hold_frictions(motion):
    """Tell the model's functions, through `env`, in which direction each friction slides, and that
    sticking coordinates are not free."""
    first = first_flag(motion)
    for k in range(motion.frictions.shape[0]):
        slides = motion.frictions[k, FrictionColumn.SLIDES]
        motion.parameters[first - 2 - motion.frictions.shape[0] + k] = (
            1.0 * slides if slides != 2 else 0.0
        )
        if slides != 0 or is_function(motion, k):
            continue
        if motion.multipliers > 0:
            idle = motion.frictions[k, FrictionColumn.IDLE]
            motion.parameters[first - 2 - motion.frictions.shape[0] + k] = 2.0 * idle
            if idle == 0:
                motion.parameters[first + motion.contacts.shape[0] + k] = 0.0
        else:
            motion.parameters[first + motion.frictions[k, FrictionColumn.COORDINATE]] = 0.0


@lean_jit
def is_on_surface(motion, k):
    """Whether a row is that of a surface on which the motion is exactly, unless it has just passed
    it."""
    row = motion.frictions[k]
    if not is_surface(motion, k) or is_function(motion, k) or row[FrictionColumn.REACHED] == 3:
        return False
    if row[FrictionColumn.KEPT] == 1:
        return False
    return motion.coordinates[row[FrictionColumn.COORDINATE]] == ground_speed(motion, k)


@lean_jit
def on_surfaces(motion):
    """Whether the motion is on a surface that it has not just passed."""
    found = False
    for k in range(motion.frictions.shape[0]):
        found = found or is_on_surface(motion, k)
    return found


@lean_jit
def is_to_read(motion, k):
    """Whether the side of a function is to be chosen: it has just been reached, or may have
    jumped."""
    row = motion.frictions[k]
    found = row[FrictionColumn.REACHED] > 0 or row[FrictionColumn.STRUCK] == FrictionImpact.JUMPED
    return found and is_function(motion, k)


@lean_jit
def any_to_read(motion):
    """Whether the side of any function is to be chosen."""
    found = False
    for k in range(motion.frictions.shape[0]):
        found = found or is_to_read(motion, k)
    return found


@lean_jit
def note_jumps(motion):
    """Note that what functions read may have jumped."""
    for k in range(motion.frictions.shape[0]):
        if is_function(motion, k):
            motion.frictions[k, FrictionColumn.STRUCK] = FrictionImpact.JUMPED


@lean_jit
def span_of_terms(motion):
    """A time in which the terms of the present series are told from rounding: the natural one, if
    the series reach as far."""
    size = state_size(motion, 0, motion.own)
    span = step_size(motion.velocity_series[: motion.own], motion.order, size, motion.tolerance)
    unit = time_scale(motion)
    return min(unit, span) if unit > 0.0 else span if span < np.inf else 1.0


@lean_jit
def side_ahead(motion, k):
    """The side of a function just behind the present instant, by the series on its present side:
    0 if it stays at 0. Notes how many of the first coefficients are 0."""
    row = motion.frictions[k]
    series = motion.margin_series[motion.contacts.shape[0] + 2 * k]
    row[FrictionColumn.SKIP] = 0
    unit = span_of_terms(motion)
    size = 0.0
    power = 1.0
    for i in range(1, motion.order + 1):
        power *= unit
        size = max(size, abs(series[i]) * power)
    beside = row[FrictionColumn.REACHED] == 0 or is_relay(motion, k)
    if beside and abs(series[0]) > IS_ON * size:
        return 1 if series[0] > 0.0 else -1
    power = 1.0
    for i in range(1, motion.order + 1):
        power *= unit
        row[FrictionColumn.SKIP] = i
        if series[i] != 0.0 and abs(series[i]) * power >= VANISHES * size:
            return 1 if series[i] > 0.0 else -1
    return 0


@lean_jit
def some_slide(motion, k):
    """Whether the motion slides along another function."""
    found = False
    for other in range(motion.frictions.shape[0]):
        slides = motion.frictions[other, FrictionColumn.SLIDES]
        found = found or (other != k and is_function(motion, other) and slides == 0)
    return found


@lean_jit
def stays(motion, k, t):
    """Whether a motion that has slid along a function is still at its 0, by the size of the
    function's terms on a side."""
    row = motion.frictions[k]
    row[FrictionColumn.SLIDES] = 1
    hold_frictions(motion)
    expand(motion, t, 1.0, motion.order)
    series = motion.margin_series[motion.contacts.shape[0] + 2 * k]
    unit = span_of_terms(motion)
    size = 0.0
    power = 1.0
    for i in range(1, motion.order + 1):
        power *= unit
        size = max(size, abs(series[i]) * power)
    row[FrictionColumn.SLIDES] = 0
    return abs(series[0]) <= IS_ON * size or row[FrictionColumn.REACHED] > 0


# A start at which a power has no series is left by this share of the shortest step, then by
# multiples of it. A step from there has a length of at least this share.
NUDGE = 2.0**-4
NUDGES = 5
LONGER = 16.0
LONG_ENOUGH = 0.2


@lean_jit
def has_series(motion, t):
    """Whether the coefficients of the series at the present state and sides are numbers, and allow
    a step."""
    hold_frictions(motion)
    size = expand(motion, t, 1.0, motion.order)
    total = 0.0
    for i in range(motion.own):
        for k in range(motion.order + 1):
            total += 0.0 * motion.acceleration_series[i, k]
    for row in range(motion.margin_count):
        for k in range(motion.order + 1):
            total += 0.0 * motion.margin_series[row, k]
    if total != 0.0:
        return False
    step = step_size(motion.velocity_series[: motion.own], motion.order, size, motion.tolerance)
    if motion.columns > 0 and motion.eigenmodes.size == 0:
        step = min(step, column_step(motion))
    return step > LONG_ENOUGH * shortest_step(motion)


@lean_jit
def go_to_sides(motion, t):
    """Let functions be on the sides that their values have; whether any has changed its side."""
    hold_frictions(motion)
    expand(motion, t, 1.0, 0)
    changed = False
    for k in range(motion.frictions.shape[0]):
        row = motion.frictions[k]
        if not is_to_read(motion, k) or row[FrictionColumn.REACHED] > 0:
            continue
        value = motion.margin_series[motion.contacts.shape[0] + 2 * k, 0]
        if value * row[FrictionColumn.SLIDES] < 0.0:
            row[FrictionColumn.SLIDES] *= -1
            changed = True
    return changed


@lean_jit
def pull_at(motion, t):
    """Find the accelerations at the present state, on its sides or, where they are no numbers, on
    the other ones; whether they are numbers.

    Just behind the zero of u the rounding of u may be on the wrong side for a power of u.
    """
    for _ in range(2):
        hold_frictions(motion)
        expand(motion, t, 1.0, 0)
        total = 0.0
        for i in range(motion.own):
            total += 0.0 * motion.acceleration_series[i, 0] + 0.0 * motion.velocity_series[i, 0]
        for k in range(motion.frictions.shape[0]):
            if total != 0.0 and is_to_read(motion, k):
                motion.frictions[k, FrictionColumn.SLIDES] *= -1
        if total == 0.0:
            return True
    return False


@lean_jit
def begin_beside(motion, t):
    """Let a motion go on where a power of a function has no series, until it has one. The time is
    so short that the acceleration stays the same.

    Such is Hertz's law where the contact begins, u = w t. Its force u^(3/2) changes the speed by a
    share (t / T)^(5/2), with the duration T of the contact, which is far below rounding.
    """
    step = NUDGE * shortest_step(motion)
    for _ in range(NUDGES):
        if has_series(motion, t):
            return
        sides = slides_before(motion)
        regular = pull_at(motion, t)
        for k in range(motion.frictions.shape[0]):
            motion.frictions[k, FrictionColumn.SLIDES] = sides % 4 - 1
            sides //= 4
        if not regular:
            return
        for i in range(motion.dof if motion.eigenmodes.size == 0 else motion.own):
            rate = motion.velocity_series[i, 0]
            motion.coordinates[i] += step * rate
            if i % motion.own < motion.own - motion.first_order:
                pull = motion.acceleration_series[i, 0]
                motion.coordinates[i] += 0.5 * step * step * pull
                motion.velocities[i] += step * pull
        motion.time += step
        step *= LONGER


@lean_jit
def note_other_side(motion, k, t):
    """Note how a motion that has slid along a function would move on the other side, for the
    natural scales: at the release the terms of the accelerations cancel."""
    row = motion.frictions[k]
    row[FrictionColumn.SLIDES] *= -1
    hold_frictions(motion)
    expand(motion, t, 1.0, 0)
    for i in range(motion.own - motion.first_order):
        motion.press = max(motion.press, abs(motion.acceleration_series[i, 0]))
    row[FrictionColumn.SLIDES] *= -1


@lean_jit
def choose_sides(motion, t):
    """Choose the sides of the functions that are to be read: those to which the motion moves on.

    Where both sides push the motion back it slides along the function, if no other one does.

    0 if there are none, or if both sides of one lead away from it; else 1, or 2 if one has changed.
    """
    changed = 1
    agrees = False
    turned = 0  # those that have changed, as bits
    for k in range(motion.frictions.shape[0]):
        row = motion.frictions[k]
        if is_to_read(motion, k) and row[FrictionColumn.SLIDES] == 0 and not stays(motion, k, t):
            row[FrictionColumn.SLIDES] = 1
            changed = 2
        if is_function(motion, k) and 0 < row[FrictionColumn.REACHED] < 3:
            note_other_side(motion, k, t)
    if not has_series(motion, t):
        if go_to_sides(motion, t):
            changed = 2
        begin_beside(motion, t)
    for _ in range(2 + 3 * motion.frictions.shape[0]):
        hold_frictions(motion)
        expand(motion, t, 1.0, motion.order)
        agrees = True
        for k in range(motion.frictions.shape[0]):
            row = motion.frictions[k]
            slides = row[FrictionColumn.SLIDES]
            if not is_to_read(motion, k):
                continue
            if slides == 0:
                within = abs(motion.margin_series[motion.contacts.shape[0] + 2 * k + 1, 0]) < 1.0
                if not within:
                    return 0
                continue
            ahead = side_ahead(motion, k)
            if ahead == -slides:
                row[FrictionColumn.SLIDES] = ahead
                if turned >> k & 1:
                    row[FrictionColumn.SLIDES] = 0
                    if some_slide(motion, k):
                        return 0
                turned |= 1 << k
                agrees = False
                changed = 2
        if agrees:
            break
    if not agrees:
        return 0
    return changed if motion.leave_by == 0 or lead_one_way(motion, t) else 0


@lean_jit
def lead_one_way(motion, t):
    """Whether a motion that starts at 0 of functions would move on to none but the sides that were
    chosen."""
    one_way = True
    for k in range(motion.frictions.shape[0]):
        row = motion.frictions[k]
        skip = row[FrictionColumn.SKIP]
        if is_relay(motion, k):
            continue
        if is_to_read(motion, k) and skip > 0 and row[FrictionColumn.SLIDES] != 0:
            row[FrictionColumn.SLIDES] *= -1
            hold_frictions(motion)
            expand(motion, t, 1.0, motion.order)
            one_way = one_way and side_ahead(motion, k) != row[FrictionColumn.SLIDES]
            row[FrictionColumn.SLIDES] *= -1
            row[FrictionColumn.SKIP] = skip
    hold_frictions(motion)
    return one_way


@lean_jit
def begin_on_surfaces(motion, t):
    """Choose the sides of surfaces on which a motion is: those to which it moves on.

    0 if there is none, or if both sides of one lead away from it; else 1, or 2 if one has changed.
    """
    changed = 1
    for _ in range(2):
        hold_frictions(motion)
        agrees = True
        for k in range(motion.frictions.shape[0]):
            row = motion.frictions[k]
            if not is_on_surface(motion, k):
                continue
            expand(motion, t, 1.0, motion.order)
            i = away(motion, k)
            row[FrictionColumn.SKIP] = i
            if i < motion.order and motion.gap_series[i] < 0.0:
                row[FrictionColumn.SLIDES] *= -1
                agrees = False
                changed = 2
        if agrees:
            return changed if leads_one_way(motion, t) else 0
    return 0


@lean_jit
def away(motion, k):
    """The first coefficient of the distance from a surface that is not 0, which is in `gap_series`
    afterwards; the order if there is none.
    """
    side = 1.0 * motion.frictions[k, FrictionColumn.SLIDES]
    sliding_series(motion, k, side, motion.order, motion.gap_series)
    return leading(motion.gap_series, 1, motion.order, ZERO, motion.press, 2, 0.0)


@lean_jit
def leads_one_way(motion, t):
    """Whether a motion that starts at rest on surfaces would move on to none but the sides that
    were chosen.
    """
    one_way = True
    for k in range(motion.frictions.shape[0]):
        row = motion.frictions[k]
        if is_on_surface(motion, k) and 1 < row[FrictionColumn.SKIP] < motion.order:
            row[FrictionColumn.SLIDES] *= -1
            hold_frictions(motion)
            expand(motion, t, 1.0, motion.order)
            i = away(motion, k)
            one_way = one_way and not (i < motion.order and motion.gap_series[i] > 0.0)
            row[FrictionColumn.SLIDES] *= -1
    hold_frictions(motion)
    return one_way


@lean_jit
def slide_bits(motion, count):
    """The direction of each friction plus 1 (0, 1 or 2; 3 of an open contact), in two bits each,
    behind the bits of `count` contacts."""
    bits = 0
    for k in range(motion.frictions.shape[0]):
        bits |= (1 + motion.frictions[k, FrictionColumn.SLIDES]) << (count + 2 * k)
    return bits


@lean_jit
def sliding_series(motion, k, direction, order, g):
    """The Taylor coefficients of a friction's sliding speed along a direction, or of the distance
    from a surface on a side.
    """
    v = motion.velocity_series[motion.frictions[k, FrictionColumn.COORDINATE]]
    if is_function(motion, k):
        v = motion.margin_series[motion.contacts.shape[0] + 2 * k]
    elif is_surface(motion, k):
        v = motion.coordinate_series[motion.frictions[k, FrictionColumn.COORDINATE]]
    elif motion.multipliers > 0:
        v = motion.margin_series[row_series(motion, motion.contacts.shape[0] + k)]
    for i in range(order + 1):
        g[i] = direction * v[i]
    g[0] -= direction * ground_speed(motion, k)


@lean_jit
def margin_size(motion, k):
    """The natural size of a friction's margins."""
    return motion.press / friction_mobility(motion, k)


@lean_jit
def friction_step_size(motion, count, natural, longest):
    """The step, at most `natural`, that the series of the friction forces of sticking coordinates
    and of functions allow, where no step is longer than `longest`.
    """
    tol = motion.tolerance
    sharp = min(tol, EXACT) if motion.mode == Mode.REST else tol
    for k in range(motion.frictions.shape[0]):
        if is_function(motion, k):
            slides = motion.frictions[k, FrictionColumn.SLIDES] == 0
            place = count + 2 * k + (1 if slides else 0)
            natural = guard_step(motion, place, natural, longest)
            continue
        if motion.frictions[k, FrictionColumn.SLIDES] == 0 and not leans(motion, k):
            r = motion.margin_series[count + 2 * k : count + 2 * k + 2]
            size = max(margin_size(motion, k), abs(r[0, 0]))
            if size > 0.0:
                natural = min(natural, step_size(r, motion.order, size, sharp))
    return natural


@lean_jit
def first_friction(motion, count, h, whole):
    """The friction whose guard reaches 0 first within the step, the instant, and its guard: margin
    0 or 1, or 2 for the speed.

    Then whether the step is too long to decide on a touch near its end.
    """
    order = motion.order
    hit = -1
    first = NEVER
    which = 2
    shorter = False
    for k in range(motion.frictions.shape[0]):
        slides = motion.frictions[k, FrictionColumn.SLIDES]
        skip = motion.frictions[k, FrictionColumn.SKIP]
        for b in range(0 if slides == 2 or (slides == 0 and leans(motion, k)) else 2):
            known = skip
            guard = motion.gap_series
            if slides == 0 and is_function(motion, k):
                # the share of its sides with which it slides, up to the side +1 or -1
                known = 0
                for i in range(order + 1):
                    guard[i] = (2.0 * b - 1.0) * motion.margin_series[count + 2 * k + 1, i]
                guard[0] += 1.0
                if guard[0] < 0.0:
                    return k, 0.0, b, False
            elif slides == 0:
                known = skip if motion.frictions[k, FrictionColumn.MARGIN] == b else 0
                guard = motion.margin_series[count + 2 * k + b]
                beyond = known == 0 and guard[0] < 0.0
                if beyond and guard[0] < -ZERO * margin_size(motion, k):
                    return k, 0.0, b, False
            elif b == 1:
                continue
            else:
                sliding_series(motion, k, 1.0 * slides, order, guard)
                if known == 0 and guard[0] < 0.0:  # by rounding, see `undecided`
                    return k, 0.0, 2, False
            if known >= order:
                continue
            kind, u, touch = contact_root(guard, known, order, h, motion.polynomial)
            if motion.nudged == 1 + count + k:
                u = nudged_share(motion, u, h)
            if kind == SIMPLE and u < first:
                hit = k
                first = u
                which = b if slides == 0 else 2
            shorter = shorter or (kind != SIMPLE and 0.75 < touch <= 1.0 and whole)
    return hit, first, which, shorter and hit < 0


@lean_jit
def reach_ground_speed(motion, count, t, k, which, later):
    """Take the motion, with the tangent's columns, to the instant at which a friction's guard is 0.

    If that is the sliding speed, it is set to exactly 0; the instant moves by dt = -(z - w_c) / a.
    At a surface the coordinate is set to its position, and dt = -(u - p_c) / v; at a function h the
    state stays as it is, and dt = -h_c / h'.
    """
    own = motion.own
    rest = motion.frictions[k, FrictionColumn.COORDINATE]
    crossed = is_surface(motion, k)
    if motion.columns > 0:
        expand(motion, t, 1.0, 1)
        row = -1  # of the margins, whose series is the guard
        if is_function(motion, k):
            row = count + 2 * k + (1 if which < 2 else 0)
        elif which < 2:
            row = count + 2 * k + which
        elif motion.multipliers > 0 and not crossed:
            row = row_series(motion, count + k)
        if row >= 0:
            columns_at_event(motion, EventCode.RELEASE, row, t, 1.0)
        for j in range(motion.columns):
            if row >= 0:
                motion.shifts[j] /= -motion.margin_series[row, 1]
            else:
                moved = slope(motion, j, motion.solver_numbers.size - motion.frictions.shape[0] + k)
                sliding = motion.velocities[own * (1 + j) + rest] - moved
                motion.shifts[j] = -sliding / motion.acceleration_series[rest, 0]
                if crossed:
                    motion.shifts[j] = (
                        -(motion.coordinates[own * (1 + j) + rest] - moved)
                        / motion.velocities[rest]
                    )
        move_columns(motion, 1.0)
    if crossed:
        if not is_function(motion, k):
            motion.coordinates[rest] = ground_speed(motion, k)
    elif which == 2 and motion.multipliers > 0:
        stop_row(motion, count + k)
        motion.slide_rates[k] = 0.0
    elif which == 2:
        motion.velocities[rest] = ground_speed(motion, k)
    later = later or is_function(motion, k)
    motion.frictions[k, FrictionColumn.REACHED] = 3 if which == 2 else 1 + which if later else 4


@lean_jit
def undecided(motion):
    """The frictions with exactly the speed of their ground, as bits; for the others the direction
    in which they slide is noted, and for a surface that has just been reached the other side.

    If blocks move alike, the sliding speed of one may be 0, or have changed its sign, within
    rounding, at the instant of another one's event. Its direction is then kept, so that it has its
    own event next, to which it takes the tangent's columns. So has one that has just begun to slide
    at this instant.
    """
    bits = 0
    turns = False  # whether this is the event of a friction or a surface
    for k in range(motion.frictions.shape[0]):
        turns = turns or motion.frictions[k, FrictionColumn.REACHED] > 0
    for k in range(motion.frictions.shape[0]):
        if is_surface(motion, k):
            reached = motion.frictions[k, FrictionColumn.REACHED]
            if reached == 3:
                motion.frictions[k, FrictionColumn.SLIDES] *= -1
                motion.frictions[k, FrictionColumn.SKIP] = 1
            elif reached > 0:  # what slid along it leaves it
                motion.frictions[k, FrictionColumn.SLIDES] = 1 if reached != 2 else -1
            continue
        rate = friction_rate(motion, k)
        slides = motion.frictions[k, FrictionColumn.SLIDES]
        if is_lifted(motion, k):
            motion.frictions[k, FrictionColumn.SLIDES] = 2
            motion.frictions[k, FrictionColumn.SKIP] = 0
        elif (
            turns
            and motion.multipliers == 0  # else their rates are exactly 0 together
            and motion.frictions[k, FrictionColumn.REACHED] == 0
            and abs(slides) == 1
            and abs(rate) <= rounding_of_speed(motion, k)
        ):
            continue
        elif rate == 0.0:
            bits |= 1 << k
        elif abs(rate) > ZERO * motion.swiftest or rate * slides >= 0.0 or slides == 2:
            motion.frictions[k, FrictionColumn.SLIDES] = 1 if rate > 0.0 else -1
            motion.frictions[k, FrictionColumn.SKIP] = 0
    return bits


@lean_jit
def rounding_of_speed(motion, k):
    """What rounding of instants may leave of a sliding speed when its own event is at the same
    instant as another one.
    """
    speed = motion.velocity_series[motion.frictions[k, FrictionColumn.COORDINATE]]
    if motion.multipliers > 0:
        speed = motion.margin_series[row_series(motion, motion.contacts.shape[0] + k)]
    unit = motion.period_length if motion.period_length > 0.0 else time_scale(motion)
    return TOGETHER * (abs(speed[0]) + abs(ground_speed(motion, k)) + abs(speed[1]) * unit)


@lean_jit
def is_lifted(motion, k):
    """Whether a friction is in a contact that is open, or has no force in any case."""
    pressed = motion.frictions[k, FrictionColumn.PRESSED]
    if pressed <= 0:
        return pressed == NoPress.INERT
    return motion.contacts[pressed - 1, ContactColumn.CLOSED] == 0


@lean_jit
def choose_slides(motion, still, choice):
    """Let each of the frictions in `still` stick, slide forwards or slide backwards, by the base-3
    digits of `choice`, of which each has one; False if one in an open contact has a digit other
    than 0."""
    for k in range(motion.frictions.shape[0]):
        digit = 0
        if still >> k & 1:
            digit = choice % 3
            choice //= 3
        if is_lifted(motion, k):
            motion.frictions[k, FrictionColumn.SLIDES] = 2
            if digit > 0:
                return False
        elif still >> k & 1:
            motion.frictions[k, FrictionColumn.SLIDES] = digit if digit < 2 else -1
        elif motion.frictions[k, FrictionColumn.SLIDES] == 2:
            rate = friction_rate(motion, k)
            motion.frictions[k, FrictionColumn.SLIDES] = (
                1 if rate > 0.0 else -1 if rate < 0.0 else 0
            )
    return True


@lean_jit
def any_reached(motion):
    """Whether the guard of any friction has just reached 0."""
    found = False
    for k in range(motion.frictions.shape[0]):
        found = found or motion.frictions[k, FrictionColumn.REACHED] > 0
    return found


@lean_jit
def slides_so(motion, count, candidates, held):
    """Whether the first non-zero Taylor coefficients of their guards confirm the choice for the
    candidates; notes how many coefficients before them are 0. Those in `held` have stuck up to
    now, and let go at events of their own."""
    order = motion.order
    g = motion.gap_series
    # at other reactions of the same motion others are at their limits at the same instant
    shared = False
    if motion.multipliers > 0:
        shared = some_idle(motion) and any_reached(motion)
    for k in range(motion.frictions.shape[0]):
        if not candidates >> k & 1:
            continue
        slides = motion.frictions[k, FrictionColumn.SLIDES]
        reached = motion.frictions[k, FrictionColumn.REACHED]
        motion.frictions[k, FrictionColumn.SKIP] = 0
        motion.frictions[k, FrictionColumn.MARGIN] = 0
        if slides == 2 or leans(motion, k):
            continue
        if slides == 0:
            size = margin_size(motion, k)
            for b in range(2):
                row = motion.margin_series[count + 2 * k + b]
                near = (reached > 0 or shared) and abs(row[0]) <= ALIKE * size
                known = reached == 1 + b or near
                i = leading(row, 1 if known else 0, order, ZERO, size, 0, 0.0)
                if reached == 0 and not shared and held >> k & 1 and abs(row[0]) <= ZERO * size:
                    continue  # its own event is next if this margin falls
                if i < order and row[i] < 0.0:
                    return False
                if i > 0:
                    motion.frictions[k, FrictionColumn.SKIP] = i
                    motion.frictions[k, FrictionColumn.MARGIN] = b
            continue
        sliding_series(motion, k, 1.0 * slides, order, g)
        known = reached > 0 and abs(g[1]) <= ALIKE * motion.press
        i = leading(g, 2 if known else 1, order, ZERO, motion.press, 1, 0.0)
        if i == order or g[i] < 0.0:
            return False
        motion.frictions[k, FrictionColumn.SKIP] = i
    return True


@lean_jit
def record_slides(motion, before, t):
    """Record the frictions that have begun to stick or to slide, or have reversed, since the
    directions `before` (base-4 digits)."""
    for k in range(motion.frictions.shape[0]):
        was = before % 4 - 1
        slides = motion.frictions[k, FrictionColumn.SLIDES]
        before //= 4
        # the side that a motion leaves a surface to, on which it was, is no passage of it
        on_side = is_surface(motion, k) and not is_relay(motion, k)
        on_side = on_side and motion.frictions[k, FrictionColumn.REACHED] == 0
        if slides != was and slides != 2 and was != 2 and not on_side:
            kind = (
                EventCode.SLIP
                if was == 0
                else EventCode.STICK
                if slides == 0
                else EventCode.REVERSAL
            )
            if is_surface(motion, k) and slides == -was:
                kind = EventCode.CROSSING
            record_contact_event(motion, kind, 1 << (motion.contacts.shape[0] + k), t)
            note_shifts(motion, motion.shifts)


@lean_jit
def slides_before(motion):
    """The directions of all frictions plus 1, as the base-4 digits of a number."""
    number = 0
    for k in range(motion.frictions.shape[0] - 1, -1, -1):
        number = 4 * number + 1 + motion.frictions[k, FrictionColumn.SLIDES]
    return number


@lean_jit
def sticking(motion, before):
    """The frictions that stick with the directions `before` (base-4 digits), as bits."""
    bits = 0
    for k in range(motion.frictions.shape[0]):
        bits |= 1 << k if before % 4 == 1 else 0
        before //= 4
    return bits


@lean_jit
def stick_columns(motion, count):
    """The columns of sticking coordinates: z = w_c, by the impulses p with which friction stops
    them in neighbouring motions that slide, M dz = S p.

    When a friction begins to stick during the motion, no impulse is left. At the start of a motion,
    neighbouring motions slide for a time of the order of their sliding speeds, in which nothing
    else changes to first order. Impulses of closed contacts keep these closed.
    """
    own = motion.own
    block = motion.block
    rows = motion.contacts.shape[0] + motion.frictions.shape[0]
    if motion.multipliers > 0:
        for j in range(motion.columns):
            onto(motion, 0, 0, j)
        fill_slopes(motion)
        for j in range(motion.columns):
            onto(motion, 0, 1, j)
        return
    for j in range(motion.columns):
        size = 0
        for row in range(rows):
            a = held_by(motion, row)
            if a >= 0:
                column = 0
                for other in range(rows):
                    b = held_by(motion, other)
                    if b >= 0:
                        block[size, column] = motion.inverse[a, b]
                        column += 1
                k = row - motion.contacts.shape[0]
                moved = (
                    0.0
                    if k < 0
                    else slope(
                        motion, j, motion.solver_numbers.size - motion.frictions.shape[0] + k
                    )
                )
                block[size, column] = moved - motion.velocities[own * (1 + j) + a]
                size += 1
        eliminate(block, size, size + 1)
        found = 0
        for row in range(rows):
            b = held_by(motion, row)
            if b >= 0:
                for a in range(motion.local):
                    motion.velocities[own * (1 + j) + a] += (
                        motion.inverse[a, b] * block[found, size]
                    )
                found += 1


@lean_jit
def held_by(motion, row):
    """The coordinate that a contact or, behind the contacts, a friction holds; -1 for none, or one
    that its contact holds too.
    """
    count = motion.contacts.shape[0]
    if row < count:
        return (
            motion.contacts[row, ContactColumn.COORDINATE]
            if motion.contacts[row, ContactColumn.CLOSED] == 1
            else -1
        )
    k = row - count
    if (
        motion.frictions[k, FrictionColumn.SLIDES] != 0
        or is_function(motion, k)
        or leans(motion, k)
    ):
        return -1
    return motion.frictions[k, FrictionColumn.COORDINATE]


@lean_jit
def leans(motion, k):
    """Whether a closed contact holds the coordinate along which a friction acts, so that the
    friction carries what it can.
    """
    found = motion.frictions[k, FrictionColumn.IDLE] != 0
    for i in range(motion.contacts.shape[0]):
        found = found or (motion.contacts[i, ContactColumn.CLOSED] == 1 and is_along(motion, k, i))
    return found


@lean_jit
def is_along(motion, k, i):
    """Whether a friction, no surface and not without force, acts along the coordinate of a contact."""
    along = (
        motion.contacts[i, ContactColumn.COORDINATE]
        == motion.frictions[k, FrictionColumn.COORDINATE]
    )
    along = along and motion.frictions[k, FrictionColumn.PRESSED] != NoPress.INERT
    return along and not is_surface(motion, k)


@lean_jit
def rubs_along(motion, i):
    """1 plus the number of a friction along the coordinate of a contact, 0 if there is none."""
    for k in range(motion.frictions.shape[0]):
        if is_along(motion, k, i):
            return k + 1
    return 0


@lean_jit
def tear_loose(motion, i):
    """Note of frictions that hold a coordinate together with a contact, whose reaction has just
    fallen to 0, that they too carry all that they can."""
    for k in range(motion.frictions.shape[0]):
        if motion.frictions[k, FrictionColumn.SLIDES] == 0 and is_along(motion, k, i):
            motion.frictions[k, FrictionColumn.REACHED] = 2 if motion.signs[i] > 0.0 else 1


@lean_jit
def all_stand(motion):
    """Whether no coordinate moves: none is free, and all sticking ones do so on ground at rest. As
    many may be free as there are dependent sums."""
    if motion.multipliers > 0:
        return all_rows_stand(motion)
    local = motion.local
    free = 0
    moves = motion.local < motion.own
    for i in range(local):
        free += 1 if motion.parameters[motion.parameters.size - local + i] != 0.0 else 0
        free -= 1 if is_sum(motion, i) else 0
    if free > 0:
        return False
    for k in range(motion.frictions.shape[0]):
        is_friction = not is_surface(motion, k)
        is_friction = is_friction and motion.frictions[k, FrictionColumn.PRESSED] != NoPress.INERT
        moves = moves or (is_friction and ground_speed(motion, k) != 0.0)
    return not moves
