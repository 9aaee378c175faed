"""What a plan refuses, and what it says of itself."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from saltus.errors import ParameterError
from saltus.sweep import Variable, run
from saltus.sweep.chunks import ChunkGrid
from saltus.sweep.plan import as_json, differences

GRID = np.linspace(0.0, 1.0, 4)


@pytest.mark.parametrize(
    ("entry", "sentence"),
    [
        ({"function": "wavse"}, "has no 'wavse'; did you mean 'waves'"),
        ({"function": "not_a_function"}, "is of type int, not a function"),
        (
            {"arguments": {"a": {"b": [1, np.arange(2)]}}},
            r"arguments\['a'\]\['b'\]\[1\] is of type ndarray",
        ),
        ({"arguments": {"a": float("nan")}}, r"arguments\['a'\] is nan"),
        ({"arguments": {1: 2}}, "has the key 1; keys are strings"),
        ({"attrs": {"system": object()}}, r"attrs\['system'\] is of type object"),
        ({"attrs": {"plan": 1}}, "must not have the key 'plan'"),
        ({"axes": {}}, "at least one axis"),
        ({"axes": {"x": GRID, "y": np.zeros((2, 2))}}, "axis 'y' must be a 1-D array"),
        ({"axes": {"x": GRID, "y": []}}, "axis 'y' must be a 1-D array"),
        ({"axes": {"x": GRID, "y": [0.0, np.nan]}}, "of finite numbers"),
        ({"axes": {"x": GRID, "y": ["a"]}}, "axis 'y' must be a 1-D array"),
        ({"axes": {"x": GRID, "a/b": GRID}}, "'a/b' cannot be the name of an axis"),
        ({"axes": {"x": GRID, "Height": GRID}, "chunk": {}}, "differ in their capitals alone"),
        ({"chunk": {"z": 2}}, "the axis 'z', which the plan does not have"),
        (
            {"chunk": {"x": 0}},
            r"chunk\['x'\] must be a whole number of points of at least 1, got 0",
        ),
        ({"chunk": {"x": 1.5}}, "got 1.5"),
        ({"chunk": {"x": True}}, "got True"),
        ({"variables": {}}, "at least one variable"),
        ({"variables": {"height": "f8"}}, "must be a Variable, got 'f8'"),
        ({"chunk": 3}, "chunk must be a dict, got 3"),
        ({"axes": ("a", "b")}, r"axes must be a dict, got \('a', 'b'\)"),
        ({"variables": 2}, "variables must be a dict, got 2"),
        ({"attrs": 1e3}, "attrs must be a dict, got 1000.0"),
        ({"variables": {"x": Variable()}}, "'x' names two things"),
        ({"variables": {"height": Variable(extra=(("y", 2),))}}, "'y' names two things"),
        ({"variables": {"k": Variable(extra=(("k", 2),))}}, "'k' names two things"),
        (
            {"variables": {"a": Variable(extra=(("k", 2),)), "b": Variable(extra=(("k", 3),))}},
            "has the sizes 2 and 3",
        ),
        ({"variables": {"a": Variable(extra=(("k", 2), ("k", 2)))}}, "'a' has a dimension twice"),
        ({"variables": {"zarr.json": Variable()}}, "cannot be the name of a variable"),
    ],
)
def test_a_plan_without_meaning_is_refused(waves_plan, entry, sentence):
    with pytest.raises(ParameterError, match=sentence):
        waves_plan(**entry)


@pytest.mark.parametrize(
    ("function", "sentence"),
    [
        ("no_such_module:f", "'no_such_module' cannot be imported"),
        ("__main__:f", "is in a script"),
        ("waves", "must be 'package.module:name', got 'waves'"),
        (":waves", "must be 'package.module:name'"),
        (len, "must be 'package.module:name', got <built-in"),
    ],
)
def test_a_function_that_cannot_be_imported_is_refused(waves_plan, function, sentence):
    plan = waves_plan()
    with pytest.raises(ParameterError, match=sentence):
        type(plan)(function=function, axes=plan.axes, variables=plan.variables)


@pytest.mark.parametrize(
    ("entry", "sentence"),
    [
        ({"dtype": "U8"}, "boolean, integer, real or complex"),
        ({"dtype": "g"}, "of up to 64 bits"),
        ({"dtype": "f9"}, "a NumPy type such as 'f8'"),
        ({"extra": (("k", 0),)}, "size of at least 1"),
        ({"extra": (("a b", 2),)}, "'a b' cannot be the name of a dimension"),
        ({"attrs": {"units": {1}}}, r"attrs\['units'\] is of type set"),
        ({"dtype": "u1", "fill": -1}, "fill must be a value of type uint8, got -1"),
    ],
)
def test_a_variable_without_meaning_is_refused(entry, sentence):
    with pytest.raises(ParameterError, match=sentence):
        Variable(**entry)


@pytest.mark.parametrize(
    ("wrong", "sentence"),
    [
        (
            "no dict",
            r"returned for chunk 0/0 \(x 0 to 0.166667, y 0 to 1\) a list; a dict of arrays",
        ),
        ("missing", "no 'count'"),
        ("too many", "'heigth', which is not a variable of the plan; did you mean 'height'"),
        ("shape", r"'height' of shape \(3, 2\); \(2, 3\) is expected, along x, y"),
        ("type", "'count' of type float64; the plan says int32"),
        ("range", "'count' with values from .* too large for int32"),
    ],
)
def test_what_a_function_returns_is_what_was_planned(waves_plan, tmp_path, wrong, sentence):
    with pytest.raises(ParameterError, match=sentence):
        run(waves_plan("returns", {"wrong": wrong}), tmp_path / "s")


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        ({"workers": 0}, "workers must lie in"),
        ({"workers": 1.5}, "workers must be a whole number"),
        ({"retries": -1}, "retries must lie in"),
        ({"retries": None}, "retries must be"),
        ({"scheduler": "localhost"}, "an address such as 'tcp://host:8786'"),
        ({"scheduler": "tcp://localhost:1", "workers": 2}, "are given both"),
        ({"progress": 3}, "progress must be a function"),
        ({"store": 3}, "store must be the path of a folder"),
        ({"store": "s3://a/b"}, "got the address"),
    ],
)
def test_a_run_without_meaning_is_refused(waves_plan, arguments, sentence):
    with pytest.raises(ParameterError, match=sentence):
        run(waves_plan(), **arguments)


@given(st.lists(st.tuples(st.integers(1, 12), st.integers(1, 12)), min_size=1, max_size=3))
@settings(max_examples=60, deadline=None)
def test_chunks_cover_every_point_once(sizes):
    names = "abc"[: len(sizes)]
    chunks = ChunkGrid(
        {n: size for n, (size, _) in zip(names, sizes, strict=True)},
        {n: c for n, (_, c) in zip(names, sizes, strict=True)},
    )
    hits = np.zeros([size for size, _ in sizes], dtype=int)
    indices = list(chunks.indices())
    for index in indices:
        hits[chunks.slices(index)] += 1
    assert (hits == 1).all()
    assert len(indices) == chunks.total


def test_arguments_reach_the_function_as_json_gives_them_back():
    given_ = {
        "pair": (1, 2.5),
        "flag": True,
        "none": None,
        "number": np.float64(0.1),
        "count": np.int64(3),
        "on": np.bool_(True),
    }
    there = as_json(given_, "arguments")
    assert there == {
        "pair": [1, 2.5],
        "flag": True,
        "none": None,
        "number": 0.1,
        "count": 3,
        "on": True,
    }
    assert [type(there[name]) for name in ("number", "count", "on")] == [float, int, bool]


def test_differences_look_into_texts_that_are_json():
    there = {"system": '{"model": {"beta0": 1.4}}', "seed": 1, "gone": 2, "flag": 1}
    here = {"system": '{"model": {"beta0": 1.5}}', "seed": 1, "new": 3, "flag": True}
    assert list(differences(there, here)) == [
        "system.model.beta0 is 1.4 there and 1.5 here",
        "gone is 2 there and not given here",
        "flag is 1 there and True here",
        "new is 3 here and not given there",
    ]
    assert list(differences(there, there)) == []
