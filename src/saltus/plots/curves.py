"""Curves over a parameter: a branch, a curve of special points, a backbone, attractors; the orbits
of a search, and a cascade.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import NullLocator

from saltus.errors import ParameterError
from saltus.plots.basins import attractor_colours
from saltus.plots.branch_cuts import ModelValidity, smooth_lines
from saltus.plots.conventions import (
    LOOK,
    axes_or_new,
    chosen_quantity,
    drawing,
    legend_of,
    marks_of,
    new_figure,
    parameter_name,
    peak,
    quantity_name,
    shown_quantity,
    symbol,
    unit_in_brackets,
    with_amplitudes,
)
from saltus.plots.response import MARK_NAMES, MARKS, line_handles, line_style

RESTS: dict[str, dict[str, Any]] = {
    "RL": {"marker": "x", "markersize": 3.4},
    "CH": {"marker": "+", "markersize": 4.4},
}
REST_NAMES = {"RL": "lost release (RL)", "CH": "end of a rest (CH)"}


PALE_INK: dict[str, Any] = {"alpha": 0.3}  # of what is not proved
PROVED_MARK: dict[str, Any] = {
    "marker": ".",
    "ms": 2.2,
    "ls": "none",
    "color": LOOK.ink,
    "zorder": 6,
}


def _in_ink(dataset: Any) -> Iterator[tuple[Any, dict[str, Any]]]:
    """The runs of a branch's points that are proved and that are not, with their ink; a step
    between both is not proved.
    """
    if "proved" not in dataset:
        yield dataset, {}
        return
    proved = dataset["proved"].values == 1
    changes = [0, *(np.flatnonzero(proved[1:] != proved[:-1]) + 1), proved.size]
    for first, end in itertools.pairwise(changes):
        if proved[first]:
            yield dataset.isel(point=slice(first, end)), {}
        else:
            part = slice(max(first - 1, 0), min(end + 1, proved.size))
            yield dataset.isel(point=part), PALE_INK


def branch_quantities(dataset: Any) -> list[str]:
    """The numbers of the points of a branch that its special points have, too."""
    return [
        str(name)
        for name, part in dataset.data_vars.items()
        if part.dims == ("point",)
        and part.dtype.kind in "fi"
        and name != "parameter"
        and f"special_{name}" in dataset
    ]


def _finite(dataset: Any, quantity: str) -> Any:
    """The points and the special points of a branch at which a quantity has a value."""
    points = np.isfinite(dataset[quantity].values)
    special = np.isfinite(dataset[f"special_{quantity}"].values)
    if not points.any():
        raise ParameterError(f"{quantity} has no value at any point of this branch", "quantity")
    if points.all() and special.all():
        return dataset
    return dataset.isel(point=points, special=special)


@drawing
def draw_branch(
    dataset: Any,
    quantity: str | None = None,
    *,
    ax: Axes | None = None,
    width: float = LOOK.single_column,
) -> Axes:
    """Draw the dataset of a branch: stable motions solid, unstable ones dashed, and its special
    points; returns `ax`.

    The `quantity` is any number of its points, or a function of a motion. By default it is the
    amplitude; of several coordinates that of the one which the load drives. With several there are
    "amplitude_x", "largest_x" and "smallest_x" of each coordinate and of each named point x, of
    which "x" alone is the amplitude.

    Of the dataset of a proof, what is proved is in full ink, and the rest pale.
    """
    dataset = with_amplitudes(dataset)
    quantity = chosen_quantity(quantity, branch_quantities(dataset), shown_quantity(dataset))
    dataset = _finite(dataset, quantity)
    own, ax = ax is None, axes_or_new(ax, width, 0.75 * width)
    for part, ink in _in_ink(dataset):
        for line in smooth_lines(part, quantity):
            ax.plot(*line.places.T, **line_style(line.stable, line.validity), **ink)
    kinds = dataset["kind"].values
    for kind, mark in (MARKS | RESTS).items():
        if (kinds == kind).any():
            places = (
                dataset[f"special_{name}"].values[kinds == kind] for name in ("parameter", quantity)
            )
            ax.plot(
                *places,
                ls="none",
                mfc="white",
                mec=LOOK.ink,
                mew=0.5,
                zorder=5,
                label=(MARK_NAMES | REST_NAMES)[kind],
                **mark,
            )
    handles, labels, handlers = line_handles([dataset])
    named = dict(zip(labels, handles, strict=True)) | marks_of(ax)
    if "special_proved" in dataset:
        proved = dataset["special_proved"].values == 1
        places = (dataset[f"special_{name}"].values[proved] for name in ("parameter", quantity))
        ax.plot(*places, label="proved", **PROVED_MARK)
    if "proved" in dataset:
        ink_line = {**line_style(True, ModelValidity.ASSUMPTION), "color": LOOK.ink}
        named["proved"] = (Line2D([], [], **ink_line), Line2D([], [], **PROVED_MARK))
        if not dataset["proved"].values.all():
            named["not proved"] = Line2D([], [], **ink_line, **PALE_INK)
    legend_of(
        ax,
        own,
        [*named.values()],
        labels=[*named],
        handler_map=handlers,
        handlelength=3.6,
        ncols=2,
    )
    ax.set_xlabel(parameter_name(dataset.attrs["path"]))
    ax.set_ylabel(f"{quantity_name(dataset, quantity)}{unit_in_brackets(dataset[quantity])}")
    return ax


# of special points in two parameters, told apart in grey too
CURVES: dict[str, dict[str, Any]] = {
    "LP": {"color": LOOK.ink, "linestyle": LOOK.dashes[0]},
    "PD": {"color": LOOK.stable, "linestyle": LOOK.dashes[1]},
    "BPC": {"color": LOOK.limit, "linestyle": LOOK.dashes[3]},
    "NS": {"color": LOOK.separatrix, "linestyle": LOOK.dashes[2]},
    "GR": {"color": LOOK.unstable, "linestyle": LOOK.dashes[2]},
    "SW": {"color": LOOK.limit, "linestyle": LOOK.dashes[4]},
}


@drawing
def draw_special_curve(
    dataset: Any, *, ax: Axes | None = None, width: float = LOOK.single_column
) -> Axes:
    """Draw a curve of special points in the plane of its two parameters, as
    `SpecialCurve.to_xarray` gives it; returns `ax`.
    """
    own = ax is None
    ax = axes_or_new(ax, width, 0.75 * width)
    kind = str(dataset.attrs["kind"])
    ax.plot(
        *dataset["parameter"].values.T,
        label=MARK_NAMES.get(kind, kind),
        **CURVES.get(kind, {"color": LOOK.ink}),
    )
    first, second = (str(path) for path in dataset["path"].values)
    ax.set_xlabel(parameter_name(first))
    ax.set_ylabel(parameter_name(second))
    legend_of(ax, own)
    return ax


@drawing
def draw_attractors_along(
    dataset: Any, *, ax: Axes | None = None, width: float = 1.3 * LOOK.single_column
) -> Axes:
    """Draw the amplitudes of `attractors_along`, each attractor in a colour of its own; returns
    `ax`.
    """
    own = ax is None
    ax = axes_or_new(ax, width, 0.62 * width)
    numbers = [int(number) for number in dataset["attractor"].values]
    for number, colour in attractor_colours(numbers).items():
        sizes = dataset["amplitude"].sel(attractor=number).values
        kinds = {str(kind) for kind in dataset["kind"].sel(attractor=number).values} - {""}
        label = f"{number}: {' or '.join(sorted(kinds))}"
        ax.plot(
            dataset["value"].values,
            sizes,
            color=colour,
            marker=".",
            ms=3.5,
            mec=LOOK.ink,
            mew=0.2,
            label=label,
        )
    ax.set_xlim(*np.sort(dataset["value"].values[[0, -1]]))
    ax.set_xlabel(parameter_name(dataset.attrs["path"]))
    ax.set_ylabel(f"{quantity_name(dataset, 'amplitude')}{unit_in_brackets(dataset['amplitude'])}")
    legend_of(ax, own)
    return ax


SETTLED: dict[str, Any] = {
    "color": LOOK.ink,
    "linestyle": "none",
    "marker": "+",
    "markersize": 5.0,
    "markeredgewidth": 0.6,
}
FACES = {
    True: ("stable orbit", LOOK.stable, LOOK.stable, "o"),
    False: ("unstable orbit", "white", LOOK.unstable, "s"),
}


@drawing
def draw_search(
    dataset: Any, *, ax: Axes | None = None, width: float = 1.3 * LOOK.single_column
) -> Axes:
    """Draw the amplitudes of the orbits of `search_orbits`, stable ones filled, unstable ones open;
    returns `ax`.

    Beside a mark is the period, if it is not 1; crosses are the orbits on which simulated motions
    have settled.
    """
    own = ax is None
    ax = axes_or_new(ax, width, 0.62 * width)
    x = dataset["parameter"].values
    y = dataset["amplitude"].values
    stable = dataset["stable"].values.astype(bool)
    for is_stable, (label, face, edge, marker) in FACES.items():
        here = stable == is_stable
        if here.any():
            ax.plot(
                x[here],
                y[here],
                ls="none",
                marker=marker,
                ms=4.0,
                mfc=face,
                mec=edge,
                mew=0.8,
                label=label,
            )
    for place, height, period in zip(x, y, dataset["period"].values, strict=True):
        if period > 1:
            ax.annotate(
                str(period), (place, height), (4, 2), textcoords="offset points", fontsize=7
            )
    settled = dataset["settled_parameter"].values, dataset["settled_amplitude"].values
    if settled[0].size:
        ax.plot(*settled, label="direct simulation", zorder=4, **SETTLED)
    ax.set_ylim(0.0, 1.08 * max([*y, *settled[1]], default=1.0))
    ax.set_xlabel(parameter_name(dataset.attrs["path"]))
    ax.set_ylabel(f"${peak(dataset.attrs['coordinate'])}${unit_in_brackets(dataset['amplitude'])}")
    if ax.get_legend_handles_labels()[0]:
        legend_of(ax, own)
    return ax


@drawing
def draw_cascade(dataset: Any, *, ax: Axes | None = None, figure: Figure | None = None) -> Any:
    """Draw a cascade of period doublings: their parameters, the ratios of successive distances and
    the limit; returns both axes.

    Into given axes only the parameters are drawn.
    """
    if ax is not None:
        return _draw_doublings(ax, dataset)
    figure = new_figure(LOOK.double_column, 68.0) if figure is None else figure
    left, right = figure.subplots(1, 2)
    _draw_doublings(left, dataset)
    periods = dataset["period"].values
    ratios = dataset["ratio"].values
    # Feigenbaum's constant
    right.axhline(4.669201609102990, label="limit 4.6692", **LOOK.limit_line)
    right.plot(periods[: len(ratios)], ratios, marker="s", ms=4.0, mfc="white", **LOOK.stable_line)
    right.set_ylabel("ratio of successive distances")
    legend_of(right, False)
    _name_periods(right, periods)
    return np.array([left, right])


def _draw_doublings(ax: Axes, dataset: Any) -> Axes:
    periods = dataset["period"].values
    ax.plot(
        periods, dataset["parameter"].values, marker="s", ms=4.0, mfc="white", **LOOK.stable_line
    )
    ax.set_ylabel(f"{parameter_name(dataset.attrs['path'])} of the doubling")
    _name_periods(ax, periods)
    return ax


def _name_periods(ax: Axes, periods: np.ndarray) -> None:
    ax.set_xscale("log", base=2)
    ax.set_xlim(periods[0] / 1.4, periods[-1] * 1.4)
    ax.xaxis.set_minor_locator(NullLocator())
    ax.set_xticks(periods, [str(period) for period in periods])
    ax.set_xlabel("forcing periods of the orbit that doubles")


BACKBONE_LINE: dict[str, Any] = {
    "color": LOOK.ink,
    "linestyle": (0, (6, 1.5, 1, 1.5)),
    "linewidth": 1.1,
}


@drawing
def draw_backbone(
    dataset: Any, *, ax: Axes | None = None, width: float = LOOK.single_column
) -> Axes:
    """Draw the dataset of `backbone`: amplitudes over the frequencies of the free orbits; returns
    the axes.
    """
    ax = axes_or_new(ax, width, 0.75 * width)
    ax.plot(dataset["frequency"].values, dataset["amplitude"].values, **BACKBONE_LINE)
    ax.set_xlabel(r"frequency $2\pi/T$ of free motions")
    ax.set_ylabel(
        f"${symbol(dataset.attrs['coordinate'])}$ at the turning "
        f"point{unit_in_brackets(dataset['amplitude'])}"
    )
    return ax
