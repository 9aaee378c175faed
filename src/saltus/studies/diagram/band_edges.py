"""What happens at the edges of bands of chaos, as the branches of the same diagram show it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from saltus.flow import Ending, Motion, find_recurrence
from saltus.orbits import Branch, PeriodicOrbit, SpecialKind, SpecialPoint, is_symmetric
from saltus.studies.diagram.bands import Band, Bands, Edge, EdgeKind
from saltus.studies.diagram.chaos_search import BandOrigin
from saltus.systems import System, image_of


@dataclass(frozen=True)
class EdgeSettings:
    """When the evidence suffices to say what happens at an edge."""

    # Largest distance of a fold or a grazing from the bracket of an edge, as a share of the range.
    beside: float = 1e-4
    # Largest distance, as a share of the range, of the period doubling of an orbit from the edge at which its cascade ends.
    cascade: float = 0.03
    nearest: int = 4  # The period of the motions beyond an edge is that at the first regular one of this many values next to it.
    # The largest distance, as a share of the attractor's size, at which the attractor touches an unstable orbit: its states are
    # no denser than that. Inside the band, at `depth` times the range from the edge or in the middle of a narrower band, it must
    # be at least `grown` times as far away, as unstable orbits within the attractor are near to it everywhere.
    touch: float = 0.02
    grown: float = 3.0
    depth: float = 0.005
    longest_period: int = 3  # The longest period of unstable orbits that are compared, in forcing periods.
    same_place: float = 1e-9  # An orbit is that of a special point if their parameters differ by no more than this, relatively.
    periods: int = 400  # Forcing periods for which chaotic motions are followed to sample the attractor's states.


SETTINGS = EdgeSettings()


def explained(system: System, chaos: Bands, branches: Sequence[Branch]) -> Bands:
    """The bands with what happens at each edge, as far as the branches of the same diagram show it.

    If a fold or a grazing at which orbits lose their stability lies in the bracket of the edge, it is what happens there. The
    edge is the end of a cascade if the motions beyond it have 2^k times (k > 0) the period of an orbit whose period doubling lies
    on that side. It is a crisis if the motions beyond are transients and the attractor, whose states at phase 0 are away from
    the states of an unstable orbit within the band, comes up to them at the edge.
    """
    look = _Evidence(system, chaos, branches)
    bands = [replace(band, lower=look.of(band, band.lower), upper=look.of(band, band.upper)) for band in chaos.bands]
    return replace(chaos, bands=tuple(bands))


class _Evidence:
    """The special points and the unstable orbits of a diagram."""

    def __init__(self, system: System, chaos: Bands, branches: Sequence[Branch]) -> None:
        self.system, self.chaos, self.branches = system, chaos, branches
        self.span = float(np.ptp(chaos.tried.values))
        self.special = turning_points(branches)

    def of(self, band: Band, edge: Edge) -> Edge:
        """The edge with its kind and the evidence for it."""
        if edge.kind is EdgeKind.BOUND:
            return edge
        special, kind = self._special(edge)
        if special is not None:
            return replace(edge, kind=kind, special=special.parameter)
        if self._verdict(edge.outer) is not Ending.TRANSIENT:
            return edge
        distance = self._touched(band, edge)
        return replace(edge, distance=distance, kind=EdgeKind.CRISIS if distance <= SETTINGS.touch else edge.kind)

    def _verdict(self, value: float) -> Ending:
        return Ending(self.chaos.tried.verdict[np.searchsorted(self.chaos.tried.values, value)])

    def _special(self, edge: Edge) -> tuple[SpecialPoint | None, EdgeKind]:
        """The special point that shows what happens at an edge, or None, and the kind of edge that it makes."""
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
        """The longest period of the motions at the nearest value beyond an edge at which they are regular; 0 if there is none."""
        tried, first = self.chaos.tried, int(np.searchsorted(self.chaos.tried.values, edge.outer))
        step = 1 if edge.outer > edge.inner else -1
        nearest = [i for i in range(first, first + SETTINGS.nearest * step, step) if 0 <= i < len(tried.values)]
        return next((int(tried.period[i]) for i in nearest if tried.verdict[i] == Ending.PERIODIC and tried.period[i] > 0), 0)

    def _touched(self, band: Band, edge: Edge) -> float:
        """The attractor's distance to the unstable orbit that it touches at an edge but not inside the band; nan if there is
        none."""
        tried, span = self.chaos.tried, band.high - band.low
        toward = np.sign(edge.inner - edge.outer) * min(SETTINGS.depth * self.span, 0.5 * span)
        inside = np.flatnonzero(tried.chaotic & (tried.values >= band.low) & (tried.values <= band.high))
        within = float(tried.values[inside[np.abs(tried.values[inside] - edge.inner - toward).argmin()]])
        here, there = self._attractor(edge.inner), self._attractor(within)
        best = float("nan")
        for branch in self.branches:
            distance = _distance(here, branch, edge.inner)
            if distance <= SETTINGS.touch and _distance(there, branch, within) >= SETTINGS.grown * distance:
                best = float(np.fmin(best, distance))
        return best

    def _attractor(self, value: float) -> np.ndarray:
        """States of the chaos at a value that was tried, at phase 0, (n, d)."""
        tried = self.chaos.tried
        begin = tried.states[np.searchsorted(tried.values, value)]
        begin = begin[np.isfinite(begin).all(axis=1)]
        parameters = {self.chaos.path: np.full(len(begin), value)}
        states = find_recurrence(self.system, begin, SETTINGS.periods, parameters=parameters).states
        return np.asarray(states[np.isfinite(states).all(axis=-1)])


def _distance(states: np.ndarray, branch: Branch, value: float) -> float:
    """The least distance of an attractor's states to the unstable orbits of a branch, as a share of the attractor's size; inf if
    there are no such orbits."""
    orbits = _unstable_at(branch, value)
    if not orbits:
        return np.inf
    points = np.concatenate([_section(orbit) for orbit in orbits])
    size = np.ptp(states, axis=0)
    return float(min(np.linalg.norm((states - point) / size, axis=1).min() for point in points))


def turning_points(branches: Sequence[Branch]) -> list[SpecialPoint]:
    """The special points at which stable orbits lose their stability or end: those with stable orbits on one side only."""
    return [special for branch in branches for special in branch.special if _turns(branch, special)]


def _turns(branch: Branch, special: SpecialPoint) -> bool:
    """Whether stability changes at a special point, or a stable branch ends there; orbits at the point itself do not count."""
    away = np.abs(branch.parameters - special.parameter)
    apart = away + np.abs(branch.amplitudes - special.amplitude)
    nearest = int(apart.argmin())
    there = away > SETTINGS.same_place * max(1.0, abs(special.parameter))
    below = np.flatnonzero(there[:nearest])[-1:]
    above = nearest + np.flatnonzero(there[nearest:])[:1]
    beside = branch.stable[np.concatenate([below, above])]
    return bool(beside.any()) and not (len(beside) == 2 and bool(beside.all()))


def band_origins(branches: Sequence[Branch]) -> list[BandOrigin]:
    """The special points of branches at which narrow bands may begin, as `BandSearch` takes them."""
    return [
        BandOrigin(str(special.kind), special.parameter, tuple(special.orbit.section_state.tolist()))
        for special in turning_points(branches)
    ]


def _is_doubled(period: int, base: int) -> bool:
    """Whether a period is 2, 4, 8, ... times another."""
    times = period // base
    return period == times * base and times > 1 and times & (times - 1) == 0


def _unstable_at(branch: Branch, value: float) -> list[PeriodicOrbit]:
    """The unstable orbits of a branch at a value, where it has any."""
    unseen = not branch.parameters.min() <= value <= branch.parameters.max() or branch.stable.all()
    if unseen or branch.points[0].orbit.period > SETTINGS.longest_period:
        return []
    return [orbit for orbit in branch.at(value) if orbit.admissible and not orbit.stable]


def _section(orbit: PeriodicOrbit) -> np.ndarray:
    """The states of an orbit at phase 0, and those of its mirror image, (n, d)."""
    motion, forcing = orbit.motion(orbit.period + 2), orbit.duration / orbit.period
    first = forcing * np.ceil(motion.start / forcing)
    times = first + forcing * np.arange(orbit.period)
    states = _at(motion, times)
    if not is_symmetric(orbit.system):
        return states
    return np.concatenate([states, image_of(orbit.system.model, _at(motion, times + 0.5 * forcing))])


def _at(motion: Motion, times: np.ndarray) -> np.ndarray:
    """The states of a motion at some times, (n, d)."""
    position, velocity = motion.at(times)
    return np.concatenate([np.atleast_2d(position), np.atleast_2d(velocity)]).T
