"""The plan of a sweep: a function, its arguments, a grid, and its division into chunks."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from saltus.errors import ParameterError, near
from saltus.sweep.chunk_grid import MOST_CHUNKS, NAME, ChunkGrid, Index
from saltus.sweep.chunk_results import resolve
from saltus.sweep.jsonable import as_json, one_line

RESERVED = ("zarr.json", "plan")
WRITER = "saltus_version"  # names the version that wrote a store; whether results are the same is told by `result_version`


@dataclass(frozen=True, kw_only=True)
class Variable:
    """A variable of a sweep: its NumPy type (boolean, integer, real or complex), the (name, size) of its dimensions in addition
    to the grid's axes, its attributes, and the fill value of chunks that are not computed yet.

    Parameters
    ----------
    dtype
        The name of its NumPy type.
    extra
        Its own dimensions after those of the axes, each with its length.
    attrs
        Its attributes, such as units and a long name.
    fill
        The value in chunks that are not computed; by default nan, or 0 or False for types that have no nan.

    Examples
    --------
    >>> saltus.sweep.Variable(attrs={"units": "rad"}).dtype
    'float64'
    """

    dtype: str = "f8"
    extra: tuple[tuple[str, int], ...] = ()
    attrs: Mapping[str, Any] = field(default_factory=dict)
    fill: Any = None

    def __post_init__(self) -> None:
        try:
            dtype = np.dtype(self.dtype)
        except TypeError:
            raise ParameterError(f"dtype must be a NumPy type such as 'f8' or 'i2', got {self.dtype!r}", "dtype") from None
        if dtype.kind not in "biufc" or dtype.itemsize > (16 if dtype.kind == "c" else 8):
            raise ParameterError(
                f"dtype must be boolean, integer, real or complex, of up to 64 bits a part, got {self.dtype!r}", "dtype"
            )
        extra = tuple((str(name), int(size)) for name, size in self.extra)
        for name, size in extra:
            _check_name(name, "a dimension")
            if size < 1:
                raise ParameterError(f"dimension {name!r} must have a size of at least 1, got {size}")
        fill = self.fill if self.fill is not None else {"f": np.nan, "c": complex(np.nan, np.nan)}.get(dtype.kind, 0)
        try:
            fill = dtype.type(fill).item()
        except (TypeError, ValueError, OverflowError):
            raise ParameterError(f"fill must be a value of type {dtype}, got {fill!r}", "fill") from None
        for name, value in (("dtype", dtype.name), ("extra", extra), ("attrs", as_json(self.attrs, "attrs")), ("fill", fill)):
            object.__setattr__(self, name, value)


@dataclass(frozen=True, kw_only=True, eq=False)
class Plan:
    """Independent computations on a grid, in chunks.

    The function is called as `function(arguments, block)`, where `block` holds the chunk's values of each axis, and returns a
    dict with an array for each variable: along the axes in their order, then along the variable's extra dimensions. It must
    depend on nothing else: a random generator takes its seed from the arguments and the block, so that a chunk is the same
    whichever process computes it, and when.

    Parameters
    ----------
    function
        "package.module:name", importable wherever it runs.
    arguments
        The arguments that are the same for all chunks: values that JSON has, given to the function as JSON gives them back.
    axes
        1-D arrays of numbers by name, the grid's coordinates.
    chunk
        The number of points of a chunk along each axis; all points of an axis that is not named.
    variables
        A `Variable` by name for each array that the function returns.
    attrs
        Provenance, in values that JSON has: kind, system, version, seed, ...

    Raises
    ------
    ParameterError
        The function is unknown; a name, an axis or a chunk is wrong; a value is none that JSON has; or the grid has too many
        chunks.

    Examples
    --------
    >>> plan = saltus.sweep.Plan(
    ...     function="numpy:squeeze", axes={"x": np.arange(4.0)}, chunk={"x": 2}, variables={"y": saltus.sweep.Variable()}
    ... )
    >>> plan.axes["x"].size
    4
    """

    function: str
    axes: Mapping[str, np.ndarray]
    variables: Mapping[str, Variable]
    arguments: Mapping[str, Any] = field(default_factory=dict)
    chunk: Mapping[str, int] = field(default_factory=dict)
    attrs: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        resolve(self.function)
        axes = {name: _axis(name, values) for name, values in self.axes.items()}
        if not axes:
            raise ParameterError("axes is empty; a plan needs at least one axis")
        variables = _variables(self.variables, axes)
        values = {
            "arguments": as_json(self.arguments, "arguments"),
            "axes": axes,
            "chunk": _chunk(self.chunk, axes),
            "variables": variables,
            "attrs": as_json(self.attrs, "attrs"),
        }
        if "plan" in values["attrs"]:
            raise ParameterError("attrs must not have the key 'plan'; the plan itself is kept there", "attrs")
        for name, value in values.items():
            object.__setattr__(self, name, value)
        if self.chunks.total > MOST_CHUNKS:
            raise ParameterError(f"chunk cuts the grid into {self.chunks.total} chunks, and {MOST_CHUNKS} are the most", "chunk")

    @cached_property
    def chunks(self) -> ChunkGrid:
        """How the grid is cut."""
        return ChunkGrid({name: len(values) for name, values in self.axes.items()}, self.chunk)

    def block(self, index: Index) -> dict[str, np.ndarray]:
        """The values of each axis in a chunk.

        Parameters
        ----------
        index
            The chunk's place among the chunks, a number for each axis.
        """
        cuts = zip(self.axes.items(), self.chunks.slices(index), strict=True)
        return {name: values[cut].copy() for (name, values), cut in cuts}

    def place(self, index: Index) -> str:
        """Where in the grid a chunk is, in words.

        Parameters
        ----------
        index
            The chunk's place among the chunks, a number for each axis.
        """
        return ", ".join(f"{name} {_range(values)}" for name, values in self.block(index).items())

    def dimensions(self, name: str) -> tuple[str, ...]:
        """The dimensions of a variable: the axes, then its own.

        Parameters
        ----------
        name
            The variable's name.
        """
        return (*self.axes, *(extra for extra, _ in self.variables[name].extra))

    def shape(self, name: str, index: Index | None = None) -> tuple[int, ...]:
        """The shape of a variable, of all of it or in the chunk `index`.

        Parameters
        ----------
        name
            The variable's name.
        index
            The chunk's place among the chunks; None for the whole grid.
        """
        sizes = self.chunks.sizes.values() if index is None else (s.stop - s.start for s in self.chunks.slices(index))
        return (*sizes, *(size for _, size in self.variables[name].extra))

    @property
    def attributes(self) -> dict[str, Any]:
        """The attributes of the dataset: the plan's own, and the plan itself as a string of JSON."""
        return {**self.attrs, "plan": one_line(self.describe())}

    def describe(self) -> dict[str, Any]:
        """The plan as JSON: plans that are equal as JSON compute the same. Axes are identified by a digest of their values."""
        variables = {
            name: {"dtype": v.dtype, "extra": [list(e) for e in v.extra], "attrs": v.attrs, "fill": repr(v.fill)}
            for name, v in self.variables.items()
        }
        return {
            "function": self.function,
            "arguments": self.arguments,
            "order": list(self.axes),
            "axes": {name: _digest(values) for name, values in self.axes.items()},
            "chunk": self.chunk,
            "variables": variables,
            "attrs": {name: value for name, value in self.attrs.items() if name != WRITER},
        }


def _check_name(name: Any, what: str) -> None:
    if not isinstance(name, str) or not NAME.fullmatch(name) or name in RESERVED:
        raise ParameterError(
            f"{name!r} cannot be the name of {what}; a name is a letter, then letters, digits, '_', '-' and '.', not 'plan'"
        )


def _axis(name: Any, values: Any) -> np.ndarray:
    _check_name(name, "an axis")
    array = np.array(values)
    if array.ndim != 1 or not array.size or array.dtype.kind not in "iuf" or not np.isfinite(array).all():
        raise ParameterError(f"axis {name!r} must be a 1-D array of finite numbers, not empty, got {values!r:.80}")
    array.setflags(write=False)
    return array


def _chunk(chunk: Mapping[str, int], axes: Mapping[str, np.ndarray]) -> dict[str, int]:
    for name, size in chunk.items():
        if name not in axes:
            raise ParameterError(f"chunk names the axis {name!r}, which the plan does not have; {near(name, axes)}")
        if isinstance(size, bool) or not isinstance(size, int | np.integer) or size < 1:
            raise ParameterError(f"chunk[{name!r}] must be a whole number of points of at least 1, got {size!r}")
    return {name: min(int(chunk.get(name, len(values))), len(values)) for name, values in axes.items()}


def _variables(variables: Mapping[str, Variable], axes: Mapping[str, np.ndarray]) -> dict[str, Variable]:
    if not variables:
        raise ParameterError("variables is empty; a plan needs at least one variable")
    sizes: dict[str, int] = {}
    for name, variable in variables.items():
        _check_name(name, "a variable")
        if not isinstance(variable, Variable):
            raise ParameterError(f"variables[{name!r}] must be a Variable, got {variable!r}")
        for dimension, size in variable.extra:
            if sizes.setdefault(dimension, size) != size:
                raise ParameterError(f"dimension {dimension!r} has the sizes {sizes[dimension]} and {size}; give it one")
    for name in (*variables, *sizes):
        if name in axes or (name in variables and name in sizes):
            raise ParameterError(f"{name!r} names two things; an axis, a dimension and a variable need names of their own")
    folders = [name.casefold() for name in (*axes, *variables)]
    if len(set(folders)) < len(folders):
        raise ParameterError(
            "two axes or variables have names that differ in their capitals alone; not all disks tell these apart"
        )
    repeated = [name for name, v in variables.items() if len(dict(v.extra)) < len(v.extra)]
    if repeated:
        raise ParameterError(f"variable {repeated[0]!r} has a dimension twice")
    return dict(variables)


def _digest(values: np.ndarray) -> dict[str, Any]:
    kept = np.ascontiguousarray(values.astype(values.dtype.newbyteorder("<")))
    ends = {"first": values[0].item(), "last": values[-1].item()}
    return {"size": len(values), "dtype": values.dtype.name, **ends, "sha256": hashlib.sha256(kept.tobytes()).hexdigest()}


def _range(values: np.ndarray) -> str:
    return f"{values[0]:.6g}" if len(values) == 1 else f"{values[0]:.6g} to {values[-1]:.6g}"
