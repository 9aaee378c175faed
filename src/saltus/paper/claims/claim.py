"""A claim: one number or statement of the paper beside what is computed here, and the verdict that follows."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import asdict, dataclass
from decimal import Decimal
from enum import StrEnum
from typing import Any


class Verdict(StrEnum):
    """What the computation says of a claim."""

    AGREES = "agrees"
    ERRATUM = "agrees with erratum"  # not as printed, but as the erratum corrects it
    DISAGREES = "disagrees"


@dataclass(frozen=True, slots=True, kw_only=True)
class Claim:
    """One row of the table of claims. `compare` and `check` make it, so that the verdict is always computed."""

    id: str
    where: str  # equation label, section or figure
    statement: str  # in our own words
    paper: str
    value: str
    verdict: Verdict
    evidence: str
    erratum: int | None = None

    def to_dict(self) -> dict[str, Any]:
        """As written to claims.json."""
        return asdict(self)

    @property
    def verdict_text(self) -> str:
        """The verdict with the erratum's number."""
        return f"{self.verdict} {self.erratum}" if self.verdict is Verdict.ERRATUM else str(self.verdict)


def printed_unit(printed: str) -> float:
    """One unit in the last digit of a printed number: 0.001 for "2.405"."""
    return float(Decimal(1).scaleb(int(Decimal(printed).as_tuple().exponent)))


def compare(
    id: str,
    where: str,
    statement: str,
    *,
    printed: str,
    value: float,
    evidence: str,
    unit: str = "",
    corrected: str | None = None,
    erratum: int | None = None,
) -> Claim:
    """A printed number against a computed one: they agree within one unit of the last printed digit (rounded or cut).

    Where they do not, and the erratum's `corrected` number does, the verdict is "agrees with erratum N".
    """
    text = f"{value:.6g}{f' {unit}' if unit else ''}"
    verdict = Verdict.DISAGREES
    if abs(value - float(printed)) < printed_unit(printed) * (1 + 1e-9):
        verdict = Verdict.AGREES
    elif corrected is not None and abs(value - float(corrected)) < printed_unit(corrected) * (1 + 1e-9):
        verdict = Verdict.ERRATUM
    paper = f"{printed}{f' {unit}' if unit else ''}"
    return Claim(
        id=id, where=where, statement=statement, paper=paper, value=text, verdict=verdict, evidence=evidence, erratum=erratum
    )


def check(
    id: str,
    where: str,
    statement: str,
    *,
    printed: float | bool,
    evidence: str,
    corrected: float | bool | None = None,
    tolerance: float = 1e-9,
    erratum: int | None = None,
) -> Claim:
    """A printed formula or statement, and the erratum's: each a residual that must vanish, or whether it holds."""
    as_printed = _holds(printed, tolerance)
    as_corrected = corrected is not None and _holds(corrected, tolerance)
    verdict = Verdict.AGREES if as_printed else Verdict.ERRATUM if as_corrected and erratum else Verdict.DISAGREES
    return Claim(
        id=id,
        where=where,
        statement=statement,
        paper="as stated" if corrected is None else f"as printed: {_text(printed)}",
        value=_text(printed) if corrected is None else f"corrected: {_text(corrected)}",
        verdict=verdict,
        evidence=evidence,
        erratum=erratum,
    )


def _holds(outcome: float | bool, tolerance: float) -> bool:
    return bool(outcome) if _is_bool(outcome) else abs(float(outcome)) <= tolerance


def _is_bool(outcome: Any) -> bool:
    return isinstance(outcome, bool) or type(outcome).__name__ == "bool"


def _text(outcome: float | bool) -> str:
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
    counts = {verdict: sum(c.verdict is verdict for c in claims) for verdict in Verdict}
    parts = [f"{counts[Verdict.AGREES]} agree", f"{counts[Verdict.ERRATUM]} agree with an erratum"]
    return f"{len(claims)} claims: {', '.join(parts)}, {counts[Verdict.DISAGREES]} disagree."
