"""Motions in the space of rotation, angular velocity and total energy."""

from __future__ import annotations

from typing import Any

import numpy as np

from saltus.plots.conventions import DASHES, INK, STABLE, shades


def draw_space(ax: Any, data: Any) -> None:
    """Trajectories with their starts and attractors, the plane theta = 0, and the potential energy in the plane theta' = 0."""
    reach = 1.05 * float(np.nanmax(abs(data["velocity"].values)))
    top = 1.08 * float(np.nanmax(data["energy"].values))
    floor = min(0.0, float(data["potential"].min())) - 0.02
    _plane(ax, reach, floor, top)
    order = (0, 1, 2)
    for i, colour in zip(order, shades(len(order), 0.0, 0.7), strict=False):
        theta, velocity, energy = (data[name][i].values for name in ("theta", "velocity", "energy"))
        ax.plot(theta, velocity, energy, color=colour, ls=DASHES[0], lw=0.8, zorder=5 + i)
        ax.plot(theta[:1], velocity[:1], energy[:1], color=colour, marker="D", ms=3.5, zorder=9)
    potential = data["potential"].values
    ax.plot(data["potential_theta"].values, 0 * potential, potential, color=INK, lw=0.6, zorder=4)
    stable = data["stable"].values.astype(bool)
    points, levels = data["equilibrium"].values[stable], data["equilibrium_energy"].values[stable]
    ax.plot(points, 0 * points, levels, color=STABLE, ls="none", marker="o", ms=5, zorder=10)
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
    ax.plot_surface(0 * velocity, velocity, energy, color="#9a9a9a", alpha=0.28, shade=False, zorder=1, linewidth=0)
