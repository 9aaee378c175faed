"""Results of saltus as JSON for a page: diagrams with their orbits, charts, basins and curves of
the phase plane.

Each result carries its system's numbers, so that a page whose numbers have been moved says that
they are not those of the result, and a click sets them all.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Iterable, Iterator
from typing import Any

import numpy as np

from saltus.branch_tables import branches_of
from saltus.errors import ParameterError, shown
from saltus.files import parsed_json
from saltus.orbits import orbits_of
from saltus.result import check_provenance, identity
from saltus.systems import System, numbers

MEANINGS = {
    "LP": "fold",
    "PD": "period doubling",
    "BPC": "branch point",
    "NS": "Neimark–Sacker",
    "GR": "grazing",
    "SW": "switching",
    "RL": "release",
    "CH": "end of a rest",
    "GS": "grazing-sliding",
    "CS": "crossing-sliding",
    "SS": "switching-sliding",
    "AS": "adding-sliding",
}  # of the kinds of special points


def digest(system: System) -> str:
    """A short text that is a page's own: its links and its results carry it."""
    return hashlib.sha256(
        json.dumps([system.to_dict(), identity(system)], sort_keys=True).encode()
    ).hexdigest()[:16]


def results_as_json(results: Iterable[Any], system: System) -> list[dict[str, Any]]:
    """What a page of a system shows of results, each a Dataset, a DataTree, or an object with
    `to_xarray`.

    Raises
    ------
    ParameterError
        A result of another system, of other equations or of another version of saltus, or of a kind
        that a page does not show.
    """
    entries = [
        _one(result.to_xarray() if hasattr(result, "to_xarray") else result, system)
        for result in results
    ]
    return list(_joined(entries))


def _joined(entries: Iterable[dict[str, Any]]) -> Iterator[dict[str, Any]]:
    """Results of which branches along one parameter, with the same other numbers, are one
    diagram.
    """
    diagrams: dict[str, dict[str, Any]] = {}
    for entry in entries:
        others = {
            path: value for path, value in entry["values"].items() if path != entry.get("path")
        }
        key = json.dumps([entry["title"], entry.get("path"), others]) if "dots" not in entry else ""
        if entry["kind"] == "diagram" and key in diagrams:
            for name in ("branches", "special"):
                diagrams[key][name] += entry[name]
            continue
        if entry["kind"] == "diagram" and key:
            diagrams[key] = entry
        yield entry


def _one(data: Any, system: System) -> dict[str, Any]:
    if not hasattr(data, "attrs"):
        raise ParameterError(
            f"a page shows results, such as a branch or a motion, got {shown(data)}", "results"
        )
    kind = str(data.attrs.get("kind", "dataset"))
    if kind not in READERS:
        raise ParameterError(
            f"a page shows {', '.join(sorted(READERS))}, not a result of the kind {kind!r}",
            "results",
        )
    own = _system_of(data.attrs)
    check_provenance(data.attrs, own, f"the {kind.replace('_', ' ')}")
    if not differ_in_numbers(own, system):
        raise ParameterError(
            f"the {kind.replace('_', ' ')} is of another system: its loads or impact law differ",
            "results",
        )
    title = str(data.attrs.get("title", ""))
    title = (
        kind.replace("_", " ").capitalize()
        if title.endswith("computed by saltus") or not title
        else title
    )
    common = {"title": title, "digest": digest(system), "values": dict(numbers(own))}
    return common | READERS[kind](data)


def differ_in_numbers(one: System, other: System) -> bool:
    """Whether two systems are the same but for their numbers."""
    try:
        return one.with_(dict(numbers(other))) == other
    except ParameterError:
        return False


def _system_of(attributes: Any) -> System:
    try:
        return System.from_dict(parsed_json(attributes["system"]))
    except ParameterError:
        raise  # such as of a model that is not registered
    except (KeyError, TypeError, ValueError) as error:
        raise ParameterError(
            "the result does not say of which system it is; compute it again", "results"
        ) from error


def _diagram(tree: Any) -> dict[str, Any]:
    branches = []
    special = []
    for _, branch in branches_of(tree):
        branches.append(_branch(branch))
        special += list(_special(branch))
    dots = tree["attractors"].dataset
    bands = (
        [tree["bands"].dataset[name].values for name in ("low", "high")]
        if "bands" in tree.children
        else [[], []]
    )
    return {
        "kind": "diagram",
        "path": str(tree.attrs["path"]),
        "quantity": "amplitude",
        "bounds": [float(bound) for bound in tree.attrs["bounds"]],
        "branches": branches,
        "special": special,
        "dots": {name: _listed(dots[name].values) for name in ("parameter", "amplitude")},
        "bands": [{"low": float(a), "high": float(b)} for a, b in zip(*bands, strict=True)],
    }


def _single_branch(branch: Any) -> dict[str, Any]:
    common = {"kind": "diagram", "path": str(branch.attrs["path"]), "quantity": "amplitude"}
    return common | {"branches": [_branch(branch)], "special": list(_special(branch))}


def _branch(branch: Any) -> dict[str, Any]:
    """One branch: each orbit with the state from which it starts, its multipliers and its
    evidence.
    """
    orbits = orbits_of(branch)
    if orbits[0].signature.through:
        raise ParameterError("a page cannot show branches of cycles without a load yet", "results")
    starts = [orbit.start() for orbit in orbits]
    coordinates = orbits[0].system.model.coordinates
    defects = branch["defect"].values if "defect" in branch.variables else [None] * len(orbits)
    return {
        "parameter": _listed(branch["parameter"].values),
        "amplitude": _listed(branch["amplitude"].values),
        "stable": [int(orbit.stable) for orbit in orbits],
        "period": [int(orbit.period) for orbit in orbits],
        "start": [
            [float(start[name]) for name in coordinates] + _velocities(start) for start in starts
        ],
        "time": [float(start.get("time", 0.0)) for start in starts],
        "multipliers": [
            [[float(m.real), float(m.imag)] for m in orbit.multipliers if np.isfinite(m)]
            for orbit in orbits
        ],
        "evidence": [
            _evidence(orbit.residual, defect) for orbit, defect in zip(orbits, defects, strict=True)
        ],
    }


def _velocities(start: Any) -> list[float]:
    return [float(each) for each in np.atleast_1d(start["velocity"])]


def _evidence(residual: float, defect: float | None) -> str:
    confirmed = (
        ""
        if defect is None or not np.isfinite(defect)
        else f", {defect:.1g} from itself after a period of simulation"
    )
    return f"residual {residual:.1g}{confirmed}"


def _special(branch: Any) -> Iterator[dict[str, Any]]:
    if "special" not in branch.sizes:
        return
    rows = (branch[name].values for name in ("kind", "special_parameter", "special_amplitude"))
    for kind, parameter, amplitude in zip(*rows, strict=True):
        text = MEANINGS.get(str(kind), str(kind).replace("_", " "))
        yield {
            "kind": str(kind),
            "parameter": float(parameter),
            "amplitude": float(amplitude),
            "text": text,
        }


def _chart(data: Any) -> dict[str, Any]:
    first, second = (str(path) for path in data.attrs["path"])
    coordinates = str(data.attrs["coordinate"]).split()
    columns = [f"motion_{name}" for name in (*coordinates, *_rates(coordinates))]
    amplitude = data["amplitude"].transpose("horizontal", "vertical").values
    motions = data.transpose("horizontal", "vertical", "motion", ...)
    largest = np.argmax(np.nan_to_num(motions["motion_amplitude"].values, nan=-1.0), axis=-1)
    states = np.stack(
        [
            np.take_along_axis(motions[name].values, largest[..., None], -1)[..., 0]
            for name in columns
        ],
        axis=-1,
    )
    return {
        "kind": "chart",
        "paths": [first, second],
        "quantity": "amplitude",
        "x": _listed(data["horizontal"].values),
        "y": _listed(data["vertical"].values),
        "cells": [_listed(row) for row in amplitude],
        "starts": [[_state(cell) for cell in row] for row in states],
    }


def _rates(coordinates: list[str]) -> list[str]:
    return ["velocity"] if len(coordinates) == 1 else [f"{name}_velocity" for name in coordinates]


def _state(values: np.ndarray) -> list[float] | None:
    return [float(each) for each in values] if np.isfinite(values).all() else None


def _basins(data: Any) -> dict[str, Any]:
    x, y = (str(name) for name in data.attrs["plane"])
    label = data["label"].transpose(x, y).values
    names = [
        f"period {int(p)}, amplitude {float(a):.4g}"
        for p, a in zip(data.attractor_period, data.amplitude, strict=True)
    ]
    attractors = [
        {"label": int(n) - 1, "name": name}
        for n, name in zip(data["attractor"].values, names, strict=True)
    ]
    return {
        "kind": "basins",
        "plane": _plane(x, y),
        "x": _listed(data[x].values),
        "y": _listed(data[y].values),
        "cells": [[int(each) - 1 for each in row] for row in label],
        "attractors": attractors,
        "curves": (
            [_points("boundary", True, data, [f"boundary_{x}", f"boundary_{y}"])]
            if f"boundary_{x}" in data
            else []
        ),
    }


def _curve(data: Any) -> dict[str, Any]:
    plane = [str(name) for name in data.attrs["plane"]]
    stable = bool(data.attrs.get("stable", True))
    curve = _points(str(data.attrs["kind"]), stable, data, plane)
    return {"kind": "curves", "plane": _plane(*plane), "curves": [curve]}


def _points(name: str, stable: bool, data: Any, columns: list[str]) -> dict[str, Any]:
    """A curve of the phase plane; it is interrupted where a number is nan."""
    points = np.column_stack([data[column].values for column in columns])
    return {
        "name": name,
        "stable": stable,
        "points": [[_number(a), _number(b)] for a, b in points.tolist()],
    }


def _plane(x: str, y: str) -> list[str]:
    """The names of both axes as the page has them: each velocity with that of its coordinate."""
    return [x, f"{x}_velocity" if y == "velocity" else y]


def _listed(values: np.ndarray) -> list[float | None]:
    return [_number(each) for each in np.asarray(values, dtype=float).tolist()]


def _number(value: float) -> float | None:
    """A number as JSON has it, which knows no nan."""
    return value if np.isfinite(value) else None


READERS: dict[str, Callable[[Any], dict[str, Any]]] = {
    "response_spectrum": _diagram,
    "bifurcation_diagram": _diagram,
    "branch": _single_branch,
    "stability_chart": _chart,
    "basins": _basins,
    "manifold": _curve,
    "separatrix": _curve,
}  # by the attribute `kind`
