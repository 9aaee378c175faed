"""Attractors along a parameter: found at every value, and recognised from one value to the next."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from saltus.attractors.attractor import (
    REST,
    Attractor,
    Attractors,
    Target,
    about,
    attractor_columns,
    variable,
)
from saltus.attractors.attractor_search import find_attractors
from saltus.checks import as_numbers, check_number
from saltus.errors import ParameterError, shown
from saltus.flow import Ending
from saltus.progress import Progress, part_of, silent
from saltus.systems import Box, System, check_along, check_path, size_with_sides

if TYPE_CHECKING:
    import xarray


@dataclass(frozen=True)
class MatchingSettings:
    """The numbers by which an attractor is recognised at the next value of the parameter."""

    # Two sets may be one attractor if their distance, relative to their size, is below this
    # threshold.
    threshold: float = 0.3
    # A factor of the threshold for orbits of different periods, as across a period doubling.
    other_period: float = 0.5
    # A factor of the threshold for orbits of the same period, if motions from one settle on the
    # other.
    led: float = 3.0
    # Number of states of each attractor from which motions start at the next value.
    seeds: int = 64
    # The share of the states of a sampled set that must be near the other set; some may not be, as
    # both are random samples.
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
    """The attractors at each value of a parameter, with labels that an attractor keeps as the
    parameter changes.

    At each value they are found by `find_attractors`, from the same initial states and from states
    of the attractors at the value before. So none is lost because its basin is small. The
    attractors at two neighbouring values are then matched, the nearest pair first. Their distance
    is Hausdorff's, between the sets of their points at phase 0, relative to the size of the larger
    set. Between attractors of different periods, as across a period doubling, the threshold is half
    as large; between two of the same period it is three times as large if motions from all points
    of the first settle on the second. An attractor without a match is born, or has died. Rest
    always has the label 0.

    Parameters
    ----------
    system
        What moves.
    path
        Dotted path of the parameter.
    values
        Values of the parameter, increasing or decreasing; attractors are matched from each to the
        next.
    window, starts, max_period, seed, tol
        As for `find_attractors`.
    known
        Branches along the same parameter, whose stable orbits count as attractors at every value.
    threshold
        The largest relative distance between the states of one attractor at two neighbouring
        values.
    progress
        Called with the fraction done and what is being done.

    Returns
    -------
    xarray.Dataset
        A Dataset. Over (value, attractor), nan where the attractor does not exist: `fraction`,
        `error`, `amplitude`, `largest_...`, `smallest_...`, `period` (0: none), `kind` ("" where it
        does not exist). Over (value): `undecided`. Over (event): births and deaths.

    Raises
    ------
    ParameterError
        A path that leads to no number, values that are not monotonic; else as for
        `find_attractors`.

    Examples
    --------
    >>> along = saltus.attractors_along(system, "load.frequency", [0.98, 1.0], starts=8)
    >>> along.period.values
    array([[1.],
           [1.]])
    """
    check_number("threshold", threshold, above=0.0)
    grid = _values(system, path, values)
    followed = _Followed(threshold, size_with_sides(system))
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
    """The attractors at the values so far, and for each value the identities of its attractors by
    their labels there.
    """

    threshold: float
    dimension: int  # of the states
    rows: list[Attractors] = field(default_factory=list)
    names: list[dict[int, int]] = field(default_factory=list)

    @property
    def seeds(self) -> np.ndarray:
        """States of the attractors at the last value, (n, d)."""
        last = self.rows[-1] if self.rows else ()
        return np.concatenate(
            [np.empty((0, self.dimension)), *(member.states[-SETTINGS.seeds :] for member in last)]
        )

    def add(self, here: Attractors) -> None:
        """Add the attractors at the next value: each gets the identity of the nearest one at the
        value before, or a new one.
        """
        found: dict[int, int] = {}
        for (old, new), distance in sorted(self._distances(here).items(), key=lambda item: item[1]):
            if (
                distance < self.threshold
                and new not in found
                and self.names[-1][old] not in found.values()
            ):
                found[new] = self.names[-1][old]
        taken = max((name for row in self.names for name in row.values()), default=REST)
        for member in here:
            if member.label not in found:
                taken += member.label != REST
                found[member.label] = REST if member.label == REST else taken
        self.rows.append(here)
        self.names.append(found)

    def _distances(self, here: Attractors) -> dict[tuple[int, int], float]:
        """The distance of each attractor from each one at the value before, by their labels (old,
        new).
        """
        if not self.rows:
            return {}
        before = self.rows[-1]
        parts = np.split(
            here.carried,
            np.cumsum([len(member.states[-SETTINGS.seeds :]) for member in before])[:-1],
        )
        led = (
            {old.label: set(part.tolist()) for old, part in zip(before, parts, strict=True)}
            if len(before)
            else {}
        )
        return {
            (old.label, new.label): _apart(old, new, led[old.label] == {new.label})
            for old in before
            for new in here
        }

    def events(self, grid: np.ndarray) -> list[tuple[str, int, float, float]]:
        """Births and deaths: their kind, the label, and the last value before them and the first
        one after.
        """
        found = []
        for i in range(1, len(grid)):
            old = set(self.names[i - 1].values())
            new = set(self.names[i].values())
            edges = float(grid[i - 1]), float(grid[i])
            found += [("death", label, *edges) for label in sorted(old - new)]
            found += [("birth", label, *edges) for label in sorted(new - old)]
        return found


def set_distance(one: Target, other: Target) -> float:
    """Hausdorff's distance between two sets of states, relative to their largest absolute value of
    a variable, both in natural units.

    If one of the sets is a sample, 5 % of the states may lie farther away.
    """
    forth = other.distance(one.states)
    back = one.distance(other.states)
    share = SETTINGS.share if one.dense or other.dense else 1.0
    apart = max(float(np.quantile(forth, share)), float(np.quantile(back, share)))
    size = max(float(np.abs(target.states / target.units).max()) for target in (one, other))
    return apart / size if size > 0.0 else 0.0 if apart == 0.0 else np.inf


def _apart(old: Attractor, new: Attractor, led: bool) -> float:
    """The distance of two attractors, scaled up for different periods, and down where motions from
    the old one settle on the new one."""
    if Ending.REST in (old.kind, new.kind):
        return set_distance(old.target, new.target) if old.kind == new.kind else np.inf
    distance = set_distance(old.target, new.target)
    if old.period != new.period:
        return distance / SETTINGS.other_period
    return distance / SETTINGS.led if led else distance


def _values(system: System, path: str, values: Any) -> np.ndarray:
    check_path(system, path)
    grid = np.atleast_1d(as_numbers(values, "values"))
    steps = np.diff(grid)
    if (
        grid.ndim != 1
        or not grid.size
        or not np.isfinite(grid).all()
        or not ((steps > 0).all() or (steps < 0).all())
    ):
        raise ParameterError(
            (f"values must be numbers of {path} that increase or decrease, got {shown(values)}"),
            "values",
        )
    check_along(system, path, grid, "values")
    return grid


def _dataset(
    system: System, path: str, grid: np.ndarray, followed: _Followed, numbers: dict[str, Any]
) -> xarray.Dataset:
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
    over = ("value", "attractor")
    events = followed.events(grid)
    variables = {
        key: variable(over, tables[key], units, text) for key, (_, units, text) in columns.items()
    }
    variables["kind"] = variable(over, kinds, "1", "rest, periodic, quasi-periodic or chaotic")
    variables["undecided"] = variable(
        "value", [row.undecided for row in followed.rows], "1", "undecided initial states"
    )
    for i, (key, text) in enumerate(
        (
            ("kind", "birth or death"),
            ("label", "label"),
            ("before", f"{path} before"),
            ("after", f"{path} after"),
        )
    ):
        variables[f"event_{key}"] = variable(
            "event", np.array([event[i] for event in events]), "1", text
        )
    axes = {
        "value": variable("value", grid, "1", path),
        "attractor": (
            "attractor",
            np.array(identities, dtype=int),
            {"long_name": "identity; 0 is rest"},
        ),
    }
    numbers |= {"coordinate": " ".join(system.model.coordinates)}
    return xarray.Dataset(
        variables,
        axes,
        about(system, "attractors along a parameter", path=path, **numbers),
    )
