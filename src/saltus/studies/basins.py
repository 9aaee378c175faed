"""Basins as a sweep: rows of the grid are chunks, kept in a store, computed here or on a cluster."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from saltus.attractors import basins_of_attraction
from saltus.checks import check_count, checked_by
from saltus.errors import ParameterError
from saltus.progress import Progress, part_of, silent
from saltus.systems import System

if TYPE_CHECKING:
    import xarray

    from saltus.sweep import Plan

ROWS = 25  # of the grid in one chunk
CELLS = "saltus.attractors.basins.grid:cells"


def _check(system: System, rows: int, store: Any, workers: object, scheduler: object, progress: object, **options: Any) -> None:
    check_count("rows", rows, 1)
    if store is not None and Path(store).exists():
        _check_store(Path(store), system)
    basins_of_attraction.check(system, **options)


@checked_by(_check)
def basin_sweep(
    system: System,
    *,
    rows: int = ROWS,
    store: Any = None,
    workers: int | None = None,
    scheduler: str | None = None,
    progress: Progress = silent,
    **options: Any,
) -> xarray.Dataset:
    """`basins_of_attraction`, its cells computed as a sweep: the same numbers, in chunks that a later run need not repeat.

    The attractors are found first, and the curves at the end, at every run; they follow from the arguments alone.

    Args:
        system: what moves.
        rows: velocities of the grid in one chunk.
        store, workers, scheduler: where the cells are kept and who computes them, see `saltus.sweep.execution`.
        progress: called with the fraction done and what is being done, first when all arguments have been checked.
        options: those of `basins`.

    Raises:
        ParameterError: an argument without meaning.
        SweepError, SweepInterrupted: as `saltus.sweep.execution`.
    """
    from saltus.sweep import run

    def computed(arguments: dict[str, Any], axes: dict[str, np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
        data = run(
            plan(arguments, axes, int(rows)), store, workers=workers, scheduler=scheduler, progress=part_of(progress, 0.1, 0.9)
        )
        return data["label"].values, data["time"].values

    return basins_of_attraction(system, compute=computed, progress=lambda fraction: progress(fraction, "attractors"), **options)


def _check_store(path: Path, system: System) -> None:
    """Refuse, before attractors are looked for, what is surely not the store of these basins."""
    from saltus.sweep import read_plan

    kept = read_plan(path)
    if kept["function"] != CELLS or kept["arguments"]["system"] != json.loads(json.dumps(system.to_dict())):
        raise ParameterError(f"{path} is the store of another sweep, or of the basins of another system; name another store")


def plan(arguments: dict[str, Any], axes: dict[str, np.ndarray], rows: int) -> Plan:
    """The cells of basins as a sweep."""
    from saltus import __version__
    from saltus.sweep import Plan, Variable

    variables = {
        "label": Variable(dtype="i2", attrs={"units": "1", "long_name": "known attractor on which the motion ends, else -1"}),
        "time": Variable(dtype="f8", attrs={"long_name": "forcing periods to reach it"}),
    }
    said = {"kind": "basin_cells", "title": "cells of basins computed by saltus", "saltus_version": __version__}
    return Plan(function=CELLS, arguments=arguments, axes=axes, chunk={"velocity": rows}, variables=variables, attrs=said)
