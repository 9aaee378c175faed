"""Fig. 9: response spectra under load (i), a harmonic horizontal force, for six amplitudes."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from saltus.paper.claims.claim import Measured
from saltus.paper.figure_data import joined
from saltus.paper.figures.figure import paper_figure
from saltus.paper.figures.harmonic_loads import under_force
from saltus.paper.figures.parallel_panels import each
from saltus.paper.figures.response_panels import spectrum
from saltus.paper.measures import chaos_measures, response_measures
from saltus.paper.measures.validity_measures import validity
from saltus.plots import (
    DOUBLE_COLUMN,
    draw_limits,
    draw_response,
    draw_zoom,
    highest,
    new_figure,
    panel_label,
    response_legend,
    styled,
)

AMPLITUDES = {"a": 0.2, "b": 0.5, "c": 1.0, "d": 1.5, "e": 2.0, "f": 3.0}  # Hhat
FREQUENCY_RANGE = (0.1, 3.0)
ZOOMED = {"a": (0.1, 0.46), "b": (0.1, 0.34)}  # Omega of the superharmonic resonances


def compute(amplitudes: Mapping[str, float] = AMPLITUDES, **options: Any) -> Any:
    """One spectrum for each amplitude; options are those of `response_spectrum`."""
    return joined(each(_panel, amplitudes, **options), what="response spectrum under load (i)")


def _panel(amplitude: float, **options: Any) -> Any:
    return spectrum(under_force(amplitude=amplitude), FREQUENCY_RANGE, **options)


@styled
def draw(data: Any) -> Any:
    """(a) to (f), a panel for each amplitude; zooms of the superharmonic resonances in the first two."""
    panels = {name: tree for name, tree in data.children.items() if name in AMPLITUDES}
    rows = (len(panels) + 1) // 2
    figure = new_figure(DOUBLE_COLUMN, 25.0 + 65.0 * rows)
    axes = figure.subplots(rows, 2, squeeze=False)
    for ax, (name, tree) in zip(axes.flat, panels.items(), strict=False):
        draw_panel(ax, tree, name, rf"$\widehat{{\mathcal{{H}}}}={AMPLITUDES[name]:g}$", r"\theta_{\rm st}")
        if name in ZOOMED:
            zoom(ax, tree, ZOOMED[name])
    for ax in axes[-1]:
        ax.set_xlabel(r"frequency $\Omega$")
    response_legend(figure, list(panels.values()))
    return figure


def draw_panel(ax: Any, tree: Any, name: str, title: str, unit: str) -> None:
    """A spectrum in units of its scale, over the range of the study, with the limits of the mechanism."""
    scale, (low, high) = tree.attrs["scale"], tree.attrs["bounds"]
    ax.set_xlim(0.0, high)
    ax.set_ylim(0.0, 1.08 * highest(tree, low, high) / scale)
    ax.set_ylabel(rf"$\max_\tau|\theta|/{unit}$")
    panel_label(ax, name)
    ax.set_title(title, pad=4)
    draw_limits(ax, tree.attrs["limits"], scale)
    draw_response(ax, tree, scale=scale)


def zoom(ax: Any, tree: Any, window: tuple[float, float]) -> None:
    """An inset with the superharmonic resonances."""
    scale = tree.attrs["scale"]
    top = highest(tree, *window) / scale
    draw_zoom(ax, tree, (0.40, 0.44), (*window, 0.45 * top, 1.06 * top), scale=scale)


def measure(data: Any) -> dict[str, Measured | None]:
    """Every feature that the text names."""
    panels = {AMPLITUDES[name]: tree for name, tree in data.children.items()}
    found = {**response_measures.force_spectra(panels), **chaos_measures.force_spectra(panels)}
    return {**found, "fig09-validity": validity("Fig. 9", data.children)}


FIGURE = paper_figure("fig09", compute=compute, draw=draw, measure=measure)
