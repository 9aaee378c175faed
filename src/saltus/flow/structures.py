"""Systems ready to run: the compiled code of their structure, found or made, and their numbers."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np

from saltus.errors import ParameterError
from saltus.flow.compiled import Structure, load_structure
from saltus.systems import Model, Record, System, children, is_number, numbers
from saltus.taylor import Trace, record_table, trace


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
    """What a system's structure depends on: the types of its parts and whatever in them is not a number."""
    if isinstance(node, Record):  # its samples are numbers, and its scale; where they came from does not matter
        return Record, node.quantity
    parts = children(node)
    if parts:
        return type(node), tuple((name, structure_key(part)) for name, part in parts.items())
    if is_number(node):
        return float
    if isinstance(node, np.ndarray):
        return node.shape, node.dtype.str, node.tobytes()
    if type(node).__hash__ is None:
        raise ParameterError(f"a model cannot keep a {type(node).__name__}, got {node!r}; give it numbers, an array or a tuple")
    return node


def limits_of(system: System, stop_at: Iterable[str]) -> tuple[str, ...]:
    """The margins that end a motion: the model's own stops and those asked for."""
    try:
        return tuple(dict.fromkeys((*system.model.stops, *([stop_at] if isinstance(stop_at, str) else stop_at))))
    except TypeError:
        raise ParameterError(
            f"stop_at must be the names of margins, such as ['kinematic_limit'], got {stop_at!r}", "stop_at"
        ) from None


def taylor_order(tol: float) -> int:
    """The order that pays at a tolerance: 10 at 1e-6, 15 at 1e-10, 20 at 1e-14."""
    return round(10 + 1.25 * (-math.log10(tol) - 6))


def check_gap(model: Model) -> None:
    """Refuse a gap that is not linear in the coordinate, or not zero at `contact`: a model has one contact point."""
    point, name = float(model.contact), type(model).__name__
    for side in model.sides:
        at, below, above = (float(model.gap(point + x, side)) for x in (0.0, -1.0, 1.0))
        rounding = 1e-9 * (abs(below) + abs(above))
        if abs(at) > rounding:
            raise ParameterError(f"{name}.gap must be 0 at {name}.contact = {point:g}, got {at:g} on side {side}; give both")
        if abs(below + above) > rounding:
            raise ParameterError(f"{name}.gap must be linear in the coordinate: a model has one contact point, not two stops")
