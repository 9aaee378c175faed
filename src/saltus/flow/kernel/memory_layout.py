"""Definitions that the generated functions share with their callers: numbers of events, places in a state, slots of memory.

The enumerations are written into compiled code as the numbers that they stand for (see `compiled_part`).
"""

from __future__ import annotations

from enum import IntEnum


class EventCode(IntEnum):
    """The kinds of events of a motion; the generated function `tangent` takes them as an argument."""

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
    RESET_SLOPES = 10  # no event, but a request to `tangent`: the derivatives of the reset alone, at a fixed instant


class RestDetail(IntEnum):
    """The way in which a system comes to rest, which decides the derivatives at rest."""

    AFTER_IMPACTS = 0  # as the limit of an accumulation of impacts
    AT_ONCE = 1  # after an impact that leaves no speed; motions from neighbouring states come to rest soon after
    NEVER_AGAIN = 2  # at once, but impacts lose nothing, so that motions from neighbouring states never come to rest


class ReleaseDetail(IntEnum):
    """The cause of a release from rest, which decides the derivatives of the release."""

    AT_A_ROOT = 0  # a simple root of the contact acceleration
    AT_A_JUMP = 1  # a jump of the contact acceleration through zero, whose time the load fixes
    AT_NONE = 2  # neither, so that the release has no derivative


class LaneSlot(IntEnum):
    """The slots of the lanes' memory that the generated functions read or write besides the parts of `LanePart`."""

    NOW = 0  # time within the forcing period
    ORIGIN = 1  # time at which the forcing period began
    SIDE = 2
    NEW_TIME = 3  # the time at the end of the step
    NEW_SIDE = 4  # after an impact
    FREE_POSITION = 32  # with several contacts, where only one coordinate is free: this coordinate
    FREE_VELOCITY = 33


class LanePart(IntEnum):
    """The parts of the lanes' memory behind the slots that do not depend on the structure, in their order."""

    POSITION = 0
    VELOCITY = 1
    NEW_POSITION = 2  # at the end of the step
    NEW_VELOCITY = 3
    AFTER_POSITION = 4  # after an impact at the end of the step
    AFTER_VELOCITY = 5
    ENDED_POSITION = 6  # at the end of the last forcing period
    ENDED_VELOCITY = 7
    PARAMETERS = 8
    FREE = 9  # with several contacts: 1 for each coordinate that no contact holds, else 0
    CONTACTS = 10  # the contacts' positions
    MASS = 11  # the mass matrix at the new state, by rows
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
