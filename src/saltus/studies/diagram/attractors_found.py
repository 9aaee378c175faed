"""The attractors that the simulation of a diagram has found, each once at each value, and whether they lie on branches."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from saltus.enumerations import NumberedSentence
from saltus.studies.chart.cells import seeds
from saltus.studies.chart.motions import ALIKE, by_cell, is_alike, is_same, motion_type
from saltus.studies.diagram.simulated import SimulatedMotions
from saltus.systems import System


class Place(NumberedSentence):
    """Whether a simulated periodic motion lies on a branch, or why not; its `str` is the sentence."""

    OPEN = 0, "it has not been looked at"
    ON_BRANCH = 1, "it lies on a stable part of a branch"
    LONGER = 2, "its period is longer than the longest that is followed"
    NO_ORBIT = 3, "Newton's method finds no orbit near it"
    UNSTABLE = 4, "the orbit near it is not called stable: it grazes, or is about to lose its stability"
    ELSEWHERE = 5, "the branch of the orbit near it does not come back to it"
    RARE = 6, "its period is long, and no random motion ends on it"
    LEFT = 7, "it is stable in a small part of the range alone, and the effort follows no more of such"


LONG = 6  # Orbits of longer periods are many, and most have small basins: only those on which random motions end are followed.


@dataclass
class AttractorsFound:
    """All motions that were simulated, and the different attractors among them: each once at each value."""

    motions: SimulatedMotions
    max_period: int  # the longest period of orbits that are followed
    place: np.ndarray = field(init=False)  # (n,): a `Place` for each motion, kept up to date for `rows` only
    looked: np.ndarray = field(init=False)  # (n,): a motion was compared with so many branches, the first ones
    rows: np.ndarray = field(init=False)  # the first motion that was found on each attractor, by value
    starts: np.ndarray = field(init=False)  # how many motions were found on the attractor of each of these rows
    attractor: np.ndarray = field(init=False)  # (n,): the row of the attractor of each motion; its own where it has not settled

    def __post_init__(self) -> None:
        self.place, self.looked = np.zeros(len(self.motions), dtype=np.int8), np.zeros(len(self.motions), dtype=int)
        self._tell_apart()

    def add(self, more: SimulatedMotions) -> int:
        """Add motions; returns how many attractors are new."""
        before = len(self.rows)
        self.motions = self.motions.joined(more)
        self.place = np.append(self.place, np.zeros(len(more), dtype=np.int8))
        self.looked = np.append(self.looked, np.zeros(len(more), dtype=int))
        self._tell_apart()
        return len(self.rows) - before

    def _tell_apart(self) -> None:
        """Find the attractors: motions at one value are on one attractor if they have the same period and the same extrema, or
        those of the mirror image."""
        rows = np.flatnonzero(self.motions.periodic)
        table = as_chart_motions(self.motions.only(rows))
        seen = (table[name] for name in ("other", "amplitude", "slowest", "period"))
        order = np.lexsort((rows, *seen, self.motions.value[rows]))
        rows, table = rows[order], table[order]
        fresh = np.ones(len(rows), dtype=bool)
        fresh[1:] = (self.motions.value[rows[1:]] != self.motions.value[rows[:-1]]) | ~is_same(table[1:], table[:-1])
        begin = np.flatnonzero(fresh)
        self.rows = np.minimum.reduceat(rows, begin) if len(rows) else rows
        self.starts = np.diff(np.append(begin, len(rows)))
        self.attractor = np.arange(len(self.motions))
        self.attractor[rows] = np.repeat(self.rows, self.starts)
        period = self.motions.period[self.rows]
        self.place[self.rows[period > self.max_period]] = Place.LONGER
        self.place[np.intersect1d(self.open, self.rows[period > LONG])] = Place.RARE

    @property
    def open(self) -> np.ndarray:
        """The rows of attractors of which it is not known yet whether they lie on a branch."""
        return np.asarray(self.rows[self.place[self.rows] == Place.OPEN])

    def reopen(self, motions: np.ndarray) -> None:
        """Let attractors be followed that were taken as rare, as the random motions of these rows end on them."""
        ends = self.attractor[motions]
        self.place[ends[self.place[ends] == Place.RARE]] = Place.OPEN

    @property
    def unplaced(self) -> np.ndarray:
        """The rows of attractors that lie on no branch."""
        return np.asarray(self.rows[self.place[self.rows] != Place.ON_BRANCH])

    def families(self, rows: np.ndarray) -> list[np.ndarray]:
        """The attractors of these rows in runs along the parameter, each of similar motions; long runs first."""
        motions = self.motions.only(rows)
        table = as_chart_motions(motions)
        order = np.lexsort((motions.value, table["impact_count"], table["period"]))
        alike = is_alike(table[order][1:], table[order][:-1], ALIKE.family)
        runs = np.split(rows[order], 1 + np.flatnonzero(~alike)) if len(rows) else []
        return sorted(runs, key=lambda run: -len(run))

    def seeds(self, system: System, grid: np.ndarray, known: np.ndarray, since: int) -> tuple[np.ndarray, np.ndarray]:
        """Further starts, values (n,) and states (n, d): attractors are started at the neighbouring values that have none alike.

        Parameters
        ----------
        system
            What moves.
        grid
            The values that have neighbours.
        known
            Attractors that are known from branches, as records of a chart whose cells are the values of the grid.
        since
            Only attractors that were first found by the motion of this row, or later.
        """
        rows = self.rows[np.isin(self.motions.value[self.rows], grid)]
        mine = as_chart_motions(self.motions.only(rows))
        mine["cell"] = np.searchsorted(grid, self.motions.value[rows])
        every = by_cell(np.concatenate([mine, known]))
        cell, states = seeds(system, by_cell(mine[rows >= since]), every, (1, len(grid)))
        return grid[cell], states


def as_chart_motions(motions: SimulatedMotions) -> np.ndarray:
    """The motions as records of a chart, all in cell 0, so that they are compared by the same functions."""
    table = np.zeros(len(motions), motion_type(motions.last.shape[1]))
    for name in ("period", "impact_count", "amplitude", "slowest"):
        table[name] = getattr(motions, name)
    table["other"], table["state"] = np.minimum(motions.highest, -motions.lowest), motions.last
    return table
