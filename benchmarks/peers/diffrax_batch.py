"""diffrax, compiled by XLA for the CPU: a batch by vmap, with its own events and a restart after
each of them.

The motions of a batch march in step: all of them wait for the one with the most steps between two
impacts, and for the one with the most impacts. The event is theta over the time since the last
impact, for theta itself is zero there and diffrax would take that for the next event.
"""

from __future__ import annotations

import os
from functools import cache
from typing import Any

# one core
os.environ.setdefault(
    "XLA_FLAGS", "--xla_cpu_multi_thread_eigen=false intra_op_parallelism_threads=1"
)

import diffrax
import jax
import jax.numpy as jnp
import numpy as np
import optimistix
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

jax.config.update("jax_enable_x64", True)
BATCH = 64  # 256 are no faster


def field(t: Any, y: Any, args: Any) -> Any:
    """theta' and theta'' on a side."""
    side, _, _, amplitude = args
    angle = side * y[0] + BETA0
    push = jnp.sin(angle) * amplitude * jnp.sin(FREQUENCY * t) + side * jnp.cos(angle) * VERTICAL
    return jnp.stack([y[1], push - DAMPING * y[1] - y[0]])


def gap(t: Any, y: Any, args: Any, **_: Any) -> Any:
    """The event: side * theta, over the time since the start if that was at the contact."""
    side, start, at_contact, _ = args
    since = t - start
    fresh = since <= 0
    return side * jnp.where(
        at_contact, jnp.where(fresh, y[1], y[0] / jnp.where(fresh, 1.0, since)), y[0]
    )


def follow(
    solver: Any,
    tol: float,
    horizon: float,
    factor: float = 1.0,
    enough: float = jnp.inf,
    forward: bool = False,
) -> Any:
    """The motion of a single state, as a function to be batched and compiled; `forward` makes it
    differentiable.
    """
    adjoint = diffrax.ForwardMode() if forward else diffrax.RecursiveCheckpointAdjoint()
    event = diffrax.Event(gap, optimistix.Newton(rtol=1e-13, atol=1e-14))
    control = diffrax.PIDController(rtol=max(tol, 2.3e-14), atol=tol)

    def arc(carry: Any) -> Any:
        t, y, side, at_contact, amplitude, impacts, last = carry
        part = diffrax.diffeqsolve(
            diffrax.ODETerm(field), solver, t, horizon, None, y, (side, t, at_contact, amplitude), event=event,
            stepsize_controller=control, max_steps=None, throw=False, adjoint=adjoint,
        )  # fmt: skip
        t, y, hit = part.ts[-1], part.ys[-1], part.event_mask
        y = jnp.where(hit, jnp.stack([0.0, factor * y[1]]), y)
        return (
            t,
            y,
            jnp.where(hit, -side, side),
            hit,
            amplitude,
            impacts + hit,
            jnp.where(hit, t, last),
        )

    def motion(theta: Any, velocity: Any, amplitude: Any) -> Any:
        side = jnp.where((theta > 0) | ((theta == 0) & (velocity > 0)), 1.0, -1.0)
        start = (0.0, jnp.stack([theta, velocity]), side, theta == 0, amplitude, 0, 0.0)
        t, y, _, _, _, impacts, last = jax.lax.while_loop(
            lambda c: (c[0] < horizon) & (c[5] < enough), arc, start
        )
        return y[0], y[1], t, impacts, last

    return motion


def _peer(solver: Any, tolerances: tuple[float, ...], with_derivatives: bool = False) -> Peer:
    name = type(solver).__name__

    @cache
    def setup(tol: float) -> Flow:
        run = jax.jit(jax.vmap(follow(solver, tol, HORIZON), (0, 0, None)))

        def flow(theta: np.ndarray, velocity: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
            x, v, *_ = run(theta, velocity, AMPLITUDE)
            return np.asarray(x), np.asarray(v)

        return flow

    def derivatives(tol: float) -> DerivativeFlow:
        motion = follow(solver, tol, HORIZON, forward=True)

        def both(theta: Any, velocity: Any) -> Any:
            return jax.jvp(lambda a: motion(theta, velocity, a)[:2], (AMPLITUDE,), (1.0,))

        run = jax.jit(jax.vmap(both))

        def flow(
            theta: np.ndarray, velocity: np.ndarray
        ) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
            (x, v), (dx, dv) = run(theta, velocity)
            return np.asarray(x), np.asarray(v), np.asarray(dx), np.asarray(dv)

        return flow

    def zeno(enough: int) -> dict[str, Any]:
        run = jax.jit(follow(solver, 1e-10, ZENO_HORIZON, ZENO_FACTOR, enough))
        x, v, t, impacts, last = run(0.3, 0.0, 0.0)
        return zeno_answer(time=t, theta=x, velocity=v, impacts=impacts, last=last)

    return Peer(
        name=f"diffrax {name}",
        about=(
            f"{name} and Newton on its interpolant, a batch of {BATCH} by vmap that marches in "
            "step; 64 bits, XLA on one core"
        ),
        packages=("diffrax", "jax"),
        tolerances=tolerances,
        setup=setup,
        batch=BATCH,
        derivatives=derivatives if with_derivatives else None,
        derivatives_about="amplitude only, forward mode through the solver and its events",
        zeno=zeno,
    )


PEERS = (
    _peer(diffrax.Dopri8(), (1e-6, 1e-8, 1e-10, 1e-12, 1e-13), with_derivatives=True),
    _peer(diffrax.Tsit5(), (1e-5, 1e-7, 1e-9, 1e-11, 1e-13)),
)
