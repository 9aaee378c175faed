"""Section 5.2 beyond the portraits: four stable states of two layers, the portrait's symmetry;
bounded motion (section 1).
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from saltus import simulate, simulate_many
from saltus_paper.claims.claim import Measured, measured, with_fields
from saltus_paper.figure_data import TOLERANCE, largest_angle, scalar_dataset, scalars
from saltus_paper.figures.harmonic_loads import DAMPING, under_force
from saltus_paper.figures.harmonic_loads import VERTICAL as FORCED_VERTICAL
from saltus_paper.figures.phase_portraits import BETA0, VERTICAL, constant_load

SPAN = 11.0  # how long the motions are followed whose mirror images are compared
# Hhat, the largest of Fig. 9, and Omega of the forced motions
STRONGEST = 3.0
FREQUENCIES = (0.5, 1.0, 1.6)


def compute(motions: int = 12, starts: int = 256) -> Any:
    """Minima of the energy of both layers, gaps between mirrored motions, and the largest rotation
    of forced ones.
    """
    values = {**_minima(), **_mirrors(np.random.default_rng(7), motions), **_bounded(starts)}
    return scalar_dataset(
        values, what="large amplitudes", tol=TOLERANCE, motions=motions, starts=starts
    )


def _minima() -> dict[str, float]:
    """How many minima the energy of both layers has under V = -1.5 / sin(beta0), and how many with
    at most one layer open.

    The energy is that of the springs (k = 1) less the work of V on the upper mass, which is at the
    height eta_1 + eta_2.
    """
    from scipy.optimize import minimize

    def energy(theta: np.ndarray) -> float:
        height = math.sin(BETA0 + theta[0]) + math.sin(BETA0 - theta[1])
        return float(theta @ theta) / 2 - VERTICAL * height

    line = math.pi - BETA0
    found = list[np.ndarray]()
    for first in np.linspace(0.0, line, 9):
        for second in np.linspace(0.0, -line, 9):
            bounds = ((0.0, line), (-line, 0.0))
            end = minimize(
                energy,
                (first, second),
                method="L-BFGS-B",
                bounds=bounds,
                options={"ftol": 1e-15, "gtol": 1e-10},
            ).x
            if not _is_saddle(energy, end) and not any(
                np.allclose(end, other, atol=1e-3) for other in found
            ):
                found.append(end)
    return {
        "stable_of_both": len(found),
        "stable_of_one": sum(bool(abs(end).min() < 1e-6) for end in found),
    }


def _is_saddle(energy: Any, place: np.ndarray) -> bool:
    """Whether a small step within theta_1 >= 0 >= theta_2 lowers the energy: the search may stop on
    a ridge.
    """
    steps = [np.array([x, y]) for x in (-1e-3, 0.0, 1e-3) for y in (-1e-3, 0.0, 1e-3)]
    allowed = [place + step for step in steps if place[0] + step[0] >= 0.0 >= place[1] + step[1]]
    return bool(min(energy(near) for near in allowed) < energy(place) - 1e-12)


def _mirrors(rng: np.random.Generator, motions: int) -> dict[str, float]:
    """The largest distance, for several motions, between the mirrored start and the end of a motion
    from the mirrored end.

    Mirroring about the axis of theta' or of theta reverses the time, so that start and end are
    exchanged.
    """
    starts = [
        (float(q), float(v))
        for q, v in zip(
            rng.uniform(-1.5, 1.5, motions), rng.uniform(-0.4, 0.4, motions), strict=True
        )
    ]
    cases = {
        "free": constant_load(),
        "damped": constant_load(damping=0.1),
        "unequal": constant_load(stiffness=1.1),
    }
    found = {}
    for name, system in cases.items():
        for axis, (flip_theta, flip_velocity) in {"theta": (1, -1), "velocity": (-1, 1)}.items():
            gaps = []
            for theta, velocity in starts:
                end = simulate(system, theta=theta, velocity=velocity, duration=SPAN, tol=TOLERANCE)
                back = simulate(
                    system,
                    theta=flip_theta * end.theta,
                    velocity=flip_velocity * end.velocity,
                    duration=SPAN,
                    tol=TOLERANCE,
                )
                gaps.append(
                    math.hypot(
                        back.theta - flip_theta * theta, back.velocity - flip_velocity * velocity
                    )
                )
            found[f"mirror_{name}_{axis}"] = max(gaps)
    return found


def _bounded(starts: int) -> dict[str, float]:
    """The largest rotation after 100 periods of motions from far away under the strongest load of
    Fig. 9, and its bound.

    Between impacts theta'' + C theta' + theta = f(tau), abs(f) <= Hhat + abs(V), and theta and
    theta' are continuous: in the end abs(theta) <= (Hhat + abs(V)) coth(pi mu / (2 sqrt(1 -
    mu^2))), mu = C / 2, the absolute integral of the impulse response.
    """
    largest = 0.0
    beyond = 0
    rng = np.random.default_rng(3)
    for frequency in FREQUENCIES:
        theta, velocity = rng.uniform(-20, 20, (2, starts))
        system = under_force(frequency=frequency, amplitude=STRONGEST)
        late = simulate_many(
            system, theta=theta, velocity=velocity, periods=120, sample="extrema", last=20
        )
        size = largest_angle(late)
        largest, beyond = (
            max(largest, float(size.max())),
            beyond + int((size > 2 * (math.pi - BETA0)).sum()),
        )
    mu = DAMPING / 2
    bound = (STRONGEST + abs(FORCED_VERTICAL)) / math.tanh(
        math.pi * mu / (2 * math.sqrt(1 - mu * mu))
    )
    return {
        "largest_late": largest,
        "ultimate_bound": bound,
        "beyond_limit": beyond / (len(FREQUENCIES) * starts),
    }


def measure(data: Any) -> dict[str, Measured]:
    """Sections 1 and 5.2."""
    r = scalars(data)
    mirrored = max(r["mirror_free_theta"], r["mirror_free_velocity"])
    found = {
        "tetrastability": measured(r["stable_of_both"] == 4 and r["stable_of_one"] == 3),
        "portrait-symmetry": measured(
            mirrored < 1e-8
            and r["mirror_damped_theta"] > 1e-3
            and r["mirror_unequal_velocity"] > 1e-3
        ),
        "intro-global-stability": measured(r["largest_late"] < r["ultimate_bound"]),
    }
    more = {
        "motions": int(data.attrs["motions"]),
        "forced": int(data.attrs["starts"]) * len(FREQUENCIES),
        "mirrored": mirrored,
    }
    return with_fields(r | more, found)
