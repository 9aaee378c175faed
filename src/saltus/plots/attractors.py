"""Attractors on the stroboscopic section: their states at phase 0, and the initial states that lead to each."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patheffects import Normal, Stroke

from saltus.plots.attractor_marks import UNDECIDED_COLOUR, attractor_colours, attractor_legend, draw_points, name_plane, steady
from saltus.plots.axis_names import unit_in_brackets
from saltus.plots.conventions import INK, SINGLE_COLUMN, axes_or_new
from saltus.plots.drawing import drawing

START_MARK: dict[str, Any] = {
    "linestyle": "none",
    "marker": "o",
    "markersize": 2.6,
    "markeredgewidth": 0.3,
    "markeredgecolor": INK,
    "zorder": 3,
}
HALO = [Stroke(linewidth=2.2, foreground="white"), Normal()]  # so that an attractor stands out among the starts


@drawing
def draw_attractors(dataset: Any, *, ax: Axes | None = None, width: float = 1.3 * SINGLE_COLUMN) -> Axes:
    """Draw the dataset of `find_attractors`: a dot for each start, a mark for each state at phase 0; returns `ax`."""
    x, y = (str(name) for name in dataset.attrs["plane"])
    colours = attractor_colours([int(n) for n in dataset["attractor"].values])
    own, ax = ax is None, axes_or_new(ax, width, 0.82 * width + 4.2 * (len(colours) + 1) // 2)
    ends = dataset["end"].values
    for n, colour in {**colours, -1: UNDECIDED_COLOUR}.items():
        here = ends == n
        ax.plot(dataset[f"start_{x}"].values[here], dataset[f"start_{y}"].values[here], color=colour, **START_MARK)
    for i, colour in enumerate(colours.values()):
        draw_points(ax, dataset, i, markerfacecolor=colour, path_effects=HALO)
    name_plane(ax, (x, y), unit_in_brackets(dataset[f"start_{x}"]), steady(dataset))
    undecided = ("o", f"{100 * float(dataset.attrs['undecided']):.3g} %") if (ends == -1).any() else None
    attractor_legend(ax, own, dataset, colours, lambda i: _share(dataset, i), undecided)
    return ax


def _share(dataset: Any, i: int) -> str:
    """The share of the starts that lead to an attractor, with its error."""
    share, error = (100 * float(dataset[v].values[i]) for v in ("fraction", "fraction_error"))
    return "" if np.isnan(share) else f", {share:.3g} %" if error == 0.0 else f", {share:.1f} ± {error:.1f} %"
