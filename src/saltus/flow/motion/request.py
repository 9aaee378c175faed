"""The request for a single motion: the arguments that `simulate` and `sensitivities` share, read and checked once."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from saltus.checks import LIMITS, check_memory, check_number, check_size
from saltus.errors import ParameterError
from saltus.flow.kernel.structures import limits_of
from saltus.systems import System, check_system, read_start

ARGUMENTS = ("velocity", "periods", "duration", "time")  # a misspelt one arrives among the coordinates

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


@dataclass(frozen=True, kw_only=True)
class MotionRequest:
    """The arguments of `simulate` as they are given, and the quantities that follow from them.

    Raises
    ------
    ParameterError
        An argument has no meaning.
    """

    system: System
    coordinates: Mapping[str, float]
    velocity: Any
    periods: float | None
    duration: float | None
    tol: float
    time: float
    side: int | None
    stop_at: Iterable[str]
    dense: bool
    times: Any = None
    sensitivities: tuple[str, ...] | None = None  # parameters to differentiate to; None without derivatives
    # These follow from the arguments:
    position: np.ndarray = field(init=False)
    speeds: np.ndarray = field(init=False)
    limits: tuple[str, ...] = field(init=False)  # margins that end the motion
    clock: Clock = field(init=False)
    sample_times: np.ndarray | None = field(init=False)

    def __post_init__(self) -> None:
        check_system(self.system, "simulate", several_contacts=True)
        for name, value in self._read().items():
            object.__setattr__(self, name, value)

    def _read(self) -> dict[str, Any]:
        """The fields that follow from the arguments."""
        position, speeds = np.split(read_start(self.system, self.velocity, self.coordinates, ARGUMENTS), 2)
        limits = limits_of(self.system, self.stop_at)
        check_number("tol", self.tol, at_least=1e-15, at_most=1e-6)
        check_number("time", self.time)
        if self.side not in (None, 1, -1):
            raise ParameterError(f"side must be +1 or -1, got {self.side!r}", "side")
        when = clock(float(self.time), self.system.load.period, self.periods, self.duration)
        if self.dense and self.times is None:
            _check_dense(when, self.periods, self.duration)
        return {
            "position": position,
            "speeds": speeds,
            "limits": limits,
            "clock": when,
            "sample_times": None if self.times is None else _sample_times(self.times, float(self.time)),
        }


def _check_dense(when: Clock, periods: float | None, duration: float | None) -> None:
    """Refuse a motion that is too long to be kept whole."""
    name, span = ("duration", duration) if periods is None else ("periods", periods)
    count = float(span or 0.0) / (1.0 if periods is not None else when.length or 2.0 * math.pi)
    check_memory(name, count * LIMITS.dense, f"{count:.3g} periods of a motion kept whole (dense=False or times=... keep less)")


def _sample_times(given: Any, start: float) -> np.ndarray:
    check_size(given, "times")
    try:
        times = np.atleast_1d(np.asarray(given, dtype=float))
    except (TypeError, ValueError):
        times = np.array([np.nan])
    if times.ndim != 1 or not np.isfinite(times).all() or (np.diff(times) < 0).any() or (times < start).any():
        raise ParameterError(f"times must be numbers that do not decrease, from the start {start:g} on, got {given!r}", "times")
    return times
