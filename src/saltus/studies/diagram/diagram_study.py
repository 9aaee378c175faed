"""Response spectra and bifurcation diagrams: every periodic orbit that a simulation finds, followed
along one parameter.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from saltus.branch_tables import branch_tables
from saltus.checks import as_numbers, check_bounds, check_count, check_step, checked_by
from saltus.errors import ParameterError, shown
from saltus.flow import (
    Functions,
    Quantity,
    check_device,
    check_new_names,
    on_device,
    own_quantities,
    state_names,
    unit_of,
)
from saltus.orbits import STEP, Branch, PeriodicOrbit, closing_rows
from saltus.progress import Progress, growing, part_of, silent
from saltus.result import provenance
from saltus.studies.diagram.bands import band_dataset, explained
from saltus.studies.diagram.branch_set import BranchSet
from saltus.studies.diagram.diagram_search import DiagramSearch
from saltus.studies.diagram.diagram_work import DiagramWork, diagram_plan, diagram_work
from saltus.studies.diagram.effort import CHAOS, EFFORTS, check_diagram, read_effort
from saltus.studies.diagram.simulated import BranchAssignment
from saltus.studies.motion_quantities import quantities_of_motions
from saltus.systems import Box, System, check_window, driven_displacements
from saltus.theory import amplitude_limits

if TYPE_CHECKING:
    import xarray


@dataclass(frozen=True)
class ConfirmationSettings:
    """What direct simulation must show of an orbit."""

    # A stable orbit must come back to itself within this distance, in natural units ...
    distance: float = 1e-8
    rounds: int = 20  # ... after this number of its periods.


CONFIRMATION = ConfirmationSettings()


def diagram_tree(
    search: DiagramSearch, functions: Functions | None = None, **facts: Any
) -> xarray.DataTree:
    """The DataTree that `bifurcation_diagram` returns; `facts` are further attributes."""
    import xarray

    from saltus.result_tree import ResultTree

    system = search.system
    path = search.path
    bounds = search.bounds
    branches = search.branches.branches
    low, high = search.missed.interval
    attributes = provenance(
        system,
        seed=search.seed,
        path=path,
        coordinate=" ".join(system.model.coordinates),
        shown=" ".join(driven_displacements(system)),
        bounds=list(bounds),
        limits=_limits(system, path, bounds),
        window=np.ravel(search.window).tolist(),
        left=search.branches.left,
        **facts,
        **_effort(search) | {"values": len(search.grid), "motions": len(search.found.motions)},
        missed_share=search.missed.share,
        missed_low=low,
        missed_high=high,
        ended_share=search.missed.ended_share,
        missed=search.missed.missed,
        samples_tried=search.missed.samples,
    )
    order = sorted(
        range(len(branches)),
        key=lambda i: (branches[i].points[0].orbit.period, -len(branches[i].points)),
    )
    nodes = {
        "/": xarray.Dataset(attrs=attributes),
        **branch_tables(confirmed([branches[i] for i in order], search.work, functions)),
    }
    chaos = search.chaos
    bands = (
        {"bands": band_dataset()}
        if chaos is None
        else explained(system, chaos, branches).to_datasets()
    )
    own = own_quantities(system, functions)
    found = {"attractors": _attractors(search, own), "unplaced": _unplaced(search, own)}
    return ResultTree.from_dict({**nodes, **found, **bands, "search": _searched(search)})


def _effort(search: DiagramSearch) -> dict[str, Any]:
    """How much was tried, as attributes; of the search for chaos only the shares of the range down
    to which it halved.
    """
    tried = asdict(search.effort)
    chaos = search.effort.chaos
    del tried["chaos"]
    return tried | {"chaos_step": chaos.step, "chaos_edge": chaos.edge}


def _limits(system: System, path: str, bounds: tuple[float, float]) -> list[float]:
    """The amplitudes that motions of the mechanism cannot exceed, rad; none if they vary with the
    parameter of the diagram.
    """
    low, high = (
        [float(limit.value) for limit in amplitude_limits(system, {path: value})]
        for value in bounds
    )
    return low if low == high else []


def confirmed(
    branches: list[Branch], work: DiagramWork, functions: Functions | None = None
) -> list[xarray.Dataset]:
    """The datasets of branches, with the distance by which simulated orbits miss themselves:
    `defect` after one period, `kept` after 20 periods, for stable orbits.

    An orbit with stable multipliers whose motion does not stay on it is not called stable;
    `unconfirmed` counts these.
    """
    found = [branch.to_xarray(functions) for branch in branches]
    ends = np.cumsum([0, *(len(branch.orbits) for branch in branches)])
    orbits = [orbit for branch in branches for orbit in branch.orbits]
    stable = np.flatnonzero(
        np.concatenate([np.zeros(0), *(data["stable"].values for data in found)])
    )
    defect = _distances(orbits, 1, work)
    kept = np.full(len(orbits), np.nan)
    kept[stable] = _distances([orbits[i] for i in stable], CONFIRMATION.rounds, work)
    for data, first, last in zip(found, ends, ends[1:], strict=False):
        here = kept[first:last]
        lost = np.isfinite(here) & ~(here < CONFIRMATION.distance)
        lost |= (data["stable"].values > 0) & ~np.isfinite(here)
        data["stable"][lost] = 0
        data.attrs["unconfirmed"] = int(lost.sum())
        data["defect"] = (
            "point",
            defect[first:last],
            {"long_name": "distance after one period, by the event-driven flow"},
        )
        data["kept"] = (
            "point",
            here,
            {"long_name": f"distance after {CONFIRMATION.rounds} periods, where stable"},
        )
    return found


def _distances(orbits: list[PeriodicOrbit], rounds: int, work: DiagramWork) -> np.ndarray:
    """The distance of each orbit from itself after `rounds` of its periods, by the event-driven
    flow, all orbits in lanes.
    """
    return work.distances(closing_rows(orbits, rounds)) if orbits else np.empty(0)


def _attractors(search: DiagramSearch, own: Sequence[Quantity]) -> xarray.Dataset:
    """The attractors on which motions settled at the values of the grid, a dot each, without those
    of long periods that are not followed."""
    found = search.found
    left = np.isin(found.assignment[found.rows], (BranchAssignment.LONGER, BranchAssignment.RARE))
    shown = np.isin(found.motions.value[found.rows], search.grid) & ~left
    data = _dots(search, found.rows[shown], own)
    data["starts"] = (
        "dot",
        found.starts[shown],
        {"long_name": "motions of the simulation that have settled on it"},
    )
    data["placed"] = (
        "dot",
        (found.assignment[found.rows[shown]] == BranchAssignment.ON_BRANCH).astype(np.int8),
    )
    data["placed"].attrs["long_name"] = "whether it lies on a stable part of a branch"
    return data


def _unplaced(search: DiagramSearch, own: Sequence[Quantity]) -> xarray.Dataset:
    """The attractors that lie on no branch, at all values, with the reason."""
    rows = search.found.unplaced
    data = _dots(search, rows, own)
    places = search.found.assignment[rows]
    data["reason"] = (
        "dot",
        np.array([BranchAssignment(place).name.lower() for place in places], dtype="U16"),
    )
    data["reason"].attrs = {place.name.lower(): str(place) for place in BranchAssignment}
    return data


def _dots(search: DiagramSearch, rows: np.ndarray, own: Sequence[Quantity]) -> xarray.Dataset:
    """Simulated motions that repeat themselves."""
    import xarray

    motions = search.found.motions.only(rows)
    model = search.system.model
    angle = {"units": unit_of(search.system, driven_displacements(search.system)[0])}
    columns: dict[str, tuple[np.ndarray, dict[str, str]]] = {
        "parameter": (motions.value, {"long_name": search.path}),
        "amplitude": (motions.amplitude, angle),
        "highest": (motions.highest, angle),
        "lowest": (motions.lowest, angle),
        "period": (motions.period, {"long_name": "forcing periods after which it repeats"}),
        "impact_count": (motions.impact_count, {"long_name": "impacts in them"}),
    }
    if model.names_its_contacts:
        columns["slowest"] = (
            motions.slowest,
            angle | {"long_name": "least speed of an impact, 0 without impacts"},
        )
    check_new_names(own, (*columns, *state_names(model.coordinates)))
    values = {search.path: motions.value}
    columns |= quantities_of_motions(search.system, values, motions.last, motions.period, own)
    for i, name in enumerate(state_names(model.coordinates)):
        columns[name] = motions.last[:, i], angle | {"long_name": f"{name} at phase 0"}
    return xarray.Dataset({name: ("dot", *column) for name, column in columns.items()})


def _searched(search: DiagramSearch) -> xarray.Dataset:
    """The values of the grid, and how many of the motions from the starts there settled on no
    periodic orbit, and why.
    """
    import xarray

    first = search.found.motions.only(slice(0, len(search.grid) * search.effort.starts))
    outcomes = (first.unsettled, first.at_rest, first.ended)
    unsettled, at_rest, ended = (
        which.reshape(len(search.grid), -1).sum(axis=1) for which in outcomes
    )
    columns = {
        "unsettled": (
            "searched",
            unsettled,
            {"long_name": "motions that did not settle: slow, of a long period, or chaotic"},
        ),
        "at_rest": ("searched", at_rest, {"long_name": "motions that came to rest"}),
        "ended": ("searched", ended, {"long_name": "motions that a limit of the model ended"}),
    }
    return xarray.Dataset(
        columns, coords={"searched": ("searched", search.grid, {"long_name": search.path})}
    )


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
    device: Any,
    functions: Any,
    progress: object,
    **counts: int,
) -> None:
    own_quantities(system, functions)
    check_device(device, system, workers, scheduler)
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
@on_device
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
    device: str = "cpu",
    functions: Functions | None = None,
    progress: Progress = silent,
) -> xarray.DataTree:
    """All branches of periodic orbits along a parameter that a simulation finds, and bands of chaos
    (Figs. 11 to 13).

    Motions are simulated from states spread over a window at many values of the parameter, then
    from the motions at neighbouring values, until nothing new is found. The orbits on which they
    settle are followed, unless a branch goes through them already; motions that do not settle are
    judged by `judge`. Unstable orbits of up to `repelling` forcing periods, and the families that
    are born at every PD and BPC, are followed as well; families of more than one forcing period
    also above the upper bound, where many of them close. At last random motions estimate the share
    of the states that end on something that the diagram lacks, and the orbits on which they settle
    are followed too. Every orbit is confirmed by the event-driven flow over a period, stable ones
    over 20.

    Parameters
    ----------
    system
        What moves.
    path, bounds, effort
        Dotted path of the parameter, its range, and how much is tried, see `Effort`.
    max_period
        The longest period of orbits that are followed, in forcing periods. Orbits of more than 6
        are followed only if random motions end on them, and only while they are stable.
    values
        Values at which motions are simulated; by default evenly spaced, as many as the effort says.
        If they are given, the orbits on which random motions settle are not followed.
    starts, window, seed
        How many initial states there are at each value, by default as the effort says; the window
        in which they lie; their seed.
    repelling, switch
        The longest period of repelling orbits that are searched for; whether the families born at
        special points are followed.
    step, bands
        The longest step along a branch; whether chaos is looked for.
    store
        Folder in which all that takes long is kept, so that a search that was stopped goes on, and
        one with more values or starts computes only what is new.
    functions
        Further quantities of the motions by name, as `frequency_sweep` takes them: columns of
        `points`, `special`, `attractors` and `unplaced`.
    workers, scheduler, device, progress
        Who computes, where motions are followed (as for `simulate_many`), and how progress is
        reported, see `saltus.sweep.run`.

    Returns
    -------
    xarray.DataTree
        A DataTree: the branches in `branches`, `points`, `special` and `orbits` (`branch_of` gives
        one), `attractors`, `unplaced`, `bands`, `exponents`, `stroboscopic` and `search`;
        docs/spectra.md lists their variables and attributes.

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
    tried = replace(
        tried,
        starts=tried.starts if starts is None else starts,
        samples=tried.samples if values is None else 1,
    )
    grid = _values((low, high), values, tried.values)
    area = check_window(window, system)
    progress = growing(progress)
    progress(0.0, "searching")
    plan = diagram_plan(system, path, (low, high), area, seed)
    middle = system.with_({path: 0.5 * (low + high)})
    with diagram_work(
        middle, path, plan, None if store is None else Path(store), workers, scheduler
    ) as work:
        branches = BranchSet(
            work, (low, high), min(max_period, CHAOS.long_period), step, switch, tried.branches
        )
        search = DiagramSearch(work, (low, high), grid, area, seed, tried, branches, max_period)
        _search(search, repelling, bands, values is None, progress)
        tree = diagram_tree(
            search,
            functions,
            kind="bifurcation_diagram",
            effort=str(read_effort(effort)),
            max_period=max_period,
        )
    progress(1.0, "done")
    return tree


def _search(
    search: DiagramSearch, repelling: int, bands: bool, follow: bool, progress: Progress
) -> None:
    """Simulate; follow the orbits that this shows, and look for chaos; see what random motions end
    on, and `follow` it.
    """
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
    device: str = "cpu",
    functions: Functions | None = None,
    progress: Progress = silent,
) -> xarray.DataTree:
    """`bifurcation_diagram` along the forcing frequency (the paper's Figs. 9 and 10).

    Parameters
    ----------
    system
        What moves, under a load with a frequency.
    path, bounds
        The dotted path of the frequency, its lowest and its highest value.
    effort, max_period, values, starts, window, seed, repelling, switch, step, bands
        As for `bifurcation_diagram`.
    store, workers, scheduler, device, functions, progress
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
        device=device,
        functions=functions,
        progress=progress,
    )
    tree.attrs["kind"] = "response_spectrum"
    return tree


def _values(bounds: tuple[float, float], values: Iterable[float] | None, count: int) -> np.ndarray:
    """The values at which motions are simulated, in order: those given, or `count` values from
    bound to bound.
    """
    if values is None:
        return np.linspace(*bounds, count)
    grid = as_numbers(values, "values")
    if grid.ndim != 1 or not grid.size:
        raise ParameterError(
            f"values must be numbers at which to search, got {shown(values)}", "values"
        )
    outside = grid[~((grid >= bounds[0]) & (grid <= bounds[1]))]
    if outside.size:
        raise ParameterError(
            f"values must lie within the bounds {bounds}, got {outside[0]:g}; widen the bounds "
            "or leave it out",
            "values",
        )
    return np.unique(grid)
