"""`saltus status`: how far a sweep is."""

from __future__ import annotations

import datetime
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

from rich.console import Console
from rich.progress_bar import ProgressBar
from rich.table import Table
from rich.text import Text

if TYPE_CHECKING:
    from saltus.sweep import StoreStatus

BAR_WIDTH = 40  # columns of the bar
FAILURES_NAMED = 5  # failed chunks that are named


def print_status(path: Path) -> None:
    """Print how far the sweep in the store at `path` is, from its files alone: it may be running, stopped or killed.

    Raises:
        ParameterError: there is no store of a sweep at `path`.
    """
    from saltus.sweep import status

    found = status(path)
    console = Console(highlight=False)
    console.print(f"[bold]{found.kind[:1].upper()}{found.kind[1:].replace('_', ' ')}[/] ", end="")
    console.print(f"in {path}", markup=False, soft_wrap=True)
    if console.is_terminal:
        console.print(ProgressBar(total=found.total, completed=found.done, width=BAR_WIDTH), "", sep="\n")
    table = Table(box=None, show_header=False, pad_edge=False)
    table.add_column(style="dim", no_wrap=True)
    table.add_column(overflow="fold")
    for head, text in rows(found):
        table.add_row(head, Text(text))
    console.print(table)
    console.print(ending(found), markup=False, soft_wrap=True)


def rows(found: StoreStatus) -> Iterator[tuple[str, str]]:
    """The lines of the table: heads and values."""
    yield "chunks", f"{found.done} of {found.total} done ({100 * found.done // found.total} %)"
    yield "grid", ", ".join(f"{size} along {name}" for name, size in found.sizes.items())
    yield "size", size(found.bytes)
    yield "begun", moment(found.started)
    yield "last written", moment(found.updated) if found.updated else "nothing yet"
    if found.failures:
        yield "failed", str(found.failed)
    for failure in found.failures[:FAILURES_NAMED]:
        yield "", str(failure)
    if found.failed > FAILURES_NAMED:
        yield "", f"and {found.failed - FAILURES_NAMED} more"


def ending(found: StoreStatus) -> str:
    """Whether the sweep goes on, and how it can be gone on with."""
    if found.complete:
        return "The sweep is complete."
    if found.running:
        return "A run is writing to it now."
    if found.running is None:
        return "If no run is writing to it, start the sweep again: it goes on from here."
    return "No run is writing to it; start the sweep again to go on from here."


def size(count: int) -> str:
    """A number of bytes, in the unit that fits."""
    value, unit = float(count), "B"
    for larger in ("kB", "MB", "GB", "TB"):
        if value < 1000:
            break
        value, unit = value / 1000, larger
    return f"{value:.3g} {unit}" if unit != "B" else f"{count} B"


def moment(when: datetime.datetime) -> str:
    """A time, in the zone of who asks."""
    return when.strftime("%Y-%m-%d %H:%M:%S")
