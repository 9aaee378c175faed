"""The branches of one diagram: each orbit that is found is followed once, and so is what is born on its branch."""

from __future__ import annotations

from dataclasses import dataclass, field

from saltus.orbits import Branch, PeriodicOrbit, SpecialPoint, continue_orbit, same_orbit, switch_branch

FOLLOWED = 20.0  # times the range's upper end: how far families of a longer period are followed
MOST_BRANCHES = 60
SAME_PLACE = 1e-6  # between a branch's end and the special point of another one that it is
BRANCHING = ("PD", "BPC")
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
    left: int = 0  # special points whose families are too small to be followed

    @property
    def full(self) -> bool:
        """Whether no more branches are followed."""
        return len(self.branches) >= MOST_BRANCHES

    def add(self, orbit: PeriodicOrbit) -> None:
        """Follow an orbit, what is born on its branch and what this was born from, unless it lies on a known branch."""
        waiting = [orbit]
        while waiting:
            orbit = waiting.pop(0)
            if not (self.full or self.knows(orbit)):
                first = continue_orbit(orbit, self.path, self._range(orbit.periods), step=self.step)
                waiting += self._grow(first) if self.switch else self._keep(first)

    def _keep(self, *branches: Branch) -> list[PeriodicOrbit]:
        self.branches += branches
        return []

    def _grow(self, first: Branch) -> list[PeriodicOrbit]:
        """Keep a branch and all that are born on it; returns orbits of the branches on which they end."""
        self._keep(first)
        waiting, parents = [first], []
        while waiting:
            branch = waiting.pop(0)
            for special in filter(self._begins, branch.special):
                if special.amplitude < VISIBLE * branch.amplitudes.max():
                    self.left += 1
                elif _is_parent(special, branch):
                    parents += _beside(special)
                else:
                    born = self._born_at(special)
                    self._keep(*born)
                    waiting += born
        return parents

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
        """The branches that begin at a special point, unless they are known."""
        if self.full or self._ends_at(special):
            return []
        born = switch_branch(special, self._range(_periods_born(special)), step=self.step, both=False)
        return [branch for branch in born if not self.knows(branch.points[len(branch.points) // 2].orbit)]

    def _ends_at(self, special: SpecialPoint) -> bool:
        """Whether a branch of the orbits that are born at a special point begins or ends there."""
        for branch in self.branches:
            for end, inner, reason in zip((0, -1), (1, -2), branch.ends, strict=True):
                family = branch.points[inner].orbit if len(branch.points) > 2 else branch.points[end].orbit
                if (
                    special.kind in reason
                    and family.periods == _periods_born(special)
                    and _meet(branch.points[end].orbit, special)
                ):
                    return True
        return False

    def _range(self, periods: int) -> tuple[float, float]:
        """How far a family is followed: where the range ends, or beyond for those that may be loops."""
        low, high = self.bounds
        return (low, high) if periods == 1 else (low, FOLLOWED * high if high > 0 else high)


def _periods_born(special: SpecialPoint) -> int:
    """Of the orbits that are born at a special point."""
    return special.orbit.periods * (2 if special.kind == "PD" else 1)


def _meet(end: PeriodicOrbit, special: SpecialPoint) -> bool:
    """Whether the orbit at a branch's end is the special point of another one."""
    near = SAME_PLACE * max(1.0, abs(special.parameter))
    return abs(end.solution.values[0] - special.parameter) < near and abs(end.amplitude - special.amplitude) < near


def _is_parent(special: SpecialPoint, branch: Branch) -> bool:
    """Whether a special point at a branch's end is one of the branch from which its orbits are born."""
    inner = branch.points[len(branch.points) // 2].orbit
    return special.orbit.periods < inner.periods or (special.orbit.symmetric and not inner.symmetric)


def _beside(special: SpecialPoint) -> list[PeriodicOrbit]:
    """An orbit next to a special point on its own branch: at the point itself test functions vanish."""
    point = special.point.curve.solve(special.point.place + BESIDE * special.point.tangent, special.point.tangent)
    return [] if point is None or not point.orbit.admissible else [point.orbit]
