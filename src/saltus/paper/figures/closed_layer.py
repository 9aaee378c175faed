"""Whether the closed layer stays closed in the stable motions of a diagram, by both layers' equations along simulated motions."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from saltus.branch_tables import branches_of
from saltus.orbits import PeriodicOrbit, orbits_of
from saltus.paper.figure_data import dataset
from saltus.paper.measures.spectrum_features import within
from saltus.systems import TwoLayer


@dataclass(frozen=True, slots=True, kw_only=True)
class ClosedLayerSettings:
    """Which motions are simulated, and at how many instants the reaction is evaluated."""

    motions: int = 12  # The number of stable motions of a diagram, spread evenly over its branches' points.
    instants: int = 4000  # The number of instants of an orbit's period at which the reaction is evaluated.
    beside: float = 1e-9  # And as long before and after each impact, where it is often least, as a share of the period.


SETTINGS = ClosedLayerSettings()


def closed_layer(spectrum: Any) -> Any:
    """The least reaction of the closed layer in some stable motions, with the sign that keeps it closed (errata 21).

    Returns a Dataset over `motion`: the value of the `parameter`, `stored`, the margin that the branch holds, `simulated`, the
    least of -R2 or R1 of `eomnl`, both rows of which are evaluated along the simulated motion, and `share`, the share of the
    motion's time in which it is below 0.
    """
    stable = [
        (branch, i)
        for _, branch in branches_of(spectrum)
        for i in np.flatnonzero((branch["stable"].values == 1) & within(spectrum, branch))
    ]
    chosen = [stable[k] for k in np.linspace(0, len(stable) - 1, min(SETTINGS.motions, len(stable))).astype(int)]
    reactions = [_reaction(orbits_of(branch.isel(point=[i]))[0]) for branch, i in chosen]
    stored = np.array([float(branch["margin_reaction"][i]) for branch, i in chosen])
    return dataset(
        {
            "parameter": ("motion", np.array([float(branch["parameter"][i]) for branch, i in chosen]), "1", "of the diagram"),
            "stored": ("motion", stored, "1", "least reaction, as the branch holds it"),
            "simulated": ("motion", np.array([r.min() for r in reactions]), "1", "least reaction along the simulated motion"),
            "share": ("motion", np.array([(r[: SETTINGS.instants] < 0).mean() for r in reactions]), "1", "of time, below 0"),
        },
        what="reaction of the closed layer in some stable motions",
    )


def _reaction(orbit: PeriodicOrbit) -> np.ndarray:
    """-R2 while the lower layer is open, else R1, along a simulated period: at even instants, then just beside impacts."""
    model: Any = orbit.system.model
    load = orbit.system.load
    both = TwoLayer(
        beta0=model.beta0,
        damping=model.damping,
        stiffness_ratio=model.stiffness_ratio,
        mass_ratio=model.mass_ratio,
        dissipation_ratio=model.dissipation_ratio,
    )
    motion = orbit.motion()
    even = motion.start + orbit.duration * (np.arange(SETTINGS.instants) + 0.5) / SETTINGS.instants
    beside = (motion.impacts.time + SETTINGS.beside * orbit.duration * np.array([[-1], [1]])).ravel()
    times = np.concatenate([even, beside[(beside > motion.start) & (beside < motion.start + orbit.duration)]])
    theta, velocity = (np.asarray(state, dtype=float) for state in motion.at(times))
    side = np.sign(theta)
    acceleration = model.acceleration(times, theta, velocity, side, load)
    lower, upper = side > 0, side < 0
    angles, rates, seconds = ((np.where(lower, x, 0.0), np.where(upper, x, 0.0)) for x in (theta, velocity, acceleration))
    first, second = both.constraint_reactions(times, angles, rates, seconds, load)
    return np.asarray(np.where(lower, -second, first))
