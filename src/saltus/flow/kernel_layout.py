"""What the scalar kernel and its callers agree on: modes, reasons to return, places in its arrays, and its thresholds.

Members of the enumerations become plain numbers in the compiled text (see `compiled_part`). The thresholds below the marker are
compiled together with the kernel.
"""

from __future__ import annotations

from enum import IntEnum

import numpy as np


class Mode(IntEnum):
    """What a motion is doing."""

    ARC = 0  # moving smoothly on one side
    CONTACT = 1  # at the contact, to be decided
    REST = 2  # held at the contact until an acceleration points outward
    CHATTER = 3  # impacts without loss, too small and too many to follow one by one
    BEYOND = 4  # on no side of the contact: no state of the model


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
    SMOOTH = 8  # a smooth motion is all there is, so that a lane can go on by itself
    CAPTURED = 9
    SETTLED = 10
    OUTSIDE = 11
    UNRESOLVED = 12


class GrazingDetail(IntEnum):
    """What a grazing leaves."""

    TOUCH = 0
    TRIPLE = 1  # no speed: the motion goes on from rest at the contact


class Where(IntEnum):
    """Places in the array `where` of whole numbers that, with `state`, say where a motion is."""

    PERIOD = 0  # the forcing period
    MODE = 1
    SIDE = 2
    SKIP = 3  # order of the gap's known zero at the start of an arc; the side just released in CONTACT from rest
    PIECE = 4  # of the records
    STEPS = 5  # recorded in the buffer
    EVENTS = 6  # recorded in the buffer
    LAST_PERIOD = 7  # in which the motion ends
    ORDER = 8  # of the Taylor series
    DENSE = 9  # whether steps are recorded
    LEAVE_BY = 10  # the side named by the caller, where the motion from rest at contact is not unique; or 0
    HELD = 11  # whether it was at rest or in chatter before
    DOF = 12  # coordinates that are followed, OWN (1 + COLUMNS)
    MARGINS = 13  # at which the motion stops
    ROWS = 14  # of the workspace
    SIDES = 15  # of the contact
    CHECKED = 16  # whether steps are checked, as the structure has functions whose bends a series may not see
    UNTIL_SMOOTH = 17  # whether to return as soon as a smooth motion is all there is (see `driver.py`)
    OWN = 18  # the model's own coordinates
    COLUMNS = 19  # of the tangent


# The places of `Structure.sizes`, in their order.
STRUCTURE_SIZES = [Where.DOF, Where.MARGINS, Where.ROWS, Where.SIDES, Where.CHECKED, Where.OWN, Where.COLUMNS]


class Setting(IntEnum):
    """Places in the array `settings`."""

    LENGTH = 0  # of a forcing period
    END = 1  # of the motion, as a time within its last forcing period
    TOLERANCE = 2
    HORIZON = 3  # for a lane's scalar steps, which end before its motion may: the local time at which that does


class Work(IntEnum):
    """Places in the tuple `work` of arrays: Taylor coefficients of a step and the space to compute them."""

    POSITIONS = 0
    VELOCITIES = 1
    ACCELERATIONS = 2
    GAP = 3
    MARGINS = 4
    RECURRENCES = 5
    POLYNOMIAL = 6  # scaled to a step of 1
    CONTACT = 7  # contact accelerations of both sides
    STEP_END = 8  # the first five once more at the end of a step


class ModelPart(IntEnum):
    """Places in the tuple `model`: what the kernel calls for a structure, and the geometry of its contact."""

    SERIES = 0
    CONTACT_SERIES = 1
    RESET = 2
    CONTACT_DAMPING = 3
    GEOMETRY = 4
    TANGENT = 5


class Geometry(IntEnum):
    """Places in the array of a structure's geometry: the coordinate at contact, and how the gap changes with it on each side."""

    CONTACT = 0
    RATE_UP = 1
    RATE_DOWN = 2


# --- compiled from here on -----------------------------------------------------------------------------------------------

WHERE_LENGTH, SETTING_COUNT = 20, 4  # lengths of the arrays `where` and `settings`

# The length of a step.
SAFETY = 0.9  # The error of a step is then a tenth of tol, and 1000 periods add up to a drift in energy below 1e-12.
GAP = 0.65  # in the log of the radius between the last terms and those before: 0.6 for a sine, more where they vanish
SMALLEST = 1e-6  # The error of a step is relative to the size of the state, but absolute below this size.
SHORTEST = 1e-9  # A shorter step, in units of time or of a shorter forcing period, means that the acceleration is singular.
ROUGHER = 100.0  # A column's series may end so much earlier, in tol, than the motion's, whose steps then decide alone.
DEFECT = 100.0  # between a series and the equation at the end of a step, in tol size / h: sound steps stay below 4
BATCH = 100_000  # passes of the loop before the caller may look (Ctrl-C)

# Rest and release.
ZERO = 1e-14  # A smaller acceleration at contact is zero, as it is a difference of loads of order 1.
EXACT = 1e-15  # The tolerance at rest: a small error would decide whether a touch is a release, and there steps cost little.
TINY = 1e-60  # a speed so small that a limit is reached, and its square still a number

# Accumulations of impacts.
SLOW = 3.0  # in sqrt(tol): a faster impact is not tested for being the end of an accumulation
LOSSLESS = 1e-12  # A smaller loss of speed over two impacts is rounding.
CHATTER_SPEED = 1e-5  # The averaged law is then wrong by 5e-5 of the speed; following on takes 1e5 impacts a unit of time.
SLOWLY = 0.02  # the most that the contact accelerations may change over two impacts for the averaged law
GAUSS_NODES = np.array([0.0694318442029737, 0.3300094782075719, 0.6699905217924281, 0.9305681557970263])
GAUSS_WEIGHTS = np.array([0.1739274225687269, 0.3260725774312731, 0.3260725774312731, 0.1739274225687269])
