"""Attractors along a parameter: found at every value, continued from one to the next, each with an identity of its own."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from saltus.attractors.attractor import REST, Attractor, Attractors, Target
from saltus.attractors.attractors_dataset import about, attractor_columns, variable
from saltus.attractors.find import find_attractors
from saltus.attractors.kind import AttractorKind
from saltus.checks import as_numbers, check_along, check_number, check_path
from saltus.errors import ParameterError
from saltus.progress import Progress, part_of, silent
from saltus.systems import System
from saltus.window import Box

if TYPE_CHECKING:
    import xarray


@dataclass(frozen=True)
class MatchingSettings:
    """The numbers by which an attractor is recognised at the next value of the parameter."""

    threshold: float = 0.3  # Two sets may be one attractor if their distance, relative to their size, is at most this threshold.
    other_period: float = 0.5  # A factor of the threshold for orbits of different periods, as across a period doubling.
    led: float = 3.0  # A factor of the threshold for orbits of the same period, where motions from one settle on the other.
    seeds: int = 64  # Number of states of each attractor from which motions start at the next value.
    # The share of the states of a sampled set that must be near the other set: not all are, as both are random samples.
    share: float = 0.95


SETTINGS = MatchingSettings()


def attractors_along(
    system: System,
    path: str,
    values: Iterable[float],
    *,
    window: Box | None = None,
    starts: int = 128,
    max_period: int = 16,
    seed: int = 0,
    known: Any = (),
    threshold: float = SETTINGS.threshold,
    tol: float = 1e-11,
    progress: Progress = silent,
) -> xarray.Dataset:
    """The attractors at each value of a parameter, with labels that an attractor keeps as the parameter changes.

    At each value they are found by `find_attractors`, from the same initial states and from states of the attractors at the
    value before, so that none is lost because its basin is small. Those at two neighbouring values are then matched, the nearest
    first: by the distance between the sets of their points at phase 0 (Hausdorff's, the larger of the two ways), relative to the
    size of the larger set. Half the threshold holds between different periods, as across a period doubling; three times as much
    between two of the same period if motions from all points of the one settle on the other. One that is matched to none is
    born, or has died. Rest is always 0.

    Parameters
    ----------
    system
        What moves.
    path
        Dotted path of the parameter.
    values
        Of the parameter, increasing or decreasing: identities are kept from each to the next.
    window, starts, max_period, seed, tol
        As for `find_attractors`.
    known
        Branches along the same parameter, whose stable orbits count at every value.
    threshold
        The largest relative distance of one and the same attractor at neighbouring values.
    progress
        Called with the fraction done and what is being done.

    Returns
    -------
    xarray.Dataset
        A Dataset over (value, attractor), nan where it does not exist: `fraction`, `error`, `amplitude`, `largest_...`,
        `smallest_...`, `period` (0: none), `kind` ("" where it does not exist); over (value): `undecided`; over (event):
        births and deaths.

    Raises
    ------
    ParameterError
        A path to no number, values that are not monotonic, and as for `find_attractors`.

    Examples
    --------
    >>> along = saltus.attractors_along(system, "load.frequency", [0.98, 1.0], starts=8)
    >>> along.period.values
    array([[1.],
           [1.]])
    """
    check_number("threshold", threshold, above=0.0)
    grid, followed = _values(system, path, values), _Followed(threshold, system.dimension)
    for i, value in enumerate(grid):
        here = find_attractors(
            system.with_({path: float(value)}),
            window=window,
            starts=starts,
            max_period=max_period,
            seed=seed,
            known=known,
            also=followed.seeds,
            tol=tol,
            progress=part_of(progress, i / len(grid), (i + 1) / len(grid), path),
        )
        followed.add(here)
    numbers = {"threshold": threshold, "starts": starts, "seed": seed, "tol": tol}
    return _dataset(system, path, grid, followed, numbers)


@dataclass
class _Followed:
    """The attractors at the values so far, and the identities of each by its label there."""

    threshold: float
    dimension: int  # of the states
    rows: list[Attractors] = field(default_factory=list)
    names: list[dict[int, int]] = field(default_factory=list)

    @property
    def seeds(self) -> np.ndarray:
        """States of the attractors at the last value, (n, d)."""
        last = self.rows[-1] if self.rows else ()
        return np.concatenate([np.empty((0, self.dimension)), *(member.states[-SETTINGS.seeds :] for member in last)])

    def add(self, here: Attractors) -> None:
        """Add the attractors at the next value, found from the seeds too: each goes on as the nearest one before, or is new."""
        found: dict[int, int] = {}
        for (old, new), distance in sorted(self._distances(here).items(), key=lambda item: item[1]):
            if distance < self.threshold and new not in found and self.names[-1][old] not in found.values():
                found[new] = self.names[-1][old]
        taken = max((name for row in self.names for name in row.values()), default=REST)
        for member in here:
            if member.label not in found:
                taken += member.label != REST
                found[member.label] = REST if member.label == REST else taken
        self.rows.append(here)
        self.names.append(found)

    def _distances(self, here: Attractors) -> dict[tuple[int, int], float]:
        """How far each attractor is from each of those before, by their labels."""
        if not self.rows:
            return {}
        before = self.rows[-1]
        parts = np.split(here.carried, np.cumsum([len(member.states[-SETTINGS.seeds :]) for member in before])[:-1])
        led = {old.label: set(part.tolist()) for old, part in zip(before, parts, strict=True)} if len(before) else {}
        return {(old.label, new.label): _apart(old, new, led[old.label] == {new.label}) for old in before for new in here}

    def events(self, grid: np.ndarray) -> list[tuple[str, int, float, float]]:
        """Births and deaths: their kind, the label, and the last value before them and the first one after."""
        found = []
        for i in range(1, len(grid)):
            old, new = set(self.names[i - 1].values()), set(self.names[i].values())
            edges = float(grid[i - 1]), float(grid[i])
            found += [("death", label, *edges) for label in sorted(old - new)]
            found += [("birth", label, *edges) for label in sorted(new - old)]
        return found


def set_distance(one: Target, other: Target) -> float:
    """Hausdorff's distance between two sets of points, relative to the size of the larger: its width, or its distance from 0.

    Between sampled sets 5 % of the points may lie farther away, as they are points of a random sample.
    """
    forth, back = other.distance(one.states), one.distance(other.states)
    share = SETTINGS.share if one.dense or other.dense else 1.0
    apart = max(float(np.quantile(forth, share)), float(np.quantile(back, share)))
    size = max(float(np.abs(target.states).max()) for target in (one, other))
    return apart / size if size > 0.0 else 0.0 if apart == 0.0 else np.inf


def _apart(old: Attractor, new: Attractor, led: bool) -> float:
    """The distance of two attractors, larger for different periods, and smaller where motions from one settle on the other."""
    if AttractorKind.REST in (old.kind, new.kind):
        return set_distance(old.target, new.target) if old.kind == new.kind else np.inf
    distance = set_distance(old.target, new.target)
    if old.period != new.period:
        return distance / SETTINGS.other_period
    return distance / SETTINGS.led if led else distance


def _values(system: System, path: str, values: Any) -> np.ndarray:
    check_path(system, path)
    grid = np.atleast_1d(as_numbers(values))
    steps = np.diff(grid)
    if grid.ndim != 1 or not grid.size or not np.isfinite(grid).all() or not ((steps > 0).all() or (steps < 0).all()):
        raise ParameterError(f"values must be numbers of {path} that increase, or that decrease, got {values!r}", "values")
    check_along(system, path, grid, "values")
    return grid


def _dataset(system: System, path: str, grid: np.ndarray, followed: _Followed, numbers: dict[str, Any]) -> xarray.Dataset:
    import xarray

    identities = sorted({name for row in followed.names for name in row.values()})
    columns = attractor_columns(system)
    tables = {key: np.full((len(grid), len(identities)), np.nan) for key in columns}
    kinds = np.full((len(grid), len(identities)), "", dtype="<U16")
    for i, (row, name) in enumerate(zip(followed.rows, followed.names, strict=True)):
        for member in row:
            j = identities.index(name[member.label])
            kinds[i, j] = str(member.kind)
            for key, (part, _, _) in columns.items():
                tables[key][i, j] = getattr(member, part)
    over, events = ("value", "attractor"), followed.events(grid)
    variables = {key: variable(over, tables[key], units, text) for key, (_, units, text) in columns.items()}
    variables["kind"] = variable(over, kinds, "1", "rest, periodic, quasi-periodic or chaotic")
    variables["undecided"] = variable("value", [row.undecided for row in followed.rows], "1", "undecided initial states")
    for i, (key, text) in enumerate(
        (("kind", "birth or death"), ("label", "label"), ("before", f"{path} before"), ("after", f"{path} after"))
    ):
        variables[f"event_{key}"] = variable("event", np.array([event[i] for event in events]), "1", text)
    axes = {
        "value": variable("value", grid, "1", path),
        "attractor": ("attractor", np.array(identities, dtype=int), {"long_name": "identity; 0 is rest"}),
    }
    numbers |= {"coordinate": " ".join(system.model.coordinates)}
    return xarray.Dataset(
        variables,
        axes,
        about(system, "attractors along a parameter", path=path, **numbers),
    )
