"""Impacts in lanes of a model with several contacts: one contact closes, alone or while others are closed.

Its compiled part goes into one module with that of `contacts/lane_step.py`. The complementarity problem

    v+ = v- + M^-1 sum_i s_i J_i,    0 <= J _|_ (v+ + E v-) >= 0

is solved by trying an impulse at the contact that closes alone, then impulses at this and all closed contacts. Lanes in which
neither is a solution are solved one at a time (`contacts_handoff.py`).
"""

from __future__ import annotations

from saltus.flow.kernel.memory_layout import LanePart
from saltus.flow.lanes.lane_layout import Code, LaneSetting, Size, Slot
from saltus.taylor import absolute, bits, fma, inline_jit, lean_jit, load, mask, replace, select, splat, store

# --- compiled from here on -----------------------------------------------------------------------------------------------


@inline_jit
def closed_lanes(sizes, at, m, i):
    """Bits of the lanes in which a contact is closed."""
    row = sizes[Size.CONTACTS + 1 + i]
    start = load(m, at[LanePart.POSITION] + row) - load(m, at[LanePart.CONTACTS] + i)
    return bits(load(m, at[LanePart.FREE] + row) < 0.5) & bits(start * start <= 0.0)


@inline_jit
def closing_lanes(i, hit, which):
    """Bits of the lanes in which contact i is the one that closes."""
    return hit & bits(absolute(which - 1.0 * i) < 0.5)


@inline_jit
def aim(sizes, at, m, i, hit, which, speed):
    """The rate -E v- of a contact's gap after the impact, if the contact has an impulse."""
    count, factor = sizes[Size.CONTACTS], splat(0.0)
    for j in range(count):
        entry = load(m, at[LanePart.RESTITUTION] + count * i + j)
        factor = select(mask(closing_lanes(j, hit, which)), entry, factor)
    return factor * speed


@lean_jit
def resolve_impacts(code, sizes, at, m, settings, hit, which):
    """Apply the impact law in the lanes in `hit`, where the contact `which` closes, at the new state; returns the resolved lanes.

    Lanes are not resolved, and unchanged, if the speeds that are left are so small that an accumulation may end, or all 0.
    """
    code[Code.IMPACT](m)
    speed = splat(0.0)
    for i in range(sizes[Size.CONTACTS]):
        rate = (1.0 * sizes[Size.CONTACTS + 1 + sizes[Size.CONTACTS] + i]) * load(
            m, at[LanePart.NEW_VELOCITY] + sizes[Size.CONTACTS + 1 + i]
        )
        speed = select(mask(closing_lanes(i, hit, which)), -rate, speed)
    store(m, Slot.NEW_SPEED, speed)
    resolved, left = 0, hit & bits(speed > 0.0)
    for together in range(2):
        if left:
            give_impulses(sizes, at, m, together, left, which, speed)
            accepted = left & impulses_hold(sizes, at, m, settings, together, left, which, speed)
            take_impulses(sizes, at, m, together, accepted, which, speed)
            resolved |= accepted
            left &= ~accepted
    return resolved


@lean_jit
def give_impulses(sizes, at, m, together, hit, which, speed):
    """Solve for the jumps of all velocities: those at the acting contacts are given, and no impulse acts on the others."""
    own, count = sizes[Size.OWN], sizes[Size.CONTACTS]
    free, change = at[LanePart.IMPULSES], at[LanePart.IMPULSES] + own
    matrix = change + own
    for row in range(own):
        store(m, free + row, splat(1.0))
        store(m, change + row, splat(0.0))
    for i in range(count):
        row, acts = sizes[Size.CONTACTS + 1 + i], closing_lanes(i, hit, which)
        if together:
            acts |= closed_lanes(sizes, at, m, i) & hit
        after = (1.0 * sizes[Size.CONTACTS + 1 + count + i]) * aim(sizes, at, m, i, hit, which, speed)
        replace(m, free + row, mask(acts), splat(0.0))
        replace(m, change + row, mask(acts), after - load(m, at[LanePart.NEW_VELOCITY] + row))
    for row in range(own):
        known, here = splat(0.0), load(m, free + row)
        for column in range(own):
            entry = load(m, at[LanePart.MASS] + own * row + column)
            known = fma(entry, load(m, change + column) * (1.0 - load(m, free + column)), known)
            diagonal = 1.0 - here if row == column else splat(0.0)
            store(m, matrix + own * row + column, fma(entry, here * load(m, free + column), diagonal))
        replace(m, change + row, mask(bits(here > 0.5)), -known)
    eliminate(m, matrix, change, own)


@lean_jit
def eliminate(m, matrix, right, size):
    """Solve a linear system in place, without pivoting, which a positive definite matrix does not need."""
    for k in range(size):
        inverse = 1.0 / load(m, matrix + size * k + k)
        for row in range(k + 1, size):
            factor = load(m, matrix + size * row + k) * inverse
            for column in range(k + 1, size):
                entry = load(m, matrix + size * row + column)
                store(m, matrix + size * row + column, fma(-factor, load(m, matrix + size * k + column), entry))
            store(m, right + row, fma(-factor, load(m, right + k), load(m, right + row)))
    for k in range(size - 1, -1, -1):
        value = load(m, right + k)
        for column in range(k + 1, size):
            value = fma(-load(m, matrix + size * k + column), load(m, right + column), value)
        store(m, right + k, value / load(m, matrix + size * k + k))


@lean_jit
def impulses_hold(sizes, at, m, settings, together, hit, which, speed):
    """Bits of the lanes in which the jumps solve the problem, no slow speed is left, and some coordinate is free afterwards."""
    own, count = sizes[Size.OWN], sizes[Size.CONTACTS]
    change, rates, good, freed = at[LanePart.IMPULSES] + own, at[LanePart.IMPULSES] + own * (own + 2), hit, splat(1.0 * own)
    for i in range(count):
        row, closing = sizes[Size.CONTACTS + 1 + i], closing_lanes(i, hit, which)
        closed = closed_lanes(sizes, at, m, i) & hit
        acts = closing | closed if together else closing
        sign, aimed = 1.0 * sizes[Size.CONTACTS + 1 + count + i], aim(sizes, at, m, i, hit, which, speed)
        impulse = splat(0.0)
        for column in range(own):
            impulse = fma(load(m, at[LanePart.MASS] + own * row + column), load(m, change + column), impulse)
        rate = select(mask(acts), aimed, sign * load(m, change + row))
        store(m, rates + i, rate)
        solved = (acts & bits(sign * impulse >= 0.0)) | (closed & ~acts & bits(rate >= aimed))
        stays = bits(rate * rate <= 0.0)
        good &= (solved & (stays | bits(rate > settings[LaneSetting.SLOWEST_IMPACT]))) | ~(closing | closed)
        freed = select(mask((closing | closed) & stays), freed - 1.0, freed)
    return good & bits(freed > 0.5)


@lean_jit
def take_impulses(sizes, at, m, together, accepted, which, speed):
    """Put the state after the impact, and the closed contacts, into the accepted lanes."""
    own, count, chosen = sizes[Size.OWN], sizes[Size.CONTACTS], mask(accepted)
    change, rates, side = at[LanePart.IMPULSES] + own, at[LanePart.IMPULSES] + own * (own + 2), splat(1.0)
    for row in range(own):
        before = load(m, at[LanePart.NEW_VELOCITY] + row)
        replace(m, at[LanePart.AFTER_POSITION] + row, chosen, load(m, at[LanePart.NEW_POSITION] + row))
        replace(m, at[LanePart.AFTER_VELOCITY] + row, chosen, before + load(m, change + row))
    for i in range(count):  # all contacts before `free` changes: it still says which were closed
        closing, closed = closing_lanes(i, accepted, which), closed_lanes(sizes, at, m, i) & accepted
        stays = (closing | closed) & bits(absolute(load(m, rates + i)) <= 0.0)
        side = select(mask(stays), side + 1.0 * (1 << i), side)
        store(m, at[LanePart.IMPULSES] + i, select(mask(stays), splat(1.0), splat(0.0)))
        acts = mask(closing | closed) if together else mask(closing)
        row, rate = sizes[Size.CONTACTS + 1 + i], (1.0 * sizes[Size.CONTACTS + 1 + count + i]) * load(m, rates + i)
        replace(m, at[LanePart.AFTER_VELOCITY] + row, acts, rate + 0.0)
    for row in range(own):
        replace(m, at[LanePart.FREE] + row, chosen, splat(1.0))
    for i in range(count):
        stays = mask(accepted & bits(load(m, at[LanePart.IMPULSES] + i) > 0.5))
        replace(m, at[LanePart.FREE] + sizes[Size.CONTACTS + 1 + i], stays, splat(0.0))
    replace(m, Slot.NEW_SIDE, chosen, side)
