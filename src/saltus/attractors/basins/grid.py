"""Basins: for every initial state of a grid, the attractor on which its motion ends, and how long
it takes to come near.

The curves between basins are stable manifolds of the saddles on the boundary, found by edge
tracking.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from saltus.attractors.attractor import (
    REST,
    SAME_STATE,
    UNDECIDED,
    Attractor,
    Attractors,
    Target,
    about,
    attractor_table,
    labels,
    state_plane,
    state_units,
    variable,
)
from saltus.attractors.attractor_search import find_attractors
from saltus.attractors.basins.basin_cells import Grid, Labelling, check_basin_store, computed_cells
from saltus.attractors.phase_plane import separatrices
from saltus.attractors.saddle_manifolds import is_saddle, stable_manifold
from saltus.attractors.stroboscopic_section import (
    is_constant,
    section_states,
    solved_orbit,
    with_clock,
)
from saltus.checks import (
    LIMITS,
    check_axis,
    check_count,
    check_memory,
    check_number,
    check_work,
    checked_by,
)
from saltus.errors import ParameterError, near
from saltus.flow import check_device, check_relays, on_device, side_name, state_names
from saltus.orbits import PeriodicOrbit, is_symmetric, same_orbit
from saltus.progress import Progress, part_of, silent
from saltus.systems import (
    Box,
    System,
    Window,
    check_reached,
    check_system,
    check_window,
    image_of,
    rest_state,
    reversed_system,
)

if TYPE_CHECKING:
    import xarray


@dataclass(frozen=True)
class BoundarySettings:
    """How saddles on the boundary are found, and their manifolds computed."""

    # Distance between neighbouring points of a manifold, in half widths of the window.
    step: float = 0.01
    points: int = 8_000  # The largest number of points of a manifold on each side of a saddle.
    max_period: int = 6  # The longest period of saddles that are looked for, in forcing periods.
    # The largest number of saddles, which are those of the shortest periods. If there are more, the
    # manifold of each comes near all of the boundary.
    saddles: int = 4
    edges: int = 12  # Number of places of the boundary from which the edge is tracked.
    tracked: int = 40  # Number of forcing periods for which it is tracked.
    cuts: int = 32  # Number of states that divide an interval across the boundary.
    # Number of times that such an interval is divided: 33^-9 of it is less than rounding.
    rounds: int = 9
    # Newton's method is tried from returns that are no farther than this.
    farthest_return: float = 0.2
    # Curves are given up to this distance from the middle of the window, in half widths.
    margin: float = 1.5


BOUNDARIES = BoundarySettings()
Label = Callable[[np.ndarray], np.ndarray]  # states (n, 2) -> labels (n,)


def basin_boundaries(
    found: Attractors, label: Label, labels: np.ndarray, along: np.ndarray, velocity: np.ndarray
) -> np.ndarray:
    """The curves at which the basins of a grid meet, one after the other, (n, 2), with nan between
    them.

    Under a constant load they are the separatrices of the saddle equilibria in the window of the
    grid. Under a periodic load they are the stable manifolds of at most 4 saddle orbits, of up to 6
    forcing periods, that edge tracking finds. Of a curve that is too long only a part is given: the
    manifold of a chaotic saddle has no end.

    Parameters
    ----------
    found
        The attractors.
    label
        The labels of states.
    labels
        The labels of the grid, (velocities, coordinates).
    along, velocity
        The grid.
    """
    bounds = (float(along[0]), float(along[-1])), (float(velocity[0]), float(velocity[-1]))
    window = check_window(bounds, found.system)
    if is_constant(found.system.load):
        curves = [
            np.stack([curve.theta, curve.velocity], axis=1)
            for curve in separatrices(found.system, window)
        ]
    else:
        saddles = edge_saddles(found.system, *edges(label, labels, along, velocity))
        curves = [
            stable_manifold(
                saddle, window=window, step=BOUNDARIES.step, points=BOUNDARIES.points
            ).states
            for saddle in saddles
        ]
    return clipped(curves, window)


def edges(
    label: Label, labels: np.ndarray, along: np.ndarray, velocity: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Pairs of states (n, 2) with different labels, as close to each other as rounding allows,
    spread over the boundary.
    """
    rows, columns = np.nonzero(
        (labels[:, 1:] != labels[:, :-1])
        & (labels[:, 1:] != UNDECIDED)
        & (labels[:, :-1] != UNDECIDED)
    )
    chosen = np.unique(
        np.linspace(0, max(len(rows) - 1, 0), min(BOUNDARIES.edges, len(rows))).astype(int)
    )
    rows, columns = rows[chosen], columns[chosen]
    low = np.stack([along[columns], velocity[rows]], axis=1)
    high = np.stack([along[columns + 1], velocity[rows]], axis=1)
    first = labels[rows, columns]
    for _ in range(BOUNDARIES.rounds if len(rows) else 0):
        share = np.linspace(0.0, 1.0, BOUNDARIES.cuts + 2)[None, 1:-1, None]
        between = low[:, None] + share * (high - low)[:, None]
        other = label(between.reshape(-1, 2)).reshape(len(rows), BOUNDARIES.cuts) != first[:, None]
        between = np.concatenate([low[:, None], between, high[:, None]], axis=1)
        # the last state with the first label
        place = np.where(other.any(axis=1), np.argmax(other, axis=1), BOUNDARIES.cuts)
        pick = np.arange(len(rows))
        low = between[pick, place]
        high = between[pick, place + 1]
    return low, high


def edge_saddles(system: System, low: np.ndarray, high: np.ndarray) -> list[PeriodicOrbit]:
    """The saddle orbits near which motions on the boundary come, and their mirror images."""
    found: list[PeriodicOrbit] = []
    for track in section_states(system, 0.5 * (low + high), BOUNDARIES.tracked) if len(low) else ():
        for state, period in _returns(track):
            orbit = solved_orbit(system, state, period)
            if orbit is None or not is_saddle(orbit):
                continue
            for one in (orbit, *_image(orbit)):
                if not any(same_orbit(one, other, mirrored=False) for other in found):
                    found.append(one)
    return sorted(found, key=lambda orbit: orbit.period)[: BOUNDARIES.saddles]


def _returns(track: np.ndarray) -> list[tuple[np.ndarray, int]]:
    """For each period up to the longest, the state of a motion to which it returns most closely
    after this period, if near.
    """
    chosen = []
    for q in range(1, BOUNDARIES.max_period + 1):
        apart = np.abs(track[q:] - track[:-q]).max(axis=1)
        # later it has left the boundary for an attractor, and returns there
        apart = apart[: len(apart) // 2]
        nearest = int(np.nanargmin(apart))
        if apart[nearest] < BOUNDARIES.farthest_return:
            chosen.append((track[nearest], q))
    return chosen


def clipped(curves: list[np.ndarray], window: Window) -> np.ndarray:
    """The curves one after the other, (n, 2), with nan between them and where they are more than
    1.5 half widths from the middle of the window."""
    parts = [np.full((0, 2), np.nan)]
    for curve in curves:
        far = ~(np.abs(window.scaled(curve)) <= BOUNDARIES.margin).all(axis=1)
        parts += [np.where(far[:, None], np.nan, curve), np.full((1, 2), np.nan)]
    joined = np.concatenate(parts)
    gone = np.isnan(joined).any(axis=1)
    return joined[~(gone & np.append(True, gone[:-1]))] if len(joined) else joined


def _image(orbit: PeriodicOrbit) -> list[PeriodicOrbit]:
    """The mirror image of an orbit that is not its own."""
    if orbit.symmetric or not is_symmetric(orbit.system):
        return []
    state = image_of(orbit.system, section_states(orbit.system, np.array([orbit.state]), 0.5)[0, 0])
    image = solved_orbit(orbit.system, state, orbit.period)
    return [] if image is None else [image]


@dataclass(frozen=True)
class BasinSettings:
    """The numbers of a picture of basins."""

    cells: int = 201  # Number of cells along an axis whose values are not given.
    # The half width of the window around a grid of one point, as a share of the default one.
    narrowest: float = 1e-6
    periods: int = 500  # The largest number of forcing periods for which a motion is followed.
    within: float = 1e-2  # The distance from an attractor within which a motion has reached it.
    rows: int = 25  # Number of rows of the grid in a chunk of a store, which then takes seconds.
    # Number of states, out of the cells whose motions end on no known attractor, from which new
    # attractors are looked for.
    new_states: int = 64
    rounds: int = 3  # Number of times that new attractors are looked for.


SETTINGS = BasinSettings()
# A misspelt one of these arrives among the coordinates.
ARGUMENTS: tuple[str, ...]
ARGUMENTS = (
    "window",
    "points",
    "velocity",
    "relays",
    "found",
    "periods",
    "within",
    "curves",
    "tol",
    "rows",
)
ARGUMENTS += ("store", "workers", "scheduler", "device", "progress")


def _check(
    system: System,
    window: Any,
    points: int,
    velocity: Any,
    relays: Any,
    found: Attractors | None,
    periods: int,
    within: float,
    curves: bool,
    tol: float,
    rows: int,
    store: Any,
    workers: object,
    scheduler: object,
    device: Any,
    progress: object,
    **coordinates: Any,
) -> None:
    check_device(device, system, workers, scheduler)
    check_count("points", points, 2)
    grid = _grid(with_clock(system), velocity, relays, coordinates, found, window, points)
    axes = dict(zip(grid.plane, (grid.horizontal, grid.vertical), strict=True))
    for name in system.model.coordinates:
        check_reached(system.model, name, axes.get(name, grid.fixed[name]), name)
    check_count("periods", periods, 32)
    check_number("within", within, above=0.0)
    check_number("tol", tol, at_least=1e-15, at_most=1e-6)
    if found is not None and found.system != system:
        raise ParameterError(
            "found holds the attractors of another system; leave it out, or compute it for"
            " this one",
            "found",
        )
    if curves:
        _check_curves(system, grid)
    check_count("rows", rows, 1)
    height, width = grid.shape
    check_work("periods", height * width, periods)
    at_once = width * (height if store is None else min(rows, height))
    check_memory(grid.plane[1], float(at_once) * LIMITS.motion, f"{at_once} cells at once")
    from saltus.sweep import store_path

    path = store_path(store)
    if path is not None and path.exists():
        check_basin_store(path, system)


@checked_by(_check)
@on_device
def basins_of_attraction(
    system: System,
    *,
    window: Box | None = None,
    points: int = SETTINGS.cells,
    velocity: Iterable[float] | None = None,
    relays: Mapping[str, bool] | None = None,
    found: Attractors | None = None,
    periods: int = SETTINGS.periods,
    within: float = SETTINGS.within,
    curves: bool = False,
    tol: float = 1e-11,
    rows: int = SETTINGS.rows,
    store: Path | str | None = None,
    workers: int | None = None,
    scheduler: str | None = None,
    device: str = "cpu",
    progress: Progress = silent,
    **coordinates: Iterable[float] | float,
) -> xarray.Dataset:
    """The attractor on which the motion from each state (coordinate, velocity) of a grid at phase 0
    ends, and the time it takes.

    A cell has the label of an attractor if its motion is proved to be captured at rest, settles on
    the orbit, or ends among points of a chaotic set. To settle is to come as near as 1e-6, or to
    stay as near for two periods of the orbit and to be nearer in the second; else it is -1,
    undecided. Motions that settle elsewhere give new attractors, with labels after the known ones.
    The time is the number of forcing periods after which the motion stays within a distance
    (`within`) of the attractor's states at phase 0; for rest it is at most the time until capture
    is proved.

    Parameters
    ----------
    system
        What moves, as for `find_attractors`.
    window
        The bounds of each coordinate, then of each velocity, as for `find_attractors`; by default
        its window, or that of `found`. With several coordinates two state variables have two
        different bounds, and the others keep their value.
    points
        The number of values along each of the two.
    velocity
        The velocities of the grid themselves, increasing, in place of those of the window.
    relays
        Whether each `Relay` of the model is on in the states of the grid between its thresholds,
        such as {"heater": True}.
    found
        The attractors and their labels; by default those that `find_attractors` finds, over the
        grid.
    periods
        The largest number of forcing periods of each motion.
    within
        The distance from an attractor, as the largest difference of a variable in natural units,
        within which a motion has reached it.
    curves
        Whether to add the curves at which basins meet, computed by the backward flow (see
        `basin_boundaries`), as `boundary_...` over `boundary_point`, nan between curves.
    tol
        The error of a step.
    rows
        The number of rows of the grid in one chunk of a store or of a worker.
    store, workers, scheduler
        Where the cells are kept and who computes them, see `saltus.sweep.run`. The attractors
        before and the curves after the cells are computed anew at every run. If none is given all
        cells are computed at once.
    device
        Where the motions are followed, as for `simulate_many`.
    progress
        Called with the fraction done and what is being done.
    coordinates
        The coordinates of the grid themselves, by the model's name: theta=np.linspace(-2, 2, 201).
        With several coordinates two state variables are lists, such as theta_1 and
        theta_1_velocity; the others are fixed, by default at rest at their contacts, or at 0
        without one.

    Returns
    -------
    xarray.Dataset
        A Dataset over (velocity, coordinate), or over the two variables of the plane: `label`,
        `time` (nan where undecided), and the table of the attractors, in which `cells` is an
        attractor's share of the grid.

    Raises
    ------
    ParameterError
        As for `find_attractors`; a grid that does not increase; attractors of another system.

    Examples
    --------
    >>> basins = saltus.basins_of_attraction(system, window=((-1, 1), (-1, 1)), points=5)
    >>> np.unique(basins.label)
    array([1], dtype=int16)
    """
    clock = with_clock(system)
    grid = _grid(clock, velocity, relays, coordinates, found, window, points)
    progress(0.0, "attractors")
    if found is None:
        found = find_attractors(
            system, window=_around(clock, grid), tol=tol, progress=part_of(progress, 0.0, 0.1)
        )
    labelling = Labelling(clock, found.targets, periods, within, tol)
    where = {"store": store, "workers": workers, "scheduler": scheduler}
    label, time = computed_cells(
        system, labelling, grid, int(rows), part_of(progress, 0.1, 0.9), **where
    )
    found = _with_new(found, labelling, grid, label, time)
    data = _dataset(found, grid, label, time, {"periods": periods, "within": within, "tol": tol})
    if curves:
        data = data.assign(_curves(found, replace(labelling, targets=found.targets), grid, label))
    progress(1.0, "basins")
    return data


def _with_new(
    found: Attractors, labelling: Labelling, grid: Grid, label: np.ndarray, time: np.ndarray
) -> Attractors:
    """The attractors with those to which only cells of the grid lead; `label` and `time` of these
    cells are filled in.
    """
    members = list(found.members)
    reasons = list(found.reasons)
    seen = np.zeros(label.shape, dtype=bool)
    for _ in range(SETTINGS.rounds):
        rows, columns = np.nonzero((label == UNDECIDED) & ~seen)
        if not rows.size:
            break
        states = grid.states_over(grid.horizontal[columns], grid.vertical[rows])
        chosen = np.linspace(0, rows.size - 1, min(SETTINGS.new_states, rows.size)).astype(int)
        seen[rows[chosen], columns[chosen]] = True
        more = find_attractors(found.system, starts=1, also=states[chosen], tol=labelling.tol)
        new = [
            member
            for member in more
            if not any(_same(member.target, known.target) for known in members)
        ]
        reasons = list(dict.fromkeys([*reasons, *more.reasons]))
        if not new:
            continue
        fresh = _relabelled(new, [member.label for member in members])
        members += fresh
        further = replace(labelling, targets=tuple(member.target for member in fresh))
        label[rows, columns], time[rows, columns] = further.of(states)
    members.sort(key=lambda member: member.label)
    return replace(found, members=tuple(members), reasons=tuple(reasons))


def _curves(
    found: Attractors, labelling: Labelling, grid: Grid, label: np.ndarray
) -> dict[str, Any]:
    """The curves at which basins meet, as variables."""
    points = basin_boundaries(
        found, lambda states: labelling.of(states)[0], label, grid.horizontal, grid.vertical
    )
    text = "of the stable manifolds between basins, nan between curves"
    units = state_units(found.system)
    return {
        f"boundary_{key}": variable("boundary_point", points[:, i], units[key], f"{key} {text}")
        for i, key in enumerate(grid.plane)
    }


def _check_curves(system: System, grid: Grid) -> None:
    """Refuse, before cells are computed, grids and systems without curves: a grid that is a line,
    irreversible impacts.
    """
    check_system(system, "the curves between basins", coordinates=1)
    for name, values in zip(grid.plane, (grid.horizontal, grid.vertical), strict=True):
        if len(values) < 2:
            raise ParameterError(
                f"{name} must be at least two numbers where the curves between basins are"
                " asked for",
                name,
            )
    reversed_system(system)


def _same(one: Target, other: Target) -> bool:
    """Whether two attractors are one."""
    if one.kind != other.kind:
        return False
    apart = other.distance(one.states)
    if other.dense:
        return bool(np.median(apart) < other.grain)
    return bool(apart.max() < 10.0 * SAME_STATE * (1.0 + one.size(one.states).max()))


def _relabelled(new: list[Attractor], known: list[int]) -> list[Attractor]:
    """New attractors with labels after the known ones, without shares, as these would be of a few
    states only.

    A state of rest gets the label of rest if no known one has it: models with several contacts may
    have several states of rest.
    """
    first = 1 + max(known, default=REST)
    label_of = {member.label: first + i for i, member in enumerate(new)}
    if REST in label_of and REST not in known:
        label_of[REST] = REST
    return [member.labelled(label_of, starts=0, of=0) for member in new]


def _around(system: System, grid: Grid) -> Window:
    """The smallest window around the contact that contains a grid; with the default bounds for
    variables that are held fixed.
    """
    area = check_window(None, system)
    bounds = [list(pair) for pair in area]
    names = list(grid.fixed)
    for name, values in zip(grid.plane, (grid.horizontal, grid.vertical), strict=True):
        i = names.index(name)
        middle = area.centre[i]
        wide = float(max(np.abs(values - middle).max(), SETTINGS.narrowest * area.half[i]))
        bounds[i] = [middle - wide, middle + wide]
    return check_window(bounds, system)


def _grid(
    system: System,
    velocity: Any,
    relays: Any,
    coordinates: Mapping[str, Any],
    found: Attractors | None,
    window: Any,
    points: int,
) -> Grid:
    """The plane of the initial states, with the sides of relays behind them."""
    grid = _plane(system, velocity, coordinates, found, window, points)
    known = [relay.name for relay in system.model.relays]
    if relays is not None:
        check_relays(system, relays)
    for name in known:
        if (relays or {}).get(name) not in (True, False):
            raise ParameterError(
                f"a picture of basins has the relay {name!r} on one side between its thresholds:"
                f" give relays={{{name!r}: True}}, or False",
                "relays",
            )
    sides = {side_name(name): 1.0 if relays[name] else -1.0 for name in known}
    return replace(grid, fixed=grid.fixed | sides)


def _plane(
    system: System,
    velocity: Any,
    coordinates: Mapping[str, Any],
    found: Attractors | None,
    window: Any,
    points: int,
) -> Grid:
    """The plane of the initial states."""
    names = state_names(system.model.coordinates)
    known_names = {*names, *system.model.coordinates}
    given = {n: v for n, v in coordinates.items() if v is not None or n not in known_names}
    if velocity is not None:
        given["velocity"] = velocity
    # the velocities of the last ones follow from the state
    chosen = names[: len(names) - len(system.model.first_order)]
    if len(chosen) < 2:
        raise ParameterError(
            f"{type(system.model).__name__} has the state variable {chosen[0]} alone, and a plane"
            " has two",
            "system",
        )
    for name in given:
        if name not in chosen:
            known = ", ".join(f"{each}=..." for each in chosen)
            kind = "coordinate" if len(names) == 2 else "state variable"
            like = near(name, [*chosen, *ARGUMENTS])
            hint = like if like.startswith("did you mean") else f"give {known}"
            raise ParameterError(
                f"{type(system.model).__name__} has no {kind} {name!r}; {hint}", name
            )
    if window is not None:
        return _grid_of_window(system, window, points, names, chosen, given)
    fixed = dict(zip(names, map(float, rest_state(system)), strict=True))
    varied = (
        [name for name in names if name in given and np.ndim(given[name]) > 0]
        if len(names) > 2
        else list(names)
    )
    if len(varied) not in (0, 2):
        raise ParameterError(
            f"two state variables of {', '.join(names)} are given as lists and the others as"
            f" numbers, got lists of {', '.join(varied)}",
            varied[0],
        )
    x, y = varied or state_plane(system)
    for name in set(given) - {x, y}:
        check_number(name, given[name])
        fixed[name] = float(given[name])
    box = check_window(None if found is None else found.window, system)
    along, up = (
        check_axis(n, given[n] if n in given else _over(system, box, names.index(n), points))
        for n in (x, y)
    )
    return Grid((x, y), along, up, fixed)


def _grid_of_window(
    system: System,
    window: Any,
    points: int,
    names: tuple[str, ...],
    chosen: tuple[str, ...],
    given: Mapping[str, Any],
) -> Grid:
    """The plane of a window: two state variables go over their bounds."""
    if given:
        name = next(iter(given))
        raise ParameterError(
            f"give window=... with points=..., or the values of the grid themselves ({name}=...),"
            " not both",
            "window",
        )
    bounds = dict(zip(names, check_window(window, system), strict=True))
    varied = [name for name in chosen if bounds[name][0] < bounds[name][1]]
    if len(varied) != 2:
        raise ParameterError(
            f"window must have two different bounds for two of {', '.join(chosen)}, and equal ones"
            f" for the others, got different ones for {', '.join(varied) or 'none'}",
            "window",
        )
    axes = []
    for name in varied:
        values = np.linspace(*bounds[name], points)
        reached = name not in system.model.coordinates or system.model.reaches(name, values)
        axes.append(values[reached] if np.ndim(reached) else values)
    fixed = {name: float(low) for name, (low, _) in bounds.items()}
    return Grid((varied[0], varied[1]), axes[0], axes[1], fixed)


def _over(system: System, window: Window, place: int, points: int) -> np.ndarray:
    """Evenly spaced values of a state variable over a window, without those beyond a contact."""
    values = window.centre[place] + window.half[place] * np.linspace(-1.0, 1.0, points)
    names = system.model.coordinates
    return np.asarray(
        values[system.model.reaches(names[place], values)] if place < len(names) else values
    )


def _dataset(
    found: Attractors, grid: Grid, label: np.ndarray, time: np.ndarray, numbers: dict[str, Any]
) -> xarray.Dataset:
    import xarray

    x, y = grid.plane
    units = state_units(found.system)
    share = [float((label == member.label).mean()) for member in found]
    period = with_clock(found.system).load.period or math.nan
    variables: dict[str, Any] = attractor_table(found.members, found.system)
    variables |= {
        "label": variable(
            (y, x), label, "1", "attractor on which the motion ends, -1 for undecided"
        ),
        "time": variable(
            (y, x), time, f"2 pi / Omega = {period:.9g}", "forcing periods to reach the attractor"
        ),
        "cells": variable("attractor", np.array(share), "1", "share of the grid"),
    }
    axes = {
        y: variable(y, grid.vertical, units[y], f"{y} at phase 0"),
        x: variable(x, grid.horizontal, units[x], f"{x} at phase 0"),
        "attractor": labels(found.members),
    }
    undecided = float((label == UNDECIDED).mean())
    held = {f"held_{name}": value for name, value in grid.fixed.items() if name not in grid.plane}
    attributes = about(
        found.system,
        "basins",
        **numbers,
        plane=[x, y],
        **held,
        reasons=list(found.reasons),
        undecided=undecided,
    )
    return xarray.Dataset(variables, axes, attributes)
