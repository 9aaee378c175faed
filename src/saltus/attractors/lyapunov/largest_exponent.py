"""The largest Lyapunov exponent of many motions at once, as samples of their attractors: what searching for chaos takes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.special import stdtrit

from saltus.attractors.lyapunov.averages import resolution
from saltus.attractors.lyapunov.neighbours import Neighbours
from saltus.attractors.lyapunov.stretching import Stretching
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

    def put(self, rows: np.ndarray, other: Largest) -> None:
        """Put what is now known of these groups in its place."""
        for name in ("exponent", "error", "positive", "negative"):
            getattr(self, name)[rows] = getattr(other, name)


class LargestExponents:
    """The largest exponent of each group of motions, from a run that is made longer where its sign is open.

    The motions of a group are taken for independent samples of one attractor, so that their scatter gives the error, by Student's
    t. Motions that are lost are left out, and so are those whose perturbations surely shrink where others surely grow.
    Growth is that of `simulate_many`'s derivatives (`Stretching`), with several contacts of pairs of motions (`Neighbours`).

    The resolution is 2 ln(t) / t for the time t of one motion, as regular ones may part like t^2.

    Parameters
    ----------
    system
        What moves, under a load with a frequency.
    states
        (groups, size, d) at phase 0.
    parameters
        Numbers by dotted path, (groups,) each, in place of the system's.
    shortest
        The forcing periods of the shortest run, before which perturbations turn for a quarter of it.
    tol
        The error of a step.
    """

    def __init__(
        self, system: System, states: np.ndarray, parameters: Mapping[str, np.ndarray], *, shortest: int, tol: float = 1e-10
    ) -> None:
        kind = Neighbours if system.model.contacts else Stretching
        self._perturbations = kind(system, states, parameters, turning=shortest // 4, tol=tol)
        self.found = Largest.unknown(len(states))

    def go_on(self, rows: np.ndarray, periods: int) -> None:
        """Measure the exponents of these groups over so many forcing periods in all."""
        self.found.put(rows, _averaged(*self._perturbations.rates(rows, periods)))


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
