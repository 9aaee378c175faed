"""The largest exponents of many motions from pairs of neighbours, in lanes, for models with several contacts.

A derivative of such a motion to its start is moved through every event by the scalar kernel, with a column for each variable of
the state, while two motions go on in lanes, also through impacts that die away.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from saltus.attractors.lyapunov.settings import LYAPUNOV
from saltus.attractors.lyapunov.stretching import stretched
from saltus.flow import Stop, last_states, motions_from, stop_names
from saltus.orbits import states_beside
from saltus.systems import System


@dataclass(frozen=True)
class NeighbourSettings:
    """How pairs are followed before they are brought together again."""

    # The longest time between two renormalisations, in units of time, if a forcing period is not longer: neighbours whose
    # exponent is 0.3 part by a factor of 2000 in it, and are still 2e-4 from one another.
    longest_span: float = 26.0
    most_periods: int = 16  # The largest number of forcing periods between two of them.
    # The factor by which a pair may come together and still say by how much: its distance is then 100 times the error of a step.
    # What shrinks more is measured by derivatives.
    least: float = 1e-4


SETTINGS = NeighbourSettings()


class Neighbours:
    """Pairs of motions, whose distance is brought back to 1e-7 again and again; a run can be made longer.

    Parameters
    ----------
    states
        (groups, size, d) at phase 0, where the motions begin.
    parameters
        Numbers by dotted path, (groups,) each, in place of the system's.
    lengths
        (groups,): of their forcing periods.
    turning
        Forcing periods in which the pairs turn to the direction that grows, before their growth counts.
    tol
        The error of a step.
    """

    def __init__(
        self,
        system: System,
        states: np.ndarray,
        parameters: Mapping[str, np.ndarray],
        lengths: np.ndarray,
        turning: int,
        tol: float,
    ) -> None:
        groups, self.size, d = states.shape
        self.system, self.tol, self.lengths = system, tol, lengths
        self.columns = {path: np.repeat(values, self.size) for path, values in parameters.items()}
        self.here = states.reshape(-1, d).copy()  # (n, d): nan once a motion is lost
        self.away = np.full_like(self.here, LYAPUNOV.distance / math.sqrt(d))
        self.growth = np.zeros(groups * self.size)
        self.periods = np.zeros(groups, dtype=int)
        self.spans = np.clip(SETTINGS.longest_span / self.lengths, 1, SETTINGS.most_periods).astype(int)
        self._go_on(np.arange(groups), max(1, turning))
        self.growth[:], self.periods[:] = np.where(np.isnan(self.growth), np.nan, 0.0), 0

    def rates(self, rows: np.ndarray, periods: int) -> tuple[np.ndarray, np.ndarray]:
        """Rates of growth (groups, size) over at least so many periods in all, of these groups; and their times, (groups,)."""
        self._go_on(rows, periods)
        time = self.periods[rows] * self.lengths[rows]
        return self.growth.reshape(-1, self.size)[rows] / time[:, None], time

    def _go_on(self, rows: np.ndarray, periods: int) -> None:
        """Follow these groups until so many periods are done; what one does depends on no other one."""
        for span in np.unique(self.spans[rows]).tolist():
            part = rows[self.spans[rows] == span]
            while (part := part[self.periods[part] < periods]).size:
                self._step((part[:, None] * self.size + np.arange(self.size)).ravel(), span)
                self.periods[part] += span

    def _step(self, motions: np.ndarray, span: int) -> None:
        """Follow these motions and their neighbours for so many periods, and bring each pair together again."""
        motions = motions[np.isfinite(self.here[motions]).all(axis=1)]
        if not motions.size:
            return
        here, away = self.here[motions], self.away[motions]
        beside = states_beside(self.system, here, away)
        twice = {path: np.tile(values[motions], 2) for path, values in self.columns.items()}
        options = {"parameters": twice, "periods": span, "sample": (), "tol": self.tol}
        ends = motions_from(self.system, np.concatenate([here, beside]), **options)
        moving = (ends["side"].values != 0) & (stop_names(ends) == Stop.HORIZON)
        first, second = last_states(self.system, ends).reshape(2, *here.shape)
        going = moving.reshape(2, -1).all(axis=0) & np.isfinite(first).all(axis=1)
        with np.errstate(invalid="ignore", divide="ignore"):
            factor = np.linalg.norm(second - first, axis=1) / np.linalg.norm(beside - here, axis=1)
            turned, growth = (second - first) / np.linalg.norm(second - first, axis=1)[:, None], np.log(factor)
        weak = np.flatnonzero(going & ~(factor > SETTINGS.least))
        if weak.size:
            columns = {path: values[motions[weak]] for path, values in self.columns.items()}
            direction = away[weak] / np.linalg.norm(away[weak], axis=1)[:, None]
            first[weak], turned[weak], growth[weak] = stretched(self.system, here[weak], direction, columns, span, self.tol)
        self.here[motions] = np.where(going[:, None], first, np.nan)
        self.away[motions] = LYAPUNOV.distance * turned
        self.growth[motions] += np.where(going, growth, np.nan)
