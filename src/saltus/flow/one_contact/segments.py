"""Smooth segments with their derivatives: the parts of the boundary-value problem of a periodic
orbit (see `orbits/`).

A segment is the smooth motion on one side from one instant to another, whatever the sign of the
gap, forwards or backwards in time; it starts with an impact or from a state. If passing the contact
is no singularity (`ContactRegularity.CONTINUOUS`), it is the motion from a state through all sides.
The compiled parts of the kernel's files (see `kernel.py`) up to `impacts.py` and of this file are
compiled as one module, once for all models. Time is not counted by forcing periods here; loads with
records, which are not periodic, have no orbits.
"""

from __future__ import annotations

import math

import numpy as np

from saltus.flow.kernel.layout import (
    EventCode,
    Geometry,
    SegmentColumn,
    SegmentValue,
    side_of_state,
)
from saltus.flow.kernel.memory import (
    IMPACT_EQUATIONS,
    SEGMENTS,
    MotionMemory,
    OneContactSegmentParts,
)
from saltus.flow.kernel.roots import (
    NOISE,
    SIMPLE,
    contact_root,
    excluded,
    horner,
    roots_within,
    scale_gap,
)
from saltus.flow.kernel.steps import (
    column_step,
    columns_at_event,
    expand,
    leaps,
    log_of_tolerance,
    move,
    state_arrays,
    step_arrays,
    step_size,
)
from saltus.flow.one_contact.impacts import largest_terms, rate_of, set_state
from saltus.taylor import by_reference, cached_jit, jit, lean_jit

# --- compiled from here on ---------------------------------------------------

# in `spans`: times, and the gap's speed before the impact that starts it
SEGMENT_START = 0
SEGMENT_END = 1
APPROACH = 2
# in `sides`: the side before that impact (0: starts from a state), and the side of the segment (0:
# all)
BEFORE = 0
ALONG = 1
# A slower passage gets the tangent of one with this speed, as a share of the speed that the pull at
# the contact gives in the natural time: near a grazing two passages cancel, with a rounding of
# 1e-16 / speed.
SLOWEST = 1e-9
MOST_STEPS = 100_000  # of one segment
# a segment's duration times the forcing frequency, below which the derivatives of its quotient are
# those of its beginning
SHORT = 1e-6


@lean_jit
def widen(seen, x):
    """Let the range of the coordinates contain a value."""
    seen[SegmentColumn.HIGHEST], seen[SegmentColumn.LOWEST] = (
        max(seen[SegmentColumn.HIGHEST], x),
        min(seen[SegmentColumn.LOWEST], x),
    )


@lean_jit
def extremes_of_other(motion, a, h, roots, seen):
    """Update the extremes with the range of a coordinate that has no contact."""
    order = motion.order
    poly = motion.polynomial
    q = motion.coordinate_series[a]
    scale_gap(motion.velocity_series[a], 0, order, h, poly)
    size = 0.0
    for k in range(order + 1):
        size += abs(poly[k])
    for i in range(roots_within(poly, order, roots, NOISE * size) + 2):
        x = q[0] if i == 0 else horner(q, order, h if i == 1 else roots[i - 2] * h)
        widen(seen, x)


@lean_jit
def extremes_in_step(motion, side, t, h, roots, seen):
    """Update the extremes with a step of a segment: extrema of the coordinates, minima of the gap
    and of the margins.
    """
    q = motion.coordinate_series
    m = motion.margin_series
    order = motion.order
    poly = motion.polynomial
    widen(seen, q[0, 0])
    scale_gap(motion.velocity_series[0], 0, order, h, poly)
    rate = rate_of(motion, side) if motion.sides > 0 else 1.0
    seen[SegmentColumn.DEEPEST] = max(
        seen[SegmentColumn.DEEPEST], rate * (q[0, 0] - motion.geometry[Geometry.CONTACT])
    )
    size = 0.0
    for k in range(order + 1):
        size += abs(poly[k])
    for i in range(roots_within(poly, order, roots, NOISE * size)):
        x = horner(q[0], order, roots[i] * h)
        widen(seen, x)
        gap = rate * (x - motion.geometry[Geometry.CONTACT])
        seen[SegmentColumn.DEEPEST] = max(seen[SegmentColumn.DEEPEST], gap)
        turn = 0.0
        for k in range(order, 0, -1):
            turn = turn * roots[i] + k * poly[k]
        if motion.sides > 0 and rate * turn > 0.0 and gap < seen[SegmentColumn.LOWEST_GAP]:
            seen[SegmentColumn.LOWEST_GAP] = gap
            seen[SegmentColumn.LOWEST_GAP_TIME] = t + roots[i] * h
    for a in range(1, motion.own):
        extremes_of_other(motion, a, h, roots, seen)
    for j in range(motion.margin_count):
        scale_gap(m[j], 0, order, h, poly)
        poly[0] -= seen[SegmentColumn.LEAST_MARGIN + j]
        if excluded(poly, order):
            continue  # it stays above its least value so far
        least = min(m[j, 0], horner(m[j], order, h))
        size = abs(m[j, 0])
        for k in range(1, order + 1):
            poly[k - 1] = k * poly[k]
            size += abs(poly[k - 1])
        for i in range(roots_within(poly, order - 1, roots, NOISE * size)):
            least = min(least, horner(m[j], order, roots[i] * h))
        seen[SegmentColumn.LEAST_MARGIN + j] = min(seen[SegmentColumn.LEAST_MARGIN + j], least)


@lean_jit
def start_by_impact(motion, t, side, speed):
    """The state just after an impact, with the columns for d/d(speed), d/d(start) and the
    parameters; returns (side, dv+/dt).
    """
    inward = -math.copysign(1.0, rate_of(motion, side))
    for j in range(2 * motion.dof):
        motion.state[j] = 0.0
    motion.velocities[0] = inward * speed
    motion.velocities[1] = inward
    next_side, after = motion.reset(
        t, motion.origin, inward * speed, side, motion.env, motion.piece
    )
    columns_at_event(motion, EventCode.RESET_SLOPES, 0, t, side)
    set_state(motion, motion.geometry[Geometry.CONTACT], after)
    drift = motion.shifts[1]
    expand(motion, t, next_side, 0)
    # the column of the start: the term of the equation of motion
    motion.coordinates[2] = -motion.velocities[0]
    motion.velocities[2] = drift - motion.acceleration_series[0, 0]
    return next_side, drift


@lean_jit
def start_from_state(motion, t, side, given):
    """A given state, coordinates first, with the unit columns of its own derivatives."""
    own = motion.own
    for j in range(2 * motion.dof):
        motion.state[j] = 0.0
    for i in range(own):
        motion.coordinates[i], motion.velocities[i] = given[i], given[own + i]
        motion.coordinates[own * (1 + i) + i] = motion.velocities[own * (1 + own + i) + i] = 1.0
    expand(motion, t, side, 0)


@lean_jit
def segment_step(motion, t, end, side, size):
    """The absolute length of the step that the series of a segment allow."""
    log_tol = log_of_tolerance(motion)
    natural = step_size(motion.velocity_series[: motion.own], motion.order, size, log_tol)
    natural = min(natural, column_step(motion))
    while motion.checked > 0 and end >= t:
        terms = largest_terms(motion, side)
        if not leaps(motion, t, side, min(natural, end - t), size, terms):
            break
        natural = 0.5 * min(natural, end - t)
    return natural


@lean_jit
def follow(motion, begin, end, side, roots, seen):
    """Follow one segment. Returns the quotient (x - contact) / duration of its first coordinate, or
    nan if it cannot be followed."""
    order = motion.order
    t = begin
    forwards = end >= begin
    recording = seen.size > 1
    quotient = math.nan
    for count in range(MOST_STEPS):
        size = expand(motion, t, side, order)
        natural = segment_step(motion, t, end, side, size)
        if not natural > 0.0:
            return math.nan
        last = natural >= abs(end - t)
        h = end - t if last else (natural if forwards else -natural)
        if recording and h > 0.0:
            extremes_in_step(motion, side, t, h, roots, seen)
        # from the series itself, because x - contact loses digits in short segments
        if count == 0 and last:
            quotient = horner(motion.coordinate_series[0, 1:], order - 1, h)
        move(motion, h, motion.dof)
        if last:
            x = motion.coordinates[0]
            if recording:
                widen(seen, x)
            return (
                quotient if count == 0 else (x - motion.geometry[Geometry.CONTACT]) / (end - begin)
            )
        t += h
    return math.nan


@lean_jit
def pass_contact(motion, t, side):
    """Pass through the contact with unchanged velocity, and transform the tangent; returns the next
    side, or at a touch this one."""
    inward = -math.copysign(1.0, rate_of(motion, side))
    velocity = motion.velocities[0]
    if not inward * velocity > 0.0:
        set_state(motion, motion.geometry[Geometry.CONTACT], velocity)
        return side
    pull = abs(motion.acceleration_series[0, 0])
    slowest = SLOWEST * pull * motion.natural_time
    motion.velocities[0] = inward * max(inward * velocity, slowest)
    columns_at_event(motion, EventCode.IMPACT, 0, t, side)
    set_state(motion, motion.geometry[Geometry.CONTACT], velocity)
    return -side


@lean_jit
def follow_through(motion, begin, end, side, roots, seen):
    """Follow one segment through all sides of a continuous contact. Returns the side at its end, or
    0 if it cannot be followed."""
    order = motion.order
    t = begin
    skip = 0
    first = np.inf
    recording = seen.size > 1
    for _ in range(MOST_STEPS):
        size = expand(motion, t, side, order)
        natural = segment_step(motion, t, end, side, size)
        if not natural > 0.0:
            return 0.0
        h = min(natural, end - t)
        kind, u, _ = contact_root(motion.gap_series, skip, order, h, motion.polynomial)
        tau = u * h if kind == SIMPLE else h
        if recording:
            extremes_in_step(motion, side, t, tau, roots, seen)
        move(motion, tau, motion.dof)
        last, t, skip = kind != SIMPLE and h == end - t, t + tau, 0
        if kind == SIMPLE:
            following = pass_contact(motion, t, side)
            if recording and following != side:
                if seen[SegmentColumn.CROSSINGS] == 0.0:
                    # On an orbit, the arc before the first passage continues the one after the
                    # last.
                    first = seen[SegmentColumn.DEEPEST]
                else:
                    seen[SegmentColumn.SHALLOWEST] = min(
                        seen[SegmentColumn.SHALLOWEST], seen[SegmentColumn.DEEPEST]
                    )
                seen[SegmentColumn.CROSSINGS], seen[SegmentColumn.DEEPEST] = (
                    seen[SegmentColumn.CROSSINGS] + 1.0,
                    -np.inf,
                )
            side = following
            skip = 1
        if recording:
            widen(seen, motion.coordinates[0])
        if last:
            if recording and seen[SegmentColumn.CROSSINGS] > 0.0:
                seen[SegmentColumn.SHALLOWEST] = min(
                    seen[SegmentColumn.SHALLOWEST], max(first, seen[SegmentColumn.DEEPEST])
                )
            return side
    return 0.0


@lean_jit
def copy_state(motion, ends, columns, first):
    """Put coordinates, velocities and accelerations into `ends` from `first` on, and into `columns`
    the tangent's columns.
    """
    own = motion.own
    for i in range(own):
        ends[first + i], ends[first + own + i] = motion.coordinates[i], motion.velocities[i]
        ends[first + 2 * own + i] = motion.acceleration_series[i, 0]
        for j in range(motion.columns):
            columns[i, j] = motion.coordinates[own * (1 + j) + i]
            columns[own + i, j] = motion.velocities[own * (1 + j) + i]


@jit
def follow_segments_with(numbers, parts, request, results):
    """`follow_segments` with the parts of the motion's memory in one named tuple."""
    motion = by_reference(MotionMemory(numbers, parts))
    own = numbers.own
    spans = request.spans
    sides = request.sides
    states = request.states
    ends = results.ends
    columns = results.columns
    extremes = results.extremes
    roots = np.zeros(motion.order + 2)
    nothing = np.zeros(1)
    recording = extremes.shape[0] > 0
    for s in range(spans.shape[0]):
        begin = spans[s, SEGMENT_START]
        end = spans[s, SEGMENT_END]
        side = float(sides[s, ALONG])
        drift = 0.0
        if not math.isfinite(end - begin):
            return s
        through = sides[s, BEFORE] == 0 and sides[s, ALONG] == 0
        if through:
            _, start = side_of_state(motion.sides, states[s, 0], states[s, own], motion.geometry)
            side = float(start)
        if sides[s, BEFORE] != 0:
            side, drift = start_by_impact(
                motion, begin, float(sides[s, BEFORE]), spans[s, APPROACH]
            )
        else:
            start_from_state(motion, begin, side, states[s])
        copy_state(motion, ends[s], columns[s, 2 * own :], SegmentValue.FIRST_STATE + 3 * own)
        if recording:
            extremes[s] = np.inf
            extremes[s, SegmentColumn.HIGHEST] = -np.inf
            extremes[s, SegmentColumn.CROSSINGS] = 0.0
            extremes[s, SegmentColumn.DEEPEST] = -np.inf
        seen = extremes[s] if recording else nothing
        if through:
            side = follow_through(motion, begin, end, side, roots, seen)
            ends[s, SegmentValue.QUOTIENT] = math.nan if side == 0.0 else 0.0
        else:
            ends[s, SegmentValue.QUOTIENT] = follow(motion, begin, end, side, roots, seen)
        ends[s, SegmentValue.RESET_DRIFT] = drift
        expand(motion, end, side, 0)
        copy_state(motion, ends[s], columns[s], SegmentValue.FIRST_STATE)
        if not math.isfinite(ends[s, SegmentValue.QUOTIENT]) or not math.isfinite(
            ends[s, SegmentValue.FIRST_STATE + 2 * own]
        ):
            return s
    return spans.shape[0]


@cached_jit(SEGMENTS, nogil=True)
def follow_segments(numbers, env, functions, request, results):
    """Follow all segments of `request`; returns how many could be followed.

    The derivatives of a segment that starts with an impact are to the speed before this impact, to
    its time and to the parameters; those of a segment that starts from a state (in `states`) are to
    this state and to the parameters. In `results`, `columns` has them for the end (first the
    coordinates, then the velocities), then for the start. `extremes` are recorded unless the array
    is empty. A segment with the side 0 goes through all sides.
    """
    record = numbers[0]
    state = state_arrays(record, np.zeros(2 * record.dof + record.columns))
    parts = OneContactSegmentParts(state, env, functions, step_arrays(record))
    return follow_segments_with(record, parts, request, results)


@cached_jit(IMPACT_EQUATIONS)
def impact_equations(request, followed, equations):
    """The equations of impacts, w / duration = 0 and -w' - v_next = 0 for each segment, and their
    derivatives.

    They are those of an `ImpactRequest`, whose segments have been `followed`, and are put into an
    `ImpactEquations`.
    """
    spans, signs, speeds, frequency, place = request
    ends, columns, _ = followed
    residual, here, there, parameters = equations
    for i in range(spans.shape[0]):
        begin = spans[i, SEGMENT_START]
        end = spans[i, SEGMENT_END]
        sign = signs[i]
        quotient = ends[i, SegmentValue.QUOTIENT]
        velocity = ends[i, SegmentValue.FIRST_STATE + 1]
        acceleration = ends[i, SegmentValue.FIRST_STATE + 2]
        duration = end - begin
        pull = 0.5 * ends[i, SegmentValue.FIRST_STATE + 5]
        column = columns[i]
        short = abs(duration) * frequency < SHORT
        residual[i, 0], residual[i, 1] = sign * quotient, -sign * velocity - speeds[i]
        by_speed = column[2 + 1, 0] if short else column[0, 0] / duration
        by_start = (
            ends[i, SegmentValue.RESET_DRIFT] - pull
            if short
            else (column[0, 1] + quotient) / duration
        )
        by_end = pull if short else (velocity - quotient) / duration
        here[i, 0, 0] = sign * by_start / frequency
        here[i, 1, 0] = -sign * column[1, 1] / frequency
        here[i, 0, 1] = sign * by_speed
        here[i, 1, 1] = -sign * column[1, 0]
        there[i, 0, 0] = sign * by_end / frequency
        there[i, 1, 0] = -sign * acceleration / frequency
        there[i, 0, 1] = 0.0
        there[i, 1, 1] = -1.0
        for j in range(2, column.shape[1]):
            by_value = column[3, j] if short else (column[0, j] - column[2, j]) / duration
            parameters[i, 0, j - 2], parameters[i, 1, j - 2] = sign * by_value, -sign * column[1, j]
        if place >= 0:  # derivatives to the frequency are at fixed phases, not at fixed times
            for row in range(2):
                parameters[i, row, place] -= here[i, row, 0] * begin + there[i, row, 0] * end
