"""The largest Lyapunov exponent of many motions at once, from few long stretches: what searching for chaos takes."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from saltus.attractors.lyapunov.averages import Estimate
from saltus.attractors.lyapunov.settings import LYAPUNOV
from saltus.flow import Stop, last_states, motions_from, stop_names
from saltus.systems import System


@dataclass(frozen=True, eq=False)
class Largest:
    """The largest exponents, an entry for each motion; nan where a motion has ended or come to rest."""

    exponent: np.ndarray  # per unit of dimensionless time
    error: np.ndarray  # half width of its 95 % interval
    positive: np.ndarray  # whether it is above its error and the resolution, in all and in both halves
    rates: np.ndarray  # (32, n): from each stretch
    duration: np.ndarray  # (n,): of the run

    @classmethod
    def of(cls, rates: np.ndarray, duration: np.ndarray) -> Largest:
        """The averages of rates (32, n) over runs of these durations, (n,)."""
        found = Estimate.of(rates)
        return cls(found.value, found.error, found.positive(duration), rates, duration)

    def averaged(self, chosen: np.ndarray) -> Largest:
        """The exponents of groups of motions that follow one another, averaged over those chosen, (groups, size).

        Motions on one attractor are samples of it, whose average has a smaller error than each of them.
        """
        rates = self.rates.reshape(-1, *chosen.shape)
        counted = chosen & np.isfinite(rates)
        with np.errstate(invalid="ignore"):
            mean = np.where(counted, rates, 0.0).sum(axis=2) / counted.sum(axis=2)
        return Largest.of(mean, self.duration.reshape(chosen.shape)[:, 0])


def largest_exponents(
    system: System, states: np.ndarray, parameters: Mapping[str, np.ndarray], *, periods: int = 12, tol: float = 1e-10
) -> Largest:
    """The growth of one small perturbation of each motion from states (n, 2) at phase 0 over 32 stretches of so many periods.

    Within a stretch the derivatives of the end to the start, through impacts, are those of `simulate_many`: along the direction
    that grows most they are accurate however far it grows, so that no frame need be kept orthonormal and a stretch may be long
    (`lyapunov_many` needs short ones: it follows the direction that shrinks, too).
    """
    states, direction = np.array(states, dtype=float), np.tile(np.sqrt([0.5, 0.5]), (len(states), 1))
    frequency = np.broadcast_to(parameters.get("load.frequency", np.array(system.load.frequency, dtype=float)), len(states))
    growth = np.full((LYAPUNOV.stretches, len(states)), np.nan)
    options = {"periods": periods, "sensitivities": (), "sample": (), "until": ("rest",), "tol": tol}
    for stretch in range(LYAPUNOV.stretches):
        here = np.flatnonzero(np.isfinite(states).all(axis=1))
        if not here.size:
            break
        columns = {path: values[here] for path, values in parameters.items()}
        ends = motions_from(system, states[here], parameters=columns, **options)
        grown = np.einsum("nij,nj->ni", ends["derivative"].values, direction[here])
        length = np.linalg.norm(grown, axis=1)
        # What is captured at rest would have to be followed through all of its impacts, of which there are millions.
        moving = (ends["side"].values != 0) & (stop_names(ends) != Stop.CAPTURED)
        going = moving & np.isfinite(length) & (length > 0.0)
        with np.errstate(divide="ignore", invalid="ignore"):
            growth[stretch, here] = np.where(going, np.log(length), np.nan)
            direction[here] = grown / length[:, None]
        states[here] = np.where(going[:, None], last_states(system, ends), np.nan)
    duration = periods * 2.0 * math.pi / frequency
    return Largest.of(growth / duration, LYAPUNOV.stretches * duration)
