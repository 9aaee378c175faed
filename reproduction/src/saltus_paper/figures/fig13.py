"""Fig.

13: bifurcation diagram under load (iii), harmonic horizontal and vertical forces, which is not
symmetric.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from saltus import simulate
from saltus.plots import (
    LOOK,
    draw_response,
    highest,
    lowest,
    new_figure,
    note_missed,
    panel_label,
    response_legend,
    styled,
)
from saltus.theory import critical_horizontal
from saltus_paper.claims.claim import Measured
from saltus_paper.figure_data import TOLERANCE, dataset, joined, with_groups
from saltus_paper.figures.disturbed_rest import largest_disturbance
from saltus_paper.figures.figure import paper_figure
from saltus_paper.figures.harmonic_loads import (
    BETA0,
    DAMPING,
    SWING,
    VERTICAL,
    on_ground,
    under_both,
    under_force,
)
from saltus_paper.figures.load_diagrams import LEAST, frame, undeformed
from saltus_paper.figures.response_panels import diagram
from saltus_paper.figures.zooms import draw_beside
from saltus_paper.measures.response_measures import border_of_rest, both_diagram
from saltus_paper.measures.validity_measures import validity

LARGEST = 3.0  # Hhat
ZOOMED = 0.15  # Hhat
BESIDE = 0.03  # relative distance from Hcr at which theta = 0 is disturbed
# of the motions that are compared with their mirror images: state, forcing periods
START = (0.4, 0.3)
SHOWN = 5


def compute(**options: Any) -> Any:
    """The diagram, and how far each load is from symmetric; options are those of
    `bifurcation_diagram`.
    """
    tree = diagram(under_both(), (LEAST, LARGEST), SWING, **options)
    rest = undeformed(under_both(), tree.attrs["critical"])
    panel = joined({"a": tree}, what="bifurcation diagram under load (iii)")
    return with_groups(
        panel,
        {
            "mirror": _mirror_images(),
            "undeformed": rest,
            "disturbed": _disturbed(tree.attrs["critical"]),
        },
    )


def _disturbed(critical: float) -> Any:
    """How far the slightly disturbed theta = 0 moves in a period on both sides of Hcr, and below
    the printed Hcr (errata 35).
    """
    beta0 = math.radians(BETA0)
    printed = float(critical_horizontal(beta0, VERTICAL))
    amplitudes = np.array(
        [(1 - BESIDE) * critical, (1 + BESIDE) * critical, (1 - BESIDE) * printed]
    )
    moved = np.array(
        [
            largest_disturbance(beta0, DAMPING, VERTICAL, SWING, float(amplitude))
            for amplitude in amplitudes
        ]
    )
    return dataset(
        {
            "amplitude": ("case", amplitudes, "1", "Hhat"),
            "moved": ("case", moved, "rad", "max abs(theta) in a period"),
        },
        what="a disturbance of theta = 0 under load (iii), by DOP853",
        printed=printed,
    )


def _mirror_images() -> Any:
    """The distance of a motion from the mirror image of another one, which starts from the mirrored
    state half a period later.
    """
    systems = {
        "(i)": under_force(amplitude=0.3),
        "(ii)": on_ground(amplitude=0.3),
        "(iii)": under_both(amplitude=0.3),
    }
    gaps = np.array([_gap(system) for system in systems.values()])
    return dataset(
        {
            "load": ("case", np.array(list(systems))),
            "gap": ("case", gaps, "1", "of the states after some periods"),
        },
        what="symmetry of the response under loads (i) to (iii)",
    )


def _gap(system: Any) -> float:
    theta, velocity = START
    one = simulate(system, theta=theta, velocity=velocity, periods=SHOWN, tol=TOLERANCE)
    two = simulate(
        system,
        theta=-theta,
        velocity=-velocity,
        time=0.5 * system.load.period,
        periods=SHOWN,
        tol=TOLERANCE,
    )
    return float(max(abs(one.theta + two.theta), abs(one.velocity + two.velocity)))


@styled
def draw(data: Any) -> Any:
    """(a) the largest and (b) the least rotation of every motion; beside each the details near
    rest.
    """
    tree = data["a"]
    _, high = tree.attrs["bounds"]
    figure = new_figure(LOOK.double_column, 150.0)
    axes = figure.subplots(2, 2, sharex="col", width_ratios=[2.6, 1])
    for (ax, beside), (label, quantity) in zip(
        axes, (("a", "highest"), ("b", "lowest")), strict=True
    ):
        ax.set_xlim(0.0, high)
        ax.set_ylim(*_range(tree, high, quantity))
        frame(ax, tree, mirrored=True)
        ax.axhline(0.0, color=LOOK.faint, linewidth=0.6, zorder=1)
        draw_response(ax, tree, quantity)
        draw_beside(beside, ax, tree, (0.0, ZOOMED, *_range(tree, ZOOMED, quantity)), quantity)
        frame(beside, tree)
        panel_label(ax, label)
    note_missed(axes[0, 0], tree)
    axes[0, 1].set_title("near rest", pad=4)
    for ax in axes[0]:
        ax.set_xlabel("")
    axes[0, 0].set_ylabel(r"$\max_\tau\,\theta$ (rad)")
    axes[1, 0].set_ylabel(r"$\min_\tau\,\theta$ (rad)")
    response_legend(figure, [tree], critical=True)
    return figure


def _range(tree: Any, high: float, quantity: str) -> tuple[float, float]:
    """From the least to the largest value of a quantity up to a value of the parameter, with room
    beside, and 0.
    """
    return 1.08 * min(lowest(tree, 0.0, high, quantity), 0.0), 1.08 * max(
        highest(tree, 0.0, high, quantity), 0.0
    )


def measure(data: Any) -> dict[str, Measured]:
    """The loss of symmetry, and the other statements of the text."""
    found = {**both_diagram(data["a"], data["mirror"]), "fig13-critical": border_of_rest(data)}
    return {**found, "fig13-validity": validity("Fig. 13", {"a": data["a"]})}


FIGURE = paper_figure(
    "fig13", quick={"effort": "quick"}, compute=compute, draw=draw, measure=measure
)
