"""The report: every figure with its caption, every claim with its verdict, in HTML, Markdown and JSON."""

from __future__ import annotations

import html
import json
import re
from collections.abc import Iterable, Iterator, Mapping
from importlib.resources import files
from pathlib import Path

import saltus
from saltus.files import write_text
from saltus.paper import up_to_date as state
from saltus.paper.claims.claim import Agreement, Claim, tally, to_markdown
from saltus.paper.figures.figure import PaperFigure

STYLE_CLASSES = {Agreement.AGREES: "agrees", Agreement.ERRATUM: "erratum", Agreement.DISAGREES: "disagrees"}


def compute_claims(figure: PaperFigure, folder: Path) -> list[Claim]:
    """The claims of a figure from the data that it left in `folder`."""
    import xarray

    with xarray.open_datatree(folder / f"{figure.name}.nc", engine="h5netcdf") as tree:
        return figure.claims(tree.load())


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
    claims = [claim for group in present.values() for claim in group]
    pages = {
        "claims.json": json.dumps([claim.to_dict() for claim in claims], indent=1, ensure_ascii=False) + "\n",
        "claims.md": to_markdown(claims),
        "index.html": "\n".join(_page(present, folder)) + "\n",
    }
    for name, text in pages.items():
        path = folder / name
        if not path.exists() or path.read_text(encoding="utf-8") != text:
            write_text(path, text)
    return claims


def _page(present: dict[PaperFigure, list[Claim]], folder: Path) -> Iterator[str]:
    everything = [claim for group in present.values() for claim in group]
    yield '<!doctype html><html lang="en"><head><meta charset="utf-8">'
    yield '<meta name="viewport" content="width=device-width, initial-scale=1">'
    yield f"<title>The paper, computed by saltus</title><style>{_style_sheet()}</style></head><body>"
    yield "<h1>Non-smooth dynamics of buckling based metainterfaces: the paper, computed</h1>"
    yield f"<p>saltus {saltus.__version__}. {tally(everything)} The whole table: "
    yield '<a href="claims.md">claims.md</a>, <a href="claims.json">claims.json</a>.</p><nav>'
    yield from (f'<a href="#{figure.name}">{html.escape(figure.title)}</a>' for figure in present)
    yield "</nav>"
    for figure, claims in present.items():
        yield from _section(figure, claims, folder)
    yield "</body></html>"


def _style_sheet() -> str:
    return (files("saltus.paper") / "report.css").read_text(encoding="utf-8")


def _section(figure: PaperFigure, claims: list[Claim], folder: Path) -> Iterator[str]:
    yield f'<h2 id="{figure.name}">{html.escape(figure.title)}</h2>'
    if figure.draw is not None:
        yield f'<img src="{figure.name}.png" alt="{html.escape(figure.title)}">'
    yield f'<p class="caption">{html.escape(figure.caption)}</p>'
    if figure.table is not None:
        yield _html_table((folder / f"{figure.name}.md").read_text(encoding="utf-8"))
    links = (f'<a href="{name}">{name}</a>' for name in figure.files())
    yield f'<p class="files">{" · ".join(links)}</p>'
    if claims:
        yield "<table><tr><th>claim</th><th>where</th><th>paper</th><th>here</th><th>verdict</th><th>evidence</th></tr>"
        yield from map(_row, claims)
        yield "</table>"


def _row(claim: Claim) -> str:
    cells = (claim.statement, claim.where, claim.paper, claim.value)
    row = "".join(f"<td>{html.escape(cell)}</td>" for cell in cells)
    verdict = f'<td class="{STYLE_CLASSES[claim.verdict]}">{claim.verdict_text}</td>'
    return f'<tr id="{claim.id}">{row}{verdict}<td>{html.escape(claim.evidence)}</td></tr>'


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
