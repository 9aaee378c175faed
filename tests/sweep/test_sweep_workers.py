"""Chunks in processes of their own."""

import subprocess
import sys

import numpy as np
import pytest

from saltus.errors import SweepError
from saltus.sweep import run


@pytest.mark.parametrize("workers", [1, 3])
def test_the_number_of_workers_does_not_change_a_bit(waves_plan, tree, tmp_path, workers):
    run(waves_plan(), tmp_path / "here")
    run(waves_plan(), tmp_path / "there", workers=workers)
    assert tree(tmp_path / "here") == tree(tmp_path / "there")


def test_a_worker_that_dies_fails_its_own_chunk_which_is_tried_again(waves_plan, tmp_path, caplog):
    arguments = {"bad": float(np.linspace(0.0, 1.0, 7)[4]), "mark": str(tmp_path / "mark")}
    dataset = run(waves_plan("dies", arguments), workers=2)
    assert dataset["count"].min() >= 0
    (record,) = caplog.records
    assert "its process ended with exit code 9; it is tried again" in record.getMessage()


def test_a_worker_that_dies_each_time_is_told(waves_plan, tmp_path):
    arguments = {
        "bad": float(np.linspace(0.0, 1.0, 7)[4]),
        "mark": str(tmp_path / "no folder" / "mark"),
        "always": True,
    }
    with pytest.raises(
        SweepError, match=r"2 of 8 chunks failed: chunk 2/0 .* ended with exit code 9"
    ):
        run(waves_plan("dies", arguments), tmp_path / "s", workers=2)


def test_a_script_without_its_guard_is_told(tmp_path):
    lines = (
        "import numpy as np",
        "from saltus.sweep import Plan, Variable, run",
        "axes = {'x': np.arange(3.0)}",
        "run(Plan(function='numpy:multiply', axes=axes, variables={'a': Variable()}), workers=1)",
    )
    (tmp_path / "careless.py").write_text("\n".join(lines))
    result = subprocess.run(
        [sys.executable, str(tmp_path / "careless.py")],
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    assert "call the sweep below `if __name__" in result.stderr.strip().splitlines()[-1]
