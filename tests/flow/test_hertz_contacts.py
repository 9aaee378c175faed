"""Laws with a power that is not whole where they set in, such as Hertz's: durations in closed form,
energies, and an independent integrator.
"""

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from saltus.errors import TraceError
from saltus.flow import sensitivities, simulate
from saltus.systems import ContactModel, System


def with_force(force, **numbers):
    """A system with a force of y, v and the model's numbers k, g and w."""

    @dataclass(frozen=True, kw_only=True)
    class Own(ContactModel):
        k: float = 1e4
        g: float = 9.81
        w: float = 0.0

        coordinates: ClassVar[tuple[str, ...]] = ("y",)
        channels: ClassVar[tuple[str, ...]] = ()

        def force(self, t, y, velocity, load):
            return force(y, velocity, self)

    return System(model=Own(**numbers))


def ball(y, v, m):
    return m.k * np.maximum(m.w - y, 0.0) ** 1.5 - m.g


def crossings(motion):
    return [event.time for event in motion.events if str(event.kind) == "crossing"]


@pytest.mark.parametrize(
    ("stiffness", "speed", "power"),
    [(1.0, 1.0, 1.5), (1e4, 3.0, 1.5), (1e9, 0.1, 1.5), (1e-3, 20.0, 1.5), (50.0, 2.0, 2.2)],
)
def test_the_duration_of_an_impact_by_hertz(stiffness, speed, power):
    """v^2 / 2 = k s^(p + 1) / (p + 1) at the depth s, and the duration is

    2 s / v sqrt(pi) Gamma(1 + 1 / (p + 1)) / Gamma(1 / 2 + 1 / (p + 1)) (Hertz: 2.9432 s / v).
    """
    n = power + 1.0
    depth = (n * speed**2 / (2.0 * stiffness)) ** (1.0 / n)
    shape = math.sqrt(math.pi) * math.gamma(1.0 + 1.0 / n) / math.gamma(0.5 + 1.0 / n)
    duration = 2.0 * depth / speed * shape
    start = 0.37 * duration * speed
    system = with_force(lambda y, v, m: m.k * np.maximum(-y, 0.0) ** power, k=stiffness, g=0.0)
    motion = simulate(system, y=start, velocity=-speed, duration=2.0 * duration)
    times = crossings(motion)
    assert len(times) == 2
    assert math.isclose(times[0], 0.37 * duration, rel_tol=1e-12)
    assert math.isclose(times[1] - times[0], duration, rel_tol=1e-10)
    assert math.isclose(motion.velocity, speed, rel_tol=1e-10)


def by_dop853(end, wall, g=9.81, k=1e4):
    """The state of a ball that falls on a wall, from one zero of its distance to the next."""
    t, state, inside = 0.0, np.array([0.5, 0.0]), False
    while t < end:

        def field(t, s, inside=inside):
            return [s[1], -g + (k * max(wall - s[0], 0.0) ** 1.5 if inside else 0.0)]

        def event(t, s):
            return s[0] - wall

        event.terminal, event.direction = True, 1.0 if inside else -1.0
        run = solve_ivp(
            field,
            (t, end),
            state,
            "DOP853",
            events=event,
            rtol=1e-13,
            atol=1e-15,
            max_step=5e-4 if inside else 0.1,
        )
        t, state = run.t[-1], run.y[:, -1].copy()
        if run.status == 1:
            inside = not inside
            state[0] = wall
    return state


@pytest.mark.parametrize(
    ("force", "wall"),
    [
        (ball, 0.0),
        (ball, -3.0),
        (lambda y, v, m: np.where(y < m.w, m.k * (m.w - y) ** 1.5, 0.0) - m.g, 0.0),
        (lambda y, v, m: np.where(y < m.w, m.k * np.abs(y - m.w) ** 1.5, 0.0) - m.g, 0.0),
        (lambda y, v, m: m.k * (-np.minimum(y - m.w, 0.0)) ** 1.5 - m.g, 0.0),
        (lambda y, v, m: m.k * np.maximum(m.w - y, 0.0) * np.sqrt(np.maximum(m.w - y, 0)) - m.g, 0),
    ],
)
def test_a_ball_on_a_wall_by_hertz(force, wall):
    end = 1.5
    motion = simulate(with_force(force, w=wall), y=0.5, velocity=0.0, duration=end)
    expected = by_dop853(end, wall)
    assert len(crossings(motion)) == (4 if wall == 0.0 else 2)
    assert np.allclose([motion.position, motion.velocity], expected, rtol=0.0, atol=1e-9)
    # it returns to its height
    first = simulate(with_force(force, w=wall), y=0.5, velocity=0.0, duration=crossings(motion)[1])
    energy = 0.5 * first.velocity**2 + 9.81 * (first.position - 0.5)
    assert abs(energy) < 1e-9


def test_derivatives_through_impacts_by_hertz():
    system = with_force(ball)
    found = sensitivities(system, y=0.5, velocity=0.0, parameters=("model.k",), duration=0.9)
    ends = []
    for shift in (1.0, -1.0):
        motion = simulate(
            system.with_(**{"model.k": 1e4 + shift}), y=0.5, velocity=0.0, duration=0.9
        )
        ends.append(np.array([motion.position, motion.velocity]))
    slope = (ends[0] - ends[1]) / 2.0
    assert np.allclose(found.parameters[:, 0], slope, rtol=1e-6)


def test_drag_with_a_power_from_rest():
    """x'' = 1 - x - c sign(v) abs(v)^1.5, which sets in at each turn."""
    system = with_force(lambda y, v, m: 1.0 - y - 0.3 * np.sign(v) * np.abs(v) ** 1.5)
    motion = simulate(system, y=0.0, velocity=0.0, duration=9.0)
    t, state, way = 0.0, [0.0, 0.0], 1.0
    turns = []
    while True:

        def field(t, s, way=way):
            return [s[1], 1.0 - s[0] - 0.3 * way * max(way * s[1], 0.0) ** 1.5]

        def event(t, s):
            return s[1]

        event.terminal, event.direction = True, -way
        run = solve_ivp(
            field, (t, 9.0), state, "DOP853", events=event, rtol=1e-13, atol=1e-15, max_step=0.01
        )
        t, state = run.t[-1], [run.y[0, -1], 0.0 if run.status == 1 else run.y[1, -1]]
        if run.status != 1:
            break
        turns.append(t)
        way = -way
    assert np.allclose(crossings(motion), turns, rtol=0.0, atol=1e-9)
    assert np.allclose([motion.position, motion.velocity], state, rtol=0.0, atol=1e-9)


def test_a_condition_on_what_is_0_on_a_side_is_refused():
    with pytest.raises(TraceError, match=r"is 0 on a whole side, such as np\.maximum"):
        with_force(lambda y, v, m: -y - np.where(np.maximum(y, 0.0) * v > 0.0, 0.5, 0.0))
