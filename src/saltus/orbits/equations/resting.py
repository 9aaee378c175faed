"""Periodic orbits that rest at the contact for a part of their period (losses at impact).

Impacts accumulate in a finite time, the system rests, and the load alone determines when it is released. The motion after a
release therefore does not depend on what came before. An orbit is found by following the motion from release to release until
one repeats; no equation has to be solved, and the multipliers are 0.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from saltus.flow import EventKind, Motion, Release, SegmentValue, load_releases, peak_near, simulate
from saltus.orbits.equations.contract import ORBIT_TOLERANCE, OrbitEvaluation, Solution
from saltus.orbits.equations.one_contact import OneContactEquations, Segments
from saltus.orbits.orbit import PeriodicOrbit
from saltus.orbits.signature import Signature
from saltus.orbits.symmetry import is_symmetric, keeps_symmetry
from saltus.orbits.tolerances import TOLERANCES
from saltus.systems import System

INTO = 1e-3  # share of the first flight after a release in which the gap only opens, and in which no minimum is looked for
RELEASED, LANDED, SIDE = 0, 1, 2  # in `excursions`


@dataclass(frozen=True, eq=False)
class RestingOrbit(PeriodicOrbit):
    """A periodic orbit with rest: each release begins an excursion, which ends in an accumulation of impacts and rest up to the
    next release.

    It has all properties of a `PeriodicOrbit`. Of its infinitely many impacts it lists those that the flow resolves before it
    jumps to rest. `residual` is the largest difference between the smooth segments from impact to impact and the motion of the
    event-driven flow.

    Attributes
    ----------
    equations
        The equations that it solves.
    solution
        Their solution.
    excursions
        For each release in the (half) period the time of the release, the time of rest, and the side it is released to, (n, 3).
    bends
        The second derivative of the gap just before each impact, (impacts,); it is positive only for impacts born at a grazing.

    Examples
    --------
    >>> lossy = system.with_({"load.horizontal.amplitude": 0.15, "load.frequency": 0.2, "impact.e": 0.3})
    >>> resting = saltus.find_orbit(lossy, theta=0.3)
    >>> 0.31 < resting.rest_share < 0.32, abs(resting.multipliers)
    (True, array([0., 0.]))
    """

    excursions: np.ndarray
    bends: np.ndarray

    def _over_period(self, column: int) -> np.ndarray:
        values = self.excursions[:, column]
        if not self.symmetric:
            return values
        return np.concatenate([values, -values if column == SIDE else values + 0.5 * self.duration])

    @property
    def _shift(self) -> float:
        return 0.0  # times are counted from phase 0 of the period of the first release

    @property
    def releases(self) -> np.ndarray:
        """The times at which it leaves rest, from phase 0 of the load's period in which the first one lies, (n,)."""
        return self._over_period(RELEASED)

    @property
    def release_sides(self) -> np.ndarray:
        """The sides to which it is released, (n,)."""
        return self._over_period(SIDE).astype(int)

    @property
    def rests(self) -> np.ndarray:
        """The times at which it comes to rest, each after the release of the same index, (n,)."""
        return self._over_period(LANDED)

    @property
    def rest_durations(self) -> np.ndarray:
        """How long each rest lasts, (n,)."""
        following = np.append(self.releases[1:], self.releases[0] + self.duration)
        durations: np.ndarray = following - self.rests
        return durations

    @property
    def rest_share(self) -> float:
        """The share of its period for which it rests."""
        return float(self.rest_durations.sum() / self.duration)

    @cached_property
    def pulls(self) -> np.ndarray:
        """The largest contact acceleration after each release, (n,); where it is 0 the load only just pulls, and the release is
        lost beyond."""
        phases = self.releases * self.frequency
        return np.array([peak_near(self.system, int(s), phi) for s, phi in zip(self.release_sides, phases, strict=True)])

    @property
    def multipliers(self) -> np.ndarray:
        """0 and 0: neighbouring motions come to rest before the next release and coincide with the orbit from then on."""
        return np.zeros(2, dtype=complex)

    @property
    def touching(self) -> np.ndarray:
        """The speeds of the impacts whose gap closes ever more slowly (its second derivative is positive), as those born at a
        grazing do."""
        speeds: np.ndarray = self.solution.unknowns[1::2][self.bends > 0.0]
        return speeds

    @property
    def grazes(self) -> bool:
        """Whether it touches the contact without speed, apart from its accumulations of impacts."""
        return min(abs(self.clearance), float(self.touching.min(initial=math.inf))) < TOLERANCES.touch

    @property
    def stable(self) -> bool:
        """True, unless the load only just pulls at a release, a rest has no duration, or the orbit grazes."""
        return bool(self.pulls.min() > TOLERANCES.touch and self.rest_durations.min() > TOLERANCES.touch) and not self.grazes

    def start(self) -> dict[str, Any]:
        """The arguments of `simulate` that start the motion at its first release."""
        model = self.system.model
        time, side = float(self.excursions[0, RELEASED]), int(self.excursions[0, SIDE])
        return {model.coordinates[0]: float(model.contact), "velocity": 0.0, "time": time, "side": side}

    @cached_property
    def defect(self) -> float:
        """The largest distance between states a period apart, at 64 instants of a direct simulation over two periods."""
        motion = self.motion(2 * self.period)
        times = motion.start + self.duration * (np.arange(64) + 0.5) / 64.0
        now, later = motion.at(times), motion.at(times + self.duration)
        return float(np.abs(np.asarray(now) - np.asarray(later)).max())

    def __repr__(self) -> str:
        kind = "symmetric " if self.symmetric else ""
        return (
            f"RestingOrbit({kind}period {self.period}, {len(self.releases)} rests, "
            f"together {100 * self.rest_share:.3g} % of the time, amplitude={self.amplitude:.9g}, "
            f"{'stable' if self.stable else 'unstable'}, residual={self.residual:.1g})"
        )


def resting_near(base: OneContactEquations, motion: Motion, max_period: int) -> RestingOrbit | None:
    """The resting orbit of up to `max_period` forcing periods that a motion follows after its last release; None if there is
    none.

    It begins at the one of its releases that is earliest in the forcing period.
    """
    last = motion.events.of(EventKind.RELEASE)
    release = _known(load_releases(base.system), last[-1].time, last[-1].side, base.system) if len(last) else None
    found = None if release is None else resting_orbit(base, release, max_period)
    if found is None:
        return None
    period = base.system.load.period
    earliest = int(np.argmin(found.releases % period))
    release = _known(load_releases(base.system), found.releases[earliest], int(found.release_sides[earliest]), base.system)
    return found if release is None else resting_orbit(base, release, max_period)


def resting_orbit(base: OneContactEquations, release: Release, max_period: int) -> RestingOrbit | None:
    """The resting orbit of up to `max_period` forcing periods that the motion from a release leads to; None if there is none."""
    system, period = base.system, base.system.load.period
    assert period is not None
    roots = load_releases(system)
    motion = _released(system, release, max_period + 1, dense=False)
    chain, times = [release], [release.time]
    for event in motion.events.of(EventKind.RELEASE):
        if event.time - release.time < TOLERANCES.release * period:
            continue
        following = _known(roots, event.time, event.side, system)
        if following is None:
            return None
        if following in chain:
            first = chain.index(following)
            periods = round((event.time - times[first]) / period)
            return _orbit(base, tuple(chain[first:]), periods) if periods <= max_period else None
        chain.append(following)
        times.append(event.time)
    return None


def _released(system: System, release: Release, periods: float, dense: bool = True) -> Motion:
    contact: dict[str, Any] = {system.model.coordinates[0]: float(system.model.contact), "velocity": 0.0}
    return simulate(system, **contact, time=release.time, side=release.side, periods=periods, tol=ORBIT_TOLERANCE, dense=dense)


def _known(roots: tuple[Release, ...], time: float, side: int, system: System) -> Release | None:
    """The release of the load that coincides with an event at a time, modulo the forcing period; None without such."""
    period = system.load.period
    assert period is not None

    def apart(root: Release) -> float:
        return abs((root.time - time + 0.5 * period) % period - 0.5 * period)

    nearest = min((root for root in roots if root.side == side), key=apart, default=None)
    return nearest if nearest is not None and apart(nearest) < TOLERANCES.release * period else None


def _orbit(base: OneContactEquations, chain: tuple[Release, ...], periods: int) -> RestingOrbit | None:
    """The orbit that goes through a cycle of releases; it is given by its first half if it is symmetric and the system stays
    so."""
    system, period = base.system, base.system.load.period
    assert period is not None
    first = chain[0]
    opposite = replace(first, time=(first.time + 0.5 * period) % period, side=-first.side)
    image = _known(chain, opposite.time, opposite.side, system)
    mirrored = keeps_symmetry(system, base.paths[0]) if base.paths else is_symmetric(system)
    symmetric = periods % 2 == 1 and image is not None and mirrored
    span = 0.5 * periods if symmetric else float(periods)
    motion = _released(system, first, span)
    excursions = _excursions(motion, first, first.time + span * period, TOLERANCES.release * period)
    if excursions is None:
        return None
    impacts = motion.impacts
    equations = base.with_signature(Signature(tuple(int(s) for s in impacts.side), periods, symmetric))
    evaluation, bends = _between(equations, motion, excursions)
    if evaluation is None:
        return None
    unknowns = np.stack([impacts.time * base.frequency(base.values), np.abs(impacts.velocity_before)], axis=1).ravel()
    return RestingOrbit(equations, Solution(unknowns, equations.values, evaluation, 0), excursions, bends)


def _excursions(motion: Motion, first: Release, end: float, slack: float) -> np.ndarray | None:
    """The times of release and rest, and the sides, of a motion that starts at a release; None if it does not rest at `end`."""
    releases, sides = [first.time], [first.side]
    for event in motion.events.of(EventKind.RELEASE):
        if first.time + slack < event.time < end - slack:
            releases.append(event.time)
            sides.append(event.side)
    rests = [event.time for event in motion.events.of(EventKind.REST) if event.time > first.time + slack]
    if len(rests) != len(releases) or motion.limit is not None or rests[-1] > end:
        return None
    return np.array([releases, rests, sides]).T


def _between(equations: OneContactEquations, motion: Motion, excursions: np.ndarray) -> tuple[OrbitEvaluation | None, np.ndarray]:
    """The equations of the impacts along the smooth segments between them, and the gap's second derivatives at the impacts."""
    impacts, contact = motion.impacts, float(equations.system.model.contact)
    speeds = np.abs(impacts.velocity_before)
    opened = np.searchsorted(impacts.time, excursions[:, RELEASED])  # the first impact of each excursion
    begins, before = np.append(-np.inf, impacts.time[:-1]), np.append(0, impacts.side[:-1]).astype(np.int64)
    approach, states = np.append(0.0, speeds[:-1]), np.zeros((len(speeds), 2))
    into = excursions[:, RELEASED] + INTO * (impacts.time[opened] - excursions[:, RELEASED])
    begins[opened], before[opened], approach[opened] = into, 0, 0.0
    states[opened] = np.stack(motion.at(into), axis=1)
    spans = np.stack([begins, impacts.time, approach], axis=1)
    along = impacts.side.astype(np.int64)
    segments = Segments(spans, np.stack([before, along], axis=1), states)
    followed = equations.follow_segments(segments, equations.values, with_extremes=True)
    if followed is None:
        return None, np.empty(0)
    ends, _, extremes, rates = followed
    sign = np.where(along > 0, rates[0], rates[-1])
    closed = np.stack(
        [ends[:, SegmentValue.FIRST_STATE] - contact, -sign * ends[:, SegmentValue.FIRST_STATE + 1] - speeds], axis=1
    )
    nothing = np.empty((0, 2, 2))
    evaluation = OrbitEvaluation(closed.ravel(), nothing, nothing, np.empty((0, len(equations.paths))), ends, extremes)
    bends: np.ndarray = sign * ends[:, SegmentValue.FIRST_STATE + 2]
    return evaluation, bends
