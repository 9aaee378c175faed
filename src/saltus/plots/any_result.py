"""One function that draws any result of saltus, by its kind.

Pictures of experiments are here: an energy balance, the fit of a system to a measurement, and which
loads overturn a block.
"""

from __future__ import annotations

import json
import math
import textwrap
import warnings
from collections.abc import Callable
from contextlib import nullcontext, suppress
from inspect import signature
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import FixedLocator, FuncFormatter, MaxNLocator

from saltus.checks import check_number
from saltus.errors import ParameterError, near, shown
from saltus.plots.basins import (
    draw_attractors,
    draw_basins,
    draw_integrity,
    draw_uncertainty,
    draw_wada,
)
from saltus.plots.chaos import (
    draw_chaotic_bands,
    draw_exponents,
    draw_exponents_along,
    draw_verdict,
)
from saltus.plots.chart import draw_stability_chart
from saltus.plots.conventions import (
    LEGENDS,
    LOOK,
    NARROWEST,
    WIDEST,
    asked_legend,
    axes_or_new,
    cell_edges,
    drawing,
    figure_of,
    legend_at,
    legend_of,
    new_figure,
    shades,
    style_on_top,
    with_amplitudes,
)
from saltus.plots.conventions import style as look
from saltus.plots.curves import (
    draw_attractors_along,
    draw_backbone,
    draw_branch,
    draw_cascade,
    draw_search,
    draw_special_curve,
)
from saltus.plots.motion import (
    draw_ensemble,
    draw_motion,
    draw_proof,
    draw_sensitivities,
    draw_sweep,
)
from saltus.plots.plane import draw_manifold, draw_plane, draw_separatrix
from saltus.plots.response import draw_diagram
from saltus.plots.unit_cell import draw_unit_cell
from saltus.progress import show_below_cell

# stands; overturns at once, after one impact, after more
FILLS = ("white", "#bcd2ea", "#f3c98b", "#c9a0c9")
IMPACTS = ("without an impact", "after 1 impact", "after 2 or more impacts")
POINTS = ("o", "x", ".")  # the markers of borders that are single points


@drawing
def draw_overturning(
    dataset: Any, *, ax: Axes | None = None, width: float = 1.3 * LOOK.single_column
) -> Axes:
    """Draw the map of `overturning_spectrum` in shades, and its borders as lines; returns the
    axes.
    """
    own = ax is None
    ax = axes_or_new(ax, width, 0.75 * width)
    impacts = dataset["impacts"].values
    fallen = dataset["overturned"].values != 0
    kinds = np.where(fallen, 1 + np.minimum(impacts, len(FILLS) - 2), 0)
    edges = cell_edges(dataset["frequency"].values), cell_edges(dataset["amplitude"].values)
    ax.pcolormesh(
        *edges,
        kinds.T,
        cmap=ListedColormap(FILLS),
        vmin=-0.5,
        vmax=len(FILLS) - 0.5,
        rasterized=True,
    )
    shown = sorted(set(np.minimum(impacts[fallen], len(FILLS) - 2).tolist()))
    names = IMPACTS
    handles: list[Any] = [
        Patch(facecolor=FILLS[1 + k], label=f"overturns {names[k]}") for k in shown
    ]
    counts = np.minimum(dataset["border_impacts"].values, len(IMPACTS) - 1)
    numbers = dataset["border_number"].values
    for count in sorted(set(counts.tolist())):
        line: dict[str, Any] = {
            "color": LOOK.ink,
            "linestyle": LOOK.dashes[count],
            "linewidth": 1.0,
        }
        # borders that are not followed are single points
        points = all(
            np.count_nonzero(numbers == number) == 1 for number in numbers[counts == count]
        )
        look = (
            {**line, "linestyle": "", "marker": POINTS[count], "markersize": 3} if points else line
        )
        for number in sorted(set(numbers[counts == count].tolist())):
            part = numbers == number
            ax.plot(
                dataset["border_frequency"].values[part],
                dataset["border_amplitude"].values[part],
                **look,
            )
        handles.append(Line2D([], [], label=f"border {IMPACTS[count]}", **look))
    system = json.loads(dataset.attrs.get("system", "{}"))
    signal = system.get("load", {}).get(dataset.attrs["channel"], {})
    pulse = signal.get("type", "record") if isinstance(signal, dict) else "record"
    # a block's time is scaled by p, and the ground's acceleration by the gravity g
    of_block = system.get("model", {}).get("type") == "RockingBlock"
    per_p = " / p" if of_block else ""
    per_g = " / g" if of_block and signal.get("quantity") == "acceleration" else ""
    ax.set_xlim(edges[0][0], edges[0][-1])
    ax.set_ylim(edges[1][0], edges[1][-1])
    ax.set_xlabel(
        "speed of the record" if pulse == "record" else rf"frequency $\omega{per_p}$ of the pulse"
    )
    ax.set_ylabel(
        "factor of the record"
        if pulse == "record"
        else f"amplitude of the {signal.get('quantity', 'pulse')}{per_g}"
    )
    legend_of(ax, own, handles, ncols=2)
    return ax


@drawing
def draw_fragility(
    dataset: Any, *, ax: Axes | None = None, width: float = LOOK.single_column
) -> Axes:
    """Draw the share of the loads that overturn, with its interval, over the scale of `fragility`;
    returns the axes.
    """
    own = ax is None
    ax = axes_or_new(ax, width, 0.7 * width)
    scale = dataset["scale"].values
    ax.fill_between(
        scale,
        dataset["lower"].values,
        dataset["upper"].values,
        color=LOOK.stable,
        alpha=0.18,
        lw=0.0,
        label="95 % interval",
    )
    ax.plot(
        scale,
        dataset["share"].values,
        color=LOOK.stable,
        lw=1.2,
        label=f"share of {dataset.sizes['record']} loads",
    )
    ax.set(
        xlabel="scale of the loads",
        ylabel="share that overturns",
        ylim=(-0.02, 1.02),
        xlim=(scale[0], scale[-1]),
    )
    legend_of(ax, own)
    return ax


@drawing
def draw_energies(
    dataset: Any, *, ax: Axes | None = None, width: float = LOOK.single_column
) -> Axes:
    """Draw the dataset of `energies`: the mean power of each part as a bar, by its role; returns
    the axes.
    """
    parts = [str(name) for name in dataset["part"].values]
    own = ax is None
    ax = axes_or_new(ax, width, 14.0 + 6.0 * len(parts))
    roles = dataset["role"].values
    for role, colour in zip(("supplied", "dissipated", "stored"), shades(3), strict=True):
        chosen = np.flatnonzero(roles == role)
        ax.barh(chosen, dataset["power"].values[chosen], height=0.6, color=colour, label=role)
    ax.axvline(0.0, color="k", linewidth=0.6)
    ax.set_yticks(range(len(parts)), parts)
    ax.invert_yaxis()
    ax.set_xlabel("mean power")
    ax.set_ylabel("part")
    legend_of(ax, own)
    return ax


@drawing
def draw_fit(
    dataset: Any, *, ax: Axes | None = None, width: float = 1.3 * LOOK.single_column
) -> Axes:
    """Draw the dataset of a `fit`: what was measured as dots, the motion as lines; of impact times
    alone by how much the motion misses them; returns the axes."""
    own = ax is None
    ax = axes_or_new(ax, width, 0.62 * width)
    kinds = list(
        dict.fromkeys(
            zip(dataset["record"].values.tolist(), dataset["quantity"].values.tolist(), strict=True)
        )
    )
    sampled = [kind for kind in kinds if kind[1] != "impacts"]
    for (record, quantity), colour in zip(
        sampled or kinds, shades(len(sampled or kinds)), strict=True
    ):
        chosen = (dataset["record"].values == record) & (dataset["quantity"].values == quantity)
        time, measured, model, sigma = (
            dataset[n].values[chosen] for n in ("time", "measured", "model", "sigma")
        )
        label = quantity if len({r for r, _ in kinds}) == 1 else f"{quantity} of record {record}"
        if sampled:
            ax.plot(time, measured, ".", color=colour, markersize=2.5, alpha=0.5, zorder=1)
            ax.plot(time, model, "-", color=colour, linewidth=0.9, label=label, zorder=2)
        else:
            ax.errorbar(
                time,
                model - measured,
                sigma,
                fmt="o",
                color=colour,
                markersize=3,
                capsize=2,
                label=label,
            )
            ax.axhline(0.0, color="k", linewidth=0.6)
    ax.set_xlabel(r"$\tau$")
    ax.set_ylabel(
        "measured (dots), motion (lines)" if sampled else "time of the motion less that measured"
    )
    legend_of(ax, own)
    return ax


def draw_theorems(dataset: Any, *, ax: Axes | None = None, **options: Any) -> Any:
    """Draw the answer of a study's [prove]: a branch, or an orbit; returns the axes."""
    return (draw_branch if "box" in dataset.dims else draw_proof)(dataset, ax=ax, **options)


DRAWINGS: dict[str, Callable[..., Any]] = {
    "attractors": draw_attractors,
    "attractors along a parameter": draw_attractors_along,
    "backbone": draw_backbone,
    "basin_integrity": draw_integrity,
    "basins": draw_basins,
    "bifurcation_diagram": draw_diagram,
    "branch": draw_branch,
    "branch_proof": draw_branch,
    "cascade": draw_cascade,
    "cell": draw_unit_cell,
    "chaotic_bands": draw_chaotic_bands,
    "energies": draw_energies,
    "ensemble": draw_ensemble,
    "exponents": draw_exponents,
    "fragility": draw_fragility,
    "fit": draw_fit,
    "free_orbit": draw_motion,
    "frequency_sweep": draw_sweep,
    "lyapunov_many": draw_exponents_along,
    "manifold": draw_manifold,
    "mapped": draw_ensemble,
    "motion": draw_motion,
    "orbits": draw_search,
    "overturning_spectrum": draw_overturning,
    "periodic_orbit": draw_motion,
    "proof": draw_proof,
    "prove": draw_theorems,
    "phase_portrait": draw_plane,
    "response_spectrum": draw_diagram,
    "sensitivities": draw_sensitivities,
    "separatrix": draw_separatrix,
    "special_proof": draw_proof,
    "stability_chart": draw_stability_chart,
    "uncertainty_exponent": draw_uncertainty,
    "verdict": draw_verdict,
    "wada": draw_wada,
}  # by the attribute `kind`


SIZES = {"column": LOOK.single_column, "page": LOOK.double_column}  # of a journal, mm


def plot(
    result: Any,
    *,
    legend: bool | str | None = None,
    title: str | None = None,
    size: str | tuple[float, float] | None = None,
    dpi: float | None = None,
    style: Any = None,
    degrees: bool = False,
    **options: Any,
) -> Any:
    """Draw any result; returns the axes, or an array of them for several panels. In a notebook the
    picture is below the cell, and `saltus.save` writes it to a file. `plt.show()` shows what was
    drawn into figures of pyplot: `ax=plt.gca()`, or `figure=plt.figure()` for several panels.

    Parameters
    ----------
    result
        A Dataset or a DataTree that saltus has made, or a result with `to_xarray`, such as a motion
        or a branch. A tuple of such results, as `switch_branch` and `separatrices` return it, is
        drawn into the same axes.
    legend
        Where the legend is: "inside" the axes, "below" or to the "right" of them (below where that
        would take nearly half of the width), or False for
        none. A new figure has it below, where it covers nothing; given axes have it inside.
    title
        A title above the picture.
    size
        The size of a new figure: "column" or "page", one or both columns of a journal (90 and 190
        mm), or its width and height in mm.
    dpi
        The dots in an inch of a new figure; `saltus.save` writes at least 300.
    style
        A style of Matplotlib on top of the conventions: a name, a file or a dictionary.
    degrees
        Whether axes and colour bars of angles have degrees in place of radians.
    options
        Options of the function that draws it, such as `ax=` (or `figure=` for several panels) and
        `width=`, in mm.

    Raises
    ------
    ParameterError
        A result that has no picture, or an argument that the picture does not take.

    Examples
    --------
    >>> axes = saltus.plot(branch, legend="right", title="A resonance", size=(120, 60))
    >>> type(axes).__name__, (axes.figure.get_size_inches() * 25.4).round().tolist()
    ('Axes', [120.0, 60.0])
    """
    into_given = options.get("ax") is not None or options.get("figure") is not None
    _check_size(size, dpi, into_given, "width" in options)
    place = _place_of_legend(legend)
    if title is not None and not into_given:
        place = place or "below"  # above is the title
    with legend_at(place), style_on_top(_checked_style(style)):
        axes = _draw(result, options, size)
        if title is not None:
            _entitle(axes, str(title), into_given)
    figure = figure_of(axes)
    if degrees:
        in_degrees(axes)
    if isinstance(size, tuple):
        figure.set_size_inches(size[0] / 25.4, size[1] / 25.4)
        _notice_narrow_panels(figure, size)
    if dpi is not None:
        figure.set_dpi(dpi)
    if not into_given:
        show_below_cell(figure)
    return axes


def _entitle(axes: Any, title: str, into_given: bool) -> None:
    """A title above given axes, or above a new figure, broken to its width."""
    if into_given:
        np.ravel(axes)[0].set_title(title)
        return
    figure = figure_of(axes)
    letters = max(12, round(25.4 * figure.get_figwidth() / LETTER))
    with look():
        figure.suptitle("\n".join(textwrap.wrap(title, letters)), fontsize=TITLE_SIZE)


TITLE_SIZE = 10.0  # points


class DegreeTicks(MaxNLocator):
    """Round numbers of degrees on an axis whose data are in radians."""

    def tick_values(self, vmin: float, vmax: float) -> Any:
        """Their places, in radians."""
        return np.radians(super().tick_values(math.degrees(vmin), math.degrees(vmax)))


def in_degrees(axes: Any) -> None:
    """Write the numbers of axes in rad, and of their colour bars, as degrees; what is drawn stays
    where it is."""
    for ax in np.ravel(axes):
        for axis in (ax.xaxis, ax.yaxis):
            if _say_degrees(axis.label):
                axis.set_major_locator(DegreeTicks(nbins=6, steps=DEGREE_STEPS))
                axis.set_major_formatter(lambda value, place: f"{math.degrees(value):.10g}")
        for shaded in (*ax.collections, *ax.images):
            bar = getattr(shaded, "colorbar", None)
            if bar is None or not _say_degrees(bar.ax.yaxis.label):
                continue
            if not isinstance(bar.locator, FixedLocator):  # that of the edges of its colours
                bar.locator = DegreeTicks(nbins=6, steps=DEGREE_STEPS)
            bar.formatter = FuncFormatter(lambda value, place: f"{math.degrees(value):.3g}")
            bar.update_ticks()


def _say_degrees(label: Any) -> bool:
    """Whether the name of an axis has the unit rad, which becomes deg."""
    text = label.get_text()
    if text.endswith(" (rad)"):
        label.set_text(text.removesuffix("(rad)") + "(deg)")
        return True
    return False


DEGREE_STEPS = (1, 1.5, 2, 3, 4.5, 5, 9, 10)


LETTER = 1.75  # mm, the mean width of a letter of that size


def _place_of_legend(legend: Any) -> str | None:
    """The place of a legend by its name."""
    named = {None: None, True: None, False: "none"} | {place: place for place in LEGENDS}
    if not isinstance(legend, (bool, str, type(None))) or legend not in named:
        raise ParameterError(
            f'legend must be "inside", "below", "right" or False, got {shown(legend)}', "legend"
        )
    return named[legend]


LEAST_PANEL = 12.0  # mm: labels of an axis overlap on a lower or narrower panel


PANEL_HEIGHT = 34.0  # mm, the height of a panel that a legend below it leaves


def _give_panels_height(figure: Any, axes: Any) -> None:
    """Make a figure higher until each of its panels has a height in which it can be read, at most
    0.6 of its width."""
    panels = [ax for ax in np.ravel(axes) if ax.get_subplotspec() is not None]
    rows = max((ax.get_subplotspec().get_gridspec().nrows for ax in panels), default=1)
    engine = figure.get_layout_engine()
    if engine is None:
        return
    for _ in range(3):  # the layout divides what is added between the panels in its own way
        engine.execute(figure)
        size = 25.4 * figure.get_size_inches()
        places = [ax.get_position() for ax in panels]
        lacking = max(
            (min(PANEL_HEIGHT, 0.6 * at.width * size[0]) - at.height * size[1] for at in places),
            default=0.0,
        )
        if lacking <= 0.5:
            return
        figure.set_figheight((size[1] + rows * lacking) / 25.4)


def _notice_narrow_panels(figure: Any, size: tuple[float, float]) -> None:
    """Warn where a size leaves the panels no room, as legends and labels keep theirs."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)  # Matplotlib's, of what is said below
        figure.draw_without_rendering()
    bars = "<colorbar>"
    panels = [
        ax.get_position()
        for ax in figure.axes
        if ax.get_visible() and ax.axison and ax.get_label() != bars
    ]
    widths = [panel.width * size[0] for panel in panels]
    heights = [panel.height * size[1] for panel in panels]
    least = min(*widths, *heights, math.inf)
    if least < LEAST_PANEL:
        text = (
            f"size={size} leaves a panel {least:.0f} mm for its shorter side, so that labels"
            " overlap; give a larger size, or legend=False"
        )
        warnings.warn(text, UserWarning, stacklevel=4)


def _check_size(size: Any, dpi: Any, into_given: bool, has_width: bool) -> None:
    """Refuse a size or a density of a figure that is not new, or that no figure has."""
    for name, value in (("size", size), ("dpi", dpi)):
        if value is not None and into_given:
            raise ParameterError(
                f"{name} applies to a new figure; set it on the figure of your axes", name
            )
    if size is not None and has_width:
        raise ParameterError("size and width exclude each other; give one of them", "size")
    if isinstance(size, tuple) and len(size) == 2:
        for number in size:
            check_number("size", number, at_least=NARROWEST, at_most=WIDEST, unit="mm")
    elif size is not None and not (isinstance(size, str) and size in SIZES):
        raise ParameterError(
            f'size must be "column", "page" or (width, height) in mm, got {shown(size)}', "size"
        )
    if dpi is not None:
        check_number("dpi", dpi, at_least=10.0, at_most=2400.0)


def _checked_style(own: Any) -> Any:
    """A style that Matplotlib knows."""
    if own is None:
        return None
    try:
        with mpl.style.context(own):
            return own
    except Exception as error:
        raise ParameterError(
            f"style must be a style of Matplotlib, by name, file or dictionary, got {shown(own)}",
            "style",
        ) from error


# the arguments of `plot` for all results
COMMON = ("legend", "title", "size", "dpi", "style", "degrees")


def _draw(result: Any, options: dict[str, Any], size: Any) -> Any:
    """Draw a result, or several into the same axes, in a new figure of this size."""
    width = SIZES[size] if isinstance(size, str) else size[0] if size else None
    if isinstance(result, (tuple, list)) and result:
        given = options.pop("ax", None)
        place = asked_legend() or ("below" if given is None else None)
        kinds = [
            str(getattr(part, "attrs", {}).get("kind", type(part).__name__)) for part in result
        ]
        over_time = ["motion" in kind.lower() for kind in kinds]
        if any(over_time) and not all(over_time):
            raise ParameterError(
                "a motion has a picture over time, and others none: draw them apart", "result"
            )
        with look() if given is None else nullcontext(), legend_at(place):
            wide = options.pop("width", width or LOOK.single_column)
            ax = axes_or_new(given, wide, 0.85 * LOOK.single_column)
            for part in result:
                _draw(part, {**options, "ax": ax}, None)
        return ax
    data = _dataset_of(result, options)
    if not hasattr(data, "attrs") or not hasattr(data, "data_vars"):
        raise ParameterError(
            f"result must be a Dataset, a DataTree or an object with to_xarray, got "
            f"{shown(result)}",
            "result",
        )
    draw = DRAWINGS.get(str(data.attrs.get("kind", ""))) or _by_content(data)
    if draw is None:
        raise ParameterError(
            f"nothing draws a result of the kind {shown(data.attrs.get('kind', ''))}", "result"
        )
    taken = signature(draw).parameters
    unknown = [name for name in options if name not in taken]
    if unknown and not any(one.kind is one.VAR_KEYWORD for one in taken.values()):
        own = [name for name in taken if name not in ("dataset", "data", "tree")]
        raise ParameterError(
            f"a picture of this result, of kind {shown(data.attrs.get('kind', ''))}, takes no "
            f"{unknown[0]!r:.40}; {near(unknown[0], [*own, *COMMON])}",
            unknown[0],
        )
    if width is None:
        return draw(data, **options)
    if "width" in signature(draw).parameters:
        return draw(data, width=width, **options)
    height = max(0.75 * LOOK.single_column, 0.63 * width)
    with look():
        figure = new_figure(width, height)
        axes = draw(data, figure=figure, **options)
        if isinstance(size, str):  # which is a width: the height is what its panels need
            _give_panels_height(figure, axes)
        return axes


def _dataset_of(result: Any, options: dict[str, Any]) -> Any:
    """The dataset of a result, with a quantity that is given as a function of a motion; the option
    then names it."""
    which = options.get("quantity")
    if which is not None and not isinstance(which, str) and not callable(which):
        raise ParameterError(
            f"quantity must be a name, or a function of a motion, got {shown(which)}", "quantity"
        )
    make = getattr(result, "to_xarray", None)
    takes_functions = make is not None and "functions" in signature(make).parameters
    if not callable(which):
        data = result if make is None else make()
        known = {which, f"amplitude_{which}", f"largest_{which}"}
        if make is None or not takes_functions or which is None or known & {*with_amplitudes(data)}:
            return data
        with suppress(ParameterError):  # it is refused with those that there are
            return make(functions={which: which})
        return data
    if make is None or not takes_functions:
        raise ParameterError(
            "quantity is a function, which has no motions here: give the study that makes this "
            'result functions={"name": function}, and quantity="name" here',
            "quantity",
        )
    name = getattr(which, "__name__", "")
    options["quantity"] = name if name.isidentifier() else "function"
    return make(functions={options["quantity"]: which})


def _by_content(data: Any) -> Callable[..., Any] | None:
    """The function that draws a dataset without a `kind`, or with one of another meaning, such as a
    curve of special points.
    """
    if "chart" in getattr(data, "children", ()):
        return draw_stability_chart
    if "branches" in getattr(data, "children", ()):
        return draw_diagram
    if "unknowns" in data and "path" in data.coords:
        return draw_special_curve
    if {"amplitude", "outcome", "horizontal", "vertical"} <= set(data.variables):
        return draw_stability_chart
    return None
