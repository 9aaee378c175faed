"""The progress of work: every function that takes a while calls `progress(fraction, what)`.

`fraction` of the work is done, from 0 to 1, and `what` names in a few words what is being done. The first call comes when all
arguments have been checked and computing begins.
"""

from __future__ import annotations

from collections.abc import Callable

Progress = Callable[[float, str], object]


def silent(fraction: float, what: str) -> None:
    """The progress of work that nobody watches."""


def part_of(progress: Progress, begin: float, end: float, what: str | None = None) -> Progress:
    """The progress of a part of the work, during which the fraction of all of it grows from `begin` to `end`.

    `what`, if it is given, names the part whatever its own steps are called.
    """

    def show(fraction: float, step: str) -> object:
        return progress(begin + (end - begin) * fraction, step if what is None else what)

    return show
