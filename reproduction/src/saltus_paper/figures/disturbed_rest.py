"""What becomes of a slight disturbance of theta = 0, integrated by DOP853 from impact to impact,
independently of `flow`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True, slots=True, kw_only=True)
class DisturbanceSettings:
    """How the disturbed state is followed."""

    theta: float = 1e-5  # The rotation, in rad, from which the motion starts at rest.
    tolerance: float = 1e-12  # The relative and absolute tolerance of DOP853.
    # The largest number of impacts; a motion that stays near theta = 0 has some 400 in a period.
    impacts: int = 20_000


SETTINGS = DisturbanceSettings()


def largest_disturbance(
    beta0: float, damping: float, mean: float, swing: float, amplitude: float, periods: int = 1
) -> float:
    """max abs(theta) over some periods under H = amplitude sin(tau) and V = mean + swing cos(tau),
    from `SETTINGS.theta` at rest.

    On the side s the motion obeys theta'' = sin(abs(theta) + beta0) H + s cos(abs(theta) + beta0) V
    - damping theta' - theta (`gov_eqn_theta`, k = 1, m = 0, e = 1), so that it goes through theta =
    0 with its velocity. The angle is in rad.
    """
    from scipy.integrate import solve_ivp

    def contact(t: float, state: np.ndarray) -> float:
        return float(state[0])

    contact.terminal = True  # type: ignore[attr-defined]
    time = 0.0
    end = 2 * math.pi * periods
    state = np.array([SETTINGS.theta, 0.0])
    side = 1.0
    largest = 0.0
    for _ in range(SETTINGS.impacts):

        def rate(t: float, state: np.ndarray, side: float = side) -> list[float]:
            angle = side * state[0] + beta0
            load = math.sin(angle) * amplitude * math.sin(t) + side * math.cos(angle) * (
                mean + swing * math.cos(t)
            )
            return [state[1], load - damping * state[1] - state[0]]

        contact.direction = -side  # type: ignore[attr-defined]
        arc = solve_ivp(
            rate,
            (time, end),
            state,
            "DOP853",
            rtol=SETTINGS.tolerance,
            atol=SETTINGS.tolerance * 1e-4,
            events=contact,
            max_step=0.1,
        )
        largest = max(largest, float(np.abs(arc.y[0]).max()))
        if arc.status != 1:
            return largest
        time, side = float(arc.t[-1]), -side
        state = np.array([0.0, arc.y[1, -1]])
    return math.nan
