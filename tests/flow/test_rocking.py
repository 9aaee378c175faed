"""The rocking block: free periods and overturning by quadrature, Housner's impacts, a ground that
moves both ways.
"""

import math

import mpmath as mp
import numpy as np
import pytest
from scipy.integrate import solve_ivp

from saltus import InelasticImpact
from saltus.flow import EventKind, Stop, simulate
from saltus.systems import Harmonic, Load, RockingBlock, System, VelocityReduction
from saltus.theory import rocking_period, short_rocking_period


def block(alpha, *, impact=None, load=None):
    return System(
        model=RockingBlock(alpha=alpha),
        load=load or Load(),
        impact=impact or VelocityReduction(1.0),
    )


def quarter_period(alpha, theta0):
    """From theta0 at rest to contact: theta'^2 / 2 = cos(alpha - theta0) - cos(alpha - theta), with
    theta = theta0 (1 - u^2).
    """

    def slowness(u):
        return mp.sqrt(theta0) / mp.sqrt(
            mp.sin(alpha - theta0 * (1 - u * u / 2)) * mp.sinc(theta0 * u * u / 2) / 2
        )

    return mp.quad(slowness, [0, 1])


@pytest.mark.parametrize("alpha", [0.1, 0.5, 1.2])
@pytest.mark.parametrize("share", [0.05, 0.5, 0.95])
def test_free_rocking_without_loss_has_the_period_of_the_quadrature_and_of_the_closed_form(
    alpha, share
):
    theta0 = share * alpha
    motion = simulate(block(alpha), theta=theta0, velocity=0.0, duration=30.0, tol=1e-15)
    with mp.workdps(30):
        quarter = float(quarter_period(alpha, theta0))
    np.testing.assert_allclose(
        motion.impacts.time, quarter * (1 + 2 * np.arange(len(motion.impacts))), atol=1e-11
    )
    assert 4 * quarter == pytest.approx(rocking_period(theta0, alpha=alpha), rel=1e-12)


def test_the_period_of_small_rocking_tends_to_its_short_form():
    errors = []
    for theta0 in (0.02, 0.01, 0.005):
        motion = simulate(block(0.4), theta=theta0, velocity=0.0, duration=5.0, tol=1e-15)
        errors.append(
            abs(short_rocking_period(theta0, alpha=0.4) / (4 * motion.impacts.time[0]) - 1)
        )
    assert errors[0] < 0.05
    assert errors[1] < 0.7 * errors[0]
    assert errors[2] < 0.7 * errors[1]


@pytest.mark.parametrize("alpha", [0.2, 0.9])
def test_each_inelastic_impact_has_the_factor_of_housner_and_rest_follows(alpha):
    factor = 1 - 1.5 * math.sin(alpha) ** 2  # conservation of angular momentum about the new corner
    motion = simulate(
        block(alpha, impact=InelasticImpact()), theta=0.7 * alpha, velocity=0.0, duration=400.0
    )
    np.testing.assert_allclose(
        motion.impacts.velocity_after, max(factor, 0.0) * motion.impacts.velocity_before, rtol=1e-14
    )
    assert motion.stop is Stop.REST
    with mp.workdps(30):
        # theta_n of the n-th swing from v^2 / 2 = cos(alpha - theta_n) - cos(alpha), v falling by
        # the factor at each impact
        speed = mp.sqrt(2 * (mp.cos(alpha - mp.mpf(0.7) * alpha) - mp.cos(mp.mpf(alpha))))
        time = quarter_period(alpha, 0.7 * alpha)
        for n in range(min(5, len(motion.impacts))):
            assert abs(motion.impacts.velocity_before[n]) == pytest.approx(float(speed), rel=1e-12)
            assert motion.impacts.time[n] == pytest.approx(float(time), rel=1e-12)
            speed *= factor
            time += 2 * quarter_period(alpha, alpha - mp.acos(mp.cos(mp.mpf(alpha)) + speed**2 / 2))


@pytest.mark.parametrize("side", [1, -1])
def test_a_block_thrown_over_its_corner_overturns_when_the_quadrature_says(side):
    alpha, speed = 0.4, 0.75
    motion = simulate(block(alpha), theta=0.0, velocity=side * speed, duration=50.0, tol=1e-15)
    with mp.workdps(30):
        energy = mp.mpf(speed) ** 2 / 2 + mp.cos(mp.mpf(alpha))
        time = mp.quad(
            lambda x: 1 / mp.sqrt(2 * (energy - mp.cos(alpha - x))), [0, alpha, mp.pi / 2]
        )
    assert (motion.stop, motion.limit) == (Stop.LIMIT, "overturned")
    assert motion.time == pytest.approx(float(time), rel=1e-13)
    assert motion.theta == pytest.approx(side * math.pi / 2, abs=1e-13)
    assert motion.events[-1].kind is EventKind.LIMIT


def test_the_separatrix_between_rocking_and_overturning_is_where_the_energy_reaches_the_top():
    alpha = 0.4
    critical = math.sqrt(2 * (1 - math.cos(alpha)))
    below, above = (
        simulate(block(alpha), theta=0.0, velocity=critical * f, duration=60.0, tol=1e-15)
        for f in (1 - 1e-9, 1 + 1e-9)
    )
    assert below.limit is None
    assert len(below.impacts) >= 1
    assert above.limit == "overturned"


def test_a_ground_that_moves_both_ways_is_met_by_scipy_restarted_at_each_impact():
    alpha, W, zeta, nu = 0.35, 2.3, 0.05, 0.04
    load = Load(
        frequency=W,
        ground_horizontal=Harmonic(amplitude=zeta, phase=0.4),
        ground_vertical=Harmonic(amplitude=nu, phase=1.1),
    )
    motion = simulate(
        block(alpha, impact=InelasticImpact(), load=load),
        theta=0.1,
        velocity=0.05,
        duration=9.0,
        tol=1e-14,
    )
    factor, side, time, state, times = 1 - 1.5 * math.sin(alpha) ** 2, 1, 0.0, (0.1, 0.05), []
    while time < 9.0:

        def flow(t, y, side=side):
            across, up = -zeta * W**2 * math.sin(W * t + 0.4), -nu * W**2 * math.sin(W * t + 1.1)
            tilt = alpha - side * y[0]
            return [y[1], -across * math.cos(tilt) - side * (1 + up) * math.sin(tilt)]

        def contact(t, y, side=side, start=time):
            return side * y[0] if t > start else 1.0

        contact.terminal, contact.direction = True, -1
        arc = solve_ivp(
            flow, (time, 9.0), state, events=contact, method="DOP853", rtol=1e-13, atol=1e-15
        )
        time, state = float(arc.t[-1]), tuple(arc.y[:, -1])
        if arc.t_events[0].size:
            times.append(time)
            side, state = -side, (0.0, factor * state[1])
    assert len(times) == len(motion.impacts) >= 3
    np.testing.assert_allclose(motion.impacts.time, times, atol=1e-9)
    assert motion.theta == pytest.approx(state[0], abs=1e-9)
    assert motion.velocity == pytest.approx(state[1], abs=1e-9)


def test_a_block_stands_until_the_ground_accelerates_by_more_than_its_slenderness():
    """Uplift starts where abs(zeta'') = tan(alpha) (1 + nu''), the point where the overturning
    moment wins.
    """
    alpha, W = 0.3, 0.5
    peak = 1.5 * math.tan(alpha)
    load = Load(frequency=W, ground_horizontal=Harmonic(amplitude=peak / W**2))
    motion = simulate(
        block(alpha, impact=InelasticImpact(), load=load), theta=0.0, velocity=0.0, duration=3.0
    )
    release = next(e for e in motion.events if e.kind is EventKind.RELEASE)
    assert release.time == pytest.approx(math.asin(1 / 1.5) / W, rel=1e-13)
    assert release.side == 1  # the ground, -zeta'' > 0, leaves the block behind
    standing = simulate(
        block(alpha, load=load).with_({"load.ground_horizontal.amplitude": peak / 1.6 / W**2}),
        theta=0.0,
        periods=3,
    )
    assert standing.rest_time == 0.0
    assert standing.stop is Stop.REST
