"""Parts of a search: each input is computed once, and found again by who asks next; texts come back as they were."""

import numpy as np
import pytest

from saltus.sweep import Part, Parts, text_rows

SQUARES = Part("squares", "test_parts:squares", width=2, chunk=3)
TEXTS = Part("texts", "test_parts:texts", width=8, chunk=1, dtype="u1")
asked = []


def squares(arguments, block):
    inputs = [arguments["inputs"][row] for row in block["row"].astype(int)]
    asked.extend(inputs)
    return {"result": np.array([[x, arguments["scale"] * x**2] for x in inputs], dtype=float)}


def texts(arguments, block):
    return {"result": text_rows([bytes.fromhex(arguments["inputs"][row]) for row in block["row"].astype(int)], TEXTS.width)}


@pytest.mark.parametrize("kept", [False, True])
def test_an_input_is_computed_once(kept, tmp_path):
    store = tmp_path / "search.zarr" if kept else None
    asked.clear()
    parts = Parts({"scale": 2.0}, store)
    assert [row.tolist() for row in parts.rows(SQUARES, [1, 2, 2, 3, 4])] == [[1, 2], [2, 8], [2, 8], [3, 18], [4, 32]]
    assert [row.tolist() for row in parts.rows(SQUARES, [5, 3, 1])] == [[5, 50], [3, 18], [1, 2]]
    assert asked == [1, 2, 3, 4, 5]
    again = Parts({"scale": 2.0}, store)
    assert [row.tolist() for row in again.rows(SQUARES, [5, 4])] == [[5, 50], [4, 32]]
    assert asked == [1, 2, 3, 4, 5] + ([] if kept else [5, 4])
    assert sorted(given for given, _ in again.remembered(SQUARES)) == ([1, 2, 3, 4, 5] if kept else [4, 5])


def test_what_was_computed_with_other_arguments_is_not_taken(tmp_path):
    Parts({"scale": 2.0}, tmp_path).rows(SQUARES, [3])
    assert Parts({"scale": 5.0}, tmp_path).rows(SQUARES, [3])[0].tolist() == [3, 45]


@pytest.mark.parametrize("kept", [False, True])
def test_texts_come_back_as_they_were_and_those_too_long_as_none(kept, tmp_path):
    given = ["", "00", "6100", "0a", "0a00", "61626364656667", "6162636465666700", "ff00ff000000"]
    parts = Parts({}, tmp_path if kept else None)
    expected = [bytes.fromhex(text) if len(text) < 16 else b"" for text in given]
    for _ in range(2):
        assert parts.texts(TEXTS, given) == expected
        parts = Parts({}, tmp_path if kept else None)
