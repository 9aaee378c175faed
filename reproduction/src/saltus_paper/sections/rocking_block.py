"""The appendix's formulas on random states, and the claims that follow."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from saltus import Harmonic, Load, Metainterface, RockingBlock, System, VelocityReduction, simulate
from saltus.theory import (
    decayed_amplitude,
    final_time,
    housner_restitution,
    rocking_energy_jump,
    rocking_period,
)
from saltus_paper.claims.claim import Measured, measured, with_fields
from saltus_paper.figure_data import scalars
from saltus_paper.sections.differences import derivative


def block(alpha: float, e: float = 1.0) -> Any:
    """A free block of slenderness `alpha` (rad)."""
    return System(model=RockingBlock(alpha=alpha), impact=VelocityReduction(e))


def residuals(rng: np.random.Generator, n: int = 500) -> dict[str, Any]:
    """Largest deviations of each formula, as printed and as corrected, on `n` random states."""
    alpha = rng.uniform(0.05, 1.4, n)
    theta = rng.uniform(-1.2, 1.2, n)
    velocity, ground, push = rng.normal(size=(3, n))
    return {
        **_energies(alpha, theta, velocity, ground),
        **_equations(alpha, theta, velocity, push),
        **_conditions(rng, n),
        **_decay(),
        **_linear_terms(),
        **_lagrange(rng),
        **_housner(rng),
        **_overturning(),
    }


def _energies(
    alpha: np.ndarray, theta: np.ndarray, velocity: np.ndarray, ground: np.ndarray
) -> dict[str, float]:
    """T / (2 M R^2 / 3) summed over the block's points (3 by 3 Gauss points are exact) against both
    brackets.
    """
    nodes, weights = np.polynomial.legendre.leggauss(3)
    total = np.zeros_like(alpha)
    for u, wu in zip(nodes, weights, strict=True):
        for v, wv in zip(nodes, weights, strict=True):
            # from the pivot, R = 1: the block stands at x in [-2 sin(alpha), 0], y in [0, 2
            # cos(alpha)], then turns by |theta|
            x = np.sin(alpha) * (u - 1)
            y = np.cos(alpha) * (v + 1)
            size = abs(theta)
            px = x * np.cos(size) + y * np.sin(size)
            py = -x * np.sin(size) + y * np.cos(size)
            speed_x = py * velocity + 4 / 3 * ground
            speed_y = -px * velocity
            total += wu * wv / 4 * (speed_x**2 + speed_y**2) / 2
    exact = total / (2 / 3)
    cross = 2 * velocity * ground * np.cos(alpha - abs(theta))
    printed, corrected = (velocity**2 + factor * ground**2 + cross for factor in (4, 4 / 3))
    return {
        "energy_printed": abs(printed - exact).max(),
        "energy_corrected": abs(corrected - exact).max(),
    }


def _places(alpha: float, theta: float, ground: float) -> tuple[np.ndarray, np.ndarray]:
    """Places (9, 2) and shares of the mass (9,) of the Gauss points of a block, R = 1, on a ground
    at U_h = 4/3 `ground`.

    It turns about its right corner by theta > 0, clockwise, and about its left one by theta < 0.
    """
    nodes, weights = np.polynomial.legendre.leggauss(3)
    side = math.copysign(1.0, theta)
    size = abs(theta)
    u, v = (grid.ravel() for grid in np.meshgrid(nodes, nodes))
    # from the pivot, before the turn
    x = side * math.sin(alpha) * (u - 1)
    y = math.cos(alpha) * (v + 1)
    across = (
        x * math.cos(theta) + y * math.sin(theta)
        if side > 0
        else x * math.cos(size) - y * math.sin(size)
    )
    up = y * math.cos(size) - side * x * math.sin(size)
    pivot = side * math.sin(alpha) + 4 / 3 * ground
    return np.stack([pivot + across, up], axis=1), np.outer(weights, weights).ravel() / 4


def _lagrange(rng: np.random.Generator, n: int = 40) -> dict[str, float]:
    """`EOM&Rock` and Pi from the points of the block, the most over random states; g = 4/3, so that
    p = 1.
    """
    numbers = (
        rng.uniform(0.1, 1.4, n),
        rng.uniform(0.05, 1.0, n) * rng.choice([-1, 1], n),
        *rng.normal(size=(2, n)),
    )
    rows = [
        (_lagrange_residual(*map(float, row)), _height_error(*map(float, row[:2])))
        for row in zip(*numbers, strict=True)
    ]
    equation, height = np.max(rows, axis=0)
    return {"rocking_eom": float(equation), "rocking_potential": float(height)}


def _height_error(alpha: float, theta: float) -> float:
    points, shares = _places(alpha, theta, 0.0)
    return abs(
        float(shares @ points[:, 1])
        - math.cos(alpha)
        - (math.cos(alpha - abs(theta)) - math.cos(alpha))
    )


def _lagrange_residual(alpha: float, theta: float, velocity: float, shake: float) -> float:
    """The sum of mass x (acceleration + weight) x dplace/dtheta over the points, by differences
    along the motion.
    """
    # zeta''(0) = shake
    load = Load(frequency=1.0, ground_horizontal=Harmonic(amplitude=-shake, phase=np.pi / 2))
    side = math.copysign(1.0, theta)
    h = 1e-3
    acceleration = float(RockingBlock(alpha=alpha).acceleration(0.0, theta, velocity, side, load))

    def at(s: float) -> np.ndarray:
        return _places(alpha, theta + velocity * s + acceleration * s * s / 2, shake * s * s / 2)[0]

    def turned(angle: float) -> np.ndarray:
        return _places(alpha, angle, 0.0)[0]

    shares = _places(alpha, theta, 0.0)[1]
    second = (16 * (at(h) + at(-h)) - at(2 * h) - at(-2 * h) - 30 * at(0.0)) / (12 * h * h)
    return abs(
        float(shares @ ((second + np.array([0.0, 4 / 3])) * derivative(turned, theta)).sum(axis=1))
    )


def _housner(rng: np.random.Generator, n: int = 40) -> dict[str, float]:
    """Housner's restitution against the angular momentum of the block's points about the corner
    that it comes to turn about.
    """
    worst = 0.0
    for alpha in rng.uniform(0.05, 0.9, n):
        points, shares = _places(float(alpha), 1e-300, 0.0)  # upright
        corner = np.array([math.sin(alpha), 0.0])
        old = points - corner
        new = points + corner
        kept = float(shares @ (new * old).sum(axis=1)) / float(shares @ (new * new).sum(axis=1))
        worst = max(
            worst,
            abs(kept - (1 - 1.5 * math.sin(alpha) ** 2)),
            abs(housner_restitution(alpha) - kept**2),
        )
    return {"housner": worst}


def _overturning() -> dict[str, float]:
    """How many of blocks of several slendernesses come back from 0.999 alpha, and from 1.001 alpha,
    at rest.
    """
    counts = {"back_inside": 0, "back_outside": 0, "blocks": 0}
    for alpha in (0.1, 0.4, 0.8):
        counts["blocks"] += 1
        for name, share in (("back_inside", 0.999), ("back_outside", 1.001)):
            counts[name] += (
                len(
                    simulate(block(alpha), theta=share * alpha, velocity=0.0, duration=12.0).impacts
                )
                > 0
            )
    return {name: float(count) for name, count in counts.items()}


def _equations(
    alpha: np.ndarray, theta: np.ndarray, velocity: np.ndarray, push: np.ndarray
) -> dict[str, float]:
    """`EOM&Rock2` with either sign of zeta'' against `EOM&Rock`, and against the metainterface
    without its spring.
    """
    worst = dict.fromkeys(("rock2_printed", "rock2_corrected", "analogy"), 0.0)
    for a, angle, speed, shake in zip(
        alpha[:60], theta[:60], velocity[:60], push[:60], strict=True
    ):
        side = float(np.sign(angle))
        beta0 = np.pi / 2 - a
        # zeta''(0) = shake
        load = Load(frequency=1.0, ground_horizontal=Harmonic(amplitude=-shake, phase=np.pi / 2))
        exact = RockingBlock(alpha=float(a)).acceleration(0.0, angle, speed, side, load)
        turn = -side * np.cos(abs(angle) + beta0)
        for name, sign in (("rock2_printed", 1), ("rock2_corrected", -1)):
            worst[name] = max(
                worst[name], abs(sign * shake * np.sin(abs(angle) + beta0) + turn - exact)
            )
        constant = Load(
            vertical=-1.0,
            frequency=1.0,
            ground_horizontal=Harmonic(amplitude=-shake, phase=np.pi / 2),
        )
        twin = (
            Metainterface(beta0=float(beta0)).acceleration(0.0, angle, speed, side, constant)
            + angle
        )
        worst["analogy"] = max(worst["analogy"], abs(twin - exact))
    return worst


def _linear_terms() -> dict[str, float]:
    """The coefficient of -theta that is left of each acceleration once the moment of the weight or
    load is taken off.
    """
    angle = 0.3
    beta0 = 1.2
    moment = -np.cos(angle + beta0)
    cell = Metainterface(beta0=beta0).acceleration(0.0, angle, 0.0, 1, Load(vertical=-1.0))
    block = RockingBlock(alpha=np.pi / 2 - beta0).acceleration(0.0, angle, 0.0, 1, Load())
    return {
        "term_of_cell": float((moment - cell) / angle),
        "term_of_block": float((moment - block) / angle),
    }


def _conditions(rng: np.random.Generator, n: int) -> dict[str, Any]:
    """How often the energy falls, and how often each reading of the two conditions says so."""
    alpha = rng.uniform(0.05, 1.4, n)
    e = rng.uniform(0.05, 0.95, n)
    velocity = rng.normal(size=n)
    ground = 2 * rng.normal(size=n)
    pairs = zip(velocity, alpha, e, ground, strict=True)
    jump = np.array(
        [rocking_energy_jump(v, alpha=a, e=f, ground_velocity=g) for v, a, f, g in pairs]
    )
    one = velocity * ground > 0
    two = abs(ground) < (1 + e) / (2 * np.cos(alpha)) * abs(velocity)
    return {
        "falls": int((jump < 0).sum()),
        "both": int((one & two).sum()),
        "either": int((one | two).sum()),
        "either_matches": bool(((one | two) == (jump < 0)).all()),
        "states": n,
    }


def _decay(e: float = 0.9, alpha: float = 0.3, theta0: float = 1e-4) -> dict[str, float]:
    """Amplitude after one cycle and end of the rocking, simulated, over their closed forms."""
    period = float(rocking_period(theta0, alpha=alpha))
    end = final_time(period=period, e=e)
    motion = simulate(block(alpha, e), theta=theta0, velocity=0.0, duration=1.2 * end)
    second, third = motion.impacts.time[1:3]
    # theta'' is nearly constant on each side, so the peak is where the parabola's time is half over
    peak = abs(motion.at(np.array([(second + third) / 2]))[0][0])
    return {
        "amplitude_ratio": float(peak / decayed_amplitude(2, theta0=theta0, e=e)),
        "printed_amplitude_ratio": float(peak / (e**8 * theta0)),
        "final_time_ratio": float(motion.rest_time or np.nan) / end,
        "decay_e": e,
    }


def measure(data: Any) -> dict[str, Measured]:
    """The appendix, with errata 8, 10, 11, 12, 17 and 27."""
    r = scalars(data["checks"])
    period = data["period"]
    jump = data["jump"]
    slender = abs(period["slender"] / period["exact"] - 1)
    close = period["share"].values > 0.9
    wide = slender.values[-1]
    thin = slender.values[0]
    # from 5 to 20 degrees: 16 for an error of order alpha^2
    growth = float(slender.values[1].max() / thin.max())
    found = {
        "rocking-energy": measured(r["energy_printed"], r["energy_corrected"]),
        "rocking-potential": measured(r["rocking_potential"]),
        "rocking-eom": measured(r["rocking_eom"]),
        "rocking-housner": measured(r["housner"]),
        "rocking-overturning": measured(r["back_inside"] == r["blocks"] and r["back_outside"] == 0),
        "rocking-eom2": measured(r["rock2_printed"], r["rock2_corrected"]),
        "rocking-analogy": measured(r["analogy"]),
        "rocking-linear-term": measured(
            r["term_of_block"] > 0.1 and r["term_of_cell"] < 1e-12,
            r["term_of_block"] < 1e-12 and abs(r["term_of_cell"] - 1) < 1e-12,
        ),
        "rocking-jump": measured(
            float(
                abs(
                    jump["computed"].values - np.interp(jump["dot"], jump["ground"], jump["jump"])
                ).max()
            )
        ),
        "rocking-still": measured(
            bool(float(jump["jump"].sel(ground=0.0, method="nearest")) < 0),
            jump=float(jump["jump"].sel(ground=0.0, method="nearest")),
            e=jump.attrs["e"],
        ),
        "rocking-conditions": measured(bool(r["both"] == r["falls"]), bool(r["either_matches"])),
        "rocking-period": measured(_period_error(period), motions=period["simulated"].size),
        "rocking-short": measured(
            float(abs(period["short"] / period["exact"] - 1)[:, 0].max()),
            share=float(period["share"][0]),
        ),
        "rocking-arccosh": measured(
            bool(thin[~close].max() > 0.01),
            bool(thin.max() < 0.01 and growth > 10),
            slender_error=thin.max(),
            wide_error=wide.max(),
            wide_error_close=wide[close].max(),
        ),
        "rocking-decay": measured(
            r["printed_amplitude_ratio"] - 1,
            max(abs(r["amplitude_ratio"] - 1), abs(r["final_time_ratio"] - 1)),
        ),
    }
    return with_fields(r, found)


def _period_error(period: Any) -> float:
    exact = np.array(
        [rocking_period(period["dot"].values * a, alpha=float(a)) for a in period["alpha"].values]
    )
    return float(abs(period["simulated"].values / exact - 1).max())
