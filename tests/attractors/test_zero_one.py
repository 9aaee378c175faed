"""The 0-1 test on series whose nature is known."""

from dataclasses import replace

import numpy as np
import pytest

from saltus import ParameterError, zero_one_test
from saltus.attractors.nonperiodic import _displacement, zero_one_of_bands


def logistic(rate, count, start=0.3, skip=200):
    values = [start]
    for _ in range(count + skip - 1):
        values.append(rate * values[-1] * (1 - values[-1]))
    return np.array(values[skip:])


def test_it_sees_the_chaos_of_the_logistic_map():
    found = zero_one_test(logistic(4.0, 2000))
    assert found.K > 0.98
    assert found.spread < 0.02
    assert found.samples == 2000


def test_it_sees_the_order_of_a_golden_rotation():
    found = zero_one_test(np.cos(2 * np.pi * (np.sqrt(5) - 1) / 2 * np.arange(2000)))
    assert abs(found.K) < 0.05


@pytest.mark.parametrize("rate", [2.9, 3.2, 3.5, 3.83])
def test_it_sees_order_on_cycles(rate):
    """The logistic map has attracting cycles of 1, 2, 4 and 3 steps at these rates."""
    assert abs(zero_one_test(logistic(rate, 1000, skip=4000)).K) < 0.1


@pytest.mark.parametrize(("rate", "bands"), [(3.575, 8), (3.59, 4), (3.65, 2)])
def test_chaos_in_several_bands_is_seen_on_every_nth_number(rate, bands):
    """Below 3.5926 the logistic map has chaos in 4 bands or more, below 3.6786 in 2. That it is
    chaos its exponent shows, the average of ln abs(f'), which has nothing to do with the test."""
    series = logistic(rate, 20_000)
    assert np.mean(np.log(np.abs(rate * (1 - 2 * series)))) > 0.05
    assert zero_one_test(series[:8000], every=bands).K > 0.95
    assert zero_one_of_bands(series[:8000]).K > 0.95
    assert zero_one_test(series[:8000], every=bands) == replace(
        zero_one_test(series[:8000:bands]), every=bands
    )


def test_weak_chaos_in_very_many_bands_looks_regular_to_it():
    """Why it has no vote on chaos: at the rate 3.57 the exponent is 0.0105, and K of 20 000 numbers
    is near 0.
    """
    series = logistic(3.57, 20_000, skip=10_000)
    assert np.mean(np.log(np.abs(3.57 * (1 - 2 * series)))) == pytest.approx(0.0105, abs=0.001)
    assert zero_one_test(series).K < 0.05


def test_it_sees_order_on_every_nth_number_of_a_torus():
    for rotation in ((np.sqrt(5) - 1) / 2, np.sqrt(2) - 1, np.pi - 3):
        assert zero_one_of_bands(np.cos(2 * np.pi * rotation * np.arange(4000))).K < 0.2


def test_a_mean_does_not_hide_anything():
    """The term that oscillates with the lag is taken out: it is what a mean adds."""
    series = logistic(4.0, 2000)
    assert zero_one_test(series + 50.0).K > 0.9
    rotation = np.cos(2 * np.pi * (np.sqrt(5) - 1) / 2 * np.arange(2000))
    assert abs(zero_one_test(rotation + 50.0).K) < 0.05


def test_a_series_that_is_sampled_too_finely_looks_regular():
    """The caveat: the same chaos, read 40 times a step, is smooth."""
    series = logistic(4.0, 200)
    fine = np.interp(np.arange(0, 199, 1 / 40), np.arange(200), series)
    assert zero_one_test(series).K > 0.9
    assert zero_one_test(fine).K < 0.3


def test_the_mean_square_displacement_is_that_of_its_definition():
    values, c, longest = logistic(3.9, 300) + 2.0, np.array([[0.9], [2.1]]), 30
    found = _displacement(values, c, longest)
    for row, frequency in zip(found, c[:, 0], strict=True):
        path = np.cumsum(values * np.exp(1j * frequency * np.arange(1, 301)))
        direct = [
            np.mean([abs(path[j + n] - path[j]) ** 2 for j in range(270)]) for n in range(1, 31)
        ]
        np.testing.assert_allclose(row, direct, rtol=1e-10)


def test_the_seed_fixes_the_answer():
    series = logistic(3.9, 500)
    assert zero_one_test(series, seed=3) == zero_one_test(series, seed=3)
    assert zero_one_test(series, seed=3) != zero_one_test(series, seed=4)


@pytest.mark.parametrize("series", [np.zeros(99), np.zeros((200, 2)), [np.nan] * 200, "chaos"])
def test_it_refuses_what_is_no_series(series):
    with pytest.raises(ParameterError, match=r"0-1 test|series must be"):
        zero_one_test(series)


def test_it_refuses_no_frequencies():
    with pytest.raises(ParameterError, match="count"):
        zero_one_test(logistic(4.0, 200), count=0)
