"""Looking for chaos along a parameter, in ever smaller steps where something changes."""

from __future__ import annotations

import itertools
from bisect import bisect_left, insort
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from saltus.attractors import EarlierJudgement
from saltus.checks import check_count, checked_by
from saltus.errors import ParameterError, shown
from saltus.flow import Ending
from saltus.progress import Progress, part_of, silent
from saltus.studies.diagram.bands import BandOrigin, Bands
from saltus.studies.diagram.diagram_work import DiagramWork
from saltus.studies.diagram.effort import EFFORTS, check_diagram, read_effort
from saltus.studies.diagram.searched_range import (
    JudgementRequest,
    MotionStarts,
    SearchedRange,
    SearchedValue,
)
from saltus.studies.diagram.simulated import SimulatedMotions, starts_at
from saltus.systems import Box, System, check_window

# The share of the rest that is taken as still to be done after each round, as their number is not
# known before.
SLOWER = 0.8


def _check(
    system: System,
    path: str,
    bounds: tuple[float, float],
    count: int,
    starts: int,
    window: object,
    seed: int,
    special: object,
    effort: str,
    progress: object,
) -> None:
    check_diagram(system, path, bounds, starts=starts, seed=seed)
    read_effort(effort)
    check_count("count", count, 2)
    check_window(window, system)
    if not isinstance(special, Iterable) or isinstance(special, (str, bytes, Mapping)):
        raise ParameterError(
            f"special must be BandOrigins, as band_origins gives them, got {shown(special)}",
            "special",
        )
    for origin in special if isinstance(special, (list, tuple)) else ():
        if not isinstance(origin, BandOrigin):
            raise ParameterError(
                f"special must be BandOrigins, as band_origins gives them, got {shown(origin)}",
                "special",
            )


@checked_by(_check)
def chaotic_bands(
    system: System,
    path: str,
    bounds: tuple[float, float],
    *,
    count: int = 121,
    starts: int = 8,
    window: Box | None = None,
    seed: int = 0,
    special: Iterable[BandOrigin] = (),
    effort: str = "standard",
    progress: Progress = silent,
) -> Bands:
    """Where motions are chaotic along a parameter, first from `starts` states at each of `count`
    values.

    Where the motions at two neighbouring values differ, or are chaotic at one of them, the interval
    is halved, down to a thousandth of the range. Motions at the new value begin on those at both
    ends, so that an attractor is followed however small its basin is. Motions that have not settled
    after 300 forcing periods are judged by `judge`. The edges of bands, and of windows of periodic
    motion within them, are then enclosed in brackets of 1e-4 of the range. The motions for this
    begin on the chaos of the inner side. Windows narrower than a thousandth of the range are found
    by chance only; an attractor is not found if its basin contains no start and it ends before the
    next value. `effort="quick"` halves to 4e-3 and 1e-3 of the range and judges once; "thorough"
    halves to 5e-4 and 5e-5.

    Parameters
    ----------
    system
        What moves, under a load with a frequency.
    path, bounds
        Dotted path of the parameter, and its range.
    count
        Number of values, evenly spaced from bound to bound, at least 2.
    starts, window, seed
        Initial states, as `search_orbits` takes them.
    special
        Special points of branches, beside which motions are begun, as narrow bands begin there.
    effort
        How finely bands are resolved, and how surely transients are excluded, see `Effort`.
    progress
        Called with the fraction done.

    Raises
    ------
    ParameterError
        An argument without meaning.

    Examples
    --------
    >>> bands = saltus.chaotic_bands(system, "load.frequency", (0.98, 1.0), count=3)
    >>> len(bands.bands)
    0
    """
    values = np.linspace(*bounds, count)
    area = check_window(window, system)
    states = starts_at(system, values, starts, area, seed).reshape(-1, system.dimension)
    first = part_of(progress, 0.0, 0.2, "looking for chaos")
    work = DiagramWork(system, path)
    search = BandSearch(
        work, (float(bounds[0]), float(bounds[1])), EFFORTS[read_effort(effort)].chaos
    )
    search.look(
        work.simulate(np.repeat(values, starts), states, search.settings.settling, first),
        special,
        part_of(progress, 0.2, 1.0),
    )
    return search.bands


@dataclass
class BandSearch(SearchedRange):
    """The search for bands of chaos between two values of a parameter."""

    special: list[BandOrigin] = field(default_factory=list)  # by value
    # the values of special points beside which motions were begun
    chosen: list[float] = field(default_factory=list)
    # Pairs of neighbouring values: motions were begun at the second one from those at the first
    # one.
    carried: set[tuple[float, float]] = field(default_factory=set)

    def look(
        self,
        motions: SimulatedMotions,
        special: Iterable[BandOrigin] = (),
        progress: Progress = silent,
    ) -> None:
        """Look for chaos from these new motions and beside these special points: `locate` and
        `confirm`.
        """
        self.locate(motions, special, part_of(progress, 0.0, 0.5))
        self.confirm(part_of(progress, 0.5, 1.0))
        progress(1.0, "looking for chaos")

    def begin(self, motions: SimulatedMotions, progress: Progress = silent) -> None:
        """The part of `locate` for which branches need not be known: judge motions, and halve
        intervals between chaos.
        """
        self.given.append(motions)
        self.take(motions)
        self.refine(progress, inside=True)

    def locate(
        self,
        motions: SimulatedMotions,
        special: Iterable[BandOrigin] = (),
        progress: Progress = silent,
    ) -> None:
        """Locate the edges of bands and of windows, from these new motions and beside these special
        points.
        """
        self.given.append(motions)
        self.take(motions)
        self.refine(part_of(progress, 0.0, 0.6))
        self.beside_special_points(special)
        self.refine(part_of(progress, 0.6, 1.0))

    def beside_special_points(
        self, special: Iterable[BandOrigin], progress: Progress = silent
    ) -> None:
        """Begin motions from the orbits of special points that were not known, at values beside
        them, but not within chaos that is known."""
        progress(0.0, "looking for chaos, beside special points")
        fresh = sorted(filter(self._note, special), key=lambda origin: origin.value)
        chosen = [origin for origin in fresh if self._is_apart(origin.value)]
        outside = [origin for origin in chosen if not self._is_within_chaos(origin.value)]
        values = [
            (origin.value + share * self.span, origin.state)
            for origin in outside
            for share in self.settings.beside
        ]
        self.simulate_starts(
            MotionStarts(value, np.array([state]))
            for value, state in values
            if self.bounds[0] <= value <= self.bounds[1]
        )

    def _is_apart(self, value: float) -> bool:
        """Whether no special point nearby was chosen before; then this one is."""
        at = bisect_left(self.chosen, value)
        least = self.settings.spacing * self.span
        apart = all(abs(value - other) >= least for other in self.chosen[max(0, at - 1) : at + 1])
        if apart:
            insort(self.chosen, value)
        return apart

    def _note(self, origin: BandOrigin) -> bool:
        """Note a special point, and return whether it is new: one at which a branch is born is
        found on both branches.
        """
        near = self.settings.same * self.span
        same = self.settings.same
        ends = (
            bisect_left(self.special, origin.value + side, key=lambda other: other.value)
            for side in (-near, near)
        )
        if any(
            np.allclose(origin.state, other.state, rtol=0.0, atol=same)
            for other in self.special[slice(*ends)]
        ):
            return False
        insort(self.special, origin, key=lambda other: other.value)
        return True

    def _is_within_chaos(self, value: float) -> bool:
        """Whether there is chaos at both of the tried values next to this one."""
        at = bisect_left(self.entries, SearchedValue(value))
        return 0 < at < len(self.entries) and all(
            entry.chaotic for entry in self.entries[at - 1 : at + 1]
        )

    def refine(self, progress: Progress = silent, inside: bool = False) -> None:
        """Halve intervals and carry chaos to neighbouring values, until neither shows anything new;
        or, if asked, only halve intervals between two values with chaos.

        All motions of a round are simulated together, as a few motions take nearly as long as many.
        """
        for number in itertools.count():
            progress(1.0 - SLOWER**number, f"looking for chaos, values: {len(self.entries)}")
            pairs = (
                (a, b)
                for a, b in itertools.pairwise(self.entries)
                if not inside or (a.chaotic and b.chaotic)
            )
            middles = [(a, b) for a, b in pairs if self._is_of_interest(a, b)]
            carried = [] if inside else self._to_carry()
            if not middles and not carried:
                return
            begun = [MotionStarts(b.value, a.starts(self.settings.seeds, 0)) for a, b in carried]
            self.simulate_starts(begun + [self._begin_between(a, b) for a, b in middles])

    def _to_carry(self) -> list[tuple[SearchedValue, SearchedValue]]:
        """Pairs of neighbouring values of which only the first one `goes_on`: its motions are to be
        continued at the second one.

        Where there is chaos at the outermost value, the end of the range becomes a value, too.
        """
        for bound, outermost in zip(
            self.bounds, (self.entries[:1], self.entries[-1:]), strict=True
        ):
            if any(entry.chaotic for entry in outermost):
                self.entry(bound)
        marked = [(entry, entry.goes_on) for entry in self.entries]
        pairs = [
            (a, b) if on else (b, a)
            for (a, on), (b, other) in itertools.pairwise(marked)
            if on != other
        ]
        fresh = [(a, b) for a, b in pairs if (a.value, b.value) not in self.carried]
        self.carried.update((a.value, b.value) for a, b in fresh)
        return fresh

    def _is_of_interest(self, a: SearchedValue, b: SearchedValue) -> bool:
        """Whether chaos may begin, end or be interrupted between two neighbouring values that are
        not close to each other yet.
        """
        width = (b.value - a.value) / self.span
        if {a.verdict, b.verdict} <= {Ending.UNDECIDED, Ending.QUASI_PERIODIC}:
            width /= self.settings.undecided
        if a.chaotic != b.chaotic:
            return width > self.settings.edge
        if width <= self.settings.step:
            near_chaos = not a.chaotic and max(a.longest, b.longest) > self.settings.long_period
            return near_chaos and width > self.settings.fine_step
        inside = bisect_left(self.special, a.value, key=lambda origin: origin.value)
        special = inside < len(self.special) and self.special[inside].value <= b.value
        return special or a.kinds != b.kinds or bool(len(a.chaos) + len(b.chaos))

    def _begin_between(self, a: SearchedValue, b: SearchedValue) -> MotionStarts:
        """The motions that begin in the middle of an interval, from the states of the motions at
        both ends.

        If all motions at both ends come to rest there are no such states; the middle then counts as
        tried all the same.
        """
        few = (self.settings.seeds, self.settings.neighbours)
        middle = 0.5 * (a.value + b.value)
        some = [states for states in (a.starts(*few), b.starts(*few)) if len(states)]
        self.entry(middle)
        self.carried.update(((a.value, middle), (b.value, middle)))
        return MotionStarts(
            middle, np.concatenate(some) if some else np.empty((0, 0)), self._level_between(a, b)
        )

    def _level_between(self, a: SearchedValue, b: SearchedValue) -> int:
        """The care with which chaos between two values is judged: if there is an edge between them,
        the one that it needs.
        """
        return self._level_against(b if a.chaotic else a) if a.chaotic != b.chaotic else 0

    def _level_against(self, other: SearchedValue) -> int:
        """The care with which chaos next to a value without chaos is judged.

        If the motions without chaos are transients, it is the least care that excludes mean lives
        `longer` times as long as theirs.
        """
        life = self.settings.longer * other.mean_life if other.verdict is Ending.TRANSIENT else 0.0
        judgements = self.settings.judgements
        return next(
            (level for level, one in enumerate(judgements) if one.exposure >= 3.0 * life),
            len(judgements) - 1,
        )

    def confirm(self, progress: Progress = silent) -> None:
        """Judge doubtful chaos with more care; where it turns out to be a transient, find the new
        edges of the band.
        """
        for number in range(self.settings.confirmations):
            progress(1.0 - SLOWER**number, "looking for chaos, confirming it")
            failed = self._confirm(self._doubtful())
            if not failed:
                return
            self._confirm_near(failed)
            self.refine()

    def _doubtful(self) -> dict[int, list[SearchedValue]]:
        """The values whose chaos is doubtful, by the care with which it is to be judged.

        Settling is a Poisson process, so the forcing periods in which no companion settles add up
        over neighbouring values. If in a stretch of a band they are fewer than the second judgement
        asks for, the value in the middle is judged again. The same holds for narrow parts of a band
        in which some motions settle: these may be windows with long transients. The last value with
        chaos at an edge is judged with the care that `_level_against` gives, and a value at which
        some companions have settled with the next higher care.
        """
        runs = self._runs()
        doubtful = dict[int, list[SearchedValue]]()
        enough = self.settings.judgements[min(1, len(self.settings.judgements) - 1)].exposure
        for part in [
            part for run in runs for part in (*self._stretches(run), *self._beside_windows(run))
        ]:
            if sum(entry.periods_without_settling for entry in part) < enough:
                doubtful.setdefault(1, []).append(part[len(part) // 2])
        for a, b in self._edges():
            doubtful.setdefault(self._level_against(b), []).append(a)
        for entry in (entry for run in runs for entry in run if entry.settled_count):
            doubtful.setdefault(entry.judgement_level + 1, []).append(entry)
        return doubtful

    def _confirm_near(self, failed: list[SearchedValue]) -> None:
        """Judge the nearest chaos beside values that turned out to have none, with as much care;
        where this fails too, twice as many values on each side, and so on."""
        for level in {entry.judgement_level for entry in failed}:
            beside = [entry.value for entry in failed if entry.judgement_level == level]
            reach = 1
            while beside:
                chaotic = [entry for entry in self.entries if entry.chaotic]
                at = [bisect_left(chaotic, SearchedValue(value)) for value in beside]
                near = {
                    entry.value: entry
                    for i in at
                    for entry in chaotic[max(0, i - reach) : i + reach]
                }
                beside, reach = (
                    [entry.value for entry in self._confirm({level: list(near.values())})],
                    2 * reach,
                )

    def _edges(self) -> list[tuple[SearchedValue, SearchedValue]]:
        """Neighbours of which the first is chaotic and the second is not."""
        pairs = [pair for a, b in itertools.pairwise(self.entries) for pair in ((a, b), (b, a))]
        return [(a, b) for a, b in pairs if a.chaotic and not b.chaotic]

    def _confirm(self, doubtful: Mapping[int, Sequence[SearchedValue]]) -> list[SearchedValue]:
        """Judge chaos with these levels where that has not been done; returns the values at which
        there is none after all.
        """
        wanted: dict[float, tuple[int, SearchedValue]] = {}
        for level in sorted(doubtful):  # of several levels the highest counts
            wanted |= {
                entry.value: (min(level, len(self.settings.judgements) - 1), entry)
                for entry in doubtful[level]
            }
        asked: dict[tuple[int, int], list[SearchedValue]] = {}
        for level, entry in wanted.values():
            if entry.chaotic and entry.judgement_level < level:
                asked.setdefault((level, len(entry.chaos)), []).append(entry)
        questions = []
        for (level, _), alike in asked.items():
            known = EarlierJudgement(
                *np.array(
                    [
                        (entry.exponent, entry.error, entry.periods_without_settling)
                        for entry in alike
                    ]
                ).T
            )
            states = np.stack([entry.chaos for entry in alike])
            questions.append(
                JudgementRequest(np.array([entry.value for entry in alike]), states, level, known)
            )
        self._judge(questions)
        return [entry for alike in asked.values() for entry in alike if not entry.chaotic]

    def _runs(self) -> list[list[SearchedValue]]:
        """The runs of successive values with chaos."""
        runs: list[list[SearchedValue]] = [[]]
        for entry in self.entries:
            if entry.chaotic:
                runs[-1].append(entry)
            elif runs[-1]:
                runs.append([])
        return [run for run in runs if run]

    def _stretches(self, run: list[SearchedValue]) -> list[list[SearchedValue]]:
        """The parts of a band whose values are judged together, with about equal numbers of
        values.
        """
        count = 1 + int((run[-1].value - run[0].value) / (self.settings.every * self.span))
        return [
            part.tolist()
            for part in np.array_split(np.array(run, dtype=object), min(count, len(run)))
        ]

    def _beside_windows(self, run: list[SearchedValue]) -> list[list[SearchedValue]]:
        """The narrow parts of a band in which some motions settle, a part for each period and
        number of impacts.
        """
        extents: dict[tuple[int, int], list[SearchedValue]] = {}
        for entry in run:
            for kind in entry.kinds:
                extents.setdefault(kind, []).append(entry)
        return [
            some
            for some in extents.values()
            if some[-1].value - some[0].value <= self.settings.every * self.span
        ]
