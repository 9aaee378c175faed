"""The largest Lyapunov exponents of groups of motions, each a sample of an attractor, as the search for chaos needs them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.special import stdtrit

from saltus.attractors.lyapunov.averages import resolution
from saltus.attractors.lyapunov.neighbours import Neighbours
from saltus.attractors.lyapunov.stretching import Stretching
from saltus.systems import System

FEWEST = 4  # the fewest motions from whose scatter an error is taken


@dataclass(frozen=True, eq=False)
class Largest:
    """Largest exponents with half widths of their 95 % intervals, per unit of dimensionless time; an entry for each group."""

    exponent: np.ndarray  # (groups,): nan where fewer than four motions of a group have an exponent
    error: np.ndarray
    positive: np.ndarray  # (groups,): whether it is above its error and the resolution
    negative: np.ndarray  # (groups,): whether it is below them

    @classmethod
    def unknown(cls, groups: int) -> Largest:
        """The entries of so many groups of which nothing is known yet."""
        return cls(*np.full((2, groups), np.nan), *np.zeros((2, groups), dtype=bool))

    def put(self, rows: np.ndarray, other: Largest) -> None:
        """Replace the entries of these groups."""
        for name in ("exponent", "error", "positive", "negative"):
            getattr(self, name)[rows] = getattr(other, name)


class LargestExponents:
    """The largest exponent of each group of motions, from a run that can be made longer while the sign is open.

    The motions of a group are taken as independent samples of one attractor, so that their scatter gives the error, by Student's
    t. Motions that are lost are left out, and so are motions whose perturbations surely shrink if those of others surely grow.
    The growth is that of derivatives (`Stretching`) or, with several contacts, of the distance of two motions (`Neighbours`).

    The resolution is 2 ln(t) / t for the time t of one motion, as the distance of regular motions may grow like t^2.

    Parameters
    ----------
    system
        What moves, under a load with a frequency.
    states
        (groups, size, d) at phase 0.
    parameters
        Numbers by dotted path, (groups,) each, in place of the system's.
    shortest
        The forcing periods of the shortest run. Before it, perturbations are followed for a quarter of this time, to turn to the
        direction that grows.
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
    """The averages of rates (groups, size) over these times, (groups,); averages within the resolution are of neither sign."""
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
