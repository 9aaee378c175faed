"""The growth of small perturbations of many motions, over a run that can be made longer."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Mapping

import numpy as np

from saltus.systems import System


class Perturbations(ABC):
    """A perturbation of each motion, which has turned to the direction of the largest growth before its growth is measured.

    Parameters
    ----------
    system
        What moves, under a load with a frequency.
    states
        (groups, size, d) at phase 0, where the motions begin.
    parameters
        Numbers by dotted path, (groups,) each, in place of the system's.
    turning
        Forcing periods in which the perturbations turn to the direction that grows, before their growth counts.
    tol
        The error of a step.
    """

    def __init__(
        self, system: System, states: np.ndarray, parameters: Mapping[str, np.ndarray], *, turning: int, tol: float
    ) -> None:
        groups, self.size, d = states.shape
        frequency = parameters.get("load.frequency", np.array(system.load.frequency, dtype=float))
        self.system, self.tol, self.lengths = system, tol, np.broadcast_to(2.0 * math.pi / frequency, groups)
        self.columns = {path: np.repeat(values, self.size) for path, values in parameters.items()}
        self.here = states.reshape(-1, d).copy()  # (n, d): nan once a motion is lost
        self.direction = np.full_like(self.here, math.sqrt(1.0 / d))
        self.growth = np.zeros(groups * self.size)  # ln of the factor by which each has grown; nan once its motion is lost
        self.periods = np.zeros(groups, dtype=int)
        self._go_on(np.arange(groups), max(1, turning))
        self.growth[:], self.periods[:] = np.where(np.isnan(self.growth), np.nan, 0.0), 0

    def rates(self, rows: np.ndarray, periods: int) -> tuple[np.ndarray, np.ndarray]:
        """Rates of growth (groups, size) over so many periods in all, of these groups; and their times, (groups,)."""
        self._go_on(rows, periods)
        time = self.periods[rows] * self.lengths[rows]
        return self.growth.reshape(-1, self.size)[rows] / time[:, None], time

    def _go_on(self, rows: np.ndarray, periods: int) -> None:
        """Follow these groups until so many periods are done; none depends on the others."""
        while (rows := rows[self.periods[rows] < periods]).size:
            spans = np.minimum(self.longest_spans(rows), periods - self.periods[rows])
            for span in np.unique(spans).tolist():
                part = rows[spans == span]
                motions = (part[:, None] * self.size + np.arange(self.size)).ravel()
                self.step(motions[np.isfinite(self.here[motions]).all(axis=1)], span)
                self.periods[part] += span

    @abstractmethod
    def longest_spans(self, rows: np.ndarray) -> np.ndarray:
        """The largest number of forcing periods of a step of each of these groups."""

    @abstractmethod
    def step(self, motions: np.ndarray, periods: int) -> None:
        """Follow the motions of these indices for so many periods: update their states, the perturbations and the growth."""
