"""A branch as an xarray.Dataset: all that a figure or a later continuation needs, without loss."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from saltus.orbits.orbit import PeriodicOrbit

if TYPE_CHECKING:
    import xarray

    from saltus.orbits.branch import Branch
    from saltus.orbits.special import SpecialPoint


def branch_dataset(branch: Branch) -> xarray.Dataset:
    """Points along `point`, special points along `special`.

    Angles in radians; `stable` and `symmetric` are 0 or 1; `unknowns` and `sides` hold each orbit's own (see `problem.py`),
    filled up with nan and 0.
    """
    import xarray

    import saltus

    orbits = branch.orbits
    system = orbits[0].problem.system
    names = system.model.coordinates
    data: dict[str, Any] = {"parameter": ("point", branch.parameters, {"long_name": branch.path})}
    data |= {name: ("point", values, attrs) for name, values, attrs in _columns(orbits, names[0])}
    data |= _multipliers(orbits) | _unknowns(orbits) | _special(branch.special)
    attributes = {
        "path": branch.path,
        "coordinate": names[0],
        "ends": list(branch.ends),
        "origin": branch.origin,
        "closed": int(branch.closed),
        "missed": "; ".join(branch.missed),
        "system": system.to_json(),
        "saltus": saltus.__version__,
        "tol": orbits[0].problem.tol,
    }
    return xarray.Dataset(data, attrs=attributes)


def _columns(orbits: list[PeriodicOrbit], coordinate: str) -> list[tuple[str, np.ndarray, dict[str, str]]]:
    """What is one number of each orbit."""
    angle = {"units": "rad"} if coordinate.startswith("theta") else {"units": "1"}

    def column(value: Any, kind: Any = float) -> np.ndarray:
        return np.array([value(orbit) for orbit in orbits], dtype=kind)

    columns = [
        ("amplitude", column(lambda o: o.amplitude), {**angle, "long_name": f"max abs({coordinate})"}),
        ("highest", column(lambda o: o.highest), {**angle, "long_name": f"max {coordinate}"}),
        ("lowest", column(lambda o: o.lowest), {**angle, "long_name": f"min {coordinate}"}),
        ("stable", column(lambda o: o.stable, np.int8), {}),
        ("symmetric", column(lambda o: o.symmetric, np.int8), {}),
        ("impact_count", column(lambda o: o.signature.impact_count, int), {"long_name": "impacts in one period of the orbit"}),
        ("period", column(lambda o: o.period, int), {"long_name": "forcing periods in one period of the orbit"}),
        ("side", column(lambda o: o.signature.side, np.int8), {"long_name": "side of an orbit without impacts"}),
        ("slowest", column(lambda o: o.slowest), {"long_name": "least speed of an impact"}),
        ("clearance", column(lambda o: o.clearance), {"long_name": "least inner minimum of the gap"}),
        ("residual", column(lambda o: o.residual), {}),
    ]
    for name in orbits[0].problem.margins:
        columns.append((f"margin_{name}", column(lambda o, name=name: o.margins[name]), {"long_name": f"least {name}"}))
    return columns


def _multipliers(orbits: list[PeriodicOrbit]) -> dict[str, Any]:
    values = np.array([orbit.multipliers for orbit in orbits])
    dims = ("point", "multiplier")
    return {"multiplier_real": (dims, values.real), "multiplier_imag": (dims, values.imag)}


def _unknowns(orbits: list[PeriodicOrbit]) -> dict[str, Any]:
    """The equations' own unknowns and sides, in rows of one length."""
    width = max(orbit.problem.size for orbit in orbits)
    unknowns = np.full((len(orbits), width), np.nan)
    sides = np.zeros((len(orbits), max(1, max(len(orbit.signature.sides) for orbit in orbits))), dtype=np.int8)
    for row, side, orbit in zip(unknowns, sides, orbits, strict=True):
        row[: orbit.problem.size] = orbit.solution.unknowns
        side[: len(orbit.signature.sides)] = orbit.signature.sides
    return {"unknowns": (("point", "unknown"), unknowns), "sides": (("point", "impact"), sides)}


def _special(special: tuple[SpecialPoint, ...]) -> dict[str, Any]:
    """The special points with their evidence."""
    if not special:
        return {}
    rows: dict[str, list[Any]] = {
        "kind": [s.kind for s in special],
        "special_parameter": [s.parameter for s in special],
        "special_amplitude": [s.amplitude for s in special],
        "special_highest": [s.orbit.highest for s in special],
        "special_lowest": [s.orbit.lowest for s in special],
        "special_impact_count": [s.orbit.signature.impact_count for s in special],
        "special_period": [s.orbit.period for s in special],
        "special_residual": [s.evidence.residual for s in special],
        "bracket": [s.evidence.bracket for s in special],
        "test_before": [s.evidence.before for s in special],
        "test_after": [s.evidence.after for s in special],
        "test_value": [s.evidence.value for s in special],
        "special_defect": [s.defect for s in special],
    }
    return {name: ("special", np.array(values)) for name, values in rows.items()}
