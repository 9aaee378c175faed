"""Searching for periodic orbits, stable and unstable, from many initial states at several values of a parameter."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np

from saltus.errors import ParameterError
from saltus.flow import simulate_many
from saltus.orbits.find import check_whole, orbit_near
from saltus.orbits.orbit import PeriodicOrbit
from saltus.orbits.problem import Problem
from saltus.orbits.signature import Signature
from saltus.systems import System

REGION = (1.5, 1.5)  # half widths of the region of initial states: of the first coordinate and of its velocity
SETTLE = 200  # forcing periods before the motion is taken to have settled
TRANSIENT = 24  # forcing periods of each motion in which near returns are looked for
RETURN = 0.15  # distance of a near return from which Newton's method is tried for an orbit that repels
GUESSES = 12  # the nearest returns that are tried, for each period
SETTLED = 1e-6


@dataclass(frozen=True, eq=False)
class Search:
    """What was found, and what was searched."""

    path: str
    orbits: tuple[PeriodicOrbit, ...]
    values: np.ndarray  # of the parameter
    starts: int  # at each value
    longest: int  # forcing periods
    region: tuple[float, float]
    seed: int
    unsettled: np.ndarray  # (values,): how many of the motions did not settle on an orbit of up to so many periods: slow or chaotic
    at_rest: np.ndarray  # (values,): and how many came to rest

    def __repr__(self) -> str:
        kinds = sorted({orbit.periods for orbit in self.orbits})
        stable = sum(orbit.stable for orbit in self.orbits)
        return (
            f"Search({len(self.orbits)} orbits, {stable} of them stable, of periods {kinds}; from {self.starts} states in "
            f"{self.region} at each of {len(self.values)} values of {self.path}, seed {self.seed})"
        )


def search_orbits(
    system: System,
    path: str,
    values: Iterable[float],
    *,
    longest: int = 6,
    starts: int = 48,
    region: tuple[float, float] = REGION,
    seed: int = 0,
    unstable: bool = True,
    progress: Callable[[float], object] | None = None,
) -> Search:
    """Periodic orbits of up to `longest` forcing periods at several values of a parameter, each once for each value.

    Initial states are spread evenly (a Sobol sequence) over the region around the contact, or around 0 for a model without
    one. Motions that settle lead to the attracting orbits. Returns of the motions near to where they were, on their way or in
    chaos, are first guesses for Newton's method, which finds repelling ones.

    Raises:
        ParameterError: an unknown parameter, no values, an effort without meaning.
    """
    for name, number in (("longest", longest), ("starts", starts)):
        check_whole(name, number, 1)
    system.get(path)
    grid = np.atleast_1d(np.asarray(list(values), dtype=float))
    if not grid.size or not np.isfinite(grid).all():
        raise ParameterError(f"values must be numbers of {path} at which to search, got {grid.tolist()}")
    if len(system.model.coordinates) > 1:
        raise ParameterError("search_orbits works on models with one coordinate; use find_orbit from your own states")
    states = initial_states(system, starts, region, seed)
    strobes = _strobes(system, path, grid, states, longest)
    found: list[PeriodicOrbit] = []
    unsettled, at_rest = np.zeros(len(grid), dtype=int), np.zeros(len(grid), dtype=int)
    for i, value in enumerate(grid):
        base = Problem(system.with_({path: float(value)}), Signature((), 1), (path,))
        early, late = strobes[0][i], strobes[1][i]
        moving = np.isfinite(late).all(axis=(1, 2)) & (np.abs(late - _contact(system)).max(axis=(1, 2)) > 1e-6)
        at_rest[i] = int((~moving).sum())
        here, unsettled[i] = _attracting(base, late[moving], longest)
        if unstable:
            here += _repelling(base, np.concatenate([early[moving], late[moving]]), longest, here)
        found += here
        if progress is not None:
            progress((i + 1) / len(grid))
    return Search(path, tuple(found), grid, starts, longest, region, seed, unsettled, at_rest)


def initial_states(system: System, count: int, region: tuple[float, float], seed: int) -> np.ndarray:
    """(count, 2): coordinates and velocities spread over the region, on the side of the contact where motions are."""
    from scipy.stats import qmc

    points = 2.0 * qmc.Sobol(2, seed=seed).random(1 << max(0, (count - 1).bit_length()))[:count] - 1.0
    states = points * np.asarray(region)
    model = system.model
    if len(model.sides) == 1:
        inward = np.sign(float(model.gap(model.contact + 1.0, model.sides[0])))
        states[:, 0] = inward * np.abs(states[:, 0])
    return states + np.array([_contact(system)[0], 0.0])


def _contact(system: System) -> np.ndarray:
    return np.array([float(system.model.contact) if system.model.sides else 0.0, 0.0])


def _strobes(system: System, path: str, grid: np.ndarray, states: np.ndarray, longest: int) -> tuple[np.ndarray, np.ndarray]:
    """States at the ends of forcing periods, (values, starts, periods, 2): early ones, and those after settling."""
    name = system.model.coordinates[0]

    def run(theta: Any, velocity: Any, periods: int, last: int) -> np.ndarray:
        result = simulate_many(
            system, **{name: theta}, velocity=velocity, parameters={path: grid[:, None]}, periods=periods, last=last, tol=1e-11
        )
        return np.stack([result[f"sampled_{name}"].values, result["sampled_velocity"].values], axis=-1)

    early = run(states[None, :, 0], states[None, :, 1], *[max(TRANSIENT, longest + 1)] * 2)
    late = run(early[:, :, -1, 0], early[:, :, -1, 1], SETTLE, max(TRANSIENT, longest + 1))
    return early, late


def _attracting(base: Problem, late: np.ndarray, longest: int) -> tuple[list[PeriodicOrbit], int]:
    """The orbits on which settled motions are, and how many motions have not settled."""
    found: list[PeriodicOrbit] = []
    known = np.empty((0, 2))
    unsettled = 0
    for strobes in late:
        if known.size and np.abs(known - strobes[-1]).max(axis=1).min() < 1e-5:
            continue
        period = next((q for q in range(1, longest + 1) if np.abs(strobes[-1] - strobes[-1 - q]).max() < SETTLED), None)
        if period is None:
            unsettled += 1
            continue
        known = np.concatenate([known, strobes[-period:]])
        orbit = _newton(base, strobes[-1], period)
        if orbit is not None:
            _add(found, orbit)
    return found, unsettled


def _repelling(base: Problem, strobes: np.ndarray, longest: int, known: list[PeriodicOrbit]) -> list[PeriodicOrbit]:
    """Orbits near which motions return to where they were."""
    found: list[PeriodicOrbit] = []
    for q in range(1, longest + 1):
        if strobes.shape[1] <= q:
            break
        distance = np.abs(strobes[:, q:] - strobes[:, :-q]).max(axis=2)
        states, distance = strobes[:, :-q].reshape(-1, 2), distance.ravel()
        order = np.argsort(distance)
        tried: list[np.ndarray] = []
        for i in order:
            if not SETTLED < distance[i] < RETURN or len(tried) >= GUESSES:
                if distance[i] >= RETURN or len(tried) >= GUESSES:
                    break
                continue
            if any(np.abs(states[i] - other).max() < 0.05 for other in tried):
                continue
            tried.append(states[i])
            orbit = _newton(base, states[i], q)
            if orbit is not None and not any(same_orbit(orbit, other) for other in known):
                _add(found, orbit)
    return found


def _newton(base: Problem, state: np.ndarray, period: int) -> PeriodicOrbit | None:
    from saltus.errors import MotionError

    name = base.system.model.coordinates[0]
    try:
        orbit = orbit_near(base, {name: float(state[0]), "velocity": float(state[1])}, period)
    except MotionError:
        return None
    return orbit if orbit is not None and orbit.admissible and orbit.amplitude > 1e-6 else None


def _add(found: list[PeriodicOrbit], orbit: PeriodicOrbit) -> None:
    if not any(same_orbit(orbit, other) for other in found):
        found.append(orbit)


def same_orbit(a: PeriodicOrbit, b: PeriodicOrbit, mirrored: bool = True) -> bool:
    """Whether two orbits of one system are the same, or mirror images; by their period, impacts, speeds and extrema."""
    if (a.periods, a.signature.crossings) != (b.periods, b.signature.crossings):
        return False
    one, other = np.array([a.highest, a.lowest]), np.array([b.highest, b.lowest])
    same = np.abs(one - other).max() < 1e-6 or (mirrored and np.abs(one + other[::-1]).max() < 1e-6)
    if not same or a.speeds.size == 0:
        return bool(same)
    return bool(np.abs(np.sort(a.speeds) - np.sort(b.speeds)).max() < 1e-6)
