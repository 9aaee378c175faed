"""Attractors on the stroboscopic section: their colours, marks and legend, and the initial states that lead to each."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.patheffects import Normal, Stroke

from saltus.plots.axis_names import state_symbol, symbol, unit_in_brackets
from saltus.plots.conventions import INK, SINGLE_COLUMN, axes_or_new, drawing, legend_of, shades

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


UNDECIDED_COLOUR = "#ffffff"
AT_REST = "#dddddd"  # lighter than every colour of a moving attractor
MARKERS = ("o", "s", "^", "D", "v", "P", "X", "<", ">", "p")
MARK: dict[str, Any] = {"linestyle": "none", "markersize": 4.5, "markerfacecolor": "white", "markeredgecolor": INK, "zorder": 6}
POINT: dict[str, Any] = MARK | {"marker": "o", "markersize": 1.8, "markeredgewidth": 0.4}  # of a set that does not repeat
MOST_NAMED = 8  # attractors in the legend


def attractor_colours(numbers: Sequence[int]) -> dict[int, Any]:
    """A colour for each label: rest apart, the others from dark to light in their order."""
    moving = shades(sum(n != 0 for n in numbers))
    return {n: AT_REST if n == 0 else moving.pop(0) for n in numbers}


def draw_points(ax: Any, dataset: Any, i: int, **style: Any) -> None:
    """Attractor `i` at phase 0 of the load: large marks if it is periodic, else some of its points."""
    repeats = str(dataset["attractor_kind"].values[i]) in ("rest", "periodic")
    mark = MARK | {"marker": MARKERS[i % len(MARKERS)]} if repeats else POINT
    x, y = (dataset[f"section_{name}"].values[i] for name in dataset.attrs["plane"])
    ax.plot(x, y, **{**mark, **style})


def name_plane(ax: Any, plane: tuple[str, str], unit: str, constant: bool) -> None:
    """The names of the two state variables on the axes; under a `constant` load there is no phase."""
    when = "" if constant else " at phase 0"
    ax.set_xlabel(f"${symbol(plane[0])}${when}{unit}")
    ax.set_ylabel(f"${state_symbol(plane[1], plane)}${when}{unit}")


def steady(dataset: Any) -> bool:
    """Whether the load is constant: there are no phases then."""
    return bool(dataset.attrs.get("load") == "constant")


def attractor_legend(
    ax: Any, own: bool, dataset: Any, colours: dict[int, Any], share: Callable[[int], str], undecided: tuple[str, str] | None
) -> None:
    """A legend of the colours and marks, with `share(i)` of attractor i, and the mark and share of undecided states."""
    handles = []
    for i, (number, colour) in enumerate([*colours.items()][:MOST_NAMED]):
        text = f"{number}: {_kind(dataset, i)}{share(i)}"
        handles.append(_handle(MARKERS[i % len(MARKERS)], colour, text))
    if undecided is not None:
        handles.append(_handle(undecided[0], UNDECIDED_COLOUR, f"undecided, {undecided[1]}"))
    legend_of(ax, own, handles, ncols=2, columnspacing=1.2, handletextpad=0.4)


def _kind(dataset: Any, i: int) -> str:
    kind, period = str(dataset["attractor_kind"].values[i]), int(dataset["attractor_period"].values[i])
    return kind if kind != "periodic" else "equilibrium" if steady(dataset) else f"period {period}"


def _handle(marker: str, colour: Any, text: str) -> Line2D:
    return Line2D([], [], linestyle="none", marker=marker, markersize=6, markerfacecolor=colour, markeredgecolor=INK, label=text)
