"""The phase portraits of Figs. 1c, 4 and 5: a portrait of `saltus.studies` with energies and measures of its motions."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from saltus.flow import simulate
from saltus.studies import phase_portrait
from saltus.systems import Load, Metainterface, System, VelocityReduction
from saltus.theory import potential_energy, total_energy
from saltus_paper.figure_data import TOLERANCE, dataset

BETA0 = math.radians(80.0)
VERTICAL = -1.5 / math.sin(BETA0)  # the paper's -1.523
AT_SADDLE = 1e-3  # distance at which a separatrix has come back to a saddle


def constant_load(*, stiffness: float = 1.0, damping: float = 0.0, e: float = 1.0) -> System:
    """The metainterface of Figs. 1c, 4 and 5: beta0 = 80 deg, V = -1.5 / sin(beta0), m = 0."""
    model = Metainterface(beta0=BETA0, damping=damping, stiffness_ratio=stiffness)
    return System(model=model, load=Load(vertical=VERTICAL), impact=VelocityReduction(e))


def portrait(system: System, starts: Sequence[tuple[float, float]], duration: float, bound: float, samples: int = 900) -> Any:
    """Motions from `starts` (theta, theta') for `duration`, the separatrices up to abs(theta) = `bound`, and the equilibria."""
    motions = [simulate(system, theta=theta, velocity=velocity, duration=duration, tol=TOLERANCE) for theta, velocity in starts]
    window = ((-bound, bound), (-bound, bound))
    plane = phase_portrait(system, window=window, starts=starts, duration=duration, samples=samples)
    energy = _energy(system, plane["theta"].values, plane["velocity"].values)
    levels = potential_energy(system, plane["equilibrium"].values)
    shares = {name: [float(motion.validity.share[name]) for motion in motions] for name in motions[0].validity.share}
    data = dataset(
        {
            "energy": (("motion", "sample"), energy, "K2", "kinetic and potential energy"),
            "end": ("motion", [motion.theta for motion in motions], "rad", "theta at the end"),
            "impacts": ("motion", [len(motion.impacts) for motion in motions], "1", "impacts in the time shown"),
            "corner": ("motion", [_corner(motion) for motion in motions], "1", "jump of theta'' at the first impact upward"),
            "wrong_reaction": ("motion", shares["reaction"], "1", "share of time in which the closed layer would open"),
            "beyond_line": ("motion", shares["line_limit"], "1", "share of time beyond the straight line"),
            "beyond_limit": ("motion", shares["kinematic_limit"], "1", "share of time beyond the kinematic limit"),
            "equilibrium_energy": ("equilibrium", levels, "K2", "potential energy above the undeformed state"),
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
    """The portrait with separatrices that end where they first pass abs(theta) = `bound`, backward in time from their saddle."""
    beyond = np.cumsum(np.abs(np.nan_to_num(plane["separatrix_theta"].values)) > bound, axis=1) > 0
    kept = {name: plane[name].where(~beyond) for name in ("separatrix_theta", "separatrix_velocity")}
    return plane.assign(kept).dropna("point", how="all", subset=["separatrix_theta"])


def _separates(plane: Any, system: System) -> Any:
    """Whether motions on the two sides of each separatrix end differently: it is closed, or there is viscous damping.

    If energy is lost at impacts only, an open branch separates nothing: motions on both sides pass the saddle and end at
    theta = 0, one turn apart.
    """
    damped = float(system.get("model.damping")) > 0
    return plane["separatrix_theta"].isel(point=0, drop=True).copy(data=closed(plane) | damped).assign_attrs(units="1")


def closed(plane: Any) -> np.ndarray:
    """Which separatrices come back to a saddle, (separatrix,)."""
    saddles = plane["equilibrium"].values[~plane["stable"].values.astype(bool)]
    found = []
    for theta, velocity in zip(plane["separatrix_theta"].values, plane["separatrix_velocity"].values, strict=True):
        last = np.flatnonzero(np.isfinite(theta))[-1]
        found.append(np.hypot(theta[last] - saddles, velocity[last]).min() < AT_SADDLE)
    return np.array(found)


def _corner(motion: Any) -> float:
    """The jump of theta'' at the first impact with theta' > 0, from the series of the steps on both sides of it; NaN if none."""
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
    low, high = np.nanmin(data["theta"].values, axis=1), np.nanmax(data["theta"].values, axis=1)
    return [[float(s) for s in stable if a < s < b] for a, b in zip(low, high, strict=True)]


def outward(data: Any) -> list[np.ndarray]:
    """The states (n, 2) of the separatrices that leave their saddle away from theta = 0, and so never reach theta = 0."""
    curves = np.stack([data["separatrix_theta"].values, data["separatrix_velocity"].values], axis=2)
    known = [curve[np.isfinite(curve).all(axis=1)] for curve in curves]
    return [curve for curve in known if np.abs(curve[:, 0]).min() > 0.5 * abs(curve[0, 0])]


def loop_area(data: Any, saddle: float) -> float:
    """The area inside the branch of the separatrix that leaves `saddle` outward and comes back to it."""
    (loop,) = (curve for curve in outward(data) if abs(curve[0, 0] - saddle) < AT_SADDLE)
    return float(abs(np.trapezoid(loop[:, 1], loop[:, 0])))


def _energy(system: System, theta: np.ndarray, velocity: np.ndarray) -> np.ndarray:
    known = np.isfinite(theta) & np.isfinite(velocity)
    energy = np.full(theta.shape, np.nan)
    energy[known] = total_energy(system, theta[known], velocity[known])
    return energy
