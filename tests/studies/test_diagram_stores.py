"""Diagrams kept in parts: killed and gone on with, extended, computed by several processes and by a
cluster, always the same.
"""

import os
import re
import shutil
import signal
import subprocess
import sys
from dataclasses import fields, replace
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from diagram_script import BOUNDS, FREQUENCY, contact_diagram, diagram
from shared_systems import forced
from typer.testing import CliRunner

from saltus import response_spectrum
from saltus import result as results
from saltus.cli.app import app
from saltus.errors import ParameterError, SweepError
from saltus.files import checked_content, write_dataset
from saltus.flow import Ending
from saltus.result import identity
from saltus.studies.diagram import diagram_work
from saltus.studies.diagram.effort import EFFORTS, Effort
from saltus.sweep import Memo, SweepInterrupted, memo, status
from saltus.sweep.store_files import unpacked

SCRIPT = Path(__file__).with_name("diagram_script.py")


@pytest.fixture(scope="module")
def alone():
    """The diagram without a store."""
    return diagram()


@pytest.fixture(scope="module")
def kept(tmp_path_factory):
    """A folder with the store of the diagram and its netCDF file."""
    return computed(tmp_path_factory.mktemp("kept"))


def computed(folder, **options):
    write_dataset(
        folder / "diagram.nc", diagram(store=folder / "diagram.zarr", **{"workers": 1} | options)
    )
    return folder


def files(folder):
    return {
        str(file.relative_to(folder)): file.read_bytes()
        for file in folder.rglob("*")
        if file.is_file()
    }


def check_same(folder, other):
    """Two folders have the same files with the same bytes; else the names of those that differ."""
    here, there = files(folder), files(other)
    names = sorted(name for name in here | there if here.get(name) != there.get(name))
    assert not names, names


def counts(store):
    """How many inputs were computed of each kind of parts."""
    found = {}
    for file in (store / "parts").iterdir():
        part = unpacked(checked_content(file))
        found[part["kind"]] = found.get(part["kind"], 0) + len(part["inputs"])
    return found


def test_a_store_changes_no_number_and_remembers_all_of_them(alone, kept, monkeypatch):
    store = kept / "diagram.zarr"
    assert status(store).complete
    assert (
        min(counts(store)[kind] for kind in ("motions", "branches", "judgements", "distances")) > 0
    )
    monkeypatch.setattr(memo, "outcomes", None)  # nothing is left to compute
    xr.testing.assert_identical(diagram(store=store), alone)


@pytest.mark.thorough
def test_what_an_effort_does_not_follow_in_windows_of_chaos_is_listed_with_its_reason(monkeypatch):
    """Without branches of such motions there are fewer, and each of these motions is a dot; none of
    a wide range is left.
    """
    few = {"max_period": 6}
    quick = EFFORTS[Effort.QUICK]
    every = diagram(**few)
    assert "left" not in every["unplaced"]["reason"].values
    monkeypatch.setitem(EFFORTS, Effort.QUICK, replace(quick, narrow=0))
    some = diagram(**few)
    reasons = some["unplaced"]["reason"]
    left = some["unplaced"]["parameter"].values[reasons.values == "left"]
    assert len(left) > 0  # how many depends on the rounding of chaotic motions
    assert not np.isin(left, some["search"]["searched"].values).any()
    assert "the effort follows no more of such" in reasons.attrs["left"]
    assert (
        some["branches"].sizes["branch"]
        < every["branches"].sizes["branch"]
        <= some["branches"].sizes["branch"] + quick.narrow
    )


@pytest.mark.parametrize(
    "moments", [(1 / 3,), pytest.param((0.05, 0.2, 1 / 3, 2 / 3), marks=pytest.mark.thorough)]
)
def test_killed_at_several_moments_a_search_goes_on_to_the_same_bytes(kept, tmp_path, moments):
    """After such shares of its parts: each run before or after it has written a part."""
    chunks = sum(status(kept / "diagram.zarr").remembered.values())
    for share in moments:
        left = chunks - (
            sum(status(store).remembered.values())
            if (store := tmp_path / "diagram.zarr").exists()
            else 0
        )
        kill("one", store, 1 + int(share * left))
    check_same(computed(tmp_path), kept)


@pytest.mark.thorough
def test_killed_and_interrupted_a_search_with_several_contacts_goes_on_to_the_same_bytes(tmp_path):
    def stop(_, what):
        if "following" in what:
            raise KeyboardInterrupt

    whole, again = tmp_path / "whole", tmp_path / "again"
    for folder in (whole, again):
        folder.mkdir()
    write_dataset(whole / "diagram.nc", contact_diagram(store=whole / "diagram.zarr"))
    chunks = sum(status(whole / "diagram.zarr").remembered.values())
    with pytest.raises(SweepInterrupted, match="keeps its parts"):
        contact_diagram(store=again / "diagram.zarr", progress=stop)
    kill("several", again / "diagram.zarr", 1 + chunks // 3)
    write_dataset(again / "diagram.nc", contact_diagram(store=again / "diagram.zarr"))
    check_same(again, whole)


def kill(kind, store, count):
    """Run a diagram until it is killed as it writes so many chunks."""
    command = [sys.executable, str(SCRIPT), str(store), str(count), kind]
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)}
    died = subprocess.run(command, capture_output=True, text=True, check=False, env=environment)
    assert died.returncode == -signal.SIGKILL, died.stderr
    assert not status(store).complete


def test_one_and_two_processes_give_the_same_bytes(alone, kept, tmp_path, monkeypatch):
    monkeypatch.setattr(memo, "PATIENCE", 0.0)
    check_same(computed(tmp_path, workers=2), kept)
    xr.testing.assert_identical(diagram(store=tmp_path / "diagram.zarr", workers=2), alone)


@pytest.mark.thorough
def test_a_cluster_of_which_a_worker_dies_gives_the_same_diagram(alone, tmp_path):
    distributed = pytest.importorskip("distributed")
    store, struck = tmp_path / "diagram.zarr", []
    with distributed.LocalCluster(
        n_workers=2,
        threads_per_worker=1,
        processes=True,
        dashboard_address="127.0.0.1:0",
        host="127.0.0.1",
    ) as cluster:

        def kill(_, what):
            if "following" in what and not struck:
                struck.append(next(worker.process.pid for worker in cluster.workers.values()))
                os.kill(struck[0], signal.SIGKILL)

        there = diagram(store=store, scheduler=cluster.scheduler_address, progress=kill)
    assert struck
    xr.testing.assert_identical(there, alone)
    xr.testing.assert_identical(diagram(store=store), alone)


@pytest.mark.thorough
def test_more_values_and_starts_extend_a_store_and_equal_a_fresh_search(kept, tmp_path):
    store, more = tmp_path / "diagram.zarr", {"values": np.linspace(*BOUNDS, 5), "starts": 6}
    shutil.copytree(kept / "diagram.zarr", store)
    before = counts(store)
    extended = diagram(store=store, **more)
    after = counts(store)
    fresh = tmp_path / "fresh.zarr"
    xr.testing.assert_identical(extended, diagram(store=fresh, **more))
    assert all(after[kind] <= before[kind] + number for kind, number in counts(fresh).items())
    # 3 values with 4 starts are the same
    assert after["motions"] <= before["motions"] + counts(fresh)["motions"] - 3 * 4


def test_a_motion_that_has_settled_is_the_same_however_long_it_is_given():
    system, values = forced(2.0), np.array([1.3, 1.35, 1.45, 1.6])
    states = np.array([[0.3, 0.0], [1.0, 0.2], [0.3, 0.0], [-1.0, 0.0]])
    common = {"system": system.to_json(), "path": FREQUENCY, **identity(system)}
    work, direct = (
        diagram_work.DiagramWork(system, FREQUENCY, made) for made in (Memo(common), None)
    )
    work.simulate(values, states, 200)

    def asked(periods):
        known = work.memo.remembered(diagram_work.kinds()["motions"])
        return {tuple(given[:3]): one["outcome"] for given, one in known if given[3] == periods}

    outcomes = asked(200)
    moving = {start for start, outcome in outcomes.items() if outcome == Ending.UNDECIDED}
    assert 0 < len(moving) < len(outcomes)
    longer, fresh = work.simulate(values, states, 400), direct.simulate(values, states, 400)
    for field in fields(fresh):
        np.testing.assert_array_equal(getattr(longer, field.name), getattr(fresh, field.name))
    # others than these begin where a chaotic motion is after 200 periods, which rounding decides
    assert moving <= set(asked(400))
    assert not (set(outcomes) - moving) & set(asked(400))


@pytest.mark.parametrize(
    ("changes", "differs"),
    [
        ({"system": forced(2.1)}, "system.load.horizontal.amplitude is 2.0 there and 2.1 here"),
        ({"window": ((-2.0, 2.0), (-2.0, 2.0))}, r"attrs.window is \[-1.5, 1.5, -1.5, 1.5\] there"),
        ({"bounds": (1.2, 1.6)}, r"attrs.bounds is \[1.3, 1.6\] there"),
        ({"seed": 1}, "attrs.seed is 0 there and 1 here"),
    ],
)
def test_the_store_of_another_diagram_is_refused(kept, changes, differs):
    options = {"system": forced(2.0), "bounds": BOUNDS} | changes
    with pytest.raises(ParameterError, match=differs) as told:
        response_spectrum(store=kept / "diagram.zarr", **options)
    assert told.value.parameter == "store"
    assert "--fresh" in str(told.value)


def test_the_store_of_another_version_is_refused(kept, monkeypatch):
    monkeypatch.setattr(results, "RESULT_VERSION", results.RESULT_VERSION + 1)
    with pytest.raises(ParameterError, match="result_version"):
        diagram(store=kept / "diagram.zarr")


def test_a_second_search_of_one_store_is_refused_while_the_first_runs(tmp_path):
    def second(_, what):
        if "following" in what:
            diagram(store=tmp_path / "diagram.zarr")

    with pytest.raises(SweepError, match="another run is writing"):
        diagram(store=tmp_path / "diagram.zarr", progress=second)


def test_an_interrupt_says_what_is_kept(tmp_path):
    def stop(_, what):
        if "following" in what:
            raise KeyboardInterrupt

    with pytest.raises(
        SweepInterrupted, match=r"diagram.zarr keeps its parts: run the same again to go on"
    ):
        diagram(store=tmp_path / "diagram.zarr", progress=stop)


def test_status_counts_the_parts_and_verifies_them(kept, tmp_path):
    store = tmp_path / "diagram.zarr"
    shutil.copytree(kept / "diagram.zarr", store)
    told = CliRunner().invoke(app, ["status", "--verify", str(store)])
    assert told.exit_code == 0, told.output
    for kind in counts(store):
        assert re.search(rf"{kind} +\d+ chunks? remembered", told.output)
    assert "The sweep is complete" in told.output
    chunk = next(store.glob("parts/branches_*"))
    chunk.write_bytes(chunk.read_bytes()[:99] + chunk.read_bytes()[100:])
    told = CliRunner().invoke(app, ["status", "--verify", str(store)])
    assert told.exit_code == 2
    assert "1 damaged or missing file" in told.output


def test_a_damaged_part_is_computed_again(kept, tmp_path):
    shutil.copytree(kept, tmp_path / "again")
    chunk = next((tmp_path / "again").glob("diagram.zarr/parts/motions_*"))
    chunk.write_bytes(chunk.read_bytes()[:99] + chunk.read_bytes()[100:])
    check_same(computed(tmp_path / "again"), kept)
