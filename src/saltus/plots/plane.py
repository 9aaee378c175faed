"""The phase plane of a study: its motions, equilibria and separatrices."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from saltus.plots.conventions import FAINT, SEPARATRIX_LINE, SINGLE_COLUMN, STABLE, UNSTABLE, new_figure, styled
from saltus.plots.diagram import axis_name
from saltus.plots.marks import arrow_along, fixed_points

CELLS = 48  # along each side of the window: motions that were spread end where they come so near to one that is drawn
LAPS = 160  # the same for a motion and its own earlier laps
LEAST = 0.08  # window widths: what is left of a motion is not drawn if it is shorter
ARROWS = 0.6  # window widths between arrows along a motion


@styled
def draw_plane(dataset: Any, width: float = 1.5 * SINGLE_COLUMN) -> Figure:
    """A Figure from a dataset of `saltus.studies.portrait`.

    Stable equilibria are filled, unstable ones open. Motions from given starts are drawn whole; those that were spread over the
    window end where they come near to one that is drawn, so that lines stay apart.
    """
    name = dataset.attrs["coordinate"]
    window = np.asarray(dataset.attrs["window"], dtype=float).reshape(2, 2)
    symbol, unit = axis_name(name)
    figure = new_figure(width, 0.85 * width)
    ax = figure.subplots()
    ax.set_xlim(*window[0])
    ax.set_ylim(*window[1])
    ax.axhline(0.0, color=FAINT, lw=0.4, zorder=0)
    if "contact" in dataset.attrs:
        ax.axvline(float(dataset.attrs["contact"]), color=FAINT, lw=1.2, zorder=0)
    for x, v in _lines(dataset[name].values, dataset["velocity"].values, window, dataset.attrs.get("starts") == "spread"):
        ax.plot(x, v, color=STABLE, lw=0.7, zorder=2)
        _arrows(ax, x, v, window)
    for x, v in zip(dataset[f"separatrix_{name}"].values, dataset["separatrix_velocity"].values, strict=True):
        ax.plot(x, v, zorder=3, **SEPARATRIX_LINE)
    stable = dataset["stable"].values.astype(bool)
    fixed_points(ax, dataset["equilibrium"].values, stable)
    for artist in (*ax.texts, *ax.lines):
        artist.set_in_layout(False)  # what is outside the window would take room beside it
    ax.set_xlabel(rf"${symbol}${unit}")
    ax.set_ylabel(rf"$\dot{{{symbol}}}$")
    _legend(figure, stable, bool(dataset.sizes["separatrix"]))
    return figure


def _lines(places: np.ndarray, velocities: np.ndarray, window: np.ndarray, apart: bool) -> list[tuple[np.ndarray, np.ndarray]]:
    """The motions as they are drawn."""
    taken = np.zeros((CELLS, CELLS), dtype=bool)
    lines = []
    for x, v in zip(places, velocities, strict=True):
        end = len(x)
        if apart:
            scaled = (np.stack([x, v], axis=1) - window[:, 0]) / np.diff(window, axis=1)[:, 0]
            inside = ((scaled >= 0.0) & (scaled < 1.0)).all(axis=1)
            travelled = _travelled(scaled)
            end = min(_first_near(scaled, inside, taken), _own_lap(scaled, inside, travelled))
            if end == 0 or travelled[end - 1] < LEAST:
                continue
            here = (scaled[:end][inside[:end]] * CELLS).astype(int)
            taken[here[:, 0], here[:, 1]] = True
        lines.append((x[:end], v[:end]))
    return lines


def _travelled(points: np.ndarray) -> np.ndarray:
    """The length of the way (n, 2) to each of its points; jumps have none."""
    steps = np.hypot(*np.diff(points, axis=0).T)
    return np.append(0.0, np.cumsum(np.nan_to_num(steps)))


def _first_near(scaled: np.ndarray, inside: np.ndarray, taken: np.ndarray) -> int:
    """The sample at which a motion comes to where another one is drawn."""
    cells = np.where(inside[:, None], scaled * CELLS, 0.0).astype(int)
    near = np.flatnonzero(taken[cells[:, 0], cells[:, 1]] & inside)
    return int(near[0]) if near.size else len(scaled)


def _own_lap(scaled: np.ndarray, inside: np.ndarray, travelled: np.ndarray) -> int:
    """The sample at which a motion has come so near to an earlier lap of its own that the lines would run together.

    It goes on from there for a little, so that a motion that repeats itself is drawn closed.
    """
    seen: dict[tuple[int, int], int] = {}
    for k in np.flatnonzero(inside):
        cell = (int(scaled[k, 0] * LAPS), int(scaled[k, 1] * LAPS))
        if travelled[k] - travelled[seen.setdefault(cell, int(k))] > 8.0 / LAPS:
            return int(np.searchsorted(travelled, travelled[k] + 2.0 / LAPS))
    return len(scaled)


def _arrows(ax: Any, x: np.ndarray, v: np.ndarray, window: np.ndarray) -> None:
    """Arrow heads along a motion, the first soon after its start, none outside the window."""
    travelled = _travelled(np.stack([x, v], axis=1) / np.diff(window, axis=1)[:, 0])
    for place in np.arange(0.12, travelled[-1], ARROWS):
        k = int(np.searchsorted(travelled, place))
        if window[0, 0] < x[k] < window[0, 1] and window[1, 0] < v[k] < window[1, 1]:
            arrow_along(ax, x, v, k, STABLE)


def _legend(figure: Figure, stable: np.ndarray, parted: bool) -> None:
    """What is there of stable and unstable equilibria and separatrices."""
    dot: dict[str, Any] = {"linestyle": "none", "marker": "o", "markersize": 4.5}
    handles = [Line2D([], [], color=STABLE, lw=0.7, label="motion")]
    if stable.any():
        handles.append(Line2D([], [], color=STABLE, label="stable equilibrium", **dot))
    if not stable.all():
        handles.append(Line2D([], [], mfc="white", mec=UNSTABLE, label="unstable equilibrium", **dot))
    if parted:
        handles.append(Line2D([], [], label="separatrix", **SEPARATRIX_LINE))
    figure.legend(handles=handles, loc="outside lower center", ncols=len(handles), columnspacing=1.4, handletextpad=0.5)
