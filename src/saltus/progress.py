"""The progress of work: every function that takes a while calls `progress(fraction, what)`.

`fraction` of the work is done, from 0 to 1, and `what` names in a few words what is being done. The
first call comes when all arguments have been checked and computing begins.
"""

from __future__ import annotations

import html
import io
import math
import multiprocessing
import sys
import threading
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from contextvars import ContextVar
from numbers import Real
from typing import Any

from saltus.errors import ParameterError, shown

Progress = Callable[[float, str], object]
UNWATCHED = 2.0  # seconds after which work that nobody watches shows its progress by itself
LOOK_INTERVAL = 0.1  # seconds between looks at Ctrl-C, and at the progress of other threads


class LineBelowCell:
    """One line below the cell of a notebook, which is written over as work goes on, as also in a
    notebook that is executed.
    """

    def __init__(self) -> None:
        self._handle: Any = None

    def show(self, fraction: float, what: str) -> bool:
        """Show the line; False outside of a notebook."""
        if not _in_notebook():
            return False
        notebook = sys.modules["IPython"].display
        done = fraction >= 1.0
        line = (
            f"<progress value='{fraction:.4f}' max='1'></progress> {100 * fraction:3.0f} % "
            f"{html.escape(what)}"
        )
        if self._handle is None:
            self._handle = notebook.display(notebook.HTML(line), display_id=True)
        else:
            self._handle.update(notebook.HTML(line))
        if done:
            self._handle = None
        return True


def show_below_cell(figure: Any) -> None:
    """In a notebook, show a figure below the cell that makes it; elsewhere do nothing."""
    if _in_notebook():
        picture = io.BytesIO()
        notebook = sys.modules["IPython"].display
        figure.savefig(picture, format="png", dpi=110)
        notebook.display(notebook.Image(picture.getvalue()))


def _in_notebook() -> bool:
    shell = sys.modules["IPython"].get_ipython() if "IPython" in sys.modules else None
    return hasattr(shell, "kernel")


LINE = LineBelowCell()


def silent(fraction: float, what: str) -> None:
    """The progress of work that nobody watches."""


def show_progress(fraction: float, what: str) -> None:
    """The progress of work in one line on stderr, or of a notebook below the cell, written over
    itself: `progress=show_progress`.

    Parameters
    ----------
    fraction
        The share that is done, in [0, 1].
    what
        What is being done.

    Examples
    --------
    >>> ends = saltus.simulate_many(system, theta=[0.1, 0.3], periods=10, progress=saltus.show_progress)
    """
    if not isinstance(fraction, Real) or isinstance(fraction, bool) or not math.isfinite(fraction):
        raise ParameterError(f"fraction must be a finite number, got {shown(fraction)}", "fraction")
    if LINE.show(min(max(fraction, 0.0), 1.0), what):
        return
    bar = "#" * round(20 * min(max(fraction, 0.0), 1.0))
    done = fraction >= 1.0
    print(
        f"\r[{bar:<20}] {100 * fraction:3.0f} % {what:<40.40}",
        end="\n" if done else "",
        file=sys.stderr,
        flush=True,
    )


class LongWork:
    """The progress of work that nobody watches, which is shown after a while where a person reads:
    in a terminal or a notebook. A file is not written to."""

    def __init__(self) -> None:
        self.begin = time.monotonic()
        self.shown = -math.inf  # when the line was written last
        self.last: tuple[float, str] | None = None  # what it said then

    def __call__(self, fraction: float, what: str) -> None:
        """Show the line, if it has taken long; at most ten times a second."""
        now = time.monotonic()
        if self.last is None and (fraction >= 1.0 or now - self.begin <= UNWATCHED):
            return
        if (fraction >= 1.0 or now - self.shown >= LOOK_INTERVAL) and _is_read():
            self.shown, self.last = now, (fraction, what)
            show_progress(fraction, what)

    @property
    def is_early(self) -> bool:
        """Whether it is too early for the line."""
        return self.last is None and time.monotonic() - self.begin <= UNWATCHED

    def end(self) -> None:
        """Leave the line, which is full unless an error has ended the work."""
        if self.last is None or self.last[0] >= 1.0:
            return
        if sys.exc_info()[0] is None:
            show_progress(1.0, self.last[1])
        elif not _in_notebook():
            print(file=sys.stderr)


def shown_if_long(progress: Progress) -> Progress:
    """A progress; in the place of `silent`, where nobody watches what this is a part of either, one
    that is shown after a while."""
    return LongWork() if progress is silent and _watch.get() is None else progress


def is_unwatched() -> bool:
    """Whether nobody watches what this thread does."""
    return _watch.get() is None


def _is_read() -> bool:
    """Whether a person reads what this thread writes: that of a script or notebook itself, no
    thread and no process that helps it."""
    own = threading.current_thread() is threading.main_thread()
    return own and multiprocessing.parent_process() is None and (_in_notebook() or _is_terminal())


def _is_terminal() -> bool:
    return sys.stderr is not None and sys.stderr.isatty()


class FractionMemory:
    """A progress that remembers the fraction, for parts of the work that know nothing of the
    whole.
    """

    def __init__(self, progress: Progress) -> None:
        self.progress = progress
        self.fraction = 0.0

    def __call__(self, fraction: float, what: str) -> object:
        self.fraction = fraction
        return self.progress(fraction, what)


def is_idle(progress: Progress) -> bool:
    """Whether a progress would do nothing now, so that its words need not be written."""
    if isinstance(progress, FractionMemory):
        progress = progress.progress
    return progress is silent or (isinstance(progress, LongWork) and progress.is_early)


_watch: ContextVar[FractionMemory | None] = ContextVar("watch", default=None)


@contextmanager
def watched(progress: Progress) -> Iterator[FractionMemory]:
    """While work goes on, `say` tells this progress; work is given the one that is returned in its
    place.
    """
    watch = FractionMemory(progress)
    token = _watch.set(watch)
    try:
        yield watch
    finally:
        _watch.reset(token)


def say(what: str) -> None:
    """Tell whoever watches the work of this thread what takes a while now, such as compiling,
    whichever function asked for it.

    Where nobody watches, a terminal shows it as a line; a file is not written to.
    """
    watch = _watch.get()
    if watch is not None and not isinstance(watch.progress, LongWork):
        watch.progress(watch.fraction, what)
    elif _is_terminal():
        print(f"saltus: {what}", file=sys.stderr, flush=True)


def part_of(progress: Progress, begin: float, end: float, what: str | None = None) -> Progress:
    """The progress of a part of the work, during which the fraction of the whole work grows from
    `begin` to `end`.

    `what`, if it is given, replaces the names that the part gives to its own steps.
    """

    def show(fraction: float, step: str) -> object:
        return progress(begin + (end - begin) * fraction, step if what is None else what)

    return show


def growing(progress: Progress) -> Progress:
    """A progress whose fraction never falls, for work of which some parts turn out to be longer
    than expected.
    """
    most = 0.0

    def show(fraction: float, step: str) -> object:
        nonlocal most
        most = max(most, fraction)
        return progress(most, step)

    return show


# --- tables in a notebook: HTML in which every text is escaped ---------------

MOST_ROWS = 40  # the most rows of a table; further ones are only counted
CELL = "style='text-align:left;padding:1px 10px 1px 0;vertical-align:top'"


def html_table(title: str, facts: Mapping[str, Any]) -> str:
    """A table with a row for each fact; floats with 9 digits."""
    rows = [
        f"<tr><th {CELL}>{_text(name)}</th><td {CELL}>{_text(value)}</td></tr>"
        for name, value in facts.items()
    ]
    more = (
        f"<tr><td {CELL} colspan='2'>and {len(rows) - MOST_ROWS} more</td></tr>"
        if len(rows) > MOST_ROWS
        else ""
    )
    return f"<div><strong>{_text(title)}</strong><table>{''.join(rows[:MOST_ROWS])}{more}</table></div>"


def rows_table(columns: Mapping[str, Any]) -> str:
    """A table with a column for each name, and a heading."""
    count = max((len(values) for values in columns.values()), default=0)
    head = "".join(f"<th {CELL}>{_text(name)}</th>" for name in columns)
    rows = [
        "<tr>"
        + "".join(f"<td {CELL}>{_text(_plain(values[i]))}</td>" for values in columns.values())
        + "</tr>"
        for i in range(min(count, MOST_ROWS))
    ]
    more = (
        f"<tr><td {CELL} colspan='{len(columns)}'>and {count - MOST_ROWS} more</td></tr>"
        if count > MOST_ROWS
        else ""
    )
    return f"<div><table><tr>{head}</tr>{''.join(rows)}{more}</table></div>"


def _plain(value: Any) -> Any:
    return value.item() if hasattr(value, "item") else value


def _text(value: Any) -> str:
    return html.escape(f"{value:.9g}" if isinstance(value, float) else str(value))
