"""The reduced metainterface: jumps, equivalent loads, symmetry, limits, and errata 4, 14, 18, 19,
20.
"""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from saltus.errors import ParameterError
from saltus.systems import Harmonic, Load, Metainterface, Record, System

angle = st.floats(0.1, 3.0)
ratio = st.floats(0.1, 3.0)
number = st.floats(-2.0, 2.0)
small = st.floats(0.0, 0.5)


@settings(deadline=None)
@given(
    angle,
    small,
    ratio,
    st.floats(0, 3),
    ratio,
    st.sampled_from([1, -1]),
    st.tuples(*[number] * 6),
    st.floats(0.1, 1),
)
def test_erratum_4_general_jump_of_the_acceleration(beta0, damping, k, m, c, s, loads, e):
    """[[theta'']] = s / (1+m) {(h - m) H sin b0 + [(2 + m + v) V - 2 (1+m) nu''] cos b0 + C [(1+m)
    v_upper - c v_lower]}.
    """
    model = Metainterface(
        beta0=beta0, damping=damping, stiffness_ratio=k, mass_ratio=m, dissipation_ratio=c
    )
    names = (
        "horizontal",
        "vertical",
        "lower_horizontal",
        "lower_vertical",
        "ground_horizontal",
        "ground_vertical",
    )
    signals = [
        Harmonic(a) if n.startswith("ground") else a for n, a in zip(names, loads, strict=True)
    ]
    load = Load(frequency=1.3, **dict(zip(names, signals, strict=True)))
    # s is the sign of the velocity at the crossing: s = 1 opens the lower layer
    t, before = 0.7, s * 0.9
    after = e * before
    jump = model.acceleration(t, 0.0, after, s, load) - model.acceleration(t, 0.0, before, -s, load)
    lower, upper = (after, before) if s == 1 else (before, after)
    nu = load.ground_vertical.acceleration(t)
    across = (loads[2] - m * loads[0]) * math.sin(beta0)  # (h - m) H, as h H is the lower channel
    along = ((2 + m) * loads[1] + loads[3] - 2 * (1 + m) * nu) * math.cos(beta0)
    viscous = damping * ((1 + m) * upper - c * lower)
    expected = s / (1 + m) * (across + along + viscous)
    assert jump == pytest.approx(expected, abs=1e-12)
    # as printed: the velocity jump in place of both velocities; they differ by this
    printed = s / (1 + m) * (across + along + (1 - c + m) * damping * (after - before))
    assert jump - printed == pytest.approx(
        s / (1 + m) * (viscous - (1 - c + m) * damping * (after - before)), abs=1e-12
    )


def test_erratum_4_printed_jump_misses_the_damping_at_e_1_and_has_no_sign_at_theta_0():
    model = Metainterface(beta0=1.2, damping=0.3, mass_ratio=0.5)
    load = Load(vertical=-0.5)
    jump = model.acceleration(0.0, 0.0, 0.9, 1, load) - model.acceleration(0.0, 0.0, 0.9, -1, load)
    # (m + v + 2) V cos(beta0); the damping term is (1 - c + m) C [[theta']] = 0
    bracket = 2.5 * -0.5 * math.cos(1.2)
    assert jump == pytest.approx((bracket + 0.5 * 0.3 * 0.9) / 1.5, abs=1e-14)
    assert abs(jump - bracket / 1.5) > 0.05
    assert np.sign(0.0) * bracket == 0.0 != jump


@pytest.mark.parametrize("s", [1, -1])
def test_erratum_4_symmetric_jump_and_where_it_vanishes(s):
    """[[theta'']] = -C [[theta']] + 2 s cos(b0) (V - nu''); printed is s C [[theta']], the opposite
    sign for s = 1.
    """
    beta0, damping, t = 1.2, 0.3, 0.4
    model = Metainterface(beta0=beta0, damping=damping)
    load = Load(
        frequency=2.0, horizontal=Harmonic(0.6), vertical=-0.5, ground_vertical=Harmonic(0.2)
    )
    push = 2 * s * math.cos(beta0) * (-0.5 - load.ground_vertical.acceleration(t))
    for e in (1.0, 0.7):
        before, after = s * 0.8, s * 0.8 * e
        jump = model.acceleration(t, 0.0, after, s, load) - model.acceleration(
            t, 0.0, before, -s, load
        )
        assert jump == pytest.approx(-damping * (after - before) + push, abs=1e-14)
        if e < 1 and s == 1:
            assert abs(jump - (damping * (after - before) + push)) > 0.1
    still = Load(horizontal=0.4, vertical=0.0)  # V = nu'': "always present" is too strong
    a, b = (model.acceleration(t, 0.0, 0.8, side, still) for side in (1, -1))
    assert a == b != 0.0


@settings(deadline=None)
@given(
    angle,
    st.floats(0.2, 3),
    st.floats(-1, 1),
    st.floats(-2, 2),
    number,
    number,
    st.floats(0, 20),
    st.floats(0, 2),
)
def test_erratum_14_shaking_the_ground_is_a_force_of_plus_omega_squared_zeta(
    b0, omega, zeta, vertical, theta, v, t, m
):
    """Load (ii) is load (i) with H = +Omega^2 zeta; unequal layers (m > 0) also need h = m."""
    model = Metainterface(beta0=b0, damping=0.1, mass_ratio=m, stiffness_ratio=0.6)
    shaken = Load(frequency=omega, ground_horizontal=Harmonic(zeta), vertical=vertical)
    force = omega**2 * zeta
    pushed = Load(
        frequency=omega,
        horizontal=Harmonic(force),
        lower_horizontal=Harmonic(m * force),
        vertical=vertical,
    )
    printed = Load(
        frequency=omega,
        horizontal=Harmonic(-force),
        lower_horizontal=Harmonic(-m * force),
        vertical=vertical,
    )
    side = 1 if theta >= 0 else -1
    found = model.acceleration(t, theta, v, side, shaken)
    assert found == pytest.approx(model.acceleration(t, theta, v, side, pushed), abs=1e-12)
    # the printed sign is half a period late
    late = model.acceleration(t + math.pi / omega, theta, v, side, printed)
    assert found == pytest.approx(late, abs=1e-10 * (1 + abs(force)))
    wrong = model.acceleration(t, theta, v, side, printed)
    lever = 2 * math.sin(b0 + abs(theta)) * force * math.sin(omega * t)
    assert found - wrong == pytest.approx(lever, abs=1e-10)


def test_erratum_14_without_h_equal_to_m_the_loads_differ_on_the_lower_layer():
    model = Metainterface(beta0=1.2, mass_ratio=0.5)
    shaken = Load(frequency=1.0, ground_horizontal=Harmonic(0.3))
    pushed = Load(frequency=1.0, horizontal=Harmonic(0.3))
    upper = [model.acceleration(1.0, -0.2, 0.0, -1, load) for load in (shaken, pushed)]
    lower = [model.acceleration(1.0, 0.2, 0.0, 1, load) for load in (shaken, pushed)]
    assert upper[0] == pytest.approx(upper[1], abs=1e-15)
    assert abs(lower[0] - lower[1]) > 0.05


@settings(deadline=None)
@given(angle, st.floats(0.01, 2), small, number, number, st.floats(0, 10))
def test_erratum_18_symmetry_holds_for_k_c_1_plus_m_1_plus_h_1_plus_v_equal(
    b0, m, damping, theta, v, t
):
    """More generally than the paper's m = v = h = 0, k = c = 1; -theta moves under the mirrored
    load as theta does.
    """
    same = 1 + m
    model = Metainterface(
        beta0=b0, damping=damping, stiffness_ratio=same, mass_ratio=m, dissipation_ratio=same
    )
    horizontal, vertical = Harmonic(0.6, phase=0.3), Harmonic(0.2, mean=-0.5)
    load = Load(
        frequency=1.1,
        horizontal=horizontal,
        vertical=vertical,
        lower_horizontal=Harmonic(m * 0.6, phase=0.3),
        lower_vertical=Harmonic(m * 0.2, m * -0.5),
        ground_horizontal=Harmonic(0.3),
        ground_vertical=Harmonic(0.1),
    )
    mirrored = model.mirror(load)
    assert mirrored is not None
    side = 1 if theta >= 0 else -1
    there = model.acceleration(t, theta, v, side, load)
    assert model.acceleration(t, -theta, -v, -side, mirrored) == pytest.approx(-there, abs=1e-12)
    assert mirrored.vertical(t) == load.vertical(t)


@pytest.mark.parametrize(
    "change",
    [{"stiffness_ratio": 1.3}, {"dissipation_ratio": 0.7}, {"mass_ratio": 0.4}],
    ids=lambda c: next(iter(c)),
)
def test_erratum_18_one_unequal_ratio_breaks_the_symmetry(change):
    model = Metainterface(beta0=1.2, damping=0.2, **change)
    load = Load(frequency=1.0, horizontal=Harmonic(0.5), vertical=-0.5)
    assert model.mirror(load) is None
    reverse = Load(frequency=1.0, horizontal=Harmonic(-0.5), vertical=-0.5)
    there, back = (
        model.acceleration(0.4, 0.3, 0.5, 1, load),
        model.acceleration(0.4, -0.3, -0.5, -1, reverse),
    )
    assert abs(there + back) > 0.01


def test_a_load_on_the_lower_mass_alone_breaks_the_symmetry():
    model = Metainterface(beta0=1.2)
    assert model.mirror(Load(lower_vertical=0.1)) is None
    assert model.mirror(Load(lower_vertical=0.0, vertical=-1.0)) is not None


def test_mirror_reverses_records_and_sums_and_undoes_itself():
    model = Metainterface(beta0=1.2)
    record = Record([0.0, 1.0, 2.0], [0.0, 1.0, -1.0])
    load = Load(frequency=1.0, horizontal=record + Harmonic(0.2) + 0.1, vertical=-0.4)
    mirrored = model.mirror(load)
    for t in (0.3, 1.4, 5.0):
        assert mirrored.horizontal(t) == pytest.approx(-load.horizontal(t))
    assert model.mirror(mirrored) == load


def test_errata_19_and_20_margins_vanish_at_the_line_and_at_the_kinematic_limit():
    beta0 = math.radians(80)
    model, load = Metainterface(beta0=beta0), Load(vertical=-0.5)
    for side in (1, -1):
        for name, degrees in (("line_limit", 100.0), ("kinematic_limit", 200.0)):
            theta = side * math.radians(degrees)
            margins = [
                model.margins(0.0, theta * f, 0.0, 0.0, side, load)[name] for f in (0.99, 1.0, 1.01)
            ]
            assert margins[0] > 0 > margins[2]
            assert margins[1] == pytest.approx(0.0, abs=1e-14)
        at_110 = model.margins(0.0, side * math.radians(110), 0.0, 0.0, side, load)["line_limit"]
        assert at_110 == pytest.approx(-math.radians(10))  # the printed angle is past the line


def test_smoothed_sign_tends_to_the_exact_equation():
    """tanh(B theta / 2) differs from the sign by about 2 exp(-B abs(theta))."""
    exact = Metainterface(beta0=1.2, damping=0.1)
    load = Load(frequency=1.0, horizontal=Harmonic(0.5), vertical=-0.5)
    for theta in (0.1, -0.3):
        sharp = exact.acceleration(0.7, theta, 0.4, 1 if theta > 0 else -1, load)
        errors = []
        for sharpness in (50.0, 100.0, 400.0):
            smooth = Metainterface(beta0=1.2, damping=0.1, smoothing=sharpness)
            errors.append(abs(smooth.acceleration(0.7, theta, 0.4, 0, load) - sharp))
            assert errors[-1] <= 4 * math.exp(-sharpness * abs(theta)) + 1e-15
        assert errors[0] > errors[2]
    assert Metainterface(beta0=1.2, smoothing=100.0).sides == ()


def test_smoothing_is_refused_for_unequal_layers():
    with pytest.raises(ParameterError, match="smoothing is for symmetric layers only"):
        Metainterface(beta0=1.2, smoothing=100.0, mass_ratio=0.1)


def test_a_right_angle_makes_a_smooth_pendulum():
    """At beta0 = pi/2 both sides have one equation, `gov_eqn_special`."""
    model = Metainterface(beta0=math.pi / 2, damping=0.1)
    load = Load(
        frequency=1.0, horizontal=Harmonic(0.5), vertical=-0.5, ground_horizontal=Harmonic(0.2)
    )
    for t, theta, v in ((0.3, 0.4, -0.2), (1.7, -0.9, 0.5), (2.2, 0.0, 1.0)):
        push = load.horizontal(t) - load.ground_horizontal.acceleration(t)
        expected = math.cos(theta) * push + 0.5 * math.sin(theta) - 0.1 * v - theta
        sides = (1, -1) if theta == 0 else (int(math.copysign(1, theta)),)
        for side in sides:
            assert model.acceleration(t, theta, v, side, load) == pytest.approx(expected, abs=1e-14)


def test_a_lower_load_that_vanishes_does_not_break_the_mirror():
    model = Metainterface(beta0=1.4)
    upper = {"frequency": 2.0, "horizontal": Harmonic(0.3), "vertical": -0.5}
    for nothing in (0.0, Harmonic(0.0), Harmonic(0.0, phase=1.0) + 0.0):
        assert model.mirror(Load(**upper, lower_horizontal=nothing)) is not None
    assert model.mirror(Load(**upper, lower_horizontal=Harmonic(0.1))) is None


def test_a_lower_load_is_refused_where_the_sign_is_smoothed():
    model = Metainterface(beta0=1.4, smoothing=100.0)
    with pytest.raises(ParameterError, match=r"load\.lower_vertical cannot act with smoothing"):
        System(model=model, load=Load(vertical=-0.5, lower_vertical=-0.1))
    assert System(model=model, load=Load(vertical=-0.5, lower_vertical=0.0)).model is model
