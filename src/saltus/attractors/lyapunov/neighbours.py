"""The largest exponents of many motions from pairs of neighbours, in lanes, for models with several contacts.

The derivative of such a motion by its start must be carried through every event by the scalar kernel, with a column for each
state variable; two motions are followed in lanes, also through accumulations of impacts, which is faster.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from saltus.attractors.lyapunov.perturbations import Perturbations
from saltus.attractors.lyapunov.settings import LYAPUNOV
from saltus.attractors.lyapunov.stretching import stretched
from saltus.flow import Stop, ensemble_from
from saltus.orbits import states_beside


@dataclass(frozen=True)
class NeighbourSettings:
    """How pairs are followed before they are brought together again."""

    # The longest time between two renormalisations, in units of time, but at least a forcing period: with an exponent of 0.3 the
    # distance of neighbours grows by a factor of 2000 in it, to 2e-4.
    longest_span: float = 26.0
    most_periods: int = 16  # The largest number of forcing periods between two renormalisations.
    # The smallest factor of the distance of a pair that is measured by the pair: the distance is then 100 times the error of a
    # step. Smaller factors are measured by derivatives.
    least: float = 1e-4


SETTINGS = NeighbourSettings()


class Neighbours(Perturbations):
    """Pairs of motions, whose distance is reset to 1e-7 after each span."""

    def longest_spans(self, rows: np.ndarray) -> np.ndarray:
        """The number of forcing periods within which neighbours stay near, even if they are chaotic."""
        return np.asarray(np.clip(SETTINGS.longest_span / self.lengths[rows], 1, SETTINGS.most_periods).astype(int))

    def step(self, motions: np.ndarray, periods: int) -> None:
        """Follow these motions and their neighbours, and bring each pair together again."""
        if not motions.size:
            return
        here, away = self.here[motions], LYAPUNOV.distance * self.direction[motions]
        beside = states_beside(self.system, here, away)
        twice = {path: np.tile(values[motions], 2) for path, values in self.columns.items()}
        ends = ensemble_from(self.system, np.concatenate([here, beside]), periods, parameters=twice, tol=self.tol)
        moving = (ends.side != 0) & ends.stopped(Stop.HORIZON)
        first, second = ends.last.reshape(2, *here.shape)
        going = moving.reshape(2, -1).all(axis=0) & np.isfinite(first).all(axis=1)
        with np.errstate(invalid="ignore", divide="ignore"):
            factor = np.linalg.norm(second - first, axis=1) / np.linalg.norm(beside - here, axis=1)
            turned, growth = (second - first) / np.linalg.norm(second - first, axis=1)[:, None], np.log(factor)
        weak = np.flatnonzero(going & ~(factor > SETTINGS.least))
        if weak.size:
            columns = {path: values[motions[weak]] for path, values in self.columns.items()}
            direction = self.direction[motions[weak]]
            first[weak], turned[weak], growth[weak] = stretched(self.system, here[weak], direction, columns, periods, self.tol)
        self.here[motions] = np.where(going[:, None], first, np.nan)
        self.direction[motions] = turned
        self.growth[motions] += np.where(going, growth, np.nan)
