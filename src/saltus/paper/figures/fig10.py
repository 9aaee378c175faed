"""Fig. 10: response spectra under load (ii), a harmonic horizontal ground motion, for two amplitudes."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from saltus.paper.claims import statements_chaos
from saltus.paper.claims.claim import Claim
from saltus.paper.claims.features import main_branch
from saltus.paper.claims.statements_spectra import ground_spectra
from saltus.paper.figures import spectra
from saltus.paper.figures.fig09 import draw_panel
from saltus.paper.figures.figure import PaperFigure
from saltus.paper.figures.panels import each
from saltus.plots import DOUBLE_COLUMN, draw_zoom, highest, new_figure, response_legend, styled

AMPLITUDES = {"a": 0.25, "b": 0.5}  # zetahat
FREQUENCIES = (0.1, 4.0)  # Omega: up to chaos


def compute(amplitudes: Mapping[str, float] = AMPLITUDES, **options: Any) -> Any:
    """One spectrum for each amplitude; options are those of `response_spectrum`."""
    return spectra.together(each(_panel, amplitudes, **options), what="response spectrum under load (ii)")


def _panel(amplitude: float, **options: Any) -> Any:
    return spectra.spectrum(spectra.on_ground(amplitude=amplitude), FREQUENCIES, **options)


@styled
def draw(data: Any) -> Any:
    """(a) and (b), a panel for each amplitude."""
    panels = {name: tree for name, tree in data.children.items() if name in AMPLITUDES}
    figure = new_figure(DOUBLE_COLUMN, 95.0)
    axes = figure.subplots(1, len(panels), squeeze=False)[0]
    for ax, (name, tree) in zip(axes, panels.items(), strict=True):
        draw_panel(ax, tree, name, rf"$\widehat{{\zeta}}={AMPLITUDES[name]:g}$", r"\theta_{\rm eq}")
        ax.set_xlabel(r"frequency $\Omega$")
        zoom(ax, tree)
    response_legend(figure, list(panels.values()))
    return figure


def zoom(ax: Any, tree: Any) -> None:
    """An inset with what lies between rest and the steady motions of the main branch."""
    begin, scale = float(main_branch(tree)["parameter"].min()), tree.attrs["scale"]
    window = (0.96 * begin, 1.26 * begin)
    draw_zoom(ax, tree, (0.34, 0.38), (*window, 0.0, 0.6 * highest(tree, *window) / scale), scale=scale)


def claims(data: Any) -> list[Claim]:
    """Every feature that the text names."""
    amplitudes = {name: AMPLITUDES[name] for name in data.children}
    return [*ground_spectra(data, amplitudes), *statements_chaos.ground_spectra(data, amplitudes)]


FIGURE = PaperFigure(
    name="fig10",
    title="Fig. 10: response spectra under load (ii)",
    caption=(
        "As Fig. 9, under the horizontal ground motion ζ = ζ̂ sin Ωτ, in units of θ_eq = arccos(cos β₀ − ζ̂) − β₀. Below the "
        "frequency at which the main branch begins the ground's acceleration is too small for any motion but rest; insets: what "
        "lies between."
    ),
    compute=compute,
    draw=draw,
    claims=claims,
)
