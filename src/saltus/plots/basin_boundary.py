"""Measures of the boundary of basins: the share of uncertain states, and the share that lies near all basins."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import FormatStrFormatter, LogLocator, MaxNLocator, NullFormatter

from saltus.plots.conventions import INK, LIMIT_LINE, SINGLE_COLUMN, STABLE, STABLE_LINE, axes_or_new
from saltus.plots.drawing import drawing


@drawing
def draw_uncertainty(dataset: Any, *, ax: Axes | None = None, width: float = SINGLE_COLUMN) -> Axes:
    """Draw the share of uncertain states over the distance, on logarithmic axes, with the power law that was fitted."""
    ax = axes_or_new(ax, width, 0.75 * width)
    distance, share = dataset["distance"].values, dataset["share"].values
    alpha, error = float(dataset.attrs["alpha"]), float(dataset.attrs["error"])
    known = share > 0.0
    ax.loglog(distance[known], share[known], ls="none", marker="o", ms=4.0, mfc="white", mec=INK, label="grid")
    if np.isfinite(alpha) and known.any():
        middle = np.exp(np.mean(np.log(share[known]) - alpha * np.log(distance[known])))
        label = rf"$\varepsilon^\alpha$, $\alpha={alpha:.3f}\pm{error:.3f}$"
        ax.loglog(distance, middle * distance**alpha, label=label, **STABLE_LINE)
    for axis in (ax.xaxis, ax.yaxis):
        axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
        axis.set_major_formatter(FormatStrFormatter("%g"))
        axis.set_minor_formatter(NullFormatter())
    ax.set_xlabel(r"distance $\varepsilon$ (cells)")
    ax.set_ylabel(r"share $f(\varepsilon)$ of uncertain states")
    ax.legend(loc="best")
    return ax


@drawing
def draw_wada(dataset: Any, *, ax: Axes | None = None, width: float = SINGLE_COLUMN) -> Axes:
    """Draw the share of the boundary cells that have all basins within a radius, and the shares from which a verdict follows."""
    ax = axes_or_new(ax, width, 0.75 * width)
    ax.plot(dataset["radius"].values, dataset["share"].values, color=STABLE, marker="o", ms=4.0, lw=0.9, label="boundary cells")
    for name, label in (("agrees", "agrees with Wada above"), ("fails", "does not below")):
        style = {**LIMIT_LINE, "linestyle": "-" if name == "agrees" else (0, (1, 1.2))}
        ax.axhline(float(dataset.attrs[name]), label=label, **style)
    ax.set_ylim(-0.03, 1.03)
    ax.set_xlabel("radius (cells)")
    ax.set_ylabel("share with all basins within the radius")
    ax.xaxis.set_major_locator(MaxNLocator(integer=True))
    ax.set_title(f"{np.size(dataset.attrs['labels'])} basins, verdict: {dataset.attrs['verdict']}", loc="left", pad=4)
    ax.legend(loc="best")
    return ax
