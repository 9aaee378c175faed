"""Curves in the state plane: manifolds of saddle orbits at phase 0, and separatrices of the phase plane."""

from __future__ import annotations

from typing import Any

from matplotlib.axes import Axes

from saltus.plots.axis_names import plane_of, state_label
from saltus.plots.conventions import (
    INK,
    SEPARATRIX_LINE,
    SINGLE_COLUMN,
    STABLE_LINE,
    UNSTABLE,
    UNSTABLE_LINE,
    axes_or_new,
    marks_of,
)
from saltus.plots.drawing import drawing

SADDLE: dict[str, Any] = {"linestyle": "none", "marker": "o", "markersize": 4.5, "markerfacecolor": "white", "zorder": 5}


@drawing
def draw_manifold(dataset: Any, *, ax: Axes | None = None, width: float = SINGLE_COLUMN) -> Axes:
    """Draw the manifold of a saddle orbit at phase 0 of the load, the stable one solid, the unstable one dashed; returns `ax`."""
    ax = axes_or_new(ax, width, 0.85 * width)
    plane = plane_of(dataset)
    stable = bool(dataset.attrs["stable"])
    line, label = (STABLE_LINE, "stable manifold") if stable else (UNSTABLE_LINE, "unstable manifold")
    ax.plot(*(dataset[name].values for name in plane), label=label, **{**line, "linewidth": 0.8})
    ax.plot(*(dataset[f"orbit_{name}"].values for name in plane), markeredgecolor=INK, label="saddle orbit", **SADDLE)
    ax.set_xlabel(state_label(dataset, plane[0], plane, " at phase 0"))
    ax.set_ylabel(state_label(dataset, plane[1], plane, " at phase 0"))
    marks = marks_of(ax)
    ax.legend(marks.values(), marks.keys(), loc="best")
    return ax


@drawing
def draw_separatrix(dataset: Any, *, ax: Axes | None = None, width: float = SINGLE_COLUMN) -> Axes:
    """Draw a separatrix in the phase plane and its saddle, an open mark; returns `ax`."""
    ax = axes_or_new(ax, width, 0.85 * width)
    plane = plane_of(dataset)
    ax.plot(*(dataset[name].values for name in plane), label="separatrix", **SEPARATRIX_LINE)
    ax.plot(float(dataset.attrs["saddle"]), 0.0, markeredgecolor=UNSTABLE, label="saddle", **SADDLE)
    ax.set_xlabel(state_label(dataset, plane[0], plane))
    ax.set_ylabel(state_label(dataset, plane[1], plane))
    marks = marks_of(ax)
    ax.legend(marks.values(), marks.keys(), loc="best")
    return ax
