"""The store: what is in it, and what does not change it."""

import random
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import sweep_toys
import xarray as xr

from saltus.errors import ParameterError, SweepError
from saltus.sweep import Plan, Variable, open_store, run, status
from saltus.sweep import store_files as files
from saltus.sweep.store import opened


@pytest.fixture(scope="module")
def whole(waves_plan, tmp_path_factory):
    store = tmp_path_factory.mktemp("whole") / "store"
    run(waves_plan(), store)
    return store


def test_the_chunks_together_are_the_function_of_the_whole_grid(waves_plan, whole):
    plan = waves_plan()
    direct = sweep_toys.waves(dict(plan.arguments), dict(plan.axes))
    for dataset in (run(plan), run(plan, whole)):
        for name, values in direct.items():
            np.testing.assert_array_equal(dataset[name], values)
        assert np.isnan(dataset["height"]).any()  # NaN is a value
        assert dataset["height"].dims == ("x", "y")
        assert dataset["count"].dims == ("x", "y", "k")
        assert dataset["count"].dtype == np.int32
        assert dataset["height"].attrs == {"units": "m"}
        assert dataset.attrs.items() >= plan.attrs.items()
        np.testing.assert_array_equal(dataset["x"], plan.axes["x"])


def test_any_reader_of_zarr_reads_it(waves_plan, whole):
    assert xr.open_zarr(whole).load().identical(run(waves_plan()))
    assert open_store(whole).load().identical(run(waves_plan()))


def test_netcdf_keeps_a_dataset_with_its_plan(waves_plan, tmp_path):
    run(waves_plan()).to_netcdf(tmp_path / "waves.nc", engine="h5netcdf")
    assert xr.open_dataset(tmp_path / "waves.nc", engine="h5netcdf").attrs["seed"] == 0


def test_neither_order_nor_gaps_change_a_byte(waves_plan, whole, tree, tmp_path):
    """Chunks, or files of one variable of a chunk, that are missing are computed again, whichever
    they are.
    """
    plan, reference = waves_plan(), tree(whole)
    run(plan, tmp_path / "s")
    chunks = [name for name in reference if "/c/" in name and name[0] not in "xy"]
    for seed in range(4):
        for name in random.Random(seed).sample(chunks, 5 + seed):
            (tmp_path / "s" / name).unlink()
        run(plan, tmp_path / "s")
        assert tree(tmp_path / "s") == reference


def test_random_numbers_are_those_of_the_chunk(waves_plan, tree, tmp_path):
    plan = waves_plan("draws", {"seed": 7})
    run(plan, tmp_path / "a")
    run(plan, tmp_path / "b", workers=2)
    assert tree(tmp_path / "a") == tree(tmp_path / "b")


def test_a_function_that_spoils_its_arguments_spoils_no_other_chunk(waves_plan):
    assert run(waves_plan("greedy", {"list": [0.1]}))["height"].equals(run(waves_plan())["height"])


def test_each_file_is_written_once(waves_plan, monkeypatch, tmp_path):
    from saltus.sweep import store

    written = []
    original = store.write_durably
    monkeypatch.setattr(
        store,
        "write_durably",
        lambda path, content: (written.append(path), original(path, content)),
    )
    run(waves_plan(), tmp_path / "s")
    chunks = [
        path
        for path in written
        if path.parent.name != "c" and "c" in path.parts and tmp_path / "s" in path.parents
    ]
    assert len(chunks) == len(set(chunks)) == 2 * 8
    before = len(written)
    run(waves_plan(), tmp_path / "s")
    assert len(written) == before


def test_a_chunk_is_done_when_all_its_variables_are_there(waves_plan, tmp_path):
    plan, store = waves_plan(), tmp_path / "s"
    run(plan, store)
    files.chunk_file(store, "count", (2, 1), 1).unlink()
    kept = files.chunk_file(store, "height", (2, 1), 0)
    stamp = kept.stat().st_mtime_ns
    with opened(plan, store) as sheets:
        assert sheets.missing() == [(2, 1)]
    run(plan, store)
    assert kept.stat().st_mtime_ns == stamp  # once there, not written again


def test_of_many_chunks_the_folders_tell_the_same_as_the_files(waves_plan, tmp_path, monkeypatch):
    run(waves_plan(), tmp_path / "s")
    files.chunk_file(tmp_path / "s", "count", (2, 1), 1).unlink()
    files.chunk_file(tmp_path / "s", "height", (3, 0), 0).unlink()
    asked = status(tmp_path / "s")
    assert not asked.estimated
    monkeypatch.setattr(files, "ASKED_ONE_BY_ONE", 2)
    told = status(tmp_path / "s")
    assert told.estimated
    assert (told.done, told.total) == (asked.done, asked.total) == (6, 8)
    assert told.bytes == pytest.approx(asked.bytes, rel=0.2)  # chunks at the ends are smaller
    with opened(waves_plan(), tmp_path / "s") as store:
        assert store.missing() == [(2, 1), (3, 0)]


def test_chunks_of_nothing_but_fill_values_are_done(waves_plan, tmp_path):
    plan = waves_plan(arguments={"hole": 1e9})
    assert np.isnan(run(plan, tmp_path / "s")["height"]).all()
    with opened(plan, tmp_path / "s") as sheets:
        assert sheets.missing() == []


@pytest.mark.parametrize(
    ("entry", "sentence"),
    [
        ({"arguments": {"hole": 0.2}}, "arguments.hole is 0.1 there and 0.2 here"),
        ({"function": "draws"}, "function is 'sweep_toys:waves' there and 'sweep_toys:draws' here"),
        ({"attrs": {"kind": "waves", "seed": 1}}, "attrs.seed is 0 there and 1 here"),
        ({"chunk": {"x": 2, "y": 2}}, "chunk.y is 3 there and 2 here"),
        (
            {"axes": {"x": np.linspace(0, 1, 7), "y": np.linspace(0, 3, 5)}},
            "axes.y.last is 2.0 there and 3.0 here",
        ),
        ({"axes": {"y": np.linspace(0, 2, 5), "x": np.linspace(0, 1, 7)}}, "order is"),
    ],
)
def test_the_store_of_another_plan_is_refused_and_left_alone(
    waves_plan, whole, tree, entry, sentence
):
    before = tree(whole)
    with pytest.raises(ParameterError, match="is the store of another plan: .*" + sentence):
        run(waves_plan(**entry), whole)
    assert tree(whole) == before


def test_something_else_in_the_place_is_refused(waves_plan, tmp_path):
    (tmp_path / "file").write_text("x")
    (tmp_path / "folder").mkdir()
    (tmp_path / "folder" / "letter").write_text("x")
    with pytest.raises(ParameterError, match="is a file; name a store"):
        run(waves_plan(), tmp_path / "file")
    with pytest.raises(ParameterError, match="is a folder with something else in it"):
        run(waves_plan(), tmp_path / "folder")
    with pytest.raises(SweepError, match="cannot be made"):
        run(waves_plan(), tmp_path / "file" / "store")
    (tmp_path / "empty").mkdir()
    run(waves_plan(), tmp_path / "empty")
    assert sorted(p.name for p in tmp_path.iterdir()) == ["empty", "file", "folder"]


def test_an_incomplete_store_is_read_when_asked_for(waves_plan, tmp_path):
    plan = waves_plan()
    run(plan, tmp_path / "s")
    for name, extra in (("height", 0), ("count", 1)):
        files.chunk_file(tmp_path / "s", name, (0, 1), extra).unlink()
    with pytest.raises(SweepError, match="has 7 of 8 chunks"):
        open_store(tmp_path / "s")
    partial = open_store(tmp_path / "s", partial=True)
    assert np.isnan(partial["height"][:2, 3:]).all()
    assert (partial["count"][:2, 3:] == -1).all()
    assert (partial["count"][2:] >= 0).all()


def test_every_kind_of_number_comes_back_as_it_was(tmp_path):
    x, kinds = np.linspace(-3.0, 100.0, 5), ["bool", "i1", "i8", "f2", "f4", "c8", "c16"]
    variables = {kind: Variable(dtype=kind) for kind in kinds}
    plan = Plan(
        function="sweep_toys:kinds",
        arguments={"kinds": kinds},
        axes={"x": x},
        chunk={"x": 2},
        variables=variables,
    )
    for dataset in (run(plan), run(plan, tmp_path / "s")):
        for kind in kinds:
            assert dataset[kind].dtype == np.dtype(kind)
            np.testing.assert_array_equal(dataset[kind], x.astype(kind))
    for kind in kinds:
        files.chunk_file(tmp_path / "s", kind, (1,), 0).unlink()
    partial = open_store(tmp_path / "s", partial=True)
    for kind in kinds:
        assert np.isnan(partial[kind][2]) if kind[0] in "fc" else partial[kind][2] == 0


def test_an_interval_is_no_time_difference(waves_plan, tmp_path):
    variables = {
        "height": Variable(attrs={"units": "s"}),
        "count": Variable(dtype="i4", extra=(("k", 3),), attrs={"units": "days"}),
    }
    dataset = run(waves_plan(variables=variables), tmp_path / "s")
    assert dataset["height"].dtype == float
    assert dataset["count"].dtype == np.int32


def test_planning_and_looking_at_a_sweep_import_nothing_heavy():
    heavy = ("zarr", "xarray", "distributed", "dask", "scipy", "numba")
    code = f"import sys, saltus.sweep; print([m for m in {heavy} if m in sys.modules])"
    assert (
        subprocess.run(
            [sys.executable, "-c", code], capture_output=True, text=True, check=True
        ).stdout.strip()
        == "[]"
    )


def test_a_sweep_in_memory_needs_no_zarr(waves_plan):
    code = "; ".join(
        (
            "import sys, numpy as np",
            "from saltus.sweep import Plan, Variable, run",
            (
                "entries = {'arguments': {'kinds': ['f8']}, 'axes': {'x': np.arange(3.0)}, "
                "'variables': {'f8': Variable()}}"
            ),
            "run(Plan(function='sweep_toys:kinds', **entries))",
            "print([m for m in ('zarr', 'distributed') if m in sys.modules])",
        )
    )
    result = subprocess.run(
        [sys.executable, "-c", code],
        capture_output=True,
        text=True,
        check=True,
        cwd=Path(__file__).parent,
    )
    assert result.stdout.strip() == "[]"
