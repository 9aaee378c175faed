"""Datasets with units on every variable, and with attributes for what was computed, with which
system and accuracy.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import xarray as xr

import saltus
from saltus import System

TOLERANCE = 1e-12  # the tolerance of every motion that is shown in a figure


def provenance(system: System | None = None, **more: Any) -> dict[str, Any]:
    """The attributes of every dataset: the version of saltus, the system as JSON if there is one,
    and further ones.
    """
    return {
        "saltus_version": saltus.__version__,
        **({"system": system.to_json()} if system else {}),
        **more,
    }


def dataset(
    variables: Mapping[str, tuple[Any, ...]],
    coords: Mapping[str, Any] | None = None,
    *,
    what: str,
    system: System | None = None,
    **attributes: Any,
) -> xr.Dataset:
    """A Dataset from `name: (dims, values, units, meaning)`, with its provenance in its
    attributes.
    """
    parts = {name: _variable(*parts) for name, parts in variables.items()}
    axes = {
        name: _variable(*parts) if isinstance(parts, tuple) else parts
        for name, parts in (coords or {}).items()
    }
    return xr.Dataset(parts, axes, provenance(system, what=what, **attributes))


def _variable(dims: Any, values: Any, units: str = "1", meaning: str = "") -> xr.Variable:
    return xr.Variable(
        dims, values, {"units": units, **({"long_name": meaning} if meaning else {})}
    )


def scalar_dataset(values: Mapping[str, float], *, what: str, **attributes: Any) -> xr.Dataset:
    """A Dataset of single numbers without a unit, with its provenance."""
    return dataset({name: ((), value) for name, value in values.items()}, what=what, **attributes)


def largest_angle(ends: xr.Dataset) -> np.ndarray:
    """The largest abs(theta) of each motion of an ensemble, over all periods of which extrema were
    kept.
    """
    size = np.maximum(ends["largest_theta"].values, -ends["smallest_theta"].values)
    return np.asarray(size.reshape(len(size), -1).max(axis=1))


def scalars(data: Any) -> dict[str, float]:
    """The numbers in a group of a DataTree that contains only single numbers, by name."""
    return {name: float(value) for name, value in data.to_dataset().items()}


def tree(groups: Mapping[str, xr.Dataset], *, what: str, **attributes: Any) -> xr.DataTree:
    """A DataTree of named datasets, such as the panels of a figure."""
    return xr.DataTree.from_dict(
        {"/": xr.Dataset(attrs=provenance(what=what, **attributes)), **dict(groups)}
    )


def joined(panels: Mapping[str, xr.DataTree], *, what: str) -> xr.DataTree:
    """The trees of a figure's panels as one DataTree; every variable has units, and every group its
    provenance.
    """
    parts = {"/": xr.Dataset(attrs=provenance(what=what))}
    for name, panel in panels.items():
        for node in panel.subtree:
            data = node.to_dataset(inherit=False)
            data.attrs = provenance(what=node.name if node is not panel else what) | data.attrs
            for variable in data.variables.values():
                variable.attrs.setdefault("units", "1")
            parts[f"{name}/{node.relative_to(panel)}".removesuffix("/.")] = data
    return xr.DataTree.from_dict(parts)


def named(result: Any, title: str) -> Any:
    """A result with a title of its own, by which pages call it."""
    return (
        result.copy().assign_attrs(title=title)
        if isinstance(result, xr.Dataset)
        else _renamed(result, title)
    )


def _renamed(tree: xr.DataTree, title: str) -> xr.DataTree:
    copied = tree.copy()
    copied.attrs = {**tree.attrs, "title": title}
    return copied


def with_groups(tree: xr.DataTree, groups: Mapping[str, xr.Dataset]) -> xr.DataTree:
    """A tree with further datasets as its children."""
    return tree.assign({name: xr.DataTree(data) for name, data in groups.items()})
