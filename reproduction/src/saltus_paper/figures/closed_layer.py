"""Whether the closed layer stays closed in the stable motions of a diagram, by both layers'
equations along simulated motions.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from saltus import PeriodicOrbit, TwoLayer, branches_of
from saltus.orbits import orbits_of
from saltus_paper.figure_data import dataset
from saltus_paper.measures.spectrum_features import within


@dataclass(frozen=True, slots=True, kw_only=True)
class ClosedLayerSettings:
    """Which motions are simulated, and at how many instants the reaction is evaluated."""

    # The number of stable motions of a diagram, spread evenly over its branches' points.
    motions: int = 12
    # The number of instants of an orbit's period at which the reaction is evaluated.
    instants: int = 4000
    # The reaction is also evaluated this share of the orbit's duration after the beginning and
    # before the end of each arc, where it is often least.
    beside: float = 1e-9


SETTINGS = ClosedLayerSettings()


def closed_layer(spectrum: Any) -> Any:
    """The least reaction of the closed layer in some stable motions, with the sign that keeps it
    closed (errata 21).

    Returns a Dataset over `motion`: `parameter`, its value; `stored`, the margin in the branch's
    data; `simulated`, the least of -R2 or R1 of `eomnl`, evaluated along the simulated motion;
    `share`, the share of the time in which the reaction is below 0.
    """
    stable = [
        (branch, i)
        for _, branch in branches_of(spectrum)
        for i in np.flatnonzero((branch["stable"].values == 1) & within(spectrum, branch))
    ]
    chosen = [
        stable[k]
        for k in np.linspace(0, len(stable) - 1, min(SETTINGS.motions, len(stable))).astype(int)
    ]
    found = [_Reaction(orbits_of(branch.isel(point=[i]))[0]) for branch, i in chosen]
    stored = np.array([float(branch["margin_reaction"][i]) for branch, i in chosen])
    return dataset(
        {
            "parameter": (
                "motion",
                np.array([float(branch["parameter"][i]) for branch, i in chosen]),
                "1",
                "of the diagram",
            ),
            "stored": ("motion", stored, "1", "least reaction, as the branch holds it"),
            "simulated": (
                "motion",
                np.array([one.least for one in found]),
                "1",
                "least reaction along the simulated motion",
            ),
            "share": ("motion", np.array([one.share for one in found]), "1", "of time, below 0"),
        },
        what="reaction of the closed layer in some stable motions",
    )


class _Reaction:
    """-R2 while the lower layer is open, else R1, along a simulated period of an orbit."""

    def __init__(self, orbit: PeriodicOrbit) -> None:
        model: Any = orbit.system.model
        self.both = TwoLayer(**model.cell_numbers)
        self.orbit, self.motion = orbit, orbit.motion()

    @property
    def share(self) -> float:
        """The share of the period in which it is below 0."""
        instants = (np.arange(SETTINGS.instants) + 0.5) / SETTINGS.instants
        return float((self.at(self.motion.start + self.orbit.duration * instants) < 0).mean())

    @property
    def least(self) -> float:
        """Its least value on all arcs, including their ends; between instants it is found by
        minimisation.
        """
        from scipy.optimize import minimize_scalar

        motion = self.motion
        duration = self.orbit.duration
        last = motion.start + duration
        bounds = np.unique(np.clip([motion.start, *motion.impacts.time, last], motion.start, last))
        best = np.inf
        inset = SETTINGS.beside * duration
        for begin, end in pairwise(bounds):
            if end - begin <= 4 * inset:
                continue
            number = max(3, math.ceil(SETTINGS.instants * (end - begin) / duration))
            times = np.linspace(begin + inset, end - inset, number)
            values = self.at(times)
            k = int(values.argmin())
            around = (times[max(k - 1, 0)], times[min(k + 1, number - 1)])
            refined = minimize_scalar(
                lambda t: float(self.at(np.array([t]))[0]), bounds=around, method="bounded"
            )
            best = min(best, float(values[k]), float(refined.fun))
        return best

    def at(self, times: np.ndarray) -> np.ndarray:
        """The reaction at some times, from both rows of `eomnl`."""
        load = self.orbit.system.load
        theta, velocity = (np.asarray(state, dtype=float) for state in self.motion.at(times))
        side = np.sign(theta)
        acceleration = self.orbit.system.model.acceleration(times, theta, velocity, side, load)
        lower = side > 0
        upper = side < 0
        angles, rates, seconds = (
            (np.where(lower, x, 0.0), np.where(upper, x, 0.0))
            for x in (theta, velocity, acceleration)
        )
        first, second = self.both.constraint_reactions(times, angles, rates, seconds, load)
        return np.asarray(np.where(lower, -second, first))
