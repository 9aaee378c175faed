"""The paper's motions with both layers: where the reduced model is exact, and the stable states
that it does not have.
"""

import math

import numpy as np
import pytest

from saltus import simulate
from saltus_paper.figures.both_layers import FATES, FIGURE, beside, embedded, stable_states
from saltus_paper.figures.harmonic_loads import AMPLITUDE, FREQUENCY, under_force


def test_a_state_of_the_reduced_model_opens_the_layer_of_its_sign():
    states = np.array([[0.3, -0.1], [-0.3, 0.1], [0.0, 0.2], [0.0, -0.2]])
    expected = [
        [0.3, 0.0, -0.1, 0.0],
        [0.0, -0.3, 0.0, 0.1],
        [0.0, 0.0, 0.2, 0.0],
        [0.0, 0.0, 0.0, -0.2],
    ]
    np.testing.assert_array_equal(embedded(states), expected)


def test_the_page_begins_where_the_closed_layer_opens():
    system, results, first = FIGURE.page(None)
    motion = simulate(system, **first)
    assert results == []
    assert (motion.to_xarray()["closed_contacts"].values == 0).any()


def test_steady_motions_are_exact_up_to_the_load_that_opens_the_closed_layer():
    """At Omega = 1, V = -0.5, C = 0.1 that is Hhat = 0.174, by the least reaction of the reduced
    motion (contacts.md).
    """
    data = beside(
        under_force(), {AMPLITUDE: np.array([0.1, 0.172, 0.176, 0.2])}, ((0.0, 0.0, 1.0),)
    )
    same = data["fate"].values[0] == FATES.index("same")
    amplitude = data[AMPLITUDE].values
    assert same[amplitude < 0.174].all()
    assert not same[amplitude > 0.174].any()


def test_a_transfer_changes_no_motion_whose_impacts_open_both_layers():
    """It acts at closed contacts: with e > 0 the other layer is open when one closes."""
    places = {
        FREQUENCY: np.array([0.2876543, 0.1938271, 0.66]),
        AMPLITUDE: np.array([0.5, 0.2, 0.2]),
    }
    data = beside(
        under_force(),
        places,
        ((0.001, 0.5, 0.0), (0.001, 0.5, 0.5), (0.001, 0.0, 0.0), (0.001, 0.0, 1.0)),
    )
    full = data["full"].values
    assert np.isfinite(full[0]).any()
    np.testing.assert_array_equal(full[0], full[1])
    assert not np.array_equal(full[2], full[3], equal_nan=True)


@pytest.mark.parametrize("stiffness", [1.0, 1.1])
def test_the_fourth_stable_state_has_both_layers_open_where_each_would_be_alone(stiffness):
    """The potential is a sum over both layers: each rests where V cos(beta0 + x) = k x beyond its
    hump, by bisection.
    """
    beta0 = math.radians(80)
    vertical = -1.5 / math.sin(beta0)

    def opening(k):
        low, high = math.pi / 2 - beta0 + 0.6, math.pi - beta0
        for _ in range(200):
            middle = 0.5 * (low + high)
            low, high = (
                (middle, high)
                if vertical * math.cos(beta0 + middle) > k * middle
                else (low, middle)
            )
        return low

    data = stable_states()
    here = data["stiffness"].values == stiffness
    both = (data["lower"].values[here] > 0.1) & (data["upper"].values[here] < -0.1)
    assert both.sum() == 1
    assert data["lower"].values[here][both][0] == pytest.approx(opening(stiffness), abs=1e-5)
    assert -data["upper"].values[here][both][0] == pytest.approx(opening(1.0), abs=1e-5)
