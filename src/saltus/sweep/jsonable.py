"""Values that are kept as JSON: the check before they are written, and their comparison when they are read."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from saltus.errors import ParameterError

QUOTED = 60  # the most characters of a value that a message shows
DIGEST = re.compile(r"[0-9a-f]{20,}")  # messages say that a digest has changed, but do not show it


def as_json(value: Any, place: str) -> Any:
    """`value` as JSON gives it back: mappings to dicts, tuples to lists, NumPy's numbers to Python's.

    Raises
    ------
    ParameterError
        There is a value that JSON does not have; `place` and the keys below it say where.
    """
    if isinstance(value, np.generic):
        value = value.item()
    if value is None or isinstance(value, bool | str):
        return value
    if isinstance(value, int):
        return int(value)
    if isinstance(value, float):
        if not math.isfinite(value):
            raise ParameterError(f"{place} is {value!r}, which JSON does not have; write None or a word for it")
        return float(value)
    if isinstance(value, list | tuple):
        return [as_json(item, f"{place}[{i}]") for i, item in enumerate(value)]
    if not isinstance(value, Mapping):
        kind = type(value).__name__
        raise ParameterError(f"{place} is of type {kind}, which JSON does not have; numbers, strings, lists and dicts can be")
    for key in value:
        if not isinstance(key, str):
            raise ParameterError(f"{place} has the key {key!r}; keys are strings in JSON")
    return {key: as_json(item, f"{place}[{key!r}]") for key, item in value.items()}


def one_line(value: Any) -> str:
    """`value` as one line of JSON, the same for the same value."""
    return json.dumps(value, sort_keys=True, allow_nan=False)


def differences(there: Any, here: Any, place: str = "") -> Iterator[str]:
    """Sentences about the differences of two JSON values, entry by entry, also within strings that are JSON themselves."""
    there, here = _parsed(there), _parsed(here)
    if isinstance(there, dict) and isinstance(here, dict):
        for key in dict.fromkeys([*there, *here]):
            below = f"{place}.{key}" if place else key
            if key not in here:
                yield f"{below} is {_short(there[key])} there and not given here"
            elif key not in there:
                yield f"{below} is {_short(here[key])} here and not given there"
            else:
                yield from differences(there[key], here[key], below)
    elif there != here and _is_digest(there) and _is_digest(here):
        yield f"{place} has changed"
    elif there != here or isinstance(there, bool) != isinstance(here, bool):
        yield f"{place} is {_short(there)} there and {_short(here)} here"


def _is_digest(value: Any) -> bool:
    return isinstance(value, str) and DIGEST.fullmatch(value) is not None


def _parsed(value: Any) -> Any:
    if isinstance(value, str) and value.startswith("{"):
        try:
            return json.loads(value)
        except ValueError:
            return value
    return value


def _short(value: Any) -> str:
    quoted = repr(value)
    return quoted if len(quoted) <= QUOTED else quoted[: QUOTED - 3] + "..."
