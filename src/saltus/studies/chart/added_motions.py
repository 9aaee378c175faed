"""A stability chart with motions that continuation has led to, and no initial state."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from saltus.orbits import PeriodicOrbit
from saltus.studies.chart.cells import beyond_limits
from saltus.studies.chart.motions import KEPT, MOTION, by_cell, is_same, read_motions, table
from saltus.systems import System

if TYPE_CHECKING:
    import xarray

ADDED = "added_by_continuation"  # an attribute of the chart: how many


def with_motions(chart: xarray.Dataset, system: System, orbits: Sequence[tuple[int, int, PeriodicOrbit]]) -> xarray.Dataset:
    """The chart with stable orbits, given by row and column, as motions of their cells where these have them not yet."""
    made = chart.transpose("vertical", "horizontal", ...).copy(deep=True).load()  # its arrays are written to
    shape, motions = made["count"].shape, read_motions(made)
    added = 0
    for row, column, orbit in orbits:
        motion = _motion(int(np.ravel_multi_index((row, column), shape)), orbit)
        here = motions[motions["cell"] == motion["cell"]]
        if len(here) < KEPT and not is_same(here, motion).any():
            motions = np.concatenate([motion, motions])
            added += 1
    columns = table(by_cell(motions), made["count"].size, chart.attrs["coordinate"])
    complete = made["count"].values <= KEPT  # of other cells not all motions are kept, and none are added
    for name, values in columns.items():
        made[name].values[complete] = values.reshape(*shape, *values.shape[1:])[complete]
    vertical, horizontal = np.meshgrid(made["vertical"], made["horizontal"], indexing="ij")
    paths = made.attrs["path"]
    for name, flag in beyond_limits(system, {paths[0]: horizontal, paths[1]: vertical}, made["amplitude"].values).items():
        made[name].values[:] = flag
    made.attrs[ADDED] = int(chart.attrs[ADDED]) + added
    return made


def _motion(cell: int, orbit: PeriodicOrbit) -> np.ndarray:
    """An orbit as a motion of a cell, an array of one record."""
    other = min(orbit.highest, -orbit.lowest)
    return np.array([(cell, 0, orbit.period, len(orbit.impact_times), orbit.amplitude, other, orbit.state)], MOTION)
