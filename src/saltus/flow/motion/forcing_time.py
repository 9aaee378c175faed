"""The flow's representation of time, the number of the forcing period and a time within it, by which the phase stays exact."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from saltus.checks import LIMITS, check_number
from saltus.errors import ParameterError

MOST_PERIODS = 2**53  # as many as can be counted exactly


@dataclass(frozen=True)
class Clock:
    """When motions start and end; each a number, or an array for many motions."""

    first: Any  # the forcing period that they start in; 0 where the load has none
    local: Any  # the time within it
    last: Any  # the forcing period that they end in
    end: Any  # the local time within that
    length: Any  # of a forcing period; 0 where the load has none


def clock(time: Any, length: Any, periods: float | None, duration: float | None) -> Clock:
    """The start and the end of motions that begin at `time`, under loads of period `length` (or None), and last `periods` or
    `duration`.

    Raises
    ------
    ParameterError
        Both of `periods` and `duration` are given, or neither; one is negative or too long to count; or `periods` is given
        without a forcing period.
    """
    if (periods is None) == (duration is None):
        raise ParameterError("say how long: either periods=... or duration=...", "periods")
    span = periods if duration is None else duration
    check_number("periods" if duration is None else "duration", span, at_least=0.0, at_most=LIMITS.periods)
    assert span is not None
    if length is None:
        if periods is not None:
            raise ParameterError(
                "the load has no frequency, so there are no forcing periods; give duration=... instead", "periods"
            )
        return Clock(0, time, 0, time + span, 0.0)
    reach = np.max(np.abs(time) / length + (span / length if periods is None else span), initial=0.0)
    if not reach < MOST_PERIODS:
        raise ParameterError(f"the motion must start and end within 2^53 forcing periods, got {reach:g} of them", "time")
    first, local = np.divmod(time, length)
    if periods is None:
        passed, end = np.divmod(local + span, length)
    else:
        passed, end = np.floor(periods), local + (periods - np.floor(periods)) * length
    return Clock(first, local, first + passed, end, length)
