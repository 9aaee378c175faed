"""A step of all lanes of a model with one contact or none: the smooth motion up to the contact, and
impacts.

Its compiled part goes into one module with that of `programs/lane_driver.py`; `contacts/lane_step.py` takes
its place for other models.
"""

from __future__ import annotations

from saltus.flow.kernel.layout import CHATTER_SPEED, LOSSLESS, side_of_state
from saltus.flow.lane_steps.memory import FAST, SMALLEST_SHARE, Gap, Step, Stretch
from saltus.flow.lane_steps.sampling import pass_ends, record_others, record_range
from saltus.flow.lane_steps.steps import (
    both_at,
    commit,
    find_contact,
    margins_certain,
    natural_speeds,
    natural_step,
    note_impacts,
    rate_of_change,
    series_true,
    state_size,
    sweep,
)
from saltus.taylor import inline_jit, lean_jit
from saltus.taylor.lane_vectors import absolute, bits, fma, mask, minimum, select, splat

# --- compiled from here on ---------------------------------------------------


@inline_jit
def begin_contact(lane, env, state):
    """Tell a lane where its contact is; returns the mode in which a motion from this state begins,
    and its side.
    """
    numbers = lane.geometry[lane.index]
    geometry = lane.code.geometry
    geometry(env, numbers)
    lane.contact = numbers[0]
    lane.rate_up = numbers[1]
    lane.rate_down = numbers[2]
    return side_of_state(lane.sizes.sides, state[0], state[state.size // 2], numbers)


@inline_jit
def side_at_end(lane):
    """The side at the end of a motion."""
    return int(lane.side)


@inline_jit
def rate_on(lanes, side):
    """The gap's rate of change with the coordinate, on a side."""
    return select(mask(bits(side > 0.0)), lanes.rate_up, lanes.rate_down)


@inline_jit
def propose(lanes):
    """Compute the step of every lane up to its first contact, and put the new state into its slots.

    Returns bits of the lanes that hit, bits for the scalar kernel, bits of the lanes that wait for
    a shorter step, and the step.
    """
    series = lanes.code.series
    series(lanes.memory, lanes.places, lanes.sizes.order)
    size = state_size(lanes)
    share = lanes.step_share
    now = lanes.now
    limit = lanes.step_limit
    natural = share * natural_step(lanes, size)
    h = minimum(natural, limit - now)
    alive = lanes.busy & ~lanes.scalar
    sound = bits(natural > lanes.settings.shortest_step) & bits(size < FAST)
    contact = lanes.contact
    position = lanes.position[0]
    mean, v, a, bend = sweep(lanes, 0, h)
    if lanes.sizes.margins > 0:
        sound &= margins_certain(lanes, h)
    hit = 0
    waits = 0
    tau = h
    at_root = v
    if lanes.sizes.sides > 0:
        # a root depends on these alone
        sign = select(mask(bits(rate_on(lanes, lanes.side) > 0.0)), splat(1.0), splat(-1.0))
        # measured from the contact, so that a small gap keeps its digits
        start = position - contact
        gap = Gap(0, start, sign, lanes.at_contact)
        patient = bits(share > SMALLEST_SHARE)
        end = fma(mean, h, start), v, a, bend
        hit, doubtful, waits, tau, at_root = find_contact(
            lanes, gap, h, end, alive & sound, patient
        )
        sound &= ~doubtful
    impact = mask(hit)
    lanes.new_time = select(mask(bits(natural >= limit - now) & ~hit), limit, now + tau)
    lanes.new_position[0] = select(impact, contact, fma(mean, h, position))
    lanes.new_velocity[0] = select(impact, at_root, v)
    for row in range(1, lanes.sizes.rows):
        q, w = both_at(lanes, row, tau)
        lanes.new_position[row] = q
        lanes.new_velocity[row] = w
    if lanes.sizes.checked > 0:
        sound &= series_true(lanes, tau, size)
    lanes.step_share = select(mask(waits), 0.5 * share, splat(1.0))
    return hit & sound & alive, alive & ~sound & ~waits, waits, Step(h, tau, bend, splat(0.0))


@inline_jit
def reset(lanes, hit):
    """Apply the reset at the new state. Returns bits of the lanes that are resolved, bits for the
    scalar kernel, and bits of those that are captured."""
    impact = lanes.code.impact
    impact(lanes.memory, lanes.places)
    approach = rate_on(lanes, lanes.side) * lanes.new_velocity[0]
    speed = rate_on(lanes, lanes.new_side) * lanes.after_velocity[0]
    natural = natural_speeds(lanes)
    good = bits(approach < 0.0) & bits(speed > CHATTER_SPEED * natural) & hit
    slow = good & ~bits(speed > lanes.settings.slowest_impact * natural)
    if slow:
        good &= ~slow | loses_nothing(lanes, speed)
    captured = bits(speed < lanes.capture_speed) & good
    return good, hit & ~good, captured


@lean_jit
def loses_nothing(lanes, speed):
    """Bits of the lanes in which the next two impacts would not change the gap's `speed`, so that
    impacts do not accumulate.

    `impacts.accumulation` tests the same in the scalar kernel.
    """
    side = lanes.side
    before = lanes.new_velocity[0]
    impact = lanes.code.impact
    for _ in range(2):
        lanes.side = lanes.new_side
        lanes.new_velocity[0] = -lanes.after_velocity[0]
        impact(lanes.memory, lanes.places)
    loss = speed - rate_on(lanes, lanes.new_side) * lanes.after_velocity[0]
    lanes.side = side
    lanes.new_velocity[0] = before
    impact(lanes.memory, lanes.places)
    return bits(absolute(loss) < LOSSLESS * speed)


@inline_jit
def step_all(lanes):
    """One step of all lanes.

    Returns bits for the scalar kernel, bits captured, and bits past the end of their forcing
    period.
    """
    hit, doubtful, waits, step = propose(lanes)
    captured = 0
    resolved = hit
    if hit:
        rate = rate_on(lanes, lanes.side)
        pull = rate_of_change(lanes, lanes.velocities[0], step.taken)
        note_impacts(lanes, hit, rate * lanes.new_velocity[0], rate * pull)
        resolved, unsolved, captured = reset(lanes, hit)
        doubtful |= unsolved
    moved = lanes.busy & ~lanes.scalar & ~doubtful & ~waits
    begin = splat(0.0)
    v_begin = lanes.velocities[0][0]
    past = moved & bits(lanes.new_time > lanes.period_end)
    if past and lanes.sizes.ends_asked > 0:
        pass_ends(lanes, step, past)
        begin = select(mask(past), lanes.period_end - lanes.now, begin)
        v_begin = select(mask(past), lanes.ended_velocity[0], v_begin)
    if lanes.sizes.extrema > 0:
        x = lanes.new_position[0]
        v = lanes.new_velocity[0]
        stretch = Stretch(begin, step.taken, v_begin, x, v, step.h, step.bend)
        record_range(lanes, 0, stretch, moved)
        record_others(lanes, step, past, moved)
    commit(lanes, moved, resolved, absolute(lanes.new_velocity[0]))
    lanes.at_contact = (lanes.at_contact & ~moved) | resolved
    return doubtful, captured, past
