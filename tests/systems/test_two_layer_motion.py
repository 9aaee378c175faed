"""The two-layer model in motion with both layers open, up to the first contact."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from saltus import TwoLayer
from saltus.flow import EventKind, simulate
from saltus.systems import Harmonic, Load, System

MODEL = TwoLayer(
    beta0=math.radians(80), mass_ratio=0.4, damping=0.05, stiffness_ratio=0.8, dissipation_ratio=1.2
)
LOAD = Load(frequency=1.2, vertical=-0.5, horizontal=Harmonic(0.2), ground_horizontal=Harmonic(0.1))


def reference(start, duration):
    """DOP853 with the matrices of `eomnl`, stopped where either layer closes."""

    def rate(t, y):
        q, v = y[:2], y[2:]
        right = np.array(MODEL.load_vector(t, q, LOAD)) - MODEL.damping_matrix() @ v
        right = right - MODEL.velocity_matrix(q) @ v**2 - MODEL.stiffness_matrix() @ q
        return np.concatenate([v, np.linalg.solve(MODEL.mass_matrix(q), right)])

    closes = [lambda t, y: y[0], lambda t, y: -y[1]]
    for event in closes:
        event.terminal, event.direction = True, -1
    return solve_ivp(
        rate, (0, duration), start, method="DOP853", rtol=1e-12, atol=1e-14, events=closes
    )


@pytest.mark.parametrize(
    ("start", "name"),
    [((0.5, -0.4, 0.0, 0.0), "upper"), ((0.3, -0.5, 0.0, -0.5), "lower")],
)
def test_open_motion_agrees_with_an_independent_integrator_up_to_the_first_contact(start, name):
    system = System(model=MODEL, load=LOAD)
    motion = simulate(system, theta_1=start[0], theta_2=start[1], velocity=start[2:], duration=10.0)
    expected = reference(start, 10.0)
    assert expected.status == 1  # a contact ended it
    impact = motion.events.of(EventKind.IMPACT)[0]
    assert impact.contact == name
    assert impact.time == pytest.approx(expected.t[-1], abs=1e-10)
    position = motion.at(impact.time)[0]
    assert [*position, *impact.velocity_before] == pytest.approx(expected.y[:, -1], abs=1e-9)
