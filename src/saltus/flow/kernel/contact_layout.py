"""Places in the arrays that the kernel for several contacts shares with its callers, its
thresholds, and the arrays in which it solves for impacts and closed contacts."""

from __future__ import annotations

from enum import IntEnum

import numpy as np

from saltus.flow.kernel.memory import SolverArrays
from saltus.taylor import jit, lean_jit


class PartKind(IntEnum):
    """The kinds of parts, in the order of their rows. All behind the contacts have two sides, and
    from SURFACE on they are surfaces. From FUNCTION on the guard is a series of the model. From
    RELAY on the side is remembered, as the state does not tell it."""

    CONTACT = 0
    FRICTION = 1  # its guard is the sliding speed q' - w
    SURFACE = 2  # its guard is the distance q - p of a coordinate from a position
    FUNCTION = 3  # its guard is a function, whose series is in the place of its first margin
    RELAY = 4  # a function that depends on its own side


class Touch(IntEnum):
    """The state of a contact."""

    OPEN = 0
    CLOSED = 1  # its gap and the gap's rate are exactly 0


class Side(IntEnum):
    """The state of a part with two sides, +1 or -1 times which its guard is not negative."""

    BELOW = -1  # a friction slides backwards
    HELD = 0  # the guard stays 0: a friction sticks, a motion slides along a function
    ABOVE = 1  # a friction slides forwards
    OFF = 2  # of a friction in a contact that is open, or that is inert: it has no force


class Reached(IntEnum):
    """Which guard of a part is 0 at the start of a step, as its event has just been."""

    NO = 0
    FIRST = 1  # the first margin of what is held; of a contact the reaction
    SECOND = 2  # the second margin
    GUARD = 3  # the guard itself: a sliding speed, a surface
    LIMIT = 4  # a margin was at 0, or below, at the start of the last step already


class Guard(IntEnum):
    """Which guard of a part with two sides becomes 0."""

    FIRST = 0  # its first margin, of what is held
    SECOND = 1
    ITSELF = 2  # the guard itself


class Kept(IntEnum):
    """What a surface that resets the state does at an instant at which the motion is at it."""

    NO = 0  # the motion is not at it
    ON_ITS_SIDE = 1  # it stays on its side, apart from rounding, and has its own event next
    PASSED = 2  # its own event has not changed its function: its side is read behind it


class PartColumn(IntEnum):
    """Columns of the table of parts, of whole numbers: a row for each contact (`motion.contacts`),
    then for each friction and for each surface (`motion.sided`). Columns that a kind does not use
    are 0."""

    COORDINATE = 0  # the coordinate that it holds, along which it acts, or that it looks at
    STATE = 1  # of a contact a `Touch`, of all others a `Side`
    # how many of the first Taylor coefficients of its guard are known to be 0 at the start of a
    # step
    SKIP = 2
    KIND = 3  # a `PartKind`
    MARGIN = 4  # of a friction that sticks, the number of the margin that SKIP refers to
    REACHED = 5  # a `Reached`
    # of what is held and follows from what else is: not 0, of a friction the direction of its
    # static limit, which it carries; a contact then carries nothing
    IDLE = 6
    # of a friction 1 plus the number of the contact whose reaction presses it, 0 for none; or a
    # `NoPress`
    PRESSED = 7
    STRUCK = 8  # of a friction or a function, a `FrictionImpact`
    # of a surface that resets the state where its side becomes +1, 1 plus the number of its reset;
    # minus that where -1 is the side in STATE that the motion comes to
    RESETS = 9
    KEPT = 10  # of a surface that resets the state, a `Kept`
    # of a contact, after how many more of its impacts the end of an accumulation is looked for
    # again
    WAITS = 11
    # of an open contact, between two calls of the kernel: what its gap has more than the difference
    # of its coordinate and its position, in units of EXCESS times the position
    EXCESS = 12


class FrictionImpact(IntEnum):
    """What a friction in a contact did at the last impact."""

    NOT = 0  # the contact had no impulse
    STUCK = 1  # after it the coordinate has the speed of the ground
    FORWARDS = 2  # it slides forwards after it
    BACKWARDS = 3
    JUMPED = 4  # of a surface that is a function, which may have jumped: its side is read anew


class NoPress(IntEnum):
    """In place of the contact that presses a friction."""

    INERT = -1  # the coefficients are 0, and nothing that it does changes a motion


class SegmentPlan(IntEnum):
    """Columns of the plan that describes each segment of an orbit (`segments.py`)."""

    ALONG = 0  # the contacts that are closed along the segment, as bits
    # the kind of the event with which it ends: IMPACT or RELEASE of `EventCode`, -1 for none
    KIND = 1
    CONTACT = 2  # the contact of that event
    AFTER = 3  # the contacts that are closed after it, as bits
    # its guard is divided by this power of its duration: 3 or 2 for excursions (`excursion_guard`),
    # else 0
    POWER = 4
    HIT = 5  # the contact whose impact begins it, -1 for none


class SegmentEnd(IntEnum):
    """Places in the numbers that describe a segment's ends."""

    GUARD = 0  # the guard of its event: the gap, or the reaction
    RATE = 1  # the guard's rate; at an impact minus the speed
    BY_START = 2  # the guard's derivative to the time of the segment's start
    BY_END = 3  # the guard's derivative to the time of its end
    # state and rates at the start, both at the end, the state after the event: 10 numbers for each
    # coordinate
    NUMBERS = 4


class SegmentExtremes(IntEnum):
    """Places in the extremes along a segment; inf where there is no such minimum. Those from `GAP`
    to `BESIDE` are in natural units."""

    TOP = 0  # the largest value of any coordinate
    BOTTOM = 1  # the least value of any coordinate
    GAP = 2  # the lowest inner minimum of a gap, its time, and its contact
    FORCE = 5  # the lowest inner minimum of a reaction, its time, and its contact
    # at the start, the least reaction of a closed contact or acceleration of an opening one, and
    # its contact
    PULL = 8
    # at the end, the least reaction of a contact that stays closed up to the event, and its contact
    TAIL = 10
    # at an impact that ends it, the least gap of another contact whose speed the impact changes
    BESIDE = 12
    MARGINS = 13  # the least values of the margins, from here on


class ImpactDetail(IntEnum):
    """Whether the motion has derivatives after an impact, or why it has none."""

    REGULAR = 0
    NO_SPEED = 1  # a contact is reached without speed
    # contacts that act on one another close at one instant, and in neighbouring motions one after
    # the other
    APART = 2
    # contacts that do not act on one another close at one instant, and their order makes a
    # first-order difference
    ORDERED = 3


# --- compiled from here on ---------------------------------------------------

NEAR = (
    2.0**-44
)  # Contacts close together if, when one closes, the other's gap is no larger than this share of its size in the step.
GAP_ROUNDING = 2.0**-6  # The rounding of a gap, in units of NEAR times the contact's position.
# Events of frictions are at one instant if no more than this share of the period lies between them:
# some 1e3 units in the last place.
TOGETHER = 2.0**-42
EXCESS = 2.0**-92
MOST_EXCESS = 2.0**50  # beyond it the coordinate was moved, and the difference is the gap
# For models with more contacts sets of them are found by exchanges, as there are too many to try
# them all.
MOST_TRIED = 8
# What counts as letting go, in units of a friction that only does not begin to stick: there are no
# more than 64 rows.
LETS_GO = 1000
# Two answers push alike if their a' M a differ by less than this share: by rounding.
EQUAL_PUSH = 1e-9
# The largest violation of a complementarity problem that may be rounding, as a share of its
# right-hand side.
VIOLATED = 1e-12
# Impacts of an accumulation that are followed at most: e = 0.9996 needs so many for 16 digits.
MOST_FROZEN_IMPACTS = 100_000
# Contacts close together in neighbouring motions too if their shifts differ by less than this
# share.
APART = 1e-9
# of the differences of an accumulation's duration: their error is its square, and 1e-12 by rounding
RELATIVE_STEP = 1e-4
# A contact whose impacts are slower than the first one of an accumulation by this factor rests.
VANISHED = 1e-16
# An accumulation is over if all speeds are smaller than the first one by this factor. It exceeds
# VANISHED, at
FINISHED = 1e-14
# which accumulations of one contact within those of another are cut off: near that scale the cuts
# would keep the other one going.
# If n impacts were followed ahead in vain, n / 32 impacts must happen before it is tried again.
TRIED_AGAIN = 32
# A rate of a row that is a smaller share of the terms of its sum is rounding.
ROW_ROUNDING = 2.0**-44
# A contact whose rate is less than this many times as large bounces no more than a few times before
# its rate is rounding,
LAST_BOUNCES = 8.0
# so that its accumulation ends there, if the accelerations change by no more than this share until
# then: what this leaves of its speed is rounding too.
FADING_CHANGE = 0.1
# A row follows from others if the square of the sine of its angle to them is at most this.
SPANNED = 1e-13
# Two choices move alike if the square of their difference, in the metric of M, is a smaller share.
SAME_MOTION = 1e-20
# Two impacts are alike if the square of the difference of their velocities is a smaller share.
SAME_IMPACT = 1e-18
# An idle row is kept at 0 if its acceleration is smaller, in units of the largest one so far.
PULLED = 1e-9
# Reactions smaller than this vanish together, in units of the largest one so far: the rounding of
# the loads that hold the contacts.
TIED = 1e-12
# A square of a coupling of two contacts that is no more than this share of the product of their own
# is rounding of the inverse mass matrix: a distant impact would open a contact on which nothing
# presses.
UNCOUPLED = 2.0**-92


@jit
def zeros(count):
    """An array of zeros, made in a function of its own because numba would compile `np.zeros` anew
    at each call of it.
    """
    return np.zeros(count)


@jit
def rows_of_zeros(rows, columns):
    """An array of zeros with two indices."""
    return np.zeros((rows, columns))


@jit
def solver_arrays(local, count, columns, frictions, numbers, multipliers):
    """The arrays in which impacts are solved for, for so many columns of a tangent, frictions,
    numbers that `matrices` fills, and rows that multipliers hold.
    """
    rows = count + frictions
    most = max(2 * local, rows + 1)
    of_rows = rows_of_zeros(local + 4, multipliers)
    # one piece of memory, as lanes ask for it at every slow impact
    of_contacts = rows_of_zeros(2 * count + 10, count)
    return SolverArrays(
        zeros(numbers),
        rows_of_zeros(local, local),
        of_contacts[:count],
        rows_of_zeros(max(local, rows), most),
        of_contacts[count : 2 * count],
        of_contacts[2 * count],
        of_contacts[2 * count + 1],
        of_contacts[2 * count + 2],
        of_contacts[2 * count + 3],
        of_contacts[2 * count + 4],
        of_contacts[2 * count + 5],
        of_contacts[2 * count + 6],
        of_contacts[2 * count + 7],
        of_contacts[2 * count + 8],
        of_contacts[2 * count + 9],
        zeros(columns * numbers),
        zeros(local),
        zeros(columns),
        rows_of_zeros(columns, count),
        of_rows[:local],
        of_rows[local],
        of_rows[local + 1],
        of_rows[local + 2],
        of_rows[local + 3],
    )


@lean_jit
def copy_all(given, target):
    """Copy an array into another one; numba's assignment of slices would take seconds to
    compile.
    """
    for i in range(given.size):
        target[i] = given[i]


@lean_jit
def restitution(motion, i, j):
    """The entry E_ij of the restitution matrix."""
    local = motion.local
    count = motion.contacts.shape[0]
    return motion.solver_numbers[local * local + count * i + j]


@lean_jit
def contact_position(motion, i):
    """The position of a contact."""
    local = motion.local
    count = motion.contacts.shape[0]
    return motion.solver_numbers[local * local + count * count + i]


@lean_jit
def is_sum(motion, i):
    """Whether a coordinate is a dependent sum: its row of the mass matrix has minus the
    coefficients of others.
    """
    local = motion.local
    found = False
    for j in range(local - motion.first_order if i >= local - motion.first_order else 0):
        found = found or motion.solver_numbers[local * i + j] != 0.0
    return found


@lean_jit
def jumping(motion, i):
    """What of a coordinate may jump at an event: its velocity, or the value of one of first order
    that is no dependent sum.
    """
    follows = i >= motion.own - motion.first_order and not is_sum(motion, i)
    return motion.coordinates[i] if follows else motion.velocities[i]


@lean_jit
def is_surface(motion, k):
    """Whether a row behind those of the contacts is that of a surface."""
    return motion.sided[k, PartColumn.KIND] >= PartKind.SURFACE


@lean_jit
def is_function(motion, k):
    """Whether it is that of a surface that is a function."""
    return motion.sided[k, PartColumn.KIND] >= PartKind.FUNCTION


@lean_jit
def is_remembered(motion, k):
    """Whether its side is remembered, as that of a relay, and the state does not tell it."""
    return motion.sided[k, PartColumn.KIND] >= PartKind.RELAY


@lean_jit
def first_row(motion):
    """The place in `solver_numbers` of the rows that multipliers hold: their end where none are."""
    size = motion.solver_numbers.size
    if motion.multipliers == 0:
        return size
    return size - motion.multipliers * (motion.local + 1) - motion.contacts.shape[0]


@lean_jit
def guard_level(motion, k):
    """The speed of a friction's ground, in a row 0; the position of a surface."""
    return motion.solver_numbers[first_row(motion) - motion.sided.shape[0] + k]


@lean_jit
def has_phases(motion):
    """Whether impacts with friction have a phase of compression and one of expansion."""
    return motion.solver_numbers[first_row(motion) - 2 * motion.sided.shape[0] - 1] > 0.0


@lean_jit
def rub_coefficient(motion, k):
    """The coefficient of a friction in a contact, at impacts."""
    return motion.solver_numbers[first_row(motion) - 2 * motion.sided.shape[0] + k]


@lean_jit
def first_flag(motion):
    """The place in the parameters of the numbers that say what is free: coordinates, or rows that
    multipliers hold."""
    return motion.parameters.size - (motion.multipliers if motion.multipliers > 0 else motion.local)
