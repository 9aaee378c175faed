"""Runs that are killed, interrupted or doubled."""

import os
import random
import signal
import threading
import time
import warnings

import pytest
import sweep_script

from saltus.errors import SweepError
from saltus.sweep import StoreStatus, run, status
from saltus.sweep import store_files as files
from saltus.sweep.store import opened

CHUNKS = 120
CREATION = -10  # from here to 0: while the store is made


@pytest.fixture(scope="module")
def reference(tree, tmp_path_factory):
    """The files of a run that nothing disturbed."""
    store = tmp_path_factory.mktemp("reference") / "store"
    run(sweep_script.long_plan(CHUNKS, pause=0.0, quick=-2.0), store)
    return tree(store)


def _killed(script, store, rng, chunks, workers=0) -> StoreStatus | None:
    """Kill a run at a random moment after so many chunks; how far it came, None if not even to make
    the store.
    """
    process = script("go_on", store, workers, 0.0)
    while (line := process.stdout.readline().strip()) and (line == "go" or int(line) < chunks):
        if line == "go" and chunks < 0:
            break
    time.sleep(rng.uniform(0.0, 0.06 if chunks < 0 else 0.006))
    os.kill(process.pid, signal.SIGKILL)
    process.wait()
    return status(store) if store.exists() else None


def _kill_and_resume(script, tree, tmp_path, reference, rng, moments):
    """Kill a run at each of `moments`, and complete every store; how far each had come."""
    came = []
    for i, chunks in enumerate(moments):
        store = tmp_path / f"{i}" / "store"
        came.append(_killed(script, store, rng, chunks))
        run(sweep_script.long_plan(CHUNKS, pause=0.0, quick=-2.0), store)
        assert tree(store) == reference
    return [0 if c is None else c.done for c in came]


def test_killed_runs_resume_to_the_same_bytes(script, tree, tmp_path, reference):
    done = _kill_and_resume(script, tree, tmp_path, reference, random.Random(0), (CREATION, 20, 70))
    assert done[0] < CHUNKS
    assert 20 <= done[1] < CHUNKS
    assert 70 <= done[2] < CHUNKS


@pytest.mark.thorough
def test_20_kills_at_random_moments_resume_to_the_same_bytes(script, tree, tmp_path, reference):
    rng = random.Random(0)
    moments = [rng.randrange(CREATION, CHUNKS) for _ in range(20)]
    done = _kill_and_resume(script, tree, tmp_path, reference, rng, moments)
    assert sum(0 < d < CHUNKS for d in done) >= 12


@pytest.mark.thorough
def test_one_store_killed_again_and_again(script, tree, tmp_path, reference):
    rng, store, done = random.Random(1), tmp_path / "store", [0]
    while done[-1] < CHUNKS - 10:
        came = _killed(script, store, rng, done[-1] + rng.randrange(20), workers=rng.choice((0, 2)))
        done.append(came.done)
    assert done == sorted(done)  # what is done stays
    assert len(done) > 3
    run(sweep_script.long_plan(CHUNKS, pause=0.0, quick=-2.0), store)
    assert tree(store) == reference


def test_what_a_kill_left_half_written_is_removed(tree, tmp_path):
    plan, store = sweep_script.long_plan(chunks=4), tmp_path / "store"
    run(plan, store)
    before = tree(store)
    files.chunk_file(store, "height", (2, 0), 0).rename(
        store / "height" / "c" / "2" / ".0.0a1b2c.part"
    )
    stale = tmp_path / ".store.0a1b2c.part"
    stale.mkdir()
    os.utime(stale, (0, 0))
    # perhaps of a run that is about to find the store there
    fresh = tmp_path / ".store.3d4e5f.part"
    fresh.mkdir()
    run(plan, store)
    assert tree(store) == before
    assert not stale.exists()
    assert fresh.exists()


def test_the_workers_of_a_killed_run_end_too(script, tmp_path):
    process = script("go_on", tmp_path / "store", 2, 0.1)
    while process.stdout.readline() not in ("1\n", ""):
        pass
    os.kill(process.pid, signal.SIGKILL)
    process.wait()
    deadline = time.monotonic() + 60
    while time.monotonic() < deadline:
        try:
            os.killpg(process.pid, 0)
        except ProcessLookupError:  # the group has nobody left
            return
        time.sleep(0.02)
    pytest.fail("a worker outlives its run")


@pytest.mark.parametrize("workers", [0, 2])
def test_an_interrupt_ends_a_run_and_says_how_to_go_on(script, tmp_path, workers):
    store = tmp_path / "store"
    process = script("go_on", store, workers, 60.0, -0.97)  # two chunks, and then a minute for each
    while process.stdout.readline() not in ("2\n", ""):
        pass
    os.killpg(process.pid, signal.SIGINT)  # as a terminal does: to the workers too
    _, err = process.communicate(timeout=20)
    last = err.strip().splitlines()[-1]
    done = status(store).done
    assert last.endswith(
        f"interrupted after {done} of 120 chunks; {store} keeps them: run the same again to go on"
    )
    assert "SpawnProcess" not in err


def test_two_runs_on_one_store_are_not_possible_at_once(tmp_path):
    plan, store = sweep_script.long_plan(chunks=3), tmp_path / "store"
    with opened(plan, store):
        assert status(store).running is True
        with pytest.raises(SweepError, match="another run is writing to"):
            run(plan, store)
    assert status(store).running is False
    run(plan, store)


def test_looking_at_a_store_does_not_keep_a_run_out(tmp_path):
    plan, store = sweep_script.long_plan(chunks=3), tmp_path / "store"
    run(plan, store)
    over = threading.Event()

    def look():
        while not over.is_set():
            status(store)

    watcher = threading.Thread(target=look)
    watcher.start()
    try:
        for _ in range(10):
            run(plan, store)
    finally:
        over.set()
        watcher.join()


def test_two_that_begin_at_once_make_one_store(tree, tmp_path, monkeypatch):
    """The second to move its new folder into place finds the store of the first, and takes that."""
    plan, store = sweep_script.long_plan(chunks=3), tmp_path / "store"
    finish = files.finish

    def overtaken(part, path):
        monkeypatch.setattr(files, "finish", finish)
        run(plan, store)
        finish(part, path)

    monkeypatch.setattr(files, "finish", overtaken)
    run(plan, store)
    assert [p.name for p in tmp_path.iterdir()] == ["store"]
    assert status(store).complete


def test_where_there_are_no_locks_two_runs_write_the_same(tree, tmp_path, monkeypatch):
    """Without a lock, two runs at once cost time, not the store: files are whole, and both write
    the same bytes.
    """
    monkeypatch.setattr(files, "lock", lambda file, shared=False: None)
    plan = sweep_script.long_plan(chunks=12, pause=0.005)
    run(plan, tmp_path / "alone")
    both = [threading.Thread(target=run, args=(plan, tmp_path / "both")) for _ in range(2)]
    for thread in both:
        thread.start()
    for thread in both:
        thread.join()
    assert tree(tmp_path / "both") == tree(tmp_path / "alone")
    assert status(tmp_path / "both").running is None


def test_a_store_is_made_without_a_warning(tmp_path):
    """Zarr's own function for consolidated metadata warns, which could not be silenced in one of
    several threads alone.
    """
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        run(sweep_script.long_plan(3, pause=0.0, quick=-2.0), tmp_path / "store")
    assert status(tmp_path / "store").done == 3
