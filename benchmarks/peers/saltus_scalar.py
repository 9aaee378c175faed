"""saltus, one motion at a time: the robust kernel."""

from __future__ import annotations

from typing import Any

import numpy as np
from reference import (
    AMPLITUDE,
    BETA0,
    DAMPING,
    FREQUENCY,
    PERIODS,
    VERTICAL,
    ZENO_FACTOR,
    ZENO_HORIZON,
)

import saltus
from peers.peer import AbsentError, DerivativeFlow, Flow, Peer, zeno_answer

AMPLITUDE_PATH = "load.horizontal.amplitude"
TOLERANCES = (1e-6, 1e-8, 1e-10, 1e-12, 1e-14, 1e-15)
VARIANTS = ("the case", "other numbers", "another structure")


def system(variant: str = "the case") -> Any:
    """The measured system, the same with other numbers, or another structure: load (ii),
    `loadpathaa`, a moving ground.
    """
    other = variant == "other numbers"
    model = saltus.Metainterface(beta0=BETA0, damping=0.07 if other else DAMPING)
    shake = saltus.Harmonic(amplitude=0.31 if other else AMPLITUDE)
    channel = {"ground_horizontal" if variant == "another structure" else "horizontal": shake}
    return saltus.System(
        model=model, load=saltus.Load(frequency=FREQUENCY, vertical=VERTICAL, **channel)
    )


def flow_of(variant: str, tol: float) -> Flow:
    """The scalar flow of a variant of the system."""
    what = system(variant)

    def flow(theta: np.ndarray, velocity: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        ends = [
            saltus.simulate(
                what, theta=float(a), velocity=float(v), periods=PERIODS, tol=tol, dense=False
            )
            for a, v in zip(theta, velocity, strict=True)
        ]
        return np.array([e.theta for e in ends]), np.array([e.velocity for e in ends])

    return flow


def derivatives(tol: float) -> DerivativeFlow:
    """The motion and its derivative to the amplitude."""
    if not hasattr(saltus, "sensitivities"):
        raise AbsentError("this saltus has no sensitivities")
    what = system()

    def flow(
        theta: np.ndarray, velocity: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        results = [
            saltus.sensitivities(
                what,
                theta=float(a),
                velocity=float(v),
                periods=PERIODS,
                parameters=(AMPLITUDE_PATH,),
                tol=tol,
            )
            for a, v in zip(theta, velocity, strict=True)
        ]
        ends = [r.motion for r in results]
        columns = np.array([np.ravel(r.parameters) for r in results])
        return (
            np.array([e.theta for e in ends]),
            np.array([e.velocity for e in ends]),
            columns[:, 0],
            columns[:, 1],
        )

    return flow


def zeno(enough: int) -> dict[str, Any]:
    """The accumulation of impacts: its limit is an event of its own."""
    model = saltus.Metainterface(beta0=BETA0, damping=DAMPING)
    what = saltus.System(
        model=model,
        load=saltus.Load(vertical=VERTICAL),
        impact=saltus.VelocityReduction(ZENO_FACTOR),
    )
    motion = saltus.simulate(what, theta=0.3, duration=ZENO_HORIZON)
    rest = [event.time for event in motion.events if event.kind == saltus.EventKind.REST]
    impacts = len(motion.impacts)
    return zeno_answer(
        time=motion.time,
        theta=motion.theta,
        velocity=motion.velocity,
        impacts=impacts,
        last=rest[-1],
    )


PEERS = (
    Peer(
        name="saltus scalar",
        about=(
            "one motion at a time, every impact a proved first root; Python is entered once a "
            "motion"
        ),
        packages=("saltus", "numba"),
        tolerances=TOLERANCES,
        setup=lambda tol: flow_of("the case", tol),
        batch=16,
        derivatives=derivatives,
        derivatives_about="state and amplitude, with saltation",
        zeno=zeno,
    ),
)
