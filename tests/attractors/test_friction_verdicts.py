"""Exponents and verdicts of motions with dry friction, beside closed forms, multipliers and
neighbouring motions.
"""

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import pytest
from shared_systems import Falling

import saltus
from saltus import BeltOscillator, classify, lyapunov_many, lyapunov_spectrum
from saltus.flow import Ending
from saltus.systems import Harmonic, Load, System


def forced(amplitude, frequency, model=BeltOscillator, **numbers):
    return System(
        model=model(**numbers), load=Load(frequency=frequency, force=Harmonic(amplitude=amplitude))
    )


CHAOTIC = forced(0.5, 0.64, Falling, kinetic=0.4, static=0.4, belt_speed=0.5)
STICKS = forced(0.3, 0.7, kinetic=0.2, static=0.3, belt_speed=0.1, damping=0.02)


def test_a_motion_that_sticks_in_every_period_has_the_exponent_of_its_multiplier_and_one_of_minus_infinity():
    """While it sticks all that is left of a state is its place, so that one multiplier is exactly
    0.
    """
    orbit = saltus.find_orbit(STICKS, x=0.1)
    found = lyapunov_spectrum(STICKS, **orbit.start(), periods=64, transient=0)
    assert found.values[0] == pytest.approx(
        math.log(abs(orbit.multipliers[0])) / orbit.duration, abs=1e-9
    )
    assert found.values[1] == -math.inf
    assert np.linalg.det(
        saltus.sensitivities(STICKS, **orbit.start(), periods=1).state
    ) == pytest.approx(0.0, abs=1e-15)
    assert found.agrees


def test_a_motion_that_only_slides_has_the_exponents_of_a_damped_oscillator():
    """On a fast belt the friction is a constant force: -c / 2 twice."""
    found = lyapunov_spectrum(
        forced(0.1, 0.7, damping=0.1, belt_speed=3.0), x=0.1, periods=200, transient=20
    )
    np.testing.assert_allclose(found.values, -0.05, rtol=0, atol=1e-5)
    assert found.agrees


def test_a_stick_slip_cycle_without_a_load_has_the_exponents_0_and_minus_infinity():
    belt = System(model=BeltOscillator(kinetic=0.2, static=0.3, belt_speed=0.1))
    found = lyapunov_spectrum(belt, x=0.1, velocity=0.1, periods=400, transient=20)
    assert abs(found.values[0]) < found.errors[0] + found.resolution
    assert found.values[1] == -math.inf
    verdict = classify(belt, x=0.1, velocity=0.1, periods=200, transient=20)
    assert str(verdict.kind) == "periodic"
    assert verdict.orbit.multipliers == pytest.approx([0.0], abs=1e-12)


@pytest.mark.thorough
def test_chaos_with_stick_and_slip_has_the_exponent_of_two_neighbouring_motions():
    verdict = classify(CHAOTIC, x=0.1, velocity=0.0, periods=900, transient=200)
    assert str(verdict.kind) == "chaotic"
    exponents = verdict.exponents
    assert exponents.values[1] == -math.inf
    state, growth, apart = verdict.state, [], 1e-8
    direction = np.array([apart, 0.0])
    for _ in range(600):
        one = saltus.simulate(CHAOTIC, **state, periods=1, dense=False)
        moved = {"x": state["x"] + direction[0], "velocity": state["velocity"] + direction[1]}
        other = saltus.simulate(CHAOTIC, **moved, periods=1, dense=False)
        change = np.array([other.x - one.x, other.velocity - one.velocity])
        growth.append(math.log(np.linalg.norm(change) / apart))
        direction, state = (
            change * (apart / np.linalg.norm(change)),
            {"x": one.x, "velocity": one.velocity},
        )
    length = CHAOTIC.load.period
    error = (
        np.std([np.mean(part) for part in np.split(np.array(growth), 12)], ddof=1)
        / math.sqrt(12)
        / length
    )
    assert abs(np.mean(growth) / length - exponents.values[0]) < 3 * math.hypot(
        error, exponents.errors[0] / 2
    )


def test_many_exponents_at_once_are_those_of_one():
    for system in (STICKS, forced(0.8, 1.0, kinetic=0.1, static=0.1, belt_speed=0.0)):
        many = lyapunov_many(system, x=[0.1, 0.2], periods=64, transient=20)
        one = lyapunov_spectrum(system, x=0.1, periods=64, transient=20, two_trajectories=False)
        np.testing.assert_allclose(many["exponent"].values[0], one.values, rtol=0, atol=1e-6)
        assert set(many["ending"].values) <= {Ending.PERIODIC, Ending.UNDECIDED}  # neither rests


def test_a_body_that_stays_on_still_ground_is_at_rest_wherever_it_stands():
    """The load is below mu_s N - k abs(x): motions beside it come to stand beside it, so that one
    exponent is 0.
    """
    still = forced(0.1, 0.7, belt_speed=0.0)
    verdict = classify(still, x=0.1, velocity=0.1, periods=300, transient=20)
    assert str(verdict.kind) == "rest"
    assert "it stands still" in verdict.reason
    many = lyapunov_many(still, x=[0.1, 0.2], periods=64, transient=20)
    assert many["ending"].values.tolist() == [Ending.REST, Ending.REST]
    np.testing.assert_allclose(many["exponent"].values[:, 0], 0.0, rtol=0, atol=1e-12)


@dataclass(frozen=True, kw_only=True)
class Stribeck(saltus.ContactModel):
    """x'' + 0.05 x' + x = F(t) + mu(u) sign u on a belt of the speed 0.8, u = 0.8 - x'."""

    coordinates: ClassVar[tuple[str, ...]] = ("x",)
    channels: ClassVar[tuple[str, ...]] = ("force",)
    frictions = (
        saltus.Friction(
            name="belt",
            coordinate="x",
            kinetic=0.15,
            static=0.3,
            ground_speed=0.8,
            stribeck_speed=0.2,
        ),
    )

    def force(self, t, x, velocity, load):
        return load.force(t) - x - 0.05 * velocity


def sticking(x, velocity, steps=314, periods=24):
    """Which of many motions of the belt's mass under 0.01 sin(t) stick in the last two periods, by
    an implicit time stepping.
    """
    h, stuck, speed = 2 * math.pi / steps, np.zeros(x.shape, dtype=bool), velocity - 0.8
    for k in range(periods * steps):
        middle = x + 0.5 * h * (speed + 0.8)
        most = h * (0.15 + 0.15 * np.exp(-np.abs(speed) / 0.2))
        speed = speed + h * (0.01 * math.sin((k + 0.5) * h) - middle - 0.05 * (speed + 0.8))
        speed = np.where(np.abs(speed) <= most, 0.0, speed - np.sign(speed) * most)
        x = middle + 0.5 * h * (speed + 0.8)
        stuck |= (speed == 0.0) & (k >= (periods - 2) * steps)
    return stuck


def test_the_share_of_starts_that_slide_on_beside_stick_slip_is_that_of_a_time_stepping():
    found = saltus.find_attractors(
        forced(0.01, 1.0, Stribeck), window=((-1.5, 1.5), (-1.5, 1.5)), starts=128
    )
    assert len(found) == 2
    slides = min(found, key=lambda one: one.amplitude)
    share = 1.0 - sticking(*np.random.default_rng(5).uniform(-1.5, 1.5, (2, 2000))).mean()
    assert 0.1 < share < 0.3
    assert abs(slides.fraction - share) < 2.5 * math.hypot(
        slides.error, math.sqrt(share * (1.0 - share) / 2000)
    )
    assert 0.02 < slides.error < 0.05
