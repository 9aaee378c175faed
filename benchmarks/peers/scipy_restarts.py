"""SciPy's solve_ivp, restarted at every impact that its own event location finds: what a careful
user writes.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from reference import (
    AMPLITUDE,
    BETA0,
    DAMPING,
    FREQUENCY,
    HORIZON,
    VERTICAL,
    ZENO_FACTOR,
    ZENO_HORIZON,
)
from scipy.integrate import solve_ivp

from peers.peer import Flow, Peer, zeno_answer


def slope(t: float, y: np.ndarray, side: float, amplitude: float) -> tuple[float, float]:
    """The field of one side; plain floats are twice as fast as arrays here."""
    angle = side * y[0] + BETA0
    push = math.sin(angle) * amplitude * math.sin(FREQUENCY * t) + side * math.cos(angle) * VERTICAL
    return y[1], push - DAMPING * y[1] - y[0]


def follow(
    method: str,
    tol: float,
    state: np.ndarray,
    end: float,
    *,
    amplitude: float,
    factor: float = 1.0,
    enough: float = math.inf,
) -> dict[str, Any]:
    """One motion to its end, or to `enough` impacts."""
    t, last, impacts = 0.0, 0.0, 0
    side = 1.0 if state[0] > 0 or (state[0] == 0 and state[1] > 0) else -1.0

    def contact(t: float, y: np.ndarray, side: float, amplitude: float) -> float:
        return float(y[0])

    contact.terminal = True  # type: ignore[attr-defined]
    while t < end and impacts < enough:
        contact.direction = -side  # type: ignore[attr-defined]
        part = solve_ivp(
            slope,
            (t, end),
            state,
            method,
            events=contact,
            args=(side, amplitude),
            rtol=max(tol, 2.3e-14),
            atol=tol,
        )
        if part.status < 0:
            raise RuntimeError(part.message)
        t, state = part.t[-1], part.y[:, -1].copy()
        if part.status == 1:
            state[0], state[1], side, impacts, last = 0.0, factor * state[1], -side, impacts + 1, t
    return zeno_answer(time=t, theta=state[0], velocity=state[1], impacts=impacts, last=last)


def _peer(method: str, tolerances: tuple[float, ...]) -> Peer:
    def setup(tol: float) -> Flow:
        def flow(theta: np.ndarray, velocity: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
            starts = np.column_stack([theta, velocity])
            ends = [follow(method, tol, start, HORIZON, amplitude=AMPLITUDE) for start in starts]
            return np.array([e["theta"] for e in ends]), np.array([e["velocity"] for e in ends])

        return flow

    def zeno(enough: int) -> dict[str, Any]:
        state = np.array([0.3, 0.0])
        return follow(
            method, 1e-10, state, ZENO_HORIZON, amplitude=0.0, factor=ZENO_FACTOR, enough=enough
        )

    about = f"solve_ivp with {method}, restarted at every impact that its event location finds"
    return Peer(
        name=f"SciPy {method}",
        about=about,
        packages=("scipy",),
        tolerances=tolerances,
        setup=setup,
        batch=1,
        zeno=zeno,
    )


PEERS = (
    _peer("DOP853", (1e-4, 1e-6, 1e-8, 1e-10, 1e-12, 1e-13, 1e-14)),
    _peer("LSODA", (1e-5, 1e-7, 1e-9, 1e-11, 1e-12, 1e-13, 1e-14)),
)
