"""What the generated functions and their callers agree on: numbers of events, places in a state, slots of the lanes' memory.

The enumerations are written into compiled code as the numbers that they stand for (see `compiled_part`).
"""

from __future__ import annotations

from enum import IntEnum


class EventCode(IntEnum):
    """What happens at an instant of a motion; for the generated function `tangent` also what it is asked."""

    IMPACT = 0
    GRAZING = 1
    RESTING = 2
    RELEASE = 3
    CHATTERING = 4
    LIMIT = 5
    HELD = 6
    STICK = 7
    SLIP = 8
    REVERSAL = 9
    RESET_SLOPES = 10  # no event: the derivatives of the reset alone, at a fixed instant of impact


class RestDetail(IntEnum):
    """How rest comes about, which decides its derivatives."""

    AFTER_IMPACTS = 0  # as the limit of an accumulation of impacts
    AT_ONCE = 1  # after an impact that leaves no speed, and motions from states beside it come to rest soon after
    NEVER_AGAIN = 2  # at once, but impacts lose nothing, so that motions from states beside it never come to rest


class ReleaseDetail(IntEnum):
    """What releases a system from rest, which decides the derivatives of the release."""

    AT_A_ROOT = 0  # a simple root of the contact acceleration
    AT_A_JUMP = 1  # a jump of the contact acceleration through zero, whose time the load fixes
    AT_NONE = 2  # neither, so that the release has no derivative


class State(IntEnum):
    """Places in the array `state` of the scalar kernel.

    From COORDINATES on it holds all coordinates, those of the tangent's columns included, then their velocities, then for each
    column by how much the last event moves.
    """

    TIME = 0  # within the forcing period
    CHATTER_SPEED = 1  # of the gap, while impacts without loss are averaged
    COORDINATES = 2


class LaneSlot(IntEnum):
    """The slots of the lanes' memory that the generated functions read or write besides the parts of `LanePart`."""

    NOW = 0  # time within the forcing period
    ORIGIN = 1  # time at which that began
    SIDE = 2
    NEW_TIME = 3  # of what a step proposes
    NEW_SIDE = 4  # after an impact
    FREE_POSITION = 32  # of the one coordinate that is free, in a model with several contacts
    FREE_VELOCITY = 33


class LanePart(IntEnum):
    """The parts of the lanes' memory behind the slots that do not depend on the structure, in their order."""

    POSITION = 0
    VELOCITY = 1
    NEW_POSITION = 2  # at the end of the step that is proposed
    NEW_VELOCITY = 3
    AFTER_POSITION = 4  # after an impact there
    AFTER_VELOCITY = 5
    ENDED_POSITION = 6  # at the end of the last forcing period
    ENDED_VELOCITY = 7
    PARAMETERS = 8
    FREE = 9  # 1 for each coordinate that no contact holds, else 0, of a model with several
    CONTACTS = 10  # their positions
    MASS = 11  # matrix at the new state, by rows
    RESTITUTION = 12  # E by rows
    IMPULSES = 13  # room for the impulses of an impact
    CONSTANT_GUARDS = 14  # margins that do not change while one coordinate is free
    CONSTANTS = 15
    RECORDS = 16
    POSITIONS = 17  # from here on Taylor series, each of SERIES_LENGTH slots
    VELOCITIES = 18
    ACCELERATIONS = 19
    MARGINS = 20  # with the reactions of several contacts before them


# --- compiled from here on -----------------------------------------------------------------------------------------------

FIRST_PART = 36  # slot: those before it do not depend on the structure
LOWEST_ORDER, HIGHEST_ORDER = 14, 22  # of a lane's series, at 1e-6 and at 1e-15; even, as coefficients are made in pairs
SERIES_LENGTH = HIGHEST_ORDER + 1
