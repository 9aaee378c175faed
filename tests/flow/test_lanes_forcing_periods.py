"""Steps of lanes go past the ends of forcing periods: what is kept of each period is what the
scalar motion has in it.
"""

import itertools
import math

import numpy as np
import pytest
from shared_systems import forced
from test_ensemble_samples import KINDS, extrema

import saltus
from saltus.flow import stop_names
from saltus.flow.programs.lane_handoff import turning_range
from saltus.systems import Harmonic, Load, Record

SHORT = {"load.frequency": 40.0, "load.horizontal.amplitude": 0.3}  # periods shorter than a step
RECORD = Record([-2.0, -0.7, 0.31, 1.3, 2.9, 9.0], [0.0, 0.3, -0.2, 0.4, 0.1, 0.2])
SYSTEMS = {
    "short": forced(H=0.0, e=0.9).with_(SHORT),
    "ordinary": forced(e=0.9, H=0.3, W=2.0),
    "record": (
        forced(H=0.0, e=0.9).with_(
            {"load": Load(frequency=7.0, horizontal=RECORD + Harmonic(0.1), vertical=-0.5)}
        )
    ),
}


@pytest.mark.parametrize("system", SYSTEMS)
@pytest.mark.parametrize(("time", "periods"), [(0.3, 20.0), (-1e-20, 12.0), (-1.3, 17.4)])
def test_each_period_has_what_the_scalar_motion_has_in_it(system, time, periods):
    """State, extrema, impacts and least speed; the time at the end, and how many periods it
    took.
    """
    system, starts = SYSTEMS[system], np.array([0.3, 0.7])
    ends = saltus.simulate_many(
        system, theta=starts, time=time, periods=periods, sample=KINDS, last="all", tol=1e-13
    )
    for i, theta in enumerate(starts):
        motion = saltus.simulate(system, theta=theta, time=time, periods=periods, tol=1e-14)
        bounds = motion.start + system.load.period * np.arange(math.ceil(periods) + 1)
        bounds[-1] = motion.time
        ours, (x, v), crossings = ends.isel(trajectory=i), motion.at(bounds[1:]), motion.impacts
        np.testing.assert_allclose(
            [ours.sampled_theta, ours.sampled_velocity], [x, v], rtol=0, atol=1e-12
        )
        spans = list(itertools.pairwise(bounds))
        largest, smallest = np.transpose([extrema(motion, *span) for span in spans])
        np.testing.assert_allclose(
            [ours.largest_theta, ours.smallest_theta], [largest, smallest], rtol=0, atol=1e-12
        )
        inside = [(crossings.time > a) & (crossings.time <= b) for a, b in spans]
        np.testing.assert_array_equal(ours.period_impact_count, [chosen.sum() for chosen in inside])
        speeds = [
            np.abs(crossings.velocity_before[chosen]).min(initial=np.inf) for chosen in inside
        ]
        np.testing.assert_allclose(ours.least_speed, speeds, rtol=0, atol=1e-11)
        assert float(ours.time) == pytest.approx(motion.time, abs=1e-13)
        assert float(ours.periods) == pytest.approx(periods, abs=1e-13)


def test_what_has_settled_ends_at_the_end_of_its_period():
    """With its derivatives, as after so many periods that were asked for."""
    system, options = (
        forced(C=0.3, H=0.3, W=2.0),
        {"theta": 0.6, "tol": 1e-13, "sensitivities": ("load.frequency",)},
    )
    ends = saltus.simulate_many(system, periods=400, until="settled", **options)
    assert str(stop_names(ends).values) == "settled"
    assert float(ends.periods) == round(float(ends.periods)) < 400
    assert float(ends.theta) == float(ends.sampled_theta[-1])
    other = saltus.simulate_many(system, periods=float(ends.periods), **options)
    assert float(ends.theta) == pytest.approx(float(other.theta), abs=1e-13)
    np.testing.assert_allclose(ends.derivative, other.derivative, rtol=0, atol=1e-10)
    assert int(ends.impact_count) == int(other.impact_count)


def test_turning_points_before_a_part_of_a_step_do_not_count():
    """x = u^2 (1 - u) (u - 2)^2, which turns at 0, 0.47, 1.53 and 2."""
    polynomial = (
        np.polynomial.Polynomial([0, 0, 1])
        * np.polynomial.Polynomial([1, -1])
        * np.polynomial.Polynomial([4, -4, 1])
    )
    series = np.concatenate([polynomial.coef, np.zeros(8)])
    turns = polynomial.deriv().roots().real
    for begin, end in (
        (0.0, 1.0),
        (0.3, 1.0),
        (0.7, 0.9),
        (0.8, 1.8),
        (0.2, 0.201),
        (0.5, 0.5),
        (0.1, 1.9),
    ):
        values = polynomial(np.array([*turns[(turns > begin) & (turns < end)], end]))
        assert turning_range(series, 12, begin, end, np.zeros(16)) == pytest.approx(
            (values.max(), values.min()), abs=1e-13
        )
