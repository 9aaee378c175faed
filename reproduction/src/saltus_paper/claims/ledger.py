"""The ledger: how many of the paper's statements hold as printed, are corrected or are not checked,
section by section.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass

from saltus_paper.claims.claim import Claim, ClaimVerdict
from saltus_paper.claims.claim_tables import Origin, section_titles

PAPER_VERDICTS = (
    ClaimVerdict.AS_PRINTED,
    ClaimVerdict.CORRECTED,
    ClaimVerdict.UNDECIDED,
    ClaimVerdict.NOT_CHECKED,
    ClaimVerdict.DISAGREES,
)


@dataclass(frozen=True, slots=True)
class SectionCount:
    """The verdicts on one section, or on all of them."""

    name: str
    paper: Counter[ClaimVerdict]  # the verdicts on the paper's statements
    ours: Counter[ClaimVerdict]  # the verdicts on our own checks

    def cells(self) -> tuple[str, ...]:
        """A row of the ledger's table, under `HEADINGS`."""
        counts = [self.paper.total(), *(self.paper[verdict] for verdict in PAPER_VERDICTS)]
        own = self.ours.total()
        return (
            self.name,
            *map(str, counts),
            f"{self.ours[ClaimVerdict.HOLDS]} of {own}" if own else "–",
        )


HEADINGS = ("section", "total", *map(str, PAPER_VERDICTS), "own checks")


def ledger(claims: Iterable[Claim]) -> list[SectionCount]:
    """One count for each section that has claims, in the paper's order, and one of all sections."""
    claims, titles = list(claims), section_titles()
    order = list(titles)
    sections = sorted(
        {claim.section for claim in claims},
        key=lambda s: order.index(s) if s in order else len(order),
    )
    rows = [
        _count(f"{s} {titles.get(s, '')}".strip(), (c for c in claims if c.section == s))
        for s in sections
    ]
    return [*rows, _count("all", claims)]


def _count(name: str, claims: Iterable[Claim]) -> SectionCount:
    counts = {origin: Counter[ClaimVerdict]() for origin in Origin}
    for claim in claims:
        counts[claim.origin][claim.verdict] += 1
    return SectionCount(name, counts[Origin.PAPER], counts[Origin.OURS])


def tally(claims: Iterable[Claim]) -> str:
    """How many claims carry each verdict, in words."""
    total = ledger(claims)[-1]
    paper = total.paper
    ours = total.ours
    return (
        f"{paper.total()} statements of the paper: as printed {paper[ClaimVerdict.AS_PRINTED]},"
        f" corrected by an erratum {paper[ClaimVerdict.CORRECTED]}, undecided"
        f" {paper[ClaimVerdict.UNDECIDED]}, not checked {paper[ClaimVerdict.NOT_CHECKED]}, in"
        f" disagreement {paper[ClaimVerdict.DISAGREES]}. Checks of our own that hold:"
        f" {ours[ClaimVerdict.HOLDS]} of {ours.total()}."
    )


def to_markdown(claims: Iterable[Claim]) -> str:
    """The counts section by section, and the table of claims of each section."""
    claims = list(claims)
    lines = [
        "# The paper's claims, computed",
        "",
        tally(claims),
        "",
        *_table([HEADINGS, *(row.cells() for row in ledger(claims))]),
        "",
    ]
    for section, title in section_titles().items():
        here = [claim for claim in claims if claim.section == section]
        if here:
            lines += [f"## {section} {title}", "", *_claims_table(here), ""]
    return "\n".join(lines).rstrip() + "\n"


def _claims_table(claims: Iterable[Claim]) -> list[str]:
    rows = [("id", "where", "claim", "paper", "here", "verdict", "evidence")]
    rows += [
        (c.id, c.where, _statement(c), c.paper, c.value, c.verdict_text, c.evidence) for c in claims
    ]
    return _table(rows)


def _statement(claim: Claim) -> str:
    return f"{claim.statement} (own check)" if claim.origin is Origin.OURS else claim.statement


def _table(rows: Iterable[tuple[str, ...]]) -> list[str]:
    first, *rest = [
        "| " + " | ".join(cell.replace("|", "\\|") for cell in row) + " |" for row in rows
    ]
    return [first, "|" + "---|" * (first.count(" | ") + 1), *rest]
