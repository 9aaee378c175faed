"""Fig. 9: response spectra under load (i), a harmonic horizontal force, for six amplitudes."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from saltus.paper.claims import statements_chaos
from saltus.paper.claims.claim import Claim
from saltus.paper.claims.statements_spectra import force_spectra
from saltus.paper.figures import spectra
from saltus.paper.figures.figure import PaperFigure
from saltus.paper.figures.panels import each
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
FREQUENCIES = (0.1, 3.0)
ZOOMED = {"a": (0.1, 0.46), "b": (0.1, 0.34)}  # Omega of the superharmonic resonances


def compute(amplitudes: Mapping[str, float] = AMPLITUDES, **options: Any) -> Any:
    """One spectrum for each amplitude; options are those of `response_spectrum`."""
    return spectra.together(each(_panel, amplitudes, **options), what="response spectrum under load (i)")


def _panel(amplitude: float, **options: Any) -> Any:
    return spectra.spectrum(spectra.under_force(amplitude=amplitude), FREQUENCIES, **options)


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
    draw_limits(ax, tree.attrs["line"], tree.attrs["farthest"], scale)
    draw_response(ax, tree, scale=scale)


def zoom(ax: Any, tree: Any, window: tuple[float, float]) -> None:
    """An inset with the superharmonic resonances."""
    scale = tree.attrs["scale"]
    top = highest(tree, *window) / scale
    draw_zoom(ax, tree, (0.40, 0.44), (*window, 0.45 * top, 1.06 * top), scale=scale)


def claims(data: Any) -> list[Claim]:
    """Every feature that the text names."""
    amplitudes = {name: AMPLITUDES[name] for name in data.children}
    return [*force_spectra(data, amplitudes), *statements_chaos.force_spectra(data, amplitudes)]


FIGURE = PaperFigure(
    name="fig09",
    title="Fig. 9: response spectra under load (i)",
    caption=(
        "Largest rotation over one period of the motion, in units of the quasi-static θ_st, against the frequency of the "
        "horizontal force H = Ĥ sin Ωτ at V = −0.5, β₀ = 80°, C = 0.1. Stable motions are solid blue, unstable ones dashed red; "
        "every branch is one of the exact non-smooth equation, followed through its grazings. Dots are attractors that direct "
        "simulation from many starts settled on. Green: the straight line at 100° (erratum 19), dash-dotted, and the kinematic "
        "limit at 200° (erratum 20), dotted, beyond which solutions of the equation are no motions of the mechanism. Insets: "
        "superharmonic resonances. Motions of up to 6 forcing periods. Orange: bands in which a motion is chaotic; "
        "none is quasi-periodic (erratum 22)."
    ),
    compute=compute,
    draw=draw,
    claims=claims,
)
