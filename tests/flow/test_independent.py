"""100 random motions against an integrator of another make: heyoka.py, stopped at each impact and
restarted beyond it.
"""

import math

import numpy as np
import pytest
from shared_systems import forced

from saltus.flow import simulate

heyoka = pytest.importorskip("heyoka", reason="heyoka.py is on Linux x86-64 only")

CASES, PERTURBATION = 100, 1e-7
NEAR_GRAZING, LARGE_DERIVATIVE = 1e-3, 1e4
COLUMNS = ("side", "beta0", "mean", "H", "W", "phase", "V", "C", "k", "m")


@pytest.fixture(scope="module")
def integrator():
    """`gov_eqn_theta_long` with its numbers as runtime parameters, and the contact, from inside, as
    a terminal event.
    """
    x, v = heyoka.make_vars("x", "v")
    side, beta0, mean, H, W, phase, V, damping, stiffness, mass = (heyoka.par[i] for i in range(10))
    push = mean + H * heyoka.sin(W * heyoka.time + phase)
    force = heyoka.sin(side * x + beta0) * push + side * heyoka.cos(side * x + beta0) * V
    contact = heyoka.t_event(side * x, direction=heyoka.event_direction.negative)
    equations = [(x, v), (v, (force - damping * v - stiffness * x) / mass)]
    return heyoka.taylor_adaptive(
        equations, [0.3, 0.0], pars=[1.0] * 10, t_events=[contact], tol=1e-15
    )


def by_heyoka(integrator, n, theta, velocity, duration):
    """The end state and the impact times."""
    side, times = math.copysign(1.0, theta), []
    integrator.time, integrator.state[:] = 0.0, (theta, velocity)
    while True:
        lower = side > 0
        integrator.pars[:] = [
            side, n["beta0"], n["mean"], n["H"], n["W"], n["phase"], n["V"],
            n["C"] * (n["c"] if lower else 1.0), n["k"] if lower else 1.0, 1.0 + (n["m"] if lower else 0.0),
        ]  # fmt: skip
        integrator.reset_cooldowns()
        outcome, *_ = integrator.propagate_until(duration)
        if outcome == heyoka.taylor_outcome.time_limit:
            return integrator.state.copy(), np.array(times)
        times.append(integrator.time)
        integrator.state[:] = 0.0, n["e"] * integrator.state[1]
        side = -side


def random_case(rng):
    numbers = {
        "beta0": rng.uniform(0.5, 2.6),
        "C": rng.uniform(0.0, 0.3),
        "m": rng.choice([0.0, rng.uniform(0.0, 1.5)]),
        "k": rng.choice([1.0, rng.uniform(0.5, 2.0)]),
        "c": rng.choice([1.0, rng.uniform(0.0, 2.0)]),
        "V": rng.uniform(-1.0, 0.5),
        "H": rng.uniform(0.0, 1.5),
        "W": rng.uniform(0.4, 2.5),
        "mean": rng.choice([0.0, rng.uniform(-0.3, 0.3)]),
        "phase": rng.uniform(-3.0, 3.0),
        "e": rng.choice([1.0, rng.uniform(0.6, 1.0)]),
    }
    return (
        numbers,
        float(rng.choice([-1, 1]) * rng.uniform(0.1, 2.0)),
        float(rng.uniform(-1.0, 1.0)),
        float(rng.uniform(5.0, 20.0)),
    )


def passes_near_a_grazing(motion):
    """Whether a local extremum of the gap, or the height of a flight between two impacts, is below
    NEAR_GRAZING.
    """
    times = np.linspace(motion.start, motion.time, 6001)
    position, velocity, side = motion.dense.states(times)
    gap, rate = side * position[0], side * velocity[0]
    turns = (rate[:-1] * rate[1:] <= 0) & (side[:-1] == side[1:])
    flights = np.diff(motion.impacts.time)
    # a parabola's height
    slow = np.abs(motion.impacts.velocity_after[:-1]) * flights / 4 < NEAR_GRAZING
    return bool(
        (np.minimum(gap[:-1], gap[1:])[turns] < NEAR_GRAZING).any()
        or slow.any()
        or (side == 0).any()
    )


def derivative(system, theta, velocity, duration):
    """The largest entry of d(state at the end) / d(state at the start), by differences."""
    ends = []
    for dx, dv in ((0.0, 0.0), (PERTURBATION, 0.0), (0.0, PERTURBATION)):
        motion = simulate(system, theta=theta + dx, velocity=velocity + dv, duration=duration)
        ends.append(np.array([motion.theta, motion.velocity]))
    return max(np.abs(end - ends[0]).max() for end in ends[1:]) / PERTURBATION


def test_100_random_motions_agree_with_heyoka_to_1e_9(integrator, record_property):
    rng, compared, grazing, sensitive, impacts, worst = np.random.default_rng(2024), 0, 0, 0, 0, 0.0
    for _ in range(CASES):
        numbers, theta, velocity, duration = random_case(rng)
        system = forced(**numbers)
        motion = simulate(system, theta=theta, velocity=velocity, duration=duration, tol=1e-14)
        if passes_near_a_grazing(motion):
            grazing += 1
        elif derivative(system, theta, velocity, duration) > LARGE_DERIVATIVE:
            sensitive += 1
        else:
            state, times = by_heyoka(integrator, numbers, theta, velocity, duration)
            assert len(times) == len(motion.impacts)
            assert np.abs(state - [motion.theta, motion.velocity]).max() < 1e-9
            np.testing.assert_allclose(motion.impacts.time, times, rtol=0, atol=1e-9)
            worst = max(worst, np.abs(state - [motion.theta, motion.velocity]).max())
            compared, impacts = compared + 1, impacts + len(times)
    said = (
        f"{compared} of {CASES} compared, {impacts} impacts, largest difference {worst:.1e}; left"
        f" out: {grazing} near a grazing or at rest, {sensitive} with a derivative above"
        f" {LARGE_DERIVATIVE:g}"
    )
    record_property("comparison", said)
    print(said)
    assert compared > CASES / 2, said
    assert impacts > 3 * compared, said
