"""Which simulated motions lie on stable branches: by interpolation between a branch's points, or by solving for the orbit."""

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

    # The extrema of a settled motion and of its orbit agree to this share of the amplitude, or of `least` if that is larger.
    same: float = 1e-5
    least: float = 1e-3
    # Extrema between two points of a branch are interpolated by a cubic and by a quadratic through the points about them. If the
    # two differ by more than this share of the amplitude, the orbit is solved for.
    certain: float = 1e-3
    # The orbit is solved for if a motion's extrema differ from the interpolated ones by less than this share of the amplitude and
    # twice the change of the extrema between the two points.
    near: float = 0.05
    # Least speeds of impacts below this are taken as this. In an accumulation, a motion has as many impacts as were followed, and
    # an orbit lists those above 1e-5, so that their slowest impacts differ.
    slow: float = 2e-4


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

    @cached_property
    def _joins(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """The points that a smooth curve joins to the next one, and the least and the largest parameter between the two, (m,)."""
        parameter, usable = self.columns[0], np.flatnonzero(self.joined)
        return usable, *np.sort([parameter[usable], parameter[usable + 1]], axis=0)

    @cached_property
    def _stable_joins(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Those of `_joins` of which one of the two points is stable."""
        usable, low, high = self._joins
        counts = (self.columns[3, usable] > 0) | (self.columns[3, usable + 1] > 0)
        return usable[counts], low[counts], high[counts]

    @cached_property
    def _reach(self) -> tuple[float, float, set[float]]:
        """The least and the largest parameter, and the periods of the orbits."""
        parameter, period = self.columns[0], self.columns[4]
        return float(parameter.min()), float(parameter.max()), set(period.tolist())

    def may_hold(self, low: float, high: float, periods: set[int]) -> bool:
        """Whether an orbit of one of these periods, at a value from `low` to `high`, may lie on the branch: a fast test, as most
        orbits are looked for on a hundred branches and are far from nearly all of them."""
        least, most, own = self._reach
        return least <= high and low <= most and not own.isdisjoint(periods)

    def crossings(self, values: np.ndarray, stable: bool = True) -> tuple[np.ndarray, np.ndarray]:
        """Where the branch passes the values: the indices of the values, and those of the branch's points before them.

        With `stable`, one of the points on both sides of a value must be stable.
        """
        usable, low, high = self._stable_joins if stable else self._joins
        order = np.argsort(values)
        first, last = np.searchsorted(values[order], low, "left"), np.searchsorted(values[order], high, "right")
        number = last - first
        rank = np.arange(number.sum()) + np.repeat(first - np.cumsum(number) + number, number)
        rows, before = order[rank], np.repeat(usable, number)
        each = np.lexsort((before, rows))
        return rows[each], before[each]

    def extrema(self, values: np.ndarray, before: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Extrema and slowest impact at values (k,) after the points of these indices, interpolated, (k, 3); their uncertainty,
        (k,); and how much they change from one point to the next, (k,).

        The uncertainty is inf where the parameter turns, or where too few points are joined.
        """
        here, there = self.columns[SEEN][:, before], self.columns[SEEN][:, before + 1]
        parameter = self.columns[0]
        width = parameter[before + 1] - parameter[before]
        share = np.divide(values - parameter[before], width, out=np.zeros(len(values)), where=width != 0.0)
        read, uncertain = here + share * (there - here), np.full(len(values), np.inf)
        smooth = np.flatnonzero(self._smooth[before])
        four = before[smooth, None] + np.arange(-1, 3)
        nodes, seen = parameter[four], self.columns[SEEN][:, four]
        cubic, quadratic = _lagrange(nodes, seen, values[smooth]), _lagrange(nodes[:, :3], seen[..., :3], values[smooth])
        read[:, smooth], uncertain[smooth] = cubic, np.abs(cubic - quadratic).max(axis=0)
        return read.T, uncertain, np.abs(there - here).max(axis=0)

    @cached_property
    def _smooth(self) -> np.ndarray:
        """Whether a point, the next one and the neighbours of both are joined and the parameter does not turn there, (n,)."""
        smooth, steps = np.zeros(len(self.columns[0]), dtype=bool), np.diff(self.columns[0])
        if len(steps) >= 3:
            three = np.lib.stride_tricks.sliding_window_view(np.where(self.joined, np.sign(steps), 0.0), 3)
            smooth[1:-2] = np.abs(three.sum(axis=1)) == 3.0
        return smooth

    def holds(self, orbit: PeriodicOrbit, value: float) -> bool:
        """Whether an orbit at a value of the parameter, stable or not, or its mirror image, lies on the branch."""
        if not self.may_hold(value, value, {orbit.period}):
            return False
        seen = _seen(orbit)
        for before in self.crossings(np.array([value]), stable=False)[1].tolist():
            ends = self.columns[SEEN][:, before : before + 2].T  # a cubic may be far off beside narrow peaks
            near = SETTINGS.near * max(orbit.amplitude, SETTINGS.least) + 2.0 * np.abs(ends[1] - ends[0]).max()
            if self.columns[4, before] == orbit.period and min(_apart(seen, end, True) for end in ends) <= near:
                other = self.solved(value, before)
                if other is not None and same_orbit(orbit, other):
                    return True
        return False

    def solved(self, value: float, before: int) -> PeriodicOrbit | None:
        """The orbit at a value of the parameter after the point of this index, solved for; None if that fails."""
        for place in (before, before + 1):
            if self.columns[0, place] == value:
                return self.branch.points[place].orbit
        points = self.branch.solved_between(before, value)
        return points[0].orbit if points else None


def _lagrange(nodes: np.ndarray, values: np.ndarray, at: np.ndarray) -> np.ndarray:
    """Lagrange's polynomials of degree m - 1 through values (n, k, m) at nodes (k, m), each at its place `at` (k,), (n, k)."""
    result = np.zeros(values.shape[:2])
    for i in range(nodes.shape[1]):
        others = nodes[:, [j for j in range(nodes.shape[1]) if j != i]]
        result += values[..., i] * np.prod((at[:, None] - others) / (nodes[:, i, None] - others), axis=1)
    return result


def _slowest(orbit: PeriodicOrbit) -> float:
    """The least speed of an impact of an orbit, at least `SETTINGS.slow`; 0 for models with one contact, as motions have it."""
    if not orbit.system.model.names_its_contacts:
        return 0.0
    return max(orbit.slowest if np.isfinite(orbit.slowest) else 0.0, SETTINGS.slow)


def _seen(orbit: PeriodicOrbit) -> np.ndarray:
    """The quantities by which motions and orbits are compared: the extrema and the slowest impact."""
    return np.array([orbit.highest, orbit.lowest, _slowest(orbit)])


def stable_motions(branches: list[PlacedBranch], grid: np.ndarray, dimension: int) -> np.ndarray:
    """The stable orbits of branches at the values of a grid, by interpolation, as records of a chart; their states are nan."""
    record = motion_type(dimension)
    parts = [np.zeros(0, record)]
    for branch in branches:
        cells, before = branch.crossings(grid)
        part = np.zeros(len(cells), record)
        extrema = branch.extrema(grid[cells], before)[0]
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
        The motions that are looked for.
    branches
        The branches on which they are looked for.
    mirrored
        Whether a motion also lies on a branch if its mirror image does.
    """
    result = np.zeros(len(motions), dtype=bool)
    least = SETTINGS.slow if branches and branches[0].branch.orbits[0].system.model.names_its_contacts else 0.0
    every = np.stack([motions.highest, motions.lowest, np.maximum(motions.slowest, least)], axis=1)
    sizes = np.maximum(motions.amplitude, SETTINGS.least)
    low, high, periods = motions.value.min(initial=np.inf), motions.value.max(initial=-np.inf), set(motions.period.tolist())
    for branch in (branch for branch in branches if branch.may_hold(low, high, periods)):
        rows, before = branch.crossings(motions.value)
        rows, before = (each[~result[rows] & (motions.period[rows] == branch.columns[4, before])] for each in (rows, before))
        expected, uncertain, change = branch.extrema(motions.value[rows], before)
        apart, size = _apart(every[rows], expected, mirrored), sizes[rows]
        both_stable = (branch.columns[3, before] > 0) & (branch.columns[3, before + 1] > 0)
        sure = both_stable & (uncertain < SETTINGS.certain * size) & (apart < 2.0 * uncertain + SETTINGS.same * size)
        result[rows[sure]] = True
        for i in np.flatnonzero(~sure & (apart <= SETTINGS.near * size + 2.0 * change)).tolist():
            if not result[rows[i]]:
                orbit = branch.solved(float(motions.value[rows[i]]), int(before[i]))
                if orbit is not None and (orbit.stable or both_stable[i]):
                    result[rows[i]] = _apart(every[rows[i]], _seen(orbit), mirrored) < SETTINGS.same * size[i]
    return result


def _apart(seen: np.ndarray, expected: np.ndarray, mirrored: bool) -> np.ndarray:
    """The largest difference of (highest, lowest, slowest impact); with `mirrored` also to the mirror image, the smaller one."""
    apart = np.abs(seen - expected).max(axis=-1)
    image = np.stack([-expected[..., 1], -expected[..., 0], expected[..., 2]], axis=-1)
    return np.asarray(np.minimum(apart, np.abs(seen - image).max(axis=-1)) if mirrored else apart)
