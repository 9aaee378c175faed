"""Exponents from pairs of neighbouring motions, beside derivatives and multipliers."""

import math

import numpy as np
import pytest

import saltus
from saltus import NewtonImpact, TwoLayer
from saltus.attractors.lyapunov.growth import LYAPUNOV, LargestExponents, Neighbours, stretched
from saltus.flow import find_recurrence
from saltus.systems import Harmonic, Load, System


def layers(amplitude, frequency=1.0, damping=0.1, **law):
    return System(
        model=TwoLayer(beta0=math.radians(80), damping=damping, mass_ratio=0.1),
        load=Load(frequency=frequency, vertical=-0.5, horizontal=Harmonic(amplitude=amplitude)),
        impact=NewtonImpact(**law),
    )


DYING = layers(1.0, 1.02, e=0.5)  # chaos whose impacts die away: 50 of them in a forcing period


def states_of(system, count):
    """States (count, 4) of motions that have gone on for 60 forcing periods."""
    begin = np.array([[0.1 * (i + 1), -0.05 * i, 0.0, -0.1] for i in range(count)])
    return find_recurrence(system, begin, 60, kept=1, stop_early=False).last


@pytest.mark.thorough
def test_neighbours_part_as_the_derivatives_say_through_impacts_that_die_away():
    """Over the same 12 periods from the same states, after the same four in which they turn to the
    direction that grows.
    """
    states, lengths = states_of(DYING, 5), np.array([DYING.load.period])
    rates, time = Neighbours(DYING, states[None], {}, turning=4, tol=1e-11).rates(np.array([0]), 12)
    begin, direction, _ = stretched(DYING, states, np.full_like(states, 0.5), {}, 4, 1e-11)
    growth = stretched(DYING, begin, direction, {}, 12, 1e-11)[2]
    assert time[0] == 12 * lengths[0]
    np.testing.assert_allclose(rates[0], growth / time[0], rtol=0, atol=2e-4)


@pytest.mark.parametrize(
    ("damping", "together"), [(0.1, False), pytest.param(1.0, True, marks=pytest.mark.thorough)]
)
def test_the_exponent_of_an_orbit_is_that_of_its_multiplier_also_where_neighbours_become_one(
    damping, together
):
    """With much damping these pairs come nearer in four periods than two motions can tell."""
    orbit = saltus.find_orbit(layers(2.0, damping=damping, e=0.0), theta_1=0.1, theta_2=0.0)
    expected = math.log(abs(orbit.multipliers[0])) / orbit.duration
    assert (4 * orbit.duration * expected < math.log(LYAPUNOV.least_of_pair)) == together
    begin = np.repeat(np.concatenate(orbit.section_state[None, None]), 4, axis=0)[None]
    rates, _ = Neighbours(orbit.system, begin, {}, turning=32, tol=1e-12).rates(np.array([0]), 16)
    np.testing.assert_allclose(rates[0], expected, rtol=0, atol=1e-4)


def test_an_exponent_does_not_depend_on_what_else_is_asked():
    """A group alone and beside one of another frequency, whose pairs are brought together after
    other times.
    """
    states = np.stack([states_of(DYING, 4)] * 2)
    frequencies = np.array([1.02, 0.61])
    both, alone = (
        LargestExponents(
            DYING, states[:n], {"load.frequency": frequencies[:n]}, shortest=16, tol=1e-10
        )
        for n in (2, 1)
    )
    both.go_on(np.array([0, 1]), 16)
    alone.go_on(np.array([0]), 16)
    for run in (both, alone):
        run.go_on(np.array([0]), 64)
    assert alone.found.exponent[0] == both.found.exponent[0]
    assert np.isfinite(both.found.exponent).all()
