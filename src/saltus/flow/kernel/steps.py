"""One step of the scalar flow: its Taylor series, its length, and its records.

Its compiled part goes into one module with that of `one_contact/kernel.py`.
"""

from __future__ import annotations

import math

import numpy as np

from saltus.flow.kernel.layout import DEFECT, GAP, SAFETY, SMALLEST, ModelPart, Setting, Where
from saltus.flow.kernel.memory_layout import State
from saltus.flow.kernel.roots import horner
from saltus.taylor import jit, lean_jit

# --- compiled from here on -----------------------------------------------------------------------------------------------


@jit
def work_arrays(where):
    """The arrays of a step, in the places of `Work`."""
    dof, order, margins = where[Where.DOF], where[Where.ORDER], max(where[Where.MARGINS], 1)
    count = order + 2
    rows = np.zeros((3 * dof + margins + 4, count))  # one piece of memory for each shape: lanes ask for them at every slow impact
    pairs = np.zeros((3 * dof + margins + 1, 2))
    return (
        rows[:dof],
        rows[dof : 2 * dof],
        rows[2 * dof : 3 * dof],
        rows[3 * dof],
        rows[3 * dof + 4 :],
        np.zeros((where[Where.ROWS], order + 6)),
        rows[3 * dof + 1],
        rows[3 * dof + 2 : 3 * dof + 4],
        (pairs[:dof], pairs[dof : 2 * dof], pairs[2 * dof : 3 * dof], pairs[3 * dof], pairs[3 * dof + 1 :]),
    )


@lean_jit
def expand(where, state, env, model, work, t, origin, side, order):
    """Expand the state in its Taylor series at time `t`; returns the size of the model's own part of the state."""
    q, v, a, g, m, w, _, _, _ = work
    first_q, first_v, size = State.COORDINATES, State.COORDINATES + where[Where.DOF], 0.0
    for i in range(where[Where.DOF]):
        q[i, 0], v[i, 0] = state[first_q + i], state[first_v + i]
        if i < where[Where.OWN]:
            size = max(size, abs(q[i, 0]), abs(v[i, 0]))
    model[ModelPart.SERIES](t, origin, side, env, where[Where.PIECE], q, v, a, g, m, w, order)
    return size


@lean_jit
def growth(coefficients, first, last, size):
    """The largest log(abs(c_k) / size) / k for first <= k <= last: minus the log of the radius of convergence by these terms."""
    largest = -np.inf
    for i in range(coefficients.shape[0]):
        for k in range(first, last + 1):
            if coefficients[i, k] != 0.0:
                largest = max(largest, math.log(abs(coefficients[i, k]) / size) / k)
    return largest


@lean_jit
def grow_faster(coefficients, first, last, size, rate):
    """Whether `growth` exceeds a rate, found without the many logarithms of it."""
    factor = math.exp(rate)
    for i in range(coefficients.shape[0]):
        bound = size * math.exp(first * rate)
        for k in range(first, last + 1):
            if abs(coefficients[i, k]) > bound:
                return True
            bound *= factor
    return False


@lean_jit
def step_size(coefficients, order, size, tol):
    """The step h at which the last two terms of the series are tol, relative to `size`.

    By symmetry both terms may be far too small: for x'' = -x^3 from x = 0 only every fourth coefficient is not 0. The growth of
    the series is then taken from the upper half of the coefficients.
    """
    size = max(size, SMALLEST)
    at_end, before_end = growth(coefficients, order, order, size), growth(coefficients, order - 1, order - 1, size)
    step = min(math.log(tol) / order - at_end, math.log(tol) / (order - 1) - before_end)
    if grow_faster(coefficients, order // 2, order - 2, size, max(at_end, before_end) + GAP):
        step = min(step, math.log(tol) / order - growth(coefficients, order // 2, order - 2, size))
    return SAFETY * math.exp(step) if step < 700.0 else np.inf


@lean_jit
def leaps(where, env, model, work, t, origin, side, h, size, tol):
    """Whether a step passes a feature of the acceleration that its series cannot show, such as the bend of a saturated tanh,
    whose coefficients are below rounding far away from it.

    It is noticed because the model's acceleration at the end of the step then differs from that of the series.
    """
    q, v, a, _, _, w, _, _, (q_end, v_end, a_end, g_end, m_end) = work
    order = where[Where.ORDER]
    for i in range(where[Where.DOF]):
        q_end[i, 0], v_end[i, 0] = horner(q[i], order, h), horner(v[i], order, h)
    model[ModelPart.SERIES](t + h, origin, side, env, where[Where.PIECE], q_end, v_end, a_end, g_end, m_end, w, 0)
    defect = 0.0
    for i in range(where[Where.OWN]):
        defect = max(defect, abs(a_end[i, 0] - horner(a[i], order, h)))
    return defect > DEFECT * tol * max(size, SMALLEST) / h


@lean_jit
def move(where, state, q, v, tau):
    """Take the state at `tau` from the series of a step; returns whether the model's own part of it is finite."""
    first_q, first_v, order, finite = State.COORDINATES, State.COORDINATES + where[Where.DOF], where[Where.ORDER], True
    for i in range(where[Where.DOF]):
        state[first_q + i], state[first_v + i] = horner(q[i], order, tau), horner(v[i], order, tau)
        if i < where[Where.OWN]:
            finite = finite and math.isfinite(state[first_q + i]) and math.isfinite(state[first_v + i])
    return finite


@lean_jit
def record_event(where, events, kind, side, detail, t, before, after):
    """Append an event: (period, kind, side, detail) and (local time, velocity before, velocity after, shifts)."""
    labels, values = events
    i = where[Where.EVENTS]
    labels[i, 0], labels[i, 1], labels[i, 2], labels[i, 3] = where[Where.PERIOD], kind, side, detail
    values[i, 0], values[i, 1], values[i, 2] = t, before, after
    for j in range(where[Where.COLUMNS]):
        values[i, 3 + j] = math.nan  # until `record_shift` sets it
    where[Where.EVENTS] = i + 1


@lean_jit
def record_shift(where, state, events):
    """Record with the last event its shift along each column, which `tangent` has put into the state."""
    for j in range(where[Where.COLUMNS]):
        events[1][where[Where.EVENTS] - 1, 3 + j] = state[State.COORDINATES + 2 * where[Where.DOF] + j]


@lean_jit
def forget(where, state):
    """Set the tangent to nan: there are no derivatives from here on."""
    coordinates, velocities = State.COORDINATES, State.COORDINATES + where[Where.DOF]
    for i in range(where[Where.OWN], where[Where.DOF]):
        state[coordinates + i] = state[velocities + i] = math.nan
    for j in range(where[Where.COLUMNS]):
        state[velocities + where[Where.DOF] + j] = math.nan


@lean_jit
def column_step(where, q, v, a, order, tol):
    """The longest step that the series of the tangent's columns allow, each relative to its own size."""
    step, own = np.inf, where[Where.OWN]
    for first in range(own, where[Where.DOF], own):
        size = 0.0
        for i in range(first, first + own):
            size = max(size, abs(q[i, 0]), abs(v[i, 0]), abs(a[i, 0]))
        if 0.0 < size < np.inf:
            step = min(step, step_size(v[first : first + own], order, size, tol))
    return step


@lean_jit
def record_step(where, steps, side, t, h, q):
    """Append a step of the dense output: its start, its length, and the coordinates' series."""
    if where[Where.DENSE] == 0:
        return
    labels, spans, coefficients = steps
    i = where[Where.STEPS]
    labels[i, 0], labels[i, 1] = where[Where.PERIOD], side
    spans[i, 0], spans[i, 1] = t, h
    for d in range(where[Where.OWN]):
        for k in range(where[Where.ORDER] + 2):
            coefficients[i, d, k] = q[d, k]
    where[Where.STEPS] = i + 1


@lean_jit
def next_target(where, state, breaks, origin, t_end):
    """The time up to which the next step may go: the end of the forcing period, or a breakpoint of the records before."""
    while where[Where.PIECE] < breaks.size and breaks[where[Where.PIECE]] - origin <= state[State.TIME]:
        where[Where.PIECE] += 1
    if where[Where.PIECE] < breaks.size:
        return min(t_end, breaks[where[Where.PIECE]] - origin)
    return t_end


@lean_jit
def motion_end(where, settings):
    """The time at which the motion ends, as counted from the present forcing period."""
    if where[Where.UNTIL_SMOOTH] > 0:
        return settings[Setting.HORIZON]
    return (where[Where.LAST_PERIOD] - where[Where.PERIOD]) * settings[Setting.LENGTH] + settings[Setting.END]
