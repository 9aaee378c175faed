"""Random systems whose branches have many special points, in units of length, time and mass."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, ClassVar

import numpy as np

import saltus


@dataclass(frozen=True, kw_only=True)
class Absorber(saltus.ContactModel):
    """A small mass between two stops of a large one, which an elastic spring holds."""

    m1: float = 1.0
    m2: float = 0.05
    k: float = 1.0
    c: float = 0.02
    clear: float = 1.0
    coordinates: ClassVar[tuple[str, ...]] = ("x", "y")
    channels: ClassVar[tuple[str, ...]] = ("force",)

    @property
    def contacts(self) -> tuple[saltus.Contact, ...]:
        apart = {"y": 1.0, "x": -1.0}
        return (
            saltus.Contact(name="left", coordinate=apart, sign=1, position=-self.clear),
            saltus.Contact(name="right", coordinate=apart, sign=-1, position=self.clear),
        )

    def mass_matrix(self, q: Any) -> Any:
        return [[self.m1, 0.0], [0.0, self.m2]]

    def force(self, t: Any, q: Any, v: Any, load: Any) -> Any:
        return load.force(t) - self.k * q[0] - self.c * v[0], 0.0 * q[1]


@dataclass(frozen=True, kw_only=True)
class Backlash(saltus.ContactModel):
    """A pair of gears: its relative coordinate has no stiffness within the backlash."""

    m: float = 1.0
    b: float = 1.0
    k: float = 1.0
    c: float = 0.05
    mean: float = 0.1
    coordinates: ClassVar[tuple[str, ...]] = ("x",)
    channels: ClassVar[tuple[str, ...]] = ("force",)

    @property
    def surfaces(self) -> tuple[saltus.Surface, ...]:
        return (
            saltus.Surface(name="front", coordinate="x", position=self.b),
            saltus.Surface(name="back", coordinate="x", position=-self.b),
        )

    def mass_matrix(self, q: Any) -> Any:
        return self.m

    def force(self, t: Any, q: Any, v: Any, load: Any, sides: Any) -> Any:
        front = self.k * (q - self.b) * (1 + sides.front) / 2
        back = self.k * (q + self.b) * (1 - sides.back) / 2
        return load.force(t) + self.mean - self.c * v - front - back


@dataclass(frozen=True, kw_only=True)
class Walls(saltus.ContactModel):
    """A mass on a spring before a wall."""

    m: float = 1.0
    k: float = 1.0
    c: float = 0.1
    low: float = -1.0
    high: float = 1.0
    number: ClassVar[int] = 1
    coordinates: ClassVar[tuple[str, ...]] = ("x",)
    channels: ClassVar[tuple[str, ...]] = ("force",)

    @property
    def contacts(self) -> tuple[saltus.Contact, ...]:
        right = saltus.Contact(name="right", coordinate="x", sign=-1, position=self.high)
        left = saltus.Contact(name="left", coordinate="x", sign=1, position=self.low)
        return (right, left)[: self.number]

    def mass_matrix(self, q: Any) -> Any:
        return self.m

    def force(self, t: Any, x: Any, v: Any, load: Any) -> Any:
        return load.force(t) - self.c * v - self.k * x


@dataclass(frozen=True, kw_only=True)
class TwoWalls(Walls):
    """The same between two walls."""

    number: ClassVar[int] = 2


@dataclass(frozen=True, kw_only=True)
class ImpactPair(saltus.ContactModel):
    """Two masses on springs of their own that hit each other."""

    m1: float = 1.0
    m2: float = 0.5
    k1: float = 1.0
    k2: float = 1.0
    c: float = 0.1
    apart: float = 0.5
    coordinates: ClassVar[tuple[str, ...]] = ("x", "y")
    channels: ClassVar[tuple[str, ...]] = ("force",)

    @property
    def contacts(self) -> tuple[saltus.Contact, ...]:
        apart = {"y": 1.0, "x": -1.0}
        return (saltus.Contact(name="between", coordinate=apart, sign=1, position=-self.apart),)

    def mass_matrix(self, q: Any) -> Any:
        return [[self.m1, 0.0], [0.0, self.m2]]

    def force(self, t: Any, q: Any, v: Any, load: Any) -> Any:
        first = load.force(t) - self.k1 * q[0] - self.c * v[0]
        return first, -self.k2 * q[1] - self.c * v[1]


@dataclass(frozen=True, kw_only=True)
class Chain(saltus.ContactModel):
    """Two masses in a row on springs, each before a wall of its own."""

    m: float = 1.0
    k: float = 1.0
    between: float = 0.4
    c: float = 0.1
    first: float = 0.6
    second: float = 0.8
    coordinates: ClassVar[tuple[str, ...]] = ("x", "y")
    channels: ClassVar[tuple[str, ...]] = ("force",)

    @property
    def contacts(self) -> tuple[saltus.Contact, ...]:
        return (
            saltus.Contact(name="one", coordinate="x", sign=-1, position=self.first),
            saltus.Contact(name="two", coordinate="y", sign=-1, position=self.second),
        )

    def mass_matrix(self, q: Any) -> Any:
        return [[self.m, 0.0], [0.0, 0.7 * self.m]]

    def force(self, t: Any, q: Any, v: Any, load: Any) -> Any:
        pull = self.between * (q[1] - q[0])
        first = load.force(t) - self.k * q[0] - self.c * v[0] + pull
        return first, -self.k * q[1] - self.c * v[1] - pull


@dataclass(frozen=True)
class Units:
    """How many units of the user the units of a case are."""

    length: float = 1.0
    time: float = 1.0
    mass: float = 1.0

    @property
    def name(self) -> str:
        return f"L{self.length:g} T{self.time:g} M{self.mass:g}"


@dataclass(frozen=True)
class Case:
    """A random system of a kind, without units."""

    kind: str
    numbers: tuple[float, ...]
    units: Units = Units()
    rounded: int | None = None  # the seed of the perturbation of all numbers by 1e-13

    def in_units(self, units: Units) -> Case:
        return replace(self, units=units)

    @property
    def frequency(self) -> float:
        """The frequency of the load, in the units of the user."""
        return self.numbers[3] / self.units.time

    @property
    def start(self) -> dict[str, Any]:
        length = self.units.length
        speed = length / self.units.time
        if self.kind in ("absorber", "pair", "chain"):
            return {"x": 0.1 * length, "y": 0.0, "velocity": (0.0, 0.1 * speed)}
        return {"x": 0.1 * length, "velocity": 0.3 * speed}

    @cached_property
    def system(self) -> saltus.System:
        n = self.numbers
        units = self.units
        length = units.length
        mass = units.mass
        stiffness = mass / units.time**2
        damping = mass / units.time
        force = stiffness * length
        model: Any
        if self.kind == "absorber":
            model = Absorber(
                m1=mass, m2=n[0] * mass, k=stiffness, c=n[1] * damping, clear=n[2] * length
            )
        elif self.kind == "backlash":
            model = Backlash(
                m=mass, b=n[0] * length, k=stiffness, c=n[1] * damping, mean=n[2] * force
            )
        elif self.kind in ("wall", "stops"):
            model = (Walls if self.kind == "wall" else TwoWalls)(
                m=mass,
                k=n[0] * stiffness,
                c=n[1] * damping,
                low=-n[6] * length,
                high=n[2] * length,
            )
        elif self.kind == "pair":
            model = ImpactPair(
                m1=mass,
                m2=n[0] * mass,
                k1=stiffness,
                k2=n[6] * stiffness,
                c=n[1] * damping,
                apart=n[2] * length,
            )
        else:
            model = Chain(
                m=mass,
                k=stiffness,
                between=n[0] * stiffness,
                c=n[1] * damping,
                first=n[2] * length,
                second=n[6] * length,
            )
        load = saltus.Load(frequency=self.frequency, force=saltus.Harmonic(n[4] * force))
        impact = {"impact": saltus.NewtonImpact(e=n[5])} if model.contacts else {}
        system = saltus.System(model=model, load=load, **impact)
        return system if self.rounded is None else _rounded(system, self.rounded)


def _rounded(system: saltus.System, seed: int) -> saltus.System:
    """All numbers of a system times 1 +- 1e-13."""
    rng = np.random.default_rng(seed)
    changed = {
        path: float(value) * (1.0 + 1e-13 * rng.choice([-1.0, 1.0]))
        for path, value in saltus.systems.numbers(system)
        if path not in ("impact.e", "load.frequency", "load.force.order") and value
    }
    return system.with_(changed)


RANGES = {
    "absorber": ((0.02, 0.3), (0.01, 0.1), (0.3, 1.5), (0.8, 1.2), (0.05, 0.4), (0.4, 0.9)),
    "backlash": ((0.2, 1.0), (0.03, 0.2), (-0.2, 0.2), (0.6, 1.4), (0.1, 0.6), (0.5, 0.6)),
    "wall": ((0.5, 1.5), (0.05, 0.3), (0.15, 1.0), (0.7, 2.5), (0.2, 0.8), (0.3, 0.9)),
    "stops": ((0.1, 1.0), (0.03, 0.2), (0.5, 1.2), (0.7, 1.5), (0.4, 1.0), (0.3, 0.8)),
    "pair": ((0.2, 1.5), (0.05, 0.2), (0.15, 0.6), (0.7, 2.0), (0.2, 0.8), (0.3, 0.9)),
    "chain": ((0.1, 0.8), (0.05, 0.2), (0.2, 0.8), (0.7, 2.0), (0.2, 0.8), (0.3, 0.9)),
}
KINDS = tuple(RANGES)


def random_case(kind: str, seed: int) -> Case:
    """A random system of a kind."""
    rng = np.random.default_rng([seed, *kind.encode()])
    drawn = [rng.uniform(*pair) for pair in RANGES[kind]]
    return Case(kind, (*drawn, rng.uniform(0.5, 1.2)))
