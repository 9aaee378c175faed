"""A step of all lanes of a model with one contact or none: the smooth motion up to the contact, and impacts.

Its compiled part goes into one module with that of `lanes/driver.py`; `contacts/lane_step.py` takes its place for other models.
"""

from __future__ import annotations

import numpy as np

from saltus.flow.kernel.layout import CHATTER_SPEED, LOSSLESS
from saltus.flow.kernel.memory_layout import SERIES_LENGTH, LanePart
from saltus.flow.lanes.lane_layout import FAST, SMALLEST_SHARE, Code, Flag, LaneArray, LaneSetting, Size, Slot
from saltus.flow.lanes.lane_steps import (
    both_at,
    commit,
    margins_certain,
    natural_step,
    row_count,
    series_true,
    state_size,
    sweep,
)
from saltus.flow.lanes.meeting import meet
from saltus.flow.lanes.sampling import LONGEST_RECURRENCE, pass_ends, record_others, record_range
from saltus.flow.one_contact.sides import side_of_state
from saltus.taylor import (
    WIDTH,
    absolute,
    bits,
    fma,
    inline_jit,
    jit,
    lean_jit,
    load,
    mask,
    minimum,
    put,
    select,
    splat,
    store,
)

# --- compiled from here on -----------------------------------------------------------------------------------------------


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


@jit
def lane_space(sizes, at):
    """Room for two polynomials of one lane."""
    return np.zeros(SERIES_LENGTH + 2), np.zeros(SERIES_LENGTH + 2)


@inline_jit
def begin_contact(lane, code, sizes, at, m, lanes, env, state, piece):
    """Tell a lane where its contact is; returns the mode in which a motion from this state begins, and its side."""
    geometry = lanes[LaneArray.GEOMETRY][lane]
    code[Code.GEOMETRY](env, geometry)
    for j in range(geometry.size):
        put(m, Slot.CONTACT + j, lane, geometry[j])
    return side_of_state(sizes[Size.SIDES], state[0], state[state.size // 2], geometry)


@inline_jit
def rate_on(m, slot):
    """The gap's rate of change with the coordinate, on the side that a slot holds."""
    return select(mask(bits(load(m, slot) > 0.0)), load(m, Slot.RATE_UP), load(m, Slot.RATE_DOWN))


@inline_jit
def propose(code, sizes, at, m, flags, settings, limits, helpers, space):
    """Compute the step of every lane up to its first contact, and put the new state into the slots NEW_*.

    Returns bits of the lanes that hit, bits for the scalar kernel, and bits of the lanes that wait for a shorter step; the length
    h of the step, the part tau of it that is taken, and the bound `bend` of `sweep`.
    """
    order = sizes[Size.ORDER]
    code[Code.SERIES](m, order)
    size = state_size(m, at, sizes)
    share = load(m, Slot.STEP_SHARE)
    natural = share * natural_step(m, at, sizes, limits, size)
    now, limit = load(m, Slot.NOW), load(m, Slot.STEP_LIMIT)
    h = minimum(natural, limit - now)
    alive = flags[Flag.BUSY] & ~flags[Flag.SCALAR]
    sound = bits(natural > settings[LaneSetting.SHORTEST_STEP]) & bits(size < FAST)
    contact, position = load(m, Slot.CONTACT), load(m, at[LanePart.POSITION])
    mean, v, a, bend = sweep(m, at, 0, order, h)
    if sizes[Size.MARGINS] > 0:
        sound &= margins_certain(m, at, sizes, h)
    hit, waits, tau, at_root = 0, 0, h, v
    if sizes[Size.SIDES] > 0:
        sign = select(mask(bits(rate_on(m, Slot.SIDE) > 0.0)), splat(1.0), splat(-1.0))  # a root depends on these numbers alone
        start = position - contact  # measured from the contact, so that a small gap keeps its digits
        end, skip = (fma(mean, h, start), v, a), flags[Flag.AT_CONTACT]
        patient = bits(share > SMALLEST_SHARE)
        hit, doubtful, waits, tau, at_root = meet(
            at, 0, m, order, h, sign, start, end, bend, skip, alive & sound, patient, helpers, space
        )
        sound &= ~doubtful
    impact = mask(hit)
    store(m, Slot.NEW_TIME, select(mask(bits(natural >= limit - now) & ~hit), limit, now + tau))
    store(m, at[LanePart.NEW_POSITION], select(impact, contact, fma(mean, h, position)))
    store(m, at[LanePart.NEW_VELOCITY], select(impact, at_root, v))
    for row in range(1, row_count(at)):
        positions, velocities = at[LanePart.POSITIONS] + row * SERIES_LENGTH, at[LanePart.VELOCITIES] + row * SERIES_LENGTH
        q, w = both_at(m, positions, velocities, order, load(m, positions), tau)
        store(m, at[LanePart.NEW_POSITION] + row, q)
        store(m, at[LanePart.NEW_VELOCITY] + row, w)
    if sizes[Size.CHECKED] > 0:
        sound &= series_true(code, m, at, sizes, settings[LaneSetting.TOLERANCE], tau, size)
    store(m, Slot.STEP_SHARE, select(mask(waits), 0.5 * share, splat(1.0)))
    return hit & sound & alive, alive & ~sound & ~waits, waits, h, tau, bend


@inline_jit
def reset(code, at, m, settings, hit):
    """Apply the reset at the new state. Returns bits of the lanes that are resolved, bits for the scalar kernel, and bits of
    those that are captured."""
    code[Code.IMPACT](m)
    approach = rate_on(m, Slot.SIDE) * load(m, at[LanePart.NEW_VELOCITY])
    speed = rate_on(m, Slot.NEW_SIDE) * load(m, at[LanePart.AFTER_VELOCITY])
    good = bits(approach < 0.0) & bits(speed > CHATTER_SPEED) & hit
    slow = good & ~bits(speed > settings[LaneSetting.SLOWEST_IMPACT])
    if slow:
        good &= ~slow | loses_nothing(code, at, m, speed)
    captured = bits(speed < load(m, Slot.CAPTURE_SPEED)) & good
    return good, hit & ~good, captured


@lean_jit
def loses_nothing(code, at, m, speed):
    """Bits of the lanes in which the next two impacts would not change the gap's `speed`, so that impacts do not accumulate.

    `contact.accumulation` tests the same in the scalar kernel.
    """
    side, before = load(m, Slot.SIDE), load(m, at[LanePart.NEW_VELOCITY])
    for _ in range(2):
        store(m, Slot.SIDE, load(m, Slot.NEW_SIDE))
        store(m, at[LanePart.NEW_VELOCITY], -load(m, at[LanePart.AFTER_VELOCITY]))
        code[Code.IMPACT](m)
    loss = speed - rate_on(m, Slot.NEW_SIDE) * load(m, at[LanePart.AFTER_VELOCITY])
    store(m, Slot.SIDE, side)
    store(m, at[LanePart.NEW_VELOCITY], before)
    code[Code.IMPACT](m)
    return bits(absolute(loss) < LOSSLESS * speed)


@inline_jit
def step_all(code, scalar, sizes, at, m, flags, settings, limits, helpers, lanes, jobs, tables, space):
    """One step of all lanes. Returns bits for the scalar kernel, bits captured, and bits past the end of their forcing period."""
    hit, scalar, waits, h, tau, bend = propose(code, sizes, at, m, flags, settings, limits, helpers, space)
    captured = 0
    resolved = hit
    if hit:
        resolved, doubtful, captured = reset(code, at, m, settings, hit)
        scalar |= doubtful
    moved = flags[Flag.BUSY] & ~flags[Flag.SCALAR] & ~scalar & ~waits
    begin, v_begin = splat(0.0), load(m, at[LanePart.VELOCITY])
    past = moved & bits(load(m, Slot.NEW_TIME) > load(m, Slot.PERIOD_END))
    if past and sizes[Size.ENDS_ASKED] > 0:
        pass_ends(m, at, sizes, h, bend, past, helpers, space[0], space[1])
        begin = select(mask(past), load(m, Slot.PERIOD_END) - load(m, Slot.NOW), begin)
        v_begin = select(mask(past), load(m, at[LanePart.ENDED_VELOCITY]), v_begin)
    if sizes[Size.EXTREMA] > 0:
        x, v = load(m, at[LanePart.NEW_POSITION]), load(m, at[LanePart.NEW_VELOCITY])
        record_range(m, at, 0, sizes, h, bend, begin, v_begin, tau, x, v, moved, helpers, space[0], space[1])
        record_others(m, at, sizes, h, past, tau, moved, helpers, space[0], space[1])
    commit(at, m, moved, resolved, absolute(load(m, at[LanePart.NEW_VELOCITY])))
    flags[Flag.AT_CONTACT] = (flags[Flag.AT_CONTACT] & ~moved) | resolved
    return scalar, captured, past
