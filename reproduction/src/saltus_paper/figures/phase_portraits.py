"""The phase portraits of Figs.

1c, 4 and 5: a portrait of `saltus.studies` with energies and measures of its motions.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from saltus import Load, Metainterface, System, VelocityReduction, phase_portrait, simulate
from saltus.plots import LOOK, draw_arrows, fixed_points, limit_lines
from saltus.theory import potential_energy, total_energy
from saltus_paper.figure_data import TOLERANCE, dataset

BETA0 = math.radians(80.0)
VERTICAL = -1.5 / math.sin(BETA0)  # the paper's -1.523
AT_SADDLE = 1e-3  # distance at which a separatrix has come back to a saddle


def constant_load(*, stiffness: float = 1.0, damping: float = 0.0, e: float = 1.0) -> System:
    """The metainterface of Figs. 1c, 4 and 5: beta0 = 80 deg, V = -1.5 / sin(beta0), m = 0."""
    model = Metainterface(beta0=BETA0, damping=damping, stiffness_ratio=stiffness)
    return System(model=model, load=Load(vertical=VERTICAL), impact=VelocityReduction(e))


def portrait(
    system: System,
    starts: Sequence[tuple[float, float]],
    duration: float,
    bound: float,
    samples: int = 900,
) -> Any:
    """Motions from `starts` (theta, theta') for `duration`, the separatrices up to abs(theta) =
    `bound`, and the equilibria.
    """
    motions = [
        simulate(system, theta=theta, velocity=velocity, duration=duration, tol=TOLERANCE)
        for theta, velocity in starts
    ]
    window = ((-bound, bound), (-bound, bound))
    plane = phase_portrait(system, window=window, starts=starts, duration=duration, samples=samples)
    energy = _energy(system, plane["theta"].values, plane["velocity"].values)
    levels = potential_energy(system, plane["equilibrium"].values)
    shares = {
        name: [float(motion.validity.share[name]) for motion in motions]
        for name in motions[0].validity.share
    }
    data = dataset(
        {
            "energy": (("motion", "sample"), energy, "K2", "kinetic and potential energy"),
            "end": ("motion", [motion.theta for motion in motions], "rad", "theta at the end"),
            "impacts": (
                "motion",
                [len(motion.impacts) for motion in motions],
                "1",
                "impacts in the time shown",
            ),
            "corner": (
                "motion",
                [_corner(motion) for motion in motions],
                "1",
                "jump of theta'' at the first impact upward",
            ),
            "wrong_reaction": (
                "motion",
                shares["reaction"],
                "1",
                "share of time in which the closed layer would open",
            ),
            "beyond_line": (
                "motion",
                shares["line_limit"],
                "1",
                "share of time beyond the straight line",
            ),
            "beyond_limit": (
                "motion",
                shares["kinematic_limit"],
                "1",
                "share of time beyond the kinematic limit",
            ),
            "equilibrium_energy": (
                "equilibrium",
                levels,
                "K2",
                "potential energy above the undeformed state",
            ),
            "line_limit": ((), math.pi - BETA0, "rad", "straight line"),
            "kinematic_limit": ((), 2 * (math.pi - BETA0), "rad", "the slider closes again"),
        },
        what="phase portrait",
        system=system,
        tol=TOLERANCE,
    )
    merged = _within(plane, bound).merge(data).assign(separates=_separates(plane, system))
    return merged.assign_attrs(plane.attrs | data.attrs)


def _within(plane: Any, bound: float) -> Any:
    """The portrait with separatrices that end where they first pass abs(theta) = `bound`, backward
    in time from their saddle.
    """
    beyond = np.cumsum(np.abs(np.nan_to_num(plane["separatrix_theta"].values)) > bound, axis=1) > 0
    kept = {
        name: plane[name].where(~beyond) for name in ("separatrix_theta", "separatrix_velocity")
    }
    return plane.assign(kept).dropna("point", how="all", subset=["separatrix_theta"])


def _separates(plane: Any, system: System) -> Any:
    """Whether motions on the two sides of each separatrix end differently: it is closed, or there
    is viscous damping.

    If energy is lost at impacts only, an open branch separates nothing: motions on both sides pass
    the saddle and end at theta = 0, one turn apart.
    """
    damped = float(system.get("model.damping")) > 0
    return (
        plane["separatrix_theta"]
        .isel(point=0, drop=True)
        .copy(data=closed(plane) | damped)
        .assign_attrs(units="1")
    )


def closed(plane: Any) -> np.ndarray:
    """Which separatrices come back to a saddle, (separatrix,)."""
    saddles = plane["equilibrium"].values[~plane["stable"].values.astype(bool)]
    found = []
    for theta, velocity in zip(
        plane["separatrix_theta"].values, plane["separatrix_velocity"].values, strict=True
    ):
        last = np.flatnonzero(np.isfinite(theta))[-1]
        found.append(np.hypot(theta[last] - saddles, velocity[last]).min() < AT_SADDLE)
    return np.array(found)


def _corner(motion: Any) -> float:
    """The jump of theta'' at the first impact with theta' > 0, from the series of the steps on both
    sides of it; NaN if none.
    """
    dense = motion.dense
    for time, velocity in zip(motion.impacts.time, motion.impacts.velocity_before, strict=True):
        after = int(np.searchsorted(dense.start, time))
        if velocity > 0 and 0 < after < dense.start.size:
            powers = np.arange(dense.series.shape[2])
            curvature = (powers * (powers - 1) * dense.series[after - 1, 0])[2:]
            before = np.polynomial.polynomial.polyval(dense.length[after - 1], curvature)
            return float(2 * dense.series[after, 0, 2] - before)
    return math.nan


def circled(data: Any) -> list[list[float]]:
    """The stable equilibria that each motion goes round: those within the range of its theta."""
    stable = data["equilibrium"].values[data["stable"].values.astype(bool)]
    low = np.nanmin(data["theta"].values, axis=1)
    high = np.nanmax(data["theta"].values, axis=1)
    return [[float(s) for s in stable if a < s < b] for a, b in zip(low, high, strict=True)]


def outward(data: Any) -> list[np.ndarray]:
    """The states (n, 2) of the separatrices that leave their saddle away from theta = 0, and so
    never reach theta = 0.
    """
    curves = np.stack([data["separatrix_theta"].values, data["separatrix_velocity"].values], axis=2)
    known = [curve[np.isfinite(curve).all(axis=1)] for curve in curves]
    return [curve for curve in known if np.abs(curve[:, 0]).min() > 0.5 * abs(curve[0, 0])]


def loop_area(data: Any, saddle: float) -> float:
    """The area inside the branch of the separatrix that leaves `saddle` outward and comes back to
    it.
    """
    (loop,) = (curve for curve in outward(data) if abs(curve[0, 0] - saddle) < AT_SADDLE)
    return float(abs(np.trapezoid(loop[:, 1], loop[:, 0])))


def _energy(system: System, theta: np.ndarray, velocity: np.ndarray) -> np.ndarray:
    known = np.isfinite(theta) & np.isfinite(velocity)
    energy = np.full(theta.shape, np.nan)
    energy[known] = total_energy(system, theta[known], velocity[known])
    return energy


@dataclass(frozen=True)
class PortraitSettings:
    """Which part of a trajectory is drawn."""

    # Motions this close in energy to theta = 0 are left out: their many lines would merge to a
    # black area.
    core: float = 0.032
    eye: float = 0.0012  # This distance at a deformed equilibrium, around which motions spiral.
    away: float = 0.03  # The distance, in window widths, at which a trajectory has left its start.
    back: float = 0.004  # The distance, in window widths, at which it has come back to its start.


PORTRAIT = PortraitSettings()


def draw_portrait(
    ax: Any, data: Any, xlim: tuple[float, float], ylim: tuple[float, float], spacing: float = 0.8
) -> None:
    """One panel from a portrait of the paper; arrows come about every `spacing` panel widths along
    a trajectory.
    """
    ax.set_xlim(*xlim)
    ax.set_ylim(*ylim)
    ax.axvline(0.0, color=LOOK.faint, lw=1.2, zorder=0)
    ax.axhline(0.0, color=LOOK.faint, lw=0.4, zorder=0)
    for name in ("line_limit", "kinematic_limit"):
        limit_lines(ax, float(data[name]), rf"${np.rad2deg(float(data[name])):.0f}^\circ$")
    borders = data.isel(separatrix=data["separates"].values.astype(bool))
    for theta, velocity in zip(
        borders["separatrix_theta"].values, borders["separatrix_velocity"].values, strict=True
    ):
        ax.plot(theta, velocity, zorder=1.5, **LOOK.separatrix_line | {"linewidth": 0.8})
    for theta, velocity, hide in zip(
        data["theta"].values, data["velocity"].values, _hidden(data), strict=True
    ):
        shown = np.where(hide, np.nan, velocity)
        ax.plot(theta, shown, color=LOOK.stable, lw=0.7, zorder=2)
        draw_arrows(
            ax, theta, shown, spacing, _first_return(theta / np.ptp(xlim), shown / np.ptp(ylim))
        )
    fixed_points(ax, data["equilibrium"].values, data["stable"].values)
    ax.set_xlabel(r"$\theta$ (rad)")


def _hidden(data: Any) -> np.ndarray:
    """The samples of decaying motions that have come closer to their attractor than `core` or
    `eye`.
    """
    points = data["equilibrium"].values
    stable = data["stable"].values.astype(bool)
    theta = data["theta"].values
    energy = data["energy"].values
    hidden = np.zeros(theta.shape, dtype=bool)
    for low, high in pairwise([-np.inf, *points[~stable], np.inf]):
        for i in np.flatnonzero(stable & (points > low) & (points < high)):
            floor = float(data["equilibrium_energy"][i]) + (
                PORTRAIT.eye if points[i] else PORTRAIT.core
            )
            hidden |= (theta > low) & (theta < high) & (energy < floor)
    decays = np.nanmax(energy, axis=1) - np.nanmin(energy, axis=1) > 1e-9
    return np.asarray(hidden & decays[:, None])


def _first_return(x: np.ndarray, y: np.ndarray) -> int:
    """The sample at which a closed trajectory, in units of the panel, is back at its start, or the
    last one.
    """
    known = np.flatnonzero(np.isfinite(x) & np.isfinite(y))
    distance = np.hypot(x[known] - x[0], y[known] - y[0])
    away = np.flatnonzero(distance > PORTRAIT.away)
    if away.size == 0:
        return 0
    back = np.flatnonzero(distance[away[0] :] < PORTRAIT.back)
    return int(known[away[0] + back[0]]) if back.size else int(known[-1])
