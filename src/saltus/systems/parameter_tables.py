"""Tables of parameters: arrays or numbers by dotted path, broadcast together and checked before
anything runs.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from saltus.checks import LIMITS, check_memory
from saltus.errors import ParameterError, near, shown
from saltus.systems.serial import numbers
from saltus.systems.system import System

# Up to this number of rows of parameters, a system is made of each; of more, those with a least or
# largest value are checked, and as many more, evenly spaced.
MOST_CHECKED = 32


def parameter_table(system: System, parameters: Any) -> dict[str, Any]:
    """The parameters as given, by path; each path leads to a number of the system.

    Raises
    ------
    ParameterError
        No mapping, or a path that leads to no number.
    """
    if parameters is None:
        return {}
    if not isinstance(parameters, Mapping):
        raise ParameterError(
            "parameters must be arrays by dotted path, such as {'load.frequency': ...}, got"
            f" {parameters!r}",
            "parameters",
        )
    known = [path for path, _ in numbers(system)]
    for path in parameters:
        if path not in known:
            system.get(str(path))  # refuses a path that leads nowhere
            raise ParameterError(
                f"{path} is not a number, so it cannot be varied; {near(str(path), known)}",
                "parameters",
            )
    return dict(parameters)


def check_parameters(system: System, columns: Mapping[str, np.ndarray]) -> None:
    """Refuse values that the system refuses, row by row.

    Raises
    ------
    ParameterError
        Values that the system refuses, or orders of harmonics that are not whole.
    """
    for path, values in columns.items():
        if path.endswith(".order") and not np.equal(values, np.round(values)).all():
            raise ParameterError(f"{path} must be whole numbers", "parameters")
    if columns and all(a.size for a in columns.values()):
        rows, _ = distinct_rows(np.broadcast_arrays(*(np.atleast_1d(a) for a in columns.values())))
        for i in _chosen(rows):
            system.with_(dict(zip(columns, rows[i].tolist(), strict=True)))


def distinct_rows(columns: Sequence[np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    """The different rows of columns (n,) in rising order, (m, columns), and the place of each row
    among them, (n,).

    It does what `np.unique` does along an axis, which takes ten times as long.
    """
    order = np.lexsort(columns[::-1])
    rows = np.stack(columns, axis=1)[order]
    fresh = np.ones(len(rows), dtype=bool)
    place = np.empty(len(rows), dtype=int)
    fresh[1:] = (rows[1:] != rows[:-1]).any(axis=1)
    place[order] = np.cumsum(fresh) - 1
    return rows[fresh], place


def _chosen(rows: np.ndarray) -> Iterable[int]:
    """The rows to be checked: all, or if they are many, those with extreme values and some
    others.
    """
    if len(rows) <= MOST_CHECKED:
        return range(len(rows))
    even = np.linspace(0, len(rows) - 1, MOST_CHECKED).astype(int)
    return map(int, np.unique(np.concatenate([rows.argmin(axis=0), rows.argmax(axis=0), even])))


def finite_array(name: str, given: Any) -> Any:
    """A DataArray or an array of finite numbers."""
    import xarray

    if (size := getattr(given, "size", 0)) > LIMITS.count:
        raise ParameterError(
            f"{name} holds {size:.3g} numbers; at most {LIMITS.count} are allowed", name
        )
    try:
        if (
            np.iscomplexobj(given)
            or np.ma.is_masked(given)
            or getattr(given, "dtype", np.dtype(float)).kind in "mM"
        ):
            raise TypeError
        array = (
            given.astype(float)
            if isinstance(given, xarray.DataArray)
            else np.asarray(given, dtype=float)
        )
    except (TypeError, ValueError, OverflowError):
        raise ParameterError(
            f"{name} must be a number or an array of numbers, got {shown(given)}", name
        ) from None
    if not np.isfinite(array).all():
        raise ParameterError(f"{name} must be finite; it holds nan or inf", name)
    return array


def broadcast_arrays(
    arrays: dict[str, Any],
) -> tuple[tuple[str, ...], tuple[int, ...], dict[str, Any], dict[str, np.ndarray]]:
    """Arrays broadcast together: their dimensions, shape and coordinates, and each array in one
    row, or as one number.
    """
    import xarray

    named = {name: a for name, a in arrays.items() if isinstance(a, xarray.DataArray) and a.ndim}
    plain = {name: np.asarray(a) for name, a in arrays.items() if name not in named}
    many = [name for name, a in plain.items() if a.ndim]
    if named and many:
        raise ParameterError(
            f"{min(named)} has named dimensions and {many[0]} has not; give DataArrays or arrays,"
            " not both"
        )
    if named:
        _check_together(
            min(named),
            {dim: size for a in named.values() for dim, size in a.sizes.items()}.values(),
        )
        together = _aligned(named)
        dims, shape = next((tuple(str(d) for d in a.dims), a.shape) for a in together.values())
        flat = {name: a.values.reshape(-1) for name, a in together.items()} | plain
        return dims, shape, _coords(named, dims), {name: flat[name] for name in arrays}
    try:
        shape = np.broadcast_shapes(*(a.shape for a in plain.values()))
    except ValueError:
        shapes = ", ".join(f"{name} {plain[name].shape}" for name in many)
        raise ParameterError(
            f"the arrays do not broadcast together: {shapes}; for each with each, name their"
            f" dimensions: {many[0]}=xr.DataArray(values, dims={many[0]!r})",
            "parameters",
        ) from None
    _check_together(next(iter(many), "parameters"), shape)
    dims = ("trajectory",) if len(shape) == 1 else tuple(f"axis_{i}" for i in range(len(shape)))
    return (
        dims,
        shape,
        {},
        {name: np.broadcast_to(a, shape).reshape(-1) if a.ndim else a for name, a in plain.items()},
    )


def _check_together(name: str, lengths: Iterable[int]) -> None:
    """Refuse more motions than fit into memory before their arrays are made."""
    motions = math.prod(map(float, lengths))
    check_memory(name, motions * LIMITS.motion, f"{motions:.3g} motions")


def _aligned(named: dict[str, Any]) -> dict[str, Any]:
    """DataArrays over all of their dimensions, in one order."""
    import xarray

    try:
        together = xarray.broadcast(*xarray.align(*named.values(), join="exact"))
    except ValueError:
        raise ParameterError(
            f"the DataArrays ({', '.join(named)}) have dimensions of the same name with other"
            " lengths or coordinates; give such dimensions different names"
        ) from None
    return dict(zip(named, together, strict=True))


def _coords(named: dict[str, Any], dims: tuple[str, ...]) -> dict[str, Any]:
    """The coordinates of DataArrays; an array along a dimension of its own name is the dimension's
    coordinate.

    As in xarray's arithmetic, coordinates on which two arrays do not agree are left out.
    """
    coords: dict[str, Any] = {}
    unlike = set()
    for array in named.values():
        for name, values in array.coords.items():
            if name in dims and name not in array.dims:
                continue  # a scalar coordinate with the name of a dimension of the others
            if name in coords and not coords[name].variable.equals(values.variable):
                unlike.add(name)
            coords[str(name)] = values
    for name, array in named.items():
        if array.dims in ((name,), (f"initial_{name}",)):
            coords.setdefault(
                str(array.dims[0]), array.copy().assign_coords({array.dims[0]: array.values})
            )
    return {
        name: values.reset_coords(drop=True)
        for name, values in coords.items()
        if name not in unlike
    }


def check_path(system: System, path: Any, name: str = "path") -> None:
    """Refuse anything but the dotted path of a number of the system.

    Raises
    ------
    ParameterError
        The error is of the argument `name` and gives similar paths.
    """
    if isinstance(path, str) and path in system.parameters:
        return
    try:
        value = system.get(path)
    except ParameterError as error:
        raise ParameterError(str(error), name) from None
    if isinstance(value, (int, float)) and not isinstance(value, bool):
        raise ParameterError(
            f"{path} is a setting, along which nothing can be computed: take a system for each of "
            f"its values, with_({{{path!r}: ...}})",
            name,
        )
    raise ParameterError(f"{path} is not a number, so nothing can be computed along it", name)


def check_along(system: System, path: str, values: Iterable[float], name: str) -> None:
    """Refuse values of the parameter at `path` that the system does not allow.

    Raises
    ------
    ParameterError
        The error is of the argument `name` and has the system's refusal.
    """
    for value in values:
        try:
            system.with_({path: float(value)})
        except ParameterError as error:
            raise ParameterError(
                f"{name} reach beyond what the system allows: {error}", name
            ) from None
