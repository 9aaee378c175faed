"""Dotted paths: the names by which the numbers of a system are read, changed, listed and replaced by symbols."""

from __future__ import annotations

import dataclasses
from collections import defaultdict
from collections.abc import Callable, Iterator, Mapping
from functools import cache
from typing import Any

from saltus.errors import ParameterError, near, shown
from saltus.systems.impact_laws import Factors
from saltus.systems.load import Load
from saltus.systems.signals import Constant, Sum, as_signal


def children(node: Any) -> dict[str, Any]:
    """The named parts of a part of a system: fields of a dataclass, channels of a load, terms of a sum, factors of a law."""
    if isinstance(node, Load):
        return {"frequency": node.frequency, **node.channels}
    if isinstance(node, (Sum, Factors)):
        return {str(i): term for i, term in enumerate(node.terms if isinstance(node, Sum) else node)}
    kind: Any = type(node)
    return {name: getattr(node, name) for name in _fields_of(kind)}


@cache
def _fields_of(kind: type) -> tuple[str, ...]:
    """The names of the fields of a dataclass; none of any other class."""
    return tuple(f.name for f in dataclasses.fields(kind)) if dataclasses.is_dataclass(kind) else ()


def is_number(value: Any) -> bool:
    """Whether a leaf is a number of the system; switches and names belong to its structure."""
    return isinstance(value, (int, float)) and not isinstance(value, bool)


def numbers(node: Any, prefix: str = "") -> Iterator[tuple[str, float]]:
    """Every number below `node` with its dotted path; a `Constant` is the path of its channel."""
    if isinstance(node, Constant):
        yield prefix, node.value
        return
    for name, child in children(node).items():
        path = f"{prefix}.{name}" if prefix else name
        if is_number(child):
            yield path, float(child)
        else:
            yield from numbers(child, path)


def replace(node: Any, changes: Mapping[str, Any], where: str = "") -> Any:
    """A copy of `node` with the parts at the given dotted paths replaced, all at once, so that their order does not matter.

    Where a part and something below it are both given, the part is replaced first. Numbers become constant signals where
    signals stand.

    Raises
    ------
    ParameterError
        A path that leads nowhere; the error names similar ones. A value that the new system refuses.
    """
    parts, below = children(node), defaultdict[str, dict[str, Any]](dict)
    for path, value in changes.items():
        head, _, rest = str(path).partition(".")
        if head not in parts and not (isinstance(node, Load) and head.isidentifier() and not rest):
            hint = f"{type(node).__name__} has no {shown(head)}; {near(head, children(node))}"
            raise ParameterError(f"no parameter {shown(where + str(path))}: {hint}", where + str(path))
        if rest:
            below[head][rest] = value
        else:
            parts[head] = value
    for head, deeper in below.items():
        parts[head] = replace(parts[head], deeper, f"{where}{head}.")
    if isinstance(node, Load):
        return Load(**parts)
    if isinstance(node, Sum):
        return Sum(tuple(as_signal(part, f"{where}{name}") for name, part in parts.items()))
    if isinstance(node, Factors):
        return Factors(parts.values())
    try:
        return dataclasses.replace(node, **parts)
    except ParameterError as error:
        raise (error.inside(where[:-1]) if where else error) from None


def substitute(node: Any, leaf: Callable[[str, float], Any], prefix: str = "") -> Any:
    """A copy of `node` with every number replaced by `leaf(path, number)`, made without checks: for tracing."""
    twin: Any
    if isinstance(node, Constant):
        twin = object.__new__(Constant)
        object.__setattr__(twin, "value", leaf(prefix, node.value))
        return twin
    parts = {}
    for name, child in children(node).items():
        path = f"{prefix}.{name}" if prefix else name
        parts[name] = leaf(path, float(child)) if is_number(child) else substitute(child, leaf, path)
    if isinstance(node, Load):
        twin = object.__new__(Load)
        object.__setattr__(twin, "frequency", parts.pop("frequency"))
        object.__setattr__(twin, "channels", parts)
        return twin
    if isinstance(node, Sum):
        twin = object.__new__(Sum)
        object.__setattr__(twin, "terms", tuple(parts.values()))
        return twin
    if isinstance(node, Factors):
        return Factors(parts.values())
    if not dataclasses.is_dataclass(node):
        return node
    twin = object.__new__(type(node))
    for name, part in parts.items():
        object.__setattr__(twin, name, part)
    return twin
