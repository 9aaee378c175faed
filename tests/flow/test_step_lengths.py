"""The length of a step: what it takes from earlier terms than the last ones."""

import math

import numpy as np
import pytest

from saltus.flow.kernel.layout import GAP, PAIR_GAP
from saltus.flow.kernel.steps import grow_faster, growth, step_size, surely_slower


def largest_growth(series, order, size):
    """The growth by the last two terms, with which that of earlier ones is compared."""
    return max(growth(series, k, k, size) for k in (order - 1, order))


def grows_faster(series, order, size):
    """Whether some earlier terms shorten the step: the three questions of `step_size`."""
    largest = largest_growth(series, order, size)
    pairs = [
        grow_faster(series, k - 1, k, size, largest + pair * PAIR_GAP / order)
        for pair, k in ((1, order - 2), (2, order - 4))
    ]
    return any(pairs) or grow_faster(series, order // 2, order - 2, size, largest + GAP)


@pytest.mark.parametrize("order", [12, 18, 19, 21])
@pytest.mark.parametrize("kind", ["geometric", "entire", "even", "uneven"])
def test_earlier_terms_are_left_out_only_where_they_are_small(order, kind):
    rng = np.random.default_rng(order)
    k = np.arange(order + 2)
    seen = set()
    for _ in range(400):
        series = rng.normal(size=(rng.integers(1, 4), k.size))
        series *= np.exp(3.0 * rng.normal() - 2.0 * rng.normal() * k)
        if kind == "entire":
            series /= [math.gamma(1.0 + n) for n in k]
        if kind == "even":
            series[:, 1::2] *= 1e-8
        if kind == "uneven":
            series *= np.exp(rng.normal(size=series.shape) * rng.uniform(0.0, 3.0))
        size = np.abs(series[:, 0]).max() * math.exp(rng.normal())
        left_out = surely_slower(series, order, largest_growth(series, order, size))
        looked_at = grows_faster(series, order, size)
        assert not (left_out and looked_at)
        seen.add(left_out)
    assert True in seen or order < 18 or kind == "even"


def test_the_radius_of_a_geometric_series_is_found_without_earlier_terms():
    """1 / (1 - x / r): the last two terms say r."""
    order, radius, tol = 18, 0.3, 1e-12
    series = radius ** -np.arange(order + 2.0)[None, :]
    assert surely_slower(series, order, largest_growth(series, order, 1.0))
    step = step_size(series, order, 1.0, math.log(tol))
    assert step == pytest.approx(0.9 * radius * tol ** (1.0 / (order - 1)), rel=1e-12)


def test_what_is_not_a_number_is_looked_at():
    series = np.full((1, 20), np.nan)
    assert not surely_slower(series, 18, -np.inf)
