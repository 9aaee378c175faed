"""The paper's errata as data: the place of each, and the correction."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

from saltus_paper.toml_tables import toml_table


@dataclass(frozen=True, slots=True, kw_only=True)
class Erratum:
    """One erratum of `errata.toml`."""

    place: str  # equation label, section or figure
    correct: str
    derivation: str  # why, in short


@cache
def errata() -> dict[int, Erratum]:
    """All errata by number."""
    return {int(number): Erratum(**keys) for number, keys in toml_table("errata.toml").items()}
