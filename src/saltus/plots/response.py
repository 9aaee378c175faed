"""Response spectra and bifurcation diagrams: branches of periodic motions, their special points,
bands and simulated attractors.

A study on its own has the branches above and the stroboscopic points of direct simulation below.
All is drawn from its DataTree: its branches (see `branch_tables.py`), `attractors` (dots) and
`bands`.
"""

from __future__ import annotations

import textwrap
from collections.abc import Iterable
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from saltus.branch_tables import branches_of
from saltus.plots.branch_cuts import ModelValidity, margins_of, smooth_lines, validity_of
from saltus.plots.conventions import (
    LOOK,
    chosen_quantity,
    drawing,
    is_flat,
    legend_of,
    new_figure,
    outside_legend,
    parameter_name,
    quantity_name,
    symbol,
    unit_in_brackets,
    with_amplitudes,
)

# Simulated motions are drawn at about this many values: more dots would hide the lines.
DOTTED_VALUES = 25
QSB_LINE: dict[str, Any] = {"color": "#7b2d9b", "linestyle": (0, (3, 2)), "linewidth": 1.0}
FARTHEST_LINE: dict[str, Any] = {"color": LOOK.limit, "linestyle": (0, (1, 1.2)), "linewidth": 1.2}
# Heavy where the model holds, thin where an assumption fails, thin and pale beyond a limit:
# distinct in grey as well.
WEIGHTS = {ModelValidity.HOLDS: 1.7, ModelValidity.ASSUMPTION: 0.75, ModelValidity.LIMIT: 0.75}
PALE = {True: LOOK.pale_stable, False: LOOK.pale_unstable}
BANDS = {"QP": "#cfe6f7", "CH": "#fbd9b0"}  # quasi-periodic light blue, chaotic light orange
BAND_NAMES = {"QP": "quasi-periodic", "CH": "chaotic"}
DOTS: dict[str, Any] = {
    "color": LOOK.ink,
    "linestyle": "none",
    "marker": ".",
    "markersize": 2.4,
    "markeredgewidth": 0.0,
}
MARKS: dict[str, dict[str, Any]] = {
    "LP": {"marker": "o", "markersize": 2.8},
    "PD": {"marker": "s", "markersize": 2.7},
    "BPC": {"marker": "D", "markersize": 2.6},
    "GR": {"marker": "^", "markersize": 3.0},
    "NS": {"marker": "*", "markersize": 3.6},
    "SW": {"marker": "v", "markersize": 3.0},
    "GS": {"marker": "<", "markersize": 3.0},
    "CS": {"marker": "X", "markersize": 3.2},
    "SS": {"marker": ">", "markersize": 3.0},
    "AS": {"marker": "P", "markersize": 3.2},
}
MARK_NAMES = {
    "LP": "fold (LP)",
    "PD": "period doubling (PD)",
    "BPC": "branch point (BPC)",
    "GR": "grazing (GR)",
    "NS": "Neimark–Sacker (NS)",
    "SW": "switching (SW)",
    "GS": "grazing-sliding (GS)",
    "CS": "crossing-sliding (CS)",
    "SS": "switching-sliding (SS)",
    "AS": "adding-sliding (AS)",
}


def highest(spectrum: Any, low: float, high: float, quantity: str = "amplitude") -> float:
    """The largest value of a quantity on all branches between two values of the parameter."""
    return float(_inside(spectrum, low, high, quantity).max())


def lowest(spectrum: Any, low: float, high: float, quantity: str = "amplitude") -> float:
    """The least value of a quantity on all branches between two values of the parameter."""
    return float(_inside(spectrum, low, high, quantity).min())


def _inside(spectrum: Any, low: float, high: float, quantity: str) -> np.ndarray:
    x = spectrum["points"]["parameter"].values
    return np.asarray(spectrum["points"][quantity].values[(x >= low) & (x <= high)])


def draw_branches(
    ax: Any, spectrum: Any, quantity: str = "amplitude", scale: float = 1.0, weight: float = 1.0
) -> None:
    """Every branch, stable motions in solid blue, unstable ones in dashed red, heavier where the
    model holds.

    `quantity` is drawn in units of `scale`, lines in `weight` times their usual width.
    """
    for _, branch in branches_of(spectrum):
        for line in smooth_lines(branch, quantity):
            x, y = line.places.T
            ax.plot(
                x,
                y / scale,
                zorder=3.2 if line.stable else 3.0,
                **line_style(line.stable, line.validity, weight),
            )


def line_style(stable: bool, validity: ModelValidity, weight: float = 1.0) -> dict[str, Any]:
    """The line style of motions of this stability and validity, in `weight` times the usual
    width.
    """
    style = {
        **(LOOK.stable_line if stable else LOOK.unstable_line),
        "linewidth": weight * WEIGHTS[validity],
    }
    return style | ({"color": PALE[stable]} if validity is ModelValidity.LIMIT else {})


# Of a branch that is shorter than its marks only the line is drawn, mm.
SHORTEST_MARKED = 1.2


def draw_special(ax: Any, spectrum: Any, quantity: str = "amplitude", scale: float = 1.0) -> None:
    """Small marks by kind at the special points inside the axes, the closest ones of a kind thinned
    out; none on branches that are shorter than a mark.
    """
    box = ax.get_window_extent()
    unit = np.array([box.width, box.height]) / ax.figure.dpi * 25.4
    low, high = np.array([ax.get_xlim(), ax.get_ylim()]).T
    spectrum = _marked(spectrum, quantity, scale, unit / (high - low))
    for kind, style in MARKS.items():
        places = special_places(spectrum, kind, quantity) / np.array([1.0, scale])
        kept: list[np.ndarray] = []
        inside = ((places >= low) & (places <= high)).all(axis=1)
        for place in places[inside]:
            # mm
            if all(np.linalg.norm((place - other) / (high - low) * unit) > 1.7 for other in kept):
                kept.append(place)
        if kept:
            ax.plot(*np.array(kept).T, linestyle="none", zorder=5, **_mark(style))


def _marked(spectrum: Any, quantity: str, scale: float, unit: np.ndarray) -> Any:
    """The special points of branches that are longer than a mark, where `unit` is the length of
    each axis's unit in mm.
    """
    special = spectrum["special"].to_dataset()
    if "kind" not in special:  # a diagram without branches
        return {"special": special}
    long = []
    for number, branch in branches_of(spectrum):
        curve = [branch["parameter"].values, branch[quantity].values / scale]
        steps = np.diff(np.stack(curve, axis=1), axis=0) * unit
        if np.nansum(np.linalg.norm(steps, axis=1)) > SHORTEST_MARKED:
            long.append(number)
    return {"special": special.isel(special=np.isin(special["branch"].values, long))}


def special_places(spectrum: Any, kind: str, quantity: str = "amplitude") -> np.ndarray:
    """(parameter, quantity) of the special points of a kind on all branches, (n, 2)."""
    special = spectrum["special"]
    if "kind" not in special:  # a diagram without branches
        return np.empty((0, 2))
    here = special["kind"].values == kind
    return np.stack(
        [special[f"special_{name}"].values[here] for name in ("parameter", quantity)], axis=1
    )


def _mark(style: dict[str, Any]) -> dict[str, Any]:
    return {
        "markerfacecolor": "white",
        "markeredgecolor": LOOK.ink,
        "markeredgewidth": 0.5,
        **style,
    }


def draw_attractors(
    ax: Any, spectrum: Any, quantity: str = "amplitude", scale: float = 1.0
) -> None:
    """The attractors found by simulation, as dots over the branches: at some values only, but all
    that lie on no branch.
    """
    dots = spectrum["attractors"]
    values = np.unique(dots["parameter"].values)
    shown = np.isin(dots["parameter"].values, values[:: max(1, round(len(values) / DOTTED_VALUES))])
    ax.plot(dots["parameter"].values[shown], dots[quantity].values[shown] / scale, zorder=4, **DOTS)
    if "unplaced" in spectrum.children:
        other = spectrum["unplaced"]
        ax.plot(other["parameter"], other[quantity] / scale, zorder=4, **DOTS)


def note_missed(ax: Any, spectrum: Any) -> None:
    """Write above the axes which share of random states ends on something that the diagram lacks,
    with its interval.
    """
    share, low, high = (
        100 * float(spectrum.attrs.get(f"missed_{name}", np.nan))
        for name in ("share", "low", "high")
    )
    ended = 100 * float(spectrum.attrs.get("ended_share", 0.0))
    if np.isfinite(share):
        cut = f"; ended at a limit: {ended:.2g} %" if ended > 0 else ""
        ax.set_title(
            f"missed: {share:.2g} % ({low:.2g} to {high:.2g} %){cut}",
            loc="right",
            pad=4,
            fontsize=7,
        )


def draw_bands(ax: Any, spectrum: Any) -> None:
    """Light blue where motions are quasi-periodic, light orange where they are chaotic."""
    bands = spectrum["bands"]
    for low, high, kind in zip(
        bands["low"].values, bands["high"].values, bands["kind"].values, strict=True
    ):
        ax.axvspan(low, high, color=BANDS[str(kind)], linewidth=0, zorder=0)


def draw_limits(
    ax: Any, limits: Iterable[float], scale: float = 1.0, mirrored: bool = False
) -> None:
    """Green lines at the straight line, dashed, and at the kinematic limit, dotted, those that fall
    inside the axes.
    """
    low, high = ax.get_ylim()
    for angle, style in zip(limits, (LOOK.limit_line, FARTHEST_LINE), strict=False):
        for value in (angle / scale, *((-angle / scale,) if mirrored else ())):
            if low < value < high:
                ax.axhline(value, zorder=2, **style)


def draw_critical(ax: Any, critical: float) -> None:
    """The purple dashed line of the quasi-static bifurcation (QSB)."""
    ax.axvline(critical, zorder=2, **QSB_LINE)


def draw_response(
    ax: Any, spectrum: Any, quantity: str = "amplitude", scale: float = 1.0, weight: float = 1.0
) -> None:
    """Bands, branches, dots and marks; the limits of the axes must be set before."""
    draw_bands(ax, spectrum)
    draw_branches(ax, spectrum, quantity, scale, weight)
    draw_attractors(ax, spectrum, quantity, scale)
    draw_special(ax, spectrum, quantity, scale)


def response_legend(
    where: Any, spectra: list[Any], *, limits: bool = True, critical: bool = False, columns: int = 4
) -> None:
    """One legend for all panels: below those of a figure, or within axes."""
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    handles, labels, handlers = line_handles(
        [branch for spectrum in spectra for _, branch in branches_of(spectrum)]
    )
    more: list[Any] = [Line2D([], [], label="direct simulation", **{**DOTS, "markersize": 4})]
    if limits:
        more.append(Line2D([], [], label=r"straight line, $\pi-\beta_0$", **LOOK.limit_line))
        more.append(Line2D([], [], label=r"kinematic limit, $2(\pi-\beta_0)$", **FARTHEST_LINE))
    if critical:
        more.append(Line2D([], [], label="quasi-static bifurcation (QSB)", **QSB_LINE))
    for kind, style in MARKS.items():
        if any(len(special_places(spectrum, kind)) for spectrum in spectra):
            more.append(Line2D([], [], linestyle="none", label=MARK_NAMES[kind], **_mark(style)))
    found = {str(kind) for spectrum in spectra for kind in spectrum["bands"]["kind"].values}
    more += [Patch(color=BANDS[kind], label=BAND_NAMES[kind]) for kind in BANDS if kind in found]
    entries: dict[str, Any] = {
        "handles": [*handles, *more],
        "labels": [*labels, *(handle.get_label() for handle in more)],
    }
    if isinstance(where, Axes):
        legend_of(where, False, **entries, handler_map=handlers, handlelength=3.6)
        return
    width = where.get_figwidth() * 25.4 / LOOK.double_column
    # so many of size one point fit into a double column
    letters = round(880.0 * width / mpl.rcParams["font.size"])
    outside_legend(
        where,
        **entries,
        handler_map=handlers,
        ncols=max(1, round(columns * min(1.0, width))),
        columnspacing=1.2,
        handletextpad=0.5,
        handlelength=3.6,
        title=textwrap.fill(missed_states(spectra) or "", max(20, letters)) or None,
        title_fontsize="medium",
    )


def missed_states(spectra: list[Any]) -> str | None:
    """The explanation of the share that `note_missed` writes above the panels; None if no sample
    was taken.
    """
    if not any("missed_low" in spectrum.attrs for spectrum in spectra):
        return None
    return (
        "missed: the share of random starts that end on an attractor not drawn, with its 95 % "
        "interval"
    )


def line_handles(branches: list[Any]) -> tuple[list[Any], list[str], dict[Any, Any]]:
    """Handles and labels of the lines of branches, and the handlers that draw them, as a legend
    takes them.
    """
    from matplotlib.legend_handler import HandlerTuple
    from matplotlib.lines import Line2D

    labels = line_labels(branches)
    pairs = [tuple(Line2D([], [], **style) for style in styles) for _, styles in labels]
    return (
        [pair if len(pair) > 1 else pair[0] for pair in pairs],
        [label for label, _ in labels],
        {tuple: HandlerTuple(ndivide=None, pad=0.3)},
    )


def line_labels(branches: list[Any]) -> list[tuple[str, list[dict[str, Any]]]]:
    """The labels of the lines of branches, with the styles of stable and unstable motions, as far
    as there are such; by validity if there are margins.
    """
    names = {
        kind: sorted({name for branch in branches for name in margins_of(branch, kind)})
        for kind in ModelValidity
    }
    if not any(names.values()):
        drawn = {bool(each) for branch in branches for each in np.unique(branch["stable"].values)}
        return [
            (name, [line_style(stable, ModelValidity.HOLDS)])
            for name, stable in (("stable", True), ("unstable", False))
            if stable in drawn
        ]
    found = {validity for branch in branches for validity in validity_of(branch)}
    meaning = {
        ModelValidity.HOLDS: "stable, unstable (model holds)",
        ModelValidity.ASSUMPTION: (
            " or ".join(names[ModelValidity.ASSUMPTION]).replace("_", " ") + " violated"
        ),
        ModelValidity.LIMIT: "beyond " + " or ".join(names[ModelValidity.LIMIT]).replace("_", " "),
    }
    return [
        (meaning[validity], [line_style(stable, validity) for stable in (True, False)])
        for validity in ModelValidity
        if validity in found
    ]


POINTS: dict[str, Any] = {
    "color": LOOK.ink,
    "linestyle": "none",
    "marker": ".",
    "markeredgewidth": 0.0,
    "rasterized": True,
}


# A motion that stays within this of the contact for a period is at rest, and its states are left
# out.
HARDLY_MOVES = 1e-9

# those of branches, special points and simulated motions
QUANTITIES = ("amplitude", "highest", "lowest", "slowest")


@drawing
def draw_diagram(
    tree: Any, quantity: str | None = None, *, ax: Axes | None = None, figure: Figure | None = None
) -> Any:
    """Draw the DataTree of `response_spectrum` or `bifurcation_diagram`; returns its axes, (1 or
    2,).

    In a figure the states at phase 0 are below the branches; into given axes only the branches are
    drawn. The `quantity` is the amplitude, the highest or the lowest value of the coordinate, of
    several the one that the load drives. With several contacts it may be the least speed of an
    impact ("slowest", 0 without impacts). With several coordinates there are "largest_x" and
    "smallest_x" of each coordinate and of each named point x, of which "x" alone is the amplitude;
    and there are the diagram's own `functions`. The default is the amplitude, or "slowest" if most
    motions have the same amplitude, as between two walls.
    """
    tree = _with_amplitudes(tree)
    known = _quantities(tree)
    usual = "amplitude"
    if "slowest" in known and is_flat(tree["attractors"]["amplitude"].values):
        usual = "slowest"
    quantity = chosen_quantity(quantity, known, usual)
    tree = _with_finite_speeds(tree) if quantity == "slowest" else tree
    low, high = (float(x) for x in tree.attrs["bounds"])
    unit = _unit(tree, quantity)
    simulated = "stroboscopic" in tree.children and ax is None
    if ax is None:
        figure = (
            new_figure(LOOK.double_column, 150.0 if simulated else 95.0)
            if figure is None
            else figure
        )
        axes = figure.subplots(
            1 + simulated, 1, sharex=True, squeeze=False, height_ratios=[3, 2][: 1 + simulated]
        )[:, 0]
    else:
        axes = np.array([ax])
    axes[0].set_xlim(low, high)
    bottom, top = _range(tree, quantity, low, high)
    # so that marks on the axis are not cut
    axes[0].set_ylim(bottom - 0.02 * (top - bottom), top + 0.08 * (top - bottom))
    axes[0].set_ylabel(
        f"least speed of an impact{unit}"
        if quantity == "slowest"
        else f"{quantity_name(tree, quantity)}{unit}"
    )
    limits = (
        []
        if quantity not in QUANTITIES[:3]
        else [float(limit) for limit in np.atleast_1d(tree.attrs["limits"])]
    )
    draw_response(axes[0], tree, quantity)
    draw_limits(axes[0], limits)
    note_missed(axes[0], tree)
    if simulated:
        draw_stroboscopic_states(axes[1], tree)
        section = tree["stroboscopic"]
        name = section.attrs.get("coordinate", tree.attrs["coordinate"].split()[0])
        unit = unit_in_brackets(section["position"])
        axes[1].set_ylabel(f"${symbol(name)}$ at phase 0{unit}")
        axes[1].set_title("stroboscopic points of direct simulation", loc="left", pad=3)
    axes[-1].set_xlabel(parameter_name(tree.attrs["path"]))
    response_legend(
        figure if ax is None else ax,
        [tree],
        limits=min(limits, default=np.inf) < axes[0].get_ylim()[1],
    )
    return axes if ax is None else ax


def _with_finite_speeds(tree: Any) -> Any:
    """The diagram with 0 for the least impact speed of orbits without impacts, as simulated motions
    have it.
    """
    tree = tree.copy()
    for table, name in (("points", "slowest"), ("special", "special_slowest")):
        if name in tree[table]:
            speeds = tree[table][name]
            tree[table][name] = speeds.where(np.isfinite(speeds), 0.0)
    return tree


def _with_amplitudes(tree: Any) -> Any:
    """The diagram with the amplitudes of all displacements whose extrema it has."""
    tree = tree.copy()
    for table in ("attractors", "unplaced", "points", "special"):
        if table in tree.children:
            tree[table].dataset = with_amplitudes(tree[table].to_dataset())
    return tree


def _quantities(tree: Any) -> list[str]:
    """The numbers that branches, special points and simulated motions have, the usual ones first."""
    dots = tree["attractors"]
    own = [
        str(name)
        for name, part in dots.data_vars.items()
        if part.dtype.kind == "f" and name != "parameter" and name not in QUANTITIES
    ]
    points = tree["points"]
    special = tree["special"]
    empty = "parameter" not in points
    return [
        name
        for name in (*QUANTITIES, *own)
        if name in dots and (empty or (name in points and f"special_{name}" in special))
    ]


def _unit(tree: Any, quantity: str) -> str:
    """The unit of a quantity, as the simulated motions carry it."""
    return unit_in_brackets(tree["attractors"][quantity])


def _range(tree: Any, quantity: str, low: float, high: float) -> tuple[float, float]:
    """The least and the largest value of a quantity within the bounds; amplitudes and speeds begin
    at 0. If equal, 1 apart.
    """
    points = tree["points"]
    found = tree["attractors"][quantity].values
    if points.sizes["point"]:
        x = points["parameter"].values
        found = np.append(found, points[quantity].values[(x >= low) & (x <= high)])
    found = found[np.isfinite(found)]
    from_zero = quantity == "slowest" or quantity.startswith("amplitude")
    top = float(np.max(found, initial=0.0 if from_zero or not found.size else -np.inf))
    bottom = 0.0 if from_zero else float(np.min(found, initial=top))
    return (bottom, top) if top > bottom else (bottom, bottom + 1.0)


def draw_stroboscopic_states(ax: Any, tree: Any) -> None:
    """The states at phase 0 of the load of the simulated motions from every start, period after
    period.
    """
    section = tree["stroboscopic"]
    draw_bands(ax, tree)
    moving = section["peak"].values > HARDLY_MOVES
    values = section["value"].values[moving]
    places = section["position"].values[moving]
    low, high = ax.get_xlim()
    width = ax.get_window_extent().width / ax.figure.dpi * 72.0  # points
    size = np.clip(0.5 * width / max(len(np.unique(values)), 1), 1.3, 3.5)
    ax.plot(values, places, markersize=size, **POINTS)
    ax.set_xlim(low, high)
