"""A step in lanes is as exact as one of the scalar kernel, also where the last coefficients vanish
by symmetry.
"""

import math
from dataclasses import dataclass
from typing import ClassVar

import mpmath as mp
import numpy as np
import pytest
from shared_systems import BETA80, forced

import saltus
from saltus.systems import Load, Model, System

pytestmark = pytest.mark.thorough  # many structures of their own


@dataclass(frozen=True, kw_only=True)
class Odd(Model):
    """x'' = -linear x - cubic x^3 - quintic x^5 - septic x^7, without contact."""

    linear: float = 0.0
    cubic: float = 0.0
    quintic: float = 0.0
    septic: float = 0.0
    coordinates: ClassVar[tuple[str, ...]] = ("x",)

    def acceleration(self, t, x, velocity, side, load):
        return -self.linear * x - self.cubic * x**3 - self.quintic * x**5 - self.septic * x**7


@dataclass(frozen=True, kw_only=True)
class Pair(Model):
    """x'' = F - w^2 x beside y'' = -y^3: one coordinate has all coefficients, the other only every
    fourth.
    """

    rate: float = 1.0
    coordinates: ClassVar[tuple[str, ...]] = ("x", "y")
    channels: ClassVar[tuple[str, ...]] = ("force",)

    def acceleration(self, t, q, velocity, side, load):
        return load.force(t) - self.rate**2 * q[0], -(q[1] ** 3)


def lemniscate(time):
    """X and X' of X'' = -X^3 from X = 0, X' = 1, by the lemniscate sine; X' by the energy, its sign
    by the derivative.
    """
    with mp.workdps(40):
        # X'^2 = 1 - X^4/2: X = a sl(t / a) with a = 2^(1/4) and sl(u) = sd(sqrt(2) u, 1/2) /
        # sqrt(2)
        a, half = mp.mpf(2) ** mp.mpf("0.25"), mp.mpf("0.5")
        u = mp.sqrt(2) * mp.mpf(time) / a
        x = a * mp.ellipfun("sd", u, m=half) / mp.sqrt(2)
        rate = mp.ellipfun("cn", u, m=half) / mp.ellipfun("dn", u, m=half) ** 2  # sd' = cn / dn^2
        return float(x), float(rate)


def test_the_reference_keeps_its_energy():
    for time in (0.3, 1.7, 4.0, 9.9):
        x, rate = lemniscate(time)
        assert rate**2 / 2 + x**4 / 4 == pytest.approx(0.5, abs=1e-15)


@pytest.mark.parametrize("digits", range(6, 16))
@pytest.mark.parametrize("duration", [0.3, 0.8064, 0.882, 1.6, 3.0, 5.0])
def test_a_cubic_oscillator_through_zero_follows_the_lemniscate_at_every_tolerance(
    digits, duration
):
    ends = saltus.simulate_many(
        System(model=Odd(cubic=1.0)), x=0.0, velocity=1.0, duration=duration, tol=10.0**-digits
    )
    x, rate = lemniscate(duration)
    assert abs(float(ends.x) - x) + abs(float(ends.velocity) - rate) < 20 * 10.0**-digits + 2e-14


@pytest.mark.parametrize("digits", range(6, 16, 3))
@pytest.mark.parametrize("power", ["cubic", "quintic", "septic"])
def test_odd_oscillators_keep_their_energy_from_zero_at_every_tolerance(digits, power):
    """Between, where the last coefficients do not quite vanish, neither rule sees the growth; the
    scalar kernel loses as much.
    """
    linear = np.array([0.0, 1e-12, 1e-9, 1e-6, 1e-3, 1.0])
    system = System(model=Odd(**{power: 1.0}))
    ends = saltus.simulate_many(
        system,
        x=0.0,
        velocity=1.0,
        parameters={"model.linear": linear},
        duration=20.0,
        tol=10.0**-digits,
    )
    degree = {"cubic": 4, "quintic": 6, "septic": 8}[power]
    x, v = ends.x.values, ends.velocity.values
    error = np.abs(v**2 / 2 + linear * x**2 / 2 + x**degree / degree - 0.5)
    assert (
        error <= np.where((linear == 0.0) | (linear == 1.0), 30.0, 400.0) * 10.0**-digits + 2e-14
    ).all()


@pytest.mark.parametrize("rate", [1.0, 3.0, 6.0])
@pytest.mark.parametrize("lanes", [True, False])
def test_each_of_several_coordinates_is_looked_at(rate, lanes):
    system = System(model=Pair(rate=rate), load=Load(force=0.3))
    arguments = {"x": 0.2, "y": 0.0, "velocity": (0.1, 1.0), "tol": 1e-12}
    for duration in (0.5, 1.0, 3.0, 10.0):
        if lanes:
            ends = saltus.simulate_many(system, duration=duration, **arguments)
            x, y = float(ends.x), float(ends.y)
        else:
            x, y = saltus.simulate(system, duration=duration, **arguments).position
        exact = (
            0.3 / rate**2
            + (0.2 - 0.3 / rate**2) * math.cos(rate * duration)
            + 0.1 / rate * math.sin(rate * duration)
        )
        assert y == pytest.approx(lemniscate(duration)[0], abs=2e-11)
        assert x == pytest.approx(exact, abs=2e-11)


@pytest.mark.parametrize("tol", [1e-8, 1e-12, 1e-14])
def test_tangents_whose_last_coefficients_vanish_follow_the_lemniscate(tol):
    """x(t; v) = sqrt(v) X(sqrt(v) t), and a shift in time moves the start by X' = 1: the
    derivatives in closed form.
    """
    for duration in (0.8064, 3.0, 5.0):
        ends = saltus.simulate_many(
            System(model=Odd(cubic=1.0)),
            x=0.0,
            velocity=1.0,
            duration=duration,
            tol=tol,
            sensitivities=(),
        )
        x, rate = lemniscate(duration)
        expected = [
            [rate, 0.5 * x + 0.5 * duration * rate],
            [-(x**3), rate - 0.5 * duration * x**3],
        ]
        np.testing.assert_allclose(
            ends.derivative.values, expected, rtol=0, atol=3000 * tol + 1e-12
        )


def test_energy_drifts_no_more_than_in_the_scalar_kernel():
    """Over 300 periods, root mean square of eight motions: below 10 tol, and in the mean within
    twice the scalar's.
    """
    system, starts, ratios = forced(H=0.0, C=0.0), np.linspace(0.1, 1.5, 8), []

    def energy(theta, velocity):
        return velocity**2 / 2 + theta**2 / 2 + 0.5 * np.sin(np.abs(theta) + BETA80)

    def drift(theta, velocity):
        return math.sqrt(np.mean((energy(theta, velocity) - energy(starts, 0.0)) ** 2))

    for tol in (1e-6, 1e-8, 1e-10, 1e-12, 1e-14):
        ends = saltus.simulate_many(system, theta=starts, periods=300, tol=tol)
        motions = [
            saltus.simulate(system, theta=x, periods=300, tol=tol, dense=False) for x in starts
        ]
        in_lanes = drift(ends.theta.values, ends.velocity.values)
        assert in_lanes < 10 * tol
        ratios.append(
            in_lanes
            / drift(np.array([m.theta for m in motions]), np.array([m.velocity for m in motions]))
        )
    assert np.exp(np.mean(np.log(ratios))) <= 2.0, ratios


@pytest.mark.parametrize("tol", [1e-6, 1e-9, 1e-12])
def test_driven_motions_are_as_exact_as_in_the_scalar_kernel(tol):
    """The median error against the smallest tolerance, within a factor of 2."""
    system, rng = forced(H=0.3), np.random.default_rng(0)
    theta, velocity = rng.uniform(-1, 1, 100), rng.uniform(-0.5, 0.5, 100)
    exact = saltus.simulate_many(system, theta=theta, velocity=velocity, periods=2, tol=1e-15)
    ends = saltus.simulate_many(system, theta=theta, velocity=velocity, periods=2, tol=tol)
    motions = [
        saltus.simulate(system, theta=a, velocity=b, periods=2, tol=tol, dense=False)
        for a, b in zip(theta, velocity, strict=True)
    ]
    here = np.abs(ends.theta.values - exact.theta.values)
    alone = np.abs(np.array([m.theta for m in motions]) - exact.theta.values)
    assert np.median(here) <= 2.0 * np.median(alone) + 1e-15
