"""The share of a chart's cells that are wrong, by charts with more starts on a finer grid over some blocks of its plane."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from saltus.checks import check_count
from saltus.studies.chart.changes import COUNTS
from saltus.studies.chart.chart import stability_chart
from saltus.studies.chart.motions import ALIKE, has_alike, read_motions
from saltus.studies.chart.request import ChartRequest
from saltus.systems import System

if TYPE_CHECKING:
    import xarray

MORE = 4  # times as many starts


def wrong_cells(system: System, chart: xarray.Dataset, *, blocks: int = 6, size: int = 5, seed: int = 1) -> dict[str, int]:
    """How many cells of a sample are wrong: square blocks of cells, at random, are computed again with four times the starts,
    other ones, and half the distance between the cells.

    Args:
        system: that of the chart.
        chart: as `stability_chart` or `with_borders` returns it.
        blocks, size: how many blocks, and of how many cells along a side.
        seed: of the blocks and of the starts.

    Returns:
        `checked_cells`; of these `wrong_rest`, where the chart has rest alone and there is something else or the other way round;
        `wrong_outcome`, where there is something else than the chart says; and `wrong_motions`, where it lacks a stable motion.
    """
    for name, value in (("blocks", blocks), ("size", size)):
        check_count(name, value, 1)
    request, chart = ChartRequest.of_chart(system, chart), chart.transpose("vertical", "horizontal", ...)
    rng, counted = np.random.default_rng(seed), np.zeros(4, dtype=int)
    for _ in range(blocks):
        first = [int(rng.integers(0, max(n - size, 0) + 1)) for n in request.shape]
        block = chart.isel(vertical=slice(first[0], first[0] + size), horizontal=slice(first[1], first[1] + size))
        axes: dict[str, Any] = {name: _finer(block[name].values) for name in ("vertical", "horizontal")}
        numbers: dict[str, Any] = {"starts": MORE * request.starts, "periods": request.periods, "max_period": request.max_period}
        numbers |= {"least": request.least, "tol": request.tol, "seed": request.seed + seed}
        finer = stability_chart(system, paths=request.paths, window=request.window, **axes, **numbers)
        counted += _compared(block, finer.isel(vertical=slice(None, None, 2), horizontal=slice(None, None, 2)))
    return dict(zip(("checked_cells", "wrong_rest", "wrong_outcome", "wrong_motions"), map(int, counted), strict=True))


def _finer(values: np.ndarray) -> np.ndarray:
    """The values of an axis and those halfway between them."""
    return np.interp(np.arange(2 * len(values) - 1) / 2, np.arange(len(values)), values)


def _compared(block: xarray.Dataset, better: xarray.Dataset) -> np.ndarray:
    """The number of cells, and of those that differ in rest, in the outcome, and in that a motion is missing."""
    motions = read_motions(better)
    counts = motions["amplitude"] > COUNTS * float(better.attrs["least"])
    lacking = motions["cell"][counts & ~has_alike(read_motions(block), motions["cell"], motions, ALIKE.followed)]
    one, other = (data["outcome"].values.ravel() for data in (block, better))
    return np.array([one.size, ((one == 0) != (other == 0)).sum(), (one != other).sum(), len(np.unique(lacking))])
