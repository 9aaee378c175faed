"""Attractors on the stroboscopic section: where they are at phase 0, and which initial states lead to each."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.figure import Figure

from saltus.plots.basins import AT_REST, MARK, MARKERS
from saltus.plots.diagram import axis_name
from saltus.plots.style import INK, SINGLE_COLUMN, new_figure, shades, styled

START: dict[str, Any] = {
    "linestyle": "none",
    "marker": "o",
    "markersize": 2.6,
    "markeredgewidth": 0.3,
    "markeredgecolor": INK,
    "zorder": 3,
}
UNDECIDED = "white"


@styled
def draw_attractors(dataset: Any, width: float = 1.3 * SINGLE_COLUMN) -> Figure:
    """A Figure from a dataset of `saltus.attractors.attractors`: a dot for each start, a mark for each point at phase 0."""
    name = next(str(v).removeprefix("strobe_") for v in dataset if str(v).startswith("strobe_") and v != "strobe_velocity")
    numbers = [int(n) for n in dataset["attractor"].values]
    moving = shades(sum(n != 0 for n in numbers))
    colours = {n: AT_REST if n == 0 else moving.pop(0) for n in numbers} | {-1: UNDECIDED}
    symbol, unit = axis_name(name)
    figure = new_figure(width, 0.82 * width + 4.2 * (len(numbers) + 1) // 2)
    ax = figure.subplots()
    ends = dataset["end"].values
    for n, colour in colours.items():
        here = ends == n
        ax.plot(dataset[f"start_{name}"].values[here], dataset["start_velocity"].values[here], color=colour, **START)
    for i, n in enumerate(numbers):
        points = (dataset[f"strobe_{name}"].values[i], dataset["strobe_velocity"].values[i])
        ax.plot(*points, marker=MARKERS[i % len(MARKERS)], label=_words(dataset, i, n), **{**MARK, "markerfacecolor": colours[n]})
    ax.set_xlabel(rf"${symbol}$ at phase 0{unit}")
    ax.set_ylabel(rf"${symbol}'$ at phase 0")
    figure.legend(loc="outside lower center", ncols=2, columnspacing=1.2, handletextpad=0.4)
    return figure


def _words(dataset: Any, i: int, label: int) -> str:
    kind, periods = str(dataset["attractor_kind"].values[i]), int(dataset["attractor_periods"].values[i])
    share, error = (100 * float(dataset[v].values[i]) for v in ("fraction", "fraction_error"))
    name = f"{label}: {kind}" + (f", period {periods}" if periods else "")
    return name if np.isnan(share) else f"{name}, {share:.1f} ± {error:.1f} %"
