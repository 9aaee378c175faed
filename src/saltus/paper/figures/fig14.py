"""Fig. 14: stability charts under load (i) for six frequencies."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from saltus.paper.claims.claim import Measured
from saltus.paper.figures import chart_panels
from saltus.paper.figures.figure import paper_figure
from saltus.paper.measures.chart_measures import over_frequency

PANELS: dict[str, dict[str, Any]] = {
    name: {"beta0": 80.0, "damping": 0.1, "frequency": frequency, "widest": widest, "curves": curves}
    for name, frequency, widest, curves in (
        *(
            ("a", 0.1, chart_panels.WIDEST, 2),
            ("b", 0.5, chart_panels.WIDEST, 8),
        ),  # slow loads: chaos, and orbits of many impacts
        *(("c", 0.75, chart_panels.WIDEST, 12), ("d", 1.0, chart_panels.WIDEST, 20), ("e", 1.5, chart_panels.WIDEST, 16)),
        ("f", 4.0, 0.2, 20),  # all borders are at small Hhat
    )
}


def compute(panels: Mapping[str, Mapping[str, Any]] = PANELS, size: int = 101, **options: Any) -> Any:
    """One chart for each frequency; options are those of `stability_chart`."""
    return chart_panels.compute(panels, size, **options)


def draw(data: Any) -> Any:
    """(a) to (f), a panel for each frequency."""
    return chart_panels.draw(data, columns=2, height=240.0)


def measure(data: Any) -> dict[str, Measured]:
    """The statements of the text on Fig. 14."""
    return over_frequency(data)


FIGURE = paper_figure("fig14", compute=compute, draw=draw, measure=measure)
