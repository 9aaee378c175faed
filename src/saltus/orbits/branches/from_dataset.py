"""Orbits from the dataset of a branch or of a curve, without loss: the dataset keeps all their unknowns and signatures."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from saltus.checks import check_dataset
from saltus.continuation import NEWTON
from saltus.errors import ParameterError
from saltus.orbits.equations.contract import OrbitEquations
from saltus.orbits.equations.kinds import equations_of
from saltus.orbits.orbit import PeriodicOrbit
from saltus.orbits.signature import ModeChange, Signature
from saltus.provenance import check_provenance
from saltus.public_functions import answered
from saltus.systems import System

if TYPE_CHECKING:
    import xarray

NEEDED = ("parameter", "unknowns")


@answered
def orbits_of(dataset: xarray.Dataset) -> list[PeriodicOrbit]:
    """The orbits along `point` of a dataset that `Branch.to_xarray` or `SpecialCurve.to_xarray` made, bit for bit, in order.

    The equations are evaluated at the kept unknowns, which must solve them. `continue_orbit` can go on from
    each of these orbits.

    Parameters
    ----------
    dataset
        The dataset that `to_xarray` of a branch or a curve gave.

    Raises
    ------
    ParameterError
        The dataset is of another kind, of other equations than the model has now, or of another version of saltus; its
        unknowns do not solve the equations; or the model is the user's own and not registered (`saltus.register`).

    Examples
    --------
    >>> again = saltus.orbits.orbits_of(branch.to_xarray())
    >>> again[0].amplitude == branch.orbits[0].amplitude
    True
    """
    check_dataset(dataset, "a branch or a curve of special points", NEEDED, ("system", "tol"))
    system, tol = System.from_json(dataset.attrs["system"]), float(dataset.attrs["tol"])
    check_provenance(dataset.attrs, system, "the dataset of these orbits")
    paths = tuple(map(str, dataset["path"].values)) if "path" in dataset.coords else (str(dataset.attrs["path"]),)
    values = np.atleast_2d(dataset["parameter"].values.T).T
    known: dict[Signature, OrbitEquations] = {}
    orbits = []
    for signature, row, value in zip(_signatures(dataset), dataset["unknowns"].values, values, strict=True):
        if signature not in known:
            known[signature] = equations_of(system, signature, paths, tol)
        orbits.append(_orbit(known[signature], row, value))
    return orbits


def _signatures(dataset: xarray.Dataset) -> list[Signature]:
    """The signature of each orbit."""
    columns = (dataset[name].values for name in ("sides", "period", "symmetric", "side"))
    signatures = [_signature(*row) for row in zip(*columns, strict=True)]
    changes = [
        tuple(ModeChange(bool(k), int(i), int(c)) for k, i, c in table.reshape(-1, 3) if k >= 0)
        for table in dataset["events"].values
    ]
    more = zip(signatures, changes, dataset["closed_contacts"].values, dataset["section"].values, strict=True)
    return [
        replace(signature, events=events, closed=int(closed), section=None if np.isnan(section) else float(section))
        for signature, events, closed, section in more
    ]


def _signature(sides: np.ndarray, periods: Any, symmetric: Any, side: Any) -> Signature:
    """The signature in one row of the dataset, where the sides are padded with 0."""
    return Signature(tuple(int(s) for s in sides if s), int(periods), bool(symmetric), int(side))


def _orbit(equations: OrbitEquations, row: np.ndarray, value: np.ndarray) -> PeriodicOrbit:
    values = value.astype(float)
    orbit = PeriodicOrbit.known(equations, row[: equations.size].copy(), values)
    scale = max(1.0, float(np.abs(row[: equations.size]).max()))
    if orbit is None or not orbit.residual <= max(NEWTON.stalled * scale, equations.residual_floor):
        error = "its motion cannot be followed" if orbit is None else f"its residual is {orbit.residual:.1e}"
        raise ParameterError(f"what is kept at {equations.paths[0]} = {values[0]:g} is no orbit ({error}): the data are damaged")
    return orbit
