"""Chunks that fail: reported, tried again, and told at the end, while the rest goes on."""

import logging
import re

import numpy as np
import pytest

from saltus.errors import SweepError
from saltus.sweep import SweepInterrupted, run, status

BAD = float(np.linspace(0.0, 1.0, 7)[3])  # in the chunks 1/0 and 1/1


@pytest.mark.parametrize("workers", [None, 2])
def test_the_rest_goes_on_and_the_same_run_completes_it(waves_plan, tree, tmp_path, workers):
    store, until = tmp_path / "store", tmp_path / "repaired"
    plan = waves_plan("fails", {"bad": [BAD], "until": str(until)})
    with pytest.raises(SweepError) as told:
        run(plan, store, workers=workers)
    sentence = (
        "2 of 8 chunks failed: chunk 1/0 (x 0.333333 to 0.5, y 0 to 1): ValueError: no "
        "wave at 0.3333333333333333, and 1 more; "
    )
    assert str(told.value).startswith(sentence)
    assert str(told.value).endswith(
        f"{store} keeps the others, and the same run again computes only what is missing"
    )
    assert [failure.index for failure in told.value.failures] == [(1, 0), (1, 1)]
    assert {failure.attempts for failure in told.value.failures} == {2}
    found = status(store)
    assert (found.done, found.failed, found.complete) == (6, 2, False)
    assert found.failures == told.value.failures
    until.touch()
    counts = []
    run(
        plan,
        store,
        workers=workers,
        progress=lambda fraction, _: counts.append(round(8 * fraction)),
    )
    assert counts == [6, 7, 8]
    assert status(store).failed == 0
    run(plan, tmp_path / "undisturbed")
    assert tree(store) == tree(tmp_path / "undisturbed")


def test_a_chunk_that_fails_once_is_tried_again(waves_plan, tmp_path, caplog):
    (tmp_path / "seen").mkdir()
    plan = waves_plan("fails_once", {"seen": str(tmp_path / "seen")})
    with caplog.at_level(logging.WARNING, logger="saltus.sweep"):
        dataset = run(plan, tmp_path / "store")
    assert dataset["count"].min() >= 0
    assert caplog.records[0].getMessage() == (
        "chunk 0/0 (x 0 to 0.166667, y 0 to 1): RuntimeError: not the first time; it is tried again"
    )
    assert len(caplog.records) == 8
    assert not (tmp_path / "store" / ".failures.json").exists()


def test_without_retries_it_is_not(waves_plan, tmp_path, caplog):
    (tmp_path / "seen").mkdir()
    plan = waves_plan("fails_once", {"seen": str(tmp_path / "seen")})
    with pytest.raises(SweepError, match="8 of 8 chunks failed"):
        run(plan, tmp_path / "store", retries=0)
    assert all(r.getMessage().endswith("given up after 1 attempt") for r in caplog.records)


def test_an_interrupted_run_keeps_its_list_of_failures(waves_plan, tmp_path):
    def interrupt(fraction, _):
        if fraction == 5 / 8:
            raise KeyboardInterrupt

    with pytest.raises(SweepInterrupted, match=r"interrupted after 5 of 8 chunks; .* keeps them"):
        run(waves_plan("fails", {"bad": [BAD]}), tmp_path / "s", progress=interrupt)
    assert [failure.index for failure in status(tmp_path / "s").failures] == [(1, 0), (1, 1)]


def test_in_memory_the_error_holds_what_there_is(waves_plan):
    with pytest.raises(SweepError, match="are in the error's `dataset`") as told:
        run(waves_plan("fails", {"bad": [BAD]}), retries=0)
    partial = told.value.dataset
    assert np.isnan(partial["height"][2:4]).all()
    assert (partial["count"][2:4] == -1).all()
    assert (partial["count"][4:] >= 0).all()


def test_progress_counts_up_and_estimates_the_time_left(waves_plan, tmp_path):
    said = []
    run(
        waves_plan(arguments={"pause": 0.05}),
        tmp_path / "s",
        progress=lambda *what: said.append(what),
    )
    assert [fraction for fraction, _ in said] == [done / 8 for done in range(9)]
    assert said[0][1] == "0 of 8 chunks"  # nothing to estimate from
    assert said[-1][1] == "8 of 8 chunks"
    assert all(
        re.fullmatch(rf"{done} of 8 chunks, about \d+ s left", what)
        for done, (_, what) in enumerate(said[1:-1], 1)
    )
    again = []
    run(
        waves_plan(arguments={"pause": 0.05}),
        tmp_path / "s",
        progress=lambda *what: again.append(what),
    )
    assert again == [(1.0, "8 of 8 chunks")]
