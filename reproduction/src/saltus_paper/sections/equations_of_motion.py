"""Section 3 and the reduction to one degree of freedom: the equations of motion (errata 14, 18,
21).
"""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np

from saltus import Harmonic, Load, Metainterface, System, TwoLayer, UnitCell
from saltus.theory import pendulum_acceleration
from saltus_paper.claims.claim import Measured, measured, with_fields
from saltus_paper.figure_data import scalar_dataset, scalars
from saltus_paper.sections.differences import derivative


def compute(states: int = 40) -> Any:
    """Largest residuals over random parameters, loads and states."""
    rng = np.random.default_rng(2)
    rows = [_residuals(rng) for _ in range(states)]
    values = {name: max(row[name] for row in rows) for name in rows[0]}
    values |= {**_equivalence(rng), **_symmetry(rng), **_closed_layer(), **_excitation()}
    return scalar_dataset(values, what="residuals of the equations of motion", states=states)


def random_case(rng: np.random.Generator, beta0: float | None = None) -> tuple[Any, Any, Any]:
    """A metainterface, the two-layer model with the same numbers, and a load on every channel."""
    numbers = {
        "beta0": float(rng.uniform(0.4, 2.4)) if beta0 is None else beta0,
        "damping": float(rng.uniform(0, 1)),
        "stiffness_ratio": float(rng.uniform(0.3, 3)),
        "mass_ratio": float(rng.uniform(0.2, 2)),
        "dissipation_ratio": float(rng.uniform(0, 2)),
    }
    channels = {
        name: Harmonic(amplitude=float(a), phase=float(p))
        for name, (a, p) in zip(Metainterface.channels, rng.normal(size=(6, 2)), strict=True)
    }
    return Metainterface(**numbers), TwoLayer(**numbers), Load(frequency=1.3, **channels)


def _residuals(rng: np.random.Generator) -> dict[str, float]:
    single, double, load = random_case(rng)
    theta = (float(rng.uniform(0.05, 0.6)), float(-rng.uniform(0.05, 0.6)))
    velocity = tuple(map(float, rng.normal(size=2)))
    acceleration = double.acceleration(0.2, theta, velocity, 0, load)
    return {
        "kinetic": _kinetic_residual(double, load, 0.2, theta, velocity),
        "lagrange": _lagrange_residual(double, load, 0.2, theta, velocity, acceleration),
        "linear": _linear_residual(double, load),
        "reduction": _reduction_residual(single, double, load, theta, velocity),
        "virtual_work": _virtual_work_residual(double, load, 0.2, theta),
        "operators": _operators_residual(double, theta),
    }


def _kinetic_residual(model: Any, load: Any, t: float, theta: Any, velocity: Any) -> float:
    """`kin_eng` against the velocities of the masses of the drawn cell, by differences of their
    positions.
    """
    cell = UnitCell(alpha0=0.3, beta0=model.beta0)

    def places(s: float) -> np.ndarray:
        layout = cell.layout(theta[0] + velocity[0] * s, theta[1] + velocity[1] * s)
        ground = np.array([load.ground_horizontal(t + s), load.ground_vertical(t + s)])
        return np.asarray(np.array([layout.points["mass_1"], layout.points["mass_2"]]) + ground)

    speeds = derivative(places)
    energy = (model.mass_ratio * speeds[0] @ speeds[0] + speeds[1] @ speeds[1]) / 2
    return abs(float(energy - model.kinetic_energy(t, theta, velocity, 0, load)))


def _virtual_work_residual(model: Any, load: Any, t: float, theta: Any) -> float:
    """`ext_forces_beta` against the work of the forces on both masses of the drawn cell over small
    rotations.
    """
    cell = UnitCell(alpha0=0.3, beta0=model.beta0)
    worst = 0.0
    upper = np.array([load.horizontal(t), load.vertical(t)])
    lower = np.array([load.lower_horizontal(t), load.lower_vertical(t)])

    def work(j: int, turn: float) -> float:
        points = cell.layout(*(q + turn * (i == j) for i, q in enumerate(theta))).points
        return float(lower @ np.array(points["mass_1"]) + upper @ np.array(points["mass_2"]))

    for j, force in enumerate(model.generalised_forces(t, theta, load)):
        worst = max(worst, abs(derivative(partial(work, j)) - force))
    return worst


def _operators_residual(model: Any, theta: Any) -> float:
    """How far M is from symmetric, D from skew-symmetric, and C and K from diagonal."""
    mass = np.asarray(model.mass_matrix(theta))
    twist = np.asarray(model.velocity_matrix(theta))
    diagonals = [
        np.asarray(matrix) for matrix in (model.damping_matrix(), model.stiffness_matrix())
    ]
    parts = [
        mass - mass.T,
        twist + twist.T,
        *(matrix - np.diag(np.diag(matrix)) for matrix in diagonals),
    ]
    return float(max(abs(part).max() for part in parts))


def _excitation() -> dict[str, float]:
    """The change of f0 and K0 over a period if one channel alone varies: the least of the six, for
    beta0 = 80 and 90.
    """
    times = np.linspace(0, 2 * np.pi, 13)
    found = dict[str, float]()
    for degrees in (80, 90):
        model = TwoLayer(beta0=float(np.deg2rad(degrees)), mass_ratio=0.4)
        swings = []
        for name in Metainterface.channels:
            load = Load(frequency=1.0, **{name: Harmonic(amplitude=0.3)})
            force = np.array([model.load_vector(t, (0.0, 0.0), load) for t in times])
            stiffness = np.array([np.diag(model.linear_stiffness_matrix(t, load)) for t in times])
            swings.append([float(np.ptp(values, axis=0).max()) for values in (force, stiffness)])
        found |= {
            f"external_{degrees}": min(s[0] for s in swings),
            f"parametric_{degrees}": min(s[1] for s in swings),
        }
    still = Load(horizontal=0.3, vertical=-0.5)
    parts = [
        np.array([model.load_vector(t, (0.0, 0.0), still) for t in times]),
        np.array([model.linear_stiffness_matrix(t, still) for t in times]),
    ]
    return found | {"excitation_still": float(max(np.ptp(part, axis=0).max() for part in parts))}


def _lagrange_residual(
    model: Any, load: Any, t: float, theta: Any, velocity: Any, acceleration: Any
) -> float:
    """Euler-Lagrange from kin_eng, pot_eng_beta, Rayleigh and ext_forces_beta only, by differences,
    along the motion.
    """
    step = 1e-20j

    def slope(function: Any, point: tuple[float, float], j: int) -> float:
        shifted = [complex(p) for p in point]
        shifted[j] += step
        return float(np.imag(function(tuple(shifted))) / step.imag)

    def momentum(j: int, s: float) -> float:
        where = tuple(
            q + v * s + a * s * s / 2 for q, v, a in zip(theta, velocity, acceleration, strict=True)
        )
        speed = tuple(v + a * s for v, a in zip(velocity, acceleration, strict=True))
        return slope(lambda v: model.kinetic_energy(t + s, where, v, 0, load), speed, j)

    force = model.generalised_forces(t, theta, load)
    worst = 0.0
    for j in (0, 1):
        potential = slope(
            lambda q: model.kinetic_energy(t, q, velocity, 0, load) - model.potential_energy(q),
            theta,
            j,
        )
        balance = (
            derivative(partial(momentum, j)) - potential + slope(model.dissipation, velocity, j)
        )
        worst = max(worst, abs(balance - force[j]))
    return worst


def _linear_residual(model: Any, load: Any) -> float:
    """K theta - f against K0 theta - f0 to first order, and M0: derivatives at theta = 0 by complex
    steps.
    """
    step = 1e-20j
    t = 0.2
    worst = 0.0
    stiffness = np.asarray(model.linear_stiffness_matrix(t, load))
    exact = np.asarray(model.stiffness_matrix())
    for j in (0, 1):
        point = tuple(step if i == j else 0.0 for i in (0, 1))
        slopes = exact[:, j] - np.imag(np.array(model.load_vector(t, point, load))) / step.imag
        worst = max(worst, float(abs(slopes - stiffness[:, j]).max()))
    return worst


def _reduction_residual(single: Any, double: Any, load: Any, theta: Any, velocity: Any) -> float:
    """The row of the open layer with the other one held closed, against `gov_eqn_theta_long`."""
    worst = 0.0
    for j, side in ((0, 1), (1, -1)):
        where = tuple(theta[i] if i == j else 0.0 for i in (0, 1))
        speed = tuple(velocity[i] if i == j else 0.0 for i in (0, 1))
        moving = single.acceleration(0.2, theta[j], velocity[j], side, load)
        both = tuple(moving if i == j else 0.0 for i in (0, 1))
        worst = max(
            worst, abs(float(double.constraint_reactions(0.2, where, speed, both, load)[j]))
        )
    return worst


def _equivalence(rng: np.random.Generator) -> dict[str, float]:
    """Ground motion zetahat against a force +Omega^2 zetahat and -Omega^2 zetahat, symmetric, and
    with h = m.
    """
    times = rng.uniform(0, 6, 40)
    theta = float(rng.uniform(0.1, 1))
    omega = 1.3
    zeta = 0.4
    worst = {"force_printed": 0.0, "force_corrected": 0.0, "force_unequal": 0.0}
    ground = Load(frequency=omega, ground_horizontal=Harmonic(amplitude=zeta), vertical=-0.5)

    def gap(model: Any, **force: Any) -> float:
        other = Load(frequency=omega, vertical=-0.5, **force)
        return float(
            max(
                abs(
                    model.acceleration(t, theta, 0.1, 1, ground)
                    - model.acceleration(t, theta, 0.1, 1, other)
                )
                for t in times
            )
        )

    symmetric = Metainterface(beta0=1.4)
    unequal = Metainterface(beta0=1.4, mass_ratio=0.7)
    size = omega**2 * zeta
    worst["force_printed"] = gap(symmetric, horizontal=Harmonic(amplitude=-size))
    worst["force_corrected"] = max(
        gap(symmetric, horizontal=Harmonic(amplitude=size)),
        gap(
            unequal,
            horizontal=Harmonic(amplitude=size),
            lower_horizontal=Harmonic(amplitude=0.7 * size),
        ),
    )
    worst["force_unequal"] = gap(unequal, horizontal=Harmonic(amplitude=size))
    return worst


def _symmetry(rng: np.random.Generator) -> dict[str, Any]:
    """Whether reversing theta and the horizontal loads reverses the acceleration, symmetric and
    with k = c = 1+m = 1+h = 1+v.
    """

    def gap(model: Any, ratio: float) -> float:
        def load(sign: int) -> Any:
            force = Harmonic(amplitude=sign * 0.4)
            push = -0.5
            return Load(
                frequency=1.3,
                horizontal=force,
                vertical=push,
                lower_horizontal=Harmonic(amplitude=sign * 0.4 * ratio),
                lower_vertical=push * ratio,
                ground_horizontal=Harmonic(amplitude=sign * 0.1),
            )

        states = rng.uniform(0.05, 1, (20, 3))
        sums = [
            model.acceleration(t, q, v, 1, load(1)) + model.acceleration(t, -q, -v, -1, load(-1))
            for t, q, v in states
        ]
        return float(max(map(abs, sums)))

    symmetric = gap(Metainterface(beta0=1.4, damping=0.1), 0.0)
    scaled = gap(
        Metainterface(
            beta0=1.4, damping=0.1, stiffness_ratio=1.7, mass_ratio=0.7, dissipation_ratio=1.7
        ),
        0.7,
    )
    unequal = gap(Metainterface(beta0=1.4, damping=0.1, stiffness_ratio=1.7), 0.0)
    upright = Metainterface(beta0=np.pi / 2, damping=0.1)
    return {
        "symmetry": symmetric,
        "symmetry_scaled": scaled,
        "symmetry_unequal": unequal,
        "pendulum": _pendulum(upright, rng),
    }


def _pendulum(model: Any, rng: np.random.Generator) -> float:
    load = Load(
        frequency=1.3,
        horizontal=Harmonic(amplitude=0.4),
        vertical=-0.5,
        ground_horizontal=Harmonic(amplitude=0.1),
    )
    system = System(model=model, load=load)
    return max(
        abs(
            float(pendulum_acceleration(system, t, s * q, v))
            - float(model.acceleration(t, s * q, v, s, load))
        )
        for t, q, v in rng.uniform(0.05, 1, (20, 3))
        for s in (1, -1)
    )


def _closed_layer() -> dict[str, float]:
    """The speed just after a crossing above which the closed layer's reaction has the wrong sign,
    beta0 = 80 deg, V = -0.5.
    """
    from scipy.optimize import brentq

    model = Metainterface(beta0=np.deg2rad(80.0))
    load = Load(vertical=-0.5)

    def reaction(speed: float) -> float:
        acceleration = model.acceleration(0.0, 0.0, speed, 1, load)
        return float(model.margins(0.0, 0.0, speed, acceleration, 1, load)["reaction"])

    return {
        "reaction_onset": float(brentq(reaction, 0.01, 5.0)),
        "reaction_slow": reaction(0.3),
        "reaction_fast": reaction(1.5),
    }


def measure(data: Any) -> dict[str, Measured]:
    """Section 3 and the reduction."""
    r = scalars(data)
    found = {
        "kinetic-energy": measured(r["kinetic"]),
        "lagrange": measured(r["lagrange"]),
        "virtual-work": measured(r["virtual_work"]),
        "operators": measured(r["operators"]),
        "linearised": measured(r["linear"]),
        "external-parametric": measured(
            r["external_80"] > 0.01 and r["parametric_80"] > 0.01 and r["excitation_still"] == 0.0
        ),
        "asymmetry": measured(r["symmetry_unequal"] > 1e-3),
        "reduction": measured(r["reduction"]),
        "one-open-layer": measured(
            r["reaction_fast"] >= 0, r["reaction_slow"] > 0 > r["reaction_fast"]
        ),
        "symmetry": measured(r["symmetry"]),
        "symmetry-general": measured(r["symmetry_scaled"] > 1e-9, r["symmetry_scaled"] < 1e-12),
        "pendulum": measured(r["pendulum"]),
        "ground-force": measured(r["force_printed"], r["force_corrected"]),
    }
    return with_fields(r | data.attrs, found)
