"""Branches at random parameters of all models, a user's own among them, for tests of what holds on
any branch.
"""

import math
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from shared_systems import BETA80, forced, hinged, rocking, shaken, walled

from saltus import (
    Harmonic,
    Load,
    Metainterface,
    Model,
    OneContactModel,
    SaltusError,
    System,
    VelocityReduction,
    find_orbit,
)

FREQUENCY = "load.frequency"


@dataclass(frozen=True, slots=True, kw_only=True)
class Smooth(Model):
    """What the models without contact have in common."""

    damping: float = 0.1

    coordinates: ClassVar[tuple[str, ...]] = ("x",)
    channels: ClassVar[tuple[str, ...]] = ("push",)


@dataclass(frozen=True, slots=True, kw_only=True)
class Pendulum(Smooth):
    """x'' + c x' + sin x = F."""

    def acceleration(self, t: Any, x: Any, velocity: Any, side: Any, load: Load) -> Any:
        return load.push(t) - self.damping * velocity - np.sin(x)


@dataclass(frozen=True, slots=True, kw_only=True)
class Duffing(Smooth):
    """x'' + c x' + x + b x^3 = F."""

    cubic: float = 1.0

    def acceleration(self, t: Any, x: Any, velocity: Any, side: Any, load: Load) -> Any:
        return load.push(t) - self.damping * velocity - x - self.cubic * x**3


@dataclass(frozen=True, slots=True, kw_only=True)
class Bilinear(OneContactModel):
    """A spring that is stiffer beyond x = `edge`: the field is continuous across the contact."""

    damping: float = 0.1
    edge: float = 0.5
    stiffness: float = 3.0

    coordinates: ClassVar[tuple[str, ...]] = ("x",)
    channels: ClassVar[tuple[str, ...]] = ("push",)
    sides: ClassVar[tuple[int, ...]] = (1, -1)

    @property
    def contact(self) -> Any:
        return self.edge

    def gap(self, x: Any, side: Any) -> Any:
        return side * (x - self.edge)

    def acceleration(self, t: Any, x: Any, velocity: Any, side: Any, load: Load) -> Any:
        more = 0.5 * (1 + side) * self.stiffness
        return load.push(t) - self.damping * velocity - x - more * (x - self.edge)


@dataclass(frozen=True, slots=True, kw_only=True)
class ImpactDuffing(OneContactModel):
    """Duffing's oscillator with a wall at x = `wall`."""

    damping: float = 0.1
    cubic: float = 1.0
    wall: float = 0.8

    coordinates: ClassVar[tuple[str, ...]] = ("x",)
    channels: ClassVar[tuple[str, ...]] = ("push",)
    sides: ClassVar[tuple[int, ...]] = (1,)

    @property
    def contact(self) -> Any:
        return self.wall

    def gap(self, x: Any, side: Any) -> Any:
        return self.wall - x

    def acceleration(self, t: Any, x: Any, velocity: Any, side: Any, load: Load) -> Any:
        return load.push(t) - self.damping * velocity - x - self.cubic * x**3

    def reset(self, t: Any, velocity: Any, side: Any, load: Load, impact: Any) -> Any:
        return side, -impact.velocity_after(self, t, velocity, side, side, load)


def pushed(model, amplitude, frequency, e=1.0, mean=0.0):
    """A model of this file under a harmonic push."""
    push = Harmonic(amplitude=amplitude, mean=mean)
    return System(
        model=model, load=Load(frequency=frequency, push=push), impact=VelocityReduction(e)
    )


def swung(H=0.5, W=1.0, swing=0.25, e=1.0):
    """Load (iii) of the paper: horizontal and vertical forces."""
    vertical = Harmonic(mean=-0.5, amplitude=swing, phase=math.pi / 2)
    load = Load(frequency=W, horizontal=Harmonic(amplitude=H), vertical=vertical)
    return System(
        model=Metainterface(beta0=BETA80, damping=0.1), load=load, impact=VelocityReduction(e)
    )


def metainterface(rng):
    k, m, c = (
        (1.0, 0.0, 1.0) if rng.random() < 0.6 else rng.uniform((0.7, 0.0, 0.7), (1.4, 0.4, 1.4))
    )
    e = 1.0 if rng.random() < 0.6 else rng.uniform(0.6, 1.0)
    H, W, V, C = rng.uniform((0.05, 0.3, -0.9, 0.05), (1.2, 2.5, -0.2, 0.3))
    return (
        forced(H, W, V, C, e, beta0=rng.uniform(0.9, 1.5), k=k, m=m, c=c),
        "load.horizontal.amplitude",
        1.5,
    )


def grounded(rng):
    zeta, nu, r, m, W = rng.uniform((0.1, 0.0, 0.7, 0.0, 0.5), (1.0, 0.2, 1.0, 0.4, 2.0))
    return shaken(zeta, nu, r, m, W), "load.ground_horizontal.amplitude", 1.5


def both_forces(rng):
    H, W, swing = rng.uniform((0.1, 0.4, 0.05), (1.0, 2.5, 0.4))
    return (
        swung(H, W, swing, 1.0 if rng.random() < 0.5 else rng.uniform(0.7, 1.0)),
        "load.horizontal.amplitude",
        1.5,
    )


def block(rng):
    a, W, alpha = rng.uniform((1.1, 2.0, 0.15), (4.0, 7.0, 0.35))
    return rocking(a, W, alpha), "load.ground_horizontal.amplitude", 0.1 * alpha


def wall(rng):
    A, W, d, e, c = rng.uniform((0.1, 0.5, -0.2, 0.4, 0.02), (1.0, 2.8, 1.0, 1.0, 0.3))
    return walled(A, W, d, e, c=c), "load.force.amplitude", 1.0


def hinge(rng):
    push, W, edge, e = rng.uniform((0.2, 0.5, -0.2, 0.7), (1.2, 2.0, 0.6, 1.0))
    return (
        hinged(push, W, edge, e).with_({"load.push.mean": rng.uniform(0.05, 0.2)}),
        "load.push.amplitude",
        1.0,
    )


def pendulum(rng):
    push, W, damping = rng.uniform((0.2, 0.4, 0.05), (1.8, 2.2, 0.4))
    return pushed(Pendulum(damping=damping), push, W), "load.push.amplitude", 2.5


def duffing(rng):
    push, W, damping, cubic, mean = rng.uniform(
        (0.2, 0.3, 0.03, 0.3, -0.2), (8.0, 2.5, 0.3, 1.5, 0.2)
    )
    return (
        pushed(Duffing(damping=damping, cubic=cubic), push, W, mean=mean),
        "load.push.amplitude",
        12.0,
    )


def bilinear(rng):
    push, W, damping, edge, stiffness = rng.uniform(
        (0.2, 0.4, 0.03, 0.1, 1.0), (1.5, 3.0, 0.2, 0.8, 9.0)
    )
    return (
        pushed(Bilinear(damping=damping, edge=edge, stiffness=stiffness), push, W),
        "load.push.amplitude",
        2.0,
    )


def impact_duffing(rng):
    push, W, damping, at, e = rng.uniform((0.2, 0.5, 0.03, 0.2, 0.5), (2.0, 2.5, 0.3, 1.0, 1.0))
    return pushed(ImpactDuffing(damping=damping, wall=at), push, W, e), "load.push.amplitude", 2.5


MODELS = (
    metainterface,
    grounded,
    both_forces,
    block,
    wall,
    hinge,
    pendulum,
    duffing,
    bilinear,
    impact_duffing,
)


def random_branch(model, seed):
    """An orbit, a path and bounds: a branch to follow at random parameters of one of the models."""
    rng = np.random.default_rng([MODELS.index(model), seed])
    while True:
        system, amplitude, top = model(rng)
        path = FREQUENCY if rng.random() < 0.6 else amplitude
        name = system.model.coordinates[0]
        scale = system.model.alpha if hasattr(system.model, "alpha") else 1.0
        x, velocity = scale * rng.uniform((-1.0, -0.5), (1.0, 0.5))
        if system.model.sides == (1,):
            x = system.model.wall - abs(x)
        settle = (
            {"settle": 0, "period": int(rng.integers(1, 4))}
            if rng.random() < 0.4
            else {"max_period": 4}
        )
        try:
            orbit = find_orbit(system, **{name: x}, velocity=velocity, parameters=(path,), **settle)
        except SaltusError:
            continue
        value = system.get(path)
        low, high = (
            (value * rng.uniform(0.4, 0.9), value * rng.uniform(1.1, 2.0))
            if path == FREQUENCY
            else (0.02 * top, top)
        )
        if low < value < high:
            return orbit, path, (low, high)
