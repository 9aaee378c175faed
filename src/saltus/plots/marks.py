"""Marks shared by the pictures: fixed points, arrows of direction, limit lines, dimensions, the edges of cells."""

from __future__ import annotations

from typing import Any

import numpy as np

from saltus.plots.conventions import INK, LIMIT, LIMIT_LINE, STABLE, UNSTABLE


def fixed_points(ax: Any, theta: np.ndarray, stable: np.ndarray, size: float = 4.5) -> None:
    """Equilibria on the axis theta' = 0: filled blue where stable, open red where unstable."""
    theta, stable = np.asarray(theta), np.asarray(stable, dtype=bool)
    common: dict[str, Any] = {"linestyle": "none", "marker": "o", "markersize": size, "zorder": 6, "clip_on": False}
    ax.plot(theta[stable], 0 * theta[stable], markerfacecolor=STABLE, markeredgecolor=STABLE, **common)
    ax.plot(theta[~stable], 0 * theta[~stable], markerfacecolor="white", markeredgecolor=UNSTABLE, markeredgewidth=1.0, **common)


def arrow_along(ax: Any, x: np.ndarray, y: np.ndarray, at: int, color: str, size: float = 7.0) -> None:
    """An arrow head on the curve (x, y) at its sample `at`, pointing along it."""
    after = min(at + 1, len(x) - 1)
    before = after - 1
    if not np.isfinite([x[before], x[after], y[before], y[after]]).all():
        return
    ax.annotate(
        "",
        xy=(x[after], y[after]),
        xytext=(x[before], y[before]),
        arrowprops={"arrowstyle": "-|>,head_width=0.24,head_length=0.48", "color": color, "lw": 0, "mutation_scale": size},
        zorder=5,
        annotation_clip=True,
    )


def limit_lines(ax: Any, angle: float, label: str | None = None, axis: str = "x") -> None:
    """Green lines at both signs of a limit angle, those that fall inside the axes."""
    low, high = ax.get_xlim() if axis == "x" else ax.get_ylim()
    for value in (-angle, angle):
        if low < value < high:
            (ax.axvline if axis == "x" else ax.axhline)(value, zorder=1, **LIMIT_LINE)
            if label and axis == "x":
                ax.annotate(
                    label,
                    xy=(value, 1.0),
                    xycoords=("data", "axes fraction"),
                    xytext=(0, 2),
                    textcoords="offset points",
                    ha="center",
                    va="bottom",
                    color=LIMIT,
                    fontsize=7,
                )


def dimension(ax: Any, start: np.ndarray, end: np.ndarray, label: str, offset: float = 0.0, shift: float = 0.05) -> None:
    """A dimension line from `start` to `end`, moved sideways by `offset`, with its label beside the middle."""
    start, end = np.asarray(start, float), np.asarray(end, float)
    along = (end - start) / np.linalg.norm(end - start)
    side = np.array([-along[1], along[0]])
    a, b = start + offset * side, end + offset * side
    for foot, tip in ((start, a), (end, b)):
        if offset:
            ax.plot(*zip(foot, tip + 0.3 * shift * np.sign(offset) * side, strict=True), color=INK, lw=0.4)
    style = {"arrowstyle": "<|-|>,head_width=0.12,head_length=0.3", "color": INK, "lw": 0.5, "shrinkA": 0, "shrinkB": 0}
    ax.annotate("", xy=b, xytext=a, arrowprops=style)
    ax.text(*((a + b) / 2 + np.sign(offset or 1) * shift * side), label, ha="center", va="center")


def arc(
    ax: Any, centre: np.ndarray, radius: float, first: float, last: float, label: str, reach: float = 1.35, at: float = 0.5
) -> None:
    """An arc of an angle from direction `first` to `last` (rad), its label at `reach` radii and the share `at` of the angle."""
    angles = np.linspace(first, last, 60)
    ax.plot(centre[0] + radius * np.cos(angles), centre[1] + radius * np.sin(angles), color=INK, lw=0.6)
    middle = first + at * (last - first)
    ax.text(
        centre[0] + reach * radius * np.cos(middle), centre[1] + reach * radius * np.sin(middle), label, ha="center", va="center"
    )


def cell_edges(middles: np.ndarray) -> np.ndarray:
    """The edges of cells about their middles, (n + 1,), halfway between them."""
    if len(middles) == 1:
        return np.asarray(middles[0] + np.array([-0.5, 0.5]))
    inner = (middles[1:] + middles[:-1]) / 2
    return np.concatenate([[2 * middles[0] - inner[0]], inner, [2 * middles[-1] - inner[-1]]])
