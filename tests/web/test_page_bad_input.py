"""What the page makes of damaged links, and of links that ask for what cannot be: in node, with the
engine of a real page.
"""

from __future__ import annotations

import numpy as np
import pytest
from test_agreement import NODE, block, cell, layers, page_parts, run_node, stops, wall

from saltus.web import one_file

pytestmark = pytest.mark.skipif(NODE is None, reason="node is not installed here")


def answers(kind, folder, damaged, extremes):
    """What `bad_input.mjs` counts for a system of a kind."""
    system, start = kind(np.random.default_rng(5))
    wasm, description = page_parts(system)
    simulate = {"periods": 20} if system.load.period else {"duration": 20.0}
    names = [
        name
        for each in description["model"]["coordinates"]
        for name in (each["name"], each["velocity"])
    ]
    description |= {
        "start": dict.fromkeys(["time", *names], 0.0)
        | {name: value for name, value in start.items() if name in names},
        "study": {"system": system.to_dict(), "simulate": simulate},
        "digest": "of the page",
    }
    task = {"wasm": wasm, "description": description, "damaged": damaged, "extremes": extremes}
    return run_node("bad_input.mjs", one_file.PAGE.as_uri(), task, folder)


def check(found, damaged, extremes):
    assert found["answers"]["other"] == []
    assert found["answers"]["refused"] > 0.95 * damaged
    assert found["wrong"] == []
    assert sum(found["kinds"].values()) == extremes
    assert found["kinds"]["refused"] > 0
    assert found["kinds"]["whole"] > 0  # whether one ends early depends on the machine's time
    # milliseconds; two of them are computed, more where the machine does other things
    assert found["slowest"] < 15_000


def test_damaged_links_are_refused_and_extreme_numbers_break_nothing(tmp_path):
    check(answers(wall, tmp_path, 10_000, 60), 10_000, 60)


@pytest.mark.thorough
@pytest.mark.parametrize("kind", [cell, wall, block, stops, layers])
def test_extreme_numbers_of_models_break_nothing(tmp_path, kind):
    check(answers(kind, tmp_path, 1000, 600), 1000, 600)
