"""A quantity of one's own over a grid: what it returns, where its function may stand, and how it
goes on.
"""

import functools
import os
import subprocess
import sys
import threading

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
    """But for two of the kept points, by which a change is noticed that no digest can tell."""
    log, broken = tmp_path / "log.txt", tmp_path / "broken"

    def fragile(x, y):
        with log.open("a") as file:
            print(x, y, file=file)
        if broken.exists() and x == 2.0:
            raise ValueError("no answer here")
        return x * y

    broken.touch()
    with pytest.raises(SweepError, match="no answer here"):
        saltus.map_over(fragile, GRID, store=tmp_path / "kept.zarr", retries=0)
    log.unlink()
    broken.unlink()
    data = saltus.map_over(fragile, GRID, store=tmp_path / "kept.zarr")
    asked = log.read_text().splitlines()
    assert len(asked) == 4
    assert not {"2.0 0.0", "2.0 10.0"} - {*asked}
    np.testing.assert_array_equal(data.value, np.multiply.outer(GRID["x"], GRID["y"]))
    log.unlink()
    saltus.map_over(fragile, GRID, store=tmp_path / "kept.zarr")
    assert not log.exists()


def scaled(a, x):
    return a * x


def shifted(a, x):
    return a + 3 * x


class Times:
    def __init__(self, a):
        self.a = a

    def __call__(self, x):
        return self.a * x

    def method(self, x):
        return self.a * x


def closed_over(a):
    return lambda x: a * x


def with_default(a):
    return lambda x, a=a: a * x


def with_global(value, body="wall.get('load.force') * x"):
    space = {"wall": value, "np": np, "__name__": "a_user"}
    exec(f"def helper(x): return wall(x)\ndef asked(x): return {body}", space)
    return space["asked"]


def wall(damping):
    model = saltus.WallOscillator(damping=damping)
    return saltus.System(model=model, load=saltus.Load(force=damping))


# each makes a function of 2 or of 3, which gives other values for them
MAKERS = {
    "a partial call": lambda a: functools.partial(scaled, a),
    "another partial call": lambda a: functools.partial(scaled if a == 2 else shifted, 2),
    "an object": Times,
    "a method": lambda a: Times(a).method,
    "a closure": closed_over,
    "a default": with_default,
    "a global number": lambda a: with_global(a, "wall * x"),
    "a global array": lambda a: with_global(np.array([1.0, a]), "wall[1] * x"),
    "a global system": lambda a: with_global(wall(float(a))),
    "a global function": lambda a: with_global(closed_over(a), "wall(x)"),
    "a function of a function": lambda a: with_global(closed_over(a), "helper(x)"),
    "a deep value": lambda a: with_global({"a": [(1, {"b": Times(a)})]}, "wall['a'][0][1]['b'](x)"),
    "one's own code": lambda a: with_global(0, f"{a} * x"),
    "a nested function": lambda a: with_global(0, f"(lambda y: {a} * y)(x)"),
    "another function": lambda a: with_global(0, ["np.sinh(x)", "np.cosh(x)"][a - 2]),
    "lambdas of one line": lambda a: [lambda x: 2 * x, lambda x: 3 * x][a - 2],
}


@pytest.mark.parametrize("how", MAKERS)
def test_a_store_of_another_function_is_refused(how, tmp_path):
    """Never the answers of the old one; and the same function, made anew, goes on."""
    make, store, grid = MAKERS[how], tmp_path / "kept.zarr", {"x": [1.0, 2.0]}
    before = saltus.map_over(make(2), grid, store=store)
    assert not np.array_equal(before.value, saltus.map_over(make(3), grid).value)
    with pytest.raises(ParameterError, match=r"has changed since .*remove_store") as refusal:
        saltus.map_over(make(3), grid, store=store)
    assert refusal.value.parameter == "store"
    again = saltus.map_over(make(2), grid, store=store)
    np.testing.assert_array_equal(again.value, before.value)


def test_digests_are_those_of_other_processes(tmp_path):
    """Whatever seed the hashes of texts have: a store is gone on with after a restart."""
    script = tmp_path / "a_script.py"
    script.write_text(
        "import functools, sys, numpy as np, saltus\nfrom saltus.sweep.content import"
        " contents_of\nwords = {'one', 'two', 'three', 'four'}\ntable = {word: np.arange(3) for"
        " word in words}\nblock = saltus.PhysicalBlock(half_width=0.2, half_height=0.8)\nclass"
        " Rule:\n    def __init__(self): self.rule = self\n    def __call__(self, x): return x in"
        " words\nrule = Rule()\ndef asked(x):\n    return len(table) * x if x in {1.0, 2.0} or 'a'"
        " in {'b', 'c'} else rule(x) + block.alpha\nprint(sorted(contents_of(asked).items()))\n"
    )
    found = set()
    for seed in ("1", "2", "3"):
        environment = {**os.environ, "PYTHONHASHSEED": seed}
        done = subprocess.run(
            [sys.executable, script], env=environment, capture_output=True, text=True, check=True
        )
        found.add(done.stdout)
    assert len(found) == 1
    assert "global table" in found.pop()


def test_what_cannot_be_digested_is_refused_by_its_name(tmp_path):
    lock = threading.Lock()

    def locked(x):
        with lock:
            return x

    with pytest.raises(ParameterError, match=r"value lock holds .*lock.*cannot be digested"):
        saltus.map_over(locked, {"x": [1.0]}, store=tmp_path / "kept.zarr")
    assert saltus.map_over(locked, {"x": [1.0]}).value == 1.0


def test_a_file_that_has_changed_is_noticed_where_a_store_is_gone_on_with(tmp_path):
    """A digest does not see what a function reads from elsewhere."""
    file, broken = tmp_path / "factor.txt", tmp_path / "broken"

    def asked(x):
        if broken.exists() and x == 3.0:
            raise ValueError("no answer here")
        return float(file.read_text()) * x

    file.write_text("2.0")
    broken.touch()
    with pytest.raises(SweepError):
        saltus.map_over(asked, {"x": [1.0, 2.0, 3.0]}, store=tmp_path / "k.zarr", retries=0)
    broken.unlink()
    file.write_text("2.5")
    with pytest.raises(ParameterError, match=r"keeps .*something .*function reads has changed"):
        saltus.map_over(asked, {"x": [1.0, 2.0, 3.0]}, store=tmp_path / "k.zarr")
    file.write_text("2.0")
    data = saltus.map_over(asked, {"x": [1.0, 2.0, 3.0]}, store=tmp_path / "k.zarr")
    np.testing.assert_array_equal(data.value, [2.0, 4.0, 6.0])


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


@pytest.mark.parametrize("store", ["x" * 300, "/" + "y" * 300])
def test_a_store_with_too_long_a_name_is_one_sentence(store):
    with pytest.raises(ParameterError, match="store must be the path of a folder"):
        saltus.map_over(total, GRID, store=store)
