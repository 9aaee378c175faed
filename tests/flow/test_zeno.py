"""Accumulations of impacts: their limit against extrapolated 30-digit impacts and against closed
forms, at any tolerance.
"""

import math

import mpmath as mp
import numpy as np
import pytest
from flow_references import PreciseSystem, limit_of_impacts
from shared_systems import forced

from saltus.flow import EventKind, Stop, simulate
from saltus.systems import EnergyRestitution, Load, System, VelocityReduction, WallOscillator

ZENO = 17.82077858790958  # beta0 = 80 deg, C = 0.1, V = -0.5, H = 0, e = 0.8, from 0.3 at rest


@pytest.mark.parametrize(
    ("tol", "within"), [(1e-15, 1e-12), (1e-12, 1e-12), (1e-10, 1e-10), (1e-8, 1e-8), (1e-6, 1e-5)]
)
def test_the_known_accumulation_is_met_and_moves_with_the_tolerance_only_within_it(tol, within):
    motion = simulate(forced(H=0.0, e=0.8), theta=0.3, velocity=0.0, duration=30.0, tol=tol)
    assert motion.rest_time == pytest.approx(ZENO, abs=within, rel=0)
    assert (motion.stop, motion.theta, motion.velocity, motion.side) == (Stop.REST, 0.0, 0.0, 0)
    assert motion.time == 30.0


# e, the start, how many impacts the reference follows, and every how many pairs of them it
# extrapolates from.
CASES = [
    (0.8, 0.3, 0.0, 40, 1),
    (0.3, 0.3, 0.0, 14, 1),
    (0.95, 0.0, 0.01, 80, 4),
    (0.99, 0.0, 1e-3, 160, 8),
]


@pytest.mark.parametrize(("e", "theta", "velocity", "impacts", "pairs"), CASES)
def test_the_accumulation_is_where_30_digit_impacts_extrapolate_to(
    e, theta, velocity, impacts, pairs
):
    with mp.workdps(30):
        followed = PreciseSystem(factors=(e, e)).run(theta, velocity, 1e3, impacts=impacts).impacts
        chosen = followed[:: -2 * pairs][::-1][-12:]
        limit = limit_of_impacts(chosen, chosen[-1][1])
        # the extrapolation has converged
        assert abs(limit - limit_of_impacts(chosen[1:], chosen[-1][1])) < 1e-13
        for tol in (1e-15, 1e-12):
            motion = simulate(
                forced(H=0.0, e=e), theta=theta, velocity=velocity, duration=50.0, tol=tol
            )
            assert abs(motion.rest_time - limit) < 1e-12, tol


def test_an_energy_restitution_on_unequal_masses_accumulates_where_30_digit_impacts_extrapolate_to():
    r, m = 0.6, 0.5
    # v+ of T+ = r T-, with the masses 1 + m and 1
    factors = (math.sqrt(r * (1 + m)), math.sqrt(r / (1 + m)))
    with mp.workdps(30):
        chosen = (
            PreciseSystem(m=m, k=1.2, c=0.8, factors=factors)
            .run(0.3, 0.0, 1e3, impacts=40)
            .impacts[::-2][::-1][-12:]
        )
        limit = limit_of_impacts(chosen, chosen[-1][1])
    motion = simulate(
        forced(H=0.0, m=m, k=1.2, c=0.8, impact=EnergyRestitution(r)),
        theta=0.3,
        velocity=0.0,
        duration=50.0,
    )
    assert motion.rest_time == pytest.approx(float(limit), abs=1e-12, rel=0)
    before, after = motion.impacts.velocity_before, motion.impacts.velocity_after
    np.testing.assert_allclose(
        after / before, np.where(motion.impacts.side > 0, *factors), rtol=1e-14
    )


@pytest.mark.parametrize("e", [0.0, 0.2, 0.8, 0.97])
@pytest.mark.parametrize(("force", "wall", "drop"), [(1.0, 1.0, 0.4), (0.07, -2.0, 3.0)])
def test_a_ball_that_bounces_on_the_wall_rests_when_its_geometric_series_ends(e, force, wall, drop):
    ball = System(
        model=WallOscillator(stiffness=0.0, wall=wall),
        load=Load(force=force),
        impact=VelocityReduction(e),
    )
    fall = math.sqrt(2 * drop / force)
    # each flight after an impact at speed v lasts 2 e v / F, and v = F fall, e F fall, e^2 F fall,
    # ...
    end = fall + 2 * fall * e / (1 - e)
    motion = simulate(ball, x=wall - drop, velocity=0.0, duration=2 * end)
    assert motion.rest_time == pytest.approx(end, rel=2e-14)
    assert motion.x == wall
    speeds = force * fall * e ** np.arange(len(motion.impacts))
    np.testing.assert_allclose(motion.impacts.velocity_before, speeds, rtol=1e-12)


def test_the_limit_is_the_end_of_the_impacts_and_of_the_dense_output():
    motion = simulate(forced(H=0.0, e=0.8), theta=0.3, velocity=0.0, duration=30.0)
    assert [e.kind for e in motion.events].count(EventKind.REST) == 1
    assert motion.events[-1].time > motion.impacts.time[-1]
    theta, velocity = motion.at(np.linspace(motion.rest_time, 30.0, 50))
    assert not theta.any()
    assert not velocity.any()
    theta, velocity = motion.at(np.linspace(motion.impacts.time[-1], motion.rest_time, 50))
    assert np.abs(theta).max() < 1e-12
    assert np.abs(velocity).max() < 1e-6


def test_a_motion_that_ends_within_the_last_bounces_is_not_yet_at_rest():
    motion = simulate(forced(H=0.0, e=0.8), theta=0.3, velocity=0.0, duration=ZENO - 0.05)
    assert (motion.stop, motion.rest_time) == (Stop.HORIZON, None)
    assert len(motion.impacts) > 10


def test_every_impact_of_an_accumulation_loses_the_same_factor():
    motion = simulate(forced(H=0.0, e=0.8), theta=0.3, velocity=0.0, duration=30.0, tol=1e-15)
    np.testing.assert_array_equal(
        motion.impacts.velocity_after, 0.8 * motion.impacts.velocity_before
    )
    small = np.abs(motion.impacts.velocity_before) < 1e-6
    ratios = (
        np.diff(motion.impacts.time)[small[1:]][1:] / np.diff(motion.impacts.time)[small[1:]][:-1]
    )
    np.testing.assert_allclose(ratios, 0.8, rtol=1e-4)  # time differences of 1e-6 near 17.8


def test_a_motion_that_ends_within_the_accumulation_is_not_at_rest():
    """The jump to rest is for the time that is left; a horizon inside it is reached impact by
    impact.
    """
    whole = simulate(forced(H=0.0, e=0.8), theta=0.3, duration=50.0)
    for before in (1e-5, 1e-7, 1e-9):
        cut = simulate(forced(H=0.0, e=0.8), theta=0.3, duration=whole.rest_time - before)
        assert cut.time == whole.rest_time - before
        assert cut.stop is Stop.HORIZON
        assert abs(cut.velocity) < 10 * before
