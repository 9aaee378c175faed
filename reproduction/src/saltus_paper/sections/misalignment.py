"""Section 2 on the misalignment phi: the same equilibria as in theta, a bifurcation in phi, and why
phi is not integrated.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from saltus import Load, Metainterface, System, UnitCell, simulate
from saltus.theory import equilibria
from saltus_paper.claims.claim import Measured, measured, with_fields
from saltus_paper.figure_data import TOLERANCE, scalar_dataset, scalars

ALPHA0 = math.radians(45.0)
BETA0 = math.radians(80.0)
DISTANCES = (1e-2, 1e-6, 1e-10)  # from the impact, of the ends of the integrations


def compute(loads: int = 30) -> Any:
    """Equilibria in both angles under random loads, and the work of integrating each angle up to an
    impact.
    """
    values = {**_equilibria(np.random.default_rng(5), loads), **_bifurcation(), **_integration()}
    return scalar_dataset(values, what="the misalignment angle", tol=TOLERANCE, loads=loads)


def _energy(
    cell: Any, phi: np.ndarray, layer: int, horizontal: float, vertical: float
) -> np.ndarray:
    """Spring energy less the work of both forces, from the places of the mass as functions of phi_j
    alone (m = 0, k = 1).
    """
    theta = cell.theta(phi, layer=layer)
    return np.asarray(
        theta**2 / 2
        - horizontal * cell.xi(theta)
        - vertical * (cell.eta(theta) - math.sin(cell.beta0))
    )


def _minima(
    cell: Any, layer: int, horizontal: float, vertical: float
) -> tuple[list[float], list[float]]:
    """The theta of the minima and of the maxima of that energy over phi_j, on a grid that is denser
    towards the straight line.
    """
    phi = np.sin(np.linspace(-1, 1, 20001) * math.pi / 2) * cell.max_misalignment
    energy = _energy(cell, phi, layer, horizontal, vertical)
    turns = np.diff(energy)
    at = [np.flatnonzero((sign * turns[:-1] < 0) & (sign * turns[1:] >= 0)) + 1 for sign in (1, -1)]
    low, high = (
        [float(cell.theta(phi[i], layer=layer)) for i in found if phi[i] >= -1e-12] for found in at
    )
    return low, high


def _equilibria(rng: np.random.Generator, loads: int) -> dict[str, float]:
    """How many equilibria within the straight line the two angles do not share, over random loads
    and both layers.
    """
    cell = UnitCell(alpha0=ALPHA0, beta0=BETA0)
    wrong = 0
    deformed = 0
    for horizontal, vertical in zip(
        rng.uniform(-0.6, 0.6, loads), rng.uniform(-2.0, 1.0, loads), strict=True
    ):
        load = Load(horizontal=float(horizontal), vertical=float(vertical))
        known = equilibria(System(model=Metainterface(beta0=BETA0), load=load))
        for layer, side in ((1, 1), (2, -1)):
            for stable, found in zip(
                (True, False), _minima(cell, layer, horizontal, vertical), strict=True
            ):
                away = [x for x in found if abs(x) > 1e-3]
                expected = [
                    p.theta
                    for p in known
                    if p.stable is stable and p.within_line and side * p.theta > 1e-3
                ]
                same = len(away) == len(expected) and np.allclose(
                    sorted(away), sorted(expected), atol=2e-3
                )
                wrong, deformed = wrong + (not same), deformed + len(expected)
    return {"equilibria_wrong": wrong, "equilibria_deformed": deformed}


def _bifurcation() -> dict[str, float]:
    """The stationary phi_1 at small openings just below and above V = 0 at H = 0, beta0 below 90
    degrees.
    """
    cell = UnitCell(alpha0=ALPHA0, beta0=BETA0)

    def count(vertical: float) -> int:
        phi = np.linspace(-0.5, 0.5, 4001)
        turns = np.sign(np.diff(_energy(cell, phi, 1, 0.0, vertical)))
        return int((np.diff(turns) != 0).sum())

    return {"stationary_below": count(-0.02), "stationary_above": count(0.02)}


def _integration() -> dict[str, float]:
    """Evaluations of the right-hand side that RK45 at 1e-8 needs up to `DISTANCES` from an impact,
    in theta and in phi.
    """
    cell = UnitCell(alpha0=ALPHA0, beta0=BETA0)
    system = System(model=Metainterface(beta0=BETA0, damping=0.1), load=Load(vertical=-0.5))
    impact = float(
        simulate(system, theta=0.4, velocity=0.0, duration=4.0, tol=TOLERANCE).impacts.time[0]
    )

    def in_theta(t: float, y: np.ndarray) -> list[float]:
        return [y[1], float(system.model.acceleration(t, y[0], y[1], 1, system.load))]

    def in_phi(t: float, y: np.ndarray) -> list[float]:
        """phi'' from theta'' = g' phi'' + g'' phi'^2 with theta = g(phi) of `gen_conf`."""
        tangent = math.tan(y[0])
        secant2 = 1 / math.cos(y[0]) ** 2
        beta = float(cell.beta_of_phi(y[0]))
        first = 2 * cell.psi * tangent * secant2 / math.sin(beta)
        bend = 2 * cell.psi * (secant2**2 + 2 * tangent**2 * secant2)
        second = (bend - first**2 * math.cos(beta)) / math.sin(beta)
        theta = beta - cell.beta0
        acceleration = float(system.model.acceleration(t, theta, first * y[1], 1, system.load))
        return [y[1], (acceleration - second * y[1] ** 2) / first]

    starts = {"theta": (in_theta, 0.4), "phi": (in_phi, float(cell.phi(0.4)))}
    return {
        f"work_{name}_{i}": _work(function, start, impact - distance)
        for name, (function, start) in starts.items()
        for i, distance in enumerate(DISTANCES)
    }


def _work(function: Any, start: float, duration: float) -> int:
    from scipy.integrate import solve_ivp

    return int(
        solve_ivp(function, (0.0, duration), (start, 0.0), method="RK45", rtol=1e-8, atol=1e-8).nfev
    )


def measure(data: Any) -> dict[str, Measured]:
    """Section 2 on phi."""
    r = scalars(data)
    near_theta = r["work_theta_2"]
    near_phi = r["work_phi_2"]
    found = {
        "quasi-static-equivalence": measured(
            r["equilibria_wrong"] == 0 and r["equilibria_deformed"] > 20
        ),
        "phi-bifurcation": measured(r["stationary_below"] == 1 and r["stationary_above"] == 3),
        "phi-integration": measured(
            near_phi > 3 * near_theta
            and r["work_phi_2"] > r["work_phi_1"] > r["work_phi_0"]
            and near_theta < 1.2 * r["work_theta_0"]
        ),
    }
    return with_fields(r | {"loads": int(data.attrs["loads"]), "distances": list(DISTANCES)}, found)
