"""Orbits, special points and branches as JSON and arrays: what comes back is the same bit for bit,
and nothing else is made.
"""

import numpy as np
import pytest
import xarray as xr
from shared_systems import forced

import saltus
from saltus.errors import ParameterError
from saltus.orbits import as_json, from_json, switch_branch
from saltus.sweep.store_files import packed, unpacked

FREQUENCY = "load.frequency"


LOSSY = {"load.horizontal.amplitude": 0.15, "load.frequency": 0.2, "impact.e": 0.3}
FAMILIES = {"through folds and grazings": ({}, (0.25, 1.0)), "resting": (LOSSY, (0.19, 0.21))}


def family(name):
    changes, bounds = FAMILIES[name]
    return saltus.continue_orbit(
        saltus.find_orbit(forced().with_(changes), theta=0.3), FREQUENCY, bounds
    )


def assert_same(branch, back):
    """Places, tangents and equations of all points, what joins them, and the datasets."""
    for one, other in zip(branch.points, back.points, strict=True):
        np.testing.assert_array_equal(one.place, other.place)
        np.testing.assert_array_equal(one.tangent, other.tangent)
        for name, values in vars(one.orbit.solution.evaluation).items():
            if not name.startswith("_"):
                np.testing.assert_array_equal(
                    values, getattr(other.orbit.solution.evaluation, name)
                )
    joined = [[each.is_joined(i) for i in range(len(each.points) - 1)] for each in (branch, back)]
    assert joined[0] == joined[1]
    xr.testing.assert_identical(branch.to_xarray(), back.to_xarray())


@pytest.mark.parametrize("name", FAMILIES)
def test_a_branch_comes_back_bit_for_bit(name):
    branch = family(name)
    content = packed(as_json(branch))
    back = from_json(unpacked(content))
    assert_same(branch, back)
    assert packed(as_json(back)) == content


def test_what_is_born_at_a_special_point_that_came_back_is_the_same():
    branch = family("through folds and grazings")
    special = next(point for point in branch.special if point.kind == "BPC")
    born, again = (
        switch_branch(point, (0.25, 1.0), both=False)
        for point in (special, from_json(as_json(special)))
    )
    for one, other in zip(born, again, strict=True):
        assert_same(one, other)


@pytest.mark.parametrize(
    "record",
    [
        None,
        {},
        {"objects": [], "found": {"object": 0}},
        {"objects": [["print", ["harm"]]], "found": {"object": 0}},
        {"objects": [["saltus.__main__", []]], "found": None},
        {"objects": [["Branch", [1]]], "found": {"object": 0}},
        {"objects": [["System", ["{}"]]], "found": {"object": 0}},
        {"objects": [], "found": {"enum": ["SpecialKind", "nothing"]}},
    ],
)
def test_a_record_of_anything_else_is_refused_and_runs_nothing(record, capsys):
    with pytest.raises(ParameterError, match=r"no record of orbits|model"):
        from_json(record)
    assert capsys.readouterr().out == ""
