"""The values of a parameter at which chaos was looked for: motions that are begun there, and the judgement of those that do not
settle."""

from __future__ import annotations

from bisect import bisect_left, insort
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from saltus.attractors import EarlierJudgement, Judged
from saltus.flow import Ending
from saltus.studies.diagram.bands import Bands, Tried, bands_of
from saltus.studies.diagram.diagram_work import DiagramWork
from saltus.studies.diagram.effort import CHAOS, ChaosSettings
from saltus.studies.diagram.simulated import SimulatedMotions

# Of several verdicts, the last one counts.
RANKS = (Ending.PERIODIC, Ending.QUASI_PERIODIC, Ending.TRANSIENT, Ending.UNDECIDED, Ending.CHAOTIC)


@dataclass(order=True)
class SearchedValue:
    """What is known at one value of the parameter."""

    value: float
    verdict: Ending = field(default=Ending.PERIODIC, compare=False)  # until a motion is judged, all are taken to settle
    exponent: float = field(default=np.nan, compare=False)
    error: float = field(default=np.nan, compare=False)
    life: float = field(default=np.nan, compare=False)
    period: int = field(default=0, compare=False)  # of a motion that settles slowly, or on an orbit of a long period
    care: int = field(default=0, compare=False)  # number of the judgement that gave the verdict
    settled: int = field(default=0, compare=False)  # companions that settled in that judgement
    chaos: np.ndarray = field(default_factory=lambda: np.empty((0, 0)), compare=False)  # (n, d): states of unsettled motions
    # Period, number of impacts, amplitude and state at phase 0 of each motion that has settled.
    orbits: list[tuple[int, int, float, np.ndarray]] = field(default_factory=list, compare=False)
    longest_orbit: int = field(default=0, compare=False)  # the longest of their periods, which is asked for very often

    @property
    def chaotic(self) -> bool:
        """Whether there is chaos."""
        return self.verdict is Ending.CHAOTIC

    @property
    def quiet(self) -> float:
        """Forcing periods of companions, in all, if none of these has settled, else 0; see `Judged.life`."""
        return 0.0 if self.settled else 3.0 * self.life

    @property
    def kinds(self) -> set[tuple[int, int]]:
        """Period and impacts of the motions that have settled."""
        return {orbit[:2] for orbit in self.orbits}

    @property
    def goes_on(self) -> bool:
        """Whether motions here are chaotic or may be so, are on a torus, or have a longer period than those that have settled."""
        if self.verdict is Ending.PERIODIC:
            return self.period > self.longest_orbit
        return self.verdict is not Ending.TRANSIENT

    @property
    def longest(self) -> int:
        """The longest period of the motions that settle, in forcing periods."""
        return max(self.period, self.longest_orbit)

    def judge(self, judged: Judged, row: int, care: int) -> None:
        """Take the verdict on the unsettled motions here, unless an earlier judgement was more careful, or as careful and found a
        verdict of higher rank."""
        verdict = Ending(judged.ending[row])
        if care < self.care or (care == self.care and RANKS.index(verdict) < RANKS.index(self.verdict)):
            return
        self.verdict, self.care, self.chaos = verdict, care, judged.states[row]
        self.exponent, self.error = float(judged.exponent[row]), float(judged.error[row])
        self.life, self.period = float(judged.life[row]), int(judged.period[row])
        self.settled = int(judged.gone[row])

    def settle(self, period: int, impacts: int, amplitude: float, state: np.ndarray) -> None:
        """Add a motion that has settled here, unless it is known."""
        for q, n, size, _ in self.orbits:
            if (q, n) == (period, impacts) and abs(size - amplitude) <= 1e-4 * size:
                return
        self.orbits.append((period, impacts, amplitude, state))
        self.longest_orbit = max(self.longest_orbit, period)

    def starts(self, seeds: int, orbits: int) -> np.ndarray:
        """States from which motions at neighbouring values are begun, (n, d)."""
        unsettled = len(self.chaos) > 0 and (self.goes_on or not self.orbits)
        chosen = self.chaos[np.linspace(0, len(self.chaos) - 1, seeds).astype(int)] if unsettled else self.chaos[:0]
        settled = [orbit[3][None] for orbit in self.orbits[:orbits]]
        return np.concatenate([*([chosen] if len(chosen) or not settled else []), *settled])


class Begun(NamedTuple):
    """Motions that begin at one value, from states (n, d), and the care with which they are judged if they do not settle."""

    value: float
    states: np.ndarray
    care: int = 0


class Question(NamedTuple):
    """States (n, m, d) of motions that have not settled at values (n,), to be judged with the same care."""

    values: np.ndarray
    states: np.ndarray
    care: int
    earlier: EarlierJudgement | None = None


@dataclass
class SearchedRange:
    """What is known between two values of a parameter; long computations are done by `work`."""

    work: DiagramWork
    bounds: tuple[float, float]
    settings: ChaosSettings = CHAOS
    places: list[SearchedValue] = field(default_factory=list)  # by value
    given: list[SimulatedMotions] = field(default_factory=list)  # motions that were simulated before, in the order of the calls
    begun: list[SimulatedMotions] = field(default_factory=list)  # motions that the search has begun itself

    @property
    def bands(self) -> Bands:
        """The bands that have been found."""
        tried, motions = self.tried(), self.given[0].joined(*self.given[1:], *self.begun)
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

    def follow(self, begun: Iterable[Begun]) -> None:
        """Follow motions from states at some values, and judge those that do not settle."""
        some = [one for one in begun if len(one.states)]
        if some:
            column = np.repeat([one.value for one in some], [len(one.states) for one in some])
            motions = self._simulate(column, np.concatenate([one.states for one in some]))
            self.take(motions, {one.value: one.care for one in some})

    def _simulate(self, values: np.ndarray, states: np.ndarray) -> SimulatedMotions:
        self.begun.append(self.work.simulate(values, states, self.settings.settling))
        return self.begun[-1]

    def take(self, motions: SimulatedMotions, care: Mapping[float, int] = MappingProxyType({})) -> None:
        """Add motions to what is known, and judge those that have not settled, with more care at some values."""
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
        states, cares = states.reshape(len(values), -1, states.shape[-1]), np.array([care.get(value, 0) for value in values])
        self._judge([Question(values[cares == one], states[cares == one], one) for one in np.unique(cares).tolist()])

    def _judge(self, questions: Sequence[Question]) -> None:
        """Judge motions that have not settled.

        Motions on which companions have settled are then simulated too, and added to what is known.
        """
        answers = self.work.judge_all([(q.values, q.states, self.settings.judgements[q.care], q.earlier) for q in questions])
        later: list[Begun] = []
        for question, judged in zip(questions, answers, strict=True):
            for row, value in enumerate(question.values):
                self.place(float(value)).judge(judged, row, question.care)
            found = judged.settled.few(self.settings.neighbours // 2, len(judged.settled.period))
            later += [Begun(question.values[row], state[None]) for row, state in zip(found.question, found.state, strict=True)]
        if later:
            states = np.concatenate([one.states for one in later])
            self._settle(self._simulate(np.array([one.value for one in later]), states))

    def _settle(self, motions: SimulatedMotions) -> None:
        """Note at each value on what motions have settled."""
        for i in np.flatnonzero(motions.periodic):
            impacts = 0 if 0.0 < motions.slowest[i] < self.settings.dying else int(motions.impact_count[i])
            facts = int(motions.period[i]), impacts, float(motions.amplitude[i])
            self.place(float(motions.value[i])).settle(*facts, motions.last[i])

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
