"""Basins as a sweep: the same numbers, kept, and gone on with."""

import numpy as np
import pytest
from shared_systems import forced

from saltus import basins_of_attraction
from saltus.attractors.basins import basin_cells
from saltus.errors import ParameterError
from saltus.sweep import status
from saltus.sweep import store_files as files

GRID = {"theta": np.linspace(-2.0, 2.0, 9), "velocity": np.linspace(-1.5, 2.0, 7)}
SYSTEM = forced(1.0, W=2.4)  # three attractors


@pytest.mark.parametrize("rows", [1, 3, 100])
def test_a_sweep_of_basins_is_the_basins(tmp_path, rows):
    whole = basins_of_attraction(SYSTEM, **GRID)
    assert len(np.unique(whole["label"])) == 3
    assert basins_of_attraction(SYSTEM, **GRID, rows=rows, store=tmp_path / "store").identical(
        whole
    )


def test_what_is_kept_is_gone_on_with(tmp_path, monkeypatch):
    told = []
    whole = basins_of_attraction(
        SYSTEM, **GRID, rows=2, store=tmp_path / "store", progress=lambda *what: told.append(what)
    )
    assert told[0][0] == 0.0  # all arguments are checked
    assert [words.split(",")[0] for _, words in told if "chunks" in words] == [
        f"{i} of 4 chunks" for i in range(5)
    ]
    for name in ("label", "time"):
        files.chunk_file(tmp_path / "store", name, (2, 0), 0).unlink()
    assert status(tmp_path / "store").done == 3
    seen, cells = [], basin_cells.cells
    monkeypatch.setattr(
        basin_cells, "cells", lambda arguments, block: seen.append(block) or cells(arguments, block)
    )
    assert basins_of_attraction(SYSTEM, **GRID, rows=2, store=tmp_path / "store").identical(whole)
    assert len(seen) == 1
    np.testing.assert_array_equal(seen[0]["velocity"], GRID["velocity"][4:6])


def test_the_store_of_something_else_is_refused_before_anything_is_computed(tmp_path, monkeypatch):
    basins_of_attraction(SYSTEM, theta=[0.5], velocity=[0.0], store=tmp_path / "store")
    monkeypatch.setattr(
        "saltus.flow.long_time.recurrence.simulate_many",
        lambda *args, **more: pytest.fail("it began to compute"),
    )
    with pytest.raises(ParameterError, match="of the basins of another system; name another store"):
        basins_of_attraction(
            forced(1.0, W=2.5), theta=[0.5], velocity=[0.0], store=tmp_path / "store"
        )
    (tmp_path / "file").write_text("mine")
    with pytest.raises(ParameterError, match="is a file"):
        basins_of_attraction(SYSTEM, store=tmp_path / "file")
    with pytest.raises(ParameterError, match="rows must lie in"):
        basins_of_attraction(SYSTEM, rows=0)
    with pytest.raises(ParameterError, match="has no coordinate 'x'"):
        basins_of_attraction(SYSTEM, x=[1.0])
