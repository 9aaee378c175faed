"""Fig. 5: phase portraits of conservative systems with a softer and with a stiffer lower layer."""

from __future__ import annotations

from typing import Any

import numpy as np

from saltus.plots import LOOK, new_figure, panel_label, styled
from saltus_paper.claims.claim import Measured, measured
from saltus_paper.figure_data import TOLERANCE, tree
from saltus_paper.figures.figure import paper_figure
from saltus_paper.figures.phase_portraits import (
    BETA0,
    VERTICAL,
    circled,
    constant_load,
    draw_portrait,
    loop_area,
    outward,
    portrait,
)

STIFFNESS = {"a": 0.5, "b": 1.1}
AXES = {"a": ((-2.6, 3.8), (-1.75, 1.75)), "b": ((-2.45, 2.45), (-0.95, 0.95))}
STARTS: dict[str, list[tuple[float, float]]] = {
    "a": [
        (-0.13, 0.0),
        (-0.42, 0.0),
        (0.5, 0.0),
        (1.0, 0.0),
        (1.7, 0.0),
        (-0.72, 0.0),
        (-1.1, 0.0),
        (-2.05, 0.0),
    ],
    "b": [
        (0.25, 0.0),
        (0.42, 0.0),
        (0.62, 0.0),
        (-0.68, 0.0),
        (-1.05, 0.0),
        (0.84, 0.0),
        (1.0, 0.0),
        (-2.1, 0.0),
        (-2.25, 0.0),
    ],
}
MOTION_DURATION = 40.0


def compute(samples: int = 1200) -> Any:
    """Both portraits, and one with k = 1 to compare its separatrix."""
    groups = {
        name: portrait(constant_load(stiffness=k), STARTS[name], MOTION_DURATION, 4.0, samples)
        for name, k in STIFFNESS.items()
    }
    groups["symmetric"] = portrait(constant_load(), [(0.3, 0.0)], 1.0, 4.0, 10)
    return tree(
        groups,
        what="phase portraits of non-symmetric conservative systems, V = -1.5 / sin(beta0)",
        tol=TOLERANCE,
    )


@styled
def draw(data: Any) -> Any:
    """Two panels with axes of their own."""
    figure = new_figure(LOOK.double_column, 84.0)
    axes = figure.subplots(1, 2)
    for ax, name in zip(axes, "ab", strict=True):
        draw_portrait(ax, data[name], *AXES[name])
        panel_label(ax, name)
        ax.set_ylabel(r"$\dot\theta$")
    return figure


def measure(data: Any) -> dict[str, Measured]:
    """theta_I (erratum 9), the separatrix regions, and the motion round two equilibria."""
    found = {name: _summary(data[name]) for name in ("a", "b", "symmetric")}
    (soft, _, soft_area), (stiff, _, stiff_area), (_, _, area) = (
        found[n] for n in ("a", "b", "symmetric")
    )
    largest = float(np.nanmax(data["a"]["separatrix_theta"].values))
    limit = float(data["a"]["kinematic_limit"])
    misprint = 1.384
    wrong = data["a"]["wrong_reaction"].values
    stiffness = VERTICAL * float(np.cos(BETA0 + misprint)) / misprint
    shifts = {
        side: max(_loop_shift(data[n], data["symmetric"], side) for n in "ab") for side in (1, -1)
    }
    rest = np.array(circled(data["a"])[1]), np.array(circled(data["b"])[2])
    return {
        "fig05a-theta-i": measured(soft),
        "fig05b-theta-i": measured(stiff, misprint=misprint, stiffness=stiffness),
        "fig05a-region": measured(soft_area > area, soft_area=soft_area, area=area),
        "fig05b-region": measured(stiff_area < area, stiff_area=stiff_area),
        "fig05-upper": measured(shifts[-1], lower_shift=shifts[1]),
        "fig05a-two": measured(
            len(rest[0]) == 2 and 0.0 in rest[0] and bool((rest[0] >= 0).all()),
            start=STARTS["a"][1][0],
            circled=rest[0].round(4).tolist(),
        ),
        "fig05b-two": measured(
            len(rest[1]) == 2 and 0.0 in rest[1] and bool((rest[1] <= 0).all()),
            start=STARTS["b"][2][0],
            circled=rest[1].round(4).tolist(),
        ),
        "fig05a-one-layer": measured(bool(wrong.max() > 0), shares=wrong.round(3).tolist()),
        "fig05a-limit": measured(
            largest < limit,
            largest > limit,
            largest=largest,
            kinematic_limit=limit,
            start=STARTS["a"][-1][0],
            share=float(data["a"]["beyond_limit"][-1]),
        ),
    }


def _loop_shift(panel: Any, other: Any, side: int) -> float:
    """The largest distance between the separatrices round the deformed equilibria on a side, or
    between these equilibria.
    """
    ends = [float((side * p["equilibrium"]).max()) for p in (panel, other)]
    loops = [next(curve for curve in outward(p) if side * curve[0, 0] > 0) for p in (panel, other)]
    count = min(len(loop) for loop in loops)
    return max(abs(ends[0] - ends[1]), float(np.abs(loops[0][:count] - loops[1][:count]).max()))


def _summary(panel: Any) -> tuple[float, float, float]:
    """theta_I, theta_II and the area of the separatrix round theta_I."""
    points = panel["equilibrium"].values
    stable = panel["stable"].values.astype(bool)
    saddle = points[~stable][-1]
    return float(points[stable][-1]), float(points[stable][0]), loop_area(panel, float(saddle))


FIGURE = paper_figure("fig05", compute=compute, draw=draw, measure=measure)
