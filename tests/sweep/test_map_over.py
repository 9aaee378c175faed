"""A quantity of one's own over a grid: what it returns, where its function may stand, and how it
goes on.
"""

import numpy as np
import pytest

import saltus
from saltus.errors import ParameterError, SweepError

GRID = {"x": [1.0, 2.0, 3.0], "y": [0.0, 10.0]}


def total(x, y):
    return x + y


def several(x, y):
    return {
        "sum": x + y,
        "powers": [x, x**2, x**3],
        "whole": int(x),
        "true": x > y,
        "wave": np.exp(1j * x),
    }


def test_a_number_at_every_point_is_the_variable_value():
    data = saltus.map_over(total, GRID)
    assert data.value.dims == ("x", "y")
    np.testing.assert_array_equal(data.value, [[1.0, 11.0], [2.0, 12.0], [3.0, 13.0]])
    np.testing.assert_array_equal(data.x, GRID["x"])


def test_names_arrays_and_complex_numbers_are_kept():
    data = saltus.map_over(several, GRID, chunk={"y": 2})
    np.testing.assert_array_equal(data["sum"], [[1.0, 11.0], [2.0, 12.0], [3.0, 13.0]])
    assert data.powers.dims == ("x", "y", "powers_0")
    np.testing.assert_array_equal(data.powers.sel(x=2.0, y=10.0), [2.0, 4.0, 8.0])
    np.testing.assert_array_equal(data.true[:, 0], 1.0)
    np.testing.assert_allclose(data.wave[:, 0], np.exp(1j * np.array(GRID["x"])))


@pytest.mark.parametrize("where", ["a module", "another function", "a notebook"])
def test_processes_find_a_function_wherever_it_stands(where, tmp_path):
    factor = 2.0
    function = total if where == "a module" else (lambda x, y: factor * total(x, y))
    if where == "a notebook":  # it is in no file, and its module is __main__ in every process
        cell: dict = {"__name__": "__main__", "saltus": saltus, "fall": saltus.Load(force=2.0)}
        exec(
            "def function(x, y):\n    return fall.force(0.0) * (x + y) if saltus.Load else 0.0\n",
            cell,
        )
        function = cell["function"]
    data = saltus.map_over(function, GRID, store=tmp_path / "kept.zarr", workers=2)
    np.testing.assert_array_equal(
        data.value, (1.0 if where == "a module" else 2.0) * np.add.outer(GRID["x"], GRID["y"])
    )


def test_what_is_kept_is_not_computed_again_after_a_failure(tmp_path):
    asked, broken = [], [True]

    def fragile(x, y):
        asked.append((x, y))
        if broken[0] and x == 2.0:
            raise ValueError("no answer here")
        return x * y

    with pytest.raises(SweepError, match="no answer here"):
        saltus.map_over(fragile, GRID, store=tmp_path / "kept.zarr", retries=0)
    asked.clear()
    broken[0] = False
    data = saltus.map_over(fragile, GRID, store=tmp_path / "kept.zarr")
    assert sorted(asked) == [(2.0, 0.0), (2.0, 10.0)]
    np.testing.assert_array_equal(data.value, np.multiply.outer(GRID["x"], GRID["y"]))
    asked.clear()
    saltus.map_over(fragile, GRID, store=tmp_path / "kept.zarr")
    assert not asked


def test_other_points_are_computed_where_the_function_raises_at_the_first():
    with pytest.raises(
        SweepError, match=r"1 of 3 chunks failed: chunk 0 \(x 0\): ZeroDivisionError"
    ) as raised:
        saltus.map_over(lambda x: 1 / x, {"x": [0.0, 2.0, 4.0]})
    np.testing.assert_array_equal(raised.value.dataset.value, [np.nan, 0.5, 0.25])
    with pytest.raises(
        SweepError,
        match=r"raised at each of the 2 points: TypeError: .* at the first, x 0.0, y 1.0",
    ):
        saltus.map_over(lambda x: 1 / x, {"x": [0.0, 2.0], "y": [1.0]})


def test_a_number_over_one_name_or_two_is_drawn_and_a_part_of_more():
    one = saltus.plot(saltus.map_over(lambda x: 2 * x, {"x": [1.0, 2.0, 3.0]}))
    assert (one.get_xlabel(), one.get_ylabel()) == ("x", "value")
    np.testing.assert_array_equal(one.lines[0].get_xydata(), [[1.0, 2.0], [2.0, 4.0], [3.0, 6.0]])
    two = saltus.plot(saltus.map_over(total, GRID))
    assert (two.get_xlabel(), two.get_ylabel()) == ("x", "y")
    np.testing.assert_array_equal(
        np.ravel(two.collections[0].get_array()), [1.0, 2.0, 3.0, 11.0, 12.0, 13.0]
    )
    # names of ensembles
    named = saltus.plot(
        saltus.map_over(lambda period: {"stop": 2 * period}, {"period": [1.0, 2.0]})
    )
    assert (named.get_xlabel(), named.get_ylabel()) == ("period", "stop")
    three = saltus.map_over(lambda x, y, z: x + y + z, GRID | {"z": [0.5, 0.7]})
    with pytest.raises(
        ParameterError, match=r"over one or two dimensions to draw; draw a part, as isel\(x=0\)"
    ):
        saltus.plot(three)
    assert saltus.plot(three.isel(z=1)).get_xlabel() == "x"


def test_a_store_of_another_text_or_another_grid_is_refused(tmp_path):
    store = tmp_path / "kept.zarr"
    saltus.map_over(lambda x: x + 1, {"x": [1.0]}, store=store)
    with pytest.raises(
        ParameterError, match=r"text of the function .* has changed since .*remove_store"
    ):
        saltus.map_over(lambda x: x + 2, {"x": [1.0]}, store=store)
    saltus.sweep.remove_store(store)
    saltus.map_over(total, GRID, store=store)
    with pytest.raises(ParameterError, match="is the store of another plan: axes"):
        saltus.map_over(total, GRID | {"y": [0.0, 11.0]}, store=store)


@pytest.mark.parametrize(
    ("function", "grid", "sentence"),
    [
        (3.0, GRID, "function must be a function"),
        (total, {}, "grid must be a dict"),
        (total, {"x": ["a"], "y": [0.0]}, "axis 'x' must be"),
        (lambda x, y: "word", GRID, "function must return numbers, got 'word' at"),
        (lambda x, y: {"a": None}, GRID, "function must return numbers, got as 'a' None"),
    ],
)
def test_what_has_no_meaning_is_refused(function, grid, sentence):
    with pytest.raises(ParameterError, match=sentence):
        saltus.map_over(function, grid)


def test_shapes_that_differ_are_refused():
    with pytest.raises(ParameterError, match="shape"):
        saltus.map_over(lambda x: np.ones(int(x)), {"x": [1.0, 2.0]}, retries=0)
