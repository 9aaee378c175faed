"""Basins: for every initial state of a grid, the attractor on which its motion ends, and how long it takes to come near."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from saltus.attractors.attractor import NEAR, REST, UNDECIDED, Attractor, Attractors, Target
from saltus.attractors.attractors_dataset import attractor_table, coordinate, labels, provenance
from saltus.attractors.basins.basin_cells import PERIODS, WITHIN, Grid, check_basin_store, computed_cells
from saltus.attractors.basins.labelling import label_states
from saltus.attractors.find import find_attractors
from saltus.attractors.stroboscopic_section import with_clock
from saltus.checks import Window, check_axis, check_count, check_number, check_window, checked_by
from saltus.errors import ParameterError
from saltus.progress import Progress, part_of, silent
from saltus.systems import System, reversed_system

if TYPE_CHECKING:
    import xarray

CELLS = 201  # along an axis for which no numbers are given
NARROWEST = 1e-6  # half width of a window around a grid of one point
ROWS = 25  # velocities in a chunk, which then takes seconds
MOST_NEW = 64  # states of cells that end nowhere known from which new attractors are looked for, at a time
ROUNDS = 3


def _check(
    system: System,
    velocity: Any,
    found: Attractors | None,
    periods: int,
    within: float,
    curves: bool,
    tol: float,
    rows: int,
    store: Any,
    workers: object,
    scheduler: object,
    progress: object,
    **coordinates: Any,
) -> None:
    grid = _grid(with_clock(system), velocity, coordinates, found)
    check_count("periods", periods, 32)
    check_number("within", within, above=0.0)
    check_number("tol", tol, at_least=1e-15, at_most=1e-6)
    if found is not None and found.system != system:
        raise ParameterError("found holds the attractors of another system; leave it out, or compute it for this one", "found")
    if curves:
        _check_curves(system, grid)
    check_count("rows", rows, 1)
    if store is not None and Path(store).exists():
        check_basin_store(Path(store), system)


@checked_by(_check)
def basins_of_attraction(
    system: System,
    *,
    velocity: Iterable[float] | None = None,
    found: Attractors | None = None,
    periods: int = PERIODS,
    within: float = WITHIN,
    curves: bool = False,
    tol: float = 1e-11,
    rows: int = ROWS,
    store: Path | str | None = None,
    workers: int | None = None,
    scheduler: str | None = None,
    progress: Progress = silent,
    **coordinates: Iterable[float],
) -> xarray.Dataset:
    """The attractor on which the motion from each state (coordinate, velocity) of a grid at phase 0 ends, and the time it takes.

    A cell has the label of an attractor if its motion is proved to be captured at rest, settles on the cycle (to 1e-6, or is as
    near for two rounds, and nearer in the second), or ends among the points of a chaotic set; else it is -1, undecided. Cells
    that settle elsewhere give new attractors, with labels after the known ones. The time is that after which the motion stays
    within a distance of the attractor's points at phase 0, in forcing periods; to rest, at most that to the proof of capture.

    Args:
        system: what moves, as for `attractors`.
        velocity: the velocities of the grid, increasing; by default 201 over the window of `found`, or of `attractors`.
        found: the attractors and their labels; by default those that `attractors` finds, over the grid.
        periods: the most forcing periods of each motion.
        within: that distance, in the larger of coordinate and velocity.
        curves: adds the curves at which basins meet, computed by the backward flow (see `boundaries`), as `boundary_...` over
            `boundary_point`, nan between pieces.
        tol: the error of a step.
        rows: velocities of the grid in one chunk of a store, or of what a worker computes.
        store, workers, scheduler: where the cells are kept and who computes them, see `saltus.sweep.run`; the attractors are
            found first, and the curves at the end, at every run. Where none is given all cells are computed at once.
        progress: called with the fraction done and what is being done, first when all arguments have been checked.
        coordinates: the coordinates of the grid, by the model's name: theta=np.linspace(-2, 2, 201).

    Returns:
        A Dataset over (velocity, coordinate): `label`, `time` (nan where undecided), and the table of the attractors, in which
        `cells` is the share of the grid.

    Raises:
        ParameterError: as for `attractors`; a grid that does not increase; attractors of another system.
    """
    clock = with_clock(system)
    grid = _grid(clock, velocity, coordinates, found)
    progress(0.0, "attractors")
    if found is None:
        window = _around(clock, grid)
        found = find_attractors(system, window=window, tol=tol, progress=lambda done: progress(0.1 * done, "attractors"))
    numbers: dict[str, Any] = {"periods": periods, "within": within, "tol": tol}
    where = {"store": store, "workers": workers, "scheduler": scheduler}
    label, time = computed_cells(found, grid, numbers, int(rows), part_of(progress, 0.1, 0.9), **where)
    members, label, time, reasons = _with_new(system, found, grid, label, time, periods, within, tol)
    data = _dataset(system, members, grid, label, time, numbers | {"reasons": reasons})
    if curves:
        data = data.assign(_meeting(replace(found, members=members), grid, label, periods, within, tol))
    progress(1.0, "cells")
    return data


def _with_new(
    system: System, found: Attractors, grid: Grid, label: np.ndarray, time: np.ndarray, periods: int, within: float, tol: float
) -> tuple[tuple[Attractor, ...], np.ndarray, np.ndarray, list[str]]:
    """Attractors that only cells of the grid lead to, and these cells with their labels."""
    members, reasons = list(found.members), list(found.reasons)
    clock, seen = with_clock(system), np.zeros(label.shape, dtype=bool)
    for _ in range(ROUNDS):
        rows, columns = np.nonzero((label == UNDECIDED) & ~seen)
        if not rows.size:
            break
        chosen = np.linspace(0, rows.size - 1, min(MOST_NEW, rows.size)).astype(int)
        seen[rows[chosen], columns[chosen]] = True
        states = np.stack([grid[1][columns[chosen]], grid[0][rows[chosen]]], axis=1)
        more = find_attractors(system, starts=1, also=states, tol=tol)
        new = [member for member in more if not any(_same(member.target, known.target) for known in members)]
        reasons = list(dict.fromkeys([*reasons, *more.reasons]))
        if not new:
            continue
        fresh = _relabelled(new, 1 + max([member.label for member in members], default=REST))
        members += fresh
        all_states = np.stack([grid[1][columns], grid[0][rows]], axis=1)
        targets = tuple(member.target for member in fresh)
        label[rows, columns], time[rows, columns] = label_states(clock, targets, all_states, periods, within, tol)
    return tuple(sorted(members, key=lambda member: member.label)), label, time, reasons


def _meeting(found: Attractors, grid: Grid, label: np.ndarray, periods: int, within: float, tol: float) -> dict[str, Any]:
    """The curves at which basins meet, as variables."""
    from saltus.attractors.basins.boundaries import boundaries, clipped

    clock, (name, unit) = with_clock(found.system), coordinate(found.system)
    curves = boundaries(
        found, lambda states: label_states(clock, found.targets, states, periods, within, tol)[0], label, grid[1], grid[0]
    )
    points = clipped(curves, (grid[1][[0, -1]], grid[0][[0, -1]]))
    text = "of the stable manifolds between basins, nan between pieces"
    return {
        f"boundary_{name}": ("boundary_point", points[:, 0], {"units": unit, "long_name": f"{name} {text}"}),
        "boundary_velocity": ("boundary_point", points[:, 1], {"units": "1", "long_name": f"velocity {text}"}),
    }


def _check_curves(system: System, grid: Grid) -> None:
    """Refuse, before cells are computed, what has no curves: a grid that is a line, impacts that cannot be undone."""
    for name, values in zip(("velocity", system.model.coordinates[0]), grid, strict=True):
        if len(values) < 2:
            raise ParameterError(f"{name} must be at least two numbers where the curves between basins are asked for", name)
    reversed_system(system)


def _same(one: Target, other: Target) -> bool:
    if one.kind != other.kind:
        return False
    apart = other.distance(one.strobes)
    return (
        bool(np.median(apart) < other.grain)
        if other.dense
        else bool(apart.max() < 10.0 * NEAR * (1.0 + np.abs(one.strobes).max()))
    )


def _relabelled(new: list[Attractor], first: int) -> list[Attractor]:
    """New attractors with labels after the known ones, rest with its own; shares of the few states say nothing."""
    label_of = {m.label: first + i for i, m in enumerate(m for m in new if m.kind != "rest")} | {REST: REST}
    return [
        Attractor(
            target=Target(label_of[m.label], m.kind, m.strobes),
            highest=m.highest,
            lowest=m.lowest,
            orbit=m.orbit,
            starts=0,
            of=0,
            mirror=label_of.get(m.mirror, UNDECIDED),
            evidence=m.evidence,
        )
        for m in new
    ]


def _around(system: System, grid: Grid) -> Window:
    """The least window around the contact that holds a grid."""
    contact = check_window(None, system).centre[0]
    wide, fast = (float(max(np.abs(a - m).max(), NARROWEST)) for a, m in ((grid[1], contact), (grid[0], 0.0)))
    return Window((contact - wide, contact + wide), (-fast, fast))


def _grid(system: System, velocity: Any, coordinates: Mapping[str, Any], found: Attractors | None) -> Grid:
    """Velocities and coordinates of the grid."""
    name = system.model.coordinates[0]
    for other in coordinates:
        if other != name:
            raise ParameterError(
                f"{type(system.model).__name__} has no coordinate {other!r}; give {name}=... and velocity=...", other
            )
    window = check_window(None if found is None else found.window, system)
    along = window.centre[0] + window.half[0] * np.linspace(-1.0, 1.0, CELLS)
    if system.model.sides:
        along = along[np.max([np.asarray(system.model.gap(along, s)) for s in system.model.sides], axis=0) >= 0.0]
    speeds = window.centre[1] + window.half[1] * np.linspace(-1.0, 1.0, CELLS) if velocity is None else velocity
    places = coordinates.get(name)
    return check_axis("velocity", speeds), check_axis(name, along if places is None else places)


def _dataset(
    system: System, members: tuple[Attractor, ...], grid: Grid, label: np.ndarray, time: np.ndarray, more: dict[str, Any]
) -> xarray.Dataset:
    import xarray

    name, unit = coordinate(system)
    dims = ("velocity", name)
    share = [float((label == member.label).mean()) for member in members]
    period = with_clock(system).load.period or math.nan
    variables: dict[str, Any] = attractor_table(members, system)
    variables |= {
        "label": (dims, label, {"units": "1", "long_name": "attractor on which the motion ends, -1 for undecided"}),
        "time": (dims, time, {"units": f"2 pi / Omega = {period:.9g}", "long_name": "forcing periods to reach the attractor"}),
        "cells": ("attractor", np.array(share), {"units": "1", "long_name": "share of the grid"}),
    }
    axes = {
        "velocity": ("velocity", grid[0], {"units": "1", "long_name": f"d {name} / d tau at phase 0"}),
        name: (name, grid[1], {"units": unit, "long_name": f"{name} at phase 0"}),
        "attractor": labels(members),
    }
    undecided = float((label == UNDECIDED).mean())
    return xarray.Dataset(variables, axes, provenance(system, "basins") | more | {"undecided": undecided})
