"""The branches that are compared, and what is known of them.

Load (i) (`loadpatha`) at beta0 = 80 deg, C = 0.1, V = -0.5, e = 1: the symmetric orbits of period 1
from Omega = 3 down to 0.1, for two amplitudes. The folds are those on which two independent exact
codes agree to residuals of 1e-15.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
from reference import BETA0, DAMPING, VERTICAL

HIGHEST, LOWEST = 3.0, 0.1  # Omega, followed downwards
# the codes are timed against each other as far down as this, where both get without many impacts a
# period
TIMED = 0.2
SHARPNESSES = (50.0, 200.0, 1000.0, 5000.0)  # B
SAMPLES = 400  # of the orbit that AUTO starts from


@dataclass(frozen=True)
class Known:
    """Exact values of Omega on the branch of one amplitude, the folds as the branch meets them."""

    folds: tuple[float, float]
    grazing: float | None = None  # from two to six crossings, reached from above
    grazing_amplitude: float = math.nan  # max abs(theta) there


KNOWN = {
    0.5: Known((0.848485265597, 0.908810732539), 0.284630020, 1.05950014),
    1.0: Known((0.811772145949, 0.995113422444)),
}


def system(amplitude: float) -> Any:
    """The exact system at Omega = 3."""
    import saltus

    load = saltus.Load(
        frequency=HIGHEST, horizontal=saltus.Harmonic(amplitude=amplitude), vertical=VERTICAL
    )
    return saltus.System(model=saltus.Metainterface(beta0=BETA0, damping=DAMPING), load=load)


@cache
def first_state(amplitude: float) -> tuple[float, float]:
    """theta and theta' at tau = 0 on the exact orbit at Omega = 3.

    Newton's method on one period of the event-driven flow, from the high-frequency limit theta = -H
    sin(beta0) sin(Omega tau) / Omega^2: for H = 1 a motion that starts elsewhere settles on another
    attractor.
    """
    from scipy.optimize import root

    import saltus

    exact = system(amplitude)

    def gap(state: np.ndarray) -> tuple[float, float]:
        end = saltus.simulate(exact, theta=state[0], velocity=state[1], periods=1)
        return end.theta - state[0], end.velocity - state[1]

    found = root(gap, (0.0, -amplitude * math.sin(BETA0) / HIGHEST), tol=1e-13)
    if not np.max(np.abs(found.fun)) < 1e-12:
        raise RuntimeError(
            f"no orbit of period 1 was found at Omega = {HIGHEST:g} for H = {amplitude:g}: "
            f"{found.message}"
        )
    return float(found.x[0]), float(found.x[1])


def first_orbit(amplitude: float) -> np.ndarray:
    """The same orbit over its period, as rows of tau, theta, theta', sin(Omega tau), cos(Omega
    tau).
    """
    import saltus

    theta, velocity = first_state(amplitude)
    times = np.linspace(0.0, 2 * math.pi / HIGHEST, SAMPLES + 1)
    along = saltus.simulate(system(amplitude), theta=theta, velocity=velocity, periods=1).at(times)
    return np.column_stack([times, *along, np.sin(HIGHEST * times), np.cos(HIGHEST * times)])
