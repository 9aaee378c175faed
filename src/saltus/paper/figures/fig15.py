"""Fig. 15: stability charts under load (i) at Omega = 1 for another angle, and for less and more damping."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from saltus.paper.claims.claim import Measured
from saltus.paper.figures import chart_panels
from saltus.paper.figures.figure import paper_figure
from saltus.paper.measures.chart_measures import over_parameters
from saltus.paper.panel_work import Panels

REFERENCE = "d"  # Fig. 14 (d) again, which all are compared with
CHARTS: dict[str, dict[str, Any]] = {
    name: {"beta0": beta0, "damping": damping, "frequency": 1.0, "widest": chart_panels.WIDEST, "curves": 8}
    for name, beta0, damping in (("a", 60.0, 0.1), ("b", 80.0, 0.05), ("c", 80.0, 0.15), (REFERENCE, 80.0, 0.1))
}


def panels(charts: Mapping[str, Mapping[str, Any]] = CHARTS, size: int = 101, **options: Any) -> Panels:
    """One chart for each system; options are those of `stability_chart`."""
    return chart_panels.panels(charts, size, **options)


def draw(data: Any) -> Any:
    """(a) to (c), a panel for each system, and (d), which they are compared with."""
    return chart_panels.draw(data, columns=2, height=175.0)


def measure(data: Any) -> dict[str, Measured]:
    """The statements of the text on Fig. 15."""
    return over_parameters(data)


FIGURE = paper_figure("fig15", panels=panels, join=chart_panels.join, draw=draw, measure=measure)
