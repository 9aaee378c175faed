"""Response spectra and bifurcation diagrams: every periodic orbit that a simulation finds, followed along one parameter."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from saltus.checks import Rectangle, check_bounds, check_count, check_kind, check_step, check_window
from saltus.errors import ParameterError
from saltus.orbits import STEP
from saltus.progress import Progress, part_of, silent
from saltus.public_functions import checked_by
from saltus.studies.checks import check_diagram
from saltus.studies.diagram.branch_set import BranchSet
from saltus.studies.diagram.diagram_dataset import diagram_tree
from saltus.studies.diagram.diagram_search import DiagramSearch
from saltus.studies.diagram.effort import EFFORTS, read_effort
from saltus.systems import System

if TYPE_CHECKING:
    import xarray


@dataclass(frozen=True)
class WorkShares:
    """The share of the work that is done after each part."""

    search: float = 0.2
    branches: float = 0.6
    bands: float = 0.9


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
    progress: object,
    **counts: int,
) -> None:
    bounds = check_diagram(system, path, bounds, **counts)
    read_effort(effort)
    if starts is not None:
        check_count("starts", starts, 1)
    check_step(step)
    for name, answer in (("switch", switch), ("bands", bands)):
        check_kind(name, answer, bool)
    _values(bounds, values, 1)
    check_window(window, system)
    if not callable(progress):
        raise ParameterError(
            f"progress must be a function of the fraction done and of what is being done, got {progress!r}", "progress"
        )


@checked_by(_check)
def bifurcation_diagram(
    system: System,
    path: str = "load.horizontal.amplitude",
    bounds: tuple[float, float] = (0.0, 3.0),
    *,
    effort: str = "standard",
    max_period: int = 6,
    values: Iterable[float] | None = None,
    starts: int | None = None,
    window: Rectangle | None = None,
    seed: int = 0,
    repelling: int = 1,
    switch: bool = True,
    step: float = STEP,
    bands: bool = True,
    progress: Progress = silent,
) -> xarray.DataTree:
    """All branches of periodic orbits along a parameter that a simulation finds, and bands of chaos (Figs. 11 to 13).

    One simulation is used for everything, from states spread over a window at many values of the parameter, and from the motions
    of neighbouring values until nothing new is found. What settles is followed unless a branch goes through it; what does not is
    judged to be chaotic, or left undecided. Then random motions say what share of the states ends on something that the diagram
    does not have; what they show is followed as well. Orbits of up to `repelling` forcing periods that repel, and what is born at
    every PD and BPC, are followed besides, those of more than one forcing period beyond the bounds, to where they close or end.
    Every orbit is confirmed by the event-driven flow over a period, the stable ones over 20.

    Args:
        system: what moves.
        path, bounds: dotted path of the parameter, and its range.
        effort: how much is tried, see `Effort`: "quick", "standard" or "thorough".
        max_period: the longest period, in forcing periods, that is followed.
        values: where is simulated, by default evenly, as many as the effort says. If given, what is random is not followed.
        starts, window, seed: how many initial states at each value, by default as the effort says, where, and their seed.
        repelling, switch: up to which period repelling orbits are searched for; whether what is born at special points is.
        step, bands: the longest step along a branch; whether chaos is looked for.
        progress: called with the fraction done and what is being done.

    Returns:
        A DataTree: the branches in `branches`, `points`, `special` and `orbits` (`branch_of` gives one), `attractors`,
        `unplaced`, `bands`, `exponents`, `stroboscopic` and `search`; docs/orbits.md lists their variables and attributes.

    Raises:
        ParameterError: an argument without meaning.
    """
    low, high = check_bounds(bounds)
    tried = EFFORTS[read_effort(effort)]
    tried = replace(tried, starts=tried.starts if starts is None else starts, samples=tried.samples if values is None else 1)
    grid, area = _values((low, high), values, tried.values), check_window(window, system)
    branches = BranchSet(path, (low, high), max_period, step, switch, tried.branches)
    search = DiagramSearch(system.with_({path: 0.5 * (low + high)}), path, (low, high), grid, area, seed, tried, branches)
    progress(0.0, "searching")
    search.simulate(part_of(progress, 0.0, SHARES.search, "searching"))
    _follow(search, repelling, part_of(progress, SHARES.search, SHARES.branches))
    if bands:
        search.look_for_chaos(part_of(progress, SHARES.branches, SHARES.bands, "looking for chaos"))
    search.estimate(follow=values is None)
    progress(SHARES.bands, "confirming")
    tree = diagram_tree(search, effort=str(read_effort(effort)), max_period=max_period)
    progress(1.0, "done")
    return tree


def _follow(search: DiagramSearch, repelling: int, progress: Progress) -> None:
    """Follow what the simulation shows, what repels, what is born on these, and what motions from neighbouring values add."""
    search.follow(progress)
    search.repel(repelling)
    search.branches.grow(progress)
    search.carry_on(progress)


@checked_by(bifurcation_diagram.check)
def response_spectrum(
    system: System, path: str = "load.frequency", bounds: tuple[float, float] = (0.1, 3.0), **options: Any
) -> xarray.DataTree:
    """`bifurcation_diagram` along the forcing frequency, with the same options (the paper's Figs. 9 and 10)."""
    return bifurcation_diagram(system, path, bounds, **options)


def _values(bounds: tuple[float, float], values: Iterable[float] | None, count: int) -> np.ndarray:
    """The values at which motions are simulated, in order: those given, all within the bounds, or so many from bound to bound."""
    if values is None:
        return np.linspace(*bounds, count)
    try:
        grid = np.array([float(value) for value in values])
    except (TypeError, ValueError):
        grid = np.empty(0)
    if not grid.size:
        raise ParameterError(f"values must be numbers at which to search, got {values!r}", "values")
    outside = grid[~((grid >= bounds[0]) & (grid <= bounds[1]))]
    if outside.size:
        raise ParameterError(
            f"values must lie within the bounds {bounds}, got {outside[0]:g}; widen the bounds or leave it out", "values"
        )
    return np.unique(grid)
