"""What `print` shows of a tree of results: a line for each group, and of many groups the first."""

import pytest
import xarray

import saltus
from saltus.result_tree import MOST_GROUPS, ResultTree

LONGEST = 25  # lines: what a screen shows without scrolling


def groups(count):
    """A tree of `count` groups, each of one variable over a dimension of five."""
    data = xarray.Dataset({"value": ("point", range(5))})
    return ResultTree.from_dict({f"curves/curve_{i:02d}": data for i in range(count)})


@pytest.mark.parametrize("count", [1, MOST_GROUPS, MOST_GROUPS + 1, 300])
def test_a_tree_prints_on_one_screen(count):
    shown = str(groups(count)).splitlines()
    assert len(shown) <= LONGEST
    named = [line for line in shown[1:-1] if "curve_" in line]
    assert all(line.endswith("1 variable over point 5") for line in named)
    left_out = [line for line in shown if line.strip().startswith("…")]
    told = int(left_out[0].split()[1]) if left_out else 0
    assert len(named) + told == count


def test_a_group_prints_its_numbers():
    """One group is printed as xarray does it, with its values."""
    tree = groups(2)
    assert "0 1 2 3 4" in repr(tree["curves/curve_00"])
    assert repr(tree["curves"]).count("curve_0") == repr(tree).count("curve_0")


def test_a_diagram_prints_on_one_screen_computed_and_read_back(spectrum, tmp_path):
    path = saltus.save(tmp_path / "diagram.nc", spectrum)
    for tree in (spectrum, saltus.load(path)):
        shown = str(tree)
        assert len(shown.splitlines()) <= LONGEST
        for name, part in tree.children.items():
            if part.data_vars:
                assert f"  {name} " in shown
    assert repr(saltus.load(path)) == repr(spectrum)
