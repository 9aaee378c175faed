"""Orbits, special points and branches as bytes, and back, bit for bit: for other processes, and for stores.

The bytes hold a system as its JSON, a problem as its signature, and a point as its place and tangent; the equations are evaluated
again at this place. The reader makes only saltus's own data and arrays, and calls nothing else, so that bytes cannot run code.
"""

from __future__ import annotations

import io
import pickle
import zlib
from dataclasses import fields, is_dataclass
from enum import Enum
from typing import Any

import numpy as np

from saltus.errors import ParameterError
from saltus.orbits.branches.orbit_curve import OrbitCurve, OrbitPoint
from saltus.orbits.equations.contract import OrbitEquations, Solution
from saltus.orbits.orbit import PeriodicOrbit
from saltus.systems import System

ARRAYS = ("_frombuffer", "_reconstruct", "ndarray", "dtype", "scalar")  # the names of NumPy's own functions that make arrays
DAMAGED = "these bytes are of no orbits that this version of saltus knows; compute them again"


def as_bytes(found: Any) -> bytes:
    """Orbits, special points or branches, alone or in lists, as bytes."""
    buffer = io.BytesIO()
    _OrbitWriter(buffer, protocol=5).dump(found)
    return zlib.compress(buffer.getvalue())


def from_bytes(content: bytes) -> Any:
    """The orbits, special points or branches that `as_bytes` has written.

    Raises
    ------
    ParameterError
        The bytes are of anything else, or damaged.
    """
    try:
        return _OrbitReader(io.BytesIO(zlib.decompress(content))).load()
    except (pickle.UnpicklingError, zlib.error, EOFError, AttributeError, TypeError, ValueError, LookupError) as error:
        raise ParameterError(DAMAGED) from error


class _OrbitWriter(pickle.Pickler):
    def reducer_override(self, found: Any) -> Any:
        """The function and the arguments that make an object again; properties that it has computed and cached are not kept."""
        if isinstance(found, System):
            return _system, (found.to_json(),)
        if isinstance(found, OrbitEquations):
            return type(found), (found.system, found.signature, found.paths, found.tol)
        if type(found) is OrbitPoint:
            return _point, (found.curve, found.place, found.tangent, found.iterations)
        if type(found) is PeriodicOrbit:
            return _orbit, (found.equations, found.solution.unknowns, found.solution.values, found.solution.iterations)
        if isinstance(found, Enum):
            return type(found), (found.value,)
        if is_dataclass(found) and not isinstance(found, type):
            return type(found), tuple(getattr(found, field.name) for field in fields(found))
        return NotImplemented


class _OrbitReader(pickle.Unpickler):
    def find_class(self, module: str, name: str) -> Any:
        """Find the classes of saltus's data and of NumPy's arrays, and refuse all others."""
        if module == __name__ and name in MAKERS:
            return MAKERS[name]
        if module.split(".")[0] == "numpy" and name in ARRAYS:
            return super().find_class(module, name)
        found = super().find_class(module, name) if module.startswith("saltus.") else None
        if isinstance(found, type) and (is_dataclass(found) or issubclass(found, (Enum, OrbitEquations))):
            return found
        raise pickle.UnpicklingError(f"{module}.{name}")


def _system(text: str) -> System:
    return System.from_json(text)


def _point(curve: OrbitCurve, place: np.ndarray, tangent: np.ndarray, iterations: int) -> OrbitPoint:
    evaluation = curve.evaluate(place, thorough=True)
    if evaluation is None:
        raise ParameterError(DAMAGED)
    return OrbitPoint(curve, place, tangent, iterations, evaluation)


def _orbit(equations: OrbitEquations, unknowns: np.ndarray, values: np.ndarray, iterations: int) -> PeriodicOrbit:
    evaluation = equations.evaluate(unknowns, values, with_extremes=True)
    if evaluation is None:
        raise ParameterError(DAMAGED)
    return PeriodicOrbit(equations, Solution(unknowns, values, evaluation, iterations))


MAKERS = {function.__name__: function for function in (_system, _point, _orbit)}
