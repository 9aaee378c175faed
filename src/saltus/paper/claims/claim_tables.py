"""The tables of claims: what the paper says, as data, in one TOML file for each section and in the paper's order.

A table `[part.claim-id]` holds, for the claim that the part (a figure, table or group of statements) bears on:

    place       equation label, section or figure
    statement   in our own words
    printed     the printed number, as a string; left out where the claim is a formula or a statement
    corrected   the erratum's number
    unit        of both numbers
    tolerance   of the residual of a formula, 1e-9 unless it is given
    erratum     the number of the erratum that corrects the claim
    evidence    a template: `{name:format}` is a field that the part measured
    lists       how a field that is a list of rows is written: `each` row, what stands `between`, and what if there is `none`
    like        another claim, whose keys are taken where this one has none
"""

from __future__ import annotations

import tomllib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from functools import cache
from importlib.resources import files
from typing import Any


@dataclass(frozen=True, slots=True, kw_only=True)
class ListForm:
    """How rows of fields are written one after the other."""

    each: str
    between: str = ", "
    none: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class ClaimEntry:
    """One claim of a table."""

    place: str
    statement: str
    evidence: str
    printed: str | None = None
    corrected: str | None = None
    unit: str = ""
    tolerance: float = 1e-9
    erratum: int | None = None
    lists: dict[str, ListForm] = field(default_factory=dict)

    def evidence_text(self, fields: Mapping[str, Any]) -> str:
        """The evidence with the fields put in."""
        return self._filled(self.evidence, fields)

    def _filled(self, template: str, fields: Mapping[str, Any]) -> str:
        texts = {name: self._listed(self.lists[name], rows) for name, rows in fields.items() if name in self.lists}
        return template.format(**{**fields, **texts})

    def _listed(self, form: ListForm, rows: Iterable[Mapping[str, Any]]) -> str:
        return form.between.join(self._filled(form.each, row) for row in rows) or form.none


@cache
def claim_tables() -> dict[str, dict[str, ClaimEntry]]:
    """All claims by part and id.

    Raises:
        TypeError: a claim without a place, statement or evidence, or with an unknown key.
    """
    parts: dict[str, dict[str, dict[str, Any]]] = {}
    for file in sorted(files("saltus.paper.claims").iterdir(), key=lambda file: file.name):
        if file.name.endswith(".toml"):
            for part, claims in tomllib.loads(file.read_text(encoding="utf-8")).items():
                parts.setdefault(part, {}).update(claims)
    everything = {id: entry for claims in parts.values() for id, entry in claims.items()}
    return {part: {id: _entry(claims[id], everything) for id in claims} for part, claims in parts.items()}


def _entry(own: Mapping[str, Any], everything: Mapping[str, Mapping[str, Any]]) -> ClaimEntry:
    """A claim from its keys, and those of the claim that it is `like`."""
    keys = {**everything[own["like"]], **own} if "like" in own else dict(own)
    keys.pop("like", None)
    lists = {name: ListForm(**form) for name, form in keys.pop("lists", {}).items()}
    return ClaimEntry(**keys, lists=lists)
