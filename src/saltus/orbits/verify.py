"""Orbits compared with one another, and checked by direct simulation, many at once in lanes."""

from __future__ import annotations

from typing import Any

import numpy as np

from saltus.checks import answered, check_count
from saltus.flow import simulate_many
from saltus.orbits.contract.sampled_motion import DYING
from saltus.orbits.orbit import PeriodicOrbit
from saltus.orbits.signature import TOLERANCES
from saltus.systems import System, natural_units


def same_orbit(a: PeriodicOrbit, b: PeriodicOrbit, mirrored: bool = True) -> bool:
    """Whether two orbits of one system are the same, or mirror images: if their periods, impact
    counts, speeds and extrema agree."""
    if (a.period, a.signature.impact_count) != (b.period, b.signature.impact_count):
        return False
    natural = a.equations.natural
    one = np.array(a.reach[::-1]) / natural.length
    other = np.array(b.reach[::-1]) / natural.length
    same = np.abs(one - other).max() < TOLERANCES.same_orbit or (
        mirrored and np.abs(one + other[::-1]).max() < TOLERANCES.same_orbit
    )
    return bool(same) and _same_speeds(
        np.sort(a.speeds)[::-1] / natural.speed, np.sort(b.speeds)[::-1] / natural.speed
    )


def _same_speeds(one: np.ndarray, other: np.ndarray) -> bool:
    """Whether two lists of speeds, in natural units and in falling order, agree; one may be longer by very slow impacts,
    since rounding decides which impact of an accumulation is the last one that is listed."""
    n = min(one.size, other.size)
    last = np.append(one[n:], other[n:]).max(initial=0.0)
    return bool(
        np.abs(one[:n] - other[:n]).max(initial=0.0) < TOLERANCES.same_orbit and last < 2.0 * DYING
    )


@answered
def defects(orbits: list[PeriodicOrbit], rounds: int = 1, tol: float = 1e-13) -> np.ndarray:
    """The distance of each orbit's state from itself after `rounds` of its periods, by the
    event-driven flow, (n,), in natural units of the state variables.

    All orbits must belong to one system, which may differ in the parameter along their common path,
    if they have one. An orbit that starts after its first impact ends at this impact, and rounding
    decides whether before or after it: the smaller distance counts.

    Parameters
    ----------
    orbits
        The orbits, n of them.
    rounds
        After how many of their periods.
    tol
        The error that one step may make.

    Raises
    ------
    ParameterError
        One of `orbits` is no orbit.

    Examples
    --------
    >>> bool(saltus.orbits.defects(branch.orbits[:3]).max() < 1e-10)
    True
    """
    check_count("rounds", rounds, 1)
    orbits = list(orbits)
    if len(orbits) == 0:
        return np.zeros(0)
    equations = orbits[0].equations
    return closing_distances(
        equations.given, next(iter(equations.paths), None), closing_rows(orbits, rounds), tol
    )


def closing_rows(orbits: list[PeriodicOrbit], rounds: int = 1) -> np.ndarray:
    """One row for each orbit, (n, m), as `closing_distances` takes them.

    It has the parameter along the common path, if there is one, then the state at the start and its
    time. Behind these are the speed before the first impact (-1 without), and the forcing periods,
    or the time of a cycle.
    """
    rows = []
    for orbit in orbits:
        start = orbit.start()
        names = orbit.system.model.coordinates
        velocities = np.atleast_1d(start["velocity"])
        speed = orbit.speeds[0] if orbit.signature.sides else -1.0
        ends = [start.get("time", 0.0), speed, rounds * orbit.period]
        rows.append(
            [*orbit.solution.values[:1], *(start[name] for name in names), *velocities, *ends]
        )
    return np.array(rows, dtype=float).reshape(len(orbits), -1)


def closing_distances(
    system: System, path: str | None, rows: np.ndarray, tol: float = 1e-13
) -> np.ndarray:
    """The distance of each orbit's state from itself at the end of its motion, from rows that
    `closing_rows` gives, (n,), in natural units of the state variables.
    """
    units = natural_units(system)
    names = system.model.coordinates
    moving = system.model.moving
    count = len(names)
    result = np.full(len(rows), np.inf)
    for periods in np.unique(rows[:, -1]):
        places = rows[:, -1] == periods
        *columns, times, speeds, _ = rows[places].T
        varied, states = ({path: columns[0]}, columns[1:]) if path is not None else ({}, columns)
        begin = dict(zip(names, states, strict=False))
        # that of a cycle without a load is a time
        forced = system.load.period is not None
        lasting = {"periods": int(periods)} if forced else {"duration": float(periods)}
        velocities = states[count:]
        velocity: Any = (
            velocities[0] if len(moving) == 1 else tuple(velocities[: len(moving)]) or 0.0
        )
        ends = simulate_many(
            system,
            **begin,
            velocity=velocity,
            time=times,
            parameters=varied,
            **lasting,
            sample=(),
            tol=tol,
        )
        apart = np.max(
            [
                np.abs(ends[name].values - begin[name]) / unit
                for name, unit in zip(names, units.lengths, strict=True)
            ],
            axis=0,
        )
        if moving == names and count == 1:
            after = ends["velocity"].values
            before = np.where(speeds < 0.0, np.inf, speeds)
            either = np.minimum(np.abs(after - velocity), np.abs(np.abs(after) - before))
            either /= units.speed
        else:
            speeds_after = [ends[f"{name}_velocity"].values for name in moving]
            either = np.max(
                [
                    np.abs(a - b) / unit
                    for a, b, unit in zip(speeds_after, velocities, units.speeds, strict=False)
                ]
                or [0.0 * apart],
                axis=0,
            )
        result[places] = np.maximum(apart, either)
    return result
