"""Weighted averages and their error bars, against series whose mean and scatter are known."""

import numpy as np
import pytest

from saltus.attractors.lyapunov.growth import average, uncertainty, weights

GOLDEN = (np.sqrt(5) - 1) / 2


def test_weights_add_up_to_one_and_vanish_at_both_ends():
    w = weights(500)
    assert w.sum() == pytest.approx(1.0, abs=1e-14)
    assert w[0] < 1e-100
    np.testing.assert_allclose(w, w[::-1], rtol=1e-9, atol=0)


def test_the_average_of_a_quasi_periodic_series_converges_faster_than_any_power():
    errors = []
    for count in (100, 200, 400, 800):
        series = 0.7 + np.cos(2 * np.pi * GOLDEN * np.arange(count) + 0.3)
        errors.append(abs(float(average(series)) - 0.7))
    assert errors[-1] < 1e-13
    halvings = np.log2(np.array(errors[:-1]) / np.maximum(errors[1:], 1e-16))
    assert halvings.max() > 8  # the order of the convergence between two of the lengths
    plain = abs(float(series.mean()) - 0.7)
    assert plain > 1e-4


@pytest.mark.parametrize("memory", [0.0, 0.9, 0.98])
def test_error_bars_cover_the_true_mean_of_correlated_series_as_often_as_they_say(memory):
    """x_j = memory x_{j-1} + noise, whose mean is 0; the bars are wide enough in 95 of 100
    cases.
    """
    rng, count = np.random.default_rng(5), 4000
    noise = rng.standard_normal((count, 400))
    series = np.empty_like(noise)
    series[0] = noise[0] / np.sqrt(1 - memory**2)
    for j in range(1, count):
        series[j] = memory * series[j - 1] + noise[j]
    bars, covered = uncertainty(series), np.abs(average(series)) < uncertainty(series)
    assert covered.mean() > 0.92
    # and not by being endless: the standard error of the plain mean is (1 / (1 - memory)) /
    # sqrt(count)
    assert np.median(bars) < 5 * (1 / (1 - memory)) / np.sqrt(count)


def test_what_rests_is_minus_infinity_without_an_error_and_what_is_unknown_stays_so():
    series = np.zeros((40, 3))
    series[7, 1], series[9, 2] = -np.inf, np.nan
    np.testing.assert_array_equal(average(series), [0.0, -np.inf, np.nan])
    np.testing.assert_array_equal(uncertainty(series), [0.0, 0.0, np.nan])


def test_too_short_a_series_has_no_error_bar():
    with pytest.raises(ValueError, match="at least 16"):
        uncertainty(np.zeros(15))
