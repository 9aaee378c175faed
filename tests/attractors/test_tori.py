"""Whether a torus is possible: each condition of errata 22 is needed, and what the check says of
the flow is so.
"""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from shared_systems import forced, under, walled
from soft_stops import soft_stop
from verdict_cases import spread

import saltus
from saltus import MotionError, ParameterError, excludes_tori

BETA0 = math.radians(80)


def test_the_papers_system_has_none():
    reason = excludes_tori(forced(0.2, 0.38))
    assert "continuous" in reason
    assert "shrinks areas" in reason
    assert "errata 22" in reason
    # exp(-C T), the area that a period leaves
    assert f"{math.exp(-0.1 * 2 * math.pi / 0.38):.3g}" in reason


@pytest.mark.parametrize(
    "changes",
    [
        {"C": 0.0},  # areas are kept
        {"c": 0.0},  # and those of motions on the lower side alone
        {"V": 0.5, "H": 0.0},  # the contact pushes away on both sides, always
        {"V": 0.5},  # or for a part of the period
    ],
)
def test_without_one_of_the_conditions_a_torus_is_not_excluded(changes):
    assert excludes_tori(forced(**changes)) is None


@pytest.mark.parametrize("e", [0.0, 0.5, 1.0])
def test_losses_at_impacts_do_not_help_a_torus(e):
    assert excludes_tori(forced(0.5, 1.0, e=e))
    assert excludes_tori(walled(c=0.1, wall=0.1, e=e))


def test_the_wall_needs_damping():
    """A one-sided wall tears nothing apart; without damping motions beside it keep areas."""
    assert "one wall" in excludes_tori(walled(c=0.1, wall=0.1))
    assert excludes_tori(walled(c=0.0, wall=0.1)) is None


def test_laws_that_may_raise_the_speed_do_not_count():
    assert excludes_tori(under(vertical=-0.5, impact=saltus.InelasticImpact()))
    assert excludes_tori(under(vertical=-0.5, impact=saltus.EnergyRestitution(0.9))) is None


def test_a_smoothed_sign_is_continuous_whatever_the_vertical_load():
    assert "no contact" in excludes_tori(under(vertical=0.5, smoothing=100.0))
    assert excludes_tori(under(vertical=0.5, smoothing=100.0, C=0.0)) is None


def test_the_acceleration_of_the_ground_counts_as_a_load():
    """nu'' = -nuhat Omega^2 sin: at nuhat = 0.6, V - nu'' is above 0 for a while, which alone
    tears, at 0.4 never.
    """
    for amplitude, excluded in ((0.4, True), (0.6, False)):
        system = under(vertical=-0.5, ground_vertical=saltus.Harmonic(amplitude=amplitude))
        assert (excludes_tori(system) is not None) is excluded


def test_a_load_that_pulls_one_way_while_the_contact_would_open_tears_nothing():
    """V - nu'' > 0 around tau = pi / 2 only, where a force H > 0 presses the upper layer shut: one
    side opens, not both.
    """
    ground = saltus.Harmonic(amplitude=0.6)
    aligned = under(
        vertical=-0.5, ground_vertical=ground, horizontal=saltus.Harmonic(amplitude=0.1)
    )
    assert excludes_tori(aligned) is not None
    crossed = under(
        vertical=-0.5,
        ground_vertical=ground,
        horizontal=saltus.Harmonic(amplitude=0.1, phase=math.pi / 2),
    )
    assert excludes_tori(crossed) is None


@settings(max_examples=60, deadline=None)
@given(
    vertical=st.floats(-1.0, 1.0),
    swing=st.floats(0.0, 1.0),
    horizontal=st.floats(0.0, 5.0),
    phase=st.floats(0.0, 6.28),
    beta0=st.floats(0.3, 2.8),
)
def test_it_is_so_wherever_the_vertical_load_presses_throughout(
    vertical, swing, horizontal, phase, beta0
):
    """The condition of errata 22 itself, V(t) cos(beta0) < 0 at all times, is enough, for any
    horizontal load.
    """
    channels = {
        "vertical": saltus.Harmonic(mean=vertical, amplitude=swing, phase=phase),
        "horizontal": saltus.Harmonic(amplitude=horizontal),
    }
    system = saltus.System(
        model=saltus.Metainterface(beta0=beta0, damping=0.1),
        load=saltus.Load(frequency=1.0, **channels),
    )
    presses = max((vertical + swing) * math.cos(beta0), (vertical - swing) * math.cos(beta0))
    if presses < -0.02 - 0.002 * horizontal:  # the bounds are over 1/4096 of the period
        assert excludes_tori(system) is not None
    if presses > 0.0 and horizontal == 0.0:
        assert excludes_tori(system) is None


def test_where_a_torus_is_not_excluded_the_flow_tears_or_keeps_areas():
    """At V cos(beta0) > 0 and H = 0 the motion from rest is not unique; motions beside it end far
    from each other.
    """
    system = forced(0.0, 1.0, V=0.5)
    assert excludes_tori(system) is None
    with pytest.raises(MotionError, match="not unique"):
        saltus.simulate(system, theta=0.0, periods=1)
    ends = [saltus.simulate(system, theta=theta, periods=1).theta for theta in (1e-9, -1e-9)]
    assert ends[0] - ends[1] > 1e6 * 2e-9
    pressed = forced(0.0, 1.0)
    near = [saltus.simulate(pressed, theta=theta, periods=1).theta for theta in (1e-9, -1e-9)]
    assert abs(near[0] - near[1]) < 1e-6


def test_the_contraction_that_it_states_holds_for_every_motion():
    """det of the stroboscopic map's derivative is at most exp(-C T) with equal layers, and e^2 less
    for every impact.
    """
    for e in (1.0, 0.8):
        system = forced(0.5, 1.0, e=e)
        for theta, velocity in spread(12):
            found = saltus.sensitivities(system, theta=theta, velocity=velocity, periods=1)
            if found.undefined is None:
                assert abs(found.determinant) <= math.exp(-0.1 * 2 * math.pi) * (1 + 1e-9)


def test_it_refuses_records():
    record = saltus.Record(np.array([0.0, 1.0]), np.array([0.0, 1.0]))
    with pytest.raises(ParameterError, match="is a Record"):
        excludes_tori(under(horizontal=record))


def test_under_constant_loads_there_is_no_room():
    system = saltus.System(
        model=saltus.Metainterface(beta0=BETA0, damping=0.1), load=saltus.Load(vertical=-0.5)
    )
    assert "no room" in excludes_tori(system)


def test_two_coordinates_are_not_spoken_of():
    assert (
        excludes_tori(
            saltus.System(
                model=saltus.TwoLayer(beta0=1.4, damping=0.1), load=saltus.Load(vertical=-0.5)
            )
        )
        is None
    )


def test_a_soft_stop_tears_nothing_apart_and_its_damping_excludes_tori():
    for numbers in ({}, {"damper": 0.3}, {"stop": -0.5}):
        assert "neither the velocity nor the acceleration changes" in excludes_tori(
            soft_stop(**numbers)
        )
    assert excludes_tori(soft_stop(damping=0.0)) is None
    assert excludes_tori(soft_stop(damping=0.1, damper=-0.2)) is None


def test_a_slow_motion_between_soft_stops_is_not_called_quasi_periodic():
    """At 0.53 it creeps towards an orbit whose largest multiplier is near -1."""
    assert str(saltus.classify(soft_stop(frequency=0.53), x=0.1).kind) in ("undecided", "periodic")
