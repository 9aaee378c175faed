"""The base class of all results: a dataset, from which pictures, files and tables are made.

Its attributes say where it comes from, and a notebook shows its facts.
"""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Iterator, Mapping
from enum import Enum
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from saltus.errors import ParameterError, near, shown
from saltus.files import parsed_json
from saltus.progress import html_table, rows_table
from saltus.systems import mode_sums

if TYPE_CHECKING:
    import pandas
    import xarray

    from saltus.systems import System

MOST_ENTRIES = 6  # the most entries of an array that is shown in a table


# Methods that other packages have, and the function of saltus for them.
FUNCTIONS = {
    **dict.fromkeys(("save", "to_netcdf", "write", "dump"), 'saltus.save("result.nc", {})'),
    **dict.fromkeys(("plot", "draw", "show"), "saltus.plot({})"),
    "to_mat": 'saltus.to_mat("result.mat", {})',
    "animate": 'saltus.animate({}, "film.mp4")',
}


def function_for(name: str, result: str) -> str:
    """The hint to the function that does what a missing method would; empty without one."""
    return f"; write {FUNCTIONS[name].format(result)}" if name in FUNCTIONS else ""


class Result:
    """The result of a public function: `to_xarray` gives its dataset, which `saltus.plot` draws and
    `saltus.to_mat` writes.
    """

    def to_xarray(self) -> Any:
        """The result as a Dataset or a DataTree, whose attribute `kind` says which result it is."""
        raise NotImplementedError

    def to_pandas(self) -> pandas.DataFrame:
        """A table of the result; `saltus.to_pandas` gives its other tables."""
        return table_of(self.to_xarray())

    def to_csv(self, path: str | Path) -> Path:
        """Write the table as comma-separated text, every number with all of its digits; returns the
        path.

        Parameters
        ----------
        path
            The path of the file.
        """
        return to_csv(path, self)

    if not TYPE_CHECKING:

        def __getattr__(self, name: str) -> Any:
            own = type(self).__name__
            raise AttributeError(f"a {own} has no {name!r}{function_for(name, own.lower())}")

    def __repr__(self) -> str:
        return f"{type(self).__name__}({', '.join(f'{name}={value}' for name, value in self._facts().items())})"

    def _repr_html_(self) -> str:
        return html_table(type(self).__name__, self._facts())

    def _facts(self) -> dict[str, Any]:
        """The fields that are numbers, words or short arrays."""
        fields: dict[str, Any] = {
            field.name: getattr(self, field.name)
            for field in dataclasses.fields(self)  # type: ignore[arg-type]
        }
        return {
            name: value.tolist() if isinstance(value, np.ndarray) else value
            for name, value in fields.items()
            if _is_short(value)
        }


def result_dataset(
    kind: str,
    columns: Mapping[str, tuple[Any, ...]],
    coords: Any = None,
    system: System | None = None,
    **facts: Any,
) -> xarray.Dataset:
    """A Dataset of a `kind` with its provenance; `columns` are dimensions, values, unit and name in
    words of each variable.
    """
    import xarray

    variables = {
        name: (dims, np.asarray(values), {"units": unit, "long_name": text})
        for name, (dims, values, unit, text) in columns.items()
    }
    known = {"title": f"{kind.replace('_', ' ')} computed by saltus", "kind": kind} | provenance(
        system, **facts
    )
    return xarray.Dataset(variables, coords, known | {"Conventions": "CF-1.8"})


# Results whose motions or cells lie on a grid, a row of the table being one of them, and the
# variable that is given over all of the grid; of those without a name it is the first one.
ON_GRIDS = {
    **dict.fromkeys(
        ("ensemble", "overturning_spectrum", "stability_chart", "phase_portrait", "fragility"), ""
    ),
    "basins": "label",
    "frequency_sweep": "amplitude",
    "attractors along a parameter": "",
}
MAPPED = "mapped"  # the kind of what `map_over` gives, whose grid has the names that the user chose
# of a tree, which its table shows unless another one is asked for
FIRST_PARTS = ("points", "chart", "cells")


def table_of(data: Any, table: str | None = None) -> pandas.DataFrame:
    """A table of a Dataset or a DataTree: long, a row for each thing of one kind, and never a
    product of unrelated dimensions.

    A Dataset has a table for each of its dimensions, and for each of its variables over all
    dimensions of it; the first is that of its first variable, or of the whole grid of an ensemble,
    with a column for each of its axes. A variable with one more dimension has a column for each of
    its entries, named `variable_entry`. A DataTree has the tables of its parts, `points` first if
    it has them. Single values have one row.
    """
    if getattr(data, "children", None):
        parts = {
            node.path.strip("/"): node.to_dataset(inherit=False)
            for node in data.subtree
            if node.data_vars
        }
        full = [
            name
            for name, part in parts.items()
            if any(variable.size for variable in part.data_vars.values())
        ]
        first = next(
            (name for name in (*FIRST_PARTS, *full) if name in full), next(iter(parts), "")
        )
        name, _, dim = (first if table is None else table).partition(".")
        if name not in parts:
            raise ParameterError(
                f"there is no table {shown(table)}; {near(str(table), parts)}", "table"
            )
        return table_of(parts[name], dim or None)
    over = _rows_of(data, table)
    return (
        _long_table(data, over) if len(over) > 1 else _wide_table(data, over[0] if over else None)
    )


def _rows_of(data: Any, table: str | None) -> tuple[str, ...]:
    """The dimensions whose entries are the rows of a table."""
    variables = {
        str(name): tuple(map(str, variable.dims))
        for name, variable in data.data_vars.items()
        if variable.dims
    }
    first = next(iter(variables.values()), ())
    kind = str(data.attrs.get("kind", ""))
    known = dict.fromkeys(dims[0] for dims in variables.values())
    if table in known:
        return (str(table),)
    if table is not None:
        if table not in variables:
            also = [*known, *(name for name, dims in variables.items() if len(dims) > 1)]
            raise ParameterError(
                f"there is no table {shown(table)}; {near(str(table), also)}", "table"
            )
        return variables[table]
    if kind == MAPPED:
        axes = tuple(dim for dim in first if dim in data.coords)
        return axes if any(len(dims) <= len(axes) + 1 for dims in variables.values()) else first
    return variables.get(ON_GRIDS[kind], first) if kind in ON_GRIDS else first[:1]


def _long_table(data: Any, over: tuple[str, ...]) -> pandas.DataFrame:
    """A row for each cell of a grid; variables with further dimensions, such as samples over time,
    are left out.

    Arrays that a function of the user's own gives at each point of its grid have a column for each
    of their entries.
    """
    import pandas

    shape = tuple(data.sizes[dim] for dim in over)
    places = np.indices(shape).reshape(len(over), -1)
    columns: dict[str, Any] = {
        dim: data[dim].values[at] for dim, at in zip(over, places, strict=True)
    }
    for name, variable in data.variables.items():
        further = [dim for dim in variable.dims if dim not in over]
        if name not in columns and not further:
            at = tuple(places[over.index(str(dim))] for dim in variable.dims)
            columns[str(name)] = (
                _in_words(variable)[at]
                if variable.dims
                else np.full(places.shape[1], variable.values)
            )
        elif (
            data.attrs.get("kind") == MAPPED
            and len(further) == 1
            and set(over) < set(variable.dims)
        ):
            entries = variable.transpose(*over, ...).values.reshape(places.shape[1], -1).T
            columns |= {f"{name}_{entry}": column for entry, column in enumerate(entries)}
    return pandas.DataFrame(columns)


def _wide_table(data: Any, over: str | None) -> pandas.DataFrame:
    """A row for each entry of a dimension, or one row of single values."""
    import pandas

    columns: dict[str, Any] = {}
    for name, variable in data.data_vars.items():
        if over is None and not variable.dims:
            columns[str(name)] = [variable.values[()]]
        elif variable.dims == (over,):
            columns[str(name)] = _in_words(variable)
        elif over in variable.dims and variable.ndim == 2:
            spread = variable.transpose(over, ...)
            entries = spread[spread.dims[1]].values.tolist()
            columns |= {
                f"{name}_{entry}": column
                for entry, column in zip(entries, spread.values.T, strict=True)
            }
    index = None if over is None else pandas.Index(data[over].values, name=str(over))
    return pandas.DataFrame(columns, index=index)


def _in_words(variable: Any) -> np.ndarray:
    """The values of a variable, numbers that stand for words as these."""
    words = str(variable.attrs.get("flag_meanings", "")).split()
    values = np.asarray(variable.values)
    numbers = variable.attrs.get("flag_values", range(len(words)))
    if (
        not words
        or "flag_masks" in variable.attrs
        or not values.size
        or list(numbers) != list(range(len(words)))
    ):
        return values
    return np.array(words)[values] if values.min() >= 0 and values.max() < len(words) else values


def to_pandas(result: Any, table: str | None = None) -> pandas.DataFrame:
    """A table of any result: long and tidy, with a row for each point, motion, cell or event.

    Parameters
    ----------
    result
        A result, such as a branch, or a Dataset or a DataTree that saltus has made, such as an
        ensemble or a diagram.
    table
        Which of its tables, by the name of a dimension, such as "special" of a branch or "jump" of
        a sweep. The name of a variable gives a row for each of its numbers, and the name of a part
        of a tree, such as "bands" of a diagram, its table. By default that of its points, of all
        motions of an ensemble, or of all cells of basins or of a grid of one's own.

    Raises
    ------
    ParameterError
        Something that is no result, or a table that it does not have; the error names those that it
        has.

    Examples
    --------
    >>> ends = saltus.simulate_many(system, theta=[0.1, 0.2], periods=2)
    >>> saltus.to_pandas(ends).start_theta.tolist()
    [0.1, 0.2]
    >>> saltus.to_pandas(branch, "special").kind.tolist()[:1]
    ['LP']
    """
    if hasattr(result, "to_pandas") and not hasattr(result, "data_vars"):
        made: pandas.DataFrame = (
            result.to_pandas() if table is None else table_of(result.to_xarray(), table)
        )
        return made
    if not (hasattr(result, "data_vars") and hasattr(result, "attrs")):
        raise ParameterError(
            f"result must be a Dataset, a DataTree or an object with to_pandas, got "
            f"{shown(result)}",
            "result",
        )
    return table_of(result, table)


def to_csv(path: str | Path, result: Any, table: str | None = None) -> Path:
    """Write a table of any result as comma-separated text, every number with all of its digits;
    returns the path. Rows have no numbers of their own; each column has a name.

    Parameters
    ----------
    path
        The path of the file, which is complete or not there.
    result, table
        As for `to_pandas`.

    Raises
    ------
    ParameterError
        As for `to_pandas`.

    Examples
    --------
    >>> saltus.to_csv("branch.csv", branch).read_text().split(",")[:2]
    ['point', 'parameter']
    """
    from saltus.files import write_text

    if not isinstance(path, (str, Path)):
        raise ParameterError(
            f"the path comes first, to_csv(path, result); got {shown(path)}", "path"
        )
    if not Path(path).name:
        raise ParameterError(
            f"path must name a file, such as branch.csv, got {shown(path)}", "path"
        )
    rows = to_pandas(result, table)
    is_named = any(name is not None for name in rows.index.names)
    return write_text(path, rows.to_csv(index=is_named, lineterminator="\n"))


class RowTable:
    """What has a table by itself: the events of a motion, the special points of a branch."""

    def _table(self) -> dict[str, Any]:
        """The columns, by their names."""
        raise NotImplementedError

    def to_pandas(self) -> pandas.DataFrame:
        """The table."""
        import pandas

        return pandas.DataFrame(self._table())

    if not TYPE_CHECKING:

        def __getattr__(self, name: str) -> Any:
            own = type(self).__name__
            raise AttributeError(f"{own} has no {name!r}{function_for(name, own.lower())}")

    def to_csv(self, path: str | Path) -> Path:
        """Write the table as comma-separated text; returns the path.

        Parameters
        ----------
        path
            The path of the file.
        """
        return to_csv(path, self)

    def _repr_html_(self) -> str:
        return rows_table(self._table())


def _is_short(value: Any) -> bool:
    if isinstance(value, np.ndarray):
        return 0 < value.size <= MOST_ENTRIES
    return value is None or isinstance(value, (int, float, str, Enum))


# Raised whenever the same request gives other numbers than before: results of another version are
# refused and not continued.
RESULT_VERSION = 15


def provenance(
    system: System | None = None, *, tol: float | None = None, seed: int | None = None, **more: Any
) -> dict[str, Any]:
    """The attributes `saltus_version`, `result_version`, `system` and `equations` (as JSON), `tol`
    and `seed`, as far as they are given, and further ones.

    The system's JSON has its numbers, and `equations` a digest of each part of its equations
    (`saltus.taylor.equations_of`). For a structure `modes` are sums of its modes, by which a reader
    notices that its own are others.
    """
    from saltus import __version__

    kept: dict[str, Any] = {"saltus_version": __version__, "result_version": RESULT_VERSION}
    if system is not None:
        kept |= {"system": system.to_json()} | identity(system)
        if modes := mode_sums(system.model):
            kept["modes"] = json.dumps(modes)
    return (
        kept
        | {name: value for name, value in (("tol", tol), ("seed", seed)) if value is not None}
        | more
    )


def identity(system: System) -> dict[str, Any]:
    """The attributes that `check_provenance` compares, `result_version` and `equations`, for parts
    that are computed elsewhere.

    Raises
    ------
    TraceError
        A model that cannot be traced.
    """
    from saltus.taylor import equations_of

    return {"result_version": RESULT_VERSION, "equations": json.dumps(equations_of(system))}


def check_provenance(
    attributes: Mapping[str, Any], system: System, what: str, remedy: str = "compute it again"
) -> None:
    """Refuse a result, `what`, whose attributes are not those of this system and of this version of
    saltus.

    Raises
    ------
    ParameterError
        The error names the version or the part of the equations that differs, and the `remedy`.
    """
    differ = "; ".join(_differences(attributes, system))
    if differ:
        raise ParameterError(f"{what} is not from the same computation: {differ}; {remedy}")


def _differences(attributes: Mapping[str, Any], system: System) -> Iterator[str]:
    version = attributes.get("result_version")
    name = type(system.model).__name__
    if version != RESULT_VERSION:
        by = (
            f"saltus {attributes['saltus_version']}"
            if "saltus_version" in attributes
            else "another saltus"
        )
        yield (
            f"it is by {by}, whose results are of version "
            f"{version if version is not None else 1}, and here of {RESULT_VERSION}"
        )
        return
    try:
        there = dict(parsed_json(attributes["equations"]))
    except (KeyError, TypeError, ValueError):
        yield f"it does not say of which equations of {name} it is"
        return
    here = json.loads(identity(system)["equations"])
    changed = [part for part in here if here[part] != there.get(part)]
    if changed:
        yield (
            f"the {' and the '.join(changed)} of {name} "
            f"{'has' if len(changed) == 1 else 'have'} changed since"
        )
    modes = mode_sums(system.model)
    if modes and "modes" in attributes and not _agree(attributes["modes"], modes):
        yield f"its amplitudes are of other modes of {name}"


def _agree(kept: Any, modes: list[float]) -> bool:
    """Whether the sums of the modes in a file are those of here, up to rounding."""
    try:
        there = np.array(json.loads(kept), dtype=float)
    except (TypeError, ValueError):
        return False
    here = np.array(modes)
    return there.shape == here.shape and bool(
        np.abs(there - here).max() <= SAME_MODES * np.abs(here).max()
    )


# Sums of the modes of a structure that differ by less, as a share of the largest, are the same:
# rounding moves modes of nearly equal frequencies.
SAME_MODES = 1e-6
