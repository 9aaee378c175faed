"""Random models with switches of velocities and functions, against an independent integrator that
restarts at every zero of a switch.
"""

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from saltus.flow import sensitivities, simulate
from saltus.systems import ContactModel, Harmonic, Load, System


@dataclass(frozen=True, kw_only=True)
class Random(ContactModel):
    """Two masses with a spring that only pushes, drag, a damper with two slopes, and a force that
    jumps across a function."""

    a: float = 0.5
    b: float = 0.5
    c: float = 0.5
    d: float = 0.5
    e: float = 0.5
    f: float = 0.1

    coordinates: ClassVar[tuple[str, ...]] = ("x", "y")
    channels: ClassVar[tuple[str, ...]] = ("force",)

    def mass_matrix(self, q):
        return [[1.2, 0.3], [0.3, 0.8]]

    def force(self, t, q, velocity, load):
        (x, y), (u, v) = q, velocity
        one, two, three, four = functions(t, q, velocity, load.force(t), self)
        stop = np.maximum(one, 0.0)
        drag = self.b * two * abs(two)
        damped = np.where(three > 0.0, 2.0 * self.c, self.c) * three
        jump = self.f * np.sign(four)
        return (
            load.force(t) - x - 0.1 * u - self.a * 10.0 * stop - drag + damped,
            -y - 0.1 * v - damped + jump,
        )


def functions(t, q, velocity, push, model):
    """What the forces switch with."""
    (x, y), (u, v) = q, velocity
    return x + 0.3 * y - model.d, u, v - u, y - model.e * push + 0.2 * x * y


NAMES = ("a", "b", "c", "d", "e", "f")
MASS = np.linalg.inv([[1.2, 0.3], [0.3, 0.8]])


def by_dop853(model, frequency, start, end):
    """The state at the end and the number of zeros, from one zero of a function to the next."""
    t, state, count = 0.0, np.array(start), 0

    def values(t, s):
        return functions(t, s[:2], s[2:], 0.8 * math.sin(frequency * t), model)

    sides = [1.0 if value >= 0.0 else -1.0 for value in values(0.0, state)]

    def field(t, s):
        one, two, three, _ = values(t, s)
        stop = one if sides[0] > 0.0 else 0.0
        drag = model.b * sides[1] * two * two
        damped = (2.0 if sides[2] > 0.0 else 1.0) * model.c * three
        force = [
            0.8 * math.sin(frequency * t) - s[0] - 0.1 * s[2] - 10.0 * model.a * stop - drag,
            -s[1] - 0.1 * s[3] + model.f * sides[3],
        ]
        return np.concatenate([s[2:], MASS @ [force[0] + damped, force[1] - damped]])

    def event(number):
        found = lambda t, s: values(t, s)[number]  # noqa: E731
        found.terminal, found.direction = True, -sides[number]
        return found

    while t < end:
        run = solve_ivp(
            field,
            (t, end),
            state,
            "DOP853",
            events=[event(number) for number in range(4)],
            rtol=1e-13,
            atol=1e-14,
            max_step=0.05,
        )
        t, state = run.t[-1], run.y[:, -1]
        if run.status == 1:
            sides[next(i for i, hits in enumerate(run.t_events) if len(hits))] *= -1.0
            count += 1
    return state, count


def case(seed):
    random = np.random.default_rng(seed)
    model = Random(**dict(zip(NAMES, random.uniform(0.1, 0.8, 6).tolist(), strict=True)))
    frequency = float(random.uniform(0.5, 2.0))
    start = random.normal(0.0, 0.5, 4)
    system = System(model=model, load=Load(frequency=frequency, force=Harmonic(0.8)))
    return system, start


def check_motion(seed):
    system, start = case(seed)
    end = 15.0
    motion = simulate(system, x=start[0], y=start[1], velocity=tuple(start[2:]), duration=end)
    state, count = by_dop853(system.model, system.load.frequency, start, end)
    crossings = [event for event in motion.events if str(event.kind) == "crossing"]
    assert len(crossings) == count, seed
    assert np.allclose([*motion.position, *motion.velocity], state, rtol=0.0, atol=3e-10), seed


def check_derivatives(seed):
    system, start = case(seed)
    end, step = 8.0, 1e-5
    paths = ("model.d", "model.f", "load.frequency")
    found = sensitivities(
        system, x=start[0], y=start[1], velocity=tuple(start[2:]), parameters=paths, duration=end
    )
    for number, path in enumerate(paths):
        value = system.get(path)
        ends = []
        for shift in (step, -step):
            motion = simulate(
                system.with_(**{path: value + shift}),
                x=start[0],
                y=start[1],
                velocity=tuple(start[2:]),
                duration=end,
            )
            ends.append(np.array([*motion.position, *motion.velocity]))
        slope = (ends[0] - ends[1]) / (2.0 * step)
        assert np.allclose(found.parameters[:, number], slope, rtol=1e-6, atol=1e-6), (seed, path)


@pytest.mark.parametrize("seed", range(2))
def test_random_motions_are_those_of_an_independent_integrator(seed):
    check_motion(seed)


@pytest.mark.parametrize("seed", range(6))
def test_random_derivatives_are_those_of_neighbouring_motions(seed):
    check_derivatives(seed)


@pytest.mark.thorough
@pytest.mark.parametrize("seed", range(10, 200))
def test_many_random_motions_and_derivatives(seed):
    check_motion(seed)
    check_derivatives(seed)
