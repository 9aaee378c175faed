"""Fig.

15: stability charts under load (i) at Omega = 1 for another angle, and for less and more damping.
"""

from __future__ import annotations

from saltus_paper.figures.chart_panels import chart_figure
from saltus_paper.measures.chart_measures import over_parameters

# the last is Fig. 14 (d), to compare with
SYSTEMS = {"a": (60.0, 0.1), "b": (80.0, 0.05), "c": (80.0, 0.15), "d": (80.0, 0.1)}
CHARTS = {
    name: {"beta0": beta0, "damping": damping, "frequency": 1.0, "widest": 0.5}
    for name, (beta0, damping) in SYSTEMS.items()
}

FIGURE = chart_figure("fig15", CHARTS, over_parameters, height=175.0, module=__name__)
