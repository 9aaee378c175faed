"""Lines of a phase plane: where motions are cut so that their lines stay apart, and where arrows are drawn along them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from saltus.plots.conventions import STABLE
from saltus.plots.marks import arrow_along


@dataclass(frozen=True, slots=True, kw_only=True)
class LineSpacing:
    """How near lines and arrows of a phase plane may come to one another; lengths are in widths of the window."""

    cells: int = 48  # cells along each side of the window: a motion is cut where it enters a cell with the line of another one
    lap_cells: int = 160  # the cells for a motion and its own earlier laps
    apart: float = 8 / 160  # least length between two laps: a motion that returns to a cell sooner has not left it
    closing: float = 2 / 160  # length drawn beyond the first lap, so that the line of a periodic motion is closed
    least: float = 0.08  # a motion is not drawn if less than this length is left of it
    first_arrow: float = 0.12  # length from the start of a motion to its first arrow


SPACING = LineSpacing()


def travelled(points: np.ndarray) -> np.ndarray:
    """The length of a line (n, 2) up to each of its points; jumps do not count."""
    steps = np.hypot(*np.diff(points, axis=0).T)
    return np.append(0.0, np.cumsum(np.nan_to_num(steps)))


def draw_arrows(ax: Any, x: np.ndarray, v: np.ndarray, spacing: float, last: int = -1) -> None:
    """Arrow heads about every `spacing` widths of the axes along a motion up to its sample `last`, none outside the axes."""
    (left, right), (low, high) = ax.get_xlim(), ax.get_ylim()
    way = travelled(np.stack([x / (right - left), v / (high - low)], axis=1))
    for at in sorted({int(np.searchsorted(way, place)) for place in np.arange(SPACING.first_arrow, way[last], spacing)}):
        if left < x[at] < right and low < v[at] < high:
            arrow_along(ax, x, v, at, STABLE)


def lines_apart(motions: list[tuple[np.ndarray, np.ndarray]], window: np.ndarray) -> list[tuple[np.ndarray, np.ndarray]]:
    """Motions (x, v), cut where they come near to an earlier one or to themselves, without those of which little is left."""
    taken = np.zeros((SPACING.cells, SPACING.cells), dtype=bool)
    lines = []
    for x, v in motions:
        scaled = (np.stack([x, v], axis=1) - window[:, 0]) / np.diff(window, axis=1)[:, 0]
        inside, way = ((scaled >= 0.0) & (scaled < 1.0)).all(axis=1), travelled(scaled)
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
    """The sample at which a motion has come so near to an earlier lap of its own that the lines would run together."""
    seen: dict[tuple[int, int], int] = {}
    for k in np.flatnonzero(inside):
        cell = (int(scaled[k, 0] * SPACING.lap_cells), int(scaled[k, 1] * SPACING.lap_cells))
        if way[k] - way[seen.setdefault(cell, int(k))] > SPACING.apart:
            return int(np.searchsorted(way, way[k] + SPACING.closing))
    return len(scaled)
