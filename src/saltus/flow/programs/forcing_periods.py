"""A trajectory in its lane: its start, its way from one forcing period to the next, and its end.

Its compiled part goes into one module with that of `driver.py`.
"""

from __future__ import annotations

import math

import numpy as np

from saltus.flow.kernel.layout import Mode, Status
from saltus.flow.lane_steps.memory import BURST, LONGEST_RECURRENCE, MOST_IMPACTS, natural_time_of
from saltus.flow.lane_steps.sampling import recurrence_period
from saltus.flow.one_contact.lane_step import begin_contact, side_at_end
from saltus.taylor import inline_jit, lean_jit

# --- compiled from here on ---------------------------------------------------


@lean_jit
def fill(lane, trajectory):
    """Put a trajectory into a lane."""
    work = lane.work
    i = lane.index
    agreements = lane.agreements
    job = work.jobs[trajectory]
    parameters = work.parameters[trajectory]
    state = work.states[trajectory]
    lane.trajectory, lane.last_period, lane.leave_by, lane.piece = (
        trajectory,
        job.last_period,
        job.leave_by,
        job.piece,
    )
    lane.held = lane.skip = lane.grazings = 0
    lane.end_time, lane.chatter_speed = job.end_time, 0.0
    for k in range(agreements.shape[1]):
        agreements[i, k] = 0
    breaks, table = records_of(lane, trajectory)
    constants = lane.constants_of[i]
    half = state.size // 2
    constants_of = lane.code.constants
    constants_of(parameters, constants)
    put_all(lane.position, state[:half])
    put_all(lane.velocity, state[half:])
    put_all(lane.parameters, parameters)
    put_all(lane.constants, constants)
    begin_time(lane, job)
    begin_overall(lane)
    begin_records(lane)
    mode, side = begin_contact(lane, (parameters, constants, breaks, table), state)
    lane.mode = mode
    lane.side = float(side)
    bit = 1 << i
    lane.busy |= bit
    lane.at_contact &= ~bit
    lane.scalar = lane.scalar & ~bit if mode == Mode.ARC else lane.scalar | bit
    begin_period(lane)


@lean_jit
def records_of(lane, trajectory):
    """`own_records` for functions that count no references."""
    breaks, table = lane.work.tables
    i = min(trajectory, breaks.shape[0] - 1)
    return breaks[i], table[i]


@lean_jit
def put_all(slots, values):
    """Put numbers into the slots of one lane."""
    for j in range(values.size):
        slots[j] = values[j]


@inline_jit
def impacts_between_checks(lane):
    """The number of impacts between two checks whether there are too many."""
    return BURST if lane.sizes.contacts > 0 else MOST_IMPACTS


@inline_jit
def begin_time(lane, job):
    """Set the forcing period and the time at which a trajectory starts, and its first step."""
    lane.now = lane.period_start = lane.last_check = job.start_time
    lane.period_length, lane.capture_speed = job.period_length, job.capture_speed
    lane.period = float(job.first_period)
    lane.periods_done = 0.0
    lane.step_share = 1.0
    lane.pull = lane.fastest = 0.0
    lane.next_check = impacts_between_checks(lane)
    lane.recorded_from = first_recorded(lane)


@inline_jit
def first_recorded(lane):
    """The first forcing period in which extrema are recorded, if the motion goes on up to its last
    one.

    It is one before those that are kept, because a step that goes past its end already belongs to
    the next one; and one more, as the last period may have no length.
    """
    return -np.inf if lane.sizes.from_start > 0 else lane.last_period - lane.sizes.kept - 1.0


@inline_jit
def begin_overall(lane):
    """Begin the records of the whole trajectory."""
    lane.overall_highest = -np.inf
    lane.overall_lowest = np.inf
    lane.overall_least_speed = np.inf
    lane.overall_impacts = 0.0


@inline_jit
def begin_records(lane):
    """Begin the records of a forcing period, with the positions at its beginning."""
    high = low = lane.position[0]
    for row in range(1, lane.sizes.own):
        x = lane.position[row]
        high, low = max(high, x), min(low, x)
    lane.highest = high
    lane.lowest = low
    lane.least_speed = np.inf
    lane.impacts = 0.0


@lean_jit
def unresolved(lane):
    """Whether there were more than MOST_IMPACTS in a natural time since the last check."""
    many = impacts_between_checks(lane)
    now = lane.now
    span = natural_time_of(lane)
    if not span > 0.0:  # as in `steps.time_scale`
        span = lane.fastest / lane.pull if lane.pull > 0.0 else 0.0
    since = lane.last_check
    lane.last_check = now
    lane.next_check += many
    return now - since < span * many / MOST_IMPACTS


@inline_jit
def end_of_period(lane):
    """The local time at which a forcing period of a trajectory ends: one period after it began, or
    with the motion.
    """
    if int(lane.period) == lane.last_period:
        return lane.end_time
    return lane.period_start + lane.period_length


@inline_jit
def begin_period(lane):
    """Set the end of a lane's forcing period, and the time beyond which no step goes.

    This time is one period after the end, so that a step may go past the end; it is the end itself
    if the motion ends in this period or the next. Both are at most the next breakpoint of the
    load's records.
    """
    breaks = lane.work.tables[
        0
    ]  # indexed with `own`: a row as an array of its own would need a locked instruction to count references
    own = min(lane.trajectory, breaks.shape[0] - 1)
    period = int(lane.period)
    last = lane.last_period
    length = lane.period_length
    origin = period * length
    end = end_of_period(lane)
    limit = end + length if period + 1 < last else end
    piece = lane.piece
    # of shares of the period, or of times
    unit, before = (length, 0.0) if lane.sizes.repeats > 0 else (1.0, origin)
    while piece < breaks.shape[1] and breaks[own, piece] * unit - before <= lane.now:
        piece += 1
    lane.piece = piece
    each = piece < breaks.shape[1] or lane.sizes.every_end > 0
    lane.passed_together = -np.inf if each else float(last - 2)
    if piece < breaks.shape[1]:
        limit = min(limit, breaks[own, piece] * unit - before)
    lane.origin = origin
    lane.period_end = min(end, limit)
    lane.step_limit = limit


@inline_jit
def end_here(lane):
    """End the forcing period of a lane at its present state (compare `sampling.pass_ends`)."""
    for row in range(2 * lane.sizes.rows):  # the slots of velocities follow those of positions
        lane.ended_position[row] = lane.position[row]
    lane.ended_side = lane.side
    lane.ended_highest, lane.ended_lowest = lane.highest, lane.lowest
    lane.ended_least_speed, lane.ended_impacts = lane.least_speed, lane.impacts
    total_up(lane)
    lane.next_check -= lane.impacts
    lane.periods_done += 1.0
    begin_records(lane)


@inline_jit
def go_back(lane, t):
    """Put a lane back to the end of its last forcing period, at time t."""
    for row in range(2 * lane.sizes.rows):
        lane.position[row] = lane.ended_position[row]
    lane.side = lane.ended_side
    lane.now = t
    begin_records(lane)


@inline_jit
def keep_sample(lane):
    """Keep the state at the end of the last forcing period and what happened in it, in place of the
    oldest sample.
    """
    own = lane.sizes.own
    done = int(lane.periods_done)
    row = lane.work.samples[lane.trajectory, (done - 1) % lane.sizes.kept]
    for d in range(own):
        row[d], row[own + d] = lane.ended_position[d], lane.ended_velocity[d]
    row[2 * own] = lane.ended_highest
    row[2 * own + 1] = lane.ended_lowest
    row[2 * own + 2] = lane.ended_least_speed
    row[2 * own + 3] = lane.ended_impacts


@inline_jit
def end_period(lane):
    """Keep the state at the end of a forcing period; returns the period after which the trajectory
    repeats itself, or 0.
    """
    states = lane.stroboscopic[lane.index]
    agreements = lane.agreements[lane.index]
    if lane.sizes.every_end > 0:
        keep_sample(lane)
    if lane.sizes.settle == 0:
        return 0
    done = int(lane.periods_done)
    own = lane.sizes.own
    state = states[done % (2 * LONGEST_RECURRENCE)]
    for d in range(own):
        state[d] = lane.ended_position[d]
        state[own + d] = lane.ended_velocity[d]
    if lane.mode == Mode.CHATTER:
        state[own] = lane.chatter_speed
    length = lane.settings.natural_length
    speed = length * (2.0 * math.pi / lane.period_length) if lane.period_length > 0.0 else length
    period, agrees = recurrence_period(states, agreements, done, own, length, speed)
    lane.recorded_from = -np.inf if agrees else first_recorded(lane)
    return period


@inline_jit
def total_up(lane):
    """Add the records of a forcing period to those of the whole trajectory."""
    lane.overall_impacts += lane.impacts
    lane.overall_highest = max(lane.overall_highest, lane.highest)
    lane.overall_lowest = min(lane.overall_lowest, lane.lowest)
    lane.overall_least_speed = min(lane.overall_least_speed, lane.least_speed)


@inline_jit
def arrive(lane, past):
    """Go on from the end of a forcing period (which the step may have gone `past`), or from a
    breakpoint of the records.

    Returns DONE, SETTLED, or PAUSED, and the period after which the trajectory repeats itself.
    """
    period = int(lane.period)
    now = lane.now
    start = lane.period_start
    last = period == lane.last_period
    t_end = end_of_period(lane)
    if now >= t_end:
        done = lane.periods_done
        # the last period has no length, so there is nothing to record
        if last and t_end <= start and done > 0.0:
            return Status.DONE, 0
        if past:
            lane.periods_done = done + 1.0
        else:
            end_here(lane)
        recurrence = end_period(lane)
        if last:
            return Status.DONE, 0
        if recurrence > 0:
            go_back(lane, t_end)
            return Status.SETTLED, recurrence
        lane.period = period + 1.0
        lane.now = start + (now - t_end)
        lane.last_check += start - t_end
        if lane.sizes.repeats > 0:
            lane.piece = 0
    begin_period(lane)
    return Status.PAUSED, 0


@lean_jit
def finish(lane, status, detail):
    """Write the end of a lane's trajectory into the results, and free the lane."""
    last = lane.work.last[lane.trajectory]
    end = lane.work.ends[lane.trajectory]
    bit = 1 << lane.index
    none = lane.periods_done == 0.0
    half = last.size // 2
    part = lane.now > lane.period_start or lane.impacts > 0.0 or none
    # within a forcing period
    if part and status != Status.DONE and status != Status.SETTLED and status != Status.OUTSIDE:
        end_here(lane)
    else:
        total_up(lane)
    if lane.periods_done > 0.0:
        keep_sample(lane)
    for row in range(half):
        last[row], last[half + row] = lane.position[row], lane.velocity[row]
    end.time, end.chatter_speed = lane.now, lane.chatter_speed
    end.highest = lane.overall_highest
    end.lowest = lane.overall_lowest
    end.least_speed = lane.overall_least_speed
    if lane.sizes.columns > 0 and lane.mode == Mode.ARC:
        write_rates(lane)
    end.status, end.detail, end.mode, end.grazings = status, detail, lane.mode, lane.grazings
    end.side, end.period = side_at_end(lane), int(lane.period)
    end.impacts, end.periods_done = int(lane.overall_impacts), int(lane.periods_done)
    lane.busy &= ~bit
    lane.scalar &= ~bit


@lean_jit
def write_rates(lane):
    """Write the accelerations at the end, and the shift of the last event along each column."""
    own = lane.sizes.own
    rates = lane.work.rates[lane.trajectory]
    lanes = lane.lanes
    field = lane.code.field
    lanes.new_time = lanes.now
    for row in range(2 * lane.sizes.rows):
        lanes.new_position[row] = lanes.position[row]
    field(lane.memory, lane.places)
    for row in range(own):
        rates[row] = lane.after_velocity[row]
    for j in range(lane.sizes.columns):
        rates[own + j] = lane.after_position[j]
