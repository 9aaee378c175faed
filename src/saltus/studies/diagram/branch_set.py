"""The branches of one diagram, each orbit that is found followed once, and which simulated motions
lie on them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from saltus.orbits import Branch, PeriodicOrbit, SpecialKind, SpecialPoint, same_orbit
from saltus.progress import Progress, part_of, silent
from saltus.studies.chart.motions import motion_type
from saltus.studies.diagram.diagram_work import DiagramWork, Request
from saltus.studies.diagram.simulated import SimulatedMotions
from saltus.systems import NaturalUnits, System, natural_units


@dataclass(frozen=True)
class PlacementSettings:
    """When a simulated motion is the orbit of a branch."""

    # Lengths and speeds are in natural units. The extrema of a settled motion and of its orbit
    # agree to this share of the amplitude, or of `least` if that is larger.
    same: float = 1e-5
    least: float = 1e-3
    # Extrema between two points of a branch are interpolated by a cubic and by a quadratic through
    # the points about them. If the two differ by more than this share of the amplitude, the orbit
    # is solved for.
    certain: float = 1e-3
    # The orbit is solved for if a motion's extrema differ from the interpolated ones by less than
    # this share of the amplitude and twice the change of the extrema between the two points.
    near: float = 0.05
    # Least speeds of impacts below this are taken as this. In an accumulation, a motion has as many
    # impacts as were followed, and an orbit lists those above 1e-5, so that their slowest impacts
    # differ.
    slow: float = 2e-4


PLACEMENT = PlacementSettings()
SEEN = [1, 2, 6]  # the columns of a branch by which motions are compared with it


@dataclass(frozen=True, eq=False)
class PlacedBranch:
    """A branch with the columns in which motions are looked up."""

    branch: Branch

    @cached_property
    def columns(self) -> np.ndarray:
        """Parameter, highest, lowest, stability, period, impacts and slowest impact of each point,
        (7, n), the latter as a length: in natural times.
        """
        units = self.units
        rows = [
            (value, *o.reach[::-1], o.stable, o.period, o.impact_count, _seen(o, units)[2])
            for value, o in zip(self.branch.parameters.tolist(), self.branch.orbits, strict=True)
        ]
        return np.array(rows, dtype=float).reshape(-1, 7).T

    @cached_property
    def units(self) -> NaturalUnits:
        """The natural units of the first system of the branch, for all of its orbits."""
        return natural_units(self.branch.orbits[0].system)

    @cached_property
    def joined(self) -> np.ndarray:
        """Whether a smooth curve leads from each point to the next, (n - 1,)."""
        return np.array(
            [self.branch.is_joined(i) for i in range(len(self.branch.points) - 1)], dtype=bool
        )

    @cached_property
    def stable_ends(self) -> np.ndarray:
        """Indices of the special points at which stability changes or, where there is none, of the
        last stable ones, (n,).
        """
        stable = self.columns[3] > 0
        special = np.isin(self.columns[0], [each.parameter for each in self.branch.special])
        before = np.flatnonzero(stable[:-1] != stable[1:])
        last = np.where(stable[before], before, before + 1)
        beyond = 2 * before + 1 - last
        return np.unique(np.where(special[beyond], beyond, last))

    @cached_property
    def _joins(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """The points that a smooth curve joins to the next one, and the least and the largest
        parameter between the two, (m,).
        """
        parameter = self.columns[0]
        usable = np.flatnonzero(self.joined)
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
        return (
            float(self.columns[0].min()),
            float(self.columns[0].max()),
            set(self.columns[4].tolist()),
        )

    def may_hold(self, low: float, high: float, periods: set[int]) -> bool:
        """Whether an orbit of one of these periods, at a value from `low` to `high`, may lie on the
        branch: a fast test, as most orbits are looked for on a hundred branches and are far from
        nearly all of them."""
        least, most, own = self._reach
        return least <= high and low <= most and not own.isdisjoint(periods)

    def crossings(self, values: np.ndarray, stable: bool = True) -> tuple[np.ndarray, np.ndarray]:
        """Where the branch passes the values: the indices of the values, and those of the branch's
        points before them.

        With `stable`, one of the points on both sides of a value must be stable.
        """
        usable, low, high = self._stable_joins if stable else self._joins
        order = np.argsort(values, kind="stable")
        first = np.searchsorted(values[order], low, "left")
        last = np.searchsorted(values[order], high, "right")
        number = last - first
        rank = np.arange(number.sum()) + np.repeat(first - np.cumsum(number) + number, number)
        rows = order[rank]
        before = np.repeat(usable, number)
        each = np.lexsort((before, rows))
        return rows[each], before[each]

    def extrema(
        self, values: np.ndarray, before: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Extrema and slowest impact at values (k,) after the points of these indices,
        interpolated, (k, 3); their uncertainty, (k,); and how much they change from one point to
        the next, (k,).

        The uncertainty is inf where the parameter turns, or where too few points are joined.
        """
        here = self.columns[SEEN][:, before]
        there = self.columns[SEEN][:, before + 1]
        parameter = self.columns[0]
        width = np.diff(self.columns[0])[before]
        share = np.divide(
            values - parameter[before], width, out=np.zeros(len(values)), where=width != 0.0
        )
        read = here + share * (there - here)
        uncertain = np.full(len(values), np.inf)
        smooth = np.flatnonzero(self._smooth[before])
        four = before[smooth, None] + np.arange(-1, 3)
        nodes = parameter[four]
        seen = self.columns[SEEN][:, four]
        cubic = _lagrange(nodes, seen, values[smooth])
        quadratic = _lagrange(nodes[:, :3], seen[..., :3], values[smooth])
        read[:, smooth] = cubic
        uncertain[smooth] = np.abs(cubic - quadratic).max(axis=0)
        return read.T, uncertain, np.abs(there - here).max(axis=0)

    @cached_property
    def _smooth(self) -> np.ndarray:
        """Whether a point, the next one and the neighbours of both are joined and the parameter
        does not turn there, (n,).
        """
        smooth = np.zeros(len(self.columns[0]), dtype=bool)
        steps = np.diff(self.columns[0])
        if len(steps) >= 3:
            three = np.lib.stride_tricks.sliding_window_view(
                np.where(self.joined, np.sign(steps), 0.0), 3
            )
            smooth[1:-2] = np.abs(three.sum(axis=1)) == 3.0
        return smooth

    def holds(self, orbit: PeriodicOrbit, value: float) -> bool:
        """Whether an orbit at a value of the parameter, stable or not, or its mirror image, lies on
        the branch.
        """
        if not self.may_hold(value, value, {orbit.period}):
            return False
        seen = _seen(orbit, self.units)
        for before in self.crossings(np.array([value]), stable=False)[1].tolist():
            # a cubic may be far off beside narrow peaks
            ends = self.columns[SEEN][:, before : before + 2].T
            near = (
                PLACEMENT.near * max(orbit.size, PLACEMENT.least * self.units.length)
                + 2.0 * np.abs(ends[1] - ends[0]).max()
            )
            if (
                self.columns[4, before] == orbit.period
                and min(_apart(seen, end, True) for end in ends) <= near
            ):
                other = self.solved(value, before)
                if other is not None and same_orbit(orbit, other):
                    return True
        return False

    def solved(self, value: float, before: int) -> PeriodicOrbit | None:
        """The orbit at a value of the parameter after the point of this index, solved for; None if
        that fails.
        """
        there = [
            self.branch.points[place]
            for place in (before, before + 1)
            if self.columns[0, place] == value
        ]
        points = there or self.branch.solved_between(before, value)
        return points[0].orbit if points else None


def _lagrange(nodes: np.ndarray, values: np.ndarray, at: np.ndarray) -> np.ndarray:
    """Lagrange's polynomials of degree m - 1 through values (n, k, m) at nodes (k, m), each at its
    place `at` (k,), (n, k).
    """
    result = np.zeros(values.shape[:2])
    for i in range(nodes.shape[1]):
        others = nodes[:, [j for j in range(nodes.shape[1]) if j != i]]
        result += values[..., i] * np.prod(
            (at[:, None] - others) / (nodes[:, i, None] - others), axis=1
        )
    return result


def _least_speed(system: System, units: NaturalUnits) -> float:
    """The least speed of an impact by which motions and orbits are told apart, times the natural
    time; 0 where motions are told by their extrema.
    """
    return PLACEMENT.slow * units.length if system.model.names_its_contacts else 0.0


def _seen(orbit: PeriodicOrbit, units: NaturalUnits) -> np.ndarray:
    """The quantities by which motions and orbits are compared, as lengths: the extrema, and the
    slowest impact in the natural time.
    """
    least = _least_speed(orbit.system, units)
    slowest = orbit.slowest * units.time
    return np.array(
        [
            *orbit.reach[::-1],
            max(slowest, least) if least and slowest < np.inf else least,
        ]
    )


def stable_motions(
    branches: list[PlacedBranch], grid: np.ndarray, system: System, middle: float
) -> np.ndarray:
    """The stable orbits of branches at the values of a grid, by interpolation, as records of a
    chart, with extrema from the `middle` on and speeds in natural times; their states are nan.
    """
    record = motion_type(system.dimension)
    time = natural_units(system).time
    parts = [np.zeros(0, record)]
    for branch in branches:
        cells, before = branch.crossings(grid)
        part = np.zeros(len(cells), record)
        extrema = branch.extrema(grid[cells], before)[0]
        part["cell"] = cells
        part["state"] = np.nan
        part["period"], part["impact_count"] = branch.columns[4:6, before]
        high, low = extrema[:, 0] - middle, middle - extrema[:, 1]
        part["amplitude"] = np.maximum(high, low)
        part["other"] = np.minimum(high, low)
        part["slowest"] = extrema[:, 2] * (time / branch.units.time)
        parts.append(part)
    return np.concatenate(parts)


def placed(
    motions: SimulatedMotions, branches: list[PlacedBranch], middle: float | None
) -> np.ndarray:
    """Which of the motions that repeat themselves lie on a stable part of one of the branches,
    (n,).

    Parameters
    ----------
    motions
        The motions that are looked for.
    branches
        The branches on which they are looked for.
    middle
        About this place a motion also lies on a branch if its mirror image does; None if it does
        not.
    """
    result = np.zeros(len(motions), dtype=bool)
    low = motions.value.min(initial=np.inf)
    high = motions.value.max(initial=-np.inf)
    periods = set(motions.period.tolist())
    for branch in (branch for branch in branches if branch.may_hold(low, high, periods)):
        rows, before = branch.crossings(motions.value)
        rows, before = (
            each[~result[rows] & (motions.period[rows] == branch.columns[4, before])]
            for each in (rows, before)
        )
        expected, uncertain, change = branch.extrema(motions.value[rows], before)
        units = branch.units
        slowest = motions.slowest[rows] * units.time
        least = _least_speed(branch.branch.orbits[0].system, units)
        seen = np.stack(
            [motions.highest[rows], motions.lowest[rows], np.maximum(slowest, least)], axis=1
        )
        apart = _apart(seen, expected, middle)
        size = np.maximum(motions.amplitude[rows], PLACEMENT.least * units.length)
        both_stable = (branch.columns[3, before] > 0) & (branch.columns[3, before + 1] > 0)
        sure = (
            both_stable
            & (uncertain < PLACEMENT.certain * size)
            & (apart < 2.0 * uncertain + PLACEMENT.same * size)
        )
        result[rows[sure]] = True
        for i in np.flatnonzero(~sure & (apart <= PLACEMENT.near * size + 2.0 * change)).tolist():
            if not result[rows[i]]:
                orbit = branch.solved(float(motions.value[rows[i]]), int(before[i]))
                if orbit is not None and (orbit.stable or both_stable[i]):
                    result[rows[i]] = (
                        _apart(seen[i], _seen(orbit, units), middle) < PLACEMENT.same * size[i]
                    )
    return result


def _apart(seen: np.ndarray, expected: np.ndarray, middle: float | None) -> np.ndarray:
    """The largest difference of (highest, lowest, slowest impact); with a `middle` also to the
    mirror image about it, the smaller one.
    """
    apart = np.abs(seen - expected).max(axis=-1)
    if middle is None:
        return np.asarray(apart)
    twice = 2.0 * middle
    image = np.stack(
        [twice - expected[..., 1], twice - expected[..., 0], expected[..., 2]], axis=-1
    )
    return np.asarray(np.minimum(apart, np.abs(seen - image).max(axis=-1)))


BRANCHING = (SpecialKind.PD, SpecialKind.BPC, SpecialKind.CH)  # at which other families begin


@dataclass(frozen=True)
class BranchSettings:
    """How far branches are followed, and which of the branches that are born on others."""

    # Along a frequency, families of periods above 1 are followed up to this many times the upper
    # bound, as many of them close.
    beyond_frequency: float = 20.0
    # Along other parameters few of them close; they are followed up to this many times the upper
    # bound.
    beyond: float = 1.3
    # Branches born on one that covers less than this share of the range are not followed.
    narrow: float = 0.02
    # A branch is not followed if its first orbit is smaller than this share of its parent's largest
    # orbit: near rest a branch has infinitely many special points, each at a smaller orbit than the
    # one before.
    visible: float = 0.01
    # The end of a branch is the special point of another one if parameters differ by no more than
    # this share, and amplitudes by no more than this in natural units.
    same_place: float = 1e-6
    # Step along a parent's branch from the special point at which a family ends on it: at the point
    # itself test functions vanish.
    beside: float = 1e-3


BRANCHES = BranchSettings()


@dataclass
class BranchSet:
    """The branches that are known so far; up to which period, how far and how finely branches are
    followed.
    """

    work: DiagramWork
    bounds: tuple[float, float]
    max_period: int
    step: float
    switch: bool
    most: int  # once there are this many branches, those born on others are not followed any more
    placed: list[PlacedBranch] = field(default_factory=list)
    # the branches whose special points were followed up
    grown: set[int] = field(default_factory=set)
    # the branches that were followed only while they are stable
    partial: set[int] = field(default_factory=set)
    # the partial branches that turned out to be parts of others
    parts: set[int] = field(default_factory=set)
    # with how many branches each partial branch was compared
    compared: dict[int, int] = field(default_factory=dict)
    left: int = 0  # special points at which a family is born that is not followed

    def add_branches_of(
        self, orbit: PeriodicOrbit, while_stable: bool = False, progress: Progress = silent
    ) -> None:
        """Follow an orbit unless it lies on a known branch: either only while it is stable, or all
        the way, and then also the parents' branches at whose special points its branch ends."""
        if while_stable and not self.knows(orbit):
            self.placed.append(PlacedBranch(self._continued(orbit, progress, while_stable=True)))
            self.partial.add(id(self.placed[-1]))
        waiting = [] if while_stable else [orbit]
        while waiting:
            waiting += self._follow(waiting.pop(0), progress)

    def prepare(self, orbits: Sequence[tuple[PeriodicOrbit, bool]]) -> None:
        """Compute the branches of orbits that lie on no known one at the same time; the second
        entry of each pair says whether the orbit is followed only while it is stable."""
        self.work.prepare(
            [self.request(orbit, stable) for orbit, stable in orbits if not self.knows(orbit)]
        )

    def grow(self, progress: Progress) -> None:
        """Follow the families that are born on the branches, those of the widest branch first."""
        while self.switch:
            widest = max(
                (b for b in self._whole if id(b) not in self.grown), key=self._width, default=None
            )
            if widest is None:
                return
            self.grown.add(id(widest))
            self._grow(
                widest, part_of(progress, 1.0, 1.0, f"following, branches: {len(self.placed)}")
            )

    @property
    def branches(self) -> list[Branch]:
        """The branches, in the order in which they were followed, without those that turned out to
        be parts of others.
        """
        return [
            placed.branch
            for placed in self.placed
            if not (id(placed) in self.partial and self._is_part(placed))
        ]

    @property
    def _whole(self) -> list[Branch]:
        """The branches that were followed all the way."""
        return [placed.branch for placed in self.placed if id(placed) not in self.partial]

    def _is_part(self, partial: PlacedBranch) -> bool:
        """Whether a branch that was followed only while it is stable is a part of one that was
        followed all the way.

        It is compared only with the branches that are new since the last time.
        """
        key = id(partial)
        points = partial.branch.points
        if key not in self.parts:
            inner = points[len(points) // 2].orbit
            value = float(inner.solution.values[0])
            new = self.placed[self.compared.get(key, 0) :]
            self.compared[key] = len(self.placed)
            if any(other.holds(inner, value) for other in new if id(other) not in self.partial):
                self.parts.add(key)
        return key in self.parts

    def _continued(
        self, orbit: PeriodicOrbit, progress: Progress, while_stable: bool = False
    ) -> Branch:
        return self.work.branches_of([self.request(orbit, while_stable)], progress)[0][0]

    def request(self, start: PeriodicOrbit | SpecialPoint, while_stable: bool = False) -> Request:
        """The request for the branch of an orbit, or for the branches that are born at a special
        point.
        """
        period = _period_born(start) if isinstance(start, SpecialPoint) else start.period
        return Request(start, self._range(period), self.step, while_stable)

    def _follow(self, orbit: PeriodicOrbit, progress: Progress) -> list[PeriodicOrbit]:
        """Follow an orbit unless it lies on a known branch; returns an orbit of each parent's
        branch on which its branch ends.
        """
        if self.knows(orbit):
            return []
        branch = self._continued(orbit, progress)
        self.placed.append(PlacedBranch(branch))
        specials = filter(self._is_branching, branch.special) if self.switch else ()
        return [
            beside
            for special in specials
            if _is_parent(special, branch)
            for beside in _beside(special)
        ]

    def _grow(self, branch: Branch, progress: Progress) -> None:
        """Follow the families that are born on a branch."""
        narrow = self._width(branch) < BRANCHES.narrow * (self.bounds[1] - self.bounds[0])
        own = [
            special
            for special in filter(self._is_branching, branch.special)
            if not _is_parent(special, branch)
        ]
        visible = {
            id(special): special.orbit.size >= BRANCHES.visible * branch.sizes.max()
            for special in own
        }
        # a family often ends at the next special point, so only every other one is computed in
        # advance
        if not narrow:
            ahead = [
                special
                for special in own
                if visible[id(special)] and not self._is_followed(special)
            ]
            self.work.prepare(
                [
                    self.request(special)
                    for special in ahead[: max(0, self.most - len(self.placed)) : 2]
                ]
            )
        for special in own:
            if self._is_followed(special):
                continue
            if narrow or not visible[id(special)] or len(self.placed) >= self.most:
                self.left += 1
            else:
                self.placed += map(PlacedBranch, self._born_at(special, progress))

    def _width(self, branch: Branch) -> float:
        """The part of the range that a branch covers."""
        low, high = np.clip([branch.parameters.min(), branch.parameters.max()], *self.bounds)
        return float(high - low)

    def knows(self, orbit: PeriodicOrbit) -> bool:
        """Whether an orbit, or its mirror image, lies on a branch."""
        value = float(orbit.solution.values[0])
        return any(placed.holds(orbit, value) for placed in self.placed)

    def _is_branching(self, special: SpecialPoint) -> bool:
        """Whether a special point lies within the bounds, and orbits of at most the longest period
        are born at it.
        """
        inside = self.bounds[0] <= special.parameter <= self.bounds[1]
        return inside and special.kind in BRANCHING and _period_born(special) <= self.max_period

    def _born_at(self, special: SpecialPoint, progress: Progress) -> list[Branch]:
        """The branches that begin at a special point, without those that are known already."""
        born = self.work.branches_of([self.request(special)], progress)[0]
        return [
            branch
            for branch in born
            if not self.knows(branch.points[len(branch.points) // 2].orbit)
        ]

    def _is_followed(self, special: SpecialPoint) -> bool:
        """Whether a branch of the orbits that are born at a special point begins or ends there."""
        for branch in self._whole:
            for place, inner, end in zip((0, -1), (1, -2), branch.ends, strict=True):
                last = branch.points[place].orbit
                family = branch.points[inner].orbit if len(branch.points) > 2 else last
                if (
                    special.kind == end.kind
                    and family.period == _period_born(special)
                    and _meet(last, special, self.bounds)
                ):
                    return True
        return False

    def _range(self, period: int) -> tuple[float, float]:
        """The bounds within which a family is followed: those of the diagram or, if it may be a
        loop, with a higher upper one.
        """
        low, high = self.bounds
        reach = BRANCHES.beyond_frequency if self.work.path == "load.frequency" else BRANCHES.beyond
        return (low, high) if period == 1 else (low, max(high, reach * high))


def _period_born(special: SpecialPoint) -> int:
    """The period of the orbits that are born at a special point."""
    return special.orbit.signature.period * (2 if special.kind == SpecialKind.PD else 1)


def _meet(end: PeriodicOrbit, special: SpecialPoint, bounds: tuple[float, float]) -> bool:
    """Whether the orbit at a branch's end is the special point of another one, in a diagram between
    these bounds."""
    near = BRANCHES.same_place * max(map(abs, (special.parameter, *bounds)))
    length = natural_units(special.orbit.system).length
    return (
        abs(end.solution.values[0] - special.parameter) < near
        and abs(end.size - special.orbit.size) < BRANCHES.same_place * length
    )


def _is_parent(special: SpecialPoint, branch: Branch) -> bool:
    """Whether a special point at the end of a branch belongs to the parent's branch, on which the
    branch is born.
    """
    inner = branch.points[len(branch.points) // 2].orbit
    return special.orbit.period < inner.period or (special.orbit.symmetric and not inner.symmetric)


def _beside(special: SpecialPoint) -> list[PeriodicOrbit]:
    """An orbit next to a special point, on the branch to which the point belongs; empty if there is
    none.
    """
    point = special.point.beside(BRANCHES.beside)
    return [] if point is None or not point.orbit.admissible else [point.orbit]
