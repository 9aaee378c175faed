"""Searching for periodic orbits, stable and unstable, from many initial states at several values of
a parameter.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from saltus.checks import as_numbers, check_count, check_starts
from saltus.errors import ParameterError, shown
from saltus.flow import Recurrence, driven_range, find_recurrence, simulate, unit_of
from saltus.orbits.finding.from_motion import NEAR_RETURNS, orbits_near_returns, solved_near
from saltus.orbits.orbit import PeriodicOrbit
from saltus.orbits.verify import same_orbit
from saltus.progress import Progress, silent
from saltus.result import Result, result_dataset
from saltus.systems import (
    Box,
    System,
    Window,
    arguments_of,
    check_path,
    check_system,
    check_window,
    driven_displacement,
    initial_states,
    is_still,
    natural_units,
    rest_state,
)

if TYPE_CHECKING:
    import xarray


@dataclass(frozen=True)
class SearchSettings:
    """How long motions are followed, and which of their states may lead to orbits."""

    settling: int = 200  # Number of forcing periods for which motions are followed to settle.
    # Number of forcing periods, at the beginning of each motion and at its end, in which near
    # returns are looked for.
    transient: int = 24


SETTINGS = SearchSettings()


@dataclass(frozen=True)
class Settled:
    """The periodic motions on which direct simulation has settled, one entry of each array for each
    of them.
    """

    value: np.ndarray  # of the parameter
    period: np.ndarray  # forcing periods after which the motion repeats itself
    highest: np.ndarray  # the largest value over that time of the displacement that the load drives
    lowest: np.ndarray

    @property
    def amplitude(self) -> np.ndarray:
        """max abs of the coordinate."""
        return np.asarray(np.maximum(np.abs(self.highest), np.abs(self.lowest)))


@dataclass(frozen=True, eq=False)
class Search(Result):
    """The result of a search for orbits: the orbits, and the effort that was made.

    Attributes
    ----------
    system
        The system that was searched.
    path
        The dotted path of the parameter.
    orbits
        The orbits that were found.
    values
        The values of the parameter at which the search was made.
    starts
        How many initial states there were at each value.
    max_period
        The longest period that was looked for, in forcing periods.
    window
        The window of the initial states.
    seed
        The seed of the initial states.
    unsettled
        How many motions did not settle on an orbit of up to `max_period`, as they are slow or
        chaotic, (values,).
    at_rest
        How many motions came to rest, (values,).
    settled
        The periodic attractors as direct simulation shows them.

    Examples
    --------
    >>> found = saltus.search_orbits(system, "load.frequency", [1.0], max_period=1, starts=8)
    >>> found.at_rest, found.unsettled
    (array([0]), array([0]))
    """

    system: System
    path: str
    orbits: tuple[PeriodicOrbit, ...]
    values: np.ndarray
    starts: int
    max_period: int
    window: Window
    seed: int
    unsettled: np.ndarray
    at_rest: np.ndarray
    settled: Settled

    def to_xarray(self) -> xarray.Dataset:
        """The orbits over `orbit`, the numbers of unsettled and of resting motions over `value`,
        settled motions over `motion`."""
        name = driven_displacement(self.system)
        unit = unit_of(self.system, name)
        text = f"max abs({name})"
        columns: dict[str, tuple[Any, ...]] = {
            "parameter": (
                "orbit",
                [float(orbit.solution.values[0]) for orbit in self.orbits],
                "1",
                self.path,
            ),
            "amplitude": ("orbit", [orbit.amplitude for orbit in self.orbits], unit, text),
            "period": (
                "orbit",
                np.array([orbit.period for orbit in self.orbits], dtype=int),
                "1",
                "forcing periods",
            ),
            "stable": (
                "orbit",
                np.array([orbit.stable for orbit in self.orbits], dtype=np.int8),
                "1",
                "1 where it is stable",
            ),
            "unsettled": ("value", self.unsettled, "1", "motions that did not settle on an orbit"),
            "at_rest": ("value", self.at_rest, "1", "motions that came to rest"),
            "settled_parameter": ("motion", self.settled.value, "1", self.path),
            "settled_amplitude": (
                "motion",
                self.settled.amplitude,
                unit,
                f"{text} of what simulation has settled on",
            ),
            "settled_period": ("motion", self.settled.period, "1", "its forcing periods"),
        }
        facts = {
            "path": self.path,
            "starts": self.starts,
            "max_period": self.max_period,
            "coordinate": name,
        }
        return result_dataset(
            "orbits", columns, {"value": self.values}, self.system, seed=self.seed, **facts
        )

    def __repr__(self) -> str:
        kinds = sorted({orbit.period for orbit in self.orbits})
        stable = sum(orbit.stable for orbit in self.orbits)
        return (
            f"Search({len(self.orbits)} orbits, {stable} of them stable, of periods {kinds}; from"
            f" {self.starts} states in {tuple(self.window)} at each of {len(self.values)} values of"
            f" {self.path}, seed {self.seed})"
        )


def search_orbits(
    system: System,
    path: str,
    values: Iterable[float],
    *,
    max_period: int = 6,
    starts: int = 48,
    window: Box | None = None,
    seed: int = 0,
    repelling: int | None = None,
    progress: Progress = silent,
) -> Search:
    """Periodic orbits of up to `max_period` forcing periods at several values of a parameter, each
    once for each value.

    Initial states are spread evenly (a sequence of low discrepancy) over a window of the states, as
    in `find_attractors`; by default the window has half widths of 1.5 natural units around the contact,
    or around 0 for a model without one. Motions that settle lead to the attracting orbits. Where motions in a
    transient or in chaos come back near to an earlier state, Newton's method begins and finds
    repelling orbits of up to `repelling` forcing periods.

    Parameters
    ----------
    system
        What moves, under a load with a frequency.
    path
        The dotted path of the parameter.
    values
        Its values at which to search.
    max_period
        The longest period, in forcing periods.
    starts
        How many initial states there are at each value.
    window
        A pair (low, high) for each coordinate, then for each velocity; by default half widths of
        1.5 natural units around the contact.
    seed
        The seed of the initial states.
    repelling
        The longest period of repelling orbits, by default `max_period`; 0 looks for none.
    progress
        Called with the fraction done and what is being done.

    Raises
    ------
    ParameterError
        The parameter is unknown, there are no values, or another argument has no meaning.

    Examples
    --------
    >>> found = saltus.search_orbits(system, "load.frequency", [1.0], max_period=1, starts=8)
    >>> len(found.orbits)
    1
    """
    check_system(system, "search_orbits", several_contacts=True, multipliers=True, switches=True)
    check_count("max_period", max_period, 1)
    if repelling is not None:
        check_count("repelling", repelling, 0)
    check_starts(starts)
    check_count("seed", seed, 0)
    check_path(system, path)
    area = check_window(window, system)
    grid = np.atleast_1d(as_numbers(values, "values"))
    if grid.ndim != 1 or not grid.size or not np.isfinite(grid).all():
        raise ParameterError(
            f"values must be numbers of {path} at which to search, got {shown(values)}", "values"
        )
    early, late = _follow(
        system, path, grid, initial_states(system, starts, area, seed), max_period
    )
    found: list[PeriodicOrbit] = []
    known: list[np.ndarray] = []
    returning = np.zeros((len(grid), starts), dtype=bool)
    unsettled = np.zeros(len(grid), dtype=int)
    at_rest = np.zeros(len(grid), dtype=int)
    settled: list[tuple[float, int, float, float]] = []
    for i, value in enumerate(grid):
        moving, at_rest[i] = _moving(system, late, np.arange(i * starts, (i + 1) * starts))
        here, seen, attracting, unsettled[i] = _attracting(
            system.with_({path: float(value)}), path, late.only(moving)
        )
        settled += [(float(value), *row) for row in seen]
        found, known = found + here, [*known, attracting]
        returning[i, moving - i * starts] = True
        progress(0.5 * (i + 1) / len(grid), "searching")
    shape = (len(grid), starts, -1, system.dimension)
    states = np.concatenate([early.states.reshape(shape), late.states.reshape(shape)], axis=1)
    states[~np.tile(returning, (1, 2))] = np.nan
    near = orbits_near_returns(
        system, path, grid, states, known, max_period if repelling is None else repelling
    )
    found = sorted(found + near, key=lambda orbit: float(orbit.solution.values[0]))
    progress(1.0, "searching")
    columns = np.array(settled, dtype=float).reshape(-1, 4).T
    dots = Settled(columns[0], columns[1].astype(int), columns[2], columns[3])
    return Search(
        system, path, tuple(found), grid, starts, max_period, area, seed, unsettled, at_rest, dots
    )


def _follow(
    system: System, path: str, grid: np.ndarray, states: np.ndarray, max_period: int
) -> tuple[Recurrence, Recurrence]:
    """Motions from the same states at every value, one row for each: their first forcing periods,
    and those until they settle.
    """
    kept = max(SETTINGS.transient, max_period + 1)
    parameters = {path: np.repeat(grid, len(states))}
    options: dict[str, Any] = {
        "parameters": parameters,
        "max_period": max_period,
        "kept": kept,
        "stop_early": False,
    }
    early = find_recurrence(system, np.tile(states, (len(grid), 1)), kept, **options)
    begin = np.where(np.isfinite(early.states[:, -1]), early.states[:, -1], rest_state(system))
    return early, find_recurrence(system, begin, SETTINGS.settling, extrema=True, **options)


def _moving(system: System, late: Recurrence, rows: np.ndarray) -> tuple[np.ndarray, int]:
    """Which of these motions go on without resting at the contact, and how many rest there."""
    assert late.extrema is not None
    alive = rows[np.isfinite(late.states[rows]).all(axis=(1, 2))]
    high = late.extrema[alive, :, 0].max(axis=1, initial=-np.inf)
    low = late.extrema[alive, :, 1].min(axis=1, initial=np.inf)
    moving = alive[~is_still(system, high, low, NEAR_RETURNS.still * natural_units(system).length)]
    return moving, len(alive) - len(moving)


def _attracting(
    system: System, path: str, late: Recurrence
) -> tuple[list[PeriodicOrbit], list[tuple[int, float, float]], np.ndarray, int]:
    """The orbits of settled motions; period and extrema of each as simulated; their states at phase
    0; and the number of motions that have not settled."""
    found: list[PeriodicOrbit] = []
    seen: list[tuple[int, float, float]] = []
    known = np.empty((0, system.dimension))
    unsettled = 0
    for states, period, highest, lowest in zip(
        late.states, late.period.tolist(), late.highest, late.lowest, strict=True
    ):
        apart = np.abs((known - states[-1]) / natural_units(system).state)
        if known.size and apart.max(axis=1).min() < NEAR_RETURNS.same_state:
            continue
        if not period:
            unsettled += 1
            continue
        known = np.concatenate([known, states[-period:]])
        if len(system.model.coordinates) > 1:
            motion = simulate(system, **arguments_of(system, states[-1]), periods=period)
            lowest, highest = driven_range(motion)
        seen.append((period, float(highest), float(lowest)))
        orbit = solved_near(system, path, states[-1], period)
        if orbit is not None:
            _add(found, orbit)
    return found, seen, known, unsettled


def _add(found: list[PeriodicOrbit], orbit: PeriodicOrbit) -> None:
    if not any(same_orbit(orbit, other) for other in found):
        found.append(orbit)
