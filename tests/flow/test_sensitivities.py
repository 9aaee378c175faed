"""Derivatives of the end state and of the event times against differences of 30-digit motions, and
against closed forms.
"""

import math

import mpmath as mp
import numpy as np
import pytest
from flow_references import SHARED_PATHS, PreciseSystem
from shared_systems import BETA80, forced

import saltus
from saltus.systems import Harmonic, Load, System, VelocityReduction, WallOscillator

pytestmark = pytest.mark.thorough  # many structures of their own

STEP = mp.mpf(10) ** -7  # of differences of second order, of motions to 22 digits
PATHS = {
    "H": "load.horizontal.amplitude",
    "mean": "load.horizontal.mean",
    "phase": "load.horizontal.phase",
    "W": "load.frequency",
    "V": "load.vertical",
    "C": "model.damping",
    "beta0": "model.beta0",
    "k": "model.stiffness_ratio",
    "m": "model.mass_ratio",
    "c": "model.dissipation_ratio",
    "e": "impact.e",
}
UNEQUAL = {
    "beta0": 1.2,
    "C": 0.15,
    "m": 0.4,
    "k": 1.3,
    "c": 0.7,
    "V": -0.6,
    "H": 0.7,
    "mean": 0.1,
    "phase": 0.3,
    "W": 1.7,
    "e": 0.9,
}
PAPER = {
    "beta0": BETA80,
    "C": 0.1,
    "m": 0.0,
    "k": 1.0,
    "c": 1.0,
    "V": -0.5,
    "H": 0.5,
    "mean": 0.0,
    "phase": 0.0,
    "W": 1.0,
    "e": 1.0,
}
TENSION = {
    "beta0": 1.4,
    "C": 0.05,
    "m": 0.0,
    "k": 0.8,
    "c": 1.4,
    "V": 0.2,
    "H": 0.6,
    "mean": -0.05,
    "phase": -1.0,
    "W": 0.6,
    "e": 1.0,
}


def precise(numbers, start, periods, duration):
    """The end state and the times of the impacts."""
    numbers = dict(numbers)
    e = numbers.pop("e")
    until = mp.mpf(duration) if periods is None else periods * 2 * mp.pi / mp.mpf(numbers["W"])
    motion = PreciseSystem(**numbers, factors=(e, e)).run(*start, until, order=22, tol="1e-22")
    return np.array([*motion.state, *(t for t, *_ in motion.impacts)])


def difference(function, value):
    """Of second order; its error is of order STEP^2."""
    value = mp.mpf(value)
    return ((function(value + STEP) - function(value - STEP)) / (2 * STEP)).astype(float)


def check(result, columns, tol=1e-9):
    """Every column, relative to its largest entry; the impacts are all the events."""
    computed = np.vstack([np.hstack([result.state, result.parameters]), result.event_times])
    assert computed.shape == columns.shape
    error = np.abs(computed - columns) / np.abs(columns).max(axis=0)
    assert error.max() < tol, error.max(axis=0)


@pytest.mark.parametrize(
    ("numbers", "start", "impacts", "length"),
    [
        (PAPER, (0.3, 0.0), 3, {"periods": 2}),
        (UNEQUAL, (0.4, -0.2), 3, {"duration": 10.0}),
        (UNEQUAL, (0.0, 0.8), 2, {"periods": 2}),
        (TENSION, (-0.7, 0.1), 2, {"duration": 8.0}),
    ],
)
def test_all_derivatives_are_those_of_a_30_digit_motion(numbers, start, impacts, length):
    span = (length.get("periods"), length.get("duration"))
    with mp.workdps(30):
        columns = [
            (
                difference(lambda x: precise(numbers, (x, start[1]), *span), start[0])
                if start[0]
                else None
            ),
            difference(lambda v: precise(numbers, (start[0], v), *span), start[1]),
            *(
                difference(
                    lambda p, name=name: precise({**numbers, name: p}, start, *span), numbers[name]
                )
                for name in PATHS
            ),
        ]
    result = saltus.sensitivities(
        forced(**numbers),
        theta=start[0],
        velocity=start[1],
        **length,
        parameters=tuple(PATHS.values()),
        tol=1e-12,
    )
    assert result.parameter_paths == tuple(PATHS.values())
    assert result.undefined is None
    assert len(result.motion.impacts) >= impacts
    if start[0]:
        check(result, np.array(columns).T)
    else:  # at contact the reference has no motions on the other side: without the first column
        computed = np.vstack([np.hstack([result.state, result.parameters]), result.event_times])[
            :, 1:
        ]
        expected = np.array(columns[1:]).T
        assert (np.abs(computed - expected) / np.abs(expected).max(axis=0)).max() < 1e-9


class PreciseWall:
    """x'' + c x' + k x = F sin(W t) before a wall at d, v+ = -e v-: closed forms between impacts,
    by variation of constants.
    """

    def __init__(self, *, k, c, d, F, W, e):
        self.k, self.c, self.d, self.F, self.W, self.e = map(mp.mpf, (k, c, d, F, W, e))

    def particular(self, t, order=0):
        response = self.F / (self.k - self.W**2 + 1j * self.c * self.W) * (1j * self.W) ** order
        return mp.im(response * mp.expj(self.W * t))

    def flight(self, t0, x0, v0):
        """x and v as functions of t."""
        rate, angular = -self.c / 2, mp.sqrt(self.k - self.c**2 / 4)
        a = x0 - self.particular(t0)
        b = (v0 - self.particular(t0, 1) - rate * a) / angular

        def state(t):
            s, decay = angular * (t - t0), mp.exp(rate * (t - t0))
            x = decay * (a * mp.cos(s) + b * mp.sin(s))
            v = rate * x + decay * angular * (b * mp.cos(s) - a * mp.sin(s))
            return self.particular(t) + x, self.particular(t, 1) + v

        return state

    def run(self, x, v, until, guesses):
        """With the times of the impacts known roughly."""
        t, times = mp.mpf(0), []
        for guess in guesses:
            flight = self.flight(t, x, v)
            t = mp.findroot(lambda s, flight=flight: flight(s)[0] - self.d, mp.mpf(guess))
            times.append(t)
            x, v = self.d, -self.e * flight(t)[1]
        return np.array([*self.flight(t, x, v)(mp.mpf(until)), *times])


def test_the_wall_s_place_and_law_and_the_oscillator_s_numbers():
    numbers = {"k": 1.3, "c": 0.1, "d": 0.4, "F": 0.9, "W": 1.7, "e": 0.8}
    paths = (
        "model.stiffness",
        "model.damping",
        "model.wall",
        "load.force.amplitude",
        "load.frequency",
        "impact.e",
    )
    system = System(
        model=WallOscillator(stiffness=1.3, damping=0.1, wall=0.4),
        load=Load(frequency=1.7, force=Harmonic(0.9)),
        impact=VelocityReduction(0.8),
    )
    start, duration = (-0.5, 0.3), 15.0
    result = saltus.sensitivities(
        system, x=start[0], velocity=start[1], duration=duration, parameters=paths
    )
    guesses = result.motion.impacts.time
    assert len(guesses) >= 4
    with mp.workdps(30):
        columns = [
            difference(
                lambda x: PreciseWall(**numbers).run(x, mp.mpf(start[1]), duration, guesses),
                start[0],
            ),
            difference(
                lambda v: PreciseWall(**numbers).run(mp.mpf(start[0]), v, duration, guesses),
                start[1],
            ),
            *(
                difference(
                    lambda p, n=name: PreciseWall(**{**numbers, n: p}).run(
                        mp.mpf(start[0]), mp.mpf(start[1]), duration, guesses
                    ),
                    numbers[name],
                )
                for name in numbers
            ),
        ]
    check(result, np.array(columns).T)


def test_the_start_counts_in_the_derivative_to_the_frequency():
    """From time t0 on H(t) = H sin(W t): W moves the phase at the start as well, by t0 a unit of
    W.
    """
    t0, system = 12345.678, forced(H=0.5, W=1.3)
    late = saltus.sensitivities(
        system, theta=0.3, duration=9.0, time=t0, parameters=("load.frequency",), tol=1e-14
    )
    phase = math.fmod(1.3 * t0, 2 * math.pi)
    early = saltus.sensitivities(
        forced(H=0.5, W=1.3, phase=phase),
        theta=0.3,
        duration=9.0,
        parameters=SHARED_PATHS,
        tol=1e-14,
    )
    frequency, start = (
        early.parameters[:, SHARED_PATHS.index(p)]
        for p in ("load.frequency", "load.horizontal.phase")
    )
    np.testing.assert_allclose(late.parameters[:, 0], frequency + t0 * start, rtol=1e-10)
    np.testing.assert_allclose(late.state, early.state, rtol=1e-10, atol=1e-10)


def test_the_end_of_a_motion_of_so_many_periods_moves_with_the_frequency():
    system = forced(H=0.5, W=1.3)
    whole = saltus.sensitivities(
        system, theta=0.3, periods=4, parameters=("load.frequency",), tol=1e-14
    )
    fixed = saltus.sensitivities(
        system, theta=0.3, duration=whole.motion.time, parameters=("load.frequency",), tol=1e-14
    )
    acceleration = system.model.acceleration(
        whole.motion.time, whole.motion.theta, whole.motion.velocity, whole.motion.side, system.load
    )
    moved = -2 * math.pi * 4 / 1.3**2 * np.array([whole.motion.velocity, acceleration])
    np.testing.assert_allclose(whole.parameters[:, 0] - fixed.parameters[:, 0], moved, rtol=1e-11)
    np.testing.assert_allclose(whole.event_times, fixed.event_times, rtol=1e-12)


def test_the_derivative_of_two_stretches_is_the_product_of_theirs():
    system = forced(H=0.5, m=0.3, e=0.9)
    first = saltus.sensitivities(system, theta=0.3, velocity=0.1, duration=7.0, tol=1e-14)
    then = saltus.sensitivities(
        system,
        theta=first.motion.theta,
        velocity=first.motion.velocity,
        time=7.0,
        duration=6.0,
        tol=1e-14,
    )
    whole = saltus.sensitivities(system, theta=0.3, velocity=0.1, duration=13.0, tol=1e-14)
    np.testing.assert_allclose(then.state @ first.state, whole.state, rtol=1e-11, atol=1e-11)


def test_mirror_motions_have_mirror_derivatives():
    system = forced(H=0.5, mean=0.05, phase=0.4)
    one = saltus.sensitivities(system, theta=0.3, velocity=-0.2, periods=4, parameters=SHARED_PATHS)
    other = saltus.sensitivities(
        system.mirrored(), theta=-0.3, velocity=0.2, periods=4, parameters=SHARED_PATHS
    )
    assert one.motion.theta == -other.motion.theta
    signs = np.array([1, -1, -1, -1, -1, -1])  # -H is what the mirrored system has for H
    np.testing.assert_allclose(other.state, one.state, rtol=1e-12)
    np.testing.assert_allclose(other.parameters, one.parameters * signs, rtol=1e-12)
    np.testing.assert_allclose(other.event_times, one.event_times * [-1, -1, *-signs], rtol=1e-12)


def test_the_motion_is_that_of_simulate_to_rounding():
    """The series of both are loops of their own, which may round sums in another order."""
    system = forced(H=0.5, m=0.3, e=0.9)
    plain = saltus.simulate(system, theta=0.3, velocity=0.1, periods=20)
    motion = saltus.sensitivities(
        system, theta=0.3, velocity=0.1, periods=20, parameters=("load.frequency",)
    ).motion
    near = {"rtol": 0.0, "atol": 1e-13}  # of numbers up to 126
    np.testing.assert_allclose(
        (motion.theta, motion.velocity), (plain.theta, plain.velocity), **near
    )
    assert len(motion.impacts) == len(plain.impacts)
    np.testing.assert_allclose(motion.impacts.time, plain.impacts.time, **near)
    times = np.linspace(0.0, motion.time, 100)
    np.testing.assert_allclose(motion.at(times)[0], plain.at(times)[0], **near)


@pytest.mark.parametrize("tol", [1e-6, 1e-8, 1e-10, 1e-12])
def test_the_error_follows_the_tolerance(tol):
    system = forced(H=0.5)
    best = saltus.sensitivities(system, theta=0.3, periods=5, parameters=SHARED_PATHS, tol=1e-15)
    result = saltus.sensitivities(system, theta=0.3, periods=5, parameters=SHARED_PATHS, tol=tol)
    for name in ("state", "parameters", "event_times"):
        computed, exact = getattr(result, name), getattr(best, name)
        assert np.abs(computed - exact).max() < 1e3 * tol * np.abs(exact).max()


def test_at_an_equilibrium_the_tangent_sets_the_steps():
    """x'' + c x' + k x = F at x = F / k: the motion is constant, and its tangent the exponential of
    a matrix.
    """
    from scipy.linalg import expm

    load = Load(force=0.3)
    system = System(model=WallOscillator(stiffness=1.0, damping=0.1, wall=1.0), load=load)
    result = saltus.sensitivities(system, x=0.3, duration=50.0, parameters=("load.force",))
    exact = expm(50.0 * np.array([[0.0, 1.0], [-1.0, -0.1]]))
    np.testing.assert_allclose(result.state, exact, rtol=0, atol=1e-11)
    np.testing.assert_allclose(
        result.parameters[:, 0], (np.eye(2) - exact) @ [1.0, 0.0], atol=1e-11
    )
