"""The monostable domain with both of its borders, and the static angles, against minimisation and
the list of equilibria.
"""

import math

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from scipy.optimize import minimize_scalar

from saltus.errors import ParameterError
from saltus.systems import Load, Metainterface, System
from saltus.theory import (
    critical_horizontal,
    equilibria,
    equivalent_angle,
    fold_curve,
    fold_horizontal,
    is_monostable,
    static_angle,
    subcritical_vertical,
    unloaded_fold,
)

BETA = math.radians(80)


def cell(beta0, h, v):
    return System(model=Metainterface(beta0=beta0), load=Load(horizontal=h, vertical=v))


def least_horizontal(beta0, vertical):
    """The least H with a deformed equilibrium: x is one under H = (x - V cos(beta0 + x)) /
    sin(beta0 + x), minimised over x.
    """

    def horizontal(x):
        return (x - vertical * math.cos(beta0 + x)) / math.sin(beta0 + x)

    grid = np.linspace(1e-6, math.pi - beta0 - 1e-3, 2000)
    best = grid[np.argmin([horizontal(x) for x in grid])]
    step = grid[1]
    return minimize_scalar(
        horizontal,
        bounds=(max(best - step, 0), best + step),
        method="bounded",
        options={"xatol": 1e-12},
    ).fun


def printed(beta0, horizontal, vertical):
    """The domain of Fig. 8."""
    return vertical * math.cos(beta0) < -abs(horizontal) * math.sin(beta0)


def test_erratum_23_fold_below_the_critical_load():
    assert critical_horizontal(BETA, -1.2) == pytest.approx(0.2116, abs=5e-5)
    assert fold_horizontal(BETA, -1.2) == pytest.approx(0.1131, abs=5e-5)
    assert fold_horizontal(BETA, -1.2) == pytest.approx(least_horizontal(BETA, -1.2), abs=1e-12)


@pytest.mark.parametrize(("degrees", "paper"), [(80, -1.3563), (60, -1.8105)])
def test_erratum_23_deformed_equilibria_without_horizontal_load(degrees, paper):
    vertical, opening = unloaded_fold(math.radians(degrees))
    assert vertical == pytest.approx(paper, abs=5e-5)
    assert fold_curve(math.radians(degrees), opening) == pytest.approx((0.0, vertical), abs=1e-14)
    for dv, count in ((1e-6, 1), (-1e-6, 5)):
        assert len(equilibria(cell(math.radians(degrees), 0.0, vertical + dv))) == count


def test_erratum_23_the_papers_domain_holds_other_equilibria_too():
    for h, alone in ((0.10, True), (0.12, False), (0.20, False)):
        assert printed(BETA, h, -1.2)
        states = equilibria(cell(BETA, h, -1.2))
        assert is_monostable(BETA, h, -1.2) == alone
        assert (len(states) == 1) == alone
        assert sum(e.stable for e in states) == (1 if alone else 2)
    assert not printed(BETA, 0.22, -1.2)
    edge = least_horizontal(BETA, -1.2) * np.array([1 - 1e-8, 1 + 1e-8])
    np.testing.assert_array_equal(is_monostable(BETA, edge, -1.2), [True, False])


@settings(deadline=None, max_examples=200)
@given(st.floats(0.15, 3.0), st.floats(-1.2, 1.2), st.floats(-3, 3))
def test_domain_is_where_the_undeformed_state_is_the_only_equilibrium(beta0, share, vertical):
    h = share * abs(vertical / math.tan(beta0))
    assume(abs(abs(share) - 1) > 1e-3 and abs(math.cos(beta0)) > 1e-3 and abs(vertical) > 1e-3)
    if vertical <= -math.sin(beta0) and beta0 < math.pi / 2:
        assume(abs(abs(h) - fold_horizontal(beta0, vertical)) > 1e-6)
    states = [(e.theta, e.stable) for e in equilibria(cell(beta0, h, vertical))]
    assert is_monostable(beta0, h, vertical) == (states == [(0.0, True)])


def test_both_borders_meet_and_touch_at_the_start_of_the_fold():
    assert fold_curve(BETA, 0.0) == pytest.approx((math.cos(BETA), -math.sin(BETA)))
    assert subcritical_vertical(BETA) == -math.sin(BETA)
    steps = np.array([0.02, 0.01, 0.005])
    h, v = fold_curve(BETA, steps)
    gap = critical_horizontal(BETA, v) - h
    assert np.all(gap > 0)
    # tangent, and parted only at third order
    assert np.log2(gap[:-1] / gap[1:]) == pytest.approx([3, 3], abs=0.05)
    vertical = np.linspace(-1.5, -math.sin(BETA), 50)
    assert np.all(fold_horizontal(BETA, vertical) <= critical_horizontal(BETA, vertical) + 1e-12)


@settings(deadline=None, max_examples=40)
@given(st.floats(0.2, 1.5), st.floats(0.01, 0.97))
def test_fold_is_the_least_load_with_a_deformed_equilibrium(beta0, share):
    low, high = unloaded_fold(beta0)[0], -math.sin(beta0)
    vertical = high + share * (low - high)
    assert fold_horizontal(beta0, vertical) == pytest.approx(
        least_horizontal(beta0, vertical), abs=1e-9
    )


def test_supercritical_buckling_has_no_fold():
    """V > -sin(beta0): just below Hcr nothing else exists, just above the new state is close to
    theta = 0.
    """
    critical = critical_horizontal(BETA, -0.5)
    assert critical == pytest.approx(0.5 / math.tan(BETA))
    assert [e.theta for e in equilibria(cell(BETA, critical - 1e-6, -0.5))] == [0.0]
    assert static_angle(BETA, critical + 1e-6, -0.5) < 1e-5


@pytest.mark.parametrize(
    ("h", "v"), [(0.2, -0.5), (0.5, -0.5), (1.0, -0.5), (3.0, -0.5), (0.23, -1.2)]
)
def test_static_angle_is_reached_by_loading_slowly(by_scipy, h, v):
    system = System(
        model=Metainterface(beta0=BETA, damping=2.0), load=Load(horizontal=h, vertical=v)
    )
    rest = by_scipy(system, 1e-9, until=150.0)
    assert rest.state[1] == pytest.approx(0.0, abs=1e-9)
    assert static_angle(BETA, h, v) == pytest.approx(rest.state[0], abs=1e-8)
    assert static_angle(BETA, -h, v) == static_angle(BETA, h, v)


def test_equivalent_angle_moves_the_mass_by_the_ground_amplitude():
    zeta = np.array([0.0, 0.25, 0.5, 1.0])
    angle = equivalent_angle(BETA, zeta)
    np.testing.assert_allclose(math.cos(BETA) - np.cos(BETA + angle), zeta, atol=1e-15)
    assert equivalent_angle(BETA, 1 + math.cos(BETA)) == pytest.approx(math.pi - BETA)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: equivalent_angle(BETA, 1.2), "1 \\+ cos"),
        (lambda: equivalent_angle(BETA, -0.1), "1 \\+ cos"),
        (lambda: critical_horizontal(BETA, 0.5), "unstable for every H"),
        (lambda: static_angle(BETA, 0.05, -0.5), "must exceed Hcr"),
        (lambda: fold_horizontal(BETA, -0.5), "Hcr is the border"),
        (lambda: fold_horizontal(1.8, -1.5), "beta0 must"),
        (lambda: fold_curve(BETA, 2.0), "straight line"),
        (lambda: is_monostable(80.0, 0.0, -0.5), "degrees"),
    ],
)
def test_refuses_what_is_out_of_range(call, message):
    with pytest.raises(ParameterError, match=message):
        call()


def test_erratum_35_an_ellipse_of_loads_leaves_the_domain_before_the_printed_amplitude():
    tau = np.linspace(0, 2 * np.pi, 200_001)
    swing, critical = 0.25, critical_horizontal(BETA, -0.5, 0.25)
    assert critical == pytest.approx(0.07635, abs=5e-6)
    for amplitude, inside in ((critical * (1 - 1e-6), True), (critical * (1 + 1e-6), False)):
        vertical, horizontal = -0.5 + swing * np.cos(tau), amplitude * np.sin(tau)
        assert (
            bool((vertical * math.cos(BETA) < -np.abs(horizontal) * math.sin(BETA)).all()) is inside
        )
    assert critical_horizontal(BETA, -0.5, 0.0) == pytest.approx(0.5 / math.tan(BETA), rel=1e-15)
    with pytest.raises(ParameterError, match="swing must be at most"):
        critical_horizontal(BETA, -0.5, 0.6)
