"""Orbits that several tests look at are found once."""

import pytest
from orbit_cases import ORBITS, orbit_of

# each compiles for itself
ELSEWHERE = ("ground, restitution of energy", "a user's smooth model", "smoothed", "rocking block")


@pytest.fixture(
    params=[pytest.param(n, marks=[pytest.mark.thorough] * (n in ELSEWHERE)) for n in ORBITS]
)
def name(request):
    """The name of a case."""
    return request.param


@pytest.fixture
def orbit(name):
    """Its orbit."""
    return orbit_of(name)
