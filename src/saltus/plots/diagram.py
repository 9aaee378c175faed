"""A diagram of a study on its own: the branches above, the stroboscopic points of direct simulation below."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from saltus.errors import ParameterError, shown
from saltus.plots.axis_names import is_flat, parameter_name, peak, symbol, unit_in_brackets
from saltus.plots.conventions import DOUBLE_COLUMN, INK, drawing, new_figure
from saltus.plots.response import draw_bands, draw_limits, draw_response, note_missed, response_legend

POINTS: dict[str, Any] = {"color": INK, "linestyle": "none", "marker": ".", "markeredgewidth": 0.0, "rasterized": True}


@dataclass(frozen=True)
class StateSettings:
    """Which stroboscopic states are drawn, and how large: their size follows from the step between values."""

    finest: float = 1.3  # The least size of a point.
    coarsest: float = 3.5  # The largest size of a point.
    at_rest: float = 1e-9  # A motion that stays within this of the contact for a period is at rest, and left out.


DRAWN_STATES = StateSettings()


QUANTITIES = ("amplitude", "highest", "lowest", "slowest")  # those of branches, special points and simulated motions


@drawing
def draw_diagram(tree: Any, quantity: str | None = None, *, ax: Axes | None = None, figure: Figure | None = None) -> Any:
    """Draw the DataTree of `response_spectrum` or `bifurcation_diagram`; returns its axes, (1 or 2,).

    In a figure the states at phase 0 are below the branches; into given axes only the branches are drawn. The `quantity` is the
    amplitude, the highest or the lowest value of a coordinate, or, with several contacts, the least speed of an impact
    ("slowest", 0 without impacts). The default is the amplitude, or "slowest" if most motions have the same amplitude, as between
    two walls.
    """
    known = [name for name in QUANTITIES if name in tree["attractors"]]
    if quantity is not None and quantity not in known:
        raise ParameterError(f"quantity must be one of {', '.join(known)}, got {shown(quantity)}", "quantity")
    quantity = quantity or ("slowest" if "slowest" in known and is_flat(tree["attractors"]["amplitude"].values) else "amplitude")
    tree = _with_finite_speeds(tree) if quantity == "slowest" else tree
    low, high = (float(x) for x in tree.attrs["bounds"])
    names, unit = tree.attrs["coordinate"], _unit(tree)
    simulated = "stroboscopic" in tree.children and ax is None
    if ax is None:
        figure = new_figure(DOUBLE_COLUMN, 150.0 if simulated else 95.0) if figure is None else figure
        axes = figure.subplots(1 + simulated, 1, sharex=True, squeeze=False, height_ratios=[3, 2][: 1 + simulated])[:, 0]
    else:
        axes = np.array([ax])
    axes[0].set_xlim(low, high)
    bottom, top = _range(tree, quantity, low, high)
    axes[0].set_ylim(bottom - 0.02 * (top - bottom), top + 0.08 * (top - bottom))  # so that marks on the axis are not cut
    axes[0].set_ylabel(f"least speed of an impact{unit}" if quantity == "slowest" else f"${peak(names, quantity)}${unit}")
    limits = [] if quantity == "slowest" else [float(limit) for limit in np.atleast_1d(tree.attrs["limits"])]
    draw_response(axes[0], tree, quantity)
    draw_limits(axes[0], limits)
    note_missed(axes[0], tree)
    if simulated:
        draw_stroboscopic_states(axes[1], tree)
        axes[1].set_ylabel(f"${symbol(names.split()[0])}$ at phase 0{unit}")
        axes[1].set_title("stroboscopic points of direct simulation", loc="left", pad=3)
    axes[-1].set_xlabel(parameter_name(tree.attrs["path"]))
    response_legend(figure if ax is None else ax, [tree], limits=min(limits, default=np.inf) < axes[0].get_ylim()[1])
    return axes if ax is None else ax


def _with_finite_speeds(tree: Any) -> Any:
    """The diagram with 0 for the least impact speed of orbits without impacts, as simulated motions have it."""
    tree = tree.copy()
    for table, name in (("points", "slowest"), ("special", "special_slowest")):
        if name in tree[table]:
            speeds = tree[table][name]
            tree[table][name] = speeds.where(np.isfinite(speeds), 0.0)
    return tree


def _unit(tree: Any) -> str:
    """The unit of the amplitudes, as the branches carry it."""
    points = tree["points"]
    return unit_in_brackets(points["amplitude"]) if "amplitude" in points else ""


def _range(tree: Any, quantity: str, low: float, high: float) -> tuple[float, float]:
    """The least and the largest value of a quantity within the bounds; amplitudes and speeds begin at 0. If equal, 1 apart."""
    points, found = tree["points"], tree["attractors"][quantity].values
    if points.sizes["point"]:
        x = points["parameter"].values
        found = np.append(found, points[quantity].values[(x >= low) & (x <= high)])
    found = found[np.isfinite(found)]
    from_zero = quantity in ("amplitude", "slowest")
    top = float(np.max(found, initial=0.0 if from_zero or not found.size else -np.inf))
    bottom = 0.0 if from_zero else float(np.min(found, initial=top))
    return (bottom, top) if top > bottom else (bottom, bottom + 1.0)


def draw_stroboscopic_states(ax: Any, tree: Any) -> None:
    """The states at phase 0 of the load of the simulated motions from every start, period after period."""
    section = tree["stroboscopic"]
    draw_bands(ax, tree)
    moving = section["peak"].values > DRAWN_STATES.at_rest
    values, places = section["value"].values[moving], section["position"].values[moving]
    low, high = ax.get_xlim()
    width = ax.get_window_extent().width / ax.figure.dpi * 72.0  # points
    size = np.clip(0.5 * width / max(len(np.unique(values)), 1), DRAWN_STATES.finest, DRAWN_STATES.coarsest)
    ax.plot(values, places, markersize=size, **POINTS)
    ax.set_xlim(low, high)
