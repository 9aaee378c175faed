"""Rest at contact and its end: release times, how the motion grows from them, and what is decided
at an equality.
"""

import math

import numpy as np
import pytest
from flow_references import evaluate_steps
from shared_systems import BETA80, forced

from saltus.errors import MotionError
from saltus.flow import EventKind, Stop, simulate
from saltus.systems import (
    Harmonic,
    Load,
    Metainterface,
    Record,
    System,
    VelocityReduction,
    WallOscillator,
)

SIN, COS = math.sin(BETA80), math.cos(BETA80)
BALANCE = 0.5 * COS / SIN  # the constant H that balances V = -0.5 at contact


def kinds(motion):
    return [e.kind for e in motion.events]


def closed_form_release(H, V, W, beta0=BETA80):
    """The first time at which H sin(W t) sin(beta0) = abs(V) cos(beta0)."""
    return math.asin(abs(V) * math.cos(beta0) / (H * math.sin(beta0))) / W


@pytest.mark.parametrize(("H", "V", "W", "beta0", "m"), [
    (0.5, -0.5, 1.0, BETA80, 0.0), (0.1, -0.5, 0.02, BETA80, 0.0), (2.0, -3.0, 0.3, 1.1, 0.7), (0.0882, -0.5, 1.0, BETA80, 0.0),
])  # fmt: skip
@pytest.mark.parametrize("tol", [1e-15, 1e-12, 1e-7])
def test_rest_ends_at_the_closed_form_release_time_on_the_side_of_the_load(H, V, W, beta0, m, tol):
    for sign in (1, -1):
        motion = simulate(
            forced(H=sign * H, V=V, W=W, beta0=beta0, m=m, e=0.8),
            theta=0.0,
            velocity=0.0,
            periods=0.25,
            tol=tol,
        )
        release = closed_form_release(H, V, W, beta0)
        assert kinds(motion)[:2] == [EventKind.REST, EventKind.RELEASE]
        assert motion.events[0].time == 0.0
        assert motion.events[1].time == pytest.approx(release, rel=1e-13, abs=0)
        assert motion.events[1].side == sign


def test_a_slow_load_brings_rest_and_release_twice_a_period_each_at_its_closed_form_time():
    H, W = 0.15, 0.02
    system = forced(H=H, W=W, e=0.6, C=0.3)
    motion = simulate(system, theta=0.3, velocity=0.0, periods=4, tol=1e-14)
    released = np.array([e.time for e in motion.events if e.kind is EventKind.RELEASE])
    half = math.pi / W
    first = closed_form_release(H, -0.5, W)
    np.testing.assert_allclose(
        released, first + half * np.arange(8), rtol=0, atol=1e-13 * 4 * 2 * half
    )
    assert [e.side for e in motion.events if e.kind is EventKind.RELEASE] == [1, -1] * 4
    assert kinds(motion).count(EventKind.REST) == 8 + (motion.stop is Stop.REST) - (
        motion.events[0].time > released[0]
    )
    for time in released:
        before, after = motion.at(np.array([time - 1e-3, time]))[0]
        assert before == after == 0.0


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize("m", [0.0, 0.7])
def test_after_a_simple_root_theta_grows_like_the_slope_of_the_acceleration_times_tau_cubed_over_6(
    sign, m
):
    H, W = 0.4, 0.7
    motion = simulate(
        forced(H=sign * H, W=W, m=m, e=0.8), theta=0.0, velocity=0.0, periods=0.25, tol=1e-15
    )
    release = motion.events[1].time
    slope = sign * H * W * math.cos(W * release) * SIN / (1 + m * (sign > 0))
    tau = np.array([2e-2, 1e-2, 5e-3])
    theta, velocity = motion.at(release + tau)
    errors = np.abs(theta / (slope * tau**3 / 6) - 1)
    assert errors[0] < 0.01
    np.testing.assert_allclose(errors[1:] / errors[:-1], 0.5, atol=0.05)
    np.testing.assert_allclose(velocity, slope * tau**2 / 2, rtol=0.02)


def test_after_a_jump_of_the_load_theta_grows_like_the_acceleration_times_tau_squared_over_2():
    load = Load(horizontal=Record([1.0, 9.0], [0.3, 0.3]), vertical=-0.5)
    system = System(
        model=Metainterface(beta0=BETA80, damping=0.1), load=load, impact=VelocityReduction(0.8)
    )
    motion = simulate(system, theta=0.0, velocity=0.0, duration=3.0)
    release = motion.events[1]
    assert (release.kind, release.time, release.side) == (EventKind.RELEASE, 1.0, 1)
    acceleration, tau = 0.3 * SIN - 0.5 * COS, np.array([2e-3, 1e-3])
    errors = np.abs(motion.at(1.0 + tau)[0] / (acceleration * tau**2 / 2) - 1)
    assert errors[0] < 1e-3
    assert errors[1] / errors[0] == pytest.approx(0.5, abs=0.05)


def test_an_acceleration_that_only_touches_zero_does_not_release():
    # a few roundings short of the touch, whose own sign no double can tell
    below = BALANCE * (1 - 4e-15)
    motion = simulate(forced(H=below, e=0.8), theta=0.0, velocity=0.0, periods=5)
    assert motion.stop is Stop.REST
    assert motion.rest_time == 0.0
    assert (motion.theta, motion.velocity) == (0.0, 0.0)
    touching = simulate(forced(H=BALANCE, e=0.8), theta=0.0, velocity=0.0, periods=5)
    assert touching.stop is Stop.REST
    assert np.abs(evaluate_steps(touching.dense)).max() < 1e-25


@pytest.mark.parametrize("excess", [1e-3, 1e-6, 1e-9])
def test_an_acceleration_that_exceeds_zero_briefly_releases_at_its_first_root_and_rest_returns(
    excess,
):
    H = BALANCE * (1 + excess)
    motion = simulate(forced(H=H, e=0.8), theta=0.0, velocity=0.0, periods=0.5, tol=1e-15)
    release = motion.events[1]
    assert release.kind is EventKind.RELEASE
    # the root of sin(t) = 1 / (1 + excess) is known as well as its slope, sqrt(2 excess), allows
    assert release.time == pytest.approx(
        math.acos(math.sqrt(1 - (1 + excess) ** -2)), abs=1e-15 / math.sqrt(excess)
    )
    largest = np.abs(
        motion.at(release.time + np.linspace(0, 20 * math.sqrt(excess), 2000))[0]
    ).max()
    # a = excess - x^2 / 2 acts for a time of order sqrt(excess)
    assert 0 < largest < 30 * SIN * BALANCE * excess**2 + 1e-30
    assert motion.stop is Stop.REST


def two_harmonics(mean, first, third, phase=0.0, order=3):
    load = Load(
        frequency=1.0,
        horizontal=Harmonic(amplitude=first, mean=mean, phase=phase)
        + Harmonic(amplitude=third, order=order, phase=phase),
        vertical=-0.5,
    )
    return System(
        model=Metainterface(beta0=BETA80, damping=0.1), load=load, impact=VelocityReduction(0.8)
    )


def test_a_triple_root_releases_and_theta_grows_like_tau_to_the_5th():
    rate = 0.2  # H = BALANCE + rate sin(t)^3
    motion = simulate(
        two_harmonics(BALANCE, 0.75 * rate, -0.25 * rate),
        theta=0.0,
        velocity=0.0,
        time=-1.0,
        duration=2.0,
        tol=1e-15,
    )
    assert kinds(motion)[:2] == [EventKind.REST, EventKind.RELEASE]
    # a cube is below 1e-14 within 3e-5 of its root
    assert motion.events[1].time == pytest.approx(0.0, abs=1e-4)
    tau = np.array([0.1, 0.05])
    errors = motion.at(tau)[0] / (rate * SIN * tau**5 / 20) - 1
    assert np.abs(errors).max() < 0.02


# H = BALANCE + rate (1 - cos t) and its kind: the first non-zero derivative of the acceleration at
# t = 0, and what follows.
@pytest.mark.parametrize(("system", "power", "factor"), [
    (forced(H=0.2, mean=BALANCE, e=0.8), 3, 1 / 6),
    (forced(H=-0.2, mean=BALANCE + 0.2, phase=math.pi / 2, e=0.8), 4, 1 / 24),
    (two_harmonics(BALANCE, 0.15, -0.05), 5, 1 / 20),
])  # fmt: skip
def test_a_start_on_an_equality_leaves_by_its_first_non_zero_coefficient_if_that_points_outward(
    system, power, factor
):
    motion = simulate(system, theta=0.0, velocity=0.0, duration=0.5, tol=1e-15)
    tau = 0.02
    assert motion.at(tau)[0] == pytest.approx(0.2 * SIN * factor * tau**power, rel=0.02)
    assert EventKind.REST not in kinds(motion)


@pytest.mark.parametrize("system", [
    forced(H=-0.2, mean=BALANCE, e=0.8),
    forced(H=0.2, mean=BALANCE - 0.2, phase=math.pi / 2, e=0.8),
    two_harmonics(BALANCE, -0.15, 0.05),
    forced(H=0.0, mean=BALANCE, e=0.8),
])  # fmt: skip
def test_a_start_on_an_equality_rests_if_the_first_non_zero_coefficient_points_inward_or_all_are_zero(
    system,
):
    motion = simulate(system, theta=0.0, velocity=0.0, duration=0.5)
    assert motion.stop is Stop.REST
    assert motion.rest_time == 0.0


def test_a_start_that_both_sides_attract_away_from_contact_is_refused_with_its_instant():
    with pytest.raises(MotionError, match=r"not unique.*side=\+1 or side=-1"):
        simulate(forced(H=0.0, V=0.5), theta=0.0, velocity=0.0, duration=1.0)


def test_naming_the_side_resolves_it_into_two_mirror_images():
    upper, lower = (
        simulate(forced(H=0.0, V=0.5), theta=0.0, velocity=0.0, duration=5.0, side=s)
        for s in (-1, 1)
    )
    assert lower.theta == -upper.theta
    assert lower.theta != 0
    assert lower.at(1e-3)[0] == pytest.approx(0.5 * COS * 1e-6 / 2, rel=1e-3)


def test_where_only_one_side_points_outward_no_choice_is_asked_for():
    for H, side in ((0.3, 1), (-0.3, -1)):
        motion = simulate(forced(H=0.0, mean=H, V=0.5), theta=0.0, velocity=0.0, duration=0.3)
        assert motion.side == side
        assert motion.theta * side > 0


def test_rest_that_ends_on_both_sides_at_once_is_refused_and_resolved_by_side():
    # V = -0.5 sin t changes its sign at pi
    load = Load(frequency=1.0, vertical=Harmonic(amplitude=-0.5, phase=0.0))
    system = System(
        model=Metainterface(beta0=BETA80, damping=0.1), load=load, impact=VelocityReduction(0.8)
    )
    with pytest.raises(MotionError, match=r"at time 3\.14159265.*not unique"):
        simulate(system, theta=0.0, velocity=0.0, time=0.5, duration=5.0)
    for side in (1, -1):
        motion = simulate(system, theta=0.0, velocity=0.0, time=0.5, duration=5.0, side=side)
        release = next(e for e in motion.events if e.kind is EventKind.RELEASE)
        assert (release.side, release.time) == (side, pytest.approx(math.pi, abs=1e-13))


def test_without_a_vertical_load_the_horizontal_one_alone_decides():
    leaving = simulate(forced(V=0.0, H=0.4), theta=0.0, velocity=0.0, duration=0.5, tol=1e-15)
    assert leaving.at(0.01)[0] == pytest.approx(0.4 * SIN * 1e-6 / 6, rel=0.01)
    pushed = simulate(forced(H=0.0, V=0.0, mean=-0.4), theta=0.0, velocity=0.0, duration=0.5)
    assert pushed.at(1e-3)[0] == pytest.approx(-0.4 * SIN * 1e-6 / 2, rel=1e-3)
    unloaded = simulate(forced(H=0.0, V=0.0), theta=0.0, velocity=0.0, duration=0.5)
    assert unloaded.stop is Stop.REST


@pytest.mark.parametrize(
    "nudge", [0.3e-14, 0.9e-14, 1.1e-14, 1.9e-14, 1e-13, 1.5e-13, -0.9e-14, -1.1e-14, -1.5e-13]
)
def test_an_imbalance_near_the_working_precision_neither_hangs_nor_stays_undecided(nudge):
    for C in (0.0, 0.1):
        for drift in (1e-3, -1e-3, 0.0):
            system = forced(mean=BALANCE, H=drift, C=C, e=0.8)
            balanced = simulate(system, theta=0.0, velocity=0.0, duration=3.0)
            nudged = simulate(
                system.with_({"load.horizontal.mean": BALANCE + nudge}),
                theta=0.0,
                velocity=0.0,
                duration=3.0,
            )
            assert nudged.theta == pytest.approx(balanced.theta, abs=1e-11)
            assert (balanced.theta > 1e-3) == (drift > 0)  # drift sin(t) alone decides


def test_balances_of_large_loads_neither_hang_nor_raise():
    for V in np.linspace(-500.0, -50000.0, 40):
        motion = simulate(
            forced(H=0.0, V=float(V), mean=-V / math.tan(BETA80), e=0.8),
            theta=0.0,
            velocity=0.0,
            duration=1.0,
        )
        assert math.isfinite(motion.theta)


def test_the_wall_holds_what_presses_on_it_until_the_force_falls_to_k_d():
    w, k, d = 0.4, 2.0, 0.5
    # F = 1.5 + cos(w t), k d = 1
    load = Load(frequency=w, force=Harmonic(amplitude=1.0, mean=1.5, phase=math.pi / 2))
    system = System(
        model=WallOscillator(stiffness=k, damping=0.2, wall=d),
        load=load,
        impact=VelocityReduction(0.7),
    )
    motion = simulate(system, x=d, velocity=0.0, periods=0.5, tol=1e-15)
    release = 2 * math.pi / 3 / w
    assert kinds(motion)[:2] == [EventKind.REST, EventKind.RELEASE]
    assert motion.events[1].time == pytest.approx(release, rel=1e-13)
    tau = 1e-2
    assert motion.at(release + tau)[0] - d == pytest.approx(
        -w * math.sin(w * release) * tau**3 / 6, rel=0.01
    )


def test_a_perfectly_plastic_impact_rests_at_once_where_it_is_held_and_goes_on_where_it_is_not():
    stuck = simulate(forced(H=0.0, e=0.0), theta=0.3, velocity=0.0, duration=10.0)
    assert len(stuck.impacts) == 1
    assert stuck.rest_time == stuck.impacts.time[0]
    pushed = simulate(forced(H=0.0, e=0.0, mean=-0.5), theta=0.3, velocity=0.0, duration=3.0)
    first = pushed.impacts.time[0]
    assert pushed.at(first + 1e-3)[0] == pytest.approx(
        -(0.5 * SIN - 0.5 * COS) * 1e-6 / 2, rel=1e-3
    )
