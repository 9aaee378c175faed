"""Models with cycles without a load, each with a parameter along which its cycles are followed."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

import saltus
from saltus import (
    BeltOscillator,
    Contact,
    ContactModel,
    Friction,
    NewtonImpact,
    Surface,
    System,
)


@saltus.register
@dataclass(frozen=True, kw_only=True)
class VanDerPol(ContactModel):
    """x'' = mu (1 - x^2) x' - x."""

    mu: float = 1.0

    coordinates: ClassVar[tuple[str, ...]] = ("x",)
    channels: ClassVar[tuple[str, ...]] = ()

    def force(self, t, x, velocity, load):
        return self.mu * (1.0 - x * x) * velocity - x


@saltus.register
@dataclass(frozen=True, kw_only=True)
class StoppedVanDerPol(VanDerPol):
    """The same before a hard stop."""

    place: float = 1.0

    @property
    def contacts(self):
        return (Contact(name="stop", coordinate="x", position=self.place, sign=-1),)


@saltus.register
@dataclass(frozen=True, kw_only=True)
class SoftlyStopped(VanDerPol):
    """The same before a soft stop."""

    place: float = 1.0

    @property
    def surfaces(self):
        return (Surface(name="stop", coordinate="x", position=self.place),)

    def force(self, t, x, velocity, load, sides):
        free = VanDerPol.force(self, t, x, velocity, load)
        return free - (1.0 + sides.stop) / 2.0 * 8.0 * (x - self.place)


@saltus.register
@dataclass(frozen=True, kw_only=True)
class Clock(ContactModel):
    """A pendulum that is pushed along its velocity, between two hard stops."""

    push: float = 0.1
    place: float = 1.0

    coordinates: ClassVar[tuple[str, ...]] = ("x",)
    channels: ClassVar[tuple[str, ...]] = ()

    @property
    def contacts(self):
        return (
            Contact(name="right", coordinate="x", position=self.place, sign=-1),
            Contact(name="left", coordinate="x", position=-0.8, sign=1),
        )

    def force(self, t, x, velocity, load):
        return -x + self.push * velocity


@saltus.register
@dataclass(frozen=True, kw_only=True)
class Squealing(ContactModel):
    """x'' + 0.1 x' + x = mu(u), u = abs(x' - speed), mu = 0.2 + 0.3 exp(-u / 0.5)."""

    speed: float = 0.3

    coordinates: ClassVar[tuple[str, ...]] = ("x",)
    channels: ClassVar[tuple[str, ...]] = ()

    @property
    def frictions(self):
        falling = {"kinetic": 0.2, "static": 0.5, "stribeck_speed": 0.5}
        return (Friction(name="disc", coordinate="x", ground_speed=self.speed, **falling),)

    def force(self, t, x, velocity, load):
        return -x - 0.1 * velocity


@saltus.register
@dataclass(frozen=True, kw_only=True)
class Coupled(ContactModel):
    """Van der Pol's oscillator with a damped mass on it."""

    mu: float = 1.0
    coupling: float = 0.3

    coordinates: ClassVar[tuple[str, ...]] = ("x", "y")
    channels: ClassVar[tuple[str, ...]] = ()

    def force(self, t, q, velocity, load):
        (x, y), (u, v) = q, velocity
        pull = self.coupling * (x - y)
        return self.mu * (1.0 - x * x) * u - x - pull, -0.2 * v - 2.1 * y + pull


@saltus.register
@dataclass(frozen=True, kw_only=True)
class StoppedCoupled(Coupled):
    """The same with a hard stop before the second mass."""

    place: float = 0.2

    @property
    def contacts(self):
        return (Contact(name="stop", coordinate="y", position=self.place, sign=-1),)


@saltus.register
@dataclass(frozen=True, kw_only=True)
class TwoDuffing(ContactModel):
    """Two masses on springs that harden, without loss, coupled by a spring k."""

    k: float = 0.1

    coordinates: ClassVar[tuple[str, ...]] = ("x", "y")
    channels: ClassVar[tuple[str, ...]] = ()

    def force(self, t, q, velocity, load):
        x, y = q
        pull = self.k * (x - y)
        return -x - x**3 - pull, -y - y**3 + pull


@saltus.register
@dataclass(frozen=True, kw_only=True)
class TwoOnBelt(ContactModel):
    """Two masses on a belt, a spring between them."""

    speed: float = 0.1
    damping: float = 0.05
    spring: float = 0.7

    coordinates: ClassVar[tuple[str, ...]] = ("x", "y")
    channels: ClassVar[tuple[str, ...]] = ()

    @property
    def frictions(self):
        return (
            Friction(name="one", coordinate="x", kinetic=0.2, static=0.4, ground_speed=self.speed),
        )

    def normal_forces(self, t, q, velocity, load):
        return (1.0,)

    def force(self, t, q, velocity, load):
        (x, y), (u, v) = q, velocity
        pull = self.spring * (x - y)
        return -x - self.damping * u - pull, -1.3 * y - self.damping * v + pull


@saltus.register
@dataclass(frozen=True, kw_only=True)
class Piecewise(ContactModel):
    """Example 9.2 of COCO: a field in the plane, another one on each side of x1 = 0."""

    alpha: float = 1.0
    beta: float = 2.0
    gamma: float = 1.5

    coordinates: ClassVar[tuple[str, ...]] = ("x1", "x2")
    first_order: ClassVar[tuple[str, ...]] = ("x1", "x2")
    channels: ClassVar[tuple[str, ...]] = ()
    surfaces: ClassVar[tuple[Surface, ...]] = (Surface(name="axis", coordinate="x1"),)

    def force(self, t, q, velocity, load, sides):
        x, y = q
        r = np.sqrt(x * x + y * y)
        right, left = (1.0 + sides.axis) / 2.0, (1.0 - sides.axis) / 2.0
        out, turn = self.alpha * (self.beta - r), self.gamma + self.beta - r
        return (
            left * (-y + (1.0 - r) * x) + right * (out * x - turn * y),
            left * (x + (1.0 - r) * y) + right * (out * y + turn * x),
        )


@saltus.register
@dataclass(frozen=True, kw_only=True)
class Roessler(ContactModel):
    """x' = -y - z, y' = x + a y, z' = b + z (x - c)."""

    a: float = 0.2
    b: float = 0.2
    c: float = 2.5

    coordinates: ClassVar[tuple[str, ...]] = ("x", "y", "z")
    first_order: ClassVar[tuple[str, ...]] = ("x", "y", "z")
    channels: ClassVar[tuple[str, ...]] = ()

    def force(self, t, q, velocity, load):
        x, y, z = q
        return -y - z, x + self.a * y, self.b + z * (x - self.c)


@saltus.register
@dataclass(frozen=True, kw_only=True)
class Lorenz(ContactModel):
    """Lorenz's equations, with sigma = 10 and b = 8/3."""

    r: float = 350.0

    coordinates: ClassVar[tuple[str, ...]] = ("x", "y", "z")
    first_order: ClassVar[tuple[str, ...]] = ("x", "y", "z")
    channels: ClassVar[tuple[str, ...]] = ()

    def force(self, t, q, velocity, load):
        x, y, z = q
        return 10.0 * (y - x), self.r * x - y - x * z, x * y - 8.0 / 3.0 * z


# the system with numbers at random, a start, and the parameter with its range
CASES: dict[str, Any] = {
    "van der pol": lambda r: (
        System(model=VanDerPol(mu=r(0.4, 2.0))),
        {"x": 0.5},
        "mu",
        (0.3, 3.0),
    ),
    "belt": lambda r: (
        System(model=BeltOscillator(static=r(0.3, 0.5), damping=r(0.0, 0.03))),
        {"x": 0.5, "velocity": 0.5},
        "belt_speed",
        (0.05, 0.2),
    ),
    "hard stop": lambda r: (
        System(model=StoppedVanDerPol(mu=r(0.3, 1.2)), impact=NewtonImpact(r(0.4, 0.9))),
        {"x": 0.2, "velocity": 0.9},
        "place",
        (0.6, 2.3),
    ),
    "soft stop": lambda r: (
        System(model=SoftlyStopped(mu=r(0.3, 1.2))),
        {"x": 0.2},
        "place",
        (0.3, 2.5),
    ),
    "clock": lambda r: (
        System(model=Clock(push=r(0.08, 0.2)), impact=NewtonImpact(r(0.6, 0.8))),
        {"x": 0.2, "velocity": 0.9},
        "push",
        (0.05, 0.3),
    ),
    "two masses": lambda r: (
        System(model=Coupled(coupling=r(0.1, 0.5))),
        {"x": 0.2, "y": 0.1},
        "mu",
        (0.3, 3.0),
    ),
    "two masses and a stop": lambda r: (
        System(model=StoppedCoupled(coupling=r(0.3, 0.5)), impact=NewtonImpact(r(0.5, 0.9))),
        {"x": 0.2, "y": 0.1},
        "place",
        (0.05, 1.0),
    ),
    "two masses on a belt": lambda r: (
        System(model=TwoOnBelt(damping=r(0.01, 0.03), spring=r(0.4, 0.9))),
        {"x": 0.9, "y": 0.1, "velocity": (0.1, 0.0)},
        "speed",
        (0.06, 0.14),
    ),
    "piecewise": lambda r: (
        System(model=Piecewise(gamma=r(1.2, 2.0))),
        {"x1": 0.1, "x2": 1.2},
        "beta",
        (1.3, 3.0),
    ),
    "first order": lambda r: (
        System(model=Roessler(a=r(0.15, 0.22))),
        {"x": 1.0, "y": 1.0, "z": 0.1},
        "c",
        (2.0, 3.5),
    ),
}


def difference_multipliers(orbit: saltus.PeriodicOrbit, step: float = 1e-6) -> np.ndarray:
    """The eigenvalues but 1 of the map over a period, by central differences of the motion."""
    start = orbit.start()
    names = orbit.system.model.coordinates
    moving = len(orbit.system.model.moving)
    velocity = np.atleast_1d(start["velocity"])[:moving] if moving else []
    state = np.array([*(start[name] for name in names), *velocity])
    count = len(names)
    units = saltus.systems.natural_units(orbit.system).state[: len(state)]

    def later(state):
        given = dict(zip(names, state[:count].tolist(), strict=True))
        if moving:
            given["velocity"] = float(state[count]) if moving == 1 else tuple(state[count:])
        run = saltus.simulate(orbit.system, **given, duration=orbit.period, tol=1e-14)
        return run.final_state[: len(state)]

    columns = []
    for axis, unit in zip(np.eye(len(state)), units, strict=True):
        beside = step * unit * axis
        columns.append((later(state + beside) - later(state - beside)) / (2.0 * step * unit))
    values = np.linalg.eigvals(np.array(columns).T)
    return np.delete(values, np.argmin(np.abs(values - 1.0)))


def along_branch(name: str, seed: int) -> tuple[int, float]:
    """How many orbits of a branch were compared with differences, and the largest difference of
    their multipliers, as a share of the largest one. Orbits beside which differences do not
    converge, as at a grazing, are left out.
    """
    rng = np.random.default_rng(seed)
    system, start, parameter, bounds = CASES[name](rng.uniform)
    path = f"model.{parameter}"
    value = system.get(path)
    orbit = saltus.find_orbit(system, **start)
    branch = saltus.continue_orbit(
        orbit, path, (min(bounds[0], value), max(bounds[1], value)), step=0.05
    )
    compared, worst = 0, 0.0
    for found in branch.orbits[:: max(1, len(branch.orbits) // 6)]:
        rough, fine = (difference_multipliers(found, step) for step in (4e-6, 1e-6))
        size = max(1.0, abs(found.multipliers[0]))
        if max(min(abs(fine - one)) for one in rough) > 1e-7 * size:
            continue
        compared += 1
        apart = max(min(abs(fine - one)) for one in found.multipliers)
        worst = max(worst, float(apart / size))
        assert found.defect < 1e-9 * size, (found, found.defect)
        assert abs(saltus.energies(found).defect) < 1e-10 * size
    return compared, worst
