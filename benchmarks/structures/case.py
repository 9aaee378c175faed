"""The structure of each size: a bar of length 1 and wave speed 1, held at one end, pushed at the
other, which meets a wall.

Its mass is lumped, so that SciPy's way has no equation to solve for the reaction of the wall. The
impact is inelastic: with another restitution the node at the wall would bounce without end, which
neither of the others can follow.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

import saltus

FREQUENCY, AMPLITUDE, GAP = 1.3, 0.05, 0.02
OF_MASS, OF_STIFFNESS = 0.2, 0.002  # the damping, in parts of these
PERIODS = 10
END = PERIODS * 2.0 * math.pi / FREQUENCY
SOON = 1e-6  # after a release, when the gap is 0 by rounding, SciPy is not asked for an impact
SWEPT = np.linspace(1.2, 1.4, 5)


def matrices(size: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Mass, damping and stiffness; row 0 is the end that is pushed."""
    mass = np.eye(size) / size
    stiffness = size * (2.0 * np.eye(size) - np.eye(size, k=1) - np.eye(size, k=-1))
    mass[0, 0] /= 2.0
    stiffness[0, 0] /= 2.0
    return mass, OF_MASS * mass + OF_STIFFNESS * stiffness, stiffness


def bar(size: int) -> saltus.System:
    """For saltus."""
    mass, damping, stiffness = matrices(size)
    wall = saltus.Contact(name="wall", coordinate=0, position=-GAP)
    return saltus.System(
        model=saltus.Structure(
            mass=mass, damping=damping, stiffness=stiffness, contacts=[wall], forces={"push": 0}
        ),
        load=saltus.Load(frequency=FREQUENCY, push=saltus.Harmonic(AMPLITUDE)),
        impact=saltus.NewtonImpact(e=0.0),
    )


def chain(cells: int) -> saltus.System:
    """A row of cells of the paper under a load, for saltus; with both masses, as a motion ends
    where a massless one is free.
    """
    return saltus.System(
        model=saltus.CellChain(cells=cells, beta0=math.radians(80), damping=0.1, mass_ratio=1.0),
        load=saltus.Load(frequency=1.0, horizontal=saltus.Harmonic(0.5), vertical=-0.5),
        impact=saltus.NewtonImpact(e=0.0),
    )


def by_scipy(size: int, tol: float) -> np.ndarray:
    """The displacements at the end by DOP853, restarted at each impact and each release, which its
    events find.
    """
    mass, damping, stiffness = matrices(size)
    inertia, t, held, since = np.diag(mass), 0.0, False, 0.0
    of_state = -np.hstack([stiffness, damping])

    def pushed(t: float, y: np.ndarray) -> np.ndarray:
        force = of_state @ y
        force[0] += AMPLITUDE * math.sin(FREQUENCY * t)
        return force

    def slope(t: float, y: np.ndarray) -> np.ndarray:
        rate = np.concatenate([y[size:], pushed(t, y) / inertia])
        if held:
            rate[0] = rate[size] = 0.0
        return rate

    def event(t: float, y: np.ndarray) -> float:
        return float(pushed(t, y)[0] if held else y[0] + GAP + (t < since + SOON))

    event.terminal = True  # type: ignore[attr-defined]
    y = np.zeros(2 * size)
    while t < END:
        event.direction = 1.0 if held else -1.0  # type: ignore[attr-defined]
        part = solve_ivp(slope, (t, END), y, "DOP853", events=event, rtol=tol, atol=0.01 * tol)
        if part.status < 0:
            raise RuntimeError(part.message)
        t, y = float(part.t[-1]), part.y[:, -1].copy()
        if part.status == 1:
            y[0], y[size] = -GAP, 0.0
            held, since = not held and pushed(t, y)[0] < 0.0, t
    return y[:size]


def for_siconos(size: int, steps: int) -> dict[str, Any]:
    """What march.py of the folder siconos is asked for."""
    mass, damping, stiffness = (matrix.tolist() for matrix in matrices(size))
    row, wave = [float(i == 0) for i in range(size)], [AMPLITUDE, FREQUENCY]
    return {
        "mass": mass,
        "damping": damping,
        "stiffness": stiffness,
        "wave": wave,
        "rows": [row],
        "offsets": [GAP],
        "e": [0.0],
        "position": [0.0] * size,
        "velocity": [0.0] * size,
        "duration": END,
        "steps": steps,
        "rounds": 1,
    }
