"""A diagram of a study on its own: the branches above, the stroboscopic points of direct simulation below."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.figure import Figure

from saltus.plots.response import draw_bands, draw_response, highest, legend
from saltus.plots.style import DOUBLE_COLUMN, INK, new_figure, styled

NAMES = {"load.frequency": r"frequency $\Omega$", "load.horizontal.amplitude": r"load amplitude $\widehat{\mathcal{H}}$"}
POINTS: dict[str, Any] = {
    "color": INK,
    "linestyle": "none",
    "marker": ".",
    "markersize": 1.3,
    "markeredgewidth": 0.0,
    "rasterized": True,
}
AT_REST = 1e-9  # of the largest: a motion that is smaller in every period is left out


@styled
def draw_diagram(tree: Any) -> Figure:
    """A Figure from the DataTree of `response_spectrum` or `bifurcation_diagram`."""
    low, high = tree.attrs["bounds"]
    symbol, unit = axis_name(tree.attrs["coordinate"])
    brute = "strobes" in tree.children
    figure = new_figure(DOUBLE_COLUMN, 150.0 if brute else 95.0)
    axes = figure.subplots(1 + brute, 1, sharex=True, squeeze=False, height_ratios=[3, 2][: 1 + brute])[:, 0]
    axes[0].set_xlim(low, high)
    top = highest(tree, low, high) if any(name.startswith("branch_") for name in tree.children) else 1.0
    axes[0].set_ylim(0.0, 1.08 * top)
    axes[0].set_ylabel(rf"$\max_\tau|{symbol}|${unit}")
    draw_response(axes[0], tree)
    if brute:
        draw_strobes(axes[1], tree)
        axes[1].set_ylabel(rf"${symbol}$ at phase 0{unit}")
    axes[-1].set_xlabel(NAMES.get(tree.attrs["path"], tree.attrs["path"]))
    legend(figure, [tree], limits=False)
    return figure


def draw_strobes(ax: Any, tree: Any) -> None:
    """The brute-force diagram: where motions are at phase 0 of the load, period after period, from every start."""
    strobes = tree["strobes"]
    draw_bands(ax, tree)
    places = strobes["position"].values
    moving = np.nanmax(strobes["peak"].values, axis=2, initial=0.0) > AT_REST
    values = np.broadcast_to(strobes["value"].values[:, None, None], places.shape)
    ax.plot(values[moving].ravel(), places[moving].ravel(), **POINTS)


def axis_name(coordinate: str) -> tuple[str, str]:
    """The symbol of a coordinate, and its unit in brackets."""
    return (r"\theta" + coordinate.removeprefix("theta"), " (rad)") if coordinate.startswith("theta") else (coordinate, "")
