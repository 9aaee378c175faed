"""The request for a single motion: the arguments that `simulate` and `sensitivities` share, read and checked once."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from saltus.checks import LIMITS, check_memory, check_number
from saltus.errors import ParameterError, near
from saltus.flow.kernel.structures import limits_of
from saltus.flow.motion.forcing_time import Clock, clock
from saltus.systems import System, check_system

ARGUMENTS = ("velocity", "periods", "duration", "time")  # a misspelt one arrives among the coordinates


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
        position, speeds = _start_state(self.system, self.velocity, self.coordinates)
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
    try:
        times = np.atleast_1d(np.asarray(given, dtype=float))
    except (TypeError, ValueError):
        times = np.array([np.nan])
    if times.ndim != 1 or not np.isfinite(times).all() or (np.diff(times) < 0).any() or (times < start).any():
        raise ParameterError(f"times must be numbers that do not decrease, from the start {start:g} on, got {given!r}", "times")
    return times


def _one_by_one(coordinates: Mapping[str, Any], names: tuple[str, ...]) -> Mapping[str, Any]:
    """The coordinates by their names, also if they are given together: theta=(0.2, 0.0) for theta_1 and theta_2."""
    for together, values in coordinates.items():
        if together not in names and names == tuple(f"{together}_{i + 1}" for i in range(len(names))):
            if np.shape(values) != (len(names),):
                raise ParameterError(f"{together} must have {len(names)} values, got {values!r}", together)
            return {name: v for name, v in coordinates.items() if name != together} | dict(zip(names, values, strict=True))
    return coordinates


def check_coordinates(system: System, given: Iterable[str]) -> None:
    """Refuse a start that has other coordinates than the model, or lacks one of them.

    Raises
    ------
    ParameterError
        A name is no coordinate (the message has similar names), or a coordinate is not given.
    """
    names, given = system.model.coordinates, tuple(given)
    for name in given:
        if name not in names:
            raise ParameterError(
                f"{type(system.model).__name__} has no coordinate {name!r}; {near(name, names, ARGUMENTS)}", name
            )
    for name in names:
        if name not in given:
            raise ParameterError(f"the state at the start needs {name}=...", name)


def _start_state(system: System, velocity: Any, coordinates: Mapping[str, float]) -> tuple[np.ndarray, np.ndarray]:
    names = system.model.coordinates
    coordinates = _one_by_one(coordinates, names)
    check_coordinates(system, coordinates)
    for name in names:
        check_number(name, coordinates[name])
    try:
        speeds = np.atleast_1d(velocity)
        if np.ndim(velocity) == 0 and velocity == 0.0:
            speeds = np.zeros(len(names))
    except ValueError:
        raise ParameterError(f"velocity must have {len(names)} value(s), got {velocity!r}", "velocity") from None
    if speeds.shape != (len(names),):
        raise ParameterError(f"velocity must have {len(names)} value(s), got {velocity!r}", "velocity")
    for value in speeds:
        check_number("velocity", value)
    return np.array([coordinates[name] for name in names], dtype=float), speeds.astype(float)
