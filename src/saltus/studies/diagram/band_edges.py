"""What happens at the edges of bands of chaos: the branches of a diagram beside them tell."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from saltus.flow import find_recurrence
from saltus.orbits import Branch, PeriodicOrbit, SpecialKind, SpecialPoint, is_symmetric
from saltus.studies.diagram.bands import Bands, Edge, EdgeKind
from saltus.studies.diagram.chaos_search import Seed
from saltus.systems import System


@dataclass(frozen=True)
class EdgeSettings:
    """What is asked of the evidence for what happens at an edge."""

    # Largest distance of a fold or a grazing from the bracket of an edge, as a share of the range: half of the bracket's width.
    beside: float = 1e-4
    # Largest distance, as a share of the range, of the period doubling of an orbit from the edge at which its cascade ends.
    cascade: float = 0.05
    # Largest distance of the attractor from an unstable orbit that it touches, as a share of its size: chaos comes as near as its
    # states are dense there.
    touch: float = 0.02
    periods: int = 400  # Forcing periods for which motions of the chaos are followed to know its states.


SETTINGS = EdgeSettings()


def explained(system: System, chaos: Bands, branches: Sequence[Branch]) -> Bands:
    """The bands with what happens at each edge, as far as the branches of the same diagram show it.

    A fold or a grazing at which motions lose their stability, in the bracket of the edge, is what happens there. A cascade ends
    where motions beyond have 2^k times, k > 0, the period of an orbit whose doubling lies on that side. Where neither is, and
    motions leave the attractor beyond, the distance of its states to the nearest unstable orbit at the inner value, at phase 0,
    tells a crisis.
    """
    look = _Evidence(system, chaos, branches)
    bands = [replace(band, lower=look.of(band.lower), upper=look.of(band.upper)) for band in chaos.bands]
    return replace(chaos, bands=tuple(bands))


class _Evidence:
    """The special points and the unstable orbits of a diagram."""

    def __init__(self, system: System, chaos: Bands, branches: Sequence[Branch]) -> None:
        self.system, self.chaos, self.branches = system, chaos, branches
        self.span = float(np.ptp(chaos.tried.values))
        self.special = turning_points(branches)

    def of(self, edge: Edge) -> Edge:
        """The edge with its kind and the evidence for it."""
        if edge.kind is EdgeKind.BOUND:
            return edge
        special, kind = self._special(edge)
        if special is not None:
            return replace(edge, kind=kind, special=special.parameter)
        if edge.kind is EdgeKind.UNDECIDED:
            return edge
        distance = self._distance(edge)
        kind = EdgeKind.CRISIS if distance <= SETTINGS.touch else EdgeKind.UNKNOWN
        return replace(edge, kind=kind, distance=distance)

    def _special(self, edge: Edge) -> tuple[SpecialPoint | None, EdgeKind]:
        """The special point that shows what happens at an edge, with what that is."""
        low, high, reach = min(edge.inner, edge.outer), max(edge.inner, edge.outer), SETTINGS.beside * self.span
        beside = [point for point in self.special if low - reach <= point.parameter <= high + reach]
        for code, kind in ((SpecialKind.LP, EdgeKind.FOLD), (SpecialKind.GR, EdgeKind.GRAZING)):
            nearest = min((p for p in beside if p.kind == code), key=lambda p: abs(p.parameter - edge.outer), default=None)
            if nearest is not None:
                return nearest, kind
        period, side = self._period_beyond(edge), np.sign(edge.outer - edge.inner)
        doubled = [
            point
            for point in self.special
            if point.kind == SpecialKind.PD
            and 0.0 <= side * (point.parameter - edge.inner) <= SETTINGS.cascade * self.span
            and _is_doubled(period, point.orbit.period)
        ]
        nearest = min(doubled, key=lambda p: abs(p.parameter - edge.inner), default=None)
        return nearest, EdgeKind.CASCADE

    def _period_beyond(self, edge: Edge) -> int:
        """The longest period that motions have at the first value beyond an edge."""
        tried = self.chaos.tried
        return int(tried.period[np.searchsorted(tried.values, edge.outer)])

    def _distance(self, edge: Edge) -> float:
        """The distance of the chaos at the inner value from the nearest unstable orbit, by its size; nan where there is none."""
        tried = self.chaos.tried
        begin = tried.states[np.searchsorted(tried.values, edge.inner)]
        begin = begin[np.isfinite(begin).all(axis=1)]
        parameters = {self.chaos.path: np.full(len(begin), edge.inner)}
        states = find_recurrence(self.system, begin, SETTINGS.periods, parameters=parameters).states.reshape(-1, 2)
        states = states[np.isfinite(states).all(axis=1)]
        orbits = [orbit for branch in self.branches for orbit in _unstable_at(branch, edge.inner)]
        if not orbits:
            return float("nan")
        points = np.concatenate([_section(orbit) for orbit in orbits])
        size = np.ptp(states, axis=0)
        return float(min(np.linalg.norm((states - point) / size, axis=1).min() for point in points))


def turning_points(branches: Sequence[Branch]) -> list[SpecialPoint]:
    """The special points at which motions lose their stability or end."""
    found = []
    for branch in branches:
        places = {id(point): i for i, point in enumerate(branch.points)}
        for special in branch.special:
            i = places.get(id(special.point))
            beside = [] if i is None else [branch.points[j].orbit.stable for j in (i - 1, i + 1) if 0 <= j < len(branch.points)]
            if any(beside) and not (len(beside) == 2 and all(beside)):
                found.append(special)
    return found


def seeds_of(branches: Sequence[Branch]) -> list[Seed]:
    """The special points of branches at which narrow bands may begin, as `resolve_bands` takes them."""
    return [Seed(str(special.kind), special.parameter, special.orbit.state) for special in turning_points(branches)]


def _is_doubled(period: int, base: int) -> bool:
    """Whether a period is 2, 4, 8, ... times another."""
    times = period // base
    return period == times * base and times > 1 and times & (times - 1) == 0


def _unstable_at(branch: Branch, value: float) -> list[PeriodicOrbit]:
    """The unstable orbits of a branch at a value, where it has any."""
    if not branch.parameters.min() <= value <= branch.parameters.max() or branch.stable.all():
        return []
    return [orbit for orbit in branch.at(value) if orbit.admissible and not orbit.stable]


def _section(orbit: PeriodicOrbit) -> np.ndarray:
    """The states of an orbit at phase 0, and those of its mirror image, (n, 2)."""
    motion, forcing = orbit.motion(orbit.period + 2), orbit.duration / orbit.period
    first = forcing * np.ceil(motion.start / forcing)
    times = first + forcing * np.arange(orbit.period)
    states = np.stack(motion.at(times), axis=1)
    if not is_symmetric(orbit.system):
        return states
    return np.concatenate([states, -np.stack(motion.at(times + 0.5 * forcing), axis=1)])
