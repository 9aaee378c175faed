"""Laws as textbooks write them, in the force of a model: friction that falls with the speed, functions
of one sign, against frictions of the library and an independent integrator.
"""

import math
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from saltus import Friction
from saltus.errors import TraceError
from saltus.flow import sensitivities, simulate
from saltus.systems import ContactModel, Harmonic, Load, System

LOAD = Load(frequency=1.1, force=Harmonic(0.7))
START: dict[str, Any] = {"x": 0.2, "velocity": 1.0}


@dataclass(frozen=True, kw_only=True)
class Stribeck(ContactModel):
    """A mass on a rough ground, whose friction falls with the speed."""

    kinetic: float = 0.3
    static: float = 0.5
    fall: float = 0.4
    ground: float = 0.0

    coordinates: ClassVar[tuple[str, ...]] = ("x",)
    channels: ClassVar[tuple[str, ...]] = ("force",)

    def force(self, t, x, velocity, load):
        slip = velocity - self.ground
        size = self.kinetic + (self.static - self.kinetic) * np.exp(-abs(slip / self.fall))
        return load.force(t) - 0.2 * x - np.sign(slip) * size


@dataclass(frozen=True, kw_only=True)
class Rubbed(Stribeck):
    """The same by a friction of the library."""

    @property
    def frictions(self):
        return (
            Friction(
                name="rub",
                coordinate="x",
                kinetic=self.kinetic,
                static=self.static,
                stribeck_speed=self.fall,
                ground_speed=self.ground,
            ),
        )

    def force(self, t, x, velocity, load):
        return load.force(t) - 0.2 * x


def by_dop853(end, ground, size):
    """The state at the end and the events, from one event to the next, with a state that says
    whether it sticks."""
    t, state, way = 0.0, np.array([START["x"], START["velocity"]]), 1.0
    events = []

    def drive(t, x):
        return 0.7 * math.sin(1.1 * t) - 0.2 * x

    def field(t, s):
        return [s[1], drive(t, s[0]) - way * size(abs(s[1] - ground)) if way else 0.0]

    def event(t, s):
        return way * (s[1] - ground) if way else size(0.0) - abs(drive(t, s[0]))

    event.terminal = True
    event.direction = -1.0
    while t < end:
        run = solve_ivp(
            field,
            (t, end),
            state,
            "DOP853",
            events=event,
            rtol=1e-13,
            atol=1e-15,
            max_step=0.05,
        )
        t, state = run.t[-1], run.y[:, -1].copy()
        if run.status != 1:
            break
        state[1] = ground
        push = drive(t, state[0])
        before, way = way, math.copysign(1.0, push) if way == 0.0 or abs(push) > size(0.0) else 0.0
        events.append(("slip" if before == 0.0 else "crossing" if way else "stick", t))
    return state, events


@pytest.mark.parametrize("ground", [0.0, 0.3])
def test_friction_that_falls_with_the_speed_sticks_and_slips(ground):
    end = 40.0
    model = Stribeck(ground=ground)
    motion = simulate(System(model=model, load=LOAD), **START, duration=end)
    state, events = by_dop853(end, ground, lambda u: 0.3 + 0.2 * math.exp(-u / 0.4))
    assert np.allclose([motion.position, motion.velocity], state, rtol=0.0, atol=1e-11)
    assert [str(event.kind) for event in motion.events] == [kind for kind, _ in events]
    assert {kind for kind, _ in events} >= {"stick", "slip"}
    found = [event.time for event in motion.events]
    assert np.allclose(found, [time for _, time in events], rtol=0.0, atol=1e-11)
    rubbed = simulate(System(model=Rubbed(ground=ground), load=LOAD), **START, duration=end)
    assert math.isclose(motion.position, rubbed.position, abs_tol=1e-12)
    assert math.isclose(motion.velocity, rubbed.velocity, abs_tol=1e-12)


@pytest.mark.parametrize("end", [8.9, 12.0, 14.0, 16.0, 17.7, 18.2])
def test_a_motion_is_the_same_whenever_it_ends(end):
    """A step from a release begins with accelerations that cancel to rounding."""
    motion, rubbed = (
        simulate(System(model=model, load=LOAD), **START, duration=end)
        for model in (Stribeck(), Rubbed())
    )
    assert math.isclose(motion.position, rubbed.position, abs_tol=1e-12)
    assert math.isclose(motion.velocity, rubbed.velocity, abs_tol=1e-12)


def test_derivatives_of_friction_that_falls_with_the_speed():
    paths = ("model.kinetic", "model.static", "model.fall", "load.force.amplitude")
    one, two = (
        sensitivities(System(model=model, load=LOAD), **START, parameters=paths, duration=23.0)
        for model in (Stribeck(), Rubbed())
    )
    assert {"stick", "slip"} <= {str(event.kind) for event in one.motion.events}
    assert np.allclose(one.state, two.state, rtol=0.0, atol=1e-10)
    assert np.allclose(one.parameters, two.parameters, rtol=0.0, atol=1e-10)


def with_force(force, names=("x",), **numbers):
    """A system with a force of t, x, v, the load and the model's numbers a and b."""

    @dataclass(frozen=True, kw_only=True)
    class Own(ContactModel):
        a: float = 0.4
        b: float = 2.0

        coordinates: ClassVar[tuple[str, ...]] = names
        channels: ClassVar[tuple[str, ...]] = ("force",)

        def force(self, t, x, velocity, load):
            return force(t, x, velocity, load.force(t), self)

    return System(model=Own(**numbers), load=LOAD)


def dry(sign):
    return lambda t, x, v, f, m: f - 0.2 * x - 0.4 * sign(x, v, m)


@pytest.mark.parametrize(
    "sign",
    [
        lambda x, v, m: np.sign(v**3),
        lambda x, v, m: np.sign(3.0 * v),
        lambda x, v, m: -np.sign(-v / 7.0),
        lambda x, v, m: np.sign(v / m.b),
        lambda x, v, m: -np.sign(v * (m.a - m.b)),
        lambda x, v, m: np.sign(v * np.exp(x)),
        lambda x, v, m: np.sign(v**3 / (1.0 + x * x)),
        lambda x, v, m: np.sign(np.tanh(v)),
        lambda x, v, m: 0.75 * np.sign(v) + 0.25 * np.sign(3.0 * v),
        lambda x, v, m: 0.5 * np.sign(v * np.exp(x)) + 0.5 * np.sign(v / m.b),
        lambda x, v, m: np.where(v > 0.0, 1.0, -1.0),
        lambda x, v, m: np.where(2.0 * v > 0.0, 1.0, 1.0) * np.sign(v),
        lambda x, v, m: np.sign(v) ** 3,
        lambda x, v, m: np.sign(v) * np.exp(np.sign(v) - np.where(v > 0.0, 1.0, -1.0)),
    ],
)
def test_functions_of_one_sign_are_one_switch(sign):
    plain = simulate(with_force(dry(lambda x, v, m: np.sign(v))), **START, duration=25.0)
    other = simulate(with_force(dry(sign)), **START, duration=25.0)
    assert [event.kind for event in other.events] == [event.kind for event in plain.events]
    assert {"stick", "slip"} <= {str(event.kind) for event in plain.events}
    times = [[event.time for event in motion.events] for motion in (plain, other)]
    assert np.allclose(*times, rtol=0.0, atol=1e-11)
    assert math.isclose(other.position, plain.position, abs_tol=1e-12)
    assert math.isclose(other.velocity, plain.velocity, abs_tol=1e-12)


def test_friction_with_two_coefficients_is_that_of_an_integrator():
    """mu is 0.3 forwards and 0.45 backwards, where the product of two switches is a mean."""
    end = 30.0
    system = with_force(
        lambda t, x, v, f, m: f - 0.2 * x - np.where(v > 0.0, 0.3, 0.45) * np.sign(v)
    )
    motion = simulate(system, **START, duration=end)
    # it sticks while the push lies between -0.45 and 0.3
    t, state, way = 0.0, [0.2, 1.0], 1

    def push(t, x):
        return 0.7 * math.sin(1.1 * t) - 0.2 * x

    kinds = []
    while True:
        friction = {1: -0.3, -1: 0.45}

        def field(t, s, way=way, friction=friction):
            return [s[1], push(t, s[0]) + friction[way] if way else 0.0]

        def event(t, s, way=way):
            return way * s[1] if way else min(0.3 - push(t, s[0]), push(t, s[0]) + 0.45)

        event.terminal, event.direction = True, -1.0
        run = solve_ivp(
            field, (t, end), state, "DOP853", events=event, rtol=1e-13, atol=1e-15, max_step=0.05
        )
        t, state = run.t[-1], [run.y[0, -1], run.y[1, -1]]
        if run.status != 1:
            break
        state[1] = 0.0
        force = push(t, state[0])
        before = way
        way = 1 if force > 0.3 - 1e-9 else -1 if force < -0.45 + 1e-9 else 0
        kinds.append("slip" if before == 0 else "crossing" if way else "stick")
    assert [str(event.kind) for event in motion.events] == kinds
    assert "stick" in kinds
    assert np.allclose([motion.position, motion.velocity], state, rtol=0.0, atol=1e-11)


def test_a_stiffness_of_zero_has_no_force():
    """A factor is left out of a switch, and the switch does not vanish with it."""
    spring = with_force(lambda t, x, v, f, m: f - x - 0.1 * v - np.maximum(m.a * x, 0.0), a=0.0)
    plain = with_force(lambda t, x, v, f, m: f - x - 0.1 * v)
    found = [simulate(each, **START, duration=15.0) for each in (spring, plain)]
    assert math.isclose(found[0].position, found[1].position, abs_tol=1e-12)


@dataclass(frozen=True, kw_only=True)
class Train(ContactModel):
    """Two masses that a spring joins, each of which rubs with a friction that falls."""

    coordinates: ClassVar[tuple[str, ...]] = ("x", "y")
    channels: ClassVar[tuple[str, ...]] = ("force",)

    def mass_matrix(self, q):
        return [[1.0, 0.2], [0.2, 0.6]]

    def force(self, t, q, velocity, load):
        (x, y), (u, v) = q, velocity
        pull = 0.8 * (y - x)
        first = np.sign(u) * (0.3 + 0.1 * np.exp(-np.abs(u) / 0.2))
        return load.force(t) - 0.2 * x + pull - first, -pull - 0.3 * v


@dataclass(frozen=True, kw_only=True)
class RubbedTrain(Train):
    """The same by a friction of the library."""

    frictions: ClassVar[tuple[Friction, ...]] = (
        Friction(name="rub", coordinate="x", kinetic=0.3, static=0.4, stribeck_speed=0.2),
    )

    def force(self, t, q, velocity, load):
        (x, y), (_, v) = q, velocity
        pull = 0.8 * (y - x)
        return load.force(t) - 0.2 * x + pull, -pull - 0.3 * v


def test_a_mass_of_two_that_sticks_under_a_falling_friction():
    start = {"x": 0.2, "y": -0.3, "velocity": (1.0, 0.0)}
    one, two = (
        simulate(System(model=model, load=LOAD), **start, duration=30.0)
        for model in (Train(), RubbedTrain())
    )
    assert {"stick", "slip"} <= {str(event.kind) for event in one.events}
    assert np.allclose(one.position, two.position, rtol=0.0, atol=1e-11)
    assert np.allclose(one.velocity, two.velocity, rtol=0.0, atol=1e-11)


@pytest.mark.parametrize(
    ("law", "same"),
    [
        (lambda x, v: np.copysign(0.4, v), lambda x, v: 0.4 * np.sign(v)),
        (lambda x, v: np.fabs(v) * v, lambda x, v: np.abs(v) * v),
        (lambda x, v: np.clip(x, None, 0.3), lambda x, v: np.minimum(x, 0.3)),
        (lambda x, v: np.clip(x, a_min=0.1, a_max=None), lambda x, v: np.maximum(x, 0.1)),
        (lambda x, v: np.heaviside(x, 0.5) * v, lambda x, v: np.where(x > 0.0, v, 0.0)),
        (lambda x, v: np.heaviside(x, 1.0) * v, lambda x, v: np.where(x > 0.0, v, 0.0)),
        (
            lambda x, v: np.where((x > 0.0) & (v > 0.0), v, 0.0),
            lambda x, v: np.where(x > 0.0, np.maximum(v, 0.0), 0.0),
        ),
        (
            lambda x, v: np.where(np.logical_or(x <= 0.0, np.logical_not(v > 0.0)), 0.0, v),
            lambda x, v: np.where(x > 0.0, np.maximum(v, 0.0), 0.0),
        ),
    ],
)
def test_forms_of_numpy_are_those_they_stand_for(law, same):
    motions = [
        simulate(
            with_force(lambda t, x, v, f, m, law=law: f - 0.2 * x - law(x, v)),
            **START,
            duration=15.0,
        )
        for law in (law, same)
    ]
    assert len(motions[0].events) == len(motions[1].events) > 0
    assert math.isclose(motions[0].position, motions[1].position, abs_tol=1e-11)


@pytest.mark.parametrize(
    ("law", "words"),
    [
        (lambda x, v: max(x, 0.0), r"np\.maximum\(x, 0\.0\)"),
        (lambda x, v: v if v > 0.0 else 0.0, r"write np\.where\(x > 0\.0, a, b\)"),
        (lambda x, v: np.where(x > 0.0 and v > 0.0, v, 0.0), r"\(x > 0\.0\) & \(v < 0\.0\)"),
        (lambda x, v: math.copysign(1.0, v), "use NumPy's functions, not math's"),
    ],
)
def test_forms_of_python_are_refused_with_the_form_to_write(law, words):
    with pytest.raises(TraceError, match=words) as refusal:
        simulate(with_force(lambda t, x, v, f, m: f - law(x, v)), **START, duration=1.0)
    assert len(str(refusal.value)) < 450
