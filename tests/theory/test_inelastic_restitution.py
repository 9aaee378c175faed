"""The restitution of inelastic contact from the kinetic energy, and r as against e with a moving
ground.
"""

import math

import numpy as np
import pytest
import sympy as sp
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from saltus import InelasticImpact
from saltus.errors import ParameterError
from saltus.systems import Harmonic, Load, Metainterface, System
from saltus.theory import energy_factor, energy_jump, inelastic_contact, velocity_factor


def kinetic_energy():
    """`kin_eng` over K2 at theta = 0, from the positions of both masses on a moving ground."""
    t, b, m = sp.symbols("t b m", positive=True)
    first, second, ground_h, ground_v = (
        sp.Function(n)(t) for n in ("theta_1", "theta_2", "zeta", "nu")
    )
    x1 = sp.Matrix([ground_h - sp.cos(b + first), ground_v + sp.sin(b + first)])
    x2 = x1 + sp.Matrix([sp.cos(b - second), sp.sin(b - second)])
    v1, v2, zeta, nu = sp.symbols("v1 v2 zeta_dot nu_dot")
    kinetic = m * x1.diff(t).dot(x1.diff(t)) / 2 + x2.diff(t).dot(x2.diff(t)) / 2
    rates = {first.diff(t): v1, second.diff(t): v2, ground_h.diff(t): zeta, ground_v.diff(t): nu}
    return sp.expand(kinetic.subs(rates).subs({first: 0, second: 0})), (v1, v2, zeta, nu, b, m)


def test_erratum_25_factor_from_the_momentum_that_is_not_hit():
    """dT/dtheta'_j of the layer that is not hit is continuous; the ground's velocity drops out of
    its jump.
    """
    kinetic, (v1, v2, _, _, b, m) = kinetic_energy()
    before, after = sp.symbols("before after")
    for side, free in ((1, v2), (-1, v1)):
        momentum = sp.diff(kinetic, free)
        arrive, leave = (
            ({v1: before, v2: 0}, {v1: 0, v2: after})
            if side > 0
            else ({v1: 0, v2: before}, {v1: after, v2: 0})
        )
        balance = sp.trigsimp(momentum.subs(leave) - momentum.subs(arrive))
        factor = sp.simplify(sp.solve(balance, after)[0] / before)
        assert sp.simplify(factor + sp.cos(2 * b) / (1 if side > 0 else 1 + m)) == 0
        for degrees, ratio in ((50, 0.0), (80, 0.4), (130, 3.0)):
            expected = float(factor.subs({b: math.radians(degrees), m: ratio}))
            assert inelastic_contact(math.radians(degrees), ratio, side).factor == pytest.approx(
                expected
            )


@settings(deadline=None, max_examples=60)
@given(st.floats(0.05, 3.1), st.floats(0, 5), st.sampled_from([1, -1]))
def test_erratum_25_impulses_push_as_unilateral_constraints_can(beta0, m, side):
    """The constraint theta_1 >= 0 can only push up, theta_2 <= 0 only down; nothing may act on a
    layer that opens.
    """
    contact = inelastic_contact(beta0, m, side)
    arriving = -side  # the velocity with which the open layer comes back
    first, second = (arriving * impulse for impulse in contact.impulses)
    assert first >= -1e-12
    assert second <= 1e-12
    between = math.pi / 4 < beta0 < 3 * math.pi / 4
    assert (contact.factor > 0) == (between and abs(math.cos(2 * beta0)) > 0)
    if contact.factor > 0:
        assert contact.impulses[1 if side > 0 else 0] == pytest.approx(0.0, abs=1e-15)
    assert 0 <= contact.restitution <= 1


@settings(deadline=None, max_examples=40)
@given(st.floats(0.8, 2.3), st.floats(0, 5), st.sampled_from([1, -1]), st.floats(0.1, 2))
def test_erratum_25_is_the_law_that_models_run_and_loses_energy(beta0, m, side, speed):
    system = System(model=Metainterface(beta0=beta0, mass_ratio=m), impact=InelasticImpact())
    contact = inelastic_contact(beta0, m, side)
    after = system.impact.velocity_after(system.model, 0.0, -side * speed, side, -side, system.load)
    assert after == pytest.approx(-side * contact.factor * speed, rel=1e-14, abs=1e-15)
    assert energy_factor(system, -side * speed, side, contact.factor) == pytest.approx(
        contact.restitution
    )
    assert contact.restitution == pytest.approx(math.cos(2 * beta0) ** 2 / (1 + m))


def moving(zeta=0.3, nu=0.2, m=0.0, beta0=1.4):
    # velocities zeta, nu at tau = 0
    load = Load(frequency=1.0, ground_horizontal=Harmonic(zeta), ground_vertical=Harmonic(nu))
    return System(model=Metainterface(beta0=beta0, mass_ratio=m), load=load)


def test_erratum_05_energy_jump_and_ratio_from_the_kinetic_energy():
    """Both formulas, and r, from T of the two masses; the printed `rest_def_vel` differs once the
    ground moves vertically.
    """
    kinetic, (v1, v2, zeta, nu, b, m) = kinetic_energy()
    v, e = sp.symbols("v e")
    for side in (1, -1):
        here, there = (
            ({v1: v, v2: 0}, {v1: 0, v2: e * v})
            if side > 0
            else ({v1: 0, v2: v}, {v1: e * v, v2: 0})
        )
        before, after = kinetic.subs(here), kinetic.subs(there)
        for ratio in (0.0, 0.7):
            values = {zeta: 0.3, nu: 0.2, b: 1.4, m: ratio, v: -side * 0.5, e: 0.8}
            system = moving(m=ratio)
            assert energy_jump(system, -side * 0.5, side, 0.8) == pytest.approx(
                float((after - before).subs(values))
            )
            assert energy_factor(system, -side * 0.5, side, 0.8) == pytest.approx(
                float((after / before).subs(values))
            )

    def printed(v, e, zeta, nu, b):
        def energy(w):
            return (w * math.sin(b) + zeta) ** 2 + (w * math.cos(b) + nu) ** 2

        return energy(e * v) / energy(v)

    assert energy_factor(moving(nu=0.0), -0.5, 1, 0.8) == pytest.approx(
        printed(-0.5, 0.8, 0.3, 0.0, 1.4)
    )
    assert abs(energy_factor(moving(), -0.5, 1, 0.8) - printed(-0.5, 0.8, 0.3, 0.2, 1.4)) > 0.05
    assert abs(energy_factor(moving(), 0.5, -1, 0.8) - printed(0.5, 0.8, 0.3, 0.2, 1.4)) > 0.05


def test_erratum_05_vertical_ground_velocity_changes_the_energy_without_loss_of_velocity():
    assert energy_jump(moving(), -0.5, 1, 1.0) == pytest.approx(-2 * -0.5 * math.cos(1.4) * 0.2)
    assert energy_jump(moving(nu=0.0), -0.5, 1, 1.0) == 0.0


def test_still_ground_gives_e_squared():
    for e in (0.3, 1.0):
        still = System(model=Metainterface(beta0=1.4))
        assert energy_factor(still, 0.7, -1, e) == pytest.approx(e**2)  # `rest_def_red`
        heavy = System(model=Metainterface(beta0=1.4, mass_ratio=0.5))
        assert energy_factor(heavy, -0.7, 1, e) == pytest.approx(e**2 / 1.5)
        assert energy_factor(heavy, 0.7, -1, e) == pytest.approx(e**2 * 1.5)


@settings(deadline=None, max_examples=150)
@given(
    st.floats(0.3, 2.8), st.floats(0, 3), st.floats(-1, 1), st.floats(-1, 1), st.floats(0.05, 2), st.floats(0.05, 1),
    st.sampled_from([1, -1]),
)  # fmt: skip
def test_energy_jump_is_that_of_the_models_kinetic_energy(beta0, m, zeta, nu, speed, e, side):
    system = moving(zeta, nu, m, beta0)
    model, v = system.model, -side * speed
    difference = model.kinetic_energy(0.0, 0.0, e * v, -side, system.load) - model.kinetic_energy(
        0.0, 0.0, v, side, system.load
    )
    assert energy_jump(system, v, side, e) == pytest.approx(difference, abs=1e-12)
    assume(abs(difference) > 1e-9)
    assert (energy_factor(system, v, side, e) < 1) == (energy_jump(system, v, side, e) < 0)


@settings(deadline=None, max_examples=100)
@given(
    st.floats(0.3, 2.8),
    st.floats(0, 3),
    st.floats(-0.1, 0.1),
    st.floats(-0.1, 0.1),
    st.floats(0.5, 2),
    st.sampled_from([1, -1]),
)
def test_conversion_from_r_to_e_and_back(beta0, m, zeta, nu, speed, side):
    system, r = moving(zeta, nu, m, beta0), 0.9
    v = -side * speed
    assert energy_factor(system, v, side, velocity_factor(system, v, side, r)) == pytest.approx(
        r, rel=1e-11
    )


def test_energy_jump_broadcasts():
    assert energy_jump(
        moving(), np.linspace(-1, -0.1, 5)[:, None], 1, np.array([0.5, 1.0])
    ).shape == (5, 2)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (
            lambda: energy_factor(System(model=Metainterface(beta0=1.4)), 0.0, 1, 1.0),
            "kinetic energy before",
        ),
        (lambda: velocity_factor(moving(), 0.0, 1, 1.0), "velocity 0"),
        (lambda: velocity_factor(moving(0.0, 1.0), -0.01, 1, 0.5), "tau = 0.0"),
        (lambda: inelastic_contact(80.0, 0.0, 1), "degrees"),
        (lambda: inelastic_contact(1.4, -1.0, 1), "mass_ratio"),
        (lambda: inelastic_contact(1.4, 0.0, 0), "side must be"),
    ],
)
def test_refuses_what_has_no_answer(call, message):
    with pytest.raises(ParameterError, match=message):
        call()
