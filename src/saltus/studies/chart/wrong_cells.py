"""The share of a chart's cells that are wrong, from a sample that is computed again with more starts and on a finer grid."""

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
    """How many cells of a random sample are wrong.

    Each cell is computed again with four times as many starts, which are others, and with eight cells around it at half the
    distance of its neighbours, so that motions that begin at these are found as well.

    Parameters
    ----------
    system
        The system of the chart.
    chart
        A chart as `stability_chart` or `with_borders` returns it.
    cells
        The number of cells in the sample; all cells if the chart has fewer.
    seed
        The seed of the sample and of the starts.

    Returns
    -------
    dict[str, float]
        The number of `checked_cells` and of `wrong_cells` among them. The latter are `wrong_rest` where the chart has rest alone
        and there is something else, `wrong_motions` where it lacks a stable motion, and `wrong_chaos` where either the chart or
        the sample has chaos, but not both. `wrong_share` is the share of wrong cells, and `wrong_share_low` to `wrong_share_high`
        its 95 % interval.

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
    """The arguments of a chart with more and with other starts."""
    more = replace(request, starts=MORE * request.starts, seed=request.seed + seed)
    return {name: getattr(more, name) for name in more.__dataclass_fields__}


@dataclass(frozen=True, eq=False, kw_only=True)
class _Sample(ChartRequest):
    """Some cells of a chart, each in the middle of a block of three by three cells half as far apart."""

    place: np.ndarray  # (n, 2): row and column in the chart

    @property
    def shape(self) -> tuple[int, int]:
        """All blocks below one another; starts from a neighbour that belongs to another block do no harm."""
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
