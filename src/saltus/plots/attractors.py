"""Attractors on the stroboscopic section: where they are at phase 0, and which initial states lead to each."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patheffects import Normal, Stroke

from saltus.plots.basins import AT_REST, MARK, MARKERS, MOST_NAMED, POINT
from saltus.plots.conventions import INK, SINGLE_COLUMN, new_figure, shades, styled
from saltus.plots.diagram import axis_name

START: dict[str, Any] = {
    "linestyle": "none",
    "marker": "o",
    "markersize": 2.6,
    "markeredgewidth": 0.3,
    "markeredgecolor": INK,
    "zorder": 3,
}
UNDECIDED = "white"
HALO = [Stroke(linewidth=2.2, foreground="white"), Normal()]  # so that an attractor stands out among the starts


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
        shape = MARKERS[i % len(MARKERS)]
        mark = POINT if str(dataset["attractor_kind"].values[i]) not in ("rest", "periodic") else MARK | {"marker": shape}
        ax.plot(*points, path_effects=HALO, **{**mark, "markerfacecolor": colours[n]})
    when = "" if _steady(dataset) else " at phase 0"
    ax.set_xlabel(rf"${symbol}${when}{unit}")
    ax.set_ylabel(rf"$\dot{{{symbol}}}${when}")
    _legend(figure, dataset, numbers, colours, bool((ends == -1).any()))
    return figure


def _steady(dataset: Any) -> bool:
    """Whether the load is constant: there are no phases then."""
    return bool(dataset.attrs.get("load") == "constant")


def _legend(figure: Figure, dataset: Any, numbers: list[int], colours: dict[int, Any], undecided: bool) -> None:
    """What each colour and mark stands for, and its share of the starts."""
    handles = [_handle(MARKERS[i % len(MARKERS)], colours[n], _words(dataset, i, n)) for i, n in enumerate(numbers[:MOST_NAMED])]
    if undecided:
        handles.append(_handle("o", UNDECIDED, f"undecided, {100 * float(dataset.attrs['undecided']):.3g} %"))
    figure.legend(handles=handles, loc="outside lower center", ncols=2, columnspacing=1.2, handletextpad=0.4)


def _handle(marker: str, colour: Any, text: str) -> Line2D:
    return Line2D([], [], linestyle="none", marker=marker, markersize=6, markerfacecolor=colour, markeredgecolor=INK, label=text)


def _words(dataset: Any, i: int, label: int) -> str:
    kind, periods = str(dataset["attractor_kind"].values[i]), int(dataset["attractor_period"].values[i])
    share, error = (100 * float(dataset[v].values[i]) for v in ("fraction", "fraction_error"))
    what = kind if kind != "periodic" else "equilibrium" if _steady(dataset) else f"period {periods}"
    text = f"{label}: {what}"
    return text if np.isnan(share) else f"{text}, {share:.3g} %" if error == 0.0 else f"{text}, {share:.1f} ± {error:.1f} %"
