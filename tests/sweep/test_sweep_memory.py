"""Memory does not grow with the number of trajectories."""

import json

import pytest

DATA = 8 * 8 * 900_000 / 2**20  # MB more that the larger sweep writes


@pytest.mark.thorough
def test_a_million_rows_need_no_more_memory_than_a_tenth_of_them(script, tmp_path):
    peaks = []
    for rows in (100_000, 1_000_000):
        process = script("measure", tmp_path / str(rows), rows)
        out, err = process.communicate(timeout=120)
        assert process.returncode == 0, err
        told = json.loads(out)
        assert told["shape"] == [1000, rows // 1000, 8]
        assert told["chunks"] == rows // 25_000
        peaks.append(told["peak"])
    assert peaks[1] - peaks[0] < 0.2 * DATA
