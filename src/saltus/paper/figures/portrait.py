"""A phase portrait as a dataset: trajectories, separatrices and fixed points of a system under a constant load."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from saltus.paper.figure_data import TOLERANCE, dataset
from saltus.paper.figures.manifolds import Manifold, manifold
from saltus.paper.figures.sampling import curve, padded
from saltus.systems import Load, Metainterface, System, VelocityReduction
from saltus.theory import Equilibrium, equilibria, total_energy

BETA0 = math.radians(80.0)
VERTICAL = -1.5 / math.sin(BETA0)  # the paper's -1.523


def system(*, stiffness: float = 1.0, damping: float = 0.0, e: float = 1.0) -> System:
    """The metainterface of Figs. 1c, 4 and 5: beta0 = 80 deg, V = -1.5 / sin(beta0), m = 0."""
    model = Metainterface(beta0=BETA0, damping=damping, stiffness_ratio=stiffness)
    return System(model=model, load=Load(vertical=VERTICAL), impact=VelocityReduction(e))


def portrait(system: System, starts: Sequence[tuple[float, float]], duration: float, bound: float, samples: int = 900) -> Any:
    """Motions from `starts` (theta, theta') for `duration`, the stable manifolds of every saddle up to `bound`, the equilibria.

    The stable manifolds of the saddles are the separatrices; without losses each closes on a saddle again.
    """
    from saltus.flow import simulate

    points = equilibria(system)
    motions = [simulate(system, theta=theta, velocity=velocity, duration=duration, tol=TOLERANCE) for theta, velocity in starts]
    tau, theta, velocity = (padded(list(rows)) for rows in zip(*(curve(m, 0.0, samples) for m in motions), strict=True))
    branches = separatrices(system, points, bound)
    return dataset(
        {
            "tau": (("trajectory", "sample"), tau, "1", "dimensionless time"),
            "theta": (("trajectory", "sample"), theta, "rad", "difference angle"),
            "velocity": (("trajectory", "sample"), velocity, "1", "theta', rad per unit of tau"),
            "energy": (("trajectory", "sample"), _energy(system, theta, velocity), "K2", "kinetic and potential energy"),
            "end": ("trajectory", [m.theta for m in motions], "rad", "theta at the end"),
            "impacts": ("trajectory", [len(m.impacts) for m in motions], "1", "impacts in the time shown"),
            "corner": ("trajectory", [_corner(m) for m in motions], "1", "jump of theta'' at the first impact upward, or NaN"),
            "wrong_reaction": (
                "trajectory",
                _shares(motions, "reaction"),
                "1",
                "share of time in which the closed layer would open",
            ),
            "beyond_line": ("trajectory", _shares(motions, "line_limit"), "1", "share of time beyond the straight line"),
            "beyond_limit": ("trajectory", _shares(motions, "kinematic_limit"), "1", "share of time beyond the kinematic limit"),
            "manifold_theta": (
                ("manifold", "point"),
                padded([b.theta for b in branches]),
                "rad",
                "stable manifolds of the saddles",
            ),
            "manifold_velocity": (("manifold", "point"), padded([b.velocity for b in branches]), "1", "theta' on them"),
            "manifold_saddle": ("manifold", [b.saddle for b in branches], "rad", "where each ends"),
            "manifold_separates": (
                "manifold",
                [separates(system, b) for b in branches],
                "1",
                "whether motions on its two sides end apart",
            ),
            "manifold_starts_at": ("manifold", [b.ends_at for b in branches], "rad", "the saddle that it comes from, or NaN"),
            "equilibrium": ("fixed_point", [p.theta for p in points], "rad", "equilibria"),
            "stable": ("fixed_point", [p.stable for p in points], "1", "whether each is stable"),
            "equilibrium_energy": (
                "fixed_point",
                [p.energy for p in points],
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


def separatrices(system: System, points: Sequence[Equilibrium], bound: float) -> list[Manifold]:
    """Both branches of the stable manifold of every saddle, ordered by saddle, outward first."""
    saddles = [p for p in points if p.eigenvalues is not None and p.eigenvalues[0].real > 0]
    angles = [s.theta for s in saddles]
    return [
        manifold(system, saddle, stable=True, outward=outward, saddles=angles, bound=bound)
        for saddle in saddles
        for outward in (True, False)
    ]


def separates(system: System, branch: Manifold) -> bool:
    """Whether a branch is a separatrix: it closes on a saddle, or the damping makes it a border between two attractors.

    Where impacts alone take energy, an open branch separates nothing: the motions on both its sides pass the saddle and end at
    theta = 0, one turn apart.
    """
    return math.isfinite(branch.ends_at) or float(system.get("model.damping")) > 0


def circled(data: Any) -> list[list[float]]:
    """The stable equilibria that each trajectory goes round: those within the range of its theta."""
    stable = data["equilibrium"].values[data["stable"].values.astype(bool)]
    low, high = np.nanmin(data["theta"].values, axis=1), np.nanmax(data["theta"].values, axis=1)
    return [[float(s) for s in stable if a < s < b] for a, b in zip(low, high, strict=True)]


def loop_area(data: Any, saddle: float) -> float:
    """The area inside the branch of the separatrix that leaves `saddle` outward and comes back to it."""
    i = next(i for i, s in enumerate(data["manifold_saddle"].values) if abs(s - saddle) < 1e-9)
    theta, velocity = data["manifold_theta"][i].values, data["manifold_velocity"][i].values
    known = np.isfinite(theta) & np.isfinite(velocity)
    return float(abs(np.trapezoid(velocity[known], theta[known])))


def _shares(motions: Sequence[Any], margin: str) -> list[float]:
    return [float(motion.validity.share[margin]) for motion in motions]


def _energy(system: System, theta: np.ndarray, velocity: np.ndarray) -> np.ndarray:
    known = np.isfinite(theta) & np.isfinite(velocity)
    energy = np.full(theta.shape, np.nan)
    energy[known] = total_energy(system, theta[known], velocity[known])
    return energy
