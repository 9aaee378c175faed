"""The kinds of values in a study file, and the check of one table against the fields of a class."""

from __future__ import annotations

import dataclasses
import datetime
import math
import re
import typing
from collections.abc import Mapping, Sequence
from typing import Annotated, Any, NoReturn

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, ValidationError, create_model

from saltus.config.source import Keys, Source
from saltus.errors import ParameterError, near

ANGLE = re.compile(r"\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*(deg|rad|°)\s*")


def show(value: Any) -> str:
    """A TOML value as a sentence shows it."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        text = value if len(value) <= 40 else value[:37] + "..."
        return "the text " + '"' + text.encode("unicode_escape").decode("ascii") + '"'
    for kind, name in ((Mapping, "a table"), ((list, tuple), "a list"), ((datetime.date, datetime.time), "a date or a time")):
        if isinstance(value, kind):
            return name
    text = repr(value) if not isinstance(value, int) or abs(value) < 10**20 else "a very large number"
    return text if len(text) <= 40 else text[:37] + "..."


def read_number(value: Any) -> float:
    """A finite number as a float.

    Raises:
        ValueError: for anything else, with the predicate of a sentence.
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
    return number


def _unquoted(text: str) -> str:
    try:
        finite = math.isfinite(float(text))
    except ValueError:
        finite = False
    return f"; write it without quotes: {text.strip()}" if finite else ""


def read_angle(value: Any) -> float:
    """An angle in radians from "80 deg", "1.4 rad" or a number of radians.

    Raises:
        ValueError: for anything else, with the predicate of a sentence.
    """
    if not isinstance(value, str):
        return read_number(value)
    match = ANGLE.fullmatch(value)
    if match is None:
        raise ValueError(f'must be an angle such as "80 deg", "1.4 rad" or a number of radians without quotes, got {show(value)}')
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


Number = Annotated[float, BeforeValidator(read_number)]
Angle = Annotated[float, BeforeValidator(read_angle)]
Whole = Annotated[int, BeforeValidator(read_whole)]
Text = Annotated[str, BeforeValidator(read_text)]
Switch = Annotated[bool, BeforeValidator(read_switch)]
KINDS: dict[Any, Any] = {float: Number, int: Whole, str: Text, bool: Switch}


class Table(BaseModel):
    """The base of every table of a study: unknown keys are refused."""

    model_config = ConfigDict(extra="forbid", arbitrary_types_allowed=True, protected_namespaces=())


def table_of(cls: type, **more: Any) -> type[Table]:
    """The pydantic model of a table whose keys are the fields of the dataclass `cls`, and `more`."""
    hints = typing.get_type_hints(cls)
    fields: dict[str, Any] = {}
    for f in dataclasses.fields(cls):
        if not f.init or f.name.startswith("_"):
            continue
        kind = Angle if f.metadata.get("unit") == "rad" else _kind(hints.get(f.name, Any))
        required = f.default is dataclasses.MISSING and f.default_factory is dataclasses.MISSING
        fields[f.name] = (kind, ...) if required else (kind, Field(default=None, validate_default=False))
    return create_model(cls.__name__, __base__=Table, **{**fields, **more})


def _kind(hint: Any) -> Any:
    """The kind of value that a type hint stands for; X | None is an X that may be left out."""
    kinds = [arg for arg in typing.get_args(hint) if arg is not type(None)]
    return KINDS.get(kinds[0] if len(kinds) == 1 else hint, Any)


def check_table(source: Source, keys: Keys, data: Any, table: type[Table]) -> dict[str, Any]:
    """The values in the table `data` that stands at `keys`, each of its kind; keys left out are left out.

    Raises:
        ParameterError: what is wrong, with its place; an unknown key before a missing one, which it often explains.
    """
    name = ".".join(keys)
    if not isinstance(data, Mapping):
        source.refuse(keys, f"{name} must be a table of keys and values, got {show(data)}")
    try:
        checked = table.model_validate(dict(data))
    except ValidationError as failure:
        _refuse(source, keys, table, failure.errors(include_url=False))
    return {key: getattr(checked, key) for key in data}


def _refuse(source: Source, keys: Keys, table: type[Table], errors: Sequence[Any]) -> NoReturn:
    rank = {"extra_forbidden": 0, "missing": 2}
    error = min(errors, key=lambda e: rank.get(e["type"], 1))
    key = str(error["loc"][0])
    dotted = ".".join((*keys, key))
    if error["type"] == "extra_forbidden":
        source.refuse((*keys, key), f"unknown key {dotted}; {near(key, table.model_fields)}")
    if error["type"] == "missing":
        source.refuse(keys, f"{dotted} is missing; {table.__name__} needs it")
    source.refuse((*keys, key), f"{dotted} {error.get('ctx', {}).get('error', error['msg'])}")


def build(source: Source, keys: Keys, cls: type, values: dict[str, Any]) -> Any:
    """`cls(**values)`, with the refusals of the class itself at their place in the table at `keys`."""
    try:
        return cls(**values)
    except ParameterError as error:
        source.refuse_error(error.inside(".".join(keys)))
    except (ValueError, TypeError, ArithmeticError) as error:  # a class of the user's own may raise anything
        source.refuse(keys, f"{'.'.join(keys)}: {error}")
