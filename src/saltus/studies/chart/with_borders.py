"""A stability chart with its borders: the exact ones, and for the metainterface the quasi-static one."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from saltus.checks import check_count, checked_by
from saltus.studies.chart.borders import disagreements, with_borders
from saltus.studies.chart.chart import stability_chart
from saltus.systems import Harmonic, Load, Metainterface, System

if TYPE_CHECKING:
    import xarray

CURVES = 12  # on which motions end, at most
LOADS = ("load.horizontal.amplitude", "load.vertical")  # the axes on which the quasi-static border is known


def _check(system: System, curves: int, progress: object, exploring: object, **options: Any) -> None:
    check_count("curves", curves, 0)
    stability_chart.check(system, **options)  # type: ignore[attr-defined]


@checked_by(_check)
def bordered_chart(
    system: System,
    *,
    curves: int = CURVES,
    progress: Callable[..., object] | None = None,
    exploring: Callable[[float], object] | None = None,
    **options: Any,
) -> xarray.DataTree:
    """`stability_chart` with what bounds its motions (Figs. 14, 15).

    Args:
        system: what moves, under a load with a frequency.
        curves: how many curves on which motions end are followed at most, see `exact_borders`.
        progress: of the chart, as `stability_chart` calls it.
        exploring: called with the share of the changes between cells that are explained.
        options: those of `stability_chart`.

    Returns:
        A DataTree of the groups `chart`, `borders` (see `Borders.to_xarray`), `disagreements` and, for the metainterface with
        k = 1 under load (i) in the plane of Hhat and V, `static` (see `static_borders`).

    Raises:
        ParameterError, SweepError: as `stability_chart`.
    """
    import xarray as xr

    chart, borders = with_borders(
        system, stability_chart(system, progress=progress, **options), most=int(curves), progress=exploring
    )
    chart.attrs = {name: value for name, value in chart.attrs.items() if name != "plan"}
    groups = {"chart": chart, "disagreements": disagreements(chart, borders)}
    if isinstance(system.model, Metainterface) and _has_static_border(system.model, system.load, chart):
        groups["static"] = static_borders(system.model.beta0, float(chart["vertical"].min()))
    return xr.DataTree.from_dict(groups).assign({"borders": borders.to_xarray()})


def _has_static_border(model: Metainterface, load: Load, chart: xarray.Dataset) -> bool:
    """Whether the closed forms of `static_borders` hold: k = 1, beta0 below 90 degrees, H = Hhat sin and constant V < 0 alone."""
    horizontal = load.channels.get("horizontal")
    return (
        tuple(chart.attrs["path"]) == LOADS
        and (model.stiffness_ratio, model.smoothing) == (1.0, None)
        and model.beta0 < np.pi / 2
        and set(load.channels) == {"horizontal", "vertical"}
        and isinstance(horizontal, Harmonic)
        and horizontal.mean == 0.0
        and float(chart["vertical"].min()) < 0.0
    )


def static_borders(beta0: float, lowest: float) -> xarray.Dataset:
    """Both parts of the quasi-static border over V from `lowest` to 0, `critical` (the paper's) and `fold`; `true` is the lesser
    (erratum 23)."""
    import xarray as xr

    from saltus.theory import critical_horizontal, fold_horizontal, subcritical_vertical, unloaded_fold

    start, end = subcritical_vertical(beta0), unloaded_fold(beta0)[0]
    bend = end + (start - end) * np.linspace(0.0, 1.0, 101) ** 0.5  # the fold leaves the line at V = start as a power 3/2
    ends = [np.linspace(lowest, end, 21), bend, np.linspace(end, start, 101), np.linspace(start, 0.0, 21)]
    vertical = np.unique(np.concatenate(ends))
    vertical = vertical[vertical >= lowest]
    fold = np.full_like(vertical, np.nan)
    fold[vertical <= start] = fold_horizontal(beta0, vertical[vertical <= start])
    fold[vertical <= end] = 0.0  # deformed equilibria are there without any horizontal load; not the rounding of 0
    critical = critical_horizontal(beta0, vertical)
    data = {
        "critical": (critical, "Hhat at which the undeformed state is lost (the paper's border)"),
        "fold": (fold, "Hhat at the fold of deformed equilibria (erratum 23)"),
        "true": (np.fmin(critical, fold), "the lesser of both: the quasi-static border"),
    }
    variables = {name: ("vertical", values, {"units": "1", "long_name": text}) for name, (values, text) in data.items()}
    return xr.Dataset(
        variables, {"vertical": ("vertical", vertical, {"units": "1", "long_name": "V"})}, {"subcritical_below": start}
    )
