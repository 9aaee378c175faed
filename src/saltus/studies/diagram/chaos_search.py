"""Looking for chaos along a parameter: motions that neither rest nor repeat themselves and whose neighbours part for good."""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from saltus.attractors import largest_exponents
from saltus.checks import Rectangle, check_count, check_window
from saltus.flow import Outcome, find_recurrence
from saltus.orbits import initial_states
from saltus.progress import Progress, part_of, silent
from saltus.public_functions import checked_by
from saltus.studies.checks import check_diagram
from saltus.studies.diagram.bands import Band, Bands, Tried, spread_over
from saltus.systems import System


@dataclass(frozen=True)
class ChaosSettings:
    """How motions are judged to be chaotic, and how the edges of bands are located."""

    settling: int = 400  # Forcing periods that a motion is given to come to rest or to repeat itself.
    # Periods of a stretch of the exponent, instead of 12, where that leaves open whether the exponent is positive.
    longer_stretch: int = 60
    # Forcing periods for which all companions of a motion must go on without settling: long transients of chaos are none.
    confirming: int = 2000
    # Companions of the motions at a value of the grid, all of which must be chaotic; at the halvings of an edge fewer do.
    companions: int = 64
    companions_at_edges: int = 12
    apart: float = 1e-7  # Distance between the beginnings of companions, or those from one motion would all be that motion.
    kept: int = 64  # Stroboscopic states that are kept of each motion.
    seeds: int = 4  # States of a chaotic motion from which motions at the neighbouring values are begun.
    halvings: int = 7  # Halvings of the bracket of an edge.
    tol: float = 1e-10  # The error of a step.


SETTINGS = ChaosSettings()


def _check(
    system: System, path: str, bounds: tuple[float, float], count: int, starts: int, window: object, seed: int, progress: object
) -> None:
    check_diagram(system, path, bounds, starts=starts, seed=seed)
    check_count("count", count, 1)
    check_window(window, system)


@checked_by(_check)
def chaotic_bands(
    system: System,
    path: str,
    bounds: tuple[float, float],
    *,
    count: int = 121,
    starts: int = 8,
    window: Rectangle | None = None,
    seed: int = 0,
    progress: Progress = silent,
) -> Bands:
    """Where motions are chaotic along a parameter, from `starts` states at each of `count` values.

    A motion is called chaotic if it has not settled after 400 forcing periods, its largest Lyapunov exponent over the next 384
    (or, where that leaves it open, 1920 more) exceeds its error bar in both halves of them, and none of 64 motions from beside
    points of those that look so at this value (12 at the halvings of an edge) settles within 2000 periods: a motion on an
    attractor never leaves it, and where one does chaos is transient. Transients that live for 100 000 periods on average pass
    for chaos nevertheless. Every band is carried on to its neighbours by motions begun on it, and each edge is then halved
    seven times between a value with chaos and one without. Windows of periodic motion between two values of the grid are not
    seen; attractors whose basins hold no start are not either.

    Args:
        system: what moves, with one coordinate, under a load with a frequency.
        path, bounds: dotted path of the parameter, and its range.
        count: of values, evenly from the first bound to the last.
        starts, window, seed: initial states, as `search_orbits` takes them.
        progress: called with the fraction done.

    Raises:
        ParameterError: an argument without meaning.
    """
    search = _ChaosSearch(system, path)
    values, states = np.linspace(*bounds, count), initial_states(system, starts, check_window(window, system), seed)
    tried = search.at(values, states, SETTINGS.companions, part_of(progress, 0.0, 0.7, "looking for chaos"))
    search.spread(tried)
    progress(0.8, "looking for chaos")
    bands = search.bands(tried)
    progress(1.0, "looking for chaos")
    return Bands(path, bands, tried)


class _FollowedRows(NamedTuple):
    """Motions after some forcing periods, (n, starts, ...)."""

    moving: np.ndarray  # neither at rest nor settled
    states: np.ndarray
    peaks: np.ndarray


@dataclass
class _ChaosSearch:
    """Motions of one system at values of one of its parameters."""

    system: System
    path: str
    # Pairs of neighbouring values of the grid: motions were started at the second one from chaotic states of the first one.
    carried: set[tuple[int, int]] = field(default_factory=set)

    def at(self, values: np.ndarray, states: np.ndarray, companions: int, progress: Progress = silent) -> Tried:
        """Follow motions from states (starts, 2), or (n, starts, 2) of each value's own, and judge those that do not settle."""
        begin = np.broadcast_to(states, (len(values), *states.shape[-2:]))
        shape, ends = begin.shape[:2], self._follow(values, begin, SETTINGS.settling, progress)
        chaotic, undecided = np.zeros(shape, dtype=bool), np.zeros(shape, dtype=bool)
        tried = Tried(values, chaotic, np.full(shape, np.nan), np.full(shape, np.nan), undecided, ends.states, ends.peaks)
        rows = np.nonzero(ends.moving)
        if rows[0].size:
            self._judge(tried, rows, companions)
        return tried

    def _judge(self, tried: Tried, rows: tuple[np.ndarray, ...], companions: int) -> None:
        """Exponents of what has not settled, and whether it is chaotic."""
        values = tried.values[rows[0]]
        found = largest_exponents(self.system, tried.states[rows][:, -1], {self.path: values}, tol=SETTINGS.tol)
        again = np.flatnonzero(~found.positive & (found.exponent > 0.0))  # weak chaos, or none: a longer run may decide
        if again.size:
            columns, stretch = {self.path: values[again]}, SETTINGS.longer_stretch
            longer = largest_exponents(self.system, tried.states[rows][again, -1], columns, periods=stretch, tol=SETTINGS.tol)
            for name in ("exponent", "error", "positive"):
                getattr(found, name)[again] = getattr(longer, name)
        tried.exponent[rows], tried.error[rows], positive = found.exponent, found.error, found.positive
        tried.undecided[rows] = ~positive & ~(found.exponent + found.error < 0.0)
        if positive.any():
            self._confirm(tried, tuple(place[positive] for place in rows), companions)

    def _confirm(self, tried: Tried, kept: tuple[np.ndarray, ...], companions: int) -> None:
        """Follow companions of motions that look chaotic: where one of them settles, chaos is a transient, however long."""
        lines = np.unique(kept[0])
        beside = SETTINGS.apart * np.arange(companions)[:, None]
        states = [spread_over(tried.states[line, kept[1][kept[0] == line]], companions) + beside for line in lines]
        later = self._follow(tried.values[lines], np.stack(states), SETTINGS.confirming)
        stays = dict(zip(lines.tolist(), np.all(later.moving, axis=1).tolist(), strict=True))
        for line, start in zip(*kept, strict=True):
            tried.chaotic[line, start], tried.undecided[line, start] = stays[line], not stays[line]

    def _follow(self, values: np.ndarray, states: np.ndarray, periods: int, progress: Progress = silent) -> _FollowedRows:
        """Follow motions from states (n, starts, 2) at each of the values (n,)."""
        shape, kept = states.shape[:2], SETTINGS.kept
        ends = find_recurrence(
            self.system,
            states.reshape(-1, 2),
            periods,
            parameters={self.path: np.repeat(values, shape[1])},
            kept=kept,
            extrema=True,
            tol=SETTINGS.tol,
            progress=progress,
        )
        assert ends.extrema is not None
        last, peaks = ends.states.copy(), np.abs(ends.extrema).max(axis=2)
        moving = ends.outcome == Outcome.MOVING
        shown = np.where(moving, kept, np.maximum(ends.period, 1))  # of what has settled one period alone
        early = np.arange(last.shape[1]) < last.shape[1] - shown[:, None]
        last[early], peaks[early] = np.nan, np.nan
        return _FollowedRows(moving.reshape(shape), last.reshape(*shape, *last.shape[1:]), peaks.reshape(*shape, peaks.shape[1]))

    def spread(self, tried: Tried) -> None:
        """Carry chaos on to neighbouring values of the grid: motions begun on it, as long as they find more."""
        neighbours = [pair for i, j in pairwise(range(len(tried.values))) for pair in ((i, j), (j, i))]
        while True:
            chaos, followed = tried.has_chaos, ~np.isnan(tried.states).all(axis=(1, 2, 3))
            fresh = [(i, j) for i, j in neighbours if chaos[i] and not chaos[j] and followed[j] and (i, j) not in self.carried]
            if not fresh:
                return
            self.carried.update(fresh)
            states = np.stack([tried.chaotic_states(i, SETTINGS.seeds) for i, _ in fresh])
            more = self.at(tried.values[[j for _, j in fresh]], states, SETTINGS.companions_at_edges)
            for row, (_, j) in enumerate(fresh):
                if more.has_chaos[row]:
                    tried.adopt(j, more, row)

    def bands(self, tried: Tried) -> tuple[Band, ...]:
        """The bands between runs of values with chaos, their edges in brackets."""
        chaos = np.concatenate([[False], tried.has_chaos, [False]]).astype(int)
        first, last = np.flatnonzero(np.diff(chaos) == 1), np.flatnonzero(np.diff(chaos) == -1) - 1
        values, n = tried.values, len(tried.values)
        inner = np.concatenate([values[first], values[last]])
        outer = np.concatenate([values[np.maximum(first - 1, 0)], values[np.minimum(last + 1, n - 1)]])
        if len(first):
            inner, outer = self._halve(tried, np.concatenate([first, last]), inner, outer)
        (low, high), (before, after), bands = np.split(inner, 2), np.split(outer, 2), []
        for k, (a, b) in enumerate(zip(first, last, strict=True)):
            inside = np.where(tried.chaotic[a : b + 1], tried.exponent[a : b + 1], -np.inf)
            top = np.unravel_index(int(inside.argmax()), inside.shape)
            ends = (float(low[k]), float(high[k]), float(before[k]), float(after[k]))
            bands.append(Band(*ends, float(inside[top]), float(tried.error[a : b + 1][top])))
        return tuple(bands)

    def _halve(self, tried: Tried, rows: np.ndarray, inner: np.ndarray, outer: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Halve all brackets of edges at once; motions begin on the chaos of the inner side."""
        inner, outer = inner.copy(), outer.copy()
        states = np.stack([tried.chaotic_states(row, SETTINGS.seeds) for row in rows])
        for _ in range(SETTINGS.halvings):
            wide = np.flatnonzero(inner != outer)
            if not wide.size:
                break
            middle = 0.5 * (inner[wide] + outer[wide])
            more = self.at(middle, states[wide], SETTINGS.companions_at_edges)
            for row, k in enumerate(wide):
                if more.has_chaos[row]:
                    inner[k], states[k] = middle[row], more.chaotic_states(row, SETTINGS.seeds)
                else:
                    outer[k] = middle[row]
        return inner, outer
