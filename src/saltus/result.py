"""The base class of all results: a dataset, from which pictures, files and tables are made, and their facts in a notebook."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from enum import Enum
from typing import TYPE_CHECKING, Any

import numpy as np

from saltus.notebook import html_table
from saltus.provenance import provenance

if TYPE_CHECKING:
    import pandas
    import xarray

    from saltus.systems import System

MOST_ENTRIES = 6  # the most entries of an array that is shown in a table


class Result:
    """The result of a public function: `to_xarray` gives its dataset, which `saltus.plot` draws and `saltus.to_mat` writes."""

    def to_xarray(self) -> Any:
        """The result as a Dataset or a DataTree, whose attribute `kind` says which result it is."""
        raise NotImplementedError

    def to_pandas(self) -> pandas.DataFrame:
        """A table of the dataset, see `table_of`."""
        return table_of(self.to_xarray())

    def __repr__(self) -> str:
        return f"{type(self).__name__}({', '.join(f'{name}={value}' for name, value in self._facts().items())})"

    def _repr_html_(self) -> str:
        return html_table(type(self).__name__, self._facts())

    def _facts(self) -> dict[str, Any]:
        """The fields that are numbers, words or short arrays."""
        fields: dict[str, Any] = {field.name: getattr(self, field.name) for field in dataclasses.fields(self)}  # type: ignore[arg-type]
        return {
            name: value.tolist() if isinstance(value, np.ndarray) else value for name, value in fields.items() if _is_short(value)
        }


def result_dataset(
    kind: str, columns: Mapping[str, tuple[Any, ...]], coords: Any = None, system: System | None = None, **facts: Any
) -> xarray.Dataset:
    """A Dataset of a `kind` with its provenance; `columns` are dimensions, values, unit and name in words of each variable."""
    import xarray

    variables = {
        name: (dims, np.asarray(values), {"units": unit, "long_name": text})
        for name, (dims, values, unit, text) in columns.items()
    }
    known = {"title": f"{kind.replace('_', ' ')} computed by saltus", "kind": kind} | provenance(system, **facts)
    return xarray.Dataset(variables, coords, known | {"Conventions": "CF-1.8"})


def table_of(data: Any) -> pandas.DataFrame:
    """A table of a Dataset, or of the first part of a DataTree that is not empty.

    Its rows are the entries of the first dimension of the first variable that has any; a variable with a further dimension has a
    column for each of its entries, named `variable_entry`. A dataset of single values has one row.
    """
    import pandas

    if getattr(data, "children", None):
        data = next(node.to_dataset() for node in data.subtree if any(data_array.size for data_array in node.data_vars.values()))
    over = next((variable.dims[0] for variable in data.data_vars.values() if variable.dims), None)
    columns: dict[str, Any] = {}
    for name, variable in data.data_vars.items():
        if over is None and not variable.dims:
            columns[str(name)] = [variable.values[()]]
        elif variable.dims == (over,):
            columns[str(name)] = variable.values
        elif over in variable.dims and variable.ndim == 2:
            spread = variable.transpose(over, ...)
            entries = spread[spread.dims[1]].values.tolist()
            columns |= {f"{name}_{entry}": column for entry, column in zip(entries, spread.values.T, strict=True)}
    index = None if over is None else pandas.Index(data[over].values, name=str(over))
    return pandas.DataFrame(columns, index=index)


def _is_short(value: Any) -> bool:
    if isinstance(value, np.ndarray):
        return 0 < value.size <= MOST_ENTRIES
    return value is None or isinstance(value, (int, float, str, Enum))
