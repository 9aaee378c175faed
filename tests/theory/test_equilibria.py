"""All equilibria and their stability, against dense scans, mpmath, numerical Jacobians and SciPy
motions.
"""

import math

import mpmath as mp
import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from saltus.systems import Load, Metainterface, System
from saltus.theory import (
    Stability,
    equilibria,
    fold_curve,
    potential_energy,
    potential_slope,
    undeformed_stability,
)

BETA = math.radians(80)
V_PORTRAITS = -1.5 / math.sin(BETA)


def portrait(k=1.0, damping=0.0):
    return System(
        model=Metainterface(beta0=BETA, stiffness_ratio=k, damping=damping),
        load=Load(vertical=V_PORTRAITS),
    )


@pytest.mark.parametrize(("k", "paper"), [(1.0, 1.46272), (0.5, 2.40575), (1.1, 1.13346)])
def test_erratum_09_theta_one_of_the_phase_portraits(k, paper):
    top = equilibria(portrait(k))[-1]
    assert top.stable
    assert top.theta == pytest.approx(paper, abs=5e-6)
    with mp.workdps(30):
        b, v = mp.mpf(BETA), mp.mpf(V_PORTRAITS)
        exact = mp.findroot(lambda x: k * x - v * mp.cos(b + x), paper)
    assert top.theta == pytest.approx(float(exact), rel=4e-15)


def test_erratum_09_the_printed_angle_belongs_to_another_stiffness():
    assert abs(potential_slope(portrait(1.1), 1.384)) > 0.05
    assert equilibria(portrait(1.0295))[-1].theta == pytest.approx(1.384, abs=5e-4)


def test_three_stable_states_between_two_saddles():
    five = equilibria(portrait())
    assert [e.stability.value for e in five] == [
        "stable",
        "unstable",
        "stable",
        "unstable",
        "stable",
    ]
    assert [e.theta for e in five] == pytest.approx([-e.theta for e in five][::-1])
    assert [e.energy for e in five] == pytest.approx(
        [float(potential_energy(portrait(), e.theta)) for e in five]
    )


def test_soft_lower_layer_rests_beyond_the_straight_line():
    """Errata 19: for beta0 = 80 deg the line is at 100 deg; theta_I = 137.8 deg of k = 0.5 lies
    beyond it.
    """
    assert [e.within_line for e in equilibria(portrait(0.5))] == [True, True, True, True, False]


forces = st.floats(-4, 4)


@settings(deadline=None, max_examples=150)
@given(st.floats(0.1, 3.0), st.floats(0.1, 4), forces, forces, forces, forces)
def test_no_equilibrium_is_missed(beta0, k, h, v, h1, v1):
    """Sign changes of the moment on a dense scan, each side, against what the closed form
    brackets.
    """
    load = Load(horizontal=h, vertical=v, lower_horizontal=h1, lower_vertical=v1)
    system = System(model=Metainterface(beta0=beta0, stiffness_ratio=k), load=load)
    limit = 2 * (math.pi - beta0)
    found = [e for e in equilibria(system) if e.theta != 0]
    grid = np.linspace(1e-6, limit - 1e-6, 20001)
    for side in (1, -1):
        slope = side * potential_slope(system, side * grid)
        assume(np.min(np.abs(slope[[0, -1]])) > 1e-5)
        turns = slope[1:-1][np.diff(np.sign(np.diff(slope))) != 0]
        assume(turns.size == 0 or np.min(np.abs(turns)) > 1e-5)
        scanned = grid[:-1][np.diff(np.sign(slope)) != 0]
        mine = np.array(sorted(side * e.theta for e in found if side * e.theta > 0))
        assert mine.size == scanned.size
        assert np.all((mine > scanned - 1e-12) & (mine < scanned + grid[1] - grid[0] + 1e-12))
    for e in found:
        assert abs(potential_slope(system, e.theta)) < 1e-12


@settings(deadline=None, max_examples=60)
@given(
    st.floats(0.3, 2.8),
    st.floats(0.3, 3),
    st.floats(0, 2),
    st.floats(0.01, 3),
    st.floats(0, 2),
    forces,
    forces,
)
def test_eigenvalues_are_those_of_the_numerical_jacobian(beta0, k, m, damping, c, h, v):
    model = Metainterface(
        beta0=beta0, stiffness_ratio=k, mass_ratio=m, damping=damping, dissipation_ratio=c
    )
    system = System(model=model, load=Load(horizontal=h, vertical=v))
    for e in equilibria(system):
        if e.theta == 0 or abs(e.curvature) < 1e-3:
            continue
        side, d = math.copysign(1, e.theta), 1e-6
        by_theta = (
            model.acceleration(0, e.theta + d, 0, side, system.load)
            - model.acceleration(0, e.theta - d, 0, side, system.load)
        ) / (2 * d)
        by_velocity = model.acceleration(0, e.theta, 1.0, side, system.load) - model.acceleration(
            0, e.theta, 0, side, system.load
        )
        numerical = np.linalg.eigvals([[0, 1], [by_theta, by_velocity]])
        assert np.sum(e.eigenvalues) == pytest.approx(numerical.sum(), abs=1e-6)
        assert np.prod(e.eigenvalues) == pytest.approx(np.prod(numerical), abs=1e-6)
        if model.damping * min(c, 1) > 1e-3:
            assert e.stable == (numerical.real.max() < 0)


@pytest.mark.parametrize(
    ("degrees", "vertical", "expected"),
    [(80, -0.5, "stable"), (80, 0.5, "unstable"), (100, 0.5, "stable"), (100, -0.5, "unstable")],
)
def test_undeformed_state_is_stable_for_v_cos_beta0_below_zero(
    by_scipy, degrees, vertical, expected
):
    system = System(
        model=Metainterface(beta0=math.radians(degrees), damping=0.1), load=Load(vertical=vertical)
    )
    assert undeformed_stability(system) is Stability(expected)
    peaks = by_scipy(system, 1e-4, until=3.0).peaks
    if expected == "stable":
        assert len(peaks) > 10
        assert abs(peaks[-1]) < 0.99e-4
    else:
        assert (
            max((abs(p) for p in peaks), default=abs(by_scipy(system, 1e-4, until=3.0).state[0]))
            > 0.01
        )


def test_undeformed_state_is_none_where_the_load_opens_one_layer():
    held = System(model=Metainterface(beta0=BETA), load=Load(horizontal=0.08, vertical=-0.5))
    gone = held.with_({"load.horizontal": 0.09})  # Hcr = 0.0882
    assert undeformed_stability(held) is Stability.STABLE
    assert undeformed_stability(gone) is None
    assert 0.0 not in [e.theta for e in equilibria(gone)]


@pytest.mark.parametrize(
    ("vertical", "expected"),
    [(-0.9, Stability.STABLE), (-1.1, Stability.UNSTABLE), (0.0, Stability.STABLE)],
)
def test_upright_cell_buckles_at_v_equal_to_minus_one(vertical, expected):
    system = System(model=Metainterface(beta0=math.pi / 2), load=Load(vertical=vertical))
    assert undeformed_stability(system) is expected
    others = [e.theta for e in equilibria(system) if e.theta != 0]
    if expected is Stability.STABLE:
        assert others == []
    else:  # theta = -V sin(theta)
        assert others == pytest.approx([-others[1], others[1]])
        assert others[1] == pytest.approx(1.1 * math.sin(others[1]))


def test_undeformed_state_with_the_lower_layer_alone_past_buckling_is_unstable():
    system = System(
        model=Metainterface(beta0=math.pi / 2, stiffness_ratio=0.5), load=Load(vertical=-0.7)
    )
    assert undeformed_stability(system) is Stability.UNSTABLE
    assert [e.theta > 0 for e in equilibria(system) if e.theta != 0] == [True]


@pytest.mark.parametrize("opening", [0.3, 0.6, 0.9])
def test_two_equilibria_meet_in_a_fold(opening):
    h, v = fold_curve(BETA, opening)

    def near(dh):
        system = System(model=Metainterface(beta0=BETA), load=Load(horizontal=h + dh, vertical=v))
        return [e for e in equilibria(system) if e.theta > 0]

    assert len(near(-1e-9)) == 0
    pair = near(1e-9)
    assert [e.stability for e in pair] == [Stability.UNSTABLE, Stability.STABLE]
    assert [e.theta for e in pair] == pytest.approx([opening, opening], abs=1e-3)
    at = near(0.0)
    assert all(e.theta == pytest.approx(opening, abs=1e-6) for e in at)
    assert [e.stability for e in at] in (
        [Stability.FOLD],
        [Stability.UNSTABLE, Stability.STABLE],
        [],
    )
