"""One figure from its name to files, as the command line makes it."""

import io
import json
import re
from dataclasses import replace

import pytest
import xarray as xr

from saltus import ParameterError
from saltus.files import write_dataset
from saltus.flow import available_cores
from saltus.systems import System
from saltus_paper import FIGURES, reproduce
from saltus_paper.expected_time import Speeds, expected_seconds, on_the_clock, reasonable_effort
from saltus_paper.figures.figure import EFFORTS
from saltus_paper.toml_tables import toml_table


def test_one_name_makes_one_figure_with_its_data_claims_and_report(tmp_path):
    (result,) = reproduce(["fig08"], tmp_path)
    assert result.made
    assert [path.name for path in result.files] == ["fig08.nc", "fig08.png", "fig08.pdf"]
    claims = json.loads((tmp_path / "claims.json").read_text(encoding="utf-8"))
    assert [claim["id"] for claim in claims] == [claim.id for claim in result.claims]
    page = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert 'href="fig08.png"' in page
    assert all(f'id="{claim["id"]}"' in page for claim in claims)
    assert 'id="fig04"' not in page


def test_a_picture_embeds_its_fonts_whole_and_the_data_holds_its_systems(tmp_path):
    reproduce(["fig08"], tmp_path)
    pdf = (tmp_path / "fig08.pdf").read_bytes()
    assert b"/FontFile2" in pdf
    assert b"/Type3" not in pdf
    with xr.open_datatree(tmp_path / "fig08.nc", engine="h5netcdf") as data:
        system = System.from_json(str(data["iii"]["system"].values[0]))
        assert system.get("load.vertical.amplitude") == 0.25


def test_a_picture_is_the_same_from_the_data_on_disk(tmp_path):
    figure = FIGURES["fig08"]
    data = figure.compute()
    write_dataset(tmp_path / "fig08.nc", data)
    with xr.open_datatree(tmp_path / "fig08.nc", engine="h5netcdf") as stored:
        pictures = [io.BytesIO(), io.BytesIO()]
        for picture, source in zip(pictures, (data, stored.load()), strict=True):
            figure.draw(source).savefig(picture, dpi=60)
    assert pictures[0].getvalue() == pictures[1].getvalue()


def test_the_time_is_told_first_and_each_picture_as_it_is_ready(tmp_path):
    told = []
    reproduce(["fig08"], tmp_path, progress=lambda fraction, what: told.append((fraction, what)))
    words = [what.split(",")[0] for _, what in told]
    assert words[0] == "measuring the speed of this machine"
    assert re.match(r"1 parts will take about \d+ (s|min) here on \d+ core", words[1])
    assert words[2] == f"{tmp_path / 'fig08.png'} is ready"
    assert [fraction for fraction, _ in told] == sorted(fraction for fraction, _ in told)


def test_the_work_of_every_part_is_known_and_a_draft_takes_a_third_at_most():
    times = {
        effort: expected_seconds(
            [figure.at(effort) for figure in FIGURES.values()], Speeds(1e5, 100.0)
        )
        for effort in EFFORTS
    }
    table = toml_table("expected_time.toml")
    assert set(times["standard"]) == set(table["standard"])
    assert set(table["quick"]) == {name for name, figure in FIGURES.items() if figure.quick}
    assert sum(times["quick"].values()) < sum(times["standard"].values()) / 3


def test_twice_the_speed_is_half_the_time():
    slow, fast, no_faster_branches = (
        expected_seconds([FIGURES["fig14"]], Speeds(motions, points))["fig14"]
        for motions, points in ((1e5, 100.0), (2e5, 200.0), (2e5, 100.0))
    )
    assert slow == 2 * fast
    assert fast < no_faster_branches < slow
    assert on_the_clock(1200.0 * available_cores()) == "20 min"
    assert on_the_clock(42.0 * available_cores()) == "40 s"


def test_a_slow_machine_makes_a_draft_where_time_is_short():
    whole = sum(expected_seconds(FIGURES.values(), Speeds(1e5, 100.0)).values())
    for cores, effort in ((1.1 * whole / 900.0, "standard"), (0.9 * whole / 900.0, "quick")):
        assert reasonable_effort(FIGURES.values(), Speeds(1e5, 100.0), cores) == effort


@pytest.mark.thorough
def test_a_draft_is_marked_and_made_anew_in_full(tmp_path, monkeypatch):
    monkeypatch.setitem(FIGURES, "fig04", replace(FIGURES["fig04"], quick={"samples": 300}))
    assert reproduce(["fig04"], tmp_path, effort="quick")[0].made
    page = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert "Draft: 1 of 1 parts" in page
    assert "samples = 300" in page
    assert '<a href="fig04.html">Move it</a>' in page
    assert '"title": "Separatrix"' in (tmp_path / "fig04.html").read_text(encoding="utf-8")
    assert not reproduce(["fig04"], tmp_path, effort="quick")[0].made
    assert "Draft: 1 of 1 parts" in (tmp_path / "report.html").read_text(encoding="utf-8")
    assert reproduce(["fig04"], tmp_path)[0].made
    assert "Draft:" not in (tmp_path / "report.html").read_text(encoding="utf-8")
    # in full it is better than a draft
    assert not reproduce(["fig04"], tmp_path, effort="quick")[0].made


def test_an_unknown_name_is_answered_with_the_near_ones(tmp_path):
    with pytest.raises(ParameterError, match=r"'fig4'.*'fig04'"):
        reproduce(["fig4"], tmp_path)
    assert list(tmp_path.iterdir()) == []


def test_the_table_has_a_row_for_each_scenario(tmp_path):
    reproduce(["table1"], tmp_path)
    lines = (tmp_path / "table1.md").read_text(encoding="utf-8").splitlines()
    rows = [line for line in lines if re.match(r"\| [12] \|", line)]
    assert len(rows) == 5
    assert "partial bouncing" in (tmp_path / "report.html").read_text(encoding="utf-8")


def test_every_part_has_a_title_a_caption_and_its_own_name():
    for name, figure in FIGURES.items():
        assert figure.name == name
        assert figure.title
        assert figure.caption.endswith(".")
