"""The judge: what motions end on that have not settled, many at once.

`classify`, `find_attractors`, charts and diagrams all ask it, so that they cannot contradict each
other on one motion.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from saltus.attractors.lyapunov.growth import LargestExponents
from saltus.attractors.nonperiodic import regular_motion
from saltus.attractors.stroboscopic_section import creeping_orbit, is_unforced, section_of
from saltus.enumerations import NumberedSentence
from saltus.flow import RECURRENCE, Ending, Recurrence, find_recurrence, return_period, simulate
from saltus.progress import Progress, part_of, silent
from saltus.systems import (
    System,
    arguments_of,
    natural_units,
    states_beside,
    units_with_sides,
)


class Reason(NumberedSentence):
    """The reasons of verdicts, of one motion or of many; `sentence.format` fills in the numbers."""

    NOT_SURE = 0, "{seen}, which regular motion and weak chaos may both show{torus}"
    CHAOS = (
        1,
        (
            "{seen}, and none of those beside it settles any more, which excludes transients of a"
            " mean life below {life:.3g} periods"
        ),
    )
    TRANSIENT = (
        2,
        (
            "{seen}, but {gone} of the motions beside it settle, after {life:.3g} forcing periods"
            " in the mean: a transient"
        ),
    )
    FEW_SETTLED = (
        3,
        (
            "{seen}, and {gone} of the motions beside it settle: too few to tell a long transient"
            " from chaos beside one"
        ),
    )
    COMING_TOGETHER = (
        4,
        (
            "{seen}: motions beside it come together with it, so that it settles slowly, or on an"
            " orbit of more than {longest} forcing periods, which a larger max_period may find,"
            " unless rounding decides its period"
        ),
    )
    TORUS = 5, "{seen}, it does not repeat itself, and the 0-1 test sees order (K = {K:.3g})"
    LONG_PERIOD = 6, "it repeats itself every {period} forcing periods"
    NO_EXPONENTS = 7, "it comes to rest or ends before an exponent is known"
    LIMIT = 8, "a limit of the model ends it and all motions beside it"
    CAPTURED = (
        9,
        (
            "within {periods} forcing periods it is captured by the contact, from where no later"
            " load pulls it"
        ),
    )
    STANDS = (
        10,
        "within {periods} forcing periods it stands still, held by what no later load overcomes",
    )
    ON_ORBIT = (
        11,
        "{seen}, on an orbit of period {period} with the largest multiplier {multiplier:.6g}",
    )
    EQUILIBRIUM = 12, "it comes to the equilibrium at {place:.9g}, which attracts"
    DOUBTFUL_ORBIT = 13, "{seen}, but {doubt}"
    MARGIN = 14, "the motion ends at time {time:.6g}, where its margin {limit} reaches 0"
    CANNOT_GO_ON = 15, "the motion cannot go on: {error}"
    NOT_FOLLOWED = 16, "the motion cannot be followed beyond some {periods} forcing periods"
    CONSERVATIVE = (
        17,
        (
            "under constant loads it goes on moving: it has not lost its energy, has none to lose,"
            " or gains some on a cycle, which has no forcing period"
        ),
    )
    SELF_EXCITED = (
        18,
        (
            "under constant loads it goes on moving: the ground that its friction moves on may"
            " drive it round a cycle, which has no forcing period"
        ),
    )
    CYCLE = (
        20,
        "it goes round a cycle in the time {time:.12g}, with the largest multiplier {multiplier:.6g}",
    )
    CREEPS = (
        21,
        (
            "it creeps to where it sticks for good, slower and slower: the largest multiplier there"
            " is 1 within its own accuracy"
        ),
    )
    ROUNDING = (
        19,
        (
            "{seen} when steps make an error of {tol:.0e}, and {other} when they make {looser:.0e}:"
            " differences grow so much from one rest to the next that rounding decides the period,"
            " and no orbit can be told"
        ),
    )


@dataclass(frozen=True)
class JudgementSettings:
    """How long motions that have not settled are followed, and what then counts as chaos."""

    # Number of companions: motions from the states of a question, which stand for all motions
    # there.
    companions: int = 16
    # The first round in forcing periods; most transients end in it, and need no exponents.
    first_periods: int = 250
    # The length of each further round. After a round survivors replace the companions that settled.
    round_periods: int = 1690
    rounds: int = 12  # The largest number of further rounds.
    # Forcing periods, added up over companions, in which none may settle. If none has settled
    # within E, transients of a mean life of E / 3 or less are excluded with a probability of 95 %,
    # as the number that settle within E is Poisson distributed.
    exposure: int = 100_000
    # Number of companions that must have settled for the verdict of a transient while others go on:
    # from three, a mean life is estimated to within a factor of about 3. If some settle and then no
    # more do, chaos takes a time without settling of three of the mean lives that the former show.
    settled: int = 3
    # After so many rounds the motions are called a transient if the rate at which companions settle
    # in the later half of the rounds is at least this share of the rate in the earlier half: if
    # some were on an attractor, their share of the companions would grow, and the rate would fall.
    # Pure transients take five rounds on average, those beside an attractor more.
    fewest_rounds: int = 4
    steady: float = 0.9
    # Number of survivors whose exponent is measured; they are taken as samples of one attractor.
    measured: int = 12
    # Forcing periods of the shortest run of these survivors, which is doubled up to the longest one
    # as long as the sign of the exponent is open: weak chaos of exponent 0.005 takes a thousand
    # periods.
    shortest_run: int = 64
    longest_run: int = 1600
    # From a run of this length on, a long period is looked for if the exponent seems to be below 0:
    # one saves longer runs.
    regular_run: int = 256
    # Distance between the first states of companions from one state, as they would else be one
    # motion. Chaos of exponent 0.005 separates them within 3000 units of time.
    apart: float = 1e-7
    # The longest period looked for in a regular motion that has not settled, in forcing periods.
    longest_period: int = 128
    # Forcing periods for which such a motion is followed, so that it settles with multipliers up to
    # 0.99.
    patience: int = 4000
    # The error of a step: with 1e-8, some periodic motions do not return near enough to be
    # recognised.
    tol: float = 1e-10


JUDGEMENT = JudgementSettings()
# A coordinate that moves by less than this in a period of the clock, in natural units, stands.
STANDING = 1e-6


@dataclass(frozen=True, eq=False)
class EarlierJudgement:
    """What a less careful judgement has shown of the chaos from whose states a further one starts,
    an entry for each question.
    """

    exponent: np.ndarray  # (n,): the largest exponent, which is surely above 0
    error: np.ndarray  # (n,): half width of its 95 % interval
    # (n,): forcing periods of companions, in all, in which none has settled
    periods_without_settling: np.ndarray


@dataclass(frozen=True, eq=False)
class Judged:
    """The answers, an entry for each question."""

    # (n,): an `Ending`: CHAOTIC, TRANSIENT, PERIODIC, QUASI_PERIODIC or UNDECIDED
    ending: np.ndarray
    reason: np.ndarray  # (n,): a `Reason`, whose sentence `sentence` fills in
    # (n,): largest exponent of those that have not settled, per unit of time; nan if all settle at
    # once
    exponent: np.ndarray
    error: np.ndarray  # (n,): half width of its 95 % interval
    # (n,): 2 ln(t) / t, which regular motion may show after the time of the run
    resolution: np.ndarray
    zero_one: np.ndarray  # (n,): K of the 0-1 test by which a torus is one; else nan
    # (n,): how many companions have settled, or were ended by a limit of the model
    settled_count: np.ndarray
    # (n,): mean life of a transient in forcing periods; of chaos the mean life that is excluded
    # with 95 %
    mean_life: np.ndarray
    # (n,): forcing periods after which a periodic motion repeats itself, 0 if that is not known
    period: np.ndarray
    # (n, companions, d): the last stroboscopic states, of survivors where there are any
    states: np.ndarray
    settled: SettledLater  # what companions settled on

    def __len__(self) -> int:
        return len(self.ending)

    def sentence(self, row: int, settings: JudgementSettings, torus: str = "") -> str:
        """The reason of an answer in words; `torus` is added where it is not known whether a motion
        is regular.
        """
        exponent, error, least = (
            float(values[row]) for values in (self.exponent, self.error, self.resolution)
        )
        seen = (
            f"its largest exponent is {exponent:.4g} +- {error:.1g}, where regular motion may show"
            f" {least:.1g}"
        )
        numbers = {
            "gone": int(self.settled_count[row]),
            "life": float(self.mean_life[row]),
            "period": int(self.period[row]),
        }
        return Reason(self.reason[row]).sentence.format(
            seen=seen if np.isfinite(exponent) else "it looks like chaos for a while",
            torus=torus,
            longest=settings.longest_period,
            K=float(self.zero_one[row]),
            **numbers,
        )


@dataclass(frozen=True, eq=False)
class SettledLater:
    """Periodic motions on which companions settled."""

    question: np.ndarray  # (k,): the number of the question
    state: np.ndarray  # (k, d): at phase 0
    period: np.ndarray  # (k,): in forcing periods

    @classmethod
    def none(cls, dimension: int) -> SettledLater:
        """No motions, of so many state variables."""
        return cls(np.zeros(0, dtype=int), np.zeros((0, dimension)), np.zeros(0, dtype=int))

    def joined(self, other: SettledLater) -> SettledLater:
        """These and others."""
        return SettledLater(
            *(
                np.concatenate([getattr(self, n), getattr(other, n)])
                for n in ("question", "state", "period")
            )
        )

    def few(self, alike: int, most: int) -> SettledLater:
        """At most `most` of the motions of each question, and of these at most `alike` of each
        period.
        """
        order = np.lexsort((self.state[:, 0], self.period, self.question))
        for key, count in (
            (self.question * (1 + self.period.max(initial=0)) + self.period, alike),
            (self.question, most),
        ):
            order = order[np.arange(len(order)) - np.searchsorted(key[order], key[order]) < count]
        return SettledLater(self.question[order], self.state[order], self.period[order])


def reason_unforced(system: System) -> Reason | None:
    """Why nothing is known of a motion that goes on moving although nothing that acts on it varies;
    None where something does.

    On a cycle without a forcing period the states at phase 0 of a clock fill a closed curve, and
    look like those of a torus.
    """
    if not is_unforced(system):
        return None
    return Reason.SELF_EXCITED if system.model.frictions else Reason.CONSERVATIVE


def reason_cycle(system: System, state: np.ndarray) -> Reason | None:
    """`reason_unforced` of a motion from a state (d,) that repeats itself with its clock; None
    where it stands at an equilibrium."""
    reason = reason_unforced(system)
    if reason is None:
        return None
    motion = simulate(system, **arguments_of(system, state), periods=1)
    swing = np.ptp(np.atleast_2d(motion.extrema), axis=1)
    return reason if (swing > STANDING * natural_units(system).lengths).any() else None


def judge(
    system: System,
    states: np.ndarray,
    parameters: Mapping[str, np.ndarray],
    *,
    settings: JudgementSettings = JUDGEMENT,
    earlier: EarlierJudgement | None = None,
    progress: Progress = silent,
) -> Judged:
    """What motions end on that have not settled: chaos, a transient, a torus, or an orbit after
    all.

    A question is a set of stroboscopic states under one set of parameters: the last states of a
    motion, or of several motions, that have not settled. Companions start at these and are followed
    in rounds. Chaos takes two conditions. The average of the survivors' largest exponents is above
    0 by more than its 95 % error and the resolution 2 ln(t) / t. And within a number of forcing
    periods, added up over companions, none settles: settling from chaotic transients is a Poisson
    process, whose rate is estimated or bounded by this number. If some settle, survivors take their
    places; if there is a chaotic attractor beside the transient, the share of companions on it
    grows, until none settles within three mean lives of the transient. If the rate at which
    companions settle does not fall, there is no such attractor.

    Where nothing that acts on a system varies with time, nothing is judged: the answer is undecided
    (`reason_unforced`); so it is where a motion creeps to sticking (`creeping_orbit`). A motion is periodic if its exponent is surely below 0, or if it is found to repeat itself after
    a long period. It is on a torus if its exponent may be 0 and the conditions of `regular_motion`
    hold.

    Parameters
    ----------
    system
        What moves, under a load with a frequency.
    states
        (n, m, d), coordinates and velocities at phase 0; rows of nan are left out, and each
        question needs one other row.
    parameters
        Numbers by dotted path, (n,) each, in place of the system's.
    settings
        How long companions are followed, and how surely transients are excluded.
    earlier
        The results of an earlier judgement that has found chaos, if the states are those that it
        gave: the exponent is not measured again, and the time in which none has settled is counted.
    progress
        Called with the fraction done.
    """
    run = _Judgement(system, states, parameters, settings)
    if earlier is None:
        run.do_round(settings.first_periods, part_of(progress, 0.0, 0.2, "judging"))
        run.measure()
    else:
        run.go_on_from(earlier)
    for i in range(settings.rounds):
        open_chaos = run.positive & ~run.lasts & ~run.steady & run.may_last(settings.rounds - i)
        run.open &= open_chaos | (~run.positive & ~run.negative & (run.settled_count > 0))
        begin, end = (0.3 + 0.7 * number / settings.rounds for number in (i, i + 1))
        run.do_round(settings.round_periods, part_of(progress, begin, end, "judging"))
    run.look_for_long_periods(~run.all_gone)
    run.look_for_tori()
    progress(1.0, "judging")
    return run.judged()


class _Judgement:
    """The state of a judgement of several questions."""

    def __init__(
        self,
        system: System,
        states: np.ndarray,
        parameters: Mapping[str, np.ndarray],
        settings: JudgementSettings,
    ) -> None:
        n = len(states)
        self.system = system
        self.settings = settings
        self.settled = SettledLater.none(states.shape[-1])
        self.parameters = {
            path: np.broadcast_to(np.asarray(values, dtype=float), n)
            for path, values in parameters.items()
        }
        self.states = np.full((n, settings.companions, states.shape[-1]), np.nan)
        for row, given in enumerate(states):
            self.states[row] = _companions(system, given[np.isfinite(given).all(axis=-1)], settings)
        # an entry for each question: a `Reason` where it is known why nothing is to be looked for,
        # as nothing that acts varies or the motion creeps; else -1
        self.foreseen = np.array([self._foreseen(row, states[row]) for row in range(n)], dtype=int)
        self.open = self.foreseen < 0  # whether companions are still to be followed
        # whether the exponent is surely above, or below 0
        self.positive, self.negative = np.zeros((2, n), dtype=bool)
        # whether no companion is left; whether long periods were tried
        self.all_gone, self.looked = np.zeros((2, n), dtype=bool)
        self.exponent, self.error, self.resolution, self.zero_one = np.full((4, n), np.nan)
        self.settled_count, self.ended = np.zeros(
            (2, n), dtype=int
        )  # companions that have settled or ended; of these, by a limit
        # forcing periods for which companions were followed, added up
        self.exposure = np.zeros(n, dtype=int)
        # the exposure up to the end of the last round in which any settled
        self.before = np.zeros(n, dtype=int)
        self.period, self.rounds = np.zeros((2, n), dtype=int)
        # Number of companions that settled in each round, and the round's exposure.
        self.history = np.zeros((2, settings.rounds + 1, n))

    def _foreseen(self, row: int, states: np.ndarray) -> int:
        """The number of the reason of a question on which nothing acts that varies, or whose last
        states (m, d) creep; else -1.
        """
        numbers = {path: float(values[row]) for path, values in self.parameters.items()}
        system = self.system.with_(numbers) if numbers else self.system
        reason = reason_unforced(system)
        if reason is None and creeping_orbit(system, states) is not None:
            reason = Reason.CREEPS
        return -1 if reason is None else int(reason)

    def go_on_from(self, earlier: EarlierJudgement) -> None:
        """Go on from what a less careful judgement has shown."""
        self.exponent, self.error, self.exposure = (
            earlier.exponent.copy(),
            earlier.error.copy(),
            earlier.periods_without_settling.astype(int),
        )
        self.positive[:] = True

    def _ends(
        self, rows: np.ndarray, states: np.ndarray, periods: int, progress: Progress, **options: Any
    ) -> Recurrence:
        """How motions from states (rows, m, 2) end."""
        columns = {
            path: np.repeat(values[rows], states.shape[1])
            for path, values in self.parameters.items()
        }
        options = {"kept": 1} | options
        return find_recurrence(
            self.system,
            states.reshape(-1, states.shape[-1]),
            periods,
            parameters=columns,
            tol=self.settings.tol,
            progress=progress,
            **options,
        )

    def do_round(self, periods: int, progress: Progress) -> None:
        """Follow companions for a round: those that settle are counted, and survivors take their
        places.
        """
        rows = np.flatnonzero(self.open)
        if not rows.size:
            return
        ends = self._ends(rows, self.states[rows], periods, progress)
        shape = (rows.size, self.settings.companions)
        moving = (ends.outcome == Ending.UNDECIDED).reshape(shape)
        last = ends.last.reshape(*shape, -1)
        self._keep_settled(rows, ends)
        left = (~moving).sum(axis=1)
        followed = np.ceil(ends.periods).astype(int).reshape(shape).sum(axis=1)
        self.history[:, self.rounds[rows], rows] = left, followed
        self.rounds[rows] += 1
        self.exposure[rows] += followed
        self.settled_count[rows] += left
        self.ended[rows] += ends.ended.reshape(shape).sum(axis=1)
        self.before[rows] = np.where(left > 0, self.exposure[rows], self.before[rows])
        for i, row in enumerate(rows):
            survivors = last[i][moving[i]]
            self.all_gone[row] = not len(survivors)
            self.states[row] = (
                _companions(self.system, survivors, self.settings) if len(survivors) else last[i]
            )
        self.open[rows] = ~self.all_gone[rows]

    @property
    def lasts(self) -> np.ndarray:
        """Where none has settled for so long that a transient is excluded, (n,)."""
        return self._lacking <= 0.0

    @property
    def _lacking(self) -> np.ndarray:
        """The further exposure in which none may settle until a transient is excluded, (n,)."""
        life = self.before / np.maximum(self.settled_count, 1)
        return np.asarray(
            np.maximum(self.settings.exposure, 3.0 * life) - (self.exposure - self.before)
        )

    @property
    def steady(self) -> np.ndarray:
        """Where companions settle at a rate that does not fall, so that none of them is on an
        attractor, (n,).
        """
        later = np.arange(self.history.shape[1])[:, None] >= self.rounds - self.rounds // 2
        left, followed = self.history.sum(axis=1)
        left_late, followed_late = np.where(later, self.history, 0.0).sum(axis=1)
        does_not_fall = (
            left_late * (followed - followed_late)
            >= self.settings.steady * (left - left_late) * followed_late
        )
        return np.asarray(
            does_not_fall
            & (left >= self.settings.settled)
            & (self.rounds >= self.settings.fewest_rounds)
        )

    def may_last(self, rounds: int) -> np.ndarray:
        """Where so many more rounds may exclude a transient, or may show enough settled companions
        to call it one, (n,).
        """
        within = self._lacking <= rounds * self.settings.round_periods * self.settings.companions
        return np.asarray(within | (self.settled_count < self.settings.settled))

    def _keep_settled(self, rows: np.ndarray, ends: Recurrence) -> None:
        """Keep the motions on which companions have settled."""
        here = np.flatnonzero(ends.periodic)
        question = rows[here // self.settings.companions]
        self.settled = self.settled.joined(
            SettledLater(question, ends.last[here], ends.period[here])
        )

    def measure(self) -> None:
        """Measure the exponents of some survivors, by longer and longer runs until their sign is
        known.

        There are no longer runs if the exponent seems to be below 0 and a motion repeats itself
        after a long period.
        """
        rows = np.flatnonzero(self.open)
        settings = self.settings
        if not rows.size:
            return
        chosen = np.linspace(
            0, settings.companions - 1, min(settings.measured, settings.companions)
        ).astype(int)
        columns = {path: values[rows] for path, values in self.parameters.items()}
        given = self.states[rows][:, chosen]
        shortest = settings.shortest_run
        periods = 0
        run = LargestExponents(self.system, given, columns, shortest=shortest, tol=settings.tol)
        while periods < settings.longest_run:
            periods = min(max(2 * periods, shortest), settings.longest_run)
            asked = np.flatnonzero((~self.positive & ~self.negative & (self.period == 0))[rows])
            if not asked.size:
                return
            run.go_on(asked, periods)
            for name in ("exponent", "error", "resolution", "positive", "negative"):
                getattr(self, name)[rows] = getattr(run.found, name)
            if periods >= settings.regular_run:
                self.look_for_long_periods(self.open & (self.exponent < 0.0))

    def look_for_long_periods(self, chosen: np.ndarray) -> None:
        """Follow a motion of each of the chosen questions, (n,), until it settles, unless the
        exponent is surely positive.

        Near bifurcations exponents are near 0, and motions settle slowly.
        """
        chosen = chosen & (self.foreseen < 0)
        rows = np.flatnonzero(chosen & ~self.positive & ~self.all_gone & ~self.looked)
        if not rows.size:
            return
        self.looked[rows] = True
        longest = self.settings.longest_period
        options = {"max_period": longest, "kept": 2 * longest + 2}
        ends = self._ends(rows, self.states[rows, :1], self.settings.patience, silent, **options)
        rows, ends = rows[ends.periodic], ends.only(ends.periodic)
        units = units_with_sides(self.system)
        fewest = return_period(ends.states, longest, RECURRENCE.long_agreement, units)
        self.period[rows] = fewest
        self.settled = self.settled.joined(SettledLater(rows, ends.last, fewest))

    def look_for_tori(self) -> None:
        """Decide whether a motion of each question whose exponent may be 0 is on a torus, or
        approaches an orbit slowly.
        """
        chosen = (
            ~self.positive
            & ~self.negative
            & (self.period == 0)
            & ~self.all_gone
            & np.isfinite(self.exponent)
        )
        for row in np.flatnonzero(chosen):
            system = self.system.with_(
                {path: float(values[row]) for path, values in self.parameters.items()}
            )
            found = regular_motion(
                system, self.states[row, 0], self.settings.patience, self.settings.tol
            )
            if found.zero_one is not None:
                self.zero_one[row] = found.zero_one.K
            if found.orbit is not None:
                period = found.orbit.period
                state = section_of(found.orbit)
                self.period[row] = period
                self.settled = self.settled.joined(
                    SettledLater(np.array([row]), state[None], np.array([period]))
                )

    def judged(self) -> Judged:
        """The verdicts that follow from the counts and the exponents."""
        n = len(self.open)
        ending = np.full(n, Ending.UNDECIDED)
        reason = np.full(n, Reason.NOT_SURE)
        lasts = self.positive & ~self.all_gone & self.lasts
        some = self.positive & ~self.lasts
        cut = self.all_gone & (self.ended == self.settled_count)
        transient = (self.all_gone & ~cut) | (some & (self.settled_count >= self.settings.settled))
        reason[some] = Reason.FEW_SETTLED
        reason[np.isnan(self.exponent)] = Reason.NO_EXPONENTS
        reason[cut] = Reason.LIMIT
        repeats = (self.period > 0) & ~self.all_gone
        together = self.negative & ~self.all_gone
        for chosen, kind, why in (
            (np.isfinite(self.zero_one), Ending.QUASI_PERIODIC, Reason.TORUS),
            (together, Ending.PERIODIC, Reason.COMING_TOGETHER),
            (repeats, Ending.PERIODIC, Reason.LONG_PERIOD),
            (transient, Ending.TRANSIENT, Reason.TRANSIENT),
            (lasts, Ending.CHAOTIC, Reason.CHAOS),
        ):
            ending[chosen] = kind
            reason[chosen] = why
        without = self.foreseen >= 0
        ending[without] = Ending.UNDECIDED
        reason[without] = self.foreseen[without]
        with np.errstate(divide="ignore", invalid="ignore"):
            life = np.where(
                lasts, (self.exposure - self.before) / 3.0, self.exposure / self.settled_count
            )
        found = {
            name: getattr(self, name)
            for name in ("exponent", "error", "resolution", "zero_one", "settled_count", "period")
        }
        return Judged(
            ending, reason, mean_life=life, states=self.states, settled=self.settled, **found
        )


def _companions(system: System, states: np.ndarray, settings: JudgementSettings) -> np.ndarray:
    """The first states of companions, (companions, d): beside these states (m, d), each of which is
    taken about equally often.
    """
    chosen = states[np.linspace(0, len(states) - 1, settings.companions).astype(int)]
    return states_beside(system, chosen, settings.apart * np.arange(settings.companions)[:, None])
