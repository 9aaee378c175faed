"""The values of a parameter at which chaos was looked for: motions that are begun there, and the
judgement of those that do not settle."""

from __future__ import annotations

from bisect import bisect_left, insort
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from saltus.attractors import EarlierJudgement, Judged
from saltus.flow import Ending
from saltus.studies.diagram.bands import Bands, TriedValues, bands_of
from saltus.studies.diagram.diagram_work import DiagramWork
from saltus.studies.diagram.effort import CHAOS, ChaosSettings
from saltus.studies.diagram.simulated import SimulatedMotions
from saltus.systems import natural_units

# Of several verdicts, the last one counts.
RANKS = (Ending.PERIODIC, Ending.QUASI_PERIODIC, Ending.TRANSIENT, Ending.UNDECIDED, Ending.CHAOTIC)


@dataclass(order=True)
class SearchedValue:
    """What is known at one value of the parameter."""

    value: float
    # until a motion is judged, all are taken to settle
    verdict: Ending = field(default=Ending.PERIODIC, compare=False)
    exponent: float = field(default=np.nan, compare=False)
    error: float = field(default=np.nan, compare=False)
    mean_life: float = field(default=np.nan, compare=False)
    # of a motion that settles slowly, or on an orbit of a long period
    period: int = field(default=0, compare=False)
    # number of the judgement that gave the verdict
    judgement_level: int = field(default=0, compare=False)
    # companions that settled in that judgement
    settled_count: int = field(default=0, compare=False)
    # (n, d): states of unsettled motions
    chaos: np.ndarray = field(default_factory=lambda: np.empty((0, 0)), compare=False)
    # Period, number of impacts, amplitude and state at phase 0 of each motion that has settled.
    orbits: list[tuple[int, int, float, np.ndarray]] = field(default_factory=list, compare=False)
    # the longest of their periods, which is asked for very often
    longest_orbit: int = field(default=0, compare=False)

    @property
    def chaotic(self) -> bool:
        """Whether there is chaos."""
        return self.verdict is Ending.CHAOTIC

    @property
    def periods_without_settling(self) -> float:
        """Forcing periods of companions, in all, if none of these has settled, else 0; see
        `Judged.mean_life`.
        """
        return 0.0 if self.settled_count else 3.0 * self.mean_life

    @property
    def kinds(self) -> set[tuple[int, int]]:
        """Period and impacts of the motions that have settled."""
        return {orbit[:2] for orbit in self.orbits}

    @property
    def goes_on(self) -> bool:
        """Whether motions here are chaotic or may be so, are on a torus, or have a longer period
        than those that have settled.
        """
        if self.verdict is Ending.PERIODIC:
            return self.period > self.longest_orbit
        return self.verdict is not Ending.TRANSIENT

    @property
    def longest(self) -> int:
        """The longest period of the motions that settle, in forcing periods."""
        return max(self.period, self.longest_orbit)

    def judge(self, judged: Judged, row: int, level: int) -> None:
        """Take the verdict on the unsettled motions here, unless an earlier judgement was more
        careful, or as careful and found a verdict of higher rank."""
        verdict = Ending(judged.ending[row])
        if level < self.judgement_level or (
            level == self.judgement_level and RANKS.index(verdict) < RANKS.index(self.verdict)
        ):
            return
        self.verdict = verdict
        self.judgement_level = level
        self.chaos = judged.states[row]
        self.exponent, self.error = float(judged.exponent[row]), float(judged.error[row])
        self.mean_life, self.period = float(judged.mean_life[row]), int(judged.period[row])
        self.settled_count = int(judged.settled_count[row])

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
        chosen = (
            self.chaos[np.linspace(0, len(self.chaos) - 1, seeds).astype(int)]
            if unsettled
            else self.chaos[:0]
        )
        settled = [orbit[3][None] for orbit in self.orbits[:orbits]]
        return np.concatenate([*([chosen] if len(chosen) or not settled else []), *settled])


class MotionStarts(NamedTuple):
    """Motions that begin at one value, from states (n, d), and the care with which they are judged
    if they do not settle.
    """

    value: float
    states: np.ndarray
    level: int = 0


class JudgementRequest(NamedTuple):
    """States (n, m, d) of motions that have not settled at values (n,), to be judged with the same
    care.
    """

    values: np.ndarray
    states: np.ndarray
    level: int
    earlier: EarlierJudgement | None = None


@dataclass
class SearchedRange:
    """What is known between two values of a parameter; long computations are done by `work`."""

    work: DiagramWork
    bounds: tuple[float, float]
    settings: ChaosSettings = CHAOS
    entries: list[SearchedValue] = field(default_factory=list)  # by value
    # motions that were simulated before, in the order of the calls
    given: list[SimulatedMotions] = field(default_factory=list)
    # motions that the search has begun itself
    begun: list[SimulatedMotions] = field(default_factory=list)

    @property
    def bands(self) -> Bands:
        """The bands that have been found."""
        tried = self.tried()
        motions = self.given[0].joined(*self.given[1:], *self.begun)
        return Bands(self.work.system, self.work.path, bands_of(tried), tried, motions)

    @property
    def span(self) -> float:
        """The width of the range."""
        return self.bounds[1] - self.bounds[0]

    def entry(self, value: float) -> SearchedValue:
        """The entry of a value, a new one if the value was not tried before."""
        at = bisect_left(self.entries, SearchedValue(value))
        if at == len(self.entries) or self.entries[at].value != value:
            insort(
                self.entries, SearchedValue(value, chaos=np.empty((0, self.work.system.dimension)))
            )
        return self.entries[at]

    def simulate_starts(self, begun: Iterable[MotionStarts]) -> None:
        """Follow motions from states at some values, and judge those that do not settle."""
        some = [one for one in begun if len(one.states)]
        if some:
            column = np.repeat([one.value for one in some], [len(one.states) for one in some])
            motions = self._simulate(column, np.concatenate([one.states for one in some]))
            self.take(motions, {one.value: one.level for one in some})

    def _simulate(self, values: np.ndarray, states: np.ndarray) -> SimulatedMotions:
        self.begun.append(self.work.simulate(values, states, self.settings.settling))
        return self.begun[-1]

    def take(
        self, motions: SimulatedMotions, level: Mapping[float, int] = MappingProxyType({})
    ) -> None:
        """Add motions to what is known, and judge those that have not settled, with more care at
        some values.
        """
        self._settle(motions)
        for value in np.unique(motions.value):
            self.entry(float(value))
        loose = motions.only(motions.unsettled)
        values, row = np.unique(loose.value, return_inverse=True)
        if not values.size:
            return
        most = int(np.bincount(row).max())
        last = loose.states[:, -self.settings.states :]
        states = np.full((len(values), most, *last.shape[1:]), np.nan)
        for i in range(len(values)):
            states[i, : np.count_nonzero(row == i)] = last[row == i]
        states, levels = (
            states.reshape(len(values), -1, states.shape[-1]),
            np.array([level.get(value, 0) for value in values]),
        )
        self._judge(
            [
                JudgementRequest(values[levels == one], states[levels == one], one)
                for one in np.unique(levels).tolist()
            ]
        )

    def _judge(self, questions: Sequence[JudgementRequest]) -> None:
        """Judge motions that have not settled.

        Motions on which companions have settled are then simulated too, and added to what is known.
        """
        answers = self.work.judge_all(
            [(q.values, q.states, self.settings.judgements[q.level], q.earlier) for q in questions]
        )
        later: list[MotionStarts] = []
        for question, judged in zip(questions, answers, strict=True):
            for row, value in enumerate(question.values):
                self.entry(float(value)).judge(judged, row, question.level)
            found = judged.settled.few(self.settings.neighbours // 2, len(judged.settled.period))
            later += [
                MotionStarts(question.values[row], state[None])
                for row, state in zip(found.question, found.state, strict=True)
            ]
        if later:
            states = np.concatenate([one.states for one in later])
            self._settle(self._simulate(np.array([one.value for one in later]), states))

    def _settle(self, motions: SimulatedMotions) -> None:
        """Note at each value on what motions have settled."""
        dying = self.settings.dying * natural_units(self.work.system).speed
        for i in np.flatnonzero(motions.periodic):
            impacts = 0 if 0.0 < motions.slowest[i] < dying else int(motions.impact_count[i])
            facts = int(motions.period[i]), impacts, float(motions.amplitude[i])
            self.entry(float(motions.value[i])).settle(*facts, motions.last[i])

    def tried(self) -> TriedValues:
        """What became of motions at all values."""
        most = max(judgement.companions for judgement in self.settings.judgements)
        states = np.full((len(self.entries), most, self.work.system.dimension), np.nan)
        for row, entry in enumerate(self.entries):
            states[row, : len(entry.chaos)] = entry.chaos
        return TriedValues(
            values=np.array([entry.value for entry in self.entries]),
            verdict=np.array([entry.verdict for entry in self.entries]),
            exponent=np.array([entry.exponent for entry in self.entries]),
            error=np.array([entry.error for entry in self.entries]),
            mean_life=np.array([entry.mean_life for entry in self.entries]),
            period=np.array([entry.longest for entry in self.entries]),
            states=states,
        )
