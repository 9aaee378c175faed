"""The results that are asked of an ensemble: tolerance, duration, samples, and early ends."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from enum import StrEnum
from typing import Any

import numpy as np

from saltus.checks import check_count
from saltus.errors import ParameterError, near, shown


class Sample(StrEnum):
    """The samples that may be kept for each of the last forcing periods; their order is that of the
    variables in the result.
    """

    STATE = "state"  # at the end of the period, stroboscopically
    EXTREMA = "extrema"  # of the coordinate; with several coordinates, of any of them
    SPEED = "speed"  # the least abs(v-) of the impacts
    IMPACT_COUNT = "impact_count"

    def columns(self, own: int) -> list[int]:
        """Its columns in the samples of the driver, for a model with `own` coordinates."""
        state = 2 * own
        return {
            Sample.STATE: list(range(state)),
            Sample.EXTREMA: [state, state + 1],
            Sample.SPEED: [state + 2],
            Sample.IMPACT_COUNT: [state + 3],
        }[self]


class Until(StrEnum):
    """The conditions that may end a trajectory early."""

    REST = "rest"  # it is proved to be captured at rest for all later loads (see `capture_speed`)
    SETTLED = "settled"  # it repeats itself every q <= 16 forcing periods


@dataclass(frozen=True)
class EnsembleOptions:
    """What is to be computed: how exactly, for how long, and which samples are kept."""

    tol: float
    periods: float | None  # None if a duration is asked for
    limits: tuple[str, ...]  # margins to stop at
    sample: tuple[str, ...] = ()  # of `Sample`
    until: tuple[str, ...] = ()  # of `Until`
    # whether extrema are recorded from the start, not only in the periods that are kept: that takes
    # time
    from_start: bool = True
    # of the parameters to differentiate to; None without derivatives
    paths: tuple[str, ...] | None = None


def read_names(argument: str, given: Any, known: Iterable[str] | None = None) -> tuple[str, ...]:
    """One name or several as a tuple; each must be one of the `known` names, if these are given.

    Raises
    ------
    ParameterError
        A value is no name, or no known one.
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
            raise ParameterError(
                f"{argument} cannot be {shown(name)}; {near(str(name), known)}", argument
            )
    return names


def read_last(last: Any, periods: int) -> int:
    """For how many of the forcing periods of a motion samples are kept.

    Raises
    ------
    ParameterError
        `last` is neither a whole number from 1 on nor "all".
    """
    if isinstance(last, str) and last == "all":
        return periods
    if isinstance(last, bool) or not isinstance(last, (int, np.integer)) or last < 1:
        raise ParameterError(
            f'last must be a whole number of forcing periods from 1 on, or "all", got {last!r}',
            "last",
        )
    return max(1, min(int(last), periods))


def read_side(side: Any) -> int:
    """The side to leave by, or 0.

    Raises
    ------
    ParameterError
        `side` is neither +1 nor -1 nor None.
    """
    if side is not None and (np.ndim(side) or side not in (1, -1)):
        raise ParameterError(f"side must be +1 or -1, got {side!r}", "side")
    return side or 0


def read_threads(threads: Any) -> int:
    """The number of threads to use, by default as many as there are cores.

    Raises
    ------
    ParameterError
        `threads` is no whole number from 1 on.
    """
    # here, as reading a dataset needs no compiled code
    from saltus.flow.programs.lane_threads import available_cores

    threads = available_cores() if threads is None else threads
    check_count("threads", threads, 1)
    return int(threads)
