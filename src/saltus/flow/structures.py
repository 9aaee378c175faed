"""Systems ready to run: the compiled code of their structure, found or made, and their numbers."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cache
from types import FunctionType
from typing import Any

import numpy as np

from saltus.checks import check_names
from saltus.errors import ParameterError
from saltus.flow.compiled import Structure, load_structure
from saltus.systems import Record, System, children, is_number, numbers
from saltus.taylor import Trace, record_table, trace

OFF_CONTACT = 1e-9  # of a gap at the contact, relative to its rate: far above rounding, far below what a model would mean


@dataclass(frozen=True)
class Program:
    """A system ready to run: its compiled kernel and its numbers."""

    trace: Trace
    structure: Structure
    env: tuple[Any, ...]  # parameters, constants, record breakpoints, record table
    model: tuple[Any, ...]  # the structure's functions and the geometry of its contact
    limits: tuple[str, ...]


def program(system: System, limits: tuple[str, ...] = (), sensitivities: tuple[str, ...] | None = None) -> Program:
    """A system ready to run, with a tangent if asked. Its structure is traced and compiled, or found; numbers are only read."""
    key = (structure_key(system), limits, sensitivities)
    if key not in _structures:
        traced = trace(system, limits, sensitivities)
        _structures[key] = traced, load_structure(traced)
    traced, structure = _structures[key]
    parameters = np.array([value for _, value in numbers(system)])
    return Program(traced, structure, *structure.prepare(parameters, record_table(system, traced.records)), tuple(traced.margins))


_structures: dict[Any, tuple[Trace, Structure]] = {}


def structure_key(node: Any) -> Any:
    """What a system's structure depends on: the types of its parts, what these read from their modules, and whatever in them is
    not a number."""
    if isinstance(node, Record):  # its samples are numbers, and its scale; where they came from does not matter
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
    """Where the numbers stand that the methods of a user's class read from its module or class: a trace holds their values."""
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


def limits_of(system: System, stop_at: Iterable[str]) -> tuple[str, ...]:
    """The margins that end a motion: the model's own stops and those asked for."""
    return tuple(dict.fromkeys((*system.model.stops, *check_names("stop_at", stop_at, "margins, such as ['kinematic_limit']"))))


def taylor_order(tol: float) -> int:
    """The order that pays at a tolerance: 10 at 1e-6, 15 at 1e-10, 20 at 1e-14."""
    return round(10 + 1.25 * (-math.log10(tol) - 6))


def check_contact(system: System) -> None:
    """Refuse a gap that is not 0 at `contact`, and a reset that sends the motion beyond the contact."""
    model, load, impact = system.model, system.load, system.impact
    point, name = float(model.contact), type(model).__name__
    rates = {side: float(model.gap(point + 1.0, side)) - float(model.gap(point, side)) for side in model.sides}
    for side, rate in rates.items():
        at = float(model.gap(point, side))
        if abs(at) > OFF_CONTACT * abs(rate):
            raise ParameterError(f"{name}.gap must be 0 at {name}.contact = {point:g}, got {at:g} on side {side}; give both")
        before = -math.copysign(1.0, rate)
        following, after = model.reset(0.0, before, side, load, impact)
        if rates.get(int(following), 0.0) * after < 0.0:
            raise ParameterError(
                f"{name}.reset sends the motion beyond the contact: on side {side} the velocity {before:g} becomes "
                f"{float(after):g} on side {int(following)}; velocities are rates of the coordinate, and "
                + ("a bounce turns the sign of what impact.velocity_after returns" if following == side else "a passage keeps it")
            )
