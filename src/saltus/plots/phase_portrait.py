"""Phase portraits: trajectories with arrows, separatrices, fixed points and the limits of the mechanism."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np

from saltus.plots.conventions import FAINT, SEPARATRIX_LINE, STABLE
from saltus.plots.marks import arrow_along, fixed_points, limit_lines

CORE = 0.032  # motions this close in energy to theta = 0 are left out: their impacts would fill it with ink
EYE = 0.0012  # the same at a deformed equilibrium, where they spiral


def draw_portrait(ax: Any, data: Any, xlim: tuple[float, float], ylim: tuple[float, float], spacing: float = 0.8) -> None:
    """One panel from a dataset of `portrait`; arrows come about every `spacing` panel widths along a trajectory."""
    ax.set_xlim(*xlim)
    ax.set_ylim(*ylim)
    ax.axvline(0.0, color=FAINT, lw=1.2, zorder=0)
    ax.axhline(0.0, color=FAINT, lw=0.4, zorder=0)
    for name in ("line_limit", "kinematic_limit"):
        limit_lines(ax, float(data[name]), rf"${np.rad2deg(float(data[name])):.0f}^\circ$")
    for theta, velocity, bounds in zip(
        data["separatrix_theta"].values, data["separatrix_velocity"].values, data["separates"].values, strict=True
    ):
        if bounds:
            ax.plot(theta, velocity, zorder=3, **SEPARATRIX_LINE)
    hidden = _hidden(data)
    for theta, velocity, hide in zip(data["theta"].values, data["velocity"].values, hidden, strict=True):
        shown = np.where(hide, np.nan, velocity)
        ax.plot(theta, shown, color=STABLE, lw=0.7, zorder=2)
        for at in _arrow_places(theta, shown, np.ptp(xlim), np.ptp(ylim), spacing):
            arrow_along(ax, theta, shown, at, STABLE)
    fixed_points(ax, data["equilibrium"].values, data["stable"].values)
    ax.set_xlabel(r"$\theta$ (rad)")


def _hidden(data: Any) -> np.ndarray:
    """The samples of decaying motions that have come closer to their attractor than CORE or EYE."""
    points, stable = data["equilibrium"].values, data["stable"].values.astype(bool)
    edges = np.concatenate([[-np.inf], points[~stable], [np.inf]])
    hidden = np.zeros(data["theta"].shape, dtype=bool)
    for low, high in pairwise(edges):
        for i in np.flatnonzero(stable & (points > low) & (points < high)):
            floor = float(data["equilibrium_energy"][i]) + (EYE if points[i] else CORE)
            theta = data["theta"].values
            hidden |= (theta > low) & (theta < high) & (data["energy"].values < floor)
    decays = np.nanmax(data["energy"].values, axis=1) - np.nanmin(data["energy"].values, axis=1) > 1e-9
    return hidden & decays[:, None]


def _arrow_places(theta: np.ndarray, velocity: np.ndarray, width: float, height: float, spacing: float) -> list[int]:
    """Samples about `spacing` apart in units of the panel, the first after a fraction of it; none on what is drawn over again."""
    steps = np.hypot(np.diff(theta) / width, np.diff(velocity) / height)
    travelled = np.concatenate([[0.0], np.cumsum(np.nan_to_num(steps))])
    drawn = _first_lap(theta, velocity, width, height)
    places = np.arange(0.12, travelled[drawn], spacing)
    return sorted({int(np.searchsorted(travelled, place)) for place in places})


def _first_lap(theta: np.ndarray, velocity: np.ndarray, width: float, height: float) -> int:
    """The sample at which a closed trajectory is back at its start, or the last one."""
    known = np.flatnonzero(np.isfinite(theta) & np.isfinite(velocity))
    distance = np.hypot((theta[known] - theta[0]) / width, (velocity[known] - velocity[0]) / height)
    away = np.flatnonzero(distance > 0.03)
    if away.size == 0:
        return 0
    back = np.flatnonzero(distance[away[0] :] < 0.004)
    return int(known[away[0] + back[0]]) if back.size else int(known[-1])
