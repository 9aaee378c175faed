"""The commands that entry points add to saltus: `saltus reproduce` makes the paper, `saltus report`
its report.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.table import Table

RESULTS = Path("results")
FAILED = 1  # the exit status where a part could not be made, or a claim disagrees


def reproduce(
    names: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="NAMES",
            help="Parts of the paper, such as fig04 or table1; all if none is named.",
        ),
    ] = None,
    output: Annotated[
        Path, typer.Option("--output", "-o", help="The folder to write to.")
    ] = RESULTS,
    force: Annotated[bool, typer.Option("--force", help="Make again what is up to date.")] = False,
    effort: Annotated[
        str,
        typer.Option(
            "--effort",
            help=(
                "quick: a draft of the whole report in about a third of the time, marked as such."
            ),
        ),
    ] = "standard",
    list_: Annotated[bool, typer.Option("--list", help="List the parts and stop.")] = False,
) -> None:
    """Compute and draw the paper: figures, tables, and every claim beside the value found here.

    Writes PNG, PDF and netCDF files, and report.html to open (report.pdf too,
    where a browser is found that can print it). What is up to date is skipped.
    If a part fails, the others and the report are made. The command names at
    its end what failed, and each claim or own check that disagrees; it then
    ends with status 1. Claims of a draft do not count.

    Example: [cyan]saltus reproduce[/] for everything

    Example: [cyan]saltus reproduce fig04 fig07[/] for two figures

    Example: [cyan]saltus reproduce --effort quick[/] for a draft
    """
    if list_:
        list_parts()
    else:
        reproduce_paper(names or [], output, force, effort)


def report(
    results: Annotated[
        Path,
        typer.Argument(metavar="FOLDER", help="The folder that `saltus reproduce` has written to."),
    ] = RESULTS,
) -> None:
    """Write the report on the paper anew from results that are there; nothing is computed.

    Writes report.html, claims.md and claims.json, and report.pdf where a
    browser is found that can print it. Parts that other versions have made are
    shown, and marked.

    Example: [cyan]saltus report results[/]
    """
    renew_report(results)


def reproduce_paper(
    names: Sequence[str], output: Path, force: bool, effort: str = "standard"
) -> None:
    """Reproduce the named parts of the paper, or all, into `output`; print what was made, and the
    verdicts on the claims.
    """
    from saltus.cli import progress_bar
    from saltus_paper import FIGURES, HEADINGS, ClaimVerdict, ledger, tally, with_summaries
    from saltus_paper import reproduce as made
    from saltus_paper.reproduction import FAILURES

    with progress_bar("paper") as progress:
        results = made(names, output, force, progress, effort)
    console = Console(highlight=False)
    table = Table(box=None, show_header=False)
    for result in results:
        time = f"{result.seconds:.1f} s of processor time" if result.made else "up to date"
        table.add_row(result.name, "FAILED" if result.error else time, FIGURES[result.name].title)
    console.print(table)
    claims = with_summaries(claim for result in results for claim in result.claims)
    verdicts = Table(HEADINGS[0], box=None, padding=(0, 1, 0, 0))
    for heading in HEADINGS[1:]:
        verdicts.add_column(heading, width=max(map(len, heading.split())))
    for row in ledger(claims):
        verdicts.add_row(*row.cells())
    console.print(verdicts)
    console.print(tally(claims), markup=False, soft_wrap=True)
    _print_report(console, output)
    failed = [result for result in results if result.error]
    for result in failed:
        print(f"saltus: {result.name} failed: {result.error}", file=sys.stderr)
    if failed:
        print(f"saltus: the tracebacks are in {output / FAILURES}", file=sys.stderr, flush=True)
    disagree = [
        claim
        for claim in with_summaries(
            claim for result in results if not result.draft for claim in result.claims
        )
        if claim.verdict is ClaimVerdict.DISAGREES
    ]
    for claim in disagree:
        print(f"saltus: {claim.id} disagrees: {claim.evidence}", file=sys.stderr, flush=True)
    if failed or disagree:
        raise typer.Exit(FAILED)


def renew_report(output: Path) -> None:
    """Write the report of the results in `output` anew, computing nothing, and print which parts
    are in it.
    """
    from saltus_paper import report_from_results

    names = report_from_results(output)
    console = Console(highlight=False)
    console.print(f"Parts in the report: {', '.join(names)}", markup=False, soft_wrap=True)
    _print_report(console, output)


def _print_report(console: Console, output: Path) -> None:
    """Print the report as PDF if that can be done, and say where both are."""
    from saltus_paper import report_as_pdf

    why_not = report_as_pdf(output)
    beside = f"{why_not}." if why_not else f"{output / 'report.pdf'} is the same to print."
    console.print(
        f"Results are in {output}: open {output / 'report.html'}. {beside}",
        markup=False,
        soft_wrap=True,
    )


def list_parts() -> None:
    """Print the names that `saltus reproduce` takes, each with its title."""
    from saltus_paper import FIGURES

    table = Table(box=None, show_header=False, pad_edge=False)
    for name, figure in FIGURES.items():
        table.add_row(f"[bold]{name}[/]", figure.title)
    Console().print(table)
