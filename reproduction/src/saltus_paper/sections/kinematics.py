"""Section 2: geometry, kinematics and dimensionless numbers of the unit cell (errata 1, 2, 3, 13,
19, 20).
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from saltus import PhysicalCell, UnitCell
from saltus_paper.claims.claim import Measured, measured, with_fields
from saltus_paper.figure_data import scalar_dataset, scalars

UNIT_CELLS = ((0.5, 1.2), (0.8, 1.4), (1.1, 0.9), (0.6, 1.9))  # alpha0, beta0, rad


def compute() -> Any:
    """Largest residuals over several cells and openings."""
    rows = [_cell(*angles) for angles in UNIT_CELLS]
    worst = {name: max(row[name] for row in rows) for name in rows[0]}
    values = {**worst, **_limits(), **_dimensions(), "closing_cells": _closing_cells()}
    return scalar_dataset(values, what="residuals of the kinematics")


def _cell(alpha0: float, beta0: float) -> dict[str, float]:
    cell = UnitCell(alpha0=alpha0, beta0=beta0)
    theta = np.linspace(1e-3, 0.95 * cell.line_limit, 60)
    phi = np.asarray(cell.phi(theta))
    chi_printed = math.sin(2 * alpha0 + beta0) / math.sin(alpha0 + beta0)
    base = cell.psi / (2 * cell.lambda_)
    misread = math.sin(beta0**2) / (2 * math.sin(alpha0) * math.sin(alpha0 + beta0))
    exact = np.cos(cell.alpha_of_phi(phi))
    return {
        "chi_printed": abs(base + chi_printed - math.cos(alpha0)),
        "chi_corrected": abs(base + cell.chi - math.cos(alpha0)),
        "psi_misread": abs(misread / (2 * cell.lambda_) + cell.chi - math.cos(alpha0)),
        "theta_1_drop": float((cell.beta_of_phi(phi) - beta0).max()),
        "theta_1_corrected": float(abs(cell.theta(phi, layer=1) - theta).max()),
        "configalpha_printed": float(
            abs(_cos_alpha(cell, beta0 - theta, chi_printed) - exact).max()
        ),
        "configalpha_corrected": float(
            abs(_cos_alpha(cell, beta0 + theta, cell.chi) - exact).max()
        ),
        "closed_side": float(max(beta0 - cell.beta_of_phi(sign * phi).min() for sign in (1, -1))),
        **_drawn(cell, theta[::10]),
    }


def _cos_alpha(cell: Any, angle: np.ndarray, chi: float) -> np.ndarray:
    """cos(alpha_j) of `configalpha` with the given argument of its cosine and the given chi."""
    lowering = math.cos(cell.beta0) - np.cos(angle)
    root = np.sqrt(np.abs(cell.psi / (lowering + cell.psi)))
    return np.asarray(root * (lowering + 2 * cell.lambda_ * chi + cell.psi) / (2 * cell.lambda_))


def _drawn(cell: Any, openings: np.ndarray) -> dict[str, float]:
    """The constructed positions: lengths of the bars, angles alpha_j, displacements xi_j and
    heights eta_j.
    """
    lengths = 0.0
    angles = 0.0
    places = 0.0
    turns = 0.0
    for one, two in zip(openings, -openings[::-1], strict=True):
        layout = cell.layout(float(one), float(two))
        bars = [np.diff(layout.segment(pair), axis=0)[0] for pair in layout.bars]
        wanted = [cell.base, 1, 1, cell.base, 1, 1, cell.base, *[cell.lambda_] * 4]
        lengths = max(
            lengths,
            *(
                abs(float(np.hypot(*bar)) - length)
                for bar, length in zip(bars, wanted, strict=True)
            ),
        )
        turns = max(turns, *(abs(math.atan2(bar[1], bar[0])) for bar in (bars[3], bars[6])))
        run = layout.points["middle_right"] - layout.points["lower_left"]
        angles = max(angles, abs(math.atan2(run[1], run[0]) - float(cell.alpha(one))))
        offset = math.sin(cell.alpha0 - cell.beta0) / (2 * math.sin(cell.alpha0))
        step = layout.points["mass_2"] - layout.points["mass_1"]
        found = (
            layout.points["mass_1"][0] + offset,
            layout.points["mass_1"][1],
            step[0] - math.cos(cell.beta0),
            step[1],
        )
        stated = (cell.xi(one), cell.eta(one), cell.xi(two), cell.eta(two))
        places = max(places, *(abs(a - b) for a, b in zip(found, stated, strict=True)))
    return {
        "bar_lengths": lengths,
        "alpha_drawn": angles,
        "places": places,
        "top_edges_turn": turns,
    }


def _closing_cells(count: int = 40) -> int:
    """For how many pairs of angles in (0, pi) `restangle` disagrees with the existence of a
    triangle with positive edges.

    The base, the inclined bar of length 1 and the diagonal meet where two rays from the base's
    ends, at alpha0 and beta0, cross.
    """
    wrong = 0
    for alpha0 in np.linspace(0.05, 3.1, count):
        for beta0 in np.linspace(0.05, 3.1, count):
            rays = np.array(
                [[math.cos(alpha0), math.cos(beta0)], [math.sin(alpha0), -math.sin(beta0)]]
            )
            diagonal, bar = np.linalg.solve(rays, [1.0, 0.0])
            wrong += bool(diagonal > 0 and bar > 0) != (alpha0 + beta0 < math.pi)
    return wrong


def _limits() -> dict[str, float]:
    """The straight line and the kinematic limit at beta0 = 80 degrees."""
    cell = UnitCell(alpha0=math.radians(45), beta0=math.radians(80))
    theta = np.linspace(0, cell.kinematic_limit, 2001)
    return {
        "line_limit": math.degrees(cell.line_limit),
        "height_on_line": float(cell.eta(cell.line_limit)),
        "kinematic_limit": math.degrees(cell.kinematic_limit),
        "phi_at_limit": float(cell.phi(cell.kinematic_limit)),
        "cosine_needed_beyond": float(
            math.cos(cell.beta0) - np.cos(cell.beta0 + cell.kinematic_limit + 0.01)
        ),
        "largest_displacement": float(np.max(cell.xi(theta))),
        "bound": cell.max_displacement,
        "second_line": math.degrees(2 * math.pi - cell.beta0),
    }


def _dimensions() -> dict[str, float]:
    """One cell written in seconds and in milliseconds: a number that changes has a dimension, as t
    sqrt(M2 / K2), unlike tau.
    """
    seconds = PhysicalCell(length=0.2, upper_mass=1.5, upper_stiffness=3.0, upper_damping=0.07)
    millis = PhysicalCell(length=0.2, upper_mass=1.5, upper_stiffness=3.0e-6, upper_damping=0.07e-3)
    inertia = seconds.upper_mass * seconds.length**2
    return {
        "damping_printed_ratio": (millis.upper_damping / inertia)
        / (seconds.upper_damping / inertia),
        "damping_ratio": millis.ratios["damping"] / seconds.ratios["damping"],
        "tau_printed": math.sqrt(seconds.upper_mass / seconds.upper_stiffness) * 1.0,
        "tau_corrected": 1.0 / seconds.units["time"],
        "tau_of_frequency": 1 / math.sqrt(inertia / seconds.upper_stiffness),
    }


def measure(data: Any) -> dict[str, Measured]:
    """Section 2."""
    r = scalars(data)
    found = {
        "chi": measured(r["chi_printed"], r["chi_corrected"]),
        "one-sided": measured(max(0.0, r["closed_side"])),
        "restangle": measured(r["closing_cells"] == 0),
        "rotary-inertia": measured(r["top_edges_turn"]),
        "theta-definition": measured(r["theta_1_drop"] <= 0, r["theta_1_corrected"] < 1e-10),
        "configalpha": measured(r["configalpha_printed"], r["configalpha_corrected"]),
        "geometry": measured(max(r["bar_lengths"], r["alpha_drawn"])),
        "configdbeta": measured(r["places"]),
        "line-limit": measured(r["line_limit"]),
        "kinematic-limit": measured(
            r["second_line"] <= r["kinematic_limit"],
            r["second_line"] > r["kinematic_limit"]
            and abs(r["phi_at_limit"]) < 1e-6
            and r["cosine_needed_beyond"] < 0,
        ),
        "max-displacement": measured(max(0.0, r["largest_displacement"] - r["bound"])),
        "damping-dimension": measured(r["damping_printed_ratio"] - 1, r["damping_ratio"] - 1),
        "time-scale": measured(
            r["tau_printed"] - r["tau_of_frequency"], r["tau_corrected"] - r["tau_of_frequency"]
        ),
    }
    return with_fields(r | {"cells": len(UNIT_CELLS)}, found)
