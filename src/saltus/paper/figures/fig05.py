"""Fig. 5: phase portraits of conservative systems with a softer and with a stiffer lower layer."""

from __future__ import annotations

from typing import Any

import numpy as np

from saltus.paper.claims.claim import Claim, check, compare
from saltus.paper.figures.figure import PaperFigure
from saltus.paper.figures.portrait import BETA0, VERTICAL, circled, loop_area, portrait, system
from saltus.paper.provenance import TOLERANCE, tree
from saltus.plots import DOUBLE_COLUMN, draw_portrait, new_figure, panel_label, styled

STIFFNESS = {"a": 0.5, "b": 1.1}
AXES = {"a": ((-2.6, 3.8), (-1.75, 1.75)), "b": ((-2.45, 2.45), (-0.95, 0.95))}
STARTS: dict[str, list[tuple[float, float]]] = {
    "a": [(-0.13, 0.0), (-0.42, 0.0), (0.5, 0.0), (1.0, 0.0), (1.7, 0.0), (-0.72, 0.0), (-1.1, 0.0), (-2.05, 0.0)],
    "b": [(0.25, 0.0), (0.42, 0.0), (0.62, 0.0), (-0.68, 0.0), (-1.05, 0.0), (0.84, 0.0), (1.0, 0.0), (-2.1, 0.0), (-2.25, 0.0)],
}
DURATION = 40.0


def compute(samples: int = 1200) -> Any:
    """Both portraits; k = 1 for comparison of its separatrix."""
    groups = {name: portrait(system(stiffness=k), STARTS[name], DURATION, 4.0, samples) for name, k in STIFFNESS.items()}
    groups["symmetric"] = portrait(system(), [(0.3, 0.0)], 1.0, 4.0, 10)
    return tree(groups, what="phase portraits of non-symmetric conservative systems, V = -1.5 / sin(beta0)", tol=TOLERANCE)


@styled
def draw(data: Any) -> Any:
    """Two panels with axes of their own."""
    figure = new_figure(DOUBLE_COLUMN, 84.0)
    axes = figure.subplots(1, 2)
    for ax, name in zip(axes, "ab", strict=True):
        draw_portrait(ax, data[name], *AXES[name])
        panel_label(ax, name)
        ax.set_ylabel(r"$\dot\theta$")
    return figure


def claims(data: Any) -> list[Claim]:
    """theta_I (erratum 9), the separatrix regions, and the motion round two equilibria."""
    found = {name: _summary(data[name]) for name in ("a", "b", "symmetric")}
    (soft, _, soft_area), (stiff, _, stiff_area), (_, _, area) = (found[n] for n in ("a", "b", "symmetric"))
    misprint, wrong = 1.384, data["a"]["wrong_reaction"].values
    stiffness = VERTICAL * float(np.cos(BETA0 + misprint)) / misprint
    rest = np.array(circled(data["a"])[1]), np.array(circled(data["b"])[2])
    return [
        compare(
            "fig05a-theta-i",
            "section 5.2",
            "θ_I for k = 0.5",
            printed="2.405",
            value=soft,
            unit="rad",
            evidence="root of P'(θ) = 0; it lies beyond the straight line",
        ),
        compare(
            "fig05b-theta-i",
            "section 5.2",
            "θ_I for k = 1.1",
            printed="1.384",
            corrected="1.13346",
            erratum=9,
            value=stiff,
            unit="rad",
            evidence=f"root of P'(θ) = 0; at θ = {misprint} the moments balance for k = V cos(β₀ + θ)/θ = {stiffness:.4f}",
        ),
        check(
            "fig05a-region",
            "Fig. 5a",
            "A softer lower layer widens the region of the separatrix around θ_I",
            printed=soft_area > area,
            evidence=f"area inside {soft_area:.4f} for k = 0.5, {area:.4f} for k = 1",
        ),
        check(
            "fig05b-region",
            "Fig. 5b",
            "A stiffer lower layer shrinks it",
            printed=stiff_area < area,
            evidence=f"area inside {stiff_area:.4f} for k = 1.1",
        ),
        check(
            "fig05a-two",
            "Fig. 5a",
            "For k < 1 there are periodic motions round θ = 0 and θ_I only",
            printed=len(rest[0]) == 2 and 0.0 in rest[0] and bool((rest[0] >= 0).all()),
            evidence=f"the motion from θ = {STARTS['a'][1][0]} goes round {rest[0].round(4).tolist()}",
        ),
        check(
            "fig05b-two",
            "Fig. 5b",
            "For k > 1 there are periodic motions round θ = 0 and θ_II only",
            printed=len(rest[1]) == 2 and 0.0 in rest[1] and bool((rest[1] <= 0).all()),
            evidence=f"the motion from θ = {STARTS['b'][2][0]} goes round {rest[1].round(4).tolist()}",
        ),
        check(
            "fig05a-one-layer",
            "Fig. 5a",
            "In these motions one layer stays closed while the other is open",
            printed=bool(wrong.max() == 0),
            corrected=bool(wrong.max() > 0),
            erratum=21,
            evidence=f"share of the time in which the closed layer's reaction has the wrong sign: {wrong.round(3).tolist()}",
        ),
        check(
            "fig05a-limit",
            "line_cond",
            "Rotations have no limit but the energy",
            printed=bool(np.nanmax(data["a"]["manifold_theta"].values) < float(data["a"]["kinematic_limit"])),
            corrected=bool(np.nanmax(data["a"]["manifold_theta"].values) > float(data["a"]["kinematic_limit"])),
            erratum=20,
            evidence="for k = 0.5 the outer separatrix reaches θ = "
            f"{np.nanmax(data['a']['manifold_theta'].values):.4f} rad, past the "
            f"kinematic limit {float(data['a']['kinematic_limit']):.4f} rad, where the slider has closed again; the motion from "
            f"θ = {STARTS['a'][-1][0]} spends {float(data['a']['beyond_limit'][-1]):.1%} of its time there",
        ),
    ]


def _summary(panel: Any) -> tuple[float, float, float]:
    """theta_I, theta_II and the area of the separatrix round theta_I."""
    points, stable = panel["equilibrium"].values, panel["stable"].values.astype(bool)
    saddle = points[~stable][-1]
    return float(points[stable][-1]), float(points[stable][0]), loop_area(panel, float(saddle))


FIGURE = PaperFigure(
    name="fig05",
    title="Fig. 5: phase portraits of non-symmetric conservative systems",
    caption=(
        "As Fig. 4a for unequal layers, without losses: (a) k = 0.5; (b) k = 1.1 (θ_I: erratum 9). Between the "
        "energies of the two saddles motions go round two equilibria. Green: straight line (100°) and kinematic limit "
        "(200°, erratum 20), beyond which the equation still has solutions but the mechanism has no positions."
    ),
    compute=compute,
    draw=draw,
    claims=claims,
)
