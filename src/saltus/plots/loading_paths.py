"""Loading paths in the plane of horizontal and vertical load, over the monostable domain of the undeformed state."""

from __future__ import annotations

from typing import Any

import numpy as np

from saltus.plots.conventions import INK, STABLE_LINE, UNSTABLE_LINE
from saltus.plots.marks import arrow_along

TINT = "#dfeaf4"


def draw_domain(ax: Any, borders: Any, label: bool = True) -> None:
    """The true domain shaded, the part that belongs to it by the printed border only hatched, and both borders."""
    vertical, critical = borders["vertical"].values, borders["critical"].values
    folded, fold = borders["folded"].values, borders["fold"].values
    start = float(borders.attrs["subcritical_below"])
    upper = vertical >= start
    edge_v = np.concatenate([folded[::-1], vertical[upper]])
    edge_h = np.concatenate([fold[::-1], critical[upper]])
    ax.fill_betweenx(edge_v, -edge_h, edge_h, color=TINT, lw=0, zorder=0)
    for sign in (-1, 1):
        below = vertical <= start
        inner = np.interp(vertical[below], folded[::-1], fold[::-1], left=0.0)
        ax.fill_betweenx(
            vertical[below],
            sign * inner,
            sign * critical[below],
            facecolor="none",
            edgecolor="#b0b0b0",
            hatch="////",
            lw=0,
            zorder=0,
        )
        ax.plot(sign * critical, vertical, color=INK, lw=0.8, zorder=2)
        ax.plot(sign * fold, folded, color=INK, lw=1.6, ls=(0, (1, 1)), zorder=2)
    ax.axhline(0.0, color=INK, lw=0.4, zorder=1)
    ax.axvline(0.0, color=INK, lw=0.4, zorder=1)
    if label:
        _labels(ax, float(np.interp(-1.5, vertical, critical)))


def draw_path(ax: Any, paths: Any) -> None:
    """Each path with arrows of its direction: blue solid if within the domain, red dashed if it leaves it."""
    for i in range(paths.sizes["path"]):
        h, v = paths["horizontal"][i].values, paths["vertical"][i].values
        inside = bool(paths["within"][i])
        style = STABLE_LINE if inside else UNSTABLE_LINE
        if np.ptp(v) == 0:  # there and back on one segment: drawn once, with an arrow at each end
            h, v = np.linspace(h.min(), h.max(), 50), np.full(50, v[0])
            arrow_along(ax, h[::-1], v, 48, style["color"])
            arrows = [48]
        else:
            arrows = [30, 90, 150, 210]
        ax.plot(h, v, **{**style, "linewidth": 1.4}, zorder=4)
        for at in arrows:
            arrow_along(ax, h, v, at, style["color"], size=8)


def _labels(ax: Any, reach: float) -> None:
    leader = {"arrowstyle": "-", "color": INK, "lw": 0.5, "shrinkA": 1, "shrinkB": 1}
    text: dict[str, Any] = {"fontsize": 8, "ha": "left", "va": "center", "arrowprops": leader}
    ax.text(0.0, -0.9, "monostable", ha="center", va="center", fontsize=8)
    ax.annotate(r"$\mathcal{V}\cos\beta_0=-|\mathcal{H}|\sin\beta_0$", xy=(-0.0441, -0.25), xytext=(-0.31, -0.06), **text)
    ax.annotate("fold of\ndeformed\nequilibria", xy=(0.1725, -1.03), xytext=(0.225, -0.9), **text)
    ax.text(0.0, -1.5, "more equilibria", ha="center", va="center", fontsize=8, bbox={"facecolor": "white", "lw": 0, "pad": 1})
