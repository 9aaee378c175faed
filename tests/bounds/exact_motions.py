"""Motions in as many digits as mpmath works with: y'' = t^2 - y - y^3 by Taylor series."""

from __future__ import annotations

import mpmath as mp


def duffing_series(t: mp.mpf, y: mp.mpf, v: mp.mpf, order: int) -> list[mp.mpf]:
    """The Taylor coefficients of the solution from a state at a time."""
    c = [y, v]
    pushed = [t * t, 2 * t, mp.mpf(1)]
    for k in range(order - 1):
        square = [sum(c[i] * c[j - i] for i in range(j + 1)) for j in range(k + 1)]
        cube = sum(square[j] * c[k - j] for j in range(k + 1))
        push = pushed[k] if k < 3 else 0
        c.append((push - c[k] - cube) / ((k + 1) * (k + 2)))
    return c


def duffing(t: mp.mpf, y: mp.mpf, v: mp.mpf, h: mp.mpf) -> tuple[mp.mpf, mp.mpf]:
    """The state after h, by Taylor series of 50 terms in two steps."""
    for _ in range(2):
        c = duffing_series(t, y, v, 50)
        half = h / 2
        y = mp.polyval(c[::-1], half)
        v = mp.polyval([k * x for k, x in enumerate(c)][:0:-1], half)
        t = t + half
    return y, v
