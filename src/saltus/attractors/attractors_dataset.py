"""Attractors as an xarray Dataset, with units and provenance."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

import numpy as np

from saltus.attractors.stroboscopic_section import is_constant
from saltus.flow import extrema_names, state_names
from saltus.provenance import provenance

if TYPE_CHECKING:
    import xarray

    from saltus.attractors.attractor import Attractor, Attractors
    from saltus.systems import System

MOST_STATES = 64  # states at phase 0 that are written of each attractor


def attractors_dataset(found: Attractors) -> xarray.Dataset:
    """The table of the attractors, with their states at phase 0, and the initial states with the labels of their ends."""
    import xarray

    table = attractor_table(found.members, found.system)
    for i, (name, unit) in enumerate(state_units(found.system).items()):
        table[f"start_{name}"] = variable("start", found.states[:, i], unit, f"{name} at the start")
    table["end"] = variable("start", found.assigned, "1", "attractor on which it ends, -1 for undecided")
    attributes = about(
        found.system,
        "attractors",
        tol=found.tol,
        seed=found.seed,
        window=np.ravel(found.window).tolist(),
        plane=list(state_plane(found.system)),
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


def state_units(system: System) -> dict[str, str]:
    """The units of the state variables by their names; as time is dimensionless, a velocity has the unit of its coordinate."""
    names = system.model.coordinates
    return dict(zip(state_names(names), 2 * [system.model.unit_of(name) for name in names], strict=True))


def state_plane(system: System) -> tuple[str, str]:
    """The two state variables over which attractors are drawn: the first coordinate and its velocity."""
    names = state_names(system.model.coordinates)
    return names[0], names[len(names) // 2]


def labels(members: Iterable[Attractor]) -> Any:
    """The coordinate `attractor`."""
    return "attractor", np.array([member.label for member in members], dtype=int), {"long_name": "label; 0 is rest"}


def attractor_columns(system: System) -> dict[str, tuple[str, str, str]]:
    """The columns of a table of attractors by their names: the property of `Attractor`, the unit and the text of each."""
    names, unit = system.model.coordinates, system.model.unit_of(system.model.coordinates[0])
    high, low = extrema_names(names)
    name = names[0] if len(names) == 1 else "any coordinate"
    return {
        "fraction": ("fraction", "1", "share of the initial states that end there"),
        "error": ("error", "1", "binomial standard error of the share"),
        "amplitude": ("amplitude", unit, f"max abs({name})"),
        high: ("highest", unit, f"the largest {name}"),
        low: ("lowest", unit, f"the smallest {name}"),
        "period": ("period", "1", "forcing periods after which it repeats, 0 where it does not"),
    }


def attractor_table(members: tuple[Attractor, ...], system: System) -> dict[str, Any]:
    """The variables over (attractor,), and those of the states at phase 0 over (attractor, state)."""
    most = max([1, *(min(len(m.states), MOST_STATES) for m in members)])
    states = np.full((len(members), most, system.dimension), np.nan)
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
    for i, (label, unit) in enumerate(state_units(system).items()):
        columns[f"section_{label}"] = variable(("attractor", "state"), states[:, :, i], unit, f"{label} at phase 0 of the load")
    return columns


def _multiplier(member: Attractor) -> float:
    return float("nan") if member.orbit is None else float(np.abs(member.orbit.multipliers).max())
