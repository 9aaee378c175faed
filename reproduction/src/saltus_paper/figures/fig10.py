"""Fig.

10: response spectra under load (ii), a harmonic horizontal ground motion, for two amplitudes.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from typing import Any

import numpy as np

from saltus.flow import find_recurrence
from saltus.plots import LOOK, highest, new_figure, response_legend, styled
from saltus_paper.claims.claim import Measured
from saltus_paper.figure_data import dataset, joined, with_groups
from saltus_paper.figures.fig09 import draw_panel
from saltus_paper.figures.figure import paper_figure
from saltus_paper.figures.harmonic_loads import on_ground
from saltus_paper.figures.response_panels import spectrum
from saltus_paper.figures.zooms import draw_beside
from saltus_paper.measures import chaos_measures, response_measures
from saltus_paper.measures.spectrum_features import main_branch
from saltus_paper.measures.validity_measures import validity
from saltus_paper.panel_work import Panels

AMPLITUDES = {"a": 0.25, "b": 0.5}  # zetahat
FREQUENCY_RANGE = (0.1, 4.0)  # Omega: up to chaos
# number of motions, and forcing periods after which settled ones are counted
MOTIONS = 96
HORIZONS = (500, 2000, 8000)


def panels(amplitudes: Mapping[str, float] = AMPLITUDES, **options: Any) -> Panels:
    """One spectrum for each amplitude, and what becomes of chaos; options are those of
    `response_spectrum`.
    """
    systems = {
        name: on_ground(amplitude=amplitude)
        for name, amplitude in reversed(list(amplitudes.items()))
    }
    spectra = {
        name: partial(spectrum, system, FREQUENCY_RANGE, **options)
        for name, system in systems.items()
    }
    return {**spectra, "transients": transients}


def join(made: Mapping[str, Any]) -> Any:
    """The spectra in the order of the figure, then what becomes of chaos."""
    spectra = {name: tree for name, tree in sorted(made.items()) if name in AMPLITUDES}
    return with_groups(
        joined(spectra, what="response spectrum under load (ii)"),
        {"transients": made["transients"]},
    )


def transients() -> Any:
    """How many of some motions at the highest frequency and the largest amplitude have settled
    after some forcing periods.
    """
    system = on_ground(frequency=FREQUENCY_RANGE[1], amplitude=max(AMPLITUDES.values()))
    states = np.random.default_rng(0).uniform(-4.0, 4.0, (MOTIONS, 2))
    found = find_recurrence(system, states, HORIZONS[-1], kept=0)
    settled = [int((~found.unsettled & (found.periods <= horizon)).sum()) for horizon in HORIZONS]
    again = find_recurrence(system, found.last[found.periodic], HORIZONS[0], kept=0)
    return dataset(
        {
            "settled": ("horizon", np.array(settled), "1", "motions that have settled"),
            "motions": ((), MOTIONS, "1", "of so many"),
            "returned": (
                (),
                int((~again.periodic).sum()),
                "1",
                "of the settled ones, that wander again later",
            ),
        },
        {"periods": ("horizon", np.array(HORIZONS), "1", "forcing periods")},
        what="motions that wander at a high frequency",
        system=system,
    )


@styled
def draw(data: Any) -> Any:
    """(a) and (b), a row for each amplitude; beside each the motions between rest and the main
    branch.
    """
    panels = {name: tree for name, tree in data.children.items() if name in AMPLITUDES}
    figure = new_figure(LOOK.double_column, 25.0 + 70.0 * len(panels))
    axes = figure.subplots(len(panels), 2, squeeze=False, width_ratios=[2.6, 1])
    for (ax, beside), (name, tree) in zip(axes, panels.items(), strict=True):
        draw_panel(ax, tree, name, rf"$\widehat{{\zeta}}={AMPLITUDES[name]:g}$", r"\theta_{\rm eq}")
        begin = float(main_branch(tree)["parameter"].min())
        scale = tree.attrs["scale"]
        low = 0.96 * begin
        high = 1.26 * begin
        draw_beside(
            beside, ax, tree, (low, high, 0.0, 0.6 * highest(tree, low, high) / scale), scale=scale
        )
        beside.set_title("detail", pad=4)
    for ax in axes[-1]:
        ax.set_xlabel(r"frequency $\Omega$")
    response_legend(figure, list(panels.values()))
    return figure


def measure(data: Any) -> dict[str, Measured | None]:
    """Every feature that the text names."""
    drawn = {name: tree for name, tree in data.children.items() if name in AMPLITUDES}
    panels = {AMPLITUDES[name]: tree for name, tree in drawn.items()}
    found = {
        **response_measures.ground_spectra(panels),
        **chaos_measures.ground_spectra(panels, data["transients"]),
    }
    found |= {"fig10-equivalent": response_measures.equivalent_rotation(panels)}
    return {**found, "fig10-validity": validity("Fig. 10", drawn)}


FIGURE = paper_figure(
    "fig10", quick={"effort": "quick"}, panels=panels, join=join, draw=draw, measure=measure
)
