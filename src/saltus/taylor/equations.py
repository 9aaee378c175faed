"""The identity of a system's equations: the key of its structure, under which traces and compiled code are kept in a process, and
a digest of each traced part, which results carry so that changed models are noticed.

The structure is everything except a system's numbers, which is all that its traced equations depend on.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from types import FunctionType
from typing import Any

import numpy as np

from saltus.errors import ParameterError, SaltusError
from saltus.systems import Record, System, children, is_number
from saltus.taylor.cache import digest
from saltus.taylor.graph import Expr
from saltus.taylor.memory import tape
from saltus.taylor.tracing import Trace, trace

MOST_KNOWN = 64  # the most systems whose digests are kept, as a study asks for the same ones many times


def equations_of(system: System) -> dict[str, str]:
    """A digest of each part of a system's equations, without its numbers, which are in `System.to_json`.

    The parts are `acceleration` (including the load's channels), `gap`, `contact` (its position), `reset` (including the impact
    law), `contacts` (of a model with several), `signs` (of its contacts), `margins`, `mirror` (the load of the mirror image) and
    `names` (of coordinates, units, channels, sides and stops). Values that a model's Python reads from elsewhere, such as
    constants of its module, are numbers in the expressions.

    Raises
    ------
    TraceError
        The model cannot be traced.
    """
    key = structure_key(system)
    with_numbers = key, system.to_json()
    if with_numbers not in _known:
        if key not in _digests:
            _digests[key] = _traced_parts(system)
        if len(_known) >= MOST_KNOWN:
            _known.clear()
        _known[with_numbers] = _digests[key] | _other_parts(system)
    return dict(_known[with_numbers])


_digests: dict[Any, dict[str, str]] = {}  # of structures, as their compiled code is kept
_known: dict[Any, dict[str, str]] = {}  # of systems with their numbers, on which the mirror image may depend


def _other_parts(system: System) -> dict[str, str]:
    """The digests of the parts that are not traced."""
    mirrored, model = system.mirrored(), system.model
    names = (model.coordinates, model.units, model.channels, model.sides, model.stops)
    return {"mirror": digest(repr(mirrored and mirrored.to_dict()["load"])), "names": digest(repr(names))}


def _traced_parts(system: System) -> dict[str, str]:
    """The digests of the traced parts."""
    traced = trace(system)
    roots: dict[str, list[Expr | None]] = {
        "acceleration": list(traced.acceleration),
        "gap": [traced.gap],
        "contact": [traced.contact],
        "reset": [traced.next_side, traced.velocity_after],
        "contacts": [*traced.reactions, *traced.contact_numbers],
    }
    texts = {name: _text(traced, [root for root in parts if root is not None]) for name, parts in roots.items()}
    texts |= {"margins": _margins(system), "signs": repr((traced.signs, traced.contact_coordinates, traced.friction_coordinates))}
    return {name: digest(text) for name, text in texts.items()}


def _margins(system: System) -> str:
    """The margins as text; if they cannot be traced, and so cannot end a motion, their names take the place of expressions."""
    names = system.model.margin_names(system.load)
    try:
        traced = trace(system, names)
    except SaltusError:
        return repr(names)
    return repr(names) + _text(traced, list(traced.margins.values()))


def _text(traced: Trace, roots: list[Expr]) -> str:
    """Expressions as text, in which parameters and records are given by their paths, not by their numbers in the trace."""
    paths: dict[str, list[Any]] = {"parameter": traced.parameters, "record": traced.records}
    written = tape(roots)
    nodes = [(node[0], paths[node[0]][node[1]]) if node[0] in paths else node for node in written.nodes]
    return repr((nodes, written.roots))


# --- the key of a structure -----------------------------------------------------------------------------------------------------


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
