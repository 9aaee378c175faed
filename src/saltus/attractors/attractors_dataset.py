"""Attractors as an xarray Dataset, with units and provenance."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

import numpy as np

from saltus.attractors.stroboscopic_section import is_constant
from saltus.provenance import provenance

if TYPE_CHECKING:
    import xarray

    from saltus.attractors.attractor import Attractor, Attractors
    from saltus.systems import System

MOST_STATES = 64  # states at phase 0 that are written of each attractor


def attractors_dataset(found: Attractors) -> xarray.Dataset:
    """The table of the attractors, with their states at phase 0 and the initial states with the labels where they end."""
    import xarray

    name, unit = coordinate(found.system)
    table = attractor_table(found.members, found.system)
    table |= {
        f"start_{name}": variable("start", found.states[:, 0], unit, f"{name} at the start"),
        "start_velocity": variable("start", found.states[:, 1], unit, "velocity at the start"),
        "end": variable("start", found.assigned, "1", "attractor on which it ends, -1 for undecided"),
    }
    attributes = about(
        found.system,
        "attractors",
        tol=found.tol,
        seed=found.seed,
        window=np.ravel(found.window).tolist(),
        undecided=found.undecided,
        reasons=list(found.reasons),
    )
    return xarray.Dataset(table, {"attractor": labels(found.members)}, attributes)


def variable(dims: str | tuple[str, ...], values: Any, unit: str, text: str) -> Any:
    """A variable with its unit and its name in words, as xarray takes it."""
    return dims, values, {"units": unit, "long_name": text}


def about(system: System, kind: str, **numbers: Any) -> dict[str, Any]:
    """The attributes of a dataset: what it holds, the kind of load, and where it comes from."""
    load = "constant" if is_constant(system.load) else "periodic"
    attributes = {"title": f"{kind} computed by saltus", "kind": kind, "load": load, "Conventions": "CF-1.8"}
    return attributes | provenance(system, **numbers)


def coordinate(system: System) -> tuple[str, str]:
    """The coordinate's name and unit; times are dimensionless, so that its velocity has the same unit."""
    name = system.model.coordinates[0]
    return name, system.model.unit_of(name)


def labels(members: Iterable[Attractor]) -> Any:
    """The coordinate `attractor`."""
    return "attractor", np.array([member.label for member in members], dtype=int), {"long_name": "label; 0 is rest"}


def attractor_columns(system: System) -> dict[str, tuple[str, str, str]]:
    """The numbers that a table holds of each attractor: by their names in it the property of `Attractor`, unit and text."""
    name, unit = coordinate(system)
    return {
        "fraction": ("fraction", "1", "share of the initial states that end there"),
        "error": ("error", "1", "binomial standard error of the share"),
        "amplitude": ("amplitude", unit, f"max abs({name})"),
        f"largest_{name}": ("highest", unit, f"the largest {name}"),
        f"smallest_{name}": ("lowest", unit, f"the smallest {name}"),
        "period": ("period", "1", "forcing periods after which it repeats, 0 where it does not"),
    }


def attractor_table(members: tuple[Attractor, ...], system: System) -> dict[str, Any]:
    """Variables over (attractor,) and, of the states at phase 0, over (attractor, state)."""
    name, unit = coordinate(system)
    states = np.full((len(members), max([1, *(min(len(m.states), MOST_STATES) for m in members)]), 2), np.nan)
    for row, member in zip(states, members, strict=True):
        row[: len(member.states)] = member.states[:MOST_STATES]
    columns: dict[str, Any] = {}
    for key, (part, units, text) in attractor_columns(system).items():
        values = np.array([getattr(member, part) for member in members], dtype=int if key == "period" else float)
        columns[{"error": "fraction_error", "period": "attractor_period"}.get(key, key)] = variable(
            "attractor", values, units, text
        )
    more = {
        "attractor_kind": (np.array([str(m.kind) for m in members], dtype=str), "rest, periodic, quasi-periodic or chaotic"),
        "multiplier": (np.array([_multiplier(m) for m in members], dtype=float), "largest modulus of its multipliers"),
        "mirror": (np.array([m.mirror for m in members], dtype=int), "label of its mirror image"),
        "evidence": (np.array([m.evidence for m in members], dtype=str), "why it is one"),
    }
    columns |= {key: variable("attractor", values, "1", text) for key, (values, text) in more.items()}
    for i, label in enumerate((name, "velocity")):
        columns[f"section_{label}"] = variable(("attractor", "state"), states[:, :, i], unit, f"{label} at phase 0 of the load")
    return columns


def _multiplier(member: Attractor) -> float:
    return float("nan") if member.orbit is None else float(np.abs(member.orbit.multipliers).max())
