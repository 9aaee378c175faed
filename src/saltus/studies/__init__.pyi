from .chart.borders import Borders, with_borders
from .chart.chart_checks import disagreements, wrong_cells
from .chart.chart_study import bordered_chart, stability_chart
from .diagram.chaos_search import chaotic_bands
from .diagram.diagram_study import bifurcation_diagram, response_spectrum
from .portrait import phase_portrait
from .swept_parameter import frequency_sweep

__all__ = [
    "Borders",
    "bifurcation_diagram",
    "bordered_chart",
    "chaotic_bands",
    "disagreements",
    "frequency_sweep",
    "phase_portrait",
    "response_spectrum",
    "stability_chart",
    "with_borders",
    "wrong_cells",
]
