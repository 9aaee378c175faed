"""A claim: a number or statement of the paper, what a figure measured for it, and the verdict that
follows.

The statements of the paper are in the tables beside this file (see `claim_tables`); a figure or
section gives one `Measured` for each of its claims, and `judge` joins both. `ledger` counts the
verdicts.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass, replace
from decimal import Decimal
from enum import StrEnum
from typing import Any

from saltus import SaltusError
from saltus_paper.claims.claim_tables import BESIDE_TABLE, ClaimEntry, Origin, claim_tables


class ClaimVerdict(StrEnum):
    """The verdict of the computation on a claim; the gravest one is the last."""

    HOLDS = "holds"  # a check of our own, which the paper does not state
    AS_PRINTED = "as printed"
    NOT_CHECKED = "not checked"  # with the reason
    CORRECTED = "corrected"  # it fails as printed, and holds as its erratum corrects it
    UNDECIDED = "undecided"  # the numbers decide nothing, with the reason
    DISAGREES = "disagrees"  # it fails as printed, and there is no erratum that holds


@dataclass(frozen=True, slots=True, kw_only=True)
class Claim:
    """One row of the table of claims. `judge` makes it, so that the verdict is always computed."""

    id: str
    section: str  # its number in the paper
    origin: Origin
    where: str  # equation label, section or figure
    statement: str  # in our own words
    paper: str
    value: str
    verdict: ClaimVerdict
    evidence: str
    erratum: int | None = None
    headline: str = ""
    # a part of the evidence; its first row are the headings
    table: tuple[tuple[str, ...], ...] = ()
    beside_table: str = ""  # the evidence without the part that is in the table

    def to_dict(self) -> dict[str, Any]:
        """The claim as it is written to claims.json."""
        return asdict(self)

    @classmethod
    def from_dict(cls, row: Mapping[str, Any]) -> Claim:
        """The claim that `to_dict` wrote."""
        table = tuple(tuple(map(str, line)) for line in row["table"])
        return cls(
            **{
                **row,
                "verdict": ClaimVerdict(row["verdict"]),
                "origin": Origin(row["origin"]),
                "table": table,
            }
        )

    @property
    def verdict_text(self) -> str:
        """The verdict with the erratum's number."""
        if self.verdict is ClaimVerdict.CORRECTED and self.erratum:
            return f"{self.verdict}, erratum {self.erratum}"
        return str(self.verdict)


@dataclass(frozen=True, slots=True)
class Measured:
    """What was computed for one claim.

    For a claim with a printed number, `outcome` is the number found. For a formula or a statement
    as printed it is a residual that must vanish, or whether it holds; `corrected` is the same for
    the claim as its erratum corrects it, and `second` the same for the correction by an independent
    kind of evidence. An outcome of None decides nothing.
    """

    outcome: float | bool | None
    corrected: float | bool | None
    second: float | bool | None
    fields: Mapping[str, Any]  # the fields of the evidence's template


# by the claim's id; None if the data at hand say nothing about it
Measures = Mapping[str, Measured | None]


def measured(
    outcome: float | bool | None,
    corrected: float | bool | None = None,
    /,
    *,
    second: float | bool | None = None,
    **fields: Any,
) -> Measured:
    """A `Measured` with the fields of the claim's evidence."""
    return Measured(outcome, corrected, second, fields)


def with_fields(fields: Mapping[str, Any], measures: Mapping[str, Measured]) -> dict[str, Measured]:
    """The measures with further fields, which the templates of their evidence may name."""
    return {id: replace(one, fields={**fields, **one.fields}) for id, one in measures.items()}


def judge(part: str, measures: Measures) -> list[Claim]:
    """The claims of a part of the paper, such as "fig04", in the order of its table; without those
    that rest on other claims.

    Raises
    ------
    SaltusError
        A claim of the table that was not measured, or a measured one that is in no table.
    """
    entries = {
        id: entry for id, entry in claim_tables().get(part, {}).items() if not entry.rests_on
    }
    to_measure = {id for id, entry in entries.items() if entry.is_measured}
    missing = to_measure - measures.keys()
    unknown = measures.keys() - to_measure
    if missing:
        raise SaltusError(f"{part} did not measure its claims {', '.join(sorted(missing))}")
    if unknown:
        raise SaltusError(
            f"{part} measures what no claim of its table asks for: {', '.join(sorted(unknown))}"
        )
    claims = []
    for id, entry in entries.items():
        one = measures.get(id)
        if not entry.is_measured:
            claims.append(
                _row(id, entry, ("as stated", "", ClaimVerdict.NOT_CHECKED), entry.not_checked)
            )
        elif one is not None:
            claims.append(judge_claim(id, entry, one))
    return claims


def judge_claim(id: str, entry: ClaimEntry, measured: Measured) -> Claim:
    """One claim: a number against the printed one, or a formula or statement by its residual or
    whether it holds.
    """
    if measured.outcome is None:
        judged = ("as stated", "", ClaimVerdict.UNDECIDED)
        templates = [entry.undecided, entry.evidence]
    else:
        judged = (_compared if entry.printed is not None else _checked)(entry, measured)
        templates = [entry.evidence]
    if judged[2] is ClaimVerdict.CORRECTED:
        # A proof is the name of a test and not a template, but holds no braces.
        templates += [f"independently: {one}" for one in (entry.proof, entry.second) if one]
        if entry.second and (
            measured.second is None or not _holds(measured.second, entry.tolerance)
        ):
            # one kind of evidence against the paper is not enough
            judged = *judged[:2], ClaimVerdict.UNDECIDED
    template = "; ".join(filter(None, templates))
    table = entry.table(measured.fields)
    return replace(
        _row(id, entry, judged, entry.filled(template, measured.fields)),
        headline="" if measured.outcome is None else entry.filled(entry.headline, measured.fields),
        table=tuple(map(tuple, table)),
        beside_table=_without_list(entry.filled(template, measured.fields, beside_table=True))
        if table
        else "",
    )


def _without_list(evidence: str) -> str:
    """The evidence with the reference to the table, without the comma or colon that led to the
    list.
    """
    return re.sub(rf"[,:;]?( ?{re.escape(BESIDE_TABLE)})", r"\1", evidence)


def _row(id: str, entry: ClaimEntry, judged: tuple[str, str, ClaimVerdict], evidence: str) -> Claim:
    paper, value, verdict = judged
    return Claim(
        id=id,
        section=entry.section,
        origin=entry.origin,
        where=entry.place,
        statement=entry.statement,
        paper=paper,
        value=value,
        verdict=verdict,
        evidence=evidence,
        erratum=entry.erratum,
        headline=entry.headline,
    )


def with_summaries(claims: Iterable[Claim]) -> list[Claim]:
    """The claims and the summaries that rest on them: a summary has the gravest verdict of its
    claims, once all are judged.
    """
    known = {claim.id: claim for claim in claims}
    entries = {
        id: entry
        for part in claim_tables().values()
        for id, entry in part.items()
        if entry.rests_on
    }
    ready = {
        id: entry
        for id, entry in entries.items()
        if all(other in known for other in entry.rests_on)
    }
    return [
        *known.values(),
        *(
            _summary(id, entry, [known[other] for other in entry.rests_on])
            for id, entry in ready.items()
        ),
    ]


def _summary(id: str, entry: ClaimEntry, parts: list[Claim]) -> Claim:
    gravity = list(ClaimVerdict)
    gravest = max(parts, key=lambda claim: gravity.index(claim.verdict))
    verdict = _true(entry) if gravest.verdict is ClaimVerdict.HOLDS else gravest.verdict
    evidence = "rests on " + ", ".join(f"{claim.id} ({claim.verdict_text})" for claim in parts)
    row = _row(id, entry, ("as stated", "see the claims it rests on", verdict), evidence)
    return replace(
        row,
        erratum=entry.erratum or (gravest.erratum if verdict is ClaimVerdict.CORRECTED else None),
    )


def _compared(entry: ClaimEntry, measured: Measured) -> tuple[str, str, ClaimVerdict]:
    """Numbers agree within one unit of the last printed digit, so that a digit may have been
    rounded or cut.
    """
    unit = f" {entry.unit}" if entry.unit else ""
    verdict = ClaimVerdict.DISAGREES
    if _same_number(measured.outcome, entry.printed):
        verdict = _true(entry)
    elif _same_number(measured.outcome, entry.corrected):
        verdict = ClaimVerdict.CORRECTED
    return f"{entry.printed}{unit}", f"{measured.outcome:.6g}{unit}", verdict


def _true(entry: ClaimEntry) -> ClaimVerdict:
    return ClaimVerdict.HOLDS if entry.origin is Origin.OURS else ClaimVerdict.AS_PRINTED


def _same_number(value: float | None, printed: str | None) -> bool:
    return (
        value is not None
        and printed is not None
        and abs(value - float(printed)) < printed_unit(printed) * (1 + 1e-9)
    )


def printed_unit(printed: str) -> float:
    """One unit in the last digit of a printed number: 0.001 for "2.405"."""
    return float(Decimal(1).scaleb(int(Decimal(printed).as_tuple().exponent)))


def _checked(entry: ClaimEntry, measured: Measured) -> tuple[str, str, ClaimVerdict]:
    """A residual vanishes within the tolerance; the erratum counts only where the claim as printed
    fails.
    """
    printed = measured.outcome
    corrected = measured.corrected
    agrees, mended = (
        one is not None and _holds(one, entry.tolerance) for one in (printed, corrected)
    )
    verdict = (
        _true(entry)
        if agrees
        else ClaimVerdict.CORRECTED
        if mended and entry.erratum
        else ClaimVerdict.DISAGREES
    )
    if corrected is None or agrees:  # what holds as printed needs no correction beside it
        return "as stated", _outcome_text(printed), verdict
    return (
        f"as printed: {_outcome_text(printed)}",
        f"corrected: {_outcome_text(corrected)}",
        verdict,
    )


def _holds(outcome: float | bool, tolerance: float) -> bool:
    return bool(outcome) if _is_bool(outcome) else abs(float(outcome)) <= tolerance


def _is_bool(outcome: Any) -> bool:
    return isinstance(outcome, bool) or type(outcome).__name__ == "bool"


def _outcome_text(outcome: Any) -> str:
    return (
        ("holds" if outcome else "does not hold")
        if _is_bool(outcome)
        else f"residual {float(outcome):.1e}"
    )
