"""The smooth motion of all lanes of a model with several contacts, in one step, up to the first closing of a gap.

Its compiled part goes into one module with that of `contacts/lane_step.py`. If exactly one coordinate is free in every lane, all
lanes share a series of this coordinate alone, even if it is not the same one in all lanes (`one_free.py`).
"""

from __future__ import annotations

from saltus.flow.kernel.memory_layout import SERIES_LENGTH, LanePart
from saltus.flow.lanes.lane_layout import FAST, Code, LaneSetting, Size, Slot
from saltus.flow.lanes.lane_steps import both_at, natural_step, row_count, row_step, series_true, state_size, sweep
from saltus.flow.lanes.meeting import meet
from saltus.flow.lanes.sampling import keep_ended, record_range
from saltus.taylor import ALL, absolute, bits, fma, inline_jit, lean_jit, load, mask, minimum, replace, select, splat, store

# --- compiled from here on -----------------------------------------------------------------------------------------------

TOGETHER = 1e-6  # Gaps that close within this share of a step may close together, which the scalar kernel decides.
SMALL_GAP = 1e-9  # A gap smaller than this, when another one closes, may close together with it.


@lean_jit
def stays_positive(m, series, order, h):
    """Bits of the lanes in which a series is certainly positive on [0, h]: by the Bernstein coefficients of its cubic part, and a
    bound of the rest."""
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
    """Bits of the lanes in which certainly, over the step, all reactions of closed contacts and all margins stay positive."""
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
    """The first gap that closes in the step. Returns bits of the lanes in which one closes, bits of the lanes in doubt, the
    times, and the contacts."""
    order, count = sizes[Size.ORDER], sizes[Size.CONTACTS]
    hit, doubtful, tau, which = 0, 0, h, splat(0.0)
    for i in range(count):
        row = sizes[Size.CONTACTS + 1 + i]
        opened = alive & bits(load(m, at[LanePart.FREE] + row) > 0.5)
        if opened == 0:
            continue
        start = load(m, at[LanePart.POSITION] + row) - load(m, at[LanePart.CONTACTS] + i)
        mean, v, a, bend = sweep(m, at, row, order, h)
        end = fma(mean, h, start), v, a
        sign, skip = splat(1.0 * sizes[Size.CONTACTS + 1 + count + i]), bits(start * start <= 0.0)
        closes, unclear, _, when, _ = meet(at, row, m, order, h, sign, start, end, bend, skip, opened, 0, helpers, space)
        doubtful |= unclear | (hit & closes & bits(absolute(when - tau) < TOGETHER * h))
        first = closes & (~hit | bits(when < tau))
        tau, which = select(mask(first), when, tau), select(mask(first), splat(1.0 * i), which)
        hit |= closes
    return hit, doubtful, tau, which


@inline_jit
def put_new_state(sizes, at, m, tau, hit, which):
    """Put the state at `tau`, with the contact that closes exactly at its position. Returns bits of the lanes in which another
    gap is nearly 0 as well."""
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
def free_step(code, sizes, at, m, settings, limits, alive, helpers, space):
    """A step of all lanes, put at NEW_*, whichever coordinates are free.

    Returns bits of the lanes in which a gap closes, bits of the lanes in which nothing is in doubt, the length of the step, the
    part of it that is taken, the bound `bend` of `sweep` for the first coordinate, and the contact that closes.
    """
    order = sizes[Size.ORDER]
    code[Code.SERIES](m, order)
    size = state_size(m, at, sizes)
    natural = natural_step(m, at, sizes, limits, size)
    now, limit = load(m, Slot.NOW), load(m, Slot.STEP_LIMIT)
    h = minimum(natural, limit - now)
    sound = bits(natural > settings[LaneSetting.SHORTEST_STEP]) & bits(size < FAST)
    hit, doubtful, tau, which = first_closing(sizes, at, m, h, alive & sound, helpers, space)
    sound &= ~doubtful & ~put_new_state(sizes, at, m, tau, hit, which) & guards_certain(m, at, sizes, tau)
    store(m, Slot.NEW_TIME, select(mask(bits(natural >= limit - now) & ~hit), limit, now + tau))
    if sizes[Size.CHECKED] > 0:
        sound &= series_true(code, m, at, sizes, settings[LaneSetting.TOLERANCE], tau, size)
    bend = splat(0.0)
    if sizes[Size.EXTREMA] > 0:
        _, _, _, bend = sweep(m, at, 0, order, h)
    return hit, sound, h, tau, bend, which


# --- one coordinate is free ------------------------------------------------------------------------------------------------


@inline_jit
def add_second_derivative(m, series, other, order):
    """Add another series' second derivative to a series, up to the order below order - 2."""
    for k in range(order - 2):
        store(m, series + k, fma(load(m, other + k + 2), 1.0 * ((k + 1) * (k + 2)), load(m, series + k)))


@inline_jit
def one_is_free(sizes, at, m):
    """Bits of the lanes in which exactly one coordinate is free."""
    count = splat(0.0)
    for row in range(sizes[Size.OWN]):
        count = count + load(m, at[LanePart.FREE] + row)
    return bits(absolute(count - 1.0) < 0.5)


@inline_jit
def one_free_step(code, sizes, at, m, settings, limits, alive, helpers, space):
    """As `free_step`, for lanes in which one coordinate is free; its series are in row 0, whichever coordinate it is."""
    order, count = sizes[Size.ORDER], sizes[Size.CONTACTS]
    x, v, sign, contact, which = splat(0.0), splat(0.0), splat(1.0), splat(0.0), splat(0.0)
    for i in range(count):
        row = sizes[Size.CONTACTS + 1 + i]
        free = mask(bits(load(m, at[LanePart.FREE] + row) > 0.5))
        x, v = select(free, load(m, at[LanePart.POSITION] + row), x), select(free, load(m, at[LanePart.VELOCITY] + row), v)
        sign = select(free, splat(1.0 * sizes[Size.CONTACTS + 1 + count + i]), sign)
        contact, which = select(free, load(m, at[LanePart.CONTACTS] + i), contact), select(free, splat(1.0 * i), which)
    store(m, Slot.FREE_POSITION, x)
    store(m, Slot.FREE_VELOCITY, v)
    code[Code.ONE_FREE](m, order)
    size = state_size(m, at, sizes)
    natural = row_step(m, at[LanePart.VELOCITIES], order, size, limits[0])
    now, limit = load(m, Slot.NOW), load(m, Slot.STEP_LIMIT)
    h, start = minimum(natural, limit - now), x - contact
    sound = bits(natural > settings[LaneSetting.SHORTEST_STEP]) & bits(size < FAST)
    mean, v, a, bend = sweep(m, at, 0, order, h)
    skip = bits(start * start <= 0.0)
    end, ready = (fma(mean, h, start), v, a), alive & sound
    hit, doubtful, _, tau, at_root = meet(at, 0, m, order, h, sign, start, end, bend, skip, ready, 0, helpers, space)
    sound &= ~doubtful
    for i in range(sizes[Size.GUARDS]):
        guard = at[LanePart.MARGINS] + i * SERIES_LENGTH
        if i < sizes[Size.OWN] - 1:
            add_second_derivative(m, guard, at[LanePart.POSITIONS] + (i + 1) * SERIES_LENGTH, order)
            sound &= stays_positive(m, guard, order - 2, tau)
        else:
            sound &= stays_positive(m, guard, order, tau)
    for i in range(sizes[Size.CONSTANT_GUARDS]):
        sound &= bits(load(m, at[LanePart.CONSTANT_GUARDS] + i) > 0.0)
    closing = mask(hit)
    x, v = select(closing, contact, fma(mean, h, x)), select(closing, at_root, v)
    for row in range(sizes[Size.OWN]):
        free = mask(bits(load(m, at[LanePart.FREE] + row) > 0.5))
        store(m, at[LanePart.NEW_POSITION] + row, select(free, x, load(m, at[LanePart.POSITION] + row)))
        store(m, at[LanePart.NEW_VELOCITY] + row, select(free, v, splat(0.0)))
    store(m, Slot.NEW_TIME, select(mask(bits(natural >= limit - now) & ~hit), limit, now + tau))
    return hit, sound, h, tau, bend, which


@inline_jit
def of_free(m, sizes, first, which):
    """The value, in the part of the memory that begins at `first`, for the coordinate of the contact `which`, which was free in
    the step."""
    value = splat(0.0)
    for i in range(sizes[Size.CONTACTS]):
        was_free = mask(bits(absolute(which - 1.0 * i) < 0.5))
        value = select(was_free, load(m, first + sizes[Size.CONTACTS + 1 + i]), value)
    return value


@inline_jit
def pass_ends_of_free(m, at, sizes, h, bend, which, past, helpers, space):
    """`pass_ends` for lanes in which only the coordinate of the contact `which` was free: the other coordinates stay constant."""
    since, chosen = load(m, Slot.PERIOD_END) - load(m, Slot.NOW), mask(past)
    x, v = both_at(m, at[LanePart.POSITIONS], at[LanePart.VELOCITIES], sizes[Size.ORDER], load(m, Slot.FREE_POSITION), since)
    for i in range(sizes[Size.CONTACTS]):
        row, was_free = sizes[Size.CONTACTS + 1 + i], mask(bits(absolute(which - 1.0 * i) < 0.5))
        replace(m, at[LanePart.ENDED_POSITION] + row, chosen, select(was_free, x, load(m, at[LanePart.POSITION] + row)))
        replace(m, at[LanePart.ENDED_VELOCITY] + row, chosen, select(was_free, v, splat(0.0)))
    if sizes[Size.EXTREMA] > 0:
        v_begin = load(m, Slot.FREE_VELOCITY)
        record_range(m, at, 0, sizes, h, bend, splat(0.0), v_begin, since, x, v, past, helpers, space[0], space[1])
    keep_ended(m, at, sizes, past)
