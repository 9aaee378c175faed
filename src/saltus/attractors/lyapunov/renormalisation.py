"""Renormalisation: a long run of derivatives is cut into spans, and after each span the derivatives are made orthonormal again.

All methods of this room share the checks of the arguments, the number of spans in a forcing period, and the frame of derivatives
with which a run begins.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from saltus.attractors.lyapunov.settings import LYAPUNOV
from saltus.attractors.stroboscopic_section import check_periodic
from saltus.checks import check_count, check_number
from saltus.flow import Motion
from saltus.systems import System, check_system


def check_run(function: str, system: Any, periods: Any, transient: Any, tol: float) -> None:
    """Refuse systems that have no exponents, and runs too short for error bars of their halves.

    Raises
    ------
    ParameterError
        The error has the name of the argument.
    """
    check_system(system, function, several_contacts=True)
    check_periodic(system)
    check_count("periods", periods, 2 * LYAPUNOV.batches)
    check_count("transient", transient, 0)
    check_number("tol", tol, at_least=1e-15, at_most=1e-6)


def period_length(system: System) -> float:
    """The forcing period; under constant loads 1, a unit of time, is taken instead."""
    return system.load.period or 1.0


def span_count(length: float) -> int:
    """Into how many spans a period of this length is cut."""
    return max(1, math.ceil(length / LYAPUNOV.longest_span))


def first_frame(size: int) -> np.ndarray:
    """An orthonormal frame to begin with, (size, size), of random directions.

    A frame along the coordinates may lie in an invariant plane of a system, and would stay in it until rounding moves it out.
    """
    frame: np.ndarray = np.linalg.qr(np.random.default_rng(0).standard_normal((size, size)))[0]
    return frame


def state_of(motion: Motion) -> dict[str, Any]:
    """The state at the end of a motion, as `simulate` takes it."""
    names = motion.system.model.coordinates
    return {**dict(zip(names, np.atleast_1d(motion.position).tolist(), strict=True)), "velocity": motion.velocity}
