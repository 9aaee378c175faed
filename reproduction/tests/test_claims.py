"""Verdicts follow from numbers, and the paper's errata are all among the claims."""

from dataclasses import replace
from functools import cache
from pathlib import Path

import pytest
from picture_checks import check_provenance, clipped

from saltus import SaltusError
from saltus_paper import FIGURES, ClaimVerdict
from saltus_paper.claims.claim import judge, judge_claim, measured, printed_unit, with_summaries
from saltus_paper.claims.claim_tables import (
    ClaimEntry,
    ListForm,
    Origin,
    claim_tables,
    section_titles,
)
from saltus_paper.claims.ledger import ledger, tally, to_markdown
from saltus_paper.errata import errata
from saltus_paper.release_check import failures

ROOT = Path(__file__).parents[2]
FOLDERS = (ROOT / "tests", ROOT / "reproduction" / "tests")
# Left out here, as they take minutes: quick versions of them are tested in files of their own, and
# `make release-check` judges their claims at full size.
SPECTRA = ("fig09", "fig10", "fig11", "fig12", "fig13", "fig14", "fig15", "quasi")
ELSEWHERE = (
    *SPECTRA,
    "smoothing",
    "chain",
    "proofs",
)  # the last three are computed and judged in test_smoothing_study.py, test_chain.py, test_proofs.py
# Fewer values along an axis: reproduction/tests/test_both_layers.py has the loads on both sides of
# the one that its claim names.
COARSE = {"both_layers": {"size": 3}}
# Those of sections 2 to 5 and of the appendix; from 29 on they are our own (docs/errata.md).
ERRATA = {*range(1, 22), 23, 25, 26, 27, 29, 40}


def judged(*outcomes, statement="s", **entry):
    """A claim with these keys in its table, from what was measured."""
    return judge_claim(
        "x", ClaimEntry(place="eq", statement=statement, evidence="e", **entry), measured(*outcomes)
    )


@pytest.mark.parametrize(
    ("printed", "value", "verdict"),
    [
        ("2.405", 2.40575, ClaimVerdict.AS_PRINTED),  # cut, not rounded
        ("2.405", 2.40449, ClaimVerdict.AS_PRINTED),
        ("2.405", 2.4065, ClaimVerdict.DISAGREES),
        ("110", 100.0, ClaimVerdict.DISAGREES),
        ("110", 109.2, ClaimVerdict.AS_PRINTED),
    ],
)
def test_a_number_agrees_within_one_unit_of_its_last_digit(printed, value, verdict):
    assert judged(value, printed=printed).verdict is verdict


def test_the_unit_of_a_printed_number_is_that_of_its_last_digit():
    assert printed_unit("2.405") == pytest.approx(1e-3)
    assert printed_unit("-1.50") == pytest.approx(1e-2)
    assert printed_unit("110") == 1


def test_a_number_that_only_the_erratum_gives_agrees_with_the_erratum():
    table = {"printed": "1.384", "corrected": "1.13346", "erratum": 9}
    claim = judged(1.133459, **table)
    assert claim.verdict is ClaimVerdict.CORRECTED
    assert claim.verdict_text == "corrected, erratum 9"
    assert judged(1.2, **table).verdict is ClaimVerdict.DISAGREES


@pytest.mark.parametrize(
    ("printed", "corrected", "verdict"),
    [
        (1e-12, None, ClaimVerdict.AS_PRINTED),
        (1e-3, None, ClaimVerdict.DISAGREES),
        (1e-3, 1e-12, ClaimVerdict.CORRECTED),
        (1e-3, 1e-4, ClaimVerdict.DISAGREES),
        (1e-12, 1.0, ClaimVerdict.AS_PRINTED),
        (True, None, ClaimVerdict.AS_PRINTED),
        (False, True, ClaimVerdict.CORRECTED),
        (False, False, ClaimVerdict.DISAGREES),
        (float("nan"), None, ClaimVerdict.DISAGREES),
    ],
)
def test_a_formula_is_judged_by_its_residual(printed, corrected, verdict):
    assert judged(printed, corrected, erratum=4).verdict is verdict


def test_a_corrected_formula_without_an_erratum_disagrees():
    assert judged(1.0, 0.0).verdict is ClaimVerdict.DISAGREES


def test_a_correction_needs_both_kinds_of_evidence():
    table = {"erratum": 4, "second": "a second method finds {found}"}
    entry = ClaimEntry(place="eq", statement="s", evidence="e", **table)
    both = judge_claim("x", entry, measured(False, True, second=True, found=3))
    assert (both.verdict, both.evidence) == (
        ClaimVerdict.CORRECTED,
        "e; independently: a second method finds 3",
    )
    assert (
        judge_claim("x", entry, measured(False, True, second=False, found=3)).verdict
        is ClaimVerdict.UNDECIDED
    )
    assert judge_claim("x", entry, measured(False, True, found=3)).verdict is ClaimVerdict.UNDECIDED
    assert (
        judge_claim("x", entry, measured(True, True, second=False, found=3)).verdict
        is ClaimVerdict.AS_PRINTED
    )


def test_what_the_numbers_do_not_decide_is_undecided_with_its_reason():
    entry = ClaimEntry(place="eq", statement="s", undecided="only {n} motions were tried")
    claim = judge_claim("x", entry, measured(None, n=3))
    assert (claim.verdict, claim.evidence) == (ClaimVerdict.UNDECIDED, "only 3 motions were tried")


def test_our_own_checks_hold_or_disagree_and_never_count_as_the_papers():
    claims = [judged(True, origin=Origin.OURS), judged(False, origin=Origin.OURS), judged(True)]
    assert [claim.verdict for claim in claims] == [
        ClaimVerdict.HOLDS,
        ClaimVerdict.DISAGREES,
        ClaimVerdict.AS_PRINTED,
    ]
    total = ledger(claims)[-1]
    assert total.paper.total() == total.paper[ClaimVerdict.AS_PRINTED] == 1
    assert total.cells()[-1] == "1 of 2"


def test_a_statement_that_is_not_checked_needs_no_measure_and_gives_its_reason(monkeypatch):
    tables = {
        "fig99": {"x": ClaimEntry(place="eq", statement="s", not_checked="it is about experiments")}
    }
    monkeypatch.setattr("saltus_paper.claims.claim.claim_tables", lambda: tables)
    (claim,) = judge("fig99", {})
    assert (claim.verdict, claim.evidence) == (ClaimVerdict.NOT_CHECKED, "it is about experiments")
    with pytest.raises(SaltusError, match="no claim of its table asks for: x"):
        judge("fig99", {"x": measured(True)})


@pytest.mark.parametrize(
    ("outcomes", "verdict", "erratum"),
    [
        (((True,), (True,)), ClaimVerdict.AS_PRINTED, None),
        (((True,), (False, True)), ClaimVerdict.CORRECTED, 4),
        (((None,), (False, True)), ClaimVerdict.UNDECIDED, None),
        (((None,), (False, False)), ClaimVerdict.DISAGREES, None),
    ],
)
def test_a_summary_has_the_gravest_verdict_of_what_it_rests_on(
    monkeypatch, outcomes, verdict, erratum
):
    entry = ClaimEntry(place="eq", statement="s", evidence="e", erratum=4)
    tables = {
        "fig99": {
            "a": entry,
            "b": entry,
            "sum": ClaimEntry(place="abstract", statement="all", rests_on=("a", "b")),
        }
    }
    monkeypatch.setattr("saltus_paper.claims.claim.claim_tables", lambda: tables)
    claims = judge("fig99", {id: measured(*one) for id, one in zip("ab", outcomes, strict=True)})
    summary = with_summaries(claims)[-1]
    assert (summary.id, summary.verdict, summary.erratum) == ("sum", verdict, erratum)
    assert len(with_summaries(claims[:1])) == 1  # one of those that it rests on was not judged


def test_every_summary_rests_on_claims_that_there_are_and_that_are_measured():
    entries = {id: entry for claims in claim_tables().values() for id, entry in claims.items()}
    for id, entry in entries.items():
        assert all(entries[other].is_measured for other in entry.rests_on), id


def test_every_claim_has_evidence_or_a_reason():
    for claims in claim_tables().values():
        for id, entry in claims.items():
            assert bool(entry.evidence or entry.undecided) == entry.is_measured, id


def test_every_erratum_has_a_second_kind_of_evidence_and_every_proof_is_a_test():
    known = {
        path: path.read_text(encoding="utf-8")
        for folder in FOLDERS
        for path in folder.rglob("test_*.py")
    }
    for claims in claim_tables().values():
        for id, entry in claims.items():
            if entry.erratum and not entry.section.startswith("6."):
                assert entry.second or entry.proof, (
                    f"{id} contradicts the paper by one kind of evidence only"
                )
            if entry.proof:
                file, name = entry.proof.split("::")
                assert f"def {name}(" in known[ROOT / file], id


def test_errata_and_claims_name_each_other():
    named = {
        entry.erratum
        for claims in claim_tables().values()
        for entry in claims.values()
        if entry.erratum
    }
    assert named <= errata().keys()
    assert {*range(1, 30)} <= errata().keys()


def test_the_ledger_counts_section_by_section_in_the_papers_order():
    claims = [
        judged(True, section="5.1"),
        judged(False, True, erratum=4, section="2"),
        judged(True, section="2"),
        judged(False, section="2"),
        judged(None, section="A"),
    ]
    rows = ledger(claims)
    assert [row.name.split()[0] for row in rows] == ["2", "5.1", "A", "all"]
    assert [row.cells()[1:] for row in rows] == [
        ("3", "1", "1", "0", "0", "1", "–"),
        ("1", "1", "0", "0", "0", "0", "–"),
        ("1", "0", "0", "1", "0", "0", "–"),
        ("5", "2", "1", "1", "0", "1", "–"),
    ]
    assert (
        tally(claims)
        == "5 statements of the paper: as printed 2, corrected by an erratum 1, undecided 1, not"
        " checked 0, in disagreement 1. Checks of our own that hold: 0 of 0."
    )


def test_the_table_escapes_bars_and_has_each_claim_once_under_its_section():
    text = to_markdown(
        [judged(True, section="2"), judged(False, section="5.1", statement="|θ| > 0")]
    )
    assert "\\|θ\\| > 0" in text
    assert text.index("## 2 Mechanical model") < text.index("## 5.1 Small vibrations")
    assert text.count("| x |") == 2


def test_a_claim_that_was_not_measured_or_is_in_no_table_is_an_error(monkeypatch):
    entry = ClaimEntry(place="eq", statement="s", evidence="e")
    monkeypatch.setattr(
        "saltus_paper.claims.claim.claim_tables",
        lambda: {"fig99": {"one": entry, "another": entry}},
    )
    both = {"one": measured(True), "another": measured(True)}
    assert [claim.id for claim in judge("fig99", both)] == ["one", "another"]
    with pytest.raises(SaltusError, match="fig99 did not measure its claims another"):
        judge("fig99", {"one": measured(True)})
    with pytest.raises(SaltusError, match="no claim of its table asks for: anothr"):
        judge("fig99", both | {"anothr": measured(True)})
    assert len(judge("fig99", both | {"another": None})) == 1  # the data at hand cannot bear on it


def test_every_part_with_claims_is_one_of_the_paper_and_ids_are_unique():
    tables = claim_tables()
    assert tables.keys() <= FIGURES.keys()
    ids = [id for claims in tables.values() for id in claims]
    assert len(ids) == len(set(ids))
    assert {figure.section for figure in FIGURES.values()} - {""} <= section_titles().keys()
    assert {
        entry.section for claims in tables.values() for entry in claims.values()
    } == section_titles().keys()


def test_a_release_fails_with_a_list_of_what_disagrees_and_what_was_not_judged(monkeypatch):
    tables = {"fig99": {"x": None, "y": None}}
    monkeypatch.setattr("saltus_paper.release_check.claim_tables", lambda: tables)
    assert failures([judged(True)]) == ["y of fig99 was not judged"]
    assert failures([judged(False)]) == ["x disagrees: e", "y of fig99 was not judged"]
    assert failures([judged(True), replace(judged(True), id="y")]) == []


def test_evidence_is_written_from_fields_and_from_lists_of_rows_within_rows():
    lists = {
        "panels": ListForm(each="Ω = {w:g}: {peaks}", between="; "),
        "peaks": ListForm(each="{x:.1f}", none="none"),
    }
    entry = ClaimEntry(place="eq", statement="s", evidence="{n} found, {panels}", lists=lists)
    rows = [{"w": 0.5, "peaks": [{"x": 1.0}, {"x": 2.0}]}, {"w": 1.0, "peaks": []}]
    assert (
        entry.filled(entry.evidence, {"n": 2, "panels": rows})
        == "2 found, Ω = 0.5: 1.0, 2.0; Ω = 1: none"
    )


@cache
def data_of(name):
    figure = FIGURES[name]
    return figure.compute(**{**figure.parameters, **COARSE.get(name, {})})


def test_every_erratum_is_proved_by_a_computed_claim_and_nothing_disagrees():
    claims = []
    # those have no errata
    for figure in (figure for name, figure in FIGURES.items() if name not in (*ELSEWHERE, *COARSE)):
        check_provenance(figure.name, data_of(figure.name))
        claims += figure.claims(data_of(figure.name))
    assert len({claim.id for claim in claims}) == len(claims)
    assert [claim.id for claim in claims if claim.verdict is ClaimVerdict.DISAGREES] == []
    assert {claim.erratum for claim in claims if claim.verdict is ClaimVerdict.CORRECTED} == ERRATA
    assert all(claim.evidence and claim.statement and claim.where for claim in claims)


@pytest.mark.thorough
@pytest.mark.parametrize("name", COARSE)
def test_of_a_coarse_grid_nothing_disagrees(name):
    check_provenance(name, data_of(name))
    assert [
        claim.id
        for claim in FIGURES[name].claims(data_of(name))
        if claim.verdict is ClaimVerdict.DISAGREES
    ] == []


@pytest.mark.parametrize(
    "name",
    [
        pytest.param(name, marks=() if name in ("fig04", "fig07") else pytest.mark.thorough)
        for name, figure in FIGURES.items()
        if name not in ELSEWHERE and figure.draw is not None
    ],
)
def test_no_picture_is_clipped(name):
    assert clipped(FIGURES[name].draw(data_of(name))) == []
