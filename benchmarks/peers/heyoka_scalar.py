"""heyoka.py, one motion at a time, with a terminal event at the contact whose callback changes the
side.

Its callbacks are Python. They are kept as short as they can be: the side is a parameter, written
through a memory view that is made once; `integrator.pars[0]` in the callback costs 0.8 us an impact
more.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import heyoka as hy
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

from peers.peer import DerivativeFlow, Flow, Peer, zeno_answer

TOLERANCES = (1e-3, 1e-4, 1e-5, 1e-7, 1e-9, 1e-11, 1e-13, 1e-15)
# of the acceleration at an impact with e = 1, for the side before it
JUMP = -2.0 * np.cos(BETA0) * VERTICAL
SIDE, SIZE = 0, 1  # places of the parameters


def equations() -> list[tuple[Any, Any]]:
    """theta'' of the side par[0] under the amplitude par[1]."""
    x, v = hy.make_vars("x", "v")
    side, size = hy.par[SIDE], hy.par[SIZE]
    angle = side * x + BETA0
    push = hy.sin(angle) * size * hy.sin(FREQUENCY * hy.time) + side * hy.cos(angle) * VERTICAL
    return [(x, v), (v, push - DAMPING * v - x)]


def variational() -> Any:
    """The same with the derivatives to the state and to the amplitude; the order is that of
    `DERIVATIVES`.
    """
    x, v = hy.make_vars("x", "v")
    return hy.var_ode_sys(equations(), [x, v, hy.par[SIZE]], order=1)


def integrator(tol: float, callback: Callable[..., bool], system: Any = None) -> Any:
    """A scalar integrator with the event."""
    event = hy.t_event(hy.make_vars("x"), callback=callback)
    return hy.taylor_adaptive(
        system or equations(),
        [0.3, 0.0],
        tol=tol,
        t_events=[event],
        pars=[1.0, AMPLITUDE],
        fast_math=True,
    )


def prepare(ta: Any, x: float, v: float) -> None:
    """Put an integrator back to a start."""
    ta.time = 0.0
    ta.state[:2] = x, v
    ta.pars[SIDE] = 1.0 if x > 0 or (x == 0 and v > 0) else -1.0
    ta.reset_cooldowns()


def setup(tol: float) -> Flow:
    """The scalar flow."""
    pars: Any = None

    def flip(ta: Any, direction: int) -> bool:
        pars[SIDE] = -pars[SIDE]
        return True

    ta = integrator(tol, flip)
    pars = memoryview(ta.pars)

    def flow(theta: np.ndarray, velocity: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        ends = np.empty((2, len(theta)))
        for i, (x, v) in enumerate(zip(theta, velocity, strict=True)):
            prepare(ta, x, v)
            ta.propagate_until(HORIZON)
            ends[:, i] = ta.state
        return ends[0], ends[1]

    return flow


def derivatives(tol: float) -> DerivativeFlow:
    """heyoka has no saltation: it is written by hand in the callback, for this system alone."""
    pars: Any = None
    state: Any = None

    def leap(ta: Any, direction: int) -> bool:
        side = pars[SIDE]
        pars[SIDE] = -side
        kick = side * JUMP / state[1]
        state[5] += kick * state[2]
        state[6] += kick * state[3]
        state[7] += kick * state[4]
        return True

    ta = integrator(tol, leap, variational())
    pars, state = memoryview(ta.pars), memoryview(ta.state)
    identity = ta.state[2:].copy()

    def flow(
        theta: np.ndarray, velocity: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        ends = np.empty((4, len(theta)))
        for i, (x, v) in enumerate(zip(theta, velocity, strict=True)):
            prepare(ta, x, v)
            ta.state[2:] = identity
            ta.propagate_until(HORIZON)
            ends[:, i] = ta.state[[0, 1, 4, 7]]
        return ends[0], ends[1], ends[2], ends[3]

    return flow


def zeno(enough: int) -> dict[str, Any]:
    """The accumulation of impacts, followed as everything else."""
    impacts, last = 0, 0.0

    def bounce(ta: Any, direction: int) -> bool:
        nonlocal impacts, last
        impacts, last = impacts + 1, ta.time
        ta.pars[SIDE] = -ta.pars[SIDE]
        ta.state[1] *= ZENO_FACTOR
        return impacts < enough

    ta = integrator(1e-12, bounce)
    ta.pars[SIZE] = 0.0
    ta.propagate_until(ZENO_HORIZON)
    return zeno_answer(
        time=ta.time, theta=ta.state[0], velocity=ta.state[1], impacts=impacts, last=last
    )


PEERS = (
    Peer(
        name="heyoka.py scalar",
        about=(
            "Taylor series with a terminal event, its Python callback as short as it can be; "
            "fast_math"
        ),
        packages=("heyoka",),
        tolerances=TOLERANCES,
        setup=setup,
        batch=16,
        derivatives=derivatives,
        derivatives_about=(
            "state and amplitude; it has no saltation, which is written by hand in the callback"
        ),
        zeno=zeno,
    ),
)
