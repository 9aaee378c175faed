"""The report as a file: its links, words, sizes and colours, and what of foreign text may stand in
it.
"""

import base64
import io
import itertools
import json
import re
import shutil
from collections import Counter
from dataclasses import replace
from html.parser import HTMLParser

import numpy as np
import pytest
from PIL import Image

from saltus import ParameterError
from saltus.files import read_dataset, write_dataset
from saltus_paper import FIGURES, ClaimVerdict, report_from_results
from saltus_paper import up_to_date as state
from saltus_paper.claims.claim import judge_claim, measured
from saltus_paper.claims.claim_tables import ClaimEntry, ListForm, Origin, claim_tables
from saltus_paper.errata import errata
from saltus_paper.figures.both_layers import FATES, exact_portraits, share_table
from saltus_paper.highlights import findings, highlight_tables, validity
from saltus_paper.report.data_tables import data_tables
from saltus_paper.report.embedded_pictures import embedded
from saltus_paper.report.exact_features import chart_features, diagram_features
from saltus_paper.report.report import Linker, placed

PARTS = ["fig02", "fig08", "table1"]
EMPTY = {"meta", "link", "img", "input", "br", "hr"}


class Page(HTMLParser):
    """The elements of a page in their order: tag and attributes; and whether each that was opened
    was closed.
    """

    def __init__(self, text):
        super().__init__()
        self.elements, self.open, self.unbalanced = [], [], []
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        self.elements.append((tag, dict(attrs)))
        if tag not in EMPTY:
            self.open.append(tag)

    def handle_endtag(self, tag):
        if not self.open or self.open.pop() != tag:
            self.unbalanced.append(tag)

    def values(self, attribute, *tags):
        return [
            attrs[attribute]
            for tag, attrs in self.elements
            if attribute in attrs and (not tags or tag in tags)
        ]


@pytest.fixture(scope="module")
def text(results):
    return (results / "report.html").read_text(encoding="utf-8")


@pytest.fixture(scope="module")
def page(text):
    return Page(text)


def test_every_link_leads_somewhere_and_every_id_is_there_once(page, results):
    ids = page.values("id")
    assert not [id for id, number in Counter(ids).items() if number > 1]
    links = page.values("href", "a")
    assert len(links) > 40
    for link in links:
        if link.startswith("#"):
            assert link[1:] in ids
        else:
            assert (results / link).is_file()
    labels = [
        id
        for value in (*page.values("aria-labelledby"), *page.values("aria-describedby"))
        for id in value.split()
    ]
    assert set(labels) <= set(ids)
    assert page.open == page.unbalanced == []


def test_the_page_is_one_file_that_loads_nothing(page, text):
    for source in (*page.values("src"), *page.values("href", "link")):
        assert source.startswith("data:")
    assert "http:" not in text
    assert "https:" not in text
    assert "@import" not in text
    assert "url(" not in text


def test_headings_never_skip_a_level_and_every_picture_and_table_has_words(page):
    levels = [int(tag[1]) for tag, _ in page.elements if re.fullmatch("h[1-6]", tag)]
    assert levels[0] == 1
    assert levels.count(1) == 1
    assert all(after <= before + 1 for before, after in itertools.pairwise(levels))
    pictures = [attrs for tag, attrs in page.elements if tag == "img" and "src" in attrs]
    assert len(pictures) == 2
    assert all(attrs["alt"] and attrs["width"] and attrs["height"] for attrs in pictures)
    tags = Counter(tag for tag, _ in page.elements)
    assert tags["table"] == tags["caption"] > 5
    assert page.values("lang", "html") == ["en"]


def test_all_that_says_how_a_part_was_made_is_there(text, results):
    record = json.loads((results / ".saltus" / "fig08.json").read_text(encoding="utf-8"))
    said = text[text.index('<h3 id="fig08"') : text.index('<h4 id="claims-fig08"')]
    for word in (
        *record["files"].values(),
        f"{record['seconds']:.1f} s",
        "saltus reproduce fig08",
        *record["versions"],
    ):
        assert word in said
    for panel in read_dataset(results / "fig08.nc").children.values():
        for name in panel.variables:
            assert f"<code>{name}</code>" in said


def test_the_three_lines_of_python_make_the_part(text, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    for name in ("fig08", "table1"):
        said = text[text.index(f'id="{name}"') :]
        code = (
            re.search(r"<pre><code>(.*?)</code></pre>", said, re.DOTALL)
            .group(1)
            .replace("&#34;", '"')
        )
        assert len(code.splitlines()) == 3
        exec(code, {})
    assert (tmp_path / "fig08.png").exists()
    assert capsys.readouterr().out.count("|") > 20


def test_the_report_is_made_anew_from_results_and_says_what_other_sources_made(
    results, tmp_path, monkeypatch
):
    folder = shutil.copytree(results, tmp_path / "results")
    before = (folder / "report.html").read_bytes()
    (folder / "report.html").unlink()
    monkeypatch.setattr(
        "saltus_paper.panel_work.compute_panels", lambda parts: pytest.fail("something is computed")
    )
    assert sorted(report_from_results(folder)) == PARTS
    assert (folder / "report.html").read_bytes() == before
    record = folder / ".saltus" / "fig08.json"
    record.write_text(record.read_text().replace('"key": "', '"key": "0'))
    report_from_results(folder)
    assert (folder / "report.html").read_text(encoding="utf-8").count(
        "Other sources than those"
    ) == 1


def test_a_damaged_part_is_left_out_and_an_empty_folder_refused(results, tmp_path):
    folder = shutil.copytree(results, tmp_path / "results")
    (folder / "fig02.png").write_bytes(b"\x89PNG")
    (folder / ".saltus" / "table1.json").write_text('{"files": {}, "claims": 5}')
    assert report_from_results(folder) == ["fig08"]
    with pytest.raises(ParameterError, match="holds no results"):
        report_from_results(tmp_path / "nothing")


@pytest.mark.parametrize(
    "change",
    [
        *({"seconds": "long"}, {"versions": 5}, {"claims": [1]}),
        *(
            pytest.param(each, marks=pytest.mark.thorough)
            for each in ({"seconds": None}, {"files": []}, {"claims": None})
        ),
    ],
)
def test_a_forged_record_leaves_its_part_out(results, tmp_path, change):
    folder = shutil.copytree(results, tmp_path / "results")
    record = folder / ".saltus" / "table1.json"
    record.write_text(json.dumps(json.loads(record.read_text()) | change))
    assert report_from_results(folder) == ["fig02", "fig08"]


def test_a_data_file_of_another_program_is_refused_in_a_sentence(results, tmp_path):
    folder = shutil.copytree(results, tmp_path / "results")
    (folder / "fig08.nc").write_bytes(b"none of ours")
    record = folder / ".saltus" / "fig08.json"
    kept = json.loads(record.read_text())
    kept["files"]["fig08.nc"] = state.fingerprint(folder / "fig08.nc")
    record.write_text(json.dumps(kept))
    with pytest.raises(ParameterError, match=r"fig08\.nc is no result of saltus"):
        report_from_results(folder)


@pytest.mark.parametrize(
    "words",
    [
        *("<script>alert(1)</script>", '"><img src=x onerror=alert(1)>'),
        *(pytest.param(each, marks=pytest.mark.thorough) for each in ("{{ 7 * 7 }}", "&copy;")),
    ],
)
def test_foreign_words_are_shown_and_never_obeyed(results, tmp_path, monkeypatch, words):
    folder = shutil.copytree(results, tmp_path / "results")
    data = read_dataset(folder / "fig08.nc")
    panel = next(iter(data.children.values()))
    next(iter(panel.data_vars.values())).attrs["long_name"] = words
    write_dataset(folder / "fig08.nc", data)
    record = json.loads((folder / ".saltus" / "fig08.json").read_text())
    record["files"]["fig08.nc"] = state.fingerprint(folder / "fig08.nc")
    record["versions"]["numpy"] = words
    for key in ("statement", "evidence", "where", "paper", "value"):
        record["claims"][0][key] = words
    record["claims"][0]["table"] = [[words], [words]]
    (folder / ".saltus" / "fig08.json").write_text(json.dumps(record))
    monkeypatch.setitem(FIGURES, "fig08", replace(FIGURES["fig08"], caption=words, title=words))
    report_from_results(folder)
    text = (folder / "report.html").read_text(encoding="utf-8")
    escaped = (
        words.replace("&", "&amp;").replace("<", "&lt;").replace(">", "&gt;").replace('"', "&#34;")
    )
    assert text.count(escaped) > 10
    if escaped != words:
        assert words not in text
    assert "onerror" not in {name for _, attrs in Page(text).elements for name in attrs}


def test_a_picture_is_embedded_without_loss_in_less_room(results):
    path = results / "fig08.png"
    picture = embedded(path)
    kind, content = re.fullmatch(r"data:image/(\w+);base64,(.*)", picture.uri).groups()
    shown = Image.open(io.BytesIO(base64.b64decode(content)))
    assert shown.size == (picture.width, picture.height)
    assert np.array_equal(
        np.asarray(shown.convert("RGB")), np.asarray(Image.open(path).convert("RGB"))
    )
    if kind == "webp":
        assert len(content) < path.stat().st_size


def test_the_report_is_hardly_larger_than_its_pictures(results, text):
    pictures = sum((results / f"{name}.png").stat().st_size for name in ("fig02", "fig08"))
    assert len(text.encode()) < pictures * 4 / 3 + 300_000


def luminance(colour):
    """Of a colour #rgb or #rrggbb, by WCAG 2."""
    digits = colour.lstrip("#")
    digits = "".join(2 * digit for digit in digits) if len(digits) == 3 else digits
    parts = [int(digits[i : i + 2], 16) / 255 for i in (0, 2, 4)]
    linear = [
        part / 12.92 if part <= 0.04045 else ((part + 0.055) / 1.055) ** 2.4 for part in parts
    ]
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]


def test_words_stand_out_from_what_they_stand_on_by_day_and_by_night(text):
    schemes = [
        dict(re.findall(r"--(\w+): (#\w+)", block))
        for block in re.findall(r":root \{(.*?)\}", text, re.DOTALL)
    ]
    assert len(schemes) == 3  # light, dark, paper
    for colours in schemes:
        grounds = {
            "ink": ("paper", "tint", "code", "good", "mended", "open", "bad"),
            "soft": ("paper", "good", "mended", "open", "bad"),
        }
        grounds["link"] = ("paper",)
        for ink, places in grounds.items():
            for place in places:
                light, dark = sorted(
                    (luminance(colours[ink]), luminance(colours[place])), reverse=True
                )
                assert (light + 0.05) / (dark + 0.05) >= 4.5, (ink, place)


def test_every_verdict_has_a_box_that_hides_its_claims(page, text):
    for verdict in ClaimVerdict:
        name = verdict.name.lower().replace("_", "-")
        assert f"show-{name}" in page.values("id")
        assert f"body:has(#show-{name}:not(:checked)) .claim.{name}" in text


# --- what it says ------------------------------------------------------------


def test_ten_findings_each_rest_on_errata_or_our_checks_and_validity_on_claims_with_headlines():
    entries = {id: entry for claims in claim_tables().values() for id, entry in claims.items()}
    tables = highlight_tables()
    assert len(tables["findings"]) == 10
    for finding in tables["findings"]:
        assert finding.keys() == {"title", "paper", "instead", "claims"}
        claims = [entries[id] for id in finding["claims"]]
        assert any(claim.erratum in errata() or claim.origin is Origin.OURS for claim in claims)
    assert all(entries[id].headline for id in tables["validity"])
    listed = {id for finding in tables["findings"] for id in finding["claims"]} | set(
        tables["validity"]
    )
    for id, entry in entries.items():
        assert (
            not entry.headline
            or id in listed
            or id.split("-", 1)[1] in {one.split("-", 1)[1] for one in listed}
        ), id


def test_a_finding_is_shown_only_while_all_of_its_claims_bear_it_out():
    first, *others = highlight_tables()["findings"][0]["claims"]
    claim = judge_claim(
        first,
        ClaimEntry(place="eq", statement="s", evidence="e", erratum=22),
        measured(False, True),
    )
    found = findings([claim])
    assert [one.title for one in found] == [highlight_tables()["findings"][0]["title"]]
    assert found[0].errata == [22]
    assert findings([replace(claim, verdict=ClaimVerdict.AS_PRINTED)]) == []
    assert findings([claim, replace(claim, id=others[0], verdict=ClaimVerdict.UNDECIDED)]) == []
    assert findings([replace(claim, id=others[0])]) == []


def test_a_limit_of_validity_is_shown_while_its_claim_says_so():
    entry = ClaimEntry(place="eq", statement="s", evidence="e", headline="beyond {n}", erratum=21)
    claim = judge_claim("one-open-layer", entry, measured(False, True, n=3))
    assert [one.headline for one in validity([claim])] == ["beyond 3"]
    assert validity([replace(claim, verdict=ClaimVerdict.AS_PRINTED)]) == []


def test_evidence_that_has_columns_is_a_table_and_its_text_refers_to_it():
    panels = ListForm(each="{w:g}: {x:.1f}", columns={"Ω": "{w:g}", "x": "{x:.1f}"})
    entry = ClaimEntry(
        place="eq",
        statement="s",
        evidence="found at: {panels}",
        origin=Origin.OURS,
        lists={"panels": panels},
    )
    claim = judge_claim(
        "x", entry, measured(True, panels=[{"w": 0.5, "x": 1.0}, {"w": 2.0, "x": 3.0}])
    )
    assert claim.table == (("Ω", "x"), ("0.5", "1.0"), ("2", "3.0"))
    assert claim.evidence == "found at: 0.5: 1.0, 2: 3.0"
    assert claim.beside_table == "found at (see the table)"
    assert type(claim).from_dict(json.loads(json.dumps(claim.to_dict()))) == claim


def test_every_erratum_has_a_derivation_and_docs_hold_those_that_are_our_own():
    for number, erratum in errata().items():
        assert erratum.place, number
        assert erratum.correct.endswith((".", "!")), number
        assert erratum.derivation.endswith("."), number


def test_numbers_of_errata_that_a_run_measures_are_filled_in_from_its_claims():
    measured = {number: erratum for number, erratum in errata().items() if erratum.measured}
    assert {37, 39} <= set(measured)
    assert {id for erratum in measured.values() for id in erratum.measured} <= {
        id for table in claim_tables().values() for id in table
    }
    filled = errata()[37].filled({"fig11-two-regions": "Ω = 1: 5, Ĥ = 1 to 2"})
    assert filled.derivation.endswith("Over the load there are Ω = 1: 5, Ĥ = 1 to 2.")
    assert "not computed here" in errata()[37].filled({}).derivation
    assert not filled.measured


def test_ids_and_errata_in_words_become_links_and_nothing_else_does():
    linked = Linker({"fig09-chaos", "fig09-chaos-range", "period"})
    assert (
        linked("a period, erratum 22 & erratum 99")
        == 'a period, <a href="#erratum-22">erratum 22</a> &amp; erratum 99'
    )
    assert (
        linked("rests on period (as printed)")
        == 'rests on <a href="#period">period</a> (as printed)'
    )
    assert (
        linked("see fig09-chaos-range") == 'see <a href="#fig09-chaos-range">fig09-chaos-range</a>'
    )
    assert linked("tests/fig09-chaos.py `<b>`") == "tests/fig09-chaos.py <code>&lt;b&gt;</code>"
    assert linked("fig09-chaos", "fig09-chaos") == "fig09-chaos"


def test_labels_of_equations_become_their_numbers():
    said = str(placed("condition after rest_def_red, Kinetic Energy, <b>"))
    assert (
        re.sub("<span[^>]*>|</span>", "", said)
        == "condition after eq.\xa0(47), eq.\xa0(91), &lt;b&gt;"
    )
    assert "eq.\xa0(89)" in placed("smoothing")
    assert placed("the smoothing of section 6") == "the smoothing of section 6"
    assert "eq.\xa0(1)" in Linker(set())("by `gen_conf`")


# --- data --------------------------------------------------------------------


def tree(groups):
    import xarray as xr

    return xr.DataTree.from_dict(groups)


def test_data_tables_join_what_panels_share_and_tell_what_differs(tmp_path):
    import xarray as xr

    def panel(amplitude):
        system = {
            "model": {"type": "M", "beta0": float(np.pi / 3)},
            "load": {"amplitude": amplitude, "frequency": 2.0},
        }
        y = xr.Variable("x", [1.0, 2.0], {"units": "rad", "long_name": "an angle"})
        return xr.Dataset(
            {"y": y},
            attrs={"system": json.dumps(system), "path": "load.frequency", "seed": 7, "other": 1},
        )

    write_dataset(
        tmp_path / "x.nc",
        tree({"/": xr.Dataset(), "a": panel(0.5), "b": panel(0.5), "c": panel(2.0)}),
    )
    tables = data_tables(tmp_path / "x.nc")
    assert [
        (row.panels, row.path, row.dims, row.units, row.meaning) for row in tables.variables
    ] == [("a–c", "y", "x", "rad", "an angle")]
    assert {row.name: row.values for row in tables.parameters} == {
        "model.type": "M", "model.beta0": "1.0472 rad (60°)", "load.amplitude": ("a, b: 0.5; c: "
                                                                                "2"), "load.frequency": "varied",
    }  # fmt: skip
    assert {row.name: row.values for row in tables.settings} == {
        "path": "load.frequency",
        "seed": "7",
    }


def test_what_the_exact_treatment_adds_is_counted_in_the_data(tmp_path):
    import xarray as xr

    def line(dim, **values):
        return xr.Dataset({name: (dim, value) for name, value in values.items()})

    bands = line(
        "band",
        low=[1.0, 2.0],
        high=[1.5, 2.25],
        low_edge=["fold", "unknown"],
        high_edge=["cascade", "undecided"],
    )
    panel = {
        "a/special": line("special", kind=["LP", "LP", "GR", "reaction"]),
        "a/branches": line("branch", closed=[0, 1, 0]),
        "a/bands": bands,
        "a": xr.Dataset(attrs={"missed": 3, "sample": 1000}),
        "disturbed": xr.Dataset(),
    }
    write_dataset(tmp_path / "fig13.nc", tree(panel))
    assert diagram_features(tmp_path, {"fig13": "Fig. 13", "fig08": "Fig. 8"})[1:] == [
        ("Fig. 13 (a)", "3", "1", "2", "0", "0", "1", "2", "0.750", "2 of 4", "3 of 1000")
    ]
    curve = line("point", amplitude=[1.0, 2.0, 3.0])
    chart = {
        "b/borders/curve_00": curve.assign_attrs(kind="LP"),
        "b/borders/curve_01": curve.assign_attrs(kind="GR"),
        "b/borders/ends": line("end", period=[1]),
        "b/disagreements": xr.Dataset(attrs={"changes": 12, "on_curves": 5}),
    }
    write_dataset(tmp_path / "fig15.nc", tree(chart))
    assert chart_features(tmp_path, {"fig15": "Fig. 15"})[1:] == [
        ("Fig. 15 (b)", "1", "0", "0", "1", "6", "12", "5")
    ]
    assert diagram_features(tmp_path, {}) == chart_features(tmp_path, {}) == []


def test_shares_of_both_layers_are_those_of_the_fates():
    import xarray as xr

    fate = np.array([[FATES.index("same")] * 3 + [FATES.index("rest")]], dtype=np.int8)
    data = xr.Dataset(
        {"fate": (("variant", "attractor"), fate)},
        coords={
            "mass_ratio": ("variant", [0.001]),
            "e": ("variant", [0.5]),
            "transfer": ("variant", [0.0]),
        },
    )
    headings, row = share_table(data)
    shares = dict(zip(headings, row, strict=True))
    assert (shares["m, e, g"], shares["exact"], shares["falls to rest"]) == (
        "0.001, 0.5, 0",
        "75%",
        "25%",
    )
    portraits = xr.Dataset(
        {"panel": ("motion", ["fig04a", "fig04a", "fig05b"]), "exact": ("motion", [1, 0, 1])}
    )
    assert exact_portraits(portraits) == [("4a", 1, 2), ("5b", 1, 1)]
