"""Fig. 1c: motions of the damped tristable metainterface in the space of rotation, angular velocity and total energy."""

from __future__ import annotations

from typing import Any

import numpy as np

from saltus.paper.claims.claim import Claim, check
from saltus.paper.figures.figure import PaperFigure
from saltus.paper.figures.portrait import circled, portrait, system
from saltus.paper.provenance import TOLERANCE, tree
from saltus.plots import SINGLE_COLUMN, draw_space, new_figure, styled

STARTS = [(2.3, 0.0), (-2.38, 0.0), (2.5, 0.0)]
DURATION = 70.0


def compute(samples: int = 1600) -> Any:
    """The data of Fig. 4c (k = 1, m = 0, C = 0.1, e = 1) from three starts, one for each attractor; energies; potential."""
    from saltus.theory import potential_energy

    damped = system(damping=0.1)
    data = portrait(damped, STARTS, DURATION, 2.6, samples)
    theta = np.linspace(-2.5, 2.5, 251)
    data = data.assign_coords(potential_theta=("potential_point", theta, {"units": "rad"}))
    data["potential"] = ("potential_point", potential_energy(damped, theta), {"units": "K2", "long_name": "potential energy"})
    return tree({"space": data}, what="motions in the space theta, theta', energy", tol=TOLERANCE)


@styled
def draw(data: Any) -> Any:
    """One view of the space, with the plane of discontinuity."""
    figure = new_figure(SINGLE_COLUMN, 78.0, layout=None)
    ax = figure.add_axes((-0.08, 0.0, 0.98, 1.08), projection="3d")
    draw_space(ax, data["space"])
    return figure


def claims(data: Any) -> list[Claim]:
    """The three attractors, the falling energy, the corner at the plane theta = 0."""
    space = data["space"]
    stable = space["equilibrium"].values[space["stable"].values.astype(bool)]
    ends = space["end"].values
    reached = {int(np.argmin(abs(stable - end))) for end in ends}
    energy = space["energy"].values
    rise = float(max(np.nanmax(np.diff(e[np.isfinite(e)])) for e in energy))
    return [
        check(
            "fig01c-attractors",
            "Fig. 1c",
            "The nonconservative metainterface is tristable: its motions end at one of three attractors",
            printed=len(reached) == 3 and bool(max(min(abs(stable - end)) for end in ends) < 0.1),
            evidence=f"from θ = {[s[0] for s in STARTS]} at rest the motions end at θ = {ends.round(3).tolist()} "
            f"(τ = {DURATION:g}); "
            f"they circle {[len(c) for c in circled(space)]} attractors",
        ),
        check(
            "fig01c-energy",
            "Fig. 1c",
            "Viscous damping takes energy all the time",
            printed=bool(rise < 1e-13),
            evidence=f"largest rise of energy between samples {rise:.1e}, total loss {np.nanmax(energy) - np.nanmin(energy):.4f}",
        ),
    ]


FIGURE = PaperFigure(
    name="fig01c",
    title="Fig. 1c: motions in the space of rotation, velocity and energy",
    caption=(
        "Motions of the tristable metainterface under a constant vertical load (data of Fig. 4c: k = 1, m = 0, V "
        "= −1.5/sin β₀, C = 0.1, "
        "e = 1) in the space of rotation, angular velocity and total energy, from three starts (diamonds) to the "
        "three attractors (dots). "
        "Grey plane: the discontinuity θ = 0. Thin black: the potential energy, at θ' = 0."
    ),
    compute=compute,
    draw=draw,
    claims=claims,
)
