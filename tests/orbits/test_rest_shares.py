"""The share of a period for which orbits of several contacts rest at one of them."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import saltus
from saltus.orbits.contract.sampled_motion import excursions

DAMPING, FORCE, RATE = 0.1, 0.8, 0.3


def flight() -> float:
    """From one stop, where the force changes its sign, to the other at a distance of 2."""

    def field(t, state):
        return [state[1], FORCE * math.sin(RATE * t) - DAMPING * state[1]]

    def arrives(t, state):
        return state[0] - 2.0

    arrives.terminal = True
    solved = solve_ivp(field, (0.0, 20.0), [0.0, 0.0], events=arrives, rtol=1e-11, atol=1e-13)
    return float(solved.t_events[0][0])


def test_a_mass_that_sticks_to_each_stop_until_the_force_turns():
    """It hits without bounce, waits for the force to change its sign and flies to the other one."""
    system = saltus.System(
        model=saltus.TwoStops(stiffness=0.0, damping=DAMPING),
        load=saltus.Load(frequency=RATE, force=saltus.Harmonic(FORCE)),
        impact=saltus.NewtonImpact(e=0.0),
    )
    orbit = saltus.find_orbit(system, x=0.0)
    half = math.pi / RATE
    assert orbit.rest_share == pytest.approx(1.0 - flight() / half, rel=1e-9)
    assert np.diff(orbit.releases) == pytest.approx([half], rel=1e-12)
    assert orbit.rests - orbit.releases == pytest.approx([flight()] * 2, rel=1e-9)


def test_an_orbit_that_bounces_never_rests():
    system = saltus.System(
        model=saltus.TwoStops(damping=0.05, left=-0.5, right=0.6),
        load=saltus.Load(frequency=0.9, force=saltus.Harmonic(0.4)),
        impact=saltus.NewtonImpact(e=0.7),
    )
    orbit = saltus.find_orbit(system, x=0.1)
    assert orbit.impact_count > 0
    assert orbit.rest_share == 0.0


@pytest.mark.parametrize(
    ("resting", "expected"),
    [
        ([True, False, False, True], [(1.0, 3.0)]),
        ([False, True, False, False], [(2.0, 11.0)]),
        ([False, True, True, True], [(0.0, 1.0)]),
        ([True, True, True, True], []),
        ([False, False, False, False], []),
    ],
)
def test_excursions_go_from_release_to_rest_round_the_period(resting, expected):
    assert excursions([0.0, 1.0, 2.0, 3.0], resting, 10.0) == expected
