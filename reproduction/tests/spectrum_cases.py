"""Diagrams made by hand, of which every feature is known."""

import numpy as np
import xarray as xr

from saltus.branch_tables import branch_tables

# of the margins of these diagrams
KINDS = {"straight": "landmark", "reaction": "assumption", "reach": "limit"}


def branch(
    parameter,
    amplitude,
    stable,
    *,
    special=(),
    origin="start",
    ends=("bound", "bound"),
    periods=1,
    crossings=2,
    margins=None,
):
    """A branch's dataset with the given points; `special` holds (kind, parameter, amplitude),
    `margins` values by name.
    """
    amplitude = np.asarray(amplitude, float)
    n = len(amplitude)
    data = {
        "parameter": ("point", np.asarray(parameter, float)),
        "amplitude": ("point", amplitude),
        "highest": ("point", amplitude),
        "lowest": ("point", -0.5 * amplitude),
        "stable": ("point", np.asarray(stable, np.int8)),
        "symmetric": ("point", np.zeros(n, np.int8)),
        "period": ("point", np.full(n, periods)),
        "impact_count": ("point", np.broadcast_to(crossings, n).copy()),
    }
    for name, values in (margins or {}).items():
        data[f"margin_{name}"] = ("point", np.asarray(values, float), {"margin_kind": KINDS[name]})
    places, sizes = (np.array([row[i] for row in special], float) for i in (1, 2))
    columns = {"parameter": places, "amplitude": sizes, "highest": sizes, "lowest": -0.5 * sizes}
    data["kind"] = ("special", np.array([row[0] for row in special], str))
    data |= {f"special_{name}": ("special", values) for name, values in columns.items()}
    return xr.Dataset(
        data, attrs={"origin": origin, "end_reasons": list(ends), "end_kinds": ["", ""]}
    )


def diagram(*branches, dots=(), bounds=(0.0, 3.0)):
    """A DataTree of branches and of dots (parameter, amplitude)."""
    places = np.array(dots, float).reshape(-1, 2)
    parts = branch_tables(branches)
    columns = {
        "parameter": places[:, 0],
        "amplitude": places[:, 1],
        "highest": places[:, 1],
        "lowest": -0.5 * places[:, 1],
    }
    columns["placed"] = np.ones(len(places), dtype=int)
    parts["attractors"] = xr.Dataset({name: ("dot", values) for name, values in columns.items()})
    parts["bands"] = xr.Dataset(
        {"low": ("band", [1.0]), "high": ("band", [1.5]), "kind": ("band", ["CH"])}
    )
    parts["/"] = xr.Dataset(attrs={"bounds": list(bounds), "path": "load.frequency", "scale": 2.0})
    return xr.DataTree.from_dict(parts)


def folded():
    """A resonance that leans over: amplitude against frequency with folds at 2 and 1.5, the part
    between them unstable.
    """
    parameter = [0.0, 0.5, 1.0, 1.6, 1.99, 1.75, 1.52, 1.8, 2.4, 3.0]
    amplitude = [0.5, 0.7, 1.0, 1.5, 2.1, 1.8, 1.2, 0.8, 0.5, 0.4]
    stable = [1, 1, 1, 1, 1, 0, 0, 1, 1, 1]
    return branch(parameter, amplitude, stable, special=[("LP", 2.0, 2.0), ("LP", 1.5, 1.1)])


def loop():
    """A closed loop above it, stable below, of period 3."""
    return branch(
        [1.0, 1.5, 2.0, 1.5, 1.0],
        [3.0, 2.5, 3.0, 3.5, 3.0],
        [1, 1, 1, 0, 1],
        special=[("LP", 2.0, 3.0), ("LP", 1.0, 3.0)],
        ends=("closed", "closed"),
        periods=3,
    )
