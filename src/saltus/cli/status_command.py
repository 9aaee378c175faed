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

from saltus.cli.summaries import MOST_LISTED
from saltus.errors import LONGEST_NAME, ParameterError, printable

if TYPE_CHECKING:
    from saltus.sweep import StoreStatus

SEARCH = "diagram"  # the kind of a store whose number of parts is not known beforehand


def print_status(path: Path, verify: bool = False) -> None:
    """Print how far the sweep in the store at `path` is, from its files alone: it may be running, stopped or killed.

    Of a folder with stores inside, each is told. With `verify`, every file is compared with its checksum; `path` may then also
    be a netCDF file.

    Raises
    ------
    ParameterError
        There is no store of a sweep at `path`, or what was verified is damaged.
    """
    from saltus.sweep import damage, status

    if verify and not (path / "zarr.json").is_file() and (path.suffix != ".zarr" or not path.exists()):
        print_verified(path)
        return
    within = sorted(path.rglob("*.zarr")) if path.is_dir() and not (path / "zarr.json").is_file() else []
    if within:
        for store in within:
            print_status(store)
        return
    found = status(path, verify=verify)
    console = Console(highlight=False)
    kind = printable(found.kind, LONGEST_NAME)
    console.print(Text(f"{kind[:1].upper()}{kind[1:].replace('_', ' ')} ", style="bold"), end="")
    console.print(f"in {path}", markup=False, soft_wrap=True)
    if console.is_terminal and found.kind != SEARCH:
        console.print(ProgressBar(total=found.total, completed=found.done), "", sep="\n")
    table = Table(box=None, show_header=False, pad_edge=False)
    table.add_column(style="dim", no_wrap=True)
    table.add_column(overflow="fold")
    for head, text in rows(found):
        table.add_row(head, Text(printable(text)))
    console.print(table)
    if found.damaged:
        raise ParameterError(f"{damage(found)}; start the sweep again, and what they held is computed anew")
    console.print(ending(found), markup=False, soft_wrap=True)
    if verify:
        console.print("Every file is what was written.", markup=False)


def print_verified(path: Path) -> None:
    """Print whether the netCDF file at `path`, or each result below that folder, is still as it was written.

    Raises
    ------
    ParameterError
        Damaged results, all of which the error names; or no result at `path`.
    """
    from saltus.files import UNCHECKED, checked_content, has_checksum
    from saltus.sweep import damage, status

    found = [path] if path.is_file() else [*sorted(path.rglob("*.nc")), *sorted(path.rglob("*.zarr"))]
    console, wrong = Console(highlight=False), list[str]()
    if not found:
        raise ParameterError(f"there is no result of saltus at {path}; give a .nc file, a .zarr folder, or a folder with such")
    for file in found:
        try:
            if file.is_dir():
                store = status(file, verify=True)
                said, bad = "sound", damage(store) if store.damaged else ""
            else:
                checked_content(file)
                said, bad = "sound" if has_checksum(file.read_bytes()) else UNCHECKED, ""
        except ParameterError as error:
            bad = str(error)
        wrong += [bad] if bad else []
        console.print(f"{file}: {'damaged' if bad else said}", markup=False, soft_wrap=True)
    if wrong:
        more = f"; and {len(wrong) - 1} more of these results" if len(wrong) > 1 else ""
        raise ParameterError(f"{wrong[0]}{more}")


def rows(found: StoreStatus) -> Iterator[tuple[str, str]]:
    """The lines of the table: heads and values."""
    if found.kind != SEARCH:
        yield "chunks", f"{found.done} of {found.total} done ({100 * found.done // found.total} %)"
        yield "grid", ", ".join(f"{size} along {name}" for name, size in found.sizes.items())
    for kind, count in found.remembered.items():
        yield kind, f"{count} chunk{'s' * (count > 1)} remembered"
    yield "size", "about " * found.estimated + size(found.bytes)
    yield "begun", moment(found.started)
    yield "last written", moment(found.updated) if found.updated else "nothing yet"
    if found.failures:
        yield "failed", str(found.failed)
    for failure in found.failures[:MOST_LISTED]:
        yield "", str(failure)
    if found.failed > MOST_LISTED:
        yield "", f"and {found.failed - MOST_LISTED} more"


def ending(found: StoreStatus) -> str:
    """Whether the sweep is running, and how it can be continued."""
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
    """A time, in the local time zone."""
    return when.strftime("%Y-%m-%d %H:%M:%S")
