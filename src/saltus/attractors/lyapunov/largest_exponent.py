"""The largest Lyapunov exponent of many motions at once, from few long stretches: what searching for chaos takes."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from saltus.attractors.lyapunov.averages import average, uncertainty
from saltus.attractors.lyapunov.spectrum import resolution
from saltus.flow import simulate_many
from saltus.systems import System

STRETCHES = 32  # whose means give error bars to both halves of the run


@dataclass(frozen=True, eq=False)
class Largest:
    """The largest exponents, an entry for each motion; nan where a motion has ended or come to rest."""

    exponent: np.ndarray  # per unit of dimensionless time
    error: np.ndarray  # half width of its 95 % interval
    positive: np.ndarray  # whether it is above its error and the resolution, in all and in both halves
    states: np.ndarray  # (n, 2) at the end

    def replaced(self, rows: np.ndarray, other: Largest) -> Largest:
        """The same with some of its motions from another run."""
        columns = {}
        for name in ("exponent", "error", "positive", "states"):
            columns[name] = getattr(self, name).copy()
            columns[name][rows] = getattr(other, name)
        return Largest(**columns)


def largest_exponents(
    system: System, states: np.ndarray, parameters: Mapping[str, np.ndarray], *, periods: int = 12, tol: float = 1e-10
) -> Largest:
    """The growth of one small perturbation of each motion from states (n, 2) at phase 0 over 32 stretches of so many periods.

    Within a stretch the derivatives of the end to the start, through impacts, are those of `simulate_many`: along the direction
    that grows most they are accurate however far it grows, so that no frame need be kept orthonormal and a stretch may be long
    (`lyapunov_many` needs short ones: it follows the direction that shrinks, too).
    """
    name, n = system.model.coordinates[0], len(states)
    states, direction = np.array(states, dtype=float), np.tile(np.sqrt([0.5, 0.5]), (n, 1))
    frequency = np.broadcast_to(parameters.get("load.frequency", np.array(system.load.frequency, dtype=float)), n)
    growth = np.full((STRETCHES, n), np.nan)
    for stretch in range(STRETCHES):
        here = np.flatnonzero(np.isfinite(states).all(axis=1))
        if not here.size:
            break
        begin: dict[str, Any] = {name: states[here, 0]}
        columns = {path: values[here] for path, values in parameters.items()}
        ends = simulate_many(
            system, **begin, velocity=states[here, 1], parameters=columns, periods=periods, sensitivities=(), sample=(), tol=tol
        )
        grown = np.einsum("nij,nj->ni", ends["derivative"].values, direction[here])
        length = np.linalg.norm(grown, axis=1)
        going = (ends["side"].values != 0) & np.isfinite(length) & (length > 0.0)
        with np.errstate(divide="ignore", invalid="ignore"):
            growth[stretch, here] = np.where(going, np.log(length), np.nan)
            direction[here] = grown / length[:, None]
        states[here] = np.stack([ends[name].values, ends["velocity"].values], axis=1)
        states[here[~going]] = np.nan
    return _judged(growth / (periods * 2.0 * math.pi / frequency), periods * 2.0 * math.pi / frequency, states)


def _judged(rates: np.ndarray, lengths: np.ndarray, states: np.ndarray) -> Largest:
    half = STRETCHES // 2
    positive = np.ones(rates.shape[1], dtype=bool)
    for part in (rates, rates[:half], rates[half:]):
        limit = np.array([resolution(len(part) * length) for length in lengths])
        positive &= average(part) - uncertainty(part) > limit
    return Largest(average(rates), uncertainty(rates), positive, states)
