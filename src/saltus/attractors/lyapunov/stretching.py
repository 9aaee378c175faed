"""The growth of small perturbations of many motions, by the derivatives of their ends by their starts."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from saltus.attractors.lyapunov.perturbations import Perturbations
from saltus.flow import Stop, ensemble_from
from saltus.systems import System


class Stretching(Perturbations):
    """Perturbations by derivatives, which are accurate along the growing direction however long a step is."""

    def longest_spans(self, rows: np.ndarray) -> np.ndarray:
        """A step may be as long as the run."""
        return np.full(len(rows), np.iinfo(int).max)

    def step(self, motions: np.ndarray, periods: int) -> None:
        """Follow these motions with their derivatives."""
        columns = {path: values[motions] for path, values in self.columns.items()}
        found = stretched(self.system, self.here[motions], self.direction[motions], columns, periods, self.tol)
        self.here[motions], self.direction[motions] = found[:2]
        self.growth[motions] += found[2]


def stretched(
    system: System, states: np.ndarray, direction: np.ndarray, columns: Mapping[str, np.ndarray], periods: int, tol: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """States, directions and ln of the growth of small perturbations after so many periods; nan where a motion is lost.

    If closed contacts and sticking frictions reduce a perturbation to 0, its factor is taken as the smallest positive number.
    """
    here = np.isfinite(states).all(axis=1)
    later, turned, growth = np.full_like(states, np.nan), np.full_like(states, np.nan), np.full(len(states), np.nan)
    if not here.any():
        return later, turned, growth
    chosen = {path: values[here] for path, values in columns.items()}
    ends = ensemble_from(system, states[here], periods, parameters=chosen, tol=tol, until=("rest",), derivatives=True)
    with np.errstate(invalid="ignore", over="ignore", divide="ignore"):
        grown = np.einsum("nij,nj->ni", ends.derivatives, direction[here])
        size = np.abs(grown).max(axis=1, keepdims=True)  # squares of perturbations that have grown by 1e200 would overflow
        length = size[:, 0] * np.linalg.norm(grown / np.where(size > 0.0, size, 1.0), axis=1)
        # Motions that are captured at rest are given up, as following their impacts to the rest would take millions of these.
        moving = (ends.side != 0) & ~ends.stopped(Stop.CAPTURED)
        gone = length == 0.0 if system.model.held else np.zeros(length.shape, dtype=bool)
        going = moving & np.isfinite(length) & ((length > 0.0) | gone)
        growth[here] = np.where(going, np.log(np.maximum(length, np.finfo(float).tiny)), np.nan)
        turned[here] = np.where(gone[:, None], direction[here], grown / length[:, None])
    later[here] = np.where(going[:, None], ends.last, np.nan)
    return later, turned, growth
