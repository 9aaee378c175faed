"""A trajectory in its lane: its start, its way from one forcing period to the next, and its end.

Its compiled part goes into one module with that of `driver.py`.
"""

from __future__ import annotations

import numpy as np

from saltus.flow.kernel.layout import Mode, Status
from saltus.flow.kernel.memory_layout import LanePart
from saltus.flow.lanes.lane_layout import (
    BURST,
    MOST_IMPACTS,
    Code,
    EndLabel,
    EndNumber,
    Flag,
    JobLabel,
    JobNumber,
    LaneArray,
    LaneLabel,
    LaneNumber,
    Size,
    Slot,
)
from saltus.flow.lanes.lane_steps import row_count
from saltus.flow.lanes.sampling import LONGEST_RECURRENCE, recurrence_period
from saltus.flow.one_contact.lane_step import begin_contact
from saltus.taylor import get, inline_jit, lean_jit, load, own_records, put, store

# --- compiled from here on -----------------------------------------------------------------------------------------------


@lean_jit
def fill(lane, i, code, sizes, at, m, flags, lanes, jobs, tables):
    """Put trajectory i into a lane."""
    state, numbers, labels, parameters = jobs
    label, number, constants, agreements = lanes[0], lanes[1], lanes[2], lanes[5]  # in the places of `LaneArray`
    label[lane, LaneLabel.TRAJECTORY], label[lane, LaneLabel.LAST_PERIOD] = i, labels[i, JobLabel.LAST_PERIOD]
    label[lane, LaneLabel.LEAVE_BY], label[lane, LaneLabel.PIECE] = labels[i, JobLabel.LEAVE_BY], labels[i, JobLabel.PIECE]
    label[lane, LaneLabel.HELD] = label[lane, LaneLabel.SKIP] = label[lane, LaneLabel.GRAZINGS] = 0
    number[lane, LaneNumber.END_TIME], number[lane, LaneNumber.CHATTER_SPEED] = numbers[i, JobNumber.END_TIME], 0.0
    for k in range(agreements.shape[1]):
        agreements[lane, k] = 0
    breaks, table = own_records(tables, i)
    env = (parameters[i], constants[lane], breaks, table)
    code[Code.CONSTANTS](parameters[i], constants[lane])
    half = state.shape[1] // 2
    put_all(m, at[LanePart.POSITION], lane, state[i, :half])
    put_all(m, at[LanePart.VELOCITY], lane, state[i, half:])
    put_all(m, at[LanePart.PARAMETERS], lane, parameters[i])
    put_all(m, at[LanePart.CONSTANTS], lane, constants[lane])
    begin_time(lane, sizes, m, numbers[i], labels[i])
    begin_overall(lane, m)
    begin_records(lane, sizes, at, m)
    mode, side = begin_contact(lane, code, sizes, at, m, lanes, env, state[i], labels[i, JobLabel.PIECE])
    label[lane, LaneLabel.MODE] = mode
    put(m, Slot.SIDE, lane, float(side))
    bit = 1 << lane
    flags[Flag.BUSY] |= bit
    flags[Flag.AT_CONTACT] &= ~bit
    flags[Flag.SCALAR] = flags[Flag.SCALAR] & ~bit if mode == Mode.ARC else flags[Flag.SCALAR] | bit
    begin_period(lane, sizes, m, lanes, tables)


@lean_jit
def put_all(m, first, lane, values):
    """Put numbers into the slots of one lane from `first` on."""
    for j in range(values.size):
        put(m, first + j, lane, values[j])


@inline_jit
def impacts_between_checks(sizes):
    """The number of impacts between two checks whether there are too many."""
    return BURST if sizes[Size.CONTACTS] > 0 else MOST_IMPACTS


@inline_jit
def begin_time(lane, sizes, m, numbers, labels):
    """Set the forcing period and the time at which a trajectory starts, and its first step."""
    start = numbers[JobNumber.START_TIME]
    put(m, Slot.NOW, lane, start)
    put(m, Slot.PERIOD_START, lane, start)
    put(m, Slot.PERIOD_LENGTH, lane, numbers[JobNumber.PERIOD_LENGTH])
    put(m, Slot.CAPTURE_SPEED, lane, numbers[JobNumber.CAPTURE_SPEED])
    put(m, Slot.PERIOD, lane, float(labels[JobLabel.FIRST_PERIOD]))
    put(m, Slot.PERIODS_DONE, lane, 0.0)
    put(m, Slot.NEXT_CHECK, lane, impacts_between_checks(sizes))
    put(m, Slot.LAST_CHECK, lane, start)
    put(m, Slot.STEP_SHARE, lane, 1.0)
    put(m, Slot.RECORDED_FROM, lane, first_recorded(labels[JobLabel.LAST_PERIOD], sizes))


@inline_jit
def first_recorded(last, sizes):
    """The first forcing period in which extrema are recorded, if the motion goes on up to period `last`.

    It is one before those that are kept, because a step that goes past its end already belongs to the next one; and one more, as
    the last period may have no length.
    """
    return -np.inf if sizes[Size.FROM_START] > 0 else last - sizes[Size.KEPT] - 1.0


@inline_jit
def begin_overall(lane, m):
    """Begin the records of the whole trajectory."""
    put(m, Slot.OVERALL_HIGHEST, lane, -np.inf)
    put(m, Slot.OVERALL_LOWEST, lane, np.inf)
    put(m, Slot.OVERALL_LEAST_SPEED, lane, np.inf)
    put(m, Slot.OVERALL_IMPACTS, lane, 0.0)


@inline_jit
def begin_records(lane, sizes, at, m):
    """Begin the records of a forcing period, with the positions at its beginning."""
    high = low = get(m, at[LanePart.POSITION], lane)
    for row in range(1, sizes[Size.OWN]):
        x = get(m, at[LanePart.POSITION] + row, lane)
        high, low = max(high, x), min(low, x)
    put(m, Slot.HIGHEST, lane, high)
    put(m, Slot.LOWEST, lane, low)
    put(m, Slot.LEAST_SPEED, lane, np.inf)
    put(m, Slot.IMPACTS, lane, 0.0)


@lean_jit
def unresolved(lane, sizes, m):
    """Whether there were more than MOST_IMPACTS in a unit of time, or in a shorter forcing period, since the last check."""
    many, now, length = impacts_between_checks(sizes), get(m, Slot.NOW, lane), get(m, Slot.PERIOD_LENGTH, lane)
    since = get(m, Slot.LAST_CHECK, lane)
    put(m, Slot.LAST_CHECK, lane, now)
    put(m, Slot.NEXT_CHECK, lane, get(m, Slot.NEXT_CHECK, lane) + many)
    return now - since < (min(length, 1.0) if length > 0.0 else 1.0) * many / MOST_IMPACTS


@inline_jit
def period_end(lane, m, lanes):
    """The local time at which a forcing period of a trajectory ends: one period after it began, or with the motion."""
    if int(get(m, Slot.PERIOD, lane)) == lanes[LaneArray.LABELS][lane, LaneLabel.LAST_PERIOD]:
        return lanes[LaneArray.NUMBERS][lane, LaneNumber.END_TIME]
    return get(m, Slot.PERIOD_START, lane) + get(m, Slot.PERIOD_LENGTH, lane)


@inline_jit
def begin_period(lane, sizes, m, lanes, tables):
    """Set the end of a lane's forcing period, and the time beyond which no step goes.

    This time is one period after the end, so that a step may go past the end; it is the end itself if the motion ends in this
    period or the next. Both are at most the next breakpoint of the load's records.
    """
    labels = lanes[LaneArray.LABELS]
    breaks = tables[0]  # indexed with `own`: a row as an array of its own would need a locked instruction to count references
    own = min(labels[lane, LaneLabel.TRAJECTORY], breaks.shape[0] - 1)
    period, last, length = int(get(m, Slot.PERIOD, lane)), labels[lane, LaneLabel.LAST_PERIOD], get(m, Slot.PERIOD_LENGTH, lane)
    origin, end = period * length, period_end(lane, m, lanes)
    limit = end + length if period + 1 < last else end
    piece = labels[lane, LaneLabel.PIECE]
    while piece < breaks.shape[1] and breaks[own, piece] - origin <= get(m, Slot.NOW, lane):
        piece += 1
    labels[lane, LaneLabel.PIECE] = piece
    each = piece < breaks.shape[1] or sizes[Size.EVERY_END] > 0
    put(m, Slot.PASSED_TOGETHER, lane, -np.inf if each else float(last - 2))
    if piece < breaks.shape[1]:
        limit = min(limit, breaks[own, piece] - origin)
    put(m, Slot.ORIGIN, lane, origin)
    put(m, Slot.PERIOD_END, lane, min(end, limit))
    put(m, Slot.STEP_LIMIT, lane, limit)


@inline_jit
def end_here(lane, sizes, at, m):
    """End the forcing period of a lane at its present state (compare `sampling.pass_ends`)."""
    for row in range(2 * row_count(at)):  # the slots of velocities follow those of positions
        put(m, at[LanePart.ENDED_POSITION] + row, lane, get(m, at[LanePart.POSITION] + row, lane))
    put(m, Slot.ENDED_SIDE, lane, get(m, Slot.SIDE, lane))
    for j in range(4):
        put(m, Slot.ENDED_HIGHEST + j, lane, get(m, Slot.HIGHEST + j, lane))
    total_up(lane, m)
    put(m, Slot.NEXT_CHECK, lane, get(m, Slot.NEXT_CHECK, lane) - get(m, Slot.IMPACTS, lane))
    put(m, Slot.PERIODS_DONE, lane, get(m, Slot.PERIODS_DONE, lane) + 1.0)
    begin_records(lane, sizes, at, m)


@inline_jit
def go_back(lane, sizes, at, m, t):
    """Put a lane back to the end of its last forcing period, at time t."""
    for row in range(2 * row_count(at)):
        put(m, at[LanePart.POSITION] + row, lane, get(m, at[LanePart.ENDED_POSITION] + row, lane))
    put(m, Slot.SIDE, lane, get(m, Slot.ENDED_SIDE, lane))
    put(m, Slot.NOW, lane, t)
    begin_records(lane, sizes, at, m)


@inline_jit
def keep_sample(lane, sizes, at, m, lanes, results):
    """Keep the state at the end of the last forcing period and what happened in it, in place of the oldest sample."""
    own, done = sizes[Size.OWN], int(get(m, Slot.PERIODS_DONE, lane))
    row = results[3][lanes[LaneArray.LABELS][lane, LaneLabel.TRAJECTORY], (done - 1) % sizes[Size.KEPT]]
    for d in range(own):
        row[d], row[own + d] = get(m, at[LanePart.ENDED_POSITION] + d, lane), get(m, at[LanePart.ENDED_VELOCITY] + d, lane)
    for j in range(4):
        row[2 * own + j] = get(m, Slot.ENDED_HIGHEST + j, lane)


@inline_jit
def end_period(lane, sizes, at, m, lanes, results):
    """Keep the state at the end of a forcing period; returns the period after which the trajectory repeats itself, or 0."""
    labels, numbers, states, agreements = lanes[0], lanes[1], lanes[4], lanes[5]  # in the places of `LaneArray`
    if sizes[Size.EVERY_END] > 0:
        keep_sample(lane, sizes, at, m, lanes, results)
    if sizes[Size.SETTLE] == 0:
        return 0
    done, own = int(get(m, Slot.PERIODS_DONE, lane)), sizes[Size.OWN]
    state = states[lane, done % (2 * LONGEST_RECURRENCE)]
    for d in range(own):
        state[d] = get(m, at[LanePart.ENDED_POSITION] + d, lane)
        state[own + d] = get(m, at[LanePart.ENDED_VELOCITY] + d, lane)
    if labels[lane, LaneLabel.MODE] == Mode.CHATTER:
        state[own] = numbers[lane, LaneNumber.CHATTER_SPEED]
    period, agrees = recurrence_period(states[lane], agreements[lane], done, own)
    last = labels[lane, LaneLabel.LAST_PERIOD]
    put(m, Slot.RECORDED_FROM, lane, -np.inf if agrees else first_recorded(last, sizes))
    return period


@inline_jit
def total_up(lane, m):
    """Add the records of a forcing period to those of the whole trajectory."""
    put(m, Slot.OVERALL_IMPACTS, lane, get(m, Slot.OVERALL_IMPACTS, lane) + get(m, Slot.IMPACTS, lane))
    put(m, Slot.OVERALL_HIGHEST, lane, max(get(m, Slot.OVERALL_HIGHEST, lane), get(m, Slot.HIGHEST, lane)))
    put(m, Slot.OVERALL_LOWEST, lane, min(get(m, Slot.OVERALL_LOWEST, lane), get(m, Slot.LOWEST, lane)))
    put(m, Slot.OVERALL_LEAST_SPEED, lane, min(get(m, Slot.OVERALL_LEAST_SPEED, lane), get(m, Slot.LEAST_SPEED, lane)))


@inline_jit
def arrive(lane, past, sizes, at, m, lanes, tables, results):
    """Go on from the end of a forcing period (which the step may have gone `past`), or from a breakpoint of the records.

    Returns DONE, SETTLED, or PAUSED, and the period after which the trajectory repeats itself.
    """
    period, now, start = int(get(m, Slot.PERIOD, lane)), get(m, Slot.NOW, lane), get(m, Slot.PERIOD_START, lane)
    last, t_end = period == lanes[LaneArray.LABELS][lane, LaneLabel.LAST_PERIOD], period_end(lane, m, lanes)
    if now >= t_end:
        done = get(m, Slot.PERIODS_DONE, lane)
        if last and t_end <= start and done > 0.0:  # the last period has no length, so there is nothing to record
            return Status.DONE, 0
        if past:
            put(m, Slot.PERIODS_DONE, lane, done + 1.0)
        else:
            end_here(lane, sizes, at, m)
        recurrence = end_period(lane, sizes, at, m, lanes, results)
        if last:
            return Status.DONE, 0
        if recurrence > 0:
            go_back(lane, sizes, at, m, t_end)
            return Status.SETTLED, recurrence
        put(m, Slot.PERIOD, lane, period + 1.0)
        put(m, Slot.NOW, lane, start + (now - t_end))
        put(m, Slot.LAST_CHECK, lane, get(m, Slot.LAST_CHECK, lane) + (start - t_end))
    begin_period(lane, sizes, m, lanes, tables)
    return Status.PAUSED, 0


@lean_jit
def finish(lane, status, detail, code, sizes, at, m, flags, lanes, results):
    """Write the end of a lane's trajectory into the results, and free the lane."""
    labels = lanes[LaneArray.LABELS]
    state, numbers, ends, _ = results
    i, half = labels[lane, LaneLabel.TRAJECTORY], state.shape[1] // 2
    none = get(m, Slot.PERIODS_DONE, lane) == 0.0
    part = get(m, Slot.NOW, lane) > get(m, Slot.PERIOD_START, lane) or get(m, Slot.IMPACTS, lane) > 0.0 or none
    if part and status != Status.DONE and status != Status.SETTLED and status != Status.OUTSIDE:  # within a forcing period
        end_here(lane, sizes, at, m)
    else:
        total_up(lane, m)
    if get(m, Slot.PERIODS_DONE, lane) > 0.0:
        keep_sample(lane, sizes, at, m, lanes, results)
    for row in range(half):
        state[i, row] = get(m, at[LanePart.POSITION] + row, lane)
        state[i, half + row] = get(m, at[LanePart.VELOCITY] + row, lane)
    numbers[i, EndNumber.TIME] = get(m, Slot.NOW, lane)
    numbers[i, EndNumber.CHATTER_SPEED] = lanes[LaneArray.NUMBERS][lane, LaneNumber.CHATTER_SPEED]
    for j in range(3):
        numbers[i, EndNumber.HIGHEST + j] = get(m, Slot.OVERALL_HIGHEST + j, lane)
    if sizes[Size.COLUMNS] > 0 and labels[lane, LaneLabel.MODE] == Mode.ARC:
        write_rates(lane, i, code, sizes, at, m, numbers)
    ends[i, EndLabel.STATUS], ends[i, EndLabel.DETAIL], ends[i, EndLabel.MODE] = status, detail, labels[lane, LaneLabel.MODE]
    ends[i, EndLabel.SIDE], ends[i, EndLabel.PERIOD] = int(get(m, Slot.SIDE, lane)), int(get(m, Slot.PERIOD, lane))
    ends[i, EndLabel.IMPACTS] = int(get(m, Slot.OVERALL_IMPACTS, lane))
    ends[i, EndLabel.GRAZINGS] = labels[lane, LaneLabel.GRAZINGS]
    ends[i, EndLabel.PERIODS_DONE] = int(get(m, Slot.PERIODS_DONE, lane))
    flags[Flag.BUSY] &= ~(1 << lane)
    flags[Flag.SCALAR] &= ~(1 << lane)


@lean_jit
def write_rates(lane, i, code, sizes, at, m, numbers):
    """Write the accelerations at the end, and the shift of the last event along each column."""
    store(m, Slot.NEW_TIME, load(m, Slot.NOW))
    for row in range(2 * row_count(at)):
        store(m, at[LanePart.NEW_POSITION] + row, load(m, at[LanePart.POSITION] + row))
    code[Code.FIELD](m)
    own = sizes[Size.OWN]
    for row in range(own):
        numbers[i, EndNumber.RATES + row] = get(m, at[LanePart.AFTER_VELOCITY] + row, lane)
    for j in range(sizes[Size.COLUMNS]):
        numbers[i, EndNumber.RATES + own + j] = get(m, at[LanePart.AFTER_POSITION] + j, lane)
