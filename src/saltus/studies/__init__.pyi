from .chart.borders import Borders, with_borders
from .chart.chart import bordered_chart, stability_chart
from .chart.disagreements import disagreements
from .chart.wrong_cells import wrong_cells
from .diagram.chaos_search import chaotic_bands
from .diagram.diagram import bifurcation_diagram, response_spectrum
from .portrait import phase_portrait

__all__ = [
    "Borders",
    "bifurcation_diagram",
    "bordered_chart",
    "chaotic_bands",
    "disagreements",
    "phase_portrait",
    "response_spectrum",
    "stability_chart",
    "with_borders",
    "wrong_cells",
]
