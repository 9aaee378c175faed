"""The phase plane of a study: its motions, saddles and separatrices."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.figure import Figure

from saltus.plots.marks import arrow_along, fixed_points
from saltus.plots.style import FAINT, SEPARATRIX_LINE, SINGLE_COLUMN, STABLE, new_figure, styled

ARROW = 0.15  # share of a motion's samples after which its direction is shown


@styled
def draw_plane(dataset: Any, width: float = 1.4 * SINGLE_COLUMN) -> Figure:
    """A Figure from a dataset of `saltus.studies.phase_portrait`."""
    name = dataset.attrs["coordinate"]
    left, right, low, high = dataset.attrs["window"]
    figure = new_figure(width, 0.8 * width)
    ax = figure.subplots()
    ax.set_xlim(left, right)
    ax.set_ylim(low, high)
    ax.axhline(0.0, color=FAINT, lw=0.4, zorder=0)
    for x, v in zip(dataset[name].values, dataset["velocity"].values, strict=True):
        ax.plot(x, v, color=STABLE, lw=0.6, zorder=2)
        seen = np.flatnonzero((x > left) & (x < right) & (v > low) & (v < high))
        if seen.size > 10:
            arrow_along(ax, x, v, int(seen[int(ARROW * seen.size)]), STABLE)
    for x, v in zip(dataset[f"separatrix_{name}"].values, dataset["separatrix_velocity"].values, strict=True):
        ax.plot(x, v, zorder=3, **SEPARATRIX_LINE)
    points = dataset["saddle"].values
    fixed_points(ax, points, np.zeros(points.size, dtype=bool))
    symbol = r"\theta" if name.startswith("theta") else name
    ax.set_xlabel(rf"${symbol}$" + (" (rad)" if name.startswith("theta") else ""))
    ax.set_ylabel(rf"${symbol}'$")
    return figure
