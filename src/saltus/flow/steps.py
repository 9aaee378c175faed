"""One step: how long it may be, and what is kept of it.

This text is compiled together with the kernel (see `kernel.py`).
"""

from __future__ import annotations

import math

import numpy as np

from saltus.flow.kernel_layout import (
    COLUMNS,
    DEFECT,
    DENSE,
    DOF,
    EVENTS,
    GAP,
    ORDER,
    OWN,
    PERIOD,
    PIECE,
    SAFETY,
    SIDE,
    SMALLEST,
    STATE,
    STEPS,
)
from saltus.flow.roots import horner
from saltus.taylor import jit

# --- compiled from here on -----------------------------------------------------------------------------------------------


@jit
def growth(coefficients, first, last, size):
    """The largest log(abs(c_k) / size) / k for first <= k <= last: minus the log of the radius that these terms tell of."""
    largest = -np.inf
    for i in range(coefficients.shape[0]):
        for k in range(first, last + 1):
            if coefficients[i, k] != 0.0:
                largest = max(largest, math.log(abs(coefficients[i, k]) / size) / k)
    return largest


@jit
def step_size(coefficients, order, size, tol):
    """h such that the last two terms of the series are below tol, relative to `size`.

    By symmetry both may be far smaller than the series: x'' = -x^3 from x = 0 has every fourth coefficient only. Then the
    upper half of the coefficients says how fast it grows.
    """
    size = max(size, SMALLEST)
    at_end, before_end = growth(coefficients, order, order, size), growth(coefficients, order - 1, order - 1, size)
    upper_half = growth(coefficients, order // 2, order - 2, size)
    step = min(math.log(tol) / order - at_end, math.log(tol) / (order - 1) - before_end)
    if upper_half - max(at_end, before_end) > GAP:
        step = min(step, math.log(tol) / order - upper_half)
    return SAFETY * math.exp(step) if step < 700.0 else np.inf


@jit
def leaps(where, env, model, work, t, origin, h, size, tol):
    """Whether a step goes past what its series cannot see, such as the bend of a saturated tanh, below rounding from afar.

    The acceleration at the end of the step is then not the one that the series gives there.
    """
    q, v, a, _, _, w, _, _, (q_end, v_end, a_end, g_end, m_end) = work
    order = where[ORDER]
    for i in range(where[DOF]):
        q_end[i, 0], v_end[i, 0] = horner(q[i], order, h), horner(v[i], order, h)
    model[0](t + h, origin, float(where[SIDE]), env, where[PIECE], q_end, v_end, a_end, g_end, m_end, w, 0)
    defect = 0.0
    for i in range(where[OWN]):
        defect = max(defect, abs(a_end[i, 0] - horner(a[i], order, h)))
    return defect > DEFECT * tol * max(size, SMALLEST) / h


@jit
def record_event(where, events, kind, side, detail, t, before, after):
    """Append an event: (period, kind, side, detail) and (local time, velocity before, velocity after, shifts)."""
    labels, values = events
    i = where[EVENTS]
    labels[i, 0], labels[i, 1], labels[i, 2], labels[i, 3] = where[PERIOD], kind, side, detail
    values[i, 0], values[i, 1], values[i, 2] = t, before, after
    for j in range(where[COLUMNS]):
        values[i, 3 + j] = math.nan  # unless `record_shift` knows better
    where[EVENTS] = i + 1


@jit
def record_shift(where, state, events):
    """Note with the last event how its time moves with each column of the tangent, as `tangent` has left it in the state."""
    for j in range(where[COLUMNS]):
        events[1][where[EVENTS] - 1, 3 + j] = state[STATE + 2 * where[DOF] + j]


@jit
def forget(where, state):
    """There is no tangent from here on."""
    for i in range(where[OWN], where[DOF]):
        state[STATE + i] = state[STATE + where[DOF] + i] = math.nan
    for j in range(where[COLUMNS]):
        state[STATE + 2 * where[DOF] + j] = math.nan


@jit
def column_step(where, q, v, a, order, tol):
    """The longest step that the series of the tangent's columns allow, each relative to its own size."""
    step, own = np.inf, where[OWN]
    for first in range(own, where[DOF], own):
        size = 0.0
        for i in range(first, first + own):
            size = max(size, abs(q[i, 0]), abs(v[i, 0]), abs(a[i, 0]))
        if 0.0 < size < np.inf:
            step = min(step, step_size(v[first : first + own], order, size, tol))
    return step


@jit
def record_step(where, steps, side, t, h, q):
    """Append a step of the dense output: where it starts, how long it is, and the coordinates' series."""
    if where[DENSE] == 0:
        return
    labels, spans, coefficients = steps
    i = where[STEPS]
    labels[i, 0], labels[i, 1] = where[PERIOD], side
    spans[i, 0], spans[i, 1] = t, h
    for d in range(where[OWN]):
        for k in range(where[ORDER] + 2):
            coefficients[i, d, k] = q[d, k]
    where[STEPS] = i + 1
