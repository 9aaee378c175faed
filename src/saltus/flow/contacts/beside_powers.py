"""Starts at which a power of a function has no Taylor series, such as Hertz's u^(3/2) where the
contact begins.

Its compiled part goes into one module with that of `kernel.py`; the words of `motion` are those of
`flow/kernel/memory.py`.
"""

from __future__ import annotations

from saltus.flow.contacts.parts import hold_sides, is_to_read, states_before
from saltus.flow.kernel.contact_layout import PartColumn
from saltus.flow.kernel.steps import column_step, expand, log_of_tolerance, shortest_step, step_size
from saltus.taylor import lean_jit

# --- compiled from here on ---------------------------------------------------

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
    hold_sides(motion)
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
    log_tol = log_of_tolerance(motion)
    step = step_size(motion.velocity_series[: motion.own], motion.order, size, log_tol)
    if motion.columns > 0 and motion.eigenmodes.size == 0:
        step = min(step, column_step(motion))
    return step > LONG_ENOUGH * shortest_step(motion)


@lean_jit
def pull_at(motion, t):
    """Find the accelerations at the present state, on its sides or, where they are no numbers, on
    the other ones; whether they are numbers.

    Just behind the zero of u the rounding of u may be on the wrong side for a power of u.
    """
    for _ in range(2):
        hold_sides(motion)
        expand(motion, t, 1.0, 0)
        total = 0.0
        for i in range(motion.own):
            total += 0.0 * motion.acceleration_series[i, 0] + 0.0 * motion.velocity_series[i, 0]
        for k in range(motion.sided.shape[0]):
            if total != 0.0 and is_to_read(motion, k):
                motion.sided[k, PartColumn.STATE] *= -1
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
        sides = states_before(motion)
        regular = pull_at(motion, t)
        for k in range(motion.sided.shape[0]):
            motion.sided[k, PartColumn.STATE] = sides % 4 - 1
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
