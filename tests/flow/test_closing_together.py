"""Derivatives through contacts that close at one instant without acting on one another: cells that
move alike.
"""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import pytest

import saltus
from saltus import Contact, NewtonImpact
from saltus.flow import EventKind
from saltus.systems import ContactModel, Harmonic, Load, System


@dataclass(frozen=True, kw_only=True)
class Row(ContactModel):
    """Masses in a row, each above a wall of its own, with springs and dampers between
    neighbours.
    """

    stiffness: float = 0.4
    damping: float = 0.1
    spring: float = 0.0
    between: float = 0.0
    wall: float = 0.0

    coordinates: ClassVar[tuple[str, ...]] = ("x_1", "x_2", "x_3")
    channels: ClassVar[tuple[str, ...]] = ("force",)

    @property
    def contacts(self):
        return tuple(
            Contact(name=f"wall{name[1:]}", coordinate=name, position=self.wall)
            for name in self.coordinates
        )

    def force(self, t, x, v, load):
        forces = []
        for i in range(3):
            total = load.force(t) - self.stiffness * x[i] - self.damping * v[i]
            for j in (i - 1, i + 1):
                if 0 <= j < 3:
                    total = total + self.spring * (x[j] - x[i]) + self.between * (v[j] - v[i])
            forces.append(total)
        return tuple(forces)


@dataclass(frozen=True, kw_only=True)
class Single(Row):
    """One of them."""

    coordinates: ClassVar[tuple[str, ...]] = ("x_1",)

    def force(self, t, x, v, load):
        return load.force(t) - self.stiffness * x - self.damping * v


PATHS = ("model.spring", "load.frequency", "impact.e.0", "impact.e.1", "model.wall")


def row(e=0.6, kind=Row, force=-0.7, **numbers):
    load = Load(frequency=1.3, force=force + Harmonic(amplitude=0.5))
    return System(
        model=kind(**numbers), load=load, impact=NewtonImpact(e=(e,) * len(kind.coordinates))
    )


def end_of(system, start, duration, tol=1e-15):
    n = len(start) // 2
    motion = saltus.simulate(
        system,
        velocity=tuple(start[n:]) if n > 1 else float(start[1]),
        duration=duration,
        tol=tol,
        dense=False,
        **dict(zip(system.model.coordinates, start[:n], strict=True)),
    )
    return np.append(np.atleast_1d(motion.position), np.atleast_1d(motion.velocity))


def derivatives(system, start, duration, paths=()):
    n = len(start) // 2
    return saltus.sensitivities(
        system,
        velocity=tuple(start[n:]) if n > 1 else float(start[1]),
        duration=duration,
        parameters=paths,
        tol=1e-14,
        **dict(zip(system.model.coordinates, start[:n], strict=True)),
    )


def moved(system, start, k, by, paths):
    """The system and start with the k-th of the numbers of the start and of the parameters
    moved.
    """
    if k < len(start):
        return system, np.array(start) + by * (np.arange(len(start)) == k)
    path = paths[k - len(start)]
    return system.with_({path: system.get(path) + by}), np.array(start)


def differences(system, start, duration, paths, step):
    """From both sides, (2, state, numbers); each of an error of first order, as the order of the
    impacts has one of second.
    """
    base = end_of(system, start, duration)
    return np.array(
        [
            [
                (end_of(*moved(system, start, k, sign * step, paths), duration) - base)
                * (sign / step)
                for k in range(len(start) + len(paths))
            ]
            for sign in (1, -1)
        ]
    ).transpose(0, 2, 1)


def at_instants(motion, kind):
    """The contacts of events of a kind at each instant, one after the other."""
    instants = {}
    for event in motion.events.of(kind):
        instants.setdefault(event.time, []).append(event.contact)
    return ["+".join(contacts) for contacts in instants.values()]


def closed_together(result):
    return {name for name in at_instants(result.motion, EventKind.IMPACT) if "+" in name}


# What couples the masses, how they start, their restitution: all three alike, or the outer two
# about another one
CASES = {
    "apart": ({}, (0.5, 0.5, 0.5), (0.2, 0.2, 0.2), 0.6, 4.0),
    "all three with springs": ({"spring": 0.7}, (0.5, 0.5, 0.5), (0.2, 0.2, 0.2), 0.6, 4.0),
    "the outer two": ({"spring": 0.3, "between": 0.5}, (0.5, 0.9, 0.5), (0.1, 0.4, 0.1), 0.8, 4.0),
    "without bounce": ({"spring": 0.7, "between": 0.4}, (0.5, 0.5, 0.5), (0.2, 0.2, 0.2), 0.0, 6.0),
    "impacts that die away": ({"spring": 0.7}, (0.5, 0.5, 0.5), (0.2, 0.2, 0.2), 0.2, 6.0),
}
for seed in range(
    4
):  # springs, starts and restitutions at random, and every second time with another start of the mass in the middle
    numbers = (
        np.random.default_rng(seed)
        .uniform((0.0, 0.2, -0.5, 0.1, -0.5, 0.05), (2.0, 1.0, 0.5, 1.0, 0.5, 0.9))
        .tolist()
    )
    outer, middle = numbers[1:3], numbers[3:5] if seed % 2 else numbers[1:3]
    x, v = zip(outer, middle, outer, strict=True)
    CASES[f"random {seed}"] = ({"spring": numbers[0]}, x, v, numbers[5], 4.0)


@pytest.mark.parametrize("name", CASES)
def test_derivatives_are_the_limit_of_differences_from_either_side(name):
    numbers, x, v, e, duration = CASES[name]
    system, start = row(e, force=-0.3 if e < 0.3 else -0.7, **numbers), (*x, *v)
    paths = PATHS if e else (PATHS[0], PATHS[1], PATHS[4])
    result = derivatives(system, start, duration, paths)
    assert result.undefined is None
    assert closed_together(result) == {"wall_1+wall_3" if x[1] != x[0] else "wall_1+wall_2+wall_3"}
    found = np.hstack([result.state, result.parameters])
    coarse, fine = (differences(system, start, duration, paths, step) for step in (2e-5, 1e-5))
    size = np.abs(found).max()
    for side in range(2):
        np.testing.assert_allclose(
            (2 * fine - coarse)[side] / size, found / size, rtol=0, atol=1e-7
        )


def test_rows_without_springs_have_the_derivatives_of_one_mass():
    one = derivatives(row(kind=Single), (0.5, 0.2), 4.0, ("load.frequency", "model.wall"))
    three = derivatives(row(), (0.5,) * 3 + (0.2,) * 3, 4.0, ("load.frequency", "model.wall"))
    np.testing.assert_allclose(three.state, np.kron(one.state, np.eye(3)), rtol=0, atol=1e-13)
    np.testing.assert_allclose(
        three.parameters, np.repeat(one.parameters, 3, axis=0), rtol=0, atol=1e-13
    )
    together = at_instants(three.motion, EventKind.IMPACT)
    assert set(together) == {"wall_1+wall_2+wall_3"}
    assert len(three.motion.impacts) == 3 * len(one.motion.impacts)
    np.testing.assert_allclose(
        three.event_times[:, 6:], np.repeat(one.event_times[:, 2:], 3, axis=0), rtol=1e-11
    )
    for mass in range(3):  # each mass moves its own impact
        own = three.event_times[mass::3]
        np.testing.assert_allclose(own[:, [mass, 3 + mass]], one.event_times[:, :2], rtol=1e-11)
        others = [i for i in range(6) if i % 3 != mass]
        assert np.abs(own[:, others]).max() < 1e-14


def test_dampers_between_masses_leave_derivatives_from_one_side_only():
    """Between two impacts t apart a damper of constant b gives each of the two masses b (1 + e) v
    t.

    One has it before its own impact, which turns it round to -e of it, the other one after it; they
    change places where the other mass is the first. So derivatives from both sides differ by b (1 +
    e)^2 v abs(t) for each neighbour.
    """
    e, between, step = 0.6, 0.4, 1e-6
    system, start = row(e, between=between), (0.5,) * 3 + (0.2,) * 3
    impact = saltus.simulate(
        system, x_1=0.5, x_2=0.5, x_3=0.5, velocity=start[3:], duration=3.0
    ).events[0]
    early = derivatives(system, start, impact.time - 1e-4)
    result = derivatives(system, start, impact.time + 1e-4, ("load.frequency",))
    assert "only one-sided derivatives" in result.undefined
    assert np.isnan(result.state[:, :3]).all()
    above, below = differences(system, start, impact.time + 1e-4, ("load.frequency",), step)
    np.testing.assert_allclose(result.parameters[:, 0], above[:, 6], rtol=0, atol=1e-4)
    v = -impact.velocity_before[0]
    delays = early.state[:3, 0] / v  # of the impacts, by the start of the first mass
    one, other = -between * (1 + e) ** 2 * v * np.abs(np.diff(delays))
    assert one < -0.5
    np.testing.assert_allclose((above - below)[3:, 0], [one, one + other, other], rtol=0, atol=2e-3)


@dataclass(frozen=True, kw_only=True)
class Pushed(Row):
    """The first mass has a further force."""

    push: float = 0.0

    def force(self, t, x, v, load):
        first, *others = Row.force(self, t, x, v, load)
        return (first + self.push, *others)


def test_a_release_of_several_has_a_derivative_only_to_what_keeps_them_together():
    """Masses at their walls leave where F(t) = k x_wall: dt = x_wall dk / F'(t), while a push on
    one moves its instant alone.
    """
    W, wall = 1.3, 0.2
    load = Load(frequency=W, force=-0.2 + Harmonic(amplitude=0.5))
    system = System(model=Pushed(wall=wall), load=load, impact=NewtonImpact(e=(0.0,) * 3))
    start = dict.fromkeys(system.model.coordinates, wall)
    paths = ("model.stiffness", "model.push")
    result = saltus.sensitivities(
        system, velocity=(0.0,) * 3, duration=2.0, parameters=paths, tol=1e-14, **start
    )
    *_, release = result.motion.events
    assert at_instants(result.motion, EventKind.RELEASE) == ["wall_1+wall_2+wall_3"]
    instant = np.arcsin((0.2 + 0.4 * wall) / 0.5) / W
    assert release.time == pytest.approx(instant, abs=1e-14)
    assert result.event_times[-1, 6] == pytest.approx(
        wall / (0.5 * W * np.cos(W * instant)), rel=1e-12
    )
    assert np.isnan(result.event_times[-1, 7])
    alone = saltus.sensitivities(
        system.with_({"model.push": -0.01}),
        velocity=(0.0,) * 3,
        duration=2.0,
        parameters=paths,
        **start,
    )
    slope = -1.0 / (0.5 * W * np.cos(W * alone.motion.events[-1].time))
    assert at_instants(alone.motion, EventKind.RELEASE) == ["wall_2+wall_3", "wall_1"]
    np.testing.assert_allclose(alone.event_times[-2:, 7], [0.0, slope], rtol=1e-12)
    assert np.isfinite(result.state).all()
    assert np.isfinite(result.parameters).all()
