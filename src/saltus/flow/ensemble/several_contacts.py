"""A step of all lanes of a model with several contacts: its smooth motion up to the first closing of a gap, and impacts.

Its compiled part goes into one module with that of `driver.py`, in the place of `one_contact.py`. A lane goes on by itself while
the contacts that are closed certainly push and one gap at most closes; its impacts are solved for one lane at a time
(`contacts_handoff.py`). Releases, contacts that close together, slow impacts and rest are left to the scalar kernel.
"""

from __future__ import annotations

import numpy as np

from saltus.flow.contacts.contact_impacts import solver_arrays
from saltus.flow.contacts.contact_layout import ContactColumn
from saltus.flow.ensemble.contacts_of_lane import tell_closed
from saltus.flow.ensemble.lane_layout import FAST, Code, Flag, Helper, JobArray, LaneArray, LaneSetting, Size, Slot
from saltus.flow.ensemble.lane_steps import both_at, commit, natural_step, row_count, series_true, sweep
from saltus.flow.ensemble.meeting import meet
from saltus.flow.ensemble.sampling import LONGEST_RECURRENCE, pass_ends, record_others, record_range
from saltus.flow.kernel_layout import WHERE_LENGTH, Mode
from saltus.flow.memory_layout import SERIES_LENGTH, LanePart, State
from saltus.taylor import (
    ALL,
    WIDTH,
    absolute,
    bits,
    first_lane,
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
    vector_lane,
)

# --- compiled from here on -----------------------------------------------------------------------------------------------

TOGETHER = 1e-6  # of a step: gaps that close nearer to each other in time may close together, which the scalar kernel decides
SMALL_GAP = 1e-9  # The same of a gap that is left when another one closes.


@jit
def lane_arrays(sizes, at):
    """Arrays with a row for each lane, in the places of `LaneArray`."""
    own, count = sizes[Size.OWN], sizes[Size.CONTACTS]
    return (
        np.zeros((WIDTH, 8), dtype=np.int64),
        np.zeros((WIDTH, 2)),
        np.zeros((WIDTH, at[LanePart.RECORDS] - at[LanePart.CONSTANTS])),
        np.zeros((WIDTH, own * own + count * count + count)),
        np.zeros((WIDTH, 2 * LONGEST_RECURRENCE, 2 * own)),
        np.zeros((WIDTH, LONGEST_RECURRENCE + 1), dtype=np.int64),
        np.zeros((WIDTH, count, ContactColumn.WAITS + 1), dtype=np.int64),
    )


@jit
def lane_space(sizes, at):
    """Room for two polynomials of one lane, and for an impact: the scalar kernel's `where`, `state`, `contacts` and `solver`."""
    own, count = sizes[Size.OWN], sizes[Size.CONTACTS]
    return (
        np.zeros(SERIES_LENGTH + 2),
        np.zeros(SERIES_LENGTH + 2),
        np.zeros(WHERE_LENGTH, dtype=np.int64),
        np.zeros(State.COORDINATES + 2 * own),
        np.zeros((count, ContactColumn.WAITS + 1), dtype=np.int64),
        solver_arrays(own, count, 0),
    )


@lean_jit
def begin_contact(lane, code, sizes, at, m, lanes, env, state, piece):
    """Tell a lane where its contacts are; returns the mode in which a motion begins, and 1 and the bits of closed contacts."""
    own, count = sizes[Size.OWN], sizes[Size.CONTACTS]
    solved, contacts = lanes[LaneArray.GEOMETRY][lane], lanes[LaneArray.CONTACTS][lane]
    code[Code.GEOMETRY](env, piece, m, solved)  # any state will do: positions depend on parameters alone
    mode = Mode.ARC
    for i in range(count):
        coordinate, position = sizes[Size.CONTACTS + 1 + i], solved[own * own + count * count + i]
        put(m, at[LanePart.CONTACTS] + i, lane, position)
        sign = sizes[Size.CONTACTS + 1 + count + i]
        gap, rate = sign * (state[coordinate] - position), sign * state[own + coordinate]
        contacts[i, ContactColumn.COORDINATE] = coordinate
        contacts[i, ContactColumn.CLOSED] = 1 if gap == 0.0 and rate == 0.0 else 0
        contacts[i, ContactColumn.SKIP], contacts[i, ContactColumn.RELEASED] = 1 if gap == 0.0 else 0, 0
        contacts[i, ContactColumn.WAITS] = 0
        if not (gap > 0.0 or (gap == 0.0 and rate >= 0.0)):
            mode = Mode.BEYOND
        elif gap == 0.0 and mode == Mode.ARC:
            mode = Mode.CONTACT
    return mode, 1 + tell_closed(lane, at, m, contacts)


@lean_jit
def stays_positive(m, series, order, h):
    """Bits of the lanes in which a series is positive on [0, h] for certain, by its cubic's Bernstein coefficients."""
    rest = splat(0.0)
    for k in range(order - 1, 3, -1):
        rest = fma(rest, h, absolute(load(m, series + k)))
    square = h * h
    c0, c1, c2 = load(m, series), h * load(m, series + 1), square * load(m, series + 2)
    end = c0 + c1 + c2 + square * h * load(m, series + 3)
    low = minimum(minimum(c0, c0 + c1 * (1.0 / 3.0)), minimum(c0 + (2.0 * c1 + c2) * (1.0 / 3.0), end))
    return bits(low > rest * (square * square))


@lean_jit
def guards_certain(m, at, sizes, h):
    """Bits of the lanes in which every closed contact pushes over the step for certain, and every margin stays positive."""
    sure, count = ALL, sizes[Size.CONTACTS]
    for i in range(sizes[Size.MARGINS]):
        closed = ALL
        if i < count:
            coordinate, contact = sizes[Size.CONTACTS + 1 + i], load(m, at[LanePart.CONTACTS] + i)
            start = load(m, at[LanePart.POSITION] + coordinate) - contact
            closed = bits(load(m, at[LanePart.FREE] + coordinate) < 0.5) & bits(start * start <= 0.0)
        if closed:
            sure &= stays_positive(m, at[LanePart.MARGINS] + i * SERIES_LENGTH, sizes[Size.ORDER], h) | ~closed
    return sure


@inline_jit
def first_closing(sizes, at, m, h, alive, helpers, space):
    """The first gap that closes in the step. Returns bits of lanes in which one does, those in doubt, when, and which one."""
    order, count = sizes[Size.ORDER], sizes[Size.CONTACTS]
    hit, doubtful, tau, which = 0, 0, h, splat(0.0)
    for i in range(count):
        row = sizes[Size.CONTACTS + 1 + i]
        opened = alive & bits(load(m, at[LanePart.FREE] + row) > 0.5)
        if opened == 0:
            continue
        start = load(m, at[LanePart.POSITION] + row) - load(m, at[LanePart.CONTACTS] + i)
        x, v, a, bend = sweep(m, at, row, order, start, h)
        sign, skip = splat(1.0 * sizes[Size.CONTACTS + 1 + count + i]), bits(start * start <= 0.0)
        closes, unclear, when, _ = meet(at, row, m, order, h, sign, start, (x, v, a), bend, skip, opened, helpers, space)
        doubtful |= unclear | (hit & closes & bits(absolute(when - tau) < TOGETHER * h))
        first = closes & (~hit | bits(when < tau))
        tau, which = select(mask(first), when, tau), select(mask(first), splat(1.0 * i), which)
        hit |= closes
    return hit, doubtful, tau, which


@inline_jit
def put_new_state(sizes, at, m, tau, hit, which):
    """Put the state at `tau`, with the contact that closes at its position. Returns lanes in which another gap is as small."""
    order, count, near = sizes[Size.ORDER], sizes[Size.CONTACTS], 0
    for row in range(row_count(at)):
        positions, velocities = at[LanePart.POSITIONS] + row * SERIES_LENGTH, at[LanePart.VELOCITIES] + row * SERIES_LENGTH
        x, v = both_at(m, positions, velocities, order, load(m, positions), tau)
        store(m, at[LanePart.NEW_POSITION] + row, x)
        store(m, at[LanePart.NEW_VELOCITY] + row, v)
    for i in range(count if hit else 0):
        row, contact = sizes[Size.CONTACTS + 1 + i], load(m, at[LanePart.CONTACTS] + i)
        x, this = load(m, at[LanePart.NEW_POSITION] + row), hit & bits(absolute(which - 1.0 * i) < 0.5)
        opened = bits(load(m, at[LanePart.FREE] + row) > 0.5)
        near |= hit & ~this & opened & bits((x - contact) * (1.0 * sizes[Size.CONTACTS + 1 + count + i]) < SMALL_GAP)
        store(m, at[LanePart.NEW_POSITION] + row, select(mask(this), contact, x))
    return near


@inline_jit
def step_all(code, scalar, sizes, at, m, flags, settings, limits, helpers, lanes, jobs, tables, space):
    """One step of all lanes. Returns bits for the scalar kernel, bits captured, and bits past the end of their forcing period."""
    order, alive = sizes[Size.ORDER], flags[Flag.BUSY] & ~flags[Flag.SCALAR]
    code[Code.SERIES](m, order)
    natural, size = natural_step(m, at, sizes, limits)
    now, limit = load(m, Slot.NOW), load(m, Slot.STEP_LIMIT)
    h = minimum(natural, limit - now)
    sound = bits(natural > settings[LaneSetting.SHORTEST_STEP]) & bits(size < FAST)
    hit, doubtful, tau, which = first_closing(sizes, at, m, h, alive & sound, helpers, space)
    sound &= ~doubtful & ~put_new_state(sizes, at, m, tau, hit, which) & guards_certain(m, at, sizes, tau)
    store(m, Slot.NEW_TIME, select(mask(bits(natural >= limit - now) & ~hit), limit, now + tau))
    if sizes[Size.CHECKED] > 0:
        sound &= series_true(code, m, at, sizes, settings[LaneSetting.TOLERANCE], tau, size)
    resolved, waiting = 0, hit & sound & alive
    moved = alive & sound & ~hit
    while waiting:
        lane = first_lane(waiting)
        waiting &= waiting - 1
        impact = helpers[Helper.IMPACT]
        which_one = 1 << int(vector_lane(which, lane))
        if impact(lane, which_one, scalar, sizes, at, m, settings, lanes, jobs[JobArray.PARAMETERS], tables, space):
            resolved |= 1 << lane
    moved |= resolved
    begin, v_begin = splat(0.0), load(m, at[LanePart.VELOCITY])
    past = moved & bits(load(m, Slot.NEW_TIME) > load(m, Slot.PERIOD_END))
    bend = splat(0.0)
    if sizes[Size.EXTREMA] > 0:
        _, _, _, bend = sweep(m, at, 0, order, load(m, at[LanePart.POSITION]), h)
    if past and sizes[Size.ENDS_ASKED] > 0:
        pass_ends(m, at, sizes, h, bend, past, helpers, space[0], space[1])
        begin = select(mask(past), load(m, Slot.PERIOD_END) - now, begin)
        v_begin = select(mask(past), load(m, at[LanePart.ENDED_VELOCITY]), v_begin)
    if sizes[Size.EXTREMA] > 0:
        x, v = load(m, at[LanePart.NEW_POSITION]), load(m, at[LanePart.NEW_VELOCITY])
        record_range(m, at, 0, sizes, h, bend, begin, v_begin, tau, x, v, moved, helpers, space[0], space[1])
        record_others(m, at, sizes, h, past, tau, moved, helpers, space[0], space[1])
    commit(at, m, moved, resolved, load(m, Slot.NEW_SPEED))
    return alive & ~moved, 0, past
