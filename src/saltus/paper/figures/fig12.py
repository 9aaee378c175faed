"""Fig. 12: bifurcation diagrams under load (i), a harmonic horizontal force, for two high frequencies."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from saltus.paper.claims import statements_chaos
from saltus.paper.claims.claim import Claim
from saltus.paper.claims.statements_spectra import force_diagrams
from saltus.paper.figures import diagrams
from saltus.paper.figures.figure import PaperFigure

FREQUENCIES = {"a": 2.0, "b": 4.0}  # Omega
LARGEST = {2.0: 5.0, 4.0: 9.0}  # Hhat, by Omega: beyond the first chaos


def compute(frequencies: Mapping[str, float] = FREQUENCIES, **options: Any) -> Any:
    """One diagram for each frequency; options are those of `bifurcation_diagram`."""
    return diagrams.compute(frequencies, LARGEST, **options)


def draw(data: Any) -> Any:
    """(a) and (b), a panel for each frequency."""
    return diagrams.draw(data, FREQUENCIES, zoomed=0.6)


def claims(data: Any) -> list[Claim]:
    """Every feature that the text names."""
    frequencies = {name: FREQUENCIES[name] for name in data.children}
    return [*force_diagrams("fig12", data, frequencies), *statements_chaos.force_diagrams("fig12", data, frequencies)]


FIGURE = PaperFigure(
    name="fig12",
    title="Fig. 12: bifurcation diagrams under load (i), Ω = 2 and 4",
    caption=("As Fig. 11, for two higher frequencies."),
    compute=compute,
    draw=draw,
    claims=claims,
)
