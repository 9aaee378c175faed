"""The piecewise-linear motion impact by impact, against the paper's formula in 40 digits and SciPy
with restarts.
"""

import math

import mpmath as mp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from theory_references import integrate, linear_acceleration

from saltus.errors import ParameterError
from saltus.systems import EnergyRestitution, Load, Metainterface, System, VelocityReduction
from saltus.theory import linear_motion


def cell(degrees=80, vertical=-0.5, e=1.0, law=None, h=0.0, **model):
    impact = law or VelocityReduction(e)
    return System(
        model=Metainterface(beta0=math.radians(degrees), **model),
        load=Load(vertical=vertical, horizontal=h),
        impact=impact,
    )


def paper_solution(system, theta0, impacts):
    """`linsol_theta1` as printed, its constants A_i, B_i fitted at each impact and its zeros found
    in 40 digits.
    """
    model = system.model
    with mp.workdps(40):
        b, v, k, m, damping = (
            mp.mpf(x)
            for x in (
                model.beta0,
                system.load.vertical(0),
                model.stiffness_ratio,
                model.mass_ratio,
                model.damping,
            )
        )
        start, position, velocity, times = mp.mpf(0), mp.mpf(theta0), mp.mpf(0), []
        sign0 = 1 if theta0 > 0 else -1
        for i in range(impacts):
            p = (3 - (-1) ** i * sign0) // 2
            kappa, mass = k ** (2 - p) + v * mp.sin(b), (1 + m) ** (2 - p)
            omega, mu = mp.sqrt(kappa / mass), damping / (2 * mp.sqrt(mass * kappa))
            w, rest = mp.sqrt(1 - mu**2) * omega, (-1) ** i * sign0 * v * mp.cos(b) / kappa
            decay = mp.exp(-mu * omega * start)
            cosine, sine = mp.cos(w * start), mp.sin(w * start)
            matrix = mp.matrix(
                [
                    [decay * cosine, decay * sine],
                    [
                        decay * (-mu * omega * cosine - w * sine),
                        decay * (-mu * omega * sine + w * cosine),
                    ],
                ]
            )
            a_i, b_i = mp.lu_solve(matrix, mp.matrix([position - rest, velocity]))

            def theta(t, a_i=a_i, b_i=b_i, mu=mu, omega=omega, w=w, rest=rest):
                return mp.exp(-mu * omega * t) * (a_i * mp.cos(w * t) + b_i * mp.sin(w * t)) + rest

            scan = [start + mp.mpf(1.03) ** n * mp.mpf(1e-5) for n in range(450)]
            inside = mp.sign(theta(scan[0]))
            n = next(n for n, t in enumerate(scan) if mp.sign(theta(t)) != inside)
            root = mp.findroot(theta, (scan[n - 1], scan[n]), solver="anderson", tol=1e-60)
            position, velocity = mp.mpf(0), mp.mpf(system.impact.e) * mp.diff(theta, root)
            start = root
            times.append(float(root))
    return np.array(times), float(velocity)


@pytest.mark.parametrize("theta0", [0.3, pytest.param(-0.3, marks=pytest.mark.thorough), 1e-4])
@pytest.mark.parametrize(
    "system",
    [
        cell(),
        cell(e=0.8, damping=0.1),
        cell(60, -0.9, 0.9, damping=0.3, stiffness_ratio=2.0, mass_ratio=0.5),
    ],
    ids=["conservative", "lossy", "unequal"],
)
def test_impacts_are_the_zeros_of_the_printed_solution(system, theta0):
    """`linsol_theta1` has c^P = 1; every impact to a few units in the last place of the 40-digit
    ones.
    """
    motion = linear_motion(system, theta0, 12)
    times, last = paper_solution(system, theta0, 12)
    np.testing.assert_allclose(motion.impact_times, times, rtol=2e-14)
    assert motion.velocity_after[-1] == pytest.approx(last, rel=1e-12)


@settings(deadline=None, max_examples=25)
@given(
    st.floats(20, 160).filter(lambda d: abs(d - 90) > 3),
    st.floats(0.1, 0.9),
    st.floats(0.3, 1),
    st.floats(0, 0.2),
    st.floats(0, 2),
    st.floats(0.5, 3),
    st.floats(0, 2),
    st.floats(0.01, 0.5),
    st.sampled_from([1, -1]),
    st.floats(-0.5, 0.5),
)
def test_agrees_with_scipy_for_random_layers(
    degrees, load, e, damping, c, k, m, theta0, sign, share
):
    vertical = -load * 0.5 * math.copysign(1, math.cos(math.radians(degrees)))
    h = 0.5 * share * abs(vertical / math.tan(math.radians(degrees)))
    system = cell(
        degrees,
        vertical,
        e,
        h=h,
        damping=damping,
        dissipation_ratio=c,
        stiffness_ratio=k,
        mass_ratio=m,
    )
    mine = linear_motion(system, sign * theta0, 5)
    scipy = integrate(system, sign * theta0, impacts=5, acceleration=linear_acceleration(system))
    np.testing.assert_allclose(mine.impact_times, scipy.impact_times, rtol=1e-9)
    np.testing.assert_allclose(mine.velocity_before, scipy.before, rtol=1e-8)
    np.testing.assert_allclose(mine.velocity_after, scipy.after, rtol=1e-8)


def test_is_continuous_in_angle_and_loses_e_in_velocity():
    system = cell(e=0.7, damping=0.1)
    motion = linear_motion(system, -0.4, 6)
    np.testing.assert_allclose(motion.velocity_after, 0.7 * motion.velocity_before)
    theta, velocity = motion(motion.impact_times)
    np.testing.assert_allclose(theta, 0.0, atol=1e-16)
    np.testing.assert_allclose(velocity, motion.velocity_after)
    before = motion(np.nextafter(motion.impact_times, 0))
    np.testing.assert_allclose(before[0], 0.0, atol=1e-15)
    np.testing.assert_allclose(before[1], motion.velocity_before, rtol=1e-12)


def test_solves_its_equation_between_impacts():
    system = cell(70, -0.6, e=0.9, h=0.05, damping=0.2, stiffness_ratio=1.5, mass_ratio=0.5)
    motion = linear_motion(system, 0.3, 4)
    ends = np.concatenate([[0.0], motion.impact_times])
    for t in (ends[1:] + ends[:-1]) / 2:
        d = 1e-4
        (left, here, right), (_, velocity, _) = motion(np.array([t - d, t, t + d]))
        side = 1 if here > 0 else -1
        assert (left - 2 * here + right) / d**2 == pytest.approx(
            linear_acceleration(system)(t, here, velocity, side), abs=1e-6
        )


def test_energy_restitution_runs_through_the_same_law():
    motion = linear_motion(cell(law=EnergyRestitution(1.0), mass_ratio=3.0), 0.2, 4)
    np.testing.assert_allclose(
        motion.velocity_after / motion.velocity_before, [2.0, 0.5, 2.0, 0.5], rtol=1e-13
    )


def test_ends_where_a_layer_stays_open_and_where_an_impact_stops_it():
    settled = linear_motion(cell(h=0.3, damping=0.2), 0.1, 5)
    assert settled.impact_times.size == 0
    assert settled.end == math.inf
    centre = (0.3 * math.sin(math.radians(80)) - 0.5 * math.cos(math.radians(80))) / (
        1 - 0.3 * math.cos(math.radians(80)) - 0.5 * math.sin(math.radians(80))
    )
    assert settled(400.0)[0] == pytest.approx(centre)
    stopped = linear_motion(cell(e=0.0), 0.1, 5)
    assert stopped.impact_times.size == 1
    assert stopped(100.0) == (0.0, 0.0)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: linear_motion(cell(damping=3.0), 0.1, 3), "subcritical"),
        (lambda: linear_motion(cell(vertical=-1.2), 0.1, 3), "does not vibrate"),
        (lambda: linear_motion(cell(), 0.0, 3), "theta0 must not be 0"),
        (lambda: linear_motion(cell(), 0.1, 0), "impacts must lie in"),
        (lambda: linear_motion(cell(), 0.1, 2)(100.0), "ask for more impacts"),
        (lambda: linear_motion(cell(), 0.1, 2)(-1.0), "tau must lie"),
    ],
)
def test_refuses_what_is_out_of_range(call, message):
    with pytest.raises(ParameterError, match=message):
        call()
