"""The panels of Figs.

14 and 15: a stability chart with its exact and quasi-static borders, and their disagreements.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

import numpy as np

from saltus import System
from saltus.plots import (
    LOOK,
    border_curves,
    chart_legend,
    draw_chart,
    draw_closed_form,
    draw_lines,
    new_figure,
    panel_label,
    styled,
)
from saltus.studies import bordered_chart, wrong_cells
from saltus.theory import high_frequency_onset
from saltus_paper.claims.claim import Measures
from saltus_paper.figure_data import joined, named
from saltus_paper.figures.figure import LivingPage, PaperFigure, paper_figure
from saltus_paper.figures.harmonic_loads import under_force
from saltus_paper.panel_work import Panels

CHART_WINDOW = ((-2.0, 2.0), (-2.0, 2.0))  # of the initial states
LOWEST_LOAD = -2.0  # V
CLOSED_FORM_FROM = 2.0  # Omega from which the closed form of the onset is drawn too
# cells of a chart that are computed again, with more starts on a finer grid: each takes as long as
# 36 cells
CHECKED = 100
# largest number of curves on which motions end, for one chart: more would hide the border of rest
CURVES = 8


def chart_figure(
    name: str,
    charts: Mapping[str, Mapping[str, float]],
    measure: Callable[[Any], Measures],
    *,
    height: float,
    module: str,
) -> PaperFigure:
    """A figure with a chart of `size` x `size` cells for each system; options of its panels are
    those of `stability_chart`.
    """
    return paper_figure(
        name,
        panels=partial(_panels, charts=charts),
        join=partial(joined, what="stability charts under load (i)"),
        draw=partial(_draw, height=height),
        page=partial(_page, name=f"Fig. {name[3:]}"),
        measure=measure,
        quick={"size": 36, "curves": 1, "checked": 50},
        module=module,
    )


def _panels(charts: Mapping[str, Mapping[str, float]], size: int = 101, **options: Any) -> Panels:
    return {
        name: partial(panel, size=size, **{**values, **options}) for name, values in charts.items()
    }


def panel(
    *,
    beta0: float,
    damping: float,
    frequency: float,
    widest: float,
    size: int,
    curves: int = CURVES,
    checked: int = CHECKED,
    **options: Any,
) -> Any:
    """A `saltus.studies.bordered_chart` of the paper's system, with the share of its cells that are
    wrong (`wrong_cells`).
    """
    here = under_force(frequency, 0.1, beta0=beta0, damping=damping)
    horizontal = np.linspace(0.0, widest, size)
    vertical = np.linspace(LOWEST_LOAD, 0.0, size)
    tree = bordered_chart(
        here,
        curves=curves,
        horizontal=horizontal,
        vertical=vertical,
        **({"window": CHART_WINDOW} | options),
    )
    tree["chart"].attrs |= wrong_cells(here, tree["chart"].to_dataset(), cells=checked)
    tree["static"].attrs |= {
        "what": "quasi-static borders",
        "saltus_version": tree["chart"].attrs["saltus_version"],
    }
    tree.attrs = {
        "system": here.to_json(),
        "beta0_degrees": beta0,
        "damping": damping,
        "frequency": frequency,
    }
    return tree


def _page(data: Any, name: str) -> LivingPage:
    """All charts, and a motion of the first one's system."""
    charts = [
        named(tree["chart"].to_dataset(), f"{name}{panel}") for panel, tree in data.children.items()
    ]
    return System.from_json(charts[0].attrs["system"]), charts, {"theta": 0.3, "periods": 40}


# rad, of the colours: one scale for Figs. 14 and 15, so that their charts can be compared
COLOUR_TOP = 5.0


@styled
def _draw(data: Any, height: float) -> Any:
    """A chart for each panel, two in a row, all in one scale of colours."""
    panels = list(data.children.items())
    figure = new_figure(LOOK.double_column, height)
    axes = figure.subplots(-(-len(panels) // 2), 2, squeeze=False).ravel()
    tops = [float(np.nanmax(tree["chart"]["amplitude"].values, initial=1e-3)) for _, tree in panels]
    top = max(COLOUR_TOP, *tops)
    cells = None
    fast = False
    dots = 0
    for ax, (name, tree) in zip(axes, panels, strict=False):
        cells = draw_chart(ax, tree["chart"].to_dataset(), top) or cells
        dots += draw_lines(ax, tree)
        fast |= _closed_form(ax, tree)
        panel_label(ax, name)
        attrs = tree.attrs
        ax.set_title(
            (
                rf"$\Omega={attrs['frequency']:g}$, $\beta_0={attrs['beta0_degrees']:g}^\circ$, "
                rf"$\mathcal{{C}}={attrs['damping']:g}$"
            ),
            pad=4,
        )
        ax.set_xlabel(r"load amplitude $\widehat{\mathcal{H}}$")
        ax.set_ylabel(r"vertical load $\overline{\mathcal{V}}$")
    for ax in axes[len(panels) :]:
        ax.remove()
    if cells is not None:
        bar = figure.colorbar(
            cells,
            ax=axes[: len(panels)].tolist(),
            fraction=0.03,
            pad=0.01,
            ticks=cells.norm.boundaries,
            format="%g",
        )
        bar.set_label(r"largest $\max_\tau|\theta|$ of the stable motions (rad)")
    charts = [tree["chart"].to_dataset() for _, tree in panels]
    chart_legend(
        figure,
        charts,
        [curve for _, tree in panels for curve in border_curves(tree)],
        fast,
        dots > 0,
    )
    return figure


def _closed_form(ax: Any, tree: Any) -> bool:
    """Mark the onset's closed form (erratum 28) where the load is fast; returns whether it is."""
    frequency = float(tree.attrs["frequency"])
    if frequency < CLOSED_FORM_FROM:
        return False
    vertical = np.linspace(LOWEST_LOAD, -0.1, 20)
    beta0 = math.radians(float(tree.attrs["beta0_degrees"]))
    damping = float(tree.attrs["damping"])
    onset = [
        high_frequency_onset(frequency, beta0=beta0, vertical=v, damping=damping, order=2)
        for v in vertical
    ]
    draw_closed_form(ax, np.array(onset), vertical)
    return True
