"""Random cases for the lanes: families of systems that share one structure each, and the scalar
kernel's word on each case.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from shared_systems import paired

import saltus
from saltus import InelasticImpact, OneContactModel
from saltus.errors import MotionError, ParameterError
from saltus.systems import (
    EnergyRestitution,
    Harmonic,
    Load,
    Metainterface,
    Model,
    Record,
    RockingBlock,
    System,
    VelocityReduction,
    WallOscillator,
)

REFUSED = {
    "not unique": "not_unique",
    "no velocity after": "no_impact",
    "range of numbers": "not_finite",
    "shrink": "stalled",
    "lies beyond": "outside",
    "too slowly": "unresolved",
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Duffing(Model):
    """x'' + c x' + x + b x^3 = F: smooth."""

    damping: float = 0.0
    cubic: float = 1.0
    coordinates: ClassVar[tuple[str, ...]] = ("x",)
    channels: ClassVar[tuple[str, ...]] = ("force",)

    def acceleration(self, t, x, velocity, side, load):
        return load.force(t) - self.damping * velocity - x - self.cubic * x**3


@dataclass(frozen=True, slots=True, kw_only=True)
class Curved(OneContactModel):
    """Every function that a model may use: tanh, exp, log, sqrt, tan, pow, sin, cos and division;
    it crosses x = 0.

    x'' = F - c tanh(x') - s p sqrt(4 + x^2) - x^3 exp(-x^2) - tan(x/10) (2 + cos x)^n / (4 + x^2) +
    log(5 + x^2) sin(x/2) / 10.
    """

    damping: float = 0.1
    pull: float = 0.5
    power: float = 0.7
    coordinates: ClassVar[tuple[str, ...]] = ("x",)
    channels: ClassVar[tuple[str, ...]] = ("force",)

    def acceleration(self, t, x, velocity, side, load):
        spring = np.tan(0.1 * x) * (2 + np.cos(x)) ** self.power / (4 + x * x)
        hump = x**3 * np.exp(-(x * x))
        wave = 0.1 * np.log(5 + x * x) * np.sin(0.5 * x)
        return (
            load.force(t)
            - self.damping * np.tanh(velocity)
            - side * self.pull * np.sqrt(4 + x * x)
            - hump
            - spring
            + wave
        )


@dataclass(frozen=True)
class Cases:
    """Cases of one system: parameter columns by path, the state at the start, the time at the
    start; each array (n,).
    """

    system: System
    columns: dict[str, np.ndarray]
    state: dict[str, np.ndarray]  # coordinates by name
    velocity: Any  # an array, or a tuple of them
    time: np.ndarray
    span: dict[str, float]  # periods or duration

    def __len__(self) -> int:
        return len(self.time)

    def chosen(self, rows: Any) -> "Cases":
        """Some of the cases, in the order of `rows`."""
        velocity = (
            tuple(v[rows] for v in self.velocity)
            if isinstance(self.velocity, tuple)
            else self.velocity[rows]
        )
        columns = {path: a[rows] for path, a in self.columns.items()}
        return Cases(
            self.system,
            columns,
            {c: a[rows] for c, a in self.state.items()},
            velocity,
            self.time[rows],
            self.span,
        )

    def in_lanes(self, **options: Any) -> Any:
        """The ensemble of all cases."""
        arguments = {
            "parameters": self.columns,
            "velocity": self.velocity,
            "time": self.time,
            **self.state,
            **self.span,
        }
        return saltus.simulate_many(self.system, **(arguments | options))

    def one(self, i: int) -> tuple[System, dict[str, Any]]:
        """One case as arguments of `simulate`."""
        velocity = (
            tuple(float(v[i]) for v in self.velocity)
            if isinstance(self.velocity, tuple)
            else float(self.velocity[i])
        )
        state = {name: float(a[i]) for name, a in self.state.items()}
        system = self.system.with_({path: float(a[i]) for path, a in self.columns.items()})
        return system, {"velocity": velocity, "time": float(self.time[i]), **state, **self.span}

    def alone(self, i: int, **options: Any) -> Any:
        """One case by the scalar kernel: its motion, or the name of the reason why there is
        none.
        """
        system, arguments = self.one(i)
        try:
            return saltus.simulate(system, **(arguments | {"dense": False} | options))
        except (MotionError, ParameterError) as error:
            return next(name for text, name in REFUSED.items() if text in str(error))


# --- families ----------------------------------------------------------------


def mixed(rng, n, special, drawn, share=0.5):
    """`drawn`, but a value at which things meet in a share of the cases."""
    return np.where(rng.random(n) < share, special, drawn)


def start_angles(rng, n):
    """A third at contact or very near it."""
    kinds = np.stack(
        [np.zeros(n), 1e-3 * rng.normal(size=n), 0.5 * rng.normal(size=n), 1.5 * rng.normal(size=n)]
    )
    return kinds[rng.choice(4, n, p=[0.2, 0.1, 0.5, 0.2]), np.arange(n)]


def start_speeds(rng, n):
    kinds = np.stack([np.zeros(n), 1e-3 * rng.normal(size=n), rng.normal(size=n)])
    return kinds[rng.choice(3, n), np.arange(n)]


def start_times(rng, n):
    """Nothing, some time before or after 0, and long after."""
    kinds = np.stack(
        [
            np.zeros(n),
            rng.uniform(-20, 20, n),
            np.round(rng.uniform(-9, 9, n)),
            rng.uniform(1e3, 1e4, n),
        ]
    )
    return kinds[rng.choice(4, n, p=[0.4, 0.3, 0.2, 0.1]), np.arange(n)]


def factors(rng, n):
    """No loss, everything lost, and between."""
    return np.choose(
        rng.choice(4, n), [np.ones(n), np.zeros(n), np.full(n, 0.8), rng.uniform(0.0, 0.99, n)]
    )


def layers(rng, n):
    """All numbers of a metainterface."""
    return {
        "model.beta0": rng.uniform(0.15, 3.0, n),
        "model.damping": mixed(rng, n, 0.0, rng.uniform(0.0, 1.0, n)),
        "model.stiffness_ratio": mixed(rng, n, 1.0, rng.uniform(0.2, 3.0, n)),
        "model.mass_ratio": mixed(rng, n, 0.0, rng.uniform(0.0, 3.0, n)),
        "model.dissipation_ratio": mixed(rng, n, 1.0, rng.uniform(0.0, 3.0, n)),
    }


def weights(rng, n):
    """V of both signs."""
    return rng.choice([-1.0, -1.0, 1.0], n) * mixed(rng, n, 0.5, 10 ** rng.uniform(-2.0, 0.5, n))


def frequencies(rng, n):
    return 10 ** rng.uniform(-0.6, 0.6, n)


def periods(rng):
    """Never where a load without phase has a zero inside: at rest, that may be the instant of a
    release.
    """
    return {"periods": float(rng.choice([0.4, 1.0, 1.3, 2.0]))}


def duration(rng):
    return {"duration": float(rng.uniform(2.0, 9.0))}


def angle_cases(system, columns, rng, n, span):
    return Cases(
        system,
        columns,
        {"theta": start_angles(rng, n)},
        start_speeds(rng, n),
        start_times(rng, n),
        span,
    )


def every_channel(rng, n, impact=None):
    """A metainterface with harmonics in all six channels."""
    load = Load(
        frequency=1.0,
        horizontal=Harmonic(0.0),
        vertical=Harmonic(0.0, phase=1.0),
        lower_horizontal=Harmonic(0.0, phase=0.7),
        lower_vertical=Harmonic(0.0, phase=-0.4),
        ground_horizontal=Harmonic(0.0),
        ground_vertical=Harmonic(0.0, phase=0.5),
    )
    frequency = frequencies(rng, n)
    columns = layers(rng, n) | {
        "load.frequency": frequency,
        "load.horizontal.amplitude": mixed(rng, n, 0.0, rng.uniform(-2, 2, n)),
        "load.horizontal.mean": mixed(rng, n, 0.0, 0.2 * rng.normal(size=n)),
        "load.horizontal.phase": mixed(rng, n, 0.0, rng.uniform(-3, 3, n)),
        "load.vertical.mean": weights(rng, n),
        "load.vertical.amplitude": mixed(rng, n, 0.0, rng.uniform(0, 0.5, n)),
        "load.lower_horizontal.amplitude": mixed(rng, n, 0.0, 0.3 * rng.normal(size=n)),
        "load.lower_vertical.amplitude": mixed(rng, n, 0.0, 0.3 * rng.normal(size=n)),
        "load.ground_horizontal.amplitude": mixed(
            rng, n, 0.0, rng.uniform(0, 0.5, n) / frequency**2
        ),
        "load.ground_vertical.amplitude": mixed(rng, n, 0.0, rng.uniform(0, 0.3, n) / frequency**2),
    }
    if impact is None:
        impact, columns["impact.e"] = VelocityReduction(), factors(rng, n)
    cases = angle_cases(
        System(model=Metainterface(beta0=1.4), load=load, impact=impact),
        columns,
        rng,
        n,
        periods(rng),
    )
    # What starts at contact without speed, or is left (almost) without one by an impact, comes back
    # to it so: unless damped.
    stopped = (
        (cases.state["theta"] == 0.0) & (cases.velocity == 0.0)
        | (columns.get("impact.e", 1.0) == 0.0)
        | (impact == InelasticImpact())
    )
    columns["model.damping"] += np.where(stopped, 0.01, 0.0)
    return cases


def energy_restitution(rng, n):
    """T+ = r T-; where the ground moves, some impacts have no solution."""
    cases = every_channel(rng, n, EnergyRestitution(1.0))
    cases.columns["impact.r"] = mixed(rng, n, 1.0, rng.uniform(0.1, 1.0, n))
    # else speeds may fall as 1/n, for ever
    for path in ("load.ground_horizontal.amplitude", "load.ground_vertical.amplitude"):
        cases.columns[path] *= cases.columns["impact.r"] != 1.0
    return cases


def inelastic(rng, n):
    return every_channel(rng, n, InelasticImpact())


def paper(rng, n):
    """The paper's system: load (i) and a constant V."""
    system = System(
        model=Metainterface(beta0=1.4),
        load=Load(frequency=1.0, horizontal=Harmonic(0.0), vertical=-0.5),
    )
    columns = {
        "model.damping": rng.uniform(0.0, 0.3, n),
        "load.frequency": frequencies(rng, n),
        "load.horizontal.amplitude": rng.uniform(0, 1.2, n),
        "load.vertical": weights(rng, n),
        "impact.e": factors(rng, n),
    }
    return angle_cases(system, columns, rng, n, {"periods": float(rng.choice([1.0, 2.0, 3.7]))})


def sums(rng, n):
    """Sums of harmonics of several orders and a constant, at a varied order."""
    load = Load(
        frequency=1.0,
        horizontal=Harmonic(0.0) + Harmonic(0.0, order=2, phase=0.4) + 0.1,
        vertical=Harmonic(0.0, order=3) + -0.5,
    )
    system = System(model=Metainterface(beta0=1.3, damping=0.1), load=load)
    columns = {
        "load.frequency": frequencies(rng, n),
        "load.horizontal.0.amplitude": rng.uniform(-1, 1, n),
        "load.horizontal.1.amplitude": rng.uniform(-1, 1, n),
        "load.horizontal.1.order": rng.integers(1, 5, n).astype(float),
        "load.horizontal.2": 0.2 * rng.normal(size=n),
        "load.vertical.0.amplitude": rng.uniform(-0.4, 0.4, n),
        "load.vertical.1": weights(rng, n),
        "impact.e": factors(rng, n),
    }
    return angle_cases(system, columns, rng, n, periods(rng))


def constant_loads(rng, n):
    """No frequency at all: accumulations of impacts, rest for ever, and buckled states.

    Without damping and without loss a motion from contact comes back to it with no speed: those are
    left to the other families.
    """
    system = System(
        model=Metainterface(beta0=1.4), load=Load(horizontal=0.0, vertical=-0.5, lower_vertical=0.0)
    )
    columns = layers(rng, n) | {
        "model.damping": rng.uniform(0.01, 1.0, n),
        "load.horizontal": mixed(rng, n, 0.0, 0.4 * rng.normal(size=n)),
        "load.vertical": weights(rng, n),
        "load.lower_vertical": mixed(rng, n, 0.0, 0.2 * rng.normal(size=n)),
        "impact.e": factors(rng, n),
    }
    cases = angle_cases(system, columns, rng, n, duration(rng))
    # nothing here counts periods: the clock would round
    cases.time[:] = np.where(np.abs(cases.time) > 100, 0.0, cases.time)
    return cases


def records(rng, n):
    """A force record, a ground acceleration and a ground displacement of samples at unequal
    times.
    """
    fixed = np.random.default_rng(5)  # the records are part of the system
    t = np.cumsum(fixed.uniform(0.2, 1.0, 30)) - 8.0
    load = Load(
        frequency=1.0,
        horizontal=Record(t, fixed.normal(size=30), quantity="force") + Harmonic(0.0),
        vertical=-0.5,
        ground_horizontal=Record(t + 0.1, 0.5 * fixed.normal(size=30), quantity="acceleration"),
        ground_vertical=Record(
            t[:12] - 0.3,
            0.1 * fixed.normal(size=12),
            quantity="displacement",
            interpolation="spline",
        ),
    )
    columns = layers(rng, n) | {
        "load.frequency": frequencies(rng, n),
        "load.horizontal.0.scale": rng.uniform(-1, 1, n),
        "load.horizontal.1.amplitude": mixed(rng, n, 0.0, rng.uniform(0, 0.5, n)),
        "load.ground_horizontal.scale": mixed(rng, n, 0.0, rng.uniform(-1, 1, n)),
        "load.ground_vertical.scale": mixed(rng, n, 0.0, rng.uniform(-1, 1, n)),
        "load.vertical": weights(rng, n),
        "impact.e": factors(rng, n),
    }
    return angle_cases(
        System(model=Metainterface(beta0=1.4), load=load), columns, rng, n, duration(rng)
    )


def smoothed(rng, n):
    """tanh in place of the sign: no contact, steep."""
    system = System(
        model=Metainterface(beta0=1.4, smoothing=20.0),
        load=Load(frequency=1.0, horizontal=Harmonic(0.0), vertical=-0.5),
    )
    columns = {
        "model.smoothing": 10 ** rng.uniform(0.5, 2.5, n),
        "model.damping": rng.uniform(0.0, 0.3, n),
        "load.frequency": frequencies(rng, n),
        "load.horizontal.amplitude": rng.uniform(0, 1.2, n),
        "load.vertical": weights(rng, n),
    }
    return angle_cases(system, columns, rng, n, {"duration": 3.0})


def rocking(rng, n, impact=None):
    """A block that may overturn; some are shaken harder than they weigh."""
    load = Load(
        frequency=1.0, ground_horizontal=Harmonic(0.0), ground_vertical=Harmonic(0.0, phase=0.3)
    )
    frequency = frequencies(rng, n)
    columns = {
        "model.alpha": rng.uniform(0.05, 0.8, n),
        "load.frequency": frequency,
        "load.ground_horizontal.amplitude": (
            mixed(rng, n, 0.0, rng.uniform(0, 1.5, n)) / frequency**2
        ),
        "load.ground_vertical.amplitude": mixed(rng, n, 0.0, rng.uniform(0, 0.5, n)) / frequency**2,
    }
    if impact is None:
        impact, columns["impact.e"] = VelocityReduction(), factors(rng, n)
    system = System(model=RockingBlock(alpha=0.3), load=load, impact=impact)
    cases = angle_cases(system, columns, rng, n, periods(rng))
    return Cases(
        system,
        columns,
        {"theta": 0.4 * cases.state["theta"]},
        0.5 * cases.velocity,
        cases.time,
        cases.span,
    )


def rocking_inelastic(rng, n):
    return rocking(rng, n, InelasticImpact())


def wall(rng, n):
    """Starts before, at and (refused) beyond the wall.

    Where impacts lose nothing and flights shrink, only a wall at 0 leaves the coordinate enough
    digits.
    """
    system = System(model=WallOscillator(), load=Load(frequency=1.0, force=Harmonic(0.0)))
    factor = factors(rng, n)
    place = np.where(factor == 1.0, 0.0, mixed(rng, n, 0.0, rng.normal(size=n), 0.3))
    columns = {
        "model.stiffness": rng.uniform(0.0, 2.0, n),
        # without it and without a load a motion from the wall would graze it
        "model.damping": rng.uniform(0.01, 0.5, n),
        "model.wall": place,
        "load.frequency": frequencies(rng, n),
        "load.force.amplitude": mixed(rng, n, 0.0, rng.uniform(0, 1.5, n), 0.2),
        "load.force.mean": mixed(rng, n, 0.0, rng.uniform(-1, 1, n)),
        "impact.e": factor,
    }
    behind = np.abs(start_angles(rng, n)) * np.where(rng.random(n) < 0.05, -1.0, 1.0)
    return Cases(
        system,
        columns,
        {"x": place - behind},
        start_speeds(rng, n),
        start_times(rng, n),
        periods(rng),
    )


def pair(rng, n):
    """Two coordinates without a contact."""
    system = paired()
    columns = {
        "model.coupling": rng.uniform(0.0, 1.0, n),
        "model.cubic": rng.uniform(0.0, 1.0, n),
        "model.damping": rng.uniform(0.0, 0.3, n),
        "load.frequency": frequencies(rng, n),
        "load.force.amplitude": rng.uniform(0, 1, n),
    }
    state = {"x": rng.normal(size=n), "y": rng.normal(size=n)}
    return Cases(
        system,
        columns,
        state,
        (rng.normal(size=n), rng.normal(size=n)),
        start_times(rng, n),
        periods(rng),
    )


def duffing(rng, n):
    system = System(model=Duffing(), load=Load(frequency=1.0, force=Harmonic(0.0)))
    columns = {
        "model.damping": rng.uniform(0.0, 0.5, n),
        "model.cubic": rng.uniform(0.0, 2.0, n),
        "load.frequency": frequencies(rng, n),
        "load.force.amplitude": rng.uniform(0, 1, n),
    }
    return Cases(
        system,
        columns,
        {"x": rng.normal(size=n)},
        rng.normal(size=n),
        start_times(rng, n),
        periods(rng),
    )


def curved(rng, n):
    system = System(model=Curved(), load=Load(frequency=1.0, force=Harmonic(0.0)))
    columns = {
        "model.damping": rng.uniform(0.0, 0.5, n),
        "model.pull": rng.uniform(0.1, 1.0, n),
        "model.power": rng.uniform(-1.0, 2.0, n),
        "load.frequency": frequencies(rng, n),
        "load.force.amplitude": rng.uniform(0, 1, n),
        "impact.e": factors(rng, n),
    }
    return Cases(
        system,
        columns,
        {"x": start_angles(rng, n)},
        start_speeds(rng, n),
        start_times(rng, n),
        periods(rng),
    )


FAMILIES: dict[str, Callable[[Any, int], Cases]] = {
    f.__name__: f
    for f in (
        paper,
        every_channel,
        energy_restitution,
        inelastic,
        sums,
        constant_loads,
        records,
        smoothed,
        rocking,
        rocking_inelastic,
        wall,
        pair,
        duffing,
        curved,
    )
}


# --- what an ensemble says ---------------------------------------------------


def end_state(ensemble, system):
    """(n, 2 degrees of freedom)."""
    names = system.model.coordinates
    rates = ["velocity"] if len(names) == 1 else [f"{name}_velocity" for name in names]
    return np.stack([ensemble[name].values for name in (*names, *rates)], axis=-1)


def motion_state(motion):
    return np.concatenate([np.atleast_1d(motion.position), np.atleast_1d(motion.velocity)])


NUDGE = 1e-7


def nudged(cases, rng):
    """The same cases with every number off by some 1e-7 of itself: states and parameters, but not
    the loss nor the clock.

    What is zero stays so: symmetric, lossless and undamped cases remain what they are, and starts
    at contact stay there.
    """

    def off(a):
        return a * (1 - NUDGE * rng.uniform(0.5, 1.0))

    def kept(path):
        return path in ("impact.e", "impact.r", "load.frequency", "model.wall") or path.endswith(
            ".order"
        )

    columns = {path: a if kept(path) else off(a) for path, a in cases.columns.items()}
    wall = cases.columns.get("model.wall", 0.0)
    state = {name: wall + off(a - wall) for name, a in cases.state.items()}
    velocity = (
        tuple(map(off, cases.velocity))
        if isinstance(cases.velocity, tuple)
        else off(cases.velocity)
    )
    return Cases(cases.system, columns, state, velocity, cases.time, cases.span)


def amplification(cases, ensemble, tol, rng):
    """By how much each motion magnifies an error of its numbers, at least 1; inf where an impact
    appears or vanishes.

    A slow impact magnifies by its speed's inverse. That shows unless all numbers conspire, as where
    a motion without loss comes back to the contact with the speed that it had (among 10^5 cases:
    six impacts at 0.00165 by `energy_restitution`, batch 16, row 128). So where impacts are few the
    inverse speeds are added up, an impact's being at most that of its period's slowest.
    """
    other = nudged(cases, rng).in_lanes(tol=tol, sample=("speed", "impact_count"), last="all")
    state = end_state(ensemble, cases.system)
    moved = np.abs(end_state(other, cases.system) - state).max(axis=1) / np.maximum(
        1.0, np.abs(state).max(axis=1)
    )
    same = (other.stop.values == ensemble.stop.values) & (
        other.impact_count.values == ensemble.impact_count.values
    )
    calm = same & (ensemble.grazings.values == 0) & (other.grazings.values == 0)
    # a period that a limit ends is not kept
    slowest = np.maximum(other.least_speed.fillna(np.inf), 1e-300)
    added = (other.period_impact_count.fillna(0.0) / slowest).sum("period").values
    slow = np.where(other.impact_count.values <= 10, 1e-1 * added, 1.0)
    return np.where(calm, np.maximum(np.maximum(moved / NUDGE, slow), 1.0), math.inf)
