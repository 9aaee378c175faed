"""Smooth segments with their derivatives: the parts of the boundary-value problem of a periodic orbit (see `orbits/`).

A segment is the smooth motion on one side from one instant to another, whatever the sign of the gap, forwards or backwards in
time; it starts with an impact or from a state. If passing the contact is no singularity (`ContactRegularity.CONTINUOUS`), it is
the motion from a state through all sides. The compiled parts of the kernel's files (see `kernel.py`) up to `chatter.py` and of
this file are compiled as one module, once for all models. Time is not counted by forcing periods here; loads with records, which
are not periodic, have no orbits.
"""

from __future__ import annotations

import math

import numpy as np

from saltus.flow.kernel.function_types import IMPACT_EQUATIONS, SEGMENTS
from saltus.flow.kernel.layout import ROUGHER, Geometry, ModelPart, SegmentColumn, SegmentValue, Setting, Where, Work
from saltus.flow.kernel.memory_layout import EventCode, State
from saltus.flow.kernel.roots import NOISE, SIMPLE, contact_root, excluded, horner, roots_within, scale_gap
from saltus.flow.kernel.steps import column_step, expand, leaps, move, step_size, work_arrays
from saltus.flow.one_contact.impacts import rate_of, set_state
from saltus.flow.one_contact.sides import side_of_state
from saltus.taylor import by_reference, cached_jit, jit, lean_jit

# --- compiled from here on -----------------------------------------------------------------------------------------------

SEGMENT_START, SEGMENT_END, APPROACH = 0, 1, 2  # in `spans`: times, and the gap's speed before the impact that starts it
BEFORE, ALONG = 0, 1  # in `sides`: the side before that impact (0: starts from a state), and the side of the segment (0: all)
# A slower passage gets the tangent of one with this speed: near a grazing two passages cancel, with a rounding of 1e-16 / speed.
SLOWEST = 1e-9
MOST_STEPS = 100_000  # of one segment
SHORT = 1e-6  # a segment's duration below which the derivatives of its quotient are those of its beginning


@lean_jit
def extremes_of_other(q, v, h, order, roots, poly, seen):
    """Update the extremes with the range of a coordinate that has no contact."""
    scale_gap(v, 0, order, h, poly)
    size = 0.0
    for k in range(order + 1):
        size += abs(poly[k])
    for i in range(roots_within(poly, order, roots, NOISE * size) + 2):
        x = q[0] if i == 0 else horner(q, order, h if i == 1 else roots[i - 2] * h)
        seen[SegmentColumn.HIGHEST], seen[SegmentColumn.LOWEST] = (
            max(seen[SegmentColumn.HIGHEST], x),
            min(seen[SegmentColumn.LOWEST], x),
        )


@lean_jit
def extremes_in_step(where, model, work, side, t, h, order, roots, seen):
    """Update the extremes with a step of a segment: extrema of the coordinates, minima of the gap and of the margins."""
    q, v, m, poly = work[Work.POSITIONS], work[Work.VELOCITIES], work[Work.MARGINS], work[Work.POLYNOMIAL]
    seen[SegmentColumn.HIGHEST], seen[SegmentColumn.LOWEST] = (
        max(seen[SegmentColumn.HIGHEST], q[0, 0]),
        min(seen[SegmentColumn.LOWEST], q[0, 0]),
    )
    scale_gap(v[0], 0, order, h, poly)
    rate = rate_of(model, side) if where[Where.SIDES] > 0 else 1.0
    seen[SegmentColumn.DEEPEST] = max(seen[SegmentColumn.DEEPEST], rate * (q[0, 0] - model[ModelPart.GEOMETRY][Geometry.CONTACT]))
    size = 0.0
    for k in range(order + 1):
        size += abs(poly[k])
    for i in range(roots_within(poly, order, roots, NOISE * size)):
        x = horner(q[0], order, roots[i] * h)
        seen[SegmentColumn.HIGHEST], seen[SegmentColumn.LOWEST] = (
            max(seen[SegmentColumn.HIGHEST], x),
            min(seen[SegmentColumn.LOWEST], x),
        )
        gap = rate * (x - model[ModelPart.GEOMETRY][Geometry.CONTACT])
        seen[SegmentColumn.DEEPEST] = max(seen[SegmentColumn.DEEPEST], gap)
        turn = 0.0
        for k in range(order, 0, -1):
            turn = turn * roots[i] + k * poly[k]
        if where[Where.SIDES] > 0 and rate * turn > 0.0 and gap < seen[SegmentColumn.LOWEST_GAP]:
            seen[SegmentColumn.LOWEST_GAP], seen[SegmentColumn.LOWEST_GAP_TIME] = gap, t + roots[i] * h
    for a in range(1, where[Where.OWN]):
        extremes_of_other(q[a], v[a], h, order, roots, poly, seen)
    for j in range(where[Where.MARGINS]):
        scale_gap(m[j], 0, order, h, poly)
        poly[0] -= seen[SegmentColumn.LEAST_MARGIN + j]
        if excluded(poly, order):
            continue  # it stays above its least value so far
        least, size = min(m[j, 0], horner(m[j], order, h)), abs(m[j, 0])
        for k in range(1, order + 1):
            poly[k - 1] = k * poly[k]
            size += abs(poly[k - 1])
        for i in range(roots_within(poly, order - 1, roots, NOISE * size)):
            least = min(least, horner(m[j], order, roots[i] * h))
        seen[SegmentColumn.LEAST_MARGIN + j] = min(seen[SegmentColumn.LEAST_MARGIN + j], least)


@lean_jit
def start_by_impact(where, state, env, model, work, t, side, speed):
    """The state just after an impact, with the columns for d/d(speed), d/d(start) and the parameters; returns (side, dv+/dt)."""
    inward = -math.copysign(1.0, rate_of(model, side))
    coordinates, velocities = State.COORDINATES, State.COORDINATES + where[Where.DOF]
    for j in range(2 * where[Where.DOF]):
        state[coordinates + j] = 0.0
    state[velocities], state[velocities + 1] = inward * speed, inward
    next_side, after = model[ModelPart.RESET](t, 0.0, inward * speed, side, env, 0)
    model[ModelPart.TANGENT](EventCode.RESET_SLOPES, 0, t, 0.0, side, env, 0, state)
    set_state(where, state, model[ModelPart.GEOMETRY][Geometry.CONTACT], after)
    drift = state[velocities + where[Where.DOF] + 1]
    expand(where, state, env, model, work, t, 0.0, next_side, 0)
    state[coordinates + 2] = -state[velocities]  # the column of the start: the term of the equation of motion
    state[velocities + 2] = drift - work[Work.ACCELERATIONS][0, 0]
    return next_side, drift


@lean_jit
def start_from_state(where, state, env, model, work, t, side, given):
    """A given state, coordinates first, with the unit columns of its own derivatives."""
    own, coordinates, velocities = where[Where.OWN], State.COORDINATES, State.COORDINATES + where[Where.DOF]
    for j in range(2 * where[Where.DOF]):
        state[coordinates + j] = 0.0
    for i in range(own):
        state[coordinates + i], state[velocities + i] = given[i], given[own + i]
        state[coordinates + own * (1 + i) + i] = state[velocities + own * (1 + own + i) + i] = 1.0
    expand(where, state, env, model, work, t, 0.0, side, 0)


@lean_jit
def segment_step(where, settings, env, model, work, t, end, side, size):
    """The absolute length of the step that the series of a segment allow."""
    q, v, a = work[Work.POSITIONS], work[Work.VELOCITIES], work[Work.ACCELERATIONS]
    order, tol = where[Where.ORDER], settings[Setting.TOLERANCE]
    natural = step_size(v[: where[Where.OWN]], order, size, tol)
    natural = min(natural, column_step(where, q, v, a, order, ROUGHER * tol))
    while where[Where.CHECKED] > 0 and end >= t:
        if not leaps(where, env, model, work, t, 0.0, side, min(natural, end - t), size, tol):
            break
        natural = 0.5 * min(natural, end - t)
    return natural


@lean_jit
def follow(where, state, settings, env, model, work, begin, end, side, recording, roots, seen):
    """Follow one segment. Returns the quotient (x - contact) / duration of its first coordinate, or nan if it cannot be
    followed."""
    q, v = work[Work.POSITIONS], work[Work.VELOCITIES]
    order, t, forwards = where[Where.ORDER], begin, end >= begin
    quotient = math.nan
    for count in range(MOST_STEPS):
        size = expand(where, state, env, model, work, t, 0.0, side, order)
        natural = segment_step(where, settings, env, model, work, t, end, side, size)
        if not natural > 0.0:
            return math.nan
        last = natural >= abs(end - t)
        h = end - t if last else (natural if forwards else -natural)
        if recording and h > 0.0:
            extremes_in_step(where, model, work, side, t, h, order, roots, seen)
        if count == 0 and last:  # from the series itself, because x - contact loses digits in short segments
            quotient = horner(q[0, 1:], order - 1, h)
        move(where, state, q, v, h)
        if last:
            x = state[State.COORDINATES]
            if recording:
                seen[SegmentColumn.HIGHEST], seen[SegmentColumn.LOWEST] = (
                    max(seen[SegmentColumn.HIGHEST], x),
                    min(seen[SegmentColumn.LOWEST], x),
                )
            return quotient if count == 0 else (x - model[ModelPart.GEOMETRY][Geometry.CONTACT]) / (end - begin)
        t += h
    return math.nan


@lean_jit
def pass_contact(where, state, env, model, t, side):
    """Pass through the contact with unchanged velocity, and transform the tangent; returns the next side, or at a touch this
    one."""
    place, inward = State.COORDINATES + where[Where.DOF], -math.copysign(1.0, rate_of(model, side))
    velocity = state[place]
    if not inward * velocity > 0.0:
        set_state(where, state, model[ModelPart.GEOMETRY][Geometry.CONTACT], velocity)
        return side
    state[place] = inward * max(inward * velocity, SLOWEST)
    model[ModelPart.TANGENT](EventCode.IMPACT, 0, t, 0.0, side, env, 0, state)
    set_state(where, state, model[ModelPart.GEOMETRY][Geometry.CONTACT], velocity)
    return -side


@lean_jit
def follow_through(where, state, settings, env, model, work, begin, end, side, recording, roots, seen):
    """Follow one segment through all sides of a continuous contact. Returns the side at its end, or 0 if it cannot be
    followed."""
    order, t, skip, first = where[Where.ORDER], begin, 0, np.inf
    for _ in range(MOST_STEPS):
        size = expand(where, state, env, model, work, t, 0.0, side, order)
        natural = segment_step(where, settings, env, model, work, t, end, side, size)
        if not natural > 0.0:
            return 0.0
        h = min(natural, end - t)
        kind, u, _ = contact_root(work[Work.GAP], skip, order, h, work[Work.POLYNOMIAL])
        tau = u * h if kind == SIMPLE else h
        if recording:
            extremes_in_step(where, model, work, side, t, tau, order, roots, seen)
        move(where, state, work[Work.POSITIONS], work[Work.VELOCITIES], tau)
        last, t, skip = kind != SIMPLE and h == end - t, t + tau, 0
        if kind == SIMPLE:
            following = pass_contact(where, state, env, model, t, side)
            if recording and following != side:
                if (
                    seen[SegmentColumn.CROSSINGS] == 0.0
                ):  # on an orbit, the arc before the first passage continues the one after the last
                    first = seen[SegmentColumn.DEEPEST]
                else:
                    seen[SegmentColumn.SHALLOWEST] = min(seen[SegmentColumn.SHALLOWEST], seen[SegmentColumn.DEEPEST])
                seen[SegmentColumn.CROSSINGS], seen[SegmentColumn.DEEPEST] = seen[SegmentColumn.CROSSINGS] + 1.0, -np.inf
            side, skip = following, 1
        if recording:
            seen[SegmentColumn.HIGHEST], seen[SegmentColumn.LOWEST] = (
                max(seen[SegmentColumn.HIGHEST], state[State.COORDINATES]),
                min(seen[SegmentColumn.LOWEST], state[State.COORDINATES]),
            )
        if last:
            if recording and seen[SegmentColumn.CROSSINGS] > 0.0:
                seen[SegmentColumn.SHALLOWEST] = min(seen[SegmentColumn.SHALLOWEST], max(first, seen[SegmentColumn.DEEPEST]))
            return side
    return 0.0


@lean_jit
def copy_state(where, state, work, ends, columns, first):
    """Put coordinates, velocities and accelerations into `ends` from `first` on, and into `columns` the tangent's columns."""
    own, coordinates, velocities = where[Where.OWN], State.COORDINATES, State.COORDINATES + where[Where.DOF]
    for i in range(own):
        ends[first + i], ends[first + own + i] = state[coordinates + i], state[velocities + i]
        ends[first + 2 * own + i] = work[Work.ACCELERATIONS][i, 0]
        for j in range(where[Where.COLUMNS]):
            columns[i, j] = state[coordinates + own * (1 + j) + i]
            columns[own + i, j] = state[velocities + own * (1 + j) + i]


@jit
def follow_segments_with(where, settings, env_of, model_of, arrays, spans, sides, states, ends, columns, extremes):
    """`follow_segments` with the arrays of `Work`."""
    dof, own = where[Where.DOF], where[Where.OWN]
    env, model, work = by_reference(env_of), by_reference(model_of), by_reference(arrays)
    roots, nothing = np.zeros(where[Where.ORDER] + 2), np.zeros(1)
    state = np.zeros(State.COORDINATES + 2 * dof + where[Where.COLUMNS])
    recording = extremes.shape[0] > 0
    for s in range(spans.shape[0]):
        begin, end, side, drift = spans[s, SEGMENT_START], spans[s, SEGMENT_END], float(sides[s, ALONG]), 0.0
        if not math.isfinite(end - begin):
            return s
        through = sides[s, BEFORE] == 0 and sides[s, ALONG] == 0
        if through:
            _, start = side_of_state(where[Where.SIDES], states[s, 0], states[s, own], model[ModelPart.GEOMETRY])
            side = float(start)
        if sides[s, BEFORE] != 0:
            side, drift = start_by_impact(where, state, env, model, work, begin, float(sides[s, BEFORE]), spans[s, APPROACH])
        else:
            start_from_state(where, state, env, model, work, begin, side, states[s])
        copy_state(where, state, work, ends[s], columns[s, 2 * own :], SegmentValue.FIRST_STATE + 3 * own)
        if recording:
            extremes[s] = np.inf
            extremes[s, SegmentColumn.HIGHEST], extremes[s, SegmentColumn.DEEPEST], extremes[s, SegmentColumn.CROSSINGS] = (
                -np.inf,
                -np.inf,
                0.0,
            )
        seen = extremes[s] if recording else nothing
        if through:
            side = follow_through(where, state, settings, env, model, work, begin, end, side, recording, roots, seen)
            ends[s, SegmentValue.QUOTIENT] = math.nan if side == 0.0 else 0.0
        else:
            ends[s, SegmentValue.QUOTIENT] = follow(
                where, state, settings, env, model, work, begin, end, side, recording, roots, seen
            )
        ends[s, SegmentValue.RESET_DRIFT] = drift
        expand(where, state, env, model, work, end, 0.0, side, 0)
        copy_state(where, state, work, ends[s], columns[s], SegmentValue.FIRST_STATE)
        if not math.isfinite(ends[s, SegmentValue.QUOTIENT]) or not math.isfinite(ends[s, SegmentValue.FIRST_STATE + 2 * own]):
            return s
    return spans.shape[0]


@cached_jit(SEGMENTS, nogil=True)
def follow_segments(where, settings, env, model, spans, sides, states, ends, columns, extremes):
    """Follow all segments; returns how many could be followed.

    The derivatives of a segment that starts with an impact are to the speed before this impact, to its time and to the
    parameters; those of a segment that starts from a state (in `states`) are to this state and to the parameters. `columns` has
    them for the end (first the coordinates, then the velocities), then for the start. `extremes` are recorded unless the array is
    empty. A segment with the side 0 goes through all sides.
    """
    arrays = work_arrays(where)
    return follow_segments_with(where, settings, env, model, arrays, spans, sides, states, ends, columns, extremes)


@cached_jit(IMPACT_EQUATIONS)
def impact_equations(spans, signs, speeds, frequency, place, ends, columns, residual, here, there, parameters):
    """The equations of impacts, w / duration = 0 and -w' - v_next = 0 for each segment, and their derivatives.

    `here` holds the derivatives to phase and speed of the impact before the segment, `there` to those of the impact after it.
    `place` is the place of the frequency among the parameters, or -1. `signs` are the signs of the gap's rate on the segments,
    and `speeds` the speeds of the impacts that end them.
    """
    for i in range(spans.shape[0]):
        begin, end, sign = spans[i, SEGMENT_START], spans[i, SEGMENT_END], signs[i]
        quotient, velocity, acceleration = (
            ends[i, SegmentValue.QUOTIENT],
            ends[i, SegmentValue.FIRST_STATE + 1],
            ends[i, SegmentValue.FIRST_STATE + 2],
        )
        duration, pull, column = end - begin, 0.5 * ends[i, SegmentValue.FIRST_STATE + 5], columns[i]
        short = abs(duration) < SHORT
        residual[i, 0], residual[i, 1] = sign * quotient, -sign * velocity - speeds[i]
        by_speed = column[2 + 1, 0] if short else column[0, 0] / duration
        by_start = ends[i, SegmentValue.RESET_DRIFT] - pull if short else (column[0, 1] + quotient) / duration
        by_end = pull if short else (velocity - quotient) / duration
        here[i, 0, 0], here[i, 1, 0] = sign * by_start / frequency, -sign * column[1, 1] / frequency
        here[i, 0, 1], here[i, 1, 1] = sign * by_speed, -sign * column[1, 0]
        there[i, 0, 0], there[i, 1, 0] = sign * by_end / frequency, -sign * acceleration / frequency
        there[i, 0, 1], there[i, 1, 1] = 0.0, -1.0
        for j in range(2, column.shape[1]):
            by_value = column[3, j] if short else (column[0, j] - column[2, j]) / duration
            parameters[i, 0, j - 2], parameters[i, 1, j - 2] = sign * by_value, -sign * column[1, j]
        if place >= 0:  # derivatives to the frequency are at fixed phases, not at fixed times
            for row in range(2):
                parameters[i, row, place] -= here[i, row, 0] * begin + there[i, row, 0] * end
