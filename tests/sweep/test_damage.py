"""Damaged stores: every flipped bit, cut or missing file is noticed, and a rerun computes just that
again.
"""

import json
import os
import random

import numpy as np
import pytest
from rich.errors import MarkupError

from saltus.errors import ParameterError, SaltusError, SweepError
from saltus.sweep import Plan, Variable, open_store, remove_store, run, status
from saltus.sweep import store_files as files
from saltus.sweep.store import opened


@pytest.fixture
def store(waves_plan, tmp_path):
    run(waves_plan(), tmp_path / "store")
    return tmp_path / "store"


def flipped(content: bytes, place: int) -> bytes:
    other = bytearray(content)
    other[place // 8] ^= 1 << place % 8
    return bytes(other)


def counted(plan, store, monkeypatch):
    """How many chunks a run computes."""
    from saltus.sweep import execution

    computed, attempt = [], execution.attempt
    monkeypatch.setattr(
        execution, "attempt", lambda *given: (computed.append(given), attempt(*given))[1]
    )
    run(plan, store)
    monkeypatch.undo()
    return len(computed)


@pytest.mark.parametrize("count", [1, pytest.param(200, marks=pytest.mark.thorough)])
def test_a_flipped_bit_in_any_file_is_noticed_and_a_rerun_mends_it(
    waves_plan, store, tree, monkeypatch, count
):
    """So many bits of every file of a store, of chunks, coordinates and metadata alike; the last of
    each is mended.
    """
    rng, plan, before = random.Random(0), waves_plan(), tree(store)
    for name, content in before.items():
        for place in [rng.randrange(8 * len(content)) for _ in range(count)]:
            (store / name).write_bytes(flipped(content, place))
            with pytest.raises(SaltusError, match=r"damaged|cannot be read|no plan"):
                open_store(store)
        chunk = "/c/" in name and name[0] not in "xy"
        assert counted(plan, store, monkeypatch) == chunk
        assert tree(store) == before


@pytest.mark.parametrize(
    "change", ["cut", pytest.param("empty", marks=pytest.mark.thorough), "missing"]
)
def test_a_cut_or_missing_file_is_noticed_and_computed_again(
    waves_plan, store, tree, monkeypatch, change
):
    plan, before = waves_plan(), tree(store)
    for name, content in before.items():
        if change == "missing":
            (store / name).unlink()
        else:
            (store / name).write_bytes(content[: len(content) // 2] if change == "cut" else b"")
        with pytest.raises(
            SaltusError, match=r"damaged|cannot be read|no plan|not a store|7 of 8 chunks"
        ):
            open_store(store)
        chunk = "/c/" in name and name[0] not in "xy"
        assert counted(plan, store, monkeypatch) == chunk
        assert tree(store) == before


def test_status_names_what_is_damaged_when_it_verifies(store):
    files.chunk_file(store, "height", (2, 1), 0).write_bytes(b"1234")
    assert status(store).complete
    found = status(store, verify=True)
    assert found.done == 7
    assert found.damaged == ("height/c/2/1",)
    with pytest.raises(
        SweepError, match=r"has 1 damaged or missing file \(height/c/2/1\); run the sweep again"
    ):
        open_store(store)


def test_the_store_of_another_plan_is_not_mended(waves_plan, store, tree):
    (store / "x" / "c" / "0").unlink()
    (store / files.CHECKSUMS).unlink()
    before = tree(store)
    with pytest.raises(
        ParameterError, match=r"is damaged, so the store cannot be continued; name another store"
    ):
        run(waves_plan(arguments={"hole": 0.2}), store)
    assert tree(store) == before


def test_a_store_is_removed_and_nothing_else_is(waves_plan, store, tmp_path):
    remove_store(store)
    assert not store.exists()
    remove_store(store)
    (tmp_path / "mine").mkdir()
    with pytest.raises(ParameterError, match="is not a store, so it is not removed"):
        remove_store(tmp_path / "mine")


def forged_group(store, change):
    """Change a store's metadata, with the right checksums."""
    group = json.loads((store / files.METADATA).read_text())
    change(group)
    (store / files.METADATA).write_text(json.dumps(group))
    (store / files.CHECKSUMS).unlink()
    files.write_checksums(store)


def test_a_key_that_is_given_twice_is_no_plan(waves_plan, tmp_path):
    """Of two plans the last would hold, and a reader that takes the first one sees another."""
    run(waves_plan(), tmp_path / "s")
    metadata = tmp_path / "s" / "zarr.json"
    metadata.write_text(
        metadata.read_text().replace('"zarr_format": 3,', '"zarr_format": 3,\n"zarr_format": 3,', 1)
    )
    with pytest.raises(
        ParameterError, match=r"zarr.json cannot be read \(the key 'zarr_format' is given twice\)"
    ):
        status(tmp_path / "s")


@pytest.mark.parametrize(
    "text",
    ["5", "{", "[5]", '[{"index": "a"}]', "[" * 100_000, '[{"index": [1], "place": "[bold"}]'],
)
def test_a_damaged_list_of_failures_loses_nothing(store, text):
    (store / files.FAILURES).write_text(text)
    assert status(store).failures == ()


def test_words_of_a_store_are_no_markup(tmp_path, capsys):
    from saltus.cli.summaries import print_status

    axes, kind = {"x": np.arange(2.0)}, "[/red] [link=x]"
    plan = Plan(
        function="sweep_toys:kinds",
        arguments={"kinds": ["f8"]},
        axes=axes,
        variables={"f8": Variable()},
        attrs={"kind": kind},
    )
    run(plan, tmp_path / "store")
    try:
        print_status(tmp_path / "store")
    except MarkupError as error:
        pytest.fail(str(error))
    assert kind in capsys.readouterr().out


def test_a_grid_of_too_many_chunks_is_refused(waves_plan):
    with pytest.raises(
        ParameterError, match="cuts the grid into 2000000 chunks; at most 1000000 are allowed"
    ):
        waves_plan(axes={"x": np.arange(2e6), "y": np.arange(1.0)}, chunk={"x": 1})


PICKLE = {
    "zarr_format": 2,
    "dtype": "|O",
    "filters": [{"id": "vlen-utf8"}, {"id": "pickle"}],
    "compressor": None,
}


@pytest.mark.parametrize(
    "change",
    [
        lambda array: array.update(
            PICKLE, chunks=array["shape"], fill_value="", order="C", attributes={}
        ),
        lambda array: array.update(codecs=[{"name": "numcodecs.pickle", "configuration": {}}]),
    ],
)
def test_arrays_whose_codecs_could_run_code_are_refused_before_zarr_reads_them(
    store, change, monkeypatch
):
    import zarr

    forged_group(store, lambda group: change(group["consolidated_metadata"]["metadata"]["height"]))
    monkeypatch.setattr(
        zarr, "open_group", lambda *_, **__: pytest.fail("Zarr was given the store")
    )
    for question in (
        status,
        lambda path: status(path, verify=True),
        open_store,
        lambda path: open_store(path, partial=True),
    ):
        with pytest.raises(
            ParameterError, match="is not a store of saltus: it has codecs of other programs"
        ):
            question(store)


@pytest.mark.thorough
def test_hundreds_of_thousands_of_chunks_that_are_not_there_are_counted_at_once(tmp_path):
    """Once each was asked of the disk alone, and each was looked for in every row: an hour."""
    axes = {"x": np.arange(3e5), "y": np.arange(1.0)}
    plan = Plan(
        function="sweep_toys:waves", axes=axes, chunk={"x": 1}, variables={"height": Variable()}
    )
    with opened(plan, tmp_path / "store"):
        pass
    found = status(tmp_path / "store", verify=True)
    assert (found.done, found.total, found.damaged) == (0, 300_000, ())


@pytest.mark.parametrize("name", [files.CHECKSUMS, files.FAILURES, "zarr.json", "height/c/0/0"])
def test_a_pipe_in_the_place_of_a_file_is_not_waited_for(store, name):
    (store / name).unlink(missing_ok=True)
    os.mkfifo(store / name)
    if name == files.FAILURES:
        assert status(store, verify=True).complete
    elif name == "height/c/0/0":
        assert status(store, verify=True).done == 7
    else:
        with pytest.raises(ParameterError, match=r"damaged|not a store"):
            status(store, verify=True)
