"""The largest Lyapunov exponent of many motions at once, as samples of their attractors: what searching for chaos takes."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import stdtrit

from saltus.attractors.lyapunov.averages import resolution
from saltus.attractors.lyapunov.neighbours import Neighbours
from saltus.attractors.lyapunov.stretching import stretched
from saltus.systems import System

FEWEST = 4  # motions of which a scatter is taken


@dataclass(frozen=True, eq=False)
class Largest:
    """Largest exponents with half widths of their 95 % intervals, per unit of dimensionless time; an entry for each group."""

    exponent: np.ndarray  # (groups,): nan where fewer than four motions of a group have an exponent
    error: np.ndarray
    positive: np.ndarray  # (groups,): whether it is above its error and the resolution
    negative: np.ndarray  # (groups,): whether it is below them

    @classmethod
    def unknown(cls, groups: int) -> Largest:
        """Of so many groups nothing."""
        return cls(*np.full((2, groups), np.nan), *np.zeros((2, groups), dtype=bool))

    @property
    def open_rows(self) -> np.ndarray:
        """The numbers of the groups whose sign is not known."""
        return np.flatnonzero(~self.positive & ~self.negative)

    def put(self, rows: np.ndarray, other: Largest) -> None:
        """Put what is now known of these groups in its place."""
        for name in ("exponent", "error", "positive", "negative"):
            getattr(self, name)[rows] = getattr(other, name)


def largest_exponents(
    system: System,
    states: np.ndarray,
    parameters: Mapping[str, np.ndarray],
    *,
    runs: Sequence[int],
    tol: float = 1e-10,
) -> Largest:
    """The largest exponent of each group of motions from states (groups, size, d) at phase 0, by ever longer runs.

    A group goes on to the next run as long as its sign is open. The motions of a group are taken for independent samples of one
    attractor, so that their scatter gives the error, by Student's t. Motions that are lost are left out, and so are those whose
    perturbations surely shrink where others surely grow. A perturbation is given a quarter of a run to turn to the direction that
    grows. Its growth is that of `simulate_many`'s derivatives, of which each run takes its own: along that direction they are
    accurate however far it grows. With several contacts it is the parting of two neighbouring motions (`Neighbours`); a run then
    goes on from the one before, and is twice as long.

    The resolution is 2 ln(t) / t for the time t of one motion, as regular ones may part like t^2.

    Parameters
    ----------
    parameters
        Numbers by dotted path, (groups,) each, in place of the system's.
    runs
        The forcing periods of each run, increasing.
    """
    groups = len(states)
    frequency = parameters.get("load.frequency", np.array(system.load.frequency, dtype=float))
    lengths = np.broadcast_to(2.0 * math.pi / frequency, groups)
    measured = _by_neighbours if system.model.contacts else _by_derivatives
    return measured(system, states, parameters, lengths, runs, tol)


def _by_neighbours(
    system: System, states: np.ndarray, columns: Mapping[str, np.ndarray], lengths: np.ndarray, runs: Sequence[int], tol: float
) -> Largest:
    """The exponents of groups from one run that is doubled as long as their signs are open."""
    neighbours, found = Neighbours(system, states, columns, lengths, runs[0] // 4, tol), Largest.unknown(len(states))
    doubled = [runs[0] * 2**i for i in range(math.ceil(math.log2(runs[-1] / runs[0])))]
    for periods in (*doubled, runs[-1]):
        if (rows := found.open_rows).size:
            found.put(rows, _averaged(*neighbours.rates(rows, periods)))
    return found


def _by_derivatives(
    system: System, states: np.ndarray, columns: Mapping[str, np.ndarray], lengths: np.ndarray, runs: Sequence[int], tol: float
) -> Largest:
    """The exponents of groups from a run of its own after another, as long as their signs are open."""
    found, (size, d) = Largest.unknown(len(states)), states.shape[1:]
    for periods in runs:
        if (rows := found.open_rows).size:
            every = {path: np.repeat(values[rows], size) for path, values in columns.items()}
            begin = states[rows].reshape(-1, d)
            direction = np.full_like(begin, math.sqrt(1.0 / d))
            begin, direction, _ = stretched(system, begin, direction, every, max(1, periods // 4), tol)
            growth = stretched(system, begin, direction, every, periods, tol)[2].reshape(-1, size)
            found.put(rows, _averaged(growth / (periods * lengths[rows])[:, None], periods * lengths[rows]))
    return found


def _averaged(rates: np.ndarray, duration: np.ndarray) -> Largest:
    """The averages of rates (groups, size) over these times, (groups,); those below the resolution count as 0."""
    least = resolution(duration)
    surely = np.abs(rates) > least[:, None]
    grows, shrinks = surely & (rates > 0.0), surely & (rates < 0.0)
    counted = np.isfinite(rates) & ~(shrinks & grows.any(axis=1)[:, None])
    count = counted.sum(axis=1)
    enough = np.where(count < FEWEST, np.nan, count)
    mean = np.where(counted, rates, 0.0).sum(axis=1) / enough
    scatter = np.sqrt((np.where(counted, rates - mean[:, None], 0.0) ** 2).sum(axis=1) / (enough - 1.0))
    error = stdtrit(enough - 1.0, 0.975) * scatter / np.sqrt(enough)
    with np.errstate(invalid="ignore"):
        return Largest(mean, error, mean - error > least, mean + error < -least)
