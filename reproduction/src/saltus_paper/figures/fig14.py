"""Fig. 14: stability charts under load (i) for six frequencies."""

from __future__ import annotations

from saltus_paper.figures.chart_panels import chart_figure
from saltus_paper.measures.chart_measures import over_frequency

FREQUENCIES = {"a": 0.1, "b": 0.5, "c": 0.75, "d": 1.0, "e": 1.5, "f": 4.0}
WIDEST = {4.0: 0.2}  # the largest Hhat by Omega, where all borders are at small Hhat
CHARTS = {
    name: {
        "beta0": 80.0,
        "damping": 0.1,
        "frequency": frequency,
        "widest": WIDEST.get(frequency, 0.5),
    }
    for name, frequency in FREQUENCIES.items()
}

FIGURE = chart_figure("fig14", CHARTS, over_frequency, height=240.0, module=__name__)
