"""Phase portraits of the paper: trajectories with arrows, separatrices, fixed points and the limits of the mechanism."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from saltus.plots.conventions import FAINT, SEPARATRIX_LINE, STABLE
from saltus.plots.marks import fixed_points, limit_lines
from saltus.plots.phase_lines import draw_arrows


@dataclass(frozen=True)
class PortraitSettings:
    """Which part of a trajectory is drawn."""

    core: float = 0.032  # Motions this close in energy to theta = 0 are left out: their many lines would merge to a black area.
    eye: float = 0.0012  # This distance at a deformed equilibrium, around which motions spiral.
    away: float = 0.03  # The distance, in window widths, at which a trajectory has left its start.
    back: float = 0.004  # The distance, in window widths, at which it has come back to its start.


PORTRAIT = PortraitSettings()


def draw_portrait(ax: Any, data: Any, xlim: tuple[float, float], ylim: tuple[float, float], spacing: float = 0.8) -> None:
    """One panel from a portrait of the paper; arrows come about every `spacing` panel widths along a trajectory."""
    ax.set_xlim(*xlim)
    ax.set_ylim(*ylim)
    ax.axvline(0.0, color=FAINT, lw=1.2, zorder=0)
    ax.axhline(0.0, color=FAINT, lw=0.4, zorder=0)
    for name in ("line_limit", "kinematic_limit"):
        limit_lines(ax, float(data[name]), rf"${np.rad2deg(float(data[name])):.0f}^\circ$")
    borders = data.isel(separatrix=data["separates"].values.astype(bool))
    for theta, velocity in zip(borders["separatrix_theta"].values, borders["separatrix_velocity"].values, strict=True):
        ax.plot(theta, velocity, zorder=3, **SEPARATRIX_LINE)
    for theta, velocity, hide in zip(data["theta"].values, data["velocity"].values, _hidden(data), strict=True):
        shown = np.where(hide, np.nan, velocity)
        ax.plot(theta, shown, color=STABLE, lw=0.7, zorder=2)
        draw_arrows(ax, theta, shown, spacing, _first_return(theta / np.ptp(xlim), shown / np.ptp(ylim)))
    fixed_points(ax, data["equilibrium"].values, data["stable"].values)
    ax.set_xlabel(r"$\theta$ (rad)")


def _hidden(data: Any) -> np.ndarray:
    """The samples of decaying motions that have come closer to their attractor than `core` or `eye`."""
    points, stable = data["equilibrium"].values, data["stable"].values.astype(bool)
    theta, energy = data["theta"].values, data["energy"].values
    hidden = np.zeros(theta.shape, dtype=bool)
    for low, high in pairwise([-np.inf, *points[~stable], np.inf]):
        for i in np.flatnonzero(stable & (points > low) & (points < high)):
            floor = float(data["equilibrium_energy"][i]) + (PORTRAIT.eye if points[i] else PORTRAIT.core)
            hidden |= (theta > low) & (theta < high) & (energy < floor)
    decays = np.nanmax(energy, axis=1) - np.nanmin(energy, axis=1) > 1e-9
    return np.asarray(hidden & decays[:, None])


def _first_return(x: np.ndarray, y: np.ndarray) -> int:
    """The sample at which a closed trajectory, in units of the panel, is back at its start, or the last one."""
    known = np.flatnonzero(np.isfinite(x) & np.isfinite(y))
    distance = np.hypot(x[known] - x[0], y[known] - y[0])
    away = np.flatnonzero(distance > PORTRAIT.away)
    if away.size == 0:
        return 0
    back = np.flatnonzero(distance[away[0] :] < PORTRAIT.back)
    return int(known[away[0] + back[0]]) if back.size else int(known[-1])
