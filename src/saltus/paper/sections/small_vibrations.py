"""Section 5.1: small vibrations under a constant vertical load (errata 8, 15)."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from saltus.flow import simulate
from saltus.paper.claims.claim import Measured, measured, with_fields
from saltus.paper.figure_data import TOLERANCE, scalar_dataset, scalars
from saltus.systems import Load, Metainterface, System, VelocityReduction
from saltus.theory import (
    Stability,
    equilibria,
    final_time,
    linear_equilibria,
    linear_motion,
    linear_period,
    potential_energy,
    short_period,
    undeformed_stability,
    upright_period,
    vibrations,
)

BETA0, VERTICAL, SMALL = math.radians(80.0), -0.5, 1e-6


def compute(e: float = 0.8) -> Any:
    """Periods, decay and equilibria, from the exact motion and from the closed forms."""
    values = {
        **_periods(),
        **_decay(e),
        **_equilibria(),
        **_potential(),
        **_divergence(),
        **_linear_solution(),
        **_frequencies(),
        **_upright(),
    }
    return scalar_dataset(values, what="small vibrations", tol=TOLERANCE, e=e)


def free(
    vertical: float = VERTICAL, *, beta0: float = BETA0, stiffness: float = 1.0, damping: float = 0.0, e: float = 1.0
) -> Any:
    """The metainterface under a constant vertical load."""
    model = Metainterface(beta0=beta0, stiffness_ratio=stiffness, damping=damping)
    return System(model=model, load=Load(vertical=vertical), impact=VelocityReduction(e))


def _measured_period(system: Any, theta0: float, guess: float) -> float:
    """The time between the first and the third impact."""
    times = simulate(system, theta=theta0, velocity=0.0, duration=1.6 * guess, tol=TOLERANCE).impacts.time
    return float(times[2] - times[0])


def _periods() -> dict[str, float]:
    exact = float(linear_period(SMALL, beta0=BETA0, vertical=VERTICAL))
    measured = _measured_period(free(), SMALL, exact)
    upright = math.radians(89.9)
    theta0 = 5e-3
    close = float(linear_period(theta0, beta0=upright, vertical=VERTICAL))
    return {
        "period": measured / exact - 1,
        "short_period": float(short_period(SMALL, beta0=BETA0, vertical=VERTICAL)) / exact - 1,
        "upright_period": float(upright_period(theta0, beta0=upright, vertical=VERTICAL)) / close - 1,
        "upright_measured": _measured_period(free(beta0=upright), theta0, close) / close - 1,
        "unloaded_frequency": 2 * math.pi / math.sqrt(1 + VERTICAL * math.sin(BETA0)) / exact,
    }


def _decay(e: float) -> dict[str, float]:
    """Peaks, cycle times and the end of a small vibration with losses at impacts."""
    period = float(linear_period(SMALL, beta0=BETA0, vertical=VERTICAL))
    motion = simulate(free(e=e), theta=SMALL, velocity=0.0, duration=1.5 * final_time(period=period, e=e), tol=TOLERANCE)
    impact = motion.impacts.time[:6]
    peaks = (impact[1:-1:2] + impact[2::2]) / 2  # theta'' is all but constant on each side
    amplitude = np.abs(motion.at(peaks)[0])
    return {
        "second_amplitude": float(amplitude[0]) / SMALL,
        "third_amplitude": float(amplitude[1]) / SMALL,
        "first_cycle": float(peaks[0]) / period,
        "second_cycle": float(peaks[1] - peaks[0]) / period,
        "first_by_impacts": float(impact[1]) / period,
        "first_interval": float(impact[0]) / period,
        "second_interval": float(impact[1] - impact[0]) / period,
        "third_interval": float(impact[2] - impact[1]) / period,
        "end": _rest(motion) / final_time(period=period, e=e) - 1,
    }


def _rest(motion: Any) -> float:
    """The time of rest, or NaN if it never comes."""
    return math.nan if motion.rest_time is None else float(motion.rest_time)


def _equilibria() -> dict[str, float]:
    """How many deformed linear equilibria there are, k = 0.5, between the printed and the corrected bound and beyond both."""

    def count(load: float) -> int:
        return len(linear_equilibria(free(-load / math.sin(BETA0), stiffness=0.5))) - 1

    energies = [p.energy for p in linear_equilibria(free(-1.2 / math.sin(BETA0), stiffness=0.5)) if p.theta]
    return {"beyond_min": count(0.8), "beyond_max": count(1.2), "before_both": count(0.4), "lowest_energy": min(energies)}


def _potential() -> dict[str, float]:
    """dP/dtheta by differences against the equation of motion's moments; stability of theta = 0 by the sign of V cos(beta0)."""
    system, worst, h = free(-1.3, stiffness=0.7), 0.0, 1e-3
    for theta in (-1.2, -0.4, 0.3, 1.1):
        p = [potential_energy(system, theta + n * h) for n in (-2, -1, 1, 2)]
        slope = (8 * (p[2] - p[1]) - (p[3] - p[0])) / (12 * h)
        worst = max(worst, abs(slope + system.model.acceleration(0.0, theta, 0.0, math.copysign(1, theta), system.load)))
    signs = [(v, b) for v in (-0.5, 0.5) for b in (1.2, 2.0)]
    right = all((undeformed_stability(free(v, beta0=b)) is Stability.STABLE) == (v * math.cos(b) < 0) for v, b in signs)
    return {"potential": worst, "stability_signs": float(right)}


def _divergence() -> dict[str, float]:
    """Whether small motions just inside theta_A come back and just outside do not, beta0 close to pi/2, V = -1.2."""
    system = free(-1.2, beta0=math.radians(89.5))
    linear = linear_equilibria(system)[-1].theta
    full = min(p.theta for p in equilibria(system) if p.theta > 0)
    back, away = (simulate(system, theta=f * full, velocity=0.0, duration=30.0, tol=TOLERANCE) for f in (0.98, 1.02))
    return {
        "theta_a": full,
        "theta_a_linear": linear,
        "impacts_inside": len(back.impacts),
        "impacts_outside": len(away.impacts),
    }


def _frequencies() -> dict[str, float]:
    """Omega_0 and mu of `fre_freq_xi` against the derivatives of the acceleration just beside theta = 0."""
    system, worst, h = free(damping=0.3, stiffness=1.7).with_({"model.mass_ratio": 0.6}), 0.0, 1e-4
    for side, vibration in zip((1, -1), vibrations(system), strict=True):
        a = [system.model.acceleration(0.0, side * x, 0.0, side, system.load) for x in (0.0, h, 2 * h)]
        slope = side * (-3 * a[0] + 4 * a[1] - a[2]) / (2 * h)
        drag = system.model.acceleration(0.0, 0.0, 1.0, side, system.load) - a[0]
        omega, mu = vibration.frequency, vibration.damping_ratio
        worst = max(worst, abs(omega**2 + slope), abs(2 * mu * omega + drag))
    return {"frequencies": float(worst)}


def _upright() -> dict[str, float]:
    """theta_A and its energy under the full equation against the paper's forms, beta0 = 89.9 deg, V = -1.3, k = 1.1."""
    vertical, k, beta0 = -1.3, 1.1, math.radians(89.9)
    full = min((p for p in equilibria(free(vertical, stiffness=k, beta0=beta0)) if p.theta > 0), key=lambda p: p.theta)
    kappa, push = k + vertical * math.sin(beta0), vertical * math.cos(beta0)
    return {
        "theta_a_form": full.theta / (push / kappa) - 1,
        "theta_a_upright": full.theta / (vertical / (k + vertical) * (math.pi / 2 - beta0)) - 1,
        "energy_form": full.energy / (-(push**2) / (2 * kappa)) - 1,
    }


def _linear_solution() -> dict[str, float]:
    """Impact times of the piecewise-linear solution against the exact motion of small amplitude, with damping and loss."""
    system = free(damping=0.1, stiffness=1.5, e=0.9)
    linear = linear_motion(system, SMALL, 5)
    exact = simulate(system, theta=SMALL, velocity=0.0, duration=1.01 * float(linear.impact_times[-1]), tol=TOLERANCE)
    return {"linear_solution": float(np.abs(exact.impacts.time[:5] / linear.impact_times - 1).max())}


def measure(data: Any) -> dict[str, Measured]:
    """Section 5.1."""
    r, e = scalars(data), float(data.attrs["e"])
    found = {
        "potential": measured(r["potential"]),
        "undeformed-stability": measured(bool(r["stability_signs"])),
        "frequencies": measured(r["frequencies"]),
        "non-trivial": measured(max(abs(r["theta_a_form"]), abs(r["theta_a_upright"]), abs(r["energy_form"]))),
        "minmin": measured(
            r["beyond_min"] == 2,
            r["beyond_min"] == 1 and r["beyond_max"] == 2 and r["before_both"] == 0 and r["lowest_energy"] > 0,
        ),
        "linear-solution": measured(r["linear_solution"]),
        "period": measured(r["period"]),
        "period-expansion": measured(r["short_period"]),
        "period-upright": measured(max(abs(r["upright_period"]), abs(r["upright_measured"]))),
        "decay-amplitude": measured(
            abs(r["second_amplitude"] / e**8 - 1),
            max(abs(r["second_amplitude"] / e**4 - 1), abs(r["third_amplitude"] / e**8 - 1)),
        ),
        "decay-period": measured(
            max(abs(r["first_cycle"] / ((1 + e) ** 2 / 4) - 1), abs(r["second_cycle"] / ((1 + e) ** 2 / 4 * e**2) - 1))
        ),
        "decay-period-impacts": measured(
            r["first_by_impacts"] / ((1 + e) ** 2 / 4) - 1, r["first_by_impacts"] / ((1 + 2 * e) / 4) - 1
        ),
        "decay-intervals": measured(
            r["second_interval"] < r["first_interval"],
            r["second_interval"] > r["first_interval"] and r["third_interval"] < r["second_interval"],
        ),
        "final-time": measured(r["end"]),
        "divergence": measured(r["impacts_inside"] > 0 == r["impacts_outside"]),
    }
    more = {"e": e, "e4": e**4, "e8": e**8, "first_by_erratum": (1 + 2 * e) / 4, "theta0": SMALL, "vertical": VERTICAL}
    return with_fields(r | more, found)
