"""Slow impacts that lose no energy stay in the lanes, and are where closed forms say."""

import math

import numpy as np
import pytest
from numba import njit
from shared_systems import BETA80, forced

import saltus
from saltus.flow import stop_names
from saltus.flow.kernel.layout import CHATTER_SPEED, SLOW, Status
from saltus.flow.lane_steps.function_types import SCALAR_MOTION
from saltus.flow.programs import lane_threads as threads
from saltus.systems import EnergyRestitution, Load, System, VelocityReduction, WallOscillator
from saltus.taylor import pointer
from saltus.taylor.private_numba import OPTIONS

TOL = 1e-9
THRESHOLD = SLOW * math.sqrt(TOL)  # below it a speed may be the end of an accumulation
ENDED = int(Status.NOT_FINITE)
assert THRESHOLD > 2 * CHATTER_SPEED


@pytest.fixture
def no_scalar_kernel(monkeypatch):
    """A motion that leaves the lanes ends at once, as one that is out of range."""
    helpers = threads.load_helpers()
    end = njit(SCALAR_MOTION, **{**OPTIONS, "no_cpython_wrapper": True})(lambda lane: (ENDED, 0))
    monkeypatch.setattr(threads, "load_helpers", lambda several: (*helpers[:2], pointer(end)))


def ball(speed, e=1.0):
    """A ball that falls on the wall at these speeds under a force, and how long the flights between
    its impacts take.
    """
    system = System(
        model=WallOscillator(stiffness=0.0, wall=0.0),
        # the natural speed is 1, with a load that is lost in rounding
        load=Load(frequency=1.0, force=[1.0, saltus.Harmonic(1e-30)]),
        impact=VelocityReduction(e),
    )
    return system, {"x": -(speed**2) / 2.0, "velocity": 0.0, "tol": TOL}, 2.0 * speed


@pytest.mark.parametrize("flights", [3, 1000])
def test_a_ball_bounces_slowly_without_leaving_the_lanes(no_scalar_kernel, flights):
    speed = np.linspace(1.01 * CHATTER_SPEED, THRESHOLD, 40)
    system, start, flight = ball(speed)
    duration = flight.min() * (flights + 0.2)
    ends = saltus.simulate_many(system, duration=duration, **start)
    assert set(stop_names(ends).values) == {"horizon"}
    done, part = np.divmod(duration / flight + 0.5, 1.0)
    np.testing.assert_array_equal(ends.impact_count, done)
    np.testing.assert_allclose(
        ends.velocity, speed * (2 * part - 1), rtol=0, atol=1e-12 * flights * THRESHOLD
    )
    np.testing.assert_allclose(
        ends.x, start["x"] * 4 * part * (1 - part), rtol=0, atol=1e-12 * flights * THRESHOLD**2
    )


def test_what_may_accumulate_or_chatter_leaves_the_lanes(no_scalar_kernel):
    for e, speed in ((0.99, 0.5 * THRESHOLD), (1.0, 0.5 * CHATTER_SPEED)):
        speeds = np.array([speed, 2.0 * THRESHOLD])
        system, start, flight = ball(speeds, e)
        ends = saltus.simulate_many(system, duration=float(flight.min()), **start)
        assert stop_names(ends).values.tolist() == ["not_finite", "horizon"]


def test_an_impact_that_changes_the_speed_and_the_next_one_back_loses_nothing(no_scalar_kernel):
    """The masses are 1 + m and 1: both pulls follow them, and v^2 times the mass stays."""
    m, load = 0.5, 0.8
    system = forced(H=0.0, C=0.0, V=-load, m=m, impact=EnergyRestitution(1.0))
    speed, heavy = np.linspace(1.3 * CHATTER_SPEED, 0.7 * THRESHOLD, 32), 1 + m
    # on the side of the mass 1, and the speeds there by those before
    pull, faster = load * math.cos(BETA80), math.sqrt(heavy)
    first, second = 2 * speed * heavy / pull, 2 * speed * faster / pull  # flights
    duration = 0.02
    ends = saltus.simulate_many(
        system, theta=speed**2 * heavy / (2 * pull), velocity=0.0, duration=duration, tol=TOL
    )
    assert set(stop_names(ends).values) == {"horizon"}
    done, beyond = np.divmod(duration + 0.5 * first, first + second)
    np.testing.assert_array_equal(ends.impact_count, 2 * done + (beyond > first))
    mass = np.where(ends.theta > 0, heavy, 1.0)
    energy = mass * ends.velocity**2 / 2 + pull * abs(ends.theta)
    np.testing.assert_allclose(energy, heavy * speed**2 / 2, rtol=100 * TOL)
