"""Fig. 11: bifurcation diagrams under load (i), a harmonic horizontal force, for two low frequencies."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from saltus.paper.claims import statements_chaos
from saltus.paper.claims.claim import Claim
from saltus.paper.claims.statements_spectra import force_diagrams
from saltus.paper.figures import diagrams
from saltus.paper.figures.figure import PaperFigure

FREQUENCIES = {"a": 0.5, "b": 1.0}  # Omega
LARGEST = dict.fromkeys(FREQUENCIES.values(), 4.0)  # Hhat: beyond the second region of chaos, or what is left of it


def compute(frequencies: Mapping[str, float] = FREQUENCIES, **options: Any) -> Any:
    """One diagram for each frequency; options are those of `bifurcation_diagram`."""
    return diagrams.compute(frequencies, LARGEST, **options)


def draw(data: Any) -> Any:
    """(a) and (b), a panel for each frequency."""
    return diagrams.draw(data, FREQUENCIES, zoomed=0.2)


def claims(data: Any) -> list[Claim]:
    """Every feature that the text names."""
    frequencies = {name: FREQUENCIES[name] for name in data.children}
    return [*force_diagrams("fig11", data, frequencies), *statements_chaos.force_diagrams("fig11", data, frequencies)]


FIGURE = PaperFigure(
    name="fig11",
    title="Fig. 11: bifurcation diagrams under load (i), Ω = 0.5 and 1",
    caption=(
        "Largest rotation over one period of the motion against the amplitude Ĥ of the horizontal force H = Ĥ sin Ωτ, V = −0.5, "
        "β₀ = 80°, C = 0.1, lines, dots and bands as in Fig. 9. Purple: the quasi-static bifurcation at Hcr = |V/tan β₀|, below "
        "which the undeformed state is held; stable motions exist beside it from far smaller amplitudes on (insets)."
    ),
    compute=compute,
    draw=draw,
    claims=claims,
)
