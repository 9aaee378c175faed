"""Surfaces q = p, parts of the kind SURFACE: the answers to the questions of `parts.py` that are
theirs alone. What all parts with two sides share is in `part_events.py`.

1. A row behind those of the frictions; COORDINATE is q.
2. The guard is the distance q - p of the coordinate from its position (`guard_series`).
3. Its state is the side, +1 above the position, whatever the sign of the surface in the model; the
   force reads it.
4. Nothing holds a motion on it.
5. Its series is that of the coordinate, which bounds the step already.
6. The simple root of the guard (`first_sided`).
7. The coordinate is set to the position, and the side turns (`reach_guard`, `undecided`); a reset,
   if it has one, then acts (`resets.py`).
8. A motion that starts at rest on it moves on to the side to which the field leads on both of its
   sides (`begin_on_surfaces`); else the motion is not unique.
9. CROSSING.
10. The instant moves by dt = -(u - p_c) / v (`reach_guard`).
11. The side of the state; on the surface that of its velocity, else +1.

Its compiled part goes into one module with that of `kernel.py`; the words of `motion` are those of
`flow/kernel/memory.py`.
"""

from __future__ import annotations

from saltus.flow.contacts.parts import guard_series, hold_sides
from saltus.flow.kernel.contact_layout import (
    Kept,
    PartColumn,
    Reached,
    guard_level,
    is_function,
    is_surface,
)
from saltus.flow.kernel.layout import ZERO
from saltus.flow.kernel.roots import leading
from saltus.flow.kernel.steps import expand
from saltus.taylor import lean_jit

# --- compiled from here on ---------------------------------------------------


@lean_jit
def is_on_surface(motion, k):
    """Whether a row is that of a surface on which the motion is exactly, unless it has just passed
    it."""
    row = motion.sided[k]
    if (
        not is_surface(motion, k)
        or is_function(motion, k)
        or row[PartColumn.REACHED] == Reached.GUARD
    ):
        return False
    if row[PartColumn.KEPT] == Kept.ON_ITS_SIDE:
        return False
    return motion.coordinates[row[PartColumn.COORDINATE]] == guard_level(motion, k)


@lean_jit
def on_surfaces(motion):
    """Whether the motion is on a surface that it has not just passed."""
    found = False
    for k in range(motion.sided.shape[0]):
        found = found or is_on_surface(motion, k)
    return found


@lean_jit
def begin_on_surfaces(motion, t):
    """Choose the sides of surfaces on which a motion is: those to which it moves on.

    0 if there is none, or if both sides of one lead away from it; else 1, or 2 if one has changed.
    """
    changed = 1
    for _ in range(2):
        hold_sides(motion)
        agrees = True
        for k in range(motion.sided.shape[0]):
            row = motion.sided[k]
            if not is_on_surface(motion, k):
                continue
            expand(motion, t, 1.0, motion.order)
            i = away(motion, k)
            row[PartColumn.SKIP] = i
            if i < motion.order and motion.gap_series[i] < 0.0:
                row[PartColumn.STATE] *= -1
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
    side = 1.0 * motion.sided[k, PartColumn.STATE]
    guard_series(motion, k, side, motion.order, motion.gap_series)
    return leading(motion.gap_series, 1, motion.order, ZERO, motion.press, 2, 0.0)


@lean_jit
def leads_one_way(motion, t):
    """Whether a motion that starts at rest on surfaces would move on to none but the sides that
    were chosen.
    """
    one_way = True
    for k in range(motion.sided.shape[0]):
        row = motion.sided[k]
        if is_on_surface(motion, k) and 1 < row[PartColumn.SKIP] < motion.order:
            row[PartColumn.STATE] *= -1
            hold_sides(motion)
            expand(motion, t, 1.0, motion.order)
            i = away(motion, k)
            one_way = one_way and not (i < motion.order and motion.gap_series[i] > 0.0)
            row[PartColumn.STATE] *= -1
    hold_sides(motion)
    return one_way
