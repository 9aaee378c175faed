"""The layout of the memory of a group of lanes, and of the arrays that come with it.

The memory `m` consists of slots of one vector, with a number for each lane. Its first slots are those of `Slot`. The parts of
`LanePart` follow, each with as many slots as the structure needs; the array `at` lists the first slot of each part. Members of
the enumerations become plain numbers in the compiled text (see `compiled_part`).
"""

from __future__ import annotations

from enum import IntEnum

from saltus.flow.kernel.memory_layout import LaneSlot


class Slot(IntEnum):
    """The slots that every structure has."""

    NOW = LaneSlot.NOW
    ORIGIN = LaneSlot.ORIGIN
    SIDE = LaneSlot.SIDE
    NEW_TIME = LaneSlot.NEW_TIME
    NEW_SIDE = LaneSlot.NEW_SIDE
    PERIOD_END = 5  # the time at which the forcing period, or the motion, ends
    CONTACT = 6  # the coordinate at the contact; this slot and the next two have the places of `Geometry`
    RATE_UP = 7
    RATE_DOWN = 8
    CAPTURE_SPEED = 9  # motions whose gap has a lower speed after an impact are proved to be captured
    HIGHEST = 10  # the largest coordinate since the forcing period began; the next three slots are of the same time
    LOWEST = 11
    LEAST_SPEED = 12  # before an impact
    IMPACTS = 13
    ENDED_HIGHEST = 14  # the same four for the last forcing period that has ended, then the side at its end
    ENDED_LOWEST = 15
    ENDED_LEAST_SPEED = 16
    ENDED_IMPACTS = 17
    ENDED_SIDE = 18
    OVERALL_HIGHEST = 19  # the same four from the start to the end of the last forcing period that has ended
    OVERALL_LOWEST = 20
    OVERALL_LEAST_SPEED = 21
    OVERALL_IMPACTS = 22
    STEP_LIMIT = 23  # the time that no step goes beyond; it may lie beyond PERIOD_END
    PERIOD = 24  # number of the forcing period
    PERIOD_START = 25  # time at which the trajectory began within its first forcing period: all of its periods begin there
    PERIOD_LENGTH = 26
    PERIODS_DONE = 27
    PASSED_TOGETHER = 28  # forcing periods below this number are ended for all lanes at once
    NEXT_CHECK = 29  # the number of impacts at which it is checked next that they do not accumulate without end
    LAST_CHECK = 30  # the time at which that was last checked
    NEW_SPEED = 31  # for a model with several contacts: the speed before an impact
    FREE_POSITION = LaneSlot.FREE_POSITION
    FREE_VELOCITY = LaneSlot.FREE_VELOCITY
    STEP_SHARE = 34  # the share of the step allowed by the series that the next step takes
    RECORDED_FROM = 35  # number of the first forcing period in which extrema are recorded


class Size(IntEnum):
    """Places in the array `sizes`: numbers of a structure and of a call."""

    OWN = 0  # the model's own coordinates
    COLUMNS = 1  # of the tangent
    MARGINS = 2
    SIDES = 3
    CHECKED = 4  # whether steps are checked, as in `Where.CHECKED`
    RECORDS = 5
    ORDER = 6  # of the lanes' series
    SCALAR_ORDER = 7
    WORKSPACE = 8  # rows, of the scalar kernel
    KEPT = 9  # for how many of the last forcing periods samples are kept
    EXTREMA = 10  # whether extrema are recorded
    SETTLE = 11  # whether a trajectory ends when it repeats itself
    ENDS_ASKED = 12  # whether the ends of forcing periods are asked for at all
    EVERY_END = 13  # whether every end of a forcing period needs work, as for samples or recurrences
    ONE_FREE = 14  # whether there is a series for lanes in which one coordinate is free (see `one_free.py`)
    GUARDS = 15  # of that series
    CONSTANT_GUARDS = 16
    FRICTIONS = 17  # the number of frictions; their coordinates follow behind the signs of the contacts
    FROM_START = 18  # whether extrema are recorded from the start, not only in the forcing periods that are kept
    CONTACTS = 19  # the number of contacts of a model with several; their coordinates, then their signs follow


class LaneSetting(IntEnum):
    """Places in the array `settings` of the lanes."""

    TOLERANCE = 0
    SHORTEST_STEP = 1
    SLOWEST_IMPACT = 2  # after an impact with a lower speed of the gap, the end of an accumulation may be near


class LaneArray(IntEnum):
    """Places in the tuple `lanes` of arrays that have a row for each lane."""

    LABELS = 0  # see `LaneLabel`
    NUMBERS = 1  # see `LaneNumber`
    CONSTANTS = 2  # of the structure
    GEOMETRY = 3  # of its contact; with several contacts the numbers that `matrices` gives
    STATES = 4  # the last stroboscopic states, of which the oldest is overwritten
    AGREEMENTS = 5  # for each q, how many states in a row agreed with those q forcing periods before
    CONTACTS = 6  # of a model with several, the scalar kernel's array `contacts`


class LaneLabel(IntEnum):
    """Places in a lane's row of LABELS."""

    TRAJECTORY = 0  # its row in the jobs
    LAST_PERIOD = 1
    PIECE = 2
    MODE = 3
    HELD = 4
    SKIP = 5
    LEAVE_BY = 6
    GRAZINGS = 7


class LaneNumber(IntEnum):
    """Places in a lane's row of NUMBERS."""

    END_TIME = 0  # of the motion, within its last forcing period
    CHATTER_SPEED = 1


class Flag(IntEnum):
    """Places in the array `flags` of bits, one for each lane."""

    BUSY = 0  # it holds a trajectory
    AT_CONTACT = 1  # its arc starts at the contact
    SCALAR = 2  # it is not on an arc, so the scalar kernel moves it


class Helper(IntEnum):
    """Places in the tuple `helpers` of functions that work on one lane at a time."""

    FIRST_ROOT = 0
    TURNING_RANGE = 1
    SCALAR_MOTION = 2
    IMPACT = 3  # of a model with several contacts


class Code(IntEnum):
    """Places in the tuple `code`: the functions of a structure."""

    SERIES = 0
    IMPACT = 1
    FIELD = 2
    CONSTANTS = 3
    GEOMETRY = 4  # or `matrices`
    ONE_FREE = 5  # of a model with several contacts: the series where one coordinate is free


class JobArray(IntEnum):
    """Places in the tuple `jobs` of arrays that have a row for each trajectory."""

    STATES = 0
    NUMBERS = 1  # see `JobNumber`
    LABELS = 2  # see `JobLabel`
    PARAMETERS = 3


class JobNumber(IntEnum):
    """Columns of the jobs' numbers."""

    START_TIME = 0  # within the first forcing period
    PERIOD_LENGTH = 1
    END_TIME = 2  # within the last forcing period
    CAPTURE_SPEED = 3


class JobLabel(IntEnum):
    """Columns of the jobs' labels."""

    FIRST_PERIOD = 0
    LAST_PERIOD = 1
    LEAVE_BY = 2
    PIECE = 3


class EndNumber(IntEnum):
    """Columns of the results' numbers; behind them lie the rates of the velocities and the shifts of the last event."""

    TIME = 0
    CHATTER_SPEED = 1
    HIGHEST = 2
    LOWEST = 3
    LEAST_SPEED = 4
    RATES = 5


class EndLabel(IntEnum):
    """Columns of the results' labels."""

    STATUS = 0
    DETAIL = 1  # the period of a recurrence, or the margin that was reached
    MODE = 2
    SIDE = 3
    PERIOD = 4
    IMPACTS = 5
    GRAZINGS = 6
    PERIODS_DONE = 7


# --- compiled from here on -----------------------------------------------------------------------------------------------

MOST_IMPACTS = 1e6  # in a unit of time, or in a shorter forcing period: more are an accumulation that is not resolved
BURST = 2e4  # impacts between two checks of their rate with several contacts, where each takes a pass of the scalar kernel
SMALLEST_SHARE = 0.25  # at this share of the usual step, the scalar search for roots decides what a shorter step could not
NO_ROOT, TOUCH = -1.0, -2.0  # instead of the time of a lane's root
FAST = 1e300  # A state beyond this has left the range of numbers.
