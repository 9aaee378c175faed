"""A group of lanes that moves many trajectories at once. Each lane has its own time, step, side and
parameters, and takes the next trajectory when its own has ended.

The compiled parts of `kernel/layout.py`, `memory.py`, `lane_steps.py`, `sampling.py`,
`one_contact/lane_step.py`, `forcing_periods.py` and this file are one module, compiled once for all
models, for the width of this machine's registers. The functions of a structure, `code`, come
through pointers. For models with several contacts there is a second module with
`contacts/lane_step.py` in the place of `one_contact/lane_step.py`.

A step of all lanes computes the Taylor series; the length of the step in each lane; the end of the
step and bounds of the gap, by one sweep of Horner's rule; the root in the lanes whose gap certainly
has one; and the impacts. If anything else may happen in the step of a lane, the scalar kernel moves
this lane from the start of the step on (`handoff.py`). Such are rest, slow impacts that may
accumulate, a gap that cannot be decided, a limit, and a number out of range. Lanes do not affect
one another, so that results depend neither on the width nor on the order.

A step may go past the end of a forcing period. The state there is then evaluated from the step's
series (`sampling.pass_ends`), and the next period begins: for all lanes at once (`begin_together`),
or lane by lane where the end of the period has further consequences (`forcing_periods.arrive`).

`lanes` is the group with all of its memory, and `lane` one of its lanes (`memory.py`).
"""

from __future__ import annotations

from saltus.flow.kernel.layout import Mode, Status
from saltus.flow.lane_steps.function_types import RUN_LANES, shared
from saltus.flow.lane_steps.memory import Control, is_over
from saltus.flow.one_contact.lane_step import step_all
from saltus.flow.programs.forcing_periods import arrive, fill, finish, records_of, unresolved
from saltus.taylor import cached_jit, inline_jit, lean_jit
from saltus.taylor.lane_memory import one
from saltus.taylor.lane_vectors import ALL, bits, first_lane, lane_count, mask, select
from saltus.taylor.load_tables import anchor, expand_record
from saltus.taylor.vectors import WIDTH

# --- compiled from here on ---------------------------------------------------


@lean_jit
def expand_records(lanes):
    """The records' polynomials of every lane, expanded at its time."""
    row = lanes.polynomial
    for i in range(WIDTH):
        if (lanes.busy >> i) & 1:
            lane = one(lanes, i)
            breaks, table = records_of(lane, lane.trajectory)
            piece = lane.piece
            t = lane.now + lane.origin
            for r in range(lane.sizes.records):
                expand_record(table[r, piece], anchor(breaks, piece), t, row)
                for k in range(table.shape[2]):
                    lane.records[r * table.shape[2] + k] = row[k]


@inline_jit
def begin_together(lanes, free):
    """Begin the next forcing period in lanes whose step went past the end of one, if the next one
    is as long (compare `forcing_periods.arrive`)."""
    going = mask(free)
    begin = lanes.period_start
    end = lanes.period_end
    period = lanes.period + 1.0
    lanes.now = select(going, begin + (lanes.now - end), lanes.now)
    lanes.last_check = select(going, lanes.last_check + (begin - end), lanes.last_check)
    lanes.periods_done = select(going, lanes.periods_done + 1.0, lanes.periods_done)
    lanes.origin = select(going, period * lanes.period_length, lanes.origin)
    lanes.period = select(going, period, lanes.period)


@lean_jit
def fill_all(lanes, following):
    """Put trajectories into all lanes that are free, from number `following` on; returns the number
    of the next one.
    """
    while lanes.busy != ALL and following < lanes.work.jobs.size:
        lane = one(lanes, first_lane(~lanes.busy))
        fill(lane, following)
        following += 1
        if lane.mode == Mode.BEYOND:
            finish(lane, Status.OUTSIDE, 0)
    return following


@inline_jit
def go_on(lane, away, captured, checked, past):
    """Go on in one lane after a step of all lanes; the arguments say whether the scalar kernel
    moves it, and whether it is captured. They also say whether its number of impacts is checked,
    and whether the step went past the end of its forcing period."""
    status = Status.PAUSED
    detail = 0
    control = lane.work.control
    # This check comes first, as lanes with slow impacts need the scalar kernel in every step.
    if checked and unresolved(lane):
        status = Status.UNRESOLVED
    elif away:
        control[Control.CALLS] += 1
        scalar_motion = lane.helpers.scalar_motion
        status, detail = scalar_motion(lane)
    if status == Status.PAUSED and lane.now >= lane.period_end:
        before = lane.periods_done
        status, detail = arrive(lane, past)
        control[Control.PERIODS] += int(lane.periods_done - before)
    if status == Status.PAUSED and captured:
        status = Status.CAPTURED
    if status != Status.PAUSED:
        finish(lane, status, detail)


@lean_jit
def run_all(lanes, following):
    """Run the jobs of a group from number `following` on, and those that are in its lanes."""
    control = lanes.work.control
    while True:
        following = fill_all(lanes, following)
        if lanes.busy == 0 or is_over(control):
            return
        away = 0
        captured = 0
        checked = 0
        past = 0
        arrived = bits(lanes.now >= lanes.period_end) & lanes.busy
        if arrived == 0:
            if lanes.sizes.records > 0:
                expand_records(lanes)
            away = lanes.scalar
            if lanes.busy != lanes.scalar:
                doubtful, captured, past = step_all(lanes)
                away |= doubtful
                free = past & bits(lanes.period < lanes.passed_together)
                if free:
                    begin_together(lanes, free)
                    control[Control.PERIODS] += lane_count(free)
                    past &= ~free
            checked = bits(lanes.impacts > lanes.next_check) & lanes.busy & ~past
            arrived = bits(lanes.now >= lanes.period_end) & lanes.busy
        concerned = away | captured | checked | arrived
        while concerned:
            i = first_lane(concerned)
            concerned &= concerned - 1
            go_on(one(lanes, i), away >> i & 1, captured >> i & 1, checked >> i & 1, past >> i & 1)


@cached_jit(RUN_LANES, nogil=True)
def run_lanes(group):
    """Run all jobs of a group, a tuple `LaneGroup` (`memory.py`)."""
    run_all(shared(group), 0)
