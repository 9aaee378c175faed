"""`saltus reproduce`: the paper."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from rich.console import Console
from rich.table import Table


def reproduce_paper(names: Sequence[str], output: Path, force: bool) -> None:
    """Reproduce the named parts of the paper, or all, into `output`; print what was made and what became of the claims."""
    from saltus.cli.progress_bar import progress_bar
    from saltus.paper import FIGURES, HEADINGS, ledger, reproduce, tally, with_summaries

    with progress_bar("paper") as progress:
        results = reproduce(names, output, force, progress)
    console, table = Console(highlight=False), Table(box=None, show_header=False)
    for result in results:
        time = f"{result.seconds:.1f} s of processor time" if result.made else "up to date"
        table.add_row(result.name, time, FIGURES[result.name].title)
    console.print(table)
    claims = with_summaries(claim for result in results for claim in result.claims)
    verdicts = Table(HEADINGS[0], box=None, padding=(0, 1, 0, 0))
    for heading in HEADINGS[1:]:
        verdicts.add_column(heading, width=max(map(len, heading.split())))
    for row in ledger(claims):
        verdicts.add_row(*row.cells())
    console.print(verdicts)
    console.print(tally(claims), markup=False, soft_wrap=True)
    console.print(f"Results are in {output}: open {output / 'index.html'}", markup=False, soft_wrap=True)


def list_parts() -> None:
    """Print the names that `saltus reproduce` takes, each with what it is."""
    from saltus.paper import FIGURES

    table = Table(box=None, show_header=False, pad_edge=False)
    for name, figure in FIGURES.items():
        table.add_row(f"[bold]{name}[/]", figure.title)
    Console().print(table)
