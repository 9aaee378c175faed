"""Fig. 9: response spectra under load (i), a harmonic horizontal force, for six amplitudes."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from typing import Any

import numpy as np

from saltus.plots import (
    LOOK,
    draw_branches,
    draw_limits,
    draw_response,
    draw_special,
    highest,
    new_figure,
    note_missed,
    panel_label,
    response_legend,
    styled,
)
from saltus_paper.claims.claim import Measured, measured
from saltus_paper.figure_data import joined
from saltus_paper.figures.figure import paper_figure
from saltus_paper.figures.harmonic_loads import BETA0, VERTICAL, under_force
from saltus_paper.figures.response_panels import diagrams_page, spectrum
from saltus_paper.figures.zooms import draw_zoom
from saltus_paper.measures import chaos_measures, response_measures
from saltus_paper.measures.spectrum_features import detached
from saltus_paper.measures.validity_measures import validity
from saltus_paper.panel_work import Panels

AMPLITUDES = {"a": 0.2, "b": 0.5, "c": 1.0, "d": 1.5, "e": 2.0, "f": 3.0}  # Hhat
FREQUENCY_RANGE = (0.1, 3.75)  # Omega: up to where the loops of (d) to (f) have closed
WIDE = ("e", "f")
LOOPS = ("c",)  # panels with a loop that closes far beyond the range
ZOOMED = {"a": (0.1, 0.46), "b": (0.1, 0.34)}  # Omega of the superharmonic resonances


def panels(amplitudes: Mapping[str, float] = AMPLITUDES, **options: Any) -> Panels:
    """One spectrum for each amplitude, those that take longest first; options are those of
    `response_spectrum`.
    """
    systems = {
        name: under_force(amplitude=amplitude)
        for name, amplitude in reversed(list(amplitudes.items()))
    }
    return {
        name: partial(spectrum, system, FREQUENCY_RANGE, **options)
        for name, system in systems.items()
    }


def join(made: Mapping[str, Any]) -> Any:
    """The spectra in the order of the figure."""
    return joined(dict(sorted(made.items())), what="response spectrum under load (i)")


@styled
def draw(data: Any) -> Any:
    """(a) to (f), a panel for each amplitude, those with the most branches over the full width;
    details in insets.
    """
    panels = {name: tree for name, tree in data.children.items() if name in AMPLITUDES}
    rows: Any = _rows(list(panels))
    figure = new_figure(LOOK.double_column, 25.0 + 54.0 * len(rows))
    axes = figure.subplot_mosaic(rows)
    for name, tree in panels.items():
        draw_panel(
            axes[name],
            tree,
            name,
            rf"$\widehat{{\mathcal{{H}}}}={AMPLITUDES[name]:g}$",
            r"\theta_{\rm st}",
        )
        if name in ZOOMED:
            zoom(axes[name], tree, ZOOMED[name])
        if name in LOOPS:
            closed_loop(axes[name], tree)
    for name in rows[-1]:
        axes[name].set_xlabel(r"frequency $\Omega$")
    response_legend(figure, list(panels.values()))
    return figure


def _rows(names: list[str]) -> list[list[str]]:
    """The panels' names in rows of two columns; a wide panel, or one without a neighbour, fills a
    row.
    """
    narrow = [name for name in names if name not in WIDE]
    pairs = [narrow[i : i + 2] for i in range(0, len(narrow), 2)]
    return [
        *(pair if len(pair) == 2 else pair * 2 for pair in pairs),
        *([name] * 2 for name in names if name in WIDE),
    ]


def draw_panel(ax: Any, tree: Any, name: str, title: str, unit: str) -> None:
    """A spectrum in units of its scale, over the range of the study, with the limits of the
    mechanism.
    """
    scale = tree.attrs["scale"]
    (low, high) = tree.attrs["bounds"]
    ax.set_xlim(0.0, high)
    ax.set_ylim(0.0, 1.08 * highest(tree, low, high) / scale)
    ax.set_ylabel(rf"$\max_\tau|\theta|/{unit}$")
    panel_label(ax, name)
    ax.set_title(title, pad=4)
    draw_limits(ax, tree.attrs["limits"], scale)
    draw_response(ax, tree, scale=scale)
    note_missed(ax, tree)


def closed_loop(ax: Any, tree: Any) -> None:
    """An inset, over a logarithmic axis, with the closed loop that reaches farthest beyond the
    range.
    """
    closed = [branch for _, branch in detached(tree) if branch.attrs["closed"]]
    if not closed:
        return
    loop = max(closed, key=lambda branch: float(branch["parameter"].max()))
    scale = tree.attrs["scale"]
    inset = ax.inset_axes((0.335, 0.52, 0.215, 0.40))
    inset.set_xscale("log")
    inset.set_xlim(0.9 * float(loop["parameter"].min()), 1.2 * float(loop["parameter"].max()))
    inset.set_ylim(0.0, 1.1 * float(loop["amplitude"].max()) / scale)
    inset.set_xticks([2, 5, 10], ["2", "5", "10"])
    inset.minorticks_off()
    inset.tick_params(labelsize=7, length=2, pad=1.5)
    draw_limits(inset, tree.attrs["limits"], scale)
    draw_branches(inset, tree, scale=scale, weight=0.8)
    draw_special(inset, tree, scale=scale)


def zoom(ax: Any, tree: Any, window: tuple[float, float]) -> None:
    """An inset with the superharmonic resonances."""
    scale = tree.attrs["scale"]
    top = highest(tree, *window) / scale
    draw_zoom(ax, tree, (0.38, 0.34), (*window, 0.45 * top, 1.06 * top), scale=scale)


def measure(data: Any) -> dict[str, Measured | None]:
    """Every feature that the text names."""
    panels = {AMPLITUDES[name]: tree for name, tree in data.children.items()}
    found = {**response_measures.force_spectra(panels), **chaos_measures.force_spectra(panels)}
    found["fig09-static"] = static_unit(panels)
    return {**found, "fig09-validity": validity("Fig. 9", data.children)}


def static_unit(panels: Mapping[float, Any]) -> Measured:
    """The moment (`gov_eqn_theta_long`, k = 1) at theta_st, the `scale` of the spectra, where it
    first rises through 0.
    """
    beta0 = np.deg2rad(BETA0)
    residuals = []
    rows = []
    for load, tree in panels.items():
        scale = float(tree.attrs["scale"])
        theta = scale * np.append(np.linspace(0.0, 1.0 - 1e-6, 2000)[1:], (1.0, 1.0 + 1e-6))
        moment = theta - load * np.sin(beta0 + theta) - VERTICAL * np.cos(beta0 + theta)
        first = bool((moment[:-2] < 0.0).all()) and moment[-1] > 0.0
        residuals.append(abs(float(moment[-2])) if first else np.inf)
        rows.append({"load": load, "angle": float(np.rad2deg(scale))})
    return measured(max(residuals, default=np.inf), panels=rows)


PAGE = partial(diagrams_page, name="Fig. 9", first="b")
FIGURE = paper_figure(
    "fig09",
    quick={"effort": "quick"},
    panels=panels,
    join=join,
    draw=draw,
    measure=measure,
    page=PAGE,
)
