"""Runs that are killed, interrupted or doubled."""

import os
import random
import signal
import threading
import time

import pytest
import sweep_script

from saltus.errors import SweepError
from saltus.sweep import Status, files, run, status
from saltus.sweep.store import opened


@pytest.fixture(scope="module")
def reference(tree, tmp_path_factory):
    """The files of a run that nothing disturbed, and how long it took."""
    store = tmp_path_factory.mktemp("reference") / "store"
    start = time.monotonic()
    run(sweep_script.long_plan(pause=0.0), store)
    return tree(store), time.monotonic() - start


def _killed(script, store, delay, workers=0) -> Status | None:
    """Kill a run so many seconds after it begins; how far it came, None if not even to make the store."""
    process = script("go_on", store, workers, 0.0)
    assert process.stdout.readline() == "go\n"
    time.sleep(delay)
    os.kill(process.pid, signal.SIGKILL)
    process.wait()
    return status(store) if store.exists() else None


def _kill_and_resume(script, tree, tmp_path, reference, moments, workers=0):
    """Kill a run at each of `moments`, as fractions of a run's time, and complete every store; how far each had come."""
    files_there, duration = reference
    came = []
    for i, moment in enumerate(moments):
        store = tmp_path / f"{i}" / "store"
        came.append(_killed(script, store, moment * duration, workers))
        run(sweep_script.long_plan(pause=0.0), store)
        assert tree(store) == files_there
        assert not [p for p in store.parent.iterdir() if p != store and time.time() - p.stat().st_mtime > files.STALE]
    return came


def test_killed_runs_resume_to_the_same_bytes(script, tree, tmp_path, reference):
    came = _kill_and_resume(script, tree, tmp_path, reference, (0.3, 0.55, 0.8))
    assert any(c is not None and 0 < c.done < c.total for c in came)


@pytest.mark.thorough
def test_20_kills_at_random_moments_resume_to_the_same_bytes(script, tree, tmp_path, reference):
    rng = random.Random(0)
    came = _kill_and_resume(script, tree, tmp_path, reference, [rng.uniform(0.0, 1.1) for _ in range(20)])
    assert sum(c is not None and 0 < c.done < c.total for c in came) >= 8


@pytest.mark.thorough
def test_one_store_killed_again_and_again(script, tree, tmp_path, reference):
    rng, store = random.Random(1), tmp_path / "store"
    done = []
    for _ in range(8):
        came = _killed(script, store, rng.uniform(0.0, 0.25) * reference[1], workers=rng.choice((0, 2)))
        done.append(came.done if came else 0)
    assert done == sorted(done)  # what is done stays
    assert done[-1] > 0
    run(sweep_script.long_plan(pause=0.0), store)
    assert tree(store) == reference[0]


def test_what_a_kill_left_half_written_is_removed(tree, tmp_path):
    plan, store = sweep_script.long_plan(chunks=4), tmp_path / "store"
    run(plan, store)
    before = tree(store)
    files.chunk_file(store, "height", (2, 0), 0).rename(store / "height" / "c" / "2" / ".0.0a1b2c.part")
    stale = tmp_path / ".store.0a1b2c.part"
    stale.mkdir()
    os.utime(stale, (0, 0))
    fresh = tmp_path / ".store.3d4e5f.part"  # perhaps of a run that is about to find the store there
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
    deadline = time.monotonic() + 10
    while time.monotonic() < deadline:
        try:
            os.killpg(process.pid, 0)
        except ProcessLookupError:  # the group has nobody left
            return
        time.sleep(0.02)
    pytest.fail("a worker outlives its run")


@pytest.mark.parametrize("workers", [0, 2])
def test_an_interrupt_ends_a_run_at_once_and_says_how_to_go_on(script, tmp_path, workers):
    store = tmp_path / "store"
    process = script("go_on", store, workers, 0.4)
    while process.stdout.readline() not in ("1\n", "2\n", ""):
        pass
    start = time.monotonic()
    os.killpg(process.pid, signal.SIGINT)  # as a terminal does: to the workers too
    _, err = process.communicate(timeout=20)
    assert time.monotonic() - start < 2.0
    last = err.strip().splitlines()[-1]
    done = status(store).done
    assert last.endswith(f"interrupted after {done} of 120 chunks; {store} keeps them: run the same again to go on")
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
    """Without a lock, two runs at once cost time, not the store: files are whole, and both write the same bytes."""
    monkeypatch.setattr(files, "_lock", lambda file, shared=False: None)
    plan = sweep_script.long_plan(chunks=12, pause=0.005)
    run(plan, tmp_path / "alone")
    both = [threading.Thread(target=run, args=(plan, tmp_path / "both")) for _ in range(2)]
    for thread in both:
        thread.start()
    for thread in both:
        thread.join()
    assert tree(tmp_path / "both") == tree(tmp_path / "alone")
    assert status(tmp_path / "both").running is None
