"""What the search for chaos knows at one value of the parameter."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from saltus.attractors import Judged
from saltus.flow import Ending

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
