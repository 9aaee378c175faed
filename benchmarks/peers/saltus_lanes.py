"""saltus in lanes: many motions a step, and all cores if asked."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
from reference import PERIODS

import saltus
from peers.peer import AbsentError, DerivativeFlow, Flow, Peer
from peers.saltus_scalar import AMPLITUDE_PATH, TOLERANCES, system
from saltus.taylor.vectors import WIDTH

if not hasattr(saltus, "simulate_many"):
    raise AbsentError("this saltus has no simulate_many")


def run(
    what: Any,
    theta: np.ndarray,
    velocity: np.ndarray,
    tol: float,
    threads: int | None,
    **options: Any,
) -> Any:
    """An ensemble of motions over the measured number of periods, of which only the ends are
    kept.
    """
    return saltus.simulate_many(
        what,
        theta=theta,
        velocity=velocity,
        periods=PERIODS,
        tol=tol,
        sample=(),
        threads=threads,
        **options,
    )


def flow_of(variant: str, tol: float, threads: int | None = 1) -> Flow:
    """The flow in lanes of a variant of the system."""
    what = system(variant)

    def flow(theta: np.ndarray, velocity: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        ends = run(what, theta, velocity, tol, threads)
        return ends["theta"].values, ends["velocity"].values

    return flow


@contextmanager
def all_cores(tol: float) -> Iterator[Flow]:
    """The flow on every core."""
    yield flow_of("the case", tol, threads=None)


def derivatives(tol: float) -> DerivativeFlow:
    """The motions and their derivatives to the amplitude."""
    what = system()

    def flow(
        theta: np.ndarray, velocity: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        ends = run(what, theta, velocity, tol, 1, sensitivities=(AMPLITUDE_PATH,))
        slopes = ends["derivative"].sel(column=AMPLITUDE_PATH).values
        return ends["theta"].values, ends["velocity"].values, slopes[:, 0], slopes[:, 1]

    return flow


PEERS = (
    Peer(
        name="saltus lanes",
        about=f"{WIDTH} motions a step; rare states leave for the scalar kernel and come back",
        packages=("saltus", "numba"),
        tolerances=TOLERANCES,
        setup=lambda tol: flow_of("the case", tol),
        batch=16384,  # a call takes some milliseconds besides, most of them for its xarray.Dataset
        all_cores=all_cores,
        derivatives=derivatives,
        derivatives_about="state and amplitude, with saltation",
    ),
)
