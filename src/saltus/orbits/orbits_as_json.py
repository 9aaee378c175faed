"""Orbits, special points and branches as what JSON has, and arrays, and back, bit for bit: for
other processes, and for stores.

A system is its JSON, equations are their signature, and a point is its place and tangent; the
equations are evaluated again at this place. The classes that may occur stand in the table
`CLASSES`: reading imports nothing and calls nothing else.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import fields
from enum import Enum
from typing import Any

import numpy as np

from saltus.continuation import CurveEnd, CurveMissed, End, Evidence, Missed
from saltus.errors import ParameterError
from saltus.orbits.beyond.orbit_curve import OrbitCurve, OrbitPoint
from saltus.orbits.beyond.special_point import OrbitEnd, OrbitMissed, SpecialKind, SpecialPoint
from saltus.orbits.branches.branch import Branch
from saltus.orbits.contract.equations import OrbitEquations, Solution
from saltus.orbits.equations.kinds import equations_of
from saltus.orbits.orbit import PeriodicOrbit
from saltus.orbits.signature import ModeChange, Signature
from saltus.systems import System

DAMAGED = "this is no record of orbits that this version of saltus knows; compute them again"


def as_json(found: Any) -> dict[str, Any]:
    """Orbits, special points or branches, alone or in lists, as a record: each object once, with
    its class and its parts.
    """
    objects: list[Any] = []
    # by the id of an object: its place, and the object, so that it stays there
    places: dict[int, tuple[int, Any]] = {}

    def written(value: Any) -> Any:
        if isinstance(value, (list, tuple)):
            return {
                "list" if isinstance(value, list) else "tuple": [written(each) for each in value]
            }
        if isinstance(value, Enum):
            return {"enum": [type(value).__name__, value.value]}
        if value is None or isinstance(value, (bool, int, float, str, np.ndarray, np.generic)):
            return value
        if id(value) not in places:
            cls = OrbitEquations if isinstance(value, OrbitEquations) else type(value)
            kind = next((name for name, (known, *_) in CLASSES.items() if known is cls), None)
            assert kind is not None, f"{cls} has no entry in CLASSES"
            parts = [written(part) for part in CLASSES[kind][1](value)]
            places[id(value)] = len(objects), value
            objects.append([kind, parts])
        return {"object": places[id(value)][0]}

    top = written(found)
    return {"objects": objects, "found": top}


def from_json(record: Any) -> Any:
    """The orbits, special points or branches of a record that `as_json` has written.

    Raises
    ------
    ParameterError
        The record is of anything else.
    """
    made: list[Any] = []

    def read(value: Any) -> Any:
        if not isinstance(value, dict):
            return value
        ((kind, content),) = value.items()
        if kind == "object":
            return made[content]
        if kind == "enum":
            return ENUMERATIONS[content[0]](content[1])
        return {"list": list, "tuple": tuple}[kind](read(each) for each in content)

    try:
        for kind, parts in record["objects"]:
            made.append(CLASSES[kind][2](*(read(part) for part in parts)))
        return read(record["found"])
    except (AttributeError, TypeError, ValueError, LookupError) as error:
        raise ParameterError(DAMAGED) from error


def _point(
    curve: OrbitCurve, place: np.ndarray, tangent: np.ndarray, iterations: int
) -> OrbitPoint:
    evaluation = curve.evaluate(place, thorough=True)
    if evaluation is None:
        raise ParameterError(DAMAGED)
    return OrbitPoint(curve, place, tangent, iterations, evaluation)


def _orbit(
    equations: OrbitEquations, unknowns: np.ndarray, values: np.ndarray, iterations: int
) -> PeriodicOrbit:
    evaluation = equations.evaluate(unknowns, values, with_extremes=True)
    if evaluation is None:
        raise ParameterError(DAMAGED)
    return PeriodicOrbit(
        equations, Solution(unknowns, values, evaluation, iterations, equations.units)
    )


def _orbit_parts(orbit: PeriodicOrbit) -> tuple[Any, ...]:
    return (
        orbit.equations,
        orbit.solution.unknowns,
        orbit.solution.values,
        orbit.solution.iterations,
    )


def _fields(found: Any) -> tuple[Any, ...]:
    return tuple(getattr(found, field.name) for field in fields(found))


# Each class with the parts of an object, and how it is made of these; properties that were computed
# and kept are not written.
CLASSES: dict[str, tuple[type, Callable[[Any], tuple[Any, ...]], Callable[..., Any]]] = {
    "System": (System, lambda system: (system.to_json(),), System.from_json),
    "Equations": (OrbitEquations, lambda e: (e.given, e.signature, e.paths, e.tol), equations_of),
    "OrbitPoint": (
        OrbitPoint,
        lambda point: (point.curve, point.place, point.tangent, point.iterations),
        _point,
    ),
    "PeriodicOrbit": (PeriodicOrbit, _orbit_parts, _orbit),
}
for _class in (
    *(Branch, SpecialPoint, OrbitCurve, Signature, ModeChange),
    *(End, Evidence, Missed),
):
    CLASSES[_class.__name__] = _class, _fields, _class
_KINDS: tuple[type[Enum], ...] = (SpecialKind, OrbitEnd, CurveEnd, OrbitMissed, CurveMissed)
ENUMERATIONS: dict[str, Callable[[Any], Any]] = {each.__name__: each for each in _KINDS}
