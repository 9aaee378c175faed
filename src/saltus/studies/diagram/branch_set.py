"""The branches of one diagram: each orbit that is found is followed once, and so is what is born on its branch."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from saltus.orbits import Branch, PeriodicOrbit, SpecialKind, SpecialPoint, continue_orbit, same_orbit, switch_branch

FOLLOWED = 20.0  # times the range's upper end: how far families of a longer period are followed along a frequency,
BEYOND = 1.3  # and along anything else, where few of them close
MOST_BRANCHES = 30  # beyond which nothing more is followed that is born on another branch
NARROW = 0.02  # of the range: on a narrower branch nothing is followed that is born there
SAME_PLACE = 1e-6  # between a branch's end and the special point of another one that it is
BRANCHING = (SpecialKind.PD, SpecialKind.BPC)
VISIBLE = 0.01  # of the largest amplitude: near rest a branch has endless special points, each smaller than the one before
BESIDE = 1e-3  # step along a parent's branch from the special point at which its family was met


@dataclass
class Atlas:
    """The branches known so far, and up to which period, how far and how finely they are followed."""

    path: str
    bounds: tuple[float, float]
    max_period: int
    step: float
    switch: bool
    branches: list[Branch] = field(default_factory=list)
    left: int = 0  # special points at which a family is born that is not followed

    def fill(self, orbits: list[PeriodicOrbit], say: Callable[[float], object]) -> None:
        """Follow all orbits that do not lie on one another's branches, then what is born on the widest branches first."""
        waiting = list(orbits)
        while waiting:
            waiting += self._follow(waiting.pop(0))
            say(len(self.branches) / (len(self.branches) + len(waiting) + 1) if waiting else 1.0)
        grown: set[int] = set()
        while self.switch:
            widest = max((b for b in self.branches if id(b) not in grown), key=self._width, default=None)
            if widest is None:
                return
            grown.add(id(widest))
            self._grow(widest)
            say(1.0)

    def _follow(self, orbit: PeriodicOrbit) -> list[PeriodicOrbit]:
        """Follow an orbit unless it lies on a known branch; returns orbits of the branches on which its own ends."""
        if self.knows(orbit):
            return []
        branch = continue_orbit(orbit, self.path, self._range(orbit.period), step=self.step)
        self.branches.append(branch)
        specials = filter(self._begins, branch.special) if self.switch else ()
        return [beside for special in specials if _is_parent(special, branch) for beside in _beside(special)]

    def _grow(self, branch: Branch) -> None:
        """Follow all that is born on a branch."""
        narrow = self._width(branch) < NARROW * (self.bounds[1] - self.bounds[0])
        for special in filter(self._begins, branch.special):
            if _is_parent(special, branch) or self._ends_at(special):
                continue
            if narrow or special.amplitude < VISIBLE * branch.amplitudes.max() or len(self.branches) >= MOST_BRANCHES:
                self.left += 1
            else:
                self.branches += self._born_at(special)

    def _width(self, branch: Branch) -> float:
        """The part of the range that a branch covers."""
        low, high = np.clip([branch.parameters.min(), branch.parameters.max()], *self.bounds)
        return float(high - low)

    def knows(self, orbit: PeriodicOrbit) -> bool:
        """Whether an orbit, or its mirror image, lies on a branch."""
        value = float(orbit.solution.values[0])
        return any(
            same_orbit(orbit, other)
            for branch in self.branches
            if branch.parameters.min() <= value <= branch.parameters.max()
            for other in branch.at(value)
        )

    def _begins(self, special: SpecialPoint) -> bool:
        """Whether orbits of at most the longest period are born at a special point within the bounds."""
        inside = self.bounds[0] <= special.parameter <= self.bounds[1]
        return inside and special.kind in BRANCHING and _periods_born(special) <= self.max_period

    def _born_at(self, special: SpecialPoint) -> list[Branch]:
        """The branches that begin at a special point and are not known."""
        born = switch_branch(special, self._range(_periods_born(special)), step=self.step, both=False)
        return [branch for branch in born if not self.knows(branch.points[len(branch.points) // 2].orbit)]

    def _ends_at(self, special: SpecialPoint) -> bool:
        """Whether a branch of the orbits that are born at a special point begins or ends there."""
        for branch in self.branches:
            for place, inner, end in zip((0, -1), (1, -2), branch.ends, strict=True):
                last = branch.points[place].orbit
                family = branch.points[inner].orbit if len(branch.points) > 2 else last
                if special.kind == end.kind and family.period == _periods_born(special) and _meet(last, special):
                    return True
        return False

    def _range(self, periods: int) -> tuple[float, float]:
        """How far a family is followed: where the range ends, or beyond for those that may be loops."""
        low, high = self.bounds
        reach = FOLLOWED if self.path == "load.frequency" else BEYOND
        return (low, high) if periods == 1 else (low, max(high, reach * high))


def _periods_born(special: SpecialPoint) -> int:
    """Of the orbits that are born at a special point."""
    return special.orbit.period * (2 if special.kind == SpecialKind.PD else 1)


def _meet(end: PeriodicOrbit, special: SpecialPoint) -> bool:
    """Whether the orbit at a branch's end is the special point of another one."""
    near = SAME_PLACE * max(1.0, abs(special.parameter))
    return abs(end.solution.values[0] - special.parameter) < near and abs(end.amplitude - special.amplitude) < near


def _is_parent(special: SpecialPoint, branch: Branch) -> bool:
    """Whether a special point at a branch's end is one of the branch from which its orbits are born."""
    inner = branch.points[len(branch.points) // 2].orbit
    return special.orbit.period < inner.period or (special.orbit.symmetric and not inner.symmetric)


def _beside(special: SpecialPoint) -> list[PeriodicOrbit]:
    """An orbit next to a special point on its own branch: at the point itself test functions vanish."""
    point = special.point.curve.solve(special.point.place + BESIDE * special.point.tangent, special.point.tangent)
    return [] if point is None or not point.orbit.admissible else [point.orbit]
