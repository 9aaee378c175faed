"""Stability charts: the stable motions beside rest, in the plane of two parameters, their borders,
and checks of charts by other means."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from saltus.attractors import share_interval
from saltus.checks import answered, check_count, check_dataset, checked_by
from saltus.flow import (
    Functions,
    Quantity,
    check_device,
    check_new_names,
    on_device,
    own_quantities,
)
from saltus.progress import Progress, part_of, silent
from saltus.studies.chart.border_work import explained, special_point, unseen_folds
from saltus.studies.chart.borders import Borders, with_borders
from saltus.studies.chart.cells import computed
from saltus.studies.chart.changes import (
    COUNTS,
    ENDS,
    ChangeOutcome,
    ChartMotions,
    changes_of,
    read_chart,
)
from saltus.studies.chart.chart_request import ChartRequest
from saltus.studies.chart.motions import ALIKE, KEPT, CellOutcome, has_alike, read_motions
from saltus.studies.motion_quantities import DRIVEN, quantities_of_motions
from saltus.systems import Box, System, check_system, driven_displacements
from saltus.theory import quasi_static_border

if TYPE_CHECKING:
    import xarray

# cells by which an end may lie outside its enclosure, as motions near their end settle slowly
MARGIN = 0.02


def sampled_ends(
    system: System, paths: tuple[str, str], chart: ChartMotions, borders: Borders, count: int = 60
) -> np.ndarray:
    """For a sample of the motions that end between two cells, (n,): 1 if continuation of the orbit
    from the middle of its cell finds the special point where simulation has enclosed the end, 0 if
    elsewhere, nan if it finds none."""
    changes = changes_of(chart)
    found = borders.of(chart, changes)
    rows = np.flatnonzero(np.isin(found["outcome"], ENDS))
    chosen = (
        rows[np.unique(np.linspace(0, len(rows) - 1, min(count, len(rows))).astype(int))]
        if len(rows)
        else rows
    )
    result = np.full(len(chosen), np.nan)
    axes = (chart.horizontal, chart.vertical)
    for i, k in enumerate(chosen):
        source = changes.source[k]
        target = changes.target[k]
        motion = chart.motions[changes.motion[k]]
        along = 0 if source[0] == target[0] else 1
        axis = axes[along]
        here = source[1 - along]
        there = target[1 - along]
        place = [float(axes[n][source[1 - n]]) for n in (0, 1)]
        start = {
            "state": motion["state"],
            "period": motion["period"],
            "place": place,
            "along": along,
            "goal": axis[there],
        }
        special = special_point(system, paths, start)
        if special is not None:
            share = (special.parameter - axis[here]) / (axis[there] - axis[here])
            low = found["settled"][k] - MARGIN
            high = found["next"]["share"][k] + MARGIN
            result[i] = low <= share <= high
    return result


@answered
def disagreements(chart: xarray.Dataset, borders: Borders) -> xarray.Dataset:
    """Where chart and curves do not agree, away from the cells through which the curves run.

    Parameters
    ----------
    chart
        A chart as `stability_chart` or `with_borders` returns it.
    borders
        Its borders, as `with_borders` returns them.

    Returns
    -------
    xarray.Dataset
        A Dataset. Along `change` it has the changes for which it is not known what becomes of the
        motion, and which no curve explains: `horizontal` and `vertical` halfway between the cells,
        `amplitude` and `period` of the motion that ends, and `cells`, the number of motions in its
        family. `beside_rest` says whether the neighbour has rest alone. Along `unseen` it has the
        places on curves of folds beside which no cell has the motions that end there. Attributes:
        `changes` and `changes_beside_rest` count all changes; `located` counts those with an
        enclosed end of the motion, and `on_curves` those that a curve explains. `harmless` counts
        those where the same motion goes on, with another amplitude than expected or too small to
        count. `sampled` is the number of located ends that were also solved for by continuation,
        `sampled_agree` the number of these that lie where simulation has enclosed them.
        `chaos_beside_rest` counts pairs of neighbouring cells, one with rest alone and one with
        chaos alone, between which chaos ends but no stable motion.

    Examples
    --------
    >>> chart = saltus.stability_chart(system, horizontal=[0.2, 0.21], vertical=[-0.5, -0.49], starts=4)
    >>> chart, borders = saltus.studies.with_borders(system, chart)
    >>> saltus.studies.disagreements(chart, borders).attrs["located"]
    0
    """
    import xarray as xr

    check_dataset(
        chart,
        "stability_chart",
        ("vertical", "horizontal", "count", "amplitude"),
        ("least",),
        name="chart",
    )
    cells = read_chart(chart)
    changes = changes_of(cells)
    found = borders.of(cells, changes)
    kinds = [ChangeOutcome(outcome) for outcome in found["outcome"]]
    ends, harmless = (
        np.array([getattr(k, name) for k in kinds], dtype=bool)
        for name in ("is_end", "is_harmless")
    )
    on_curves = explained(cells, changes, borders.curves) & ~harmless
    left = changes.only(~(on_curves | ends | harmless))
    middle = (left.source + left.target) / 2
    unseen = unseen_folds(cells, borders.curves)
    columns = {
        "amplitude": cells.motions["amplitude"][left.motion],
        "period": cells.motions["period"][left.motion],
        "cells": cells.family_size[left.motion],
        "beside_rest": cells.monostable[tuple(left.target.T)],
    }
    data = {name: ("change", values) for name, values in columns.items()}
    for i, (name, axis) in enumerate(
        (("vertical", cells.vertical), ("horizontal", cells.horizontal))
    ):
        data[name] = ("change", np.interp(middle[:, i], np.arange(len(axis)), axis))
        data[f"unseen_{name}"] = ("unseen", np.interp(unseen[:, i], np.arange(len(axis)), axis))
    chaos = (chart["outcome"] == CellOutcome.CHAOS).transpose("vertical", "horizontal").values
    path = chart.attrs["path"]
    sample = sampled_ends(
        System.from_json(chart.attrs["system"]), (str(path[0]), str(path[1])), cells, borders
    )
    attrs = {
        "changes": len(changes),
        "changes_beside_rest": int(cells.monostable[tuple(changes.target.T)].sum()),
        "located": int(ends.sum()),
        "on_curves": int(on_curves.sum()),
        "sampled": int(np.isfinite(sample).sum()),
        "sampled_agree": int(np.nansum(sample)),
        "harmless": int(harmless.sum()),
        "chaos_beside_rest": _neighbours(chaos, cells.monostable),
    }
    return xr.Dataset(data, attrs=attrs)


def _neighbours(some: np.ndarray, others: np.ndarray) -> int:
    """The number of pairs of neighbouring cells of which one is among `some` and the other among
    `others`.
    """
    pairs = (
        (some[1:], others[:-1]),
        (some[:-1], others[1:]),
        (some[:, 1:], others[:, :-1]),
        (some[:, :-1], others[:, 1:]),
    )
    return int(sum((a & b).sum() for a, b in pairs))


CHAOTIC = (CellOutcome.CHAOS, CellOutcome.MOTIONS_AND_CHAOS)


@answered
def wrong_cells(
    system: System, chart: xarray.Dataset, *, cells: int = 100, seed: int = 1
) -> dict[str, float]:
    """How many cells of a random sample are wrong.

    Each cell is computed again with four times as many starts, which are others. Eight cells around
    it, at half the distance of its neighbours, are computed too, so that motions that begin at
    these are found as well.

    Parameters
    ----------
    system
        The system of the chart.
    chart
        A chart as `stability_chart` or `with_borders` returns it.
    cells
        The number of cells in the sample; all cells if the chart has fewer.
    seed
        The seed of the sample and of the starts.

    Returns
    -------
    dict[str, float]
        The number of `checked_cells` and of `wrong_cells` among them. The latter are `wrong_rest`
        where the chart has rest alone and there is something else, and `wrong_motions` where it
        lacks a stable motion. They are `wrong_chaos` where either the chart or the sample has
        chaos, but not both. `wrong_share` is the share of wrong cells, and `wrong_share_low` to
        `wrong_share_high` its 95 % interval.

    Examples
    --------
    >>> chart = saltus.stability_chart(system, horizontal=[0.2, 0.21], vertical=[-0.5, -0.49], starts=4)
    >>> saltus.studies.wrong_cells(system, chart, cells=4)["wrong_share"]
    0.0
    """
    check_count("cells", cells, 1)
    check_count("seed", seed, 0)
    request, chart = (
        ChartRequest.of_chart(system, chart),
        chart.transpose("vertical", "horizontal", ...),
    )
    size = int(np.prod(request.shape))
    chosen = np.sort(np.random.default_rng(seed).choice(size, min(cells, size), replace=False))
    finer = _Sample(
        **_numbers(request, seed), place=np.stack(np.unravel_index(chosen, request.shape), axis=1)
    )
    columns, found = computed(finer)
    middle = 9 * np.arange(len(chosen)) + 4
    motions = found[(found["amplitude"] > COUNTS * request.least) & np.isin(found["cell"], middle)]
    motions["cell"] = chosen[motions["cell"] // 9]
    known = read_motions(chart)
    full = chart["count"].values.ravel()[motions["cell"]] >= KEPT
    lacking = motions["cell"][~full & ~has_alike(known, motions["cell"], motions, ALIKE.followed)]
    before = chart["outcome"].values.ravel()[chosen]
    after = columns["outcome"][middle]
    wrong = {
        "wrong_rest": (before == CellOutcome.REST) & (after != CellOutcome.REST),
        "wrong_motions": np.isin(chosen, lacking),
        "wrong_chaos": np.isin(before, CHAOTIC) != np.isin(after, CHAOTIC),
    }
    number = int(np.any(list(wrong.values()), axis=0).sum())
    low, high = share_interval(number, len(chosen))
    counts = {
        "checked_cells": len(chosen),
        "wrong_cells": number,
        **{name: int(cells.sum()) for name, cells in wrong.items()},
    }
    return counts | {
        "wrong_share": number / len(chosen),
        "wrong_share_low": low,
        "wrong_share_high": high,
    }


def _numbers(request: ChartRequest, seed: int) -> dict[str, Any]:
    """The arguments of a chart with four times as many and with other starts."""
    more = replace(request, starts=4 * request.starts, seed=request.seed + seed)
    return {name: getattr(more, name) for name in more.__dataclass_fields__}


@dataclass(frozen=True, eq=False, kw_only=True)
class _Sample(ChartRequest):
    """Some cells of a chart, each in the middle of a block of three by three cells half as far
    apart.
    """

    place: np.ndarray  # (n, 2): row and column in the chart

    @property
    def shape(self) -> tuple[int, int]:
        """All blocks below one another; starts from a neighbour that belongs to another block do no
        harm.
        """
        return 3 * len(self.place), 3

    @property
    def parameters(self) -> dict[str, np.ndarray]:
        """The values of both parameters in each cell, by their dotted paths."""
        steps = np.array([-0.5, 0.0, 0.5])
        rows, columns = (
            np.interp(index[:, None] + steps, np.arange(len(axis)), axis)
            for index, axis in zip(self.place.T, (self.vertical, self.horizontal), strict=True)
        )
        return {
            self.paths[1]: np.repeat(rows, 3, axis=1).ravel(),
            self.paths[0]: np.tile(columns, 3).ravel(),
        }


# the axes where none are given
HORIZONTAL = np.linspace(0.0, 0.5, 101)
VERTICAL = np.linspace(-2.0, 0.0, 101)


def _check(
    system: System,
    store: Any,
    workers: object,
    scheduler: object,
    device: Any,
    progress: object,
    functions: Any = None,
    **options: Any,
) -> None:
    from saltus.sweep import check_store

    own_quantities(system, functions)

    check_device(device, system, workers, scheduler)
    plan = ChartRequest(system=system, **options).plan()
    if store is not None:
        check_store(plan, Path(store))


@checked_by(_check)
@on_device
def stability_chart(
    system: System,
    *,
    horizontal: Iterable[float] = HORIZONTAL,
    vertical: Iterable[float] = VERTICAL,
    paths: tuple[str, str] = ("load.horizontal.amplitude", "load.vertical"),
    max_period: int = 6,
    starts: int = 12,
    window: Box | None = None,
    least: float | None = None,
    periods: int | None = None,
    tol: float = 1e-10,
    seed: int = 0,
    rows: int = 101,
    store: Path | str | None = None,
    workers: int | None = None,
    scheduler: str | None = None,
    device: str = "cpu",
    functions: Functions | None = None,
    progress: Progress = silent,
) -> xarray.Dataset:
    """The largest amplitude of the stable motions beside rest, and their number, over the plane of
    two parameters (Figs. 14, 15).

    In every cell motions are followed from `starts` initial states, spread evenly over the window,
    every other one drawn in towards the contact. They are also followed from every stable motion of
    the neighbouring cells of the same chunk, until this adds nothing new. So a motion is followed
    to where its stability ends, even where its basin is tiny. Deformed equilibria, which exist
    without a horizontal load, are motions too. docs/charts.md lists the variables of the result.

    Parameters
    ----------
    system
        What moves, under a load with a frequency.
    horizontal, vertical
        The values along the two axes, by default 101 from 0 to 0.5 and from -2 to 0.
    paths
        The dotted paths of the parameters along them.
    max_period
        The longest period of a motion, in forcing periods; motions of longer periods count as
        unsettled.
    starts, window, seed
        Initial states, as `search_orbits` takes them.
    least
        The smallest amplitude that counts, by default 1e-3 in natural units: below Hcr small motions of 6, 10, 14, ... impacts
        accumulate towards rest.
    periods
        Forcing periods after which a motion that has not settled counts as unsettled; by default it
        follows from the damping.
    tol
        The error of a step; with a larger one than 1e-10 motions beside an equilibrium do not come
        to a halt.
    rows
        How many rows are one chunk; motions are carried on between neighbouring cells of one chunk
        only.
    store, workers, scheduler, progress
        Where the chunks are kept and who computes them, see `saltus.sweep.run`.
    device
        Where the motions are followed, as for `simulate_many`.
    functions
        Further quantities of the motions by name, as `frequency_sweep` takes them: `motion_...`.

    Returns
    -------
    xarray.Dataset
        A Dataset over (vertical, horizontal), and for the up to 8 largest motions of each cell over
        `motion`.

    Raises
    ------
    ParameterError
        An argument without meaning, or one that the system refuses.

    Examples
    --------
    >>> chart = saltus.stability_chart(system, horizontal=[0.0, 0.2], vertical=[-0.5], starts=4)
    >>> chart["count"].values  # without a horizontal load there is rest alone
    array([[0, 1]], dtype=int16)
    """
    from saltus.sweep import run

    numbers: dict[str, Any] = {
        "max_period": max_period,
        "starts": starts,
        "window": window,
        "least": least,
        "periods": periods,
        "rows": rows,
    }
    axes: dict[str, Any] = {"horizontal": horizontal, "vertical": vertical, "paths": paths}
    request = ChartRequest(system=system, **axes, **numbers, tol=tol, seed=seed)
    chart = run(request.plan(), store, workers=workers, scheduler=scheduler, progress=progress)
    return _with_quantities(system, chart, paths, own_quantities(system, functions))


def _with_quantities(
    system: System, chart: xarray.Dataset, paths: Sequence[str], own: Sequence[Quantity]
) -> xarray.Dataset:
    """The chart with the extrema of each coordinate and each point, of a model with several, and
    with the user's own quantities, of the motions that it keeps: `motion_...`."""
    dims = ("vertical", "horizontal", "motion")
    motions = read_motions(chart)
    at = np.nonzero(np.isfinite(chart["motion_amplitude"].transpose(*dims).values))
    values = {
        path: chart[axis].values[at[place]]
        for path, axis, place in zip(paths, ("horizontal", "vertical"), (1, 0), strict=True)
    }
    columns = quantities_of_motions(system, values, motions["state"], motions["period"], own)
    check_new_names(own, (name.removeprefix("motion_") for name in map(str, chart)))
    for name, (found, attrs) in columns.items():
        if name not in DRIVEN:
            table = np.full(tuple(chart.sizes[dim] for dim in dims), np.nan)
            table[at] = found
            chart[f"motion_{name}"] = (dims, table, attrs)
    if columns:
        chart.attrs["shown"] = " ".join(driven_displacements(system))
    return chart


def _check_bordered(system: System, curves: int, progress: object, **options: Any) -> None:
    check_system(system, "the borders of a chart", several_contacts=True)
    check_count("curves", curves, 0)
    stability_chart.check(system, **options)


@checked_by(_check_bordered)
@on_device
def bordered_chart(
    system: System,
    *,
    curves: int = 12,
    horizontal: Iterable[float] = HORIZONTAL,
    vertical: Iterable[float] = VERTICAL,
    paths: tuple[str, str] = ("load.horizontal.amplitude", "load.vertical"),
    max_period: int = 6,
    starts: int = 12,
    window: Box | None = None,
    least: float | None = None,
    periods: int | None = None,
    tol: float = 1e-10,
    seed: int = 0,
    rows: int = 101,
    store: Path | str | None = None,
    workers: int | None = None,
    scheduler: str | None = None,
    device: str = "cpu",
    functions: Functions | None = None,
    progress: Progress = silent,
) -> xarray.DataTree:
    """`stability_chart` with the exact borders of its motions (Figs. 14, 15).

    Parameters
    ----------
    system
        What moves, under a load with a frequency.
    curves
        The largest number of curves that are followed on which motions end, see `with_borders`.
    horizontal, vertical, paths, max_period, starts, window, least, periods, tol, seed, rows
        As for `stability_chart`.
    store, workers, scheduler, device, functions
        As for `stability_chart`.
    progress
        Called with the fraction done and what is being done, first when all arguments have been
        checked.

    Returns
    -------
    xarray.DataTree
        A DataTree of the groups `chart`, `borders` (see `Borders.to_xarray`), `disagreements` and,
        where theory knows it, `static`, the quasi-static border (see
        `saltus.theory.quasi_static_border`).

    Raises
    ------
    ParameterError
        As `stability_chart`.
    SweepError
        As `stability_chart`.

    Examples
    --------
    >>> made = saltus.studies.bordered_chart(system, horizontal=[0.2, 0.21], vertical=[-0.5, -0.49], starts=4, curves=0)
    >>> sorted(made.children)
    ['borders', 'chart', 'disagreements', 'static']
    """
    from saltus.result_tree import ResultTree

    chart = stability_chart(
        system,
        horizontal=horizontal,
        vertical=vertical,
        paths=paths,
        max_period=max_period,
        starts=starts,
        window=window,
        least=least,
        periods=periods,
        tol=tol,
        seed=seed,
        rows=rows,
        store=store,
        workers=workers,
        scheduler=scheduler,
        device=device,
        functions=functions,
        progress=part_of(progress, 0.0, 0.5),
    )
    rest = part_of(progress, 0.5, 1.0)
    chart, borders = with_borders(
        system,
        chart,
        curves=curves,
        progress=rest,
        store=store,
        workers=workers,
        scheduler=scheduler,
    )
    chart.attrs = {name: value for name, value in chart.attrs.items() if name != "plan"}
    groups = {"chart": chart, "disagreements": disagreements(chart, borders)}
    static = quasi_static_border(system, tuple(chart.attrs["path"]), float(chart["vertical"].min()))
    if static is not None:
        groups["static"] = static.to_xarray()
    return ResultTree.from_dict(groups).assign({"borders": borders.to_xarray(read_chart(chart))})
