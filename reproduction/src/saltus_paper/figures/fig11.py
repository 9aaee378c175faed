"""Fig.

11: bifurcation diagrams under load (i), a harmonic horizontal force, for two low frequencies.
"""

from __future__ import annotations

from saltus_paper.figures.load_diagrams import force_figure
from saltus_paper.measures import chaos_measures

# Omega of each panel, and a Hhat beyond the second region of chaos, or beyond the rest of it.
FREQUENCIES = {"a": 0.5, "b": 1.0}
LARGEST = {0.5: 4.0, 1.0: 4.0}

FIGURE = force_figure(
    "fig11", FREQUENCIES, LARGEST, chaos_measures.force_diagrams, zoomed=0.2, module=__name__
)
