"""Frequencies, the period T0 and its expansions, and the decay by impacts, against quadrature,
series and exact motions.
"""

import math

import mpmath as mp
import numpy as np
import pytest
import sympy as sp
from hypothesis import given, settings
from hypothesis import strategies as st

from saltus.errors import ParameterError
from saltus.systems import Load, Metainterface, System, VelocityReduction
from saltus.theory import (
    decayed_amplitude,
    decayed_period,
    final_time,
    linear_motion,
    linear_period,
    short_period,
    upright_period,
    vibrations,
)

BETA = math.radians(80)


@settings(deadline=None, max_examples=60)
@given(
    st.floats(0.3, 2.8),
    st.floats(0.5, 3),
    st.floats(0, 3),
    st.floats(0, 1),
    st.floats(0, 2),
    st.floats(-0.3, 1),
    st.floats(-0.3, 0.3),
)
def test_frequencies_are_those_of_the_models_acceleration_at_contact(beta0, k, m, damping, c, v, h):
    model = Metainterface(
        beta0=beta0, stiffness_ratio=k, mass_ratio=m, damping=damping, dissipation_ratio=c
    )
    system = System(model=model, load=Load(vertical=v, horizontal=h))
    for side, vibration in zip((1, -1), vibrations(system), strict=True):
        # on the smooth field of one side, both signs are allowed
        x = np.array([0.0, 1.0, -1.0]) * 1e-5
        smooth = [_one_sided(model, system.load, side, xi) for xi in x]
        stiffness = (smooth[2] - smooth[1]) / 2e-5
        assert vibration.frequency**2 == pytest.approx(stiffness, rel=1e-6)
        loss = model.acceleration(0, 0.0, 0.0, side, system.load) - model.acceleration(
            0, 0.0, 1.0, side, system.load
        )
        assert 2 * vibration.damping_ratio * vibration.frequency == pytest.approx(loss, abs=1e-12)
        assert vibration.centre == pytest.approx(side * smooth[0] / stiffness, rel=1e-5, abs=1e-9)


def _one_sided(model, load, side, x):
    """x'' at rest, x = s theta, with the model's absolute value undone: theta is shifted into beta0
    instead.
    """
    shifted = Metainterface(
        beta0=model.beta0 + x, stiffness_ratio=model.stiffness_ratio, mass_ratio=model.mass_ratio
    )
    k, mass = (model.stiffness_ratio, 1 + model.mass_ratio) if side > 0 else (1.0, 1.0)
    return side * shifted.acceleration(0, 0.0, 0.0, side, load) - k * x / mass


def quadrature_period(theta0, beta0, vertical):
    """4 times the integral of dx / v with v^2 / 2 = P(theta0) - P(x), the linearised P, by
    mpmath.
    """
    with mp.workdps(30):
        kappa, push = (
            1 + mp.mpf(vertical) * mp.sin(mp.mpf(beta0)),
            mp.mpf(vertical) * mp.cos(mp.mpf(beta0)),
        )
        size = mp.mpf(theta0)

        def integrand(u):  # x = size (1 - u^2)
            x = size * (1 - u**2)
            return 2 * size / mp.sqrt(2 * (kappa * (size + x) / 2 - push) * size)

        return float(4 * mp.quad(integrand, [0, 1]))


@pytest.mark.parametrize(
    ("degrees", "vertical", "theta0"),
    [
        (80, -0.5, 0.1),
        (80, -0.5, 1e-6),
        (60, -0.9, 0.5),
        (100, 1.5, 0.3),
        (80, -1.2, 0.05),
        (88, -1.5, 0.04),
        (80, -0.02, 2.0),
    ],
)
def test_period_is_the_quadrature_of_the_linearised_energy(degrees, vertical, theta0):
    period = linear_period(theta0, beta0=math.radians(degrees), vertical=vertical)
    assert period == pytest.approx(
        quadrature_period(theta0, math.radians(degrees), vertical), rel=1e-13
    )


def test_period_is_the_papers_arccos_and_passes_smoothly_through_zero_stiffness():
    theta, kappa, push = 0.1, 1 - 0.5 * math.sin(BETA), -0.5 * math.cos(BETA)
    printed = 4 / math.sqrt(kappa) * math.acos(1 / (1 - kappa / push * theta))
    assert linear_period(theta, beta0=BETA, vertical=-0.5) == pytest.approx(printed, rel=1e-13)
    flat = -1 / math.sin(BETA)
    around = [linear_period(theta, beta0=BETA, vertical=flat + d) for d in (-1e-7, 0.0, 1e-7)]
    assert around[1] == pytest.approx((around[0] + around[2]) / 2, rel=1e-9)


def test_period_at_the_right_angle_is_that_of_a_smooth_oscillator():
    for theta in (1e-6, 0.3):
        assert linear_period(theta, beta0=math.pi / 2, vertical=-0.5) == pytest.approx(
            2 * math.pi / math.sqrt(0.5)
        )
    assert linear_period(0.3, beta0=BETA, vertical=0.0) == pytest.approx(2 * math.pi)


def test_period_has_no_bound_near_the_saddle():
    saddle = 1.5 * math.cos(math.radians(88)) / (1.5 * math.sin(math.radians(88)) - 1)
    near = [
        linear_period(saddle * (1 - 10.0**-n), beta0=math.radians(88), vertical=-1.5)
        for n in (3, 6, 9)
    ]
    rate = 1 / math.sqrt(1.5 * math.sin(math.radians(88)) - 1)
    assert np.diff(near) == pytest.approx(4 * rate * 3 * math.log(10), rel=1e-3)
    with pytest.raises(ParameterError, match="diverges"):
        linear_period(saddle * 1.0001, beta0=math.radians(88), vertical=-1.5)


def test_short_period_is_the_first_term_of_the_series():
    """SymPy: arccos(1/(1+q)) = sqrt(2 q) (1 - 5 q / 12 + ...), so T0 / T_short - 1 tends to -5 q /
    12.
    """
    q = sp.symbols("q", positive=True)
    assert (
        sp.series(sp.acos(1 / (1 + q)) / sp.sqrt(2 * q), q, 0, 2)
        .removeO()
        .equals(1 - sp.Rational(5, 12) * q)
    )
    for theta in (1e-3, 1e-4):
        ratio = linear_period(theta, beta0=BETA, vertical=-0.5) / short_period(
            theta, beta0=BETA, vertical=-0.5
        )
        stretch = (1 - 0.5 * math.sin(BETA)) * theta / (0.5 * math.cos(BETA))
        assert (ratio - 1) / stretch == pytest.approx(-5 / 12, rel=2 * stretch)


@pytest.mark.parametrize("vertical", [-0.5, -1.6])
def test_upright_period_has_a_relative_error_of_second_order(vertical):
    errors = []
    for gap in (0.08, 0.04, 0.02):
        theta0, beta0 = 0.3 * gap, math.pi / 2 - gap
        exact = linear_period(theta0, beta0=beta0, vertical=vertical)
        errors.append(abs(upright_period(theta0, beta0=beta0, vertical=vertical) / exact - 1))
    assert np.log2(np.array(errors[:-1]) / errors[1:]) == pytest.approx([2, 2], abs=0.05)


def peaks_and_periods(e, theta0, cycles):
    """Peaks at the start of each cycle and their spacing, from the exact piecewise-linear
    motion.
    """
    model, load = Metainterface(beta0=BETA), Load(vertical=-0.5)
    motion = linear_motion(
        System(model=model, load=load, impact=VelocityReduction(e)), theta0, 2 * cycles
    )
    tops, times = [theta0], [0.0]
    for n in range(2, 2 * cycles + 1, 2):
        arc = motion.arcs[n]
        t = arc.impact_time() / 2  # undamped: the arc is symmetric about its peak
        tops.append(arc.layer.side * arc.position(t))
        times.append(motion.impact_times[n - 1] + t)
    return np.array(tops), np.diff(times), motion


@pytest.mark.parametrize("e", [0.95, 0.8, 0.5])
def test_erratum_08_amplitudes_decay_as_e_to_the_4_n_minus_1(e):
    tops, spacings, motion = peaks_and_periods(e, 1e-7, 4)
    cycles = np.arange(1, 6)
    np.testing.assert_allclose(tops, decayed_amplitude(cycles, theta0=1e-7, e=e), rtol=1e-5)
    assert abs(tops[0] / (e**4 * 1e-7) - 1) > 0.2  # the printed e^(4n) is one cycle late
    # and theta is 0 at the printed instant
    assert motion(motion.impact_times[1])[0] == pytest.approx(0.0, abs=1e-20)
    period = linear_period(1e-7, beta0=BETA, vertical=-0.5)
    np.testing.assert_allclose(spacings, decayed_period(cycles[:-1], period=period, e=e), rtol=1e-5)


@pytest.mark.parametrize(("e", "decreasing"), [(0.8, False), (0.5, False), (0.4, True)])
def test_erratum_08_first_period_between_impacts_and_the_footnote(e, decreasing):
    motion = peaks_and_periods(e, 1e-7, 2)[2]
    period = linear_period(1e-7, beta0=BETA, vertical=-0.5)
    intervals = np.diff(np.concatenate([[0.0], motion.impact_times]))
    assert motion.impact_times[1] == pytest.approx((1 + 2 * e) * period / 4, rel=1e-5)
    if e != 0.5:
        assert (intervals[1] < intervals[0]) == decreasing
    assert intervals[3] < intervals[2]


@pytest.mark.parametrize("e", [0.9, 0.6, 0.0])
def test_final_time_is_the_sum_of_all_cycles(e):
    period = linear_period(1e-7, beta0=BETA, vertical=-0.5)
    end = final_time(period=period, e=e)
    if e > 0:
        assert end == pytest.approx(
            np.sum(decayed_period(np.arange(1, 400), period=period, e=e)), rel=1e-13
        )
        # what the last peak-to-peak sum leaves out vanishes: the impacts accumulate at the same
        # instant
        motion = linear_motion(
            System(
                model=Metainterface(beta0=BETA),
                load=Load(vertical=-0.5),
                impact=VelocityReduction(e),
            ),
            1e-7,
            150,
        )
        assert motion.impact_times[-1] == pytest.approx(end, rel=1e-5)
    else:
        assert end == pytest.approx(period / 4)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: linear_period(0.1, beta0=BETA, vertical=0.5), "stable only"),
        (lambda: linear_period(0.1, beta0=math.pi / 2, vertical=-1.5), "stable only"),
        (lambda: linear_period(0.1, beta0=80.0, vertical=-0.5), "degrees"),
        (lambda: short_period(0.1, beta0=math.pi / 2, vertical=-0.5), "below 0"),
        (lambda: upright_period(0.1, beta0=1.5, vertical=-1.0), "other than -1"),
        (lambda: upright_period(0.5, beta0=1.5, vertical=-1.5), "saddle"),
        (lambda: decayed_amplitude(0, theta0=0.1, e=0.8), "cycle must"),
        (lambda: decayed_period(1, period=1.0, e=1.2), "e must"),
        (lambda: final_time(period=1.0, e=1.0), "e must"),
        (
            lambda: vibrations(System(model=Metainterface(beta0=BETA), load=Load(vertical=-1.2))),
            "lower layer does not vibrate",
        ),
    ],
)
def test_refuses_what_is_out_of_range(call, message):
    with pytest.raises(ParameterError, match=message):
        call()
