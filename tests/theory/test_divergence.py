"""Linearised equilibria and the divergence conditions, against SymPy and motions of the linearised
equation.
"""

import math

import numpy as np
import pytest
import sympy as sp
from hypothesis import given, settings
from hypothesis import strategies as st
from theory_references import linear_acceleration

from saltus.systems import Load, Metainterface, System
from saltus.theory import divergence, equilibria, linear_equilibria, undeformed_stability


def cell(degrees, vertical, k=1.0, m=0.0, **load):
    model = Metainterface(beta0=math.radians(degrees), stiffness_ratio=k, mass_ratio=m)
    return System(model=model, load=Load(vertical=vertical, **load))


def test_linear_equilibria_solve_the_first_order_expansion():
    """theta_A, theta_B and their energies from SymPy's own expansion of
    `gov_eqn_constant_loading`.
    """
    x, b, k, v = sp.symbols("x b k v")
    slope = sp.series(k * x - v * sp.cos(b + x), x, 0, 2).removeO()
    root = sp.solve(slope, x)[0]
    energy = sp.integrate(slope, (x, 0, root))
    for degrees, vertical, ratio in [
        (85, -1.7, 1.3),
        (85, -1.7, 0.4),
        (100, -0.8, 0.5),
        (70, 0.4, 2.0),
    ]:
        found = {
            e.theta: e for e in linear_equilibria(cell(degrees, vertical, ratio)) if e.theta != 0
        }
        for side, stiffness in ((1, ratio), (-1, 1.0)):
            values = {b: math.radians(degrees), k: stiffness, v: vertical}
            theta = side * float(root.subs(values))
            if side * theta < 0:
                assert not any(side * t > 0 for t in found)
                continue
            near = min(found, key=lambda t: abs(t - theta))
            assert near == pytest.approx(theta, rel=1e-12)
            assert found[near].energy == pytest.approx(float(energy.subs(values)), rel=1e-12)


@settings(deadline=None, max_examples=60)
@given(
    st.floats(30, 150).filter(lambda d: abs(d - 90) > 1),
    st.floats(-3, 3).filter(lambda v: abs(v) > 1e-6),
    st.floats(0.2, 4),
)
def test_deformed_states_are_unstable_where_the_undeformed_one_is_stable(degrees, vertical, k):
    system = cell(degrees, vertical, k)
    deformed = [e for e in linear_equilibria(system) if e.theta != 0]
    assert all(
        e.stable != undeformed_stability(system).value.startswith("stable") for e in deformed
    )
    if undeformed_stability(system).value == "stable":
        assert all(e.energy > 0 for e in deformed)


def test_erratum_15_both_equilibria_need_the_greater_stiffness():
    """Between -max(1, k)/sin(beta0) and -min(1, k)/sin(beta0), which the paper's `minmin` admits,
    only one of them exists.
    """
    for k in (0.6, 1.8):
        sine = math.sin(math.radians(88))
        between, below = -(1 + k) / 2 / sine, -(max(1, k) + 0.1) / sine
        one = [e for e in linear_equilibria(cell(88, between, k)) if e.theta != 0]
        both = [e for e in linear_equilibria(cell(88, below, k)) if e.theta != 0]
        assert between < -min(1, k) / sine  # the printed condition holds
        assert len(one) == 1
        assert (one[0].theta > 0) == (k < 1)
        assert len(both) == 2
        assert all(e.energy > 0 and not e.stable for e in both)


def test_linear_equilibria_tend_to_the_full_ones_as_beta0_tends_to_the_right_angle():
    errors = []
    for gap in (2.0, 1.0, 0.5):
        linear = next(e.theta for e in linear_equilibria(cell(90 - gap, -2.0)) if e.theta > 0)
        full = min(e.theta for e in equilibria(cell(90 - gap, -2.0)) if e.theta > 0)
        errors.append(abs(linear / full - 1))
    assert np.log2(errors[0] / errors[1]) == pytest.approx(2, abs=0.05)
    assert np.log2(errors[1] / errors[2]) == pytest.approx(2, abs=0.05)


@pytest.mark.parametrize(
    ("vertical", "k", "h"),
    [(-1.5, 1.0, 0.0), (-1.5, 0.6, 0.0), (-1.5, 1.2, 0.02), (-1.2, 1.3, 0.0)],
)
def test_motions_diverge_just_beyond_the_thresholds(by_scipy, vertical, k, h):
    system = cell(86, vertical, k, horizontal=h)
    limits = divergence(system)
    assert not limits.from_rest
    acceleration = linear_acceleration(system)
    assert (limits.above is None) == (k > -vertical * math.sin(math.radians(86)))
    for threshold in filter(None, (limits.above, limits.below)):
        inside = by_scipy(
            system, 0.999 * threshold, impacts=1, until=60.0, acceleration=acceleration
        )
        beyond = by_scipy(
            system, 1.001 * threshold, impacts=1, until=30.0, acceleration=acceleration
        )
        assert len(inside.before) == 1
        assert beyond.before == []
        assert abs(beyond.state[0]) > 10 * abs(threshold)


def test_divergence_from_the_undeformed_state():
    assert divergence(cell(80, 0.5)).from_rest
    assert divergence(cell(100, -0.5)).from_rest
    assert not divergence(cell(80, -0.5)).from_rest
    assert divergence(cell(80, -0.5)) == divergence(cell(100, 0.5))


@pytest.mark.parametrize(
    ("vertical", "above", "below"), [(-0.9, 0.0, None), (-1.1, 0.0, 0.0), (-0.5, None, None)]
)
def test_upright_cell_diverges_below_minus_k_and_minus_one(vertical, above, below):
    limits = divergence(cell(90, vertical, 0.8))
    assert (limits.above, limits.below) == (above, below)
