"""Dense output: the Taylor series of every step, evaluated anywhere at the method's accuracy."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True, eq=False)
class DenseOutput:
    """The steps of a motion: step i starts at `start[i]` on `side[i]` (0: at rest) and holds the coordinates' Taylor series.

    `series` has shape (steps, degrees of freedom, order + 2), in powers of the time since the step's start.
    """

    start: np.ndarray
    length: np.ndarray
    side: np.ndarray
    series: np.ndarray

    @property
    def end(self) -> float:
        """When the last step ends."""
        return float(self.start[-1] + self.length[-1])

    def states(self, times: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Coordinates and velocities, each (degrees of freedom, n), and sides (n,); at an impact, those after it."""
        step = np.clip(np.searchsorted(self.start, times, side="right") - 1, 0, None)
        tau = times - self.start[step]
        powers = np.arange(self.series.shape[2])
        coefficients = self.series[step]
        slopes = coefficients[:, :, 1:] * powers[1:]
        return evaluate(coefficients, tau), evaluate(slopes, tau), self.side[step]


def evaluate(coefficients: np.ndarray, tau: np.ndarray) -> np.ndarray:
    """Horner's scheme for many series at once: (n, dof, order) at (n,) gives (dof, n)."""
    value = coefficients[:, :, -1]
    for k in range(coefficients.shape[2] - 2, -1, -1):
        value = value * tau[:, None] + coefficients[:, :, k]
    return value.T
