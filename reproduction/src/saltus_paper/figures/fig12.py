"""Fig.

12: bifurcation diagrams under load (i), a harmonic horizontal force, for two high frequencies.
"""

from __future__ import annotations

from typing import Any

from saltus_paper.claims.claim import Measures
from saltus_paper.figures.load_diagrams import force_figure
from saltus_paper.measures.chaos_measures import shifts

# Omega of each panel, and Hhat beyond the first chaos.
FREQUENCIES = {"a": 2.0, "b": 4.0}
LARGEST = {2.0: 5.0, 4.0: 9.0}


def _chaos(panels: Any) -> Measures:
    return {"fig12-shift": shifts(panels)}


FIGURE = force_figure("fig12", FREQUENCIES, LARGEST, _chaos, zoomed=0.6, module=__name__)
