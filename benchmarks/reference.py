"""The case that is measured, and its exact answer.

The paper's system under load (i) (`loadpatha`) at beta0 = 80 deg, C = 0.1, V = -0.5, H = 0.5, Omega
= 1, with e = 1: sixteen motions over 20 forcing periods, the first from theta = 0.3 at rest, the
others from states drawn in a box. Their ends are in reference.json to 40 digits, where two orders
of an arbitrary-precision Taylor method agree; `python benchmarks/reference.py` computes them anew
in three minutes.
"""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

BETA0, DAMPING, VERTICAL, AMPLITUDE, FREQUENCY = math.radians(80), 0.1, -0.5, 0.5, 1.0
PERIODS = 20
HORIZON = PERIODS * 2 * math.pi
BOX = 1.0  # abs(theta) and abs(theta') of the states drawn
SEED = 108005
MOTIONS = 16
# The accumulation of impacts: H = 0, e = 0.8, from theta = 0.3 at rest; at rest from ZENO_REST on
ZENO_FACTOR, ZENO_HORIZON, ZENO_REST = 0.8, 25.0, 17.82077858790958
FILE = Path(__file__).with_name("reference.json")


def states(n: int) -> tuple[np.ndarray, np.ndarray]:
    """The first `n` states at the start, theta and theta': always the same ones."""
    drawn = np.random.default_rng(SEED).uniform(-BOX, BOX, (n, 2))
    drawn[0] = 0.3, 0.0
    return drawn[:, 0].copy(), drawn[:, 1].copy()


def exact() -> dict[str, Any]:
    """The ends of the first MOTIONS motions, the first one after one period, and its derivative to
    the amplitude.
    """
    return {
        key: np.array(value, dtype=float) for key, value in json.loads(FILE.read_text()).items()
    }


def errors(theta: Sequence[float], velocity: Sequence[float]) -> np.ndarray:
    """The error of each end state, the larger one of theta and theta'."""
    known, n = exact(), min(len(theta), MOTIONS)
    return np.maximum(
        np.abs(theta[:n] - known["theta"][:n]), np.abs(velocity[:n] - known["velocity"][:n])
    )


# --- the answer in 40 digits


def _series(
    t: Any, x: Any, v: Any, side: int, amplitude: Any, order: int
) -> tuple[list[Any], list[Any]]:
    """Taylor coefficients of theta and theta' at time t on a side; every parameter is the double
    that the codes are given.
    """
    from mpmath import cos, fdot, mpf, pi, sin

    beta0, damping, vertical, w = map(mpf, (BETA0, DAMPING, VERTICAL, FREQUENCY))
    xs, vs = [x], [v]
    sine, cosine, push = [sin(side * x + beta0)], [cos(side * x + beta0)], [amplitude * sin(w * t)]
    for n in range(order):
        vs.append(
            (fdot(sine, push[::-1]) + side * vertical * cosine[n] - damping * vs[n] - xs[n])
            / (n + 1)
        )
        xs.append(vs[n] / (n + 1))
        turn = (
            side * fdot(vs[: n + 1], cosine[::-1]) / (n + 1),
            -side * fdot(vs[: n + 1], sine[::-1]) / (n + 1),
        )
        sine.append(turn[0])
        cosine.append(turn[1])
        push.append(
            amplitude * w ** (n + 1) * sin(w * t + (n + 1) * pi / 2) / math.factorial(n + 1)
        )
    return xs, vs


def _first_root(gap: list[Any], h: Any) -> Any:
    """The first root of a polynomial (constant term first) in (0, h], found on a scan of 32 pieces,
    or None.
    """
    from mpmath import polyval

    value, pieces = gap[::-1], 32
    for i in range(pieces):
        low, high = h * i / pieces, h * (i + 1) / pieces
        if polyval(value, high) > 0:
            continue
        for _ in range(20):
            middle = (low + high) / 2
            low, high = (middle, high) if polyval(value, middle) > 0 else (low, middle)
        root = (low + high) / 2
        for _ in range(6):  # Newton from a bracket of 1e-8 doubles its digits at every turn
            at, slope = polyval(value, root, derivative=1)
            root -= at / slope
        return root
    return None


def motion(
    theta: float, velocity: float, horizon: float, *, amplitude: Any = AMPLITUDE, order: int = 40
) -> tuple[Any, Any, int]:
    """The end of a motion in mpmath's numbers, and its impacts."""
    from mpmath import mpf, polyval

    tol, amplitude, end = mpf(10) ** -36, mpf(amplitude), mpf(horizon)
    t, x, v, impacts = mpf(0), mpf(float(theta)), mpf(float(velocity)), 0
    side = 1 if x > 0 or (x == 0 and v > 0) else -1
    while t < end:
        xs, vs = _series(t, x, v, side, amplitude, order)
        h = min(
            (tol / abs(vs[order])) ** (mpf(1) / order),
            (tol / abs(vs[order - 1])) ** (mpf(1) / (order - 1)),
            mpf(1) / 2,
            end - t,
        )
        root = _first_root([side * c for c in (xs[1:] if x == 0 else xs)], h)
        tau = h if root is None else root
        t, x, v = t + tau, polyval(xs[::-1], tau), polyval(vs[::-1], tau)
        if root is not None:
            x, side, impacts = mpf(0), -side, impacts + 1
    return x, v, impacts


def compute() -> dict[str, list[str]]:
    """Everything that reference.json holds, as decimal strings; refuses a digit on which the orders
    40 and 46 differ.
    """
    from mpmath import mp, mpf, nstr

    mp.dps = 45
    ends = [
        (motion(*state, HORIZON), motion(*state, HORIZON, order=46))
        for state in zip(*states(MOTIONS), strict=True)
    ]
    assert all(abs(a[i] - b[i]) < mpf(10) ** -25 for a, b in ends for i in (0, 1))
    step = mpf(10) ** -12
    ahead, behind = (
        motion(0.3, 0.0, HORIZON, amplitude=mpf(AMPLITUDE) + sign * step) for sign in (1, -1)
    )
    columns: dict[str, list[Any]] = {
        "theta": [a[0] for a, _ in ends],
        "velocity": [a[1] for a, _ in ends],
        "impacts": [mpf(a[2]) for a, _ in ends],
        "after_one_period": list(motion(0.3, 0.0, 2 * math.pi)[:2]),
        "derivative_to_amplitude": [(ahead[i] - behind[i]) / (2 * step) for i in (0, 1)],
    }
    return {key: [nstr(value, 25) for value in values] for key, values in columns.items()}


if __name__ == "__main__":
    FILE.write_text(json.dumps(compute(), indent=1) + "\n")
    print(FILE.read_text())
