"""Derivatives at any time of a motion: closed forms through impacts, and the derivatives of shorter
motions.
"""

import numpy as np
import pytest
from shared_systems import forced

import saltus
from saltus.errors import ParameterError


def test_a_bouncing_ball_has_the_derivatives_of_its_closed_form_before_and_after_each_impact():
    """From x = -h at rest under F: t1 = sqrt(2 h / F), then x = -e F t1 s + F s^2 / 2, s = t - t1,
    until s = 2 e t1.
    """
    h, F, e = 0.8, 1.3, 0.7
    ball = saltus.System(
        model=saltus.WallOscillator(stiffness=0.0, wall=0.0),
        load=saltus.Load(force=F),
        impact=saltus.VelocityReduction(e),
    )
    first = np.sqrt(2 * h / F)
    second = first * (1 + 2 * e)
    result = saltus.sensitivities(
        ball, x=-h, duration=1.05 * second, parameters=("load.force", "impact.e")
    )

    def expected(t):
        """d(x, v) / d(x0, F, e)."""
        if t < first:
            return np.array([[1.0, t**2 / 2, 0.0], [0.0, t, 0.0]])
        by_x, by_force = -1 / (F * first), -first / (2 * F)  # of t1, as dh = -dx
        s = t - first
        at_wall = np.array([e * F * first - F * s - e * F * s, -F - e * F])  # d(x, v) / dt1
        return np.stack(
            [
                at_wall * by_x,
                at_wall * by_force + [s * s / 2 - e * first * s, s - e * first],
                [-F * first * s, -F * first],
            ],
            axis=1,
        )

    times = np.array([0.0, 0.3, np.nextafter(first, 0), first + 1e-9, 1.2 * first, 0.9 * second])
    found = result.at(times)[:, :, [0, 2, 3]]
    np.testing.assert_allclose(found, [expected(t) for t in times], rtol=1e-8, atol=1e-8)
    np.testing.assert_allclose(
        found[[0, 1, 4, 5]], [expected(times[i]) for i in (0, 1, 4, 5)], rtol=1e-13, atol=1e-13
    )
    impact = float(result.motion.impacts.time[0])
    # just after it
    np.testing.assert_allclose(
        result.at(impact)[:, [0, 2, 3]], expected(first), rtol=1e-12, atol=1e-12
    )
    before = result.at(np.nextafter(impact, -np.inf))[:, [0, 2, 3]]
    np.testing.assert_allclose(before, expected(0.999999 * first), rtol=1e-5, atol=1e-5)
    np.testing.assert_array_equal(
        result.at(result.motion.time), np.hstack([result.state, result.parameters])
    )


@pytest.mark.parametrize(
    ("system", "start", "paths"),
    [
        (
            forced(H=0.5, e=0.9),
            {"theta": 0.3},
            ("impact.e", "model.beta0", "load.horizontal.amplitude"),
        ),
        (
            saltus.System(
                model=saltus.ImpactPair(damping=0.1),
                load=saltus.Load(frequency=1.1, force=saltus.Harmonic(1.0)),
                impact=saltus.NewtonImpact(0.7),
            ),
            {"z": 0.0, "x": 0.5, "velocity": (1.0, -0.3)},
            ("model.mass_ratio", "model.clearance"),
        ),
        (
            saltus.System(model=saltus.BeltOscillator(damping=0.05)),
            {"x": 0.5, "velocity": 0.0},
            ("model.kinetic", "model.belt_speed"),
        ),
    ],
    ids=["one contact", "several contacts", "friction"],
)
def test_derivatives_on_the_way_are_those_of_motions_that_end_there(system, start, paths):
    whole = saltus.sensitivities(system, **start, duration=12.0, parameters=paths)
    assert len(whole.motion.events) >= 2
    times = [0.0, 1.7, 5.3, 9.1, 11.9]
    found = whole.at(times)
    for time, here in zip(times, found, strict=True):
        part = saltus.sensitivities(system, **start, duration=time, parameters=paths)
        expected = np.hstack([part.state, part.parameters])
        np.testing.assert_allclose(here, expected, rtol=1e-9, atol=1e-10 * np.abs(expected).max())


def test_at_rest_the_derivatives_are_those_of_the_contact():
    ball = saltus.System(
        model=saltus.WallOscillator(stiffness=0.0),
        load=saltus.Load(force=1.0),
        impact=saltus.VelocityReduction(0.5),
    )
    result = saltus.sensitivities(ball, x=0.5, duration=10.0, parameters=["model.wall"])
    assert result.motion.rest_time is not None
    np.testing.assert_array_equal(result.at(8.0), [[0.0, 0.0, 1.0], [0.0, 0.0, 0.0]])


def test_a_frequency_moves_the_end_of_periods_but_not_a_fixed_time():
    result = saltus.sensitivities(
        forced(H=0.5), theta=0.3, periods=2, parameters=["load.frequency"]
    )
    moving = -2 * np.pi * 2 / result.motion.system.load.frequency**2
    rate = saltus.flow.state_rates(result.motion)
    np.testing.assert_allclose(
        result.at(result.motion.time)[:, 2] + moving * rate, result.parameters[:, 0], rtol=1e-12
    )


def test_times_outside_are_refused_and_a_motion_that_was_not_kept_says_so():
    result = saltus.sensitivities(forced(H=0.5), theta=0.3, duration=2.0)
    with pytest.raises(ParameterError, match="must lie in"):
        result.at(2.5)
    loose = saltus.sensitivities(forced(H=0.5), theta=0.3, duration=2.0, dense=False)
    with pytest.raises(ParameterError, match="no dense output"):
        loose.at(1.0)
