"""Averages along a motion: the mean of a correlated series with its error, and how the run behind it is begun and cut."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from saltus.attractors.stroboscopic_section import check_periodic
from saltus.checks import check_count, check_number
from saltus.systems import System, check_system


@dataclass(frozen=True)
class LyapunovSettings:
    """How long runs are cut, how their error bars are taken, and what the comparisons allow."""

    batches: int = 16  # The least number of batches from which a standard error is taken.
    student: float = 2.131449545559323  # The two-sided 95 % point of Student's t with batches - 1 degrees of freedom.
    stretches: int = 32  # The number of stretches of a search, whose means give error bars to both halves of the run.
    longest_span: float = 6.5  # Derivatives grow and shrink by less than 1e6 in this time, a forcing period at Omega = 1.
    look_back: int = 160  # The forcing periods after the run within which it is tested whether a motion repeats itself.
    lossless: float = 1.0 - 1e-14  # A product of impact factors below this counts as below 1.
    largest_group: int = 256  # The most motions that one thread follows together: enough to make the cost of a call small.
    look: float = 0.2  # The time between checks for Ctrl-C and reports of progress, s.
    distance: float = 1e-7  # Of two trajectories: far above the error of a period, small enough for the map to be linear.
    accuracy: float = 1e-5  # The error of the exponent from two trajectories that their own numerical errors cause.
    tolerance: float = 1e-14  # The error of a step of the two trajectories.
    rounding: float = 1e-13  # Derivatives below this share of the largest are 0: contacts or frictions hold that direction.
    # The longest time between two renormalisations of a pair of motions, in units of time, but at least a forcing period: with an
    # exponent of 0.3 the distance of neighbours grows by a factor of 2000 in it, to 2e-4.
    pair_span: float = 26.0
    pair_periods: int = 16  # The largest number of forcing periods between two renormalisations of a pair.
    # The smallest factor of the distance of a pair that is measured by the pair: the distance is then 100 times the error of a
    # step. Smaller factors are measured by derivatives.
    least_of_pair: float = 1e-4
    every: int = 16  # The number of periods between calls of the progress.


LYAPUNOV = LyapunovSettings()


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


def check_run(function: str, system: Any, periods: Any, transient: Any, tol: float) -> None:
    """Refuse systems that have no exponents, and runs too short for error bars of their halves.

    Raises
    ------
    ParameterError
        The error has the name of the argument.
    """
    check_system(system, function, several_contacts=True)
    check_periodic(system)
    check_count("periods", periods, 2 * LYAPUNOV.batches)
    check_count("transient", transient, 0)
    check_number("tol", tol, at_least=1e-15, at_most=1e-6)


def period_length(system: System) -> float:
    """The forcing period; under constant loads 1, a unit of time, is taken instead."""
    return system.load.period or 1.0


def span_count(length: float) -> int:
    """Into how many spans a period of this length is cut."""
    return max(1, math.ceil(length / LYAPUNOV.longest_span))


def first_frame(size: int) -> np.ndarray:
    """An orthonormal frame to begin with, (size, size), of random directions.

    A frame along the coordinates may lie in an invariant plane of a system, and would stay in it until rounding moves it out.
    """
    frame: np.ndarray = np.linalg.qr(np.random.default_rng(0).standard_normal((size, size)))[0]
    return frame
