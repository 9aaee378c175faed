"""The closed form of the impact oscillator's orbits: against SymPy, the matrix exponential, the
exact flow and its tangent.
"""

import math

import numpy as np
import pytest
import sympy as sp
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from scipy.linalg import expm
from scipy.optimize import minimize_scalar
from shared_systems import walled

import saltus
from saltus.errors import ParameterError
from saltus.systems import EnergyRestitution, Load, Metainterface, System, WallOscillator
from saltus.theory import wall_orbits

KNOWN = walled(W=1.0)  # k = d = 1, c = 0.1, e = 0.8
FOLDING = [  # the last one with two forcing periods from one impact to the next
    (KNOWN, 1),
    (walled(W=2.2, k=1.5, c=0.3, e=0.7), 1),
    (walled(W=3.2, wall=-0.5, mean=0.2), 1),
    (walled(W=2.6, wall=0.3, e=0.5), 2),
]
DOUBLING = [
    (walled(W=0.7, wall=0.5, e=0.6), 1),
    (walled(W=3.2, wall=-0.5, mean=0.2), 1),
    (walled(W=2.6, wall=0.3, e=0.5), 2),
]


def loaded(system, orbit):
    return system.with_({"load.force.amplitude": orbit.amplitude})


def flown(system, orbit, start=0.0, tangent=False):
    """The exact motion over one orbit from the closed form's state at the time `start`."""
    x, velocity = orbit.state(start)
    run = saltus.sensitivities if tangent else saltus.simulate
    arguments = {
        "x": float(x),
        "velocity": float(velocity),
        "time": start,
        "duration": orbit.family.duration,
    }
    return run(loaded(system, orbit), tol=1e-14, **arguments)


def away_from_impact(orbit):
    """A quarter of a period before an impact."""
    return orbit.impact_time + 0.75 * orbit.family.duration


@st.composite
def cases(draw):
    def number(low, high):
        return draw(st.floats(low, high))

    stiffness = number(0.3, 3.0)
    system = walled(
        k=stiffness,
        c=number(0.02, 0.9) * 2 * math.sqrt(stiffness),
        wall=number(-1.0, 1.0),
        W=number(0.5, 4.0),
        e=number(0.1, 1.0),
        mean=number(-0.5, 0.5),
        phase=number(-4.0, 4.0),
    )
    return system, draw(st.integers(1, 3)), number(0.05, 2.0)


@settings(deadline=None, max_examples=100)
@given(cases())
def test_one_impact_later_the_matrix_exponential_brings_the_state_back(case):
    """x, x', sin, cos and 1 obey one linear equation; its exponential knows nothing of the closed
    form.
    """
    system, period, speed = case
    orbit = wall_orbits(system, period).orbit(speed)
    model, load = system.model, loaded(system, orbit).load
    w, force = load.frequency, load.channels["force"]
    generator = np.zeros((5, 5))
    generator[0, 1] = 1.0
    generator[1] = [-model.stiffness, -model.damping, force.amplitude, 0.0, force.mean]
    generator[2, 3], generator[3, 2] = w, -w
    angle = w * orbit.impact_time + force.phase
    after = np.array([model.wall, -system.impact.e * speed, math.sin(angle), math.cos(angle), 1.0])
    back = expm(generator * orbit.family.duration) @ after
    assert back[:2] == pytest.approx([model.wall, speed], abs=1e-11 * (1 + force.amplitude))
    middle = expm(generator * 0.37 * orbit.family.duration) @ after
    state = orbit.state(orbit.impact_time + 0.37 * orbit.family.duration)
    assert middle[:2] == pytest.approx(np.array(state), abs=1e-11 * (1 + force.amplitude))


@settings(deadline=None, max_examples=60)
@given(cases())
def test_an_orbit_is_admissible_exactly_when_the_exact_flow_has_its_one_impact(case):
    system, period, speed = case
    orbit = wall_orbits(system, period).orbit(speed)
    assume(abs(orbit.clearance) > 1e-6)
    start = away_from_impact(orbit)
    x, velocity = orbit.state(start)
    if not orbit.admissible and x >= system.model.wall:
        return
    motion = flown(system, orbit, start)
    returned = math.hypot(motion.x - x, motion.velocity - velocity) < 1e-10 * (
        1 + np.abs(orbit.multipliers).max()
    )
    assert (returned and len(motion.impacts) == 1) == orbit.admissible


@pytest.mark.parametrize(("system", "period"), [*FOLDING, DOUBLING[0]])
def test_the_exact_flow_returns_and_has_the_impact_and_the_multipliers(system, period):
    family = wall_orbits(system, period)
    for speed in (0.8 * (family.fold_speed or 0.5), 2.0 * (family.fold_speed or 0.5)):
        orbit = family.orbit(speed)
        assert orbit.admissible
        start = away_from_impact(orbit)
        derived = flown(system, orbit, start, tangent=True)
        motion, (x, velocity) = derived.motion, orbit.state(start)
        assert (motion.x, motion.velocity) == pytest.approx((x, velocity), abs=1e-11)
        assert motion.impacts.velocity_before == pytest.approx([speed], abs=1e-11)
        away = (motion.impacts.time - orbit.impact_time) % (2 * math.pi / family.frequency)
        assert min(away[0], 2 * math.pi / family.frequency - away[0]) < 1e-11
        assert np.poly(derived.state) == pytest.approx(
            np.poly(orbit.multipliers), rel=1e-10, abs=1e-10
        )
        assert derived.determinant == pytest.approx(family.determinant, rel=1e-10)


def test_issue_4_grazing_and_fold():
    """Known from the literature's oscillator: GR at A = 0.1, LP at A = 0.0999707536."""
    family = wall_orbits(KNOWN)
    assert family.grazing_amplitude == pytest.approx(0.1, abs=1e-15)
    assert family.amplitude(family.fold_speed) == pytest.approx(0.0999707536, abs=5e-11)


@pytest.mark.parametrize(("system", "period"), FOLDING)
def test_at_the_fold_the_amplitude_is_least_two_speeds_meet_and_a_multiplier_is_1(system, period):
    family = wall_orbits(system, period)
    fold, least = family.fold_speed, family.amplitude(family.fold_speed)
    found = minimize_scalar(
        family.amplitude, bounds=(0, 3 * fold), method="bounded", options={"xatol": 1e-10 * fold}
    )
    assert found.x == pytest.approx(fold, rel=1e-5)
    assert found.fun == pytest.approx(least, rel=1e-12)
    assert family.speeds(least * (1 - 1e-9)) == ()
    below, above = family.speeds(least + 0.5 * (family.grazing_amplitude - least))
    assert below + above == pytest.approx(2 * fold, rel=1e-12)
    assert np.abs(family.multipliers(fold) - 1).min() < 1e-9
    assert not family.orbit(0.9 * fold).stable
    assert len(family.speeds(family.grazing_amplitude * (1 + 1e-9))) == 1


@pytest.mark.parametrize(("system", "period"), DOUBLING)
def test_at_the_doubling_the_exact_flow_has_a_multiplier_of_minus_1(system, period):
    family = wall_orbits(system, period)
    orbit = family.orbit(family.doubling_speed)
    assert orbit.admissible
    derived = flown(system, orbit, away_from_impact(orbit), tangent=True)
    assert np.abs(np.linalg.eigvals(derived.state) + 1).min() < 1e-9
    assert {family.orbit(f * family.doubling_speed).stable for f in (0.99, 1.01)} == {True, False}


@pytest.mark.parametrize(("index", "beyond"), [(0, 0.97), (1, 1.03), (2, 1.03)])
def test_beyond_the_doubling_the_flow_settles_on_two_impacts_that_alternate(index, beyond):
    system, period = DOUBLING[index]
    family = wall_orbits(system, period)
    for factor, alternates in ((beyond, True), (2 - beyond, False)):
        orbit = family.orbit(factor * family.doubling_speed)
        assert orbit.stable != alternates
        x, velocity = orbit.state(0.0)
        motion = saltus.simulate(
            loaded(system, orbit),
            x=float(x) - 1e-5,
            velocity=float(velocity),
            periods=3000,
            dense=False,
        )
        speeds = motion.impacts.velocity_before[-4:] / orbit.speed
        assert speeds[:2] == pytest.approx(speeds[2:], abs=1e-8)
        assert (abs(speeds[1] - speeds[0]) > 0.01) == alternates
        assert (speeds == pytest.approx([1.0] * 4, abs=1e-8)) != alternates


@settings(deadline=None, max_examples=100)
@given(cases())
def test_speeds_are_the_inverse_of_the_amplitude(case):
    system, period, speed = case
    family = wall_orbits(system, period)
    amplitude = family.amplitude(speed)
    speeds = family.speeds(amplitude)
    assume(family.fold_speed is None or abs(speed / family.fold_speed - 1) > 1e-3)
    assert min(abs(v - speed) for v in speeds) < 1e-9 * (1 + speed)
    assert [family.amplitude(v) for v in speeds] == pytest.approx(
        [amplitude] * len(speeds), rel=1e-12
    )


def test_another_grazing_ends_the_admissible_orbits():
    """Two forcing periods an impact: once the maximum between impacts reaches the wall, the exact
    flow has its impact there.
    """
    family = wall_orbits(walled(W=0.7, wall=0.5, e=0.6), 2)
    speeds = np.linspace(0.05, 1.5, 30)
    clear = np.array([family.orbit(v).clearance for v in speeds])
    assert clear.max() > 1e-3
    assert clear.min() < -1e-3
    for speed, room in zip(speeds, clear, strict=True):
        orbit = family.orbit(speed)
        motion = flown(walled(W=0.7, wall=0.5, e=0.6), orbit, orbit.impact_time + 1e-3)
        first = motion.impacts.time[0] - orbit.impact_time
        assert (first == pytest.approx(family.duration, abs=1e-9)) == (room > 0)
        assert room > 0 or first < 0.9 * family.duration


def test_the_energy_restitution_of_a_wall_is_a_factor_of_the_velocity():
    by_energy = wall_orbits(
        System(model=KNOWN.model, load=KNOWN.load, impact=EnergyRestitution(0.64))
    )
    assert by_energy.fold_speed == pytest.approx(wall_orbits(KNOWN).fold_speed, rel=1e-12)


def symbols_of_the_family():
    """The docstring's quantities from Phi = e^(-c t / 2) [...], with C, S and E for its cosine,
    sine and exponential.
    """
    k, c, d, big, e, v, cosine, sine, shrink, w = sp.symbols(
        "k c d Omega e v C S E w", positive=True
    )
    phi = shrink * sp.Matrix(
        [[cosine + c * sine / (2 * w), sine / w], [-k * sine / w, cosine - c * sine / (2 * w)]]
    )
    det, trace = shrink**2, 2 * shrink * cosine
    delta = 1 - trace + det
    alpha, beta = -(1 + e) * phi[0, 1] / delta, (1 + e) * (det - phi[1, 1]) / delta
    circle = {cosine**2: 1 - sine**2, k: w**2 + c**2 / 4}
    return (
        k,
        c,
        d,
        big,
        e,
        v,
        phi,
        det,
        trace,
        delta,
        alpha,
        beta,
        lambda x: sp.simplify(zero_on_circle(x, cosine, sine, circle[k], k)),
    )


def zero_on_circle(expression, cosine, sine, stiffness, k):
    """The numerator, with k = w^2 + c^2 / 4 and C^2 = 1 - S^2."""
    numerator = sp.expand(sp.numer(sp.together(expression.subs(k, stiffness))))
    return sp.rem(numerator, cosine**2 + sine**2 - 1, cosine)


def test_the_derivation_in_symbols():
    k, c, d, big, e, v, phi, det, trace, delta, alpha, beta, vanishes = symbols_of_the_family()
    before = v * sp.Matrix([alpha, beta])
    for row in before - phi * (before - sp.Matrix([0, (1 + e) * v])):
        assert vanishes(row) == 0
    gamma = (1 - beta) / big
    square = (d - alpha * v) ** 2 + gamma**2 * v**2  # (A / Z)^2
    # the acceleration at the impact, from the steady response's own equation: F = P'' + c P' + k P
    position, velocity = d - alpha * v, (1 - beta) * v
    force = (k - big**2) * position + c * velocity
    a_old, a_new = force - c * v - k * d, force + c * e * v - k * d
    saltation = sp.Matrix([[-e, 0], [(a_new + e * a_old) / v, -e]])
    monodromy = phi * saltation
    stated = -e * trace + alpha * delta * (big**2 * d / v - (c * (1 - beta) - (k - big**2) * alpha))
    assert vanishes(monodromy.trace() - stated) == 0
    assert vanishes(monodromy.trace() - stated + e * det) != 0  # the simplification is not blind
    assert vanishes(monodromy.det() - e**2 * det) == 0
    # a multiplier of 1 and dA/dv = 0 are one condition: 1 - trace + det is the slope of A^2, up to
    # a factor without zeros
    fold = alpha * d / (alpha**2 + gamma**2)
    assert sp.simplify(sp.diff(square, v).subs(v, fold)) == 0
    assert (
        vanishes(
            sp.together((1 - stated + e**2 * det) * v - sp.diff(square, v) / 2 * big**2 * delta)
        )
        == 0
    )


def test_the_saltation_matrix_is_the_first_order_of_the_moved_impact():
    """Neighbours meet the wall at dt = -u / v; both sides of the impact expanded to first order in
    a small h.
    """
    h, u, du, e, v, a, b = sp.symbols("h u du e v a b")  # a, b: accelerations before and after
    dt = -u / v
    reached = (v + h * du) + a * h * dt  # its velocity when it gets to the wall
    # carried back to the reference's instant
    back_position = 0 - (-e * reached) * h * dt + b * (h * dt) ** 2 / 2
    back_velocity = -e * reached - b * h * dt
    linear = [
        sp.series(f, h, 0, 2).removeO().coeff(h, 1)
        for f in (sp.expand(back_position), sp.expand(back_velocity))
    ]
    expected = sp.Matrix([[-e, 0], [(b + e * a) / v, -e]]) * sp.Matrix([u, du])
    assert sp.simplify(sp.Matrix(linear) - expected) == sp.zeros(2, 1)


@pytest.mark.parametrize(
    ("system", "period", "message"),
    [
        (System(model=Metainterface(beta0=1.4)), 1, "WallOscillator"),
        (System(model=WallOscillator(), load=Load(force=0.3)), 1, "one Harmonic"),
        (walled(W=1.0, c=2.5), 1, "below critical"),
        (walled(W=1.0, c=0.0), 1, "resonance"),
        (walled(W=2.0, c=0.0), 2, "resonance"),
        (walled(W=1.0), 0, "whole number"),
        (walled(W=1.0), 1.5, "whole number"),
    ],
)
def test_refuses_what_has_no_such_orbits(system, period, message):
    with pytest.raises(ParameterError, match=message):
        wall_orbits(system, period)


def test_a_speed_of_zero_is_a_grazing_and_no_orbit():
    with pytest.raises(ParameterError, match="grazes"):
        wall_orbits(KNOWN).orbit(0.0)
