"""Basins of attraction: the attractor to which each initial state leads, as colours, with the curves where they meet."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import BoundaryNorm, ListedColormap
from matplotlib.patheffects import Normal, Stroke

from saltus.plots.attractor_marks import (
    MOST_NAMED,
    UNDECIDED_COLOUR,
    attractor_colours,
    attractor_legend,
    draw_points,
    name_plane,
    steady,
)
from saltus.plots.axis_names import unit_in_brackets
from saltus.plots.conventions import INK, SINGLE_COLUMN, axes_or_new
from saltus.plots.drawing import drawing
from saltus.plots.marks import cell_edges

BOUNDARY: dict[str, Any] = {"color": INK, "linewidth": 0.7, "zorder": 4}
HALO = [Stroke(linewidth=1.7, foreground="white", alpha=0.8), Normal()]  # so that the line shows on dark colours, too


@drawing
def draw_basins(dataset: Any, manifolds: Iterable[Any] = (), *, ax: Axes | None = None, width: float = SINGLE_COLUMN) -> Axes:
    """Draw a dataset of basins, such as `saltus.attractors.basins_of_attraction` gives.

    Rest is light grey, the other attractors go from dark to light by their labels, undecided cells are white; each attractor
    is marked at phase 0 of the load, one that does not repeat by some of its points.

    Parameters
    ----------
    dataset
        The labels of the cells, and the attractors.
    manifolds
        Arrays (n, 2) of coordinate and velocity, nan where they are interrupted, such as
        `stable_manifold(orbit).states`, to be drawn besides the dataset's own.
    ax
        The axes to draw into; by default those of a figure of its own.
    width
        Of that figure, mm.

    Returns
    -------
    Axes
        The axes.
    """
    y, x = (str(dim) for dim in dataset["label"].dims)
    colours, left = attractor_colours([int(n) for n in dataset["attractor"].values]), float(dataset.attrs.get("undecided", 0.0))
    rows = -(-min(len(colours), MOST_NAMED) // 2)
    own, ax = ax is None, axes_or_new(ax, width, 0.86 * width + 4.2 * (rows + bool(left)))
    _paint(ax, dataset, (x, y), colours)
    curves = [np.stack([dataset[f"boundary_{x}"], dataset[f"boundary_{y}"]], 1)] if f"boundary_{x}" in dataset else []
    for states in (*curves, *manifolds):
        ax.plot(*np.asarray(states, dtype=float).T, path_effects=HALO, **BOUNDARY)
    for i in range(len(colours)):
        draw_points(ax, dataset, i)
    name_plane(ax, (x, y), unit_in_brackets(dataset[x]), steady(dataset))
    share, undecided = dataset["cells"].values, ("s", _percent(left)) if left else None
    attractor_legend(ax, own, dataset, colours, lambda i: f", {_percent(float(share[i]))}", undecided)
    return ax


def _paint(ax: Any, dataset: Any, plane: tuple[str, str], colours: dict[int, Any]) -> None:
    """The cells in their colours; the grid may be uneven."""
    label, edges = dataset["label"].values, [cell_edges(dataset[name].values) for name in plane]
    cells = np.zeros(label.shape, dtype=int)
    for i, number in enumerate(colours):
        cells[label == number] = i + 1
    palette = ListedColormap([UNDECIDED_COLOUR, *colours.values()])
    limits = np.arange(len(colours) + 2) - 0.5
    ax.pcolormesh(*edges, cells, cmap=palette, norm=BoundaryNorm(limits, palette.N), rasterized=True, zorder=1)
    ax.set_xlim(edges[0][[0, -1]])
    ax.set_ylim(edges[1][[0, -1]])


def _percent(share: float) -> str:
    return f"{100 * share:.3g} %" if share == 0.0 or share >= 1e-3 else "< 0.1 %"
