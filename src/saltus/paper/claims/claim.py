"""A claim: a number or statement of the paper, what a figure measured for it, and the verdict that follows.

What the paper says stands in the tables beside this file (see `claim_tables`); a figure or section gives one `Measured` for each
of its claims, and `judge` joins both.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass, replace
from decimal import Decimal
from enum import StrEnum
from typing import Any

from saltus.errors import SaltusError, near
from saltus.paper.claims.claim_tables import ClaimEntry, claim_tables


class Agreement(StrEnum):
    """What the computation says of a claim."""

    AGREES = "agrees"
    ERRATUM = "agrees with erratum"  # not as printed, but as the erratum corrects it
    DISAGREES = "disagrees"


@dataclass(frozen=True, slots=True, kw_only=True)
class Claim:
    """One row of the table of claims. `judge` makes it, so that the verdict is always computed."""

    id: str
    where: str  # equation label, section or figure
    statement: str  # in our own words
    paper: str
    value: str
    verdict: Agreement
    evidence: str
    erratum: int | None = None

    def to_dict(self) -> dict[str, Any]:
        """As written to claims.json."""
        return asdict(self)

    @property
    def verdict_text(self) -> str:
        """The verdict with the erratum's number."""
        return f"{self.verdict} {self.erratum}" if self.verdict is Agreement.ERRATUM else str(self.verdict)


@dataclass(frozen=True, slots=True)
class Measured:
    """What was computed for one claim.

    A claim with a printed number has one `outcome`, the number found. For a formula or statement the outcome is a residual that
    must vanish, or whether it holds, as printed and, where there is an erratum, as `corrected`.
    """

    outcome: float | bool
    corrected: float | bool | None
    fields: Mapping[str, Any]  # of the template of the evidence


Measures = Mapping[str, Measured | None]  # by the claim's id; None where the data at hand cannot bear on it


def measured(outcome: float | bool, corrected: float | bool | None = None, /, **fields: Any) -> Measured:
    """A `Measured` with the fields of the claim's evidence."""
    return Measured(outcome, corrected, fields)


def with_fields(fields: Mapping[str, Any], measures: Mapping[str, Measured]) -> dict[str, Measured]:
    """The measures with fields that all of their evidence may name."""
    return {id: replace(one, fields={**fields, **one.fields}) for id, one in measures.items()}


def judge(part: str, measures: Measures) -> list[Claim]:
    """The claims of a part of the paper, such as "fig04", in the order of its table.

    Raises:
        SaltusError: a claim of the table that was not measured, or a measured one that is in no table.
    """
    entries = claim_tables().get(part, {})
    missing, unknown = entries.keys() - measures.keys(), measures.keys() - entries.keys()
    if missing:
        raise SaltusError(f"{part} did not measure its claims {', '.join(sorted(missing))}")
    if unknown:
        raise SaltusError("; ".join(f"{part} has no claim {id!r}; {near(id, entries)}" for id in sorted(unknown)))
    return [judge_claim(id, entry, one) for id, entry in entries.items() if (one := measures[id]) is not None]


def judge_claim(id: str, entry: ClaimEntry, measured: Measured) -> Claim:
    """One claim: a number against the printed one, or a formula or statement by its residual or whether it holds."""
    paper, value, verdict = (_compared if entry.printed is not None else _checked)(entry, measured)
    return Claim(
        id=id,
        where=entry.place,
        statement=entry.statement,
        paper=paper,
        value=value,
        verdict=verdict,
        evidence=entry.evidence_text(measured.fields),
        erratum=entry.erratum,
    )


def _compared(entry: ClaimEntry, measured: Measured) -> tuple[str, str, Agreement]:
    """Numbers agree within one unit of the last printed digit, so that a digit may have been rounded or cut."""
    unit = f" {entry.unit}" if entry.unit else ""
    verdict = Agreement.DISAGREES
    if _same_number(measured.outcome, entry.printed):
        verdict = Agreement.AGREES
    elif _same_number(measured.outcome, entry.corrected):
        verdict = Agreement.ERRATUM
    return f"{entry.printed}{unit}", f"{measured.outcome:.6g}{unit}", verdict


def _same_number(value: float, printed: str | None) -> bool:
    return printed is not None and abs(value - float(printed)) < printed_unit(printed) * (1 + 1e-9)


def printed_unit(printed: str) -> float:
    """One unit in the last digit of a printed number: 0.001 for "2.405"."""
    return float(Decimal(1).scaleb(int(Decimal(printed).as_tuple().exponent)))


def _checked(entry: ClaimEntry, measured: Measured) -> tuple[str, str, Agreement]:
    """A residual vanishes within the tolerance; the erratum counts only where the claim as printed fails."""
    printed, corrected = measured.outcome, measured.corrected
    agrees, mended = (one is not None and _holds(one, entry.tolerance) for one in (printed, corrected))
    verdict = Agreement.AGREES if agrees else Agreement.ERRATUM if mended and entry.erratum else Agreement.DISAGREES
    if corrected is None:
        return "as stated", _outcome_text(printed), verdict
    return f"as printed: {_outcome_text(printed)}", f"corrected: {_outcome_text(corrected)}", verdict


def _holds(outcome: float | bool, tolerance: float) -> bool:
    return bool(outcome) if _is_bool(outcome) else abs(float(outcome)) <= tolerance


def _is_bool(outcome: Any) -> bool:
    return isinstance(outcome, bool) or type(outcome).__name__ == "bool"


def _outcome_text(outcome: float | bool) -> str:
    return ("holds" if outcome else "does not hold") if _is_bool(outcome) else f"residual {float(outcome):.1e}"


def to_markdown(claims: Iterable[Claim]) -> str:
    """The table of claims, with a count of the verdicts above it."""
    claims = list(claims)
    lines = ["# The paper's claims, computed", "", tally(claims), ""]
    lines += ["| id | where | claim | paper | here | verdict | evidence |", "|---|---|---|---|---|---|---|"]
    for c in claims:
        cells = (c.id, c.where, c.statement, c.paper, c.value, c.verdict_text, c.evidence)
        lines.append("| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |")
    return "\n".join(lines) + "\n"


def tally(claims: Iterable[Claim]) -> str:
    """How many claims carry each verdict, in words."""
    claims = list(claims)
    counts = {verdict: sum(c.verdict is verdict for c in claims) for verdict in Agreement}
    parts = [f"{counts[Agreement.AGREES]} agree", f"{counts[Agreement.ERRATUM]} agree with an erratum"]
    return f"{len(claims)} claims: {', '.join(parts)}, {counts[Agreement.DISAGREES]} disagree."
