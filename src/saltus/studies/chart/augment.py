"""A stability chart with motions that continuation has led to, and no initial state."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from saltus.orbits import PeriodicOrbit
from saltus.studies.chart.cells import MOTIONS
from saltus.studies.chart.chart import with_limits
from saltus.systems import System

if TYPE_CHECKING:
    import xarray

EACH = ("amplitude", "other", "period", "impact_count", "theta", "velocity")  # what a chart keeps of a motion
EQUAL = 1e-4  # of the amplitude: between motions that are one
ADDED = "added_by_continuation"  # an attribute of the chart: how many


def with_motions(chart: xarray.Dataset, system: System, orbits: Sequence[tuple[int, int, PeriodicOrbit]]) -> xarray.Dataset:
    """The chart with stable orbits, given by row and column, as motions of their cells where these have them not yet."""
    order = ("vertical", "horizontal")
    made = chart.transpose(*order, ...).copy(deep=True).load()  # its arrays are written to
    added = 0
    for row, column, orbit in orbits:
        added += _add(
            {name: made[f"motion_{name}"].values[row, column] for name in EACH}, made["count"].values[row], column, orbit
        )
    for name, value in _largest(made).items():
        made[name].values[:] = value
    made.attrs[ADDED] = int(chart.attrs[ADDED]) + added
    paths = list(chart.attrs["path"])
    return with_limits(made, system, (paths[0], paths[1]))


def _add(cell: dict[str, Any], count: Any, column: int, orbit: PeriodicOrbit) -> int:
    """Put an orbit among the motions of a cell, by falling amplitude; returns how many are added."""
    here = np.isfinite(cell["amplitude"])
    position, velocity = orbit.state
    new = (orbit.amplitude, min(orbit.highest, -orbit.lowest), orbit.period, len(orbit.impact_times), position, velocity)
    known = here & (np.abs(cell["amplitude"] - orbit.amplitude) <= EQUAL * orbit.amplitude) & (cell["period"] == orbit.period)
    if known.any() or here.sum() == MOTIONS:
        return 0
    place = int((cell["amplitude"][here] > orbit.amplitude).sum())
    for name, value in zip(EACH, new, strict=True):
        cell[name][place + 1 :] = cell[name][place:-1].copy()
        cell[name][place] = value
    count[column] += 1
    return 1


def _largest(chart: xarray.Dataset) -> dict[str, np.ndarray]:
    """What a chart says of the largest and of the smallest of its motions."""
    size = chart["motion_amplitude"].values
    some = np.isfinite(size).any(axis=2)
    smallest = np.where(some, np.nanmin(np.where(np.isfinite(size), size, np.inf), axis=2), np.nan)
    least = np.where(chart["count"].values > MOTIONS, chart["smallest_amplitude"].values, smallest)  # not all are kept then
    return {"amplitude": size[:, :, 0], "period": chart["motion_period"].values[:, :, 0], "smallest_amplitude": least}
