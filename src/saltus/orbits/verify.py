"""Orbits compared with one another, and checked by direct simulation: many at once, in lanes."""

from __future__ import annotations

from typing import Any

import numpy as np

from saltus.checks import check_count, check_kind
from saltus.flow import simulate_many
from saltus.orbits.orbit import PeriodicOrbit
from saltus.orbits.tolerances import TOLERANCES
from saltus.public_functions import answered


def same_orbit(a: PeriodicOrbit, b: PeriodicOrbit, mirrored: bool = True) -> bool:
    """Whether two orbits of one system are the same, or mirror images; by their period, impacts, speeds and extrema."""
    if (a.period, a.signature.impact_count) != (b.period, b.signature.impact_count):
        return False
    one, other = np.array([a.highest, a.lowest]), np.array([b.highest, b.lowest])
    same = np.abs(one - other).max() < TOLERANCES.same_orbit or (
        mirrored and np.abs(one + other[::-1]).max() < TOLERANCES.same_orbit
    )
    if not same or a.speeds.size == 0:
        return bool(same)
    return bool(np.abs(np.sort(a.speeds) - np.sort(b.speeds)).max() < TOLERANCES.same_orbit)


@answered
def defects(orbits: list[PeriodicOrbit], rounds: int = 1, tol: float = 1e-13) -> np.ndarray:
    """The distance of each orbit's state from itself after so many of its periods, by the event-driven flow, (n,).

    All must belong to one system but for its parameters along their common path, if they have one. A motion that starts after its
    first impact ends with that impact, before or after it as rounding decides: the nearer counts.

    Raises:
        ParameterError: what is no orbit.
    """
    for orbit in orbits:
        check_kind("orbits", orbit, PeriodicOrbit, source="find_orbit or search_orbits")
    check_count("rounds", rounds, 1)
    result = np.full(len(orbits), np.inf)
    groups: dict[int, list[int]] = {}
    for i, orbit in enumerate(orbits):
        groups.setdefault(orbit.period, []).append(i)
    for periods, places in groups.items():
        result[places] = _defects([orbits[i] for i in places], rounds * periods, tol)
    return result


def _defects(orbits: list[PeriodicOrbit], periods: int, tol: float) -> np.ndarray:
    problem = orbits[0].problem
    system, values = problem.system, np.array([orbit.solution.values for orbit in orbits])
    names = system.model.coordinates
    starts = [orbit.start() for orbit in orbits]
    begin: dict[str, Any] = {name: np.array([start[name] for start in starts], dtype=float) for name in names}
    velocity: Any = np.array([start["velocity"] for start in starts], dtype=float)
    times = np.array([start.get("time", 0.0) for start in starts])
    columns = velocity if velocity.ndim == 1 else tuple(velocity.T)
    varied = dict(zip(problem.paths[:1], values.T, strict=False))
    result = simulate_many(system, **begin, velocity=columns, time=times, parameters=varied, periods=periods, sample=(), tol=tol)
    apart = np.max([np.abs(result[name].values - begin[name]) for name in names], axis=0)
    after = result["velocity"].values if velocity.ndim == 1 else None
    if after is None:
        ends = np.stack([result[f"{name}_velocity"].values for name in names], axis=1)
        return np.asarray(np.maximum(apart, np.abs(ends - velocity).max(axis=1)))
    before = np.array([orbit.speeds[0] if orbit.signature.sides else np.inf for orbit in orbits])
    either = np.minimum(np.abs(after - velocity), np.abs(np.abs(after) - before))
    return np.asarray(np.maximum(apart, either))
