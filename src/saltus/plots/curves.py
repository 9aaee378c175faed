"""Curves of one result each: a branch of orbits, a curve of special points, the attractors along a parameter."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes

from saltus.branch_lines import smooth_lines
from saltus.plots.attractor_marks import attractor_colours
from saltus.plots.axis_names import parameter_name, quantity_name, unit_in_brackets
from saltus.plots.conventions import INK, SINGLE_COLUMN, axes_or_new, marks_of, outside_legend
from saltus.plots.drawing import drawing
from saltus.plots.response import MARK_NAMES, MARKS, line_handles, line_style

RESTS: dict[str, dict[str, Any]] = {"RL": {"marker": "x", "markersize": 3.4}, "CH": {"marker": "+", "markersize": 4.4}}
REST_NAMES = {"RL": "lost release (RL)", "CH": "end of a rest (CH)"}


@drawing
def draw_branch(dataset: Any, quantity: str = "amplitude", *, ax: Axes | None = None, width: float = SINGLE_COLUMN) -> Axes:
    """Draw the dataset of a branch: stable motions solid, unstable ones dashed, and its special points; returns `ax`."""
    own, ax = ax is None, axes_or_new(ax, width, 0.75 * width)
    for line in smooth_lines(dataset, quantity):
        ax.plot(*line.places.T, **line_style(line.stable, line.validity))
    kinds = dataset["kind"].values
    for kind, mark in (MARKS | RESTS).items():
        if (kinds == kind).any():
            places = (dataset[f"special_{name}"].values[kinds == kind] for name in ("parameter", quantity))
            ax.plot(*places, ls="none", mfc="white", mec=INK, mew=0.5, zorder=5, label=(MARK_NAMES | REST_NAMES)[kind], **mark)
    handles, labels, handlers = line_handles([dataset])
    named = dict(zip(labels, handles, strict=True)) | marks_of(ax)
    legend = {"handles": [*named.values()], "labels": [*named], "handler_map": handlers, "handlelength": 3.6}
    if own:
        outside_legend(ax.figure, ncols=2, **legend)
    else:
        ax.legend(loc="best", **legend)
    ax.set_xlabel(parameter_name(dataset.attrs["path"]))
    ax.set_ylabel(f"{quantity_name(dataset, quantity)}{unit_in_brackets(dataset[quantity])}")
    return ax


@drawing
def draw_special_curve(dataset: Any, *, ax: Axes | None = None, width: float = SINGLE_COLUMN) -> Axes:
    """Draw a curve of special points in the plane of its two parameters, as `SpecialCurve.to_xarray` gives it; returns `ax`."""
    ax = axes_or_new(ax, width, 0.75 * width)
    ax.plot(
        *dataset["parameter"].values.T, color=INK, label=MARK_NAMES.get(str(dataset.attrs["kind"]), str(dataset.attrs["kind"]))
    )
    first, second = (str(path) for path in dataset["path"].values)
    ax.set_xlabel(parameter_name(first))
    ax.set_ylabel(parameter_name(second))
    ax.legend(loc="best")
    return ax


@drawing
def draw_attractors_along(dataset: Any, *, ax: Axes | None = None, width: float = 1.3 * SINGLE_COLUMN) -> Axes:
    """Draw the amplitudes of `attractors_along`, each attractor in a colour of its own; returns `ax`."""
    ax = axes_or_new(ax, width, 0.62 * width)
    numbers = [int(number) for number in dataset["attractor"].values]
    for number, colour in attractor_colours(numbers).items():
        sizes = dataset["amplitude"].sel(attractor=number).values
        kinds = {str(kind) for kind in dataset["kind"].sel(attractor=number).values} - {""}
        label = f"{number}: {' or '.join(sorted(kinds))}"
        ax.plot(dataset["value"].values, sizes, color=colour, marker=".", ms=3.5, mec=INK, mew=0.2, label=label)
    ax.set_xlim(*np.sort(dataset["value"].values[[0, -1]]))
    ax.set_xlabel(parameter_name(dataset.attrs["path"]))
    ax.set_ylabel(f"{quantity_name(dataset, 'amplitude')}{unit_in_brackets(dataset['amplitude'])}")
    ax.legend(loc="best")
    return ax
