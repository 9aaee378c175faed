"""What a study asks besides a motion: a table for each question, whose keys are the arguments of the functions that answer it."""

from __future__ import annotations

import inspect
import sys
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from importlib import import_module
from types import SimpleNamespace
from typing import Annotated, Any, get_args, get_type_hints

import numpy as np
from pydantic import BeforeValidator, create_model

from saltus.config.fields import KINDS, Table, check_table, read_angle, read_whole, show
from saltus.config.source import Source
from saltus.errors import near
from saltus.systems import System

QUESTIONS: dict[str, tuple[str, ...]] = {
    "phase_portrait": ("studies:phase_portrait",),
    "response_spectrum": ("studies:response_spectrum", "studies:orbit_diagram"),
    "bifurcation_diagram": ("studies:bifurcation_diagram", "studies:orbit_diagram"),
    "attractors": ("attractors:find_attractors",),
    "basins": ("studies:basin_sweep", "attractors:basins_of_attraction"),
    "stability_chart": ("studies:bordered_chart", "studies:stability_chart"),
}  # the function that answers each question, then the one to which it hands its further options
NOT_IN_FILES = ("system", "store", "workers", "scheduler")  # they are given by the rest of the file or on the command line

SPACED = ("from", "to", "count")
EXAMPLE = "{ from = 0, to = 0.5, count = 101 }"
MAX_COUNT = 100_000  # A longer axis is a slip of the pen: a chart of that width takes years.


@dataclass(frozen=True, kw_only=True)
class Ask:
    """One question: its kind, which is the name of its table, and the arguments given in it."""

    kind: str
    options: dict[str, Any]


def read_values(value: Any) -> np.ndarray:
    """Numbers (or angles) from a list, or from a table such as { from = 0, to = 0.5, count = 101 }."""
    if isinstance(value, list) and value:
        return np.array([read_angle(item) for item in value])
    if isinstance(value, dict):
        return _spaced(value)
    given = "an empty list" if value == [] else show(value)
    raise ValueError(f"must be a list of numbers or a table such as {EXAMPLE}, got {given}")


def _spaced(table: dict[str, Any]) -> np.ndarray:
    """`count` numbers evenly spaced between the two ends in a table."""
    unknown = [name for name in table if name not in SPACED]
    if unknown:
        raise ValueError(f"has the unknown key {unknown[0]!r}; {near(str(unknown[0]), SPACED)}")
    missing = [name for name in SPACED if name not in table]
    if missing:
        raise ValueError(f"needs from, to and count, such as {EXAMPLE}, and has no {' and no '.join(missing)}")
    low, high, count = _part(table, "from", read_angle), _part(table, "to", read_angle), _part(table, "count", read_whole)
    if not 2 <= count <= MAX_COUNT:
        raise ValueError(f"needs a count from 2 to {MAX_COUNT}, got {show(table['count'])}")
    if low >= high:
        raise ValueError(f"must go from the smaller number to the larger one, got from = {low:g}, to = {high:g}")
    return np.linspace(low, high, count)


def _part(table: dict[str, Any], name: str, read: Callable[[Any], Any]) -> Any:
    try:
        return read(table[name])
    except ValueError as error:
        raise ValueError(f"has a {name} that {error}") from None


def read_pair(value: Any) -> tuple[float, float]:
    """Two numbers (or angles)."""
    if not isinstance(value, list) or len(value) != 2:
        raise ValueError(f"must be a list of two numbers, got {show(value)}")
    return read_angle(value[0]), read_angle(value[1])


def read_pairs(value: Any) -> tuple[tuple[float, float], ...]:
    """Pairs of numbers (or angles)."""
    if not isinstance(value, list) or not value:
        raise ValueError(f"must be a list of pairs of numbers, got {show(value)}")
    return tuple(read_pair(item) for item in value)


def read_paths(value: Any) -> tuple[str, str]:
    """Two dotted paths."""
    if not isinstance(value, list) or len(value) != 2 or not all(isinstance(item, str) for item in value):
        raise ValueError(f'must be two dotted paths, such as ["load.horizontal.amplitude", "load.vertical"], got {show(value)}')
    return value[0], value[1]


Pair = tuple[float, float]
READABLE = KINDS | {
    Pair: Annotated[Any, BeforeValidator(read_pair)],
    tuple[Pair, Pair]: Annotated[Any, BeforeValidator(read_pairs)],
    Iterable[Pair]: Annotated[Any, BeforeValidator(read_pairs)],
    Iterable[float]: Annotated[Any, BeforeValidator(read_values)],
    tuple[str, str]: Annotated[Any, BeforeValidator(read_paths)],
}  # how a file gives an argument of each type; an argument of another type is for Python alone


def keys_of(kind: str, coordinates: tuple[str, ...] = ()) -> dict[str, Any]:
    """The keys that the table of a question may have, each with the pydantic type that reads it.

    Args:
        coordinates: the names of the coordinates, which stand for an open-ended argument that holds one array for each.
    """
    keys: dict[str, Any] = {}
    for place in QUESTIONS[kind]:
        room, name = place.split(":")
        for argument, hint in _arguments(getattr(import_module(f"saltus.{room}"), name)):
            for key in coordinates if argument.kind is argument.VAR_KEYWORD else (argument.name,):
                if hint in READABLE and key not in NOT_IN_FILES:
                    keys[key] = READABLE[hint]
    return keys


def _arguments(function: Callable[..., Any]) -> Iterator[tuple[inspect.Parameter, Any]]:
    """The arguments of a function with their types; that of X | None, which may be left out, is X."""
    arguments = inspect.signature(function).parameters
    annotated = SimpleNamespace(__annotations__={name: argument.annotation for name, argument in arguments.items()})
    hints = get_type_hints(annotated, globalns=vars(sys.modules[function.__module__]))
    for name, argument in arguments.items():
        kinds = [kind for kind in get_args(hints[name]) if kind is not type(None)]
        yield argument, kinds[0] if len(kinds) == 1 and type(None) in get_args(hints[name]) else hints[name]


def read_ask(source: Source, system: System, kind: str, data: Any) -> Ask:
    """The question in a table.

    Raises:
        ParameterError: with the place of what is wrong.
    """
    entries: dict[str, Any] = {name: (reader, None) for name, reader in keys_of(kind, system.model.coordinates).items()}
    return Ask(kind=kind, options=check_table(source, (kind,), data, create_model(kind, __base__=Table, **entries)))
