"""The paper's errata as data: the place of each, and the correction.

What a run measures is in no text: `{id}` stands for the evidence of the claim of that id, which is
filled in from the results.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cache

from saltus_paper.toml_tables import toml_table

MEASURED = re.compile(r"\{([a-z0-9-]+)\}")


@dataclass(frozen=True, slots=True, kw_only=True)
class Erratum:
    """One erratum of `errata.toml`."""

    place: str  # equation label, section or figure
    correct: str
    derivation: str  # why, in short

    @property
    def measured(self) -> tuple[str, ...]:
        """The ids of the claims whose evidence is part of the texts."""
        return tuple(MEASURED.findall(self.correct + self.derivation))

    def filled(self, evidence: Mapping[str, str]) -> Erratum:
        """The erratum with the evidence of claims, by their ids; of one that there is not yet it
        says so.
        """

        def found(match: re.Match[str]) -> str:
            return evidence.get(match[1], f"not computed here, see the claim {match[1]}")

        return replace(
            self,
            correct=MEASURED.sub(found, self.correct),
            derivation=MEASURED.sub(found, self.derivation),
        )


@cache
def errata() -> dict[int, Erratum]:
    """All errata by number."""
    return {int(number): Erratum(**keys) for number, keys in toml_table("errata.toml").items()}
