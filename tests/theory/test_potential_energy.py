"""Potential and total energy against quadrature of the model's moment, and along SciPy motions."""

import math

import numpy as np
import pytest
import sympy as sp
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import quad

from saltus.errors import ParameterError
from saltus.systems import Harmonic, Load, Metainterface, RockingBlock, System, VelocityReduction
from saltus.theory import potential_energy, potential_slope, total_energy

force = st.floats(-3, 3)
systems = st.builds(
    lambda beta0, k, m, h, v, h1, v1: System(
        model=Metainterface(beta0=beta0, stiffness_ratio=k, mass_ratio=m),
        load=Load(horizontal=h, vertical=v, lower_horizontal=h1, lower_vertical=v1),
    ),
    st.floats(0.2, 2.9),
    st.floats(0.2, 5),
    st.floats(0, 4),
    force,
    force,
    force,
    force,
)


@settings(deadline=None, max_examples=40)
@given(systems, st.floats(-2.5, 2.5).filter(lambda x: abs(x) > 1e-3))
def test_potential_is_minus_the_work_of_the_moment(system, theta):
    side = 1 if theta > 0 else -1
    mass = 1 + system.model.mass_ratio * (side > 0)

    def moment(x):
        return mass * system.model.acceleration(0.0, x, 0.0, side, system.load)

    work = quad(moment, 0.0, theta, epsabs=1e-13, epsrel=1e-13)[0]
    assert potential_energy(system, theta) == pytest.approx(-work, abs=1e-11)
    assert potential_slope(system, theta) == pytest.approx(-moment(theta), abs=1e-12)


def test_potential_is_the_papers_under_a_vertical_load_alone(beta80):
    system = System(
        model=Metainterface(beta0=beta80, stiffness_ratio=0.5), load=Load(vertical=-1.523)
    )
    theta = np.linspace(-2, 2, 41)
    k = np.where(theta > 0, 0.5, 1.0)
    printed = k * theta**2 / 2 - 1.523 * (math.sin(beta80) - np.sin(beta80 + np.abs(theta)))
    np.testing.assert_allclose(potential_energy(system, theta), printed, atol=1e-15)


def test_potential_keeps_its_digits_at_small_angles(beta80):
    import mpmath as mp

    system = System(model=Metainterface(beta0=beta80), load=Load(horizontal=0.03, vertical=-0.5))
    with mp.workdps(50):
        x, b, h, v = mp.mpf(1e-9), mp.mpf(beta80), mp.mpf(0.03), mp.mpf(-0.5)
        exact = x**2 / 2 + v * (mp.sin(b) - mp.sin(b + x)) + h * (mp.cos(b + x) - mp.cos(b))
    assert potential_energy(system, 1e-9) == pytest.approx(float(exact), rel=1e-14)


def test_slope_at_contact_is_the_mean_of_both_sides(beta80):
    system = System(model=Metainterface(beta0=beta80), load=Load(horizontal=0.3, vertical=-0.5))
    assert potential_slope(system, 0.0) == pytest.approx(-0.3 * math.sin(beta80))
    just = potential_slope(system, np.array([-1e-12, 1e-12]))
    assert potential_slope(system, 0.0) == pytest.approx(just.mean())


def test_energy_is_constant_on_each_side_of_a_scipy_motion_and_jumps_with_the_moving_mass(
    by_scipy, beta80
):
    """Errata 7: with m > 0 and e = 1 the energy jumps by m v^2 / 2 at each impact, down and up in
    turn.
    """
    system = System(
        model=Metainterface(beta0=beta80, stiffness_ratio=2.0, mass_ratio=0.7),
        load=Load(horizontal=0.02, vertical=-0.5),
    )
    motion = by_scipy(system, 0.4, impacts=4)
    energy = total_energy(system, 0.4, 0.0)
    for i, (before, after) in enumerate(zip(motion.before, motion.after, strict=True)):
        side = 1 if i % 2 == 0 else -1
        assert total_energy(system, 0.0, before, side) == pytest.approx(energy, abs=1e-11)
        energy = total_energy(system, 0.0, after, -side)
        assert energy - total_energy(system, 0.0, before, side) == pytest.approx(
            -side * 0.7 * before**2 / 2, abs=1e-14
        )


def test_total_energy_broadcasts_and_takes_the_moving_mass():
    system = System(model=Metainterface(beta0=1.2, mass_ratio=1.5), impact=VelocityReduction(1.0))
    energy = total_energy(system, np.array([[0.1], [-0.1]]), np.array([0.0, 0.2, 0.4]))
    assert energy.shape == (2, 3)
    np.testing.assert_allclose(energy[0] - energy[0, 0], 2.5 * np.array([0, 0.2, 0.4]) ** 2 / 2)
    np.testing.assert_allclose(energy[1] - energy[1, 0], np.array([0, 0.2, 0.4]) ** 2 / 2)


def test_erratum_05_kinetic_energy_on_a_still_ground_is_that_of_the_masses_that_move():
    """From the positions of both masses, with SymPy: (1+m)/2 v^2 on the lower layer, v^2/2 on the
    upper one.
    """
    t, b, m, v = sp.symbols("t b m v", positive=True)
    angle = sp.Function("theta")(t)
    for side in (1, -1):
        lower_angle, upper_angle = (b + angle, b) if side > 0 else (b, b - angle)
        first = sp.Matrix([-sp.cos(lower_angle), sp.sin(lower_angle)])
        second = first + sp.Matrix([sp.cos(upper_angle), sp.sin(upper_angle)])
        kinetic = m * first.diff(t).dot(first.diff(t)) / 2 + second.diff(t).dot(second.diff(t)) / 2
        kinetic = sp.simplify(kinetic.subs(angle.diff(t), v))
        assert sp.simplify(kinetic - ((1 + m) if side > 0 else 1) * v**2 / 2) == 0
        system = System(model=Metainterface(beta0=1.2, mass_ratio=0.6))
        assert total_energy(system, 0.0, 0.3, side) == pytest.approx(
            float(kinetic.subs({m: 0.6, v: 0.3}))
        )


@pytest.mark.parametrize(
    ("system", "message"),
    [
        (
            System(
                model=Metainterface(beta0=1.2), load=Load(frequency=1.0, horizontal=Harmonic(0.1))
            ),
            "varies in time",
        ),
        (System(model=Metainterface(beta0=1.2, smoothing=50.0)), "smoothing"),
        (System(model=RockingBlock(alpha=0.2)), "RockingBlock"),
    ],
)
def test_refuses_what_has_no_potential(system, message):
    with pytest.raises(ParameterError, match=message):
        potential_energy(system, 0.1)


def test_refuses_an_unknown_side_where_the_masses_differ():
    system = System(model=Metainterface(beta0=1.2, mass_ratio=1.0))
    with pytest.raises(ParameterError, match="side must be given"):
        total_energy(system, 0.0, 0.1)
    assert total_energy(system, 0.0, 0.0) == 0.0
