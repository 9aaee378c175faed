"""The phase plane of a study: its motions, equilibria and separatrices."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from saltus.plots.axis_names import symbol, unit_in_brackets
from saltus.plots.conventions import FAINT, SEPARATRIX_LINE, SINGLE_COLUMN, STABLE, UNSTABLE, axes_or_new, legend_of
from saltus.plots.drawing import drawing
from saltus.plots.marks import fixed_points
from saltus.plots.phase_lines import draw_arrows, lines_apart

ARROWS = 0.6  # window widths between arrows along a motion


@drawing
def draw_plane(dataset: Any, *, ax: Axes | None = None, width: float = 1.5 * SINGLE_COLUMN) -> Axes:
    """Draw a dataset of `saltus.phase_portrait`; returns the axes.

    Stable equilibria are filled, unstable ones open. Motions from given starts are drawn to their ends; motions from starts that
    were spread over the window are cut where they come near to one that is drawn, so that lines stay apart.
    """
    name = dataset.attrs["coordinate"]
    window = np.asarray(dataset.attrs["window"], dtype=float).reshape(2, 2)
    own, ax = ax is None, axes_or_new(ax, width, 0.85 * width)
    ax.set_xlim(*window[0])
    ax.set_ylim(*window[1])
    ax.axhline(0.0, color=FAINT, lw=0.4, zorder=0)
    if "contact" in dataset.attrs:
        ax.axvline(float(dataset.attrs["contact"]), color=FAINT, lw=1.2, zorder=0)
    motions = list(zip(dataset[name].values, dataset["velocity"].values, strict=True))
    for x, v in lines_apart(motions, window) if dataset.attrs.get("starts") == "spread" else motions:
        ax.plot(x, v, color=STABLE, lw=0.7, zorder=2)
        draw_arrows(ax, x, v, ARROWS)
    for x, v in zip(dataset[f"separatrix_{name}"].values, dataset["separatrix_velocity"].values, strict=True):
        ax.plot(x, v, zorder=3, **SEPARATRIX_LINE)
    stable = dataset["stable"].values.astype(bool)
    fixed_points(ax, dataset["equilibrium"].values, stable)
    for artist in (*ax.texts, *ax.lines):
        artist.set_in_layout(False)  # else parts outside the window would be given room beside it
    ax.set_xlabel(rf"${symbol(name)}${unit_in_brackets(dataset[name])}")
    ax.set_ylabel(rf"$\dot{{{symbol(name)}}}${unit_in_brackets(dataset[name])}")
    _legend(ax, own, stable, bool(dataset.sizes["separatrix"]))
    return ax


def _legend(ax: Axes, own: bool, stable: np.ndarray, separatrices: bool) -> None:
    """A legend of the stable and unstable equilibria and the separatrices, as far as there are any."""
    dot: dict[str, Any] = {"linestyle": "none", "marker": "o", "markersize": 4.5}
    handles = [Line2D([], [], color=STABLE, lw=0.7, label="motion")]
    if stable.any():
        handles.append(Line2D([], [], color=STABLE, label="stable equilibrium", **dot))
    if not stable.all():
        handles.append(Line2D([], [], mfc="white", mec=UNSTABLE, label="unstable equilibrium", **dot))
    if separatrices:
        handles.append(Line2D([], [], label="separatrix", **SEPARATRIX_LINE))
    legend_of(ax, own, handles, ncols=len(handles), columnspacing=1.4, handletextpad=0.5)
