"""Orbits that a search has found along a parameter, and a cascade of period doublings."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import NullLocator

from saltus.plots.axis_names import parameter_name, peak, unit_in_brackets
from saltus.plots.conventions import (
    DOUBLE_COLUMN,
    INK,
    LIMIT_LINE,
    SINGLE_COLUMN,
    STABLE,
    STABLE_LINE,
    UNSTABLE,
    axes_or_new,
    new_figure,
)
from saltus.plots.drawing import drawing

FEIGENBAUM = 4.669201609102990  # the limit of the ratios of a cascade
SETTLED: dict[str, Any] = {"color": INK, "linestyle": "none", "marker": "+", "markersize": 5.0, "markeredgewidth": 0.6}
FACES = {True: ("stable orbit", STABLE, STABLE, "o"), False: ("unstable orbit", "white", UNSTABLE, "s")}


@drawing
def draw_search(dataset: Any, *, ax: Axes | None = None, width: float = 1.3 * SINGLE_COLUMN) -> Axes:
    """Draw the amplitudes of the orbits of `search_orbits`, stable ones filled, unstable ones open; returns `ax`.

    Beside a mark is the period, if it is not 1; crosses are the orbits on which simulated motions have settled.
    """
    ax = axes_or_new(ax, width, 0.62 * width)
    x, y = dataset["parameter"].values, dataset["amplitude"].values
    stable = dataset["stable"].values.astype(bool)
    for is_stable, (label, face, edge, marker) in FACES.items():
        here = stable == is_stable
        if here.any():
            ax.plot(x[here], y[here], ls="none", marker=marker, ms=4.0, mfc=face, mec=edge, mew=0.8, label=label)
    for place, height, period in zip(x, y, dataset["period"].values, strict=True):
        if period > 1:
            ax.annotate(str(period), (place, height), (4, 2), textcoords="offset points", fontsize=7)
    settled = dataset["settled_parameter"].values, dataset["settled_amplitude"].values
    if settled[0].size:
        ax.plot(*settled, label="direct simulation", zorder=4, **SETTLED)
    ax.set_ylim(0.0, 1.08 * max([*y, *settled[1]], default=1.0))
    ax.set_xlabel(parameter_name(dataset.attrs["path"]))
    ax.set_ylabel(f"${peak(dataset.attrs['coordinate'])}${unit_in_brackets(dataset['amplitude'])}")
    if ax.get_legend_handles_labels()[0]:
        ax.legend(loc="best")
    return ax


@drawing
def draw_cascade(dataset: Any, *, ax: Axes | None = None, figure: Figure | None = None) -> Any:
    """Draw a cascade of period doublings: their parameters, the ratios of successive distances and the limit; returns both axes.

    Into given axes only the parameters are drawn.
    """
    if ax is not None:
        return _draw_doublings(ax, dataset)
    figure = new_figure(DOUBLE_COLUMN, 68.0) if figure is None else figure
    left, right = figure.subplots(1, 2)
    _draw_doublings(left, dataset)
    periods, ratios = dataset["period"].values, dataset["ratio"].values
    right.axhline(FEIGENBAUM, label=f"limit {FEIGENBAUM:.4f}", **LIMIT_LINE)
    right.plot(periods[: len(ratios)], ratios, marker="s", ms=4.0, mfc="white", **STABLE_LINE)
    right.set_ylabel("ratio of successive distances")
    right.legend(loc="best")
    _name_periods(right, periods)
    return np.array([left, right])


def _draw_doublings(ax: Axes, dataset: Any) -> Axes:
    periods = dataset["period"].values
    ax.plot(periods, dataset["parameter"].values, marker="s", ms=4.0, mfc="white", **STABLE_LINE)
    ax.set_ylabel(f"{parameter_name(dataset.attrs['path'])} of the doubling")
    _name_periods(ax, periods)
    return ax


def _name_periods(ax: Axes, periods: np.ndarray) -> None:
    ax.set_xscale("log", base=2)
    ax.set_xlim(periods[0] / 1.4, periods[-1] * 1.4)
    ax.xaxis.set_minor_locator(NullLocator())
    ax.set_xticks(periods, [str(period) for period in periods])
    ax.set_xlabel("forcing periods of the orbit that doubles")
