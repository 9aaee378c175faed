"""Response spectra and bifurcation diagrams: every periodic orbit that a simulation finds, followed along one parameter."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from saltus.checks import as_numbers, check_bounds, check_count, check_step
from saltus.errors import ParameterError, shown
from saltus.orbits import STEP
from saltus.progress import Progress, growing, part_of, silent
from saltus.public_functions import checked_by
from saltus.studies.checks import check_diagram
from saltus.studies.diagram.attractors_found import LONG
from saltus.studies.diagram.branch_set import BranchSet
from saltus.studies.diagram.diagram_dataset import diagram_tree
from saltus.studies.diagram.diagram_search import DiagramSearch
from saltus.studies.diagram.diagram_work import diagram_plan, diagram_work
from saltus.studies.diagram.effort import EFFORTS, read_effort
from saltus.systems import System
from saltus.window import Box, check_window

if TYPE_CHECKING:
    import xarray


@dataclass(frozen=True)
class WorkShares:
    """The share of the whole work that is done once each of its parts is."""

    simulation: float = 0.05
    search: float = 0.7
    estimate: float = 0.9


SHARES = WorkShares()


def _check(
    system: System,
    path: str,
    bounds: Any,
    effort: Any,
    values: Any,
    starts: Any,
    window: Any,
    switch: bool,
    step: float,
    bands: bool,
    store: Path | str | None,
    workers: int | None,
    scheduler: str | None,
    progress: object,
    **counts: int,
) -> None:
    bounds = check_diagram(system, path, bounds, **counts)
    read_effort(effort)
    if starts is not None:
        check_count("starts", starts, 1)
    check_step(step)
    _values(bounds, values, 1)
    area = check_window(window, system)
    from saltus.sweep import check_run, check_store

    place = check_run(store, workers, scheduler, progress)
    if place is not None:
        check_store(diagram_plan(system, path, bounds, area, counts["seed"]), place)


@checked_by(_check)
def bifurcation_diagram(
    system: System,
    path: str = "load.horizontal.amplitude",
    bounds: tuple[float, float] = (0.0, 3.0),
    *,
    effort: str = "standard",
    max_period: int = 16,
    values: Iterable[float] | None = None,
    starts: int | None = None,
    window: Box | None = None,
    seed: int = 0,
    repelling: int = 1,
    switch: bool = True,
    step: float = STEP,
    bands: bool = True,
    store: Path | str | None = None,
    workers: int | None = None,
    scheduler: str | None = None,
    progress: Progress = silent,
) -> xarray.DataTree:
    """All branches of periodic orbits along a parameter that a simulation finds, and bands of chaos (Figs. 11 to 13).

    Motions are simulated from states spread over a window at many values of the parameter, then from the motions at neighbouring
    values, until nothing new is found. The orbits on which they settle are followed, unless a branch goes through them already;
    motions that do not settle are judged by `judge`. Unstable orbits of up to `repelling` forcing periods, and the
    families that are born at every PD and BPC, are followed as well; families of more than one forcing period also above the
    upper bound, where many of them close. At last random motions estimate the share of the states that end on something that the
    diagram lacks, and the orbits on which they settle are followed too. Every orbit is confirmed by the event-driven flow over a
    period, stable ones over 20.

    Parameters
    ----------
    system
        What moves.
    path, bounds, effort
        Dotted path of the parameter, its range, and how much is tried, see `Effort`.
    max_period
        The longest period of orbits that are followed, in forcing periods. Orbits of more than 6 are followed only if random
        motions end on them, and only while they are stable.
    values
        Values at which motions are simulated; by default evenly spaced, as many as the effort says. If they are given, the orbits
        on which random motions settle are not followed.
    starts, window, seed
        How many initial states there are at each value, by default as the effort says; the window in which they lie; their seed.
    repelling, switch
        The longest period of repelling orbits that are searched for; whether the families born at special points are followed.
    step, bands
        The longest step along a branch; whether chaos is looked for.
    store
        Folder in which all that takes long is kept, so that a search that was stopped goes on, and one with more values or starts
        computes only what is new.
    workers, scheduler, progress
        Who computes, and how progress is reported, see `saltus.sweep.run`.

    Returns
    -------
    xarray.DataTree
        A DataTree: the branches in `branches`, `points`, `special` and `orbits` (`branch_of` gives one), `attractors`,
        `unplaced`, `bands`, `exponents`, `stroboscopic` and `search`; docs/orbits.md lists their variables and attributes.

    Raises
    ------
    ParameterError
        An argument without meaning.
    SweepError
        As `saltus.sweep.run`.

    Examples
    --------
    >>> diagram = saltus.bifurcation_diagram(system, bounds=(0.45, 0.55), max_period=1, values=[0.5], starts=4, bands=False)
    >>> sorted(diagram.children)
    ['attractors', 'bands', 'branches', 'orbits', 'points', 'search', 'special', 'unplaced']
    """
    low, high = check_bounds(bounds)
    tried = EFFORTS[read_effort(effort)]
    tried = replace(tried, starts=tried.starts if starts is None else starts, samples=tried.samples if values is None else 1)
    grid, area = _values((low, high), values, tried.values), check_window(window, system)
    progress = growing(progress)
    progress(0.0, "searching")
    plan, middle = diagram_plan(system, path, (low, high), area, seed), system.with_({path: 0.5 * (low + high)})
    with diagram_work(middle, path, plan, None if store is None else Path(store), workers, scheduler) as work:
        branches = BranchSet(work, (low, high), min(max_period, LONG), step, switch, tried.branches)
        search = DiagramSearch(work, (low, high), grid, area, seed, tried, branches, max_period)
        _search(search, repelling, bands, values is None, progress)
        tree = diagram_tree(search, kind="bifurcation_diagram", effort=str(read_effort(effort)), max_period=max_period)
    progress(1.0, "done")
    return tree


def _search(search: DiagramSearch, repelling: int, bands: bool, follow: bool, progress: Progress) -> None:
    """Simulate; follow the orbits that this shows, and look for chaos; see what random motions end on, and `follow` it."""
    search.simulate(part_of(progress, 0.0, SHARES.simulation, "searching"))
    search.find(repelling, bands, part_of(progress, SHARES.simulation, SHARES.search))
    search.estimate(follow, part_of(progress, SHARES.search, SHARES.estimate))
    progress(SHARES.estimate, "confirming")


@checked_by(bifurcation_diagram.check)
def response_spectrum(
    system: System,
    path: str = "load.frequency",
    bounds: tuple[float, float] = (0.1, 3.0),
    *,
    effort: str = "standard",
    max_period: int = 16,
    values: Iterable[float] | None = None,
    starts: int | None = None,
    window: Box | None = None,
    seed: int = 0,
    repelling: int = 1,
    switch: bool = True,
    step: float = STEP,
    bands: bool = True,
    store: Path | str | None = None,
    workers: int | None = None,
    scheduler: str | None = None,
    progress: Progress = silent,
) -> xarray.DataTree:
    """`bifurcation_diagram` along the forcing frequency (the paper's Figs. 9 and 10).

    Parameters
    ----------
    system
        What moves, under a load with a frequency.
    path, bounds
        The dotted path of the frequency, its lowest and its highest value.
    effort, max_period, values, starts, window, seed, repelling, switch, step, bands, store, workers, scheduler, progress
        As for `bifurcation_diagram`.

    Examples
    --------
    >>> spectrum = saltus.response_spectrum(system, bounds=(0.8, 1.0), max_period=1, values=[0.9], starts=4, bands=False)
    >>> first = saltus.branch_of(spectrum, 0)
    >>> first.special_parameter.values[first.kind.values == "LP"].round(6)
    array([0.908811, 0.848485])
    """
    tree = bifurcation_diagram(
        system,
        path,
        bounds,
        effort=effort,
        max_period=max_period,
        values=values,
        starts=starts,
        window=window,
        seed=seed,
        repelling=repelling,
        switch=switch,
        step=step,
        bands=bands,
        store=store,
        workers=workers,
        scheduler=scheduler,
        progress=progress,
    )
    tree.attrs["kind"] = "response_spectrum"
    return tree


def _values(bounds: tuple[float, float], values: Iterable[float] | None, count: int) -> np.ndarray:
    """The values at which motions are simulated, in order: those given, or `count` values from bound to bound."""
    if values is None:
        return np.linspace(*bounds, count)
    grid = as_numbers(values)
    if grid.ndim != 1 or not grid.size:
        raise ParameterError(f"values must be numbers at which to search, got {shown(values)}", "values")
    outside = grid[~((grid >= bounds[0]) & (grid <= bounds[1]))]
    if outside.size:
        raise ParameterError(
            f"values must lie within the bounds {bounds}, got {outside[0]:g}; widen the bounds or leave it out", "values"
        )
    return np.unique(grid)
