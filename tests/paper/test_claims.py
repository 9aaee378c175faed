"""Verdicts follow from numbers, and the paper's errata are all among the claims."""

from dataclasses import replace

import pytest
from picture_checks import check_provenance, clipped

from saltus.errors import SaltusError
from saltus.paper import FIGURES, Agreement
from saltus.paper.claims.claim import judge, judge_claim, measured, printed_unit, tally, to_markdown
from saltus.paper.claims.claim_tables import ClaimEntry, ListForm, claim_tables
from saltus.paper.release_check import failures

# Left out here, as they take minutes: quick versions of them are tested in files of their own, and `make release-check` judges
# their claims at full size.
SPECTRA = ("fig09", "fig10", "fig11", "fig12", "fig13", "fig14", "fig15", "quasi")
ERRATA = {*range(1, 22), 23, 25, 26, 27, 29}  # those of sections 2 to 5 and of the appendix; 29 is our own (docs/errata.md)


def judged(*outcomes, statement="s", **entry):
    """A claim with these keys in its table, from what was measured."""
    return judge_claim("x", ClaimEntry(place="eq", statement=statement, evidence="e", **entry), measured(*outcomes))


@pytest.mark.parametrize(
    ("printed", "value", "verdict"),
    [
        ("2.405", 2.40575, Agreement.AGREES),  # cut, not rounded
        ("2.405", 2.40449, Agreement.AGREES),
        ("2.405", 2.4065, Agreement.DISAGREES),
        ("110", 100.0, Agreement.DISAGREES),
        ("110", 109.2, Agreement.AGREES),
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
    assert claim.verdict is Agreement.ERRATUM
    assert claim.verdict_text == "agrees with erratum 9"
    assert judged(1.2, **table).verdict is Agreement.DISAGREES


@pytest.mark.parametrize(
    ("printed", "corrected", "verdict"),
    [
        (1e-12, None, Agreement.AGREES),
        (1e-3, None, Agreement.DISAGREES),
        (1e-3, 1e-12, Agreement.ERRATUM),
        (1e-3, 1e-4, Agreement.DISAGREES),
        (1e-12, 1.0, Agreement.AGREES),
        (True, None, Agreement.AGREES),
        (False, True, Agreement.ERRATUM),
        (False, False, Agreement.DISAGREES),
        (float("nan"), None, Agreement.DISAGREES),
    ],
)
def test_a_formula_is_judged_by_its_residual(printed, corrected, verdict):
    assert judged(printed, corrected, erratum=4).verdict is verdict


def test_a_corrected_formula_without_an_erratum_disagrees():
    assert judged(1.0, 0.0).verdict is Agreement.DISAGREES


def test_the_table_escapes_bars_and_counts_verdicts():
    claims = [judged(True), judged(False, statement="|θ| > 0")]
    assert "\\|θ\\| > 0" in to_markdown(claims)
    assert tally(claims) == "2 claims: 1 agree, 0 agree with an erratum, 1 disagree."


def test_a_claim_that_was_not_measured_or_is_in_no_table_is_an_error(monkeypatch):
    entry = ClaimEntry(place="eq", statement="s", evidence="e")
    monkeypatch.setattr("saltus.paper.claims.claim.claim_tables", lambda: {"fig99": {"one": entry, "another": entry}})
    both = {"one": measured(True), "another": measured(True)}
    assert [claim.id for claim in judge("fig99", both)] == ["one", "another"]
    with pytest.raises(SaltusError, match="fig99 did not measure its claims another"):
        judge("fig99", {"one": measured(True)})
    with pytest.raises(SaltusError, match="no claim 'anothr'; did you mean 'another'"):
        judge("fig99", both | {"anothr": measured(True)})
    assert len(judge("fig99", both | {"another": None})) == 1  # the data at hand cannot bear on it


def test_every_part_with_claims_is_one_of_the_paper_and_ids_are_unique():
    tables = claim_tables()
    assert tables.keys() <= FIGURES.keys()
    ids = [id for claims in tables.values() for id in claims]
    assert len(ids) == len(set(ids)) == 151


def test_a_release_fails_with_a_list_of_what_disagrees_and_what_was_not_judged(monkeypatch):
    tables = {"fig99": {"x": None, "y": None}}
    monkeypatch.setattr("saltus.paper.release_check.claim_tables", lambda: tables)
    assert failures([judged(True)]) == ["y of fig99 was not judged"]
    assert failures([judged(False)]) == ["x disagrees: e", "y of fig99 was not judged"]
    assert failures([judged(True), replace(judged(True), id="y")]) == []


def test_evidence_is_written_from_fields_and_from_lists_of_rows_within_rows():
    lists = {"panels": ListForm(each="Ω = {w:g}: {peaks}", between="; "), "peaks": ListForm(each="{x:.1f}", none="none")}
    entry = ClaimEntry(place="eq", statement="s", evidence="{n} found, {panels}", lists=lists)
    rows = [{"w": 0.5, "peaks": [{"x": 1.0}, {"x": 2.0}]}, {"w": 1.0, "peaks": []}]
    assert entry.evidence_text({"n": 2, "panels": rows}) == "2 found, Ω = 0.5: 1.0, 2.0; Ω = 1: none"


def test_every_erratum_is_proved_by_a_computed_claim_nothing_disagrees_and_no_picture_is_clipped():
    claims = []
    for figure in (figure for name, figure in FIGURES.items() if name not in SPECTRA):
        data = figure.compute(**figure.parameters)
        check_provenance(figure.name, data)
        claims += figure.claims(data)
        if figure.draw is not None:
            assert clipped(figure.draw(data)) == [], figure.name
    assert len({claim.id for claim in claims}) == len(claims)
    assert [claim.id for claim in claims if claim.verdict is Agreement.DISAGREES] == []
    assert {claim.erratum for claim in claims if claim.verdict is Agreement.ERRATUM} == ERRATA
    assert all(claim.evidence and claim.statement and claim.where for claim in claims)
