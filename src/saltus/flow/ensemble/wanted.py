"""What an ensemble is asked for besides its states and parameters."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from enum import StrEnum
from typing import Any

import numpy as np

from saltus.checks import check_count
from saltus.errors import ParameterError, near, shown
from saltus.flow.ensemble.threads import available_cores


class Sample(StrEnum):
    """What may be kept of each of the last forcing periods; the order is that of the variables in the result."""

    STATE = "state"  # at the end of the period, stroboscopically
    EXTREMA = "extrema"  # of the coordinate, or of all of several
    SPEED = "speed"  # the least abs(v-) of the impacts
    IMPACT_COUNT = "impact_count"

    def columns(self, own: int) -> list[int]:
        """Its columns of what the driver samples, for so many coordinates of the model."""
        state = 2 * own
        return {
            Sample.STATE: list(range(state)),
            Sample.EXTREMA: [state, state + 1],
            Sample.SPEED: [state + 2],
            Sample.IMPACT_COUNT: [state + 3],
        }[self]


class Until(StrEnum):
    """What may end a trajectory before its time."""

    REST = "rest"  # it is proved to be captured at rest for all later loads (see `capture_speed`)
    SETTLED = "settled"  # it repeats itself every q <= 16 forcing periods


@dataclass(frozen=True)
class Wanted:
    """What is to be computed: how exactly, how long, and what is kept of it."""

    tol: float
    periods: float | None  # None where a duration is asked for
    limits: tuple[str, ...]  # margins to stop at
    sample: tuple[str, ...] = ()  # of `Sample`
    until: tuple[str, ...] = ()  # of `Until`
    from_start: bool = True  # whether extrema are recorded from the start, not only in the periods that are kept: that takes time
    paths: tuple[str, ...] | None = None  # of the parameters to differentiate to; None without derivatives


def read_names(argument: str, given: Any, known: Iterable[str] | None = None) -> tuple[str, ...]:
    """One name or several; each of the known ones, where these are given.

    Raises
    ------
    ParameterError
        What is no name, or not known.
    """
    known = None if known is None else tuple(known)
    try:
        names = (given,) if isinstance(given, str) else tuple(given)
    except TypeError:
        raise ParameterError(f"{argument} must be names, got {shown(given)}", argument) from None
    for name in names:
        if not isinstance(name, str):
            raise ParameterError(f"{argument} must be names, got {shown(given)}", argument)
        if known is not None and name not in known:
            raise ParameterError(f"{argument} knows no {shown(name)}; {near(str(name), known)}", argument)
    return names


def read_last(last: Any, periods: int) -> int:
    """Of how many of so many forcing periods something is kept.

    Raises
    ------
    ParameterError
        No whole number from 1 on, and not "all".
    """
    if isinstance(last, str) and last == "all":
        return periods
    if isinstance(last, bool) or not isinstance(last, (int, np.integer)) or last < 1:
        raise ParameterError(f'last must be a whole number of forcing periods from 1 on, or "all", got {last!r}', "last")
    return max(1, min(int(last), periods))


def read_side(side: Any) -> int:
    """The side to leave by, or 0.

    Raises
    ------
    ParameterError
        Neither +1 nor -1 nor None.
    """
    if side is not None and (np.ndim(side) or side not in (1, -1)):
        raise ParameterError(f"side must be +1 or -1, got {side!r}", "side")
    return side or 0


def read_threads(threads: Any) -> int:
    """How many threads to use, by default as many as there are cores.

    Raises
    ------
    ParameterError
        No whole number from 1 on.
    """
    threads = available_cores() if threads is None else threads
    check_count("threads", threads, 1)
    return int(threads)
