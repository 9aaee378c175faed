"""Where things lie in the memory of a group of lanes, and in the arrays that come with it.

This text is compiled together with the lanes (see `driver.py`).
"""

from __future__ import annotations

# --- compiled from here on -----------------------------------------------------------------------------------------------

# Slots of one vector: the state of each lane, what its step proposes, its contact, and what is recorded of its forcing period.
NOW, ORIGIN, SIDE_NOW, NEW_TIME, NEW_SIDE, TARGET = 0, 1, 2, 3, 4, 5
POINT, RATE_UP, RATE_DOWN, CAPTURE = 6, 7, 8, 9
HIGHEST, LOWEST, LEAST, CROSSINGS = 10, 11, 12, 13
NEXT_LOOK = 14  # at this many impacts of a leg the clock is looked at
FIRST_PLACE = 15
# Then, from the slots that `at` lists, as many as the structure needs.
POSITION, VELOCITY, NEW_POSITION, NEW_VELOCITY, AFTER_POSITION, AFTER_VELOCITY = 0, 1, 2, 3, 4, 5
PARAMETERS, CONSTANTS_AT, RECORDS, POSITIONS, VELOCITIES, ACCELERATIONS, MARGINS, END_OF_MEMORY = 6, 7, 8, 9, 10, 11, 12, 13

LOWEST_ORDER, HIGHEST_ORDER = 12, 20  # of a lane's series, at 1e-6 and at 1e-15; even, as coefficients are made in pairs
STRIDE = HIGHEST_ORDER + 1  # slots of one series

# Numbers of a structure and of a call, in `sizes`.
MODEL_ROWS, COLUMN_COUNT, STOP_ROWS, SIDED, BENDS, RECORD_ROWS = 0, 1, 2, 3, 4, 5
LANE_ORDER, SCALAR_ORDER, WORKSPACE, LAST_KEPT, WATCH, SETTLE = 6, 7, 8, 9, 10, 11

SHORTEST_STEP, SLOWEST_IMPACT = 3, 4  # in `settings`, after those of `layout.py`
SETTINGS, SIZES = 5, 12  # the lengths of `settings` and `sizes`

# For each lane: in `lane`, and in `gauge`.
IDENT, LEG, LAST_LEG, PIECE_NOW, MODE_NOW, HELD_NOW, SKIP_NOW, FORCED_SIDE, COUNT, TOUCHES, LEGS_DONE = (
    0,
    1,
    2,
    3,
    4,
    5,
    6,
    7,
    8,
    9,
    10,
)
LANE_LABELS = 11  # the length of a row of `lane`
PERIOD_LENGTH, END_TIME, CHATTER_NOW, TOP, BOTTOM, SLOWEST, LEG_START, LOOKED_AT = 0, 1, 2, 3, 4, 5, 6, 7
GAUGES = 8  # and of `gauge`

AWAKE, AT_CONTACT, PARKED = 0, 1, 2  # in `flags`: bits of the lanes that hold a trajectory, that start at contact, not in an arc
ROOT_ALONE, TURNS_ALONE, VISIT_ALONE = 0, 1, 2  # in `helpers`: what is done for one lane at a time
SERIES_CODE, IMPACT_CODE, FIELD_CODE, CONSTANTS_CODE, GEOMETRY_CODE = 0, 1, 2, 3, 4  # in `code`: the functions of a structure

# Why a trajectory ended, after the reasons of `layout.py` (DONE, NOT_UNIQUE, NO_IMPACT, NOT_FINITE, STALLED, LIMITED).
CAPTURED, SETTLED, OUTSIDE, UNRESOLVED = 9, 10, 11, 12
BEYOND = 4  # a mode after those of `flow/layout.py`: on no side of the contact

MOST_IMPACTS = 1e6  # of a unit of time, or of a shorter forcing period: beyond, an accumulation is not resolved but endured
NO_ROOT, TOUCH = -1.0, -2.0  # instead of the time of a lane's root
