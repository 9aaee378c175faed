"""A branch as an xarray.Dataset: all that a figure or a later continuation needs, without loss."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from saltus.orbits.orbit import PeriodicOrbit
from saltus.provenance import provenance

if TYPE_CHECKING:
    import xarray

    from saltus.orbits.branches.branch import Branch
    from saltus.orbits.branches.special_point import SpecialPoint


def branch_dataset(branch: Branch) -> xarray.Dataset:
    """The dataset of a branch: points along `point`, special points along `special`.

    `stable` and `symmetric` are 0 or 1; `unknowns` and `sides` are those of each orbit (see `equations/`), padded with nan and
    0 to one length. Orbits that rest also have the times of their `releases` and `rests`. The attributes hold, for both ends, the
    sentence (`ends`), the reason as a word (`end_reasons`) and the kind of the special point there, if any (`end_kinds`).
    """
    import xarray

    orbits = branch.orbits
    equations = orbits[0].equations
    data: dict[str, Any] = {"parameter": ("point", branch.parameters, {"long_name": branch.path})}
    data |= {name: ("point", values, attrs) for name, values, attrs in _columns(orbits)}
    data |= multiplier_columns(orbits) | solution_columns(orbits) | _special(branch.special) | _rests(orbits)
    attributes: dict[str, Any] = {
        "kind": "branch",
        "path": branch.path,
        "coordinate": " ".join(equations.system.model.coordinates),
        "ends": [str(end) for end in branch.ends],
        "end_reasons": [end.reason.code for end in branch.ends],
        "end_kinds": [str(end.kind) for end in branch.ends],
        "origin": str(branch.origin),
        "closed": int(branch.closed),
        "missed": "; ".join(map(str, branch.missed)),
    }
    return xarray.Dataset(data, attrs=provenance(equations.system, tol=equations.tol, **attributes))


def _columns(orbits: list[PeriodicOrbit]) -> list[tuple[str, np.ndarray, dict[str, str]]]:
    """The quantities that are one number for each orbit."""
    model = orbits[0].equations.system.model
    angle, coordinate = {"units": model.unit_of(model.coordinates[0])}, " or ".join(model.coordinates)

    def column(value: Any, kind: Any = float) -> np.ndarray:
        return np.array([value(orbit) for orbit in orbits], dtype=kind)

    columns = [
        ("amplitude", column(lambda o: o.amplitude), {**angle, "long_name": f"max abs({coordinate})"}),
        ("highest", column(lambda o: o.highest), {**angle, "long_name": f"max {coordinate}"}),
        ("lowest", column(lambda o: o.lowest), {**angle, "long_name": f"min {coordinate}"}),
        ("stable", column(lambda o: o.stable, np.int8), {}),
        ("impact_count", column(lambda o: o.impact_count, int), {"long_name": "impacts in one period of the orbit"}),
        ("slowest", column(lambda o: o.slowest), {"long_name": "least speed of an impact"}),
        ("clearance", column(lambda o: o.clearance), {"long_name": "least inner minimum of the gap"}),
        ("residual", column(lambda o: o.residual), {}),
        ("rest_share", column(lambda o: o.rest_share), {}),
    ]
    for name in orbits[0].equations.margins:
        attrs = {"long_name": f"least {name}", "margin_kind": str(model.margin_kind(name))}
        columns.append((f"margin_{name}", column(lambda o, name=name: o.margins[name]), attrs))
    return columns


def _rests(orbits: list[PeriodicOrbit]) -> dict[str, Any]:
    """Releases and rests of orbits that rest, in rows of one length."""
    width = max(len(orbit.releases) for orbit in orbits)
    if not width:
        return {}

    def rows(name: str) -> np.ndarray:
        return np.array([np.pad(getattr(o, name), (0, width - len(o.releases)), constant_values=np.nan) for o in orbits])

    return {name: (("point", "rest"), rows(name)) for name in ("releases", "rests")}


def multiplier_columns(orbits: list[PeriodicOrbit]) -> dict[str, Any]:
    """The multipliers of each orbit, in rows of one length."""
    every = [orbit.multipliers for orbit in orbits]  # their number varies: what contacts hold has none
    values = np.array([np.pad(one, (0, max(map(len, every)) - len(one))) for one in every])
    dims = ("point", "multiplier")
    return {"multiplier_real": (dims, values.real), "multiplier_imag": (dims, values.imag)}


def solution_columns(orbits: list[PeriodicOrbit]) -> dict[str, Any]:
    """The signature of each orbit and the unknowns of its equations, in rows of one length, as `orbits_of` reads them."""
    width = max(orbit.equations.size for orbit in orbits)
    unknowns = np.full((len(orbits), width), np.nan)
    sides = np.zeros((len(orbits), max(1, max(len(orbit.signature.sides) for orbit in orbits))), dtype=np.int8)
    for row, side, orbit in zip(unknowns, sides, orbits, strict=True):
        row[: orbit.equations.size] = orbit.solution.unknowns
        side[: len(orbit.signature.sides)] = orbit.signature.sides
    data: dict[str, Any] = {
        "unknowns": (("point", "unknown"), unknowns),
        "sides": (("point", "impact"), sides),
        "symmetric": ("point", np.array([orbit.symmetric for orbit in orbits], dtype=np.int8)),
        "period": (
            "point",
            np.array([orbit.period for orbit in orbits]),
            {"long_name": "forcing periods in one period of the orbit"},
        ),
        "side": (
            "point",
            np.array([orbit.signature.side for orbit in orbits], dtype=np.int8),
            {"long_name": "side of an orbit without impacts"},
        ),
    }
    events = np.full((len(orbits), max(1, max(len(orbit.signature.events) for orbit in orbits)), 3), -1)
    for table, orbit in zip(events, orbits, strict=True):
        for row, event in zip(table, orbit.signature.events, strict=False):
            row[:] = event.is_impact, event.contact, event.closed
    closed = np.array([orbit.signature.closed for orbit in orbits])
    sections = np.array([np.nan if orbit.signature.section is None else orbit.signature.section for orbit in orbits])
    return data | {
        "section": ("point", sections),
        "events": (("point", "event_mark"), events.reshape(len(orbits), -1)),
        "closed_contacts": ("point", closed),
    }


def _special(special: tuple[SpecialPoint, ...]) -> dict[str, Any]:
    """The special points with their evidence."""
    rows: dict[str, list[Any]] = {
        "kind": [str(s.kind) for s in special],
        "special_parameter": [s.parameter for s in special],
        "special_amplitude": [s.amplitude for s in special],
        "special_highest": [s.orbit.highest for s in special],
        "special_lowest": [s.orbit.lowest for s in special],
        "special_slowest": [s.orbit.slowest for s in special],
        "special_impact_count": [s.orbit.impact_count for s in special],
        "special_period": [s.orbit.period for s in special],
        "special_residual": [s.evidence.residual for s in special],
        "bracket": [s.evidence.bracket for s in special],
        "test_before": [s.evidence.before for s in special],
        "test_after": [s.evidence.after for s in special],
        "test_value": [s.evidence.value for s in special],
        "special_defect": [s.defect for s in special],
    }
    return {name: ("special", np.array(values, dtype=_dtype(name))) for name, values in rows.items()}


def _dtype(name: str) -> type:
    """The type of a column of special points, which NumPy cannot tell if the column has no rows."""
    return str if name == "kind" else int if name in ("special_impact_count", "special_period") else float
