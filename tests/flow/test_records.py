"""Records of samples as loads: forces and ground motions, before, within and after their span, with
and without harmonics.
"""

import itertools
import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import pytest
from generated_functions import Generated
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline, PchipInterpolator
from scipy.linalg import expm
from scipy_motion import by_scipy

from saltus import InelasticImpact, Model, ParameterError
from saltus.flow import EventKind, simulate
from saltus.systems import (
    EnergyRestitution,
    Harmonic,
    Load,
    Metainterface,
    Record,
    RockingBlock,
    System,
    VelocityReduction,
    WallOscillator,
)
from saltus.systems.serial import from_dict, to_dict

OMEGA = 1.7
TIMES = np.array([0.4, 0.7, 1.5, 1.6, 2.9, 4.0])
FORCES = np.array([0.5, -1.0, 0.3, 2.0, -0.7, 0.8])


def oscillator(record, amplitude=0.0, **model):
    """An oscillator far from its wall under a record and a harmonic."""
    parameters = {"stiffness": 1.3, "damping": 0.2, "wall": 1e3, **model}
    load = Load(frequency=OMEGA, force=record + Harmonic(amplitude, phase=0.4))
    return System(model=WallOscillator(**parameters), load=load)


def exact(record_times, values, amplitude, start, end, x, v, stiffness=1.3, damping=0.2):
    """The same by matrix exponentials: the state is (x, v, force, slope of the force, sine,
    cosine), linear between samples.
    """
    edges = [start, *[t for t in record_times if start < t < end], end]
    sine = [math.sin(OMEGA * start + 0.4), math.cos(OMEGA * start + 0.4)]
    state = np.array([x, v, 0.0, 0.0, *sine])
    rate = np.zeros((6, 6))
    rate[0, 1] = rate[1, 2] = rate[2, 3] = 1.0
    rate[1, :2], rate[1, 4] = (-stiffness, -damping), amplitude
    rate[4, 5], rate[5, 4] = OMEGA, -OMEGA
    for left, right in itertools.pairwise(edges):
        i = np.searchsorted(record_times, 0.5 * (left + right)) - 1
        inside = 0 <= i < len(values) - 1
        slope = (
            (values[i + 1] - values[i]) / (record_times[i + 1] - record_times[i]) if inside else 0.0
        )
        state[2:4] = (values[i] + slope * (left - record_times[i]) if inside else 0.0), slope
        state = expm(rate * (right - left)) @ state
    return state[:2]


@pytest.mark.parametrize(
    ("start", "end"),
    [
        (0.0, 7.0),  # before, within and after the record; a forcing period ends within it
        (0.0, 0.4),  # to its first sample
        (0.7, 1.6),  # from sample to sample
        (1.1, 3.3),  # within
        (3.0, 9.0),  # from within to after
        (5.0, 6.0),  # after
        (-9.0, -8.0),  # before, and before time 0
        (-2.0, 3.0),  # from before time 0 to within
    ],
)
@pytest.mark.parametrize("amplitude", [0.0, 0.6])
def test_force_record_on_a_linear_oscillator_is_exact(start, end, amplitude):
    system = oscillator(Record(TIMES, FORCES), amplitude)
    motion = simulate(system, x=0.2, velocity=-0.3, time=start, duration=end - start)
    expected = exact(TIMES, FORCES, amplitude, start, end, 0.2, -0.3)
    assert motion.time == pytest.approx(end, abs=1e-14)
    assert (motion.x, motion.velocity) == pytest.approx(tuple(expected), abs=1e-12)


def test_force_record_is_exact_at_any_time_between():
    motion = simulate(oscillator(Record(TIMES, FORCES), 0.6), x=0.2, velocity=-0.3, duration=7.0)
    times = np.concatenate([TIMES, np.linspace(0.0, 7.0, 23)])
    expected = np.array(
        [exact(TIMES, FORCES, 0.6, 0.0, t, 0.2, -0.3) if t else (0.2, -0.3) for t in times]
    )
    assert np.stack(motion.at(times), axis=1) == pytest.approx(expected, abs=1e-12)


@given(
    st.lists(st.floats(0.01, 2.0), min_size=1, max_size=30),
    st.floats(-5.0, 15.0),
    st.floats(0.1, 20.0),
    st.integers(0, 2**32 - 1),
)
@settings(max_examples=25, deadline=None)
def test_random_force_records_are_exact(gaps, start, duration, seed):
    times = np.concatenate([[0.3], 0.3 + np.cumsum(gaps)])
    values = np.random.default_rng(seed).normal(size=times.size)
    motion = simulate(
        oscillator(Record(times, values, scale=2.0), 0.6), x=0.1, time=start, duration=duration
    )
    expected = exact(times, 2.0 * values, 0.6, start, start + duration, 0.1, 0.0)
    assert (motion.x, motion.velocity) == pytest.approx(tuple(expected), abs=1e-11)


def test_long_record_is_followed_sample_by_sample():
    times = np.arange(1500) * 0.03
    values = np.random.default_rng(5).normal(size=times.size)
    motion = simulate(oscillator(Record(times, values)), x=0.0, periods=20)
    expected = exact(times, values, 0.0, 0.0, motion.time, 0.0, 0.0)
    assert (motion.x, motion.velocity) == pytest.approx(tuple(expected), abs=1e-11)


def test_impacts_under_a_force_record_agree_with_scipy():
    system = oscillator(Record(TIMES, FORCES, scale=3.0), 0.6, wall=0.3).with_(
        {"impact": VelocityReduction(0.8)}
    )

    def acceleration(t, x, v, side, middle):
        force = 3.0 * np.interp(t, TIMES, FORCES) if TIMES[0] < middle < TIMES[-1] else 0.0
        return force + 0.6 * np.sin(OMEGA * t + 0.4) - 0.2 * v - 1.3 * x

    x, v, _, impacts = by_scipy(
        acceleration,
        lambda x, side: 0.3 - x,
        (0.2, 0.5),
        1,
        0.0,
        12.0,
        edges=TIMES,
        reset=lambda side, v: (side, -0.8 * v),
        contact=0.3,
    )
    motion = simulate(system, x=0.2, velocity=0.5, duration=12.0)
    assert len(motion.impacts) == len(impacts) >= 4
    assert motion.impacts.time == pytest.approx(impacts, abs=1e-9)
    assert (motion.x, motion.velocity) == pytest.approx((x, v), abs=1e-9)


# --- ground motions ----------------------------------------------------------

GROUND_TIMES = np.array([0.0, 0.3, 0.9, 1.4, 2.2, 2.9, 3.1, 4.0, 4.8])
GROUND = 0.3 * np.sin(1.9 * GROUND_TIMES) + 0.1 * GROUND_TIMES * (4.8 - GROUND_TIMES) / 4


def ground_acceleration(quantity):
    """zeta''(t) within the record, from SciPy's splines."""
    if quantity == "acceleration":
        return lambda t: np.interp(t, GROUND_TIMES, GROUND)
    return CubicSpline(GROUND_TIMES, GROUND).derivative(2 if quantity == "displacement" else 1)


@pytest.mark.parametrize("quantity", ["displacement", "velocity", "acceleration"])
@pytest.mark.parametrize("start", [0.0, 1.1])
def test_metainterface_on_recorded_ground_agrees_with_scipy(quantity, start):
    beta0, damping, vertical = 1.1, 0.1, -0.6
    record = Record(GROUND_TIMES, GROUND, quantity, scale=0.8)
    system = System(
        model=Metainterface(beta0=beta0, damping=damping),
        load=Load(vertical=vertical, ground_horizontal=record),
        impact=VelocityReduction(0.9),
    )
    zeta = ground_acceleration(quantity)

    def acceleration(t, theta, v, side, middle):
        push = -0.8 * zeta(t) if GROUND_TIMES[0] < middle < GROUND_TIMES[-1] else 0.0
        angle = beta0 + side * theta
        return np.sin(angle) * push + side * np.cos(angle) * vertical - damping * v - theta

    x, v, side, impacts = by_scipy(
        acceleration,
        lambda x, side: side * x,
        (0.2, 0.4),
        1,
        start,
        start + 12.0,
        edges=GROUND_TIMES,
        reset=lambda side, v: (-side, 0.9 * v),
    )
    motion = simulate(system, theta=0.2, velocity=0.4, time=start, duration=12.0)
    assert len(motion.impacts) == len(impacts) >= 3
    assert motion.impacts.time == pytest.approx(impacts, abs=1e-9)
    assert (motion.theta, motion.velocity, motion.side) == pytest.approx((x, v, side), abs=1e-9)


def block(record, amplitude):
    """A block on ground that moves as a record and as a harmonic."""
    load = Load(frequency=3.0, ground_horizontal=record + Harmonic(amplitude))
    return System(model=RockingBlock(alpha=0.25), load=load, impact=InelasticImpact())


def test_block_under_a_finely_sampled_sine_moves_as_under_the_harmonic():
    # Linear interpolation of zeta'' misses it by h^2/8 max|zeta''''|: the end state errs by as
    # much, and 4 times less at h/2.
    smooth = simulate(
        block(Record([0.0, 1.0], [0.0, 0.0], "acceleration"), 0.03), theta=0.05, periods=2
    )
    errors = []
    for count in (200, 400, 800):
        t = np.linspace(0.0, 2 * 2 * math.pi / 3.0, count + 1)
        sampled = block(Record(t, -0.03 * 9.0 * np.sin(3.0 * t), "acceleration"), 0.0)
        motion = simulate(sampled, theta=0.05, periods=2)
        assert len(motion.impacts) == len(smooth.impacts) > 0
        errors.append(abs(motion.theta - smooth.theta) + abs(motion.velocity - smooth.velocity))
    assert errors[0] < 1e-3
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.1)
    assert errors[1] / errors[2] == pytest.approx(4.0, rel=0.1)


def test_block_at_rest_is_released_where_the_recorded_acceleration_overcomes_its_slenderness():
    # It uplifts when |zeta''| = tan(alpha): on a ramp of slope r at t0 + tan(alpha)/r, and grows
    # like r cos(alpha) tau^3/6.
    alpha, slope = 0.25, 0.5
    system = block(Record([1.0, 3.0, 3.001], [0.0, 2 * slope, 0.0], "acceleration"), 0.0)
    motion = simulate(system, theta=0.0, duration=2.5)
    release = next(e for e in motion.events if e.kind is EventKind.RELEASE)
    assert release.time == pytest.approx(1.0 + math.tan(alpha) / slope, abs=1e-13)
    assert release.side == -1
    for tau in (1e-2, 1e-3):
        theta = motion.at(release.time + tau)[0]
        assert theta == pytest.approx(-slope * math.cos(alpha) * tau**3 / 6, rel=0.1 * tau)


def test_block_at_rest_is_released_at_a_jump_of_the_recorded_acceleration():
    # A record begins with a jump to b: theta grows at once like -s a tau^2/2, a = b cos(alpha) -
    # sin(alpha).
    alpha, jump, start = 0.25, 0.4, 1.3
    system = block(Record([start, start + 1.0], [jump, jump], "acceleration"), 0.0)
    motion = simulate(system, theta=0.0, duration=2.0)
    release = next(e for e in motion.events if e.kind is EventKind.RELEASE)
    assert release.time == pytest.approx(start, abs=1e-15)
    pull = jump * math.cos(alpha) - math.sin(alpha)
    for tau in (1e-2, 1e-4):
        theta, velocity = motion.at(start + tau)
        assert theta == pytest.approx(-pull * tau**2 / 2, rel=tau)
        assert velocity == pytest.approx(-pull * tau, rel=tau)


def test_block_stays_at_rest_where_a_kink_only_touches_its_strength():
    alpha = 0.25
    for peak, leaves in ((0.999, False), (1.001, True)):
        samples = np.array([0.0, peak * math.tan(alpha), 0.0])
        motion = simulate(
            block(Record([0.5, 1.5, 2.5], samples, "acceleration"), 0.0), theta=0.0, duration=3.0
        )
        assert any(e.kind is EventKind.RELEASE for e in motion.events) == leaves
        assert (np.abs(motion.at(np.linspace(1.499, 1.502, 50))[0]).max() > 0) == leaves


def test_oscillator_at_rest_on_its_wall_is_released_within_a_record():
    # Pressed by F > k d it rests; where the ramp brings F down to k d, it leaves.
    system = oscillator(Record([0.0, 1.0, 4.0], [2.0, 2.0, -1.0]), wall=0.5)
    motion = simulate(system, x=0.5, duration=3.5)
    release = next(e for e in motion.events if e.kind is EventKind.RELEASE)
    assert release.time == pytest.approx(1.0 + (2.0 - 1.3 * 0.5), abs=1e-13)
    for tau in (1e-2, 1e-3):
        assert 0.5 - motion.at(release.time + tau)[0] == pytest.approx(tau**3 / 6, rel=tau)


def test_samples_change_without_compiling():
    from saltus.flow.programs.compiled import _structures

    simulate(oscillator(Record(TIMES, FORCES)), x=0.0, duration=1.0)
    known = set(_structures)
    simulate(
        oscillator(Record(np.arange(50.0), np.ones(50), scale=3.0, source="other.csv")),
        x=0.0,
        duration=1.0,
    )
    assert set(_structures) == known


def test_records_of_different_spans_and_kinds_are_read_together():
    # The generated functions against the model's own Python, in every piece: accelerations, and
    # velocities in the impact law.
    load = Load(
        horizontal=Record([-1.0, 0.5, 2.0], [0.3, -0.2, 0.1]) + Record([0.0, 3.5], [0.1, 0.4]),
        vertical=-0.5,
        ground_horizontal=Record([0.2, 0.9, 1.7, 2.4], [0.0, 0.3, -0.1, 0.2], "velocity"),
        ground_vertical=Record(GROUND_TIMES, GROUND, "displacement")
        + Record([1.0, 4.0], [0.2, -0.1], "acceleration"),
    )
    system = System(
        model=Metainterface(beta0=1.3, mass_ratio=0.4), load=load, impact=EnergyRestitution(0.9)
    )
    generated = Generated(system)
    breaks = generated.env[2]
    assert breaks == pytest.approx(
        np.unique(np.concatenate([[-1, 0.5, 2, 0, 3.5, 0.2, 0.9, 1.7, 2.4, 1, 4], GROUND_TIMES]))
    )
    for t in np.concatenate([[-5.0], 0.5 * (breaks[1:] + breaks[:-1]), [9.0]]):
        piece = int(np.searchsorted(breaks, t, side="right"))
        for side in (1, -1):
            computed = generated.coefficients(t, side * 0.2, 0.4, 3, float(side), piece)[0]
            assert 2 * computed[2] == pytest.approx(
                float(system.model.acceleration(t, side * 0.2, 0.4, side, load)), abs=1e-14
            )
            expected = system.model.reset(t, -side * 1.2, side, load, system.impact)
            assert generated.reset(t, -side * 1.2, float(side), piece) == pytest.approx(
                [float(x) for x in expected], abs=1e-14
            )


CORNERS = ([0.0, 0.5, 0.6, 2.0, 2.1, 4.0], [0.0, 0.0, 0.2, 0.2, 0.0, 0.0])


@dataclass(frozen=True, kw_only=True)
class Carried(Model):
    """A mass on a spring whose other end is the ground: x'' = -w^2 (x - zeta)."""

    rate: float = 3.0
    coordinates: ClassVar[tuple[str, ...]] = ("x",)
    channels: ClassVar[tuple[str, ...]] = ("ground",)

    def acceleration(self, t, x, velocity, side, load):
        return -(self.rate**2) * (x - load.ground(t))


@pytest.mark.parametrize("width", [0.1, 1e-3])
def test_a_velocity_given_by_its_corners_has_constant_accelerations(width):
    """r = x - zeta has r'' = -w^2 r - a with a constant a between two corners, a closed form."""
    time, value = np.array(CORNERS[0]), np.array(CORNERS[1])
    time[[2, 4]] = time[[1, 3]] + width
    record = Record(time, value, "velocity", interpolation="linear")
    load, w = Load(ground=record), 3.0
    r, rate, at = 0.0, 0.0, 0.0
    for t, slope in zip(time[1:], np.diff(value) / np.diff(time), strict=True):
        still = -slope / w**2
        c, s = math.cos(w * (t - at)), math.sin(w * (t - at))
        r, rate, at = still + (r - still) * c + rate / w * s, rate * c - w * (r - still) * s, t
    motion = simulate(System(model=Carried(), load=load), x=0.0, duration=4.0)
    area = 0.2 * (time[3] - time[1])  # of the trapezoid of velocities
    assert load.ground(4.0) == pytest.approx(area, rel=1e-12)
    assert motion.x - area == pytest.approx(r, abs=1e-11)
    assert motion.velocity == pytest.approx(rate, abs=1e-11)
    speeds = [load.ground.velocity(t) for t in np.linspace(0, 4, 4001)]
    assert (min(speeds), max(speeds)) == (0.0, pytest.approx(0.2, abs=1e-15))


@pytest.mark.parametrize("quantity", ["velocity", "displacement"])
def test_a_monotone_record_has_no_extrema_between_its_samples(quantity):
    """And is SciPy's, by Fritsch and Carlson."""
    record = Record(*CORNERS, quantity, interpolation="monotone")
    times = np.linspace(0.0, 4.0, 2001)
    order = 1 if quantity == "velocity" else 0
    values = record.derivative(times, None, order)
    np.testing.assert_allclose(values, PchipInterpolator(*CORNERS)(times), rtol=0, atol=1e-15)
    assert (values.min(), values.max()) == (0.0, pytest.approx(0.2, abs=1e-15))
    motion = simulate(System(model=Carried(), load=Load(ground=record)), x=0.0, duration=4.0)
    state = np.zeros(2)
    for first, last in itertools.pairwise(CORNERS[0]):
        found = solve_ivp(
            lambda t, z: [z[1], -9.0 * (z[0] - record.derivative(t, None))],
            (first, last),
            state,
            "DOP853",
            rtol=1e-12,
            atol=1e-14,
        )
        state = found.y[:, -1]
    np.testing.assert_allclose([motion.x, motion.velocity], state, rtol=0, atol=1e-9)


def test_a_spline_that_leaves_its_samples_is_refused_and_one_that_does_not_is_taken():
    """By more than a fifth of their range, wherever it is and in whatever units."""
    for scale, shift in itertools.product((1e-6, 1.0, 1e6), (0.0, 3.0)):
        values = scale * np.array(CORNERS[1]) + shift * scale
        for quantity in ("velocity", "displacement"):
            with pytest.raises(ParameterError, match="interpolation=") as refusal:
                Record(CORNERS[0], values, quantity)
            assert refusal.value.parameter == "interpolation"
            Record(CORNERS[0], values, quantity, interpolation="spline")
        waves = scale * (shift + np.sin(np.linspace(0.0, 20.0, 60)))
        Record(np.linspace(0.0, 20.0, 60), waves, "velocity")
        Record(np.linspace(0.0, 20.0, 60), np.full(60, shift * scale), "displacement")
    for quantity, curve in (
        ("displacement", "linear"),
        ("force", "spline"),
        ("acceleration", "monotone"),
        ("velocity", "cubic"),
        ("velocity", 3),
    ):
        with pytest.raises(ParameterError, match="interpolation of a record of"):
            Record(*CORNERS, quantity, interpolation=curve)


def test_what_is_between_samples_is_kept_with_a_system():
    record = Record(*CORNERS, "velocity", interpolation="linear")
    system = System(model=Carried(), load=Load(ground=record))
    again = from_dict("load", to_dict(system.load))
    assert again == system.load
    assert again.channels["ground"].interpolation == "linear"
    assert system.load != Load(ground=Record(*CORNERS, "velocity", interpolation="monotone"))
