"""A study whose model was edited: its old chart is not given back, what differs is said, and
--fresh begins anew.
"""

import os
import sys

import numpy as np
import pytest

from saltus.sweep import open_store

MODEL = """
from dataclasses import dataclass
from saltus import OneContactModel
STIFFNESS = 1.0

@dataclass(frozen=True, kw_only=True)
class Hinged(OneContactModel):
    damping: float = 0.3
    coordinates = ("x",)
    channels = ("force",)

    def acceleration(self, t, x, velocity, side, load):
        return load.force(t) - self.damping * velocity - STIFFNESS * x - 0.2 * side
"""

STUDY = """
[model]
type = "hinged.py:Hinged"
[load]
frequency = 1.5
force = { amplitude = 1.0 }
"""

ASKS = {
    "stability_chart": """
[stability_chart]
horizontal = { from = 0.5, to = 1.0, count = 2 }
vertical = { from = 1.4, to = 1.5, count = 2 }
paths = ["load.force.amplitude", "load.frequency"]
starts = 2
periods = 40
""",
    "basins": """
[basins]
x = { from = -0.5, to = 0.5, count = 2 }
velocity = { from = -0.5, to = 0.5, count = 2 }
periods = 100
""",
}


@pytest.mark.parametrize("kind", ASKS)
def test_an_edited_model_is_seen(kind, saltus, refused, tmp_path, monkeypatch):
    monkeypatch.setattr(sys, "dont_write_bytecode", False)
    model_file = tmp_path / "hinged.py"
    model_file.write_text(MODEL)
    os.utime(model_file, (1.0e9, 1.0e9))
    (tmp_path / "study.toml").write_text(STUDY + ASKS[kind])
    run = ("run", tmp_path / "study.toml", "-o", tmp_path / "out", "--no-plot")
    assert saltus(*run).exit_code == 0
    store = tmp_path / "out" / f"{kind}.zarr"
    before = open_store(store).load()
    assert saltus(*run).exit_code == 0  # nothing has changed, so nothing is refused
    # of the same length and, as in an edit within the clock's tick, of the same time
    model_file.write_text(MODEL.replace("STIFFNESS = 1.0", "STIFFNESS = 1.7"))
    os.utime(model_file, (1.0e9, 1.0e9))
    sentence = refused(*run)
    assert "acceleration" in sentence
    assert "changed" in sentence
    assert "--fresh" in sentence
    assert open_store(store).load().identical(before)
    assert saltus(*run, "--fresh").exit_code == 0
    after = open_store(store).load()
    assert before.attrs["equations"] != after.attrs["equations"]
    if kind == "stability_chart":
        assert np.abs(before["amplitude"] - after["amplitude"]).max() > 0.1


def test_fresh_removes_nothing_but_stores(saltus, refused, tmp_path):
    (tmp_path / "hinged.py").write_text(MODEL)
    (tmp_path / "study.toml").write_text(STUDY + ASKS["stability_chart"])
    mine = tmp_path / "out" / "stability_chart.zarr"
    mine.mkdir(parents=True)
    (mine / "letter").write_text("mine")
    assert "is not a store, so it is not removed" in refused(
        "run", tmp_path / "study.toml", "-o", tmp_path / "out", "--fresh"
    )
    assert (mine / "letter").read_text() == "mine"
