"""Dry frictions, parts of the kind FRICTION: a sticking coordinate is held like one at a closed
contact, but its friction force is bounded on both sides. Their answers to the questions of
`parts.py`:

1. A row behind those of the contacts; COORDINATE is q, or the row has entries that multipliers
   hold (`rows.py`); PRESSED is the contact whose reaction is the normal force.
2. The guard is the sliding speed q' - w (`guard_series`).
3. Its state is the direction in which it slides, HELD while it sticks, OFF while its contact is
   open. The force reads the direction, and 0 while it sticks.
4. While it sticks, its two margins: what the static limit leaves on both sides (`stick_margins` of
   the model). One that follows from what else is held is IDLE, at its limit.
5. The margins bound the step (`sided_step_size`).
6. The simple root of the speed, or of a margin (`first_sided`).
7. The speed becomes exactly that of the ground; a margin changes nothing (`reach_guard`).
8. With all contacts at rest and frictions at the speed of their ground it is decided together what
   holds and what slides (`choose_slides`, `slides_so`, called by `closings.py`).
9. STICK, SLIP and REVERSAL.
10. The instant moves by dt = -(z - w_c) / a; where it sticks, impulses stop the columns
    (`stick_columns`).
11. The sign of the speed at the start.

Its compiled part goes into one module with that of `kernel.py`; the words of `motion` are those of
`flow/kernel/memory.py`.
"""

from __future__ import annotations

from saltus.flow.contacts.complementarity import eliminate, friction_rate
from saltus.flow.contacts.held_rows import all_rows_stand, onto, some_idle
from saltus.flow.contacts.impacts import friction_mobility
from saltus.flow.contacts.parts import any_reached, guard_series
from saltus.flow.contacts.rows import row_series
from saltus.flow.contacts.tangent import fill_slopes, slope
from saltus.flow.kernel.contact_layout import (
    TOGETHER,
    NoPress,
    PartColumn,
    Reached,
    Side,
    Touch,
    guard_level,
    is_function,
    is_sum,
    is_surface,
)
from saltus.flow.kernel.layout import ZERO
from saltus.flow.kernel.roots import leading
from saltus.flow.kernel.steps import time_scale
from saltus.taylor import lean_jit

# --- compiled from here on ---------------------------------------------------

# If mu_s = mu_k, the acceleration with which sliding begins is 0, that is, by rounding, smaller
# than this, in units of what presses (`note_press`). So is a margin of a friction that can only
# just stick when its speed becomes that of the ground. In both cases the next coefficients decide.
ALIKE = 1e-12


@lean_jit
def margin_size(motion, k):
    """The natural size of a friction's margins."""
    return motion.press / friction_mobility(motion, k)


@lean_jit
def rounding_of_speed(motion, k):
    """What rounding of instants may leave of a sliding speed when its own event is at the same
    instant as another one.
    """
    speed = motion.velocity_series[motion.sided[k, PartColumn.COORDINATE]]
    if motion.multipliers > 0:
        speed = motion.margin_series[row_series(motion, motion.contacts.shape[0] + k)]
    unit = motion.period_length if motion.period_length > 0.0 else time_scale(motion)
    return TOGETHER * (abs(speed[0]) + abs(guard_level(motion, k)) + abs(speed[1]) * unit)


@lean_jit
def is_lifted(motion, k):
    """Whether a friction is in a contact that is open, or has no force in any case."""
    pressed = motion.sided[k, PartColumn.PRESSED]
    if pressed <= 0:
        return pressed == NoPress.INERT
    return motion.contacts[pressed - 1, PartColumn.STATE] == Touch.OPEN


@lean_jit
def choose_slides(motion, still, choice):
    """Let each of the frictions in `still` stick, slide forwards or slide backwards, by the base-3
    digits of `choice`, of which each has one; False if one in an open contact has a digit other
    than 0."""
    for k in range(motion.sided.shape[0]):
        digit = 0
        if still >> k & 1:
            digit = choice % 3
            choice //= 3
        if is_lifted(motion, k):
            motion.sided[k, PartColumn.STATE] = Side.OFF
            if digit > 0:
                return False
        elif still >> k & 1:
            motion.sided[k, PartColumn.STATE] = digit if digit < 2 else -1
        elif motion.sided[k, PartColumn.STATE] == Side.OFF:
            rate = friction_rate(motion, k)
            motion.sided[k, PartColumn.STATE] = 1 if rate > 0.0 else -1 if rate < 0.0 else 0
    return True


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
    for k in range(motion.sided.shape[0]):
        if not candidates >> k & 1:
            continue
        slides = motion.sided[k, PartColumn.STATE]
        reached = motion.sided[k, PartColumn.REACHED]
        motion.sided[k, PartColumn.SKIP] = 0
        motion.sided[k, PartColumn.MARGIN] = 0
        if slides == Side.OFF or leans(motion, k):
            continue
        if slides == Side.HELD:
            size = margin_size(motion, k)
            for b in range(2):
                row = motion.margin_series[count + 2 * k + b]
                near = (reached != Reached.NO or shared) and abs(row[0]) <= ALIKE * size
                known = reached == Reached.FIRST + b or near
                i = leading(row, 1 if known else 0, order, ZERO, size, 0, 0.0)
                if (
                    reached == Reached.NO
                    and not shared
                    and held >> k & 1
                    and abs(row[0]) <= ZERO * size
                ):
                    continue  # its own event is next if this margin falls
                if i < order and row[i] < 0.0:
                    return False
                if i > 0:
                    motion.sided[k, PartColumn.SKIP] = i
                    motion.sided[k, PartColumn.MARGIN] = b
            continue
        guard_series(motion, k, 1.0 * slides, order, g)
        known = reached != Reached.NO and abs(g[1]) <= ALIKE * motion.press
        i = leading(g, 2 if known else 1, order, ZERO, motion.press, 1, 0.0)
        if i == order or g[i] < 0.0:
            return False
        motion.sided[k, PartColumn.SKIP] = i
    return True


@lean_jit
def sticking(motion, before):
    """The frictions that stick with the directions `before` (base-4 digits), as bits."""
    bits = 0
    for k in range(motion.sided.shape[0]):
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
    rows = motion.contacts.shape[0] + motion.sided.shape[0]
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
                    else slope(motion, j, motion.solver_numbers.size - motion.sided.shape[0] + k)
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
            motion.contacts[row, PartColumn.COORDINATE]
            if motion.contacts[row, PartColumn.STATE] == Touch.CLOSED
            else -1
        )
    k = row - count
    if motion.sided[k, PartColumn.STATE] != Side.HELD or is_function(motion, k) or leans(motion, k):
        return -1
    return motion.sided[k, PartColumn.COORDINATE]


@lean_jit
def leans(motion, k):
    """Whether a closed contact holds the coordinate along which a friction acts, so that the
    friction carries what it can.
    """
    found = motion.sided[k, PartColumn.IDLE] != 0
    for i in range(motion.contacts.shape[0]):
        found = found or (
            motion.contacts[i, PartColumn.STATE] == Touch.CLOSED and is_along(motion, k, i)
        )
    return found


@lean_jit
def is_along(motion, k, i):
    """Whether a friction, no surface and not without force, acts along the coordinate of a contact."""
    along = motion.contacts[i, PartColumn.COORDINATE] == motion.sided[k, PartColumn.COORDINATE]
    along = along and motion.sided[k, PartColumn.PRESSED] != NoPress.INERT
    return along and not is_surface(motion, k)


@lean_jit
def rubs_along(motion, i):
    """1 plus the number of a friction along the coordinate of a contact, 0 if there is none."""
    for k in range(motion.sided.shape[0]):
        if is_along(motion, k, i):
            return k + 1
    return 0


@lean_jit
def tear_loose(motion, i):
    """Note of frictions that hold a coordinate together with a contact, whose reaction has just
    fallen to 0, that they too carry all that they can."""
    for k in range(motion.sided.shape[0]):
        if motion.sided[k, PartColumn.STATE] == Side.HELD and is_along(motion, k, i):
            motion.sided[k, PartColumn.REACHED] = (
                Reached.SECOND if motion.signs[i] > 0.0 else Reached.FIRST
            )


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
    for k in range(motion.sided.shape[0]):
        is_friction = not is_surface(motion, k)
        is_friction = is_friction and motion.sided[k, PartColumn.PRESSED] != NoPress.INERT
        moves = moves or (is_friction and guard_level(motion, k) != 0.0)
    return not moves
