"""The file of a study, refusals that name it, and how its values are read: a function for each
kind.
"""

from __future__ import annotations

import dataclasses
import datetime
import math
import re
import tomllib
import typing
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NoReturn

import numpy as np

from saltus.checks import LIMITS, number_problem
from saltus.errors import ParameterError, near

Keys = tuple[str, ...]


@dataclass(frozen=True)
class Source:
    """A TOML file, by whose path refusals name it."""

    path: Path

    def refuse(self, keys: Keys, problem: str) -> NoReturn:
        """Raise a ParameterError of one sentence: the file and the `problem`, which names the
        dotted key.
        """
        raise ParameterError(one_line(f"{self.path}: {problem}"), ".".join(keys) or "path")

    def refuse_error(self, error: ParameterError) -> NoReturn:
        """Raise the refusal of a parameter at its place in the file, with the path of the file."""
        self.refuse(tuple((error.parameter or "").split(".")), str(error))


def one_line(text: str) -> str:
    """`text` with line breaks and other control characters, which a quoted key may hold, written as
    escapes.
    """
    return "".join(
        c if c.isprintable() else c.encode("unicode_escape").decode("ascii") for c in text
    )


def read_source(path: Path) -> tuple[Source, dict[str, Any]]:
    """The file at `path` and the tables in it.

    Raises
    ------
    ParameterError
        No such file, a folder, a file that cannot be read, text that is not TOML (with the line).
    """
    source = Source(path)
    try:
        # reading a device or a pipe may never end
        if path.exists() and not (path.is_file() or path.is_dir()):
            source.refuse((), "is no file; give the path of a study in TOML")
        if path.is_file() and path.stat().st_size > LIMITS.count:
            source.refuse(
                (),
                f"has {path.stat().st_size} bytes; a study has at most {LIMITS.count}, long "
                "records have files of their own",
            )
        text = path.read_text(encoding="utf-8-sig")
    except ParameterError:
        raise
    except FileNotFoundError:
        source.refuse((), "there is no such file; give the path of a study in TOML")
    except IsADirectoryError:
        source.refuse((), "is a folder; give the path of a study in TOML")
    except UnicodeDecodeError:
        source.refuse((), "is not a text file; a study is written in TOML, encoded as UTF-8")
    except (OSError, ValueError) as error:
        source.refuse((), f"cannot be read ({getattr(error, 'strerror', None) or error})")
    try:
        return source, tomllib.loads(text)
    except RecursionError:
        source.refuse((), "is not a study: its tables or lists are nested too deeply")
    except ValueError as error:  # TOMLDecodeError is one; so is a number with too many digits
        source.refuse((), _syntax_problem(str(error)))


def _syntax_problem(message: str) -> str:
    place = re.search(r" \(at line (\d+), column (\d+)\)$", message)
    if place is None:
        return f"is not valid TOML: {message[:1].lower()}{message[1:]}"
    problem = message[: place.start()]
    return (
        f"line {place[1]}, column {place[2]} is not valid TOML: {problem[:1].lower()}{problem[1:]}"
    )


# gives the value, or raises a ValueError such as "must be a number, got true"
Reader = Callable[[Any], Any]
Pair = tuple[float, float]

ANGLE = re.compile(r"\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*(deg|rad|°)\s*")
SPACED = ("from", "to", "count")
EXAMPLE = "{ from = 0, to = 0.5, count = 101 }"
# The longest axis: a longer one is a typing error, as a chart of that width takes years.
MAX_COUNT = 100_000


def show(value: Any) -> str:
    """A TOML value as it is shown in a sentence."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        text = value if len(value) <= 40 else value[:37] + "..."
        return "the text " + '"' + text.encode("unicode_escape").decode("ascii") + '"'
    for kind, name in (
        (Mapping, "a table"),
        ((list, tuple), "a list"),
        ((datetime.date, datetime.time), "a date or a time"),
    ):
        if isinstance(value, kind):
            return name
    text = (
        repr(value) if not isinstance(value, int) or abs(value) < 10**20 else "a very large number"
    )
    return text if len(text) <= 40 else text[:37] + "..."


def read_number(value: Any) -> float:
    """A finite number as a float.

    Raises
    ------
    ValueError
        For anything else, with the predicate of a sentence.
    """
    if isinstance(value, str):
        raise ValueError(f"must be a number, got {show(value)}{_unquoted(value)}")
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        raise ValueError(f"must be a number, got {show(value)}")
    try:
        number = float(value)
    except OverflowError:
        number = math.inf
    if not math.isfinite(number):
        raise ValueError(f"must be a finite number, got {show(value)}")
    if abs(number) > LIMITS.value:
        raise ValueError(f"must be at most {LIMITS.value:g} in size, got {show(value)}")
    return number


def _unquoted(text: str) -> str:
    try:
        finite = math.isfinite(float(text))
    except ValueError:
        finite = False
    return f"; write it without quotes: {text.strip()}" if finite else ""


def read_angle(value: Any) -> float:
    """An angle in radians from "80 deg", "1.4 rad" or a number of radians.

    Raises
    ------
    ValueError
        For anything else, with the predicate of a sentence.
    """
    if not isinstance(value, str):
        return read_number(value)
    match = ANGLE.fullmatch(value)
    if match is None:
        raise ValueError(
            'must be an angle such as "80 deg", "1.4 rad" or a number of radians without '
            f"quotes, got {show(value)}"
        )
    number = read_number(float(match[1]))
    return number if match[2] == "rad" else math.radians(number)


def read_whole(value: Any) -> int:
    """A whole number."""
    number = read_number(value)
    if number != int(number):
        raise ValueError(f"must be a whole number, got {show(value)}")
    return int(number)


def read_text(value: Any) -> str:
    """A text."""
    if not isinstance(value, str):
        raise ValueError(f'must be text in quotes, such as "force", got {show(value)}')
    return value


def read_switch(value: Any) -> bool:
    """true or false."""
    if not isinstance(value, bool):
        raise ValueError(f"must be true or false, got {show(value)}")
    return value


def read_values(value: Any) -> np.ndarray:
    """Numbers (or angles) from a list, or from a table such as { from = 0, to = 0.5, count = 101
    }.
    """
    if isinstance(value, list) and value:
        return np.array([read_angle(item) for item in value])
    if isinstance(value, dict):
        return _spaced(value)
    given = "an empty list" if value == [] else show(value)
    raise ValueError(f"must be a list of numbers or a table such as {EXAMPLE}, got {given}")


def read_values_or_number(value: Any) -> np.ndarray | float:
    """Numbers as `read_values` reads them, or one number (or angle)."""
    return read_values(value) if isinstance(value, (list, dict)) else read_angle(value)


def _spaced(table: dict[str, Any]) -> np.ndarray:
    """`count` numbers evenly spaced between the two ends in a table."""
    unknown = [name for name in table if name not in SPACED]
    if unknown:
        raise ValueError(f"has the unknown key {unknown[0]!r}; {near(str(unknown[0]), SPACED)}")
    missing = [name for name in SPACED if name not in table]
    if missing:
        raise ValueError(
            f"needs from, to and count, such as {EXAMPLE}, and has no {' and no '.join(missing)}"
        )
    low = _part(table, "from", read_angle)
    high = _part(table, "to", read_angle)
    count = _part(table, "count", read_whole)
    if not 2 <= count <= MAX_COUNT:
        raise ValueError(f"needs a count from 2 to {MAX_COUNT}, got {show(table['count'])}")
    if low >= high:
        raise ValueError(
            f"must go from the smaller number to the larger one, got from = {low:g}, to = {high:g}"
        )
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
    try:
        return tuple(read_pair(item) for item in value)
    except ValueError as error:
        raise ValueError(
            f"must be pairs of numbers, such as [[-2, 2], [-2, 2]], of which each {error}"
        ) from None


def read_paths(value: Any) -> tuple[str, str]:
    """Two dotted paths."""
    if (
        not isinstance(value, list)
        or len(value) != 2
        or not all(isinstance(item, str) for item in value)
    ):
        raise ValueError(
            'must be two dotted paths, such as ["load.horizontal.amplitude", "load.vertical"], '
            f"got {show(value)}"
        )
    return value[0], value[1]


def read_numbers_by_name(value: Any) -> dict[str, float]:
    """Numbers by names, such as dotted paths in quotes."""
    if not isinstance(value, dict):
        raise ValueError(
            f'must be a table of numbers, such as {{ "model.damping" = 1e-6 }}, got {show(value)}'
        )
    result: dict[str, float] = {}
    for name, number in value.items():
        try:
            result[name] = read_angle(number)
        except ValueError as error:
            raise ValueError(f"has a number {name!r:.60} that {error}") from None
    return result


def read_within(reader: Reader, **bounds: Any) -> Reader:
    """A reader of the same values as `reader`, within the bounds of `check_number`."""

    def within(value: Any) -> Any:
        number = reader(value)
        problem = number_problem(number, **bounds)
        if problem is not None:
            raise ValueError(problem)
        return number

    return within


def read_anything(value: Any) -> Any:
    """A value that is checked later, by the function that takes it."""
    return value


def read_switches(value: Any) -> dict[str, bool]:
    """A table of names with true or false, such as { heater = true }."""
    if not isinstance(value, Mapping) or not all(isinstance(on, bool) for on in value.values()):
        raise ValueError(
            f"must be a table of names with true or false, such as {{ heater = true }}, got"
            f" {show(value)}"
        )
    return {read_text(name): bool(on) for name, on in value.items()}


READERS: dict[Any, Reader] = {
    float: read_number,
    int: read_whole,
    str: read_text,
    bool: read_switch,
    Mapping[str, bool]: read_switches,
    Pair: read_pair,
    tuple[Pair, ...]: read_pairs,
    tuple[str, str]: read_paths,
    Iterable[Pair]: read_pairs,
    Mapping[str, float]: read_numbers_by_name,
    Iterable[float]: read_values,
    Iterable[float] | float: read_values_or_number,
}  # how a file gives an argument of each type


def reader_of(hint: Any) -> Reader | None:
    """The reader of values of a type, or None if a file cannot give such values; X | None is an X
    that may be left out.
    """
    kinds = [kind for kind in typing.get_args(hint) if kind is not type(None)]
    return READERS.get(
        kinds[0] if len(kinds) == 1 and type(None) in typing.get_args(hint) else hint
    )


def readers_of(cls: type) -> dict[str, Reader]:
    """The readers of the fields of a dataclass; a field whose metadata says "rad" is an angle."""
    hints = typing.get_type_hints(cls)
    return {
        f.name: (
            read_angle
            if f.metadata.get("unit") == "rad"
            else reader_of(hints.get(f.name)) or read_anything
        )
        for f in dataclasses.fields(cls)
        if f.init and not f.name.startswith("_")
    }


def read_table(
    source: Source, keys: Keys, data: Any, readers: Mapping[str, Reader]
) -> dict[str, Any]:
    """The values in the table `data` that stands at `keys`, each as its reader gives it."""
    name = ".".join(keys)
    if not isinstance(data, Mapping):
        source.refuse(keys, f"{name} must be a table of keys and values, got {show(data)}")
    for key in data:
        if key not in readers:
            source.refuse((*keys, key), f"unknown key {name}.{key}; {near(key, readers)}")
    return {key: read(source, (*keys, key), value, readers[key]) for key, value in data.items()}


def read(source: Source, keys: Keys, value: Any, reader: Reader) -> Any:
    """One value, which stands at `keys`."""
    try:
        return reader(value)
    except ValueError as error:
        source.refuse(keys, f"{'.'.join(keys)} {error}")
