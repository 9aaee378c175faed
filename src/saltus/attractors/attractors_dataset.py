"""Attractors as an xarray Dataset, with units and provenance."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    import xarray

    from saltus.attractors.attractor import Attractor, Attractors
    from saltus.systems import Load, System

MOST_STROBES = 64  # points at phase 0 that are written of each attractor


def attractors_dataset(found: Attractors) -> xarray.Dataset:
    """The table of the attractors, with their points at phase 0 and the initial states with the labels where they end."""
    import xarray

    name, unit = coordinate(found.system)
    table = attractor_table(found.members, found.system)
    table |= {
        f"start_{name}": ("start", found.states[:, 0], {"units": unit, "long_name": f"{name} at the start"}),
        "start_velocity": ("start", found.states[:, 1], {"units": unit, "long_name": "velocity at the start"}),
        "end": ("start", found.assigned, {"units": "1", "long_name": "attractor on which it ends, -1 for undecided"}),
    }
    attributes = provenance(found.system, "attractors") | {
        "tol": found.tol,
        "window": np.ravel(found.window).tolist(),
        "seed": found.seed,
        "undecided": found.undecided,
        "reasons": list(found.reasons),
    }
    return xarray.Dataset(table, {"attractor": labels(found.members)}, attributes)


def provenance(system: System, kind: str) -> dict[str, Any]:
    """The attributes that every dataset of this room has."""
    from saltus import __version__

    return {
        "title": f"{kind} computed by saltus",
        "kind": kind,
        "saltus_version": __version__,
        "system": system.to_json(),
        "load": "constant" if is_constant(system.load) else "periodic",
        "Conventions": "CF-1.8",
    }


def is_constant(load: Load) -> bool:
    """Whether no channel varies: the section at phase 0 is then the phase plane, and cycles of period 1 are equilibria."""
    return not any(signal.periodic for signal in load.channels.values())


def coordinate(system: System) -> tuple[str, str]:
    """The coordinate's name and unit."""
    name = system.model.coordinates[0]
    return name, "rad" if name.startswith("theta") else "1"


def labels(members: tuple[Attractor, ...]) -> Any:
    """The coordinate `attractor`."""
    return "attractor", np.array([member.label for member in members], dtype=int), {"long_name": "label; 0 is rest"}


def attractor_table(members: tuple[Attractor, ...], system: System) -> dict[str, Any]:
    """Variables over (attractor,) and (attractor, strobe)."""
    name, unit = coordinate(system)
    points = np.full((len(members), max([1, *(min(len(m.strobes), MOST_STROBES) for m in members)]), 2), np.nan)
    for row, member in zip(points, members, strict=True):
        row[: len(member.strobes)] = member.strobes[:MOST_STROBES]

    def column(values: Any, units: str, text: str, **more: Any) -> Any:
        return "attractor", np.array(list(values), **more), {"units": units, "long_name": text}

    strobed = ("attractor", "strobe")
    return {
        "attractor_kind": column((m.kind for m in members), "1", "rest, periodic, quasi-periodic or chaotic", dtype=str),
        "attractor_period": column((m.period for m in members), "1", "forcing periods, 0 where it has none", dtype=int),
        "fraction": column((m.fraction for m in members), "1", "share of the initial states that end there", dtype=float),
        "fraction_error": column((m.error for m in members), "1", "binomial standard error of the share", dtype=float),
        f"largest_{name}": column((m.highest for m in members), unit, f"the largest {name}", dtype=float),
        f"smallest_{name}": column((m.lowest for m in members), unit, f"the smallest {name}", dtype=float),
        "amplitude": column((m.amplitude for m in members), unit, f"max abs({name})", dtype=float),
        "multiplier": column((_multiplier(m) for m in members), "1", "largest modulus of its multipliers", dtype=float),
        "mirror": column((m.mirror for m in members), "1", "label of its mirror image", dtype=int),
        "evidence": column((m.evidence for m in members), "1", "why it is one", dtype=str),
        f"strobe_{name}": (strobed, points[:, :, 0], {"units": unit, "long_name": f"{name} at phase 0 of the load"}),
        "strobe_velocity": (strobed, points[:, :, 1], {"units": unit, "long_name": "velocity at phase 0 of the load"}),
    }


def _multiplier(member: Attractor) -> float:
    return float("nan") if member.orbit is None else float(np.abs(member.orbit.multipliers).max())
