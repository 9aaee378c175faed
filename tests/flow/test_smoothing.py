"""The smoothed sign of the paper (`smoothing`) as an option of the model, and its limit, the exact
motion.
"""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from shared_systems import forced

from saltus.errors import ParameterError
from saltus.flow import simulate
from saltus.systems import Metainterface

EXACT = forced(H=0.5)
SMOOTH = EXACT.with_({"model.smoothing": 50.0})


def smoothed_acceleration(t, theta, velocity, sharpness):
    """`gov_eqn_theta_long` with k = c = 1, m = 0 and q of `smoothing` for the sign, written
    again.
    """
    power = math.exp(min(sharpness * theta, 700.0))
    q = (power - 1) / (power + 1)
    angle = math.radians(80) + theta * q
    return math.sin(angle) * 0.5 * math.sin(t) + q * math.cos(angle) * -0.5 - 0.1 * velocity - theta


def run(sharpness, **changes):
    """A smoothed motion; one structure, so the limit is always on."""
    options = {"theta": 0.3, "duration": 7.0, "stop_at": "line_limit", **changes}
    return simulate(SMOOTH.with_({"model.smoothing": sharpness}), **options)


@pytest.mark.parametrize("sharpness", [5.0, 50.0, 300.0, 2000.0])
def test_smoothed_motion_agrees_with_scipy_on_the_paper_s_formula(sharpness):
    motion = run(sharpness)
    expected = solve_ivp(
        lambda t, y: [y[1], smoothed_acceleration(t, *y, sharpness)],
        (0, motion.time),
        (0.3, 0.0),
        method="DOP853",
        rtol=1e-12,
        atol=1e-14,
        max_step=0.05,
        dense_output=True,
    )
    times = np.linspace(0, motion.time, 60)
    # of SciPy's interpolant
    assert np.stack(motion.at(times)) == pytest.approx(expected.sol(times), abs=1e-7)
    assert (motion.theta, motion.velocity) == pytest.approx(tuple(expected.y[:, -1]), abs=1e-10)


def test_hyperbolic_tangent_is_the_paper_s_q():
    model = Metainterface(beta0=math.radians(80), damping=0.1, smoothing=50.0)
    for theta in (-0.3, -1e-3, 0.0, 1e-4, 0.02, 1.1):
        computed = model.acceleration(0.7, theta, 0.2, 1, EXACT.load)
        assert computed == pytest.approx(smoothed_acceleration(0.7, theta, 0.2, 50.0), abs=1e-15)


def test_smoothed_motion_converges_to_the_exact_one_with_the_square_of_the_width():
    # Over a crossing at speed v the odd part of sgn - q cancels, and the rest lasts 1/(B v) with a
    # force of order 1/B.
    exact = simulate(EXACT, theta=0.3, duration=7.0)
    assert len(exact.impacts) >= 1
    sharpness = np.array([50.0, 200.0, 1000.0, 5000.0])
    errors = []
    for b in sharpness:
        motion = run(b)
        errors.append(math.hypot(motion.theta - exact.theta, motion.velocity - exact.velocity))
    orders = -np.diff(np.log(errors)) / np.diff(np.log(sharpness))
    assert orders[1:] == pytest.approx(2.0, abs=0.1)
    assert errors[0] < 0.05
    assert errors[-1] < 1e-6


def test_smoothed_motion_has_no_impacts_and_no_sides():
    motion = run(200.0)
    assert len(motion.impacts) == 0
    assert list(motion.events) == []
    assert SMOOTH.model.sides == ()


@pytest.mark.parametrize("side", [1, -1])
def test_smoothed_motion_stops_at_its_limit_on_both_sides(side):
    motion = run(50.0, theta=side * 1.2, velocity=side * 1.5)
    assert (motion.stop.value, motion.limit) == ("limit", "line_limit")
    assert motion.theta == pytest.approx(side * (math.pi - math.radians(80)), abs=1e-13)


@pytest.mark.parametrize(
    "unequal",
    [
        {"stiffness_ratio": 1.1},
        {"mass_ratio": 0.1},
        {"dissipation_ratio": 0.9},
        {"mass_ratio": 1.0, "stiffness_ratio": 2.0},
    ],
)
def test_smoothing_of_unequal_layers_is_refused(unequal):
    with pytest.raises(
        ParameterError,
        match=r"smoothing is for symmetric layers only .* drop it to compute the exact motion",
    ):
        Metainterface(beta0=1.4, smoothing=100.0, **unequal)
    with pytest.raises(ParameterError, match="smoothing is for symmetric layers only"):
        SMOOTH.with_({f"model.{name}": value for name, value in unequal.items()})
