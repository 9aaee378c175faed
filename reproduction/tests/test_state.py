"""What is up to date is left alone; what is missing, changed or interrupted is made again."""

from dataclasses import replace
from functools import partial
from operator import itemgetter

import numpy as np
import pytest

from saltus import ParameterError
from saltus.plots.conventions import new_figure
from saltus_paper import PaperFigure, reproduce
from saltus_paper import up_to_date as state
from saltus_paper.claims import claim
from saltus_paper.claims.claim_tables import ClaimEntry, claim_tables
from saltus_paper.figure_data import dataset, tree

calls = []


def compute(n=3):
    calls.append(n)
    return tree({"line": dataset({"y": ("x", np.arange(float(n)))}, what="a line")}, what="a test")


def draw(data):
    figure = new_figure()
    figure.subplots().plot(data["line"]["y"])
    return figure


def measure(data):
    return {"line": claim.measured(bool((np.diff(data["line"]["y"]) > 0).all()))}


def figure(**changes):
    words = {"name": "fig99", "title": "A line", "caption": "A line.", "module": __name__}
    parts = {
        "panels": lambda **given: {"line": partial(compute, **given)},
        "join": itemgetter("line"),
    }
    return PaperFigure(**{**words, **parts, "draw": draw, "measure": measure, **changes})


@pytest.fixture(autouse=True)
def registry(monkeypatch):
    calls.clear()
    figures = {"fig99": figure()}
    monkeypatch.setattr("saltus_paper.parts.FIGURES", figures)
    tables = claim_tables() | {
        "fig99": {"line": ClaimEntry(place="here", statement="it rises", evidence="differences")}
    }
    for module in (claim, state):
        monkeypatch.setattr(module, "claim_tables", lambda: tables)
    return figures


def test_a_second_run_makes_nothing(tmp_path):
    first, second = reproduce(output=tmp_path), reproduce(output=tmp_path)
    assert [first[0].made, second[0].made] == [True, False]
    assert calls == [3]
    assert second[0].claims == first[0].claims
    assert {p.name for p in tmp_path.iterdir()} == {
        "fig99.nc", "fig99.png", "fig99.pdf", "claims.json", "claims.md", "report.html", ".saltus",
    }  # fmt: skip


def test_the_report_is_not_rewritten_when_nothing_changes(tmp_path):
    reproduce(output=tmp_path)
    before = {p: p.stat().st_mtime_ns for p in tmp_path.iterdir() if p.is_file()}
    reproduce(output=tmp_path)
    assert {p: p.stat().st_mtime_ns for p in tmp_path.iterdir() if p.is_file()} == before


@pytest.mark.parametrize(
    ("damage", "name"),
    [
        ("tampered", "fig99.nc"),
        ("missing", "fig99.png"),
        ("tampered", "fig99.pdf"),
        *(
            pytest.param(*each, marks=pytest.mark.thorough)
            for each in [
                ("missing", "fig99.nc"),
                ("tampered", "fig99.png"),
                ("missing", "fig99.pdf"),
            ]
        ),
    ],
)
def test_a_missing_or_tampered_output_is_made_again(tmp_path, name, damage):
    reproduce(output=tmp_path)
    whole = (tmp_path / name).read_bytes()
    if damage == "missing":
        (tmp_path / name).unlink()
    else:
        (tmp_path / name).write_bytes(whole[:-1])
    assert reproduce(output=tmp_path)[0].made
    assert len((tmp_path / name).read_bytes()) == len(whole)


def test_force_makes_everything_again(tmp_path):
    reproduce(output=tmp_path)
    assert reproduce(output=tmp_path, force=True)[0].made


def test_a_damaged_record_counts_as_none(tmp_path):
    reproduce(output=tmp_path)
    (tmp_path / state.FOLDER / "fig99.json").write_text("{")
    assert reproduce(output=tmp_path)[0].made


def test_other_parameters_make_it_again(tmp_path, registry):
    reproduce(output=tmp_path)
    registry["fig99"] = figure(parameters={"n": 5})
    assert reproduce(output=tmp_path)[0].made
    assert calls == [3, 5]


@pytest.mark.parametrize(
    ("module", "changes"),
    [
        ("saltus_paper.figures.fig08", True),
        # inner files of rooms, whose names come through the front door
        ("saltus.theory.quasi_static", True),
        ("saltus.theory.loaded_equilibria", True),
        ("saltus.flow.kernel.roots", True),
        ("saltus.systems.catalogue.metainterface", True),
        ("saltus.plots.plane", True),
        ("saltus_paper.figures.fig09", False),
        ("saltus.plots.basins", False),  # other inner files of a room that it uses
        ("saltus.theory.rocking", False),
        ("saltus.sweep.plan", False),  # and of rooms that it does not
        ("saltus.attractors.attractor_search", False),
    ],
)
def test_a_figure_is_out_of_date_by_a_change_in_what_it_uses_and_by_no_other(
    module, changes, monkeypatch, tmp_path
):
    from saltus_paper.figures import fig08

    figure = replace(fig08.FIGURE, draw=None)
    (tmp_path / "fig08.nc").write_bytes(b"data")
    state.write(figure, tmp_path, [], 1.0)
    assert state.up_to_date(figure, tmp_path)
    original = state._source
    assert original(module)
    monkeypatch.setattr(
        state, "_source", lambda name: original(name) + (b"#" if name == module else b"")
    )
    assert state.up_to_date(figure, tmp_path) is not changes


def test_a_changed_claim_makes_its_own_figure_anew(tmp_path, monkeypatch):
    reproduce(output=tmp_path)
    entry = replace(state.claim_tables()["fig99"]["line"], tolerance=1e-3)
    other = state.claim_tables() | {"fig98": {"line": entry}}
    monkeypatch.setattr(state, "claim_tables", lambda: other)
    assert not reproduce(output=tmp_path)[0].made
    monkeypatch.setattr(state, "claim_tables", lambda: other | {"fig99": {"line": entry}})
    assert reproduce(output=tmp_path)[0].made


def test_an_interrupt_leaves_what_was_there_and_the_next_run_goes_on(tmp_path, registry):
    reproduce(output=tmp_path)
    whole = (tmp_path / "fig99.nc").read_bytes()

    def interrupted(data):
        raise KeyboardInterrupt

    registry["fig99"] = figure(draw=interrupted)
    with pytest.raises(KeyboardInterrupt):
        reproduce(output=tmp_path, force=True)
    assert not [p.name for p in tmp_path.iterdir() if "part" in p.name]
    registry["fig99"] = figure()
    reproduce(output=tmp_path)
    assert len((tmp_path / "fig99.nc").read_bytes()) == len(whole)
    assert reproduce(output=tmp_path)[0].made is False


def test_an_output_folder_that_is_a_file_is_refused_before_anything_is_computed(tmp_path):
    (tmp_path / "taken").write_text("")
    with pytest.raises(ParameterError, match="taken"):
        reproduce(output=tmp_path / "taken")
    assert calls == []
