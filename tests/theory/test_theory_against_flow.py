"""The closed forms against the exact event-driven flow."""

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from saltus import InelasticImpact, OneContactModel
from saltus.flow import simulate
from saltus.systems import (
    EnergyRestitution,
    Harmonic,
    Load,
    Metainterface,
    RockingBlock,
    System,
    VelocityReduction,
)
from saltus.theory import (
    decayed_period,
    equilibria,
    final_time,
    high_frequency_onset,
    inelastic_contact,
    linear_motion,
    linear_period,
    peaks,
    pendulum_acceleration,
    rocking_period,
    static_angle,
    total_energy,
)

BETA = math.radians(80)


@dataclass(frozen=True, slots=True, kw_only=True)
class LinearMetainterface(OneContactModel):
    """`gov_eqn_constant_loading_lin`: the reduced equation to first order in theta, with m, k, c
    and a constant H.
    """

    beta0: float
    damping: float
    stiffness_ratio: float
    mass_ratio: float
    dissipation_ratio: float

    channels: ClassVar[tuple[str, ...]] = ("horizontal", "vertical")

    def acceleration(self, t, theta, velocity, side, load):
        lower = (1 + side) / 2
        mass, c = 1 + self.mass_ratio * lower, 1 + (self.dissipation_ratio - 1) * lower
        stiffness = 1 + (self.stiffness_ratio - 1) * lower
        sine, cosine = np.sin(self.beta0), np.cos(self.beta0)
        h, v = load.horizontal(t), load.vertical(t)
        push = h * sine + side * v * cosine - (v * sine - side * h * cosine) * theta
        return (push - c * self.damping * velocity - stiffness * theta) / mass


@pytest.mark.parametrize("theta0", [0.3, -0.3, 1e-3])
@pytest.mark.parametrize(
    ("k", "m", "c", "damping", "e", "h"),
    [
        (1.0, 0.0, 1.0, 0.0, 1.0, 0.0),
        (1.0, 0.0, 1.0, 0.1, 0.8, 0.0),
        (2.5, 0.7, 0.4, 0.2, 0.9, 0.03),
    ],
    ids=["conservative", "lossy", "unequal"],
)
def test_piecewise_linear_solution_is_the_exact_flow_impact_by_impact(
    theta0, k, m, c, damping, e, h
):
    parameters = {
        "beta0": BETA,
        "damping": damping,
        "stiffness_ratio": k,
        "mass_ratio": m,
        "dissipation_ratio": c,
    }
    load, law = Load(horizontal=h, vertical=-0.5), VelocityReduction(e)
    closed = linear_motion(
        System(model=Metainterface(**parameters), load=load, impact=law), theta0, 10
    )
    system = System(model=LinearMetainterface(**parameters), load=load, impact=law)
    flow = simulate(
        system, theta=theta0, velocity=0.0, duration=closed.impact_times[-1] * (1 + 1e-6), tol=1e-15
    )
    np.testing.assert_allclose(flow.impacts.time[:10], closed.impact_times, rtol=1e-13, atol=1e-13)
    np.testing.assert_allclose(
        flow.impacts.velocity_before[:10], closed.velocity_before, rtol=1e-11
    )
    np.testing.assert_allclose(flow.impacts.velocity_after[:10], closed.velocity_after, rtol=1e-11)


@pytest.mark.parametrize("theta0", [0.15, -0.15])
@pytest.mark.parametrize(
    ("k", "m", "law"),
    [
        (3.0, 0.0, VelocityReduction(1.0)),
        (0.5, 2.0, VelocityReduction(1.0)),
        (2.0, 2.0, EnergyRestitution(1.0)),
    ],
)
def test_peaks_and_period_of_conservative_motion(theta0, k, m, law):
    """Errata 6 and 7: also where e = 1 changes the energy at every impact, and back."""
    system = System(
        model=Metainterface(beta0=BETA, stiffness_ratio=k, mass_ratio=m),
        load=Load(vertical=-0.5),
        impact=law,
    )
    found = peaks(system, theta0)
    motion = simulate(system, theta=theta0, velocity=0.0, duration=10.2 * found.period, tol=1e-14)
    times = motion.impacts.time
    np.testing.assert_allclose(times[2:] - times[:-2], found.period, rtol=1e-12)
    theta, velocity = motion.at(
        np.array([(times[0] + times[1]) / 2, found.period, 10 * found.period])
    )
    np.testing.assert_allclose(np.sort(theta[:2]), [found.theta_min, found.theta_max], rtol=1e-12)
    np.testing.assert_allclose(theta[2], theta0, rtol=1e-11)
    np.testing.assert_allclose(velocity, 0.0, atol=1e-11)


def test_erratum_07_energy_along_the_flow():
    system = System(model=Metainterface(beta0=BETA, mass_ratio=0.8), load=Load(vertical=-0.5))
    crossings = simulate(system, theta=0.2, velocity=0.0, duration=30.0, tol=1e-14).impacts
    before = total_energy(
        system, np.zeros(len(crossings)), crossings.velocity_before, crossings.side
    )
    after = total_energy(
        system, np.zeros(len(crossings)), crossings.velocity_after, -crossings.side
    )
    np.testing.assert_allclose(
        after - before, -crossings.side * 0.8 * crossings.velocity_before**2 / 2, rtol=1e-13
    )
    np.testing.assert_allclose(before[1:], after[:-1], rtol=1e-12)


@pytest.mark.parametrize("k", [1.0, 0.5, 1.1])
def test_erratum_09_damped_motions_settle_on_the_stable_equilibria_and_leave_the_others(k):
    system = System(
        model=Metainterface(beta0=BETA, stiffness_ratio=k, damping=0.5),
        load=Load(vertical=-1.5 / math.sin(BETA)),
    )
    for state in equilibria(system):
        if state.theta == 0.0:
            continue
        end = simulate(
            system, theta=state.theta + 1e-4, velocity=0.0, duration=120.0, tol=1e-12, stop_at=()
        )
        if state.stable:
            assert end.theta == pytest.approx(state.theta, abs=1e-11)
        else:
            assert abs(end.theta - state.theta) > 0.1


def test_small_vibrations_end_at_the_final_time():
    """`finaltime` is the limit of small amplitude: the error of the full equation falls like
    theta0.
    """
    system = System(
        model=Metainterface(beta0=BETA), load=Load(vertical=-0.5), impact=VelocityReduction(0.8)
    )
    errors = []
    for theta0 in (1e-3, 1e-4, 1e-5):
        period = linear_period(theta0, beta0=BETA, vertical=-0.5)
        motion = simulate(system, theta=theta0, velocity=0.0, duration=3 * period, tol=1e-14)
        errors.append(motion.rest_time / final_time(period=period, e=0.8) - 1)
        # errata 8
        assert motion.impacts.time[1] == pytest.approx((1 + 2 * 0.8) / 4 * period, rel=10 * theta0)
    assert np.abs(errors[1:]) == pytest.approx(np.abs(errors[:-1]) / 10, rel=0.1)
    first_cycle = decayed_period(1, period=1.0, e=0.8)
    assert first_cycle == pytest.approx(1.8**2 / 4)


def test_rocking_period_of_the_block():
    system = System(model=RockingBlock(alpha=0.3), impact=VelocityReduction(1.0))
    for theta0 in (1e-4, 0.1, 0.29):
        period = rocking_period(theta0, alpha=0.3)
        times = simulate(
            system, theta=theta0, velocity=0.0, duration=4.1 * period, tol=1e-14
        ).impacts.time
        np.testing.assert_allclose(times[2:] - times[:-2], period, rtol=1e-11)
        assert times[0] == pytest.approx(period / 4, rel=1e-11)


def test_erratum_25_factors_along_the_flow():
    system = System(
        model=Metainterface(beta0=1.3, mass_ratio=0.5),
        load=Load(vertical=-0.5),
        impact=InelasticImpact(),
    )
    crossings = simulate(system, theta=0.2, velocity=0.0, duration=8.0, tol=1e-12).impacts
    assert len(crossings) > 3
    for before, after, side in zip(
        crossings.velocity_before, crossings.velocity_after, crossings.side, strict=True
    ):
        assert after / before == pytest.approx(inelastic_contact(1.3, 0.5, side).factor, rel=1e-13)


def test_erratum_28_motions_live_on_above_the_onset_and_die_below():
    frequency = 8.0
    onset = high_frequency_onset(frequency, beta0=BETA, vertical=-0.5, damping=0.1, order=2)
    closing = 0.5 * math.cos(BETA)
    amplitude = closing * math.pi**2 / (8 * frequency**2)
    final = {}
    for factor in (0.9, 1.1):
        load = Load(
            frequency=frequency,
            horizontal=Harmonic(factor * onset, phase=math.pi / 2),
            vertical=-0.5,
        )
        system = System(model=Metainterface(beta0=BETA, damping=0.1), load=load)
        motion = simulate(
            system,
            theta=0.0,
            velocity=closing * math.pi / (2 * frequency),
            periods=150,
            side=1,
            tol=1e-10,
        )
        period = 2 * math.pi / frequency
        final[factor] = np.abs(motion.at(np.linspace(148 * period, 150 * period, 200))[0]).max()
    assert final[1.1] == pytest.approx(amplitude, rel=0.1)
    assert final[0.9] < 0.3 * amplitude


@pytest.mark.thorough
def test_upright_cell_moves_as_the_pendulum():
    load = Load(
        frequency=1.3,
        horizontal=Harmonic(0.4),
        vertical=Harmonic(0.2, mean=-0.8),
        ground_horizontal=Harmonic(0.1, phase=1.0),
    )
    system = System(model=Metainterface(beta0=math.pi / 2, damping=0.1), load=load)
    motion = simulate(system, theta=0.2, velocity=0.0, duration=25.0, tol=1e-13)
    smooth = solve_ivp(
        lambda t, y: [y[1], pendulum_acceleration(system, t, *y)],
        (0, 25),
        [0.2, 0.0],
        method="DOP853",
        rtol=1e-12,
        atol=1e-13,
    )
    assert len(motion.impacts) > 2
    assert (motion.theta, motion.velocity) == pytest.approx(tuple(smooth.y[:, -1]), abs=1e-9)


def test_static_angle_under_a_constant_load():
    system = System(
        model=Metainterface(beta0=BETA, damping=1.0), load=Load(horizontal=0.5, vertical=-0.5)
    )
    end = simulate(system, theta=0.0, velocity=0.0, duration=100.0, tol=1e-12)
    assert end.theta == pytest.approx(static_angle(BETA, 0.5, -0.5), abs=1e-11)
