"""Attractors on the stroboscopic section, and basins: the attractor to which each initial state
leads, and where they meet.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import BoundaryNorm, ListedColormap
from matplotlib.lines import Line2D
from matplotlib.patches import Circle
from matplotlib.patheffects import Normal, Stroke
from matplotlib.ticker import FormatStrFormatter, LogLocator, MaxNLocator, NullFormatter

from saltus.plots.conventions import (
    LOOK,
    axes_or_new,
    cell_edges,
    drawing,
    legend_of,
    shades,
    state_symbol,
    symbol,
    unit_in_brackets,
)

START_MARK: dict[str, Any] = {
    "linestyle": "none",
    "marker": "o",
    "markersize": 2.6,
    "markeredgewidth": 0.3,
    "markeredgecolor": LOOK.ink,
    "zorder": 3,
}
# so that an attractor stands out among the starts
HALO = [Stroke(linewidth=2.2, foreground="white"), Normal()]


@drawing
def draw_attractors(
    dataset: Any, *, ax: Axes | None = None, width: float = 1.3 * LOOK.single_column
) -> Axes:
    """Draw the dataset of `find_attractors`: a dot for each start, a mark for each state at phase
    0; returns `ax`.
    """
    x, y = (str(name) for name in dataset.attrs["plane"])
    colours = attractor_colours([int(n) for n in dataset["attractor"].values])
    own, ax = ax is None, axes_or_new(ax, width, 0.82 * width + 4.2 * (len(colours) + 1) // 2)
    ends = dataset["end"].values
    for n, colour in {**colours, -1: UNDECIDED_COLOUR}.items():
        here = ends == n
        ax.plot(
            dataset[f"start_{x}"].values[here],
            dataset[f"start_{y}"].values[here],
            color=colour,
            **START_MARK,
        )
    for i, colour in enumerate(colours.values()):
        draw_points(ax, dataset, i, markerfacecolor=colour, path_effects=HALO)
    name_plane(ax, (x, y), unit_in_brackets(dataset[f"start_{x}"]), steady(dataset))
    undecided = (
        ("o", f"{100 * float(dataset.attrs['undecided']):.3g} %") if (ends == -1).any() else None
    )
    attractor_legend(ax, own, dataset, colours, lambda i: _share(dataset, i), undecided)
    return ax


def _share(dataset: Any, i: int) -> str:
    """The share of the starts that lead to an attractor, with its error."""
    share, error = (100 * float(dataset[v].values[i]) for v in ("fraction", "fraction_error"))
    return (
        ""
        if np.isnan(share)
        else f", {share:.3g} %"
        if error == 0.0
        else f", {share:.1f} ± {error:.1f} %"
    )


UNDECIDED_COLOUR = "#ffffff"
AT_REST = "#dddddd"  # lighter than every colour of a moving attractor
MARKERS = ("o", "s", "^", "D", "v", "P", "X", "<", ">", "p")
MARK: dict[str, Any] = {
    "linestyle": "none",
    "markersize": 4.5,
    "markerfacecolor": "white",
    "markeredgecolor": LOOK.ink,
    "zorder": 6,
}
# of a set that does not repeat
POINT: dict[str, Any] = MARK | {"marker": "o", "markersize": 1.8, "markeredgewidth": 0.4}
MOST_NAMED = 8  # attractors in the legend


def attractor_colours(numbers: Sequence[int]) -> dict[int, Any]:
    """A colour for each label: rest apart, the others from dark to light in their order."""
    moving = shades(sum(n != 0 for n in numbers))
    return {n: AT_REST if n == 0 else moving.pop(0) for n in numbers}


def draw_points(ax: Any, dataset: Any, i: int, **style: Any) -> None:
    """Attractor `i` at phase 0 of the load: large marks if it is periodic, else some of its
    points.
    """
    repeats = str(dataset["attractor_kind"].values[i]) in ("rest", "periodic")
    mark = MARK | {"marker": MARKERS[i % len(MARKERS)]} if repeats else POINT
    x, y = (dataset[f"section_{name}"].values[i] for name in dataset.attrs["plane"])
    ax.plot(x, y, **{**mark, **style})


def name_plane(ax: Any, plane: tuple[str, str], unit: str, constant: bool) -> None:
    """The names of the two state variables on the axes; under a `constant` load there is no
    phase.
    """
    when = "" if constant else " at phase 0"
    ax.set_xlabel(f"${symbol(plane[0])}${when}{unit}")
    ax.set_ylabel(f"${state_symbol(plane[1], plane)}${when}{unit}")


def steady(dataset: Any) -> bool:
    """Whether the load is constant: there are no phases then."""
    return bool(dataset.attrs.get("load") == "constant")


def attractor_legend(
    ax: Any,
    own: bool,
    dataset: Any,
    colours: dict[int, Any],
    share: Callable[[int], str],
    undecided: tuple[str, str] | None,
) -> None:
    """A legend of the colours and marks, with `share(i)` of attractor i, and the mark and share of
    undecided states.
    """
    handles = []
    for i, (number, colour) in enumerate([*colours.items()][:MOST_NAMED]):
        text = f"{number}: {_kind(dataset, i)}{share(i)}"
        handles.append(_handle(MARKERS[i % len(MARKERS)], colour, text))
    if undecided is not None:
        handles.append(_handle(undecided[0], UNDECIDED_COLOUR, f"undecided, {undecided[1]}"))
    legend_of(ax, own, handles, ncols=2, columnspacing=1.2, handletextpad=0.4)


def _kind(dataset: Any, i: int) -> str:
    kind = str(dataset["attractor_kind"].values[i])
    period = int(dataset["attractor_period"].values[i])
    return kind if kind != "periodic" else "equilibrium" if steady(dataset) else f"period {period}"


def _handle(marker: str, colour: Any, text: str) -> Line2D:
    return Line2D(
        [],
        [],
        linestyle="none",
        marker=marker,
        markersize=6,
        markerfacecolor=colour,
        markeredgecolor=LOOK.ink,
        label=text,
    )


BOUNDARY: dict[str, Any] = {"color": LOOK.ink, "linewidth": 0.7, "zorder": 4}
# so that the line shows on dark colours, too
LINE_HALO = [Stroke(linewidth=1.7, foreground="white", alpha=0.8), Normal()]


@drawing
def draw_basins(
    dataset: Any,
    manifolds: Iterable[Any] = (),
    *,
    ax: Axes | None = None,
    width: float = LOOK.single_column,
) -> Axes:
    """Draw a dataset of basins, such as `saltus.attractors.basins_of_attraction` gives.

    Rest is light grey, the other attractors go from dark to light by their labels, undecided cells
    are white; each attractor is marked at phase 0 of the load, one that does not repeat by some of
    its points.

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
    colours = attractor_colours([int(n) for n in dataset["attractor"].values])
    left = float(dataset.attrs.get("undecided", 0.0))
    rows = -(-min(len(colours), MOST_NAMED) // 2)
    own, ax = ax is None, axes_or_new(ax, width, 0.86 * width + 4.2 * (rows + bool(left)))
    _paint(ax, dataset, (x, y), colours)
    curves = (
        [np.stack([dataset[f"boundary_{x}"], dataset[f"boundary_{y}"]], 1)]
        if f"boundary_{x}" in dataset
        else []
    )
    for states in (*curves, *manifolds):
        ax.plot(*np.asarray(states, dtype=float).T, path_effects=LINE_HALO, **BOUNDARY)
    for i in range(len(colours)):
        draw_points(ax, dataset, i)
    name_plane(ax, (x, y), unit_in_brackets(dataset[x]), steady(dataset))
    share = dataset["cells"].values
    undecided = ("s", _percent(left)) if left else None
    attractor_legend(
        ax, own, dataset, colours, lambda i: f", {_percent(float(share[i]))}", undecided
    )
    return ax


@drawing
def draw_integrity(
    dataset: Any, *, ax: Axes | None = None, width: float = LOOK.single_column
) -> Axes:
    """Draw the dataset of `basin_integrity`: the largest circle in each basin (solid), and the one
    around the attractor's state that is nearest to another basin (dashed), with the measures; in
    the axes of `draw_basins` they lie on the basins."""
    own = ax is None
    colours = attractor_colours([int(n) for n in dataset["attractor"].values])
    ax = axes_or_new(ax, width, 0.86 * width + 4.2 * min(len(colours), MOST_NAMED))
    handles = []
    for i, (number, colour) in enumerate(colours.items()):
        for name, radius, line in (("centre", "factor", "-"), ("nearest", "distance", "--")):
            place = dataset[name].values[i]
            size = float(dataset[radius].values[i])
            if np.isfinite([*place, size]).all():
                ax.add_patch(
                    Circle(
                        tuple(place), size, fill=False, edgecolor="white", linewidth=2.4, zorder=6
                    )
                )
                ax.add_patch(
                    Circle(
                        tuple(place),
                        size,
                        fill=False,
                        linestyle=line,
                        linewidth=1.2,
                        zorder=7,
                        edgecolor=colour if own else LOOK.ink,
                    )
                )
        ax.plot(
            *dataset["nearest"].values[i],
            **MARK | {"marker": MARKERS[i % len(MARKERS)], "zorder": 8},
        )
        area, factor, distance = (
            f"{float(dataset[name].values[i]):.3g}" for name in ("area", "factor", "distance")
        )
        text = f"{number}: area {area}, largest circle {factor}, distance {distance}"
        handles.append(_handle(MARKERS[i % len(MARKERS)], colour, text))
    if own:
        ax.autoscale_view()
        x, y = dataset["plane"].values.tolist()
        name_plane(ax, (str(x), str(y)), unit_in_brackets(dataset["centre"]), steady(dataset))
        legend_of(ax, own, handles[:MOST_NAMED])
    return ax


def _paint(ax: Any, dataset: Any, plane: tuple[str, str], colours: dict[int, Any]) -> None:
    """The cells in their colours; the grid may be uneven."""
    label = dataset["label"].values
    edges = [cell_edges(dataset[name].values) for name in plane]
    cells = np.zeros(label.shape, dtype=int)
    for i, number in enumerate(colours):
        cells[label == number] = i + 1
    palette = ListedColormap([UNDECIDED_COLOUR, *colours.values()])
    limits = np.arange(len(colours) + 2) - 0.5
    ax.pcolormesh(
        *edges, cells, cmap=palette, norm=BoundaryNorm(limits, palette.N), rasterized=True, zorder=1
    )
    ax.set_xlim(edges[0][[0, -1]])
    ax.set_ylim(edges[1][[0, -1]])


def _percent(share: float) -> str:
    return f"{100 * share:.3g} %" if share == 0.0 or share >= 1e-3 else "< 0.1 %"


@drawing
def draw_uncertainty(
    dataset: Any, *, ax: Axes | None = None, width: float = LOOK.single_column
) -> Axes:
    """Draw the share of uncertain states over the distance, on logarithmic axes, with the power law
    that was fitted.
    """
    own = ax is None
    ax = axes_or_new(ax, width, 0.75 * width)
    distance = dataset["distance"].values
    share = dataset["share"].values
    alpha = float(dataset.attrs["alpha"])
    error = float(dataset.attrs["error"])
    known = share > 0.0
    ax.loglog(
        distance[known],
        share[known],
        ls="none",
        marker="o",
        ms=4.0,
        mfc="white",
        mec=LOOK.ink,
        label="grid",
    )
    if np.isfinite(alpha) and known.any():
        middle = np.exp(np.mean(np.log(share[known]) - alpha * np.log(distance[known])))
        label = rf"$\varepsilon^\alpha$, $\alpha={alpha:.3f}\pm{error:.3f}$"
        ax.loglog(distance, middle * distance**alpha, label=label, **LOOK.stable_line)
    for axis in (ax.xaxis, ax.yaxis):
        axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
        axis.set_major_formatter(FormatStrFormatter("%g"))
        axis.set_minor_formatter(NullFormatter())
    ax.set_xlabel(r"distance $\varepsilon$ (cells)")
    ax.set_ylabel(r"share $f(\varepsilon)$ of uncertain states")
    legend_of(ax, own)
    return ax


@drawing
def draw_wada(dataset: Any, *, ax: Axes | None = None, width: float = LOOK.single_column) -> Axes:
    """Draw the share of the boundary cells that have all basins within a radius, and the shares
    from which a verdict follows.
    """
    own = ax is None
    ax = axes_or_new(ax, width, 0.75 * width)
    ax.plot(
        dataset["radius"].values,
        dataset["share"].values,
        color=LOOK.stable,
        marker="o",
        ms=4.0,
        lw=0.9,
        label="boundary cells",
    )
    for name, label in (("agrees", "agrees with Wada above"), ("fails", "does not below")):
        style = {**LOOK.limit_line, "linestyle": "-" if name == "agrees" else (0, (1, 1.2))}
        ax.axhline(float(dataset.attrs[name]), label=label, **style)
    ax.set_ylim(-0.03, 1.03)
    ax.set_xlabel("radius (cells)")
    ax.set_ylabel("share with all basins within the radius")
    ax.xaxis.set_major_locator(MaxNLocator(integer=True))
    ax.set_title(
        f"{np.size(dataset.attrs['labels'])} basins, verdict: {dataset.attrs['verdict']}",
        loc="left",
        pad=4,
    )
    legend_of(ax, own)
    return ax
