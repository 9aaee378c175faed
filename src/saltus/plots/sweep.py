"""A parameter swept up and down: the amplitudes both ways, the jumps as arrows, and where the two differ."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes

from saltus.plots.axis_names import parameter_name, symbol, unit_in_brackets
from saltus.plots.conventions import SINGLE_COLUMN, STABLE, UNSTABLE, axes_or_new
from saltus.plots.drawing import drawing
from saltus.plots.marks import cell_edges

WAYS: dict[str, dict[str, Any]] = {
    "up": {"color": STABLE, "marker": "^", "markersize": 2.6, "linestyle": "-", "linewidth": 0.9, "markeredgewidth": 0.0},
    "down": {
        "color": UNSTABLE,
        "marker": "v",
        "markersize": 2.6,
        "linestyle": (0, (4, 2)),
        "linewidth": 0.9,
        "markeredgewidth": 0.0,
    },
}
BAND = "#ececec"  # where up and down differ


@drawing
def draw_sweep(dataset: Any, *, ax: Axes | None = None, width: float = 1.3 * SINGLE_COLUMN) -> Axes:
    """Draw the dataset of `frequency_sweep`: amplitudes up and down, jumps as arrows, hysteresis in grey; returns the axes."""
    ax = axes_or_new(ax, width, 0.62 * width)
    values = dataset["value"].values
    edges = cell_edges(values)
    for i in np.flatnonzero(dataset["hysteresis"].values):
        ax.axvspan(edges[i], edges[i + 1], color=BAND, linewidth=0.0, zorder=0)
    for way, line in WAYS.items():
        found = _jumps(dataset, way)
        middle = found[:, :2].mean(axis=1)
        x = np.concatenate([values, found[:, 0], middle, found[:, 1]])  # interrupted at a jump, as no motions lie in between
        y = np.concatenate(
            [dataset["amplitude"].sel(direction=way).values, found[:, 2], np.full(len(found), np.nan), found[:, 3]]
        )
        order = np.argsort(x, kind="stable")
        ax.plot(x[order], y[order], label=way, zorder=2, **line)
        for place, low, high in zip(middle, found[:, 2], found[:, 3], strict=True):
            arrow = {
                "arrowstyle": "-|>",
                "color": line["color"],
                "linewidth": 0.8,
                "shrinkA": 0.0,
                "shrinkB": 0.0,
                "mutation_scale": 7,
            }
            ax.annotate("", (place, high), (place, low), arrowprops=arrow, zorder=3)
    name = symbol(dataset.attrs["coordinate"])
    ax.set_xlim(values[0], values[-1])
    ax.set_ylim(bottom=0.0)
    ax.set_xlabel(parameter_name(dataset.attrs["path"]))
    ax.set_ylabel(rf"$\max_\tau|{name}|${unit_in_brackets(dataset['amplitude'])}")
    ax.legend(loc="best")
    return ax


def _jumps(dataset: Any, way: str) -> np.ndarray:
    """The values before and after each jump of one direction, and the amplitudes there, (n, 4)."""
    chosen = dataset["jump_direction"].values == way
    names = ("before", "after", "amplitude_before", "amplitude_after")
    return np.stack([dataset[f"jump_{name}"].values[chosen] for name in names], axis=1)
