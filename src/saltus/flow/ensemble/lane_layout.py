"""Where things lie in the memory of a group of lanes, and in the arrays that come with it.

This text is compiled together with the lanes (see `driver.py`).
"""

from __future__ import annotations

# --- compiled from here on -----------------------------------------------------------------------------------------------

# Slots of one vector: the state of each lane, what its step proposes, its contact, what is recorded of its leg, and its clock.
NOW, ORIGIN, SIDE_NOW, NEW_TIME, NEW_SIDE, TARGET = 0, 1, 2, 3, 4, 5
POINT, RATE_UP, RATE_DOWN, CAPTURE = 6, 7, 8, 9
HIGHEST, LOWEST, LEAST, IMPACT_COUNT = 10, 11, 12, 13  # since the leg began
ENDED_HIGHEST, ENDED_LOWEST, ENDED_LEAST, ENDED_IMPACT_COUNT, ENDED_SIDE = 14, 15, 16, 17, 18  # when the last leg ended
TOP, BOTTOM, SLOWEST, COUNT = 19, 20, 21, 22  # from the start to the end of the last leg
WALL = 23  # the time that no step goes beyond; it may go beyond the end of a leg, TARGET
LEG, LEG_START, LEG_LENGTH, LEGS_DONE = 24, 25, 26, 27  # which forcing period, from what local time on, how long; how many ended
FREE_LEGS = 28  # legs below this one are ended for all lanes at once
NEXT_LOOK, LAST_LOOK = 29, 30  # at this many impacts of a leg the clock is looked at, as it was at that time
# Then, from the slots that `at` lists, as many as the structure needs.
POSITION, VELOCITY, NEW_POSITION, NEW_VELOCITY, AFTER_POSITION, AFTER_VELOCITY = 0, 1, 2, 3, 4, 5
ENDED_POSITION, ENDED_VELOCITY = 6, 7
PARAMETERS, CONSTANTS_AT, RECORDS, POSITIONS, VELOCITIES, ACCELERATIONS, MARGINS = 8, 9, 10, 11, 12, 13, 14

LOWEST_ORDER, HIGHEST_ORDER = 14, 22  # of a lane's series, at 1e-6 and at 1e-15; even, as coefficients are made in pairs
STRIDE = HIGHEST_ORDER + 1  # slots of one series

# Numbers of a structure and of a call, in `sizes`.
MODEL_ROWS, COLUMN_COUNT, STOP_ROWS, SIDED, BENDS, RECORD_ROWS = 0, 1, 2, 3, 4, 5
LANE_ORDER, SCALAR_ORDER, WORKSPACE, LAST_KEPT, WATCH, SETTLE, ENDS_ASKED, EVERY_END = 6, 7, 8, 9, 10, 11, 12, 13

SHORTEST_STEP, SLOWEST_IMPACT = 3, 4  # in `settings`, after those of `layout.py`
SETTINGS, SIZES = 5, 14  # the lengths of `settings` and `sizes`

# For each lane: in `lane`, and in `gauge`.
IDENT, LAST_LEG, PIECE_NOW, MODE_NOW, HELD_NOW, SKIP_NOW, FORCED_SIDE, TOUCHES = 0, 1, 2, 3, 4, 5, 6, 7
LANE_LABELS = 8  # the length of a row of `lane`
END_TIME, CHATTER_NOW = 0, 1
GAUGES = 2  # and of `gauge`

AWAKE, AT_CONTACT, PARKED = 0, 1, 2  # in `flags`: bits of the lanes that hold a trajectory, that start at contact, not in an arc
ROOT_ALONE, TURNS_ALONE, VISIT_ALONE = 0, 1, 2  # in `helpers`: what is done for one lane at a time
SERIES_CODE, IMPACT_CODE, FIELD_CODE, CONSTANTS_CODE, GEOMETRY_CODE = 0, 1, 2, 3, 4  # in `code`: the functions of a structure

# Why a trajectory ended, after the reasons of `layout.py` (DONE, NOT_UNIQUE, NO_IMPACT, NOT_FINITE, STALLED, LIMITED).
CAPTURED, SETTLED, OUTSIDE, UNRESOLVED = 9, 10, 11, 12
BEYOND = 4  # a mode after those of `flow/kernel_layout.py`: on no side of the contact

MOST_IMPACTS = 1e6  # of a unit of time, or of a shorter forcing period: beyond, an accumulation is not resolved but endured
NO_ROOT, TOUCH = -1.0, -2.0  # instead of the time of a lane's root
