"""The two-layer model in motion, both layers open: exact until the first contact, where it stops."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from saltus.errors import MotionError
from saltus.flow import simulate
from saltus.systems import Harmonic, Load, System, TwoLayer

MODEL = TwoLayer(beta0=math.radians(80), mass_ratio=0.4, damping=0.05, stiffness_ratio=0.8, dissipation_ratio=1.2)
LOAD = Load(frequency=1.2, vertical=-0.5, horizontal=Harmonic(0.2), ground_horizontal=Harmonic(0.1))


def reference(start, duration):
    """DOP853 with the matrices of `eomnl`, stopped where either layer closes."""

    def rate(t, y):
        q, v = y[:2], y[2:]
        right = np.array(MODEL.force(t, q, LOAD)) - MODEL.damping_matrix() @ v
        right = right - MODEL.velocity_matrix(q) @ v**2 - MODEL.stiffness_matrix() @ q
        return np.concatenate([v, np.linalg.solve(MODEL.mass_matrix(q), right)])

    closes = [lambda t, y: y[0], lambda t, y: -y[1]]
    for event in closes:
        event.terminal, event.direction = True, -1
    return solve_ivp(rate, (0, duration), start, method="DOP853", rtol=1e-12, atol=1e-14, events=closes)


@pytest.mark.parametrize(
    ("start", "name"),
    [((0.5, -0.4, 0.0, 0.0), "upper_contact"), ((0.3, -0.5, 0.0, -0.5), "lower_contact")],
)
def test_open_motion_agrees_with_an_independent_integrator_up_to_the_first_contact(start, name):
    system = System(model=MODEL, load=LOAD)
    motion = simulate(system, theta_1=start[0], theta_2=start[1], velocity=start[2:], duration=10.0)
    expected = reference(start, 10.0)
    assert expected.status == 1  # a contact ended it
    assert motion.stop.name == "LIMIT"
    assert motion.limit == name
    assert motion.time == pytest.approx(expected.t[-1], abs=1e-10)
    assert [*motion.position, *motion.velocity] == pytest.approx(expected.y[:, -1], abs=1e-9)


def test_a_motion_into_the_singular_mass_matrix_ends_in_a_sentence():
    """det M = m + sin(beta_1 + beta_2)^2 vanishes at beta_1 + beta_2 = pi for m = 0: the acceleration is infinite there."""
    system = System(model=TwoLayer(beta0=np.deg2rad(80), damping=0.1), load=Load(vertical=-0.5))
    with pytest.raises(MotionError, match="the steps shrink to nothing at time"):
        simulate(system, theta_1=0.3, theta_2=-0.2, velocity=(0.0, 0.0), duration=10.0)
