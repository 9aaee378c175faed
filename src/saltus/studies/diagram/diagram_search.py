"""The search of a diagram: simulate, follow what is found, compare, and again, until every
simulated motion is accounted for.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property, partial
from typing import Any

import numpy as np

from saltus.attractors import share_interval
from saltus.flow import RECURRENCE, motions_from, stroboscopic
from saltus.orbits import PeriodicOrbit, keeps_symmetry, orbits_near_returns, solved_near
from saltus.progress import Progress, part_of, silent
from saltus.studies.diagram.bands import Bands, band_origins
from saltus.studies.diagram.branch_set import BranchSet, PlacedBranch, placed, stable_motions
from saltus.studies.diagram.chaos_search import BandSearch
from saltus.studies.diagram.diagram_work import DiagramWork, side_by_side
from saltus.studies.diagram.effort import CHAOS, EffortSettings
from saltus.studies.diagram.simulated import (
    AttractorsFound,
    BranchAssignment,
    SimulatedMotions,
    starts_at,
)
from saltus.systems import System, Window, middle_of, natural_units, within_window


@dataclass(frozen=True)
class MissedShare:
    """The share of states that end on something which is not in the diagram, estimated by a sample
    of them.
    """

    missed: int = 0  # motions of the sample that end on such a thing
    sample: int = 0
    samples: int = 0  # how many samples were tried; this is the last one
    # motions of the sample that a limit of the model ends, so that it is not known where they would
    # have gone
    ended: int = 0

    @property
    def share(self) -> float:
        """The estimate; nan without a sample."""
        return self.missed / self.sample if self.sample else np.nan

    @property
    def ended_share(self) -> float:
        """The share of the sample that a limit of the model ends; nan without a sample."""
        return self.ended / self.sample if self.sample else np.nan

    @property
    def interval(self) -> tuple[float, float]:
        """The 95 % interval of a binomial share (Wilson's)."""
        return share_interval(self.missed, self.sample)


@dataclass(frozen=True)
class DiagramSearchSettings:
    """How the search of a diagram goes on from what it has found."""

    # Orbits that simulation shows to be stable in less than this share of the range are followed
    # only while they are stable: within chaos there are any number of them, and each branch has
    # long unstable parts.
    narrow: float = 0.02
    # Rounds of starts from neighbours: each carries the motions that the last one found to the next
    # values.
    rounds: int = 100
    # Forcing periods at the beginning of motions in which near returns are looked for.
    transient: int = 24
    # Where a stable part of a branch ends, motions are started from its last orbit at values that
    # differ by these shares of the range, on both sides: they may fall to attractors to which no
    # start of the grid leads.
    beyond: tuple[float, ...] = (3e-5, 3e-4)


SETTINGS = DiagramSearchSettings()


@dataclass
class DiagramSearch:
    """One search: what was simulated and followed so far."""

    work: DiagramWork  # of the system with the parameter in the middle of its range
    bounds: tuple[float, float]
    grid: np.ndarray  # values of the parameter
    window: Window
    seed: int
    effort: EffortSettings
    branches: BranchSet
    max_period: int  # the longest period of orbits that are followed
    found: AttractorsFound = field(init=False)
    band_search: BandSearch | None = None
    taken: int = 0  # how many of the ensembles that it has begun are among the motions found
    drawn: SimulatedMotions = field(init=False)  # the last sample of random motions
    chaos: Bands | None = None
    missed: MissedShare = field(default_factory=MissedShare)
    # rows of motions whose branches were computed at once with others
    prepared: set[int] = field(default_factory=set)

    def simulate(self, progress: Progress = silent) -> None:
        """The simulation of the diagram: motions from the starts at every value of the grid."""
        states = starts_at(self.system, self.grid, self.effort.starts, self.window, self.seed)
        motions = self.simulated(
            np.repeat(self.grid, self.effort.starts),
            states.reshape(-1, self.system.dimension),
            progress,
        )
        self.found = AttractorsFound(motions, self.max_period, self.middle, self.time)

    def simulated(
        self, values: np.ndarray, states: np.ndarray, progress: Progress = silent
    ) -> SimulatedMotions:
        """Motions from states (n, d) at values (n,), as long as the effort says."""
        return self.work.simulate(values, states, self.effort.periods, progress)

    @property
    def system(self) -> System:
        """What moves."""
        return self.work.system

    @property
    def path(self) -> str:
        """The parameter."""
        return self.work.path

    @cached_property
    def middle(self) -> float:
        """The place from which extrema are compared, so that mirror images have equal ones."""
        return middle_of(self.system) or 0.0

    @cached_property
    def time(self) -> float:
        """The natural time, in which speeds of impacts are compared with lengths."""
        return natural_units(self.system).time

    @cached_property
    def image_middle(self) -> float | None:
        """The place about which the mirror image of a motion is a motion too; None without one."""
        return middle_of(self.system) if keeps_symmetry(self.system, self.path) else None

    def follow_motions(self, progress: Progress) -> None:
        """Follow the attractors that were simulated and lie on no branch, until none is left that
        was not tried.
        """
        while True:
            self._place()
            rows = self.found.open
            if not rows.size:
                return
            runs = self.found.families(rows)
            for number, run in enumerate(runs):
                row = _middle(run)
                if not self._is_placed(row, self.branches.placed[self.found.looked[row] :]):
                    narrow = self._is_partial(run)
                    if narrow and len(self.branches.partial) >= self.effort.narrow:
                        self.found.assignment[run] = BranchAssignment.LEFT
                        continue
                    self._prepare(runs[number:])
                    known = len(self.branches.placed)
                    share = known / (known + len(rows))
                    watch = part_of(progress, share, share, f"following, branches: {known}")
                    self.found.assignment[row] = self._follow(row, narrow, watch)

    def _place(self) -> None:
        """Compare the attractors that lie on no branch so far with the branches that are new to
        them.
        """
        rows = self.found.unplaced
        count = len(self.branches.placed)
        rows = rows[
            (self.found.assignment[rows] != BranchAssignment.LONGER)
            & (self.found.looked[rows] < count)
        ]
        for first in np.unique(self.found.looked[rows]).tolist():
            some = rows[self.found.looked[rows] == first]
            there = placed(
                self.found.motions.only(some), self.branches.placed[first:], self.image_middle
            )
            self.found.assignment[some[there]] = BranchAssignment.ON_BRANCH
        self.found.looked[rows] = count

    def _is_placed(self, row: int, branches: list[PlacedBranch]) -> bool:
        return bool(placed(self.found.motions.only([row]), branches, self.image_middle)[0])

    def _is_partial(self, run: np.ndarray) -> bool:
        """Whether the orbits of a run are followed only while they are stable: those of long
        periods, and those that are stable in a small part of the range only, as far as the
        simulated values show."""
        if self.found.motions.period[run[0]] > CHAOS.long_period:
            return True
        values = self.found.motions.value[run]
        least = SETTINGS.narrow * (self.bounds[1] - self.bounds[0])
        gap = np.diff([self.bounds[0], *self.grid, self.bounds[1]]).max()
        # found by the search for chaos, whose values are denser than the grid
        if not np.isin(values, self.grid).any():
            gap = min(gap, 0.25 * least)
        return bool(np.ptp(values) + 2.0 * gap < least)

    def _prepare(self, runs: list[np.ndarray]) -> None:
        """Compute the branch of the first run, and at the same time branches of later runs, which
        hardly lie on the same branch.

        Of the runs that are stable in a wide range one of each period is taken, as two of one
        period may well be on one branch.
        """
        if self.work.at_once == 1 or _middle(runs[0]) in self.prepared:
            return
        chosen: dict[Any, tuple[int, bool]] = {}
        for run in runs:
            row = _middle(run)
            narrow = self._is_partial(run)
            key = row if narrow else (int(self.found.motions.period[row]),)
            wanted = (
                len(chosen) < self.work.at_once and key not in chosen and row not in self.prepared
            )
            if wanted and not self._is_placed(row, self.branches.placed[self.found.looked[row] :]):
                chosen[key] = row, narrow
        self.prepared.update(row for row, _ in chosen.values())
        orbits = [
            (orbit, narrow)
            for row, narrow in chosen.values()
            if (orbit := self._orbit(row)) is not None
        ]
        self.branches.prepare([(orbit, narrow and orbit.stable) for orbit, narrow in orbits])

    def _orbit(self, row: int) -> PeriodicOrbit | None:
        """The orbit near a simulated motion."""
        motions = self.found.motions
        system = self.system.with_({self.path: float(motions.value[row])})
        return solved_near(system, self.path, motions.last[row], int(motions.period[row]))

    def _follow(self, row: int, while_stable: bool, progress: Progress) -> BranchAssignment:
        """Follow a simulated motion; returns where it then stands."""
        orbit = self._orbit(row)
        if orbit is None:
            return BranchAssignment.NO_ORBIT
        known = len(self.branches.placed)
        self.branches.add_branches_of(orbit, while_stable and orbit.stable, progress)
        if self._is_placed(row, self.branches.placed[known:]) or (
            orbit.stable and self.branches.knows(orbit)
        ):
            return BranchAssignment.ON_BRANCH
        return BranchAssignment.ELSEWHERE if orbit.stable else BranchAssignment.UNSTABLE

    def repel(self, max_period: int, progress: Progress) -> None:
        """Follow repelling orbits to which motions come near and near which they return, at some
        values of the grid.

        Their number is limited, as chaos contains any number of them.
        """
        grid = self.grid[
            np.unique(np.linspace(0, len(self.grid) - 1, self.effort.repelling_values).astype(int))
        ]
        begin = starts_at(self.system, grid, self.effort.starts, self.window, self.seed)
        columns = {self.path: np.repeat(grid, self.effort.starts)}
        watch = part_of(progress, 1.0, 1.0, "following repelling orbits")
        options = {
            "periods": SETTINGS.transient,
            "last": "all",
            "tol": 1e-10,
            "until": ("rest",),
            "progress": watch,
        }
        d = self.system.dimension
        motions = self.found.motions
        early = stroboscopic(
            self.system,
            motions_from(self.system, begin.reshape(-1, d), parameters=columns, **options),
        )
        shape = (len(grid), self.effort.starts, -1, d)
        late = [motions.only((motions.value == value) & motions.unsettled).states for value in grid]
        states = np.concatenate(
            [early.reshape(shape), _filled(late, self.effort.starts, SETTINGS.transient)], axis=1
        )
        known = [
            motions.only((motions.value == value) & motions.periodic).states.reshape(-1, d)
            for value in grid
        ]
        known = [states[np.isfinite(states).all(axis=1)] for states in known]
        orbits = orbits_near_returns(self.system, self.path, grid, states, known, max_period)
        most = len(self.branches.placed) + self.effort.branches
        for orbit in sorted(orbits, key=lambda orbit: orbit.period):
            if len(self.branches.placed) < most:
                self.branches.add_branches_of(orbit, progress=watch)
            else:
                self.branches.left += 1

    def carry_on(self, progress: Progress) -> None:
        """Start motions from those at neighbouring values and from the ends of stable parts of
        branches, until these show nothing new."""
        since = 0
        ended = 0
        watch = part_of(progress, 1.0, 1.0, "following motions from neighbouring values")
        for number in range(SETTINGS.rounds):
            known = stable_motions(self.branches.placed, self.grid, self.system, self.middle)
            values, states = self.found.seeds(self.system, self.grid, known, since)
            more_values, more_states = self._beyond_ends(
                self.branches.placed[ended:] if number < self.effort.jumps else []
            )
            since = len(self.found.motions)
            ended = len(self.branches.placed)
            values, states = (
                np.concatenate([values, more_values]),
                np.concatenate([states, more_states]),
            )
            if not len(values) or not self.found.add(self.simulated(values, states, watch)):
                return
            self.follow_motions(progress)

    def _beyond_ends(self, branches: list[PlacedBranch]) -> tuple[np.ndarray, np.ndarray]:
        """Values and states of starts beyond the ends of stable parts of branches."""
        found: list[tuple[float, np.ndarray]] = []
        low, high = self.bounds
        for branch in branches:
            for end in branch.stable_ends.tolist():
                value = float(branch.columns[0, end])
                orbit = branch.branch.points[end].orbit
                steps = [
                    side * share * (high - low) for share in SETTINGS.beyond for side in (-1.0, 1.0)
                ]
                found += [
                    (value + step, orbit.section_state)
                    for step in steps
                    if low <= value + step <= high
                ]
        values = np.array([value for value, _ in found], dtype=float)
        return values, np.array([state for _, state in found], dtype=float).reshape(
            -1, self.system.dimension
        )

    def find(self, repelling: int, bands: bool, progress: Progress) -> None:
        """Follow the orbits that the simulation shows, and look for chaos where motions have not
        settled.
        """
        more = partial(self._follow_more, repelling)
        if bands:
            self.band_search = BandSearch(self.work, self.bounds, self.effort.chaos)
            self._look_for_chaos(self.found.motions, progress, more)
        else:
            self.follow_motions(progress)
            more(progress)

    def _look_for_chaos(
        self,
        motions: SimulatedMotions,
        progress: Progress,
        more: Callable[[Progress], object] | None = None,
    ) -> None:
        """Look for chaos from motions, while the orbits on which motions settle are followed.

        What depends on branches comes when these are known: motions beside their special points,
        and the motions that `more` follows from neighbouring values.
        """
        assert self.band_search is not None
        search = self.band_search
        known = len(self.found.motions)
        begin = partial(search.begin, _without_repetition(motions, self.middle, self.time))
        self._beside(self.follow_motions, begin, part_of(progress, 0.0, 0.3))
        if more is not None:
            look = partial(search.beside_special_points, band_origins(self.branches.branches))
            self._beside(more, look, part_of(progress, 0.3, 0.4))
        # without those that the search knows already
        fresh = self.found.motions.only(slice(known, None))
        later = _without_repetition(fresh, self.middle, self.time)
        self._take_begun()
        search.locate(later, band_origins(self.branches.branches), part_of(progress, 0.4, 0.7))
        self._take_begun()
        self._beside(self.follow_motions, search.confirm, part_of(progress, 0.7, 1.0))
        self._take_begun()

    def _follow_more(self, repelling: int, progress: Progress) -> None:
        """Follow repelling orbits, the families born on branches, and the orbits that motions from
        neighbouring values show.
        """
        self.repel(repelling, progress)
        self.branches.grow(progress)
        self.carry_on(progress)

    def _beside(
        self,
        follow: Callable[[Progress], object],
        here: Callable[[Progress], object],
        progress: Progress,
    ) -> None:
        """Do something else while branches are followed, which it neither needs nor changes.

        One comes after the other if other processes compute, or if results are kept.
        """
        if self.work.memo is None:
            side_by_side(follow, here, progress)
        else:
            follow(progress)
            here(progress)

    def _take_begun(self) -> None:
        """Add the motions that the search for chaos has begun since the last time, and take its
        bands.
        """
        assert self.band_search is not None
        new = self.band_search.begun[self.taken :]
        self.taken += len(new)
        if new:
            self.found.add(new[0].joined(*new[1:]))
        self.chaos = self.band_search.bands

    def estimate(self, follow: bool, progress: Progress = silent) -> None:
        """Estimate which share of the states ends on something that the diagram does not have, by
        random motions.

        Motions that have not settled outside bands of chaos are given more time, as they are still
        on their way to an attractor. With `follow`, after the sample is counted, the orbits on
        which its motions settle are followed. If the effort has more than one sample, chaos is
        looked for where they do not settle. Then a new sample is counted.
        """
        for number in range(self.effort.samples):
            first = len(self.found.motions)
            self._beside(self.follow_motions, partial(self._draw, number), progress)
            self.found.add(self.drawn)
            self._place()
            unknown = (
                self.found.assignment[self.found.attractor[first:]] != BranchAssignment.ON_BRANCH
            )
            loose = self.drawn.unsettled & ~self._in_bands(self.drawn.value)
            missed = (self.drawn.periodic & unknown) | loose
            self.missed = MissedShare(
                int(missed.sum()), len(missed), number + 1, int(self.drawn.ended.sum())
            )
            if not follow or not missed.any():
                return
            self.found.reopen(np.arange(first, len(self.found.motions)))
            if self.band_search is not None and self.effort.samples > 1:
                self._look_for_chaos(self.drawn.only(loose), progress)
        self.follow_motions(progress)

    def _draw(self, number: int, progress: Progress) -> None:
        """Draw a sample: motions from random states of the window at random values; each sample has
        its own seed.
        """
        rng = np.random.default_rng([self.seed, number, self.effort.sample])
        values = rng.uniform(*self.bounds, self.effort.sample)
        points = rng.uniform(-1.0, 1.0, (self.effort.sample, len(self.window)))
        watch = part_of(progress, 0.0, 1.0, "estimating what is missing")
        motions = self.simulated(values, within_window(self.system, points, self.window), watch)
        loose = np.flatnonzero(motions.unsettled & ~self._in_bands(values))
        if loose.size:
            motions.gone_on(
                loose, self.work.followed(values[loose], motions.last[loose], self.effort.lasting)
            )
        self.drawn = motions

    def _in_bands(self, values: np.ndarray) -> np.ndarray:
        """Which values lie in a band of chaos, (n,)."""
        inside = np.zeros(len(values), dtype=bool)
        for band in () if self.chaos is None else self.chaos.bands:
            inside |= (values >= band.low) & (values <= band.high)
        return inside


def _without_repetition(motions: SimulatedMotions, middle: float, time: float) -> SimulatedMotions:
    """Each attractor once, every value, and the motions that have not settled."""
    found = AttractorsFound(motions, RECURRENCE.compiled_max_period, middle, time)
    kept = (
        np.unique(motions.value, return_index=True)[1],
        found.rows,
        np.flatnonzero(motions.unsettled),
    )
    return motions.only(np.unique(np.concatenate(kept)))


def _middle(run: np.ndarray) -> int:
    """The motion in the middle of a run, which is followed for all of them."""
    return int(run[len(run) // 2])


def _filled(groups: list[np.ndarray], count: int, kept: int) -> np.ndarray:
    """The last `kept` states of up to `count` motions of each group, filled up with nan, (groups,
    count, kept, d).
    """
    result = np.full((len(groups), count, kept, groups[0].shape[-1]), np.nan)
    for row, states in enumerate(groups):
        chosen = states[:count, -kept:]
        result[row, : len(chosen)] = chosen
    return result
