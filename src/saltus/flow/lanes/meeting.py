"""The roots of the gap in all lanes within a step: in which lanes a contact is met, and when.

Its compiled part goes into one module with that of `driver.py`.
"""

from __future__ import annotations

from saltus.flow.kernel.memory_layout import SERIES_LENGTH, LanePart
from saltus.flow.lanes.lane_layout import TOUCH, Helper
from saltus.flow.lanes.lane_steps import guess_from_end, lane_value, only_root, root_move, shape
from saltus.taylor import WIDTH, bits, fma, inline_jit, load, mask, maximum, rough_inverse, select, vector_lane, with_lane

# --- compiled from here on -----------------------------------------------------------------------------------------------


@inline_jit
def meet(at, row, m, order, h, sign, start, end, bend, skip, alive, patient, helpers, space):
    """The lanes in `alive` that meet a contact within the step, those in doubt, and those that wait for a shorter step; the
    times, and the velocities at these times.

    The contact is met where `sign` times a coordinate, measured from the contact, falls to 0. `start` is this coordinate at the
    start of the step, `end` its position, velocity and acceleration at the end. `skip` are the lanes whose step starts at the
    contact; `patient` are those that may wait for a shorter step if nothing is certain.
    """
    x, v, _ = end
    g0, first = sign * start, at[LanePart.POSITIONS] + row * SERIES_LENGTH
    g1, g2 = sign * load(m, first + 1) * h, sign * load(m, first + 2) * (h * h)
    cubic = (g0, g1, g2, sign * load(m, first + 3) * (h * h * h))
    doubtful = ((bits(g0 <= 0.0) & ~skip) | (bits(g1 <= 0.0) & skip)) & alive
    clear, falls, concave, convex = shape(cubic, bend, skip)
    over = bits(sign * x <= 0.0)
    short, flight = short_flight(cubic, bend)
    short &= skip & alive & ~doubtful
    single = concave | (falls & ~skip) | (convex & over) | short
    hit = (alive & ~doubtful & ~clear & single & over) | short
    tau, at_root = h, v
    if hit:
        guess, high = flight, h
        if hit & ~short:
            guess = guess_from_end(cubic, end, sign, h)
        if short:
            higher = sign * load(m, first + 4) * (h * h) * (h * h), sign * load(m, first + 5) * (h * h) * (h * h * h)
            guess = select(mask(short), guess_from_start(cubic, higher, flight) * h, guess)
            high = select(mask(short), 2.0 * flight * h, h)
        root, speed = only_root(m, at, row, order, start, sign, guess, high, hit)
        tau, at_root = select(mask(hit), root, h), select(mask(hit), speed, v)
    velocities = at[LanePart.VELOCITIES] + row * SERIES_LENGTH
    unclear = alive & ~doubtful & ~clear & ~single
    waits, unclear = unclear & patient, unclear & ~patient
    for lane in range(WIDTH if unclear else 0):
        if (unclear >> lane) & 1:
            root = scalar_root(at, row, m, order, lane, h, sign, g0, (skip >> lane) & 1, helpers, space)
            if root == TOUCH:
                doubtful |= 1 << lane
            elif root >= 0.0:
                hit |= 1 << lane
                tau = with_lane(tau, lane, root)
                at_root = with_lane(at_root, lane, lane_value(m, velocities, order, lane, root))
    return hit, doubtful, waits, tau, at_root


@inline_jit
def short_flight(cubic, bend):
    """The lanes in which a flight from the contact certainly ends within twice the time that it would take if the acceleration
    stayed as at its start.

    Only this part of the step is considered, by the cubic and the bound of `shape`: later in the step the acceleration may change
    its sign. Returns bits of the lanes in which the gap is concave up to this time and negative then, and half of the time as a
    share of the step.
    """
    _, g1, g2, g3 = cubic
    flight = -g1 * rough_inverse(g2)
    end = 2.0 * flight
    rest, last = bend * (end * end), fma(6.0 * g3, end, 2.0 * g2)
    concave = bits(maximum(2.0 * g2, last) < -rest)
    over = bits(fma(fma(g3, end, g2), end, g1) + rest * end * (1.0 / 12.0) < 0.0)
    return concave & over & bits(end <= 1.0), flight


@inline_jit
def guess_from_start(cubic, higher, flight):
    """The end of a short flight, as a share of the step: one `root_move` from its end under the acceleration at its start.

    `higher` are the terms of fourth and fifth order of the gap; higher ones are neglected.
    """
    _, g1, g2, g3 = cubic
    g4, g5 = higher
    value = fma(fma(fma(fma(g5, flight, g4), flight, g3), flight, g2), flight, g1)
    slope = fma(fma(fma(4.0 * g5, flight, 3.0 * g4), flight, 2.0 * g3), flight, g2)
    second, third = fma(fma(6.0 * g5, flight, 3.0 * g4), flight, g3), fma(4.0 * g5, flight, g4)
    return flight + root_move(value, rough_inverse(slope), second, third)


@inline_jit
def scalar_root(at, row, m, order, lane, h, sign, g0, skip, helpers, space):
    """The first root of one lane's gap, NO_ROOT or TOUCH, by the scalar kernel's search."""
    step, gap_sign, start = vector_lane(h, lane), vector_lane(sign, lane), vector_lane(g0, lane)
    search = helpers[Helper.FIRST_ROOT]
    return search(m, at[LanePart.POSITIONS] + row * SERIES_LENGTH, order, lane, step, gap_sign, start, skip, space[0], space[1])
