"""Fig.

1c: motions of the damped tristable metainterface in the space of rotation, angular velocity and
total energy.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from saltus.plots import LOOK, new_figure, shades, styled
from saltus.theory import potential_energy
from saltus_paper.claims.claim import Measured, measured
from saltus_paper.figure_data import TOLERANCE, tree
from saltus_paper.figures.figure import paper_figure
from saltus_paper.figures.phase_portraits import circled, constant_load, portrait

STARTS = [(2.3, 0.0), (-2.38, 0.0), (2.5, 0.0)]
MOTION_DURATION = 70.0


def compute(samples: int = 1600) -> Any:
    """The data of Fig.

    4c (k = 1, m = 0, C = 0.1, e = 1) from three starts, one for each attractor; energies;
    potential.
    """
    damped = constant_load(damping=0.1)
    data = portrait(damped, STARTS, MOTION_DURATION, 2.6, samples)
    theta = np.linspace(-2.5, 2.5, 251)
    data = data.assign_coords(potential_theta=("potential_point", theta, {"units": "rad"}))
    data["potential"] = (
        "potential_point",
        potential_energy(damped, theta),
        {"units": "K2", "long_name": "potential energy"},
    )
    return tree({"space": data}, what="motions in the space theta, theta', energy", tol=TOLERANCE)


@styled
def draw(data: Any) -> Any:
    """One view of the space, with the plane of discontinuity."""
    figure = new_figure(LOOK.single_column, 78.0, layout=None)
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
        "fig01c-energy": measured(
            bool(rise < 1e-13), rise=rise, loss=np.nanmax(energy) - np.nanmin(energy)
        ),
    }


def draw_space(ax: Any, data: Any) -> None:
    """Trajectories with their starts and attractors, the plane theta = 0, and the potential energy
    in the plane theta' = 0.
    """
    reach = 1.05 * float(np.nanmax(abs(data["velocity"].values)))
    top = 1.08 * float(np.nanmax(data["energy"].values))
    floor = min(0.0, float(data["potential"].min())) - 0.02
    _plane(ax, reach, floor, top)
    order = (0, 1, 2)
    for i, colour in zip(order, shades(len(order), 0.0, 0.7), strict=False):
        theta, velocity, energy = (data[name][i].values for name in ("theta", "velocity", "energy"))
        ax.plot(theta, velocity, energy, color=colour, ls=LOOK.dashes[0], lw=0.8, zorder=5 + i)
        ax.plot(theta[:1], velocity[:1], energy[:1], color=colour, marker="D", ms=3.5, zorder=9)
    potential = data["potential"].values
    ax.plot(
        data["potential_theta"].values, 0 * potential, potential, color=LOOK.ink, lw=0.6, zorder=4
    )
    stable = data["stable"].values.astype(bool)
    points = data["equilibrium"].values[stable]
    levels = data["equilibrium_energy"].values[stable]
    ax.plot(points, 0 * points, levels, color=LOOK.stable, ls="none", marker="o", ms=5, zorder=10)
    ax.set(xlim=(-2.6, 2.6), ylim=(-reach, reach), zlim=(floor, top))
    ax.set_xlabel(r"$\theta$ (rad)", labelpad=-1)
    ax.set_ylabel(r"$\dot\theta$", labelpad=1)
    ax.set_zlabel(r"energy$\,/K_2$", labelpad=-3)
    ax.tick_params(pad=-1)
    ax.set_yticks([-1, -0.5, 0, 0.5, 1])
    ax.view_init(elev=24, azim=-58)
    ax.set_box_aspect((1.25, 1.1, 0.9), zoom=0.95)
    for axis in (ax.xaxis, ax.yaxis, ax.zaxis):
        axis.pane.set_facecolor("white")
        axis.pane.set_edgecolor("#cccccc")
        axis._axinfo["grid"].update(color="#e4e4e4", linewidth=0.4)


def _plane(ax: Any, reach: float, floor: float, top: float) -> None:
    """theta = 0, transparent grey."""
    velocity, energy = np.meshgrid([-reach, reach], [floor, top])
    ax.plot_surface(
        0 * velocity,
        velocity,
        energy,
        color="#9a9a9a",
        alpha=0.28,
        shade=False,
        zorder=1,
        linewidth=0,
    )


FIGURE = paper_figure("fig01c", compute=compute, draw=draw, measure=measure)
