"""Which simulated motions lie on stable branches: read off between the points of a branch, solved for where that leaves doubt."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from saltus.orbits import Branch, PeriodicOrbit, same_orbit
from saltus.studies.chart.motions import motion_type
from saltus.studies.diagram.simulated import SimulatedMotions


@dataclass(frozen=True)
class PlacementSettings:
    """When a simulated motion is the orbit of a branch."""

    same: float = 1e-5  # Extrema of a settled motion and of an orbit agree to this, relative to the amplitude or to 1e-3.
    least: float = 1e-3
    # Extrema between two points of a branch follow from a cubic and from a quadratic through the points about them. Where these
    # differ by more than this share of the amplitude, the orbit is solved for.
    certain: float = 1e-3
    # A motion is tried on a branch whose extrema between its points are this near, as a share of the amplitude, beside the change
    # from one of these points to the other.
    near: float = 0.05


SETTINGS = PlacementSettings()
SEEN = [1, 2, 6]  # the columns of a branch by which motions are compared with it


@dataclass(frozen=True, eq=False)
class PlacedBranch:
    """A branch with the columns in which motions are looked up."""

    branch: Branch

    @cached_property
    def columns(self) -> np.ndarray:
        """Parameter, highest, lowest, stability, period, impacts and slowest impact of each point, (7, n)."""
        rows = [
            (value, o.highest, o.lowest, o.stable, o.period, o.signature.impact_count, _slowest(o))
            for value, o in zip(self.branch.parameters.tolist(), self.branch.orbits, strict=True)
        ]
        return np.array(rows, dtype=float).reshape(-1, 7).T

    @cached_property
    def joined(self) -> np.ndarray:
        """Whether a smooth curve leads from each point to the next, (n - 1,)."""
        return np.array([self.branch.is_joined(i) for i in range(len(self.branch.points) - 1)], dtype=bool)

    def crossings(self, values: np.ndarray, stable: bool = True) -> tuple[np.ndarray, np.ndarray]:
        """Where the branch passes each of the values, with a stable point on a side of it: numbers of values, and of the points
        before; with `stable` False also where both sides repel."""
        parameter, counts = self.columns[0], (self.columns[3] > 0) | (not stable)
        if len(parameter) < 2:
            return np.empty(0, dtype=int), np.empty(0, dtype=int)
        usable = np.flatnonzero(self.joined & (counts[:-1] | counts[1:]))
        low, high = np.sort([parameter[usable], parameter[usable + 1]], axis=0)
        order = np.argsort(values)
        first, last = np.searchsorted(values[order], low, "left"), np.searchsorted(values[order], high, "right")
        number = last - first
        rank = np.arange(number.sum()) + np.repeat(first - np.cumsum(number) + number, number)
        rows, before = order[rank], np.repeat(usable, number)
        each = np.lexsort((before, rows))
        return rows[each], before[each]

    def extrema(self, value: float, before: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Extrema and slowest impact at a value after the point of this number: read off, uncertainty, change to the next.

        The uncertainty is inf where the parameter turns, or where too few points are joined.
        """
        first = max(0, before - 1)
        last = min(before + 2, len(self.columns[0]) - 1)
        parameter, extrema = self.columns[0, first : last + 1], self.columns[SEEN, first : last + 1]
        a, b = before - first, before - first + 1
        change = np.abs(extrema[:, b] - extrema[:, a])
        width = parameter[b] - parameter[a]
        share = (value - parameter[a]) / width if width else 0.0
        straight = extrema[:, a] + share * (extrema[:, b] - extrema[:, a])
        steps = np.diff(parameter)
        if last - first < 3 or not self.joined[first:last].all() or not ((steps > 0).all() or (steps < 0).all()):
            return straight, np.full(len(SEEN), np.inf), change
        cubic, quadratic = _lagrange(parameter, extrema, value), _lagrange(parameter[:3], extrema[:, :3], value)
        return cubic, np.abs(cubic - quadratic), change

    def holds(self, orbit: PeriodicOrbit, value: float) -> bool:
        """Whether an orbit at a value, stable or not, or its mirror image, lies on the branch."""
        seen = _seen(orbit)
        for before in self.crossings(np.array([value]), stable=False)[1].tolist():
            expected, _, change = self.extrema(value, before)
            near = SETTINGS.near * max(orbit.amplitude, SETTINGS.least) + 2.0 * change.max()
            if self.columns[4, before] == orbit.period and _apart(seen, expected, True) <= near:
                other = self.solved(value, before)
                if other is not None and same_orbit(orbit, other):
                    return True
        return False

    def solved(self, value: float, before: int) -> PeriodicOrbit | None:
        """The orbit at a value after the point of this number, solved there."""
        for place in (before, before + 1):
            if self.columns[0, place] == value:
                return self.branch.points[place].orbit
        points = self.branch.solved_between(before, value)
        return points[0].orbit if points else None


def _lagrange(nodes: np.ndarray, values: np.ndarray, at: float) -> np.ndarray:
    """The polynomial through values (k, n) at nodes (n,)."""
    others = [np.delete(nodes, i) for i in range(len(nodes))]
    return np.asarray(
        values @ np.array([np.prod((at - other) / (node - other)) for node, other in zip(nodes, others, strict=True)])
    )


def _slowest(orbit: PeriodicOrbit) -> float:
    """The least speed of an impact of an orbit with several contacts, 0 without impacts; else 0, as motions have it."""
    return orbit.slowest if orbit.system.model.contacts and np.isfinite(orbit.slowest) else 0.0


def _seen(orbit: PeriodicOrbit) -> np.ndarray:
    """What motions and orbits are compared by: the extrema and the slowest impact."""
    return np.array([orbit.highest, orbit.lowest, _slowest(orbit)])


def stable_motions(branches: list[PlacedBranch], grid: np.ndarray, dimension: int) -> np.ndarray:
    """The stable orbits of branches at the values of a grid, roughly, as records of a chart; their states are nan."""
    record = motion_type(dimension)
    parts = [np.zeros(0, record)]
    for branch in branches:
        cells, before = branch.crossings(grid)
        part = np.zeros(len(cells), record)
        extrema = np.array([branch.extrema(grid[c], b)[0] for c, b in zip(cells, before, strict=True)]).reshape(-1, len(SEEN))
        part["cell"], part["state"] = cells, np.nan
        part["period"], part["impact_count"] = branch.columns[4:6, before]
        part["amplitude"] = np.maximum(extrema[:, 0], -extrema[:, 1])
        part["other"], part["slowest"] = np.minimum(extrema[:, 0], -extrema[:, 1]), extrema[:, 2]
        parts.append(part)
    return np.concatenate(parts)


def placed(motions: SimulatedMotions, branches: list[PlacedBranch], mirrored: bool) -> np.ndarray:
    """Which of the motions that repeat themselves lie on a stable part of one of the branches, (n,).

    Parameters
    ----------
    motions
        What is looked for.
    branches
        Where.
    mirrored
        Whether mirror images count as one.
    """
    result = np.zeros(len(motions), dtype=bool)
    for branch in branches:
        rows, places = branch.crossings(motions.value)
        for row, before in zip(rows.tolist(), places.tolist(), strict=True):
            if not result[row] and motions.period[row] == branch.columns[4, before]:
                result[row] = _is_at(motions, row, branch, before, mirrored)
    return result


def _is_at(motions: SimulatedMotions, row: int, branch: PlacedBranch, before: int, mirrored: bool) -> bool:
    """Whether a motion is the stable orbit of a branch after the point of this number."""
    value, seen = float(motions.value[row]), np.array([motions.highest[row], motions.lowest[row], motions.slowest[row]])
    size = max(float(motions.amplitude[row]), SETTINGS.least)
    expected, uncertain, change = branch.extrema(value, before)
    apart = _apart(seen, expected, mirrored)
    if apart > SETTINGS.near * size + 2.0 * change.max():
        return False
    both_stable = bool(branch.columns[3, before : before + 2].all())
    if both_stable and uncertain.max() < SETTINGS.certain * size and apart < 2.0 * uncertain.max() + SETTINGS.same * size:
        return True
    orbit = branch.solved(value, before)
    if orbit is None or not (orbit.stable or both_stable):
        return False
    return _apart(seen, _seen(orbit), mirrored) < SETTINGS.same * size


def _apart(seen: np.ndarray, expected: np.ndarray, mirrored: bool) -> float:
    """How far two motions are apart, (highest, lowest, slowest impact)."""
    apart = float(np.abs(seen - expected).max())
    image = np.array([-expected[1], -expected[0], expected[2]])
    return min(apart, float(np.abs(seen - image).max())) if mirrored else apart
