"""The stroboscopic map's largest exponent without derivatives, from two trajectories beside one another."""

from __future__ import annotations

from typing import Any

import numpy as np

from saltus.attractors.lyapunov.renormalisation import state_of
from saltus.attractors.lyapunov.settings import LYAPUNOV
from saltus.flow import simulate
from saltus.orbits import states_beside
from saltus.progress import Progress, silent
from saltus.systems import System


def separation_growth(
    system: System, state: dict[str, Any], periods: int, length: float, progress: Progress = silent
) -> np.ndarray:
    """ln(distance after a period / distance before) for each period, (periods,); -inf once both states are the same.

    After each period the second state is moved along the line to the first one, back to the distance of 1e-7 (Benettin, Galgani,
    Giorgilli and Strelcyn, Meccanica 15 (1980) 9). The two may lie on different sides of the contact, or have different numbers
    of impacts. Of several contacts, those that are closed in the first state are closed in the second.
    """
    here = _vector(state)
    away = np.full(here.size, LYAPUNOV.distance / np.sqrt(here.size))
    growth = np.full(periods, -np.inf)
    for p in range(periods):
        beside, following = states_beside(system, here, away), _mapped(system, here, length)
        before = float(np.linalg.norm(beside - here))
        apart = _mapped(system, beside, length) - following
        distance = float(np.linalg.norm(apart))
        if distance == 0.0 or before == 0.0:
            break
        growth[p] = np.log(distance / before)
        here, away = following, apart * (LYAPUNOV.distance / distance)
        if p % LYAPUNOV.every == LYAPUNOV.every - 1:
            progress((p + 1) / periods, "two trajectories")
    return growth


def _vector(state: dict[str, Any]) -> np.ndarray:
    """Coordinates, then velocities."""
    return np.concatenate([np.atleast_1d(values) for values in state.values()]).astype(float)


def _mapped(system: System, state: np.ndarray, length: float) -> np.ndarray:
    """The state a period later."""
    names = system.model.coordinates
    velocity = state[len(names) :].tolist()
    start: dict[str, Any] = dict(zip(names, state[: len(names)].tolist(), strict=True))
    start["velocity"] = velocity[0] if len(names) == 1 else tuple(velocity)
    return _vector(state_of(simulate(system, **start, duration=length, tol=LYAPUNOV.tolerance, dense=False)))
