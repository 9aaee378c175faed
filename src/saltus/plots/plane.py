"""State planes: motions, equilibria and separatrices, with lines that stay apart; manifolds of
saddle orbits.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from saltus.plots.conventions import (
    LOOK,
    axes_or_new,
    drawing,
    legend_of,
    plane_of,
    state_label,
    symbol,
    unit_in_brackets,
)


@drawing
def draw_plane(
    dataset: Any, *, ax: Axes | None = None, width: float = 1.5 * LOOK.single_column
) -> Axes:
    """Draw a dataset of `saltus.phase_portrait`; returns the axes.

    Stable equilibria are filled, unstable ones open. Motions from given starts are drawn to their
    ends; motions from starts that were spread over the window are cut where they come near to one
    that is drawn, so that lines stay apart.
    """
    name = dataset.attrs["coordinate"]
    window = np.asarray(dataset.attrs["window"], dtype=float).reshape(2, 2)
    own, ax = ax is None, axes_or_new(ax, width, 0.85 * width)
    ax.set_xlim(*window[0])
    ax.set_ylim(*window[1])
    ax.axhline(0.0, color=LOOK.faint, lw=0.4, zorder=0)
    if "contact" in dataset.attrs:
        ax.axvline(float(dataset.attrs["contact"]), color=LOOK.faint, lw=1.2, zorder=0)
    motions = list(zip(dataset[name].values, dataset["velocity"].values, strict=True))
    for x, v in (
        lines_apart(motions, window) if dataset.attrs.get("starts") == "spread" else motions
    ):
        ax.plot(x, v, color=LOOK.stable, lw=0.7, zorder=2)
        draw_arrows(ax, x, v, 0.6)  # window widths between arrows
    for x, v in zip(
        dataset[f"separatrix_{name}"].values, dataset["separatrix_velocity"].values, strict=True
    ):
        ax.plot(x, v, zorder=3, **LOOK.separatrix_line)
    stable = dataset["stable"].values.astype(bool)
    fixed_points(ax, dataset["equilibrium"].values, stable)
    for artist in (*ax.texts, *ax.lines):
        artist.set_in_layout(False)  # else parts outside the window would be given room beside it
    ax.set_xlabel(rf"${symbol(name)}${unit_in_brackets(dataset[name])}")
    ax.set_ylabel(rf"$\dot{{{symbol(name)}}}${unit_in_brackets(dataset[name])}")
    _legend(ax, own, stable, bool(dataset.sizes["separatrix"]))
    return ax


def _legend(ax: Axes, own: bool, stable: np.ndarray, separatrices: bool) -> None:
    """A legend of the stable and unstable equilibria and the separatrices, as far as there are
    any.
    """
    dot: dict[str, Any] = {"linestyle": "none", "marker": "o", "markersize": 4.5}
    handles = [Line2D([], [], color=LOOK.stable, lw=0.7, label="motion")]
    if stable.any():
        handles.append(Line2D([], [], color=LOOK.stable, label="stable equilibrium", **dot))
    if not stable.all():
        handles.append(
            Line2D([], [], mfc="white", mec=LOOK.unstable, label="unstable equilibrium", **dot)
        )
    if separatrices:
        handles.append(Line2D([], [], label="separatrix", **LOOK.separatrix_line))
    legend_of(ax, own, handles, ncols=len(handles), columnspacing=1.4, handletextpad=0.5)


@dataclass(frozen=True, slots=True, kw_only=True)
class LineSpacing:
    """How near lines and arrows of a phase plane may come to one another; lengths are in widths of
    the window.
    """

    # cells along each side of the window: a motion is cut where it enters a cell with the line of
    # another one
    cells: int = 48
    lap_cells: int = 160  # the cells for a motion and its own earlier laps
    # least length between two laps: a motion that returns to a cell sooner has not left it
    apart: float = 8 / 160
    # length drawn beyond the first lap, so that the line of a periodic motion is closed
    closing: float = 2 / 160
    least: float = 0.08  # a motion is not drawn if less than this length is left of it
    first_arrow: float = 0.12  # length from the start of a motion to its first arrow


SPACING = LineSpacing()


def travelled(points: np.ndarray) -> np.ndarray:
    """The length of a line (n, 2) up to each of its points; jumps do not count."""
    steps = np.hypot(*np.diff(points, axis=0).T)
    return np.append(0.0, np.cumsum(np.nan_to_num(steps)))


def draw_arrows(ax: Any, x: np.ndarray, v: np.ndarray, spacing: float, last: int = -1) -> None:
    """Arrow heads about every `spacing` widths of the axes along a motion up to its sample `last`,
    none outside the axes.
    """
    left, right = ax.get_xlim()
    low, high = ax.get_ylim()
    way = travelled(np.stack([x / (right - left), v / (high - low)], axis=1))
    for at in sorted(
        {
            int(np.searchsorted(way, place))
            for place in np.arange(SPACING.first_arrow, way[last], spacing)
        }
    ):
        if left < x[at] < right and low < v[at] < high:
            arrow_along(ax, x, v, at, LOOK.stable)


def lines_apart(
    motions: list[tuple[np.ndarray, np.ndarray]], window: np.ndarray
) -> list[tuple[np.ndarray, np.ndarray]]:
    """Motions (x, v), cut where they come near to an earlier one or to themselves, without those of
    which little is left.
    """
    taken = np.zeros((SPACING.cells, SPACING.cells), dtype=bool)
    lines = []
    for x, v in motions:
        scaled = (np.stack([x, v], axis=1) - window[:, 0]) / np.diff(window, axis=1)[:, 0]
        inside = ((scaled >= 0.0) & (scaled < 1.0)).all(axis=1)
        way = travelled(scaled)
        end = min(_first_near(scaled, inside, taken), _first_lap(scaled, inside, way))
        if end > 0 and way[end - 1] >= SPACING.least:
            here = (scaled[:end][inside[:end]] * SPACING.cells).astype(int)
            taken[here[:, 0], here[:, 1]] = True
            lines.append((x[:end], v[:end]))
    return lines


def _first_near(scaled: np.ndarray, inside: np.ndarray, taken: np.ndarray) -> int:
    """The sample at which a motion enters a cell in which another one is drawn."""
    cells = np.where(inside[:, None], scaled * SPACING.cells, 0.0).astype(int)
    near = np.flatnonzero(taken[cells[:, 0], cells[:, 1]] & inside)
    return int(near[0]) if near.size else len(scaled)


def _first_lap(scaled: np.ndarray, inside: np.ndarray, way: np.ndarray) -> int:
    """The sample at which a motion has come so near to an earlier lap of its own that the lines
    would run together.
    """
    seen: dict[tuple[int, int], int] = {}
    for k in np.flatnonzero(inside):
        cell = (int(scaled[k, 0] * SPACING.lap_cells), int(scaled[k, 1] * SPACING.lap_cells))
        if way[k] - way[seen.setdefault(cell, int(k))] > SPACING.apart:
            return int(np.searchsorted(way, way[k] + SPACING.closing))
    return len(scaled)


SADDLE: dict[str, Any] = {
    "linestyle": "none",
    "marker": "o",
    "markersize": 4.5,
    "markerfacecolor": "white",
    "zorder": 5,
}


@drawing
def draw_manifold(
    dataset: Any, *, ax: Axes | None = None, width: float = LOOK.single_column
) -> Axes:
    """Draw the manifold of a saddle orbit at phase 0 of the load, the stable one solid, the
    unstable one dashed; returns `ax`.
    """
    own = ax is None
    ax = axes_or_new(ax, width, 0.85 * width)
    plane = plane_of(dataset)
    stable = bool(dataset.attrs["stable"])
    line, label = (
        (LOOK.stable_line, "stable manifold")
        if stable
        else (LOOK.unstable_line, "unstable manifold")
    )
    ax.plot(*(dataset[name].values for name in plane), label=label, **{**line, "linewidth": 0.8})
    ax.plot(
        *(dataset[f"orbit_{name}"].values for name in plane),
        markeredgecolor=LOOK.ink,
        label="saddle orbit",
        **SADDLE,
    )
    ax.set_xlabel(state_label(dataset, plane[0], plane, " at phase 0"))
    ax.set_ylabel(state_label(dataset, plane[1], plane, " at phase 0"))
    legend_of(ax, own)
    return ax


@drawing
def draw_separatrix(
    dataset: Any, *, ax: Axes | None = None, width: float = LOOK.single_column
) -> Axes:
    """Draw a separatrix in the phase plane and its saddle, an open mark; returns `ax`."""
    own = ax is None
    ax = axes_or_new(ax, width, 0.85 * width)
    plane = plane_of(dataset)
    ax.plot(*(dataset[name].values for name in plane), label="separatrix", **LOOK.separatrix_line)
    ax.plot(
        float(dataset.attrs["saddle"]), 0.0, markeredgecolor=LOOK.unstable, label="saddle", **SADDLE
    )
    ax.set_xlabel(state_label(dataset, plane[0], plane))
    ax.set_ylabel(state_label(dataset, plane[1], plane))
    legend_of(ax, own)
    return ax


def fixed_points(ax: Any, theta: np.ndarray, stable: np.ndarray, size: float = 4.5) -> None:
    """Equilibria on the axis theta' = 0: filled blue where stable, open red where unstable."""
    theta, stable = np.asarray(theta), np.asarray(stable, dtype=bool)
    common: dict[str, Any] = {
        "linestyle": "none",
        "marker": "o",
        "markersize": size,
        "zorder": 6,
        "clip_on": False,
    }
    ax.plot(
        theta[stable],
        0 * theta[stable],
        markerfacecolor=LOOK.stable,
        markeredgecolor=LOOK.stable,
        **common,
    )
    ax.plot(
        theta[~stable],
        0 * theta[~stable],
        markerfacecolor="white",
        markeredgecolor=LOOK.unstable,
        markeredgewidth=1.0,
        **common,
    )


def arrow_along(
    ax: Any, x: np.ndarray, y: np.ndarray, at: int, color: str, size: float = 7.0
) -> None:
    """An arrow head on the curve (x, y) at its sample `at`, pointing along it."""
    after = min(at + 1, len(x) - 1)
    before = after - 1
    if not np.isfinite([x[before], x[after], y[before], y[after]]).all():
        return
    ax.annotate(
        "",
        xy=(x[after], y[after]),
        xytext=(x[before], y[before]),
        arrowprops={
            "arrowstyle": "-|>,head_width=0.24,head_length=0.48",
            "color": color,
            "lw": 0,
            "mutation_scale": size,
        },
        zorder=5,
        annotation_clip=True,
    )
