"""Many trajectories at once: a group of lanes, each with its own time, step, side and parameters, refilled as they end.

The compiled parts of `kernel_layout.py`, `lane_layout.py`, `contact_side.py`, `lane_steps.py`, `sampling.py`,
`forcing_periods.py` and this file are one module, compiled once for all models, for the width of this machine's registers. The
functions of a structure, `code`, come through pointers.

A step of all lanes: Taylor series; a step for each lane; a sweep of Horner's rule that gives the end of the step and bounds the
gap; the root in the lanes whose gap has one for certain; impacts. A lane whose step shows anything else -- rest, slow impacts,
a gap that cannot be decided, a limit, a number out of range -- is moved by the scalar kernel (`scalar_handoff.py`)
from the start of that step. No lane sees another one, so results depend neither on the width nor on the order.

A step may go past the end of a forcing period: the state there is then read off its series (`sampling.pass_ends`), and the next
period begins, for all lanes at once (`begin_together`) or for those that are waited for (`forcing_periods.arrive`).

`m` is the lanes' memory, in slots of one vector (`lane_layout.py`). `jobs` and `results` are arrays with a row for each
trajectory. `space` = (poly, series) is room for two polynomials of one lane.
"""

from __future__ import annotations

import numpy as np

from saltus.flow.ensemble.forcing_periods import arrive, fill, finish, unresolved
from saltus.flow.ensemble.function_types import RUN_LANES
from saltus.flow.ensemble.lane_layout import (
    TOUCH,
    Code,
    Flag,
    Helper,
    JobArray,
    LaneArray,
    LaneLabel,
    LaneSetting,
    Size,
    Slot,
)
from saltus.flow.ensemble.lane_steps import (
    both_at,
    lane_value,
    margins_certain,
    natural_step,
    only_root,
    row_count,
    series_true,
    shape,
    step_limits,
    sweep,
)
from saltus.flow.ensemble.sampling import LONGEST_RECURRENCE, pass_ends, record_range
from saltus.flow.kernel_layout import ROUGHER, Mode, Status
from saltus.flow.memory_layout import SERIES_LENGTH, LanePart
from saltus.taylor import (
    ALL,
    WIDTH,
    absolute,
    anchor,
    bits,
    expand_record,
    first_lane,
    get,
    inline_jit,
    jit,
    lane_count,
    lean_jit,
    load,
    mask,
    minimum,
    put,
    replace,
    select,
    splat,
    store,
    vector_lane,
    with_lane,
)
from saltus.taylor import not_here as cached_jit

# --- compiled from here on -----------------------------------------------------------------------------------------------

FAST = 1e300  # A state beyond this has left the range of numbers.


@lean_jit
def expand_records(sizes, at, m, flags, lanes, tables, row):
    """The records' polynomials of every lane, expanded at its time."""
    labels, (breaks, table) = lanes[LaneArray.LABELS], tables
    for lane in range(WIDTH):
        if (flags[Flag.BUSY] >> lane) & 1:
            piece, t = labels[lane, LaneLabel.PIECE], get(m, Slot.NOW, lane) + get(m, Slot.ORIGIN, lane)
            for r in range(sizes[Size.RECORDS]):
                expand_record(table[r, piece], anchor(breaks, piece), t, row)
                for k in range(table.shape[2]):
                    put(m, at[LanePart.RECORDS] + r * table.shape[2] + k, lane, row[k])


@inline_jit
def propose(code, sizes, at, m, flags, settings, limits, helpers, space):
    """The step of every lane up to its first contact, put at NEW_*.

    Returns (bits that hit, bits for the scalar kernel, h, tau, bend).
    """
    order = sizes[Size.ORDER]
    code[Code.SERIES](m, order)
    natural, size = natural_step(m, at, sizes, limits)
    now, limit = load(m, Slot.NOW), load(m, Slot.STEP_LIMIT)
    h = minimum(natural, limit - now)
    alive = flags[Flag.BUSY] & ~flags[Flag.SCALAR]
    sound = bits(natural > settings[LaneSetting.SHORTEST_STEP]) & bits(size < FAST)
    contact = load(m, Slot.CONTACT)
    start = load(m, at[LanePart.POSITION]) - contact  # near the contact the gap keeps its digits
    x, v, a, bend = sweep(m, at, order, start, h)
    if sizes[Size.MARGINS] > 0:
        sound &= margins_certain(m, at, sizes, h)
    hit, tau, at_root = 0, h, v
    if sizes[Size.SIDES] > 0:
        end = (x, v, a)
        hit, doubtful, tau, at_root = meet(sizes, at, m, flags, h, start, end, bend, alive & sound, helpers, space)
        sound &= ~doubtful
    impact = mask(hit)
    store(m, Slot.NEW_TIME, select(mask(bits(natural >= limit - now) & ~hit), limit, now + tau))
    store(m, at[LanePart.NEW_POSITION], select(impact, contact, x + contact))
    store(m, at[LanePart.NEW_VELOCITY], select(impact, at_root, v))
    for row in range(1, row_count(at)):
        positions, velocities = at[LanePart.POSITIONS] + row * SERIES_LENGTH, at[LanePart.VELOCITIES] + row * SERIES_LENGTH
        q, w = both_at(m, positions, velocities, order, load(m, positions), tau)
        store(m, at[LanePart.NEW_POSITION] + row, q)
        store(m, at[LanePart.NEW_VELOCITY] + row, w)
    if sizes[Size.CHECKED] > 0:
        sound &= series_true(code, m, at, sizes, settings[LaneSetting.TOLERANCE], tau, size)
    return hit & sound & alive, alive & ~sound, h, tau, bend


@inline_jit
def meet(sizes, at, m, flags, h, start, end, bend, alive, helpers, space):
    """Which of the lanes in `alive` meet the contact within the step, which are in doubt, when, and with what velocity.

    `start` is the position from the contact on at the start of the step, `end` position, velocity and acceleration at its end.
    """
    order, skip = sizes[Size.ORDER], flags[Flag.AT_CONTACT]
    x, v, _ = end
    rate = select(mask(bits(load(m, Slot.SIDE) > 0.0)), load(m, Slot.RATE_UP), load(m, Slot.RATE_DOWN))
    sign = select(mask(bits(rate > 0.0)), splat(1.0), splat(-1.0))  # all that a root depends on
    g0, first = sign * start, at[LanePart.POSITIONS]
    g1, g2 = sign * load(m, first + 1) * h, sign * load(m, first + 2) * (h * h)
    cubic = (g0, g1, g2, sign * load(m, first + 3) * (h * h * h))
    doubtful = ((bits(g0 <= 0.0) & ~skip) | (bits(g1 <= 0.0) & skip)) & alive
    clear, falls, concave, convex = shape(cubic, bend, skip)
    over = bits(sign * x <= 0.0)
    single = concave | (falls & ~skip) | (convex & over)
    hit = alive & ~doubtful & ~clear & single & over
    tau, at_root = h, v
    if hit:
        root, speed = only_root(m, at, order, h, start, sign, cubic, end, hit)
        tau, at_root = select(mask(hit), root, h), select(mask(hit), speed, v)
    unclear = alive & ~doubtful & ~clear & ~single
    for lane in range(WIDTH if unclear else 0):
        if (unclear >> lane) & 1:
            root = scalar_root(at, m, order, lane, h, sign, g0, (skip >> lane) & 1, helpers, space)
            if root == TOUCH:
                doubtful |= 1 << lane
            elif root >= 0.0:
                hit |= 1 << lane
                tau = with_lane(tau, lane, root)
                at_root = with_lane(at_root, lane, lane_value(m, at[LanePart.VELOCITIES], order, lane, root))
    return hit, doubtful, tau, at_root


@inline_jit
def scalar_root(at, m, order, lane, h, sign, g0, skip, helpers, space):
    """The first root of one lane's gap, NO_ROOT or TOUCH, by the scalar kernel's search."""
    step, gap_sign, start = vector_lane(h, lane), vector_lane(sign, lane), vector_lane(g0, lane)
    search = helpers[Helper.FIRST_ROOT]
    return search(m, at[LanePart.POSITIONS], order, lane, step, gap_sign, start, skip, space[0], space[1])


@inline_jit
def reset(code, at, m, settings, hit):
    """Impacts at the new state. Returns (bits that are resolved, bits for the scalar kernel, bits that are captured)."""
    code[Code.IMPACT](m)
    before, after = load(m, at[LanePart.NEW_VELOCITY]), load(m, at[LanePart.AFTER_VELOCITY])
    up, down = load(m, Slot.RATE_UP), load(m, Slot.RATE_DOWN)
    old = select(mask(bits(load(m, Slot.SIDE) > 0.0)), up, down)
    new = select(mask(bits(load(m, Slot.NEW_SIDE) > 0.0)), up, down)
    speed = new * after
    good = bits(old * before < 0.0) & bits(speed > settings[LaneSetting.SLOWEST_IMPACT]) & hit
    captured = bits(speed < load(m, Slot.CAPTURE_SPEED)) & good
    return good, hit & ~good, captured


@inline_jit
def commit(at, m, moved, hit):
    """Make the new state of the lanes in `moved` their state, and what is after an impact that of those in `hit`."""
    going, impact = mask(moved), mask(hit)
    replace(m, Slot.NOW, going, load(m, Slot.NEW_TIME))
    replace(m, Slot.SIDE, impact, load(m, Slot.NEW_SIDE))
    replace(m, Slot.LEAST_SPEED, impact, minimum(load(m, Slot.LEAST_SPEED), absolute(load(m, at[LanePart.NEW_VELOCITY]))))
    replace(m, Slot.IMPACTS, impact, load(m, Slot.IMPACTS) + 1.0)
    for row in range(2 * row_count(at)):  # positions, then velocities, lie one behind the other
        new = select(impact, load(m, at[LanePart.AFTER_POSITION] + row), load(m, at[LanePart.NEW_POSITION] + row))
        replace(m, at[LanePart.POSITION] + row, going, new)


@inline_jit
def begin_together(m, free):
    """Begin the next forcing period in lanes that are past the end of one, where it is as long (see `forcing_periods.arrive`)."""
    going = mask(free)
    begin, end, period = load(m, Slot.PERIOD_START), load(m, Slot.PERIOD_END), load(m, Slot.PERIOD) + 1.0
    replace(m, Slot.NOW, going, begin + (load(m, Slot.NOW) - end))
    replace(m, Slot.LAST_CHECK, going, load(m, Slot.LAST_CHECK) + (begin - end))
    replace(m, Slot.PERIODS_DONE, going, load(m, Slot.PERIODS_DONE) + 1.0)
    replace(m, Slot.ORIGIN, going, period * load(m, Slot.PERIOD_LENGTH))
    replace(m, Slot.PERIOD, going, period)


@inline_jit
def step_all(code, sizes, at, m, flags, settings, limits, helpers, space):
    """One step of all lanes. Returns bits for the scalar kernel, bits captured, and bits past the end of their forcing period."""
    hit, scalar, h, tau, bend = propose(code, sizes, at, m, flags, settings, limits, helpers, space)
    captured = 0
    resolved = hit
    if hit:
        resolved, doubtful, captured = reset(code, at, m, settings, hit)
        scalar |= doubtful
    moved = flags[Flag.BUSY] & ~flags[Flag.SCALAR] & ~scalar
    begin, v_begin = splat(0.0), load(m, at[LanePart.VELOCITY])
    past = moved & bits(load(m, Slot.NEW_TIME) > load(m, Slot.PERIOD_END))
    if past and sizes[Size.ENDS_ASKED] > 0:
        pass_ends(m, at, sizes, h, bend, past, helpers, space[0], space[1])
        begin = select(mask(past), load(m, Slot.PERIOD_END) - load(m, Slot.NOW), begin)
        v_begin = select(mask(past), load(m, at[LanePart.ENDED_VELOCITY]), v_begin)
    if sizes[Size.EXTREMA] > 0:
        x, v = load(m, at[LanePart.NEW_POSITION]), load(m, at[LanePart.NEW_VELOCITY])
        record_range(m, at, sizes, h, bend, begin, v_begin, tau, x, v, moved, helpers, space[0], space[1])
    commit(at, m, moved, resolved)
    flags[Flag.AT_CONTACT] = (flags[Flag.AT_CONTACT] & ~moved) | resolved
    return scalar, captured, past


@jit
def lane_arrays(sizes, at):
    """Arrays with a row for each lane, in the places of `LaneArray`."""
    return (
        np.zeros((WIDTH, 8), dtype=np.int64),
        np.zeros((WIDTH, 2)),
        np.zeros((WIDTH, at[LanePart.RECORDS] - at[LanePart.CONSTANTS])),
        np.zeros((WIDTH, 3)),
        np.zeros((WIDTH, 2 * LONGEST_RECURRENCE, 2 * sizes[Size.OWN])),
        np.zeros((WIDTH, LONGEST_RECURRENCE + 1), dtype=np.int64),
    )


@cached_jit(RUN_LANES, nogil=True)
def run_lanes(code, scalar, helpers, sizes, at, settings, m, jobs, tables, results, control):
    """Run all jobs. `control` = [whether to stop, forcing periods done so far]."""
    tol = settings[LaneSetting.TOLERANCE]
    limits = step_limits(sizes[Size.ORDER], tol), step_limits(sizes[Size.ORDER], ROUGHER * tol)
    lanes, flags = lane_arrays(sizes, at), np.zeros(3, dtype=np.int64)
    count, following = jobs[JobArray.STATES].shape[0], 0
    space = (np.zeros(SERIES_LENGTH + 2), np.zeros(SERIES_LENGTH + 2))
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
                doubtful, captured, past = step_all(code, sizes, at, m, flags, settings, limits, helpers, space)
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
            if (checked >> lane) & 1 and unresolved(lane, m):  # first, as slow impacts need the scalar kernel in every step
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
