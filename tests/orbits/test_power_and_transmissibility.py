"""Transmissibility and mean dissipated power: of linear oscillators by their formulas, of orbits by
the power of the load.
"""

import itertools

import numpy as np
import pytest
from scipy.integrate import quad

import saltus
from saltus import free_orbit, mean_dissipated_power, transmissibility
from saltus.errors import ParameterError

K, C, F, W = 1.7, 0.3, 0.4, 0.9


def linear(wall=50.0, **law):
    return saltus.System(
        model=saltus.WallOscillator(stiffness=K, damping=C, wall=wall),
        load=saltus.Load(frequency=W, force=saltus.Harmonic(F)),
        impact=saltus.VelocityReduction(**law),
    )


def gain(w):
    return 1 / np.hypot(K - w**2, C * w)


def test_of_a_linear_oscillator_the_force_on_the_ground_has_the_textbook_ratio():
    """T = sqrt((k^2 + c^2 w^2) / ((k - w^2)^2 + c^2 w^2)); of the displacement 1 / sqrt((k - w^2)^2
    + c^2 w^2).
    """
    orbit = saltus.find_orbit(linear(), x=0.1)
    on_ground = transmissibility(orbit, "force", lambda t, x, v: K * x + C * v)
    assert on_ground == pytest.approx(np.hypot(K, C * W) * gain(W), rel=1e-12)
    assert transmissibility(orbit, "force") == pytest.approx(gain(W), rel=1e-12)
    motion = saltus.simulate(linear(), x=0.1, periods=40)
    assert transmissibility(motion, "force") == pytest.approx(gain(W), rel=1e-9)
    assert transmissibility(motion, "force", periods=3) == pytest.approx(gain(W), rel=1e-9)


def test_of_a_linear_oscillator_the_power_is_that_of_its_dashpot():
    """P = c (w X)^2 / 2."""
    orbit = saltus.find_orbit(linear(), x=0.1)
    assert mean_dissipated_power(orbit) == pytest.approx(C * (W * F * gain(W)) ** 2 / 2, rel=1e-11)


def mean_load_power(orbit, power):
    """(1/D) int power(t, q, v) dt over an orbit, by SciPy between its impacts."""
    motion = orbit.motion()
    edges = np.unique(
        np.clip([motion.start, *motion.impacts.time, motion.time], motion.start, motion.time)
    )
    parts = [
        quad(lambda t: power(t, *motion.at(t)), a + 1e-12, b - 1e-12, epsabs=1e-12, limit=200)[0]
        for a, b in itertools.pairwise(edges)
    ]
    return sum(parts) / orbit.duration


def test_an_orbit_with_impacts_dissipates_what_the_load_gives():
    orbit = saltus.find_orbit(linear(wall=0.1, e=0.7), x=0.0)
    assert orbit.signature.impact_count > 0
    given = mean_load_power(orbit, lambda t, x, v: F * np.sin(W * t) * v)
    assert mean_dissipated_power(orbit) == pytest.approx(given, rel=1e-9)


def test_layers_of_different_masses_dissipate_what_the_load_gives():
    """Power of the loads H sin(beta0 + |theta|) + s V cos(beta0 + |theta|) times theta'."""
    beta0, vertical = 1.4, -0.5
    numbers = {"damping": 0.2, "mass_ratio": 0.3, "stiffness_ratio": 1.2, "dissipation_ratio": 1.5}
    system = saltus.System(
        model=saltus.Metainterface(beta0=beta0, **numbers),
        load=saltus.Load(frequency=1.1, horizontal=saltus.Harmonic(0.35), vertical=vertical),
        impact=saltus.EnergyRestitution(0.8),
    )
    orbit = saltus.find_orbit(system, theta=0.3)

    def power(t, theta, v):
        size, sign = abs(theta), 1 if theta > 0 else -1
        return v * (
            np.sin(beta0 + size) * 0.35 * np.sin(1.1 * t) + sign * np.cos(beta0 + size) * vertical
        )

    assert orbit.signature.impact_count > 0
    assert mean_dissipated_power(orbit) == pytest.approx(mean_load_power(orbit, power), rel=1e-7)


def test_between_two_walls_what_the_load_gives_is_dissipated():
    system = saltus.System(
        model=saltus.TwoStops(stiffness=0.2, damping=0.1),
        load=saltus.Load(frequency=1.0, force=saltus.Harmonic(0.8)),
        impact=saltus.NewtonImpact(0.7),
    )
    orbit = saltus.find_orbit(system, x=0.0)
    assert orbit.signature.impact_count > 0
    given = mean_load_power(orbit, lambda t, x, v: 0.8 * np.sin(t) * v)
    assert mean_dissipated_power(orbit) == pytest.approx(given, rel=1e-8)


def test_a_free_orbit_dissipates_nothing():
    block = saltus.System(
        model=saltus.RockingBlock(alpha=0.3), impact=saltus.VelocityReduction(1.0)
    )
    assert mean_dissipated_power(free_orbit(block, 0.1)) == pytest.approx(0.0, abs=1e-15)


def test_a_motion_that_loses_energy_in_its_impacts_has_lost_the_difference():
    """Free rocking with e = 0.9: what is dissipated is the difference of T + P between the two
    ends.
    """
    block = saltus.System(
        model=saltus.RockingBlock(alpha=0.3), impact=saltus.VelocityReduction(0.9)
    )
    motion = saltus.simulate(block, theta=0.2, duration=9.0)

    def energy(theta, v):
        return v**2 / 2 - np.cos(0.3) + np.cos(0.3 - abs(theta))

    lost = energy(0.2, 0.0) - energy(motion.theta, motion.velocity)
    assert mean_dissipated_power(motion) * 9.0 == pytest.approx(lost, rel=1e-10)


def test_what_has_no_mean_is_refused():
    motion = saltus.simulate(linear(), x=0.1, periods=2)
    with pytest.raises(ParameterError, match="dense output over so many forcing periods"):
        mean_dissipated_power(motion, periods=3)
    with pytest.raises(ParameterError, match="no channel 'horizontal'"):
        transmissibility(motion, "horizontal")
    with pytest.raises(ParameterError, match="response must return a number"):
        transmissibility(motion, "force", lambda t, x, v: "x")
    still = saltus.System(model=saltus.WallOscillator(), load=saltus.Load(force=0.3))
    with pytest.raises(ParameterError, match=r"load\.force does not vary"):
        transmissibility(saltus.simulate(still, x=0.1, duration=3.0), "force")
