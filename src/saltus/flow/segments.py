"""Smooth segments with their derivatives: what the boundary-value problem of a periodic orbit is made of (see `orbits/`).

A segment is the smooth motion on one side from one instant to another, whatever the sign of the gap, forwards or backwards in
time, started by an impact or from a state. The texts of `layout.py`, `roots.py`, `steps.py`, `contact.py`, `chatter.py` and
this file are compiled as one, once for every model. Phases are those of time 0, so records, which have none, are left out.
"""

from __future__ import annotations

import math

import numpy as np

from saltus.flow.contact import rate_of
from saltus.flow.function_types import IMPACT_EQUATIONS, SEGMENTS
from saltus.flow.kernel_layout import COLUMNS, DOF, ORDER, OWN, RESET_SLOPES, ROUGHER, ROWS, SIDES, STATE, STEEP, STOPS, TOLERANCE
from saltus.flow.roots import DEPTH, NARROW, NOISE, horner, newton, scale_gap, split, to_bernstein, variations
from saltus.flow.steps import column_step, leaps, step_size
from saltus.taylor import jit
from saltus.taylor import not_here as cached_jit

# --- compiled from here on -----------------------------------------------------------------------------------------------

SEGMENT_START, SEGMENT_END, APPROACH = 0, 1, 2  # in `spans`: times, and the gap's speed before the impact that starts it
BEFORE, ALONG = 0, 1  # in `sides`: the side before that impact (0: from a state), and the side of the segment
QUOTIENT, RESET_DRIFT, KINDS = 0, 1, 2  # in `ends`: (x - contact) / duration, dv+/dt; x, v, a at the end and at the start
HUMP, HUMP_TIME, TOP, BOTTOM, LEAST_MARGIN = 0, 1, 2, 3, 4  # in `looks`: lowest inner minimum of the gap, when, range of x
MOST_STEPS = 100_000  # of one segment
SHORT = 1e-6  # a segment's duration below which the derivatives of its quotient are those of its beginning


@jit
def roots_within(p, n, roots, noise):
    """The places in (0, 1) at which a polynomial of degree n goes through zero, except within `noise`; returns how many."""
    boxes = np.empty((DEPTH, n + 1))
    left, width = np.empty(DEPTH), np.empty(DEPTH)
    to_bernstein(p, n, boxes[0])
    left[0], width[0] = 0.0, 1.0
    top, found = 1, 0
    while top > 0:
        top -= 1
        b, low, wide = boxes[top], left[top], width[top]
        count = variations(b, n)
        largest = 0.0
        for i in range(n + 1):
            largest = max(largest, abs(b[i]))
        if count == 0 or largest <= noise or found == roots.size:
            continue
        if count == 1 or wide < NARROW or top + 2 > DEPTH:
            if count % 2 == 0:
                continue
            if b[0] < 0.0:  # `newton` starts where p is positive
                for k in range(n + 1):
                    p[k] = -p[k]
                roots[found] = newton(p, n, low, low + wide)
                for k in range(n + 1):
                    p[k] = -p[k]
            else:
                roots[found] = newton(p, n, low, low + wide)
            found += 1
            continue
        half = 0.5 * wide
        split(boxes, top, n)
        left[top], width[top] = low + half, half
        left[top + 1], width[top + 1] = low, half
        top += 2
    return found


@jit
def look(where, model, work, side, t, h, order, roots, seen):
    """Take in what a step of a segment shows: turning points of the coordinate, minima of the gap and of the margins."""
    q, v, m, poly = work[0], work[1], work[4], work[6]
    seen[TOP], seen[BOTTOM] = max(seen[TOP], q[0, 0]), min(seen[BOTTOM], q[0, 0])
    scale_gap(v[0], 0, order, h, poly)
    rate = rate_of(model, side) if where[SIDES] > 0 else 1.0
    size = 0.0
    for k in range(order + 1):
        size += abs(poly[k])
    for i in range(roots_within(poly, order, roots, NOISE * size)):
        x = horner(q[0], order, roots[i] * h)
        seen[TOP], seen[BOTTOM] = max(seen[TOP], x), min(seen[BOTTOM], x)
        gap = rate * (x - model[4][0])
        turn = 0.0
        for k in range(order, 0, -1):
            turn = turn * roots[i] + k * poly[k]
        if where[SIDES] > 0 and rate * turn > 0.0 and gap < seen[HUMP]:
            seen[HUMP], seen[HUMP_TIME] = gap, t + roots[i] * h
    for j in range(where[STOPS]):
        least, size = min(m[j, 0], horner(m[j], order, h)), abs(m[j, 0])
        for k in range(1, order + 1):
            poly[k - 1] = k * m[j, k] * h**k
            size += abs(poly[k - 1])
        for i in range(roots_within(poly, order - 1, roots, NOISE * size)):
            least = min(least, horner(m[j], order, roots[i] * h))
        seen[LEAST_MARGIN + j] = min(seen[LEAST_MARGIN + j], least)


@jit
def start_by_impact(where, state, env, model, t, side, speed):
    """The state, and the columns for d/d(speed), d/d(start) and the parameters, just after an impact; returns (side, dv+/dt).

    The column of the start lacks what the equation of motion adds to it, see `start_columns`.
    """
    inward = -math.copysign(1.0, rate_of(model, side))
    before = inward * speed
    for j in range(where[DOF]):
        state[STATE + j] = state[STATE + where[DOF] + j] = 0.0
    state[STATE + where[DOF]] = before
    state[STATE + where[DOF] + 1] = inward
    next_side, after = model[2](t, 0.0, before, side, env, 0)
    model[5](RESET_SLOPES, 0, t, 0.0, side, env, 0, state)
    state[STATE], state[STATE + where[DOF]] = model[4][0], after
    return next_side, state[STATE + 2 * where[DOF] + 1]


@jit
def expand(where, state, env, model, work, t, side, order):
    """The series of a state at an instant; returns the size of the model's own part."""
    q, v, a, g, m, w, _, _, _ = work
    size = 0.0
    for i in range(where[DOF]):
        q[i, 0], v[i, 0] = state[STATE + i], state[STATE + where[DOF] + i]
        if i < where[OWN]:
            size = max(size, abs(q[i, 0]), abs(v[i, 0]))
    model[0](t, 0.0, side, env, 0, q, v, a, g, m, w, order)
    return size


@jit
def follow(where, state, settings, env, model, work, begin, end, side, looking, roots, seen):
    """Follow one segment. Returns the quotient (x - contact) / duration of its first coordinate, or nan where it fails."""
    q, v, a = work[0], work[1], work[2]
    order, t, forwards = where[ORDER], begin, end >= begin
    quotient = math.nan
    for count in range(MOST_STEPS):
        size = expand(where, state, env, model, work, t, side, order)
        natural = step_size(v[: where[OWN]], order, size, settings[TOLERANCE])
        natural = min(natural, column_step(where, q, v, a, order, ROUGHER * settings[TOLERANCE]))
        while where[STEEP] > 0 and forwards:
            if not leaps(where, env, model, work, t, 0.0, min(natural, end - t), size, settings[TOLERANCE]):
                break
            natural = 0.5 * min(natural, end - t)
        if not natural > 0.0:
            return math.nan
        last = natural >= abs(end - t)
        h = end - t if last else (natural if forwards else -natural)
        if looking and h > 0.0:
            look(where, model, work, side, t, h, order, roots, seen)
        if count == 0 and last:  # without the cancellation of x - contact where the segment is short
            quotient = horner(q[0, 1:], order - 1, h)
        for i in range(where[DOF]):
            state[STATE + i], state[STATE + where[DOF] + i] = horner(q[i], order, h), horner(v[i], order, h)
        if last:
            if looking:
                seen[TOP], seen[BOTTOM] = max(seen[TOP], state[STATE]), min(seen[BOTTOM], state[STATE])
            return quotient if count == 0 else (state[STATE] - model[4][0]) / (end - begin)
        t += h
    return math.nan


@jit
def copy_columns(where, state, target, first):
    """Put the columns of a state into the rows of `target` from `first` on: those of the coordinates, then of the velocities."""
    own, dof = where[OWN], where[DOF]
    for j in range(where[COLUMNS]):
        for i in range(own):
            target[first + i, j] = state[STATE + own * (1 + j) + i]
            target[first + own + i, j] = state[STATE + dof + own * (1 + j) + i]


@cached_jit(SEGMENTS)
def fly_segments(where, settings, env, model, spans, sides, states, ends, columns, looks):
    """Follow all segments; returns how many of them have succeeded.

    A segment's columns are d/d(speed before its impact), d/d(its start) and the parameters, or, started from a state (its
    coordinates and velocities in `states`), those of `tangent.py`. They stand in `columns` at the end (first the coordinates,
    then the velocities) and then at the start. With `looks` empty nothing is looked at between the ends.
    """
    order, dof, own = where[ORDER], where[DOF], where[OWN]
    work = (
        np.zeros((dof, order + 2)),
        np.zeros((dof, order + 2)),
        np.zeros((dof, order + 2)),
        np.zeros(order + 2),
        np.zeros((max(where[STOPS], 1), order + 2)),
        np.zeros((where[ROWS], order + 6)),
        np.zeros(order + 2),
        np.zeros((2, order + 2)),
        (np.zeros((dof, 2)), np.zeros((dof, 2)), np.zeros((dof, 2)), np.zeros(2), np.zeros((max(where[STOPS], 1), 2))),
    )
    state, roots, nothing = np.zeros(STATE + 2 * dof + where[COLUMNS]), np.zeros(order + 2), np.zeros(1)
    looking = looks.shape[0] > 0
    for s in range(spans.shape[0]):
        begin, end, side, drift = spans[s, SEGMENT_START], spans[s, SEGMENT_END], float(sides[s, ALONG]), 0.0
        if sides[s, BEFORE] != 0:
            side, drift = start_by_impact(where, state, env, model, begin, float(sides[s, BEFORE]), spans[s, APPROACH])
            expand(where, state, env, model, work, begin, side, 0)
            state[STATE + 2], state[STATE + dof + 2] = -state[STATE + dof], drift - work[2][0, 0]
        else:
            for j in range(2 * dof):
                state[STATE + j] = 0.0
            for i in range(own):
                state[STATE + i], state[STATE + dof + i] = states[s, i], states[s, own + i]
                state[STATE + own * (1 + i) + i] = state[STATE + dof + own * (1 + own + i) + i] = 1.0
            expand(where, state, env, model, work, begin, side, 0)
        for i in range(own):
            ends[s, KINDS + 3 * own + i], ends[s, KINDS + 4 * own + i] = state[STATE + i], state[STATE + dof + i]
            ends[s, KINDS + 5 * own + i] = work[2][i, 0]
        copy_columns(where, state, columns[s], 2 * own)
        if looking:
            looks[s] = np.inf
            looks[s, TOP] = -np.inf
        seen = looks[s] if looking else nothing
        ends[s, QUOTIENT] = follow(where, state, settings, env, model, work, begin, end, side, looking, roots, seen)
        ends[s, RESET_DRIFT] = drift
        expand(where, state, env, model, work, end, side, 0)
        for i in range(own):
            ends[s, KINDS + i], ends[s, KINDS + own + i] = state[STATE + i], state[STATE + dof + i]
            ends[s, KINDS + 2 * own + i] = work[2][i, 0]
        copy_columns(where, state, columns[s], 0)
        if not math.isfinite(ends[s, QUOTIENT]) or not math.isfinite(ends[s, KINDS + 2 * own]):
            return s
    return spans.shape[0]


@cached_jit(IMPACT_EQUATIONS)
def impact_equations(spans, signs, speeds, frequency, place, ends, columns, residual, here, there, parameters):
    """The equations of impacts, w / duration = 0 and -w' - v_next = 0 for each segment, and their derivatives.

    `here` is to the phase and the speed of the impact before the segment, `there` of the one after it; `place` is the
    parameter's that is the frequency, or -1. `signs` are those of the gap's rate on the segments, `speeds` of the next impacts.
    """
    for i in range(spans.shape[0]):
        begin, end, sign = spans[i, SEGMENT_START], spans[i, SEGMENT_END], signs[i]
        quotient, velocity, acceleration = ends[i, QUOTIENT], ends[i, KINDS + 1], ends[i, KINDS + 2]
        duration, pull, column = end - begin, 0.5 * ends[i, KINDS + 5], columns[i]
        short = abs(duration) < SHORT
        residual[i, 0], residual[i, 1] = sign * quotient, -sign * velocity - speeds[i]
        by_speed = column[2 + 1, 0] if short else column[0, 0] / duration
        by_start = ends[i, RESET_DRIFT] - pull if short else (column[0, 1] + quotient) / duration
        by_end = pull if short else (velocity - quotient) / duration
        here[i, 0, 0], here[i, 1, 0] = sign * by_start / frequency, -sign * column[1, 1] / frequency
        here[i, 0, 1], here[i, 1, 1] = sign * by_speed, -sign * column[1, 0]
        there[i, 0, 0], there[i, 1, 0] = sign * by_end / frequency, -sign * acceleration / frequency
        there[i, 0, 1], there[i, 1, 1] = 0.0, -1.0
        for j in range(2, column.shape[1]):
            by_value = column[3, j] if short else (column[0, j] - column[2, j]) / duration
            parameters[i, 0, j - 2], parameters[i, 1, j - 2] = sign * by_value, -sign * column[1, j]
        if place >= 0:  # phases are kept as the frequency changes, not times
            for row in range(2):
                parameters[i, row, place] -= here[i, row, 0] * begin + there[i, row, 0] * end
