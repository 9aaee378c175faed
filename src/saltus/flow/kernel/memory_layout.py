"""Definitions that the generated functions share with their callers: numbers of events, places in a state, slots of memory.

The enumerations are written into compiled code as the numbers that they stand for (see `compiled_part`).
"""

from __future__ import annotations

from enum import IntEnum


class EventCode(IntEnum):
    """The kinds of events of a motion; the generated function `tangent` takes them as an argument."""

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


# --- compiled from here on -----------------------------------------------------------------------------------------------

LOWEST_ORDER, HIGHEST_ORDER = 14, 22  # of a lane's series, at 1e-6 and at 1e-15; even, as coefficients are made in pairs
SERIES_LENGTH = HIGHEST_ORDER + 1
