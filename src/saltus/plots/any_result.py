"""One function that draws any result of saltus, by its kind."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import nullcontext
from typing import Any

from saltus.errors import ParameterError, shown
from saltus.plots.basins import draw_attractors, draw_basins, draw_integrity, draw_uncertainty, draw_wada
from saltus.plots.chaos import draw_chaotic_bands, draw_exponents, draw_exponents_along, draw_verdict
from saltus.plots.chart import draw_stability_chart
from saltus.plots.conventions import LOOK, axes_or_new, figure_of, style
from saltus.plots.curves import draw_attractors_along, draw_backbone, draw_branch, draw_cascade, draw_search, draw_special_curve
from saltus.plots.experiments import draw_energies, draw_fit, draw_fragility, draw_overturning
from saltus.plots.motion import draw_ensemble, draw_motion, draw_sensitivities, draw_sweep
from saltus.plots.plane import draw_manifold, draw_plane, draw_separatrix
from saltus.plots.response import draw_diagram
from saltus.plots.unit_cell import draw_unit_cell
from saltus.progress import show_below_cell

DRAWINGS: dict[str, Callable[..., Any]] = {
    "attractors": draw_attractors,
    "attractors along a parameter": draw_attractors_along,
    "backbone": draw_backbone,
    "basin_integrity": draw_integrity,
    "basins": draw_basins,
    "bifurcation_diagram": draw_diagram,
    "branch": draw_branch,
    "cascade": draw_cascade,
    "cell": draw_unit_cell,
    "chaotic_bands": draw_chaotic_bands,
    "energies": draw_energies,
    "ensemble": draw_ensemble,
    "exponents": draw_exponents,
    "fragility": draw_fragility,
    "fit": draw_fit,
    "free_orbit": draw_motion,
    "frequency_sweep": draw_sweep,
    "lyapunov_many": draw_exponents_along,
    "manifold": draw_manifold,
    "mapped": draw_ensemble,
    "motion": draw_motion,
    "orbits": draw_search,
    "overturning_spectrum": draw_overturning,
    "periodic_orbit": draw_motion,
    "phase_portrait": draw_plane,
    "response_spectrum": draw_diagram,
    "sensitivities": draw_sensitivities,
    "separatrix": draw_separatrix,
    "stability_chart": draw_stability_chart,
    "uncertainty_exponent": draw_uncertainty,
    "verdict": draw_verdict,
    "wada": draw_wada,
}  # by the attribute `kind`


def plot(result: Any, **options: Any) -> Any:
    """Draw any result; returns the axes, or an array of them for several panels. In a notebook the picture is below the cell.

    Parameters
    ----------
    result
        A Dataset or a DataTree that saltus has made, a result with `to_xarray`, such as a motion or a branch, or a tuple of such
        results, as `switch_branch` and `separatrices` return them, which are drawn into the same axes.
    options
        Options of the function that draws it, such as `ax=` (or `figure=` for several panels) and `width=`, in mm.

    Raises
    ------
    ParameterError
        A result that has no picture.

    Examples
    --------
    >>> axes = saltus.plot(branch)
    >>> type(axes).__name__
    'Axes'
    """
    if isinstance(result, (tuple, list)) and result:
        given = options.pop("ax", None)
        with style() if given is None else nullcontext():
            ax = axes_or_new(given, options.pop("width", LOOK.single_column), 0.8 * LOOK.single_column)
            for each in result:
                plot(each, ax=ax, **options)
        if given is None:
            show_below_cell(figure_of(ax))
        return ax
    data = result.to_xarray() if hasattr(result, "to_xarray") else result
    if not hasattr(data, "attrs") or not hasattr(data, "data_vars"):
        raise ParameterError(f"result must be a Dataset, a DataTree or what has to_xarray, got {shown(result)}", "result")
    draw = DRAWINGS.get(str(data.attrs.get("kind", ""))) or _by_content(data)
    if draw is None:
        raise ParameterError(f"nothing draws a result of the kind {shown(data.attrs.get('kind', ''))}", "result")
    axes = draw(data, **options)
    if not options.keys() & {"ax", "figure"}:
        show_below_cell(figure_of(axes))
    return axes


def _by_content(data: Any) -> Callable[..., Any] | None:
    """The function that draws a dataset without a `kind`, or with one of another meaning, such as a curve of special points."""
    if "chart" in getattr(data, "children", ()):
        return draw_stability_chart
    if "branches" in getattr(data, "children", ()):
        return draw_diagram
    if "unknowns" in data and "path" in data.coords:
        return draw_special_curve
    if {"amplitude", "outcome", "horizontal", "vertical"} <= set(data.variables):
        return draw_stability_chart
    return None
