"""The figure of the chain of cells: waves and where they grow, which cells move, states, and the
least loads.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from saltus.plots import LOOK, new_figure, panel_label, styled
from saltus_paper.figures.chain_waves import CELLS, CRITICAL, SETTINGS, kept_states, of_waves

LOAD = r"load amplitude $\widehat{\mathcal{H}}$"
COUPLING = r"coupling $\kappa$"


@styled
def draw(data: Any) -> Any:
    """(a) multipliers of waves, (b) which grows, (c) which cells move, (d) states, (e, f) waves,
    (g) least loads, (h) checks.
    """
    figure = new_figure(LOOK.double_column, 262.0)
    axes = figure.subplots(4, 2).ravel()
    _multipliers(axes[0], data["modes"])
    _growing(axes[1], data["modes"])
    _cells(axes[2], data["cells"])
    _states(axes[3], data["states"])
    for ax, wave in zip(axes[4:6], range(2), strict=True):
        _wave(ax, data["waves"].isel(coupling=wave))
    _least(axes[6], data["least"], data["modes"])
    _checks(axes[7], data["traces"])
    for ax, name in zip(axes, "abcdefgh", strict=True):
        panel_label(ax, name)
    return figure


def _bar(ax: Any, mesh: Any, label: str, **options: Any) -> None:
    bar = ax.figure.colorbar(mesh, ax=ax, pad=0.02, **options)
    bar.set_label(label, fontsize=7)
    bar.ax.tick_params(labelsize=6)


def _multipliers(ax: Any, modes: Any) -> None:
    """The largest modulus of the multipliers over the stiffness of a wave and the load; black where
    it is 1.
    """
    sigma, loads, modulus = (modes[name].values for name in ("stiffness", "amplitude", "modulus"))
    mesh = ax.pcolormesh(
        sigma, loads, modulus, cmap="RdBu_r", vmin=0.5, vmax=1.5, shading="nearest", rasterized=True
    )
    ax.contour(sigma, loads, modulus, levels=[1.0], colors="k", linewidths=0.9)
    ax.set_xscale("log")
    ax.set_xlabel(r"stiffness of a wave $\sigma=\kappa\,\mu_q$")
    ax.set_ylabel(LOAD)
    _bar(ax, mesh, "largest multiplier")


def _growing(ax: Any, modes: Any) -> None:
    """The wave that grows fastest, over coupling and load; white where none does."""
    from matplotlib.colors import BoundaryNorm, ListedColormap

    kappa = np.geomspace(*SETTINGS.couplings, 161)
    moduli = np.stack([of_waves(modes, value) for value in kappa], axis=1)  # (loads, kappa, waves)
    wave = np.where(moduli.max(axis=2) > 1.0, moduli.argmax(axis=2) + 1.0, np.nan)
    colours = ["#4477aa", "#66ccee", "#228833", "#ccbb44", "#ee8866", "#ee6677", "#aa3377"]
    norm = BoundaryNorm(np.arange(0.5, CELLS), CELLS - 1)
    loads = modes["amplitude"].values
    mesh = ax.pcolormesh(
        kappa,
        loads,
        wave,
        cmap=ListedColormap(colours),
        norm=norm,
        shading="nearest",
        rasterized=True,
    )
    ax.axhline(CRITICAL, color="#762a83", lw=0.9)
    ax.axhline(SETTINGS.load, color="k", lw=0.7, ls=":")
    ax.set_xscale("log")
    ax.set_xlabel(COUPLING)
    ax.set_ylabel(LOAD)
    _bar(ax, mesh, "wave $q$ that grows", ticks=range(1, CELLS))


def _cells(ax: Any, cells: Any) -> None:
    """How wide each cell opens at last, over the coupling; grey where it stays closed."""
    from matplotlib import colormaps

    size = np.where(cells["size"].values > 0.01, cells["size"].values, np.nan).T
    colours = colormaps["viridis"].with_extremes(bad="0.85")
    mesh = ax.pcolormesh(
        cells["coupling"].values,
        cells["cell"].values,
        size,
        cmap=colours,
        vmin=0.0,
        shading="nearest",
    )
    ax.set_xscale("log")
    ax.set_xlabel(COUPLING)
    ax.set_ylabel("cell")
    _bar(ax, mesh, r"$\max|\theta|$ at last (rad)")


def _states(ax: Any, states: Any) -> None:
    """From how many starts the cells that begin to move are those that go on, and how many sets of
    cells there are at last.
    """

    same, sets = kept_states(states)
    kappa = states["coupling"].values
    ax.plot(kappa, same, "o-", ms=3.2, lw=1.0, color="#2166ac", label="the same cells go on")
    ax.plot(kappa, sets, "s--", ms=3.0, lw=1.0, color="#b2182b", label="different sets at last")
    ax.set_xscale("log")
    ax.set_ylim(-0.5, states.sizes["start"] + 0.8)
    ax.set_xlabel(COUPLING)
    ax.set_ylabel(f"of {states.sizes['start']} starts")
    ax.legend(loc="upper right", fontsize=6, frameon=False)


def _wave(ax: Any, wave: Any) -> None:
    """How far each cell is from the motion that all began with, at one phase of the load, period
    after period.
    """
    apart = wave["theta"].values - wave["theta"].values[:, 0].mean()
    most = float(np.abs(apart).max())
    mesh = ax.pcolormesh(
        wave["period"].values,
        wave["cell"].values,
        apart,
        cmap="PuOr",
        vmin=-most,
        vmax=most,
        shading="nearest",
        rasterized=True,
    )
    ax.set_xlabel(rf"forcing periods, $\kappa={float(wave['coupling']):g}$")
    ax.set_ylabel("cell")
    _bar(ax, mesh, r"$\theta_j$ less the shared one (rad)")


def _least(ax: Any, least: Any, modes: Any) -> None:
    """The least loads with motion, the fold of one cell and the critical load."""

    for i, (mark, colour) in enumerate((("o-", "#2166ac"), ("s--", "#b2182b"))):
        name = str(least["begin"].values[i])
        ax.plot(
            least["coupling"].values,
            least["least"].values[i],
            mark,
            ms=3.2,
            lw=1.0,
            color=colour,
            label=f"from {name}",
        )
    ax.axhline(CRITICAL, color="#762a83", lw=0.9, label=r"$\widehat{\mathcal{H}}_{cr}$")
    ax.axhline(float(modes["fold"]), color="k", lw=0.9, ls=":", label="fold of one cell")
    ax.set_xscale("log")
    ax.set_ylim(0.0, 1.25 * CRITICAL)
    ax.set_xlabel(COUPLING)
    ax.set_ylabel(r"least $\widehat{\mathcal{H}}$ with motion")
    ax.legend(loc="upper right", fontsize=6, frameon=False, ncols=2)


def _checks(ax: Any, traces: Any) -> None:
    """Traces of the waves' maps from a motion of eight cells, over those from the equations of
    one.
    """
    expected = traces["expected"].values
    found = traces["found"].values
    ends = [math.floor(expected.min() * 2) / 2, math.ceil(expected.max() * 2) / 2]
    ax.plot(ends, ends, color="0.6", lw=0.9)
    ax.plot(expected, found, "o", ms=4, color="#2166ac")
    for q, (x, y) in enumerate(zip(expected, found, strict=True)):
        ax.annotate(f"$q={q}$", (x, y), xytext=(4, -8), textcoords="offset points", fontsize=6)
    ax.set_xlabel("trace of a wave's map, one cell")
    ax.set_ylabel("trace, motion of eight cells")
