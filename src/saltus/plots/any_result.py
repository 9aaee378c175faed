"""One function that draws any result of saltus, by what it is."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from saltus.errors import ParameterError, shown
from saltus.plots.attractors import draw_attractors
from saltus.plots.backbone import draw_backbone
from saltus.plots.basins import draw_basins
from saltus.plots.chart import draw_stability_chart
from saltus.plots.curves import draw_attractors_along, draw_branch, draw_special_curve
from saltus.plots.diagram import draw_diagram
from saltus.plots.ensembles import draw_ensemble
from saltus.plots.motion import draw_motion
from saltus.plots.plane import draw_plane
from saltus.plots.sweep import draw_sweep
from saltus.public_functions import bound_arguments

DRAWINGS: dict[str, Callable[..., Any]] = {
    "motion": draw_motion,
    "phase_portrait": draw_plane,
    "response_spectrum": draw_diagram,
    "bifurcation_diagram": draw_diagram,
    "frequency_sweep": draw_sweep,
    "attractors": draw_attractors,
    "backbone": draw_backbone,
    "basins": draw_basins,
    "stability_chart": draw_stability_chart,
    "attractors along a parameter": draw_attractors_along,
}  # by the attribute `kind`


def plot(result: Any, **options: Any) -> Any:
    """Draw any result; returns the axes, or of several panels an array of them.

    Parameters
    ----------
    result
        A Dataset or a DataTree that saltus has made, or what has `to_xarray`, such as a motion or a branch.
    options
        Of the function that draws it, such as `ax=` (or `figure=`, where it has several panels) and `width=`, in mm.

    Raises
    ------
    ParameterError
        What has no picture.

    Examples
    --------
    >>> axes = saltus.plot(branch)
    >>> type(axes).__name__
    'Axes'
    """
    data = result.to_xarray() if hasattr(result, "to_xarray") else result
    if not hasattr(data, "attrs") or not hasattr(data, "data_vars"):
        raise ParameterError(f"result must be a Dataset, a DataTree or what has to_xarray, got {shown(result)}", "result")
    draw = DRAWINGS.get(str(data.attrs.get("kind", "")))
    if draw is None and "branches" in getattr(data, "children", ()):
        draw = draw_diagram
    if draw is None and "unknowns" in data:
        draw = draw_special_curve if "path" in data.coords else draw_branch
    if draw is None and "stop" in data:
        draw = draw_ensemble
    if draw is None and {"amplitude", "outcome", "horizontal", "vertical"} <= set(data.variables):
        draw = draw_stability_chart
    if draw is None:
        raise ParameterError(f"nothing draws a result of the kind {shown(data.attrs.get('kind', ''))}", "result")
    bound_arguments(draw, (data,), options)  # what it does not take is refused with what it does
    return draw(data, **options)
