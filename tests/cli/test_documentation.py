"""What docs/study.md shows is true."""

import dataclasses
import re
from pathlib import Path

import saltus
from saltus.config import load_study
from saltus.systems import IMPACTS, MODELS

TEXT = (Path(__file__).parents[2] / "docs" / "study.md").read_text(encoding="utf-8")
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
