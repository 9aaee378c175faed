"""A stability chart with motions to which no initial state has led, but a motion of a neighbouring cell."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from saltus.studies.chart.cell_outcomes import outcomes
from saltus.studies.chart.cells import beyond_limits, spread
from saltus.studies.chart.changes import ChartMotions
from saltus.studies.chart.endings import SEEN
from saltus.studies.chart.motions import ALIKE, KEPT, by_cell, distinct, has_alike, motion_type, read_motions, table
from saltus.studies.chart.request import ChartRequest

if TYPE_CHECKING:
    import xarray

ADDED = "added_by_continuation"  # an attribute of the chart: how many


def with_motions(chart: xarray.Dataset, request: ChartRequest, cells: np.ndarray, found: np.ndarray) -> xarray.Dataset:
    """The chart with motions in these cells, (n, 2) rows and columns, of `way_type`, where these have them not yet, and with what
    further motions starts from these lead to."""
    made = chart.transpose("vertical", "horizontal", ...).copy(deep=True).load()  # its arrays are written to
    shape, known = made["count"].shape, read_motions(made)
    new = _as_motions(np.ravel_multi_index(tuple(cells.T), shape), found)
    new = distinct(new[~has_alike(known, new["cell"], new, ALIKE.same)])
    if not len(new):
        return made
    motions = by_cell(spread(request, new, distinct(np.concatenate([known, new]))))
    columns = table(motions, made["count"].size, request.variables)
    complete = made["count"].values <= KEPT  # of other cells not all motions are kept, and none are added
    before = int(made["count"].sum())
    for name, values in columns.items():
        made[name].values[complete] = values.reshape(*shape, *values.shape[1:])[complete]
    parameters = {path: values.reshape(shape) for path, values in request.parameters.items()}
    for name, flag in beyond_limits(request.system, parameters, made["amplitude"].values).items():
        made[name].values[:] = flag
    made["outcome"].values[:] = outcomes(*(made[name].values for name in ("count", "unsettled", "verdict")))
    made.attrs[ADDED] = int(chart.attrs[ADDED]) + int(made["count"].sum()) - before
    return made


def has_motion(chart: ChartMotions, cell: np.ndarray, amplitude: float) -> bool:
    """Whether a cell, its row and column, has a motion of about this amplitude."""
    there = chart.motions["amplitude"][(chart.place == cell).all(axis=1)]
    return bool(np.abs(there - amplitude).min(initial=np.inf) < ALIKE.followed * amplitude)


def _as_motions(cells: np.ndarray, found: np.ndarray) -> np.ndarray:
    """Motions on the way, of `way_type`, as motions of cells."""
    motions = np.zeros(len(found), motion_type(found["state"].shape[1]))
    motions["cell"] = cells
    for name in SEEN:
        motions[name] = found[name]
    return by_cell(motions)
