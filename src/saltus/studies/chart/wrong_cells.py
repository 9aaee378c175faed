"""The share of a chart's cells that are wrong, by a sample of them that is computed again with more starts on a finer grid."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from saltus.attractors import share_interval
from saltus.checks import check_count
from saltus.public_functions import answered
from saltus.studies.chart.cell_outcomes import CellOutcome
from saltus.studies.chart.cells import computed
from saltus.studies.chart.changes import COUNTS
from saltus.studies.chart.motions import ALIKE, KEPT, has_alike, read_motions
from saltus.studies.chart.request import ChartRequest
from saltus.systems import System

if TYPE_CHECKING:
    import xarray

MORE = 4  # times as many starts
CHAOTIC = (CellOutcome.CHAOS, CellOutcome.MOTIONS_AND_CHAOS)


@answered
def wrong_cells(system: System, chart: xarray.Dataset, *, cells: int = 100, seed: int = 1) -> dict[str, float]:
    """How many cells of a sample are wrong: cells at random are computed again with four times the starts, other ones, and beside
    eight more cells about each, half as far away as its neighbours, so that motions which begin there are found.

    Parameters
    ----------
    system
        That of the chart.
    chart
        As `stability_chart` or `with_borders` returns it.
    cells
        How many cells the sample has; all of the chart's if it has no more.
    seed
        Of the sample and of the starts.

    Returns
    -------
    dict[str, float]
        `checked_cells`; of these `wrong_cells`, which are `wrong_rest`, where the chart has rest alone and there is something
        else, `wrong_motions`, where it lacks a stable motion, or `wrong_chaos`, where it has chaos and the sample none or the
        other way round; and the `wrong_share` of the wrong ones with its 95 % interval, `wrong_share_low` to `wrong_share_high`.

    Examples
    --------
    >>> chart = saltus.stability_chart(system, horizontal=[0.2, 0.21], vertical=[-0.5, -0.49], starts=4)
    >>> saltus.studies.wrong_cells(system, chart, cells=4)["wrong_share"]
    0.0
    """
    check_count("cells", cells, 1)
    check_count("seed", seed, 0)
    request, chart = ChartRequest.of_chart(system, chart), chart.transpose("vertical", "horizontal", ...)
    size = int(np.prod(request.shape))
    chosen = np.sort(np.random.default_rng(seed).choice(size, min(cells, size), replace=False))
    finer = _Sample(**_numbers(request, seed), place=np.stack(np.unravel_index(chosen, request.shape), axis=1))
    columns, found = computed(finer)
    middle = 9 * np.arange(len(chosen)) + 4
    motions = found[(found["amplitude"] > COUNTS * request.least) & np.isin(found["cell"], middle)]
    motions["cell"] = chosen[motions["cell"] // 9]
    known, full = read_motions(chart), chart["count"].values.ravel()[motions["cell"]] >= KEPT
    lacking = motions["cell"][~full & ~has_alike(known, motions["cell"], motions, ALIKE.followed)]
    before, after = chart["outcome"].values.ravel()[chosen], columns["outcome"][middle]
    wrong = {
        "wrong_rest": (before == CellOutcome.REST) & (after != CellOutcome.REST),
        "wrong_motions": np.isin(chosen, lacking),
        "wrong_chaos": np.isin(before, CHAOTIC) != np.isin(after, CHAOTIC),
    }
    number = int(np.any(list(wrong.values()), axis=0).sum())
    low, high = share_interval(number, len(chosen))
    counts = {"checked_cells": len(chosen), "wrong_cells": number, **{name: int(cells.sum()) for name, cells in wrong.items()}}
    return counts | {"wrong_share": number / len(chosen), "wrong_share_low": low, "wrong_share_high": high}


def _numbers(request: ChartRequest, seed: int) -> dict[str, Any]:
    """The arguments of a chart with more starts, other ones."""
    more = replace(request, starts=MORE * request.starts, seed=request.seed + seed)
    return {name: getattr(more, name) for name in more.__dataclass_fields__}


@dataclass(frozen=True, eq=False, kw_only=True)
class _Sample(ChartRequest):
    """Some cells of a chart, each in the middle of three rows and columns of cells half as far apart."""

    place: np.ndarray  # (n, 2): row and column in the chart

    @property
    def shape(self) -> tuple[int, int]:
        """The rows of all of them below one another: what neighbours beyond these three add as starts does no harm."""
        return 3 * len(self.place), 3

    @property
    def parameters(self) -> dict[str, np.ndarray]:
        """The values of both parameters in each cell, by their dotted paths."""
        steps = np.array([-0.5, 0.0, 0.5])
        rows, columns = (
            np.interp(index[:, None] + steps, np.arange(len(axis)), axis)
            for index, axis in zip(self.place.T, (self.vertical, self.horizontal), strict=True)
        )
        return {self.paths[1]: np.repeat(rows, 3, axis=1).ravel(), self.paths[0]: np.tile(columns, 3).ravel()}
