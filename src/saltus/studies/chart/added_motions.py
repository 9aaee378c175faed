"""Motions that are added to a cell of a stability chart: a neighbour's motion leads to them, but no initial state has."""

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

ADDED = "added_by_continuation"  # the attribute of the chart that counts them


def with_motions(chart: xarray.Dataset, request: ChartRequest, cells: np.ndarray, found: np.ndarray) -> xarray.Dataset:
    """The chart with the motions found, of `way_type`, in these cells, (n, 2) rows and columns, unless the cells have them
    already, and with the motions to which these lead in neighbouring cells."""
    made = chart.transpose("vertical", "horizontal", ...).copy(deep=True).load()  # its arrays are written to
    shape, known = made["count"].shape, read_motions(made)
    new = _as_motions(np.ravel_multi_index(tuple(cells.T), shape), found)
    new = distinct(new[~has_alike(known, new["cell"], new, ALIKE.same)])
    if not len(new):
        return made
    motions = by_cell(spread(request, new, distinct(np.concatenate([known, new]))))
    columns = table(motions, made["count"].size, request.variables)
    complete = made["count"].values <= KEPT  # other cells keep only some of their motions, so that none are added there
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
    """Whether a cell, given by its row and column, has a motion of about this amplitude."""
    there = chart.motions["amplitude"][(chart.place == cell).all(axis=1)]
    return bool(np.abs(there - amplitude).min(initial=np.inf) < ALIKE.followed * amplitude)


def _as_motions(cells: np.ndarray, found: np.ndarray) -> np.ndarray:
    """Motions of `way_type` as motions of cells, of `motion_type`."""
    motions = np.zeros(len(found), motion_type(found["state"].shape[1]))
    motions["cell"] = cells
    for name in SEEN:
        motions[name] = found[name]
    return by_cell(motions)
