"""The contents of the report, gathered from the parts of the paper, their records and their data,
as values for templates.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import saltus
from saltus.flow import available_cores
from saltus_paper import up_to_date as state
from saltus_paper.claims.claim import Claim, with_summaries
from saltus_paper.claims.claim_tables import section_titles
from saltus_paper.errata import Erratum, errata
from saltus_paper.figures.both_layers import exact_portraits, share_table
from saltus_paper.figures.figure import PaperFigure
from saltus_paper.report.data_tables import DataTables, data_tables
from saltus_paper.report.embedded_pictures import EmbeddedPicture, embedded
from saltus_paper.report.exact_features import chart_features, diagram_features

# sections of subjects that the paper does not treat; each has a chapter of its own
BEYOND = {"both_layers": "B", "chain": "C"}


@dataclass(frozen=True, slots=True, kw_only=True)
class FileLink:
    """A file beside the report."""

    name: str
    size: str
    checksum: str  # SHA-256


@dataclass(frozen=True, slots=True, kw_only=True)
class ReportPart:
    """A figure, table or group of statements, with the record of how it was made."""

    figure: PaperFigure
    claims: list[Claim]
    files: list[FileLink]
    seconds: float
    versions: str
    stale: bool  # whether it was made by other sources than the present ones
    draft: bool  # whether it was made with less effort than the paper needs
    data: DataTables
    picture: EmbeddedPicture | None
    table: list[list[str]]  # a table of the paper; its first row are the headings

    @property
    def code(self) -> str:
        """Three lines of Python that make it."""
        name = self.figure.name
        what = "figure.compute(**figure.parameters)"
        last = (
            f'figure.draw({what}).savefig("{name}.png")'
            if self.figure.draw
            else f"print(figure.claims({what}))"
        )
        if self.figure.table:
            last = f"print(figure.table({what}))"
        return f'from saltus_paper import FIGURES\nfigure = FIGURES["{name}"]\n{last}'


@dataclass(frozen=True, slots=True, kw_only=True)
class SectionContent:
    """A section of the paper: its parts, and its claims that belong to no part."""

    number: str
    title: str
    parts: list[ReportPart]
    statements: list[Claim]


@dataclass(frozen=True, slots=True, kw_only=True)
class ErratumContent:
    """An erratum with the claims that rest on it."""

    number: int
    erratum: Erratum
    claims: list[Claim]


@dataclass(frozen=True, slots=True, kw_only=True)
class ReportContent:
    """Everything that the templates of the report show."""

    claims: list[Claim]
    sections: list[SectionContent]
    missing: list[str]  # names of the parts that are not there
    errata: list[ErratumContent]
    diagrams: list[tuple[str, ...]] = field(default_factory=list)
    charts: list[tuple[str, ...]] = field(default_factory=list)
    # tables of both layers by figure
    shares: dict[str, list[list[str]]] = field(default_factory=dict)
    portraits: list[tuple[str, int, int]] = field(default_factory=list)

    @property
    def drafts(self) -> list[ReportPart]:
        """The parts that were made with less effort than the paper needs."""
        return [part for part in self.parts if part.draft]

    @property
    def parts(self) -> list[ReportPart]:
        """All parts in the order of the report."""
        return [part for section in self.sections for part in section.parts]


def report_content(
    all_figures: Iterable[PaperFigure], present: Mapping[PaperFigure, list[Claim]], folder: Path
) -> ReportContent:
    """Gather what is in `folder` of these figures, each with its claims.

    Raises
    ------
    ParameterError
        A data file that is damaged.
    """
    claims = with_summaries(claim for group in present.values() for claim in group)
    with ThreadPoolExecutor(available_cores()) as pool:  # packing a picture leaves Python's lock
        drawn = {
            figure: pool.submit(embedded, folder / f"{figure.name}.png")
            for figure in present
            if figure.draw is not None
        }
        parts = [
            _part(figure, here, folder, drawn[figure].result() if figure in drawn else None)
            for figure, here in present.items()
        ]
    shown = {claim.id for part in parts if part.figure.section for claim in part.claims}
    numbers = [*section_titles(), ""]
    evidence = {claim.id: claim.evidence for claim in claims}
    sections = [
        SectionContent(
            number=number,
            title=section_titles().get(number, "Statements without a figure"),
            parts=[part for part in parts if part.figure.section == number],
            statements=[
                claim for claim in claims if claim.section == number and claim.id not in shown
            ],
        )
        for number in numbers
    ]
    titles = {figure.name: figure.title.split(":")[0] for figure in present}
    return ReportContent(
        claims=claims,
        sections=[section for section in sections if section.parts or section.statements],
        missing=[figure.name for figure in all_figures if figure not in present],
        errata=[
            ErratumContent(
                number=number,
                erratum=erratum.filled(evidence),
                claims=[claim for claim in claims if claim.erratum == number],
            )
            for number, erratum in errata().items()
        ],
        diagrams=diagram_features(folder, titles),
        charts=chart_features(folder, titles),
        **(_both_layers(folder) if "both_layers" in titles else {}),
    )


def _part(
    figure: PaperFigure, claims: list[Claim], folder: Path, picture: EmbeddedPicture | None
) -> ReportPart:
    record = state.read(figure, folder) or {}
    checksums = record["files"]
    versions = record["versions"]
    links = [
        FileLink(name=n, size=_size(folder / n), checksum=str(checksums.get(n, "")))
        for n in figure.files()
    ]
    return ReportPart(
        figure=figure,
        claims=claims,
        files=links,
        seconds=float(record["seconds"]),
        versions=", ".join(f"{name} {number}" for name, number in versions.items()),
        stale=record.get("key") != state.key(figure),
        draft=figure.effort != "standard",
        data=data_tables(folder / f"{figure.name}.nc"),
        picture=picture,
        table=_markdown_rows(
            (folder / f"{figure.name}.md").read_text(encoding="utf-8", errors="replace")
        )
        if figure.table is not None
        else [],
    )


def _both_layers(folder: Path) -> dict[str, Any]:
    data: Any = saltus.load(folder / "both_layers.nc")
    return {
        "shares": {
            f"Fig. {name[3:].lstrip('0')}": share_table(data[name]) for name in ("fig09", "fig11")
        },
        "portraits": exact_portraits(data["portraits"]),
    }


def _size(path: Path) -> str:
    size = path.stat().st_size
    return f"{size / 1e6:.1f} MB" if size >= 1e6 else f"{size / 1e3:.0f} kB"


def _markdown_rows(text: str) -> list[list[str]]:
    """The rows of a table that this package has written as Markdown, without the line below its
    headings.
    """
    lines = [line.strip().strip("|") for line in text.splitlines() if line.startswith("|")]
    rows = [[cell.strip() for cell in line.split("|")] for line in lines]
    return [row for row in rows if not all(set(cell) <= set(":-") for cell in row)]
