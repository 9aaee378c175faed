"""The changes between neighbouring cells of a stability chart: where a motion has no counterpart in the next cell."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from saltus.studies.chart.motions import ALIKE, SIDES, motions_in, read_motions

if TYPE_CHECKING:
    import xarray

# Changes are of motions above this many times the least amplitude: smaller ones may only be too small to count in the next cell.
COUNTS = 1.2


@dataclass(frozen=True, eq=False)
class ChartMotions:
    """A chart as plain arrays: its axes, its motions, and which of these are of one family."""

    horizontal: np.ndarray
    vertical: np.ndarray
    motions: np.ndarray  # of `motion_type`, by cell and falling amplitude
    family: np.ndarray  # (n,): the number of each motion's family: motions that are counterparts of each other from cell to cell
    least: float  # the smallest amplitude that counts
    monostable: np.ndarray  # (rows, columns): whether all motions come to rest

    @property
    def place(self) -> np.ndarray:
        """(n, 2): row and column of each motion."""
        return np.stack(np.unravel_index(self.motions["cell"], self.monostable.shape), axis=1)

    @property
    def family_size(self) -> np.ndarray:
        """(n,): how many motions there are in the family of each."""
        return np.asarray(np.bincount(self.family, minlength=1)[self.family])


@dataclass(frozen=True, eq=False)
class Changes:
    """Where motions of a chart end: in `source` there is one that has no counterpart in the neighbour `target`."""

    motion: np.ndarray  # (n,): the index of the motion in the chart's motions
    source: np.ndarray  # (n, 2): row and column of its cell
    target: np.ndarray  # (n, 2): row and column of the neighbour

    def only(self, chosen: np.ndarray) -> Changes:
        """Some of them."""
        return Changes(self.motion[chosen], self.source[chosen], self.target[chosen])

    @property
    def along(self) -> int:
        """Along which axis the first change lies: 0 horizontally, 1 vertically."""
        return 0 if self.source[0, 0] == self.target[0, 0] else 1

    def __len__(self) -> int:
        return len(self.motion)


def read_chart(chart: xarray.Dataset) -> ChartMotions:
    """The motions of a chart, and which of them are of one family."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    chart, motions = chart.transpose("vertical", "horizontal", ...), read_motions(chart)
    shape = chart["count"].shape
    pairs = np.concatenate([np.empty((0, 2), dtype=int), *(_counterparts(motions, shape, side)[0] for side in SIDES)])
    graph = coo_array((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(len(motions), len(motions)))
    family = connected_components(graph, directed=False)[1] if len(motions) else np.zeros(0, dtype=int)
    axes = chart["horizontal"].values, chart["vertical"].values
    return ChartMotions(*axes, motions, family, float(chart.attrs["least"]), monostable(chart).values)


def monostable(chart: xarray.Dataset) -> xarray.DataArray:
    """Where no motion counts and every start that settles comes to rest: the white region of the paper's charts."""
    return (chart["count"] == 0) & (chart["unsettled"] == 0)


def _counterparts(motions: np.ndarray, shape: tuple[int, ...], side: tuple[int, int]) -> tuple[np.ndarray, np.ndarray]:
    """Pairs of motions (n, 2) that are counterparts in neighbouring cells, and which motions have no counterpart on this side."""
    there = np.stack(np.unravel_index(motions["cell"], shape), axis=1) + side
    inside = ((there >= 0) & (there < shape)).all(axis=1)
    target = np.where(inside, there @ [shape[1], 1], -1)
    amplitude, pairs, lonely = motions["amplitude"], [np.empty((0, 2), dtype=int)], inside.copy()
    symmetric = np.abs(amplitude - motions["other"]) < ALIKE.symmetric * amplitude
    for counts, other in motions_in(motions, target):
        size = np.maximum(amplitude[other], amplitude)
        like = counts & (np.abs(amplitude[other] - amplitude) <= ALIKE.family * size)
        like &= (motions["period"][other] == motions["period"]) & (symmetric[other] == symmetric)
        pairs.append(np.stack([np.flatnonzero(like), other[like]], axis=1))
        lonely &= ~like
    return np.concatenate(pairs), np.asarray(lonely)


def changes_of(chart: ChartMotions) -> Changes:
    """Every end of a motion between two cells of a chart, without motions that are hardly large enough to count."""
    counts, place = chart.motions["amplitude"] > COUNTS * chart.least, chart.place
    motion, target = [], []
    for side in SIDES:
        lonely = np.flatnonzero(_counterparts(chart.motions, chart.monostable.shape, side)[1] & counts)
        motion.append(lonely)
        target.append(place[lonely] + side)
    chosen = np.concatenate(motion)
    return Changes(chosen, place[chosen], np.concatenate(target))


def keys_of(chart: ChartMotions, changes: Changes) -> list[tuple[int, ...]]:
    """The keys of changes: row and column, the motion's amplitude in nrad, row and column of the neighbour."""
    size = np.rint(chart.motions["amplitude"][changes.motion] * 1e9).astype(int)
    rows = zip(changes.source, size, changes.target, strict=True)
    return [tuple(map(int, (*source, nrad, *target))) for source, nrad, target in rows]
