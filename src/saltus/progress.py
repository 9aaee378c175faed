"""The progress of work: every function that takes a while calls `progress(fraction, what)`.

`fraction` of the work is done, from 0 to 1, and `what` names in a few words what is being done. The first call comes when all
arguments have been checked and computing begins.
"""

from __future__ import annotations

import sys
from collections.abc import Callable

from saltus.checks import check_number
from saltus.notebook import LineBelowCell

Progress = Callable[[float, str], object]
LINE = LineBelowCell()
LOOK_INTERVAL = 0.1  # seconds between looks at Ctrl-C, and at the progress of other threads


def silent(fraction: float, what: str) -> None:
    """The progress of work that nobody watches."""


def show_progress(fraction: float, what: str) -> None:
    """The progress of work in one line on stderr, or of a notebook below the cell, written over itself: `progress=show_progress`.

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
    check_number("fraction", fraction)
    if LINE.show(min(max(fraction, 0.0), 1.0), what):
        return
    bar = "#" * round(20 * min(max(fraction, 0.0), 1.0))
    done = fraction >= 1.0
    print(f"\r[{bar:<20}] {100 * fraction:3.0f} % {what:<40.40}", end="\n" if done else "", file=sys.stderr, flush=True)


def part_of(progress: Progress, begin: float, end: float, what: str | None = None) -> Progress:
    """The progress of a part of the work, during which the fraction of the whole work grows from `begin` to `end`.

    `what`, if it is given, replaces the names that the part gives to its own steps.
    """

    def show(fraction: float, step: str) -> object:
        return progress(begin + (end - begin) * fraction, step if what is None else what)

    return show


def growing(progress: Progress) -> Progress:
    """A progress whose fraction never falls, for work of which some parts turn out to be longer than expected."""
    most = 0.0

    def show(fraction: float, step: str) -> object:
        nonlocal most
        most = max(most, fraction)
        return progress(most, step)

    return show
