"""The living pages of the documentation: each opens, and what a reader changes on it moves the
motion to where Python has it.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest
from computing_page import BROWSER, SETTLED, ComputingPage, field, state

import saltus

sys.path.insert(0, str(Path(__file__).parents[2] / "docs" / "_extensions"))
from living_systems import PAGES, write

pytestmark = pytest.mark.skipif(
    BROWSER is None, reason="no Chromium, Chrome or Edge is installed here"
)
CHANGED = {
    "wall": ("load.frequency", 1.4),
    "tristable": ("model.damping", 0.2),
    "block": ("load.ground_horizontal.frequency", 6.0),
    "bilinear": ("model.stop_stiffness", 4.0),
    "spectrum": ("load.frequency", 0.9),
}
SEARCHED = {"spectrum", "bilinear"}  # whose results take seconds


@pytest.fixture(scope="module")
def window(tmp_path_factory):
    page = ComputingPage(str(BROWSER), tmp_path_factory.mktemp("profile"))
    yield page
    page.close()


@pytest.mark.parametrize(
    "name",
    [pytest.param(name, marks=pytest.mark.thorough if name in SEARCHED else ()) for name in PAGES],
)
def test_a_living_page_is_alive(window, tmp_path, name):
    window.errors.clear()
    window.open(write(name, tmp_path), 928, 800)
    path, value = CHANGED[name]
    window.type(field(path), repr(value))
    window.evaluate(SETTLED)
    (system, results, first), now = PAGES[name](), state(window)
    assert now["values"][path] == value
    given = {key: each for key, each in first.items() if key not in ("title", "presets")}
    motion = saltus.simulate(system.with_({path: value}), **given)
    end = window.evaluate(
        "(() => { const m = saltusPage.session.motion; return [m.time.last, "
        "...m.state(m.time.last)]; })()"
    )
    np.testing.assert_allclose(
        end, [motion.time, *np.ravel(motion.position), *np.ravel(motion.velocity)], atol=1e-7
    )
    assert window.evaluate("saltusPage.results.length") == (
        1 if name == "bilinear" else len(results)
    )
    assert window.errors == []
