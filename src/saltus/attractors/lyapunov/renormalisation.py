"""Renormalisation: how a long run of derivatives is cut into spans, after each of which they are made orthonormal again.

All methods of this room share it: which systems and lengths can have a run, into how many spans a forcing period is cut, and the
frame of derivatives with which it begins.
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
    """Refuse what has no exponents, and a run too short for error bars of its halves.

    Raises
    ------
    ParameterError
        With the name of the argument.
    """
    check_system(system, function, several_contacts=True)
    check_periodic(system)
    check_count("periods", periods, 2 * LYAPUNOV.batches)
    check_count("transient", transient, 0)
    check_number("tol", tol, at_least=1e-15, at_most=1e-6)


def period_length(system: System) -> float:
    """The forcing period; 1 under constant loads, where a unit of time stands for it."""
    return system.load.period or 1.0


def span_count(length: float) -> int:
    """Into how many spans a period of this length is cut."""
    return max(1, math.ceil(length / LYAPUNOV.longest_span))


def first_frame(size: int) -> np.ndarray:
    """An orthonormal frame to begin with, (size, size), that no symmetry of a system fits.

    One along the coordinates may lie in an invariant plane, and would then stay there until rounding moves it out.
    """
    frame: np.ndarray = np.linalg.qr(np.random.default_rng(0).standard_normal((size, size)))[0]
    return frame


def state_of(motion: Motion) -> dict[str, Any]:
    """The state at the end of a motion, as `simulate` takes it."""
    names = motion.system.model.coordinates
    return {**dict(zip(names, np.atleast_1d(motion.position).tolist(), strict=True)), "velocity": motion.velocity}
