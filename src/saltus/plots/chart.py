"""Stability charts: the largest amplitude over the plane of two loads, the number of motions, and borders over it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import matplotlib as mpl
import numpy as np

from saltus.plots.conventions import INK, LIMIT, SINGLE_COLUMN, UNSTABLE, new_figure, styled
from saltus.plots.diagram import parameter_name

COLOURS = "viridis_r"  # large amplitudes dark, beside the white of rest small ones light
LEVELS = 12
CHAOS = "#c9c9c9"
BORDERS: dict[str, Any] = {"LP": "-", "PD": (0, (5, 1.5)), "BPC": (0, (5, 1.2, 1, 1.2)), "GR": (0, (1, 1.1))}
DOT: dict[str, Any] = {"linestyle": "none", "marker": ".", "color": INK, "markersize": 2.0, "markeredgewidth": 0.0}
NAMES = {"LP": "fold", "PD": "period doubling", "BPC": "symmetry breaking", "GR": "grazing"}


@styled
def draw_stability_chart(data: Any) -> Any:
    """A chart as it is stored, or a tree of one with its borders, with its scale and what its marks mean."""
    from matplotlib.lines import Line2D

    chart = data["chart"].to_dataset() if data_is_tree(data) else data
    figure = new_figure(1.2 * SINGLE_COLUMN, 98.0)
    ax = figure.subplots()
    cells = draw_chart(ax, chart)
    path = list(chart.attrs.get("path", ("horizontal", "vertical")))
    ax.set_xlabel(parameter_name(path[0]))
    ax.set_ylabel(parameter_name(path[1]))
    if cells is not None:
        ticks = cells.norm.boundaries[::2]
        figure.colorbar(cells, ax=ax, label=r"largest amplitude $\max_\tau|\theta|$ (rad)", ticks=ticks, format="%.2g")
    handles = list(_marks(chart))
    if chart is not data:
        dots = draw_lines(ax, data)
        handles += _line_handles(curves_of(data), "static" in data.children)
        handles += [Line2D([], [], **DOT, label="end of motions")] if dots else []
    if handles:
        figure.legend(handles=handles, loc="outside lower center", ncols=2, columnspacing=1.4, handletextpad=0.6)
    return figure


def data_is_tree(data: Any) -> bool:
    """Whether a result is a tree of datasets."""
    return bool(getattr(data, "children", None))


def curves_of(tree: Any) -> list[Any]:
    """The exact borders of a tree that holds a chart."""
    borders = tree["borders"]
    return [borders[name].to_dataset() for name in sorted(borders.children) if name.startswith("curve_")]


def draw_lines(ax: Any, tree: Any) -> int:
    """All borders of a tree that holds a chart; returns how many dots there are."""
    draw_borders(ax, curves_of(tree))
    if "static" in tree.children:
        draw_static(ax, tree["static"])
    return draw_ends(ax, tree["chart"].to_dataset(), tree["borders"]["ends"].to_dataset())


def _marks(chart: Any) -> Iterator[Any]:
    """What the marks in a chart mean, those that are there."""
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    resting = (chart["count"] == 0) & (chart["unsettled"] == 0)
    if bool(resting.any()):
        yield Patch(facecolor="white", edgecolor=INK, linewidth=0.4, label="rest alone")
    if bool((chart["count"] >= 2).any()):
        with mpl.rc_context({"hatch.linewidth": 0.3}):
            yield Patch(facecolor="#7fb8a8", edgecolor="white", hatch="......", label="several motions")
    if bool(((chart["count"] == 0) & (chart["unsettled"] > 0)).any()):
        yield Patch(facecolor=CHAOS, label="none settles")
    if "beyond_line" in chart and int(chart["beyond_line"].sum()) > 0:
        yield Line2D([], [], color=LIMIT, lw=0.9, label=r"$\max_\tau|\theta|=\pi-\beta_0$")
    if "beyond_kinematic" in chart and bool(chart["beyond_kinematic"].any()):
        cross: dict[str, Any] = {"marker": "x", "markersize": 4, "markeredgewidth": 0.8, "color": UNSTABLE, "linestyle": "none"}
        yield Line2D([], [], label="beyond the kinematic limit", **cross)


def draw_chart(ax: Any, chart: Any, top: float | None = None) -> Any:
    """The cells: coloured by the largest amplitude, dotted where there are several motions, grey where none settles, white where
    rest is alone; crosses where the largest goes beyond the kinematic limit. Returns what a colour bar needs, or None."""
    x, y = chart["horizontal"].values, chart["vertical"].values
    amplitude = chart["amplitude"].transpose("vertical", "horizontal").values
    number = chart["count"].transpose("vertical", "horizontal").values
    unsettled = chart["unsettled"].transpose("vertical", "horizontal").values > 0
    edges = _edges(x), _edges(y)
    ax.set_xlim(*((x[0], x[-1]) if len(x) > 1 else edges[0]))
    ax.set_ylim(*((y[0], y[-1]) if len(y) > 1 else edges[1]))
    wild = np.where((number == 0) & unsettled, 1.0, np.nan)
    ax.pcolormesh(*edges, wild, cmap=mpl.colors.ListedColormap([CHAOS]), rasterized=True, zorder=1)
    if not np.isfinite(amplitude).any():
        return None
    highest = float(np.nanmax(amplitude)) if top is None else top
    levels = highest * np.linspace(0.0, 1.0, LEVELS + 1) ** 2  # finer where amplitudes are small
    norm = mpl.colors.BoundaryNorm(levels, 256)
    cells = ax.pcolormesh(*edges, amplitude, cmap=COLOURS, norm=norm, rasterized=True, zorder=1)
    _hatch(ax, x, y, number >= 2)
    if "beyond_kinematic" in chart:
        rows, columns = np.nonzero(chart["beyond_kinematic"].transpose("vertical", "horizontal").values)
        ax.plot(x[columns], y[rows], linestyle="none", marker="x", color=UNSTABLE, markersize=1.5, markeredgewidth=0.3, zorder=3)
    if "beyond_line" in chart:
        _outline(ax, *edges, chart["beyond_line"].transpose("vertical", "horizontal").values)
    return cells


def _edges(middle: np.ndarray) -> np.ndarray:
    """The edges of cells about their middles."""
    if len(middle) == 1:
        return middle[0] + np.array([-0.5, 0.5])
    inner = (middle[1:] + middle[:-1]) / 2
    return np.concatenate([[2 * middle[0] - inner[0]], inner, [2 * middle[-1] - inner[-1]]])


def _hatch(ax: Any, x: np.ndarray, y: np.ndarray, where: np.ndarray) -> None:
    """Dots over the cells, without a line about them."""
    if min(where.shape) < 2 or not where.any():
        return
    with mpl.rc_context({"hatch.linewidth": 0.3, "hatch.color": "white"}):
        ax.contourf(x, y, where.astype(float), levels=[0.5, 1.5], colors="none", hatches=["......"], zorder=2)


def _outline(ax: Any, x: np.ndarray, y: np.ndarray, where: np.ndarray) -> None:
    """A green line about the cells, along their edges."""
    padded = np.pad(where, 1, mode="edge").astype(int)
    across, down = np.diff(padded, axis=1)[1:-1], np.diff(padded, axis=0)[:, 1:-1]
    lines = [((x[j], y[i]), (x[j], y[i + 1])) for i, j in np.argwhere(across)]
    lines += [((x[j], y[i]), (x[j + 1], y[i])) for i, j in np.argwhere(down)]
    ax.add_collection(mpl.collections.LineCollection(lines, colors=LIMIT, linewidths=0.9, zorder=4))


def draw_static(ax: Any, static: Any) -> None:
    """The quasi-static border in red: solid where it is the true one, dotted the part of the paper's that is not."""
    vertical, critical, true = (static[name].values for name in ("vertical", "critical", "true"))
    last = max(int(np.argmax(true > 0)) - 1, 0)  # where the border reaches Hhat = 0; below it there is none
    ax.plot(true[last:], vertical[last:], color=UNSTABLE, lw=1.4, zorder=6)
    other = vertical <= float(static.attrs["subcritical_below"])
    ax.plot(critical[other], vertical[other], color=UNSTABLE, lw=1.0, ls=(0, (1, 1.2)), zorder=6)


def draw_borders(ax: Any, curves: Sequence[Any]) -> None:
    """The exact borders, each kind with dashes of its own, on a white ground so that they are seen on every colour."""
    from matplotlib.patheffects import Normal, Stroke

    for curve in curves:
        ax.plot(
            curve["horizontal"],
            curve["vertical"],
            color=INK,
            lw=0.7,
            ls=BORDERS[str(curve.attrs["kind"])],
            path_effects=[Stroke(linewidth=1.5, foreground="white"), Normal()],
            zorder=5,
        )


def draw_ends(ax: Any, chart: Any, ends: Any) -> int:
    """The exact places at which a motion ends beside rest alone and no curve was followed, as dots; returns how many."""
    kinds = np.isfinite(ends["horizontal"].values)
    target = ends["key"].values[:, 3:]
    resting = ((chart["count"] == 0) & (chart["unsettled"] == 0)).transpose("vertical", "horizontal").values
    shown = kinds & resting[target[:, 0], target[:, 1]]
    ax.plot(ends["horizontal"].values[shown], ends["vertical"].values[shown], **DOT, zorder=5)
    return int(shown.sum())


def _line_handles(curves: Sequence[Any], static: bool) -> list[Any]:
    """What the lines of borders mean, those that are there."""
    from matplotlib.lines import Line2D

    kinds = {str(curve.attrs["kind"]) for curve in curves}
    handles = [
        Line2D([], [], color=UNSTABLE, lw=1.4, label="quasi-static border"),
        Line2D([], [], color=UNSTABLE, lw=1.0, ls=(0, (1, 1.2)), label=r"$\widehat{\mathcal{H}}_{cr}^{QS}$ where it is not"),
    ]
    exact = [Line2D([], [], color=INK, lw=0.8, ls=BORDERS[kind], label=NAMES[kind]) for kind in BORDERS if kind in kinds]
    return (handles if static else []) + exact


def chart_legend(figure: Any, curves: Sequence[Any], closed_form: bool = False) -> None:
    """What the lines and fillings mean, below all panels."""
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    handles = _line_handles(curves, static=True)
    handles.append(Line2D([], [], color=LIMIT, lw=0.9, label=r"max$|\theta|=\pi-\beta_0$"))
    with mpl.rc_context({"hatch.linewidth": 0.3}):
        handles.append(Patch(facecolor="#7fb8a8", edgecolor="white", hatch="......", label="several motions"))
    handles.append(Patch(facecolor=CHAOS, label="none settles"))
    if closed_form:
        handles.append(
            Line2D([], [], linestyle="none", marker="o", mfc="white", mec=INK, ms=3, label="closed form, high frequency")
        )
    figure.legend(handles=handles, loc="outside lower center", ncols=4)


def draw_closed_form(ax: Any, horizontal: np.ndarray, vertical: np.ndarray) -> None:
    """The onset by its closed form (erratum 28), as marks over the computed curve."""
    ax.plot(horizontal, vertical, linestyle="none", marker="o", mfc="white", mec=INK, ms=2.2, mew=0.6, zorder=7)
