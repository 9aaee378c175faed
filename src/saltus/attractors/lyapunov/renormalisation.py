"""Runs in pieces: how a long run of derivatives is cut, and which systems and lengths can have one."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from saltus.attractors.lyapunov.averages import BATCHES
from saltus.checks import check_count
from saltus.systems import System

LONGEST = 6.5  # units of time: a forcing period at Omega = 1, over which derivatives grow and shrink by less than 1e6


def pieces_of(system: System) -> tuple[float, int]:
    """The length of the period, 1 under constant loads, and into how many pieces it is cut."""
    length = system.load.period or 1.0
    return length, piece_count(length)


def piece_count(length: float) -> int:
    """Into how many pieces a period of this length is cut."""
    return max(1, math.ceil(length / LONGEST))


def first_frame(size: int) -> np.ndarray:
    """An orthonormal frame to begin with, (size, size), that no symmetry of a system fits.

    One along the coordinates may lie in an invariant plane, and would then stay there until rounding moves it out.
    """
    frame: np.ndarray = np.linalg.qr(np.random.default_rng(0).standard_normal((size, size)))[0]
    return frame


def check_run(periods: Any, transient: Any) -> None:
    """Refuse a run too short for error bars of its halves, and what is no whole number.

    Raises:
        ParameterError: with the least number.
    """
    for name, value, least in (("periods", periods, 2 * BATCHES), ("transient", transient, 0)):
        check_count(name, value, least)
