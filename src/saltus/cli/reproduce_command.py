"""`saltus reproduce`: the paper."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from rich.console import Console
from rich.table import Table


def reproduce_paper(names: Sequence[str], output: Path, force: bool) -> None:
    """Reproduce the named parts of the paper, or all, into `output`; it says itself where the results are."""
    from saltus.paper import reproduce

    reproduce(names, output, force, Console())


def list_parts() -> None:
    """Print the names that `saltus reproduce` takes, each with what it is."""
    from saltus.paper import FIGURES

    table = Table(box=None, show_header=False, pad_edge=False)
    for name, figure in FIGURES.items():
        table.add_row(f"[bold]{name}[/]", figure.title)
    Console().print(table)
