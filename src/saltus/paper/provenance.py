"""Datasets that say what they are: units on every variable, and what was computed, with which system, at which accuracy."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import xarray as xr

import saltus
from saltus.systems import System

TOLERANCE = 1e-12  # of every motion behind a figure


def dataset(
    variables: Mapping[str, tuple[Any, ...]],
    coords: Mapping[str, Any] | None = None,
    *,
    what: str,
    system: System | None = None,
    **attributes: Any,
) -> xr.Dataset:
    """A Dataset from `name: (dims, values, units, meaning)`, with its provenance in its attributes."""
    parts = {name: _variable(*parts) for name, parts in variables.items()}
    axes = {name: _variable(*parts) if isinstance(parts, tuple) else parts for name, parts in (coords or {}).items()}
    attrs = {"what": what, "saltus_version": saltus.__version__, **attributes}
    if system is not None:
        attrs["system"] = system.to_json()
    return xr.Dataset(parts, axes, attrs)


def _variable(dims: Any, values: Any, units: str = "1", meaning: str = "") -> xr.Variable:
    return xr.Variable(dims, values, {"units": units, **({"long_name": meaning} if meaning else {})})


def tree(groups: Mapping[str, xr.Dataset], *, what: str, **attributes: Any) -> xr.DataTree:
    """A DataTree of named datasets, such as the panels of a figure."""
    root = xr.Dataset(attrs={"what": what, "saltus_version": saltus.__version__, **attributes})
    return xr.DataTree.from_dict({"/": root, **dict(groups)})
