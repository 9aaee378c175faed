"""SciPy's DOP853 restarted at every impact and at every instant where the load is not smooth."""

import numpy as np
from scipy.integrate import solve_ivp


def by_scipy(
    acceleration,
    gap,
    state,
    side,
    start,
    end,
    *,
    edges=(),
    reset=lambda side, v: (-side, v),
    contact=0.0,
):
    """The state (x, v, side) at `end` of x'' = acceleration(t, x, v, side), and the times of the
    impacts.
    """
    t, y, impacts = start, np.array(state, dtype=float), []
    targets = [*sorted(edge for edge in edges if start < edge < end), end]
    while t < end:
        target = next(edge for edge in targets if edge > t)

        def rate(_, y, side=side, middle=0.5 * (t + target), low=t, high=target):
            return [y[1], acceleration(min(max(_, low), high), y[0], y[1], side, middle)]

        def closes(time, y, side=side, start=t):
            return gap(y[0], side) if time > start else 1.0

        closes.terminal, closes.direction = True, -1
        piece = solve_ivp(
            rate, (t, target), y, method="DOP853", rtol=1e-12, atol=1e-14, events=closes
        )
        t, y = piece.t[-1], piece.y[:, -1].copy()
        if piece.status == 1:
            impacts.append(t)
            side, y[1] = reset(side, y[1])
            y[0] = contact
    return y[0], y[1], side, np.array(impacts)
