"""Fig. 14: stability charts under load (i) for six frequencies."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from saltus.paper.claims.claim import Measured
from saltus.paper.figures import chart_panels
from saltus.paper.figures.figure import paper_figure
from saltus.paper.measures.chart_measures import over_frequency
from saltus.paper.panel_work import Panels

CURVES = 8  # border curves of a panel: more would bury the border beside rest
CHARTS: dict[str, dict[str, Any]] = {
    name: {"beta0": 80.0, "damping": 0.1, "frequency": frequency, "widest": widest, "curves": CURVES}
    for name, frequency, widest in (
        *((name, frequency, chart_panels.WIDEST) for name, frequency in zip("abcde", (0.1, 0.5, 0.75, 1.0, 1.5), strict=True)),
        ("f", 4.0, 0.2),  # all borders are at small Hhat
    )
}


def panels(charts: Mapping[str, Mapping[str, Any]] = CHARTS, size: int = 101, **options: Any) -> Panels:
    """One chart for each frequency; options are those of `stability_chart`."""
    return chart_panels.panels(charts, size, **options)


def draw(data: Any) -> Any:
    """(a) to (f), a panel for each frequency."""
    return chart_panels.draw(data, columns=2, height=240.0)


def measure(data: Any) -> dict[str, Measured]:
    """The statements of the text on Fig. 14."""
    return over_frequency(data)


FIGURE = paper_figure("fig14", panels=panels, join=chart_panels.join, draw=draw, measure=measure)
