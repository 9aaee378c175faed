"""The stroboscopic map's largest exponent without derivatives: a shadow beside the motion, moved back after every period."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from saltus.flow import simulate
from saltus.systems import System

DISTANCE = 1e-7  # of the shadow: far above the error of a period, far below what bends the map
TOLERANCE = 1e-14


def shadow_growth(
    system: System, state: dict[str, Any], periods: int, length: float, progress: Callable[[float], object] | None = None
) -> np.ndarray:
    """ln(distance after a period / distance before) for each period, (periods,); -inf once both states are the same.

    The shadow is moved along the line to it (Benettin, Galgani, Giorgilli and Strelcyn, Meccanica 15 (1980) 9). Where it lies on
    the other side of the contact, or meets it once more, nothing is special.
    """
    names = system.model.coordinates
    here = np.concatenate([[state[name] for name in names], np.atleast_1d(state["velocity"])])
    away = np.full(here.size, DISTANCE / np.sqrt(here.size))
    growth = np.full(periods, -np.inf)

    def strobe(at: np.ndarray) -> np.ndarray:
        velocity = at[len(names) :].tolist()
        start = dict(zip(names, at[: len(names)].tolist(), strict=True))
        speeds = velocity[0] if len(names) == 1 else tuple(velocity)
        motion = simulate(system, **start, velocity=speeds, duration=length, tol=TOLERANCE, dense=False)
        return np.concatenate([np.atleast_1d(motion.position), np.atleast_1d(motion.velocity)])

    for p in range(periods):
        following = strobe(here)
        apart = strobe(here + away) - following
        distance = float(np.linalg.norm(apart))
        if distance == 0.0:
            break
        growth[p] = np.log(distance / np.linalg.norm(away))
        here, away = following, apart * (DISTANCE / distance)
        if progress is not None and p % 16 == 15:
            progress((p + 1) / periods)
    return growth
