"""The growth of small perturbations of many motions, and the largest exponents of groups of
motions, for the judge of chaos.

Averages along a motion are here too, each the mean of a correlated series with its error.

Perturbations grow by derivatives (`Stretching`) or, with several contacts, as the distance of two
motions (`Neighbours`). With several contacts the scalar kernel would have to carry the derivative
through every event, with a column for each state variable. Two motions are followed in lanes, also
through accumulations of impacts, which is faster.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.special import stdtrit

from saltus.attractors.stroboscopic_section import check_periodic
from saltus.checks import check_count, check_number
from saltus.errors import MotionError
from saltus.flow import Stop, end_of, ensemble_from, goes_alone, sensitivities
from saltus.systems import System, arguments_of, check_system, natural_units, states_beside


@dataclass(frozen=True)
class LyapunovSettings:
    """How long runs are cut, how their error bars are taken, and what the comparisons allow."""

    batches: int = 16  # The least number of batches from which a standard error is taken.
    # The two-sided 95 % point of Student's t with batches - 1 degrees of freedom.
    student: float = 2.131449545559323
    # Derivatives grow and shrink by less than 1e6 in this time, in natural units, a forcing period
    # at Omega = 1.
    longest_span: float = 6.5
    # The forcing periods after the run within which it is tested whether a motion repeats itself.
    look_back: int = 160
    lossless: float = 1.0 - 1e-14  # A product of impact factors below this counts as below 1.
    # The most motions that one thread follows together: enough to make the cost of a call small.
    largest_group: int = 256
    # Of two trajectories, in natural units: far above the error of a period, small enough for the
    # map to be linear.
    distance: float = 1e-7
    # The error of the exponent from two trajectories that their own numerical errors cause.
    accuracy: float = 1e-5
    tolerance: float = 1e-14  # The error of a step of the two trajectories.
    # Derivatives below this share of the largest are 0: contacts or frictions hold that direction.
    rounding: float = 1e-13
    # The longest time between two renormalisations of a pair of motions, in natural units, but at
    # least a forcing period: with an exponent of 0.3 the distance of neighbours grows by a factor
    # of 2000 in it, to 2e-4.
    pair_span: float = 26.0
    # The largest number of forcing periods between two renormalisations of a pair.
    pair_periods: int = 16
    # The smallest factor of the distance of a pair that is measured by the pair: the distance is
    # then 100 times the error of a step. Smaller factors are measured by derivatives.
    least_of_pair: float = 1e-4


LYAPUNOV = LyapunovSettings()


def weights(count: int) -> np.ndarray:
    """(count,): exp(-1 / (u (1 - u))) at the middles u of equal shares of the run, scaled to the
    sum 1.

    With these weights the average of a periodic or quasi-periodic series converges faster than any
    power of the length (Das, Saiki, Sander and Yorke, Nonlinearity 30 (2017) 4111). The plain mean
    has an error of 1 / length; and the beginning of the run, which may still depend on the start,
    has no weight. In chaos the standard error is larger by a quarter.
    """
    u = (np.arange(count) + 0.5) / count
    bump = np.exp(4.0 - 1.0 / (u * (1.0 - u)))
    result: np.ndarray = bump / bump.sum()
    return result


def average(series: np.ndarray) -> np.ndarray:
    """The weighted average along the first axis, (periods, ...) -> (...); -inf where an entry
    is.
    """
    lost = np.isneginf(series).any(axis=0)
    share = weights(len(series)).reshape(-1, *[1] * (series.ndim - 1))
    terms = share * np.where(np.isneginf(series), 0.0, series)
    # added one by one, whatever else is in the array
    return np.where(lost, -np.inf, np.cumsum(terms, axis=0)[-1])


def uncertainty(series: np.ndarray) -> np.ndarray:
    """Half the width of the 95 % interval of `average`, (periods, ...) -> (...); 0 where an entry
    is -inf.

    The entries of the series are correlated, so that their scatter alone gives no error. The means
    of batches of 1, 2, 4, ... entries are less and less correlated; with a positive correlation the
    standard error from them grows with the batches, until these are longer than the correlation
    lasts. The largest standard error from 16 to 127 batches is taken, times the factor of Student's
    t for 16. It is right as long as the correlation decays within a sixteenth of the run; for
    regular motion, whose averages converge faster than their scatter shows, it is far too large.

    Raises
    ------
    ValueError
        Fewer than 16 entries.
    """
    if len(series) < LYAPUNOV.batches:
        raise ValueError(
            f"an error bar takes a series of at least {LYAPUNOV.batches} entries, got {len(series)}"
        )
    lost = np.isneginf(series).any(axis=0)
    finite = np.where(np.isneginf(series), 0.0, series)
    widening = np.sqrt(len(series) * np.sum(weights(len(series)) ** 2))
    return np.where(lost, 0.0, LYAPUNOV.student * widening * _largest_standard_error(finite))


@dataclass(frozen=True, eq=False)
class Estimate:
    """Averages of rates over a run and over each of its halves, with half widths of their 95 %
    intervals.
    """

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

    def positive(self, duration: Any, unit: Any = 1.0) -> np.ndarray:
        """Whether rates of growth over runs of these durations are above 0 by more than their error
        and the resolution, over the whole run and over both of its halves."""
        above = self.value - self.error > resolution(duration, unit)
        return np.asarray(
            above
            & (self.halves - self.half_errors > resolution(np.asarray(duration) / 2, unit)).all(
                axis=0
            )
        )


def resolution(duration: Any, unit: Any = 1.0) -> Any:
    """2 ln(t) / t: the mean rate of growth over a run of duration t of a perturbation that grows as
    the square of the time, which is measured in a natural unit.
    """
    return np.vectorize(lambda t, unit: 2.0 * math.log(max(t / unit, math.e)) / t, otypes=[float])(
        duration, unit
    )


def _largest_standard_error(series: np.ndarray) -> Any:
    result = np.zeros(series.shape[1:])
    length = 1
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
    check_system(
        system,
        function,
        several_contacts=True,
        multipliers=True,
        switches=True,
        resets=True,
        relays=True,
    )
    check_periodic(system)
    check_count("periods", periods, 2 * LYAPUNOV.batches)
    check_count("transient", transient, 0)
    check_number("tol", tol, at_least=1e-15, at_most=1e-6)


def period_length(system: System) -> float:
    """The forcing period; under constant loads a natural unit of time, rounded to a power of 2, is
    taken instead."""
    return system.load.period or natural_units(system).powers_of_two.time


def span_count(length: float, unit: float = 1.0) -> int:
    """Into how many spans a period of this length is cut, with a natural unit of time."""
    return max(1, math.ceil(length / (LYAPUNOV.longest_span * unit)))


def first_frame(size: int) -> np.ndarray:
    """An orthonormal frame to begin with, (size, size), of random directions.

    A frame along the coordinates may lie in an invariant plane of a system, and would stay in it
    until rounding moves it out.
    """
    frame: np.ndarray = np.linalg.qr(np.random.default_rng(0).standard_normal((size, size)))[0]
    return frame


class Perturbations(ABC):
    """A perturbation of each motion, which has turned to the direction of the largest growth before
    its growth is measured.

    Parameters
    ----------
    system
        What moves, under a load with a frequency.
    states
        (groups, size, d) at phase 0, where the motions begin.
    parameters
        Numbers by dotted path, (groups,) each, in place of the system's.
    turning
        Forcing periods in which the perturbations turn to the direction that grows, before their
        growth counts.
    tol
        The error of a step.
    """

    def __init__(
        self,
        system: System,
        states: np.ndarray,
        parameters: Mapping[str, np.ndarray],
        *,
        turning: int,
        tol: float,
    ) -> None:
        groups, self.size, d = states.shape
        frequency = parameters.get("load.frequency", np.array(system.load.frequency, dtype=float))
        self.system = system
        self.tol = tol
        self.lengths = np.broadcast_to(2.0 * math.pi / frequency, groups)
        self.columns = {path: np.repeat(values, self.size) for path, values in parameters.items()}
        self.here = states.reshape(-1, d).copy()  # (n, d): nan once a motion is lost
        self.units = natural_units(system).perturbation  # in which perturbations are measured
        # the sides of relays, which are behind the states, are not perturbed
        self.own = system.dimension
        self.direction = np.full((len(self.here), self.own), math.sqrt(1.0 / self.own))
        # ln of the factor by which each has grown; nan once its motion is lost
        self.growth = np.zeros(groups * self.size)
        self.periods = np.zeros(groups, dtype=int)
        self._go_on(np.arange(groups), max(1, turning))
        self.growth[:] = np.where(np.isnan(self.growth), np.nan, 0.0)
        self.periods[:] = 0

    def rates(self, rows: np.ndarray, periods: int) -> tuple[np.ndarray, np.ndarray]:
        """Rates of growth (groups, size) over so many periods in all, of these groups; and their
        times, (groups,).
        """
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
        """Follow the motions of these indices for so many periods: update their states, the
        perturbations and the growth.
        """


class Stretching(Perturbations):
    """Perturbations by derivatives, which are accurate along the growing direction however long a
    step is.
    """

    def longest_spans(self, rows: np.ndarray) -> np.ndarray:
        """A step may be as long as the run."""
        return np.full(len(rows), np.iinfo(int).max)

    def step(self, motions: np.ndarray, periods: int) -> None:
        """Follow these motions with their derivatives."""
        columns = {path: values[motions] for path, values in self.columns.items()}
        found = stretched(
            self.system, self.here[motions], self.direction[motions], columns, periods, self.tol
        )
        self.here[motions], self.direction[motions] = found[:2]
        self.growth[motions] += found[2]


def stretched(
    system: System,
    states: np.ndarray,
    direction: np.ndarray,
    columns: Mapping[str, np.ndarray],
    periods: int,
    tol: float,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """States, directions in natural units and ln of the growth of small perturbations after so many
    periods; nan where a motion is lost.

    If a rest, closed contacts or sticking frictions reduce a perturbation to 0, its factor is the
    smallest positive number.
    """
    here = np.isfinite(states).all(axis=1)
    later = np.full_like(states, np.nan)
    turned = np.full_like(direction, np.nan)
    growth = np.full(len(states), np.nan)
    if not here.any():
        return later, turned, growth
    chosen = {path: values[here] for path, values in columns.items()}
    units = natural_units(system).perturbation
    if goes_alone(system.model):
        last, derivatives, moving = _followed_alone(system, states[here], chosen, periods, tol)
    else:
        ends = ensemble_from(
            system,
            states[here],
            periods,
            parameters=chosen,
            tol=tol,
            until=("rest",),
            derivatives=True,
        )
        last = ends.last
        derivatives = ends.derivatives
        # Motions that are captured at rest are given up, as following their impacts to the rest
        # would take millions of these.
        moving = (ends.side != 0) & ~ends.stopped(Stop.CAPTURED)
    with np.errstate(invalid="ignore", over="ignore", divide="ignore"):
        grown = np.einsum("nij,nj->ni", derivatives, direction[here] * units) / units
        # squares of perturbations that have grown by 1e200 would overflow
        size = np.abs(grown).max(axis=1, keepdims=True)
        length = size[:, 0] * np.linalg.norm(grown / np.where(size > 0.0, size, 1.0), axis=1)
        gone = length == 0.0  # after a rest all that was beside the motion is in the same state
        going = moving & np.isfinite(length) & ((length > 0.0) | gone)
        growth[here] = np.where(going, np.log(np.maximum(length, np.finfo(float).tiny)), np.nan)
        turned[here] = np.where(gone[:, None], direction[here], grown / length[:, None])
    later[here] = np.where(going[:, None], last, np.nan)
    return later, turned, growth


def _followed_alone(
    system: System,
    states: np.ndarray,
    columns: Mapping[str, np.ndarray],
    periods: int,
    tol: float,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The ends of motions that are followed one by one, (n, d), their derivatives, and which of them
    go on moving.
    """
    own = system.dimension
    last = np.full_like(states, np.nan)
    derivatives = np.full((len(states), own, own), np.nan)
    moving = np.zeros(len(states), dtype=bool)
    for row, state in enumerate(states):
        numbers = {path: float(values[row]) for path, values in columns.items()}
        one = system.with_(numbers) if numbers else system
        try:
            found = sensitivities(
                one, **arguments_of(one, state), periods=periods, tol=tol, dense=False
            )
        except MotionError:
            continue
        last[row] = end_of(found.motion)
        derivatives[row] = found.state
        moving[row] = found.motion.stop is Stop.HORIZON
    return last, derivatives, moving


class Neighbours(Perturbations):
    """Pairs of motions, whose distance is reset to 1e-7 after each span."""

    def longest_spans(self, rows: np.ndarray) -> np.ndarray:
        """The number of forcing periods within which neighbours stay near, even if they are
        chaotic.
        """
        return np.asarray(
            np.clip(
                LYAPUNOV.pair_span * natural_units(self.system).own_time / self.lengths[rows],
                1,
                LYAPUNOV.pair_periods,
            ).astype(int)
        )

    def step(self, motions: np.ndarray, periods: int) -> None:
        """Follow these motions and their neighbours, and bring each pair together again."""
        if not motions.size:
            return
        here = self.here[motions]
        away = LYAPUNOV.distance * self.direction[motions] * self.units
        beside = states_beside(self.system, here, away)
        twice = {path: np.tile(values[motions], 2) for path, values in self.columns.items()}
        ends = ensemble_from(
            self.system, np.concatenate([here, beside]), periods, parameters=twice, tol=self.tol
        )
        moving = (ends.side != 0) & ends.stopped(Stop.HORIZON)
        first, second = ends.last.reshape(2, *here.shape)
        going = moving.reshape(2, -1).all(axis=0) & np.isfinite(first).all(axis=1)
        with np.errstate(invalid="ignore", divide="ignore"):
            apart = (second - first)[:, : self.own] / self.units
            length = np.linalg.norm(apart, axis=1)
            begun = (beside - here)[:, : self.own] / self.units
            factor = length / np.linalg.norm(begun, axis=1)
            turned = apart / length[:, None]
            growth = np.log(factor)
        weak = np.flatnonzero(going & ~(factor > LYAPUNOV.least_of_pair))
        if weak.size:
            columns = {path: values[motions[weak]] for path, values in self.columns.items()}
            direction = self.direction[motions[weak]]
            first[weak], turned[weak], growth[weak] = stretched(
                self.system, here[weak], direction, columns, periods, self.tol
            )
        self.here[motions] = np.where(going[:, None], first, np.nan)
        self.direction[motions] = turned
        self.growth[motions] += np.where(going, growth, np.nan)


FEWEST = 4  # the fewest motions from whose scatter an error is taken


@dataclass(frozen=True, eq=False)
class Largest:
    """Largest exponents with half widths of their 95 % intervals, per unit of dimensionless time;
    an entry for each group.
    """

    exponent: np.ndarray  # (groups,): nan where fewer than four motions of a group have an exponent
    error: np.ndarray
    resolution: np.ndarray  # (groups,): what regular motion may show
    positive: np.ndarray  # (groups,): whether it is above its error and the resolution
    negative: np.ndarray  # (groups,): whether it is below them

    @classmethod
    def unknown(cls, groups: int) -> Largest:
        """The entries of so many groups of which nothing is known yet."""
        return cls(*np.full((3, groups), np.nan), *np.zeros((2, groups), dtype=bool))

    def put(self, rows: np.ndarray, other: Largest) -> None:
        """Replace the entries of these groups."""
        for name in ("exponent", "error", "resolution", "positive", "negative"):
            getattr(self, name)[rows] = getattr(other, name)


class LargestExponents:
    """The largest exponent of each group of motions, from a run that can be made longer while the
    sign is open.

    The motions of a group are taken as independent samples of one attractor, so that their scatter
    gives the error, by Student's t. Motions that are lost are left out, and so are motions whose
    perturbations surely shrink if those of others surely grow. The growth is that of derivatives
    (`Stretching`) or, with several contacts, of the distance of two motions (`Neighbours`).

    The resolution is 2 ln(t) / t for the time t of one motion, as the distance of regular motions
    may grow like t^2.

    Parameters
    ----------
    system
        What moves, under a load with a frequency.
    states
        (groups, size, d) at phase 0.
    parameters
        Numbers by dotted path, (groups,) each, in place of the system's.
    shortest
        The forcing periods of the shortest run. Before it, perturbations are followed for a quarter
        of this time, to turn to the direction that grows.
    tol
        The error of a step.
    """

    def __init__(
        self,
        system: System,
        states: np.ndarray,
        parameters: Mapping[str, np.ndarray],
        *,
        shortest: int,
        tol: float = 1e-10,
    ) -> None:
        kind = Neighbours if system.model.names_its_contacts else Stretching
        self._perturbations = kind(system, states, parameters, turning=shortest // 4, tol=tol)
        self.found = Largest.unknown(len(states))

    def go_on(self, rows: np.ndarray, periods: int) -> None:
        """Measure the exponents of these groups over so many forcing periods in all."""
        unit = self._perturbations.lengths[rows] / (2.0 * math.pi)
        self.found.put(rows, _averaged(*self._perturbations.rates(rows, periods), unit))


def _averaged(rates: np.ndarray, duration: np.ndarray, unit: np.ndarray) -> Largest:
    """The averages of rates (groups, size) over these times, (groups,); averages within the
    resolution are of neither sign.
    """
    least = resolution(duration, unit)
    surely = np.abs(rates) > least[:, None]
    grows = surely & (rates > 0.0)
    shrinks = surely & (rates < 0.0)
    counted = np.isfinite(rates) & ~(shrinks & grows.any(axis=1)[:, None])
    count = counted.sum(axis=1)
    enough = np.where(count < FEWEST, np.nan, count)
    mean = np.where(counted, rates, 0.0).sum(axis=1) / enough
    scatter = np.sqrt(
        (np.where(counted, rates - mean[:, None], 0.0) ** 2).sum(axis=1) / (enough - 1.0)
    )
    error = stdtrit(enough - 1.0, 0.975) * scatter / np.sqrt(enough)
    with np.errstate(invalid="ignore"):
        return Largest(mean, error, least, mean - error > least, mean + error < -least)
