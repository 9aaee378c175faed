"""Chaos: Lyapunov exponents, the verdict on a motion, and the bands of chaos along a parameter."""

from __future__ import annotations

import textwrap
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from saltus.errors import ParameterError
from saltus.plots.conventions import (
    LOOK,
    axes_or_new,
    cell_edges,
    drawing,
    legend_of,
    new_figure,
    outside_legend,
    parameter_name,
    plane_of,
    state_label,
    symbol,
    unit_in_brackets,
    varied,
)
from saltus.plots.response import BAND_NAMES, BANDS, draw_bands, draw_stroboscopic_states

NAME = r"exponent $\lambda$ (per unit of $\tau$)"
ZERO: dict[str, Any] = {"color": LOOK.ink, "linewidth": 0.5, "zorder": 1}
UNRESOLVED: dict[str, Any] = {"color": "#e6e6e6", "linewidth": 0.0, "zorder": 0}
HALVES = (("at_half", "<", "first half of the run"), ("later_half", ">", "second half of the run"))


@drawing
def draw_exponents(
    dataset: Any, *, ax: Axes | None = None, width: float = LOOK.single_column
) -> Axes:
    """Draw the exponents of one motion with 95 % intervals, those of both halves of the run, and
    that of two trajectories.

    The grey range, 2 ln(t) / t for the time t, cannot be distinguished from 0.
    """
    own, ax = ax is None, axes_or_new(ax, width, 0.75 * width)
    values = dataset["exponent"].values
    errors = dataset["error"].values
    index = np.arange(1, len(values) + 1)
    ax.axhline(0.0, **ZERO)
    known = np.isfinite(values)
    resolution = float(dataset["resolution"])
    if known.any():
        ax.axhspan(-resolution, resolution, label="not distinct from 0", **UNRESOLVED)
    ax.errorbar(
        index[known],
        values[known],
        errors[known],
        color=LOOK.stable,
        fmt="o",
        ms=4.0,
        capsize=3.0,
        lw=0.9,
        label="exponent, 95 %",
    )
    for (name, marker, label), shift in zip(HALVES, (-0.12, 0.12), strict=True):
        ax.plot(
            index + shift,
            dataset[name].values,
            marker=marker,
            ms=3.5,
            mfc="white",
            mec=LOOK.ink,
            mew=0.6,
            ls="none",
            label=label,
        )
    stroboscopic = float(dataset["stroboscopic"])
    if np.isfinite(stroboscopic):
        ax.plot(
            1.24,
            stroboscopic,
            marker="x",
            ms=4.5,
            mec=LOOK.ink,
            ls="none",
            label="two trajectories",
        )
    for place in index[~known]:
        text = r"$-\infty$" if values[place - 1] == -np.inf else "undefined"
        ax.annotate(text, (place, 0.0), (0, -9), textcoords="offset points", ha="center", va="top")
    ax.set_xlim(0.5, len(values) + 0.5)
    ax.set_xticks(index, [rf"$\lambda_{{{i}}}$" for i in index])
    ax.tick_params(axis="x", length=0.0)
    ax.set_ylabel(NAME)
    if known.any():
        legend_of(ax, own, ax.get_legend_handles_labels()[0], ncols=2)
    return ax


@drawing
def draw_exponents_along(
    dataset: Any, *, ax: Axes | None = None, width: float = 1.3 * LOOK.single_column
) -> Axes:
    """Draw the dataset of `lyapunov_many`: over one dimension all exponents with their errors, over
    two the largest one.

    Where a motion rests its exponents are -inf or do not exist, and lines are interrupted.

    Raises
    ------
    ParameterError
        More than two dimensions.
    """
    dims = [str(dim) for dim in dataset["exponent"].dims if dim != "index"]
    if len(dims) > 2:
        raise ParameterError(
            f"exponents over {len(dims)} dimensions have no picture; select two of {dims}", "result"
        )
    own = ax is None
    ax = axes_or_new(ax, width, 0.62 * width)
    if len(dims) == 2:
        return _draw_map(ax, dataset, dims)
    values, errors = (np.atleast_2d(dataset[name].values) for name in ("exponent", "error"))
    label, x = varied(dataset, dims[0]) if dims else ("", np.zeros(1))
    values = np.where(np.isfinite(values), values, np.nan)
    ax.axhline(0.0, **ZERO)
    marker = "o" if len(x) == 1 else None
    for i, line in enumerate((LOOK.stable_line, LOOK.unstable_line)):
        ax.fill_between(
            x,
            values[:, i] - errors[:, i],
            values[:, i] + errors[:, i],
            color=line["color"],
            alpha=0.2,
            lw=0.0,
        )
        ax.plot(x, values[:, i], label=rf"$\lambda_{i + 1}$", marker=marker, ms=4.0, **line)
    ax.set_xlabel(label)
    ax.set_ylabel(NAME)
    legend_of(ax, own)
    return ax


def _draw_map(ax: Axes, dataset: Any, dims: list[str]) -> Axes:
    """The largest exponent over two dimensions; a line encloses where it is above its error and the
    resolution.
    """
    largest = dataset["exponent"].isel(index=0).transpose(*dims).values.T
    (first, x), (second, y) = (varied(dataset, dim) for dim in dims)
    mesh = ax.pcolormesh(
        cell_edges(x),
        cell_edges(y),
        np.where(np.isfinite(largest), largest, np.nan),
        cmap="viridis_r",
        rasterized=True,
    )
    ax.set_facecolor(LOOK.faint)
    positive = dataset["positive"].transpose(*dims).values.T.astype(float)
    if min(positive.shape) > 1 and 0.0 < positive.mean() < 1.0:
        ax.contour(x, y, positive, levels=[0.5], colors=[LOOK.ink], linewidths=0.9)
    ax.set_xlabel(first)
    ax.set_ylabel(second)
    ax.figure.colorbar(mesh, ax=ax, label=r"largest exponent $\lambda_1$ (per unit of $\tau$)")
    return ax


@drawing
def draw_verdict(
    dataset: Any, *, ax: Axes | None = None, width: float = LOOK.single_column
) -> Axes:
    """Draw the states at phase 0 on which a motion ends, its orbit if there is one, and the
    verdict's sentence; returns `ax`.
    """
    own, ax = ax is None, axes_or_new(ax, width, 0.85 * width)
    plane = plane_of(dataset)
    states = [dataset[f"section_{name}"].values for name in plane]
    many = len(states[0]) > 64
    if f"curve_{plane[0]}" in dataset:
        ax.plot(
            *(dataset[f"curve_{name}"].values for name in plane),
            label="its orbit",
            **LOOK.stable_line,
        )
    ax.plot(
        *states,
        ls="none",
        marker="o",
        color=LOOK.ink,
        ms=1.2 if many else 4.5,
        mew=0.0,
        label="states at phase 0",
        rasterized=many,
    )
    ax.set_xlabel(state_label(dataset, f"section_{plane[0]}", plane))
    ax.set_ylabel(state_label(dataset, f"section_{plane[1]}", plane))
    legend_of(ax, own, markerscale=4.0 if many else 1.0)
    if own:
        sentence = f"{dataset['kind'].values}: {dataset['reason'].values}".replace("+-", "\u00b1")
        ax.set_title("\n".join(textwrap.wrap(sentence, 62)), loc="left", fontsize=8)
    return ax


VERDICTS = {
    "undecided": "x",
    "chaotic": "o",
    "transient": "^",
    "periodic": "s",
    "quasi_periodic": "D",
}


@drawing
def draw_chaotic_bands(tree: Any, *, ax: Axes | None = None, figure: Figure | None = None) -> Any:
    """Draw the tree of `chaotic_bands`: states at phase 0 above, exponents of unsettled motions
    below; returns both axes.

    Into given axes only the states at phase 0 are drawn.
    """
    if ax is not None:
        return _draw_states(ax, tree)
    figure = new_figure(LOOK.double_column, 120.0) if figure is None else figure
    above, below = figure.subplots(2, 1, sharex=True, height_ratios=(3, 2))
    _draw_states(above, tree).set_xlabel("")
    handles: list[Any] = (
        [Patch(color=BANDS["CH"], label=BAND_NAMES["CH"])] if tree["bands"].sizes["band"] else []
    )
    handles += _draw_deciding_exponents(below, tree)
    if handles:
        outside_legend(figure, handles=handles, ncols=4)
    return np.array([above, below])


def _draw_states(ax: Axes, tree: Any) -> Axes:
    ax.set_xlim(*(float(x) for x in tree.attrs["bounds"]))
    draw_stroboscopic_states(ax, tree)
    states = tree["stroboscopic"]
    name = symbol(tree.attrs["coordinate"])
    ax.set_ylabel(f"${name}$ at phase 0{unit_in_brackets(states['position'])}")
    ax.set_xlabel(parameter_name(tree.attrs["path"]))
    return ax


def _draw_deciding_exponents(below: Axes, tree: Any) -> list[Any]:
    """The exponents of unsettled motions, with a mark for each verdict; returns the handles of the
    marks for a legend.
    """
    below.axhline(0.0, **ZERO)
    draw_bands(below, tree)
    handles = []
    table = tree["exponents"]
    verdict = table["verdict"].values
    marked = table["verdict"].attrs
    for number, meaning in zip(marked["flag_values"], marked["flag_meanings"].split(), strict=True):
        here = (verdict == number) & np.isfinite(table["exponent"].values)
        if here.any():
            columns = (table[column].values[here] for column in ("value", "exponent", "error"))
            marks: dict[str, Any] = {
                "color": LOOK.ink,
                "fmt": VERDICTS[meaning],
                "ms": 3.0,
                "mfc": "white",
                "lw": 0.6,
                "mew": 0.6,
            }
            handles.append(
                below.errorbar(
                    *columns,
                    capsize=1.5,
                    label=f"exponent, 95 %: {meaning.replace('_', '-')}",
                    **marks,
                )
            )
    if not np.isfinite(table["exponent"].values).any():
        below.text(
            0.5, 0.5, "all motions settle", transform=below.transAxes, ha="center", va="bottom"
        )
        below.set_yticks([0.0])
    below.set_ylabel(NAME)
    below.set_xlabel(parameter_name(tree.attrs["path"]))
    return handles
