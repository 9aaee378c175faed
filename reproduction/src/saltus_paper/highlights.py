"""The first page of the report: the findings that change a conclusion of the paper, and where the
reduced model is valid.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

from saltus_paper.claims.claim import Claim, ClaimVerdict
from saltus_paper.toml_tables import toml_table

# a finding: the statement fails as printed, or our own check holds
BEARS_OUT = (ClaimVerdict.CORRECTED, ClaimVerdict.HOLDS)


@dataclass(frozen=True, slots=True, kw_only=True)
class Finding:
    """One finding of `highlights.toml`, with the claims that support it."""

    title: str
    paper: str  # what the paper concludes
    instead: str
    claims: tuple[Claim, ...]

    @property
    def numbers(self) -> str:
        """The numbers measured, in the headline of the first claim; empty if it has none."""
        return self.claims[0].headline

    @property
    def errata(self) -> list[int]:
        """The numbers of the errata that say more."""
        return sorted({claim.erratum for claim in self.claims if claim.erratum})


def findings(claims: Iterable[Claim]) -> list[Finding]:
    """The findings whose first claim was judged and none of whose claims contradicts them, in the
    order of the file.
    """
    known = {claim.id: claim for claim in claims}
    found = []
    for keys in highlight_tables()["findings"]:
        here = tuple(known[id] for id in keys["claims"] if id in known)
        if keys["claims"][0] in known and all(claim.verdict in BEARS_OUT for claim in here):
            found.append(Finding(**{**keys, "claims": here}))
    return found


def validity(claims: Iterable[Claim]) -> list[Claim]:
    """The claims whose headlines say where the reduced model ends, in the order of
    `highlights.toml`.
    """
    known = {claim.id: claim for claim in claims}
    listed = [known[id] for id in highlight_tables()["validity"] if id in known]
    return [claim for claim in listed if claim.headline and claim.verdict in BEARS_OUT]


def highlight_tables() -> dict[str, Any]:
    """`findings`, each with its keys, and `validity`, the ids of claims, as the file has them."""
    return toml_table("highlights.toml")
