"""What the kernel for several contacts and its callers agree on: places in its arrays, and its thresholds."""

from __future__ import annotations

from enum import IntEnum


class ContactColumn(IntEnum):
    """Columns of the array `contacts` of whole numbers, with a row for each contact."""

    COORDINATE = 0  # the coordinate that it holds
    CLOSED = 1  # whether it does: its gap and the gap's rate are then exactly 0
    SKIP = 2  # of its guard, how many of the first Taylor coefficients are known to be 0 at the start of a step
    RELEASED = 3  # 1 where its reaction has just reached 0 from above, so that it is known to be 0
    WAITS = 4  # how many of its impacts are left until it is asked again whether an accumulation ends soon


class FrictionColumn(IntEnum):
    """Columns of the rows behind them, one for each friction."""

    COORDINATE = 0  # along which it acts
    SLIDES = 1  # in which direction of it, 0 where it sticks
    SKIP = 2  # of its guard, how many of the first Taylor coefficients are known to be 0 at the start of a step
    MARGIN = 3  # of which of the two margins of one that sticks
    REACHED = 4  # 1 or 2: which margin has just reached 0; 3: the sliding speed has


class ContactPart(IntEnum):
    """Places in the tuple `model`: what the kernel calls for a structure, and the signs of the contacts."""

    SERIES = 0
    MATRICES = 1
    SIGNS = 2
    SLOPES = 3  # of what `MATRICES` fills, along each column of the tangent
    TANGENT = 4


class Solver(IntEnum):
    """Places in the tuple `solver` of arrays, in which impacts and closed contacts are solved for."""

    NUMBERS = 0  # mass matrix by rows, E by rows, positions: what `MATRICES` fills
    INVERSE = 1  # of the mass matrix
    COUPLING = 2  # of the contacts, signs included: the rates that unit impulses give to gaps
    BLOCK = 3  # the rows of a linear system, with its right-hand sides behind them
    REDUCED = 4  # the coupling of some of the contacts
    RIGHT = 5
    IMPULSES = 6
    TRIED = 7
    RATES = 8  # of the gaps before an impact
    GAPS = 9
    PULLS = 10  # the second derivatives of the gaps with no contact closed
    FALLING_GAPS = 11  # while an accumulation is followed
    FALLING_RATES = 12
    FALLING_PULLS = 13
    SLOPES = 14  # a row for each column of the tangent: the derivatives of `NUMBERS`
    JUMP = 15  # of the velocities at an impact
    EVENT_SHIFTS = 16  # by how much an impact, a release or the end of an accumulation moves with each column
    PULL_SLOPES = 17  # the derivatives of `PULLS`, a row for each column


class SegmentPlan(IntEnum):
    """Columns of what is given of the segments of an orbit (`contact_segments.py`)."""

    ALONG = 0  # the contacts that are closed along it, as bits
    KIND = 1  # of the event with which it ends: IMPACT or RELEASE of `EventCode`, -1 for none
    CONTACT = 2  # of that event
    AFTER = 3  # the contacts that are closed after it
    POWER = 4  # of its duration by which its guard is divided: with which the gap of the contact grows that it begins and ends at
    HIT = 5  # the contact at whose impact it begins, -1 for none


class SegmentEnd(IntEnum):
    """Places in the numbers of a segment's ends."""

    GUARD = 0  # of its event: the gap, or the reaction
    RATE = 1  # of the guard, by which the speed of an impact is read
    BY_START = 2  # the guard's derivative to the time of the segment's start, and to that of its end
    BY_END = 3
    NUMBERS = 4  # state and rates at the start, both at the end, the state after the event: 10 numbers for each coordinate


class SegmentExtremes(IntEnum):
    """Places in what is seen along a segment."""

    TOP = 0  # the largest value of any coordinate
    BOTTOM = 1
    GAP = 2  # the lowest inner minimum of a gap, when, and whose
    FORCE = 5  # the same of a reaction
    PULL = 8  # the least reaction or acceleration from a contact with which it begins, and whose
    TAIL = 10  # the least reaction with which it ends, and whose: of contacts that stay closed up to the event
    BESIDE = 12  # the least gap, at the impact with which it ends, of another contact whose speed the impact changes
    MARGINS = 13  # their least values, from here on


class ImpactDetail(IntEnum):
    """What an impact leaves of the tangent."""

    REGULAR = 0
    NO_SPEED = 1  # a contact is reached without speed, so that motions beside this one have no derivative
    APART = 2  # contacts close at one instant, and motions beside this one close them one after the other
    ORDERED = 3  # the same of contacts that do not act on one another, and their order makes a difference of first order


# --- compiled from here on -----------------------------------------------------------------------------------------------

NEAR = (
    2.0**-44
)  # Contacts close together if when one does the other's gap is no larger than this share of what it was in the step.
GAP_ROUNDING = 2.0**-6  # of a gap, in NEAR times the contact's position
VIOLATED = 1e-12  # The largest share of its right-hand side by which a complementarity problem may be violated by rounding.
MOST_FROZEN_IMPACTS = 100_000  # that an accumulation is followed for: e = 0.9996 needs so many for 16 digits
APART = 1e-9  # Contacts close together in motions beside one if the derivatives of their instants differ by less than this share.
RELATIVE_STEP = 1e-4  # of differences of an accumulation's duration: their error is its square, and 1e-12 by rounding
VANISHED = 1e-16  # A contact whose impacts are slower than the first one of an accumulation by this factor rests.
FINISHED = 1e-14  # All that is slower than that by this factor is over: accumulations of one contact within those of another
# are cut off at VANISHED, and near that scale the cuts would keep the other one going.
TRIED_AGAIN = 32  # Of the impacts that were followed ahead in vain, one in so many has to come before they are followed again.
TIED = 1e-12  # A smaller reaction vanishes together with that of another contact: rounding of the loads that hold them.
