"""The progress of a command's work, drawn in one place for all commands."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from rich.console import Console
from rich.progress import BarColumn, SpinnerColumn, TextColumn, TimeElapsedColumn
from rich.progress import Progress as Bar

from saltus.progress import Progress


@contextmanager
def progress_bar(title: str) -> Iterator[Progress]:
    """A bar with a clock on a terminal; elsewhere a line on stderr whenever another step of the work begins.

    The commands of saltus draw theirs in this way; a command that another package adds can do the same.

    Parameters
    ----------
    title
        What the work is, before the name of the step.

    Yields
    ------
    Progress
        The `progress(fraction, what)` that the work calls; `what` names the step, and after a comma what changes in it.

    Examples
    --------
    >>> from saltus.cli import progress_bar
    >>> with progress_bar("spectrum") as progress:
    ...     ends = saltus.simulate_many(system, theta=[0.1, 0.3], periods=10, progress=progress)
    """
    messages, step = Console(stderr=True, highlight=False), ""
    columns = (SpinnerColumn(), TextColumn("{task.description}", markup=False), BarColumn(bar_width=20), TimeElapsedColumn())
    with Bar(*columns, console=messages, transient=True, disable=not messages.is_terminal) as bar:
        task = bar.add_task(title, total=1.0)

        def show(fraction: float, what: str) -> None:
            nonlocal step
            bar.update(task, completed=fraction, description=f"{title}: {what}")
            if not messages.is_terminal and what.split(",")[0] != step:
                step = what.split(",")[0]
                print(f"{title}: {step}", file=messages.file, flush=True)

        show(0.0, "computing")
        yield show
