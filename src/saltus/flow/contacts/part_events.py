"""Events of parts with two sides, frictions and surfaces: the questions 5 to 9 of `parts.py`, each
in one function that goes through all rows. Each asks for the kind of a part once.

Its compiled part goes into one module with that of `kernel.py`; the words of `motion` are those of
`flow/kernel/memory.py`.
"""

from __future__ import annotations

import math

from saltus.flow.contacts.complementarity import friction_rate
from saltus.flow.contacts.frictions import is_lifted, leans, margin_size, rounding_of_speed
from saltus.flow.contacts.held_rows import guard_step, stop_row
from saltus.flow.contacts.impacts import record_contact_event
from saltus.flow.contacts.parts import guard_series
from saltus.flow.contacts.rows import row_series
from saltus.flow.contacts.tangent import note_shifts, slope
from saltus.flow.kernel.contact_layout import (
    Guard,
    PartColumn,
    Reached,
    Side,
    guard_level,
    is_function,
    is_remembered,
    is_surface,
)
from saltus.flow.kernel.layout import EXACT, ZERO, EventCode, Mode
from saltus.flow.kernel.roots import NEVER, SIMPLE, contact_root, nudged_share
from saltus.flow.kernel.steps import (
    columns_at_event,
    expand,
    log_of_tolerance,
    move_columns,
    step_size,
)
from saltus.taylor import lean_jit

# --- compiled from here on ---------------------------------------------------


@lean_jit
def sided_step_size(motion, count, natural, longest):
    """The step, at most `natural`, that the series of the friction forces of sticking coordinates
    and of functions allow, where no step is longer than `longest`.
    """
    resting = motion.mode == Mode.REST
    sharp = math.log(min(motion.tolerance, EXACT)) if resting else log_of_tolerance(motion)
    for k in range(motion.sided.shape[0]):
        if is_function(motion, k):
            slides = motion.sided[k, PartColumn.STATE] == Side.HELD
            place = count + 2 * k + (1 if slides else 0)
            natural = guard_step(motion, place, natural, longest)
            continue
        if motion.sided[k, PartColumn.STATE] == Side.HELD and not leans(motion, k):
            r = motion.margin_series[count + 2 * k : count + 2 * k + 2]
            size = max(margin_size(motion, k), abs(r[0, 0]))
            if size > 0.0:
                natural = min(natural, step_size(r, motion.order, size, sharp))
    return natural


@lean_jit
def first_sided(motion, count, h, whole):
    """The friction whose guard reaches 0 first within the step, the instant, and its guard: margin
    0 or 1, or 2 for the speed.

    Then whether the step is too long to decide on a touch near its end.
    """
    order = motion.order
    hit = -1
    first = NEVER
    which = Guard.ITSELF
    shorter = False
    for k in range(motion.sided.shape[0]):
        slides = motion.sided[k, PartColumn.STATE]
        skip = motion.sided[k, PartColumn.SKIP]
        for b in range(
            0 if slides == Side.OFF or (slides == Side.HELD and leans(motion, k)) else 2
        ):
            known = skip
            guard = motion.gap_series
            if slides == Side.HELD and is_function(motion, k):
                # the share of its sides with which it slides, up to the side +1 or -1
                known = 0
                for i in range(order + 1):
                    guard[i] = (2.0 * b - 1.0) * motion.margin_series[count + 2 * k + 1, i]
                guard[0] += 1.0
                if guard[0] < 0.0:
                    return k, 0.0, b, False
            elif slides == Side.HELD:
                known = skip if motion.sided[k, PartColumn.MARGIN] == b else 0
                guard = motion.margin_series[count + 2 * k + b]
                beyond = known == 0 and guard[0] < 0.0
                if beyond and guard[0] < -ZERO * margin_size(motion, k):
                    return k, 0.0, b, False
            elif b == 1:
                continue
            else:
                guard_series(motion, k, 1.0 * slides, order, guard)
                if known == 0 and guard[0] < 0.0:  # by rounding, see `undecided`
                    return k, 0.0, Guard.ITSELF, False
            if known >= order:
                continue
            kind, u, touch = contact_root(guard, known, order, h, motion.polynomial)
            if motion.nudged == 1 + count + k:
                u = nudged_share(motion, u, h)
            if kind == SIMPLE and u < first:
                hit = k
                first = u
                which = b if slides == Side.HELD else Guard.ITSELF
            shorter = shorter or (kind != SIMPLE and 0.75 < touch <= 1.0 and whole)
    return hit, first, which, shorter and hit < 0


@lean_jit
def reach_guard(motion, count, t, k, which, later):
    """Take the motion, with the tangent's columns, to the instant at which a friction's guard is 0.

    If that is the sliding speed, it is set to exactly 0; the instant moves by dt = -(z - w_c) / a.
    At a surface the coordinate is set to its position, and dt = -(u - p_c) / v; at a function h the
    state stays as it is, and dt = -h_c / h'.
    """
    own = motion.own
    rest = motion.sided[k, PartColumn.COORDINATE]
    crossed = is_surface(motion, k)
    if motion.columns > 0:
        expand(motion, t, 1.0, 1)
        row = -1  # of the margins, whose series is the guard
        if is_function(motion, k):
            row = count + 2 * k + (1 if which != Guard.ITSELF else 0)
        elif which != Guard.ITSELF:
            row = count + 2 * k + which
        elif motion.multipliers > 0 and not crossed:
            row = row_series(motion, count + k)
        if row >= 0:
            columns_at_event(motion, EventCode.RELEASE, row, t, 1.0)
        for j in range(motion.columns):
            if row >= 0:
                motion.shifts[j] /= -motion.margin_series[row, 1]
            else:
                moved = slope(motion, j, motion.solver_numbers.size - motion.sided.shape[0] + k)
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
            motion.coordinates[rest] = guard_level(motion, k)
    elif which == Guard.ITSELF and motion.multipliers > 0:
        stop_row(motion, count + k)
        motion.slide_rates[k] = 0.0
    elif which == Guard.ITSELF:
        motion.velocities[rest] = guard_level(motion, k)
    later = later or is_function(motion, k)
    reached = Reached.GUARD
    if which != Guard.ITSELF:
        reached = Reached.FIRST + which if later else Reached.LIMIT
    motion.sided[k, PartColumn.REACHED] = reached


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
    for k in range(motion.sided.shape[0]):
        turns = turns or motion.sided[k, PartColumn.REACHED] != Reached.NO
    for k in range(motion.sided.shape[0]):
        if is_surface(motion, k):
            reached = motion.sided[k, PartColumn.REACHED]
            if reached == Reached.GUARD:
                motion.sided[k, PartColumn.STATE] *= -1
                motion.sided[k, PartColumn.SKIP] = 1
            elif reached != Reached.NO:  # what slid along it leaves it
                motion.sided[k, PartColumn.STATE] = 1 if reached != Reached.SECOND else -1
            continue
        rate = friction_rate(motion, k)
        slides = motion.sided[k, PartColumn.STATE]
        if is_lifted(motion, k):
            motion.sided[k, PartColumn.STATE] = Side.OFF
            motion.sided[k, PartColumn.SKIP] = 0
        elif (
            turns
            and motion.multipliers == 0  # else their rates are exactly 0 together
            and motion.sided[k, PartColumn.REACHED] == Reached.NO
            and abs(slides) == 1
            and abs(rate) <= rounding_of_speed(motion, k)
        ):
            continue
        elif rate == 0.0:
            bits |= 1 << k
        elif abs(rate) > ZERO * motion.swiftest or rate * slides >= 0.0 or slides == Side.OFF:
            motion.sided[k, PartColumn.STATE] = 1 if rate > 0.0 else -1
            motion.sided[k, PartColumn.SKIP] = 0
    return bits


@lean_jit
def record_sides(motion, before, t):
    """Record the frictions that have begun to stick or to slide, or have reversed, since the
    directions `before` (base-4 digits)."""
    for k in range(motion.sided.shape[0]):
        was = before % 4 - 1
        slides = motion.sided[k, PartColumn.STATE]
        before //= 4
        # the side that a motion leaves a surface to, on which it was, is no passage of it
        on_side = is_surface(motion, k) and not is_remembered(motion, k)
        on_side = on_side and motion.sided[k, PartColumn.REACHED] == Reached.NO
        if slides != was and slides != Side.OFF and was != Side.OFF and not on_side:
            kind = (
                EventCode.SLIP
                if was == Side.HELD
                else EventCode.STICK
                if slides == Side.HELD
                else EventCode.REVERSAL
            )
            if is_surface(motion, k) and slides == -was:
                kind = EventCode.CROSSING
            record_contact_event(motion, kind, 1 << (motion.contacts.shape[0] + k), t)
            note_shifts(motion, motion.shifts)
