"""The cells of a grid of initial states: the attractor on which the motion from each ends, computed at once or as a sweep."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from saltus.attractors.attractor import Target
from saltus.attractors.basins.labelling import Labelling
from saltus.attractors.stroboscopic_section import with_clock
from saltus.errors import ParameterError
from saltus.progress import Progress, silent
from saltus.provenance import check_provenance, identity, provenance
from saltus.systems import System

if TYPE_CHECKING:
    from saltus.sweep import Plan

FUNCTION = "saltus.attractors.basins.basin_cells:cells"


@dataclass(frozen=True, eq=False)
class Grid:
    """A plane of initial states: two state variables vary, the others are held fixed."""

    plane: tuple[str, str]  # the variables along the horizontal and the vertical axis
    horizontal: np.ndarray  # (columns,)
    vertical: np.ndarray  # (rows,)
    fixed: dict[str, float]  # all state variables in their order; the values of the two in the plane are not used

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns."""
        return len(self.vertical), len(self.horizontal)

    @property
    def states(self) -> np.ndarray:
        """The initial states, (rows, columns, d)."""
        return self.at(*np.meshgrid(self.horizontal, self.vertical))

    def at(self, horizontal: np.ndarray, vertical: np.ndarray) -> np.ndarray:
        """The states (..., d) at places of the plane."""
        varied = dict(zip(self.plane, (horizontal, vertical), strict=True))
        each = [varied.get(name, value) for name, value in self.fixed.items()]
        return np.stack(np.broadcast_arrays(*each), axis=-1).astype(float)


def cells(arguments: Mapping[str, Any], block: Mapping[str, Any]) -> dict[str, np.ndarray]:
    """Labels and times of one block of a grid: what a sweep calls for each of its chunks.

    Parameters
    ----------
    arguments
        The arguments that `cell_arguments` makes, in types that can be written as JSON.
    block
        Values along both axes, by the names of the state variables of the plane.

    Returns
    -------
    dict[str, np.ndarray]
        {"label": int16 (rows, columns), "time": float (rows, columns)}.

    Raises
    ------
    ParameterError
        Arguments of a system with other equations than it has here, or of another version of saltus.
    """
    system = System.from_dict(arguments["system"])
    check_provenance(arguments, system, "this part of the basins")
    targets = tuple(Target.from_dict(item) for item in arguments["attractors"])
    x, y = arguments["plane"]
    grid = Grid((x, y), np.asarray(block[x], dtype=float), np.asarray(block[y], dtype=float), arguments["fixed"])
    numbers = int(arguments["periods"]), float(arguments["within"]), float(arguments["tol"])
    label, time = _label_grid(Labelling(with_clock(system), targets, *numbers), grid)
    return {"label": label, "time": time}


def _label_grid(labelling: Labelling, grid: Grid, progress: Progress = silent) -> tuple[np.ndarray, np.ndarray]:
    """Labels and times over the grid, (rows, columns) each."""
    label, time = labelling.of(grid.states.reshape(-1, labelling.system.dimension), progress)
    return label.reshape(grid.shape), time.reshape(grid.shape)


def computed_cells(
    system: System, labelling: Labelling, grid: Grid, rows: int, progress: Progress, **where: Any
) -> tuple[np.ndarray, np.ndarray]:
    """Labels and times over the grid, by a sweep in chunks of `rows` of the grid if `where` has a store, workers or a scheduler.

    Parameters
    ----------
    system
        The system as it was given, whose load may be constant.
    labelling
        The attractors, and how motions are labelled by them.
    grid
        The initial states.
    rows
        The number of rows of the grid in a chunk.
    progress
        Called with the share of the cells that are done.
    where
        `store`, `workers` and `scheduler` of `saltus.sweep.run`, or None.
    """
    from saltus.sweep import run

    if all(value is None for value in where.values()):
        return _label_grid(labelling, grid, progress)
    data = run(_plan(system, labelling, grid, rows), progress=progress, **where)
    return np.array(data["label"]), np.array(data["time"])


def cell_arguments(system: System, labelling: Labelling, grid: Grid) -> dict[str, Any]:
    """The arguments of `cells` that are the same for all blocks."""
    targets = [target.to_dict() for target in labelling.targets]
    numbers = {"periods": labelling.periods, "within": labelling.within, "tol": labelling.tol}
    place = {"plane": list(grid.plane), "fixed": grid.fixed}
    return {"system": system.to_dict(), "attractors": targets, **place, **numbers, **identity(system)}


def _plan(system: System, labelling: Labelling, grid: Grid, rows: int) -> Plan:
    from saltus.sweep import Plan, Variable

    variables = {
        "label": Variable(dtype="i2", attrs={"units": "1", "long_name": "known attractor on which the motion ends, else -1"}),
        "time": Variable(dtype="f8", attrs={"long_name": "forcing periods to reach it"}),
    }
    return Plan(
        function=FUNCTION,
        arguments=cell_arguments(system, labelling, grid),
        axes={grid.plane[1]: grid.vertical, grid.plane[0]: grid.horizontal},
        chunk={grid.plane[1]: rows},
        variables=variables,
        attrs=provenance(system, kind="basin_cells", title="cells of basins computed by saltus"),
    )


def check_basin_store(path: Path, system: System) -> None:
    """Refuse a store that is not one of the basins of this system, before attractors are looked for."""
    from saltus.sweep import BEGIN_ANEW, read_plan

    try:
        kept = read_plan(path)
    except ParameterError as error:
        raise ParameterError(str(error), "store") from None
    if kept["function"] != FUNCTION or kept["arguments"]["system"] != json.loads(json.dumps(system.to_dict())):
        raise ParameterError(f"{path} is the store of another sweep, or of the basins of another system; {BEGIN_ANEW}", "store")
    check_provenance(kept["attrs"], system, str(path), BEGIN_ANEW)
