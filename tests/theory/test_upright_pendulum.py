"""At beta0 = pi/2 the reduced equation is a smooth pendulum on a spring."""

import math

import numpy as np
import pytest
import sympy as sp

from saltus.errors import ParameterError
from saltus.systems import Harmonic, Load, Metainterface, System
from saltus.theory import pendulum_acceleration

LOAD = Load(
    frequency=1.3,
    horizontal=Harmonic(0.7),
    vertical=Harmonic(0.2, mean=-0.8, phase=0.4),
    ground_horizontal=Harmonic(0.3, order=2),
    ground_vertical=Harmonic(0.1, phase=1.0),
)


def test_reduced_equation_is_the_pendulum():
    system = System(model=Metainterface(beta0=math.pi / 2, damping=0.2), load=LOAD)
    rng = np.random.default_rng(5)
    tau, theta, velocity = rng.uniform(-3, 3, (3, 200))
    reduced = system.model.acceleration(tau, theta, velocity, np.sign(theta), system.load)
    np.testing.assert_allclose(
        pendulum_acceleration(system, tau, theta, velocity), reduced, atol=1e-14
    )


def test_the_sign_of_theta_drops_out():
    x = sp.symbols("x", positive=True)
    for side in (1, -1):
        assert sp.simplify(sp.sin(x + sp.pi / 2) - sp.cos(side * x)) == 0
        assert sp.simplify(side * sp.cos(x + sp.pi / 2) + sp.sin(side * x)) == 0


def test_only_the_right_angle_is_smooth():
    system = System(model=Metainterface(beta0=1.5), load=LOAD)
    jump = np.subtract(*(system.model.acceleration(0.0, 0.0, 0.1, s, LOAD) for s in (1, -1)))
    assert abs(jump) > 0.05


@pytest.mark.parametrize(
    ("system", "message"),
    [
        (System(model=Metainterface(beta0=1.5)), "beta0 = pi/2"),
        (System(model=Metainterface(beta0=math.pi / 2, stiffness_ratio=2.0)), "equal layers"),
        (
            System(model=Metainterface(beta0=math.pi / 2), load=Load(lower_vertical=0.1)),
            "upper mass only",
        ),
    ],
)
def test_refuses_other_cells(system, message):
    with pytest.raises(ParameterError, match=message):
        pendulum_acceleration(system, 0.0, 0.1, 0.0)
