"""The flow against 40-digit motions: the published one, and others computed here; and how its error
falls with `tol`.
"""

import math

import mpmath as mp
import numpy as np
import pytest
from flow_references import PreciseSystem
from shared_systems import forced

from saltus.flow import simulate

# beta0 = 80 deg, C = 0.1, V = -0.5, H = 0.5, Omega = 1, e = 1, from 0.3 at rest, after 20 periods:
# orders 40 and 46 agree on it.
THETA, VELOCITY, IMPACT_COUNT = (
    -0.235680595299311781821932031456,
    -1.02103882791726021543767997137,
    39,
)
DECADES = range(6, 16)


def error(tol):
    motion = simulate(forced(H=0.5), theta=0.3, velocity=0.0, periods=20, tol=tol)
    return max(abs(motion.theta - THETA), abs(motion.velocity - VELOCITY))


def test_the_reference_motion_is_met_to_its_last_digits():
    motion = simulate(forced(H=0.5), theta=0.3, velocity=0.0, periods=20, tol=1e-15)
    assert motion.theta == pytest.approx(THETA, abs=1e-14, rel=0)
    assert motion.velocity == pytest.approx(VELOCITY, abs=1e-14, rel=0)
    assert len(motion.impacts) == IMPACT_COUNT


def test_the_error_after_20_periods_stays_below_the_tolerance_and_a_rounding_floor_at_every_decade():
    for decade in DECADES:
        assert error(10.0**-decade) <= 10.0**-decade + 2e-13, decade


def test_the_error_falls_with_every_decade_down_to_the_rounding_floor():
    errors = np.array([error(10.0**-d) for d in DECADES])
    above = errors[errors > 2e-13]
    assert above.size >= 5
    # one decade of tol gains at least a factor of 2, on the whole ten
    assert (np.diff(np.log10(above)) < -0.3).all()
    slope = np.polyfit(-np.array(DECADES)[: above.size], np.log10(above), 1)[0]
    assert 0.8 < slope < 1.5


UNEQUAL = {
    "beta0": 1.2,
    "C": 0.15,
    "m": 0.4,
    "k": 1.3,
    "c": 0.7,
    "V": -0.6,
    "H": 0.7,
    "mean": 0.1,
    "phase": 0.3,
    "W": 1.7,
}
TENSION = {
    "beta0": 1.4,
    "C": 0.05,
    "m": 0.0,
    "k": 0.8,
    "c": 1.4,
    "V": 0.2,
    "H": 0.6,
    "mean": -0.05,
    "phase": -1.0,
    "W": 0.6,
}


@pytest.mark.parametrize(
    ("numbers", "e", "start"),
    [(UNEQUAL, 0.9, (0.4, -0.2)), (TENSION, 1.0, (-0.7, 0.1)), (UNEQUAL, 1.0, (0.0, 0.8))],
)
def test_unequal_layers_with_and_without_loss_agree_with_a_30_digit_integrator_of_its_own(
    numbers, e, start
):
    with mp.workdps(30):
        exact = PreciseSystem(**numbers, factors=(e, e)).run(*start, 12.0)
        motion = simulate(
            forced(**numbers, e=e), theta=start[0], velocity=start[1], duration=12.0, tol=1e-15
        )
        assert len(motion.impacts) == len(exact.impacts) >= 2
        for time, before, (t, _, v, _) in zip(
            motion.impacts.time, motion.impacts.velocity_before, exact.impacts, strict=True
        ):
            assert abs(time - t) < 2e-14
            assert abs(before - v) < 2e-14
        assert abs(motion.theta - exact.state[0]) < 2e-14
        assert abs(motion.velocity - exact.state[1]) < 2e-14


def test_a_step_of_degree_p_has_an_error_of_order_p_plus_1():
    motion = simulate(forced(H=0.5), theta=0.3, velocity=0.0, duration=0.5, tol=1e-15)
    series = motion.dense.series[0, 0]
    assert motion.dense.length[0] > 0.2
    with mp.workdps(30):
        exact = {h: PreciseSystem(H=0.5).run(0.3, 0.0, h).state[0] for h in (0.02, 0.04)}
        for p in range(2, 8):
            errors = [
                abs(mp.polyval([mp.mpf(a) for a in series[p::-1]], mp.mpf(h)) - exact[h])
                for h in (0.02, 0.04)
            ]
            assert float(mp.log(errors[1] / errors[0], 2)) == pytest.approx(p + 1, abs=0.1), p


def test_every_step_keeps_its_last_terms_below_the_tolerance():
    for tol in (1e-7, 1e-10, 1e-13):
        motion = simulate(forced(H=0.5), theta=0.3, velocity=0.0, periods=3, tol=tol)
        dense = motion.dense
        order = dense.series.shape[2] - 2
        # of theta', whose series sets the step
        speeds = np.abs(dense.series[:, 0, 1:] * np.arange(1, order + 2))
        size = np.maximum(np.abs(dense.series[:, 0, :2]).max(axis=1), 1e-6)
        last = np.maximum(
            speeds[:, order] * dense.length**order,
            speeds[:, order - 1] * dense.length ** (order - 1),
        )
        assert (last <= tol * size * (1 + 1e-9)).all()


def test_20_periods_and_the_same_duration_are_one_motion():
    by_periods = simulate(forced(H=0.5, W=1.3), theta=0.3, velocity=0.0, periods=20)
    by_duration = simulate(
        forced(H=0.5, W=1.3), theta=0.3, velocity=0.0, duration=20 * 2 * math.pi / 1.3
    )
    assert by_periods.theta == pytest.approx(by_duration.theta, abs=1e-12)
    assert by_periods.velocity == pytest.approx(by_duration.velocity, abs=1e-12)
