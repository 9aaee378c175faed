"""Response spectra and bifurcation diagrams: every periodic orbit that a search finds, followed along one parameter."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from saltus.checks import Rectangle, check_bounds, check_number, check_window, checked_by
from saltus.errors import ParameterError
from saltus.orbits import STEP, search_orbits
from saltus.progress import Progress, part_of, silent
from saltus.studies.checks import check_diagram
from saltus.studies.diagram.branch_set import BranchSet
from saltus.studies.diagram.chaos_search import chaotic_bands
from saltus.studies.diagram.diagram_dataset import diagram_tree
from saltus.systems import System

if TYPE_CHECKING:
    import xarray

SEARCHED_VALUES = 25  # number of values of the parameter at which orbits are searched for, where none is given


@dataclass(frozen=True)
class WorkShares:
    """The share of the work that is done after each part."""

    search: float = 0.3
    branches: float = 0.7
    bands: float = 0.9


SHARES = WorkShares()


def _check(
    system: System, path: str, bounds: Any, values: Any, window: Any, step: float, switch: bool, progress: object, **efforts: int
) -> None:
    bounds = check_diagram(system, path, bounds, **efforts)
    check_number("step", step, above=0.0)
    _values(bounds, values)
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
    max_period: int = 6,
    values: Iterable[float] | None = None,
    starts: int = 48,
    window: Rectangle | None = None,
    seed: int = 0,
    repelling: int = 1,
    switch: bool = True,
    step: float = STEP,
    bands: int = 121,
    progress: Progress = silent,
) -> xarray.DataTree:
    """All branches of periodic orbits along a parameter that a search finds, and bands of chaos (the paper's Figs. 11 to 13).

    At each of `values` motions from `starts` states settle; every orbit on which they do, and those of up to `repelling` forcing
    periods that repel, is followed along the parameter unless a branch goes through it already. At every PD and BPC the new
    branch is followed too. Families of more than one forcing period are followed beyond the bounds, to where they close or end.
    Every orbit is confirmed by the event-driven flow over a period, the stable ones over 20.

    Args:
        system: what moves.
        path, bounds: dotted path of the parameter, and its range.
        max_period: the longest period, in forcing periods.
        values, starts, window, seed: where is searched, see `search_orbits`; by default 25 values within the bounds.
        repelling: up to which period repelling orbits are searched for.
        switch: whether branches are followed that are born at special points.
        step: the longest step along a branch.
        bands: at how many values, from the first to the last, chaos is looked for (0: nowhere), see `chaotic_bands`.
        progress: called with the fraction done and what is being done.

    Returns:
        A DataTree: `branch_000`, ..., `attractors` (what simulation settled on), `bands`, `exponents` and `stroboscopic` (see
        `Bands`), and `search`; docs/orbits.md lists their variables. The attribute `left` counts the special points at which a
        family is born that was not followed, see `BranchSettings`.

    Raises:
        ParameterError: an argument without meaning.
    """
    low, high = check_bounds(bounds)
    where: dict[str, Any] = {"window": window, "seed": seed}
    effort: dict[str, Any] = {"max_period": max_period, "starts": starts, "repelling": repelling, **where}
    progress(0.0, "searching")
    searching = part_of(progress, 0.0, SHARES.search)
    grid, middle = _values((low, high), values), system.with_({path: 0.5 * (low + high)})
    found = search_orbits(middle, path, grid, **effort, progress=searching)
    branches = BranchSet(path, (low, high), max_period, step, switch)
    following = part_of(progress, SHARES.search, SHARES.branches)
    branches.fill(sorted(found.orbits, key=lambda orbit: (orbit.period, not orbit.stable)), following)
    looking = part_of(progress, SHARES.branches, SHARES.bands)
    chaos = chaotic_bands(system, path, (low, high), count=bands, **where, progress=looking) if bands else None
    progress(SHARES.bands, "confirming")
    tree = diagram_tree(system, branches.branches, found, (low, high), chaos, max_period=max_period, left=branches.left)
    progress(1.0, "done")
    return tree


@checked_by(bifurcation_diagram.check)
def response_spectrum(
    system: System, path: str = "load.frequency", bounds: tuple[float, float] = (0.1, 3.0), **options: Any
) -> xarray.DataTree:
    """`bifurcation_diagram` along the forcing frequency, with the same options (the paper's Figs. 9 and 10)."""
    return bifurcation_diagram(system, path, bounds, **options)


def _values(bounds: tuple[float, float], values: Iterable[float] | None) -> np.ndarray:
    """The values at which orbits are searched for: those given, all within the bounds, or 25 spread evenly between them."""
    if values is None:
        return np.linspace(*bounds, SEARCHED_VALUES + 2)[1:-1]
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
    return grid
