"""The attractors on which the motions from given states end, and the blocks of cells of a basin
picture that are computed so.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from saltus.attractors.attractor import LAST_STATES, SAME_STATE, UNDECIDED, Target
from saltus.attractors.stroboscopic_section import with_clock
from saltus.errors import ParameterError
from saltus.flow import Ending, Recurrence, find_recurrence
from saltus.progress import Progress, silent
from saltus.result import check_provenance, identity, provenance
from saltus.systems import System, before_impacts, units_with_sides

if TYPE_CHECKING:
    from saltus.sweep import Plan


@dataclass(frozen=True)
class LabellingSettings:
    """How motions are followed until their label is known."""

    # Number of forcing periods of the first stage; after each stage settled motions are labelled.
    # Later stages are longer.
    stage: int = 48
    # The largest number of stroboscopic states that are kept at once: 67 MB, and as much again for
    # arrays computed from them.
    most_states: int = 1 << 22
    fewest: int = 256  # The least number of motions that are followed together.


SETTINGS = LabellingSettings()


@dataclass(frozen=True)
class Labelling:
    """The labels of states by the attractors on which their motions end."""

    system: System  # with a forcing period
    targets: tuple[Target, ...]
    periods: int  # the most forcing periods of each motion
    within: float  # the distance from an attractor from which on a motion has reached it
    tol: float

    def of(self, states: np.ndarray, progress: Progress = silent) -> tuple[np.ndarray, np.ndarray]:
        """The labels of states (n, d), UNDECIDED where no label is certain, and the times to reach
        the attractors, (n,) each.

        A state at a contact that moves into it is taken just before the impact.
        """
        states = before_impacts(self.system, states)
        label = np.empty(len(states), dtype=np.int16)
        time = np.empty(len(states))
        size = max(SETTINGS.fewest, SETTINGS.most_states // self.periods)
        for start in range(0, len(states), size):
            part = slice(start, start + size)
            label[part], time[part] = self._together(states[part])
            progress(min(1.0, (start + size) / len(states)), "cells")
        return label, time

    def _together(self, states: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Labels and times of states that fit into memory together, in stages: settled motions are
        not followed further.
        """
        label = np.full(len(states), UNDECIDED, dtype=np.int16)
        time = np.full(len(states), np.nan)
        rows = np.arange(len(states))
        history = states[:, None]
        done = 0
        # two periods of the longest orbit are looked at
        most = max(
            self.periods, 2 * max((len(t.states) for t in self.targets if not t.dense), default=0)
        )
        while rows.size and done < most:
            span = min(max(SETTINGS.stage, done // 2), most - done)
            ends = find_recurrence(self.system, history[:, -1], span, tol=self.tol).after(
                done, history
            )
            done += span
            label[rows] = self._labels(ends, at_the_end=done == most)
            time[rows] = self._times(label[rows], ends)
            on = ends.unsettled & (label[rows] == UNDECIDED)
            rows, history = rows[on], ends.states[on]
        return label, time

    def _labels(self, ends: Recurrence, at_the_end: bool) -> np.ndarray:
        """The labels of motions; unsettled motions are compared with the sampled sets at the end
        only.
        """
        label = np.full(len(ends), UNDECIDED, dtype=np.int16)
        for target in self.targets:
            if target.kind is Ending.REST:
                label[self._rests(target, ends)] = target.label
            elif not target.dense:
                label[_on_orbit(target, ends)] = target.label
            elif at_the_end:
                moving = ends.unsettled | (ends.periodic if target.curve else False)
                rows = np.flatnonzero(moving & (label == UNDECIDED))
                if rows.size:
                    apart = np.median(target.distance(ends.states[rows, -LAST_STATES:]), axis=1)
                    label[rows[apart < target.grain]] = target.label
        return label

    def _rests(self, target: Target, ends: Recurrence) -> np.ndarray:
        """Which motions are at rest for good in the state of an attractor, (n,); a model with one
        contact has one such state.
        """
        here = target.distance(ends.last) < SAME_STATE * target.size(target.states).max()
        return np.asarray(
            here & (ends.rest | (ends.period == 1))
            if self.system.model.holds_coordinates
            else ends.rest
        )

    def _times(self, label: np.ndarray, ends: Recurrence) -> np.ndarray:
        """The forcing periods after which each motion stays near its attractor for as long as it is
        followed; nan if undecided.

        `ends.states` begins with the initial states; it has nan for periods that a motion did not
        need.
        """
        time = np.full(len(label), np.nan)
        for target in self.targets:
            rows = np.flatnonzero(label == target.label)
            if not rows.size:
                continue
            states = ends.states[rows]
            known = np.isfinite(states[:, :, 0])
            far = known & (target.distance(states) > max(self.within, target.grain))
            last = far.shape[1] - 1 - np.argmax(far[:, ::-1], axis=1)
            passed = np.cumsum(known, axis=1, dtype=np.int32)[np.arange(len(rows)), last]
            time[rows] = np.minimum(np.where(far.any(axis=1), passed, 0), ends.periods[rows])
        return time


def _on_orbit(target: Target, ends: Recurrence) -> np.ndarray:
    """Which motions have settled on an orbit, or were near it during its last two periods and
    nearer in the second, (n,).
    """
    last = ends.states[:, -1]
    q = len(target.states)
    near = SAME_STATE * target.size(last)
    here: np.ndarray = (target.distance(last) < near) & (ends.periodic | ends.unsettled)
    rows = np.flatnonzero(here & ends.unsettled)
    here[rows] = False
    if ends.states.shape[1] < 2 * q:
        return here  # not yet followed for two of its periods
    rounds = target.distance(ends.states[rows, -2 * q :])
    before = rounds[:, :q].max(axis=1)
    after = rounds[:, q:].max(axis=1)
    here[rows] = (before < near[rows]) & (after < before)
    return here


FUNCTION = "saltus.attractors.basins.basin_cells:cells"


@dataclass(frozen=True, eq=False)
class Grid:
    """A plane of initial states: two state variables vary, the others are held fixed."""

    plane: tuple[str, str]  # the variables along the horizontal and the vertical axis
    horizontal: np.ndarray  # (columns,)
    vertical: np.ndarray  # (rows,)
    # all state variables in their order; the values of the two in the plane are not used
    fixed: dict[str, float]

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns."""
        return len(self.vertical), len(self.horizontal)

    @property
    def states(self) -> np.ndarray:
        """The initial states, (rows, columns, d)."""
        return self.states_over(*np.meshgrid(self.horizontal, self.vertical))

    def states_over(self, horizontal: np.ndarray, vertical: np.ndarray) -> np.ndarray:
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
        Arguments of a system with other equations than it has here, or of another version of
        saltus.
    """
    system = System.from_dict(arguments["system"])
    check_provenance(arguments, system, "this part of the basins")
    units = units_with_sides(with_clock(system))
    targets = tuple(Target.from_dict(item, units) for item in arguments["attractors"])
    x, y = arguments["plane"]
    grid = Grid(
        (x, y),
        np.asarray(block[x], dtype=float),
        np.asarray(block[y], dtype=float),
        arguments["fixed"],
    )
    numbers = int(arguments["periods"]), float(arguments["within"]), float(arguments["tol"])
    label, time = _label_grid(Labelling(with_clock(system), targets, *numbers), grid)
    return {"label": label, "time": time}


def _label_grid(
    labelling: Labelling, grid: Grid, progress: Progress = silent
) -> tuple[np.ndarray, np.ndarray]:
    """Labels and times over the grid, (rows, columns) each."""
    states = grid.states
    label, time = labelling.of(states.reshape(-1, states.shape[-1]), progress)
    return label.reshape(grid.shape), time.reshape(grid.shape)


def computed_cells(
    system: System, labelling: Labelling, grid: Grid, rows: int, progress: Progress, **where: Any
) -> tuple[np.ndarray, np.ndarray]:
    """Labels and times over the grid, by a sweep in chunks of `rows` of the grid if `where` has a
    store, workers or a scheduler.

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
    return {
        "system": system.to_dict(),
        "attractors": targets,
        **place,
        **numbers,
        **identity(system),
    }


def _plan(system: System, labelling: Labelling, grid: Grid, rows: int) -> Plan:
    from saltus.sweep import Plan, Variable

    variables = {
        "label": Variable(
            dtype="i2",
            attrs={"units": "1", "long_name": "known attractor on which the motion ends, else -1"},
        ),
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
    """Refuse a store that is not one of the basins of this system, before attractors are looked
    for.
    """
    from saltus.sweep import BEGIN_ANEW, read_plan

    try:
        kept = read_plan(path)
    except ParameterError as error:
        raise ParameterError(str(error), "store") from None
    if kept["function"] != FUNCTION or kept["arguments"]["system"] != json.loads(
        json.dumps(system.to_dict())
    ):
        raise ParameterError(
            (
                f"{path} is the store of another sweep, or of the basins of another system; "
                f"{BEGIN_ANEW}"
            ),
            "store",
        )
    check_provenance(kept["attrs"], system, str(path), BEGIN_ANEW)
