"""Curves on which motions end, in the plane of a chart: where they cross its cells, and which changes they explain."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from saltus.studies.chart.changes import Changes, ChartMotions
from saltus.studies.chart.motions import ALIKE

if TYPE_CHECKING:
    import xarray

ON_CURVE = 0.02  # largest distance, in cells, of a curve from a point through which it goes
ON_LINE = 1e-9  # largest distance, in cells, of a crossing from the line through the middles of cells on which it lies


def curve_dataset(curve: Any, paths: Sequence[str]) -> xarray.Dataset:
    """A curve of special points as a Dataset along `point`: `horizontal`, `vertical`, `amplitude`, `residual` of its orbits."""
    data = curve.to_xarray()
    order = [list(curve.paths).index(path) for path in paths]
    for name, i in zip(("horizontal", "vertical"), order, strict=True):
        data[name] = ("point", curve.parameters[:, i])
    kept: xarray.Dataset = data[["horizontal", "vertical", "amplitude", "residual", "special_kind"]]
    kept["special_place"] = (("special", "axis"), data["special_parameter"].values[:, order])
    signature = curve.orbits[0].signature
    kept.attrs = {**data.attrs, "period": signature.period, "impact_count": signature.impact_count, "path": list(paths)}
    return kept


def crossings(chart: ChartMotions, curve: xarray.Dataset) -> np.ndarray:
    """Where a curve crosses the rows and the columns of the cells' middles, (n, 3): row and column as numbers of cells from the
    first ones, not necessarily whole, and the orbit's amplitude there."""
    rows, columns = (
        np.interp(curve[name].values, axis, np.arange(len(axis)), left=-1, right=len(axis))
        for name, axis in (("vertical", chart.vertical), ("horizontal", chart.horizontal))
    )
    points, found = np.stack([rows, columns, curve["amplitude"].values], axis=1), [np.empty((0, 3))]
    for along in (0, 1):
        for a, b in pairwise(points):
            low, high = sorted((a[along], b[along]))
            lines = np.arange(np.ceil(low), np.floor(high) + 1)
            share = (lines - a[along]) / (b[along] - a[along]) if high > low else np.zeros(len(lines))
            found.append(a + share[:, None] * (b - a))
    return np.concatenate(found)


def explained(chart: ChartMotions, changes: Changes, curves: Sequence[xarray.Dataset]) -> np.ndarray:
    """Whether a curve explains each change: one of orbits similar to the motion that crosses the line between the two cells, or
    its continuation by one cell on both sides."""
    known = np.zeros(len(changes), dtype=bool)
    motions, step = chart.motions[changes.motion], changes.target - changes.source
    for curve in curves:
        period = int(curve.attrs["period"])
        same_period = np.isin(motions["period"], (period, 2 * period))
        for *place, amplitude in crossings(chart, curve):
            offset = np.array(place) - changes.source
            along, across = (offset * step).sum(axis=1), np.abs(offset * (1 - np.abs(step))).sum(axis=1)
            here = (across < ON_LINE) & (along > -1.0) & (along < 2.0)
            known |= here & same_period & _is_similar(motions["amplitude"], amplitude)
    return known


def _is_similar(amplitudes: np.ndarray, amplitude: float) -> np.ndarray:
    """Whether motions of these amplitudes may end in an orbit of this amplitude."""
    return np.asarray(np.abs(amplitudes - amplitude) <= ALIKE.curve * np.maximum(amplitudes, amplitude))


def passes_through(chart: ChartMotions, curve: xarray.Dataset, spot: Sequence[float]) -> bool:
    """Whether a curve goes through a point of the plane."""
    axes = (chart.horizontal, chart.vertical)
    scale = np.array([np.diff(axis).min(initial=np.inf) if axis.size > 1 else 1.0 for axis in axes])
    points = np.stack([curve["horizontal"].values, curve["vertical"].values], axis=1) / scale
    chord, away = np.diff(points, axis=0), np.array(spot) / scale - points[:-1]
    length = np.maximum((chord**2).sum(axis=1), 1e-300)
    share = np.clip((away * chord).sum(axis=1) / length, 0.0, 1.0)
    return bool(np.linalg.norm(away - share[:, None] * chord, axis=1).min(initial=np.inf) < ON_CURVE)


def unseen_folds(chart: ChartMotions, curves: Sequence[xarray.Dataset]) -> np.ndarray:
    """Places (n, 2), row and column, where a curve of folds of motions that count runs between cells, and none of these has such
    a motion.

    Places with another border of the same motions less than a cell away are left out: the motions may exist in a strip between
    the two that is too narrow to contain the middle of a cell.
    """
    found, rows = [np.empty((0, 2))], [crossings(chart, curve) for curve in curves]
    rows = [row[((row[:, :2] >= 0) & (row[:, :2] <= np.array(chart.monostable.shape) - 1)).all(axis=1)] for row in rows]
    points = np.concatenate([np.empty((0, 3)), *rows])
    number = np.repeat(np.arange(len(curves)), [len(row) for row in rows])
    period = np.array([int(curve.attrs["period"]) for curve in curves], dtype=int)[number]
    place = chart.place
    for i, (*spot, amplitude) in enumerate(points):
        if curves[number[i]].attrs["kind"] != "LP" or amplitude < (1 + ALIKE.curve) * chart.least:
            continue
        here = (np.abs(place - spot) < 1 + ON_LINE).all(axis=1) & (chart.motions["period"] == period[i])
        strip = (number != number[i]) & (np.abs(points[:, :2] - spot) < 1 + ON_LINE).all(axis=1)
        strip &= np.isin(period, (period[i], 2 * period[i], period[i] / 2)) & _is_similar(points[:, 2], amplitude)
        if not (here & _is_similar(chart.motions["amplitude"], amplitude)).any() and not strip.any():
            found.append(points[i : i + 1, :2])
    return np.concatenate(found)
