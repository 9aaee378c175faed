"""Looking for chaos along a parameter, in ever smaller steps where something changes."""

from __future__ import annotations

from bisect import bisect_left, insort
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from saltus.attractors import Earlier, Unsettled
from saltus.checks import check_count
from saltus.progress import Progress, part_of, silent
from saltus.public_functions import checked_by
from saltus.studies.checks import check_diagram
from saltus.studies.diagram.bands import Bands, Tried, bands_of
from saltus.studies.diagram.chaos_settings import SETTINGS, ChaosSettings
from saltus.studies.diagram.diagram_work import DiagramWork
from saltus.studies.diagram.effort import EFFORTS, read_effort
from saltus.studies.diagram.searched_value import SearchedValue
from saltus.studies.diagram.simulated import SimulatedMotions, starts_at
from saltus.systems import System
from saltus.window import Box, check_window


class BandOrigin(NamedTuple):
    """A special point of a branch, at which bands of chaos may begin."""

    kind: str
    value: float  # of the parameter
    state: tuple[float, ...]  # of its orbit at phase 0


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
    """Where motions are chaotic along a parameter, first from `starts` states at each of `count` values.

    Where the motions at two neighbouring values differ, or are chaotic at one of them, the interval is halved, down to a
    thousandth of the range. Motions at the new value begin on those at both ends, so that an attractor is followed however small
    its basin is. Motions that have not settled after 300 forcing periods are judged by `judge_unsettled`. The edges of bands, and
    of windows of periodic motion within them, are then enclosed in brackets of 1e-4 of the range, by motions begun on the chaos
    of the inner side. Windows narrower than a thousandth of the range are found by chance only; an attractor is not found if its
    basin contains no start and it ends before the next value. `effort="quick"` halves to 4e-3 and 1e-3 of the range and judges
    once; "thorough" halves to 5e-4 and 5e-5.

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
    values, area = np.linspace(*bounds, count), check_window(window, system)
    states = starts_at(system, values, starts, area, seed).reshape(-1, system.dimension)
    first = part_of(progress, 0.0, 0.2, "looking for chaos")
    work = DiagramWork(system, path)
    search = BandSearch(work, (float(bounds[0]), float(bounds[1])), EFFORTS[read_effort(effort)].chaos)
    search.look(
        work.simulate(np.repeat(values, starts), states, search.settings.settling, first), special, part_of(progress, 0.2, 1.0)
    )
    return search.bands


@dataclass
class BandSearch:
    """The search for bands of chaos between two values of a parameter; it remembers all motions that it was given or has begun.

    Long computations are done by `work`.
    """

    work: DiagramWork
    bounds: tuple[float, float]
    settings: ChaosSettings = SETTINGS
    special: list[BandOrigin] = field(default_factory=list)  # by value
    places: list[SearchedValue] = field(default_factory=list)  # by value
    further: list[SimulatedMotions] = field(default_factory=list)
    # Pairs of neighbouring values: motions were begun at the second one from those at the first one.
    carried: set[tuple[float, float]] = field(default_factory=set)

    def look(self, begun: SimulatedMotions, special: Iterable[BandOrigin] = (), progress: Progress = silent) -> SimulatedMotions:
        """Look for chaos from these new motions and beside these special points; returns the further motions that were begun."""
        known, fresh = len(self.further), list[BandOrigin]()
        for origin in special:
            if not self._is_known(origin):
                fresh.append(origin)
                insort(self.special, origin, key=lambda other: other.value)
        self.take(begun)
        self.refine()
        progress(0.4, "looking for chaos")
        self.beside_special_points(fresh)
        self.refine()
        progress(0.6, "looking for chaos")
        self.confirm()
        progress(1.0, "looking for chaos")
        further = self.further[known + 1 :]
        return further[0].joined(*further[1:]) if further else begun.only(slice(0))

    def _is_known(self, origin: BandOrigin) -> bool:
        """Whether a special point is known already: one at which a branch is born is found on both branches."""
        near, same = self.settings.same * self.span, self.settings.same
        ends = (bisect_left(self.special, origin.value + side, key=lambda other: other.value) for side in (-near, near))
        return any(np.allclose(origin.state, other.state, rtol=0.0, atol=same) for other in self.special[slice(*ends)])

    @property
    def bands(self) -> Bands:
        """The bands that have been found."""
        tried, motions = self.tried(), self.further[0].joined(*self.further[1:])
        return Bands(self.work.system, self.work.path, bands_of(tried), tried, motions)

    @property
    def span(self) -> float:
        """The width of the range."""
        return self.bounds[1] - self.bounds[0]

    def place(self, value: float) -> SearchedValue:
        """The entry of a value, a new one if the value was not tried before."""
        at = bisect_left(self.places, SearchedValue(value))
        if at == len(self.places) or self.places[at].value != value:
            insort(self.places, SearchedValue(value, chaos=np.empty((0, self.work.system.dimension))))
        return self.places[at]

    def follow(self, values: Sequence[float], starts: Sequence[np.ndarray], care: int = 0) -> None:
        """Follow motions from states (n, d), given for each value, and judge those that do not settle."""
        column = np.repeat(np.asarray(values, dtype=float), [len(states) for states in starts])
        if len(column):
            states = np.concatenate([some for some in starts if len(some)])
            self.take(self.work.simulate(column, states, self.settings.settling), care)

    def take(self, motions: SimulatedMotions, care: int = 0) -> None:
        """Add motions to what is known, and judge those that have not settled."""
        self._settle(motions)
        for value in np.unique(motions.value):
            self.place(float(value))
        loose = motions.only(motions.unsettled)
        values, row = np.unique(loose.value, return_inverse=True)
        if not values.size:
            return
        most, last = int(np.bincount(row).max()), loose.states[:, -self.settings.states :]
        states = np.full((len(values), most, *last.shape[1:]), np.nan)
        for i in range(len(values)):
            states[i, : np.count_nonzero(row == i)] = last[row == i]
        self._judge(values, states.reshape(len(values), -1, states.shape[-1]), care)

    def _judge(self, values: np.ndarray, states: np.ndarray, care: int, earlier: Earlier | None = None) -> None:
        """Judge the motions that have not settled, of which states (n, m, d) are given, one row for each value.

        Motions on which companions have settled are then simulated too, and added to what is known.
        """
        judged = self.work.judge(values, states, self.settings.judgements[care], earlier)
        for row, value in enumerate(values):
            self.place(float(value)).judge(judged, row, care)
        found = judged.settled.few(self.settings.neighbours // 2, len(judged.settled.period))
        if len(found.question):
            column = values[found.question]
            self._settle(self.work.simulate(column, found.state, self.settings.settling))

    def _settle(self, motions: SimulatedMotions) -> None:
        self.further.append(motions)
        for i in np.flatnonzero(motions.periodic):
            impacts = 0 if 0.0 < motions.slowest[i] < self.settings.dying else int(motions.impact_count[i])
            facts = int(motions.period[i]), impacts, float(motions.amplitude[i])
            self.place(float(motions.value[i])).settle(*facts, motions.last[i])

    def beside_special_points(self, special: Sequence[BandOrigin]) -> None:
        """Begin motions from the orbits of special points, at values beside them, but not within chaos that is known."""
        chosen: list[BandOrigin] = []
        for origin in sorted(special, key=lambda origin: origin.value):
            if not chosen or origin.value - chosen[-1].value >= self.settings.spacing * self.span:
                chosen.append(origin)
        outside = [origin for origin in chosen if not self._is_within_chaos(origin.value)]
        values = [(origin.value + share * self.span, origin.state) for origin in outside for share in self.settings.beside]
        inside = [(value, state) for value, state in values if self.bounds[0] <= value <= self.bounds[1]]
        self.follow([value for value, _ in inside], [np.array([state]) for _, state in inside])

    def _is_within_chaos(self, value: float) -> bool:
        """Whether there is chaos at both of the tried values next to this one."""
        at = bisect_left(self.places, SearchedValue(value))
        return 0 < at < len(self.places) and all(place.chaotic for place in self.places[at - 1 : at + 1])

    def refine(self) -> None:
        """Halve intervals and carry chaos to neighbouring values, until neither shows anything new.

        All motions of a round are simulated together, as a few motions take nearly as long as many.
        """
        while True:
            middles = [(a, b) for a, b in pairwise(self.places) if self._is_of_interest(a, b)]
            carried = self._to_carry()
            if not middles and not carried:
                return
            begun = {0: [(b.value, a.starts(self.settings.seeds, 0)) for a, b in carried]}
            for a, b in middles:
                begun.setdefault(self._care_between(a, b), []).append(self._begin_between(a, b))
            for care, pairs in begun.items():
                self.follow([value for value, _ in pairs], [states for _, states in pairs], care)

    def _to_carry(self) -> list[tuple[SearchedValue, SearchedValue]]:
        """Pairs of neighbouring values of which only the first one `goes_on`: its motions are to be continued at the second one.

        Where there is chaos at the outermost value, the end of the range becomes a value, too.
        """
        for bound, outermost in zip(self.bounds, (self.places[:1], self.places[-1:]), strict=True):
            if any(place.chaotic for place in outermost):
                self.place(bound)
        marked = [(place, place.goes_on) for place in self.places]
        pairs = [(a, b) if on else (b, a) for (a, on), (b, other) in pairwise(marked) if on != other]
        fresh = [(a, b) for a, b in pairs if (a.value, b.value) not in self.carried]
        self.carried.update((a.value, b.value) for a, b in fresh)
        return fresh

    def _is_of_interest(self, a: SearchedValue, b: SearchedValue) -> bool:
        """Whether chaos may begin, end or be interrupted between two neighbouring values that are not close to each other yet."""
        width = (b.value - a.value) / self.span
        if a.verdict is b.verdict is Unsettled.UNDECIDED:
            width /= self.settings.undecided
        if a.chaotic != b.chaotic:
            return width > self.settings.edge
        if width <= self.settings.step:
            near_chaos = not a.chaotic and max(a.longest, b.longest) > self.settings.long_period
            return near_chaos and width > self.settings.fine_step
        inside = bisect_left(self.special, a.value, key=lambda origin: origin.value)
        special = inside < len(self.special) and self.special[inside].value <= b.value
        return special or a.kinds != b.kinds or bool(len(a.chaos) + len(b.chaos))

    def _begin_between(self, a: SearchedValue, b: SearchedValue) -> tuple[float, np.ndarray]:
        """The middle of an interval, and the states from which motions begin there: those of the motions at both ends.

        If all motions at both ends come to rest there are no such states; the middle then counts as tried all the same.
        """
        few, middle = (self.settings.seeds, self.settings.neighbours), 0.5 * (a.value + b.value)
        some = [states for states in (a.starts(*few), b.starts(*few)) if len(states)]
        self.place(middle)
        self.carried.update(((a.value, middle), (b.value, middle)))
        return middle, np.concatenate(some) if some else np.empty((0, 0))

    def _care_between(self, a: SearchedValue, b: SearchedValue) -> int:
        """The care with which chaos between two values is judged: if there is an edge between them, the one that it needs."""
        return self._care_against(b if a.chaotic else a) if a.chaotic != b.chaotic else 0

    def _care_against(self, other: SearchedValue) -> int:
        """The care with which chaos next to a value without chaos is judged.

        If the motions without chaos are transients, it is the least care that excludes mean lives `longer` times as long as
        theirs.
        """
        life = self.settings.longer * other.life if other.verdict is Unsettled.TRANSIENT else 0.0
        judgements = self.settings.judgements
        return next((care for care, one in enumerate(judgements) if one.exposure >= 3.0 * life), len(judgements) - 1)

    def confirm(self) -> None:
        """Judge doubtful chaos with more care; where it turns out to be a transient, find the new edges of the band."""
        for _ in range(self.settings.confirmations):
            failed = [place for care, places in self._doubtful().items() for place in self._confirm(places, care)]
            if not failed:
                return
            self._confirm_near(failed)
            self.refine()

    def _doubtful(self) -> dict[int, list[SearchedValue]]:
        """The values whose chaos is doubtful, by the care with which it is to be judged.

        Settling is a Poisson process, so the forcing periods in which no companion settles add up over neighbouring values. If in
        a stretch of a band they are fewer than the second judgement asks for, the value in the middle is judged again. The same
        holds for narrow parts of a band in which some motions settle: these may be windows with long transients. The last value
        with chaos at an edge is judged with the care that `_care_against` gives, and a value at which some companions have
        settled with the next higher care.
        """
        runs, doubtful = self._runs(), dict[int, list[SearchedValue]]()
        enough = self.settings.judgements[min(1, len(self.settings.judgements) - 1)].exposure
        for part in [part for run in runs for part in (*self._stretches(run), *self._beside_windows(run))]:
            if sum(place.quiet for place in part) < enough:
                doubtful.setdefault(1, []).append(part[len(part) // 2])
        for a, b in self._edges():
            doubtful.setdefault(self._care_against(b), []).append(a)
        for place in (place for run in runs for place in run if place.settled):
            doubtful.setdefault(place.care + 1, []).append(place)
        return doubtful

    def _confirm_near(self, failed: list[SearchedValue]) -> None:
        """Judge the nearest chaos beside values that turned out to have none; where this chaos fails too, go on outwards."""
        for care in {place.care for place in failed}:
            beside, reach = [place.value for place in failed if place.care == care], self.settings.near
            while beside:
                chaotic = [place for place in self.places if place.chaotic]
                at = [bisect_left(chaotic, SearchedValue(value)) for value in beside]
                near = {place.value: place for i in at for place in chaotic[max(0, i - reach) : i + reach]}
                beside, reach = [place.value for place in self._confirm(near.values(), care)], 2 * reach

    def _edges(self) -> list[tuple[SearchedValue, SearchedValue]]:
        """Neighbours of which the first is chaotic and the second is not."""
        pairs = [pair for a, b in pairwise(self.places) for pair in ((a, b), (b, a))]
        return [(a, b) for a, b in pairs if a.chaotic and not b.chaotic]

    def _confirm(self, places: Iterable[SearchedValue], care: int) -> list[SearchedValue]:
        """Judge chaos with this care where that has not been done; returns the values at which there is none after all."""
        care = min(care, len(self.settings.judgements) - 1)
        doubtful = list({place.value: place for place in places if place.chaotic and place.care < care}.values())
        for size in {len(place.chaos) for place in doubtful}:
            alike = [place for place in doubtful if len(place.chaos) == size]
            known = Earlier(*np.array([(place.exponent, place.error, place.quiet) for place in alike]).T)
            self._judge(np.array([place.value for place in alike]), np.stack([place.chaos for place in alike]), care, known)
        return [place for place in doubtful if not place.chaotic]

    def _runs(self) -> list[list[SearchedValue]]:
        """The runs of successive values with chaos."""
        runs: list[list[SearchedValue]] = [[]]
        for place in self.places:
            if place.chaotic:
                runs[-1].append(place)
            elif runs[-1]:
                runs.append([])
        return [run for run in runs if run]

    def _stretches(self, run: list[SearchedValue]) -> list[list[SearchedValue]]:
        """The parts of a band whose values are judged together, with about equal numbers of values."""
        count = 1 + int((run[-1].value - run[0].value) / (self.settings.every * self.span))
        return [part.tolist() for part in np.array_split(np.array(run, dtype=object), min(count, len(run)))]

    def _beside_windows(self, run: list[SearchedValue]) -> list[list[SearchedValue]]:
        """The narrow parts of a band in which some motions settle, a part for each period and number of impacts."""
        extents: dict[tuple[int, int], list[SearchedValue]] = {}
        for place in run:
            for kind in place.kinds:
                extents.setdefault(kind, []).append(place)
        return [some for some in extents.values() if some[-1].value - some[0].value <= self.settings.every * self.span]

    def tried(self) -> Tried:
        """What became of motions at all values."""
        most = max(judgement.companions for judgement in self.settings.judgements)
        states = np.full((len(self.places), most, self.work.system.dimension), np.nan)
        for row, place in enumerate(self.places):
            states[row, : len(place.chaos)] = place.chaos
        return Tried(
            values=np.array([place.value for place in self.places]),
            verdict=np.array([place.verdict for place in self.places]),
            exponent=np.array([place.exponent for place in self.places]),
            error=np.array([place.error for place in self.places]),
            life=np.array([place.life for place in self.places]),
            period=np.array([place.longest for place in self.places]),
            states=states,
        )
