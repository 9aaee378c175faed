"""All branches of a diagram in few tables: each comes back as it was, from memory, from a file, and
by plain xarray or pandas.
"""

import numpy as np
import pytest
import xarray as xr
from shared_systems import forced
from study_cases import FREQUENCY

import saltus
from saltus.branch_tables import branch_tables, branches_of
from saltus.errors import ParameterError
from saltus.files import read_dataset, write_dataset
from saltus.orbits import orbits_of


@pytest.fixture(scope="module")
def branches():
    """Two branches with special points, of orbits with different numbers of impacts, and one whose
    orbits rest.
    """
    system = forced()
    lossy = system.with_(
        {"load.horizontal.amplitude": 0.15, "load.frequency": 0.2, "impact.e": 0.3}
    )
    wide = saltus.continue_orbit(saltus.find_orbit(system, theta=0.3), FREQUENCY, (0.25, 1.1))
    narrow = saltus.continue_orbit(
        saltus.find_orbit(system.with_({FREQUENCY: 1.05}), theta=0.3), FREQUENCY, (1.04, 1.06)
    )
    resting = saltus.continue_orbit(saltus.find_orbit(lossy, theta=0.3), FREQUENCY, (0.19, 0.21))
    return [branch.to_xarray() for branch in (wide, narrow, resting)]


@pytest.fixture(scope="module")
def tree(branches):
    return xr.DataTree.from_dict(branch_tables(branches))


def assert_same(back, branch):
    """The same variables, in any order, and the same that is said of a branch; the system is that
    of the first one.
    """
    xr.testing.assert_equal(back, branch)
    assert {name: variable.attrs for name, variable in back.variables.items()} == {
        name: variable.attrs for name, variable in branch.variables.items()
    }
    said = ("ends", "end_reasons", "end_kinds", "origin", "closed", "missed")
    assert {name: back.attrs[name] for name in said} == {name: branch.attrs[name] for name in said}


def test_every_branch_comes_back_as_it_was(branches, tree):
    assert branches[0].sizes["special"] > branches[1].sizes["special"] == 0
    assert branches[0].sizes["unknown"] > branches[1].sizes["unknown"]
    assert "releases" in branches[2]
    assert "releases" not in branches[0]
    for number, back in branches_of(tree):
        assert_same(back, branches[number])


def test_and_from_a_file(branches, tree, tmp_path):
    back = read_dataset(write_dataset(tmp_path / "branches.nc", tree))
    for number, branch in enumerate(branches):
        assert_same(saltus.branch_of(back, number), branch)
    orbits = orbits_of(saltus.branch_of(back, 1))
    assert [orbit.amplitude for orbit in orbits] == branches[1]["amplitude"].values.tolist()


def test_one_branch_is_a_short_line_of_xarray_or_pandas(branches, tree):
    points = tree["points"].to_dataset()
    with_xarray = points.isel(point=points.branch == 1)
    with_pandas = points.to_dataframe().groupby("branch").amplitude.max()
    np.testing.assert_array_equal(with_xarray["parameter"], branches[1]["parameter"])
    np.testing.assert_array_equal(with_pandas, [branch["amplitude"].max() for branch in branches])


def test_the_rows_of_each_branch_are_counted_as_cf_wants_it(branches, tree):
    for name, dim in (("points", "point"), ("special", "special")):
        count = tree["branches"][f"{dim}_count"]
        assert count.attrs["sample_dimension"] == dim
        assert count.values.tolist() == [branch.sizes[dim] for branch in branches]
        assert np.repeat(np.arange(3), count).tolist() == tree[name]["branch"].values.tolist()


def test_a_diagram_may_have_no_branches():
    assert list(branches_of(xr.DataTree.from_dict(branch_tables([])))) == []


def test_a_branch_that_is_not_there_is_refused(tree):
    with pytest.raises(ParameterError, match=r"number .* 2"):
        saltus.branch_of(tree, 3)
    with pytest.raises(ParameterError, match="no 'branches'"):
        saltus.branch_of(xr.DataTree(), 0)
