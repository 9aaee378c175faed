"""Stability charts: the largest amplitude over the plane of two loads, the number of motions, and
borders over it.
"""

from __future__ import annotations

import functools
import json
import math
from collections.abc import Iterable, Sequence
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.patheffects import Normal, Stroke
from matplotlib.ticker import MaxNLocator

from saltus.plots.branch_cuts import border_curves
from saltus.plots.conventions import (
    LOOK,
    axes_or_new,
    cell_edges,
    chosen_quantity,
    drawing,
    is_flat,
    legend_of,
    outside_legend,
    parameter_name,
    peak,
    unit_in_brackets,
)

# large amplitudes are dark; small ones are light, as they lie beside the white of rest
COLOURS = "viridis_r"
# Steps of the colours of the amplitude, as shares of a round number: finer where amplitudes are
# small.
LEVELS = np.array([0.0, 0.01, 0.02, 0.05, 0.1, 0.15, 0.2, 0.3, 0.4, 0.5, 0.6, 0.8, 1.0])
# The look of cells with something beside or instead of one motion: fill (None is the colour of the
# amplitude), hatch, the hatch's colour, and the words of the legend. The hatches differ, so that
# cells can be told apart without colours.
FILLINGS: dict[str, tuple[str | None, str, str, str]] = {
    "several_motions": (None, "......", "white", "several motions"),
    "motions_and_chaos": (None, "//////", LOOK.ink, "chaos beside motions"),
    "chaos": ("#8c8c8c", "//////", "white", "chaos alone"),
    "long": ("#dedede", "------", LOOK.ink, "long period, or unsettled"),
    "quasi_periodic": ("#dedede", "||||||", LOOK.ink, "quasi-periodic"),
    "undecided": ("#dedede", "xxxxxx", LOOK.ink, "undecided"),
}
BORDERS: dict[str, Any] = {
    "LP": "-",
    "PD": (0, (5, 1.5)),
    "BPC": (0, (5, 1.2, 1, 1.2)),
    "GR": (0, (1, 1.1)),
}
BORDER_NAMES = {"LP": "fold", "PD": "period doubling", "BPC": "symmetry breaking", "GR": "grazing"}
# the border of the region with rest alone
BESIDE_REST: dict[str, Any] = {"color": LOOK.ink, "lw": 1.7}
# where one motion among others begins or ends
INSIDE: dict[str, Any] = {"color": "#333333", "lw": 0.4}
# so that a line is seen on every colour
WHITE_GROUND = [Stroke(linewidth=2.9, foreground="white"), Normal()]
THIN_GROUND = [Stroke(linewidth=1.0, foreground="white", alpha=0.6), Normal()]
STATIC_LINE: dict[str, Any] = {"color": LOOK.unstable, "lw": 1.4}
# the paper's border where it is wrong
PRINTED_LINE: dict[str, Any] = {"color": LOOK.unstable, "lw": 1.0, "ls": (0, (1, 1.2))}
# A curve, or a heavy part of one, that is shorter than this many cells is left out: it would be a
# speck.
SHORTEST_CURVE = 3.0
# The largest motion changes smoothly between cells that differ by less than this share of the
# limit.
SMOOTH = 0.1
LINE_LIMIT: dict[str, Any] = {"color": LOOK.limit, "lw": 0.9}
DOT: dict[str, Any] = {
    "linestyle": "none",
    "marker": ".",
    "color": LOOK.ink,
    "markersize": 2.0,
    "markeredgewidth": 0.0,
}
CROSS: dict[str, Any] = {"linestyle": "none", "marker": "x", "color": LOOK.unstable}
CLOSED_FORM: dict[str, Any] = {"linestyle": "none", "marker": "o", "mfc": "white", "mec": LOOK.ink}


@drawing
def draw_stability_chart(data: Any, quantity: str | None = None, *, ax: Axes | None = None) -> Axes:
    """Draw the Dataset of a chart, or the DataTree of a chart and its borders, with a colour bar
    and a legend; returns `ax`.

    The colours are those of the largest `quantity` of the motions in a cell: by default of the
    amplitude, of several coordinates of the one that the load drives; or of the amplitude of
    another coordinate or named point, by its name, or of one of the chart's own `functions`.
    """
    bordered = bool(getattr(data, "children", None))
    chart = data["chart"].to_dataset() if bordered else data
    chart, said = _of_quantity(chart, quantity)
    own, ax = ax is None, axes_or_new(ax, 1.2 * LOOK.single_column, 98.0)
    cells = draw_chart(ax, chart)
    path = list(chart.attrs.get("path", ("horizontal", "vertical")))
    ax.set_xlabel(parameter_name(path[0]))
    ax.set_ylabel(parameter_name(path[1]))
    if cells is not None:
        name = (
            "least speed of an impact"
            if has_speeds(chart)
            else f"largest amplitude ${peak(said)}$"
            if said in str(chart.attrs["coordinate"]) or f"motion_largest_{said}" in chart
            else f"largest {said}"
        )
        label = f"{name}{unit_in_brackets(chart['amplitude'])}"
        ax.figure.colorbar(cells, ax=ax, label=label, ticks=cells.norm.boundaries, format="%g")
    handles = _cell_handles(chart)
    if bordered:
        dots = draw_lines(ax, data)
        handles += _line_handles(
            border_curves(data), "static" in data.children, bool(_resting(chart).any())
        )
        handles += [Line2D([], [], **DOT, label="end of motions")] if dots else []
    if handles:
        legend_of(ax, own, handles, ncols=2, columnspacing=1.4, handletextpad=0.6)
    return ax


def _of_quantity(chart: Any, quantity: str | None) -> tuple[Any, str]:
    """The chart whose `amplitude` is that of a quantity, the largest of the motions in a cell, and
    the coordinates or the name of the quantity."""
    shown = str(chart.attrs.get("shown", ""))
    named = [
        str(name).removeprefix("motion_largest_")
        for name in chart.data_vars
        if str(name).startswith("motion_largest_")
    ]
    own = [
        str(name).removeprefix("motion_")
        for name, part in chart.data_vars.items()
        if str(name).startswith("motion_") and part.attrs.get("long_name") == str(name)[7:]
    ]
    usual = shown if shown and set(shown.split()) <= {*named} else "amplitude"
    which = chosen_quantity(quantity, ["amplitude", *named, *own], usual)
    which = usual if which == "amplitude" else which
    if quantity is not None:  # which is drawn even where it is the same everywhere
        chart = chart.drop_vars("motion_slowest", errors="ignore")
    if which == "amplitude":
        return chart, str(chart.attrs["coordinate"])
    if which in own:
        values = chart[f"motion_{which}"]
    else:
        ends = [
            chart[f"motion_{end}_{x}"] for x in which.split() for end in ("largest", "smallest")
        ]
        values = functools.reduce(np.fmax, map(abs, ends))
        values.attrs = ends[0].attrs
    largest = values.max("motion").transpose(*chart["amplitude"].dims)
    largest.attrs = {**chart["amplitude"].attrs, **values.attrs}
    return chart.assign(amplitude=largest), which


def draw_lines(ax: Any, tree: Any) -> int:
    """All borders of a tree with a chart, those next to cells with rest alone as heavy lines;
    returns the number of dots.
    """
    chart = tree["chart"].to_dataset()
    for curve in border_curves(tree):
        x = curve["horizontal"].values
        y = curve["vertical"].values
        style = BORDERS[str(curve.attrs["kind"])]
        cells = _in_cells(chart, x, y)
        if np.ptp(cells, axis=1).max() < SHORTEST_CURVE:
            continue
        beside = _long_runs(_is_beside_rest(chart, cells), cells)
        ax.plot(x, y, **INSIDE, ls=style, path_effects=THIN_GROUND, zorder=4)
        heavy = np.where(beside, x, np.nan)
        ax.plot(
            heavy,
            np.where(beside, y, np.nan),
            **BESIDE_REST,
            ls=style,
            path_effects=WHITE_GROUND,
            zorder=5,
        )
    if "static" in tree.children:
        draw_static(ax, tree["static"])
    return draw_ends(ax, chart, tree["borders"]["ends"].to_dataset())


def _in_cells(chart: Any, x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Points in units of cells, columns and rows, (2, n)."""
    axes = ((x, "horizontal"), (y, "vertical"))
    return np.array(
        [
            np.interp(values, chart[name].values, np.arange(chart.sizes[name]))
            for values, name in axes
        ]
    )


def _long_runs(marked: np.ndarray, cells: np.ndarray) -> np.ndarray:
    """The marked points of a curve without those runs of them that are shorter than
    `SHORTEST_CURVE` cells.
    """
    steps = np.flatnonzero(np.diff(np.concatenate([[False], marked, [False]]).astype(int)))
    kept = np.zeros_like(marked)
    for first, last in steps.reshape(-1, 2):
        kept[first:last] = np.ptp(cells[:, first:last], axis=1).max() >= SHORTEST_CURVE
    return kept


def _is_beside_rest(chart: Any, cells: np.ndarray) -> np.ndarray:
    """Whether, among the four cells about each of these points, one has rest alone and one has
    something else.
    """
    resting = _resting(chart)
    (columns, rows) = cells
    corners = [
        resting[
            np.clip(side(rows).astype(int), 0, len(resting) - 1),
            np.clip(end(columns).astype(int), 0, resting.shape[1] - 1),
        ]
        for side in (np.floor, np.ceil)
        for end in (np.floor, np.ceil)
    ]
    return np.asarray(np.any(corners, axis=0) & ~np.all(corners, axis=0))


def _resting(chart: Any) -> np.ndarray:
    """Where every motion comes to rest, (vertical, horizontal)."""
    return np.asarray(
        ((chart["count"] == 0) & (chart["unsettled"] == 0))
        .transpose("vertical", "horizontal")
        .values
    )


def draw_chart(ax: Any, chart: Any, top: float | None = None) -> Any:
    """The cells: coloured by the largest amplitude (or, if `has_speeds`, by the largest of the
    motions' least impact speeds), and filled and hatched if there is something else (`FILLINGS`). A
    cell is white if there is rest alone; crosses where the largest motion goes beyond the kinematic
    limit.

    Returns what a colour bar needs, or None.
    """
    x = chart["horizontal"].values
    y = chart["vertical"].values
    names = ("amplitude", "beyond_line", "beyond_kinematic")
    of = {
        name: chart[name].transpose("vertical", "horizontal").values
        for name in names
        if name in chart
    }
    edges = cell_edges(x), cell_edges(y)
    ax.set_xlim(*((x[0], x[-1]) if len(x) > 1 else edges[0]))
    ax.set_ylim(*((y[0], y[-1]) if len(y) > 1 else edges[1]))
    if has_speeds(chart):
        of["amplitude"] = (
            chart["motion_slowest"]
            .fillna(-np.inf)
            .max("motion")
            .transpose("vertical", "horizontal")
            .values
        )
        of["amplitude"][~np.isfinite(of["amplitude"])] = np.nan
    cells = _amplitudes(ax, edges, of["amplitude"], top)
    for name, (fill, hatch, colour, _) in FILLINGS.items():
        where = with_outcome(chart, name)
        if fill is not None:
            only = mpl.colors.ListedColormap([fill])
            ax.pcolormesh(
                *edges, np.where(where, 1.0, np.nan), cmap=only, rasterized=True, zorder=1
            )
        _hatch(ax, x, y, where, hatch, colour)
    if "beyond_kinematic" in of:
        rows, columns = np.nonzero(of["beyond_kinematic"])
        ax.plot(x[columns], y[rows], **CROSS, markersize=1.5, markeredgewidth=0.3, zorder=3)
    if "beyond_line" in of:
        _line_limit(ax, chart)
    return cells


def has_speeds(chart: Any) -> bool:
    """Whether the motions of most cells have the same amplitude, as between two walls, so that
    impact speeds are drawn.
    """
    amplitudes = chart["amplitude"].values
    known = "motion_slowest" in chart and float(chart["motion_slowest"].max()) > 0.0
    return known and is_flat(amplitudes[np.isfinite(amplitudes)])


def with_outcome(chart: Any, name: str) -> np.ndarray:
    """Which cells of a chart have the outcome with this name in `flag_meanings`, (vertical,
    horizontal).
    """
    outcome = chart["outcome"].transpose("vertical", "horizontal")
    number = dict(
        zip(
            outcome.attrs["flag_meanings"].split(),
            np.ravel(outcome.attrs["flag_values"]),
            strict=True,
        )
    ).get(name, -1)
    return np.asarray(outcome.values == number)


def _amplitudes(
    ax: Any, edges: tuple[np.ndarray, np.ndarray], amplitude: np.ndarray, top: float | None
) -> Any:
    """The cells in the colours of their amplitudes; None without any."""
    if not np.isfinite(amplitude).any():
        return None
    levels: Any
    if np.nanmin(amplitude) < 0.0 or np.nanmax(amplitude) == 0.0:  # of a function of one's own
        levels = MaxNLocator(nbins=12).tick_values(np.nanmin(amplitude), np.nanmax(amplitude))
    else:
        levels = LEVELS * _round(float(np.nanmax(amplitude)) if top is None else top)
    norm = mpl.colors.BoundaryNorm(levels, 256)
    return ax.pcolormesh(*edges, amplitude, cmap=COLOURS, norm=norm, rasterized=True, zorder=1)


def _round(value: float) -> float:
    """The least number not below a value that has one digit other than 0."""
    unit = 10.0 ** np.floor(np.log10(value))
    return float(f"{np.ceil(value / unit - 1e-9) * unit:.1g}")


def _hatch(
    ax: Any, x: np.ndarray, y: np.ndarray, where: np.ndarray, hatch: str, colour: str
) -> None:
    """A hatch over the cells, without a line about them."""
    if min(where.shape) < 2 or not where.any():
        return
    with mpl.rc_context({"hatch.linewidth": 0.3, "hatch.color": colour}):
        ax.contourf(
            x, y, where.astype(float), levels=[0.5, 1.5], colors="none", hatches=[hatch], zorder=2
        )


def _line_limit(ax: Any, chart: Any) -> None:
    """A green line where the largest amplitude is that of the straight line, between cells over
    which it changes smoothly.

    Where it jumps, the border is the curve on which the larger motion ends, which is drawn as such.
    """
    amplitude = chart["amplitude"].transpose("vertical", "horizontal").values
    limit = math.pi - float(json.loads(chart.attrs["system"])["model"]["beta0"])
    beside = np.stack(
        [amplitude[:-1, :-1], amplitude[:-1, 1:], amplitude[1:, 1:], amplitude[1:, :-1]]
    )
    spread = np.ptp(beside, axis=0)
    known = np.isfinite(spread)
    usual = float(np.median(spread[known])) if known.any() else 0.0
    smooth = (
        known
        & (spread < max(SMOOTH * limit, 4 * usual))
        & (beside.min(axis=0) < limit)
        & (beside.max(axis=0) >= limit)
    )
    x = chart["horizontal"].values
    y = chart["vertical"].values
    lines = [
        _crossing(beside[:, i, j] - limit, x[j : j + 2], y[i : i + 2])
        for i, j in np.argwhere(smooth)
    ]
    ax.add_collection(
        LineCollection(lines, colors=LOOK.limit, linewidths=0.9, zorder=4, capstyle="round")
    )


def _crossing(excess: np.ndarray, x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Where a number given at the corners of a cell, anticlockwise from the lower left, is 0 along
    its sides, (2 or 4, 2).
    """
    corners = np.array([[x[0], y[0]], [x[1], y[0]], [x[1], y[1]], [x[0], y[1]]])
    after = np.roll(excess, -1)
    ahead = np.roll(corners, -1, axis=0)
    crossed = (excess < 0) != (after < 0)
    share = (excess[crossed] / (excess[crossed] - after[crossed]))[:, None]
    return np.asarray(corners[crossed] + share * (ahead[crossed] - corners[crossed]))


def draw_static(ax: Any, static: Any) -> None:
    """The quasi-static border in red: the true one solid, the part of the paper's border that is
    wrong dotted.
    """
    vertical, critical, true = (static[name].values for name in ("vertical", "critical", "true"))
    # where the border reaches Hhat = 0; below it there is none
    last = max(int(np.argmax(true > 0)) - 1, 0)
    ax.plot(true[last:], vertical[last:], zorder=6, **STATIC_LINE)
    other = vertical <= float(static.attrs["subcritical_below"])
    ax.plot(critical[other], vertical[other], zorder=6, **PRINTED_LINE)


def draw_ends(ax: Any, chart: Any, ends: Any) -> int:
    """Dots where a motion ends next to a cell with rest alone and no curve was followed; returns
    their number.
    """
    known = np.isfinite(ends["horizontal"].values)
    target = ends["key"].values[:, 3:]
    shown = known & _resting(chart)[target[:, 0], target[:, 1]]
    ax.plot(ends["horizontal"].values[shown], ends["vertical"].values[shown], **DOT, zorder=5)
    return int(shown.sum())


def draw_closed_form(ax: Any, horizontal: np.ndarray, vertical: np.ndarray) -> None:
    """The onset by its closed form (erratum 28), as marks over the computed curve."""
    ax.plot(horizontal, vertical, ms=2.2, mew=0.6, zorder=7, **CLOSED_FORM)


def _filling(name: str) -> Patch:
    """A patch of a legend with the filling of cells."""
    fill, hatch, colour, words = FILLINGS[name]
    with mpl.rc_context({"hatch.linewidth": 0.3, "hatch.color": colour}):
        return Patch(
            facecolor=fill or "#7fb8a8",
            edgecolor=colour,
            linewidth=0.0,
            hatch=hatch[:3],
            label=words,
        )


def _fillings(charts: Sequence[Any]) -> list[Patch]:
    """Legend entries of the fillings of cells that occur in any of the charts."""
    return [
        _filling(name)
        for name in FILLINGS
        if any(with_outcome(chart, name).any() for chart in charts)
    ]


def _rest_patch() -> Patch:
    """The legend's entry of white cells."""
    return Patch(facecolor="white", edgecolor=LOOK.ink, linewidth=0.4, label="rest alone")


def _cell_handles(chart: Any) -> list[Any]:
    """Legend entries of the marks that occur in the cells of a chart."""
    handles: list[tuple[Any, Any]] = [
        (_resting(chart), _rest_patch()),
        *((with_outcome(chart, name), _filling(name)) for name in FILLINGS),
    ]
    if "beyond_line" in chart:
        handles.append(
            (
                chart["beyond_line"] > 0,
                Line2D([], [], **LINE_LIMIT, label=r"$\max_\tau|\theta|=\pi-\beta_0$"),
            )
        )
    if "beyond_kinematic" in chart:
        cross = Line2D(
            [], [], **CROSS, markersize=4, markeredgewidth=0.8, label="beyond the kinematic limit"
        )
        handles.append((chart["beyond_kinematic"], cross))
    return [handle for where, handle in handles if bool(where.any())]


def _line_handles(curves: Iterable[Any], static: bool, rest: bool) -> list[Any]:
    """Legend entries of the lines of borders that are drawn."""
    kinds = {str(curve.attrs["kind"]) for curve in curves}
    handles = [
        Line2D([], [], **STATIC_LINE, label="quasi-static border"),
        Line2D(
            [], [], **PRINTED_LINE, label=r"$\widehat{\mathcal{H}}_{cr}^{QS}$, not the border here"
        ),
    ]
    exact = [
        Line2D([], [], color=LOOK.ink, lw=0.7, ls=BORDERS[kind], label=BORDER_NAMES[kind])
        for kind in BORDERS
        if kind in kinds
    ]
    heavy = [Line2D([], [], **BESIDE_REST, label="border of rest alone")] if exact and rest else []
    return (handles if static else []) + heavy + exact


def chart_legend(
    figure: Any,
    charts: Sequence[Any],
    curves: Sequence[Any],
    closed_form: bool = False,
    dots: bool = False,
) -> None:
    """A legend of the lines and fillings, below all panels."""
    handles = _line_handles(curves, static=True, rest=True)
    handles.append(Line2D([], [], **LINE_LIMIT, label=r"max$|\theta|=\pi-\beta_0$"))
    if dots:
        handles.append(
            Line2D([], [], **DOT | {"markersize": 4.0}, label="end of motions, no curve")
        )
    if any(_resting(chart).any() for chart in charts):
        handles.append(_rest_patch())
    handles += _fillings(charts)
    if closed_form:
        handles.append(Line2D([], [], ms=3, label="closed form, high frequency", **CLOSED_FORM))
    outside_legend(figure, handles=handles, ncols=4)
