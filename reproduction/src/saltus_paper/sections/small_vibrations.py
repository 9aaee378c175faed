"""Section 5.1: small vibrations under a constant vertical load (errata 8, 15)."""

from __future__ import annotations

import math
from functools import partial
from typing import Any

import numpy as np

from saltus import Load, Metainterface, System, VelocityReduction, simulate
from saltus.theory import (
    Stability,
    equilibria,
    final_time,
    linear_equilibria,
    linear_motion,
    linear_period,
    potential_energy,
    potential_slope,
    short_period,
    undeformed_stability,
    upright_period,
    vibrations,
)
from saltus_paper.claims.claim import Measured, measured, with_fields
from saltus_paper.figure_data import TOLERANCE, scalar_dataset, scalars
from saltus_paper.sections.differences import derivative

BETA0 = math.radians(80.0)
VERTICAL = -0.5
SMALL = 1e-6


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
    vertical: float = VERTICAL,
    *,
    beta0: float = BETA0,
    stiffness: float = 1.0,
    damping: float = 0.0,
    e: float = 1.0,
) -> Any:
    """The metainterface under a constant vertical load."""
    model = Metainterface(beta0=beta0, stiffness_ratio=stiffness, damping=damping)
    return System(model=model, load=Load(vertical=vertical), impact=VelocityReduction(e))


def _measured_period(system: Any, theta0: float, guess: float) -> float:
    """The time between the first and the third impact."""
    times = simulate(
        system, theta=theta0, velocity=0.0, duration=1.6 * guess, tol=TOLERANCE
    ).impacts.time
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
        "upright_period": float(upright_period(theta0, beta0=upright, vertical=VERTICAL)) / close
        - 1,
        "upright_measured": _measured_period(free(beta0=upright), theta0, close) / close - 1,
        "light_period": float(linear_period(0.1, beta0=BETA0, vertical=-1e-9)) / (2 * math.pi) - 1,
        "unloaded_frequency": 2 * math.pi / math.sqrt(1 + VERTICAL * math.sin(BETA0)) / exact,
    }


def _decay(e: float) -> dict[str, float]:
    """Peaks, cycle times and the end of a small vibration with losses at impacts."""
    period = float(linear_period(SMALL, beta0=BETA0, vertical=VERTICAL))
    motion = simulate(
        free(e=e),
        theta=SMALL,
        velocity=0.0,
        duration=1.5 * final_time(period=period, e=e),
        tol=TOLERANCE,
    )
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
        "end": (math.nan if motion.rest_time is None else motion.rest_time)
        / final_time(period=period, e=e)
        - 1,
    }


def _equilibria() -> dict[str, float]:
    """How many deformed linear equilibria there are, k = 0.5, between the printed and the corrected
    bound and beyond both.
    """

    def count(load: float) -> int:
        return len(linear_equilibria(free(-load / math.sin(BETA0), stiffness=0.5))) - 1

    energies = [
        p.energy for p in linear_equilibria(free(-1.2 / math.sin(BETA0), stiffness=0.5)) if p.theta
    ]
    return {
        "beyond_min": count(0.8),
        "beyond_max": count(1.2),
        "before_both": count(0.4),
        "lowest_energy": min(energies),
    }


def _potential() -> dict[str, float]:
    """dP/dtheta by differences against the equation of motion's moments; stability of theta = 0 by
    the sign of V cos(beta0).
    """
    system = free(-1.3, stiffness=0.7)
    worst = 0.0
    for theta in (-1.2, -0.4, 0.3, 1.1):
        slope = derivative(partial(potential_energy, system), theta)
        worst = max(
            worst,
            abs(
                slope
                + system.model.acceleration(0.0, theta, 0.0, math.copysign(1, theta), system.load)
            ),
        )
    signs = [(v, b) for v in (-0.5, 0.5) for b in (1.2, 2.0)]
    right = all(
        (undeformed_stability(free(v, beta0=b)) is Stability.STABLE) == (v * math.cos(b) < 0)
        for v, b in signs
    )
    return {"potential": worst, "stability_signs": float(right), **_slope_order(system)}


def _slope_order(system: Any) -> dict[str, float]:
    """The order in theta of the error of `pot_balanceder`, which is of the first order itself: the
    least over both sides.
    """
    small = np.array([1e-2, 1e-3])
    orders = []
    for side, k in ((1, 0.7), (-1, 1.0)):
        exact = np.array([potential_slope(system, side * x) for x in small])
        short = (k - 1.3 * math.sin(BETA0)) * side * small - side * -1.3 * math.cos(BETA0)
        errors = np.log(abs(short - exact))
        orders.append(float((errors[0] - errors[1]) / math.log(10)))
    return {"slope_order": min(orders)}


def leaves(theta0: float, vertical: float, *, beta0: float, stiffness: float = 1.0) -> bool:
    """Whether a motion from a small theta0 at rest leaves the undeformed state for good: no impact
    while it grows tenfold.
    """
    motion = simulate(
        free(vertical, beta0=beta0, stiffness=stiffness),
        theta=theta0,
        velocity=0.0,
        duration=60.0,
        tol=TOLERANCE,
    )
    before = float(motion.impacts.time[0]) if len(motion.impacts) else motion.time
    theta = abs(motion.at(np.linspace(0.0, before, 400))[0])
    return bool(theta.max() > 10 * abs(theta0))


def _divergence() -> dict[str, float]:
    """In how many cases of each bullet after `minmin` a simulated motion does the opposite of what
    it says, and of how many.

    The starts of the second bullet are 0.98 and 1.02 of theta_A and theta_B of the full equation,
    for beta0 = 89.99 degrees.
    """
    first = [
        (v, b, s * 1e-4, v * (90 - b) > 0)
        for v in (-0.5, 0.5, -1.5)
        for b in (70.0, 85.0, 95.0, 110.0)
        for s in (1, -1)
    ]
    # below -1 what it says depends on theta0
    far = [(v, b, theta, out) for v, b, theta, out in first if out or v > -1.0]
    wrong_first = sum(
        leaves(theta, v, beta0=math.radians(b)) is not out for v, b, theta, out in far
    )
    near = math.radians(89.99)
    wrong_second = 0
    cases = 0
    for vertical, k in ((-1.5, 1.2), (-1.1, 1.2), (-1.1, 0.8), (-0.9, 0.8)):
        deformed = [
            p.theta
            for p in equilibria(free(vertical, stiffness=k, beta0=near))
            if not p.stable and p.theta
        ]
        for side, bound in ((1, k), (-1, 1.0)):
            limits = [theta for theta in deformed if side * theta > 0]
            starts = (
                [0.98 * limits[0], 1.02 * limits[0]]
                if limits and vertical < -bound
                else [side * 1e-4, side * 1e-2]
            )
            expected = [False, vertical < -bound]
            wrong_second += sum(
                leaves(t, vertical, beta0=near, stiffness=k) is not out
                for t, out in zip(starts, expected, strict=True)
            )
            cases += 2
    upright = [
        (v, k, side) for v in (-1.5, -1.1, -0.9, -0.5) for k in (0.8, 1.2) for side in (1, -1)
    ]
    wrong_third = sum(
        leaves(side * 1e-4, v, beta0=math.pi / 2, stiffness=k)
        is not (v < (-k if side > 0 else -1.0))
        for v, k, side in upright
    )
    return {
        "divergence_1": wrong_first,
        "divergence_2": wrong_second,
        "divergence_3": wrong_third,
        "cases_1": len(far),
        "cases_2": cases,
        "cases_3": len(upright),
    }


def _frequencies() -> dict[str, float]:
    """Omega_0 and mu of `fre_freq_xi` against the derivatives of the acceleration just beside theta
    = 0.
    """
    system = free(damping=0.3, stiffness=1.7).with_({"model.mass_ratio": 0.6})
    worst = 0.0
    h = 1e-4
    for side, vibration in zip((1, -1), vibrations(system), strict=True):
        a = [
            system.model.acceleration(0.0, side * x, 0.0, side, system.load)
            for x in (0.0, h, 2 * h)
        ]
        slope = side * (-3 * a[0] + 4 * a[1] - a[2]) / (2 * h)
        drag = system.model.acceleration(0.0, 0.0, 1.0, side, system.load) - a[0]
        omega = vibration.frequency
        mu = vibration.damping_ratio
        worst = max(worst, abs(omega**2 + slope), abs(2 * mu * omega + drag))
    return {"frequencies": float(worst)}


def _upright() -> dict[str, float]:
    """theta_A, theta_B and their energies under the full equation against the paper's forms, beta0
    = 89.9 deg, k = 1.1.
    """
    vertical = -1.3
    k = 1.1
    beta0 = math.radians(89.9)
    found: dict[str, float] = {}
    deformed = [
        p for p in equilibria(free(vertical, stiffness=k, beta0=beta0)) if p.theta and not p.stable
    ]
    for name, side, stiffness in (("a", 1, k), ("b", -1, 1.0)):
        full = min((p for p in deformed if side * p.theta > 0), key=lambda p: abs(p.theta))
        kappa = stiffness + vertical * math.sin(beta0)
        push = vertical * math.cos(beta0)
        forms = {
            "form": full.theta / (side * push / kappa),
            "upright": full.theta
            / (side * vertical / (stiffness + vertical) * (math.pi / 2 - beta0)),
            "energy": full.energy / (-(push**2) / (2 * kappa)),
        }
        found |= {f"theta_{name}_{key}": ratio - 1 for key, ratio in forms.items()}
    return found | _stability_of_deformed()


def _stability_of_deformed() -> dict[str, float]:
    """The stability of the linear deformed states where theta = 0 is stable and where not; those of
    k = 1 about V = -1.
    """
    pressed = linear_equilibria(free(-1.3, beta0=math.radians(89.9), stiffness=1.1))
    pulled = linear_equilibria(free(0.3, beta0=math.radians(89.9), stiffness=1.1))
    around = [equilibria(free(v, beta0=math.radians(89.9))) for v in (-0.98, -1.02)]
    close = [sum(not p.stable and 0 < abs(p.theta) < 0.2 for p in found) for found in around]
    return {
        "stable_when_pressed": sum(p.stable for p in pressed if p.theta),
        "stable_when_pulled": sum(p.stable for p in pulled if p.theta),
        "deformed": len(pressed) + len(pulled) - 2,
        "unstable_above_minus_1": close[0],
        "unstable_below_minus_1": close[1],
    }


def _linear_solution() -> dict[str, float]:
    """Impact times of the piecewise-linear solution against the exact motion of small amplitude,
    with damping and loss.
    """
    system = free(damping=0.1, stiffness=1.5, e=0.9)
    linear = linear_motion(system, SMALL, 5)
    exact = simulate(
        system,
        theta=SMALL,
        velocity=0.0,
        duration=1.01 * float(linear.impact_times[-1]),
        tol=TOLERANCE,
    )
    return {
        "linear_solution": float(np.abs(exact.impacts.time[:5] / linear.impact_times - 1).max())
    }


def measure(data: Any) -> dict[str, Measured]:
    """Section 5.1."""
    r = scalars(data)
    e = float(data.attrs["e"])
    found = {
        "potential": measured(r["potential"]),
        "undeformed-stability": measured(bool(r["stability_signs"])),
        "frequencies": measured(r["frequencies"]),
        "potential-slope": measured(r["slope_order"] > 1.9),
        "non-trivial": measured(
            max(abs(r[f"theta_a_{form}"]) for form in ("form", "upright", "energy"))
        ),
        "non-trivial-b": measured(
            max(abs(r[f"theta_b_{form}"]) for form in ("form", "upright", "energy"))
        ),
        "non-trivial-unstable": measured(
            r["deformed"] == 4 and r["stable_when_pressed"] == 0 and r["stable_when_pulled"] == 2
        ),
        "symmetric-unstable": measured(
            r["unstable_above_minus_1"] == 0 and r["unstable_below_minus_1"] == 2
        ),
        "minmin": measured(
            r["beyond_min"] == 2,
            r["beyond_min"] == 1
            and r["beyond_max"] == 2
            and r["before_both"] == 0
            and r["lowest_energy"] > 0,
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
            max(
                abs(r["first_cycle"] / ((1 + e) ** 2 / 4) - 1),
                abs(r["second_cycle"] / ((1 + e) ** 2 / 4 * e**2) - 1),
            )
        ),
        "decay-period-impacts": measured(
            r["first_by_impacts"] / ((1 + e) ** 2 / 4) - 1,
            r["first_by_impacts"] / ((1 + 2 * e) / 4) - 1,
        ),
        "decay-intervals": measured(
            r["second_interval"] < r["first_interval"],
            r["second_interval"] > r["first_interval"]
            and r["third_interval"] < r["second_interval"],
        ),
        "final-time": measured(r["end"]),
        **{f"divergence-{n}": measured(r[f"divergence_{n}"] == 0) for n in (1, 2, 3)},
        "period-differs": measured(
            abs(r["unloaded_frequency"] - 1) > 0.1 and abs(r["light_period"]) < 1e-4
        ),
    }
    more = {
        "e": e,
        "e4": e**4,
        "e8": e**8,
        "first_by_erratum": (1 + 2 * e) / 4,
        "theta0": SMALL,
        "vertical": VERTICAL,
    }
    return with_fields(r | more, found)
