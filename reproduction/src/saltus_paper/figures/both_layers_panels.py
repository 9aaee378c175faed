"""The figure that compares the reduced model with both layers: spectra, a diagram, fates of
attractors, where it is exact.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from saltus.plots import LOOK, new_figure, panel_label, styled
from saltus_paper.figures.harmonic_loads import AMPLITUDE, FREQUENCY

# grey and dark red
REDUCED = "0.65"
FULL = "#b2182b"
# of the fates, in their order
COLOURS = ("#1b7837", "#7fbf7b", "#d9f0d3", "#c2a5cf", "#762a83", "#fdb863", "#4d4d4d")
MEANINGS = (
    "exact",
    "within 1 %",
    "within 10 %",
    "farther away",
    "does not settle",
    "falls to rest",
    "ends (limit or hinge)",
)


@styled
def draw(data: Any) -> Any:
    """(a, b) Fig.

    9, (c) Fig. 11, (d) fates in every variant, (e) where the reduced model is exact, (f) Fig. 14 at
    Omega = 1.
    """
    figure = new_figure(LOOK.double_column, 215.0)
    axes = figure.subplots(3, 2).ravel()
    reference = _reference(data["fig09"])
    for ax, amplitude in zip(axes[:2], (0.2, 1.0), strict=True):
        _points(ax, data["fig09"], AMPLITUDE, amplitude, FREQUENCY, reference)
        ax.set_title(rf"Fig. 9, $\widehat{{\mathcal{{H}}}}={amplitude:g}$", pad=4)
        ax.set_xlabel(r"frequency $\Omega$")
    _points(axes[2], data["fig11"], FREQUENCY, 1.0, AMPLITUDE, reference)
    axes[2].set_title(r"Fig. 11, $\Omega=1$", pad=4)
    axes[2].set_xlabel(r"load amplitude $\widehat{\mathcal{H}}$")
    axes[0].legend(loc="upper right", fontsize=6, frameon=False)
    _bars(axes[3], data["fig09"])
    _plane(axes[4], data["map"], (FREQUENCY, AMPLITUDE), 0)
    axes[4].set_xlabel(r"frequency $\Omega$")
    axes[4].set_ylabel(r"load amplitude $\widehat{\mathcal{H}}$")
    axes[4].set_title("exact, $m=0$ and the paper's crossing", pad=4)
    _plane(axes[5], data["fig14"], (AMPLITUDE, "load.vertical"), 1)
    axes[5].set_xlabel(r"load amplitude $\widehat{\mathcal{H}}$")
    axes[5].set_ylabel(r"vertical load $\overline{\mathcal{V}}$")
    axes[5].set_title(r"Fig. 14, $\Omega=1$, $m=0.001$, $e=g=0$", pad=4)
    for ax, name in zip(axes, "abcdef", strict=True):
        panel_label(ax, name)
    _legend(figure)
    return figure


def _reference(group: Any) -> int:
    """The variant that is shown: m = 0.001, e = g = 0."""
    chosen = (
        (group["mass_ratio"].values == 0.001)
        & (group["e"].values == 0.0)
        & (group["transfer"].values == 0.0)
    )
    return int(np.flatnonzero(chosen)[0])


def _points(ax: Any, group: Any, fixed: str, value: float, along: str, variant: int) -> None:
    """The largest opening of the lower layer over a parameter: the reduced attractors, and the full
    motions from their states.
    """
    here = np.isclose(group[fixed].values, value)
    x = group[along].values[here]
    full = group["full"].values[variant][here]
    ax.plot(
        x,
        group["reduced"].values[here],
        "o",
        ms=3.2,
        mfc="none",
        mec=REDUCED,
        mew=0.7,
        label="reduced model",
    )
    ax.plot(x, full, ".", ms=2.6, color=FULL, label="both layers")
    lost = ~np.isfinite(full)
    ax.plot(
        x[lost],
        group["reduced"].values[here][lost],
        "x",
        ms=3.0,
        mew=0.6,
        color="k",
        label="no periodic motion left",
    )
    ax.set_ylabel(r"$\max_\tau\theta_1$ (rad)")
    ax.set_ylim(0.0, None)


def _bars(ax: Any, group: Any) -> None:
    """The shares of the fates, a bar for each variant."""
    counts = np.stack([(group["fate"].values == i).mean(axis=1) for i in range(len(COLOURS))])
    left = np.zeros(counts.shape[1])
    places = np.arange(counts.shape[1])[::-1]
    for share, colour in zip(counts, COLOURS, strict=True):
        ax.barh(places, share, left=left, color=colour, height=0.8)
        left += share
    columns = zip(
        group["mass_ratio"].values, group["e"].values, group["transfer"].values, strict=True
    )
    ax.set_yticks(places, [f"{m:g}, {e:g}, {g:g}" for m, e, g in columns])
    ax.tick_params(axis="y", labelsize=6)
    ax.set_ylabel("mass $m$, restitution $e$, transfer $g$", fontsize=7)
    ax.set_xlim(0.0, 1.0)
    ax.set_xlabel("share of the reduced attractors, Fig. 9")


def _plane(ax: Any, group: Any, paths: tuple[str, str], variant: int) -> None:
    """The worst fate of the reduced attractors of each cell of a plane; white where there are none
    beside rest.
    """
    from matplotlib.colors import BoundaryNorm, ListedColormap

    x, y = (np.unique(group[path].values) for path in paths)
    cells = np.full((y.size, x.size), np.nan)
    columns, rows = (
        np.searchsorted(axis, group[path].values) for axis, path in zip((x, y), paths, strict=True)
    )
    np.fmax.at(cells, (rows, columns), group["fate"].values[variant].astype(float))
    norm = BoundaryNorm(np.arange(-0.5, len(COLOURS)), len(COLOURS))
    ax.pcolormesh(
        x, y, cells, cmap=ListedColormap(COLOURS), norm=norm, shading="nearest", rasterized=True
    )


def _legend(figure: Any) -> None:
    from matplotlib.patches import Patch

    handles = [
        Patch(facecolor=colour, label=meaning)
        for colour, meaning in zip(COLOURS, MEANINGS, strict=True)
    ]
    figure.legend(handles=handles, loc="outside lower center", ncols=4, fontsize=7, frameon=False)
