from .basins import basin_sweep
from .chart.chart import stability_chart, with_limits
from .chart.with_borders import bordered_chart
from .diagram.bands import chaotic_bands
from .diagram.diagram import bifurcation_diagram, orbit_diagram, response_spectrum
from .portrait import phase_portrait

__all__ = [
    "basin_sweep",
    "bifurcation_diagram",
    "bordered_chart",
    "chaotic_bands",
    "orbit_diagram",
    "phase_portrait",
    "response_spectrum",
    "stability_chart",
    "with_limits",
]
