"""One figure from its name to files, as the command line makes it."""

import io
import json
import re

import pytest
import xarray as xr

from saltus import ParameterError
from saltus.files import write_dataset
from saltus.systems import System
from saltus_paper import FIGURES, reproduce


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
