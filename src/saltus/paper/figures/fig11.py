"""Fig. 11: bifurcation diagrams under load (i), a harmonic horizontal force, for two low frequencies."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from saltus.paper.claims.claim import Measured
from saltus.paper.figures import load_diagrams
from saltus.paper.figures.figure import paper_figure
from saltus.paper.measures import chaos_measures, response_measures
from saltus.paper.measures.validity_measures import validity
from saltus.paper.panel_work import Panels

FREQUENCIES = {"a": 0.5, "b": 1.0}  # Omega
LARGEST = dict.fromkeys(FREQUENCIES.values(), 4.0)  # Hhat: beyond the second region of chaos, or what is left of it


def panels(frequencies: Mapping[str, float] = FREQUENCIES, **options: Any) -> Panels:
    """One diagram for each frequency; options are those of `bifurcation_diagram`."""
    return load_diagrams.panels(frequencies, LARGEST, **options)


def draw(data: Any) -> Any:
    """(a) and (b), a panel for each frequency."""
    return load_diagrams.draw(data, FREQUENCIES, zoomed=0.2)


def measure(data: Any) -> dict[str, Measured | None]:
    """Every feature that the text names."""
    panels = {FREQUENCIES[name]: tree for name, tree in data.children.items()}
    found = {**response_measures.force_diagrams("fig11", panels), **chaos_measures.force_diagrams(panels)}
    return {**found, "fig11-validity": validity("Fig. 11", data.children)}


FIGURE = paper_figure("fig11", panels=panels, join=load_diagrams.join, draw=draw, measure=measure)
