"""heyoka.py's batch mode, set up as well as it can be on this problem.

Tried: 4, 8, 16 and 32 motions a batch; with and without fast_math and force_avx512;
`integrator.pars` or a memory view in the callback. 16 motions with all of them is the fastest, by a
few per cent over 8 and a third over the defaults. Its events are found motion by motion and their
callbacks are Python, so that wider batches gain little. On all cores one process each is used: its
threads would wait for each other in the callbacks.
"""

from __future__ import annotations

import multiprocessing
import os
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import heyoka as hy
import numpy as np
from reference import AMPLITUDE, HORIZON

from peers.heyoka_scalar import JUMP, SIDE, TOLERANCES, equations, variational
from peers.peer import DerivativeFlow, Flow, Peer

WIDTH = 16
CHUNK = 64 * WIDTH  # motions that a process takes at a time


def integrator(tol: float, callback: Any, system: Any = None) -> Any:
    """A batch integrator with the event."""
    event = hy.t_event_batch(hy.make_vars("x"), callback=callback)
    pars = np.repeat([[1.0], [AMPLITUDE]], WIDTH, axis=1)
    options = {
        "tol": tol,
        "t_events": [event],
        "pars": pars,
        "fast_math": True,
        "force_avx512": True,
    }
    return hy.taylor_adaptive_batch(system or equations(), np.zeros((2, WIDTH)), **options)


def batches(
    ta: Any,
    theta: np.ndarray,
    velocity: np.ndarray,
    rows: tuple[int, ...],
    identity: np.ndarray | None,
) -> np.ndarray:
    """Propagate every batch and keep some rows of the states at the end; the last batch is filled
    up with copies.
    """
    padded = -(-len(theta) // WIDTH) * WIDTH
    starts = np.stack([np.resize(theta, padded), np.resize(velocity, padded)])
    ends = np.empty((len(rows), padded))
    for i in range(0, padded, WIDTH):
        x, v = starts[:, i : i + WIDTH]
        ta.set_time(0.0)
        ta.state[0], ta.state[1] = x, v
        if identity is not None:
            ta.state[2:] = identity
        ta.pars[SIDE] = np.where((x > 0) | ((x == 0) & (v > 0)), 1.0, -1.0)
        ta.reset_cooldowns()
        ta.propagate_until(HORIZON)
        ends[:, i : i + WIDTH] = ta.state[list(rows)]
    return ends[:, : len(theta)]


def setup(tol: float) -> Flow:
    """The flow in batches, on one core."""
    side: Any = None

    def flip(ta: Any, direction: int, lane: int) -> bool:
        side[lane] = -side[lane]
        return True

    ta = integrator(tol, flip)
    side = memoryview(ta.pars[SIDE])

    def flow(theta: np.ndarray, velocity: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        ends = batches(ta, theta, velocity, (0, 1), None)
        return ends[0], ends[1]

    return flow


def derivatives(tol: float) -> DerivativeFlow:
    """heyoka has no saltation: it is written by hand in the callback, for this system alone."""
    side: Any = None
    rows: Any = None

    def leap(ta: Any, direction: int, lane: int) -> bool:
        before = side[lane]
        side[lane] = -before
        kick = before * JUMP / rows[1][lane]
        for up, down in ((2, 5), (3, 6), (4, 7)):
            rows[down][lane] += kick * rows[up][lane]
        return True

    ta = integrator(tol, leap, variational())
    side, rows = memoryview(ta.pars[SIDE]), [memoryview(row) for row in ta.state]
    identity = ta.state[2:].copy()

    def flow(
        theta: np.ndarray, velocity: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        ends = batches(ta, theta, velocity, (0, 1, 4, 7), identity)
        return ends[0], ends[1], ends[2], ends[3]

    return flow


_flow: Flow  # of a worker process


def _start_worker(tol: float) -> None:
    global _flow
    _flow = setup(tol)
    _flow(np.array([0.3]), np.array([0.0]))


def _work(part: tuple[np.ndarray, np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    return _flow(*part)


@contextmanager
def all_cores(tol: float) -> Iterator[Flow]:
    """The flow on every core, in processes that are started and have compiled before anything is
    timed.
    """
    cores = os.cpu_count() or 1
    with multiprocessing.get_context("spawn").Pool(cores, _start_worker, (tol,)) as pool:

        def flow(theta: np.ndarray, velocity: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
            pieces = max(cores, -(-len(theta) // CHUNK))
            parts = zip(
                np.array_split(theta, pieces), np.array_split(velocity, pieces), strict=True
            )
            ends = pool.map(_work, parts, chunksize=1)
            return np.concatenate([e[0] for e in ends]), np.concatenate([e[1] for e in ends])

        yield flow


PEERS = (
    Peer(
        name="heyoka.py batch",
        about=(
            f"batches of {WIDTH} with AVX-512 and fast_math, an event with a short Python "
            "callback; a process for each core"
        ),
        packages=("heyoka",),
        tolerances=TOLERANCES,
        setup=setup,
        batch=32 * WIDTH,
        all_cores=all_cores,
        derivatives=derivatives,
        derivatives_about=(
            "state and amplitude; it has no saltation, which is written by hand in the callback"
        ),
    ),
)
