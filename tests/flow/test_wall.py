"""The wall oscillator x'' + c x' + k x = A cos(w t), v+ = -e v- at x = d: its motion with one
impact per period, in closed form.

Let the impacts be at t0 + n T, T = 2 pi / w, each with speed v > 0 before it. On [0, T], s = t -
t0, the motion is p(s) + y(s):

* p(s) = P cos(w s + a), P = A / sqrt((k - w^2)^2 + c^2 w^2), the steady response, with a = w t0 -
  atan2(c w, k - w^2);
* y(s) = exp(-c s / 2) (D cos n s + B sin n s), n^2 = k - c^2 / 4, the free part.

Since p has the period T, the conditions x = d at both ends, x'(0) = -e v and x'(T) = v are a linear
two-point problem for y:

    y(0) = y(T) = D = d - p(0),  y'(0) = -e v - p'(0),  y'(T) = v - p'(0).

y(T) = D gives B = D (exp(c T / 2) - cos n T) / sin n T, hence y'(0) = g0 D, y'(T) = g1 D with

    g0 = -c/2 + n B/D,  g1 = -c/2 + n exp(-c T / 2) ((B/D) cos n T - sin n T),

and the difference of the last two conditions is D = q v, q = (1 + e) / (g1 - g0). So p(0) = d - q
v, p'(0) = -(e + g0 q) v and p(0)^2 + (p'(0) / w)^2 = P^2 is a quadratic in the impact speed,

    (q^2 + (e + g0 q)^2 / w^2) v^2 - 2 d q v + d^2 - P^2 = 0;

the phase follows from P cos a = p(0), -w P sin a = p'(0). A root is a motion if v > 0 and x < d
between the impacts.
"""

import math

import numpy as np
import pytest

from saltus.flow import simulate
from saltus.systems import Harmonic, Load, System, VelocityReduction, WallOscillator


def one_impact_orbits(*, A, w, k=1.0, c=0.1, d=1.0, e=0.8):
    """(impact speed, w t0 in [0, 2 pi)) of each root of the quadratic with v > 0 and x < d between
    the impacts.
    """
    T, n, P = 2 * math.pi / w, math.sqrt(k - c * c / 4), A / math.hypot(k - w * w, c * w)
    ratio = (math.exp(c * T / 2) - math.cos(n * T)) / math.sin(n * T)
    g0 = -c / 2 + n * ratio
    g1 = -c / 2 + n * math.exp(-c * T / 2) * (ratio * math.cos(n * T) - math.sin(n * T))
    q = (1 + e) / (g1 - g0)
    slope = e + g0 * q
    found = []
    for v in np.roots([q * q + (slope / w) ** 2, -2 * d * q, d * d - P * P]):
        if np.iscomplex(v) or v.real <= 0:
            continue
        v = float(v.real)
        angle = math.atan2(slope * v / w, d - q * v)
        s = np.linspace(0, T, 4001)[1:-1]
        free = q * v * np.exp(-c * s / 2) * (np.cos(n * s) + ratio * np.sin(n * s))
        if (P * np.cos(w * s + angle) + free < d).all():
            found.append((v, (angle + math.atan2(c * w, k - w * w)) % (2 * math.pi)))
    return found


def oscillator(*, A, w, k=1.0, c=0.1, d=1.0, e=0.8):
    """F = A cos(w t), as a sine of phase pi / 2."""
    load = Load(frequency=w, force=Harmonic(amplitude=A, phase=math.pi / 2))
    return System(
        model=WallOscillator(stiffness=k, damping=c, wall=d), load=load, impact=VelocityReduction(e)
    )


def test_the_steady_impacts_have_the_speed_and_the_phase_of_the_closed_form():
    motion = simulate(oscillator(A=0.2, w=1.0), x=0.0, velocity=0.0, periods=300, tol=1e-14)
    ((speed, phase),) = one_impact_orbits(A=0.2, w=1.0)
    assert speed == pytest.approx(0.2986128521, abs=1e-10)
    assert motion.impacts.velocity_before[-1] == pytest.approx(speed, abs=1e-12)
    assert motion.impacts.time[-1] % (2 * math.pi) == pytest.approx(phase, abs=1e-10)


STEADY = [
    {"A": 0.5, "w": 1.0},
    {"A": 2.0, "w": 1.3},
    {"A": 0.25, "w": 0.93, "e": 0.5},
    {"A": 3.0, "w": 1.7, "c": 0.3, "e": 0.7},
    {"A": 1.0, "w": 2.2, "d": 0.1, "e": 0.6},
    {"A": 1.0, "w": 1.4, "k": 0.5, "c": 0.05, "d": 0.3, "e": 0.4},
    {"A": 0.9, "w": 2.0, "d": 0.0, "e": 0.8},
]


@pytest.mark.parametrize("numbers", STEADY)
def test_a_start_on_a_closed_form_orbit_returns_after_each_period(numbers):
    orbits = one_impact_orbits(**numbers)
    assert orbits
    for speed, phase in orbits:
        w, d, e = numbers["w"], numbers.get("d", 1.0), numbers.get("e", 0.8)
        start = phase / w
        motion = simulate(
            oscillator(**numbers),
            x=d,
            velocity=-e * speed,
            time=start,
            duration=2.5 * 2 * math.pi / w,
            tol=1e-15,
        )
        assert len(motion.impacts) == 2
        np.testing.assert_allclose(motion.impacts.velocity_before, speed, atol=2e-12)
        np.testing.assert_allclose(
            motion.impacts.time - start, np.array([1, 2]) * 2 * math.pi / w, atol=2e-12
        )


def test_a_start_into_the_wall_begins_with_its_impact():
    motion = simulate(oscillator(A=0.2, w=1.0), x=1.0, velocity=0.7, duration=0.1)
    assert motion.impacts.time[0] == 0.0
    assert motion.impacts.velocity_before[0] == 0.7
    assert motion.impacts.velocity_after[0] == -0.8 * 0.7


def test_before_any_impact_the_motion_is_that_of_the_linear_oscillator():
    A, w, k, c = 0.2, 1.3, 1.1, 0.15
    motion = simulate(
        oscillator(A=A, w=w, k=k, c=c, d=50.0), x=0.4, velocity=-0.3, duration=40.0, tol=1e-15
    )
    P, lag, n = (
        A / math.hypot(k - w * w, c * w),
        math.atan2(c * w, k - w * w),
        math.sqrt(k - c * c / 4),
    )
    D = 0.4 - P * math.cos(lag)
    B = (-0.3 - w * P * math.sin(lag) + c / 2 * D) / n
    t = np.linspace(0, 40, 333)
    exact = P * np.cos(w * t - lag) + np.exp(-c * t / 2) * (D * np.cos(n * t) + B * np.sin(n * t))
    assert len(motion.impacts) == 0
    np.testing.assert_allclose(motion.at(t)[0], exact, atol=2e-14)
