"""What the documentation shows is true, and the examples run."""

import dataclasses
import inspect
import re
import sys
import types
from pathlib import Path

import numpy as np
import pytest

import saltus
from saltus.config import load_study
from saltus.flow.capture import capture_speed
from saltus.systems import IMPACTS, MODELS

ROOT = Path(__file__).parents[2]
TEXT = (ROOT / "docs" / "study.md").read_text(encoding="utf-8")
ENSEMBLES = (ROOT / "docs" / "ensembles.md").read_text(encoding="utf-8")
BLOCKS = re.findall(r"```toml\n(.*?)```", TEXT, re.DOTALL)


def test_the_first_study_can_be_run(tmp_path):
    path = tmp_path / "study.toml"
    path.write_text(BLOCKS[0])
    assert load_study(path).run().stop is saltus.Stop.HORIZON


def test_every_way_to_write_a_channel(tmp_path):
    (tmp_path / "quake.csv").write_text("0,0\n1,1\n2,0\n")
    path = tmp_path / "study.toml"
    for line in BLOCKS[1].splitlines():
        path.write_text(f'[model]\ntype = "Metainterface"\nbeta0 = 1\n[load]\nfrequency = 2\n{line}\n')
        assert len(load_study(path).system.load.channels) == 1


def test_the_models_table_is_that_of_the_classes():
    rows = {row[0]: row for row in re.findall(r"^\| `(\w+)` \| ([^|]*)\| ([^|]*)\| ([^|]*)\| ([^|]*)\|$", TEXT, re.MULTILINE)}
    assert set(rows) == set(MODELS)
    for name, (_, needs, optional, channels, coordinates) in rows.items():
        model = MODELS[name]
        assert re.findall(r"`(\w+)`", needs + optional) == [f.name for f in dataclasses.fields(model)]
        assert re.findall(r"`(\w+)`", coordinates) == list(model.coordinates)
        if "the same" not in channels:
            assert re.findall(r"`(\w+)`", channels) == list(model.channels)


def test_the_impact_laws_are_all_named():
    rows = dict(re.findall(r"^\| `(\w+)` \| ([^|]*)\| [^|]*\|$", TEXT, re.MULTILINE))
    for name, law in IMPACTS.items():
        assert re.findall(r"`(\w+)`", rows[name]) == [f.name for f in dataclasses.fields(law)]


# --- Python ------------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["README.md", "docs/ensembles.md", "docs/models.md"])
def test_every_snippet_runs(name, monkeypatch):
    text = (ROOT / name).read_text(encoding="utf-8")
    code = "\n".join(re.findall(r"```python\n(.*?)```", text, re.DOTALL)).replace(", 200)", ", 12)")  # coarser grids
    module = types.ModuleType("snippet")
    monkeypatch.setitem(sys.modules, "snippet", module)
    exec(compile(code, name, "exec"), vars(module))


def section(title):
    return ENSEMBLES.split(f"\n## {title}\n")[1].split("\n## ")[0]


def test_the_arguments_of_simulate_many_are_all_there():
    named = re.findall(r"`(\w+)`", " ".join(re.findall(r"^\| (`[^|]*)\|", section("Arguments"), re.MULTILINE)))
    arguments = set(inspect.signature(saltus.simulate_many).parameters) - {"system", "coordinates"}
    assert set(named) - {"theta", "x", "theta_1", "theta_2"} == arguments


def test_the_variables_and_the_stops_of_an_ensemble_are_all_there():
    block = saltus.System(
        model=saltus.RockingBlock(alpha=0.2),
        load=saltus.Load(frequency=3.0, ground_horizontal=saltus.Harmonic(amplitude=0.1)),
        impact=saltus.VelocityReduction(0.9),
    )
    ensemble = saltus.simulate_many(
        block,
        theta=[0.01, 0.02],
        velocity=[0.0, 0.1],
        time=[0.0, 1.0],
        periods=2,
        sample=("state", "extrema", "crossings", "speed"),
        until=("rest", "settled"),
        sensitivities=(),
    )
    tables = section("What is returned").split("| `stop` | |")
    variables, stops = (re.findall(r"`(\w+)`", " ".join(re.findall(r"^\| (`[^|]*)\|", t, re.MULTILINE))) for t in tables)
    assert set(variables) == set(ensemble)
    assert stops == ensemble.stop.attrs["flag_meanings"].split()


def test_the_thresholds_of_capture_are_those_of_the_system_above():
    numbers = np.array(
        re.findall(r"^\| ([\d.]+) \| ([\d.e-]+) \| ([\d.e-]+) \|$", section("Ending early"), re.MULTILINE), dtype=float
    )
    assert len(numbers) == 5
    system = saltus.System(
        model=saltus.Metainterface(beta0=np.deg2rad(80), damping=0.1),
        load=saltus.Load(frequency=1.0, horizontal=saltus.Harmonic(amplitude=0.05), vertical=-0.5),
    )
    paths = {"load.horizontal.amplitude": numbers[:, :1], "impact.e": np.array([1.0, 0.9])}
    np.testing.assert_allclose(capture_speed(system, paths), numbers[:, 1:], rtol=0.05)
