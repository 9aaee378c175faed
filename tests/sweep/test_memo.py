"""What a search computes: each input once, found again by who asks next, and back from its file as
it was.
"""

import numpy as np
import pytest

from saltus.errors import SweepError
from saltus.sweep import Memo, MemoKind, memo
from saltus.sweep.store_files import packed, unpacked

SQUARES = MemoKind("squares", "test_memo:squares", chunk=3)
FAILING = MemoKind("failing", "test_memo:failing", chunk=1)
asked = []
WAY = np.dtype([("share", float), ("state", float, (2,))])
NESTED = np.dtype([("outcome", np.int8), ("last", WAY)])
VALUES = {
    "none": None,
    "numbers": [1, -2.5, 1e-320, float("inf"), True, "text \u00e9", np.float64(0.1), np.int64(3)],
    "array": np.array([[0.1, np.nan], [-0.0, 5e-324]]),
    "empty": np.zeros((0, 2)),
    "small": np.array([1, -1], dtype=np.int8),
    "nested": np.array([(1, (0.5, [1.0, 2.0]))], dtype=NESTED),
    "deep": [{"array": np.arange(3)}, [[]], {}],
}


def squares(arguments, inputs):
    asked.extend(inputs)
    return {
        "input": np.array(inputs),
        "square": [{"is": arguments["scale"] * x**2} for x in inputs],
    }


def failing(arguments, inputs):
    raise ValueError("no")


def found(memo, inputs):
    return [(int(one["input"]), one["square"]["is"]) for one in memo.results(SQUARES, inputs)]


@pytest.mark.parametrize("kept", [False, True])
def test_an_input_is_computed_once(kept, tmp_path):
    store = tmp_path / "search.zarr" if kept else None
    asked.clear()
    memo = Memo({"scale": 2.0}, store)
    assert found(memo, [1, 2, 2, 3, 4]) == [(1, 2), (2, 8), (2, 8), (3, 18), (4, 32)]
    assert found(memo, [5, 3, 1]) == [(5, 50), (3, 18), (1, 2)]
    assert asked == [1, 2, 3, 4, 5]
    again = Memo({"scale": 2.0}, store)
    assert found(again, [5, 4]) == [(5, 50), (4, 32)]
    assert asked == [1, 2, 3, 4, 5] + ([] if kept else [5, 4])
    assert sorted(given for given, _ in again.remembered(SQUARES)) == (
        [1, 2, 3, 4, 5] if kept else [4, 5]
    )


def test_what_was_computed_with_other_arguments_is_not_taken(tmp_path):
    found(Memo({"scale": 2.0}, tmp_path), [3])
    assert found(Memo({"scale": 5.0}, tmp_path), [3]) == [(3, 45)]


def test_a_run_that_was_stopped_ends_with_the_same_files(tmp_path):
    """Whichever files of a call are there: the chunks are cut from all that the run has not asked
    for before.
    """
    found(Memo({"scale": 2.0}, tmp_path), list(range(10)))
    whole = {file: file.read_bytes() for file in (tmp_path / "parts").iterdir()}
    assert len(whole) == 4
    for lost in (0, 2):
        for file in sorted(whole)[lost:]:
            file.unlink()
        assert found(Memo({"scale": 2.0}, tmp_path), list(range(10)))[-1] == (9, 162)
        assert {file: file.read_bytes() for file in (tmp_path / "parts").iterdir()} == whole


@pytest.mark.parametrize("name", VALUES)
def test_values_come_back_bit_for_bit(name):
    content = packed(VALUES[name])
    back = unpacked(content)
    assert packed(back) == content
    if isinstance(VALUES[name], np.ndarray):
        assert back.dtype == VALUES[name].dtype
        assert back.tobytes() == VALUES[name].tobytes()


@pytest.mark.parametrize(
    "content",
    [
        b"",
        b"nothing",
        b'{"array": ["|O", [1]]}\n12345678',
        b'{"array": ["<f8", [1000000000000]]}\n',
        b'{"array": ["__import__", [1]]}\n12345678',
        b'{"other": 1}\n',
        b"[" * 100_000,
    ],
)
def test_bytes_of_anything_else_are_refused(content):
    with pytest.raises(ValueError, match=r"."):
        unpacked(content)


def test_a_file_that_is_damaged_is_computed_again(tmp_path):
    found(Memo({"scale": 2.0}, tmp_path), [1, 2, 3])
    (file,) = (tmp_path / "parts").iterdir()
    content = file.read_bytes()
    for damaged in (content[:-1], content[:40], content[:50] + b"x" + content[51:], b""):
        file.write_bytes(damaged)
        assert found(Memo({"scale": 2.0}, tmp_path), [1, 2, 3]) == [(1, 2), (2, 8), (3, 18)]
        assert file.read_bytes() == content


def test_what_cannot_be_computed_or_written_is_told(tmp_path):
    with pytest.raises(SweepError, match="failing cannot be computed: ValueError: no"):
        Memo({}).results(FAILING, [1])
    (tmp_path / "parts").write_text("a file")
    with pytest.raises(SweepError, match="cannot be written"):
        Memo({"scale": 1.0}, tmp_path).results(SQUARES, [1])


def test_an_entry_costs_about_a_millisecond(tmp_path):
    """A store that cost 15 ms a part took a third of the time of Fig.

    9f; the bound leaves room for a busy machine.
    """
    import time

    many = Memo({"scale": 2.0}, tmp_path)
    begun = time.process_time()
    for x in range(100):
        many.results(SQUARES, [x])
    assert time.process_time() - begun < 0.5
    assert memo.PATIENCE > 0.0
