"""The plan of a sweep: a function, its arguments, a grid, and its division into chunks."""

from __future__ import annotations

import hashlib
import json
import math
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from saltus.errors import ParameterError, near, shown
from saltus.sweep.chunks import MOST_CHUNKS, NAME, ChunkGrid, Index, resolve

DIGEST = re.compile(r"[0-9a-f]{20,}")  # messages say that a digest has changed, but do not show it
RESERVED = ("zarr.json", "plan")
# names the version that wrote a store; whether results are the same is told by `result_version`
WRITER = "saltus_version"


@dataclass(frozen=True, kw_only=True)
class Variable:
    """A variable of a sweep: its NumPy type (boolean, integer, real or complex), the (name, size)
    of its dimensions in addition to the grid's axes, and its attributes. Chunks that are not
    computed yet have its fill value.

    Parameters
    ----------
    dtype
        The name of its NumPy type.
    extra
        Its own dimensions after those of the axes, each with its length.
    attrs
        Its attributes, such as units and a long name.
    fill
        The value in chunks that are not computed; by default nan, or 0 or False for types that have
        no nan.

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
            raise ParameterError(
                f"dtype must be a NumPy type such as 'f8' or 'i2', got {self.dtype!r}", "dtype"
            ) from None
        if dtype.kind not in "biufc" or dtype.itemsize > (16 if dtype.kind == "c" else 8):
            raise ParameterError(
                "dtype must be boolean, integer, real or complex, of up to 64 bits a part, got "
                f"{self.dtype!r}",
                "dtype",
            )
        try:
            extra = tuple((str(name), int(size)) for name, size in self.extra)
        except (TypeError, ValueError, OverflowError):
            wanted = "pairs of a name and a size, such as (('mode', 3),)"
            raise ParameterError(
                f"extra must be {wanted}, got {shown(self.extra)}", "extra"
            ) from None
        for name, size in extra:
            _check_name(name, "a dimension")
            if size < 1:
                raise ParameterError(
                    f"dimension {name!r} must have a size of at least 1, got {size}"
                )
        fill = (
            self.fill
            if self.fill is not None
            else {"f": np.nan, "c": complex(np.nan, np.nan)}.get(dtype.kind, 0)
        )
        try:
            fill = dtype.type(fill).item()
        except (TypeError, ValueError, OverflowError):
            raise ParameterError(
                f"fill must be a value of type {dtype}, got {fill!r}", "fill"
            ) from None
        for name, value in (
            ("dtype", dtype.name),
            ("extra", extra),
            ("attrs", as_json(self.attrs, "attrs")),
            ("fill", fill),
        ):
            object.__setattr__(self, name, value)


@dataclass(frozen=True, kw_only=True, eq=False)
class Plan:
    """Independent computations on a grid, in chunks.

    The function is called as `function(arguments, block)`, where `block` holds the chunk's values
    of each axis, and returns a dict with an array for each variable: along the axes in their order,
    then along the variable's extra dimensions. It must depend on nothing else: a random generator
    takes its seed from the arguments and the block, so that a chunk is the same whichever process
    computes it, and when.

    Parameters
    ----------
    function
        "package.module:name", importable wherever it runs.
    arguments
        The arguments that are the same for all chunks: values that JSON has, given to the function
        as JSON gives them back.
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
        The function is unknown; a name, an axis or a chunk is wrong; a value is none that JSON has;
        or the grid has too many chunks.

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
        for name in ("axes", "variables", "arguments", "chunk", "attrs"):
            if not isinstance(getattr(self, name), Mapping):
                raise ParameterError(
                    f"{name} must be a dict, got {shown(getattr(self, name))}", name
                )
        axes = {name: axis_values(name, values) for name, values in self.axes.items()}
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
            raise ParameterError(
                "attrs must not have the key 'plan'; the plan itself is kept there", "attrs"
            )
        for name, value in values.items():
            object.__setattr__(self, name, value)
        if self.chunks.total > MOST_CHUNKS:
            raise ParameterError(
                f"chunk cuts the grid into {self.chunks.total} chunks; at most {MOST_CHUNKS} are "
                f"allowed",
                "chunk",
            )

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
        sizes = (
            self.chunks.sizes.values()
            if index is None
            else (s.stop - s.start for s in self.chunks.slices(index))
        )
        return (*sizes, *(size for _, size in self.variables[name].extra))

    @property
    def attributes(self) -> dict[str, Any]:
        """The attributes of the dataset: the plan's own, and the plan itself as a string of
        JSON.
        """
        return {**self.attrs, "plan": one_line(self.describe())}

    def describe(self) -> dict[str, Any]:
        """The plan as JSON: plans that are equal as JSON compute the same.

        Axes are identified by a digest of their values.
        """
        variables = {
            name: {
                "dtype": v.dtype,
                "extra": [list(e) for e in v.extra],
                "attrs": v.attrs,
                "fill": repr(v.fill),
            }
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
            f"{name!r} cannot be the name of {what}; a name is a letter, then letters, digits, "
            "'_', '-' and '.', not 'plan'"
        )


def axis_values(name: Any, values: Any) -> np.ndarray:
    """The values of an axis of a plan, which are refused unless they are finite numbers in a
    list.
    """
    _check_name(name, "an axis")
    array = np.array(values)
    if (
        array.ndim != 1
        or not array.size
        or array.dtype.kind not in "iuf"
        or np.ma.is_masked(values)
        or not np.isfinite(array).all()
    ):
        raise ParameterError(
            f"axis {name!r} must be a 1-D array of finite numbers, not empty, got {shown(values)}"
        )
    array.setflags(write=False)
    return array


def _chunk(chunk: Mapping[str, int], axes: Mapping[str, np.ndarray]) -> dict[str, int]:
    for name, size in chunk.items():
        if name not in axes:
            raise ParameterError(
                f"chunk names the axis {name!r}, which the plan does not have; {near(name, axes)}"
            )
        if isinstance(size, bool) or not isinstance(size, int | np.integer) or size < 1:
            raise ParameterError(
                f"chunk[{name!r}] must be a whole number of points of at least 1, got {size!r}"
            )
    return {
        name: min(int(chunk.get(name, len(values))), len(values)) for name, values in axes.items()
    }


def _variables(
    variables: Mapping[str, Variable], axes: Mapping[str, np.ndarray]
) -> dict[str, Variable]:
    if not variables:
        raise ParameterError("variables is empty; a plan needs at least one variable")
    sizes: dict[str, int] = {}
    for name, variable in variables.items():
        _check_name(name, "a variable")
        if not isinstance(variable, Variable):
            raise ParameterError(f"variables[{name!r}] must be a Variable, got {variable!r}")
        for dimension, size in variable.extra:
            if sizes.setdefault(dimension, size) != size:
                raise ParameterError(
                    f"dimension {dimension!r} has the sizes {sizes[dimension]} and {size}; give "
                    "it one"
                )
    for name in (*variables, *sizes):
        if name in axes or (name in variables and name in sizes):
            raise ParameterError(
                f"{name!r} names two things; an axis, a dimension and a variable need names of "
                "their own"
            )
    folders = [name.casefold() for name in (*axes, *variables)]
    if len(set(folders)) < len(folders):
        raise ParameterError(
            "two axes or variables have names that differ in their capitals alone; not all disks "
            "tell these apart"
        )
    repeated = [name for name, v in variables.items() if len(dict(v.extra)) < len(v.extra)]
    if repeated:
        raise ParameterError(f"variable {repeated[0]!r} has a dimension twice")
    return dict(variables)


def _digest(values: np.ndarray) -> dict[str, Any]:
    kept = np.ascontiguousarray(values.astype(values.dtype.newbyteorder("<")))
    ends = {"first": values[0].item(), "last": values[-1].item()}
    return {
        "size": len(values),
        "dtype": values.dtype.name,
        **ends,
        "sha256": hashlib.sha256(kept.tobytes()).hexdigest(),
    }


def _range(values: np.ndarray) -> str:
    return f"{values[0]:.6g}" if len(values) == 1 else f"{values[0]:.6g} to {values[-1]:.6g}"


# --- values that are kept as JSON --------------------------------------------


def as_json(value: Any, place: str) -> Any:
    """`value` as JSON gives it back: mappings to dicts, tuples to lists, NumPy's numbers to
    Python's.

    Raises
    ------
    ParameterError
        There is a value that JSON does not have; `place` and the keys below it say where.
    """
    if isinstance(value, np.generic):
        value = value.item()
    if value is None or isinstance(value, bool | str):
        return value
    if isinstance(value, int):
        return int(value)
    if isinstance(value, float):
        if not math.isfinite(value):
            raise ParameterError(
                f"{place} is {value!r}, which JSON does not have; write None or a word for it"
            )
        return float(value)
    if isinstance(value, list | tuple):
        return [as_json(item, f"{place}[{i}]") for i, item in enumerate(value)]
    if not isinstance(value, Mapping):
        kind = type(value).__name__
        raise ParameterError(
            f"{place} is of type {kind}, which JSON does not have; use numbers, strings, lists "
            f"and dicts"
        )
    for key in value:
        if not isinstance(key, str):
            raise ParameterError(f"{place} has the key {key!r}; keys are strings in JSON")
    return {key: as_json(item, f"{place}[{key!r}]") for key, item in value.items()}


def one_line(value: Any) -> str:
    """`value` as one line of JSON, the same for the same value."""
    return json.dumps(value, sort_keys=True, allow_nan=False)


def differences(there: Any, here: Any, place: str = "") -> Iterator[str]:
    """Sentences about the differences of two JSON values, entry by entry, also within strings that
    are JSON themselves.
    """
    there, here = _parsed(there), _parsed(here)
    if isinstance(there, dict) and isinstance(here, dict):
        for key in dict.fromkeys([*there, *here]):
            below = f"{place}.{key}" if place else key
            if key not in here:
                yield f"{below} is {shown(there[key])} there and not given here"
            elif key not in there:
                yield f"{below} is {shown(here[key])} here and not given there"
            else:
                yield from differences(there[key], here[key], below)
    elif there != here and _is_digest(there) and _is_digest(here):
        yield f"{place} has changed"
    elif there != here or isinstance(there, bool) != isinstance(here, bool):
        yield f"{place} is {shown(there)} there and {shown(here)} here"


def _is_digest(value: Any) -> bool:
    return isinstance(value, str) and DIGEST.fullmatch(value) is not None


def _parsed(value: Any) -> Any:
    if isinstance(value, str) and value.startswith("{"):
        try:
            return json.loads(value)
        except ValueError:
            return value
    return value
