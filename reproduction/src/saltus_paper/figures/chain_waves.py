"""A row of cells beside one cell: its systems, its waves, and their multipliers from the linear
equations of one cell.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

from saltus import (
    CellChain,
    Metainterface,
    NewtonImpact,
    System,
    VelocityReduction,
    continue_orbit,
    find_orbit,
    simulate,
)
from saltus_paper.figures.both_layers import embedded
from saltus_paper.figures.harmonic_loads import AMPLITUDE, BETA0, DAMPING, VERTICAL, under_force

CELLS = 8
CROSSING = -math.cos(
    2 * math.radians(BETA0)
)  # the velocity factor of a perfectly inelastic contact without friction (erratum 25)
PERIOD = 2 * math.pi  # of the load: Omega = 1
# Hcr, below which the undeformed state is held
CRITICAL = abs(VERTICAL / math.tan(math.radians(BETA0)))


@dataclass(frozen=True, slots=True, kw_only=True)
class ChainSettings:
    """Loads, couplings and lengths of the chapter."""

    begin: float = 0.15  # Hhat at which the motion of one cell is found, from `swing` at rest.
    swing: float = 0.4
    # Hhat of its branch: from below its fold to where the closed layer opens.
    range: tuple[float, float] = (0.03, 0.2)
    load: float = 0.06  # Hhat of the waves and patterns: above the fold of one cell, below Hcr.
    couplings: tuple[float, float] = (0.02, 2.0)  # kappa.
    # rad by which the cells are put apart, at random; `tiny` where multipliers are measured.
    disturbed: float = 1e-3
    tiny: float = 1e-7
    settling: int = 400  # Forcing periods before a pattern is read from the `read` last ones.
    read: int = 4
    moves: float = 0.01  # rad, of a cell that counts as moving.
    step: float = 0.001  # of Hhat, when the load is taken off.
    dwell: int = 60  # Forcing periods at each value of it.
    waves: tuple[float, float] = (0.2, 1.0)  # kappa of the pictures of waves.


SETTINGS = ChainSettings()


def cell(amplitude: float, crossing: float = CROSSING) -> System:
    """The paper's cell under load (i) at Omega = 1."""
    model = Metainterface(beta0=math.radians(BETA0), damping=DAMPING)
    return System(
        model=model, load=under_force(1.0, amplitude).load, impact=VelocityReduction(crossing)
    )


def chain(amplitude: float, coupling: float, cells: int = CELLS) -> System:
    """Cells with both layers, m = 0 and contacts without friction and restitution, under the same
    load.
    """
    model = CellChain(beta0=math.radians(BETA0), damping=DAMPING, cells=cells, coupling=coupling)
    return System(model=model, load=under_force(1.0, amplitude).load, impact=NewtonImpact(e=0.0))


def wave_numbers(cells: int = CELLS) -> np.ndarray:
    """mu_q = 4 sin^2(pi q / 2 n): the eigenvalues of the differences between neighbours in a row
    with free ends, (n,).
    """
    return 4 * np.sin(np.pi * np.arange(cells) / (2 * cells)) ** 2


def shapes(cells: int = CELLS) -> np.ndarray:
    """The waves cos(pi q (j + 1/2) / n) that belong to them, with length 1, (n, n): a row for each
    wave.
    """
    waves = np.cos(np.pi * np.outer(np.arange(cells), np.arange(cells) + 0.5) / cells)
    return np.asarray(waves / np.linalg.norm(waves, axis=1)[:, None])


def branch_of(crossing: float = CROSSING) -> Any:
    """The branch of the motion of one cell over Hhat."""
    start = find_orbit(cell(SETTINGS.begin, crossing), theta=SETTINGS.swing)
    return continue_orbit(start, AMPLITUDE, SETTINGS.range)


def borders(branch: Any) -> tuple[float, float]:
    """Hhat of the fold at which the motion is born, and Hhat from which the closed layer opens."""
    two = [point for point in branch.special if point.orbit.impact_count == 2]
    fold = max(
        (point for point in two if point.kind == "LP"), key=lambda point: point.orbit.amplitude
    )
    return fold.parameter, next(point.parameter for point in two if point.kind == "reaction")


def orbit_at(branch: Any, amplitude: float) -> Any:
    """The stable motion of one cell at a load: the largest one."""
    return max(
        (orbit for orbit in branch.at(amplitude) if orbit.stable), key=lambda orbit: orbit.amplitude
    )


def turning(orbit: Any) -> tuple[float, np.ndarray]:
    """A time at which the cell is far from its contact, a quarter of a period after an impact, and
    (theta, theta') there.
    """
    motion = simulate(orbit.system, **orbit.start(), duration=PERIOD / 4, tol=1e-12)
    return motion.time, np.ravel(motion.final_state)


def transverse(orbit: Any, stiffness: np.ndarray) -> np.ndarray:
    """The maps over a period of small differences between cells that move alike, (k, 2, 2), from
    their linear equations.

    In the wave q of a row the springs are one of the stiffness sigma = kappa mu_q to the motion of
    all cells, so that

        d'' + C d' + [1 - s H cos(beta) + V sin(beta) + (2 if s > 0 else 1) sigma sin^2(beta)] d =
        0,   beta = beta0 + abs(theta),

    on the side s: with the lower layer open both masses move, with the upper one open one. At a
    crossing with the velocity v and the factor g, d+ = g d and d'+ = g d' - (g a - a+) d / v, where
    a and a+ are the accelerations before and after it. What the springs do there is of second
    order. The equations are integrated with SciPy, along the motion.
    """
    load = float(orbit.system.get(AMPLITUDE))
    crossing = float(orbit.system.get("impact.e"))
    beta0 = math.radians(BETA0)

    def rates(t: float, y: np.ndarray, side: float) -> np.ndarray:
        beta = beta0 + abs(y[0])
        force = load * math.sin(t)
        own = -DAMPING * y[1] - y[0] + force * math.sin(beta) + side * VERTICAL * math.cos(beta)
        slope = -1 + side * force * math.cos(beta) - VERTICAL * math.sin(beta)
        d = y[2:].reshape(2, 2, -1)
        slopes = slope - (2 if side > 0 else 1) * stiffness * math.sin(beta) ** 2
        return np.concatenate(
            [[y[1], own], np.stack([d[1], slopes * d[0] - DAMPING * d[1]]).ravel()]
        )

    def gap(t: float, y: np.ndarray, side: float) -> float:
        return side * float(y[0])

    gap.terminal = True  # type: ignore[attr-defined]
    gap.direction = -1  # type: ignore[attr-defined]
    time, state = turning(orbit)
    end = time + PERIOD
    side = math.copysign(1.0, state[0])
    y = np.concatenate([state, np.repeat(np.eye(2)[:, :, None], stiffness.size, axis=2).ravel()])
    while True:
        found = solve_ivp(
            rates, (time, end), y, "DOP853", events=gap, args=(side,), rtol=1e-10, atol=1e-12
        )
        time = float(found.t[-1])
        y = found.y[:, -1]
        if found.status == 0:
            return np.moveaxis(y[2:].reshape(2, 2, -1), -1, 0)
        y[0], before, y[1] = 0.0, y[1], crossing * y[1]
        old, new = (
            rates(time, np.append([0.0, v], y[2:]), s)[1]
            for v, s in ((before, side), (y[1], -side))
        )
        d = y[2:].reshape(2, 2, -1)
        y[2:] = np.stack(
            [crossing * d[0], crossing * d[1] - (crossing * old - new) / before * d[0]]
        ).ravel()
        side = -side


def largest(maps: np.ndarray) -> np.ndarray:
    """The multiplier of largest modulus of each map, (k,)."""
    values = np.linalg.eigvals(maps)
    return np.asarray(values[np.arange(len(values)), np.abs(values).argmax(axis=1)])


def begun(system: System, states: np.ndarray, time: float) -> dict[str, Any]:
    """The start of a chain from (theta, theta') of each cell, one layer of which is closed."""
    both = embedded(states)
    angles = dict(zip(system.model.coordinates, both[:, :2].ravel().tolist(), strict=True))
    return angles | {"velocity": tuple(both[:, 2:].ravel().tolist()), "time": time}


def angles_at(motion: Any, times: np.ndarray) -> np.ndarray:
    """theta of each cell, (cells, times): the sum of both layers' angles, of which one is 0 while
    its layer is closed.
    """
    return np.asarray(
        motion.at(np.minimum(times, motion.time))[0].reshape(-1, 2, len(times)).sum(axis=1)
    )


def of_waves(
    modes: Any, coupling: float, load: float | None = None, cells: int = CELLS
) -> np.ndarray:
    """The largest moduli of the multipliers of the waves q = 1, ..., n - 1 of a row, (n - 1,), or
    (loads, n - 1) at all loads.
    """
    sigma = np.log(coupling * wave_numbers(cells)[1:])
    rows = [
        np.interp(sigma, np.log(modes["stiffness"].values), row) for row in modes["modulus"].values
    ]
    if load is None:
        return np.array(rows)
    return np.array(
        [np.interp(load, modes["amplitude"].values, column) for column in np.transpose(rows)]
    )


def at_load(load: float) -> Any:
    """The motion of one cell at a load above its fold."""
    start = find_orbit(cell(SETTINGS.begin), theta=SETTINGS.swing)
    return orbit_at(continue_orbit(start, AMPLITUDE, (load, SETTINGS.begin + 0.01)), load)


def kept_states(states: Any) -> tuple[np.ndarray, np.ndarray]:
    """For each coupling, from how many starts exactly those cells move at last that began to, and
    how many sets of moving cells there are at last."""
    same = (states["moving"].values == states["begun"].values).all(axis=2).sum(axis=1)
    pairs = zip(states["moving"].values, states["ended"].values, strict=True)
    sets = [len({tuple(row) for row in ends[~ended].tolist()}) for ends, ended in pairs]
    return np.asarray(same), np.array(sets)
