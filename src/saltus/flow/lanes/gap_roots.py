"""The roots of the gap in all lanes within a step: in which lanes a contact is met, and when.

Its compiled part goes into one module with that of `driver.py`.
"""

from __future__ import annotations

from saltus.flow.lanes.lane_steps import guess_from_end, only_root, root_move, series_value, shape
from saltus.flow.lanes.memory import TOUCH
from saltus.taylor import WIDTH, bits, fma, inline_jit, mask, maximum, one, rough_inverse, select, vector_lane, with_lane

# --- compiled from here on -----------------------------------------------------------------------------------------------


@inline_jit
def find_contact(lanes, gap, h, end, alive, patient):
    """The lanes in `alive` that meet a contact within the step of length h, those in doubt, and those that wait for a shorter
    step; the times, and the velocities at these times.

    `end` are the coordinate at the end of the step, measured from the contact, its velocity and acceleration there, and the bound
    of `sweep`. `patient` are the lanes that may wait for a shorter step if nothing is certain.
    """
    (x, v, _, bend), sign, skip, series = end, gap.sign, gap.skip, lanes.positions[gap.row]
    g0, g1, g2 = sign * gap.start, sign * series[1] * h, sign * series[2] * (h * h)
    cubic = (g0, g1, g2, sign * series[3] * (h * h * h))
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
            higher = sign * series[4] * (h * h) * (h * h), sign * series[5] * (h * h) * (h * h * h)
            guess = select(mask(short), guess_from_start(cubic, higher, flight) * h, guess)
            high = select(mask(short), 2.0 * flight * h, h)
        root, speed = only_root(lanes, gap, guess, high, hit)
        tau, at_root = select(mask(hit), root, h), select(mask(hit), speed, v)
    unclear = alive & ~doubtful & ~clear & ~single
    waits, unclear = unclear & patient, unclear & ~patient
    for i in range(WIDTH if unclear else 0):
        if (unclear >> i) & 1:
            lane = one(lanes, i)
            root = lane_root(lane, gap, h)
            if root == TOUCH:
                doubtful |= 1 << i
            elif root >= 0.0:
                hit |= 1 << i
                tau = with_lane(tau, i, root)
                at_root = with_lane(at_root, i, series_value(lane.velocities[gap.row], lanes.sizes.order, root))
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
def lane_root(lane, gap, h):
    """The first root of one lane's gap, NO_ROOT or TOUCH, by the scalar kernel's search (`handoff.first_root_of`)."""
    i, search = lane.index, lane.helpers.first_root
    start, sign = vector_lane(gap.start, i), vector_lane(gap.sign, i)
    return search(lane, gap.row, start, sign, vector_lane(h, i), (gap.skip >> i) & 1)
