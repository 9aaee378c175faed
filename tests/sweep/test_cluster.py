"""Chunks computed by a Dask cluster."""

import os
import signal
import socket
import sys
import time
from dataclasses import replace

import numpy as np
import pytest

from saltus.errors import SweepError
from saltus.sweep import run, status
from saltus.sweep import workers as cluster_module

distributed = pytest.importorskip("distributed")


@pytest.fixture(scope="module")
def cluster():
    """A scheduler here and two workers in processes of their own."""
    with distributed.LocalCluster(
        n_workers=2,
        threads_per_worker=1,
        processes=True,
        dashboard_address="127.0.0.1:0",
        host="127.0.0.1",
    ) as cluster:
        yield cluster


def test_a_cluster_gives_the_same_bytes_though_a_worker_is_killed(
    cluster, waves_plan, tree, tmp_path
):
    plan = waves_plan(arguments={"pause": 0.05}, chunk={"x": 1, "y": 2})
    victims = [worker.process.pid for worker in cluster.workers.values()]
    done_at = []

    def kill(fraction, _):
        done_at.append(round(21 * fraction))
        if done_at[-1] == 4:
            os.kill(victims[0], signal.SIGKILL)

    run(plan, tmp_path / "cluster", scheduler=cluster.scheduler_address, progress=kill)
    assert done_at == list(range(22))
    run(plan, tmp_path / "here")
    assert tree(tmp_path / "cluster") == tree(tmp_path / "here")
    deadline = time.monotonic() + 60
    while (
        victims[0] in [w.process.pid for w in cluster.workers.values() if w.process]
        and time.monotonic() < deadline
    ):
        time.sleep(0.1)
    # it was a worker, and is dead
    assert victims[0] not in [w.process.pid for w in cluster.workers.values() if w.process]


def test_a_chunk_that_fails_on_a_cluster_is_tried_again_and_told(cluster, waves_plan, tmp_path):
    bad = float(np.linspace(0.0, 1.0, 7)[3])
    plan = waves_plan("fails", {"bad": [bad]})
    with pytest.raises(
        SweepError, match=r"2 of 8 chunks failed: chunk 1/0 .*ValueError: no wave at 0.333"
    ) as told:
        run(plan, tmp_path / "s", scheduler=cluster.scheduler_address)
    assert {failure.attempts for failure in told.value.failures} == {2}
    assert status(tmp_path / "s").done == 6


def test_an_interrupt_ends_a_run_on_a_cluster_and_says_how_to_go_on(cluster, script, tmp_path):
    process = script("go_on", tmp_path / "store", cluster.scheduler_address, 0.3)
    while process.stdout.readline() not in ("1\n", ""):
        pass
    process.send_signal(signal.SIGINT)
    _, err = process.communicate(timeout=60)
    assert err.strip().endswith(f"{tmp_path / 'store'} keeps them: run the same again to go on")


def test_a_chunk_that_kills_every_worker_is_told_and_the_rest_goes_on(
    cluster, waves_plan, tmp_path
):
    arguments = {
        "bad": float(np.linspace(0.0, 1.0, 7)[6]),
        "mark": str(tmp_path / "no folder" / "mark"),
        "always": True,
    }
    with distributed.Client(cluster, set_as_default=False) as client:
        client.run_on_scheduler(
            lambda dask_scheduler: setattr(dask_scheduler, "allowed_failures", 0)
        )
    plan = waves_plan("dies", arguments, chunk={"x": 6, "y": 5})
    with pytest.raises(SweepError, match=r"1 of 2 chunks failed: chunk 1/0 .*KilledWorker"):
        run(plan, tmp_path / "s", scheduler=cluster.scheduler_address, retries=0)
    assert status(tmp_path / "s").done == 1


def test_a_scheduler_that_goes_away_is_told(waves_plan, tmp_path, monkeypatch):
    """What was written before is kept, and the sweep goes on elsewhere."""
    monkeypatch.setattr(cluster_module, "CLUSTER", replace(cluster_module.CLUSTER, patience=0.5))
    plan = waves_plan(arguments={"pause": 0.05})
    cluster = distributed.LocalCluster(
        n_workers=1,
        threads_per_worker=1,
        processes=False,
        protocol="tcp",
        dashboard_address="127.0.0.1:0",
        host="127.0.0.1",
    )
    with pytest.raises(SweepError, match=r"has gone away \(.*\); run the same again to go on"):
        run(
            plan,
            tmp_path / "s",
            scheduler=cluster.scheduler_address,
            progress=lambda fraction, _: fraction == 3 / 8 and cluster.close(),
        )
    assert 3 <= status(tmp_path / "s").done < 8
    run(plan, tmp_path / "s")
    assert status(tmp_path / "s").complete


def test_an_address_without_a_scheduler_is_told(waves_plan, tmp_path, monkeypatch):
    monkeypatch.setattr(cluster_module, "CLUSTER", replace(cluster_module.CLUSTER, patience=0.5))
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        address = f"tcp://127.0.0.1:{free.getsockname()[1]}"
    with pytest.raises(SweepError, match=f"no Dask scheduler answers at {address} "):
        run(waves_plan(), tmp_path / "s", scheduler=address)
    with pytest.raises(SweepError, match="no Dask scheduler answers at carrier://pigeon"):
        run(waves_plan(), tmp_path / "s", scheduler="carrier://pigeon")


def test_a_cluster_without_workers_is_told(waves_plan, monkeypatch):
    monkeypatch.setattr(cluster_module, "CLUSTER", replace(cluster_module.CLUSTER, patience=0.5))
    with (
        distributed.LocalCluster(
            n_workers=0,
            processes=False,
            protocol="tcp",
            dashboard_address="127.0.0.1:0",
            host="127.0.0.1",
        ) as empty,
        pytest.raises(SweepError, match="has no workers; start some with `dask worker"),
    ):
        run(waves_plan(), scheduler=empty.scheduler_address)


def test_without_distributed_the_extra_is_named(waves_plan, monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(SweepError, match=r"pip install \"\.\[cluster\]\""):
        run(waves_plan(), scheduler="tcp://127.0.0.1:1")
