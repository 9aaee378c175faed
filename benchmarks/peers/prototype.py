"""A foreign sketch of the lanes, `nb_lanes.py`, from a folder that the caller names; off unless
asked for.
"""

from __future__ import annotations

import contextlib
import importlib
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from typing import Any

import numba
import numpy as np
from reference import AMPLITUDE, BETA0, DAMPING, FREQUENCY, HORIZON, VERTICAL

from peers import PROTOTYPE
from peers.peer import AbsentError, Flow, Peer

ORDERS = {1e-6: 10, 1e-8: 14, 1e-10: 14, 1e-12: 18, 1e-14: 20}

if not os.environ.get(PROTOTYPE):
    raise AbsentError("run.py was not given --prototype")
sys.path.append(os.environ[PROTOTYPE])
try:
    nb_lanes: Any = importlib.import_module("nb_lanes")
except ImportError as reason:
    raise AbsentError(f"no nb_lanes.py in {os.environ[PROTOTYPE]}: {reason}") from reason


@cache
def ensemble(order: int) -> Any:
    """The compiled prototype of an order."""
    with contextlib.redirect_stdout(None):
        return nb_lanes.make(order)


def setup(tol: float, threads: int | None = 1) -> Flow:
    """The prototype's lanes on one core, or on all of them."""
    run, numbers = ensemble(ORDERS[tol]), [DAMPING, VERTICAL, AMPLITUDE, FREQUENCY, BETA0, 1.0]

    def flow(theta: np.ndarray, velocity: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        x, v = theta.copy(), velocity.copy()
        numba.set_num_threads(threads or numba.config.NUMBA_NUM_THREADS)
        try:
            run(x, v, np.tile(numbers, (len(x), 1)), HORIZON, tol)
        finally:
            numba.set_num_threads(numba.config.NUMBA_NUM_THREADS)
        return x, v

    return flow


@contextmanager
def all_cores(tol: float) -> Iterator[Flow]:
    """The prototype on every core."""
    yield setup(tol, None)


PEERS = (
    Peer(
        name="prototype lanes",
        about="the sketch that the lanes were designed from: no rare states, no proofs",
        packages=("numba",),
        tolerances=tuple(ORDERS),
        setup=setup,
        batch=16384,
        all_cores=all_cores,
    ),
)
