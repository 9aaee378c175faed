"""The branches of a diagram as a few flat tables, and each branch as a dataset again.

A file with a group for each of hundreds of branches takes minutes to open. All branches are
therefore kept one after the other, as contiguous ragged arrays in the manner of the CF conventions:

* `branches`, along `branch`: the attributes of each branch, how many points and special points it
  has (`point_count`,
  `special_count`), and how many numbers each of its points has in `orbits` (`unknown_size`, ...);
* `points`, along `point`, and `special`, along `special`: a column for each quantity, and the
  number of the `branch`;
* `orbits`: the quantities with several numbers at each point, row after row.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from saltus.checks import check_count
from saltus.errors import ParameterError

if TYPE_CHECKING:
    import xarray

ROWS = ("point", "special")  # dimensions along which branches follow one another
TABLES = dict(zip(ROWS, ("points", "special"), strict=True))
# attributes that each branch has
SAID = ("ends", "end_reasons", "end_kinds", "origin", "closed", "missed", "unconfirmed")


def branch_tables(branches: Sequence[xarray.Dataset]) -> dict[str, xarray.Dataset]:
    """The tables of the branches of one system, each given as `Branch.to_xarray` gives it."""
    import xarray

    counts = {
        dim: np.array([branch.sizes.get(dim, 0) for branch in branches], dtype=int) for dim in ROWS
    }
    columns: dict[str, dict[str, Any]] = {
        table: {"branch": (dim, _numbers(counts[dim]))} for dim, table in TABLES.items()
    }
    said: dict[str, Any] = {
        f"{dim}_count": (
            "branch",
            counts[dim],
            {"sample_dimension": dim, "long_name": f"rows of a branch in `{table}`"},
        )
        for dim, table in TABLES.items()
    }
    wide: dict[str, Any] = {}
    for name in dict.fromkeys(str(name) for branch in branches for name in branch.variables):
        own = [branch.variables[name] for branch in branches if name in branch.variables]
        values = np.concatenate([variable.values.ravel() for variable in own])
        dims = tuple(map(str, own[0].dims))
        if len(dims) == 1:
            columns[TABLES[dims[0]]][name] = (dims[0], values, own[0].attrs)
            continue
        sizes = np.array([branch.sizes.get(dims[1], 0) for branch in branches], dtype=int)
        said[f"{dims[1]}_size"] = (
            "branch",
            sizes,
            {"long_name": "numbers of each point of a branch in `orbits`"},
        )
        wide[name] = (dims[1], values, own[0].attrs)
    for name in SAID:
        if branches and name in branches[0].attrs:
            listed = [branch.attrs[name] for branch in branches]
            said[name] = (("branch", "end")[: np.ndim(listed)], np.array(listed))
    common = {
        name: value
        for branch in branches[:1]
        for name, value in branch.attrs.items()
        if name not in SAID
    }
    tables = {"branches": said, **columns, "orbits": wide}
    return {
        name: xarray.Dataset(table, attrs=common if name == "branches" else {})
        for name, table in tables.items()
    }


def _numbers(counts: np.ndarray) -> np.ndarray:
    """The number of the branch of each row."""
    return np.repeat(np.arange(len(counts)), counts)


def branches_of(diagram: xarray.DataTree) -> Iterator[tuple[int, xarray.Dataset]]:
    """Every branch of a diagram in order, as its number and what `branch_of` gives for it.

    Parameters
    ----------
    diagram
        A diagram as `bifurcation_diagram` or `response_spectrum` returns it.

    Raises
    ------
    ParameterError
        A tree without branches.

    Examples
    --------
    >>> diagram = saltus.bifurcation_diagram(system, bounds=(0.45, 0.55), max_period=1, values=[0.5], starts=4, bands=False)
    >>> [(number, branch.sizes["point"] > 1) for number, branch in saltus.branches_of(diagram)]
    [(0, True)]
    """
    _check_tables(diagram)
    tables = _Tables(diagram)
    return ((number, tables.branch(number)) for number in range(tables.count))


def _check_tables(diagram: Any) -> None:
    missing = [
        name
        for name in ("branches", *TABLES.values(), "orbits")
        if name not in getattr(diagram, "children", ())
    ]
    if missing:
        raise ParameterError(
            "diagram must be the tree of a diagram, or of one panel; this one has no "
            f"{missing[0]!r}",
            "diagram",
        )


def branch_of(diagram: xarray.DataTree, number: int) -> xarray.Dataset:
    """The branch of this number of a diagram, as `Branch.to_xarray` gives it; `orbits_of` makes its
    orbits again.

    Parameters
    ----------
    diagram
        A diagram as `bifurcation_diagram` or `response_spectrum` returns it.
    number
        The number of the branch, from 0 on.

    Raises
    ------
    ParameterError
        A tree without branches, or with too few.

    Examples
    --------
    >>> diagram = saltus.bifurcation_diagram(system, bounds=(0.45, 0.55), max_period=1, values=[0.5], starts=4, bands=False)
    >>> saltus.branch_of(diagram, 0).parameter.values[[0, -1]]
    array([0.45, 0.55])
    """

    _check_tables(diagram)
    tables = _Tables(diagram)
    check_count("number", number, 0, tables.count - 1)
    return tables.branch(number)


class _Tables:
    """The tables of a diagram, and where each branch begins in them."""

    def __init__(self, diagram: Any) -> None:
        self.said, *tables = (
            diagram[name].to_dataset() for name in ("branches", "points", "special", "orbits")
        )
        self.columns = {
            name: column
            for table in tables
            for name, column in table.variables.items()
            if name != "branch"
        }
        self.sizes = {dim: self.said[f"{dim}_count"].values for dim in ROWS}
        for dim in {column.dims[0] for column in tables[-1].variables.values()}:
            self.sizes[dim] = self.sizes["point"] * self.said[f"{dim}_size"].values
        self.starts = {dim: np.cumsum(sizes) - sizes for dim, sizes in self.sizes.items()}
        self.count = self.said.sizes.get("branch", 0)

    def branch(self, number: int) -> xarray.Dataset:
        """The branch of this number."""
        import xarray

        points = int(self.sizes["point"][number])
        variables = {}
        for name, column in self.columns.items():
            (dim,) = column.dims
            first = int(self.starts[dim][number])
            size = int(self.sizes[dim][number])
            values = column.values[first : first + size]
            if dim in ROWS:
                variables[name] = xarray.Variable(dim, values, column.attrs, fastpath=True)
            elif size:
                variables[name] = xarray.Variable(
                    ("point", dim), values.reshape(points, -1), column.attrs, fastpath=True
                )
        said = {name: self.said[name].values[number].tolist() for name in SAID if name in self.said}
        return xarray.Dataset(variables, attrs={**self.said.attrs, **said})
