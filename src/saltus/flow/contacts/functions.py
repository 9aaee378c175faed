"""Surfaces that are functions h, switches of the force, and relays: parts of the kinds FUNCTION
and RELAY, and their answers to the questions of `parts.py`.

1. A row behind those of the frictions, or of the surfaces; COORDINATE is 0 and says nothing.
2. The guard is h, whose series is in the place of the first margin. That of a relay is `on` while
   it is off and minus `off` while it is on, so that it reads its own side.
3. Its state is the sign of h, which the force reads. While a motion slides along h = 0 it is HELD,
   and the functions read the share s of its sides by which h stays 0 (`Trace.let_slide`).
4. That share, from -1 to +1; nothing slides along a relay.
5. The series of h bounds the step (`sided_step_size`).
6. The simple root of h or, sliding, of 1 + s or 1 - s (`first_sided`).
7. The state stays as it is, and the side turns (`reach_guard`, `undecided`); a reset then acts.
8. The sides are read anew where anything may have jumped (`note_jumps`): each is the one to which
   the motion moves on, or it slides, or it is not unique (`choose_sides`). A relay keeps its side.
   Where a power of h has no series, `beside_powers.py` takes the motion from there.
9. CROSSING, SLIP and STICK.
10. The instant moves by dt = -h_c / h' (`reach_guard`).
11. The kernel reads its side; that of a relay is told (`Relay.start_side`).

Its compiled part goes into one module with that of `kernel.py`; the words of `motion` are those of
`flow/kernel/memory.py`.
"""

from __future__ import annotations

import numpy as np

from saltus.flow.contacts.beside_powers import begin_beside, has_series
from saltus.flow.contacts.parts import hold_sides, is_to_read
from saltus.flow.kernel.contact_layout import (
    FrictionImpact,
    PartColumn,
    Reached,
    Side,
    is_function,
    is_remembered,
)
from saltus.flow.kernel.steps import expand, log_of_tolerance, state_size, step_size, time_scale
from saltus.taylor import lean_jit

# --- compiled from here on ---------------------------------------------------

# A coefficient of a function is rounding if its term (`span_of_terms`) is a smaller share of the
# largest one.
VANISHES = 1e-13
# A motion is at 0 of a function if this is a smaller share of its terms.
IS_ON = 1e-12


@lean_jit
def any_to_read(motion):
    """Whether the side of any function is to be chosen."""
    found = False
    for k in range(motion.sided.shape[0]):
        found = found or is_to_read(motion, k)
    return found


@lean_jit
def note_jumps(motion):
    """Note that what functions read may have jumped."""
    for k in range(motion.sided.shape[0]):
        if is_function(motion, k):
            motion.sided[k, PartColumn.STRUCK] = FrictionImpact.JUMPED


@lean_jit
def span_of_terms(motion):
    """A time in which the terms of the present series are told from rounding: the natural one, if
    the series reach as far."""
    size = state_size(motion, 0, motion.own)
    log_tol = log_of_tolerance(motion)
    span = step_size(motion.velocity_series[: motion.own], motion.order, size, log_tol)
    unit = time_scale(motion)
    return min(unit, span) if unit > 0.0 else span if span < np.inf else 1.0


@lean_jit
def side_ahead(motion, k):
    """The side of a function just behind the present instant, by the series on its present side:
    0 if it stays at 0. Notes how many of the first coefficients are 0."""
    row = motion.sided[k]
    series = motion.margin_series[motion.contacts.shape[0] + 2 * k]
    row[PartColumn.SKIP] = 0
    unit = span_of_terms(motion)
    size = 0.0
    power = 1.0
    for i in range(1, motion.order + 1):
        power *= unit
        size = max(size, abs(series[i]) * power)
    beside = row[PartColumn.REACHED] == Reached.NO or is_remembered(motion, k)
    if beside and abs(series[0]) > IS_ON * size:
        return 1 if series[0] > 0.0 else -1
    power = 1.0
    for i in range(1, motion.order + 1):
        power *= unit
        row[PartColumn.SKIP] = i
        if series[i] != 0.0 and abs(series[i]) * power >= VANISHES * size:
            return 1 if series[i] > 0.0 else -1
    return 0


@lean_jit
def some_slide(motion, k):
    """Whether the motion slides along another function."""
    found = False
    for other in range(motion.sided.shape[0]):
        slides = motion.sided[other, PartColumn.STATE]
        found = found or (other != k and is_function(motion, other) and slides == Side.HELD)
    return found


@lean_jit
def stays(motion, k, t):
    """Whether a motion that has slid along a function is still at its 0, by the size of the
    function's terms on a side."""
    row = motion.sided[k]
    row[PartColumn.STATE] = Side.ABOVE
    hold_sides(motion)
    expand(motion, t, 1.0, motion.order)
    series = motion.margin_series[motion.contacts.shape[0] + 2 * k]
    unit = span_of_terms(motion)
    size = 0.0
    power = 1.0
    for i in range(1, motion.order + 1):
        power *= unit
        size = max(size, abs(series[i]) * power)
    row[PartColumn.STATE] = Side.HELD
    return abs(series[0]) <= IS_ON * size or row[PartColumn.REACHED] != Reached.NO


@lean_jit
def go_to_sides(motion, t):
    """Let functions be on the sides that their values have; whether any has changed its side."""
    hold_sides(motion)
    expand(motion, t, 1.0, 0)
    changed = False
    for k in range(motion.sided.shape[0]):
        row = motion.sided[k]
        if not is_to_read(motion, k) or row[PartColumn.REACHED] != Reached.NO:
            continue
        value = motion.margin_series[motion.contacts.shape[0] + 2 * k, 0]
        if value * row[PartColumn.STATE] < 0.0:
            row[PartColumn.STATE] *= -1
            changed = True
    return changed


@lean_jit
def note_other_side(motion, k, t):
    """Note how a motion that has slid along a function would move on the other side, for the
    natural scales: at the release the terms of the accelerations cancel."""
    row = motion.sided[k]
    row[PartColumn.STATE] *= -1
    hold_sides(motion)
    expand(motion, t, 1.0, 0)
    for i in range(motion.own - motion.first_order):
        motion.press = max(motion.press, abs(motion.acceleration_series[i, 0]))
    row[PartColumn.STATE] *= -1


@lean_jit
def choose_sides(motion, t):
    """Choose the sides of the functions that are to be read: those to which the motion moves on.

    Where both sides push the motion back it slides along the function, if no other one does.

    0 if there are none, or if both sides of one lead away from it; else 1, or 2 if one has changed.
    """
    changed = 1
    agrees = False
    turned = 0  # those that have changed, as bits
    for k in range(motion.sided.shape[0]):
        row = motion.sided[k]
        if is_to_read(motion, k) and row[PartColumn.STATE] == Side.HELD and not stays(motion, k, t):
            row[PartColumn.STATE] = Side.ABOVE
            changed = 2
        if is_function(motion, k) and Reached.NO < row[PartColumn.REACHED] < Reached.GUARD:
            note_other_side(motion, k, t)
    if not has_series(motion, t):
        if go_to_sides(motion, t):
            changed = 2
        begin_beside(motion, t)
    for _ in range(2 + 3 * motion.sided.shape[0]):
        hold_sides(motion)
        expand(motion, t, 1.0, motion.order)
        agrees = True
        for k in range(motion.sided.shape[0]):
            row = motion.sided[k]
            slides = row[PartColumn.STATE]
            if not is_to_read(motion, k):
                continue
            if slides == Side.HELD:
                within = abs(motion.margin_series[motion.contacts.shape[0] + 2 * k + 1, 0]) < 1.0
                if not within:
                    return 0
                continue
            ahead = side_ahead(motion, k)
            if ahead == -slides:
                row[PartColumn.STATE] = ahead
                if turned >> k & 1:
                    row[PartColumn.STATE] = Side.HELD
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
    for k in range(motion.sided.shape[0]):
        row = motion.sided[k]
        skip = row[PartColumn.SKIP]
        if is_remembered(motion, k):
            continue
        if is_to_read(motion, k) and skip > 0 and row[PartColumn.STATE] != Side.HELD:
            row[PartColumn.STATE] *= -1
            hold_sides(motion)
            expand(motion, t, 1.0, motion.order)
            one_way = one_way and side_ahead(motion, k) != row[PartColumn.STATE]
            row[PartColumn.STATE] *= -1
            row[PartColumn.SKIP] = skip
    hold_sides(motion)
    return one_way
