"""What a peer is: a code that follows the same motions, with what it does said honestly."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager
from dataclasses import dataclass
from typing import Any

import numpy as np

# From theta and theta' at time 0 to theta and theta' after reference.PERIODS forcing periods
Flow = Callable[[np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray]]
# The same, followed by d theta / d amplitude and d theta' / d amplitude
DerivativeFlow = Callable[
    [np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]
]


class AbsentError(Exception):
    """A peer that cannot run here, with the reason."""


@dataclass(frozen=True, kw_only=True)
class Peer:
    """One code in one mode."""

    name: str
    about: str  # what it does, in a sentence
    packages: tuple[str, ...]
    tolerances: tuple[float, ...]  # loose ones too, where a code does better than it is asked to
    # for one core; whatever is compiled at the first call is not timed
    setup: Callable[[float], Flow]
    batch: int = 1  # motions in one timed call
    all_cores: Callable[[float], AbstractContextManager[Flow]] | None = None
    derivatives: Callable[[float], DerivativeFlow] | None = None
    derivatives_about: str = ""
    zeno: Callable[[int], dict[str, Any]] | None = None  # given how many impacts are enough

    @property
    def module(self) -> str:
        """The file of the peer, for a process of its own to find it."""
        return self.setup.__module__.removeprefix("peers.")


def zeno_answer(
    *, time: float, theta: float, velocity: float, impacts: int, last: float
) -> dict[str, Any]:
    """Where a code is with the accumulation of impacts when it ends: its time, its state, and its
    impacts.
    """
    numbers = {"time": time, "theta": theta, "velocity": velocity, "last_impact": last}
    return {"impacts": int(impacts), **{name: float(value) for name, value in numbers.items()}}
