"""A group of lanes that moves many trajectories at once. Each lane has its own time, step, side and parameters, and takes the
next trajectory when its own has ended.

The compiled parts of `kernel/layout.py`, `lane_layout.py`, `one_contact/sides.py`, `lane_steps.py`, `meeting.py`, `sampling.py`,
`one_contact/lane_step.py`, `forcing_periods.py` and this file are one module, compiled once for all models, for the width of
this machine's registers. The functions of a structure, `code`, come through pointers. For models with several contacts there is
a second module with `contacts/lane_step.py` in the place of `one_contact/lane_step.py`.

A step of all lanes computes the Taylor series; the length of the step in each lane; the end of the step and bounds of the gap, by
one sweep of Horner's rule; the root in the lanes whose gap certainly has one; and the impacts. If anything else may happen in the
step of a lane -- rest, slow impacts that may accumulate, a gap that cannot be decided, a limit, a number out of range -- the
scalar kernel moves this lane from the start of the step on (`scalar_handoff.py`). Lanes do not affect one another, so that
results depend neither on the width nor on the order.

A step may go past the end of a forcing period. The state there is then evaluated from the step's series (`sampling.pass_ends`),
and the next period begins: for all lanes at once (`begin_together`), or lane by lane where the end of the period has further
consequences (`forcing_periods.arrive`).

`m` is the lanes' memory, in slots of one vector (`lane_layout.py`). `jobs` and `results` are arrays with a row for each
trajectory. `space` begins with room for two polynomials of one lane.
"""

from __future__ import annotations

import numpy as np

from saltus.flow.kernel.layout import ROUGHER, Mode, Status
from saltus.flow.kernel.memory_layout import LanePart
from saltus.flow.lanes.forcing_periods import arrive, fill, finish, unresolved
from saltus.flow.lanes.function_types import RUN_LANES
from saltus.flow.lanes.lane_layout import (
    Flag,
    Helper,
    JobArray,
    LaneArray,
    LaneLabel,
    LaneSetting,
    Size,
    Slot,
)
from saltus.flow.lanes.lane_steps import step_limits
from saltus.flow.one_contact.lane_step import lane_arrays, lane_space, step_all
from saltus.taylor import (
    ALL,
    WIDTH,
    anchor,
    bits,
    by_reference,
    cached_jit,
    expand_record,
    first_lane,
    get,
    inline_jit,
    lane_count,
    lean_jit,
    load,
    mask,
    own_records,
    put,
    replace,
)

# --- compiled from here on -----------------------------------------------------------------------------------------------


@lean_jit
def expand_records(sizes, at, m, flags, lanes, tables, row):
    """The records' polynomials of every lane, expanded at its time."""
    labels = lanes[LaneArray.LABELS]
    for lane in range(WIDTH):
        if (flags[Flag.BUSY] >> lane) & 1:
            breaks, table = own_records(tables, labels[lane, LaneLabel.TRAJECTORY])
            piece, t = labels[lane, LaneLabel.PIECE], get(m, Slot.NOW, lane) + get(m, Slot.ORIGIN, lane)
            for r in range(sizes[Size.RECORDS]):
                expand_record(table[r, piece], anchor(breaks, piece), t, row)
                for k in range(table.shape[2]):
                    put(m, at[LanePart.RECORDS] + r * table.shape[2] + k, lane, row[k])


@inline_jit
def begin_together(m, free):
    """Begin the next forcing period in lanes whose step went past the end of one, if the next one is as long (compare
    `forcing_periods.arrive`)."""
    going = mask(free)
    begin, end, period = load(m, Slot.PERIOD_START), load(m, Slot.PERIOD_END), load(m, Slot.PERIOD) + 1.0
    replace(m, Slot.NOW, going, begin + (load(m, Slot.NOW) - end))
    replace(m, Slot.LAST_CHECK, going, load(m, Slot.LAST_CHECK) + (begin - end))
    replace(m, Slot.PERIODS_DONE, going, load(m, Slot.PERIODS_DONE) + 1.0)
    replace(m, Slot.ORIGIN, going, period * load(m, Slot.PERIOD_LENGTH))
    replace(m, Slot.PERIOD, going, period)


@lean_jit
def run_with(
    code_of, scalar, helpers_of, sizes, at, settings, m, jobs_of, tables_of, results_of, control, limits, flags, arrays, room
):
    """`run_lanes` with the arrays of `LaneArray`, and room."""
    code, helpers, jobs, tables = by_reference(code_of), by_reference(helpers_of), by_reference(jobs_of), by_reference(tables_of)
    results, lanes, space = by_reference(results_of), by_reference(arrays), by_reference(room)
    count, following = jobs[JobArray.STATES].shape[0], 0
    while True:
        while flags[Flag.BUSY] != ALL and following < count:
            lane = first_lane(~flags[Flag.BUSY])
            fill(lane, following, code, sizes, at, m, flags, lanes, jobs, tables)
            following += 1
            if lanes[LaneArray.LABELS][lane, LaneLabel.MODE] == Mode.BEYOND:
                finish(lane, Status.OUTSIDE, 0, code, sizes, at, m, flags, lanes, results)
        if flags[Flag.BUSY] == 0 or control[0] != 0:
            return
        away, captured, checked, past = 0, 0, 0, 0
        arrived = bits(load(m, Slot.NOW) >= load(m, Slot.PERIOD_END)) & flags[Flag.BUSY]
        if arrived == 0:
            if sizes[Size.RECORDS] > 0:
                expand_records(sizes, at, m, flags, lanes, tables, space[0])
            away = flags[Flag.SCALAR]
            if flags[Flag.BUSY] != flags[Flag.SCALAR]:
                doubtful, captured, past = step_all(
                    code, scalar, sizes, at, m, flags, settings, limits, helpers, lanes, jobs, tables, space
                )
                away |= doubtful
                free = past & bits(load(m, Slot.PERIOD) < load(m, Slot.PASSED_TOGETHER))
                if free:
                    begin_together(m, free)
                    control[1] += lane_count(free)
                    past &= ~free
            checked = bits(load(m, Slot.IMPACTS) > load(m, Slot.NEXT_CHECK)) & flags[Flag.BUSY] & ~past
            arrived = bits(load(m, Slot.NOW) >= load(m, Slot.PERIOD_END)) & flags[Flag.BUSY]
        concerned = away | captured | checked | arrived
        while concerned:
            lane = first_lane(concerned)
            concerned &= concerned - 1
            status, detail = Status.PAUSED, 0
            # This check comes first, as lanes with slow impacts need the scalar kernel in every step.
            if (checked >> lane) & 1 and unresolved(lane, sizes, m):
                status = Status.UNRESOLVED
            elif (away >> lane) & 1:
                scalar_motion, parameters = helpers[Helper.SCALAR_MOTION], jobs[JobArray.PARAMETERS]
                status, detail = scalar_motion(
                    lane, scalar, sizes, at, m, flags, settings, lanes, parameters, tables, space[0], control
                )
            if status == Status.PAUSED and get(m, Slot.NOW, lane) >= get(m, Slot.PERIOD_END, lane):
                before = get(m, Slot.PERIODS_DONE, lane)
                status, detail = arrive(lane, (past >> lane) & 1, sizes, at, m, lanes, tables, results)
                control[1] += int(get(m, Slot.PERIODS_DONE, lane) - before)
            if status == Status.PAUSED and (captured >> lane) & 1:
                status = Status.CAPTURED
            if status != Status.PAUSED:
                finish(lane, status, detail, code, sizes, at, m, flags, lanes, results)


@cached_jit(RUN_LANES, nogil=True)
def run_lanes(code, scalar, helpers, sizes, at, settings, m, jobs, tables, results, control):
    """Run all jobs. `control` = [whether to stop, forcing periods done so far]."""
    tol = settings[LaneSetting.TOLERANCE]
    limits = step_limits(sizes[Size.ORDER], tol), step_limits(sizes[Size.ORDER], ROUGHER * tol)
    lanes, flags, space = lane_arrays(sizes, at), np.zeros(3, dtype=np.int64), lane_space(sizes, at)
    run_with(code, scalar, helpers, sizes, at, settings, m, jobs, tables, results, control, limits, flags, lanes, space)
