"""The structure of a system: everything except its numbers, which is all that its traced equations depend on."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from types import FunctionType
from typing import Any

import numpy as np

from saltus.errors import ParameterError
from saltus.systems import Record, children, is_number


def structure_key(node: Any) -> Any:
    """A key of a system's structure, under which traces are kept: the types of its parts, the values that these read from their
    modules, and all of their fields that are no numbers."""
    if isinstance(node, Record):  # its samples and its scale are numbers; the file that they came from does not matter
        return Record, node.quantity
    parts = children(node)
    if parts:
        owner: Any = type(node)
        outside = tuple(space.get(name) for space, name in _outside(owner))
        return owner, outside, tuple((name, structure_key(part)) for name, part in parts.items())
    if is_number(node):
        return float
    if isinstance(node, np.ndarray):
        return node.shape, node.dtype.str, node.tobytes()
    if type(node).__hash__ is None:
        raise ParameterError(f"a model cannot keep a {type(node).__name__}, got {node!r}; give it numbers, an array or a tuple")
    return node


@cache
def _outside(cls: type) -> tuple[tuple[Mapping[str, Any], str], ...]:
    """The names and namespaces of values that the methods of a user's class read from its module or class; a trace contains these
    values."""
    found: dict[tuple[int, str], tuple[Mapping[str, Any], str]] = {}
    owners = [owner for owner in cls.__mro__ if owner.__module__.partition(".")[0] not in ("saltus", "builtins")]
    waiting = [value for owner in owners for value in vars(owner).values()]
    seen: set[int] = set()
    for owner in owners:
        found |= {(id(owner), name): (vars(owner), name) for name, value in vars(owner).items() if is_number(value)}
    while waiting:
        function = getattr(waiting[-1], "fget", None) or getattr(waiting[-1], "__func__", waiting[-1])
        waiting.pop()
        if not isinstance(function, FunctionType) or id(function) in seen:
            continue
        seen.add(id(function))
        space = function.__globals__
        named = [name for name in function.__code__.co_names if name in space]
        found |= {(id(space), name): (space, name) for name in named if is_number(space[name])}
        waiting += [space[name] for name in named]  # functions that it calls
    return tuple(found.values())
