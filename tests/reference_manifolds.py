"""The stable and unstable manifolds of the saddles under a constant load: the separatrices of a
phase portrait.

Arcs are integrated here and not by `saltus.flow`, because a stable manifold is followed backward in
time, where the damping and the velocity factor (1/e) leave the range that models accept.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from saltus.errors import ParameterError
from saltus.systems import System, VelocityReduction
from saltus.theory import LoadedEquilibrium

OFFSET = 1e-5  # from the saddle; the manifold leaves its tangent by the square of this
CLOSE = 1e-4  # distance at which a manifold is said to end at a saddle
ACCURACY = {"rtol": 1e-12, "atol": 1e-14}


@dataclass(frozen=True, slots=True, kw_only=True)
class Manifold:
    """A branch of an invariant manifold from its saddle on: arrays (n,) with NaN where the velocity
    jumps.

    `time` runs from 0 and away from the saddle: negative along a stable manifold.
    """

    saddle: float
    stable: bool
    time: np.ndarray
    theta: np.ndarray
    velocity: np.ndarray
    ends_at: float  # the saddle that it reaches, or NaN


def manifold(
    system: System,
    saddle: LoadedEquilibrium,
    *,
    stable: bool,
    outward: bool,
    saddles: Sequence[float] = (),
    span: float = 60.0,
    bound: float = math.inf,
    crossings: int = 40,
    step: float = 0.08,
) -> Manifold:
    """The branch that leaves `saddle` away from (`outward`) or towards theta = 0, followed for at
    most `span` of time, to abs(theta) = `bound`, through at most `crossings` of contact, or until
    it comes close to one of `saddles`.

    Raises
    ------
    ParameterError
        An equilibrium that is not a saddle, or an impact law without v+ = e v-, e > 0.
    """
    if (
        saddle.eigenvalues is None
        or not saddle.eigenvalues[0].real > 0 > saddle.eigenvalues[1].real
    ):
        raise ParameterError(f"theta = {saddle.theta:g} is not a saddle, so it has no separatrices")
    if not isinstance(system.impact, VelocityReduction) or system.impact.e <= 0:
        raise ParameterError("manifolds are followed backward through v+ = e v- with e > 0 only")
    rate, clock = (
        (saddle.eigenvalues[1].real, -1.0) if stable else (saddle.eigenvalues[0].real, 1.0)
    )
    side = math.copysign(1.0, saddle.theta)
    away = side if outward else -side
    state = np.array([saddle.theta + away * OFFSET, away * OFFSET * rate])
    ends = saddles or (saddle.theta,)
    pieces: list[np.ndarray] = []
    now, ends_at = 0.0, math.nan
    for _ in range(crossings + 1):
        piece, event = _arc(system, state, side, clock, span - now, bound, ends, step)
        pieces.append(np.vstack([clock * (now + piece[0]), piece[1:]]))
        now += piece[0, -1]
        if event == "saddle":
            ends_at = min(ends, key=lambda s: abs(s - piece[1, -1]))
        if event != "contact":
            break
        velocity = piece[2, -1] * (1 / system.impact.e if stable else system.impact.e)
        if system.impact.e != 1:
            pieces.append(np.array([[clock * now], [math.nan], [math.nan]]))
        state, side = np.array([0.0, velocity]), -side
    time, theta, velocities = np.hstack(pieces)
    return Manifold(
        saddle=saddle.theta,
        stable=stable,
        time=time,
        theta=theta,
        velocity=velocities,
        ends_at=ends_at,
    )


def _arc(
    system: System,
    state: np.ndarray,
    side: float,
    clock: float,
    span: float,
    bound: float,
    saddles: Sequence[float],
    step: float,
) -> tuple[np.ndarray, str]:
    """One arc on one side, rows (elapsed time, theta, velocity), and what ended it."""
    from scipy.integrate import solve_ivp

    def rates(_: float, y: np.ndarray) -> list[Any]:
        return [clock * y[1], clock * system.model.acceleration(0.0, y[0], y[1], side, system.load)]

    def contact(_: float, y: np.ndarray) -> float:
        return side * y[0]

    def leaves(_: float, y: np.ndarray) -> float:
        return bound - abs(y[0])

    def arrives(_: float, y: np.ndarray) -> float:
        return min(math.hypot(y[0] - s, y[1]) for s in saddles) - CLOSE

    events = [contact, leaves, arrives]
    for event in events:
        event.terminal, event.direction = True, -1  # type: ignore[attr-defined]
    solution = solve_ivp(
        rates, (0.0, span), state, method="DOP853", events=events, max_step=step, **ACCURACY
    )
    kinds = [
        kind
        for kind, times in zip(("contact", "bound", "saddle"), solution.t_events, strict=True)
        if times.size
    ]
    piece = np.vstack([solution.t, solution.y])
    if kinds == ["contact"]:
        piece[1, -1] = 0.0
    return piece, kinds[0] if kinds else "span"
