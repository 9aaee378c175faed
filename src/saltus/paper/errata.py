"""The paper's errata as data: where each is, and what is right."""

from __future__ import annotations

import tomllib
from dataclasses import dataclass
from functools import cache
from importlib.resources import files


@dataclass(frozen=True, slots=True, kw_only=True)
class Erratum:
    """One erratum of `errata.toml`."""

    place: str  # equation label, section or figure
    correct: str
    derivation: str  # why, in short


@cache
def errata() -> dict[int, Erratum]:
    """All errata by number."""
    tables = tomllib.loads((files("saltus.paper") / "errata.toml").read_text(encoding="utf-8"))
    return {int(number): Erratum(**keys) for number, keys in tables.items()}


@cache
def equation_numbers() -> dict[str, int]:
    """The numbers of the paper's equations by the labels that claims and errata name."""
    return tomllib.loads((files("saltus.paper") / "equations.toml").read_text(encoding="utf-8"))
