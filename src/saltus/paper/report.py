"""The report: the paper's sections in its order, every figure with its caption and every claim with its verdict.

It is written as HTML, Markdown and JSON, and begins with the ledger: how many statements hold, fail, or are not checked.
"""

from __future__ import annotations

import html
import json
import math
import re
from collections.abc import Iterable, Iterator, Mapping
from importlib.resources import files
from pathlib import Path

import saltus
from saltus.files import write_text
from saltus.paper import up_to_date as state
from saltus.paper.claims.claim import Claim, ClaimVerdict, with_summaries
from saltus.paper.claims.claim_tables import Origin, section_titles
from saltus.paper.claims.ledger import LISTING_TITLES, ledger_table, listed, tally, to_markdown
from saltus.paper.errata import errata
from saltus.paper.figures.figure import PaperFigure


def write(figures: Iterable[PaperFigure], folder: Path, known: Mapping[str, Iterable[Claim]]) -> list[Claim]:
    """Write index.html, claims.json and claims.md about everything in `folder` that is up to date; return its claims.

    `known` holds the claims of the figures, by name, that are known to be up to date.
    """
    present = {}
    for figure in figures:
        if figure.name in known:
            present[figure] = list(known[figure.name])
        elif state.up_to_date(figure, folder):
            present[figure] = state.claims(figure, folder)
    claims = with_summaries(claim for group in present.values() for claim in group)
    pages = {
        "claims.json": json.dumps([claim.to_dict() for claim in claims], indent=1, ensure_ascii=False) + "\n",
        "claims.md": to_markdown(claims),
        "index.html": "\n".join(_page(present, claims, folder)) + "\n",
    }
    for name, text in pages.items():
        path = folder / name
        if not path.exists() or path.read_text(encoding="utf-8") != text:
            write_text(path, text)
    return claims


def _page(present: dict[PaperFigure, list[Claim]], everything: list[Claim], folder: Path) -> Iterator[str]:
    yield '<!doctype html><html lang="en"><head><meta charset="utf-8">'
    yield '<meta name="viewport" content="width=device-width, initial-scale=1">'
    yield f"<title>The paper, computed by saltus</title><style>{_style_sheet()}</style></head><body>"
    yield "<h1>Non-smooth dynamics of buckling based metainterfaces: the paper, computed</h1>"
    yield f"<p>saltus {saltus.__version__}. {tally(everything)} The whole table: "
    yield '<a href="claims.md">claims.md</a>, <a href="claims.json">claims.json</a>.</p>'
    yield _html_table("\n".join(ledger_table(everything)))
    for listing, headlines in listed(everything):
        links = "".join(f'<li><a href="#{claim.id}">{html.escape(text)}</a></li>' for claim, text in headlines)
        yield f"<h2>{LISTING_TITLES[listing]}</h2><ul>{links}</ul>"
    yield from _filter()
    shown = {claim.id for figure, claims in present.items() if figure.section for claim in claims}
    sections = [s for s in section_titles() if any(f.section == s for f in present) or any(c.section == s for c in everything)]
    yield "<nav>"
    yield from (f'<a href="#section-{number}">{number} {html.escape(section_titles()[number])}</a>' for number in sections)
    yield "</nav>"
    for number in sections:
        yield f'<h2 id="section-{number}">{number} {html.escape(section_titles()[number])}</h2>'
        for figure, claims in present.items():
            if figure.section == number:
                yield from _figure(figure, claims, folder)
        yield from _claims_table([claim for claim in everything if claim.section == number and claim.id not in shown])
    yield from _errata(everything)
    yield "</body></html>"


def _errata(everything: list[Claim]) -> Iterator[str]:
    """Each erratum with what is right, and the claims that it corrects."""
    yield '<h2 id="errata">Errata</h2><table><tr><th>erratum</th><th>where</th><th>what is right</th><th>claims</th></tr>'
    for number, erratum in errata().items():
        links = ", ".join(f'<a href="#{claim.id}">{claim.id}</a>' for claim in everything if claim.erratum == number)
        cells = f"<td>{html.escape(erratum.place)}</td><td>{html.escape(erratum.correct)}</td><td>{links}</td>"
        yield f'<tr id="erratum-{number}"><td>{number}</td>{cells}</tr>'
    yield "</table>"


def _filter() -> Iterator[str]:
    """Boxes that hide the claims of one verdict each: rules of the style sheet do it, without a script."""
    yield '<p class="filter">Show claims that are: '
    for verdict in ClaimVerdict:
        yield f'<label><input type="checkbox" id="show-{_style_class(verdict)}" checked> {verdict}</label>'
    yield "</p>"


def _style_class(verdict: ClaimVerdict) -> str:
    return verdict.name.lower().replace("_", "-")


def _style_sheet() -> str:
    return (files("saltus.paper") / "report.css").read_text(encoding="utf-8")


def _figure(figure: PaperFigure, claims: list[Claim], folder: Path) -> Iterator[str]:
    yield f'<h3 id="{figure.name}">{html.escape(figure.title)}</h3>'
    if figure.draw is not None:
        yield f'<img src="{figure.name}.png" alt="{html.escape(figure.title)}">'
    yield f'<p class="caption">{html.escape(figure.caption)}</p>'
    if figure.table is not None:
        yield _html_table((folder / f"{figure.name}.md").read_text(encoding="utf-8"))
    links = (f'<a href="{name}">{name}</a>' for name in figure.files())
    yield f'<p class="files">{" · ".join(links)}<br>{html.escape(_making(figure, folder))}</p>'
    yield from _claims_table(claims)


def _making(figure: PaperFigure, folder: Path) -> str:
    """How the figure was made: command, time, parameters, versions and the checksum of its data."""
    record = state.read(figure, folder) or {}
    versions = ", ".join(f"{name} {number}" for name, number in record.get("versions", {}).items())
    parameters = "; ".join(f"{name} = {value}" for name, value in figure.parameters.items())
    parts = [
        f"saltus reproduce {figure.name}",
        f"{record.get('seconds', math.nan):g} s",
        parameters or "default parameters",
        versions,
    ]
    return " · ".join([*parts, f"SHA-256 of {figure.name}.nc {record.get('files', {}).get(f'{figure.name}.nc', '')}"])


def _claims_table(claims: list[Claim]) -> Iterator[str]:
    if claims:
        yield '<table class="claims">'
        yield "<tr><th>claim</th><th>where</th><th>paper</th><th>here</th><th>verdict</th><th>evidence</th></tr>"
        yield from map(_row, claims)
        yield "</table>"


def _row(claim: Claim) -> str:
    own = ' <em class="own">own check</em>' if claim.origin is Origin.OURS else ""
    row = f"<td>{html.escape(claim.statement)}{own}</td>"
    row += "".join(f"<td>{html.escape(cell)}</td>" for cell in (claim.where, claim.paper, claim.value))
    verdict = claim.verdict_text
    if claim.erratum in errata():
        verdict = verdict.replace(f"erratum {claim.erratum}", f'<a href="#erratum-{claim.erratum}">erratum {claim.erratum}</a>')
    row += f'<td class="verdict">{verdict}</td><td>{html.escape(claim.evidence)}</td>'
    return f'<tr id="{claim.id}" class="{_style_class(claim.verdict)}">{row}</tr>'


def _html_table(markdown: str) -> str:
    """The Markdown tables of this package as HTML: plain cells, one header row; other lines become paragraphs."""
    out: list[str] = []
    rows: list[list[str]] = []
    for line in [*markdown.splitlines(), ""]:
        if line.startswith("|"):
            cells = [cell.strip() for cell in line.strip().strip("|").split("|")]
            if not all(re.fullmatch(r":?-+:?", cell) for cell in cells):
                rows.append(cells)
            continue
        if rows:
            tags = ["th"] + ["td"] * (len(rows) - 1)
            lines = ["".join(f"<{t}>{html.escape(c)}</{t}>" for c in row) for t, row in zip(tags, rows, strict=True)]
            out.append("<table>" + "".join(f"<tr>{line}</tr>" for line in lines) + "</table>")
            rows = []
        if line.strip() and not line.startswith("#"):
            out.append(f"<p>{html.escape(line)}</p>")
    return "\n".join(out)
