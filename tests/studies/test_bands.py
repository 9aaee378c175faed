"""Bands of chaos: found where chaos is known to be, nowhere else, with edges between what was tried; transients are none."""

import numpy as np
import pytest
from shared_systems import forced

from saltus import ParameterError, WallOscillator
from saltus.studies import chaotic_bands
from saltus.studies.diagram.bands import Band, Bands, Tried, band_dataset
from saltus.systems import Harmonic, Load, System

WINDOW = ((-4.0, 4.0), (-4.0, 4.0))


def bands(system, path, bounds, count=9, starts=4):
    return chaotic_bands(system, path, bounds, count=count, starts=starts, window=WINDOW)


@pytest.fixture(scope="module")
def quasi_periodic_band():
    """Where the paper has quasi-periodic motions (errata 22), at Hhat = 0.2."""
    return bands(forced(0.2), "load.frequency", (0.35, 0.43))


def test_the_band_that_the_paper_calls_quasi_periodic_is_chaotic(quasi_periodic_band):
    (band,) = quasi_periodic_band.bands
    assert 0.36 < band.low < 0.37  # the issue and numerics.md: chaotic at 0.38, period 1 at 0.36, a cascade ends at 0.3994
    assert 0.385 < band.high < 0.3995
    assert band.exponent - band.error > 0.0
    assert band.exponent == pytest.approx(0.03, abs=0.012)


def test_an_edge_lies_between_a_value_with_chaos_and_one_without(quasi_periodic_band):
    (band,) = quasi_periodic_band.bands
    step = np.diff(quasi_periodic_band.tried.values)[0]
    assert band.low - band.before == pytest.approx(step / 2**7)
    assert band.after - band.high == pytest.approx(step / 2**7)


def test_settled_motions_show_their_cycle_alone(quasi_periodic_band):
    tried = quasi_periodic_band.tried
    shown = np.isfinite(tried.states[..., 0]).sum(axis=2)
    assert (shown[tried.chaotic] == tried.states.shape[2]).all()
    assert (shown[~tried.chaotic & ~tried.undecided] <= 16).all()


def test_there_is_no_chaos_in_a_linear_oscillator():
    linear = System(
        model=WallOscillator(stiffness=1.0, damping=0.1, wall=50.0), load=Load(frequency=1.0, force=Harmonic(amplitude=0.1))
    )
    found = bands(linear, "load.frequency", (0.5, 2.0))
    assert found.bands == ()
    assert not found.tried.undecided.any()


def test_transients_of_chaos_at_high_frequency_make_no_band():
    """numerics.md and the issue: Omega = 4, Hhat between 7.2 and 7.7."""
    found = bands(forced(7.4, 4.0), "load.horizontal.amplitude", (7.2, 7.7), count=3)
    assert found.bands == ()
    assert found.tried.undecided.any()  # it does look like chaos for hundreds of periods


@pytest.mark.thorough
def test_results_do_not_depend_on_the_run(quasi_periodic_band):
    again = bands(forced(0.2), "load.frequency", (0.35, 0.43))
    assert again.bands == quasi_periodic_band.bands
    assert np.array_equal(again.tried.states, quasi_periodic_band.tried.states, equal_nan=True)


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"path": "load.freq"}, "did you mean 'load.frequency'"),
        ({"bounds": (2.0, 1.0)}, "the smaller one first"),
        ({"bounds": (0.5, np.nan)}, "the smaller one first"),
        ({"count": 0}, "count must"),
        ({"starts": 1.5}, "starts must be a whole number"),
        ({"window": 3}, "window must be"),
        ({"system": System(model=forced(1.0).model, load=Load(vertical=-0.5))}, "give the Load a frequency"),
    ],
)
def test_bad_use_is_answered_with_a_sentence(change, says):
    given = {"system": forced(1.0), "path": "load.frequency", "bounds": (0.5, 2.0)} | change
    with pytest.raises(ParameterError, match=says):
        chaotic_bands(**given)


def hand_made(*spans):
    values = np.linspace(0.0, 1.0, 11)
    nothing = np.zeros((11, 1))
    tried = Tried(values, nothing > 0, nothing, nothing, nothing > 0, np.zeros((11, 1, 4, 2)), np.zeros((11, 1, 4)))
    return Bands("x", tuple(Band(low, high, low - 0.001, high + 0.001, 0.1, 0.01) for low, high in spans), tried)


def test_an_edge_is_marked_by_the_nearest_special_point_within_reach():
    marked = hand_made((0.2, 0.4)).marked([("GR", 0.1995), ("PD", 0.35), ("LP", 0.41)])
    (band,) = marked.bands
    assert (band.low_mark, band.high_mark) == ("GR", "")


def test_bands_become_a_dataset_also_where_there_are_none():
    assert band_dataset().sizes["band"] == 0
    data = hand_made((0.2, 0.4)).to_datasets()["bands"]
    assert data["kind"].values.tolist() == ["CH"]
    assert data["low_mark"].values.tolist() == ["none"]
