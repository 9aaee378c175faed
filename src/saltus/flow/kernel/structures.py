"""Systems ready to run: the compiled code of their structure, from the disk or made, and their numbers."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from saltus.checks import check_names
from saltus.flow.kernel.compiled import Structure, load_structure
from saltus.systems import System, numbers
from saltus.taylor import Trace, record_table, structure_key, trace


@dataclass(frozen=True)
class Program:
    """A system ready to run: its compiled kernel and its numbers."""

    trace: Trace
    structure: Structure
    env: tuple[Any, ...]  # parameters, constants, record breakpoints, record table
    model: Any  # the structure's functions and the geometry of its contact
    limits: tuple[str, ...]

    def with_numbers(self, parameters: np.ndarray, records: tuple[np.ndarray, np.ndarray]) -> Program:
        """The same with other numbers."""
        env, model = self.structure.prepare(parameters, records)
        return replace(self, env=env, model=model)


def program(system: System, limits: tuple[str, ...] = (), sensitivities: tuple[str, ...] | None = None) -> Program:
    """A system ready to run, with a tangent if asked for. Its structure is traced and compiled unless it is known; its numbers
    are only filled in."""
    key = (structure_key(system), limits, sensitivities)
    if key not in _structures:
        traced = trace(system, limits, sensitivities)
        _structures[key] = traced, load_structure(traced)
    traced, structure = _structures[key]
    parameters = np.array([value for _, value in numbers(system)])
    return Program(traced, structure, *structure.prepare(parameters, record_table(system, traced.records)), tuple(traced.margins))


_structures: dict[Any, tuple[Trace, Structure]] = {}


def limits_of(system: System, stop_at: Iterable[str]) -> tuple[str, ...]:
    """The margins that end a motion: the model's own stops and those asked for."""
    lifted = [friction.limit for friction in system.model.frictions]
    asked = check_names("stop_at", stop_at, "margins, such as ['kinematic_limit']")
    return tuple(dict.fromkeys((*system.model.stops, *lifted, *asked)))


def taylor_order(tol: float) -> int:
    """The order of series that is fastest at a tolerance: 10 at 1e-6, 15 at 1e-10, 20 at 1e-14."""
    return round(10 + 1.25 * (-math.log10(tol) - 6))
