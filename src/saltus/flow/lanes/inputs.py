"""The arguments of an ensemble: states, times and parameters, broadcast together and checked before
anything runs.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from saltus.checks import LIMITS, ManyNumbers, check_memory
from saltus.errors import ParameterError, shown
from saltus.flow.lanes.ensemble_dataset import result_names, side_name
from saltus.flow.motion.motion import rate_name, state_names
from saltus.flow.motion.simulate import check_relays
from saltus.systems import (
    System,
    broadcast_arrays,
    check_parameters,
    finite_array,
    numbers,
    parameter_table,
    read_starts,
    substitute,
    units_of_gaps,
)

ARGUMENTS = (  # of `simulate_many`: a misspelt one arrives among the coordinates
    *(
        "velocity",
        "parameters",
        "periods",
        "duration",
        "tol",
        "time",
        "side",
        "relays",
        "stop_at",
        "sample",
        "last",
        "until",
    ),
    *("sensitivities", "threads", "progress"),
)


@dataclass(frozen=True)
class Inputs:
    """The starts and parameters of the trajectories: each a flat array, or one number for all of
    them.
    """

    dims: tuple[str, ...]
    shape: tuple[int, ...]
    # of the result: DataArrays or, along a dimension of the same name, arrays
    coords: dict[str, Any]
    # coordinates, velocities and the time by their names, parameters by their paths
    values: dict[str, np.ndarray]
    paths: tuple[str, ...]  # those of the parameters
    # the names of the relays whose sides are given, each among the values by its `side_name`
    given_relays: tuple[str, ...] = ()

    @property
    def size(self) -> int:
        """How many trajectories there are."""
        return math.prod(self.shape)

    @property
    def parameters(self) -> dict[str, np.ndarray]:
        """The parameters that were given, by path."""
        return {path: self.values[path] for path in self.paths}

    @property
    def relays(self) -> dict[str, np.ndarray]:
        """The sides of relays at the start that were given, +1 or -1, by the names of the relays."""
        return {name: self.values[side_name(name)] for name in self.given_relays}

    def with_numbers(self, system: System) -> Any:
        """A copy of a system in which the numbers of the parameters are arrays, for what is no
        simulation.
        """
        many = {path: array.view(ManyNumbers) for path, array in self.parameters.items()}
        return substitute(system, lambda path, value: many.get(path, value))

    def in_gaps(self, system: System) -> Inputs:
        """Those for `system.in_gap_coordinates`; the same object where that is the system
        itself.
        """
        if (inner := system.in_gap_coordinates) is system:
            return self
        twin = self.with_numbers(inner)
        own = len(system.model.coordinates)
        starts = list(self.values.values())[: 2 * own]
        rest = list(self.values.items())[2 * own :]
        units = units_of_gaps(system)
        sums = twin.model.gap_states(
            self.values["time"], starts[:own], starts[own:], twin.load, units
        )
        sums = tuple([np.asarray(sum_) for sum_ in part] for part in sums)
        called = state_names(twin.model.coordinates)
        return replace(
            self, values=dict(zip(called, [*sums[0], *sums[1]], strict=True)) | dict(rest)
        )


def read_inputs(
    system: System,
    velocity: Any,
    time: Any,
    parameters: Any,
    coordinates: Mapping[str, Any],
    relays: Mapping[str, Any] | None = None,
) -> Inputs:
    """Broadcast and check the arguments of an ensemble.

    Raises
    ------
    ParameterError
        Names are unknown to the system; values are no finite numbers, or refused by the system;
        shapes do not fit together; or a dimension or coordinate has the name of a result.
    """
    given = parameter_table(system, parameters)
    remembered = _sides(system, relays)
    arrays = {
        name: finite_array(name, value)
        for name, value in (
            _starts(system, velocity, time, coordinates) | remembered | given
        ).items()
    }
    dims, shape, coords, together = broadcast_arrays(arrays)
    check_parameters(system, broadcast_arrays({path: arrays[path] for path in given})[3])
    _check_names(system, dims, coords, arrays, given)
    size = math.prod(shape)
    check_memory(
        dims[0] if dims else "parameters", float(size) * LIMITS.motion, f"{size} motions at once"
    )
    return Inputs(dims, shape, coords, together, tuple(given), tuple(relays or ()))


def _sides(system: System, given: Any) -> dict[str, Any]:
    """The sides of relays at the start, +1 or -1, by their names in a dataset."""
    if given is None:
        return {}
    check_relays(system, given)
    found = {}
    for name, sides in given.items():
        numbers = np.asarray(sides)
        if numbers.dtype.kind not in "bif" or not np.isin(numbers, (-1, 0, 1)).all():
            raise ParameterError(
                f"the relay {name!r} must be given as True or False, or as an array of these, got"
                f" {shown(sides)}",
                "relays",
            )
        values = np.where(numbers > 0, 1.0, -1.0)
        found[side_name(name)] = sides.copy(data=values) if hasattr(sides, "dims") else values
    return found


def _starts(
    system: System, velocity: Any, time: Any, coordinates: Mapping[str, Any]
) -> dict[str, Any]:
    """The state and the time at the start, by name."""
    names = system.model.coordinates
    positions, speeds = read_starts(system, velocity, coordinates, ARGUMENTS)
    starts = dict(zip(names, positions, strict=True))
    starts |= {rate_name(name, names): speed for name, speed in zip(names, speeds, strict=True)}
    return starts | {"time": time}


def _check_names(
    system: System,
    dims: tuple[str, ...],
    coords: dict[str, Any],
    arrays: dict[str, Any],
    given: Iterable[str],
) -> None:
    """Refuse dimensions and coordinates with the name of a result, and coordinates that contradict
    the parameters.
    """
    relays = tuple(relay.name for relay in system.model.relays)
    results = result_names(system.model.coordinates, relays)
    for name in (*dims, *coords):
        if name in results:
            what = "dimension" if name in dims else "coordinate"
            free = name.removeprefix("start_")
            raise ParameterError(
                f"a {what} cannot be called {name!r}, which is the name of a result; call it "
                f"initial_{free}, for instance"
                + ("" if name in dims else f", or leave it out: .drop_vars({name!r})")
            )
    own = dict(numbers(system))
    for path in (path for path in own if path in coords):
        if not same(coords[path], arrays.get(path, own[path])):
            use = (
                "other values than parameters give"
                if path in given
                else f"other values than the system's {own[path]:g}"
            )
            raise ParameterError(
                f"the coordinate {path!r} has {use}; give them in parameters={{{path!r}: ...}}, "
                "or call the coordinate otherwise"
            )


def same(one: Any, other: Any) -> bool:
    """Whether two arrays or numbers are equal wherever they are, broadcast by name."""
    return bool(np.all(one == other))
