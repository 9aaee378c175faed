"""Table 1: impacts named from the states before and after, and erratum 16."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from saltus import TwoLayer
from saltus.errors import ParameterError
from saltus.systems import LayerState, Scenario, name_impact, other_impulse, table_1

MODEL = TwoLayer(beta0=math.radians(80), mass_ratio=0.3)
speeds = st.floats(0.01, 10)


def signed(layer, closing):
    """The velocity with which a layer closes at the given speed."""
    return -closing if layer == 1 else closing


def pair(layer, own, other):
    return (own, other) if layer == 1 else (other, own)


def state(layer, own_velocity, other_velocity, other_angle=0.0):
    return LayerState(pair(layer, 0.0, other_angle), pair(layer, own_velocity, other_velocity))


@settings(deadline=None)
@given(st.sampled_from([1, 2]), speeds, speeds, speeds)
def test_rows_of_table_1_are_named(s, hit, back, thrown):
    other = 3 - s
    before = state(s, signed(s, hit), 0.0)
    cases = {
        (0.0, -signed(other, thrown)): (Scenario.NO_BOUNCING, 1),
        (-signed(s, back), 0.0): (Scenario.BOUNCING, 1),
        (-signed(s, back), -signed(other, thrown)): (Scenario.PARTIAL_BOUNCING, 2),
        (0.0, 0.0): (Scenario.NO_BOUNCING, 0),  # everything stops
    }
    for velocities, (scenario, deformed) in cases.items():
        found = name_impact(before, state(s, *velocities))
        assert found == (scenario, s, 1, deformed)
    angle = -signed(other, 0.4)
    before = state(s, signed(s, hit), 0.7, angle)
    assert name_impact(before, state(s, 0.0, 0.2, angle)) == (Scenario.NO_BOUNCING, s, 2, 1)
    assert name_impact(before, state(s, -signed(s, back), 0.2, angle)) == (
        Scenario.BOUNCING,
        s,
        2,
        2,
    )


@settings(deadline=None)
@given(st.sampled_from([1, 2]), speeds, st.floats(0, 1), st.floats(-5, 5), st.floats(0.3, 2.0))
def test_erratum_16_an_impulse_on_one_layer_moves_the_other_open_one(
    s, hit, restitution, other_velocity, size
):
    """The momentum of the layer that is not hit is kept, so its velocity jumps by -M_js / M_jj
    times the other jump.
    """
    angle = -signed(3 - s, size)
    before = state(s, signed(s, hit), other_velocity, angle)
    mass = MODEL.mass_matrix(before.theta)
    i, j = s - 1, 2 - s
    jump = -(1 + restitution) * before.velocity[i]
    response = -mass[j, i] / mass[j, j] * jump
    after = state(s, before.velocity[i] + jump, other_velocity + response, angle)
    impulse = mass @ np.subtract(after.velocity, before.velocity)
    assert impulse[j] == pytest.approx(0.0, abs=1e-12 * hit)
    assert other_impulse(MODEL, before, after, s) == pytest.approx(0.0, abs=1e-12 * hit)
    found = name_impact(before, after, model=MODEL)
    assert found.scenario in (Scenario.BOUNCING, Scenario.NO_BOUNCING)
    assert found.deformed_before == 2
    # as printed, the other layer keeps its velocity: against the balance, unless the layers happen
    # to be uncoupled
    if abs(response) > 1e-3 * hit:
        printed = state(s, before.velocity[i] + jump, other_velocity, angle)
        with pytest.raises(ParameterError, match=rf"layer {3 - s} is open and not hit"):
            name_impact(before, printed, model=MODEL)


def test_erratum_16_angles_do_not_jump_so_the_printed_conditions_are_refused():
    """Table 1 asks for theta_j(+) != theta_*; continuity of the angles (`controtrot`) forbids
    it.
    """
    before = LayerState((0.0, -0.4), (-1.0, 0.2))
    with pytest.raises(ParameterError, match="angles are continuous"):
        name_impact(before, LayerState((0.0, -0.5), (0.0, 0.1)))
    with pytest.raises(ParameterError, match="angles are continuous"):
        name_impact(before, LayerState((0.1, -0.4), (0.5, 0.1)))
    rows = table_1()
    assert not any("theta_j(+)" in row.after or "theta_*" in row.after for row in rows)
    assert [(r.deformed_before, r.deformed_after, r.scenario) for r in rows] == [
        (1, 1, Scenario.NO_BOUNCING),
        (1, 1, Scenario.BOUNCING),
        (1, 2, Scenario.PARTIAL_BOUNCING),
        (2, 1, Scenario.NO_BOUNCING),
        (2, 2, Scenario.BOUNCING),
    ]


@pytest.mark.parametrize(("layer", "mass"), [(1, 1.0), (2, 1.0 + MODEL.mass_ratio)])
def test_erratum_29_a_velocity_factor_below_the_inelastic_one_needs_a_contact_that_pulls(
    layer, mass
):
    """The impulse on the closed layer pushes only for e >= -cos(2 beta0), or -cos(2 beta0)/(1+m)
    from upper to lower.
    """
    inelastic = -math.cos(2 * MODEL.beta0) / mass
    closing = signed(layer, 1.0)
    before = LayerState((0.0, 0.0), pair(layer, closing, 0.0))
    for e, pushes in (
        (1.0, True),
        (inelastic + 1e-6, True),
        (inelastic - 1e-6, False),
        (0.5, False),
    ):
        after = LayerState((0.0, 0.0), pair(layer, 0.0, e * closing))
        assert name_impact(before, after).scenario is Scenario.NO_BOUNCING
        push = (
            -other_impulse(MODEL, before, after, 1)
            if layer == 1
            else other_impulse(MODEL, before, after, 2)
        )
        assert (push >= 0) is pushes


@pytest.mark.parametrize(
    ("before", "after", "message"),
    [
        (
            ((0.0, -0.1), (1.0, 0.0)),
            ((0.0, -0.1), (1.0, 0.0)),
            "no layer that is closed moves towards",
        ),
        (((0.0, 0.0), (-1.0, 1.0)), ((0.0, 0.0), (0.0, 0.0)), "both layers impact at once"),
        (((0.0, 0.0), (-1.0, 0.0)), ((0.0, 0.0), (-0.5, 0.0)), "layer 1 would close further"),
        (((0.0, 0.0), (-1.0, 0.0)), ((0.0, 0.0), (0.0, 0.5)), "layer 2 would close further"),
        (
            ((-0.1, 0.0), (-1.0, 0.0)),
            ((-0.1, 0.0), (0.0, 0.0)),
            "needs theta_1 >= 0 and theta_2 <= 0",
        ),
        (
            ((0.0, 0.0), (math.nan, 0.0)),
            ((0.0, 0.0), (0.0, 0.0)),
            "before the impact must be finite",
        ),
    ],
)
def test_what_is_no_impact_is_refused(before, after, message):
    with pytest.raises(ParameterError, match=message):
        name_impact(LayerState(*before), LayerState(*after))
