"""Attractors of models with several contacts and coordinates, beside the reduced model and closed
forms.
"""

import math

import numpy as np
import pytest

from saltus import (
    ImpactPair,
    NewtonImpact,
    TwoLayer,
    TwoStops,
    attractors_along,
    basins_of_attraction,
    find_attractors,
)
from saltus.errors import ParameterError
from saltus.systems import (
    Harmonic,
    Load,
    Metainterface,
    System,
    VelocityReduction,
    WallOscillator,
    check_window,
    initial_states,
)

BETA80 = math.radians(80)


def both_and_reduced(H, **numbers):
    load = Load(frequency=1.0, vertical=-0.5, horizontal=Harmonic(amplitude=H))
    models = (
        TwoLayer(beta0=BETA80, damping=0.1, **numbers),
        Metainterface(beta0=BETA80, damping=0.1),
    )
    return [System(model=model, load=load, impact=VelocityReduction(1.0)) for model in models]


@pytest.mark.thorough
def test_where_the_closed_layer_stays_closed_the_attractors_are_those_of_the_reduced_model():
    """H = 0.1 keeps the closed layer closed (contacts.md); at 0.2 it opens, and the steady
    amplitude is 0.5694, not 0.5856.
    """
    both, reduced = (find_attractors(system, starts=24) for system in both_and_reduced(0.1))
    assert [member.kind for member in both] == [member.kind for member in reduced]
    for one, other in zip(both, reduced, strict=True):
        assert one.highest == pytest.approx(other.highest, abs=1e-10)
        assert one.lowest == pytest.approx(other.lowest, abs=1e-10)
        np.testing.assert_allclose(
            np.sort(one.states[:, 0] + one.states[:, 1]),
            np.sort(other.states[:, 0]),
            rtol=0,
            atol=1e-9,
        )
    both, reduced = (find_attractors(system, starts=24) for system in both_and_reduced(0.2))
    assert both.of(1).amplitude == pytest.approx(0.5694, abs=5e-5)
    assert reduced.of(1).amplitude == pytest.approx(0.5856, abs=5e-5)


def test_two_mirror_images_between_two_stops_are_two_attractors_with_equal_shares():
    """x'' + k x = F sin tau between stops at -1 and 1 has the mirror x -> -x with half a period:
    shares agree within errors.
    """
    system = System(
        model=TwoStops(stiffness=0.2),
        load=Load(frequency=1.0, force=Harmonic(amplitude=0.8)),
        impact=NewtonImpact(e=0.7),
    )
    found = find_attractors(system, starts=200)
    assert [member.period for member in found] == [1, 1]
    one, other = found
    assert abs(one.fraction - other.fraction) < 3.0 * math.hypot(one.error, other.error)
    half = system.load.period / 2.0
    image = one.orbit.motion(2).at(
        np.ceil(one.orbit.start()["time"] / (2 * half)) * 2 * half + half
    )
    np.testing.assert_allclose(-np.ravel(image), np.ravel(other.orbit.state), rtol=0, atol=1e-10)


def test_a_load_that_presses_on_a_stop_leaves_rest_there():
    """F = 1 + 0.1 sin tau exceeds k d = 0.2 at all times, so that the mass rests at the right stop
    whatever its start.
    """
    system = System(
        model=TwoStops(stiffness=0.2),
        load=Load(frequency=1.0, force=Harmonic(amplitude=0.1, mean=1.0)),
        impact=NewtonImpact(e=0.7),
    )
    found = find_attractors(system, starts=32)
    assert [(member.label, str(member.kind), member.fraction) for member in found] == [
        (0, "rest", 1.0)
    ]
    np.testing.assert_array_equal(found.of(0).states, [[1.0, 0.0]])


def test_two_states_of_rest_are_two_attractors():
    """A mass that is pulled to the nearer stop rests at either of them."""
    pulled = System(
        model=Pulled(),
        load=Load(frequency=1.0, force=Harmonic(amplitude=0.1)),
        impact=NewtonImpact(e=0.0),
    )
    found = find_attractors(pulled, starts=64)
    assert [(member.label, str(member.kind)) for member in found] == [(0, "rest"), (1, "rest")]
    assert sorted(member.states[0, 0] for member in found) == [-1.0, 1.0]
    assert found.undecided == 0


class Pulled(TwoStops):
    """x'' + c x' = F + 2 x between stops: away from the middle it falls on the nearer one."""

    def force(self, t, x, velocity, load):
        return load.force(t) - 0.3 * velocity + 2.0 * x


def test_starts_lie_in_the_window_and_hold_contacts_by_turns():
    both, _ = both_and_reduced(0.1)
    states = initial_states(both, 600, check_window(None, both), seed=1)
    assert (states[:, 0] >= 0.0).all()
    assert (states[:, 1] <= 0.0).all()
    assert (np.abs(states) <= 1.5).all()
    lower, upper = ((states[:, i] == 0.0) & (states[:, 2 + i] == 0.0) for i in (0, 1))
    assert [int(lower.sum()), int(upper.sum()), int((lower & upper).sum())] == [200, 200, 0]
    held = ((0.2, 0.8), (0.0, 0.0), (-0.5, 0.5), (0.0, 0.0))
    states = initial_states(both, 60, check_window(held, both), seed=1)
    assert (states[:, [1, 3]] == 0.0).all()
    assert states[:, 0].min() >= 0.2
    pair = System(
        model=ImpactPair(clearance=0.4), load=Load(frequency=1.0), impact=NewtonImpact(e=0.5)
    )
    states = initial_states(pair, 100, check_window(None, pair), seed=1)
    assert (np.abs(states[:, 1]) <= 0.4).all()
    assert int((np.abs(states[:, 1]) == 0.4).sum()) == 50


@pytest.mark.parametrize(
    ("window", "said"),
    [
        (((-1.0, 1.0), (-1.0, 1.0)), "4 pairs"),
        (((-1.0, -0.5), (-1.0, 0.0), (-1.0, 1.0), (-1.0, 1.0)), "theta_1 can be"),
        (((0.5, 0.1), (-1.0, 0.0), (-1.0, 1.0), (-1.0, 1.0)), "4 pairs"),
    ],
)
def test_windows_without_meaning_are_refused(window, said):
    both, _ = both_and_reduced(0.1)
    with pytest.raises(ParameterError, match=said) as refused:
        find_attractors(both, window=window)
    assert refused.value.parameter == "window"


def test_a_plane_of_states_with_a_closed_layer_has_the_basins_of_the_reduced_model():
    """Cells with the upper layer closed whose motions never open both layers (H = 0.1) are motions
    of the reduced model, with the same labels; they come near no later, as each layer's angle is at
    most as far away as theta."""
    both, reduced = both_and_reduced(0.1)
    theta, velocity = np.linspace(0.02, 0.3, 6), np.linspace(-0.2, 0.2, 5)
    (of_both, of_reduced) = (find_attractors(system, starts=24) for system in (both, reduced))
    one = basins_of_attraction(
        reduced, theta=theta, velocity=velocity, periods=200, found=of_reduced
    )
    two = basins_of_attraction(
        both, theta_1=theta, theta_1_velocity=velocity, theta_2=0.0, periods=200, found=of_both
    )
    assert two["label"].dims == ("theta_1_velocity", "theta_1")
    assert two.attrs["held_theta_2"] == 0.0
    np.testing.assert_array_equal(two["label"].values, one["label"].values)
    assert (two["time"].values <= one["time"].values).all()


def test_a_plane_needs_two_state_variables():
    both, _ = both_and_reduced(0.1)
    with pytest.raises(ParameterError, match="two state variables"):
        basins_of_attraction(both, theta_1=[0.1, 0.2])
    with pytest.raises(ParameterError, match="no state variable 'velocity'"):
        basins_of_attraction(both, velocity=[0.1, 0.2], theta_1=[0.1, 0.2])
    with pytest.raises(ParameterError, match="one coordinate"):
        basins_of_attraction(both, theta_1=[0.1, 0.2], theta_2=[-0.2, -0.1], curves=True)


def test_an_attractor_of_both_layers_is_followed_along_a_parameter():
    both, _ = both_and_reduced(0.1)
    found = attractors_along(both, "load.horizontal.amplitude", [0.1, 0.12, 0.14], starts=12)
    assert found["attractor"].values.tolist() == [1]
    _, reduced = both_and_reduced(0.14)
    assert float(found["amplitude"][2, 0]) == pytest.approx(
        find_attractors(reduced, starts=12).of(1).amplitude, abs=1e-9
    )


def test_starts_beyond_a_contact_are_refused_in_one_sentence():
    (both, _), stops = (
        both_and_reduced(0.1),
        System(model=TwoStops(), load=Load(frequency=1.0), impact=NewtonImpact(e=0.5)),
    )
    # x <= 1
    wall = System(model=WallOscillator(), load=Load(frequency=1.0), impact=VelocityReduction(0.5))
    for ask, words in (
        (
            lambda: basins_of_attraction(stops, x=[0.5, 1.5], velocity=[0, 1]),
            "x = 1.5 lies beyond the contact 'right' at x = 1",
        ),
        (
            lambda: basins_of_attraction(both, theta_1=[-0.3, 0.1], theta_2=[-0.3, -0.2]),
            "beyond the contact 'lower'",
        ),
        (
            lambda: basins_of_attraction(
                both, theta_1=[0.1, 0.2], theta_1_velocity=[0, 1], theta_2=0.2
            ),
            "'upper' at theta_2 = 0",
        ),
        (
            lambda: basins_of_attraction(wall, x=[0.5, 1.5], velocity=[0, 1]),
            "x = 1.5 lies beyond the contact at x = 1",
        ),
        (
            lambda: find_attractors(both, starts=1, also=[[-0.1, -0.1, 0, 0]]),
            "theta_1 = -0.1 lies beyond",
        ),
    ):
        with pytest.raises(ParameterError) as refused:
            ask()
        assert words in str(refused.value)


def test_a_start_that_moves_into_a_contact_ends_where_that_after_its_impact_does():
    """Between stops with e = 1/2: at a stop with the velocity v into it as with -v / 2."""
    load = Load(frequency=1.0, force=Harmonic(amplitude=0.9))
    stops = System(model=TwoStops(stiffness=0.0), load=load, impact=NewtonImpact(e=0.5))
    speeds = np.array([-2.0, -1.2, -0.6, -0.3, 0.3, 0.6, 1.0])
    basins = basins_of_attraction(stops, x=np.linspace(-1.0, 1.0, 5), velocity=speeds, periods=200)
    left, right = basins["label"].values[:, 0], basins["label"].values[:, -1]
    assert (basins["label"].values >= 0).all()
    np.testing.assert_array_equal(left[:3], left[:3:-1])
    assert len(set(left)) > 1  # so that it matters
    assert right[5] == right[3]
    begun = [[-1.0, -0.6], [-1.0, 0.3]]
    assert len(set(find_attractors(stops, starts=16, also=begun).carried)) == 1


def test_starts_at_a_contact_that_stay_or_leave_are_taken():
    both, _ = both_and_reduced(0.1)
    found = basins_of_attraction(both, theta_1=[0.1, 0.2], theta_2_velocity=[-0.5, 0.0], periods=64)
    assert found["label"].shape == (2, 2)
    assert (found["label"][1] == 1).all()
