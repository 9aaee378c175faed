"""The two peaks of conservative motion and their ratio, against SciPy motions and the paper's
closed forms.
"""

import math

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from saltus.errors import ParameterError
from saltus.systems import (
    EnergyRestitution,
    Harmonic,
    Load,
    Metainterface,
    System,
    VelocityReduction,
)
from saltus.theory import (
    peaks,
    reciprocal,
    unloaded_half_periods,
    unloaded_peak_ratio,
    unloaded_period,
)

BETA = math.radians(80)


def cell(k=1.0, m=0.0, vertical=0.0, law=None, **more):
    model = Metainterface(beta0=more.pop("beta0", BETA), stiffness_ratio=k, mass_ratio=m)
    return System(
        model=model, load=Load(vertical=vertical, **more), impact=law or VelocityReduction(1.0)
    )


@pytest.mark.parametrize("theta0", [-0.15, 0.15])
@pytest.mark.parametrize(
    "system",
    [
        cell(3.0, vertical=-0.5),
        cell(0.4, 1.5, vertical=-0.5),
        cell(2.0, 1.5, vertical=-0.7, law=EnergyRestitution(1.0)),
        cell(2.0, 0.5, vertical=-0.7, horizontal=0.05, lower_vertical=-0.2),
    ],
    ids=["stiff", "soft-heavy", "energy", "all-loads"],
)
def test_erratum_06_peaks_and_period_are_those_of_a_scipy_motion(by_scipy, system, theta0):
    found = peaks(system, theta0)
    motion = by_scipy(system, theta0, impacts=3)
    assert sorted([theta0, motion.peaks[-2]]) == pytest.approx(
        [found.theta_min, found.theta_max], rel=1e-9
    )
    assert motion.peaks[-1] == pytest.approx(theta0, rel=1e-9)  # periodic, whichever law
    assert found.period == pytest.approx(motion.impact_times[2] - motion.impact_times[0], rel=1e-9)
    speeds = {"lower": found.lower_speed, "upper": found.upper_speed}
    first, second = ("lower", "upper") if theta0 > 0 else ("upper", "lower")
    assert speeds[first] == pytest.approx(abs(motion.before[0]), rel=1e-9)
    assert speeds[second] == pytest.approx(abs(motion.after[0]), rel=1e-9)


def test_erratum_06_the_printed_balance_fails():
    """k belongs to theta_max and the angle under the sine is beta0 + abs(theta) on both sides."""
    k, v = 3.0, -0.5
    found = peaks(cell(k, vertical=v), -0.15)

    def balance(stiff, soft, sine_stiff, sine_soft):
        return k * stiff**2 / 2 - v * math.sin(sine_stiff) - (soft**2 / 2 - v * math.sin(sine_soft))

    low, high = found.theta_min, found.theta_max
    assert balance(high, low, BETA + high, BETA - low) == pytest.approx(0.0, abs=1e-15)
    assert abs(balance(low, high, BETA + low, BETA - high)) > 1e-2
    free = peaks(cell(k), -0.15)
    # printed: sqrt(k) abs(theta_min)
    assert free.theta_max == pytest.approx(0.15 / math.sqrt(k), rel=1e-13)


def test_erratum_06_with_a_load_the_ratio_depends_on_the_side_that_starts():
    stiff = cell(4.0, vertical=-0.5)
    assert abs(peaks(stiff, 0.1).ratio - peaks(stiff, -0.1).ratio) > 0.05
    assert peaks(cell(4.0), 0.1).ratio == pytest.approx(peaks(cell(4.0), -0.1).ratio)


@pytest.mark.parametrize("k", [0.2, 1.0, 1.7, 30.0])
@pytest.mark.parametrize("m", [0.0, 0.5, 8.0])
def test_erratum_07_two_impact_laws_without_load(by_scipy, k, m):
    """A constant velocity gives min(sqrt((1+m)/k), sqrt(k/(1+m))); only r = 1 is free of m."""
    for law, conserving, expected in (
        (VelocityReduction(1.0), False, min(math.sqrt((1 + m) / k), math.sqrt(k / (1 + m)))),
        (EnergyRestitution(1.0), True, min(math.sqrt(k), 1 / math.sqrt(k))),
    ):
        simulated = by_scipy(cell(k, m, law=law), 0.1, impacts=2).peaks
        ratio = min(abs(simulated[-1]) / 0.1, 0.1 / abs(simulated[-1]))
        assert expected == pytest.approx(ratio, rel=1e-9)
        assert unloaded_peak_ratio(k, m, energy_conserving=conserving) == pytest.approx(
            expected, rel=1e-14
        )
        assert peaks(cell(k, m, law=law), 0.1).ratio == pytest.approx(expected, rel=1e-12)


def test_erratum_07_velocity_factors_of_the_conserving_impact():
    found = peaks(cell(1.0, 3.0, law=EnergyRestitution(1.0)), 0.1)
    assert found.upper_speed / found.lower_speed == pytest.approx(2.0, rel=1e-14)  # sqrt(1+m)


@pytest.mark.parametrize("law", [VelocityReduction(1.0), EnergyRestitution(1.0)])
@pytest.mark.parametrize(("k", "m"), [(1.0, 0.0), (5.0, 0.0), (1.0, 4.0), (0.3, 1.2)])
def test_unloaded_period_holds_for_both_laws_and_any_amplitude(by_scipy, law, k, m):
    motion = by_scipy(cell(k, m, law=law), -0.2, impacts=3)
    upper, lower = motion.impact_times[0] * 2, motion.impact_times[1] - motion.impact_times[0]
    assert (lower, upper) == (
        pytest.approx(unloaded_half_periods(k, m)[0], rel=1e-9),
        pytest.approx(unloaded_half_periods(k, m)[1], rel=1e-9),
    )
    assert motion.impact_times[2] - motion.impact_times[0] == pytest.approx(
        unloaded_period(k, m), rel=1e-9
    )
    assert peaks(cell(k, m, law=law), -0.2).period == pytest.approx(
        unloaded_period(k, m), rel=1e-12
    )


def test_limits_of_extreme_layers():
    stiffness = np.array([1e-8, 1e8])
    assert unloaded_peak_ratio(stiffness) == pytest.approx([1e-4, 1e-4])
    assert unloaded_period(1e12) == pytest.approx(math.pi, abs=1e-5)
    assert unloaded_period(1e-12) > 1e6
    lower, upper = unloaded_half_periods(1.0, 1e12)
    assert upper / lower < 1e-5
    assert unloaded_peak_ratio(1.0, 1e12) < 1e-5  # errata 7: for e = 1 m does affect it
    assert unloaded_peak_ratio(1.0, 1e12, energy_conserving=True) == 1.0


@pytest.mark.parametrize(
    ("vertical", "degrees"), [(-0.5, 2), (-0.5, 10), (-0.25, 5), (-1.0, 5), (0.0, 5)]
)
def test_peak_ratio_falls_to_zero_as_the_lower_layer_stiffens(vertical, degrees):
    """Fig. 7: from 1 at k = 1, monotone, to 0."""
    ratios = [
        peaks(cell(k, vertical=vertical), -math.radians(degrees)).ratio
        for k in np.logspace(0, 6, 25)
    ]
    assert ratios[0] == pytest.approx(1.0, rel=1e-12)
    assert np.all(np.diff(ratios) < 0)
    assert ratios[-1] < 0.02


@settings(deadline=None, max_examples=50)
@given(
    st.floats(20, 85),
    st.floats(-0.9, 0),
    st.floats(1, 20),
    st.floats(0.01, 0.4),
    st.floats(-1, 1),
    st.sampled_from([1, -1]),
)
def test_reciprocity_of_the_peak_ratio(degrees, vertical, k, size, share, sign):
    """`Prprop`, which exchanges the side that starts; with a constant horizontal force too."""
    beta0 = math.radians(degrees)
    horizontal = 0.5 * share * vertical / math.tan(beta0)
    system = cell(k, vertical=vertical, horizontal=horizontal, beta0=beta0)
    try:
        found = peaks(system, sign * size)
    except ParameterError:
        assume(False)
    twin, start = reciprocal(system, sign * size)
    assert twin.get("model.stiffness_ratio") == 1 / k
    assert start == -sign * size
    assert peaks(twin, start).ratio == pytest.approx(found.ratio, rel=1e-9)


def test_reciprocity_needs_the_other_side_to_start():
    system = cell(4.0, vertical=-0.5)
    twin, start = reciprocal(system, -0.1)
    assert abs(peaks(twin, -start).ratio - peaks(system, -0.1).ratio) > 0.05


def test_passes_a_barrier_into_the_far_well():
    """Multistable layers (V = -1.523): above the saddle's energy the peak lies beyond the well at
    1.463.
    """
    system = cell(vertical=-1.5 / math.sin(BETA))
    assert peaks(system, 2.3).theta_min == pytest.approx(-2.3, rel=1e-12)
    with pytest.raises(ParameterError, match="never reaches"):
        peaks(system, 1.6)
    with pytest.raises(ParameterError, match="never reaches"):
        peaks(system, 0.6)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: peaks(cell(), 0.0), "theta0"),
        (lambda: peaks(cell(), 4.0), "kinematic limit"),
        (lambda: peaks(cell(1e-4), -0.5), "kinematic limit"),
        (lambda: peaks(cell(vertical=0.5), 0.1), "never reaches"),
        (lambda: peaks(cell(law=VelocityReduction(0.8)), 0.1), "does not repeat"),
        (lambda: peaks(cell().with_({"model.damping": 0.1}), 0.1), "undamped"),
        (
            lambda: peaks(
                System(
                    model=Metainterface(beta0=1.0), load=Load(frequency=1.0, vertical=Harmonic(0.1))
                ),
                0.1,
            ),
            "varies",
        ),
        (lambda: reciprocal(cell(m=1.0), 0.1), "m = 0"),
        (lambda: unloaded_period(0.0), "stiffness_ratio must"),
        (lambda: unloaded_peak_ratio(1.0, -1.0), "mass_ratio must"),
    ],
)
def test_refuses_what_is_out_of_range(call, message):
    with pytest.raises(ParameterError, match=message):
        call()
