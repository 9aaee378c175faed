"""An ensemble over its one or two dimensions, and a parameter swept up and down."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes

from saltus.errors import ParameterError
from saltus.plots.axis_names import parameter_name, symbol, unit_in_brackets, varied
from saltus.plots.conventions import SINGLE_COLUMN, STABLE, UNSTABLE, axes_or_new, drawing
from saltus.plots.marks import cell_edges

OWN = ("period", "state", "column")  # dimensions within one motion, and not of the ensemble


@drawing
def draw_ensemble(dataset: Any, quantity: str | None = None, *, ax: Axes | None = None, width: float = SINGLE_COLUMN) -> Axes:
    """Draw a variable of `simulate_many`, by default the first coordinate at the end, over one dimension or two; returns `ax`.

    Raises
    ------
    ParameterError
        A variable that is not there, or that has no dimensions or more than two.
    """
    quantity = next(iter(dataset.data_vars)) if quantity is None else quantity
    if quantity not in dataset or not 1 <= dataset[quantity].ndim <= 2 or set(dataset[quantity].dims) & set(OWN):
        raise ParameterError(f"the ensemble has no {quantity!r} over one or two dimensions to draw", "quantity")
    values = dataset[quantity]
    axes = dict(varied(dataset, str(dim)) for dim in values.dims)
    ax = axes_or_new(ax, width, 0.75 * width)
    label = f"{symbol_of(quantity)}{unit_in_brackets(values)}"
    names = list(axes)
    ax.set_xlabel(names[0])
    if len(names) == 1:
        ax.plot(axes[names[0]], values.values, color=STABLE, marker=".", ms=3.0, lw=0.6)
        ax.set_ylabel(label)
        return ax
    mesh = ax.pcolormesh(*(cell_edges(axis) for axis in axes.values()), values.values.T, rasterized=True)
    ax.set_ylabel(names[1])
    ax.figure.colorbar(mesh, ax=ax, label=label)
    return ax


def symbol_of(quantity: str) -> str:
    """A coordinate's symbol, or a variable's name in words."""
    if quantity.startswith("theta") or len(quantity) == 1:
        return f"${symbol(quantity)}$ at the end"
    return quantity.replace("_", " ")


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
