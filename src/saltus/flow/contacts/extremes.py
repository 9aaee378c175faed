"""The extremes along a smooth segment of a motion with several contacts, in the places of
`SegmentExtremes`.

Its compiled part goes into one module with that of `segments.py`.
"""

from __future__ import annotations

import numpy as np

from saltus.flow.contacts.impacts import gap_series
from saltus.flow.kernel.contact_layout import (
    PartColumn,
    SegmentEnd,
    SegmentExtremes,
    SegmentPlan,
    Touch,
    contact_position,
)
from saltus.flow.kernel.layout import EventCode
from saltus.flow.kernel.roots import NOISE, horner, roots_within, scale_gap
from saltus.taylor import lean_jit

# --- compiled from here on ---------------------------------------------------

# a gap and a speed, in natural units, below which a contact opens from rest after an impact without
# restitution
AT_REST = 1e-9
HARDLY_OPEN = 1e-3  # a time in which a gap hardly opens, in natural units
# share of a segment at both of its ends in which no extremum is looked for: guards are 0 there
ENDS = 1e-6


@lean_jit
def find_minimum(motion, c, t, h):
    """Update `motion.least`, a least inner minimum and its time, with the minima of a series within
    a step.
    """
    order = motion.order
    poly = motion.polynomial
    roots = motion.turns
    least = motion.least
    size = abs(c[0])
    for k in range(1, order + 1):
        poly[k - 1] = k * c[k] * h**k
        size += abs(c[k] * h**k)
    for i in range(roots_within(poly, order - 1, roots, NOISE * size)):
        turn = 0.0
        value = horner(c, order, roots[i] * h)
        for k in range(order - 1, 0, -1):
            turn = turn * roots[i] + k * poly[k]
        if turn > 0.0 and value < least[0]:
            least[0] = value
            least[1] = t + roots[i] * h


@lean_jit
def from_rest(guard, units):
    """Make 0 what rounding leaves of the first terms of a gap that opens from rest: its speed, and
    its acceleration after a release. They would give it minima just behind the event. Elastic
    forces of stiff modes leave more of the acceleration, `units[3]`.
    """
    length = units[0]
    time = units[1]
    at_rest = AT_REST * length
    if abs(guard[0]) < at_rest and abs(guard[1]) * time < at_rest:
        guard[1] = 0.0
        if abs(guard[2]) * time**2 < max(at_rest, units[3] * length):
            guard[2] = 0.0


@lean_jit
def unit_of(units, place):
    """The unit of a minimum: `units` are the natural ones of length, time and force."""
    if place == SegmentExtremes.GAP:
        return units[0]
    return units[2]


@lean_jit
def extremes_at_step(motion, t, h, begin, end, after_event, units, seen):
    """Update the extremes with a step: extrema of the coordinates, inner minima of the guards,
    least values of the margins. The segment begins at an event if `after_event`.
    """
    order = motion.order
    own = motion.own
    count = motion.contacts.shape[0]
    poly = motion.polynomial
    roots = motion.turns
    least = motion.least
    for a in range(own):
        q = motion.coordinate_series[a]
        size = 0.0
        scale_gap(motion.velocity_series[a], 0, order, h, poly)
        for k in range(order + 1):
            size += abs(poly[k])
        for i in range(roots_within(poly, order, roots, NOISE * size) + 2):
            u = 0.0 if i == 0 else 1.0 if i == 1 else roots[i - 2]
            x = horner(q, order, u * h)
            seen[SegmentExtremes.TOP] = max(seen[SegmentExtremes.TOP], x)
            seen[SegmentExtremes.BOTTOM] = min(seen[SegmentExtremes.BOTTOM], x)
    for i in range(count):
        guard = motion.gap_series
        if motion.contacts[i, PartColumn.STATE] == Touch.CLOSED:
            guard = motion.margin_series[i]
        else:
            gap_series(motion, i, contact_position(motion, i), order, guard)
            if after_event and t == begin:
                from_rest(guard, units)
        least[0] = np.inf
        least[1] = 0.0
        find_minimum(motion, guard, t, h)
        place = (
            SegmentExtremes.FORCE
            if motion.contacts[i, PartColumn.STATE] == Touch.CLOSED
            else SegmentExtremes.GAP
        )
        inside = ENDS * (end - begin) < least[1] - begin < (1.0 - ENDS) * (end - begin)
        value = least[0] / unit_of(units, place)
        if inside and value < seen[place]:
            seen[place] = value
            seen[place + 1] = least[1]
            seen[place + 2] = i
    for j in range(count, motion.margin_count):
        place = SegmentExtremes.MARGINS + j - count
        m = motion.margin_series[j]
        least[0] = min(m[0], horner(m, order, h))
        find_minimum(motion, m, t, h)
        seen[place] = min(seen[place], least[0])


@lean_jit
def extremes_at_start(motion, hit, units, seen):
    """Begin the extremes of a segment: `PULL` is the least of the reactions of closed contacts and
    of the acceleration with which the contact `hit` opens, if it opens from rest."""
    length = units[0]
    time = units[1]
    for k in range(seen.size):
        seen[k] = np.inf
    seen[SegmentExtremes.TOP] = -np.inf
    for i in range(motion.contacts.shape[0]):
        pull = np.inf
        coordinate = motion.contacts[i, PartColumn.COORDINATE]
        if motion.contacts[i, PartColumn.STATE] == Touch.CLOSED:
            pull = motion.margin_series[i, 0] / unit_of(units, SegmentExtremes.PULL)
        elif i == hit and abs(motion.velocities[coordinate]) * time < AT_REST * length:
            pull = motion.signs[i] * motion.acceleration_series[coordinate, 0] * time**2 / length
        if pull < seen[SegmentExtremes.PULL]:
            seen[SegmentExtremes.PULL] = pull
            seen[SegmentExtremes.PULL + 1] = i


@lean_jit
def extremes_at_section(motion, t, units, seen):
    """Update the extremes with the guards at the start of a segment without event there: a minimum
    may lie just at its start.
    """
    count = motion.contacts.shape[0]
    for i in range(count):
        closed = motion.contacts[i, PartColumn.STATE] == Touch.CLOSED
        x = motion.coordinates[motion.contacts[i, PartColumn.COORDINATE]]
        gap = motion.signs[i] * (x - contact_position(motion, i))
        value = motion.margin_series[i, 0] if closed else gap
        place = SegmentExtremes.FORCE if closed else SegmentExtremes.GAP
        value /= unit_of(units, place)
        if value < seen[place]:
            seen[place] = value
            seen[place + 1] = t
            seen[place + 2] = i


@lean_jit
def extremes_at_end(motion, released, units, seen):
    """Update `TAIL`, the least reaction at the end of a segment of all closed contacts but the one
    that is released there.
    """
    for i in range(motion.contacts.shape[0]):
        reaction = motion.margin_series[i, 0] / unit_of(units, SegmentExtremes.TAIL)
        if (
            motion.contacts[i, PartColumn.STATE] == Touch.CLOSED
            and i != released
            and reaction < seen[SegmentExtremes.TAIL]
        ):
            seen[SegmentExtremes.TAIL] = reaction
            seen[SegmentExtremes.TAIL + 1] = i


@lean_jit
def gap_beside(motion, plan, s, duration, ends, units, seen):
    """Update `BESIDE`, the least gap at the impact with which segment s of the plan ends, of
    another contact whose speed the impact changes.

    Such a gap may have its minimum at the impact, which no smooth segment shows. A gap that has
    opened at the start of the segment is divided by the power of the duration with which it grows;
    very short segments are skipped, where only rounding would be left.
    """
    own = motion.own
    count = motion.contacts.shape[0]
    length = units[0]
    lasts = duration / units[1]
    hit = plan[s, SegmentPlan.CONTACT]
    released = plan[s - 1, SegmentPlan.KIND] == EventCode.RELEASE
    for i in range(count):
        if i == hit or plan[s, SegmentPlan.ALONG] >> i & 1 or motion.coupling[i, hit] == 0.0:
            continue
        sign = motion.signs[i]
        place = SegmentEnd.NUMBERS + motion.contacts[i, PartColumn.COORDINATE]
        position = contact_position(motion, i)
        gap = sign * (ends[place + 4 * own] - position) / length
        if sign * (ends[place] - position) < AT_REST * length:
            if not lasts > HARDLY_OPEN:
                continue
            speed = abs(ends[place + own]) * units[1] / length
            power = 1 if speed >= AT_REST else 3 if released else 2
            gap /= lasts**power
        seen[SegmentExtremes.BESIDE] = min(seen[SegmentExtremes.BESIDE], gap)
