"""One motion: its time history, its phase portrait, and the derivatives of its end by its start and
by parameters.

An ensemble of motions, and a parameter swept up and down, are drawn here too.
"""

from __future__ import annotations

import json
import math
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap, PowerNorm
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from saltus.errors import ParameterError, shown
from saltus.plots.conventions import (
    LOOK,
    asked_legend,
    axes_or_new,
    cell_edges,
    chosen_quantity,
    drawing,
    is_flat,
    legend_of,
    new_figure,
    parameter_name,
    parameter_symbol,
    quantity_name,
    shown_quantity,
    state_symbol,
    symbol,
    unit_in_brackets,
    varied,
    with_amplitudes,
)
from saltus.result import MAPPED

if TYPE_CHECKING:
    import xarray

DASHED = (0, (4, 1.5))
LINES: tuple[dict[str, Any], ...] = (
    {"color": LOOK.stable, "ls": "-"},
    {"color": LOOK.unstable, "ls": DASHED},
)
PAIRS = (
    LOOK.stable,
    LOOK.unstable,
    LOOK.limit,
    "#E69F00",
    LOOK.ink,
    LOOK.separatrix,
)  # of more than two coordinates, two of each colour


@drawing
def draw_motion(
    dataset: xarray.Dataset, *, ax: Axes | None = None, figure: Figure | None = None
) -> Any:
    """The coordinates over time, and velocities over coordinates, of a motion as `Motion.to_xarray`
    gives it; returns both axes.

    The phase portrait shows all of the motion in grey and its last forcing period on top; without a
    forcing period, all of it. An open circle marks the start, a full one the end. Green lines mark
    the limits of the mechanism that are reached. Into given axes only the coordinates over time are
    drawn.
    """
    if ax is None:
        figure = new_figure(LOOK.double_column, 68.0) if figure is None else figure
        history, portrait = figure.subplots(1, 2, width_ratios=(1.75, 1))
    else:
        history = ax
        portrait = None
    names = coordinates(dataset)
    period = _forcing_period(dataset)
    several = [
        {"color": PAIRS[i // 2 % len(PAIRS)], "ls": ("-", DASHED)[i % 2]} for i in range(len(names))
    ]
    for name, line in zip(
        names, LINES[: len(names)] if len(names) <= len(LINES) else several, strict=True
    ):
        time, position, velocity = arcs(dataset, name)
        label = f"${symbol(name)}$" if len(names) > 1 else None
        history.plot(time, position, lw=0.9, label=label, **line)
        if portrait is not None:
            _portrait(portrait, (time, position, velocity), period, line)
    _labels(history, portrait, dataset, names)
    limit = _limit_angle(dataset)
    if limit is not None:
        for panel, axis in ((history, "y"), (portrait, "x"))[: 1 if portrait is None else 2]:
            for angle in (limit, 2 * limit):
                limit_lines(panel, angle, axis=axis)
    return np.array([history, portrait]) if ax is None else ax


@drawing
def draw_proof(
    dataset: xarray.Dataset, *, ax: Axes | None = None, figure: Figure | None = None
) -> Any:
    """The motion of an orbit of which something is proved, with what it is as a title; returns both
    axes.
    """
    axes = draw_motion(dataset, ax=ax, figure=figure)
    kind = str(dataset.attrs.get("special_kind", "orbit"))
    told = {"true": "is proved", "false": "is refuted"}.get(dataset.attrs["proved"], "is undecided")
    np.ravel(axes)[0].set_title(f"This {kind} {told}")
    return axes


def coordinates(dataset: xarray.Dataset) -> list[str]:
    """The names of the coordinates in a motion's dataset; variables of whole numbers are sides and
    states of contacts.
    """
    names = [str(name) for name, values in dataset.data_vars.items() if values.dtype.kind == "f"]
    return [name for name in names if rate_of(dataset, name) in dataset]


def rate_of(dataset: xarray.Dataset, name: str) -> str:
    """The name of the velocity that belongs to a coordinate."""
    several = f"{name}_velocity"
    return (
        several
        if several in dataset or name == "velocity" or dataset[name].dims != ("time",)
        else "velocity"
    )


def arcs(dataset: xarray.Dataset, name: str) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Time, position and velocity with the impacts inserted between the samples, separated by NaN
    where the velocity jumps.
    """
    time, position, velocity = (dataset[n].values for n in ("time", name, rate_of(dataset, name)))
    rate = rate_of(dataset, name)
    if f"impact_{rate}_before" not in dataset:
        return time, position, velocity
    at = dataset["impact_time"].values
    before, after = (dataset[f"impact_{rate}_{when}"].values for when in ("before", "after"))
    # Samples at the very instant of an impact show the state after it, and so follow it.
    times = np.concatenate([at, at, at, time])
    order = np.argsort(times, kind="stable")
    if f"impact_{name}" in dataset:
        there = dataset[f"impact_{name}"].values
    else:
        there = np.full(at.size, _contact(at, before, (time, position, velocity)))
    positions = np.concatenate([there, there, there, position])
    velocities = np.concatenate([before, np.full(at.size, np.nan), after, velocity])
    return times[order], positions[order], velocities[order]


def _contact(
    at: np.ndarray, before: np.ndarray, samples: tuple[np.ndarray, np.ndarray, np.ndarray]
) -> float:
    """The coordinate of the contact, extrapolated from the last samples before the impacts and the
    velocities there.
    """
    time, position, velocity = samples
    last = np.clip(np.searchsorted(time, at, side="left") - 1, 0, None)
    guesses = position[last] + (velocity[last] + before) / 2 * (at - time[last])
    return float(np.median(guesses)) if at.size else 0.0  # some have further impacts in between


def _portrait(
    ax: Any,
    arc: tuple[np.ndarray, np.ndarray, np.ndarray],
    period: float | None,
    line: dict[str, Any],
) -> None:
    time, position, velocity = arc
    late = time >= time[-1] - period * (1 + 1e-9) if period else np.full(time.size, True)
    if not late.all():
        ax.plot(position, velocity, color=LOOK.faint, lw=0.6, zorder=1)
    ax.plot(position[late], velocity[late], lw=1.1, zorder=2, **line)
    known = np.flatnonzero(np.isfinite(velocity))
    for index, face in ((known[0], "white"), (known[-1], LOOK.ink)):
        ax.plot(
            position[index],
            velocity[index],
            marker="o",
            ms=4,
            mfc=face,
            mec=LOOK.ink,
            mew=0.8,
            ls="none",
            zorder=3,
        )


def _labels(history: Any, portrait: Any, dataset: xarray.Dataset, names: list[str]) -> None:
    unit = unit_in_brackets(dataset[names[0]])
    places = "coordinates"
    speeds = "velocities"
    if len(names) <= len(LINES):
        places = ", ".join(f"${symbol(name)}$" for name in names)
        speeds = ", ".join(rf"$\dot{{{symbol(name)}}}$" for name in names)
    history.set(
        xlabel=r"$\tau$", ylabel=f"{places}{unit}", xlim=(float(dataset.time[0]), _end(dataset))
    )
    history.axhline(0.0, color=LOOK.faint, lw=0.5, zorder=0)
    if portrait is None:
        if len(names) > 1:
            legend_of(history, False)
        return
    portrait.set(xlabel=f"{places}{unit}", ylabel=f"{speeds}{unit}")
    portrait.axhline(0.0, color=LOOK.faint, lw=0.5, zorder=0)
    portrait.axvline(0.0, color=LOOK.faint, lw=0.5, zorder=0)
    if len(names) > 1:
        if asked_legend() is None:
            above = (
                "outside upper center"
                if history.figure.get_layout_engine() is not None
                else "upper center"
            )
            history.figure.legend(
                *history.get_legend_handles_labels(), loc=above, ncols=min(len(names), 4)
            )
        else:
            legend_of(history, True)


def _end(dataset: xarray.Dataset) -> float:
    """The end of the time axis, which is never empty."""
    first = float(dataset.time[0])
    last = float(dataset.time[-1])
    return last if last > first else first + 1.0


def _system(dataset: xarray.Dataset) -> dict[str, Any]:
    system: dict[str, Any] = json.loads(dataset.attrs.get("system", "{}"))
    return system


def _forcing_period(dataset: xarray.Dataset) -> float | None:
    frequency = _system(dataset).get("load", {}).get("frequency")
    return 2 * math.pi / frequency if frequency else None


def _limit_angle(dataset: xarray.Dataset) -> float | None:
    """The straight line pi - beta0 of a metainterface, rad."""
    model = _system(dataset).get("model", {})
    return math.pi - model["beta0"] if model.get("type") in ("Metainterface", "TwoLayer") else None


@drawing
def draw_sensitivities(dataset: Any, *, ax: Axes | None = None, width: float | None = None) -> Axes:
    """Draw the derivatives as a table of numbers, a row for each state variable at the end, darker
    if larger; returns `ax`.
    """
    derivative = np.asarray(dataset["derivative"].values, dtype=float)
    names, to = ([str(name) for name in dataset[dim].values] for dim in ("state", "to"))
    size = (18.0 * len(to) + 34.0 if width is None else width, 12.0 * len(names) + 26.0)
    ax = axes_or_new(ax, *size)
    plane = names[0], names[len(names) // 2]
    largest = float(np.nanmax(np.abs(derivative), initial=0.0)) or 1.0
    # black would stand for six times the largest derivative, so that numbers on the shades can be
    # read
    ax.imshow(
        np.abs(derivative), cmap="Greys", norm=PowerNorm(0.5, 0.0, 6.0 * largest), aspect="auto"
    )
    for (row, column), value in np.ndenumerate(derivative):
        text = f"{value:.4g}".replace("-", "\u2212") if np.isfinite(value) else "undefined"
        ax.text(column, row, text, ha="center", va="center", color=LOOK.ink)
    starts = [name.removeprefix("start_") for name in to]
    symbols = [
        rf"${state_symbol(start, plane)}(\tau_0)$" if start != name else parameter_symbol(name)
        for start, name in zip(starts, to, strict=True)
    ]
    ax.set_xticks(range(len(to)), symbols)
    ax.set_yticks(range(len(names)), [rf"${state_symbol(name, plane)}(\tau)$" for name in names])
    ax.tick_params(length=0.0)
    ax.set_xlabel("with respect to")
    ax.set_ylabel("derivative of")
    ax.set_title(
        rf"derivatives at the end, $\tau={float(dataset.attrs['end_time']):.6g}$", loc="left"
    )
    return ax


OWN = ("period", "state", "column")  # dimensions within one motion, and not of the ensemble


@drawing
def draw_ensemble(
    dataset: Any,
    quantity: str | None = None,
    *,
    ax: Axes | None = None,
    width: float = LOOK.single_column,
) -> Axes:
    """Draw a variable of `simulate_many` or of `map_over` over one dimension or two; returns `ax`.

    By default that is why the motions ended, where not all ended in the same way, and else the
    first coordinate at the end; of `map_over` it is the first variable.

    Raises
    ------
    ParameterError
        A variable that is not there, or that has no dimensions or more than two.
    """
    mapped = dataset.attrs.get("kind") == MAPPED  # whose names are the user's own, of any meaning
    if quantity is None:
        several = (
            not mapped
            and "stop" in dataset
            and dataset["stop"].size > 0
            and np.ptp(dataset["stop"].values) > 0
        )
        quantity = "stop" if several else str(next(iter(dataset.data_vars)))
    if (
        quantity not in dataset
        or not 1 <= dataset[quantity].ndim <= 2
        or (set(dataset[quantity].dims) & set(OWN) and not mapped)
    ):
        part = (
            f"; draw a part, as isel({next(iter(dataset.sizes))}=0) gives one"
            if len(dataset.sizes) > 2
            else ""
        )
        raise ParameterError(
            f"the result has no {shown(quantity)} over one or two dimensions to draw{part}",
            "quantity",
        )
    values = dataset[quantity]
    axes = dict(varied(dataset, str(dim)) for dim in values.dims)
    ax = axes_or_new(ax, width, 0.75 * width)
    if quantity == "stop" and not mapped:
        return _draw_stops(ax, values, axes)
    label = (
        quantity.replace("_", " ") if mapped else f"{symbol_of(quantity)}{unit_in_brackets(values)}"
    )
    names = list(axes)
    ax.set_xlabel(names[0])
    if len(names) == 1:
        ax.plot(axes[names[0]], values.values, color=LOOK.stable, marker=".", ms=3.0, lw=0.6)
        ax.set_ylabel(label)
        return ax
    mesh = ax.pcolormesh(
        *(cell_edges(axis) for axis in axes.values()), values.values.T, rasterized=True
    )
    ax.set_ylabel(names[1])
    ax.figure.colorbar(mesh, ax=ax, label=label)
    return ax


STOP_FILLS = (
    "#bcd2ea",
    "#f3c98b",
    "#c9a0c9",
    "#a9d8b8",
    "#e9e1a0",
    "#d9d9d9",
    "#f2b5b0",
    "#9fc5c9",
)


def _draw_stops(ax: Axes, values: Any, axes: dict[str, np.ndarray]) -> Axes:
    """Why motions ended, as a colour for each word with a legend above."""
    words = values.attrs["flag_meanings"].split()
    numbers = np.unique(values.values)
    names = list(axes)
    place = np.searchsorted(numbers, values.values)
    fills = [STOP_FILLS[i % len(STOP_FILLS)] for i in range(len(numbers))]
    ax.set_xlabel(names[0])
    if len(names) == 1:
        for i, fill in enumerate(fills):
            own = place == i
            ax.plot(
                axes[names[0]][own],
                np.full(np.count_nonzero(own), i),
                "s",
                color=fill,
                mec="none",
                ms=4.0,
            )
        ax.set_yticks(range(len(numbers)), [words[number].replace("_", " ") for number in numbers])
        ax.set_ylim(-0.5, len(numbers) - 0.5)
        return ax
    edges = [cell_edges(axis) for axis in axes.values()]
    ax.pcolormesh(
        *edges,
        place.T,
        cmap=ListedColormap(fills),
        vmin=-0.5,
        vmax=len(fills) - 0.5,
        rasterized=True,
    )
    ax.set_ylabel(names[1])
    handles = [
        Patch(facecolor=fill, label=words[number].replace("_", " "))
        for fill, number in zip(fills, numbers, strict=True)
    ]
    if asked_legend() is None:
        ax.legend(
            handles=handles,
            loc="lower left",
            bbox_to_anchor=(0.0, 1.0),
            ncols=min(len(handles), 4),
            borderaxespad=0.2,
        )
    else:
        legend_of(ax, True, handles)
    return ax


def symbol_of(quantity: str) -> str:
    """A coordinate's symbol, or a variable's name in words."""
    if quantity.startswith("theta") or len(quantity) == 1:
        return f"${symbol(quantity)}$ at the end"
    return quantity.replace("_", " ")


WAYS: dict[str, dict[str, Any]] = {
    "up": {
        "color": LOOK.stable,
        "marker": "^",
        "markersize": 2.6,
        "linestyle": "-",
        "linewidth": 0.9,
        "markeredgewidth": 0.0,
    },
    "down": {
        "color": LOOK.unstable,
        "marker": "v",
        "markersize": 2.6,
        "linestyle": (0, (4, 2)),
        "linewidth": 0.9,
        "markeredgewidth": 0.0,
    },
}
BAND = "#ececec"  # where up and down differ


@drawing
def draw_sweep(
    dataset: Any,
    quantity: str | None = None,
    *,
    ax: Axes | None = None,
    width: float = 1.3 * LOOK.single_column,
) -> Axes:
    """Draw the dataset of `frequency_sweep`: amplitudes up and down, jumps as arrows, hysteresis in
    grey; returns the axes.

    An arrow goes from the last value before a jump to the first one after it. The grey band is
    where the amplitudes up and down differ by more than a hundredth of the largest one.

    The `quantity` is any of its numbers over both directions, such as "impact_count", "largest_x" or
    "x" (the amplitude) of a coordinate or a named point x, or one of its `functions`. By default it
    is the amplitude, as in `draw_branch`. Where most motions have the same one, as between two
    stops, it is the first of the functions.
    """
    dataset = with_amplitudes(dataset)
    known = [
        str(name)
        for name, part in dataset.items()
        if part.dims == ("direction", "value") and part.dtype.kind == "f"
    ]
    # as functions have
    functions = [name for name in known if dataset[name].attrs.get("long_name") == name]
    usual = shown_quantity(dataset)
    if functions and is_flat(dataset[usual].values.ravel()):
        usual = functions[0]
    quantity = chosen_quantity(quantity, known, usual)
    own = ax is None
    ax = axes_or_new(ax, width, 0.62 * width)
    values = dataset["value"].values
    edges = cell_edges(values)
    for number, i in enumerate(np.flatnonzero(dataset["hysteresis"].values)):
        label = None if number else "up and down differ"
        ax.axvspan(edges[i], edges[i + 1], color=BAND, linewidth=0.0, zorder=0, label=label)
    for way, line in WAYS.items():
        found = _jumps(dataset, way, quantity)
        middle = found[:, :2].mean(axis=1)
        # interrupted at a jump, as no motions lie in between
        x = np.concatenate([values, found[:, 0], middle, found[:, 1]])
        y = np.concatenate(
            [
                dataset[quantity].sel(direction=way).values,
                found[:, 2],
                np.full(len(found), np.nan),
                found[:, 3],
            ]
        )
        order = np.argsort(x, kind="stable")
        ax.plot(x[order], y[order], label=way, zorder=2, **line)
        for place, low, high in zip(middle, found[:, 2], found[:, 3], strict=True):
            arrow = {
                "arrowstyle": "-|>",
                "color": line["color"],
                "linewidth": 0.8,
                "shrinkA": 0.0,
                "shrinkB": 0.0,
                "mutation_scale": 7,
            }
            ax.annotate("", (place, high), (place, low), arrowprops=arrow, zorder=3)
    ax.set_xlim(values[0], values[-1])
    ax.set_ylim(bottom=0.0 if quantity.startswith("amplitude") else None)
    ax.set_xlabel(parameter_name(dataset.attrs["path"]))
    ax.set_ylabel(
        f"{quantity_name(dataset, quantity)}{unit_in_brackets(dataset[quantity])}"
        if quantity.partition("_")[0] in ("amplitude", "largest", "smallest")
        else dataset[quantity].attrs["long_name"]
    )
    legend_of(ax, own)
    return ax


def _jumps(dataset: Any, way: str, quantity: str) -> np.ndarray:
    """The values before and after each jump of one direction, and the quantity there, (n, 4): the
    sweep has the amplitudes; another quantity is read at the values of the sweep beside the jump.
    """
    chosen = dataset["jump_direction"].values == way
    places = [dataset[f"jump_{name}"].values[chosen] for name in ("before", "after")]
    if np.array_equal(dataset[quantity], dataset["amplitude"], equal_nan=True):
        sizes = [dataset[f"jump_amplitude_{name}"].values[chosen] for name in ("before", "after")]
        return np.stack([*places, *sizes], axis=1)
    values = dataset["value"].values
    right = np.searchsorted(values, (places[0] + places[1]) / 2.0)
    right = np.clip(right, 1, max(len(values) - 1, 1))
    beside = dataset[quantity].sel(direction=way).values
    sizes = [beside[right - 1], beside[right]]
    return np.stack([*places, *(sizes if way == "up" else sizes[::-1])], axis=1)


def limit_lines(ax: Any, angle: float, label: str | None = None, axis: str = "x") -> None:
    """Green lines at both signs of a limit angle, those that fall inside the axes."""
    low, high = ax.get_xlim() if axis == "x" else ax.get_ylim()
    for value in (-angle, angle):
        if low < value < high:
            (ax.axvline if axis == "x" else ax.axhline)(value, zorder=1, **LOOK.limit_line)
            if label and axis == "x":
                ax.annotate(
                    label,
                    xy=(value, 1.0),
                    xycoords=("data", "axes fraction"),
                    xytext=(0, 2),
                    textcoords="offset points",
                    ha="center",
                    va="bottom",
                    color=LOOK.limit,
                    fontsize=7,
                )
