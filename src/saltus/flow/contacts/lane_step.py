"""A step of all lanes of a model with several contacts: the smooth motion up to the first closing
of a gap, and impacts.

Its compiled part goes into one module with that of `programs/lane_driver.py`, in the place of
`one_contact/lane_step.py`, and with that of `lane_impacts.py`. Lanes move together as long as all
closed contacts certainly push and at most one gap closes. Releases, contacts that close together,
slow impacts and rest are left to the scalar kernel, and so are all events of motions with a
tangent. The scalar kernel does all steps of motions with frictions.

If exactly one coordinate is free in every lane, all lanes share a series of this coordinate alone,
even if it is not the same one in all lanes (`one_free.py`).
"""

from __future__ import annotations

from saltus.flow.contacts.lane_impacts import closed_lanes, resolve_impacts, write_closed
from saltus.flow.kernel.contact_layout import (
    FrictionImpact,
    NoPress,
    PartColumn,
    PartKind,
    Reached,
    Side,
)
from saltus.flow.kernel.layout import Mode
from saltus.flow.lane_steps.memory import FAST, Gap, Step, Stretch
from saltus.flow.lane_steps.sampling import keep_ended, pass_ends, record_others, record_range
from saltus.flow.lane_steps.steps import (
    both_at,
    commit,
    find_contact,
    natural_step,
    note_impacts,
    rate_of_change,
    row_step,
    series_true,
    state_size,
    sweep,
)
from saltus.taylor import inline_jit, lean_jit
from saltus.taylor.lane_memory import one
from saltus.taylor.lane_vectors import (
    ALL,
    absolute,
    bits,
    first_lane,
    fma,
    lane_count,
    mask,
    minimum,
    select,
    splat,
    vector_lane,
)

# --- compiled from here on ---------------------------------------------------

# The time of a step with the series of all coordinates, in units of that with the series of one.
COST_OF_SEVERAL = 3
# Gaps that close within this share of a step may close together, which the scalar kernel decides.
CLOSE_TOGETHER = 1e-6
# A gap smaller than this, in natural units, when another one closes, may close together with it.
SMALL_GAP = 1e-9


@lean_jit
def begin_contact(lane, env, state):
    """Tell a lane where its contacts are; returns the mode in which a motion begins, and 1 for the
    side.
    """
    local = lane.sizes.local
    count = lane.sizes.contacts
    sizes = lane.sizes
    solved = lane.geometry[lane.index]
    contacts = lane.contact_rows[lane.index]
    matrices = lane.code.geometry
    # any state will do: positions depend on parameters alone
    matrices(env, lane.piece, lane.memory, solved)
    mode = Mode.ARC
    for i in range(count):
        coordinate = sizes.coordinates[i]
        position = solved[local * local + count * count + i]
        sign = sizes.signs[i]
        lane.contacts[i] = position
        gap = sign * (state[coordinate] - position)
        rate = sign * state[state.size // 2 + coordinate]
        contacts[i, PartColumn.COORDINATE] = coordinate
        contacts[i, PartColumn.STATE] = 1 if gap == 0.0 and rate == 0.0 else 0
        contacts[i, PartColumn.SKIP] = 1 if gap == 0.0 else 0
        contacts[i, PartColumn.REACHED] = Reached.NO
        contacts[i, PartColumn.WAITS] = contacts[i, PartColumn.EXCESS] = 0
        if not (gap > 0.0 or (gap == 0.0 and rate >= 0.0)):
            mode = Mode.BEYOND
        elif gap == 0.0 and mode == Mode.ARC:
            mode = Mode.CONTACT
    for k in range(sizes.frictions):
        coordinate = sizes.coordinates[count + k]
        row = contacts[count + k]
        surface = coordinate < 0
        coordinate = -1 - coordinate if surface else coordinate
        function = coordinate >= sizes.own
        coordinate = 0 if function else coordinate
        beyond = state[coordinate]
        rate = state[state.size // 2 + coordinate]
        if not surface:
            beyond = rate
        beyond -= solved[solved.size - sizes.frictions + k]
        row[PartColumn.COORDINATE] = coordinate
        row[PartColumn.SKIP] = 0
        row[PartColumn.STATE] = 1 if beyond > 0.0 else -1 if beyond < 0.0 else 0
        row[PartColumn.KIND] = PartKind.FRICTION
        row[PartColumn.MARGIN] = 0
        row[PartColumn.REACHED] = Reached.NO
        if surface:
            row[PartColumn.KIND] = PartKind.SURFACE
            if beyond == 0.0:
                row[PartColumn.STATE] = -1 if rate < 0.0 else 1
        elif row[PartColumn.PRESSED] == NoPress.INERT:
            row[PartColumn.STATE] = Side.OFF
        if function:  # the kernel reads its side
            row[PartColumn.KIND] = PartKind.FUNCTION
            row[PartColumn.STRUCK] = FrictionImpact.JUMPED
            row[PartColumn.STATE] = Side.ABOVE
        mode = Mode.CONTACT if mode == Mode.ARC else mode
    lane.leave_by = 1 if mode == Mode.CONTACT else 0  # derivatives are then one-sided
    write_closed(lane, contacts[:count])
    return mode, 1


@lean_jit
def side_at_end(lane):
    """1 plus the bits of the contacts that are closed at the end of a motion; within the step that
    went beyond it an impact may have opened some of them."""
    closed = 0
    for i in range(lane.sizes.contacts):
        row = lane.sizes.coordinates[i]
        if lane.position[row] == lane.contacts[i] and (
            lane.free[row] < 0.5 or lane.velocity[row] == 0.0
        ):
            closed |= 1 << i
    return 1 + closed


@lean_jit
def stays_positive(series, order, h):
    """Bits of the lanes in which a series is certainly positive on [0, h]: by the Bernstein
    coefficients of its cubic part, and a bound of the rest."""
    rest = splat(0.0)
    for k in range(order - 1, 3, -1):
        rest = fma(rest, h, absolute(series[k]))
    square = h * h
    c0 = series[0]
    c1 = h * series[1]
    c2 = square * series[2]
    end = c0 + c1 + c2 + square * h * series[3]
    low = minimum(
        minimum(c0, c0 + c1 * (1.0 / 3.0)), minimum(c0 + (2.0 * c1 + c2) * (1.0 / 3.0), end)
    )
    return bits(low > rest * (square * square))


@lean_jit
def guards_certain(lanes, h):
    """Bits of the lanes in which certainly, over the step, all reactions of closed contacts and all
    margins stay positive.
    """
    sure = ALL
    for i in range(lanes.sizes.margins):
        closed = closed_lanes(lanes, i) if i < lanes.sizes.contacts else ALL
        if closed:
            sure &= stays_positive(lanes.margins[i], lanes.sizes.order, h) | ~closed
    return sure


@inline_jit
def first_closing(lanes, h, alive):
    """The first gap that closes in the step. Returns bits of the lanes in which one closes, bits of
    the lanes in doubt, the times, and the contacts."""
    hit = 0
    doubtful = 0
    tau = h
    which = splat(0.0)
    for i in range(lanes.sizes.contacts):
        row = lanes.sizes.coordinates[i]
        opened = alive & bits(lanes.free[row] > 0.5)
        if opened == 0:
            continue
        start = lanes.position[row] - lanes.contacts[i]
        mean, v, a, bend = sweep(lanes, row, h)
        gap = Gap(row, start, splat(1.0 * lanes.sizes.signs[i]), bits(start * start <= 0.0))
        closes, unclear, _, when, _ = find_contact(
            lanes, gap, h, (fma(mean, h, start), v, a, bend), opened, 0
        )
        doubtful |= unclear | (hit & closes & bits(absolute(when - tau) < CLOSE_TOGETHER * h))
        first = closes & (~hit | bits(when < tau))
        tau = select(mask(first), when, tau)
        which = select(mask(first), splat(1.0 * i), which)
        hit |= closes
    return hit, doubtful, tau, which


@inline_jit
def put_new_state(lanes, tau, hit, which):
    """Put the state at `tau`, with the contact that closes exactly at its position. Returns bits of
    the lanes in which another gap is nearly 0 as well."""
    near = 0
    small = splat(SMALL_GAP * lanes.settings.natural_length)
    for row in range(lanes.sizes.rows):
        x, v = both_at(lanes, row, tau)
        lanes.new_position[row] = x
        lanes.new_velocity[row] = v
    for i in range(lanes.sizes.contacts if hit else 0):
        row = lanes.sizes.coordinates[i]
        contact = lanes.contacts[i]
        x = lanes.new_position[row]
        this = hit & bits(absolute(which - 1.0 * i) < 0.5)
        opened = bits(lanes.free[row] > 0.5)
        gap = (x - contact) * (1.0 * lanes.sizes.signs[i])
        near |= hit & ~this & opened & bits(gap < small)
        lanes.new_position[row] = select(mask(this), contact, x)
    return near


@inline_jit
def free_step(lanes, alive):
    """A step of all lanes, whichever coordinates are free, with the new state in its slots.

    Returns bits of the lanes in which a gap closes, bits of the lanes in which nothing is in doubt,
    and the step.
    """
    series = lanes.code.series
    series(lanes.memory, lanes.places, lanes.sizes.order)
    size = state_size(lanes)
    now = lanes.now
    limit = lanes.step_limit
    natural = natural_step(lanes, size)
    h = minimum(natural, limit - now)
    sound = bits(natural > lanes.settings.shortest_step) & bits(size < FAST)
    hit, doubtful, tau, which = first_closing(lanes, h, alive & sound)
    sound &= ~doubtful & ~put_new_state(lanes, tau, hit, which) & guards_certain(lanes, tau)
    lanes.new_time = select(mask(bits(natural >= limit - now) & ~hit), limit, now + tau)
    if lanes.sizes.checked > 0:
        sound &= series_true(lanes, tau, size)
    bend = splat(0.0)
    if lanes.sizes.extrema > 0:
        _, _, _, bend = sweep(lanes, 0, h)
    return hit, sound, Step(h, tau, bend, which)


# --- one coordinate is free --------------------------------------------------


@inline_jit
def add_second_derivative(series, other, order):
    """Add another series' second derivative to a series, up to the order below order - 2."""
    for k in range(order - 2):
        series[k] = fma(other[k + 2], 1.0 * ((k + 1) * (k + 2)), series[k])


@inline_jit
def one_is_free(lanes):
    """Bits of the lanes in which exactly one coordinate is free."""
    count = splat(0.0)
    for row in range(lanes.sizes.local):
        count = count + lanes.free[row]
    return bits(absolute(count - 1.0) < 0.5)


@lean_jit
def free_guards_certain(lanes, tau):
    """`guards_certain` where one coordinate is free."""
    sure = ALL
    order = lanes.sizes.order
    for i in range(lanes.sizes.guards):
        guard = lanes.margins[i]
        if i < lanes.sizes.own - 1:
            add_second_derivative(guard, lanes.positions[i + 1], order)
            sure &= stays_positive(guard, order - 2, tau)
        else:
            sure &= stays_positive(guard, order, tau)
    for i in range(lanes.sizes.constant_guards):
        sure &= bits(lanes.constant_guards[i] > 0.0)
    return sure


@inline_jit
def one_free_step(lanes, alive):
    """As `free_step`, for lanes in which one coordinate is free; its series are in row 0, whichever
    coordinate it is.
    """
    x = splat(0.0)
    v = splat(0.0)
    sign = splat(1.0)
    contact = splat(0.0)
    which = splat(0.0)
    for i in range(lanes.sizes.contacts):
        row = lanes.sizes.coordinates[i]
        free = mask(bits(lanes.free[row] > 0.5))
        x = select(free, lanes.position[row], x)
        v = select(free, lanes.velocity[row], v)
        sign = select(free, splat(1.0 * lanes.sizes.signs[i]), sign)
        contact, which = (
            select(free, lanes.contacts[i], contact),
            select(free, splat(1.0 * i), which),
        )
    lanes.free_position, lanes.free_velocity, series = x, v, lanes.code.one_free
    series(lanes.memory, lanes.places, lanes.sizes.order)
    size = state_size(lanes)
    now = lanes.now
    limit = lanes.step_limit
    natural = row_step(lanes.velocities[0], lanes.sizes.order, size, lanes.settings.limits)
    h = minimum(natural, limit - now)
    start = x - contact
    sound = bits(natural > lanes.settings.shortest_step) & bits(size < FAST)
    mean, v, a, bend = sweep(lanes, 0, h)
    gap = Gap(0, start, sign, bits(start * start <= 0.0))
    end = (fma(mean, h, start), v, a, bend)
    hit, doubtful, _, tau, at_root = find_contact(lanes, gap, h, end, alive & sound, 0)
    sound &= ~doubtful & free_guards_certain(lanes, tau)
    closing = mask(hit)
    x = select(closing, contact, fma(mean, h, x))
    v = select(closing, at_root, v)
    for row in range(lanes.sizes.own):
        free = mask(bits(lanes.free[row] > 0.5))
        lanes.new_position[row] = select(free, x, lanes.position[row])
        lanes.new_velocity[row] = select(free, v, splat(0.0))
    lanes.new_time = select(mask(bits(natural >= limit - now) & ~hit), limit, now + tau)
    return hit, sound, Step(h, tau, bend, which)


@inline_jit
def of_free(lanes, part, which):
    """The value, in a part of the memory, for the coordinate of the contact `which`, which was free
    in the step.
    """
    value = splat(0.0)
    for i in range(lanes.sizes.contacts):
        was_free = mask(bits(absolute(which - 1.0 * i) < 0.5))
        value = select(was_free, part[lanes.sizes.coordinates[i]], value)
    return value


@inline_jit
def pass_ends_of_free(lanes, step, past):
    """`pass_ends` for lanes in which only the coordinate of one contact was free: the other
    coordinates stay constant.
    """
    since = lanes.period_end - lanes.now
    chosen = mask(past)
    x, v = both_at(lanes, 0, since)
    for i in range(lanes.sizes.contacts):
        row = lanes.sizes.coordinates[i]
        was_free = mask(bits(absolute(step.contact - 1.0 * i) < 0.5))
        lanes.ended_position[row] = select(
            chosen, select(was_free, x, lanes.position[row]), lanes.ended_position[row]
        )
        lanes.ended_velocity[row] = select(
            chosen, select(was_free, v, splat(0.0)), lanes.ended_velocity[row]
        )
    if lanes.sizes.extrema > 0:
        record_range(
            lanes, 0, Stretch(splat(0.0), since, lanes.free_velocity, x, v, step.h, step.bend), past
        )
    keep_ended(lanes, past)


# --- all lanes ---------------------------------------------------------------


@inline_jit
def step_all(lanes):
    """One step, either of all lanes in which exactly one coordinate is free, or of all other lanes:
    of those that are more numerous relative to the cost of their step.

    The choice changes no motion, as the other lanes only wait. Returns bits for the scalar kernel,
    bits captured, and bits past the end of their forcing period.
    """
    alive = lanes.busy & ~lanes.scalar
    single = False
    if lanes.sizes.one_free > 0:
        with_one = alive & one_is_free(lanes)
        single = lane_count(alive & ~with_one) <= COST_OF_SEVERAL * lane_count(with_one)
        alive = with_one if single else alive & ~with_one
    if single:
        hit, sound, step = one_free_step(lanes, alive)
    else:
        hit, sound, step = free_step(lanes, alive)
    hit &= sound & alive
    resolved = 0
    moved = alive & sound & ~hit
    if hit:
        note_closings(lanes, hit, step, single)
    if hit and lanes.sizes.columns == 0:  # impacts with a tangent are left to the scalar kernel
        resolved = resolve_all(lanes, hit, step.contact)
    moved |= resolved
    past = moved & bits(lanes.new_time > lanes.period_end)
    if past and lanes.sizes.ends_asked > 0:
        if single:
            pass_ends_of_free(lanes, step, past)
        else:
            pass_ends(lanes, step, past)
    if lanes.sizes.extrema > 0:
        record_step(lanes, step, single, past, moved)
    commit(lanes, moved, resolved, lanes.new_speed)
    return alive & ~moved, 0, past


@inline_jit
def note_closings(lanes, hit, step, single):
    """Note the impacts of a step for the natural scales of the lanes."""
    for i in range(lanes.sizes.contacts):
        this = hit & bits(absolute(step.contact - 1.0 * i) < 0.5)
        if this:
            row = lanes.sizes.coordinates[i]
            pull = rate_of_change(lanes, lanes.velocities[0 if single else row], step.taken)
            note_impacts(lanes, this, lanes.new_velocity[row], pull)


@inline_jit
def resolve_all(lanes, hit, which):
    """Apply the impact law in the lanes in `hit`, together where that is possible; returns the
    resolved lanes.
    """
    resolved = (
        0
        if lanes.sizes.jumps > 0 or lanes.sizes.dependent > 0
        else resolve_impacts(lanes, hit, which)
    )
    waiting = hit & ~resolved
    while waiting:
        i = first_lane(waiting)
        impact = lanes.helpers.impact
        waiting &= waiting - 1
        if impact(one(lanes, i), 1 << int(vector_lane(which, i))):
            resolved |= 1 << i
    return resolved


@inline_jit
def record_step(lanes, step, single, past, moved):
    """Record the extrema of all coordinates up to the new state; in lanes `past` the end of a
    period, from this end.
    """
    after = mask(past)
    tau = step.taken
    begin = select(after, lanes.period_end - lanes.now, splat(0.0))
    if single:  # held coordinates are constant, and the records of the period begin with them
        v_begin = select(
            after, of_free(lanes, lanes.ended_velocity, step.contact), lanes.free_velocity
        )
        x = of_free(lanes, lanes.new_position, step.contact)
        v = of_free(lanes, lanes.new_velocity, step.contact)
        record_range(lanes, 0, Stretch(begin, tau, v_begin, x, v, step.h, step.bend), moved)
    else:
        v_begin = select(after, lanes.ended_velocity[0], lanes.velocities[0][0])
        x = lanes.new_position[0]
        v = lanes.new_velocity[0]
        record_range(lanes, 0, Stretch(begin, tau, v_begin, x, v, step.h, step.bend), moved)
        record_others(lanes, step, past, moved)
