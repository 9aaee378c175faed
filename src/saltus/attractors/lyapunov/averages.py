"""Averages along a motion: the mean of a correlated series from a long run, and its error."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from saltus.attractors.lyapunov.settings import LYAPUNOV


def weights(count: int) -> np.ndarray:
    """(count,): exp(-1 / (u (1 - u))) at the middles u of equal shares of the run, scaled to the sum 1.

    With these weights the average of a periodic or quasi-periodic series converges faster than any power of the length (Das,
    Saiki, Sander and Yorke, Nonlinearity 30 (2017) 4111), while the plain mean has an error of 1 / length; and the beginning of
    the run, which may still depend on the start, has no weight. In chaos the standard error is larger by a quarter.
    """
    u = (np.arange(count) + 0.5) / count
    bump = np.exp(4.0 - 1.0 / (u * (1.0 - u)))
    result: np.ndarray = bump / bump.sum()
    return result


def average(series: np.ndarray) -> np.ndarray:
    """The weighted average along the first axis, (periods, ...) -> (...); -inf where an entry is."""
    lost = np.isneginf(series).any(axis=0)
    share = weights(len(series)).reshape(-1, *[1] * (series.ndim - 1))
    terms = share * np.where(np.isneginf(series), 0.0, series)
    return np.where(lost, -np.inf, np.cumsum(terms, axis=0)[-1])  # added one by one, whatever else is in the array


def uncertainty(series: np.ndarray) -> np.ndarray:
    """Half the width of the 95 % interval of `average`, (periods, ...) -> (...); 0 where an entry is -inf.

    The entries of the series are correlated, so that their scatter alone gives no error. The means of batches of 1, 2, 4, ...
    entries are less and less correlated; with a positive correlation the standard error from them grows with the batches, until
    these are longer than the correlation lasts. The largest standard error from 16 to 127 batches is taken, times the factor of
    Student's t for 16. It is right as long as the correlation decays within a sixteenth of the run; for regular motion, whose
    averages converge faster than their scatter shows, it is far too large.

    Raises
    ------
    ValueError
        Fewer than 16 entries.
    """
    if len(series) < LYAPUNOV.batches:
        raise ValueError(f"an error bar takes a series of at least {LYAPUNOV.batches} entries, got {len(series)}")
    lost = np.isneginf(series).any(axis=0)
    finite = np.where(np.isneginf(series), 0.0, series)
    widening = np.sqrt(len(series) * np.sum(weights(len(series)) ** 2))
    return np.where(lost, 0.0, LYAPUNOV.student * widening * _largest_standard_error(finite))


@dataclass(frozen=True, eq=False)
class Estimate:
    """Averages of rates over a run and over each of its halves, with half widths of their 95 % intervals."""

    value: np.ndarray  # (...)
    error: np.ndarray  # (...)
    halves: np.ndarray  # (2, ...): from the first and from the second half of the run
    half_errors: np.ndarray  # (2, ...)

    @classmethod
    def of(cls, rates: np.ndarray) -> Estimate:
        """The averages of a series of rates, (entries, ...)."""
        half = len(rates) // 2
        parts = (rates[:half], rates[-half:])
        averages, errors = ([measure(part) for part in parts] for measure in (average, uncertainty))
        return cls(average(rates), uncertainty(rates), np.stack(averages), np.stack(errors))

    def positive(self, duration: Any) -> np.ndarray:
        """Whether rates of growth over runs of these durations are above 0 by more than their error and the resolution, over the
        whole run and over both of its halves."""
        above = self.value - self.error > resolution(duration)
        return np.asarray(above & (self.halves - self.half_errors > resolution(np.asarray(duration) / 2)).all(axis=0))


def resolution(duration: Any) -> Any:
    """2 ln(t) / t: the mean rate of growth over a run of duration t of a perturbation that grows as the square of the time."""
    return np.vectorize(lambda t: 2.0 * math.log(max(t, math.e)) / t, otypes=[float])(duration)


def _largest_standard_error(series: np.ndarray) -> Any:
    result, length = np.zeros(series.shape[1:]), 1
    while len(series) // length >= 8 * LYAPUNOV.batches:
        length *= 2
    while len(series) // length >= LYAPUNOV.batches:
        count = len(series) // length
        means = series[: count * length].reshape(count, length, *series.shape[1:]).mean(axis=1)
        result = np.maximum(result, means.std(axis=0, ddof=1) / np.sqrt(count))
        length *= 2
    return result
