"""Many trajectories at once: a group of lanes, each with its own time, step, side and parameters, refilled as they end.

The texts of `layout.py`, `steps.py`, `observe.py` and this file are compiled as one, with `flow/layout.py` and `flow/records.py`,
once for every model, for the width of this machine's registers. What a structure adds, `code`, comes through
pointers: `lane_series`, `lane_impact`, `lane_field` (see `straight.py`), and the scalar `constants` and `geometry`.

A step of all lanes: Taylor series; a step for each lane; a sweep of Horner's rule that gives the end of the step and bounds the
gap; Newton's method in the lanes whose gap is concave and negative at the end; impacts. A lane whose step shows anything else
-- rest, slow impacts, a gap that cannot be decided, a limit, a number out of range -- visits the scalar kernel (`visits.py`)
from the start of that step. No lane sees another one, so results depend neither on the width nor on the order.

`m` is the lanes' memory, in slots of one vector (`layout.py`). `jobs` and `results` are arrays with a row for each
trajectory. `flags` = [lanes that hold a trajectory, lanes whose gap is zero at the start of the step, lanes not in an arc].
"""

from __future__ import annotations

import math

import numpy as np

from saltus.flow.jit import inline_jit, lean_jit
from saltus.flow.jit import not_here as cached_jit
from saltus.flow.lanes.layout import *
from saltus.flow.lanes.observe import LONGEST_CYCLE, cycle_length, watch_range
from saltus.flow.lanes.signatures import RUN_LANES
from saltus.flow.lanes.steps import *
from saltus.flow.lanes.vector import *
from saltus.flow.layout import *
from saltus.flow.records import anchor, expand_record

# --- compiled from here on -----------------------------------------------------------------------------------------------

AWAKE, AT_CONTACT, PARKED = 0, 1, 2  # in `flags`
FAST = 1e300  # a state beyond this has left the range of numbers


@lean_jit
def fill(lane, i, code, sizes, at, m, flags, lanes, jobs, tables):
    """Put trajectory i into a lane."""
    state, numbers, labels, parameters = jobs
    where, gauge, constants, geometry, _, streak = lanes
    where[lane, IDENT], where[lane, LEG], where[lane, LAST_LEG] = i, labels[i, 0], labels[i, 1]
    where[lane, FORCED_SIDE], where[lane, PIECE_NOW] = labels[i, 2], labels[i, 3]
    where[lane, HELD_NOW] = where[lane, SKIP_NOW] = where[lane, COUNT] = where[lane, TOUCHES] = where[lane, LEGS_DONE] = 0
    gauge[lane, PERIOD_LENGTH], gauge[lane, END_TIME], gauge[lane, CHATTER_NOW] = numbers[i, 1], numbers[i, 2], 0.0
    gauge[lane, TOP], gauge[lane, BOTTOM], gauge[lane, SLOWEST] = -np.inf, np.inf, np.inf
    gauge[lane, LEG_START] = numbers[i, 0]
    streak[lane, :] = 0
    env = (parameters[i], constants[lane], tables[0], tables[1])
    code[3](parameters[i], constants[lane])
    code[4](env, geometry[lane])
    half = state.shape[1] // 2
    for row in range(half):
        m[(at[POSITION] + row) * WIDTH + lane], m[(at[VELOCITY] + row) * WIDTH + lane] = state[i, row], state[i, half + row]
    for j in range(parameters.shape[1]):
        m[(at[PARAMETERS] + j) * WIDTH + lane] = parameters[i, j]
    for j in range(constants.shape[1]):
        m[(at[CONSTANTS_AT] + j) * WIDTH + lane] = constants[lane, j]
    for j in range(3):
        m[(POINT + j) * WIDTH + lane] = geometry[lane, j]
    m[NOW * WIDTH + lane], m[CAPTURE * WIDTH + lane] = numbers[i, 0], numbers[i, 3]
    bit = 1 << lane
    flags[AWAKE] |= bit
    flags[AT_CONTACT] &= ~bit
    where[lane, MODE_NOW], side = begin_mode(sizes[SIDED], state[i, 0], state[i, half], geometry[lane])
    m[SIDE_NOW * WIDTH + lane] = float(side)
    flags[PARKED] = flags[PARKED] & ~bit if where[lane, MODE_NOW] == ARC else flags[PARKED] | bit
    begin_leg(lane, m, lanes, tables)


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


@inline_jit
def leg_end(lane, lanes):
    """The local time at which a leg ends: a forcing period after it began, or with the motion."""
    where, gauge = lanes[0], lanes[1]
    if where[lane, LEG] == where[lane, LAST_LEG]:
        return gauge[lane, END_TIME]
    return gauge[lane, LEG_START] + gauge[lane, PERIOD_LENGTH]


@inline_jit
def begin_leg(lane, m, lanes, tables):
    """Set where a lane's next stop is: the end of its forcing period, of its motion, or a breakpoint of the records."""
    where, breaks = lanes[0], tables[0]
    origin, target = where[lane, LEG] * lanes[1][lane, PERIOD_LENGTH], leg_end(lane, lanes)
    piece = where[lane, PIECE_NOW]
    while piece < breaks.size and breaks[piece] - origin <= m[NOW * WIDTH + lane]:
        piece += 1
    where[lane, PIECE_NOW] = piece
    if piece < breaks.size:
        target = min(target, breaks[piece] - origin)
    m[ORIGIN * WIDTH + lane], m[TARGET * WIDTH + lane] = origin, target


@inline_jit
def begin_records(lane, at, m):
    """Start what is recorded of a forcing period, with the position at its beginning."""
    x = m[at[POSITION] * WIDTH + lane]
    m[HIGHEST * WIDTH + lane], m[LOWEST * WIDTH + lane] = x, x
    m[LEAST * WIDTH + lane], m[CROSSINGS * WIDTH + lane] = np.inf, 0.0


@inline_jit
def keep_sample(lane, sizes, at, m, lanes, results):
    """Keep the state and what happened since the leg began, in the ring of the last samples."""
    where, own = lanes[0], sizes[MODEL_ROWS]
    row = results[3][where[lane, IDENT], where[lane, LEGS_DONE] % sizes[LAST_KEPT]]
    for d in range(own):
        row[d], row[own + d] = m[(at[POSITION] + d) * WIDTH + lane], m[(at[VELOCITY] + d) * WIDTH + lane]
    for j in range(4):
        row[2 * own + j] = m[(HIGHEST + j) * WIDTH + lane]
    total_up(lane, at, m, lanes)
    where[lane, LEGS_DONE] += 1


@inline_jit
def end_leg(lane, sizes, at, m, lanes, results):
    """Keep a leg that is over; the length of the cycle that the trajectory has settled on, or 0."""
    where, gauge, _, _, ring, streak = lanes
    keep_sample(lane, sizes, at, m, lanes, results)
    if sizes[SETTLE] == 0:
        return 0
    legs, own = where[lane, LEGS_DONE], sizes[MODEL_ROWS]
    here = legs % (2 * LONGEST_CYCLE)
    for d in range(own):
        ring[lane, here, d], ring[lane, here, own + d] = (
            m[(at[POSITION] + d) * WIDTH + lane],
            m[(at[VELOCITY] + d) * WIDTH + lane],
        )
    if where[lane, MODE_NOW] == CHATTER:
        ring[lane, here, own] = gauge[lane, CHATTER_NOW]
    return cycle_length(ring[lane], streak[lane], legs, own)


@inline_jit
def total_up(lane, at, m, lanes):
    """Add what was recorded of a forcing period to what is recorded of the trajectory, and start anew."""
    where, gauge = lanes[0], lanes[1]
    where[lane, COUNT] += int(m[CROSSINGS * WIDTH + lane])
    gauge[lane, TOP], gauge[lane, BOTTOM] = (
        max(gauge[lane, TOP], m[HIGHEST * WIDTH + lane]),
        min(gauge[lane, BOTTOM], m[LOWEST * WIDTH + lane]),
    )
    gauge[lane, SLOWEST] = min(gauge[lane, SLOWEST], m[LEAST * WIDTH + lane])
    begin_records(lane, at, m)


@inline_jit
def arrive(lane, sizes, at, m, lanes, tables, results):
    """At the end of a leg or at a breakpoint: go on. Returns DONE, SETTLED, or PAUSED, and the length of the cycle."""
    where, gauge = lanes[0], lanes[1]
    leg, now, start = where[lane, LEG], m[NOW * WIDTH + lane], gauge[lane, LEG_START]
    last, t_end = leg == where[lane, LAST_LEG], leg_end(lane, lanes)
    if now >= t_end:
        if last and t_end <= start and where[lane, LEGS_DONE] > 0:  # the end of whole periods: there is nothing to record
            return DONE, 0
        cycle = end_leg(lane, sizes, at, m, lanes, results)
        if last:
            return DONE, 0
        if cycle > 0:
            return SETTLED, cycle
        where[lane, LEG] = leg + 1
        m[NOW * WIDTH + lane] = start + (now - t_end)
    begin_leg(lane, m, lanes, tables)
    return PAUSED, 0


@lean_jit
def finish(lane, reason, detail, code, sizes, at, m, flags, lanes, results):
    """Write the end of a lane's trajectory; the lane is free."""
    where, gauge = lanes[0], lanes[1]
    state, numbers, labels, _ = results
    i, half = where[lane, IDENT], state.shape[1] // 2
    part = m[NOW * WIDTH + lane] > gauge[lane, LEG_START] or m[CROSSINGS * WIDTH + lane] > 0.0 or where[lane, LEGS_DONE] == 0
    if part and reason != DONE and reason != SETTLED and reason != OUTSIDE:  # it ends within a leg
        keep_sample(lane, sizes, at, m, lanes, results)
    total_up(lane, at, m, lanes)
    for row in range(half):
        state[i, row], state[i, half + row] = m[(at[POSITION] + row) * WIDTH + lane], m[(at[VELOCITY] + row) * WIDTH + lane]
    numbers[i, 0], numbers[i, 1] = m[NOW * WIDTH + lane], gauge[lane, CHATTER_NOW]
    numbers[i, 2], numbers[i, 3], numbers[i, 4] = gauge[lane, TOP], gauge[lane, BOTTOM], gauge[lane, SLOWEST]
    if sizes[COLUMN_COUNT] > 0 and where[lane, MODE_NOW] == ARC:  # how fast the state changes at the end
        store(m, NEW_TIME, load(m, NOW))
        for row in range(2 * sizes_rows(at)):
            store(m, at[NEW_POSITION] + row, load(m, at[POSITION] + row))
        code[2](m)
        for row in range(sizes[MODEL_ROWS]):
            numbers[i, 5 + row] = m[(at[AFTER_VELOCITY] + row) * WIDTH + lane]
        for j in range(sizes[COLUMN_COUNT]):
            numbers[i, 5 + sizes[MODEL_ROWS] + j] = m[(at[AFTER_POSITION] + j) * WIDTH + lane]
    labels[i, 0], labels[i, 1], labels[i, 2] = reason, detail, where[lane, MODE_NOW]
    labels[i, 3], labels[i, 4] = int(m[SIDE_NOW * WIDTH + lane]), where[lane, LEG]
    labels[i, 5], labels[i, 6], labels[i, 7] = where[lane, COUNT], where[lane, TOUCHES], where[lane, LEGS_DONE]
    flags[AWAKE] &= ~(1 << lane)
    flags[PARKED] &= ~(1 << lane)


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
def propose(code, sizes, at, m, flags, settings, helpers, poly, gap):
    """The step of every lane up to its first contact, put at NEW_*. Returns (bits that hit, bits to visit, h, tau, bend)."""
    order, tol = sizes[LANE_ORDER], settings[TOLERANCE]
    code[0](m, order)
    natural, size = natural_step(m, at, sizes, math.log2(tol))
    now, target = load(m, NOW), load(m, TARGET)
    h = minimum(natural, target - now)
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
    store(m, NEW_TIME, select(mask(bits(natural >= target - now) & ~hit), target, now + tau))
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


@lean_jit
def sizes_rows(at):
    """How many coordinates there are, those of the sensitivities included."""
    return at[VELOCITY] - at[POSITION]


@inline_jit
def meet(sizes, at, m, flags, h, start, x, v, a, bend, alive, helpers, poly, gap):
    """Which of the lanes in `alive` meet the contact within the step, which are in doubt, and when."""
    order, skip = sizes[LANE_ORDER], flags[AT_CONTACT]
    sign = select(mask(bits(load(m, SIDE_NOW) > 0.0)), load(m, RATE_UP), load(m, RATE_DOWN))
    curve = bend * absolute(sign)
    g0 = sign * start
    g1, g2 = sign * load(m, at[POSITIONS] + 1) * h, sign * load(m, at[POSITIONS] + 2) * (h * h)
    g3 = sign * load(m, at[POSITIONS] + 3) * (h * h * h)
    doubtful = ((bits(g0 <= 0.0) & ~skip) | (bits(g1 <= 0.0) & skip)) & alive
    clear, falls, concave, convex = shape(g0, g1, g2, g3, curve, skip)
    over = bits(sign * x <= 0.0)
    single = concave | (falls & ~skip) | (convex & over)
    hit = alive & ~doubtful & ~clear & single & over
    tau, at_root = h, v
    if hit:
        root, speed = only_root(m, at, order, h, start, sign, g0, g1, g2, x, v, a, hit)
        tau, at_root = select(mask(hit), root, h), select(mask(hit), speed, v)
    unclear = alive & ~doubtful & ~clear & ~single
    if unclear:
        for lane in range(WIDTH):
            if (unclear >> lane) & 1:
                at_start = vector_lane(g0, lane)
                root = helpers[0](
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
    code[1](m)
    before, after = load(m, at[NEW_VELOCITY]), load(m, at[AFTER_VELOCITY])
    up, down = load(m, RATE_UP), load(m, RATE_DOWN)
    old = select(mask(bits(load(m, SIDE_NOW) > 0.0)), up, down)
    new = select(mask(bits(load(m, NEW_SIDE) > 0.0)), up, down)
    speed = new * after
    good = bits(old * before < 0.0) & bits(speed > settings[SLOWEST_IMPACT]) & hit
    captured = bits(speed < load(m, CAPTURE)) & good
    chosen = mask(good)
    least, count = load(m, LEAST), load(m, CROSSINGS)
    store(m, LEAST, select(chosen, minimum(least, absolute(before)), least))
    store(m, CROSSINGS, select(chosen, count + 1.0, count))
    return good, hit & ~good, captured


@inline_jit
def commit(at, m, moved, hit):
    """Make the new state of the lanes in `moved` their state, and what is after an impact that of those in `hit`."""
    going, struck = mask(moved), mask(hit)
    store(m, NOW, select(going, load(m, NEW_TIME), load(m, NOW)))
    store(m, SIDE_NOW, select(struck, load(m, NEW_SIDE), load(m, SIDE_NOW)))
    count = sizes_rows(at)
    for row in range(2 * count):  # positions, then velocities, lie one behind the other
        new = select(struck, load(m, at[AFTER_POSITION] + row), load(m, at[NEW_POSITION] + row))
        store(m, at[POSITION] + row, select(going, new, load(m, at[POSITION] + row)))


@inline_jit
def fly(code, sizes, at, m, flags, settings, helpers, poly, gap):
    """One step of all lanes. Returns (bits to visit, bits captured, bits out of range)."""
    hit, away, h, tau, bend = propose(code, sizes, at, m, flags, settings, helpers, poly, gap)
    captured = 0
    new_hit = hit
    if hit:
        new_hit, doubtful, captured = strike(code, sizes, at, m, settings, hit)
        away |= doubtful
    moved = flags[AWAKE] & ~flags[PARKED] & ~away
    if sizes[WATCH] > 0:
        watch_range(m, at, sizes, h, tau, bend, moved, helpers, poly, gap)
    commit(at, m, moved, new_hit)
    flags[AT_CONTACT] = (flags[AT_CONTACT] & ~moved) | new_hit
    return away, captured


@cached_jit(RUN_LANES, nogil=True)
def run_lanes(code, scalar, helpers, sizes, at, settings, m, jobs, tables, results, control):
    """Run all jobs. `control` = [whether to stop, forcing periods done so far]."""
    constants_count = at[RECORDS] - at[CONSTANTS_AT]
    own = sizes[MODEL_ROWS]
    lanes = (
        np.zeros((WIDTH, 11), dtype=np.int64),
        np.zeros((WIDTH, 7)),
        np.zeros((WIDTH, constants_count)),
        np.zeros((WIDTH, 3)),
        np.zeros((WIDTH, 2 * LONGEST_CYCLE, 2 * own)),
        np.zeros((WIDTH, LONGEST_CYCLE + 1), dtype=np.int64),
    )
    flags, poly, gap = np.zeros(3, dtype=np.int64), np.zeros(STRIDE + 2), np.zeros(STRIDE + 2)
    count, following, arrived = jobs[0].shape[0], 0, 0
    while True:
        while flags[AWAKE] != ALL and following < count:
            lane = 0
            while (flags[AWAKE] >> lane) & 1:
                lane += 1
            fill(lane, following, code, sizes, at, m, flags, lanes, jobs, tables)
            begin_records(lane, at, m)
            following += 1
            if lanes[0][lane, MODE_NOW] == BEYOND:
                finish(lane, OUTSIDE, 0, code, sizes, at, m, flags, lanes, results)
        if flags[AWAKE] == 0 or control[0] != 0:
            return
        arrived = bits(load(m, NOW) >= load(m, TARGET)) & flags[AWAKE]
        if arrived == 0:
            if sizes[RECORD_ROWS] > 0:
                expand_records(sizes, at, m, flags, lanes, tables, poly)
            away, captured, endless = flags[PARKED], 0, 0
            if flags[AWAKE] != flags[PARKED]:
                doubtful, captured = fly(code, sizes, at, m, flags, settings, helpers, poly, gap)
                away |= doubtful
                endless = bits(load(m, CROSSINGS) > MOST_IMPACTS) & flags[AWAKE]
            for lane in range(WIDTH if away | captured | endless else 0):
                if (endless >> lane) & 1:
                    finish(lane, UNRESOLVED, 0, code, sizes, at, m, flags, lanes, results)
                elif (captured >> lane) & 1:
                    finish(lane, CAPTURED, 0, code, sizes, at, m, flags, lanes, results)
                elif (away >> lane) & 1:
                    reason, detail = helpers[2](
                        lane, scalar, sizes, at, m, flags, settings, lanes, jobs[3], tables, poly, control
                    )
                    if reason != PAUSED:
                        finish(lane, reason, detail, code, sizes, at, m, flags, lanes, results)
            arrived = bits(load(m, NOW) >= load(m, TARGET)) & flags[AWAKE]
        for lane in range(WIDTH if arrived else 0):
            if (arrived >> lane) & 1:
                before = lanes[0][lane, LEGS_DONE]
                reason, detail = arrive(lane, sizes, at, m, lanes, tables, results)
                control[1] += lanes[0][lane, LEGS_DONE] - before
                if reason != PAUSED:
                    finish(lane, reason, detail, code, sizes, at, m, flags, lanes, results)
