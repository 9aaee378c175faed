"""Impacts in lanes of a model with several contacts: one contact closes, alone or while others are
closed.

Its compiled part goes into one module with that of `contacts/lane_step.py`. The complementarity
problem

    v+ = v- + M^-1 sum_i s_i J_i,    0 <= J _|_ (v+ + E v-) >= 0

is solved by trying an impulse at the contact that closes alone, then impulses at this and all
closed contacts. Lanes in which neither is a solution are solved one at a time (`scalar_impact.py`).
"""

from __future__ import annotations

from saltus.flow.kernel.contact_layout import PartColumn, Touch
from saltus.flow.kernel.layout import LEAST_LOSS
from saltus.flow.lane_steps.memory import Closing
from saltus.taylor import inline_jit, lean_jit
from saltus.taylor.lane_vectors import absolute, bits, fma, mask, maximum, select, splat

# --- compiled from here on ---------------------------------------------------


@lean_jit
def write_closed(lane, contacts):
    """Tell the model's functions which coordinates of a lane are free."""
    for d in range(lane.sizes.local):
        lane.free[d] = 1.0
    for i in range(contacts.shape[0]):
        if contacts[i, PartColumn.STATE] == Touch.CLOSED:
            lane.free[contacts[i, PartColumn.COORDINATE]] = 0.0


@lean_jit
def read_contacts(lane, contacts):
    """Fill the scalar kernel's rows of contacts for a lane that moves smoothly; a gap that has just
    opened may still be 0.

    `WAITS` is kept: looking for the end of an accumulation too often could take as long as all its
    impacts.
    """
    for i in range(lane.sizes.contacts):
        coordinate = lane.sizes.coordinates[i]
        there = lane.position[coordinate] == lane.contacts[i]
        free = lane.free[coordinate] > 0.5
        contacts[i, PartColumn.COORDINATE] = coordinate
        contacts[i, PartColumn.STATE] = 1 if there and not free else 0
        contacts[i, PartColumn.SKIP] = 1 if there and free else 0
        contacts[i, PartColumn.REACHED] = contacts[i, PartColumn.EXCESS] = 0


@inline_jit
def closed_lanes(lanes, i):
    """Bits of the lanes in which a contact is closed."""
    row = lanes.sizes.coordinates[i]
    start = lanes.position[row] - lanes.contacts[i]
    return bits(lanes.free[row] < 0.5) & bits(start * start <= 0.0)


@inline_jit
def closing_lanes(closing, i):
    """Bits of the lanes in which contact i is the one that closes."""
    return closing.hit & bits(absolute(closing.contact - 1.0 * i) < 0.5)


@inline_jit
def acting_lanes(lanes, closing, i):
    """Bits of the lanes in which contact i has an impulse."""
    acts = closing_lanes(closing, i)
    return acts | (closed_lanes(lanes, i) & closing.hit) if closing.together else acts


@inline_jit
def aim(lanes, closing, i):
    """The rate -E v- of a contact's gap after the impact, if the contact has an impulse."""
    count = lanes.sizes.contacts
    factor = splat(0.0)
    for j in range(count):
        factor = select(mask(closing_lanes(closing, j)), lanes.restitution[count * i + j], factor)
    return factor * closing.speed


@lean_jit
def resolve_impacts(lanes, hit, which):
    """Apply the impact law in the lanes in `hit`, where the contact `which` closes, at the new
    state; returns the resolved lanes.

    Lanes are not resolved, and unchanged, if the speeds that are left are so small that an
    accumulation may end, or all 0.
    """
    speed = splat(0.0)
    matrices = lanes.code.impact
    matrices(lanes.memory, lanes.places)
    for i in range(lanes.sizes.contacts):
        rate = (1.0 * lanes.sizes.signs[i]) * lanes.new_velocity[lanes.sizes.coordinates[i]]
        speed = select(mask(hit & bits(absolute(which - 1.0 * i) < 0.5)), -rate, speed)
    lanes.new_speed = speed
    resolved = 0
    left = hit & bits(speed > 0.0)
    for together in range(2):
        if left:
            closing = Closing(left, which, speed, together)
            give_impulses(lanes, closing)
            accepted = left & impulses_hold(lanes, closing)
            take_impulses(lanes, Closing(accepted, which, speed, together))
            resolved |= accepted
            left &= ~accepted
    return resolved


@lean_jit
def give_impulses(lanes, closing):
    """Solve for the jumps of all velocities: those at the acting contacts are given, and no impulse
    acts on the others.
    """
    local = lanes.sizes.local
    free = lanes.impulse_free
    jump = lanes.jump
    matrix = lanes.matrix
    for row in range(local):
        free[row] = splat(1.0)
        jump[row] = splat(0.0)
    for i in range(lanes.sizes.contacts):
        row = lanes.sizes.coordinates[i]
        acts = mask(acting_lanes(lanes, closing, i))
        after = (1.0 * lanes.sizes.signs[i]) * aim(lanes, closing, i)
        free[row] = select(acts, splat(0.0), free[row])
        jump[row] = select(acts, after - lanes.new_velocity[row], jump[row])
    for row in range(local):
        known = splat(0.0)
        here = free[row]
        for column in range(local):
            entry = lanes.mass[local * row + column]
            known = fma(entry, jump[column] * (1.0 - free[column]), known)
            diagonal = 1.0 - here if row == column else splat(0.0)
            matrix[local * row + column] = fma(entry, here * free[column], diagonal)
        jump[row] = select(mask(bits(here > 0.5)), -known, jump[row])
    eliminate_in_lanes(matrix, jump, local)


@lean_jit
def eliminate_in_lanes(matrix, right, size):
    """Solve a linear system in place, without pivoting, which a positive definite matrix does not
    need.
    """
    for k in range(size):
        inverse = 1.0 / matrix[size * k + k]
        for row in range(k + 1, size):
            factor = matrix[size * row + k] * inverse
            for column in range(k + 1, size):
                entry = matrix[size * row + column]
                matrix[size * row + column] = fma(-factor, matrix[size * k + column], entry)
            right[row] = fma(-factor, right[k], right[row])
    for k in range(size - 1, -1, -1):
        value = right[k]
        for column in range(k + 1, size):
            value = fma(-matrix[size * k + column], right[column], value)
        right[k] = value / matrix[size * k + k]


@lean_jit
def impulses_hold(lanes, closing):
    """Bits of the lanes in which the jumps solve the problem, no slow speed is left, and some
    coordinate is free afterwards.
    """
    local = lanes.sizes.local
    jump = lanes.jump
    good = closing.hit
    count = lanes.sizes.contacts
    slow = lanes.settings.slowest_impact * lanes.fastest
    freed = splat(1.0 * lanes.sizes.own)
    for i in range(lanes.sizes.contacts):
        row = lanes.sizes.coordinates[i]
        aimed = aim(lanes, closing, i)
        sign = 1.0 * lanes.sizes.signs[i]
        concerned = closing_lanes(closing, i) | (closed_lanes(lanes, i) & closing.hit)
        acts = acting_lanes(lanes, closing, i)
        impulse = splat(0.0)
        for column in range(local):
            impulse = fma(lanes.mass[local * row + column], jump[column], impulse)
        rate = select(mask(acts), aimed, sign * jump[row])
        lanes.rates[i] = rate
        solved = (acts & bits(sign * impulse >= 0.0)) | (concerned & ~acts & bits(rate >= aimed))
        stays = bits(rate * rate <= 0.0)
        # `impacts.lost_share`
        lost = maximum(splat(LEAST_LOSS), 1.0 - lanes.restitution[count * i + i])
        good &= (solved & (stays | bits(rate > slow * lost))) | ~concerned
        freed = select(mask(concerned & stays), freed - 1.0, freed)
    return good & bits(freed > 0.5)


@lean_jit
def take_impulses(lanes, closing):
    """Put the state after the impact, and the closed contacts, into the lanes of `closing`."""
    chosen = mask(closing.hit)
    for row in range(lanes.sizes.own):
        after = lanes.new_velocity[row]
        if row < lanes.sizes.local:
            after = after + lanes.jump[row]
        lanes.after_position[row] = select(
            chosen, lanes.new_position[row], lanes.after_position[row]
        )
        lanes.after_velocity[row] = select(chosen, after, lanes.after_velocity[row])
    # all contacts before `free` changes: it still says which were closed
    for i in range(lanes.sizes.contacts):
        concerned = closing_lanes(closing, i) | (closed_lanes(lanes, i) & closing.hit)
        stays = mask(concerned & bits(absolute(lanes.rates[i]) <= 0.0))
        lanes.stays[i] = select(stays, splat(1.0), splat(0.0))
        row = lanes.sizes.coordinates[i]
        rate = (1.0 * lanes.sizes.signs[i]) * lanes.rates[i]
        lanes.after_velocity[row] = select(
            mask(acting_lanes(lanes, closing, i)), rate + 0.0, lanes.after_velocity[row]
        )
    for row in range(lanes.sizes.local):
        lanes.free[row] = select(chosen, splat(1.0), lanes.free[row])
    for i in range(lanes.sizes.contacts):
        row = lanes.sizes.coordinates[i]
        stays = mask(closing.hit & bits(lanes.stays[i] > 0.5))
        lanes.free[row] = select(stays, splat(0.0), lanes.free[row])
