"""Sweeps without a load: the amplitude and the period of cycles, up and down."""

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import saltus
from saltus import BeltOscillator, ContactModel, Friction, System

KINETIC, STATIC = 0.2, 0.3


@dataclass(frozen=True, kw_only=True)
class VanDerPol(ContactModel):
    """x'' = mu (1 - x^2) x' - x."""

    mu: float = 1.0

    coordinates: ClassVar[tuple[str, ...]] = ("x",)
    channels: ClassVar[tuple[str, ...]] = ()

    def force(self, t, x, velocity, load):
        return self.mu * (1.0 - x * x) * velocity - x


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


def test_stick_slip_over_the_belts_speed_has_its_closed_form():
    """It sticks over 2 (s - k) / w and slips on a circle about k, of the radius of (s - k, w)."""
    belt = System(model=BeltOscillator(kinetic=KINETIC, static=STATIC))
    speeds = np.array([0.06, 0.08, 0.1])
    sweep = saltus.frequency_sweep(belt, speeds, path="model.belt_speed", x=0.3, velocity=0.06)
    over = STATIC - KINETIC
    period = 2.0 * (math.pi - np.arctan2(over, speeds)) + 2.0 * over / speeds
    assert set(np.ravel(sweep.outcome.values)) == {"periodic"}
    for direction in ("up", "down"):
        here = sweep.sel(direction=direction)
        np.testing.assert_allclose(here.period, period, rtol=0, atol=1e-10)
        np.testing.assert_allclose(here.amplitude, KINETIC + np.hypot(over, speeds), atol=1e-10)
    assert sweep.sizes["jump"] == 0
    assert not sweep.hysteresis.any()


def van_der_pol(mu):
    """The period and the amplitude by DOP853: the times between maxima, once settled."""

    def field(t, state):
        return [state[1], mu * (1.0 - state[0] ** 2) * state[1] - state[0]]

    def at_maximum(t, state):
        return state[1]

    at_maximum.direction = -1
    run = solve_ivp(
        field, (0.0, 120.0), [2.0, 0.0], "DOP853", events=at_maximum, rtol=1e-12, atol=1e-12
    )
    times = run.t_events[0]
    return times[-1] - times[-2], run.y_events[0][-1][0]


def test_a_sweep_of_van_der_pols_oscillator_is_that_of_an_independent_solver():
    values = [0.5, 1.0, 1.5]
    sweep = saltus.frequency_sweep(System(model=VanDerPol()), values, path="model.mu", x=0.5)
    expected = np.array([van_der_pol(mu) for mu in values]).T
    for direction in ("up", "down"):
        here = sweep.sel(direction=direction)
        np.testing.assert_allclose(here.period, expected[0], rtol=0, atol=1e-8)
        np.testing.assert_allclose(here.amplitude, expected[1], rtol=0, atol=1e-8)


def test_a_squealing_brake_is_silent_and_loud_at_one_speed():
    """The equilibrium attracts above the Hopf point 0.5 ln 6, where a stick-slip cycle still lives."""
    hopf = 0.5 * math.log(6.0)
    speeds = np.array([0.7, 1.0, 1.3])
    sweep = saltus.frequency_sweep(System(model=Squealing()), speeds, path="model.speed", x=1.0)
    assert speeds[0] < hopf < speeds[1]
    assert sweep.outcome.values.tolist() == [
        ["periodic", "periodic", "equilibrium"],
        ["periodic", "equilibrium", "equilibrium"],
    ]
    assert sweep.hysteresis.values.tolist() == [0, 1, 0]
    assert (sweep.period.values > 0.0).tolist() == [[True, True, False], [True, False, False]]
    jumps = dict(zip(sweep.jump_direction.values.tolist(), sweep.jump_after.values, strict=True))
    assert set(jumps) == {"up", "down"}
    assert abs(jumps["down"] - hopf) < 1e-2  # it grows as slowly as exp(4e-2 t (hopf - speed))


def test_an_equilibrium_that_repels_is_left():
    """A motion that is begun at it exactly."""
    sweep = saltus.frequency_sweep(System(model=VanDerPol()), [0.5, 1.0], path="model.mu", x=0.0)
    assert set(np.ravel(sweep.outcome.values)) == {"periodic"}


def test_what_has_no_meaning_without_a_load_is_refused():
    system = System(model=VanDerPol())
    with pytest.raises(saltus.ParameterError, match="no frequency to sweep"):
        saltus.frequency_sweep(system, [1.0, 2.0])
    with pytest.raises(saltus.ParameterError, match="no forcing periods"):
        saltus.frequency_sweep(system, [0.5, 1.0], path="model.mu", stop_early=False, x=0.1)
