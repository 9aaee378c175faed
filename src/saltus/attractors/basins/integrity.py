"""The integrity of basins: how large they are, and how far an attractor is from where its basin
ends.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import TYPE_CHECKING, Any

import numpy as np

from saltus.checks import Numbers, answered
from saltus.errors import ParameterError
from saltus.result import result_dataset

if TYPE_CHECKING:
    import xarray

# Points on each side of the nearest one through which a curve is interpolated, with an error of the
# order 7.
BESIDE = 3


@answered
def basin_integrity(basins: xarray.Dataset, curves: Iterable[Numbers] = ()) -> xarray.Dataset:
    """The measures of dynamical integrity of each basin (Thompson 1989; Rega and Lenci 2005), of
    distances in the state plane:

    * the global integrity measure, its area in the grid;
    * the local integrity measure, the least distance of the attractor's states at phase 0 from
      another basin;
    * the integrity factor, the radius of the largest circle in the basin and in the grid.

    These are as exact as the grid: a distance is that to the centre of the nearest cell with
    another label (undecided ones included), up to a cell too long. Where the curves at which basins
    meet are known, from `basins_of_attraction(curves=True)` or given here, the distance from them
    is exact: of the curve through their points, which are exact themselves.

    How they fall along a parameter is the erosion profile, by `map_over` of a function that returns
    them.

    Parameters
    ----------
    basins
        The dataset of `basins_of_attraction`.
    curves
        States on the boundary, arrays (n, 2) along curves, with nan between their parts:
        `manifold.states` of `stable_manifold`, or the coordinates and velocities of `separatrices`.

    Returns
    -------
    xarray.Dataset
        Over `attractor`: `area`, `distance` (inf where there is no other basin) and the `nearest`
        state of the attractor (two numbers), `factor` and its `centre` (two numbers), and
        `distance_from_curve` (nan without a curve).

    Raises
    ------
    ParameterError
        Another dataset, a grid that is a line, or curves of another shape.

    Examples
    --------
    >>> grid = np.linspace(-1.0, 1.0, 21)
    >>> found = saltus.basin_integrity(saltus.basins_of_attraction(system, theta=grid, velocity=grid))
    >>> round(float(found.area[0]), 6), round(float(found.factor[0]), 6)  # a single basin, the whole grid
    (4.41, 1.05)
    """
    if (
        not hasattr(basins, "data_vars")
        or not {"label", "attractor"} <= set(basins.variables)
        or "plane" not in basins.attrs
    ):
        raise ParameterError("basins must be the dataset of basins_of_attraction", "basins")
    x, y = (str(name) for name in basins.attrs["plane"])
    across, up, label = (basins[name].values for name in (x, y, "label"))
    if min(across.size, up.size) < 2:
        raise ParameterError(
            "the grid of basins must have two values at least of each variable", "basins"
        )
    widths = np.outer(np.gradient(up), np.gradient(across))
    cells = np.stack([part.ravel() for part in np.meshgrid(across, up)], axis=1)
    lines = _curves(basins, (x, y), curves)
    rows = []
    for i, number in enumerate(basins["attractor"].values):
        own = label.ravel() == number
        states = np.stack([basins[f"section_{name}"].values[i] for name in (x, y)], axis=1)
        states = states[np.isfinite(states).all(axis=1)]
        from_cells, nearest, radius, centre = _in_grid(cells, own, states, (across, up))
        from_curve = min(
            (_distance(line, state) for line in lines for state in states), default=np.nan
        )
        rows.append(
            (float(widths.ravel()[own].sum()), from_cells, radius, *centre, *nearest, from_curve)
        )
    area, distance, factor, *places, exact = np.array(rows).reshape(-1, 8).T
    centre = np.transpose(places[:2])
    nearest = np.transpose(places[2:])
    unit = str(basins[x].attrs.get("units", "1"))
    columns: dict[str, tuple[Any, ...]] = {
        "area": ("attractor", area, "1", "global integrity measure: area of the basin in the grid"),
        "distance": (
            "attractor",
            distance,
            "1",
            "local integrity measure: from the attractor to the nearest other cell",
        ),
        "factor": (
            "attractor",
            factor,
            "1",
            "integrity factor: radius of the largest circle in the basin",
        ),
        "centre": (("attractor", "plane"), centre, unit, "centre of this circle"),
        "nearest": (
            ("attractor", "plane"),
            nearest,
            unit,
            "state of the attractor that is nearest to another cell",
        ),
        "distance_from_curve": (
            "attractor",
            exact,
            "1",
            "from the attractor to the curves where basins meet",
        ),
    }
    return result_dataset(
        "basin_integrity", columns, {"attractor": basins["attractor"].values, "plane": [x, y]}
    )


def _in_grid(
    cells: np.ndarray, own: np.ndarray, states: np.ndarray, axes: tuple[np.ndarray, np.ndarray]
) -> tuple[float, np.ndarray, float, np.ndarray]:
    """The distance of the attractor's states from other cells, and the state nearest to them; the
    largest circle of own cells, its radius and its centre."""
    from scipy.spatial import cKDTree

    edges = np.array([(a[0] - (a[1] - a[0]) / 2, a[-1] + (a[-1] - a[-2]) / 2) for a in axes])
    room = np.minimum(cells[own] - edges[:, 0], edges[:, 1] - cells[own]).min(axis=1)
    away = np.inf
    nearest = states[0] if len(states) else np.full(2, np.nan)
    if not own.all():
        others = cKDTree(cells[~own])
        if len(states):
            apart = others.query(states)[0]
            away = float(apart.min())
            nearest = states[int(np.argmin(apart))]
        room = np.minimum(room, others.query(cells[own])[0])
    if not own.any():
        return 0.0, nearest, 0.0, np.full(2, np.nan)
    best = int(np.argmax(room))
    return away, nearest, float(room[best]), cells[own][best]


def _curves(basins: Any, plane: tuple[str, str], curves: Iterable[Any]) -> list[np.ndarray]:
    """The parts of all curves, (n, 2) each."""
    given = [np.asarray(curve, dtype=float) for curve in curves]
    if all(f"boundary_{name}" in basins for name in plane):
        given.append(np.stack([basins[f"boundary_{name}"].values for name in plane], axis=1))
    for curve in given:
        if curve.ndim != 2 or curve.shape[1] != 2:
            raise ParameterError(
                f"curves must be arrays of states, (n, 2), got one of the shape {curve.shape}",
                "curves",
            )
    return [part for curve in given for part in _parts(curve)]


def _parts(curve: np.ndarray) -> Iterator[np.ndarray]:
    """The pieces between nan, without points that repeat the one before."""
    whole = np.isfinite(curve).all(axis=1)
    for part in np.split(curve, np.flatnonzero(~whole)):
        part = part[np.isfinite(part).all(axis=1)]
        part = (
            part[np.append(True, (np.diff(part, axis=0) != 0.0).any(axis=1))] if len(part) else part
        )
        if len(part):
            yield part


def _distance(curve: np.ndarray, state: np.ndarray) -> float:
    """The distance of a state from a curve, by the polynomial along the chords through the points
    around the nearest one.
    """
    from scipy.interpolate import BarycentricInterpolator
    from scipy.optimize import minimize_scalar

    apart = np.hypot(*(curve - state).T)
    k = int(np.argmin(apart))
    near = curve[max(k - BESIDE, 0) : k + BESIDE + 1]
    if len(near) < 2:
        return float(apart[k])
    along = np.append(0.0, np.cumsum(np.hypot(*np.diff(near, axis=0).T)))
    line = BarycentricInterpolator(along, near)
    here = k - max(k - BESIDE, 0)
    bounds = along[max(here - 1, 0)], along[min(here + 1, len(near) - 1)]

    def away(s: float) -> float:
        return float(np.hypot(*(line(s) - state)))

    found = minimize_scalar(away, bounds=bounds, method="bounded", options={"xatol": 1e-12})
    return min(float(found.fun), float(apart[k]))
