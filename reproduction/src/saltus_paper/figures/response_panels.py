"""The panels of Figs.

9 to 13: a study of the paper's system with the angles and loads that its picture needs.
"""

from __future__ import annotations

import math
from typing import Any

from saltus import System, bifurcation_diagram, response_spectrum
from saltus.theory import critical_horizontal, equivalent_angle, static_angle
from saltus_paper.figure_data import named, with_groups
from saltus_paper.figures.closed_layer import closed_layer
from saltus_paper.figures.figure import LivingPage
from saltus_paper.figures.harmonic_loads import (
    AMPLITUDE,
    BETA0,
    FREQUENCY,
    GROUND_AMPLITUDE,
    VERTICAL,
)
from saltus_paper.figures.knots_and_jumps import jumps, knots

# The window of the states from which motions are searched: few starts nearer to rest lead to large
# motions.
WINDOW = ((-4.0, 4.0), (-4.0, 4.0))


def spectrum(system: System, bounds: tuple[float, float], **options: Any) -> Any:
    """The response spectrum of a system over its frequency, in units of theta_st or theta_eq, with
    knots and jumps.
    """
    tree = _panel(
        response_spectrum(system, FREQUENCY, bounds, **({"window": WINDOW} | options)),
        scale=static_scale(system),
    )
    return with_groups(tree, {"knots": knots(tree), "jumps": jumps(tree)})


def diagram(system: System, bounds: tuple[float, float], swing: float = 0.0, **options: Any) -> Any:
    """The bifurcation diagram of a system over the amplitude of the horizontal load, in radians;
    `swing` is Vhat.
    """
    return _panel(
        bifurcation_diagram(system, AMPLITUDE, bounds, **({"window": WINDOW} | options)),
        scale=1.0,
        swing=swing,
    )


def diagrams_page(data: Any, name: str, first: str = "a") -> LivingPage:
    """What a page needs for the spectra or diagrams of a figure: all of them, `first` in front, and
    a motion of its system.
    """
    panels = sorted(data.children, key=lambda panel: (panel != first, panel))
    diagrams = [named(data[panel], f"{name}{panel}") for panel in panels]
    return System.from_json(diagrams[0].attrs["system"]), diagrams, {"theta": 0.3, "periods": 40}


def static_scale(system: System) -> float:
    """theta_st under a horizontal force, theta_eq under a ground motion, rad."""
    beta0 = math.radians(BETA0)
    if GROUND_AMPLITUDE in system.parameters:
        return float(equivalent_angle(beta0, system.get(GROUND_AMPLITUDE)))
    return static_angle(beta0, system.get(AMPLITUDE), VERTICAL)


def _panel(tree: Any, scale: float, swing: float = 0.0) -> Any:
    """A study's tree with the reactions of its closed layer, and the scale of its rotations, in
    rad, and Hcr as attributes.
    """
    beta0 = math.radians(BETA0)
    tree.attrs = {
        **tree.attrs,
        "scale": scale,
        "critical": float(critical_horizontal(beta0, VERTICAL, swing)),
    }
    return with_groups(tree, {"closed_layer": closed_layer(tree)})
