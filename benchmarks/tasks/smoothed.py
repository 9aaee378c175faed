"""The paper's way: `smoothing`, q = tanh(B theta / 2) for the sign, by RK45 at 1e-8 with steps of
at most 1e-4.

The paper names neither B nor its error. One forcing period of the first motion is followed for a
few B, and compared with the exact motion of the non-smooth equation.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from measure import interleave
from reference import AMPLITUDE, BETA0, DAMPING, FREQUENCY, VERTICAL, exact
from scipy.integrate import solve_ivp

TOL, LONGEST_STEP = 1e-8, 1e-4


def smoothed(sharpness: float) -> tuple[float, float]:
    """theta and theta' after one period."""
    half = sharpness / 2

    def slope(t: float, y: np.ndarray) -> tuple[float, float]:
        sign = math.tanh(half * y[0])
        angle = sign * y[0] + BETA0
        push = (
            math.sin(angle) * AMPLITUDE * math.sin(FREQUENCY * t)
            + sign * math.cos(angle) * VERTICAL
        )
        return y[1], push - DAMPING * y[1] - y[0]

    end = 2 * math.pi / FREQUENCY
    options = {"rtol": TOL, "atol": TOL, "max_step": LONGEST_STEP, "t_eval": [end]}
    theta, velocity = solve_ivp(slope, (0.0, end), [0.3, 0.0], "RK45", **options).y[:, -1]
    return float(theta), float(velocity)


def paper_way(rounds: int, quick: bool) -> list[dict[str, Any]]:
    """One row for each B: seconds a period, and the error against the exact motion."""
    known = exact()["after_one_period"]
    ends: dict[float, tuple[float, float]] = {}

    def task(sharpness: float) -> Any:
        return lambda: ends.__setitem__(sharpness, smoothed(sharpness))

    sharpnesses = (5e3,) if quick else (5e2, 5e3, 5e4)
    timings = interleave({b: task(b) for b in sharpnesses}, rounds, warm=False, one_core=True)
    return [
        {"sharpness": b, "error": float(np.max(np.abs(np.subtract(ends[b], known))))}
        | timings[b].as_dict()
        for b in sharpnesses
    ]
