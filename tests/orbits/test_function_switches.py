"""Orbits of models whose forces switch with functions of the state: their states, multipliers and
branches beside an independent integrator.
"""

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import saltus
from saltus import Surface
from saltus.errors import ParameterError
from saltus.systems import ContactModel, Harmonic, Load, System


@dataclass(frozen=True, kw_only=True)
class Dragged(ContactModel):
    """A hardening oscillator with quadratic drag."""

    drag: float = 0.1
    hardening: float = 1.0

    coordinates: ClassVar[tuple[str, ...]] = ("x",)
    channels: ClassVar[tuple[str, ...]] = ("force",)

    def force(self, t, x, velocity, load):
        drag = self.drag * velocity * abs(velocity) + 0.02 * velocity
        return load.force(t) - x - self.hardening * x**3 - drag


@dataclass(frozen=True, kw_only=True)
class Pushed(ContactModel):
    """A mass on a spring, with a push while a function of the state is positive."""

    push: float = 0.3

    coordinates: ClassVar[tuple[str, ...]] = ("x",)
    channels: ClassVar[tuple[str, ...]] = ("force",)
    surfaces: ClassVar[tuple[Surface, ...]] = (Surface(name="ahead", function="ahead"),)

    def ahead(self, t, x, velocity, load):
        return x - 0.4 + 0.3 * velocity

    def force(self, t, x, velocity, load, sides):
        pushed = self.push * (1.0 + sides.ahead) / 2.0
        return load.force(t) - x - 0.2 * velocity + pushed


def dragged(frequency):
    return System(model=Dragged(), load=Load(frequency=frequency, force=Harmonic(0.4)))


def field_of_dragged(frequency, drag=0.1):
    return lambda t, s: [
        s[1],
        0.4 * math.sin(frequency * t) - s[0] - s[0] ** 3 - drag * s[1] * abs(s[1]) - 0.02 * s[1],
    ]


def one_period(field, start, begin, period):
    """The state after a period by DOP853; forces are continuous, and their bends cost it steps."""
    run = solve_ivp(
        field, (begin, begin + period), start, "DOP853", rtol=1e-13, atol=1e-14, max_step=0.02
    )
    return run.y[:, -1]


def test_an_orbit_with_quadratic_drag_has_the_multipliers_of_an_integrator():
    system = dragged(1.3)
    orbit = saltus.find_orbit(system, x=0.0, velocity=0.0)
    motion = orbit.motion()
    start, begin = np.array([*np.atleast_1d(motion.at(motion.start)).ravel()]), motion.start
    period = 2.0 * math.pi / 1.3
    field = field_of_dragged(1.3)
    after = one_period(field, start, begin, period)
    assert np.allclose(after, start, rtol=0.0, atol=1e-9)
    step = 1e-4
    slopes = np.column_stack(
        [
            (
                one_period(field, start + step * unit, begin, period)
                - one_period(field, start - step * unit, begin, period)
            )
            / (2.0 * step)
            for unit in np.eye(2)
        ]
    )
    expected = np.sort_complex(np.linalg.eigvals(slopes))
    assert np.allclose(np.sort_complex(orbit.multipliers), expected, rtol=0.0, atol=1e-6)


def test_folds_of_quadratic_drag_are_where_the_frequency_turns_round():
    """At a fold of a hardening oscillator a multiplier is 1, by the differences of DOP853 too."""
    orbit = saltus.find_orbit(dragged(0.9), x=0.0, velocity=0.0)
    branch = saltus.continue_orbit(orbit, "load.frequency", (0.8, 2.6))
    folds = [point for point in branch.special if str(point.kind) == "LP"]
    assert len(folds) >= 2
    for point in folds[:2]:
        frequency = point.orbit.system.load.frequency
        motion = point.orbit.motion()
        start, begin = np.array([*np.atleast_1d(motion.at(motion.start)).ravel()]), motion.start
        field, period = field_of_dragged(frequency), 2.0 * math.pi / frequency
        step = 1e-4
        slopes = np.column_stack(
            [
                (
                    one_period(field, start + step * unit, begin, period)
                    - one_period(field, start - step * unit, begin, period)
                )
                / (2.0 * step)
                for unit in np.eye(2)
            ]
        )
        assert abs(np.linalg.eigvals(slopes) - 1.0).min() < 1e-5


def test_an_orbit_with_a_force_that_jumps_across_a_function():
    system = System(model=Pushed(), load=Load(frequency=0.8, force=Harmonic(0.5)))
    orbit = saltus.find_orbit(system, x=0.0, velocity=0.0)
    motion = orbit.motion()
    assert [str(event.kind) for event in motion.events] == ["crossing"] * 2
    state = np.array([float(x) for x in motion.at(motion.start)])

    def after(start):
        found = saltus.simulate(
            system,
            x=start[0],
            velocity=start[1],
            time=motion.start,
            duration=motion.time - motion.start,
        )
        return np.array([found.position, found.velocity])

    assert np.allclose(after(state), state, rtol=0.0, atol=1e-10)
    step = 1e-5
    slopes = np.column_stack(
        [(after(state + step * u) - after(state - step * u)) / (2.0 * step) for u in np.eye(2)]
    )
    expected = np.sort_complex(np.linalg.eigvals(slopes))
    assert np.allclose(np.sort_complex(orbit.multipliers), expected, rtol=0.0, atol=1e-8)


def test_a_branch_on_which_a_function_is_no_longer_crossed():
    """With less load the function stays negative, and the orbit is that of a linear oscillator: it
    is lost where the largest x + 0.3 v is 0.4."""
    w, c = 0.8, 0.2
    gain = math.hypot(1.0, 0.3 * w) / math.hypot(1.0 - w**2, c * w)
    touch = 0.4 / gain
    system = System(model=Pushed(), load=Load(frequency=w, force=Harmonic(0.5 * touch)))
    orbit = saltus.find_orbit(system, x=0.0, velocity=0.0)
    assert not len(orbit.motion().events)
    branch = saltus.continue_orbit(orbit, "load.force.amplitude", (0.05, 2.0 * touch))
    last = max(point.parameter for point in branch.special) if branch.special else math.nan
    assert math.isclose(last, touch, rel_tol=1e-6), (branch, touch)


def test_a_force_that_jumps_by_itself_is_refused():
    @dataclass(frozen=True, kw_only=True)
    class Signed(ContactModel):
        coordinates: ClassVar[tuple[str, ...]] = ("x",)
        channels: ClassVar[tuple[str, ...]] = ("force",)

        def force(self, t, x, velocity, load):
            return load.force(t) - x - 0.2 * np.where(velocity > 0.5, 1.0, 0.0)

    system = System(model=Signed(), load=Load(frequency=0.8, force=Harmonic(0.5)))
    with pytest.raises(ParameterError, match="name what they switch with as a method"):
        saltus.find_orbit(system, x=0.0)
