"""The branches of one diagram: each orbit that is found is followed once, and so are the families born on its branch."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from saltus.orbits import Branch, PeriodicOrbit, SpecialKind, SpecialPoint
from saltus.progress import Progress, part_of, silent
from saltus.studies.diagram.diagram_work import DiagramWork, Request
from saltus.studies.diagram.placement import PlacedBranch

BRANCHING = (SpecialKind.PD, SpecialKind.BPC)  # at which other families are born


@dataclass(frozen=True)
class BranchSettings:
    """How far branches are followed, and which of the branches that are born on others."""

    # Along a frequency, families of periods above 1 are followed up to this many times the upper bound, as many of them close.
    beyond_frequency: float = 20.0
    beyond: float = 1.3  # Along other parameters few of them close; they are followed up to this many times the upper bound.
    narrow: float = 0.02  # Branches born on one that covers less than this share of the range are not followed.
    # A branch is not followed if its first orbit is smaller than this share of its parent's largest orbit: near rest a branch has
    # infinitely many special points, each at a smaller orbit than the one before.
    visible: float = 0.01
    # The end of a branch is the special point of another one if parameters and amplitudes differ by no more than this.
    same_place: float = 1e-6
    # Step along a parent's branch from the special point at which a family ends on it: at the point itself test functions vanish.
    beside: float = 1e-3


SETTINGS = BranchSettings()


@dataclass
class BranchSet:
    """The branches that are known so far; up to which period, how far and how finely branches are followed."""

    work: DiagramWork
    bounds: tuple[float, float]
    max_period: int
    step: float
    switch: bool
    most: int  # once there are this many branches, those born on others are not followed any more
    placed: list[PlacedBranch] = field(default_factory=list)
    grown: set[int] = field(default_factory=set)  # the branches whose special points were followed up
    partial: set[int] = field(default_factory=set)  # the branches that were followed only while they are stable
    parts: set[int] = field(default_factory=set)  # the partial branches that turned out to be parts of others
    compared: dict[int, int] = field(default_factory=dict)  # with how many branches each partial branch was compared
    left: int = 0  # special points at which a family is born that is not followed

    def follow(self, orbit: PeriodicOrbit, while_stable: bool = False, progress: Progress = silent) -> None:
        """Follow an orbit unless it lies on a known branch: either only while it is stable, or all the way, and then also the
        parents' branches at whose special points its branch ends."""
        if while_stable and not self.knows(orbit):
            self.placed.append(PlacedBranch(self._continued(orbit, progress, while_stable=True)))
            self.partial.add(id(self.placed[-1]))
        waiting = [] if while_stable else [orbit]
        while waiting:
            waiting += self._follow(waiting.pop(0), progress)

    def prepare(self, orbits: Sequence[tuple[PeriodicOrbit, bool]]) -> None:
        """Compute the branches of orbits that lie on no known one at the same time; the second entry of each pair says whether
        the orbit is followed only while it is stable."""
        self.work.prepare([self.request(orbit, stable) for orbit, stable in orbits if not self.knows(orbit)])

    def grow(self, progress: Progress) -> None:
        """Follow the families that are born on the branches, those of the widest branch first."""
        while self.switch:
            widest = max((b for b in self._whole if id(b) not in self.grown), key=self._width, default=None)
            if widest is None:
                return
            self.grown.add(id(widest))
            self._grow(widest, part_of(progress, 1.0, 1.0, f"following, branches: {len(self.placed)}"))

    @property
    def branches(self) -> list[Branch]:
        """The branches, in the order in which they were followed, without those that turned out to be parts of others."""
        return [placed.branch for placed in self.placed if not (id(placed) in self.partial and self._is_part(placed))]

    @property
    def _whole(self) -> list[Branch]:
        """The branches that were followed all the way."""
        return [placed.branch for placed in self.placed if id(placed) not in self.partial]

    def _is_part(self, partial: PlacedBranch) -> bool:
        """Whether a branch that was followed only while it is stable is a part of one that was followed all the way.

        It is compared only with the branches that are new since the last time.
        """
        key, points = id(partial), partial.branch.points
        if key not in self.parts:
            inner = points[len(points) // 2].orbit
            value, new = float(inner.solution.values[0]), self.placed[self.compared.get(key, 0) :]
            self.compared[key] = len(self.placed)
            if any(other.holds(inner, value) for other in new if id(other) not in self.partial):
                self.parts.add(key)
        return key in self.parts

    def _continued(self, orbit: PeriodicOrbit, progress: Progress, while_stable: bool = False) -> Branch:
        return self.work.follow([self.request(orbit, while_stable)], progress)[0][0]

    def request(self, start: PeriodicOrbit | SpecialPoint, while_stable: bool = False) -> Request:
        """The request for the branch of an orbit, or for the branches that are born at a special point."""
        period = _period_born(start) if isinstance(start, SpecialPoint) else start.period
        return Request(start, self._range(period), self.step, while_stable)

    def _follow(self, orbit: PeriodicOrbit, progress: Progress) -> list[PeriodicOrbit]:
        """Follow an orbit unless it lies on a known branch; returns an orbit of each parent's branch on which its branch ends."""
        if self.knows(orbit):
            return []
        branch = self._continued(orbit, progress)
        self.placed.append(PlacedBranch(branch))
        specials = filter(self._is_branching, branch.special) if self.switch else ()
        return [beside for special in specials if _is_parent(special, branch) for beside in _beside(special)]

    def _grow(self, branch: Branch, progress: Progress) -> None:
        """Follow the families that are born on a branch."""
        narrow = self._width(branch) < SETTINGS.narrow * (self.bounds[1] - self.bounds[0])
        own = [special for special in filter(self._is_branching, branch.special) if not _is_parent(special, branch)]
        visible = {id(special): special.amplitude >= SETTINGS.visible * branch.amplitudes.max() for special in own}
        if not narrow:  # a family often ends at the next special point, so only every other one is computed in advance
            ahead = [special for special in own if visible[id(special)] and not self._is_followed(special)]
            self.work.prepare([self.request(special) for special in ahead[: max(0, self.most - len(self.placed)) : 2]])
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
        """Whether a special point lies within the bounds, and orbits of at most the longest period are born at it."""
        inside = self.bounds[0] <= special.parameter <= self.bounds[1]
        return inside and special.kind in BRANCHING and _period_born(special) <= self.max_period

    def _born_at(self, special: SpecialPoint, progress: Progress) -> list[Branch]:
        """The branches that begin at a special point, without those that are known already."""
        born = self.work.follow([self.request(special)], progress)[0]
        return [branch for branch in born if not self.knows(branch.points[len(branch.points) // 2].orbit)]

    def _is_followed(self, special: SpecialPoint) -> bool:
        """Whether a branch of the orbits that are born at a special point begins or ends there."""
        for branch in self._whole:
            for place, inner, end in zip((0, -1), (1, -2), branch.ends, strict=True):
                last = branch.points[place].orbit
                family = branch.points[inner].orbit if len(branch.points) > 2 else last
                if special.kind == end.kind and family.period == _period_born(special) and _meet(last, special):
                    return True
        return False

    def _range(self, period: int) -> tuple[float, float]:
        """The bounds within which a family is followed: those of the diagram or, if it may be a loop, with a higher upper one."""
        low, high = self.bounds
        reach = SETTINGS.beyond_frequency if self.work.path == "load.frequency" else SETTINGS.beyond
        return (low, high) if period == 1 else (low, max(high, reach * high))


def _period_born(special: SpecialPoint) -> int:
    """The period of the orbits that are born at a special point."""
    return special.orbit.period * (2 if special.kind == SpecialKind.PD else 1)


def _meet(end: PeriodicOrbit, special: SpecialPoint) -> bool:
    """Whether the orbit at a branch's end is the special point of another one."""
    near = SETTINGS.same_place * max(1.0, abs(special.parameter))
    return abs(end.solution.values[0] - special.parameter) < near and abs(end.amplitude - special.amplitude) < near


def _is_parent(special: SpecialPoint, branch: Branch) -> bool:
    """Whether a special point at the end of a branch belongs to the parent's branch, on which the branch is born."""
    inner = branch.points[len(branch.points) // 2].orbit
    return special.orbit.period < inner.period or (special.orbit.symmetric and not inner.symmetric)


def _beside(special: SpecialPoint) -> list[PeriodicOrbit]:
    """An orbit next to a special point, on the branch to which the point belongs; empty if there is none."""
    point = special.point.beside(SETTINGS.beside)
    return [] if point is None or not point.orbit.admissible else [point.orbit]
