"""The bands that the paper calls quasi-periodic, resolved (errata 22): stroboscopic points and
Lyapunov exponents.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from typing import Any

import numpy as np

from saltus import chaotic_bands, excludes_tori
from saltus.flow import Ending
from saltus.plots import LOOK, draw_bands, new_figure, panel_label, styled
from saltus_paper.claims.claim import Measured, measured
from saltus_paper.figure_data import joined
from saltus_paper.figures.figure import paper_figure
from saltus_paper.figures.harmonic_loads import FREQUENCY, on_ground, under_force
from saltus_paper.panel_work import Panels

WINDOWS = {"a": (0.35, 0.42), "b": (0.405, 0.475)}  # Omega
TITLES = {"a": r"load (i), $\widehat{\mathcal{H}}=0.2$", "b": r"load (ii), $\widehat{\zeta}=0.5$"}
COUNT = 57
STARTS = 4
EFFORT = "quick"  # steps of 4e-3 of these windows: less than a tenth of those of Figs. 9 and 10


def panels(
    windows: Mapping[str, tuple[float, float]] = WINDOWS, count: int = COUNT, starts: int = STARTS
) -> Panels:
    """`chaotic_bands` over both windows."""
    return {
        name: partial(_panel, name, window, count=count, starts=starts, effort=EFFORT)
        for name, window in windows.items()
    }


def join(made: Mapping[str, Any]) -> Any:
    """The bands under both loads."""
    return joined(made, what="the bands called quasi-periodic")


def _panel(name: str, window: tuple[float, float], **options: Any) -> Any:
    """The bands of a window; `torus` in the attributes says why there is none."""
    import xarray as xr

    system = {"a": under_force(amplitude=0.2), "b": on_ground(amplitude=0.5)}[name]
    found = chaotic_bands(system, FREQUENCY, window, window=((-1.0, 1.0), (-1.0, 1.0)), **options)
    tree = xr.DataTree.from_dict(found.to_datasets())
    tree.attrs = {
        "system": system.to_json(),
        "bounds": list(window),
        "torus": excludes_tori(system) or "",
    }
    return tree


@styled
def draw(data: Any) -> Any:
    """For each load the angle at phase 0 of every motion, and its largest exponent with its
    error.
    """
    figure = new_figure(LOOK.double_column, 120.0)
    axes = figure.subplots(2, len(data.children), squeeze=False, sharex="col", height_ratios=[3, 2])
    for column, (name, tree) in zip(axes.T, data.children.items(), strict=True):
        _stroboscopic_states(column[0], tree)
        _exponents(column[1], tree)
        column[0].set_title(TITLES[name], pad=4)
        panel_label(column[0], name)
        column[1].set_xlim(tree.attrs["bounds"])
        column[1].set_xlabel(r"frequency $\Omega$")
    axes[0, 0].set_ylabel(r"$\theta$ at phase 0 (rad)")
    axes[1, 0].set_ylabel(r"largest exponent $\lambda$")
    # where nothing is drawn
    axes[1, 0].legend(loc="upper right", handletextpad=0.2, borderaxespad=0.2)
    return figure


def _stroboscopic_states(ax: Any, tree: Any) -> None:
    draw_bands(ax, tree)
    ax.plot(
        tree["stroboscopic"]["value"],
        tree["stroboscopic"]["position"],
        color=LOOK.ink,
        linestyle="none",
        marker=".",
        markersize=1.2,
        markeredgewidth=0.0,
        rasterized=True,
    )


def _exponents(ax: Any, tree: Any) -> None:
    """Chaos in blue, undecided motions as open red marks; settled motions have no mark."""
    draw_bands(ax, tree)
    ax.axhline(0.0, color=LOOK.faint, lw=0.6, zorder=1)
    table = tree["exponents"]
    for kind, colour, face, label in (
        (Ending.CHAOTIC, LOOK.stable, LOOK.stable, "chaotic"),
        (Ending.UNDECIDED, LOOK.unstable, "white", "undecided"),
    ):
        here = table["verdict"].values == kind
        ax.errorbar(
            table["value"].values[here], table["exponent"].values[here], table["error"].values[here],
            linestyle="none", marker="o", markersize=2.2, markerfacecolor=face, color=colour, elinewidth=0.5, zorder=3,
            label=label,
        )  # fmt: skip


def measure(data: Any) -> dict[str, Measured | None]:
    """Both bands are chaos between periodic motions, not tori."""
    return {
        f"quasi-{name}": _resolved(data[name]) if name in data.children else None
        for name in WINDOWS
    }


def _resolved(panel: Any) -> Measured:
    bands = panel["bands"]
    table = panel["exponents"]
    reason = panel.attrs["torus"]
    periodic = int(np.isin(table["verdict"].values, (Ending.PERIODIC, Ending.TRANSIENT)).sum())
    largest = float(np.max(bands["exponent"].values, initial=-np.inf))
    return measured(
        bool(reason) and largest > 0.0 and periodic > 0,
        reason=reason,
        bands=[
            {"low": low, "high": high}
            for low, high in zip(bands["low"].values, bands["high"].values, strict=True)
        ],
        largest=largest,
        periodic=periodic,
        frequencies=table.sizes["value"],
    )


FIGURE = paper_figure(
    "quasi", quick={"count": 15}, panels=panels, join=join, draw=draw, measure=measure
)
