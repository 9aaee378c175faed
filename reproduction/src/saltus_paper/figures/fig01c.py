"""Fig. 1c: motions of the damped tristable metainterface in the space of rotation, angular velocity and total energy."""

from __future__ import annotations

from typing import Any

import numpy as np

from saltus.plots import SINGLE_COLUMN, draw_space, new_figure, styled
from saltus.theory import potential_energy
from saltus_paper.claims.claim import Measured, measured
from saltus_paper.figure_data import TOLERANCE, tree
from saltus_paper.figures.figure import paper_figure
from saltus_paper.figures.phase_portraits import circled, constant_load, portrait

STARTS = [(2.3, 0.0), (-2.38, 0.0), (2.5, 0.0)]
MOTION_DURATION = 70.0


def compute(samples: int = 1600) -> Any:
    """The data of Fig. 4c (k = 1, m = 0, C = 0.1, e = 1) from three starts, one for each attractor; energies; potential."""
    damped = constant_load(damping=0.1)
    data = portrait(damped, STARTS, MOTION_DURATION, 2.6, samples)
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


def measure(data: Any) -> dict[str, Measured]:
    """The three attractors, the falling energy, the corner at the plane theta = 0."""
    space = data["space"]
    stable = space["equilibrium"].values[space["stable"].values.astype(bool)]
    ends = space["end"].values
    reached = {int(np.argmin(abs(stable - end))) for end in ends}
    energy = space["energy"].values
    rise = float(max(np.nanmax(np.diff(e[np.isfinite(e)])) for e in energy))
    return {
        "fig01c-attractors": measured(
            len(reached) == 3 and bool(max(min(abs(stable - end)) for end in ends) < 0.1),
            starts=[s[0] for s in STARTS],
            ends=ends.round(3).tolist(),
            duration=MOTION_DURATION,
            circled=[len(c) for c in circled(space)],
        ),
        "fig01c-energy": measured(bool(rise < 1e-13), rise=rise, loss=np.nanmax(energy) - np.nanmin(energy)),
    }


FIGURE = paper_figure("fig01c", compute=compute, draw=draw, measure=measure)
