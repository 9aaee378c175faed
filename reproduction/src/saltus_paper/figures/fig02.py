"""Fig.

2: the unit cell, undeformed and deformed, and the claims of the kinematics (section "Mechanical
model").
"""

from __future__ import annotations

from typing import Any

import numpy as np

from saltus import UnitCell
from saltus.plots import (
    LOOK,
    draw_cell,
    new_figure,
    panel_label,
    styled,
)
from saltus_paper.figure_data import dataset, tree
from saltus_paper.figures.figure import paper_figure

STATES = {"undeformed": (0.0, 0.0), "deformed": (12.0, -8.0)}  # theta_1, theta_2 in degrees


def compute(alpha0: float = 38.0, beta0: float = 75.0) -> Any:
    """Positions of every point and the angles of both layers in both states; `alpha0` and `beta0`
    in degrees.
    """
    cell = UnitCell(alpha0=np.deg2rad(alpha0), beta0=np.deg2rad(beta0))
    groups = {name: _state(cell, *np.deg2rad(angles)) for name, angles in STATES.items()}
    return tree(
        groups,
        what="the two-layer unit cell undeformed and deformed",
        alpha0_degrees=alpha0,
        beta0_degrees=beta0,
    )


def _state(cell: Any, theta_1: float, theta_2: float) -> Any:
    signs = (1, -1)  # of phi_1 and phi_2: either is possible, and these keep the picture clear
    layout = cell.layout(theta_1, theta_2, misaligned=signs)
    theta = np.array([theta_1, theta_2])
    points = layout.points
    angles = {
        "alpha": (
            "layer",
            cell.alpha(theta),
            "rad",
            "angle between the base and the line joining the diagonal's ends",
        ),
        "beta": ("layer", cell.beta(theta), "rad", "angle between the base and the inclined bar"),
        "phi": ("layer", signs * cell.phi(theta), "rad", "misalignment at the slider"),
        "theta": ("layer", theta, "rad", "difference angle"),
    }
    return dataset(
        {
            "position": (
                ("point", "axis"),
                np.array(list(points.values())),
                "l",
                "place in the frame of the base",
            ),
            "bar": (("bar", "end"), np.array(layout.bars), "1", "the two ends of each bar"),
            "slider": (
                ("slider_number", "end"),
                np.array(layout.sliders),
                "1",
                "the two faces of each slider",
            ),
            "spring": (
                ("hinge",),
                np.array(list(layout.springs.values())),
                "1",
                "the visco-elastic hinges A and B",
            ),
            **angles,
        },
        {
            "point": ("point", list(points)),
            "axis": ("axis", ["x", "y"]),
            "layer": ("layer", [1, 2]),
        },
        what="one state of the unit cell",
    )


@styled
def draw(data: Any) -> Any:
    """Both states side by side, at one scale."""
    figure = new_figure(LOOK.double_column, 92.0)
    left, right = figure.subplots(1, 2)
    draw_cell(left, data["undeformed"].to_dataset(), "undeformed")
    draw_cell(right, data["deformed"].to_dataset(), "deformed")
    for ax, label in ((left, "a"), (right, "b")):
        ax.set_xlim(-1.0, 2.4)
        ax.set_ylim(-0.72, 2.5)
        panel_label(ax, label)
    return figure


FIGURE = paper_figure("fig02", compute=compute, draw=draw)
