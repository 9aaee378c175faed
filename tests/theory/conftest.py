"""Fixtures for the closed forms."""

import math

import pytest
from theory_references import integrate


@pytest.fixture
def by_scipy():
    """The independent integrator."""
    return integrate


@pytest.fixture
def beta80():
    """The paper's beta0."""
    return math.radians(80)
