"""The changes between neighbouring cells of a stability chart, and which of them curves through its plane explain."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    import xarray

ALIKE = 0.35  # of the amplitude: motions of neighbouring cells that are one family
SAME = 0.5  # of the amplitude, between a curve's orbit and a motion that ends there: at a fold amplitudes are steep
COUNTS = 1.2  # times the least amplitude: motions up to here may end in a cell because they are too small to count in the next
SYMMETRIC = 2e-4  # of the amplitude, between the two extrema
SIDES = ((0, 1), (0, -1), (1, 0), (-1, 0))
KNOWN = 0.02  # of a cell, between a point and a curve that goes through it


@dataclass(frozen=True)
class Cells:
    """A chart's motions and axes as plain arrays."""

    horizontal: np.ndarray
    vertical: np.ndarray
    cell: np.ndarray  # (n, 2): row and column of each motion
    rank: np.ndarray  # (n,): which of its cell's motions it is
    amplitude: np.ndarray
    period: np.ndarray
    symmetric: np.ndarray
    family: np.ndarray  # (n,): a number that alike motions of neighbouring cells share
    least: float  # amplitude that counts
    empty: np.ndarray  # (rows, columns): no motion, settled or not, beside rest


@dataclass(frozen=True)
class Ends:
    """Where motions of a chart end: in `source` there is one to which nothing in the neighbour `target` is alike."""

    motion: np.ndarray  # (n,): which
    source: np.ndarray  # (n, 2): row and column
    target: np.ndarray

    def only(self, chosen: np.ndarray) -> Ends:
        """Some of them."""
        return Ends(self.motion[chosen], self.source[chosen], self.target[chosen])

    def __len__(self) -> int:
        return len(self.motion)


def keys_of(cells: Cells, ends: Ends) -> list[tuple[int, ...]]:
    """What tells ends apart: row and column, the motion's amplitude in nrad, row and column of the neighbour."""
    size = np.rint(cells.amplitude[ends.motion] * 1e9).astype(int)
    return [tuple(map(int, (*a, nrad, *b))) for a, nrad, b in zip(ends.source, size, ends.target, strict=True)]


def unseen(cells: Cells, curves: Sequence[xarray.Dataset]) -> np.ndarray:
    """Places (n, 2), row and column, where a fold of motions that count runs between cells none of which has one of them.

    Where another border of theirs is less than a cell away they exist in too narrow a strip for a cell to show it.
    """
    every = [
        (number, spot, height, int(curve.attrs["period"]), curve.attrs["kind"])
        for number, curve in enumerate(curves)
        for place, amplitude in crossings(cells, curve)
        for spot, height in zip(place, amplitude, strict=True)
        if (spot >= 0).all() and (spot <= np.array(cells.empty.shape) - 1).all()
    ]
    number, spots, heights, periods = (np.array([row[i] for row in every]) for i in range(4))
    found = [np.empty((0, 2))]
    for curve_number, spot, height, period, kind in every:
        if kind != "LP" or height < (1 + SAME) * cells.least:
            continue
        here = (np.abs(cells.cell - spot) < 1 + 1e-9).all(axis=1) & (cells.period == period)
        strip = (number != curve_number) & (np.abs(spots - spot) < 1.0 + 1e-9).all(axis=1)
        strip &= np.isin(periods, (period, 2 * period, period / 2)) & _same(heights, height)
        if not (here & _same(cells.amplitude, height)).any() and not strip.any():
            found.append(spot[None])
    return np.concatenate(found)


def _same(amplitudes: np.ndarray, amplitude: float) -> np.ndarray:
    return np.asarray(np.abs(amplitudes - amplitude) <= SAME * np.maximum(amplitudes, amplitude))


def read(chart: xarray.Dataset) -> Cells:
    """The motions of a chart, and which of them are of one family."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    chart = chart.transpose("vertical", "horizontal", ...)
    amplitude = chart["motion_amplitude"].values
    place = np.argwhere(np.isfinite(amplitude))
    at = tuple(place.T)
    other, period = chart["motion_other"].values[at], chart["motion_period"].values[at]
    size = amplitude[at]
    cells = Cells(
        horizontal=chart["horizontal"].values,
        vertical=chart["vertical"].values,
        cell=place[:, :2],
        rank=place[:, 2],
        amplitude=size,
        period=period,
        symmetric=np.abs(size - other) < SYMMETRIC * size,
        family=np.zeros(len(size), dtype=int),
        least=float(chart.attrs["least"]),
        empty=((chart["count"] == 0) & (chart["unsettled"] == 0)).values,
    )
    pairs = np.concatenate([np.empty((0, 2), dtype=int), *(_alike(cells, side)[0] for side in SIDES)])
    graph = coo_array((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(len(size), len(size)))
    cells.family[:] = connected_components(graph, directed=False)[1] if len(size) else 0
    return cells


def _alike(cells: Cells, side: tuple[int, int]) -> tuple[np.ndarray, np.ndarray]:
    """Pairs of motions (n, 2) that are alike in neighbouring cells, and which motions have none alike on this side."""
    shape = cells.empty.shape
    number = cells.cell @ [shape[1], 1]
    first, last = (np.searchsorted(number, np.arange(shape[0] * shape[1]), side=which) for which in ("left", "right"))
    there = cells.cell + side
    inside = ((there >= 0) & (there < shape)).all(axis=1)
    target = np.where(inside, there @ [shape[1], 1], 0)
    pairs, alone = [np.empty((0, 2), dtype=int)], inside.copy()
    for step in range(int((last - first).max(initial=0))):
        other = first[target] + step
        like = inside & (other < last[target])
        other = np.where(like, other, 0)
        apart = np.abs(cells.amplitude[other] - cells.amplitude)
        like &= (cells.period[other] == cells.period) & (cells.symmetric[other] == cells.symmetric)
        like &= apart <= ALIKE * np.maximum(cells.amplitude[other], cells.amplitude)
        pairs.append(np.stack([np.flatnonzero(like), other[like]], axis=1))
        alone &= ~like
    return np.concatenate(pairs), np.asarray(alone)


def ends_of(cells: Cells) -> Ends:
    """Every end of a motion between two cells of a chart, but of those hardly large enough to count."""
    motion, target = [], []
    for side in SIDES:
        alone = np.flatnonzero(_alike(cells, side)[1] & (cells.amplitude > COUNTS * cells.least))
        motion.append(alone)
        target.append(cells.cell[alone] + side)
    chosen = np.concatenate(motion)
    return Ends(chosen, cells.cell[chosen], np.concatenate(target))


def explained(cells: Cells, ends: Ends, curves: Sequence[xarray.Dataset]) -> np.ndarray:
    """Whether a curve of about such orbits passes between the two cells, or through the cells before and behind them."""
    known = np.zeros(len(ends), dtype=bool)
    for curve in curves:
        for place, amplitude in crossings(cells, curve):
            known |= _ends_there(cells, ends, place, amplitude, int(curve.attrs["period"]))
    return known


def crossings(cells: Cells, curve: xarray.Dataset) -> list[tuple[np.ndarray, np.ndarray]]:
    """Where a curve crosses the lines through the cells' middles, along rows, then along columns: places (n, 2), in cells from
    the first row and column, and the orbits' amplitudes there (n,)."""
    rows = np.interp(curve["vertical"].values, cells.vertical, np.arange(len(cells.vertical)), left=-1, right=len(cells.vertical))
    columns = np.interp(
        curve["horizontal"].values, cells.horizontal, np.arange(len(cells.horizontal)), left=-1, right=len(cells.horizontal)
    )
    points, result = np.stack([rows, columns, curve["amplitude"].values], axis=1), []
    for along in (0, 1):
        found = [np.empty((0, 3))]
        for a, b in pairwise(points):
            low, high = sorted((a[along], b[along]))
            lines = np.arange(np.ceil(low), np.floor(high) + 1)
            share = (lines - a[along]) / (b[along] - a[along]) if high > low else np.zeros(len(lines))
            found.append(a + share[:, None] * (b - a))
        every = np.concatenate(found)
        result.append((every[:, :2], every[:, 2]))
    return result


def _ends_there(cells: Cells, ends: Ends, place: np.ndarray, amplitude: np.ndarray, periods: int) -> np.ndarray:
    """Which ends lie within a cell of these places along the line through both cells, and have motions such as those there."""
    near = np.zeros(len(ends), dtype=bool)
    size, period = cells.amplitude[ends.motion], cells.period[ends.motion]
    step = ends.target - ends.source
    for spot, height in zip(place, amplitude, strict=True):
        offset = spot - ends.source
        along, across = (offset * step).sum(axis=1), np.abs(offset * (1 - np.abs(step))).sum(axis=1)
        here = (across < 1e-9) & (along > -1.0) & (along < 2.0)
        near |= here & np.isin(period, (periods, 2 * periods)) & _same(size, height)
    return near


def passes(cells: Cells, curve: xarray.Dataset, spot: tuple[float, float]) -> bool:
    """Whether a curve goes through a point of the plane."""
    scale = np.array([np.diff(axis).min(initial=np.inf) if axis.size > 1 else 1.0 for axis in (cells.horizontal, cells.vertical)])
    points = np.stack([curve["horizontal"].values, curve["vertical"].values], axis=1) / scale
    chord, away = np.diff(points, axis=0), np.array(spot) / scale - points[:-1]
    length = np.maximum((chord**2).sum(axis=1), 1e-300)
    share = np.clip((away * chord).sum(axis=1) / length, 0.0, 1.0)
    return bool(np.linalg.norm(away - share[:, None] * chord, axis=1).min(initial=np.inf) < KNOWN)
