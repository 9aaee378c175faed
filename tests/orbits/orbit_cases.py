"""Systems of the orbit tests, few structures among them: what differs is numbers, and each structure is compiled once."""

import functools
import math
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from saltus import (
    EnergyRestitution,
    Harmonic,
    Load,
    Metainterface,
    Model,
    RockingBlock,
    System,
    VelocityReduction,
    WallOscillator,
    find_orbit,
)
from saltus.orbits.problem import Problem
from saltus.orbits.signature import Signature

BETA80 = math.radians(80)


def forced(beta0=BETA80, C=0.1, k=1.0, m=0.0, c=1.0, V=-0.5, H=0.5, mean=0.0, phase=0.0, W=1.0, e=1.0):
    """A metainterface under H(t) = mean + H sin(W t + phase) and a constant V."""
    return System(
        model=Metainterface(beta0=beta0, damping=C, stiffness_ratio=k, mass_ratio=m, dissipation_ratio=c),
        load=Load(frequency=W, horizontal=Harmonic(amplitude=H, mean=mean, phase=phase), vertical=V),
        impact=VelocityReduction(e),
    )


def shaken(zeta=0.3, nu=0.05, r=0.9, m=0.2, W=1.1):
    """Unequal layers on a ground that moves both ways, with a restitution of energy."""
    return System(
        model=Metainterface(beta0=BETA80, damping=0.1, stiffness_ratio=1.2, mass_ratio=m, dissipation_ratio=0.8),
        load=Load(
            frequency=W,
            ground_horizontal=Harmonic(amplitude=zeta),
            ground_vertical=Harmonic(amplitude=nu, phase=0.4),
            vertical=-0.5,
        ),
        impact=EnergyRestitution(r),
    )


def walled(A=0.2, W=1.3, k=1.0, c=0.1, wall=1.0, e=0.8, mean=0.0):
    """The impact oscillator under mean + A cos(W t)."""
    return System(
        model=WallOscillator(stiffness=k, damping=c, wall=wall),
        load=Load(frequency=W, force=Harmonic(amplitude=A, mean=mean, phase=math.pi / 2)),
        impact=VelocityReduction(e),
    )


def rocking(a=1.5, W=5.0, alpha=0.25):
    """A rocking block with Housner's impacts; the ground moves with the acceleration -a alpha sin(W t)."""
    from saltus import InelasticImpact

    return System(
        model=RockingBlock(alpha=alpha),
        load=Load(frequency=W, ground_horizontal=Harmonic(amplitude=a * alpha / W**2)),
        impact=InelasticImpact(),
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class Hinge(Model):
    """A user's model: a cubic spring and a bias s f at x = `edge`, which the motion goes through, the gap in units of its own."""

    edge: float = 0.4
    cubic: float = 0.2
    damping: float = 0.1
    bias: float = -0.3

    coordinates: ClassVar[tuple[str, ...]] = ("x",)
    channels: ClassVar[tuple[str, ...]] = ("push",)

    @property
    def contact(self) -> Any:
        return self.edge

    def gap(self, x: Any, side: Any) -> Any:
        return 2.5 * side * (x - self.edge)

    def acceleration(self, t: Any, x: Any, velocity: Any, side: Any, load: Load) -> Any:
        far = x - self.edge
        return load.push(t) - self.damping * velocity - far - self.cubic * far**3 + side * self.bias


def hinged(push=0.6, W=0.9, edge=0.4, e=0.95, **numbers):
    """The user's model under a harmonic push."""
    return System(
        model=Hinge(edge=edge, **numbers),
        load=Load(frequency=W, push=Harmonic(amplitude=push)),
        impact=VelocityReduction(e),
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class Pair(Model):
    """A user's smooth model of two degrees of freedom: cubic springs, a coupling, a damper each."""

    coupling: float = 0.3
    cubic: float = 0.4
    damping: float = 0.15

    coordinates: ClassVar[tuple[str, ...]] = ("x", "y")
    channels: ClassVar[tuple[str, ...]] = ("force",)
    sides: ClassVar[tuple[int, ...]] = ()

    def acceleration(self, t, position, velocity, side, load):
        (x, y), (u, v) = position, velocity
        pull = self.coupling * (x - y)
        return (
            load.force(t) - self.damping * u - x - self.cubic * x**3 - pull,
            -self.damping * v - 1.5 * y - self.cubic * y**3 + pull,
        )


def paired(force=0.5, W=1.2, **numbers):
    """The smooth pair under a harmonic force on the first mass."""
    return System(model=Pair(**numbers), load=Load(frequency=W, force=Harmonic(amplitude=force)))


def smoothed(B=50.0, H=0.5, W=1.0):
    """The paper's system with its sign smoothed."""
    return System(
        model=Metainterface(beta0=BETA80, damping=0.1, smoothing=B),
        load=Load(frequency=W, horizontal=Harmonic(amplitude=H), vertical=-0.5),
    )


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


def random_guess(rng: np.random.Generator, system: System, paths: tuple[str, ...], impacts: int, periods: int = 1):
    """A problem and unknowns that solve nothing: the equations are smooth there as well. The last segment runs back in time."""
    both = len(system.model.sides) == 2
    sides = tuple((-1) ** i if both else 1 for i in range(impacts))
    problem = Problem(system, Signature(sides, periods), paths)
    phases = np.sort(rng.uniform(0.0, 2.4 * math.pi * periods, impacts))
    return problem, np.stack([phases, rng.uniform(0.2, 0.9, impacts)], axis=1).ravel()


SIXTH_ORDER = ((1, 45 / 60), (2, -9 / 60), (3, 1 / 60))


def slope(function, x: np.ndarray, column: int, h: float = 2e-3) -> np.ndarray:
    """The derivative in one argument by central differences of sixth order."""
    step = np.zeros_like(x)
    step[column] = h
    return sum(weight * (function(x + j * step) - function(x - j * step)) for j, weight in SIXTH_ORDER) / h


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
    "smoothed": (smoothed(), SMOOTHED, {"theta": 0.3}),
}


@functools.cache
def orbit_of(name):
    """The orbit of one of the cases."""
    system, paths, start = ORBITS[name]
    return find_orbit(system, parameters=paths, **start)
