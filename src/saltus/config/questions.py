"""What a study asks for besides a motion: a table for each question, whose keys are the arguments of its function."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np
from pydantic import BeforeValidator, create_model

from saltus.config.fields import Number, Switch, Table, Text, Whole, check_table, read_angle, read_whole, show
from saltus.config.source import Source
from saltus.errors import near
from saltus.systems import System

SPACED = ("from", "to", "count")
EXAMPLE = "{ from = 0, to = 0.5, count = 101 }"
MOST = 100_000  # points along an axis


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


def read_grid(value: Any) -> np.ndarray:
    """The same, for numbers that rise."""
    values = read_values(value)
    if (np.diff(values) <= 0).any():
        raise ValueError("must be numbers that rise, each above the one before")
    return values


def _spaced(table: dict[str, Any]) -> np.ndarray:
    """`count` numbers evenly spaced between the two ends in a table."""
    unknown = [name for name in table if name not in SPACED]
    if unknown:
        raise ValueError(f"has the unknown key {unknown[0]!r}; {near(str(unknown[0]), SPACED)}")
    missing = [name for name in SPACED if name not in table]
    if missing:
        raise ValueError(f"needs from, to and count, such as {EXAMPLE}, and has no {' and no '.join(missing)}")
    low, high, count = _part(table, "from", read_angle), _part(table, "to", read_angle), _part(table, "count", read_whole)
    if not 2 <= count <= MOST:
        raise ValueError(f"needs a count from 2 to {MOST}, got {show(table['count'])}")
    if low >= high:
        raise ValueError(f"must go from the smaller number to the larger one, got from = {low:g}, to = {high:g}")
    return np.linspace(low, high, count)


def _part(table: dict[str, Any], name: str, read: Callable[[Any], Any]) -> Any:
    try:
        return read(table[name])
    except ValueError as error:
        raise ValueError(f"has a {name} that {error}") from None


def read_pair(value: Any) -> tuple[float, float]:
    """Two numbers."""
    if not isinstance(value, list) or len(value) != 2:
        raise ValueError(f"must be a list of two numbers, got {show(value)}")
    return read_angle(value[0]), read_angle(value[1])


def read_pairs(value: Any) -> list[tuple[float, float]]:
    """A list of pairs of numbers."""
    if not isinstance(value, list) or not value:
        raise ValueError(f"must be a list of pairs of numbers, got {show(value)}")
    return [read_pair(item) for item in value]


def read_paths(value: Any) -> tuple[str, str]:
    """Two dotted paths."""
    if not isinstance(value, list) or len(value) != 2 or not all(isinstance(item, str) for item in value):
        raise ValueError(f'must be two dotted paths, such as ["load.horizontal.amplitude", "load.vertical"], got {show(value)}')
    return value[0], value[1]


Values = Annotated[Any, BeforeValidator(read_values)]
Grid = Annotated[Any, BeforeValidator(read_grid)]
Pair = Annotated[Any, BeforeValidator(read_pair)]
Pairs = Annotated[Any, BeforeValidator(read_pairs)]
Paths = Annotated[Any, BeforeValidator(read_paths)]

DIAGRAM: dict[str, Any] = {
    "path": Text,
    "bounds": Pair,
    "max_period": Whole,
    "values": Values,
    "starts": Whole,
    "region": Pair,
    "seed": Whole,
    "repelling": Whole,
    "switch": Switch,
    "step": Number,
    "bands": Whole,
}
ASKS: dict[str, dict[str, Any]] = {
    "phase_portrait": {"window": Pairs, "starts": Pairs, "duration": Number, "samples": Whole, "seed": Whole},
    "response_spectrum": DIAGRAM,
    "bifurcation_diagram": DIAGRAM,
    "attractors": {"region": Pair, "starts": Whole, "max_period": Whole, "seed": Whole, "tol": Number},
    "basins": {"velocity": Grid, "periods": Whole, "within": Number, "curves": Switch, "tol": Number, "rows": Whole},
    "stability_chart": {
        "horizontal": Grid,
        "vertical": Grid,
        "paths": Paths,
        "max_period": Whole,
        "starts": Whole,
        "region": Pair,
        "least": Number,
        "periods": Whole,
        "tol": Number,
        "seed": Whole,
        "rows": Whole,
        "curves": Whole,
    },
}


def read_ask(source: Source, system: System, kind: str, data: Any) -> Ask:
    """The question in a table.

    Raises:
        ParameterError: with the place of what is wrong.
    """
    fields = dict(ASKS[kind])
    if kind == "basins":
        fields |= dict.fromkeys(system.model.coordinates, Grid)
    entries: dict[str, Any] = {name: (value, None) for name, value in fields.items()}
    table = create_model(kind, __base__=Table, **entries)
    return Ask(kind=kind, options=check_table(source, (kind,), data, table))
