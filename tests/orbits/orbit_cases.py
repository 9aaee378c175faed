"""Systems of the orbit tests, few structures among them: what differs is numbers, and each
structure is compiled once.
"""

import functools
import math

import numpy as np
from shared_systems import forced, hinged, paired, rocking, shaken, walled

from saltus import (
    System,
    find_orbit,
)
from saltus.orbits.equations.one_contact import OneContactEquations
from saltus.orbits.signature import Signature

FREQUENCY = "load.frequency"
FORCED = (FREQUENCY, "load.horizontal.amplitude", "model.beta0", "model.mass_ratio", "impact.e")
SHAKEN = (FREQUENCY, "impact.r")
WALLED = (FREQUENCY, "load.force.amplitude", "model.wall")
ROCKING = (FREQUENCY, "model.alpha")
HINGED = (FREQUENCY, "model.edge", "impact.e")
SMOOTHED = (FREQUENCY,)
PAIRED = (FREQUENCY, "model.coupling")

CASES = {
    "forced": (forced(k=1.2, m=0.2, c=0.7, H=0.4, mean=0.1, phase=0.3, e=0.9), FORCED),
    "shaken": (shaken(), SHAKEN),
    "walled": (walled(wall=0.7), WALLED),
    "rocking": (rocking(), ROCKING),
    "hinged": (hinged(), HINGED),
}


def random_guess(
    rng: np.random.Generator, system: System, paths: tuple[str, ...], impacts: int, periods: int = 1
):
    """A problem and unknowns that solve nothing: the equations are smooth there as well.

    The last segment runs back in time.
    """
    both = len(system.model.sides) == 2
    sides = tuple((-1) ** i if both else 1 for i in range(impacts))
    problem = OneContactEquations(system, Signature(sides, periods), paths)
    phases = np.sort(rng.uniform(0.0, 2.4 * math.pi * periods, impacts))
    return problem, np.stack([phases, rng.uniform(0.2, 0.9, impacts)], axis=1).ravel()


SIXTH_ORDER = ((1, 45 / 60), (2, -9 / 60), (3, 1 / 60))


def slope(function, x: np.ndarray, column: int, h: float = 2e-3) -> np.ndarray:
    """The derivative in one argument by central differences of sixth order."""
    step = np.zeros_like(x)
    step[column] = h
    return (
        sum(weight * (function(x + j * step) - function(x - j * step)) for j, weight in SIXTH_ORDER)
        / h
    )


PAIRED_START = {"x": 0.3, "y": 0.1, "velocity": (0.0, 0.0)}
WALL_IMPACTS = walled(A=0.5, wall=0.7)  # one impact a period

ORBITS = {  # system, paths, start: one of each kind
    "symmetric": (forced(), FORCED, {"theta": 0.3}),
    "unequal layers, losses": (*CASES["forced"], {"theta": 0.6}),
    "ground, restitution of energy": (*CASES["shaken"], {"theta": 0.5}),
    "period 3": (forced(H=1.0, W=2.4), FORCED, {"theta": -2.0}),
    "period 3, large": (forced(H=1.0, W=2.4), FORCED, {"theta": 2.0}),
    "small": (forced(H=1.0, W=2.5), FORCED, {"theta": 0.3}),
    "six impacts": (forced(H=0.5, W=0.1), FORCED, {"theta": 0.3}),
    "ten impacts": (forced(H=0.5, W=0.05), FORCED, {"theta": 0.3}),
    "around a deformed equilibrium": (forced(H=0.3, V=-1.6), FORCED, {"theta": -1.2}),
    "wall, free": (*CASES["walled"], {"x": 0.2}),
    "wall, one impact": (WALL_IMPACTS, WALLED, {"x": 0.2}),
    "wall, one impact in two periods": (walled(A=0.3, W=0.9, wall=0.7), WALLED, {"x": 0.2}),
    "rocking block": (*CASES["rocking"], {"theta": 0.01}),
    "a user's model": (*CASES["hinged"], {"x": 1.2}),
    "a user's smooth model": (paired(), PAIRED, PAIRED_START),
    "smoothed": (forced(smoothing=50.0), SMOOTHED, {"theta": 0.3}),
}


@functools.cache
def orbit_of(name):
    """The orbit of one of the cases."""
    system, paths, start = ORBITS[name]
    return find_orbit(system, parameters=paths, **start)
