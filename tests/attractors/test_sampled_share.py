"""The interval of a share that a sample gives, against SciPy's."""

import math

import pytest
from scipy.stats import binomtest

from saltus.attractors import share_interval


@pytest.mark.parametrize(("number", "sample"), [(0, 30), (1, 30), (7, 40), (30, 30), (3, 5000)])
def test_the_interval_is_wilsons(number, sample):
    known = binomtest(number, sample).proportion_ci(0.95, method="wilson")
    assert share_interval(number, sample) == pytest.approx((known.low, known.high), abs=1e-5)


def test_there_is_no_interval_without_a_sample():
    assert all(math.isnan(end) for end in share_interval(0, 0))
