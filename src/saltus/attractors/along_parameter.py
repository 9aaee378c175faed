"""Attractors along a parameter: found at every value, continued from one to the next, each with an identity of its own."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from saltus.attractors.attractor import REST, Attractor, Attractors, Target
from saltus.attractors.attractors_dataset import coordinate, provenance
from saltus.attractors.find import find_attractors
from saltus.checks import Rectangle, check_number, check_path
from saltus.errors import ParameterError
from saltus.systems import System

if TYPE_CHECKING:
    import xarray

THRESHOLD = 0.3  # distance of two sets, relative to their size, up to which one may be the other's continuation
SEEDS = 64  # points of each attractor from which motions start at the next value
OTHER_PERIOD = 0.5  # of the threshold, for sets that repeat after different periods
LED = 3.0  # times the threshold, for sets of one period where motions from the one settle on the other


@dataclass(frozen=True)
class Event:
    """An attractor that begins or ends between two values of the parameter."""

    kind: str  # "birth" or "death"
    label: int
    before: float  # the last value without it (birth) or with it (death)
    after: float


def attractors_along(
    system: System,
    path: str,
    values: Iterable[float],
    *,
    window: Rectangle | None = None,
    starts: int = 128,
    max_period: int = 16,
    seed: int = 0,
    known: Any = (),
    threshold: float = THRESHOLD,
    tol: float = 1e-11,
    progress: Callable[[float], object] | None = None,
) -> xarray.Dataset:
    """The attractors at each value of a parameter, with labels that an attractor keeps as the parameter changes.

    At each value they are found as by `attractors`, from the same initial states and from points of the attractors at the value
    before, so that none is lost because its basin is small. Those at two neighbouring values are then matched, the nearest
    first: by the distance between the sets of their points at phase 0 (Hausdorff's, the larger of the two ways), relative to the
    size of the larger set. Half the threshold holds between different periods, as across a period doubling; three times as much
    between two of the same period if motions from all points of the one settle on the other. One that is matched to none is
    born, or has died. Rest is always 0.

    Args:
        system: what moves.
        path: dotted path of the parameter.
        values: of the parameter, increasing or decreasing: identities are kept from each to the next.
        window, starts, max_period, seed, tol: as for `attractors`.
        known: branches along the same parameter, whose stable orbits count at every value.
        threshold: the largest relative distance of one and the same attractor at neighbouring values.
        progress: called with the fraction done.

    Returns:
        A Dataset over (value, attractor), nan where it does not exist: `fraction`, `error`, `amplitude`, `largest_...`,
        `smallest_...`, `period` (0: none), `kind` ("" where it does not exist); over (value): `undecided`; over (event):
        births and deaths.

    Raises:
        ParameterError: a path to no number, values that are not monotonic, and as for `attractors`.
    """
    check_number("threshold", threshold, above=0.0)
    grid = _values(system, path, values)
    rows: list[Attractors] = []
    names: list[dict[int, int]] = []  # identity by label, at each value
    seeds: list[np.ndarray] = []
    for i, value in enumerate(grid):
        here = find_attractors(
            system.with_({path: float(value)}),
            window=window,
            starts=starts,
            max_period=max_period,
            seed=seed,
            known=known,
            also=np.concatenate(seeds) if seeds else (),
            tol=tol,
        )
        taken = max((name for row in names for name in row.values()), default=REST)
        if rows:
            apart = _distances(rows[-1], here, [len(points) for points in seeds])
            names.append(_identities(rows[-1], names[-1], here, apart, threshold, taken))
        else:
            names.append({member.label: member.label for member in here})
        rows.append(here)
        seeds = [member.strobes[-SEEDS:] for member in here]
        if progress is not None:
            progress((i + 1) / len(grid))
    return _dataset(system, path, grid, rows, names, {"threshold": threshold, "starts": starts, "seed": seed, "tol": tol})


def set_distance(one: Target, other: Target) -> float:
    """Hausdorff's distance between two sets of points, relative to the size of the larger: its width, or its distance from 0.

    Between sampled sets 5 % of the points may lie farther away, as they are points of a random sample.
    """
    forth, back = other.distance(one.strobes), one.distance(other.strobes)
    share = 0.95 if one.dense or other.dense else 1.0
    apart = max(float(np.quantile(forth, share)), float(np.quantile(back, share)))
    size = max(float(np.abs(target.strobes).max()) for target in (one, other))
    return apart / size if size > 0.0 else 0.0 if apart == 0.0 else np.inf


def _distances(before: Attractors, here: Attractors, seeds: list[int]) -> dict[tuple[int, int], float]:
    """How far each attractor is from each of those before, by their labels, with so many seeds of each of these."""
    parts = np.split(here.carried, np.cumsum(seeds)[:-1]) if seeds else []
    led = {old.label: set(part.tolist()) for old, part in zip(before, parts, strict=True)}
    return {(old.label, new.label): _apart(old, new, led[old.label] == {new.label}) for old in before for new in here}


def _apart(old: Attractor, new: Attractor, led: bool) -> float:
    if "rest" in (old.kind, new.kind):
        return 0.0 if old.kind == new.kind else np.inf
    distance = set_distance(old.target, new.target)
    if old.period != new.period:
        return distance / OTHER_PERIOD
    return distance / LED if led else distance


def _identities(
    before: Attractors,
    names: dict[int, int],
    here: Attractors,
    apart: dict[tuple[int, int], float],
    threshold: float,
    taken: int,
) -> dict[int, int]:
    """The identity of each attractor: that of the one before which it continues, the nearest pair first, or a new one."""
    found: dict[int, int] = {}
    for (old, new), distance in sorted(apart.items(), key=lambda item: item[1]):
        if distance < threshold and new not in found and names[old] not in found.values():
            found[new] = names[old]
    for member in here:
        if member.label not in found:
            taken += member.kind != "rest"
            found[member.label] = REST if member.kind == "rest" else taken
    return found


def _events(grid: np.ndarray, names: list[dict[int, int]]) -> list[Event]:
    events = []
    for i in range(1, len(grid)):
        old, new = set(names[i - 1].values()), set(names[i].values())
        edges = float(grid[i - 1]), float(grid[i])
        events += [Event("death", label, *edges) for label in sorted(old - new)]
        events += [Event("birth", label, *edges) for label in sorted(new - old)]
    return events


def _values(system: System, path: str, values: Any) -> np.ndarray:
    check_path(system, path)
    try:
        grid = np.atleast_1d(np.asarray(list(values), dtype=float))
    except (TypeError, ValueError):
        grid = np.empty(0)
    steps = np.diff(grid)
    if grid.ndim != 1 or not grid.size or not np.isfinite(grid).all() or not ((steps > 0).all() or (steps < 0).all()):
        raise ParameterError(f"values must be numbers of {path} that increase, or that decrease, got {values!r}", "values")
    for value in grid:
        system.with_({path: float(value)})  # refuses what the system does
    return grid


def _dataset(
    system: System, path: str, grid: np.ndarray, rows: list[Attractors], names: list[dict[int, int]], more: dict[str, Any]
) -> xarray.Dataset:
    import xarray

    coordinate_name, unit = coordinate(system)
    identities = sorted({name for row in names for name in row.values()})
    shape = (len(grid), len(identities))
    columns: dict[str, tuple[str, str, Callable[[Attractor], float]]] = {
        "fraction": ("1", "share of the initial states that end there", lambda m: m.fraction),
        "error": ("1", "binomial standard error of the share", lambda m: m.error),
        "amplitude": (unit, f"max abs({coordinate_name})", lambda m: m.amplitude),
        f"largest_{coordinate_name}": (unit, f"the largest {coordinate_name}", lambda m: m.highest),
        f"smallest_{coordinate_name}": (unit, f"the smallest {coordinate_name}", lambda m: m.lowest),
        "period": ("1", "forcing periods after which it repeats, 0 where it does not", lambda m: float(m.period)),
    }
    tables = {name: np.full(shape, np.nan) for name in columns}
    kinds = np.full(shape, "", dtype="<U16")
    for i, (row, name) in enumerate(zip(rows, names, strict=True)):
        for member in row:
            j = identities.index(name[member.label])
            kinds[i, j] = member.kind
            for key, (_, _, read) in columns.items():
                tables[key][i, j] = read(member)
    over = ("value", "attractor")
    variables: dict[str, Any] = {
        key: (over, tables[key], {"units": units, "long_name": text}) for key, (units, text, _) in columns.items()
    }
    variables["kind"] = (over, kinds, {"units": "1", "long_name": "rest, periodic, quasi-periodic or chaotic"})
    variables["undecided"] = ("value", [row.undecided for row in rows], {"units": "1", "long_name": "undecided initial states"})
    events = _events(grid, names)
    for key, text in (("kind", "birth or death"), ("label", "label"), ("before", f"{path} before"), ("after", f"{path} after")):
        variables[f"event_{key}"] = ("event", np.array([getattr(e, key) for e in events]), {"units": "1", "long_name": text})
    axes = {
        "value": ("value", grid, {"units": "1", "long_name": path}),
        "attractor": ("attractor", np.array(identities, dtype=int), {"long_name": "identity; 0 is rest"}),
    }
    return xarray.Dataset(variables, axes, provenance(system, "attractors along a parameter") | {"path": path} | more)
