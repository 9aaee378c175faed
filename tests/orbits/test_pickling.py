"""Orbits, branches and verdicts are pickled and copied: to processes, to disk, to a colleague with
the same models.
"""

import copy
import pickle

import numpy as np
import pytest

import saltus


@pytest.fixture(scope="module")
def orbit():
    load = saltus.Load(frequency=1.0, horizontal=saltus.Harmonic(0.5), vertical=-0.5)
    model = saltus.Metainterface(beta0=np.deg2rad(80), damping=0.1)
    return saltus.find_orbit(
        saltus.System(model=model, load=load, impact=saltus.VelocityReduction(1.0)), theta=0.3
    )


@pytest.mark.parametrize(
    "again",
    [lambda found: pickle.loads(pickle.dumps(found)), copy.deepcopy],
    ids=["pickle", "copy"],
)
def test_a_branch_that_is_read_back_is_solved_as_before(orbit, again):
    branch = saltus.continue_orbit(orbit, "load.frequency", (0.99, 1.01))
    (before,), (after,) = branch.at(1.003), again(branch).at(1.003)
    np.testing.assert_array_equal(before.solution.unknowns, after.solution.unknowns)
    assert again(branch).to_xarray().equals(branch.to_xarray())


def test_an_orbit_that_is_read_back_moves_as_before(orbit):
    read = pickle.loads(pickle.dumps(orbit))
    assert read.motion().at(3.0) == orbit.motion().at(3.0)
    assert read.system == orbit.system


def test_orbits_with_several_contacts_are_pickled():
    load = saltus.Load(frequency=1.0, force=saltus.Harmonic(2.0))
    system = saltus.System(model=saltus.TwoStops(), load=load, impact=saltus.NewtonImpact(0.7))
    found = saltus.find_orbit(system, x=0.3)
    read = pickle.loads(pickle.dumps(found))
    np.testing.assert_array_equal(read.multipliers, found.multipliers)
