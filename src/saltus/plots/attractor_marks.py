"""Colours, marks and names of attractors on the stroboscopic section, and their legend: for basins and for scattered starts."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from matplotlib.lines import Line2D

from saltus.plots.axis_names import state_symbol, symbol
from saltus.plots.conventions import INK, legend_of, shades

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
