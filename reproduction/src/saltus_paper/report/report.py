"""Writing the report: report.html from its templates, claims.json, claims.md, and report.pdf where
a browser can print it.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterable, Mapping
from functools import cache
from pathlib import Path
from typing import Any

import saltus
from saltus import ParameterError
from saltus_paper import up_to_date as state
from saltus_paper.claims.claim import Claim, ClaimVerdict
from saltus_paper.claims.claim_tables import Origin
from saltus_paper.claims.ledger import HEADINGS, ledger, tally, to_markdown
from saltus_paper.errata import errata
from saltus_paper.figures.figure import PaperFigure
from saltus_paper.highlights import findings, validity
from saltus_paper.output_folder import check_writable
from saltus_paper.report.browser import print_pdf
from saltus_paper.report.report_content import BEYOND, ReportContent, report_content
from saltus_paper.toml_tables import toml_table

PAGE = "report.html"
PRINT = "report.pdf"


def write_report(
    figures: Iterable[PaperFigure], folder: Path, known: Mapping[str, Iterable[Claim]]
) -> list[Claim]:
    """Write report.html, claims.json and claims.md about everything in `folder` that is up to date;
    return its claims.

    `known` holds the claims of the figures, by name, that are known to be up to date.
    """
    figures = [state.as_made(figure, folder) for figure in figures]
    present = {}
    for figure in figures:
        if figure.name in known:
            present[figure] = list(known[figure.name])
        elif state.up_to_date(figure, folder):
            present[figure] = state.claims(figure, folder)
    return _write(report_content(figures, present, folder), folder)


def report_from_results(folder: Path | str) -> list[str]:
    """Write the report anew from the results in a folder, computing nothing; return the names of
    the parts in it.

    Parts that were made by other sources are shown too, and marked. A part is left out if its files
    are not those of its record, or if the record cannot be read.

    Raises
    ------
    ParameterError
        There are no results in the folder, or it cannot be written to.
    """
    from saltus_paper.parts import FIGURES

    folder = Path(folder)
    figures = [state.as_made(figure, folder) for figure in FIGURES.values()]
    present = {
        figure: state.claims(figure, folder) for figure in figures if state.intact(figure, folder)
    }
    if not present:
        raise ParameterError(
            f"{folder} holds no results of `saltus reproduce`; name the folder in which they are"
        )
    check_writable(folder)
    _write(report_content(figures, present, folder), folder)
    return [figure.name for figure in present]


def report_as_pdf(folder: Path | str) -> str | None:
    """Print report.html of a folder as report.pdf, if there is a browser and it is not done yet;
    returns why not, or None.
    """
    folder = Path(folder)
    return print_pdf(folder / PAGE, folder / PRINT, folder / state.FOLDER / f"{PRINT}.sha256")


def _write(content: ReportContent, folder: Path) -> list[Claim]:
    pages = {
        "claims.json": json.dumps(
            [claim.to_dict() for claim in content.claims], indent=1, ensure_ascii=False
        )
        + "\n",
        "claims.md": to_markdown(content.claims),
        PAGE: page(content),
    }
    for name, text in pages.items():
        path = folder / name
        if not path.exists() or path.read_text(encoding="utf-8") != text:
            saltus.save(path, text)
    return content.claims


def page(content: ReportContent) -> str:
    """The report as one HTML file that needs nothing beside it."""
    return str(
        _environment()
        .get_template("report.html.jinja")
        .render(
            content=content,
            linked=Linker({claim.id for claim in content.claims}),
            version=saltus.__version__,
            tally=tally(content.claims),
            headings=HEADINGS,
            ledger=[row.cells() for row in ledger(content.claims)],
            findings=findings(content.claims),
            validity=validity(content.claims),
            verdicts=list(ClaimVerdict),
            counts={
                verdict: sum(claim.verdict is verdict for claim in content.claims)
                for verdict in ClaimVerdict
            },
            ours=Origin.OURS,
            beyond=BEYOND,
        )
    )


@cache
def _environment() -> Any:
    """Templates that escape everything that is put into them: captions, evidence and metadata are
    data.
    """
    from jinja2 import Environment, PackageLoader, StrictUndefined

    environment = Environment(
        loader=PackageLoader("saltus_paper.report"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters["placed"] = placed
    environment.filters["style_class"] = lambda verdict: verdict.name.lower().replace("_", "-")
    return environment


class Linker:
    """Turns the ids of claims and the numbers of errata within a text into links, and `names` into
    code; the rest is escaped.

    A word that is also English, such as `period`, is taken as an id only if its verdict follows or
    the word "claim" precedes it.
    """

    def __init__(self, ids: set[str]) -> None:
        verdicts = "|".join(map(str, ClaimVerdict))
        names, words = (
            _alternatives(id for id in ids if ("-" in id) is hyphen) for hyphen in (True, False)
        )
        claim = rf"(?P<id>{names}|{words}(?= \((?:{verdicts}))|(?<=claim ){words})"
        self._pattern = re.compile(
            rf"`(?P<code>[^`]+)`|(?<![\w/:.-])(?:erratum (?P<number>\d+)|{claim})(?![\w/:-])"
        )

    def __call__(self, text: str, without: str = "") -> Any:
        """The text as markup, with no link to `without`, the claim or erratum that contains the
        text.
        """
        from markupsafe import Markup, escape

        parts = []
        end = 0
        for match in self._pattern.finditer(text):
            code = match["code"]
            number = match["number"]
            id = match["id"]
            target = (
                id if id else f"erratum-{number}" if number and int(number) in errata() else None
            )
            if code or (target and target != without):
                made = (
                    _equation(code) or Markup("<code>{}</code>").format(code)
                    if code
                    else _link(target, match[0])
                )
                parts += [escape(text[end : match.start()]), made]
                end = match.end()
        return Markup("").join([*parts, escape(text[end:])])


def placed(text: str) -> Any:
    """A place in the paper as markup: labels of equations become their numbers, and the rest is
    escaped.
    """
    from markupsafe import Markup, escape

    parts = []
    for part in text.split(", "):
        words = [_equation(word) if word != "smoothing" else None for word in part.split(" ")]
        shown = _equation(part) or Markup(" ").join(
            word or escape(plain) for word, plain in zip(words, part.split(" "), strict=True)
        )
        parts.append(shown)
    return Markup(", ").join(parts)


def _equation(label: str) -> Any:
    """The equation's number as markup, or None if the label is not one of the paper."""
    from markupsafe import Markup

    number = toml_table("equations.toml").get(label)
    return Markup('<span title="{}">eq.\xa0({})</span>').format(label, number) if number else None


def _link(target: str | None, words: str) -> Any:
    from markupsafe import Markup

    return Markup('<a href="#{}">{}</a>').format(target, words)


def _alternatives(ids: Iterable[str]) -> str:
    """A pattern of any of these, the longest first, or of nothing at all."""
    return f"(?:{'|'.join(map(re.escape, sorted(ids, key=len, reverse=True))) or '(?!)'})"
