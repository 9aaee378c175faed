"""Fig. 13: bifurcation diagram under load (iii), harmonic horizontal and vertical forces, which is not symmetric."""

from __future__ import annotations

from typing import Any

import numpy as np

from saltus.flow import simulate
from saltus.paper.claims.claim import Measured
from saltus.paper.figure_data import TOLERANCE, dataset, joined, with_groups
from saltus.paper.figures.figure import paper_figure
from saltus.paper.figures.harmonic_loads import on_ground, under_both, under_force
from saltus.paper.figures.load_diagrams import LEAST, frame
from saltus.paper.figures.response_panels import diagram
from saltus.paper.measures.response_measures import both_diagram
from saltus.paper.measures.validity_measures import validity
from saltus.plots import DOUBLE_COLUMN, FAINT, draw_response, highest, lowest, new_figure, response_legend, styled

LARGEST = 3.0  # Hhat
START, SHOWN = (0.4, 0.3), 5  # of the motions that are compared with their mirror images: state, forcing periods


def compute(**options: Any) -> Any:
    """The diagram, and how far each load is from symmetric; options are those of `bifurcation_diagram`."""
    tree = diagram(under_both(), (LEAST, LARGEST), **options)
    return with_groups(joined({"a": tree}, what="bifurcation diagram under load (iii)"), {"mirror": _mirror_images()})


def _mirror_images() -> Any:
    """The distance of a motion from the mirror image of the one that starts mirrored half a period later."""
    systems = {
        "(i)": under_force(amplitude=0.3),
        "(ii)": on_ground(amplitude=0.3),
        "(iii)": under_both(amplitude=0.3),
    }
    gaps = np.array([_gap(system) for system in systems.values()])
    return dataset(
        {"load": ("case", np.array(list(systems))), "gap": ("case", gaps, "1", "of the states after some periods")},
        what="symmetry of the response under loads (i) to (iii)",
    )


def _gap(system: Any) -> float:
    theta, velocity = START
    one = simulate(system, theta=theta, velocity=velocity, periods=SHOWN, tol=TOLERANCE)
    two = simulate(system, theta=-theta, velocity=-velocity, time=0.5 * system.load.period, periods=SHOWN, tol=TOLERANCE)
    return float(max(abs(one.theta + two.theta), abs(one.velocity + two.velocity)))


@styled
def draw(data: Any) -> Any:
    """Largest and least rotation of every motion, one above the other."""
    tree = data["a"]
    _, high = tree.attrs["bounds"]
    figure = new_figure(DOUBLE_COLUMN, 130.0)
    axes = figure.subplots(2, 1, sharex=True)
    for ax, quantity in zip(axes, ("highest", "lowest"), strict=True):
        ax.set_xlim(0.0, high)
        low, top = lowest(tree, 0.0, high, quantity), highest(tree, 0.0, high, quantity)
        ax.set_ylim(1.08 * min(low, 0.0), 1.08 * max(top, 0.0))
        frame(ax, tree, mirrored=True)
        ax.axhline(0.0, color=FAINT, linewidth=0.6, zorder=1)
        draw_response(ax, tree, quantity)
    axes[0].set_xlabel("")
    axes[0].set_ylabel(r"$\max_\tau\,\theta$ (rad)")
    axes[1].set_ylabel(r"$\min_\tau\,\theta$ (rad)")
    response_legend(figure, [tree], critical=True)
    return figure


def measure(data: Any) -> dict[str, Measured]:
    """The loss of symmetry, and what else the text says."""
    return {**both_diagram(data["a"], data["mirror"]), "fig13-validity": validity("Fig. 13", {"a": data["a"]})}


FIGURE = paper_figure("fig13", compute=compute, draw=draw, measure=measure)
