"""Basins of attraction: the attractor to which each initial state leads, as colours, with the curves where they meet."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
from matplotlib.colors import BoundaryNorm, ListedColormap
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patheffects import Normal, Stroke

from saltus.plots.conventions import INK, SINGLE_COLUMN, new_figure, shades, styled

UNDECIDED = "#ffffff"
AT_REST = "#dddddd"  # lighter than every colour of a moving attractor
MARKERS = ("o", "s", "^", "D", "v", "P", "X", "<", ">", "p")
MARK: dict[str, Any] = {"linestyle": "none", "markersize": 4.5, "markerfacecolor": "white", "markeredgecolor": INK, "zorder": 6}
POINT: dict[str, Any] = MARK | {"marker": "o", "markersize": 1.8, "markeredgewidth": 0.4}  # of a set that does not repeat
BOUNDARY: dict[str, Any] = {"color": INK, "linewidth": 0.7, "zorder": 4}
HALO = [Stroke(linewidth=1.7, foreground="white", alpha=0.8), Normal()]  # so that the line shows on dark colours, too
MOST_NAMED = 8  # attractors in the legend


@styled
def draw_basins(dataset: Any, manifolds: Iterable[Any] = (), width: float = SINGLE_COLUMN) -> Figure:
    """A Figure from a dataset of `basins`.

    Rest is light grey, the other attractors go from dark to light by their labels, undecided cells are white; each attractor
    is marked at phase 0 of the load, one that does not repeat by some of its points.

    Args:
        dataset: from `saltus.attractors.basins.grid`.
        manifolds: arrays (n, 2) of coordinate and velocity, nan between pieces, such as `stable_manifold(orbit).states`, to be
            drawn besides the dataset's own.
        width: of the figure, mm.
    """
    name = next(str(dim) for dim in dataset["label"].dims if dim != "velocity")
    numbers = [int(n) for n in dataset["attractor"].values]
    rows = -(-min(len(numbers), MOST_NAMED) // 2)
    figure = new_figure(width, 0.86 * width + 4.2 * (rows + bool(dataset.attrs.get("undecided"))))
    ax = figure.subplots()
    x, y = dataset[name].values, dataset["velocity"].values
    colours = _colours(numbers)
    _paint(ax, x, y, dataset["label"].values, numbers, colours)
    own = (
        [np.stack([dataset[f"boundary_{name}"], dataset["boundary_velocity"]], axis=1)] if "boundary_velocity" in dataset else []
    )
    for states in (*own, *manifolds):
        points = np.asarray(states, dtype=float)
        ax.plot(points[:, 0], points[:, 1], path_effects=HALO, **BOUNDARY)
    for i, kind in enumerate(dataset["attractor_kind"].values):
        mark = {"marker": MARKERS[i % len(MARKERS)], **MARK} if kind in ("rest", "periodic") else POINT
        ax.plot(dataset[f"strobe_{name}"].values[i], dataset["strobe_velocity"].values[i], **mark)
    ax.set_xlim(_edges(x))
    ax.set_ylim(_edges(y))
    symbol = r"\theta" if name.startswith("theta") else name
    unit = " (rad)" if name.startswith("theta") else ""
    when = "" if _steady(dataset) else " at phase 0"
    ax.set_xlabel(rf"${symbol}${when}{unit}")
    ax.set_ylabel(rf"$\dot{{{symbol}}}${when}")
    handles = _legend(dataset, numbers, colours)
    figure.legend(handles=handles, loc="outside lower center", ncols=2, columnspacing=1.2, handletextpad=0.4)
    return figure


def _colours(numbers: list[int]) -> list[Any]:
    """One for each label, in order: rest apart, the others from dark to light."""
    moving = shades(sum(n != 0 for n in numbers))
    return [AT_REST if n == 0 else moving.pop(0) for n in numbers]


def _paint(ax: Any, x: np.ndarray, y: np.ndarray, label: np.ndarray, numbers: list[int], colours: list[Any]) -> None:
    """The cells in their colours; the grid may be uneven."""
    cells = np.zeros(label.shape, dtype=int)
    for i, number in enumerate(numbers):
        cells[label == number] = i + 1
    palette = ListedColormap([UNDECIDED, *colours])
    limits = np.arange(len(numbers) + 2) - 0.5
    ax.pcolormesh(_borders(x), _borders(y), cells, cmap=palette, norm=BoundaryNorm(limits, palette.N), rasterized=True, zorder=1)


def _borders(values: np.ndarray) -> np.ndarray:
    """The borders of cells around grid values, halfway between them."""
    if len(values) == 1:
        return np.array([values[0] - 0.5, values[0] + 0.5])
    half = 0.5 * np.diff(values)
    return np.concatenate([[values[0] - half[0]], values[:-1] + half, [values[-1] + half[-1]]])


def _edges(values: np.ndarray) -> tuple[float, float]:
    borders = _borders(values)
    return float(borders[0]), float(borders[-1])


def _legend(dataset: Any, numbers: list[int], colours: list[Any]) -> list[Line2D]:
    """What each colour and mark stands for, and its share of the cells."""
    handles = []
    for i, number in enumerate(numbers[:MOST_NAMED]):
        kind, periods = str(dataset["attractor_kind"].values[i]), int(dataset["attractor_period"].values[i])
        what = kind if kind != "periodic" else "equilibrium" if _steady(dataset) else f"period {periods}"
        text = f"{number}: {what}, {_percent(float(dataset['cells'].values[i]))}"
        handles.append(_handle(MARKERS[i % len(MARKERS)], colours[i], text))
    left = float(dataset.attrs.get("undecided", 0.0))
    if left:
        handles.append(_handle("s", UNDECIDED, f"undecided, {_percent(left)}"))
    return handles


def _steady(dataset: Any) -> bool:
    """Whether the load is constant: there are no phases then."""
    return bool(dataset.attrs.get("load") == "constant")


def _handle(marker: str, colour: Any, text: str) -> Line2D:
    return Line2D([], [], linestyle="none", marker=marker, markersize=6, markerfacecolor=colour, markeredgecolor=INK, label=text)


def _percent(share: float) -> str:
    return f"{100 * share:.3g} %" if share == 0.0 or share >= 1e-3 else "< 0.1 %"
