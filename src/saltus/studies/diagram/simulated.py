"""The simulated motions of a diagram: where each begins and how it ends, and the attractors that
they have found.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, fields
from functools import partial
from typing import Any

import numpy as np

from saltus.enumerations import NumberedSentence
from saltus.flow import RECURRENCE, Ending, Recurrence, find_recurrence, return_distances
from saltus.progress import Progress, silent
from saltus.studies.chart.cells import CELLS, seeds
from saltus.studies.chart.motions import ALIKE, by_cell, is_alike, is_same, motion_type
from saltus.studies.diagram.effort import CHAOS
from saltus.systems import (
    NaturalUnits,
    System,
    Window,
    even_steps,
    is_still,
    natural_units,
    within_window,
)


@dataclass(frozen=True)
class SimulationSettings:
    """How motions are started, followed and kept."""

    # Stroboscopic states that are kept of each motion, as dots of a diagram and as starts of other
    # motions.
    kept: int = 64
    # An unsettled motion is taken as slow, not chaotic, if it returns to an earlier state within
    # this share of its amplitude.
    slow: float = 1e-2
    # Slow motions are followed for up to so many times the forcing periods of the others.
    patience: int = 8
    # Chaotic motions return as near by chance. A slow motion is followed in rounds, as long as each
    # round reduces the distance of its return by this factor; otherwise it can hardly settle in the
    # time that is left.
    nearer: float = 0.3
    # A motion that stays this near to the contact, in natural units, is at rest.
    still: float = 1e-6


SETTINGS = SimulationSettings()


@dataclass(frozen=True, eq=False)
class SimulatedMotions:
    """Motions along one parameter, a row for each."""

    value: np.ndarray  # (n,) of the parameter
    periods: np.ndarray  # (n,): forcing periods for which it was followed the last time
    last: np.ndarray  # (n, d): coordinates and velocities at the end, at phase 0
    outcome: np.ndarray  # (n,): an `Ending`
    period: np.ndarray  # (n,): forcing periods after which it repeats itself; 0 where it does not
    # (n,): impacts in one period or, if it has none, in the forcing periods that are kept
    impact_count: np.ndarray
    # (n,): largest coordinate over its period, or over the forcing periods that are kept
    highest: np.ndarray
    lowest: np.ndarray  # (n,): least coordinate over the same time
    slowest: np.ndarray  # (n,): with several contacts the least speed of an impact; else 0
    # (n, kept, d): its last stroboscopic states, of a periodic motion those of one period; else nan
    states: np.ndarray
    peaks: np.ndarray  # (n, kept): max abs of the coordinate in each of these periods

    def __len__(self) -> int:
        return len(self.value)

    @property
    def amplitude(self) -> np.ndarray:
        """max abs of the coordinate, (n,)."""
        return np.asarray(np.maximum(np.abs(self.highest), np.abs(self.lowest)))

    @property
    def periodic(self) -> np.ndarray:
        """Which repeat themselves and are not at rest, (n,)."""
        return np.asarray(self.period > 0)

    @property
    def unsettled(self) -> np.ndarray:
        """Which neither rest, nor repeat themselves, nor have ended: chaotic, slow, or of a period
        above 16, (n,).
        """
        return np.asarray(self.outcome == Ending.UNDECIDED)

    @property
    def ended(self) -> np.ndarray:
        """Which a limit of the model has ended, (n,)."""
        return np.asarray(self.outcome == Ending.ENDED)

    @property
    def at_rest(self) -> np.ndarray:
        """Which are at rest at the contact, (n,)."""
        return np.asarray((self.outcome == Ending.REST) | (self.outcome == Ending.HELD))

    def only(self, rows: Any) -> SimulatedMotions:
        """Some of the motions."""
        return SimulatedMotions(*(getattr(self, part.name)[rows] for part in fields(self)))

    def gone_on(self, rows: np.ndarray, later: SimulatedMotions) -> None:
        """Replace the motions of these rows by what has become of them later."""
        for part in fields(self):
            getattr(self, part.name)[rows] = getattr(later, part.name)

    def joined(self, *others: SimulatedMotions) -> SimulatedMotions:
        """These motions, then others."""
        every = (self, *others)
        return SimulatedMotions(
            *(np.concatenate([getattr(one, part.name) for one in every]) for part in fields(self))
        )


Follow = Callable[[np.ndarray, np.ndarray, int, Progress], SimulatedMotions]


def starts_at(
    system: System, values: np.ndarray, count: int, window: Window, seed: int
) -> np.ndarray:
    """(values, count, d): states spread over the window at each value, every other one drawn in
    towards the contact.

    The states at a value follow from the seed and the value alone, and the first of more states are
    those of fewer: a finer grid or more starts only add motions to those that were simulated. The
    states at all values together are dense in the window.
    """
    bits = np.ascontiguousarray(values, dtype="<f8").view("<u4").reshape(len(values), 2)
    size = len(window) + 1
    steps = even_steps(len(window))
    offsets = np.array(
        [np.random.default_rng([seed, *pair]).random(size) for pair in bits.tolist()]
    ).reshape(-1, 1, size)
    number = np.arange(1, count + 1)
    points = 2.0 * ((offsets[..., :-1] + number[:, None] * steps) % 1.0) - 1.0
    share = CELLS.innermost ** ((offsets[..., -1] + number * steps[0]) % 1.0)
    inner = np.where(number % 2 == 0, share, 1.0)[..., None]
    return within_window(system, points, window, inner)


def simulate_from(
    system: System,
    path: str,
    values: np.ndarray,
    states: np.ndarray,
    periods: int,
    progress: Progress = silent,
    follow: Follow | None = None,
) -> SimulatedMotions:
    """Follow motions from states (n, d) at phase 0 at values (n,) of the parameter until they
    settle or the time is up.

    `follow` takes the place of `followed` where another process computes or a store remembers.
    """
    follow = follow or partial(followed, system, path)
    found = follow(values, states, periods, progress)
    units = natural_units(system)
    slow = np.flatnonzero(found.unsettled & _is_slow(found, units))
    for _ in range(SETTINGS.patience):
        if slow.size:
            before = _return_distance(found.only(slow), units)
            found.gone_on(slow, follow(values[slow], found.last[slow], periods, silent))
            later = found.only(slow)
            apart = _return_distance(later, units)
            slow = slow[later.unsettled & (apart <= SETTINGS.nearer * before)]
    return found


def followed(
    system: System,
    path: str,
    values: np.ndarray,
    states: np.ndarray,
    periods: int,
    progress: Progress = silent,
) -> SimulatedMotions:
    """Follow motions from states (n, d) at values (n,) for at most so many forcing periods; none
    depends on the others.

    All periods that lanes recognise are looked for, even if a diagram follows shorter ones only:
    motions of periods between must not be taken as unsettled.
    """
    ends = find_recurrence(
        system,
        states,
        max(periods, SETTINGS.kept),
        parameters={path: values},
        kept=SETTINGS.kept,
        extrema=True,
        impact_count=True,
        speed=True,
        progress=progress,
    )
    return _motions(system, values, ends)


def _motions(system: System, values: np.ndarray, ends: Recurrence) -> SimulatedMotions:
    """The motions with their ends; a motion that stays at the contact is at rest."""
    assert ends.extrema is not None
    highest = ends.highest
    lowest = ends.lowest
    period = ends.period.copy()
    outcome = ends.outcome.copy()
    near = SETTINGS.still * natural_units(system).length
    still = is_still(system, highest, lowest, near) & ((period > 0) | (outcome == Ending.UNDECIDED))
    outcome[still] = Ending.HELD
    period[still] = 0
    shown = ends.within_period & ~ends.rest[:, None]
    return SimulatedMotions(
        value=np.array(values, dtype=float),
        periods=ends.periods,
        last=ends.last,
        outcome=outcome,
        period=period,
        impact_count=ends.impact_count,
        highest=highest,
        lowest=lowest,
        slowest=ends.slowest,
        states=np.where(shown[..., None], ends.states, np.nan),
        peaks=np.where(shown, np.abs(ends.extrema).max(axis=2), np.nan),
    )


def _return_distance(motions: SimulatedMotions, units: NaturalUnits) -> np.ndarray:
    """The least distance at which motions return to an earlier state, in natural units, (n,); inf
    where that is not known.
    """
    apart = return_distances(motions.states, RECURRENCE.compiled_max_period, units.state)
    return np.asarray(np.nan_to_num(apart.min(axis=1), nan=np.inf))


def _is_slow(motions: SimulatedMotions, units: NaturalUnits) -> np.ndarray:
    """Which motions return near to an earlier state, (n,)."""
    size = np.maximum(motions.amplitude / units.length, SETTINGS.still)
    return np.asarray(_return_distance(motions, units) <= SETTINGS.slow * size)


class BranchAssignment(NumberedSentence):
    """Whether a simulated periodic motion lies on a branch, or why not; its `str` is the
    sentence.
    """

    OPEN = 0, "it has not been looked at"
    ON_BRANCH = 1, "it lies on a stable part of a branch"
    LONGER = 2, "its period is longer than the longest that is followed"
    NO_ORBIT = 3, "Newton's method finds no orbit near it"
    UNSTABLE = (
        4,
        "the orbit near it is not called stable: it grazes, or is about to lose its stability",
    )
    ELSEWHERE = 5, "the branch of the orbit near it does not come back to it"
    RARE = 6, "its period is long, and no random motion ends on it"
    LEFT = (
        7,
        "it is stable in a small part of the range alone, and the effort follows no more of such",
    )


@dataclass
class AttractorsFound:
    """All motions that were simulated, and the different attractors among them: each once at each
    value.
    """

    motions: SimulatedMotions
    max_period: int  # the longest period of orbits that are followed
    middle: float  # the place about which motions may be mirror images
    time: float  # in which speeds of impacts are lengths
    # (n,): a `BranchAssignment` for each motion, kept up to date for `rows` only
    assignment: np.ndarray = field(init=False)
    # (n,): a motion was compared with so many branches, the first ones
    looked: np.ndarray = field(init=False)
    # the first motion that was found on each attractor, by value
    rows: np.ndarray = field(init=False)
    # how many motions were found on the attractor of each of these rows
    starts: np.ndarray = field(init=False)
    # (n,): the row of the attractor of each motion; its own where it has not settled
    attractor: np.ndarray = field(init=False)

    def __post_init__(self) -> None:
        self.assignment = np.zeros(len(self.motions), dtype=np.int8)
        self.looked = np.zeros(len(self.motions), dtype=int)
        self._tell_apart()

    def add(self, more: SimulatedMotions) -> int:
        """Add motions; returns how many attractors are new."""
        before = len(self.rows)
        self.motions = self.motions.joined(more)
        self.assignment = np.append(self.assignment, np.zeros(len(more), dtype=np.int8))
        self.looked = np.append(self.looked, np.zeros(len(more), dtype=int))
        self._tell_apart()
        return len(self.rows) - before

    def _tell_apart(self) -> None:
        """Find the attractors: motions at one value are on one attractor if they have the same
        period and the same extrema, or those of the mirror image."""
        rows = np.flatnonzero(self.motions.periodic)
        table = as_chart_motions(self.motions.only(rows), self.middle, self.time)
        seen = (table[name] for name in ("other", "amplitude", "slowest", "period"))
        order = np.lexsort((rows, *seen, self.motions.value[rows]))
        rows, table = rows[order], table[order]
        fresh = np.ones(len(rows), dtype=bool)
        fresh[1:] = (self.motions.value[rows[1:]] != self.motions.value[rows[:-1]]) | ~is_same(
            table[1:], table[:-1]
        )
        begin = np.flatnonzero(fresh)
        self.rows = np.minimum.reduceat(rows, begin) if len(rows) else rows
        self.starts = np.diff(np.append(begin, len(rows)))
        self.attractor = np.arange(len(self.motions))
        self.attractor[rows] = np.repeat(self.rows, self.starts)
        period = self.motions.period[self.rows]
        self.assignment[self.rows[period > self.max_period]] = BranchAssignment.LONGER
        self.assignment[np.intersect1d(self.open, self.rows[period > CHAOS.long_period])] = (
            BranchAssignment.RARE
        )

    @property
    def open(self) -> np.ndarray:
        """The rows of attractors of which it is not known yet whether they lie on a branch."""
        return np.asarray(self.rows[self.assignment[self.rows] == BranchAssignment.OPEN])

    def reopen(self, motions: np.ndarray) -> None:
        """Let attractors be followed that were taken as rare, as the random motions of these rows
        end on them.
        """
        ends = self.attractor[motions]
        self.assignment[ends[self.assignment[ends] == BranchAssignment.RARE]] = (
            BranchAssignment.OPEN
        )

    @property
    def unplaced(self) -> np.ndarray:
        """The rows of attractors that lie on no branch."""
        return np.asarray(self.rows[self.assignment[self.rows] != BranchAssignment.ON_BRANCH])

    def families(self, rows: np.ndarray) -> list[np.ndarray]:
        """The attractors of these rows in runs along the parameter, each of similar motions; long
        runs first.
        """
        motions = self.motions.only(rows)
        table = as_chart_motions(motions, self.middle, self.time)
        order = np.lexsort((motions.value, table["impact_count"], table["period"]))
        alike = is_alike(table[order][1:], table[order][:-1], ALIKE.family)
        runs = np.split(rows[order], 1 + np.flatnonzero(~alike)) if len(rows) else []
        return sorted(runs, key=lambda run: -len(run))

    def seeds(
        self, system: System, grid: np.ndarray, known: np.ndarray, since: int
    ) -> tuple[np.ndarray, np.ndarray]:
        """Further starts, values (n,) and states (n, d): attractors are started at the neighbouring
        values that have none alike.

        Parameters
        ----------
        system
            What moves.
        grid
            The values that have neighbours.
        known
            Attractors that are known from branches, as records of a chart whose cells are the
            values of the grid.
        since
            Only attractors that were first found by the motion of this row, or later.
        """
        rows = self.rows[np.isin(self.motions.value[self.rows], grid)]
        mine = as_chart_motions(self.motions.only(rows), self.middle, self.time)
        mine["cell"] = np.searchsorted(grid, self.motions.value[rows])
        every = by_cell(np.concatenate([mine, known]))
        cell, states = seeds(system, by_cell(mine[rows >= since]), every, (1, len(grid)))
        return grid[cell], states


def as_chart_motions(motions: SimulatedMotions, middle: float, time: float) -> np.ndarray:
    """The motions as records of a chart, all in cell 0, so that the same functions compare them.

    Extrema are measured from the `middle`, and speeds are multiplied by a unit of time.
    """
    table = np.zeros(len(motions), motion_type(motions.last.shape[1]))
    for name in ("period", "impact_count"):
        table[name] = getattr(motions, name)
    table["slowest"] = motions.slowest * time
    high = motions.highest - middle
    low = middle - motions.lowest
    table["amplitude"] = np.maximum(high, low)
    table["other"] = np.minimum(high, low)
    table["state"] = motions.last
    return table
