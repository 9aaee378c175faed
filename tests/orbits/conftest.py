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


ELSEWHERE = ("ground, restitution of energy", "a user's smooth model", "smoothed", "rocking block")  # each compiles for itself


@pytest.fixture(params=[pytest.param(n, marks=[pytest.mark.thorough] * (n in ELSEWHERE)) for n in ORBITS])
def name(request):
    """The name of a case."""
    return request.param


@pytest.fixture
def orbit(name):
    """Its orbit."""
    return orbit_of(name)
