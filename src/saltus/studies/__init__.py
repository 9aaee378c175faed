"""What one asks: phase portraits, response spectra, bifurcation diagrams with their bands of chaos, basins, stability charts."""

from saltus.studies.bands import chaotic_bands
from saltus.studies.basin_sweep import basin_sweep
from saltus.studies.bordered import bordered_chart
from saltus.studies.chart import stability_chart
from saltus.studies.portrait import phase_portrait
from saltus.studies.spectrum import bifurcation_diagram, response_spectrum

__all__ = [
    "basin_sweep",
    "bifurcation_diagram",
    "bordered_chart",
    "chaotic_bands",
    "phase_portrait",
    "response_spectrum",
    "stability_chart",
]
