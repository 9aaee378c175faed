"""Stability charts: the stable motions beside rest, in the plane of two parameters, and their borders."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from saltus.checks import check_count
from saltus.progress import Progress, part_of, silent
from saltus.public_functions import checked_by
from saltus.studies.chart.borders import with_borders
from saltus.studies.chart.changes import read_chart
from saltus.studies.chart.chart_checks import disagreements
from saltus.studies.chart.chart_request import ChartRequest
from saltus.systems import Box, System, check_system
from saltus.theory import quasi_static_border

if TYPE_CHECKING:
    import xarray

HORIZONTAL, VERTICAL = np.linspace(0.0, 0.5, 101), np.linspace(-2.0, 0.0, 101)  # the axes where none are given


def _check(system: System, store: Any, workers: object, scheduler: object, progress: object, **options: Any) -> None:
    from saltus.sweep import check_store

    plan = ChartRequest(system=system, **options).plan()
    if store is not None:
        check_store(plan, Path(store))


@checked_by(_check)
def stability_chart(
    system: System,
    *,
    horizontal: Iterable[float] = HORIZONTAL,
    vertical: Iterable[float] = VERTICAL,
    paths: tuple[str, str] = ("load.horizontal.amplitude", "load.vertical"),
    max_period: int = 6,
    starts: int = 12,
    window: Box | None = None,
    least: float = 1e-3,
    periods: int | None = None,
    tol: float = 1e-10,
    seed: int = 0,
    rows: int = 101,
    store: Path | str | None = None,
    workers: int | None = None,
    scheduler: str | None = None,
    progress: Progress = silent,
) -> xarray.Dataset:
    """The largest amplitude of the stable motions beside rest, and their number, over the plane of two parameters (Figs. 14, 15).

    In every cell motions are followed from `starts` initial states, spread evenly over the window, every other one drawn in
    towards the contact, and from every stable motion of the neighbouring cells of the same chunk, until this adds nothing new. So
    a motion is followed to where its stability ends, even where its basin is tiny. Deformed equilibria, which exist without a
    horizontal load, are motions too. docs/charts.md lists the variables of the result.

    Parameters
    ----------
    system
        What moves, under a load with a frequency.
    horizontal, vertical
        The values along the two axes, by default 101 from 0 to 0.5 and from -2 to 0.
    paths
        The dotted paths of the parameters along them.
    max_period
        The longest period of a motion, in forcing periods; motions of longer periods count as unsettled.
    starts, window, seed
        Initial states, as `search_orbits` takes them.
    least
        The smallest amplitude that counts: below Hcr small motions of 6, 10, 14, ... impacts accumulate towards rest.
    periods
        Forcing periods after which a motion that has not settled counts as unsettled; by default it follows from the damping.
    tol
        The error of a step; with a larger one than 1e-10 motions beside an equilibrium do not come to a halt.
    rows
        How many rows are one chunk; motions are carried on between neighbouring cells of one chunk only.
    store, workers, scheduler, progress
        Where the chunks are kept and who computes them, see `saltus.sweep.run`.

    Returns
    -------
    xarray.Dataset
        A Dataset over (vertical, horizontal), and for the up to 8 largest motions of each cell over `motion`.

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
    return run(request.plan(), store, workers=workers, scheduler=scheduler, progress=progress)


def _check_bordered(system: System, curves: int, progress: object, **options: Any) -> None:
    check_system(system, "the borders of a chart", several_contacts=True)
    check_count("curves", curves, 0)
    stability_chart.check(system, **options)


@checked_by(_check_bordered)
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
    least: float = 1e-3,
    periods: int | None = None,
    tol: float = 1e-10,
    seed: int = 0,
    rows: int = 101,
    store: Path | str | None = None,
    workers: int | None = None,
    scheduler: str | None = None,
    progress: Progress = silent,
) -> xarray.DataTree:
    """`stability_chart` with the exact borders of its motions (Figs. 14, 15).

    Parameters
    ----------
    system
        What moves, under a load with a frequency.
    curves
        The largest number of curves that are followed on which motions end, see `with_borders`.
    horizontal, vertical, paths, max_period, starts, window, least, periods, tol, seed, rows, store, workers, scheduler
        As for `stability_chart`.
    progress
        Called with the fraction done and what is being done, first when all arguments have been checked.

    Returns
    -------
    xarray.DataTree
        A DataTree of the groups `chart`, `borders` (see `Borders.to_xarray`), `disagreements` and, where theory knows it,
        `static`, the quasi-static border (see `saltus.theory.quasi_static_border`).

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
    import xarray as xr

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
        progress=part_of(progress, 0.0, 0.5),
    )
    rest = part_of(progress, 0.5, 1.0)
    chart, borders = with_borders(system, chart, curves=curves, progress=rest, store=store, workers=workers, scheduler=scheduler)
    chart.attrs = {name: value for name, value in chart.attrs.items() if name != "plan"}
    groups = {"chart": chart, "disagreements": disagreements(chart, borders)}
    static = quasi_static_border(system, tuple(chart.attrs["path"]), float(chart["vertical"].min()))
    if static is not None:
        groups["static"] = static.to_xarray()
    return xr.DataTree.from_dict(groups).assign({"borders": borders.to_xarray(read_chart(chart))})
