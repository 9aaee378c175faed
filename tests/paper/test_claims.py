"""Verdicts follow from numbers, and the paper's errata are all among the claims."""

import pytest
from picture_checks import check_provenance, clipped

from saltus.paper import FIGURES, Verdict
from saltus.paper.claims.claim import check, compare, printed_unit, tally, to_markdown

WHERE = {"id": "x", "where": "eq", "statement": "s", "evidence": "e"}
SPECTRA = ("fig09", "fig10", "fig11", "fig12", "fig13", "fig14", "fig15", "quasi")  # made small in tests of their own
ERRATA = {*range(1, 22), 23, 25, 26, 27, 29}  # those of sections 2 to 5 and of the appendix; 29 is our own (docs/errata.md)


@pytest.mark.parametrize(
    ("printed", "value", "verdict"),
    [
        ("2.405", 2.40575, Verdict.AGREES),  # cut, not rounded
        ("2.405", 2.40449, Verdict.AGREES),
        ("2.405", 2.4065, Verdict.DISAGREES),
        ("110", 100.0, Verdict.DISAGREES),
        ("110", 109.2, Verdict.AGREES),
    ],
)
def test_a_number_agrees_within_one_unit_of_its_last_digit(printed, value, verdict):
    assert compare(printed=printed, value=value, **WHERE).verdict is verdict


def test_the_unit_of_a_printed_number_is_that_of_its_last_digit():
    assert printed_unit("2.405") == pytest.approx(1e-3)
    assert printed_unit("-1.50") == pytest.approx(1e-2)
    assert printed_unit("110") == 1


def test_a_number_that_only_the_erratum_gives_agrees_with_the_erratum():
    claim = compare(printed="1.384", corrected="1.13346", value=1.133459, erratum=9, **WHERE)
    assert claim.verdict is Verdict.ERRATUM
    assert claim.verdict_text == "agrees with erratum 9"
    assert compare(printed="1.384", corrected="1.13346", value=1.2, erratum=9, **WHERE).verdict is Verdict.DISAGREES


@pytest.mark.parametrize(
    ("printed", "corrected", "verdict"),
    [
        (1e-12, None, Verdict.AGREES),
        (1e-3, None, Verdict.DISAGREES),
        (1e-3, 1e-12, Verdict.ERRATUM),
        (1e-3, 1e-4, Verdict.DISAGREES),
        (1e-12, 1.0, Verdict.AGREES),
        (True, None, Verdict.AGREES),
        (False, True, Verdict.ERRATUM),
        (False, False, Verdict.DISAGREES),
        (float("nan"), None, Verdict.DISAGREES),
    ],
)
def test_a_formula_is_judged_by_its_residual(printed, corrected, verdict):
    assert check(printed=printed, corrected=corrected, erratum=4, **WHERE).verdict is verdict


def test_a_corrected_formula_without_an_erratum_disagrees():
    assert check(printed=1.0, corrected=0.0, **WHERE).verdict is Verdict.DISAGREES


def test_the_table_escapes_bars_and_counts_verdicts():
    claims = [check(printed=True, **WHERE), check(printed=False, **{**WHERE, "statement": "|θ| > 0"})]
    assert "\\|θ\\| > 0" in to_markdown(claims)
    assert tally(claims) == "2 claims: 1 agree, 0 agree with an erratum, 1 disagree."


def test_every_erratum_is_proved_by_a_computed_claim_nothing_disagrees_and_no_picture_is_clipped():
    claims = []
    for figure in (figure for name, figure in FIGURES.items() if name not in SPECTRA):
        data = figure.compute(**figure.parameters)
        check_provenance(figure.name, data)
        claims += figure.claims(data)
        if figure.draw is not None:
            assert clipped(figure.draw(data)) == [], figure.name
    assert len({claim.id for claim in claims}) == len(claims)
    assert [claim.id for claim in claims if claim.verdict is Verdict.DISAGREES] == []
    assert {claim.erratum for claim in claims if claim.verdict is Verdict.ERRATUM} == ERRATA
    assert all(claim.evidence and claim.statement and claim.where for claim in claims)
