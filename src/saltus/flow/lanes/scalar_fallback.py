"""Roots and extrema of a single lane, where the bounds for all lanes leave them open, by the scalar kernel's search for roots.

This file is compiled by itself and called through pointers: if it were linked into its callers, it would be compiled again with
each of them.
"""

from __future__ import annotations

from saltus.flow.kernel.roots import SIMPLE, first_root, horner, scale_gap
from saltus.flow.lanes.function_types import LANE_ROOT, TURNING_RANGE
from saltus.flow.lanes.lane_layout import NO_ROOT, TOUCH
from saltus.taylor import cached_jit, get, lean_jit

# --- compiled from here on -----------------------------------------------------------------------------------------------

MOST_TURNS = 16  # the most turning points that are looked for within one step


@cached_jit(LANE_ROOT)
def lane_root(m, series, order, lane, h, sign, g0, skip, poly, gap):
    """The first root of one lane's gap by `roots.first_root`: its time, NO_ROOT, or TOUCH where it touches zero before."""
    for k in range(order + 1):
        gap[k] = sign * get(m, series + k, lane)
    gap[0] = g0
    scale_gap(gap, skip, order, h, poly)
    kind, u, touch = first_root(poly, order - skip)
    if touch <= 1.0:
        return TOUCH
    return u * h if kind == SIMPLE else NO_ROOT


@lean_jit
def shift_start(p, n, u):
    """Replace p(s) by p(u + (1 - u) s)."""
    for k in range(n):
        for j in range(n - 1, k - 1, -1):
            p[j] += u * p[j + 1]
    power = 1.0
    for k in range(n + 1):
        p[k] *= power
        power *= 1.0 - u


@cached_jit(TURNING_RANGE)
def turning_range(q, order, begin, h, p):
    """The largest and the smallest value of a series on (begin, h], at its end or where its derivative vanishes before."""
    high = low = horner(q, order, h)
    n, power = order - 1, 1.0
    for k in range(order):
        p[k] = (k + 1) * q[k + 1] * power
        power *= h
    start, left = begin / h, 1.0 - begin / h
    if begin > 0.0:
        shift_start(p, n, start)
    for _ in range(MOST_TURNS):
        while n > 0 and p[0] == 0.0:
            for k in range(n):
                p[k] = p[k + 1]
            n -= 1
        if p[0] < 0.0:
            for k in range(n + 1):
                p[k] = -p[k]
        kind, u, _ = first_root(p, n)
        if kind != SIMPLE or u >= 1.0:
            break
        start, left = start + u * left, (1.0 - u) * left
        x = horner(q, order, start * h)
        high, low = max(high, x), min(low, x)
        shift_start(p, n, u)
        p[0] = 0.0
    return high, low
