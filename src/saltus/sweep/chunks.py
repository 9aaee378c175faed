"""The chunks of a computation: how a grid is cut into them, what computes one, its errors, and the
check of its result.
"""

from __future__ import annotations

import copy
import importlib
import itertools
import math
import re
import traceback
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from saltus.errors import ParameterError, near

if TYPE_CHECKING:
    from saltus.sweep.plan import Plan

Index = tuple[int, ...]  # the place of a chunk along each axis
# the name of an axis, a dimension or a variable, which is a folder's name in a store
NAME = re.compile(r"[A-Za-z][\w.\-]*")
Arrays = dict[str, np.ndarray]
# the most chunks of a grid: each is a file, and all of them are looked for when a sweep begins
MOST_CHUNKS = 1_000_000


@dataclass(frozen=True)
class ChunkGrid:
    """A grid of `sizes` points along its axes, cut into chunks of `chunk` points along each; those
    at the ends may be smaller.
    """

    sizes: Mapping[str, int]
    chunk: Mapping[str, int]

    @property
    def grid(self) -> tuple[int, ...]:
        """The number of chunks along each axis."""
        return tuple(-(-size // self.chunk[axis]) for axis, size in self.sizes.items())

    @property
    def total(self) -> int:
        """The number of chunks."""
        return math.prod(self.grid)

    def indices(self) -> Iterator[Index]:
        """All chunks, the last axis fastest."""
        return itertools.product(*(range(n) for n in self.grid))

    def slices(self, index: Index) -> tuple[slice, ...]:
        """The points of a chunk along each axis."""
        cuts = zip(index, self.sizes.items(), strict=True)
        return tuple(
            slice(i * self.chunk[axis], min((i + 1) * self.chunk[axis], size))
            for i, (axis, size) in cuts
        )


class Computation(Protocol):
    """What processes and clusters compute: a function, its arguments, and chunks of what it is
    called with.
    """

    @property
    def function(self) -> str:
        """ "package.module:name", importable wherever it runs."""

    @property
    def arguments(self) -> Mapping[str, Any]:
        """The arguments that are the same for all chunks."""

    def block(self, index: Index, /) -> Any:
        """What belongs to one chunk."""


@dataclass(frozen=True)
class Failure:
    """A chunk that failed, with its place in the grid, its last error, and the number of attempts.

    Attributes
    ----------
    index
        The chunk's place among the chunks, a number for each axis.
    place
        Where in the grid it is, in words.
    error
        The last error.
    attempts
        How often it was tried.

    Examples
    --------
    >>> import dataclasses
    >>> [field.name for field in dataclasses.fields(saltus.sweep.Failure)]
    ['index', 'place', 'error', 'attempts']
    """

    index: Index
    place: str
    error: str
    attempts: int

    def __str__(self) -> str:
        return f"chunk {'/'.join(map(str, self.index))} ({self.place}): {self.error}"


@dataclass(frozen=True)
class Raised:
    """The error that a function raised, as strings, because not every error can be sent between
    processes.
    """

    error: str
    traceback: str = ""


def resolve(function: str) -> Callable[[Any, Any], Mapping[str, Any]]:
    """The function that `function`, "package.module:name", names.

    Raises
    ------
    ParameterError
        It is not of this form, there is no such module or name, or it is not a function.
    """
    module, colon, name = function.partition(":") if isinstance(function, str) else ("", "", "")
    if not (module and colon and name):
        raise ParameterError(
            f"function must be 'package.module:name', got {function!r}", "function"
        )
    if module == "__main__":
        raise ParameterError(
            f"function {function!r} is in a script; other processes need it in a module that "
            "they can import"
        )
    try:
        found = importlib.import_module(module)
    except ImportError as error:
        raise ParameterError(
            f"function {function!r}: the module {module!r} cannot be imported ({error})"
        ) from error
    if not hasattr(found, name):
        raise ParameterError(
            f"function {function!r}: {module!r} has no {name!r}; {near(name, vars(found))}"
        )
    computes: Callable[[Any, Any], Mapping[str, Any]] = getattr(found, name)
    if not callable(computes):
        raise ParameterError(
            f"function {function!r} is of type {type(computes).__name__}, not a function"
        )
    return computes


def attempt(function: str, arguments: Mapping[str, Any], block: Any) -> Any:
    """The result of the function for a chunk, or the error that it raised.

    Called in the process that computes.
    """
    try:
        # A function that changes its arguments must not change those of the next chunk.
        return resolve(function)(copy.deepcopy(arguments), block)
    except Exception as error:
        return Raised(
            f"{type(error).__name__}: {' '.join(str(error).split())}", traceback.format_exc()
        )


def checked(plan: Plan, index: Index, result: Any) -> Arrays:
    """The arrays that a function returned for a chunk, of the types of the plan's variables; NaN is
    a value as any other.

    Raises
    ------
    ParameterError
        The result is no mapping, has a variable too few or too many, a wrong shape, or values that
        a variable's type cannot hold.
    """
    where = f"{plan.function} returned for chunk {'/'.join(map(str, index))} ({plan.place(index)})"
    if not isinstance(result, Mapping):
        raise ParameterError(f"{where} a {type(result).__name__}; a dict of arrays is expected")
    for name in plan.variables:
        if name not in result:
            raise ParameterError(f"{where} no {name!r}; {near(name, map(str, result))}")
    for name in result:
        if name not in plan.variables:
            raise ParameterError(
                f"{where} {name!r}, which is not a variable of the plan; "
                f"{near(str(name), plan.variables)}"
            )
    return {name: _array(plan, index, name, result[name], where) for name in plan.variables}


def _array(plan: Plan, index: Index, name: str, values: Any, where: str) -> np.ndarray:
    array = np.asarray(values)
    expected = plan.shape(name, index)
    if array.shape != expected:
        axes = ", ".join(plan.dimensions(name))
        raise ParameterError(
            f"{where} {name!r} of shape {array.shape}; {expected} is expected, along {axes}"
        )
    dtype = np.dtype(plan.variables[name].dtype)
    if not np.can_cast(array.dtype, dtype, "same_kind"):
        raise ParameterError(
            f"{where} {name!r} of type {array.dtype}; the plan says {dtype}, which does not hold it"
        )
    cast = array.astype(dtype)
    if dtype.kind in "iu" and not np.array_equal(cast, array):
        raise ParameterError(
            f"{where} {name!r} with values from {array.min()} to {array.max()}, too large for "
            f"{dtype}"
        )
    return cast
