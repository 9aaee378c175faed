"""Orbits that several tests look at are found once."""

import functools

import pytest
from orbit_cases import ORBITS

from saltus import find_orbit


@functools.cache
def orbit_of(name):
    """The orbit of one of the cases."""
    system, paths, start = ORBITS[name]
    return find_orbit(system, parameters=paths, **start)


@pytest.fixture(params=ORBITS)
def name(request):
    """The name of a case."""
    return request.param


@pytest.fixture
def orbit(name):
    """Its orbit."""
    return orbit_of(name)
