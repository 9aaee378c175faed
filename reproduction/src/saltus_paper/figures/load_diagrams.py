"""The panels of Figs.

11 to 13: bifurcation diagrams over the amplitude of the horizontal load, and what becomes of rest.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

import numpy as np

from saltus import simulate_many
from saltus.plots import (
    LOOK,
    draw_critical,
    draw_limits,
    draw_response,
    highest,
    new_figure,
    note_missed,
    panel_label,
    response_legend,
    styled,
)
from saltus_paper.claims.claim import Measures
from saltus_paper.figure_data import joined, largest_angle, scalar_dataset, with_groups
from saltus_paper.figures.figure import PaperFigure, paper_figure
from saltus_paper.figures.harmonic_loads import AMPLITUDE, under_force
from saltus_paper.figures.knots_and_jumps import birth
from saltus_paper.figures.response_panels import diagram, diagrams_page
from saltus_paper.figures.zooms import draw_beside
from saltus_paper.measures import response_measures
from saltus_paper.measures.validity_measures import validity
from saltus_paper.panel_work import Panels

LEAST = 1e-3  # Hhat at which the diagrams begin: without a load nothing moves
NEAR = 1e-3  # relative distance from Hcr at which rest is tried
# forcing periods
WAIT = 300
LAST = 10


def force_figure(
    name: str,
    frequencies: Mapping[str, float],
    largest: Mapping[float, float],
    chaos: Callable[[Any], Measures],
    *,
    zoomed: float,
    module: str,
) -> PaperFigure:
    """A figure with a diagram under load (i) for each frequency Omega, up to the amplitude for it;
    `chaos` measures its bands.

    Beside each panel is its part up to the amplitude `zoomed`, about Hcr. Options of the panels are
    those of `bifurcation_diagram`.
    """

    def measure(data: Any) -> Measures:
        panels = {frequencies[label]: tree for label, tree in data.children.items()}
        shares = validity(f"Fig. {name[3:]}", data.children)
        return {
            **response_measures.force_diagrams(name, panels),
            **chaos(panels),
            f"{name}-validity": shares,
        }

    return paper_figure(
        name,
        panels=partial(_panels, frequencies=frequencies, largest=largest),
        join=partial(joined, what="bifurcation diagram under load (i)"),
        draw=partial(_draw, frequencies=frequencies, zoomed=zoomed),
        measure=measure,
        page=partial(diagrams_page, name=f"Fig. {name[3:]}"),
        quick={"effort": "quick"},
        module=module,
    )


def _panels(
    frequencies: Mapping[str, float], largest: Mapping[float, float], **options: Any
) -> Panels:
    return {
        name: partial(_panel, frequency, largest[frequency], **options)
        for name, frequency in frequencies.items()
    }


def _panel(frequency: float, largest: float, **options: Any) -> Any:
    """A diagram, with the fate of rest on both sides of Hcr."""
    system = under_force(frequency=frequency)
    tree = diagram(system, (LEAST, largest), **options)
    return with_groups(
        tree, {"undeformed": undeformed(system, tree.attrs["critical"]), "birth": birth(tree)}
    )


def undeformed(system: Any, critical: float) -> Any:
    """Motions from rest at theta = 0 just below and just above Hcr: whether they stay there, and
    how far they move much later.
    """
    amplitudes = critical * np.array([1 - NEAR, 1 + NEAR])
    ends = simulate_many(
        system,
        theta=0.0,
        parameters={AMPLITUDE: amplitudes},
        periods=WAIT,
        sample=("extrema",),
        last=LAST,
    )
    moved = np.maximum(ends["overall_largest_theta"].values, -ends["overall_smallest_theta"].values)
    values = {
        "held_below": int(moved[0] == 0.0),
        "held_above": int(moved[1] == 0.0),
        "later": float(largest_angle(ends)[1]),
    }
    return scalar_dataset(values, what="rest beside Hcr", system=system)


@styled
def _draw(data: Any, frequencies: Mapping[str, float], zoomed: float) -> Any:
    """A row for each frequency; beside each panel its part up to the amplitude `zoomed`, about
    Hcr.
    """
    panels = {name: tree for name, tree in data.children.items() if name in frequencies}
    figure = new_figure(LOOK.double_column, 25.0 + 75.0 * len(panels))
    axes = figure.subplots(len(panels), 2, squeeze=False, width_ratios=[2.6, 1])
    for (ax, beside), (name, tree) in zip(axes, panels.items(), strict=True):
        _, high = tree.attrs["bounds"]
        ax.set_xlim(0.0, high)
        ax.set_ylim(0.0, 1.08 * highest(tree, 0.0, high))
        frame(ax, tree)
        panel_label(ax, name)
        ax.set_title(rf"$\Omega={frequencies[name]:g}$", pad=4)
        ax.set_ylabel(r"$\max_\tau|\theta|$ (rad)")
        draw_response(ax, tree)
        note_missed(ax, tree)
        draw_beside(beside, ax, tree, (0.0, zoomed, 0.0, 1.1 * highest(tree, 0.0, zoomed)))
        frame(beside, tree)
        beside.set_title("near rest", pad=4)
    response_legend(figure, list(panels.values()), critical=True)
    return figure


def frame(ax: Any, tree: Any, mirrored: bool = False) -> None:
    """The limits of the mechanism, the quasi-static bifurcation and the name of the parameter."""
    draw_limits(ax, tree.attrs["limits"], mirrored=mirrored)
    draw_critical(ax, tree.attrs["critical"])
    ax.set_xlabel(r"load amplitude $\widehat{\mathcal{H}}$")
