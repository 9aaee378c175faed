"""What the motion keeps: energy, symmetry in space and in time, and the equivalence of loads."""

import math

import numpy as np
import pytest
from flow_references import evaluate_steps
from shared_systems import BETA80, forced

from saltus.flow import simulate
from saltus.systems import (
    EnergyRestitution,
    Harmonic,
    Load,
    Metainterface,
    System,
    VelocityReduction,
)


def free(*, V=-0.5, k=1.0, m=0.0, impact=None, beta0=BETA80):
    model = Metainterface(beta0=beta0, stiffness_ratio=k, mass_ratio=m)
    return System(model=model, load=Load(vertical=V), impact=impact or VelocityReduction(1.0))


def energy(system, theta, velocity, side):
    """(1+m)^P theta'^2 / 2 + k^P theta^2 / 2 - V sin(abs(theta) + beta0), the load being on the
    upper mass.
    """
    model, lower = system.model, (1 + np.asarray(side)) / 2
    mass, stiffness = 1 + model.mass_ratio * lower, 1 + (model.stiffness_ratio - 1) * lower
    return (
        mass * velocity**2 / 2
        + stiffness * theta**2 / 2
        - system.load.vertical(0.0) * np.sin(side * theta + model.beta0)
    )


def sampled(motion, count):
    """State and side at fixed random times."""
    times = np.random.default_rng(1).uniform(motion.start, motion.time, count)
    position, velocity, side = motion.dense.states(times)
    return position[0], velocity[0], side


# Small oscillations through contact, around an equilibrium of an open layer, and far out, with
# equal and unequal stiffness.
FREE = [
    (-0.5, 1.0, 0.05),
    (-0.5, 1.0, 0.3),
    (-0.5, 1.0, 2.4),
    (-0.5, 1.3, 1.0),
    (-0.5, 0.6, -3.0),
    (-1.6, 1.0, 0.9),
    (0.4, 1.0, 1.2),
]


@pytest.mark.parametrize(("V", "k", "theta"), FREE)
def test_energy_is_constant_over_1000_periods(V, k, theta):
    system = free(V=V, k=k)
    short = simulate(system, theta=theta, velocity=0.0, duration=100.0)
    times = short.impacts.time
    period = times[2] - times[0] if times.size else 2 * math.pi
    motion = simulate(system, theta=theta, velocity=0.0, duration=1000 * period, tol=1e-15)
    values = energy(system, *sampled(motion, 20000))
    before = energy(system, theta, 0.0, math.copysign(1, theta))
    unloaded = abs(before + V * math.sin(BETA80))  # above the undeformed state
    np.testing.assert_allclose(values, before, rtol=0, atol=1e-12 * max(abs(before), unloaded))
    assert len(motion.impacts) == (pytest.approx(2000, abs=1) if times.size else 0)


def test_an_energy_conserving_impact_keeps_it_between_unequal_masses_too():
    system = free(m=0.8, k=1.2, impact=EnergyRestitution(1.0))
    motion = simulate(system, theta=0.4, velocity=0.0, duration=3000.0, tol=1e-15)
    assert len(motion.impacts) > 500
    np.testing.assert_allclose(
        energy(system, *sampled(motion, 5000)), energy(system, 0.4, 0.0, 1), rtol=1e-12
    )
    factors = motion.impacts.velocity_after / motion.impacts.velocity_before
    np.testing.assert_allclose(
        factors, np.where(motion.impacts.side > 0, math.sqrt(1.8), 1 / math.sqrt(1.8)), rtol=1e-15
    )


def test_a_continuous_velocity_between_unequal_masses_changes_the_energy_at_each_crossing_and_only_there():
    m = 0.7
    system = free(m=m, k=1.2)
    motion = simulate(system, theta=0.4, velocity=0.0, duration=500.0, tol=1e-15)
    c = motion.impacts
    np.testing.assert_array_equal(c.velocity_after, c.velocity_before)
    before, after = (
        energy(system, 0.0, c.velocity_before, c.side),
        energy(system, 0.0, c.velocity_after, -c.side),
    )
    # errata 7: lost to the upper
    np.testing.assert_allclose(after - before, -c.side * m * c.velocity_before**2 / 2, rtol=1e-12)
    np.testing.assert_allclose(before[1:], after[:-1], rtol=1e-12)  # nothing between
    # and it is periodic all the same
    np.testing.assert_allclose(c.velocity_before[::2], c.velocity_before[0], rtol=1e-11)


def test_with_viscous_damping_the_energy_falls_by_what_the_damper_takes():
    system = forced(H=0.0, C=0.2, c=1.5, m=0.3, k=1.2, impact=EnergyRestitution(1.0))
    motion = simulate(system, theta=0.6, velocity=0.0, duration=12.0, tol=1e-15)
    nodes, weights = np.polynomial.legendre.leggauss(20)
    taken = 0.0
    for start, length, side in zip(
        motion.dense.start, motion.dense.length, motion.dense.side, strict=True
    ):
        velocity = motion.dense.states(start + length * (nodes + 1) / 2 * (1 - 1e-15))[1][0]
        taken += (0.3 if side > 0 else 0.2) * length / 2 * weights @ velocity**2
    first, last = (
        energy(system, 0.6, 0.0, 1),
        energy(system, motion.theta, motion.velocity, motion.side),
    )
    assert first - last == pytest.approx(taken, rel=1e-12)


GENERAL = Load(
    frequency=1.1,
    horizontal=Harmonic(amplitude=0.5, mean=0.1, phase=0.4),
    vertical=Harmonic(amplitude=0.2, mean=-0.5, phase=1.0),
    ground_horizontal=Harmonic(amplitude=0.3, phase=0.2),
    ground_vertical=Harmonic(amplitude=0.1),
)


@pytest.mark.parametrize("e", [1.0, 0.85])
@pytest.mark.parametrize(("theta", "velocity"), [(0.3, 0.0), (-0.7, 0.4), (0.0, 0.9)])
def test_the_mirrored_system_moves_as_the_mirror_image_bit_for_bit(e, theta, velocity):
    system = System(
        model=Metainterface(beta0=1.3, damping=0.1), load=GENERAL, impact=VelocityReduction(e)
    )
    motion = simulate(system, theta=theta, velocity=velocity, periods=30)
    image = simulate(system.mirrored(), theta=-theta, velocity=-velocity, periods=30)
    assert len(motion.impacts) > 10
    assert (image.theta, image.velocity, image.side) == (
        -motion.theta,
        -motion.velocity,
        -motion.side,
    )
    np.testing.assert_array_equal(image.impacts.time, motion.impacts.time)
    np.testing.assert_array_equal(image.impacts.velocity_before, -motion.impacts.velocity_before)


def test_under_a_symmetric_load_the_mirror_image_is_the_motion_half_a_period_later():
    system = forced(H=0.6, W=1.2)
    half = math.pi / 1.2
    motion = simulate(system, theta=0.3, velocity=0.1, time=0.0, duration=20.0)
    image = simulate(system, theta=-0.3, velocity=-0.1, time=half, duration=20.0)
    assert image.theta == pytest.approx(-motion.theta, abs=1e-11)
    assert image.velocity == pytest.approx(-motion.velocity, abs=1e-11)


@pytest.mark.parametrize("m", [0.0, 0.5])
def test_a_horizontal_force_and_a_ground_motion_of_one_amplitude_are_one_load(m):
    """errata 14: H = +Omega^2 zeta, and with unequal layers h = m."""
    W, H = 1.4, 0.7
    model = Metainterface(
        beta0=1.25, damping=0.1, mass_ratio=m, stiffness_ratio=1.2, dissipation_ratio=0.8
    )

    def loaded(H, zeta):
        load = Load(
            frequency=W,
            vertical=-0.5,
            horizontal=Harmonic(amplitude=H),
            lower_horizontal=Harmonic(amplitude=m * H),
            ground_horizontal=Harmonic(amplitude=zeta),
        )
        return System(model=model, load=load, impact=VelocityReduction(0.95))

    first, second = loaded(H, 0.0), loaded(0.0, H / W**2)
    one, two = (simulate(s, theta=0.4, velocity=0.0, periods=6, tol=1e-15) for s in (first, second))
    assert len(one.impacts) == len(two.impacts) > 5
    np.testing.assert_allclose(one.impacts.time, two.impacts.time, atol=1e-12)
    times = np.linspace(0.0, one.time, 500)
    np.testing.assert_allclose(one.at(times)[0], two.at(times)[0], atol=1e-12)
    # the paper's sign
    assert (
        abs(simulate(loaded(0.0, -H / W**2), theta=0.4, velocity=0.0, periods=6).theta - one.theta)
        > 1e-2
    )


@pytest.mark.parametrize(
    ("H", "theta", "velocity"),
    [(0.0, 0.3, 0.0), (0.0, -1.7, 0.4), (0.4, 0.3, 0.0), (0.8, -0.5, 0.2)],
)
def test_a_conservative_motion_run_backwards_returns_to_its_start(H, theta, velocity):
    W, phase, T = 1.3, 0.3, 15.0
    there = simulate(
        forced(C=0.0, H=H, W=W, phase=phase), theta=theta, velocity=velocity, duration=T, tol=1e-15
    )
    # H(T - s), as a sine of W s
    reversed_load = forced(C=0.0, H=H, W=W, phase=math.pi - W * T - phase)
    back = simulate(
        reversed_load, theta=there.theta, velocity=-there.velocity, duration=T, tol=1e-15
    )
    assert back.theta == pytest.approx(theta, abs=1e-12)
    assert back.velocity == pytest.approx(-velocity, abs=1e-12)
    np.testing.assert_allclose(T - back.impacts.time[::-1], there.impacts.time, atol=1e-12)


def test_a_motion_is_the_same_whether_computed_at_once_or_in_pieces():
    system = forced(H=0.5, W=0.9, e=0.95)
    whole = simulate(system, theta=0.3, velocity=0.0, duration=40.0, tol=1e-15)
    time, theta, velocity, crossings = 0.0, 0.3, 0.0, 0
    for end in [*np.random.default_rng(3).uniform(0, 40, 25).tolist(), 40.0]:
        if end <= time:
            continue
        piece = simulate(
            system, theta=theta, velocity=velocity, time=time, duration=end - time, tol=1e-15
        )
        time, theta, velocity, crossings = (
            piece.time,
            piece.theta,
            piece.velocity,
            crossings + len(piece.impacts),
        )
    assert theta == pytest.approx(whole.theta, abs=1e-12)
    assert velocity == pytest.approx(whole.velocity, abs=1e-12)
    assert crossings == len(whole.impacts)


def test_the_steps_of_the_dense_output_join():
    motion = simulate(forced(H=0.5), theta=0.3, velocity=0.0, periods=10, tol=1e-14)
    values = evaluate_steps(motion.dense, samples=2)
    np.testing.assert_allclose(values[:-1, 1], values[1:, 0], atol=3e-14)
    np.testing.assert_allclose(
        motion.dense.start[1:], (motion.dense.start + motion.dense.length)[:-1], atol=1e-13
    )
