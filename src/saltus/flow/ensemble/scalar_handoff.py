"""A lane's visit to the scalar kernel, for whatever is rare: rest, slow impacts, touches, limits, singularities.

This text is compiled together with `alone.py`, and called through a pointer.
"""

from __future__ import annotations

import numpy as np

from saltus.flow.ensemble.function_types import VISIT_LANE
from saltus.flow.ensemble.lane_layout import (
    AFTER_POSITION,
    AT_CONTACT,
    BENDS,
    CAPTURE,
    CAPTURED,
    CHATTER_NOW,
    COLUMN_COUNT,
    END_TIME,
    FORCED_SIDE,
    HELD_NOW,
    HIGHEST,
    IDENT,
    IMPACT_COUNT,
    LAST_LEG,
    LEAST,
    LEG,
    LEG_LENGTH,
    LEG_START,
    LOWEST,
    MODE_NOW,
    MODEL_ROWS,
    NOW,
    PARKED,
    PIECE_NOW,
    POSITION,
    SCALAR_ORDER,
    SIDE_NOW,
    SIDED,
    SKIP_NOW,
    STOP_ROWS,
    TOUCHES,
    VELOCITY,
    WATCH,
    WORKSPACE,
)
from saltus.flow.ensemble.scalar_fallback import turning_range
from saltus.flow.kernel_layout import (
    ARC,
    CHATTER,
    COLUMNS,
    DENSE,
    DOF,
    DONE,
    END,
    EVENTS,
    FORCED,
    FULL,
    GRAZING,
    HELD,
    HORIZON,
    IMPACT,
    LAST,
    LENGTH,
    MODE,
    ORDER,
    OWN,
    PAUSED,
    PERIOD,
    PIECE,
    REST,
    ROWS,
    SIDE,
    SIDES,
    SKIP,
    SPEED,
    STATE,
    STEEP,
    STEPS,
    STOPS,
    TIME,
    TOLERANCE,
    VISIT,
    VISITED,
    WHERE,
)
from saltus.taylor import WIDTH, jit, lean_jit
from saltus.taylor import not_here as cached_jit

# --- compiled from here on -----------------------------------------------------------------------------------------------

VISIT_BUFFER = 64  # steps, and events, of one call


@jit
def depart(lane, sizes, at, m, flags, settings, lanes):
    """The scalar kernel's state for a lane: counters, numbers and settings (see `kernel.py`)."""
    own, gauge = lanes[0][lane], lanes[1][lane]
    rows = at[VELOCITY] - at[POSITION]
    where, state, limits = np.zeros(WHERE, dtype=np.int64), np.zeros(2 + 2 * rows + sizes[COLUMN_COUNT]), np.zeros(4)
    leg, length = int(m[LEG * WIDTH + lane]), m[LEG_LENGTH * WIDTH + lane]
    where[PERIOD], where[LAST], where[MODE], where[HELD] = leg, leg, own[MODE_NOW], own[HELD_NOW]
    where[SIDE], where[PIECE], where[FORCED] = int(m[SIDE_NOW * WIDTH + lane]), own[PIECE_NOW], own[FORCED_SIDE]
    where[SKIP] = (flags[AT_CONTACT] >> lane) & 1 if own[MODE_NOW] == ARC else own[SKIP_NOW]
    where[ORDER], where[DENSE], where[VISIT] = sizes[SCALAR_ORDER], sizes[WATCH], 1
    where[DOF], where[STOPS], where[ROWS] = rows, sizes[STOP_ROWS], sizes[WORKSPACE]
    where[SIDES], where[STEEP] = sizes[SIDED], sizes[BENDS]
    where[OWN], where[COLUMNS] = sizes[MODEL_ROWS], sizes[COLUMN_COUNT]
    state[TIME], state[SPEED] = m[NOW * WIDTH + lane], gauge[CHATTER_NOW]
    for row in range(rows):
        state[STATE + row] = m[(at[POSITION] + row) * WIDTH + lane]
        state[STATE + rows + row] = m[(at[VELOCITY] + row) * WIDTH + lane]
    limits[LENGTH], limits[TOLERANCE] = length, settings[TOLERANCE]
    limits[END] = gauge[END_TIME] if leg == own[LAST_LEG] else m[LEG_START * WIDTH + lane] + length
    limits[HORIZON] = (own[LAST_LEG] - leg) * length + gauge[END_TIME]
    return where, state, limits


@lean_jit
def note(lane, where, m, lanes, steps, events, sizes, poly):
    """Record the impacts and the extrema of a part of the visit; returns the last event's detail."""
    detail = 0
    for i in range(where[EVENTS]):
        kind, detail = events[0][i, 1], events[0][i, 3]
        if kind == IMPACT:
            m[IMPACT_COUNT * WIDTH + lane] += 1.0
            m[LEAST * WIDTH + lane] = min(m[LEAST * WIDTH + lane], abs(events[1][i, 1]))
        elif kind == GRAZING:
            lanes[0][lane, TOUCHES] += 1
    for i in range(where[STEPS]):
        above, below = turning_range(steps[2][i, 0], where[ORDER], 0.0, steps[1][i, 1], poly)
        m[HIGHEST * WIDTH + lane] = max(m[HIGHEST * WIDTH + lane], above)
        m[LOWEST * WIDTH + lane] = min(m[LOWEST * WIDTH + lane], below)
    where[STEPS] = where[EVENTS] = 0
    return detail


@lean_jit
def come_back(lane, sizes, at, m, flags, lanes, where, state):
    """Put the scalar kernel's state into the lane."""
    own, bit = lanes[0][lane], 1 << lane
    rows = at[VELOCITY] - at[POSITION]
    own[MODE_NOW], own[HELD_NOW], own[SKIP_NOW], own[PIECE_NOW] = where[MODE], where[HELD], where[SKIP], where[PIECE]
    m[NOW * WIDTH + lane], m[SIDE_NOW * WIDTH + lane] = state[TIME], float(where[SIDE])
    for row in range(rows):
        m[(at[POSITION] + row) * WIDTH + lane] = state[STATE + row]
        m[(at[VELOCITY] + row) * WIDTH + lane] = state[STATE + rows + row]
    arc = where[MODE] == ARC and where[SKIP] <= 1
    flags[PARKED] = flags[PARKED] & ~bit if arc else flags[PARKED] | bit
    flags[AT_CONTACT] = flags[AT_CONTACT] | bit if arc and where[SKIP] == 1 else flags[AT_CONTACT] & ~bit


@lean_jit
def is_captured(where, state, model, threshold):
    """Whether it is at rest, or at the contact with a speed of the gap below the one that is proved to be captured."""
    if where[MODE] == REST:
        return threshold > 0.0
    if where[MODE] == CHATTER:
        return state[SPEED] < threshold
    if where[MODE] != ARC or where[SKIP] != 1:
        return False
    rate = model[4][1] if where[SIDE] > 0 else model[4][2]
    return rate * state[STATE + where[DOF]] < threshold


@cached_jit(VISIT_LANE)
def visit(lane, scalar, sizes, at, m, flags, settings, lanes, parameters, tables, poly, control):
    """Move a lane by the scalar kernel until it is on an arc again, or its leg or its motion ends.

    Returns (PAUSED, 0), or why the motion ends and which margin reached zero.
    """
    advance, functions = scalar
    gauge, constants, geometry = lanes[1], lanes[2], lanes[3]
    where, state, limits = depart(lane, sizes, at, m, flags, settings, lanes)
    env = (parameters[lanes[0][lane, IDENT]], constants[lane], tables[0], tables[1])
    model = (functions[0], functions[1], functions[2], functions[3], geometry[lane], functions[4])
    steps = (
        np.empty((VISIT_BUFFER, 2), np.int64),
        np.empty((VISIT_BUFFER, 2)),
        np.empty((VISIT_BUFFER, where[OWN], where[ORDER] + 2)),
    )
    events = (np.empty((VISIT_BUFFER, 4), np.int64), np.empty((VISIT_BUFFER, 3 + where[COLUMNS])))
    while True:
        reason = advance(where, state, limits, env, model, steps, events)
        detail = note(lane, where, m, lanes, steps, events, sizes, poly)
        if (reason != FULL and reason != PAUSED) or control[0] != 0:
            break
    come_back(lane, sizes, at, m, flags, lanes, where, state)
    for j in range(sizes[COLUMN_COUNT]):  # how the time of a last event moves, for `finish`
        m[(at[AFTER_POSITION] + j) * WIDTH + lane] = state[STATE + 2 * where[DOF] + j]
    gauge[lane, CHATTER_NOW] = state[SPEED] if where[MODE] == CHATTER else 0.0
    if reason in (DONE, VISITED, FULL, PAUSED):
        return CAPTURED if is_captured(where, state, model, m[CAPTURE * WIDTH + lane]) else PAUSED, 0
    return reason, detail
