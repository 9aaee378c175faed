"""A trajectory in its lane: how it gets there, goes from one forcing period to the next, and leaves.

`lanes` = (lane, gauge, constants, geometry, ring, streak): for each lane counters and numbers (see `layout.py`), the structure's
constants and contact, its last states, and how long each cycle has lasted. This text is compiled together with the lanes (see
`driver.py`).
"""

from __future__ import annotations

import numpy as np

from saltus.flow.ensemble.lane_layout import (
    AFTER_POSITION,
    AFTER_VELOCITY,
    AT_CONTACT,
    AWAKE,
    BEYOND,
    BOTTOM,
    CAPTURE,
    CHATTER_NOW,
    COLUMN_COUNT,
    CONSTANTS_AT,
    CONSTANTS_CODE,
    COUNT,
    END_TIME,
    ENDED_HIGHEST,
    ENDED_POSITION,
    ENDED_SIDE,
    ENDED_VELOCITY,
    EVERY_END,
    FIELD_CODE,
    FORCED_SIDE,
    FREE_LEGS,
    GEOMETRY_CODE,
    HELD_NOW,
    HIGHEST,
    IDENT,
    IMPACT_COUNT,
    LAST_KEPT,
    LAST_LEG,
    LAST_LOOK,
    LEAST,
    LEG,
    LEG_LENGTH,
    LEG_START,
    LEGS_DONE,
    LOWEST,
    MODE_NOW,
    MODEL_ROWS,
    MOST_IMPACTS,
    NEW_POSITION,
    NEW_TIME,
    NEXT_LOOK,
    NOW,
    ORIGIN,
    OUTSIDE,
    PARAMETERS,
    PARKED,
    PIECE_NOW,
    POINT,
    POSITION,
    SETTLE,
    SETTLED,
    SIDE_NOW,
    SIDED,
    SKIP_NOW,
    SLOWEST,
    TARGET,
    TOP,
    TOUCHES,
    VELOCITY,
    WALL,
)
from saltus.flow.ensemble.lane_steps import sizes_rows
from saltus.flow.ensemble.sampling import LONGEST_CYCLE, cycle_length
from saltus.flow.kernel_layout import ARC, CHATTER, CONTACT, DONE, PAUSED
from saltus.taylor import WIDTH, inline_jit, lean_jit, load, store

# --- compiled from here on -----------------------------------------------------------------------------------------------


@lean_jit
def fill(lane, i, code, sizes, at, m, flags, lanes, jobs, tables):
    """Put trajectory i into a lane."""
    state, numbers, labels, parameters = jobs
    where, gauge, constants, geometry, _, streak = lanes
    where[lane, IDENT], where[lane, LAST_LEG] = i, labels[i, 1]
    where[lane, FORCED_SIDE], where[lane, PIECE_NOW] = labels[i, 2], labels[i, 3]
    where[lane, HELD_NOW] = where[lane, SKIP_NOW] = where[lane, TOUCHES] = 0
    gauge[lane, END_TIME], gauge[lane, CHATTER_NOW] = numbers[i, 2], 0.0
    streak[lane, :] = 0
    env = (parameters[i], constants[lane], tables[0], tables[1])
    code[CONSTANTS_CODE](parameters[i], constants[lane])
    code[GEOMETRY_CODE](env, geometry[lane])
    half = state.shape[1] // 2
    for row in range(half):
        m[(at[POSITION] + row) * WIDTH + lane], m[(at[VELOCITY] + row) * WIDTH + lane] = state[i, row], state[i, half + row]
    for j in range(parameters.shape[1]):
        m[(at[PARAMETERS] + j) * WIDTH + lane] = parameters[i, j]
    for j in range(constants.shape[1]):
        m[(at[CONSTANTS_AT] + j) * WIDTH + lane] = constants[lane, j]
    for j in range(3):
        m[(POINT + j) * WIDTH + lane] = geometry[lane, j]
    m[NOW * WIDTH + lane] = m[LEG_START * WIDTH + lane] = numbers[i, 0]
    m[LEG_LENGTH * WIDTH + lane], m[CAPTURE * WIDTH + lane] = numbers[i, 1], numbers[i, 3]
    m[LEG * WIDTH + lane], m[LEGS_DONE * WIDTH + lane] = float(labels[i, 0]), 0.0
    m[TOP * WIDTH + lane], m[BOTTOM * WIDTH + lane], m[SLOWEST * WIDTH + lane], m[COUNT * WIDTH + lane] = (
        -np.inf,
        np.inf,
        np.inf,
        0.0,
    )
    m[NEXT_LOOK * WIDTH + lane], m[LAST_LOOK * WIDTH + lane] = MOST_IMPACTS, numbers[i, 0]
    begin_records(lane, at, m)
    bit = 1 << lane
    flags[AWAKE] |= bit
    flags[AT_CONTACT] &= ~bit
    where[lane, MODE_NOW], side = begin_mode(sizes[SIDED], state[i, 0], state[i, half], geometry[lane])
    m[SIDE_NOW * WIDTH + lane] = float(side)
    flags[PARKED] = flags[PARKED] & ~bit if where[lane, MODE_NOW] == ARC else flags[PARKED] | bit
    begin_leg(lane, sizes, m, lanes, tables)


@lean_jit
def begin_mode(sides, position, velocity, geometry):
    """The mode and the side of a state, as `simulation.py` chooses them; the mode BEYOND is no state of the model."""
    if sides == 0:
        return ARC, 1
    into, open_side, pressed = 0, 0, False
    for i in range(sides):
        side, rate = 1 - 2 * i, geometry[1 + i]
        gap = rate * (position - geometry[0])
        if gap > 0.0 and open_side == 0:
            open_side = side
        pressed = pressed or gap < 0.0
        if rate * velocity > 0.0 and into == 0:
            into = side
    if open_side != 0:
        return ARC, open_side
    if pressed:
        return BEYOND, 1
    if velocity == 0.0:
        return CONTACT, 1
    return (CONTACT, into) if into != 0 else (ARC, 1)


@lean_jit
def unresolved(lane, m):
    """Whether the last MOST_IMPACTS impacts took less than a unit of time, or than a shorter forcing period."""
    now, length = m[NOW * WIDTH + lane], m[LEG_LENGTH * WIDTH + lane]
    since, m[LAST_LOOK * WIDTH + lane] = m[LAST_LOOK * WIDTH + lane], now
    m[NEXT_LOOK * WIDTH + lane] += MOST_IMPACTS
    return now - since < (min(length, 1.0) if length > 0.0 else 1.0)


@inline_jit
def leg_end(lane, m, lanes):
    """The local time at which a leg ends: a forcing period after it began, or with the motion."""
    where, gauge = lanes[0], lanes[1]
    if int(m[LEG * WIDTH + lane]) == where[lane, LAST_LEG]:
        return gauge[lane, END_TIME]
    return m[LEG_START * WIDTH + lane] + m[LEG_LENGTH * WIDTH + lane]


@inline_jit
def begin_leg(lane, sizes, m, lanes, tables):
    """Set where a lane's leg ends and where a step must: there, only if the motion ends in this leg or the next one.

    The records' breakpoints end both. A step may go one leg further, not two.
    """
    where, breaks = lanes[0], tables[0]
    leg, last, length = int(m[LEG * WIDTH + lane]), where[lane, LAST_LEG], m[LEG_LENGTH * WIDTH + lane]
    origin, target = leg * length, leg_end(lane, m, lanes)
    wall = target + length if leg + 1 < last else target
    piece = where[lane, PIECE_NOW]
    while piece < breaks.size and breaks[piece] - origin <= m[NOW * WIDTH + lane]:
        piece += 1
    where[lane, PIECE_NOW] = piece
    m[FREE_LEGS * WIDTH + lane] = -np.inf if piece < breaks.size or sizes[EVERY_END] > 0 else float(last - 2)
    if piece < breaks.size:
        wall = min(wall, breaks[piece] - origin)
    m[ORIGIN * WIDTH + lane], m[TARGET * WIDTH + lane], m[WALL * WIDTH + lane] = origin, min(target, wall), wall


@inline_jit
def begin_records(lane, at, m):
    """Start what is recorded of a forcing period, with the position at its beginning."""
    x = m[at[POSITION] * WIDTH + lane]
    m[HIGHEST * WIDTH + lane], m[LOWEST * WIDTH + lane] = x, x
    m[LEAST * WIDTH + lane], m[IMPACT_COUNT * WIDTH + lane] = np.inf, 0.0


@inline_jit
def end_here(lane, at, m):
    """Take what a lane is now for the end of its leg (compare `observe.pass_ends`)."""
    count = sizes_rows(at)
    for row in range(2 * count):  # positions, then velocities, lie one behind the other
        m[(at[ENDED_POSITION] + row) * WIDTH + lane] = m[(at[POSITION] + row) * WIDTH + lane]
    m[ENDED_SIDE * WIDTH + lane] = m[SIDE_NOW * WIDTH + lane]
    for j in range(4):
        m[(ENDED_HIGHEST + j) * WIDTH + lane] = m[(HIGHEST + j) * WIDTH + lane]
    total_up(lane, m)
    m[NEXT_LOOK * WIDTH + lane] -= m[IMPACT_COUNT * WIDTH + lane]
    m[LEGS_DONE * WIDTH + lane] += 1.0
    begin_records(lane, at, m)


@inline_jit
def go_back(lane, at, m, t):
    """Have a lane be what it was at the end of its leg, at time t."""
    count = sizes_rows(at)
    for row in range(2 * count):
        m[(at[POSITION] + row) * WIDTH + lane] = m[(at[ENDED_POSITION] + row) * WIDTH + lane]
    m[SIDE_NOW * WIDTH + lane], m[NOW * WIDTH + lane] = m[ENDED_SIDE * WIDTH + lane], t
    begin_records(lane, at, m)


@inline_jit
def keep_sample(lane, sizes, at, m, lanes, results):
    """Keep the state at the end of the last leg and what happened in it, in the ring of the last samples."""
    own, done = sizes[MODEL_ROWS], int(m[LEGS_DONE * WIDTH + lane])
    row = results[3][lanes[0][lane, IDENT], (done - 1) % sizes[LAST_KEPT]]
    for d in range(own):
        row[d], row[own + d] = m[(at[ENDED_POSITION] + d) * WIDTH + lane], m[(at[ENDED_VELOCITY] + d) * WIDTH + lane]
    for j in range(4):
        row[2 * own + j] = m[(ENDED_HIGHEST + j) * WIDTH + lane]


@inline_jit
def end_leg(lane, sizes, at, m, lanes, results):
    """Keep a leg that is over; the length of the cycle that the trajectory has settled on, or 0."""
    where, gauge, _, _, ring, streak = lanes
    if sizes[EVERY_END] > 0:
        keep_sample(lane, sizes, at, m, lanes, results)
    if sizes[SETTLE] == 0:
        return 0
    legs, own = int(m[LEGS_DONE * WIDTH + lane]), sizes[MODEL_ROWS]
    here = legs % (2 * LONGEST_CYCLE)
    for d in range(own):
        ring[lane, here, d], ring[lane, here, own + d] = (
            m[(at[ENDED_POSITION] + d) * WIDTH + lane],
            m[(at[ENDED_VELOCITY] + d) * WIDTH + lane],
        )
    if where[lane, MODE_NOW] == CHATTER:
        ring[lane, here, own] = gauge[lane, CHATTER_NOW]
    return cycle_length(ring[lane], streak[lane], legs, own)


@inline_jit
def total_up(lane, m):
    """Add what was recorded of a leg to what is recorded of the trajectory."""
    m[COUNT * WIDTH + lane] += m[IMPACT_COUNT * WIDTH + lane]
    m[TOP * WIDTH + lane] = max(m[TOP * WIDTH + lane], m[HIGHEST * WIDTH + lane])
    m[BOTTOM * WIDTH + lane] = min(m[BOTTOM * WIDTH + lane], m[LOWEST * WIDTH + lane])
    m[SLOWEST * WIDTH + lane] = min(m[SLOWEST * WIDTH + lane], m[LEAST * WIDTH + lane])


@inline_jit
def arrive(lane, past, sizes, at, m, lanes, tables, results):
    """At the end of a leg, or `past` it, or at a breakpoint: go on.

    Returns DONE, SETTLED, or PAUSED, and the length of the cycle.
    """
    where = lanes[0]
    leg, now, start = int(m[LEG * WIDTH + lane]), m[NOW * WIDTH + lane], m[LEG_START * WIDTH + lane]
    last, t_end = leg == where[lane, LAST_LEG], leg_end(lane, m, lanes)
    if now >= t_end:
        if last and t_end <= start and m[LEGS_DONE * WIDTH + lane] > 0.0:  # the end of whole periods: there is nothing to record
            return DONE, 0
        if past:
            m[LEGS_DONE * WIDTH + lane] += 1.0
        else:
            end_here(lane, at, m)
        cycle = end_leg(lane, sizes, at, m, lanes, results)
        if last:
            return DONE, 0
        if cycle > 0:
            go_back(lane, at, m, t_end)
            return SETTLED, cycle
        m[LEG * WIDTH + lane] = leg + 1.0
        m[NOW * WIDTH + lane] = start + (now - t_end)
        m[LAST_LOOK * WIDTH + lane] += start - t_end
    begin_leg(lane, sizes, m, lanes, tables)
    return PAUSED, 0


@lean_jit
def finish(lane, reason, detail, code, sizes, at, m, flags, lanes, results):
    """Write the end of a lane's trajectory; the lane is free."""
    where, gauge = lanes[0], lanes[1]
    state, numbers, labels, _ = results
    i, half = where[lane, IDENT], state.shape[1] // 2
    none = m[LEGS_DONE * WIDTH + lane] == 0.0
    part = m[NOW * WIDTH + lane] > m[LEG_START * WIDTH + lane] or m[IMPACT_COUNT * WIDTH + lane] > 0.0 or none
    if part and reason != DONE and reason != SETTLED and reason != OUTSIDE:  # it ends within a leg
        end_here(lane, at, m)
    else:
        total_up(lane, m)
    if m[LEGS_DONE * WIDTH + lane] > 0.0:
        keep_sample(lane, sizes, at, m, lanes, results)
    for row in range(half):
        state[i, row], state[i, half + row] = m[(at[POSITION] + row) * WIDTH + lane], m[(at[VELOCITY] + row) * WIDTH + lane]
    numbers[i, 0], numbers[i, 1] = m[NOW * WIDTH + lane], gauge[lane, CHATTER_NOW]
    for j in range(3):
        numbers[i, 2 + j] = m[(TOP + j) * WIDTH + lane]
    if sizes[COLUMN_COUNT] > 0 and where[lane, MODE_NOW] == ARC:  # how fast the state changes at the end
        store(m, NEW_TIME, load(m, NOW))
        for row in range(2 * sizes_rows(at)):
            store(m, at[NEW_POSITION] + row, load(m, at[POSITION] + row))
        code[FIELD_CODE](m)
        for row in range(sizes[MODEL_ROWS]):
            numbers[i, 5 + row] = m[(at[AFTER_VELOCITY] + row) * WIDTH + lane]
        for j in range(sizes[COLUMN_COUNT]):
            numbers[i, 5 + sizes[MODEL_ROWS] + j] = m[(at[AFTER_POSITION] + j) * WIDTH + lane]
    labels[i, 0], labels[i, 1], labels[i, 2] = reason, detail, where[lane, MODE_NOW]
    labels[i, 3], labels[i, 4] = int(m[SIDE_NOW * WIDTH + lane]), int(m[LEG * WIDTH + lane])
    labels[i, 5], labels[i, 6] = int(m[COUNT * WIDTH + lane]), where[lane, TOUCHES]
    labels[i, 7] = int(m[LEGS_DONE * WIDTH + lane])
    flags[AWAKE] &= ~(1 << lane)
    flags[PARKED] &= ~(1 << lane)
