"""Fig. 14: stability charts under load (i) for six frequencies."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from saltus.paper.claims.claim import Claim
from saltus.paper.claims.statements_charts import over_frequency
from saltus.paper.figures import charts
from saltus.paper.figures.figure import PaperFigure

PANELS: dict[str, dict[str, Any]] = {
    name: {"beta0": 80.0, "damping": 0.1, "frequency": frequency, "widest": widest, "curves": curves}
    for name, frequency, widest, curves in (
        *(("a", 0.1, charts.WIDEST, 2), ("b", 0.5, charts.WIDEST, 8)),  # slow loads: chaos, and orbits of many impacts
        *(("c", 0.75, charts.WIDEST, 12), ("d", 1.0, charts.WIDEST, 20), ("e", 1.5, charts.WIDEST, 16)),
        ("f", 4.0, 0.2, 20),  # all borders are at small Hhat
    )
}


def compute(panels: Mapping[str, Mapping[str, Any]] = PANELS, size: int = 101, **options: Any) -> Any:
    """One chart for each frequency; options are those of `stability_chart`."""
    return charts.compute(panels, size, **options)


def draw(data: Any) -> Any:
    """(a) to (f), a panel for each frequency."""
    return charts.draw(data, columns=2, height=240.0)


def claims(data: Any) -> list[Claim]:
    """The statements of the text on Fig. 14."""
    return over_frequency(data)


FIGURE = PaperFigure(
    name="fig14",
    title="Fig. 14: stability charts, Ω = 0.1, 0.5, 0.75, 1, 1.5 and 4",
    caption=(
        "Largest amplitude of the stable motions beside rest under H = Ĥ sin Ωτ at constant V̄, β₀ = 80°, C = 0.1. White: from "
        "all starts the motion comes to rest. Grey: none settles on a motion of up to six periods (chaos). Dotted: several "
        "such motions, those of at least 0.001 rad counted. Red: quasi-static border, with the fold of equilibria "
        "below V̄ = −sin β₀ (erratum 23); red dots: the rest of the paper's line. Black: exact curves on which motions are born "
        "(folds) or lose their stability; dots: such places beside rest through which no curve goes. Green: beyond it the "
        "largest motion passes the straight line."
    ),
    compute=compute,
    draw=draw,
    claims=claims,
)
