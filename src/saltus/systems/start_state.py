"""The state at the start of a motion: one reader for every function that takes one, and what it gives them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from saltus.checks import check_number
from saltus.errors import ParameterError, near, shown
from saltus.systems.system import System


def read_start(system: System, velocity: Any, coordinates: Mapping[str, Any], arguments: Iterable[str] = ()) -> np.ndarray:
    """A state, coordinates and then velocities, (d,), from `theta=0.3, velocity=0.1` as `simulate` takes them.

    Every coordinate must be given, by its name; those called theta_1, theta_2, ... may be given together, `theta=(0.3, 0.0)`. The
    velocity is a number with one coordinate, or as many numbers as there are coordinates; 0, the default, is 0 for all.

    Parameters
    ----------
    system
        What moves.
    velocity, coordinates
        The state at the start.
    arguments
        The names of the other arguments of the function that reads it: a misspelt one arrives among the coordinates.

    Raises
    ------
    ParameterError
        A name is no coordinate (the message has similar names), a coordinate is not given, or a value is no finite number.
    """
    names = system.model.coordinates
    positions = _positions(system, coordinates, arguments)
    speeds = (velocity,) if len(names) == 1 and not _is_sequence(velocity) else _speeds(velocity, len(names))
    for name, value in (*zip(names, positions, strict=True), *(("velocity", speed) for speed in speeds)):
        check_number(name, _plain(value))
    return np.array([*positions, *speeds], dtype=float)


def read_starts(
    system: System, velocity: Any, coordinates: Mapping[str, Any], arguments: Iterable[str] = ()
) -> tuple[list[Any], list[Any]]:
    """The coordinates and the velocities of many states: `read_start`, of which each number may be an array.

    With one coordinate `velocity` is a number or an array; with several it has one number or array for each of them.

    Raises
    ------
    ParameterError
        As `read_start`; numbers in arrays are not looked at.
    """
    names = system.model.coordinates
    positions = _positions(system, coordinates, arguments)
    speeds = (velocity,) if len(names) == 1 else _speeds(velocity, len(names))
    for name, value in (*zip(names, positions, strict=True), *(("velocity", speed) for speed in speeds)):
        if not _is_sequence(value) and not hasattr(value, "dims"):
            check_number(name, _plain(value))
    return list(positions), list(speeds)


def _positions(system: System, coordinates: Mapping[str, Any], arguments: Iterable[str]) -> list[Any]:
    """The values of the coordinates in the model's order."""
    names, given = system.model.coordinates, dict(coordinates)
    for together in [name for name in given if name not in names]:
        if names == tuple(f"{together}_{i + 1}" for i in range(len(names))):
            values = given.pop(together)
            if not _is_sequence(values) or len(values) != len(names):
                raise ParameterError(f"{together} must have {len(names)} values, got {shown(values)}", together)
            given |= dict(zip(names, values, strict=True))
    for name in given:
        if name not in names:
            hint = near(name, names, {"velocity", *arguments} - {"coordinates"})
            raise ParameterError(f"{type(system.model).__name__} has no coordinate {shown(name)}; {hint}", name)
    for name in names:
        if name not in given:
            raise ParameterError(f"the state at the start needs {name}=...", name)
    return [given[name] for name in names]


def _speeds(velocity: Any, count: int) -> tuple[Any, ...]:
    """The velocities of several coordinates, or the one in a sequence."""
    if _is_sequence(velocity) and len(velocity) == count:
        return tuple(velocity)
    if isinstance(velocity, (int, float)) and velocity == 0 and not isinstance(velocity, bool):
        return (0.0,) * count
    raise ParameterError(f"velocity must have {count} value(s), got {shown(velocity)}", "velocity")


def _is_sequence(value: Any) -> bool:
    """Whether a value has entries in an order; a DataArray has named dimensions, and is no sequence."""
    return isinstance(value, (tuple, list)) or (not hasattr(value, "dims") and getattr(value, "ndim", 0) > 0)


def _plain(value: Any) -> Any:
    """The number in an array without dimensions; anything else as it is."""
    return value.item() if isinstance(value, np.ndarray) and value.ndim == 0 else value


def arguments_of(system: System, state: Any) -> dict[str, Any]:
    """A state (coordinates, velocities) as `simulate` takes it."""
    names, numbers = system.model.coordinates, [float(x) for x in state]
    velocity = tuple(numbers[len(names) :])
    return {**dict(zip(names, numbers, strict=False)), "velocity": velocity[0] if len(names) == 1 else velocity}


def state_of(system: System, arguments: Mapping[str, Any]) -> np.ndarray:
    """The inverse of `arguments_of`: coordinates, then velocities, (d,)."""
    return np.append([arguments[name] for name in system.model.coordinates], arguments["velocity"])
