"""Many trajectories at once: a group of lanes, each with its own time, step, side and parameters, refilled as they end.

The texts of `layout.py`, `steps.py`, `observe.py`, `legs.py` and this file are compiled as one, with two of `flow`,
once for every model, for the width of this machine's registers. What a structure adds, `code`, comes through
pointers: `lane_series`, `lane_impact`, `lane_field` (see `lane_functions.py`), and the scalar `constants` and `geometry`.

A step of all lanes: Taylor series; a step for each lane; a sweep of Horner's rule that gives the end of the step and bounds the
gap; the root in the lanes whose gap has one for certain; impacts. A lane whose step shows anything else -- rest, slow impacts,
a gap that cannot be decided, a limit, a number out of range -- visits the scalar kernel (`visits.py`)
from the start of that step. No lane sees another one, so results depend neither on the width nor on the order.

A step may go past the end of a forcing period: the state there is then read off its series (`observe.pass_ends`), and the next
period begins, for all lanes at once (`pass_on`) or for those that are waited for (`legs.arrive`).

`m` is the lanes' memory, in slots of one vector (`layout.py`). `jobs` and `results` are arrays with a row for each
trajectory. `flags` holds bits of lanes: see `layout.py`.
"""

from __future__ import annotations

import numpy as np

from saltus.flow.ensemble.forcing_periods import arrive, fill, finish, unresolved
from saltus.flow.ensemble.function_types import RUN_LANES
from saltus.flow.ensemble.lane_layout import (
    AFTER_POSITION,
    AFTER_VELOCITY,
    AT_CONTACT,
    AWAKE,
    BENDS,
    BEYOND,
    CAPTURE,
    CAPTURED,
    CONSTANTS_AT,
    ENDED_VELOCITY,
    ENDS_ASKED,
    FREE_LEGS,
    GAUGES,
    IMPACT_CODE,
    IMPACT_COUNT,
    LANE_LABELS,
    LANE_ORDER,
    LAST_LOOK,
    LEAST,
    LEG,
    LEG_LENGTH,
    LEG_START,
    LEGS_DONE,
    MODE_NOW,
    MODEL_ROWS,
    NEW_POSITION,
    NEW_SIDE,
    NEW_TIME,
    NEW_VELOCITY,
    NEXT_LOOK,
    NOW,
    ORIGIN,
    OUTSIDE,
    PARKED,
    PIECE_NOW,
    POINT,
    POSITION,
    POSITIONS,
    RATE_DOWN,
    RATE_UP,
    RECORD_ROWS,
    RECORDS,
    ROOT_ALONE,
    SERIES_CODE,
    SHORTEST_STEP,
    SIDE_NOW,
    SIDED,
    SLOWEST_IMPACT,
    STOP_ROWS,
    STRIDE,
    TARGET,
    TOUCH,
    UNRESOLVED,
    VELOCITIES,
    VELOCITY,
    VISIT_ALONE,
    WALL,
    WATCH,
)
from saltus.flow.ensemble.lane_steps import (
    both_at,
    lane_value,
    margins_certain,
    natural_step,
    only_root,
    series_true,
    shape,
    sizes_rows,
    step_limits,
    sweep,
)
from saltus.flow.ensemble.sampling import LONGEST_CYCLE, pass_ends, watch_range
from saltus.flow.kernel_layout import PAUSED, ROUGHER, TOLERANCE
from saltus.taylor import (
    ALL,
    WIDTH,
    absolute,
    anchor,
    bits,
    expand_record,
    first_lane,
    inline_jit,
    lane_count,
    lean_jit,
    load,
    mask,
    minimum,
    select,
    splat,
    store,
    vector_lane,
    with_lane,
)
from saltus.taylor import not_here as cached_jit

# --- compiled from here on -----------------------------------------------------------------------------------------------

FAST = 1e300  # a state beyond this has left the range of numbers


@lean_jit
def expand_records(sizes, at, m, flags, lanes, tables, row):
    """The records' pieces of every lane, expanded at its time."""
    where, (breaks, table) = lanes[0], tables
    for lane in range(WIDTH):
        if (flags[AWAKE] >> lane) & 1:
            piece, t = where[lane, PIECE_NOW], m[NOW * WIDTH + lane] + m[ORIGIN * WIDTH + lane]
            for r in range(sizes[RECORD_ROWS]):
                expand_record(table[r, piece], anchor(breaks, piece), t, row)
                for k in range(table.shape[2]):
                    m[(at[RECORDS] + r * table.shape[2] + k) * WIDTH + lane] = row[k]


@inline_jit
def propose(code, sizes, at, m, flags, settings, limits, helpers, poly, gap):
    """The step of every lane up to its first contact, put at NEW_*. Returns (bits that hit, bits to visit, h, tau, bend)."""
    order, tol = sizes[LANE_ORDER], settings[TOLERANCE]
    code[SERIES_CODE](m, order)
    natural, size = natural_step(m, at, sizes, limits)
    now, wall = load(m, NOW), load(m, WALL)
    h = minimum(natural, wall - now)
    alive = flags[AWAKE] & ~flags[PARKED]
    sound = bits(natural > settings[SHORTEST_STEP]) & bits(size < FAST)
    point = load(m, POINT)
    start = load(m, at[POSITION]) - point  # counted from the contact: near it the gap keeps its digits
    x, v, a, bend = sweep(m, at, order, start, h)
    if sizes[STOP_ROWS] > 0:
        sound &= margins_certain(m, at, sizes, h)
    hit, tau, at_root = 0, h, v
    if sizes[SIDED] > 0:
        hit, doubtful, tau, at_root = meet(sizes, at, m, flags, h, start, x, v, a, bend, alive & sound, helpers, poly, gap)
        sound &= ~doubtful
    struck = mask(hit)
    store(m, NEW_TIME, select(mask(bits(natural >= wall - now) & ~hit), wall, now + tau))
    store(m, at[NEW_POSITION], select(struck, point, x + point))
    store(m, at[NEW_VELOCITY], select(struck, at_root, v))
    for row in range(1, sizes_rows(at)):
        series = at[POSITIONS] + row * STRIDE
        q, w = both_at(m, series, at[VELOCITIES] + row * STRIDE, order, load(m, series), tau)
        store(m, at[NEW_POSITION] + row, q)
        store(m, at[NEW_VELOCITY] + row, w)
    if sizes[BENDS] > 0:
        sound &= series_true(code, m, at, sizes, tol, tau, size)
    return hit & sound & alive, alive & ~sound, h, tau, bend


@inline_jit
def meet(sizes, at, m, flags, h, start, x, v, a, bend, alive, helpers, poly, gap):
    """Which of the lanes in `alive` meet the contact within the step, which are in doubt, and when."""
    order, skip = sizes[LANE_ORDER], flags[AT_CONTACT]
    rate = select(mask(bits(load(m, SIDE_NOW) > 0.0)), load(m, RATE_UP), load(m, RATE_DOWN))
    sign = select(mask(bits(rate > 0.0)), splat(1.0), splat(-1.0))  # all that a root depends on
    g0 = sign * start
    g1, g2 = sign * load(m, at[POSITIONS] + 1) * h, sign * load(m, at[POSITIONS] + 2) * (h * h)
    g3 = sign * load(m, at[POSITIONS] + 3) * (h * h * h)
    doubtful = ((bits(g0 <= 0.0) & ~skip) | (bits(g1 <= 0.0) & skip)) & alive
    clear, falls, concave, convex = shape(g0, g1, g2, g3, bend, skip)
    over = bits(sign * x <= 0.0)
    single = concave | (falls & ~skip) | (convex & over)
    hit = alive & ~doubtful & ~clear & single & over
    tau, at_root = h, v
    if hit:
        root, speed = only_root(m, at, order, h, start, sign, g0, g1, g2, g3, x, v, a, hit)
        tau, at_root = select(mask(hit), root, h), select(mask(hit), speed, v)
    unclear = alive & ~doubtful & ~clear & ~single
    if unclear:
        for lane in range(WIDTH):
            if (unclear >> lane) & 1:
                at_start = vector_lane(g0, lane)
                root = helpers[ROOT_ALONE](
                    m,
                    at[POSITIONS],
                    order,
                    lane,
                    vector_lane(h, lane),
                    vector_lane(sign, lane),
                    at_start,
                    (skip >> lane) & 1,
                    poly,
                    gap,
                )
                if root == TOUCH:
                    doubtful |= 1 << lane
                elif root >= 0.0:
                    hit |= 1 << lane
                    tau = with_lane(tau, lane, root)
                    at_root = with_lane(at_root, lane, lane_value(m, at[VELOCITIES], order, lane, root))
    return hit, doubtful, tau, at_root


@inline_jit
def strike(code, sizes, at, m, settings, hit):
    """Impacts at the new state. Returns (bits that went through, bits to visit, bits that are captured)."""
    code[IMPACT_CODE](m)
    before, after = load(m, at[NEW_VELOCITY]), load(m, at[AFTER_VELOCITY])
    up, down = load(m, RATE_UP), load(m, RATE_DOWN)
    old = select(mask(bits(load(m, SIDE_NOW) > 0.0)), up, down)
    new = select(mask(bits(load(m, NEW_SIDE) > 0.0)), up, down)
    speed = new * after
    good = bits(old * before < 0.0) & bits(speed > settings[SLOWEST_IMPACT]) & hit
    captured = bits(speed < load(m, CAPTURE)) & good
    return good, hit & ~good, captured


@inline_jit
def commit(at, m, moved, hit):
    """Make the new state of the lanes in `moved` their state, and what is after an impact that of those in `hit`."""
    going, struck = mask(moved), mask(hit)
    store(m, NOW, select(going, load(m, NEW_TIME), load(m, NOW)))
    store(m, SIDE_NOW, select(struck, load(m, NEW_SIDE), load(m, SIDE_NOW)))
    least, impacts = load(m, LEAST), load(m, IMPACT_COUNT)
    store(m, LEAST, select(struck, minimum(least, absolute(load(m, at[NEW_VELOCITY]))), least))
    store(m, IMPACT_COUNT, select(struck, impacts + 1.0, impacts))
    count = sizes_rows(at)
    for row in range(2 * count):  # positions, then velocities, lie one behind the other
        new = select(struck, load(m, at[AFTER_POSITION] + row), load(m, at[NEW_POSITION] + row))
        store(m, at[POSITION] + row, select(going, new, load(m, at[POSITION] + row)))


@inline_jit
def pass_on(m, free):
    """Begin the next leg in lanes that are past the end of one, where it is as long (compare `legs.arrive`)."""
    going = mask(free)
    now, look, begin, end = load(m, NOW), load(m, LAST_LOOK), load(m, LEG_START), load(m, TARGET)
    leg = load(m, LEG) + 1.0
    store(m, NOW, select(going, begin + (now - end), now))
    store(m, LAST_LOOK, select(going, look + (begin - end), look))
    store(m, LEGS_DONE, select(going, load(m, LEGS_DONE) + 1.0, load(m, LEGS_DONE)))
    store(m, ORIGIN, select(going, leg * load(m, LEG_LENGTH), load(m, ORIGIN)))
    store(m, LEG, select(going, leg, load(m, LEG)))


@inline_jit
def fly(code, sizes, at, m, flags, settings, limits, helpers, poly, gap):
    """One step of all lanes. Returns (bits to visit, bits captured, bits that went past the end of their leg)."""
    hit, away, h, tau, bend = propose(code, sizes, at, m, flags, settings, limits, helpers, poly, gap)
    captured = 0
    new_hit = hit
    if hit:
        new_hit, doubtful, captured = strike(code, sizes, at, m, settings, hit)
        away |= doubtful
    moved = flags[AWAKE] & ~flags[PARKED] & ~away
    begin, v_begin = splat(0.0), load(m, at[VELOCITY])
    past = moved & bits(load(m, NEW_TIME) > load(m, TARGET))
    if past and sizes[ENDS_ASKED] > 0:
        pass_ends(m, at, sizes, h, bend, past, helpers, poly, gap)
        begin = select(mask(past), load(m, TARGET) - load(m, NOW), begin)
        v_begin = select(mask(past), load(m, at[ENDED_VELOCITY]), v_begin)
    if sizes[WATCH] > 0:
        x, v = load(m, at[NEW_POSITION]), load(m, at[NEW_VELOCITY])
        watch_range(m, at, sizes, h, bend, begin, v_begin, tau, x, v, moved, helpers, poly, gap)
    commit(at, m, moved, new_hit)
    flags[AT_CONTACT] = (flags[AT_CONTACT] & ~moved) | new_hit
    return away, captured, past


@cached_jit(RUN_LANES, nogil=True)
def run_lanes(code, scalar, helpers, sizes, at, settings, m, jobs, tables, results, control):
    """Run all jobs. `control` = [whether to stop, forcing periods done so far]."""
    constants_count = at[RECORDS] - at[CONSTANTS_AT]
    own, order, tol = sizes[MODEL_ROWS], sizes[LANE_ORDER], settings[TOLERANCE]
    limits = step_limits(order, tol), step_limits(order, ROUGHER * tol)
    lanes = (
        np.zeros((WIDTH, LANE_LABELS), dtype=np.int64),
        np.zeros((WIDTH, GAUGES)),
        np.zeros((WIDTH, constants_count)),
        np.zeros((WIDTH, 3)),
        np.zeros((WIDTH, 2 * LONGEST_CYCLE, 2 * own)),
        np.zeros((WIDTH, LONGEST_CYCLE + 1), dtype=np.int64),
    )
    flags, poly, gap = np.zeros(3, dtype=np.int64), np.zeros(STRIDE + 2), np.zeros(STRIDE + 2)
    count, following = jobs[0].shape[0], 0
    while True:
        while flags[AWAKE] != ALL and following < count:
            lane = 0
            while (flags[AWAKE] >> lane) & 1:
                lane += 1
            fill(lane, following, code, sizes, at, m, flags, lanes, jobs, tables)
            following += 1
            if lanes[0][lane, MODE_NOW] == BEYOND:
                finish(lane, OUTSIDE, 0, code, sizes, at, m, flags, lanes, results)
        if flags[AWAKE] == 0 or control[0] != 0:
            return
        away, captured, looking, past = 0, 0, 0, 0
        arrived = bits(load(m, NOW) >= load(m, TARGET)) & flags[AWAKE]
        if arrived == 0:
            if sizes[RECORD_ROWS] > 0:
                expand_records(sizes, at, m, flags, lanes, tables, poly)
            away = flags[PARKED]
            if flags[AWAKE] != flags[PARKED]:
                doubtful, captured, past = fly(code, sizes, at, m, flags, settings, limits, helpers, poly, gap)
                away |= doubtful
                free = past & bits(load(m, LEG) < load(m, FREE_LEGS))
                if free:
                    pass_on(m, free)
                    control[1] += lane_count(free)
                    past &= ~free
                looking = bits(load(m, IMPACT_COUNT) > load(m, NEXT_LOOK)) & flags[AWAKE] & ~past
            arrived = bits(load(m, NOW) >= load(m, TARGET)) & flags[AWAKE]
        concerned = away | captured | looking | arrived
        while concerned:
            lane = first_lane(concerned)
            concerned &= concerned - 1
            reason, detail = PAUSED, 0
            if (looking >> lane) & 1 and unresolved(lane, m):  # first, as slow impacts visit in every step
                reason = UNRESOLVED
            elif (away >> lane) & 1:
                reason, detail = helpers[VISIT_ALONE](
                    lane, scalar, sizes, at, m, flags, settings, lanes, jobs[3], tables, poly, control
                )
            if reason == PAUSED and m[NOW * WIDTH + lane] >= m[TARGET * WIDTH + lane]:
                before = m[LEGS_DONE * WIDTH + lane]
                reason, detail = arrive(lane, (past >> lane) & 1, sizes, at, m, lanes, tables, results)
                control[1] += int(m[LEGS_DONE * WIDTH + lane] - before)
            if reason == PAUSED and (captured >> lane) & 1:
                reason = CAPTURED
            if reason != PAUSED:
                finish(lane, reason, detail, code, sizes, at, m, flags, lanes, results)
