"""Definitions that the scalar kernel shares with its callers: modes, reasons to return, events,
places in its arrays, and thresholds; and the rule for the side on which a state moves on, which
lanes share.

Members of the enumerations become plain numbers in the compiled text (see `compiled_part`). The
thresholds below the marker are compiled together with the kernel.
"""

from __future__ import annotations

from enum import IntEnum

import numpy as np

from saltus.taylor import lean_jit


class EventCode(IntEnum):
    """The kinds of events of a motion; the generated function `tangent` takes them as an
    argument.
    """

    IMPACT = 0
    GRAZING = 1
    REST = 2
    RELEASE = 3
    CHATTER = 4
    LIMIT = 5
    HELD = 6
    STICK = 7
    SLIP = 8
    REVERSAL = 9
    CROSSING = 10
    # no event, but a request to `tangent`: the derivatives of the reset alone, at a fixed instant
    RESET_SLOPES = 11


class RestDetail(IntEnum):
    """The way in which a system comes to rest, which decides the derivatives at rest."""

    AFTER_IMPACTS = 0  # as the limit of an accumulation of impacts
    # after an impact that leaves no speed; motions from neighbouring states come to rest soon after
    AT_ONCE = 1
    # at once, but impacts lose nothing, so that motions from neighbouring states never come to rest
    NEVER_AGAIN = 2


class ReleaseDetail(IntEnum):
    """The cause of a release from rest, which decides the derivatives of the release."""

    AT_A_ROOT = 0  # a simple root of the contact acceleration
    AT_A_JUMP = 1  # a jump of the contact acceleration through zero, whose time the load fixes
    AT_NONE = 2  # neither, so that the release has no derivative


class Mode(IntEnum):
    """What a motion is doing."""

    ARC = 0  # moving smoothly on one side
    CONTACT = 1  # at the contact, where the next mode has to be decided
    REST = 2  # held at the contact until an acceleration points outward
    CHATTER = 3  # impacts without loss, too small and too many to follow one by one
    BEYOND = 4  # on no side of the contact: the model has no such state


class Status(IntEnum):
    """Why the kernel returns; from CAPTURED on only the lanes give these reasons."""

    DONE = 0
    FULL = 1  # a buffer is full
    PAUSED = 2  # a batch of steps is done
    NOT_UNIQUE = 3
    NO_IMPACT = 4
    NOT_FINITE = 5
    STALLED = 6
    LIMITED = 7
    SMOOTH = 8  # the motion is smooth again, so that its lane can go on together with the others
    CAPTURED = 9
    SETTLED = 10
    OUTSIDE = 11
    UNRESOLVED = 12
    PASSED = 13  # a contact or a surface was passed by more than rounding, without an event
    UNORDERED = 14  # two resets of the state at one instant, whose order makes a difference
    NO_STATE = 15  # a reset of the state gives no numbers


class GrazingDetail(IntEnum):
    """The kinds of grazing."""

    TOUCH = 0  # a double root of the gap
    TRIPLE = 1  # a triple root: the motion goes on from rest at the contact


class Geometry(IntEnum):
    """Places in the array of a structure's geometry: the coordinate at contact, and how the gap
    changes with it on each side.
    """

    CONTACT = 0
    RATE_UP = 1
    RATE_DOWN = 2


class SegmentValue(IntEnum):
    """Columns of the numbers at the ends of each smooth segment of an orbit with one contact
    (`one_contact/segments.py`).
    """

    QUOTIENT = 0  # (x - contact) / duration
    RESET_DRIFT = 1  # dv+/dt
    # from here on coordinates, velocities and accelerations at the end, then at the start
    FIRST_STATE = 2


class SegmentColumn(IntEnum):
    """Columns of the extremes along such a segment; inf where there is no such extreme."""

    LOWEST_GAP = 0  # the lowest inner minimum of the gap
    LOWEST_GAP_TIME = 1
    HIGHEST = 2  # the largest value of any coordinate
    LOWEST = 3  # the least
    CROSSINGS = 4  # the number of passages of the contact
    SHALLOWEST = 5  # the least depth of an arc
    DEEPEST = 6  # the depth of the last arc
    LEAST_MARGIN = 7  # the least values of the margins, from here on


# --- compiled from here on ---------------------------------------------------

# of a lane's series, at 1e-6 and at 1e-15; even, as coefficients are made in pairs
LOWEST_ORDER = 14
HIGHEST_ORDER = 22
SERIES_LENGTH = HIGHEST_ORDER + 1


# The length of a step.
# The error of a step is then a tenth of tol, and the energy drifts by less than 1e-12 in 1000
# periods.
SAFETY = 0.9
# largest difference of the log radius of convergence by the last terms and by earlier ones: 0.6 for
# a sine
GAP = 0.65
# the same from one pair of terms to the next, times the order: 2 for a sine
PAIR_GAP = 3.0
# The size of a state that is 0 and stays so, to which the error of a step is relative.
SMALLEST = 1e-6
# A speed that is a smaller number than this share of its first derivatives is 0: in all units of
# time it is far below the rounding of the speed that one step gives.
STANDS = 2.0**-160
# A shorter step, in units of time, of a shorter forcing period or of a shorter motion, means that
# the acceleration is singular.
SHORTEST = 1e-9
# The tolerance of a column's series in units of tol; so the motion alone decides nearly all steps.
ROUGHER = 100.0
# The largest defect of a series in the equation at the end of a step, in tol size / h; sound steps
# stay below 4.
DEFECT = 100.0
# a smaller acceleration may be the rounding of terms that cancel, in units of the largest of them
CANCELLED = 2.0**-50
BATCH = 100_000  # passes of the loop before the kernel returns to Python, which can then see Ctrl-C

# Rest and release.
# A smaller acceleration at the contact counts as zero, as it is a difference of loads: in units of
# the largest one so far.
ZERO = 1e-14
# The tolerance at rest: a small error could turn a touch into a release, and steps cost little
# there.
EXACT = 1e-15
TINY = 1e-60  # a speed that stands for the limit 0, and whose square is still a number

# Accumulations of impacts.
# In sqrt(tol), the lost share of the speed and the fastest impact so far: after faster impacts the
# end of an accumulation is not looked for (`slow_share`), so that impacts are seen where nothing
# changes their pull.
SLOW = 3.0
# Not below this share, that of the tolerance 1e-10: bounces that are smaller by far than the rounding
# of where bodies are would be followed, and their order with those of other bodies is lost.
LEAST_SHARE = 3e-5
LEAST_LOSS = 0.05  # The lost share counts as no smaller than this.
LOSSLESS = 1e-12  # A smaller loss of speed over two impacts is rounding.
# In natural speeds. Here the averaged law has an error of 2e-5 of the speed if the pulls of both
# sides change by half within a unit of time, and of 1e-11 at one wall, beside impacts that were
# followed one by one; a unit of time would have 1e4 of them.
CHATTER_SPEED = 4e-5
# A gap below minus this share of the terms of its sum is no rounding, and no error of a step of the
# tolerance 0; the tolerance comes ten times on top.
PENETRATED = 2.0**-40
INSTANT = 2.0**-52  # times that differ by less, in natural times, are one
# the largest change of the contact accelerations over two impacts for which the averaged law is
# used
SLOWLY = 0.02
GAUSS_NODES = np.array(
    [0.0694318442029737, 0.3300094782075719, 0.6699905217924281, 0.9305681557970263]
)
GAUSS_WEIGHTS = np.array(
    [0.1739274225687269, 0.3260725774312731, 0.3260725774312731, 0.1739274225687269]
)


@lean_jit
def side_of_state(sides, position, velocity, geometry):
    """The mode and the side of a state: from the gap; at the contact from the velocity; at rest
    there the mode CONTACT decides.

    The mode is BEYOND if the state lies on no side of the contact. A motion that starts at the
    contact with a velocity that closes the gap of every side is on an ARC that begins with its
    impact.
    """
    if sides == 0:
        return Mode.ARC, 1
    into = 0
    open_side = 0
    pressed = False
    for i in range(sides):
        side = 1 - 2 * i
        rate = geometry[Geometry.RATE_UP + i]
        gap = rate * (position - geometry[Geometry.CONTACT])
        if gap > 0.0 and open_side == 0:
            open_side = side
        pressed = pressed or gap < 0.0
        if rate * velocity > 0.0 and into == 0:
            into = side
    if open_side != 0:
        return Mode.ARC, open_side
    if pressed:
        return Mode.BEYOND, 1
    if velocity == 0.0:
        return Mode.CONTACT, 1
    return (Mode.CONTACT, into) if into != 0 else (Mode.ARC, 1)
