from .chart.borders import Borders as Borders
from .chart.borders import with_borders as with_borders
from .chart.chart_study import bordered_chart as bordered_chart
from .chart.chart_study import disagreements as disagreements
from .chart.chart_study import wrong_cells as wrong_cells
from .theorems import prove_orbit_of as prove_orbit_of
