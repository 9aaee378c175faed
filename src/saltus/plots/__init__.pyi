from .any_result import DRAWINGS, plot
from .attractors import draw_attractors
from .backbone import draw_backbone
from .basin_boundary import draw_uncertainty, draw_wada
from .basins import draw_basins
from .chaotic_bands import draw_chaotic_bands
from .chart import chart_legend, data_is_tree, draw_chart, draw_closed_form, draw_lines, draw_stability_chart
from .conventions import (
    DOUBLE_COLUMN,
    FAINT,
    INK,
    SINGLE_COLUMN,
    STABLE,
    STABLE_LINE,
    UNSTABLE,
    UNSTABLE_LINE,
    figure_of,
    new_figure,
    panel_label,
    style,
    styled,
)
from .curves import draw_attractors_along, draw_branch, draw_special_curve
from .diagram import POINTS, draw_diagram
from .energy_space import draw_space
from .ensembles import draw_ensemble
from .exponents import draw_exponents, draw_exponents_along
from .impact_approach import draw_history, draw_phase
from .loading_paths import draw_domain, draw_path
from .manifolds import draw_manifold, draw_separatrix
from .motion import draw_motion
from .orbits_found import draw_cascade, draw_search
from .peak_ratio import draw_family
from .phase_portrait import draw_portrait
from .plane import draw_plane
from .response import (
    draw_bands,
    draw_beside,
    draw_branches,
    draw_critical,
    draw_limits,
    draw_response,
    draw_special,
    draw_zoom,
    highest,
    lowest,
    note_missed,
    response_legend,
)
from .rocking import draw_errors, draw_jump, draw_periods
from .sensitivities import draw_sensitivities
from .sweep import draw_sweep
from .time_histories import draw_histories
from .unit_cell import draw_cell, draw_frames, label_deformed, label_heights, label_undeformed
from .verdict import draw_verdict

__all__ = [
    "DOUBLE_COLUMN",
    "DRAWINGS",
    "FAINT",
    "INK",
    "POINTS",
    "SINGLE_COLUMN",
    "STABLE",
    "STABLE_LINE",
    "UNSTABLE",
    "UNSTABLE_LINE",
    "chart_legend",
    "data_is_tree",
    "draw_attractors",
    "draw_attractors_along",
    "draw_backbone",
    "draw_bands",
    "draw_basins",
    "draw_beside",
    "draw_branch",
    "draw_branches",
    "draw_cascade",
    "draw_cell",
    "draw_chaotic_bands",
    "draw_chart",
    "draw_closed_form",
    "draw_critical",
    "draw_diagram",
    "draw_domain",
    "draw_ensemble",
    "draw_errors",
    "draw_exponents",
    "draw_exponents_along",
    "draw_family",
    "draw_frames",
    "draw_histories",
    "draw_history",
    "draw_jump",
    "draw_limits",
    "draw_lines",
    "draw_manifold",
    "draw_motion",
    "draw_path",
    "draw_periods",
    "draw_phase",
    "draw_plane",
    "draw_portrait",
    "draw_response",
    "draw_search",
    "draw_sensitivities",
    "draw_separatrix",
    "draw_space",
    "draw_special",
    "draw_special_curve",
    "draw_stability_chart",
    "draw_sweep",
    "draw_uncertainty",
    "draw_verdict",
    "draw_wada",
    "draw_zoom",
    "figure_of",
    "highest",
    "label_deformed",
    "label_heights",
    "label_undeformed",
    "lowest",
    "new_figure",
    "note_missed",
    "panel_label",
    "plot",
    "response_legend",
    "style",
    "styled",
]
