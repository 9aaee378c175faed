"""The tables of claims: the paper's statements as data, in one TOML file for each section and in
the paper's order.

A file begins with the `section` of the paper, its number, and its `title`. A table
`[part.claim-id]` holds, for the claim that the part (a figure, table or group of statements) bears
on:

    place        equation label, section or figure statement    in our own words origin
    "paper", or "ours" for a check of our own that the paper does not state; "paper" unless it is
    given printed      the printed number, as a string; left out where the claim is a formula or a
    statement corrected    the erratum's number unit         of both numbers tolerance    of the
    residual of a formula, 1e-9 unless it is given erratum      the number of the erratum that
    corrects the claim evidence     a template: `{name:format}` is a field that the part measured
    second       a template of the second, independent kind of evidence for the correction, which
    the part measures as `second` proof        the test that shows the correction in another way, as
    file::name undecided    a template of the reason for which the numbers decide nothing; the part
    then measures None not_checked  the reason for which the statement is not checked: nothing is
    measured for it rests_on     the ids of the claims of which this one is a summary: nothing is
    measured for it either headline     a template of what the report says on its first page, for
    the claims that `highlights.toml` lists lists        how a field that is a list is written:
    `each` row of fields or value (then as `{}`), what stands `between`, and
                 what if there is `none`; if the report shows it as a table, the templates of its
                 `columns` by their headings
    like         another claim, whose keys are taken where this one has none
"""

from __future__ import annotations

import tomllib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from functools import cache
from importlib.resources import files
from typing import Any

# replaces a list in the evidence where the table is shown beside it
BESIDE_TABLE = "(see the table)"


class Origin(StrEnum):
    """Who makes the statement of a claim."""

    PAPER = "paper"
    OURS = "ours"  # a check of our own, counted apart from the paper's claims


@dataclass(frozen=True, slots=True, kw_only=True)
class ListForm:
    """How rows of fields are written one after the other, and the templates of their columns by
    heading.
    """

    each: str
    between: str = ", "
    none: str = ""
    columns: dict[str, str] = field(default_factory=dict)


@dataclass(frozen=True, slots=True, kw_only=True)
class ClaimEntry:
    """One claim of a table."""

    place: str
    statement: str
    section: str = ""
    origin: Origin = Origin.PAPER
    evidence: str = ""
    second: str = ""
    proof: str = ""
    undecided: str = ""
    not_checked: str = ""
    rests_on: tuple[str, ...] = ()
    headline: str = ""
    printed: str | None = None
    corrected: str | None = None
    unit: str = ""
    tolerance: float = 1e-9
    erratum: int | None = None
    lists: dict[str, ListForm] = field(default_factory=dict)

    @property
    def is_measured(self) -> bool:
        """Whether a part of the paper measures something for it."""
        return not (self.not_checked or self.rests_on)

    def filled(self, template: str, fields: Mapping[str, Any], beside_table: bool = False) -> str:
        """A template, such as the evidence, with the fields put in; with `beside_table` without the
        lists that `table` shows.
        """
        forms = {name: form for name, form in self.lists.items() if name in fields}
        texts = {name: self._listed(form, fields[name]) for name, form in forms.items()}
        if beside_table:
            texts |= {name: BESIDE_TABLE for name, form in forms.items() if form.columns}
        return template.format(**{**fields, **texts})

    def table(self, fields: Mapping[str, Any]) -> list[list[str]]:
        """The headings and rows of the list that has columns; nothing if no list has any."""
        for name, form in self.lists.items():
            if form.columns and name in fields:
                return [
                    list(form.columns),
                    *(
                        [self.filled(cell, row) for cell in form.columns.values()]
                        for row in fields[name]
                    ),
                ]
        return []

    def _listed(self, form: ListForm, rows: Iterable[Any]) -> str:
        texts = (
            self.filled(form.each, row) if isinstance(row, Mapping) else form.each.format(row)
            for row in rows
        )
        return form.between.join(texts) or form.none


def claim_tables() -> dict[str, dict[str, ClaimEntry]]:
    """All claims by part and id.

    Raises
    ------
    TypeError
        A claim without a place or statement, or with an unknown key.
    ValueError
        An origin or a list form that does not exist.
    """
    return _read()[1]


def section_titles() -> dict[str, str]:
    """The titles of the paper's sections by their numbers, in its order."""
    return _read()[0]


@cache
def _read() -> tuple[dict[str, str], dict[str, dict[str, ClaimEntry]]]:
    titles: dict[str, str] = {}
    parts: dict[str, dict[str, dict[str, Any]]] = {}
    for file in sorted(files("saltus_paper.claims").iterdir(), key=lambda file: file.name):
        if file.name.endswith(".toml"):
            tables = tomllib.loads(file.read_text(encoding="utf-8"))
            section = tables.pop("section")
            titles[section] = tables.pop("title")
            for part, claims in tables.items():
                parts.setdefault(part, {}).update(
                    {id: {**keys, "section": section} for id, keys in claims.items()}
                )
    everything = {id: entry for claims in parts.values() for id, entry in claims.items()}
    return titles, {
        part: {id: _entry(claims[id], everything) for id in claims}
        for part, claims in parts.items()
    }


def _entry(own: Mapping[str, Any], everything: Mapping[str, Mapping[str, Any]]) -> ClaimEntry:
    """A claim from its keys, and those of the claim that it is `like`."""
    keys = {**everything[own["like"]], **own} if "like" in own else dict(own)
    keys.pop("like", None)
    keys["rests_on"] = tuple(keys.get("rests_on", ()))
    keys["origin"] = Origin(keys.get("origin", Origin.PAPER))
    lists = {name: ListForm(**form) for name, form in keys.pop("lists", {}).items()}
    return ClaimEntry(**keys, lists=lists)
