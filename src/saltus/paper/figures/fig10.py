"""Fig. 10: response spectra under load (ii), a harmonic horizontal ground motion, for two amplitudes."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from saltus.paper.claims.claim import Measured
from saltus.paper.figure_data import joined
from saltus.paper.figures.fig09 import draw_panel
from saltus.paper.figures.figure import paper_figure
from saltus.paper.figures.harmonic_loads import on_ground
from saltus.paper.figures.parallel_panels import each
from saltus.paper.figures.response_panels import spectrum
from saltus.paper.measures import chaos_measures, response_measures
from saltus.paper.measures.spectrum_features import main_branch
from saltus.paper.measures.validity_measures import validity
from saltus.plots import DOUBLE_COLUMN, draw_beside, highest, new_figure, response_legend, styled

AMPLITUDES = {"a": 0.25, "b": 0.5}  # zetahat
FREQUENCY_RANGE = (0.1, 4.0)  # Omega: up to chaos


def compute(amplitudes: Mapping[str, float] = AMPLITUDES, **options: Any) -> Any:
    """One spectrum for each amplitude; options are those of `response_spectrum`."""
    return joined(each(_panel, amplitudes, **options), what="response spectrum under load (ii)")


def _panel(amplitude: float, **options: Any) -> Any:
    return spectrum(on_ground(amplitude=amplitude), FREQUENCY_RANGE, **options)


@styled
def draw(data: Any) -> Any:
    """(a) and (b), a row for each amplitude; beside it what lies between rest and the steady motions of the main branch."""
    panels = {name: tree for name, tree in data.children.items() if name in AMPLITUDES}
    figure = new_figure(DOUBLE_COLUMN, 25.0 + 70.0 * len(panels))
    axes = figure.subplots(len(panels), 2, squeeze=False, width_ratios=[2.6, 1])
    for (ax, beside), (name, tree) in zip(axes, panels.items(), strict=True):
        draw_panel(ax, tree, name, rf"$\widehat{{\zeta}}={AMPLITUDES[name]:g}$", r"\theta_{\rm eq}")
        begin, scale = float(main_branch(tree)["parameter"].min()), tree.attrs["scale"]
        low, high = 0.96 * begin, 1.26 * begin
        draw_beside(beside, ax, tree, (low, high, 0.0, 0.6 * highest(tree, low, high) / scale), scale=scale)
        beside.set_title("detail", pad=4)
    for ax in axes[-1]:
        ax.set_xlabel(r"frequency $\Omega$")
    response_legend(figure, list(panels.values()))
    return figure


def measure(data: Any) -> dict[str, Measured | None]:
    """Every feature that the text names."""
    panels = {AMPLITUDES[name]: tree for name, tree in data.children.items()}
    found = {**response_measures.ground_spectra(panels), **chaos_measures.ground_spectra(panels)}
    return {**found, "fig10-validity": validity("Fig. 10", data.children)}


FIGURE = paper_figure("fig10", compute=compute, draw=draw, measure=measure)
