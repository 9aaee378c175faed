"""The questions of a study file: every key is an argument of its function, and every argument a
file can give is a key.
"""

import inspect
import re
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from saltus.cli.run_command import check
from saltus.config import load_study
from saltus.config.readers import read_pairs, read_values
from saltus.config.study import QUESTIONS, Ask, functions_of, keys_of
from saltus.errors import ParameterError

KEYS = {kind: set(keys_of(kind)) for kind in QUESTIONS}
FOR_PYTHON_ALONE = {
    "system",
    "progress",
    "store",
    "workers",
    "scheduler",
    "compute",
    "found",
    "known",
    "also",
    "functions",
}


@pytest.mark.parametrize("kind", QUESTIONS)
def test_the_keys_of_a_question_are_the_arguments_of_its_functions_of(kind):
    arguments = [
        argument
        for function in functions_of(kind)
        for argument in inspect.signature(function).parameters.values()
    ]
    named = {argument.name for argument in arguments if argument.kind is not argument.VAR_KEYWORD}
    assert KEYS[kind] == named - FOR_PYTHON_ALONE
    assert set(keys_of(kind, ("theta",))) - KEYS[kind] == (
        {"theta"} if kind in ("basins", "frequency_sweep", "prove") else set()
    )


@pytest.mark.parametrize("kind", QUESTIONS)
def test_every_function_that_answers_can_be_checked_alone(kind):
    assert all(callable(function.check) for function in functions_of(kind))


def test_the_first_function_that_takes_all_keys_answers():
    for kind in QUESTIONS:
        assert Ask(kind=kind, options={}).function is functions_of(kind)[0]
    assert (
        Ask(kind="stability_chart", options={"curves": 2, "rows": 3}).function.__name__
        == "bordered_chart"
    )
    assert (
        Ask(kind="response_spectrum", options={"bands": 2}).function.__name__ == "response_spectrum"
    )


def test_a_grid_is_evenly_spaced_or_a_list():
    np.testing.assert_array_equal(
        read_values({"from": 0, "to": 0.5, "count": 101}), np.linspace(0, 0.5, 101)
    )
    np.testing.assert_allclose(read_values(["-10 deg", 0, "10 deg"]), np.deg2rad([-10, 0, 10]))
    np.testing.assert_array_equal(read_values([3, 1, 2]), [3, 1, 2])
    assert read_pairs([[1, "90 deg"]]) == ((1.0, np.pi / 2),)
    with pytest.raises(
        ValueError,
        match=(
            r"^must be pairs of numbers, such as \[\[-2, 2\], \[-2, 2\]\], of which each .* "
            r"got 1$"
        ),
    ):
        read_pairs([1, 2])


@pytest.mark.parametrize(
    ("value", "problem"),
    [
        ({}, "has no from and no to and no count"),
        ({"from": 0, "to": 1}, "has no count"),
        ({"from": 0, "to": 1, "count": 2.5}, "has a count that must be a whole number, got 2.5"),
        ({"from": 0, "to": 1, "count": 1}, "needs a count from 2 to 100000, got 1"),
        ({"from": 0, "to": 1, "count": 10**9}, "needs a count from 2 to 100000"),
        ({"from": 0, "to": float("inf"), "count": 3}, "has a to that must be a finite number"),
        ({"from": "a", "to": 1, "count": 3}, "has a from that must be an angle"),
        (
            {"from": 1, "to": 1, "count": 3},
            "must go from the smaller number to the larger one, got from = 1, to = 1",
        ),
        ({"from": 0, "to": 1, "step": 0.1}, "has the unknown key 'step'"),
        ([], "got an empty list"),
        (1.0, "must be a list of numbers or a table such as"),
        ([[1]], "must be a number, got a list"),
        (None, "must be a list of numbers"),
    ],
)
def test_what_is_no_grid_is_told(value, problem):
    with pytest.raises(ValueError, match=r"^(has|needs|must)") as told:
        read_values(value)
    assert problem in str(told.value)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("asks")


JUNK = st.one_of(
    st.integers(),
    st.floats(),
    st.text(max_size=4),
    st.booleans(),
    st.lists(st.floats(), max_size=3),
    st.just({"from": 0, "to": 1}),
)


@settings(deadline=None, max_examples=150)
@given(kind=st.sampled_from(sorted(QUESTIONS)), data=st.data())
def test_junk_in_a_question_is_read_or_refused_in_one_sentence(folder, kind, data):
    import tomli_w

    key = data.draw(st.sampled_from([*sorted(KEYS[kind]), "theta", "other"]))
    tables = {"model": {"type": "Metainterface", "beta0": 1.4}, kind: {key: data.draw(JUNK)}}
    path = folder / "study.toml"
    path.write_bytes(tomli_w.dumps(tables).encode("utf-8", "surrogatepass"))
    try:
        told = key in load_study(path).asks[0].options
    except ParameterError as error:
        told = str(error).startswith(str(path)) and len(str(error).splitlines()) == 1
    assert told


# --- the page and the examples -----------------------------------------------

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "study.md").read_text(encoding="utf-8")
HEADS = re.compile(
    r"^((?:`\[\w+\]`(?: and )?)+)\n\n\| key \| default \| \|\n\|[-|]*\n((?:\|.*\n)+)", re.MULTILINE
)


def tables():
    """The rows of the page's table for each question: the keys and the text of the defaults."""
    for heads, rows in HEADS.findall(PAGE):
        cells = [row.split("|")[1:3] for row in rows.splitlines()]
        for kind in re.findall(r"`\[(\w+)\]`", heads):
            yield kind, [(re.findall(r"`(\w+)`", keys), default.strip()) for keys, default in cells]


def test_the_page_names_every_key_of_every_question():
    found = dict(tables())
    assert set(found) == set(QUESTIONS)
    for kind, rows in found.items():
        named = [key for keys, _ in rows for key in keys]
        assert set(named) - {"theta"} == KEYS[kind]
        assert f"| `[{kind}]` |" in PAGE


def test_the_numbers_on_the_page_are_the_defaults():
    compared = 0
    for kind, rows in tables():
        signature = {
            k: v
            for function in functions_of(kind)
            for k, v in inspect.signature(function).parameters.items()
        }
        for keys, default in rows:
            if len(keys) == 1 and keys[0] in signature and re.fullmatch(r"[\d.e-]+", default):
                assert signature[keys[0]].default == pytest.approx(float(default))
                compared += 1
    assert compared > 15


def test_the_questions_shown_on_the_page_can_be_asked(tmp_path):
    block = next(
        text
        for text in re.findall(r"```toml\n(.*?)```", PAGE, re.DOTALL)
        if "[phase_portrait]" in text
    )
    system = (
        '[model]\ntype = "Metainterface"\nbeta0 = 1.4\n[load]\nfrequency = 1\nhorizontal = '
        "{ amplitude = 0.1 }\n"
    )
    (tmp_path / "study.toml").write_text(system + block)
    asked = load_study(tmp_path / "study.toml").asks
    assert {ask.kind for ask in asked} == set(QUESTIONS) - {"response_spectrum"}


@pytest.mark.parametrize("name", ["phase_portrait", "resonance", "chart"])
def test_the_examples_ask_what_can_be_answered(name, tmp_path):
    study = load_study(ROOT / "examples" / f"{name}.toml")
    assert study.asks
    for ask in study.asks:
        check(study, ask, tmp_path / "out")
    assert not (tmp_path / "out").exists()
