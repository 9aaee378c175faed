"""Verdicts: what one motion ends on, with the evidence.

A motion that comes to rest, ends or repeats itself within its time is judged here; the one that
does not by `judge`, which charts and diagrams ask too.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from saltus.attractors.attractor import state_plane, state_units
from saltus.attractors.judgement import (
    JUDGEMENT,
    Judged,
    JudgementSettings,
    Reason,
    judge,
    reason_cycle,
    reason_unforced,
)
from saltus.attractors.lyapunov.growth import LYAPUNOV
from saltus.attractors.lyapunov.spectrum import Exponents, lyapunov_spectrum
from saltus.attractors.nonperiodic import FEWEST_ENTRIES, ZeroOne, excludes_tori, zero_one_of_bands
from saltus.attractors.stroboscopic_section import (
    Certificate,
    certify,
    certify_cycle,
    stays_at_rest,
    with_clock,
)
from saltus.checks import Speeds, check_count, check_number
from saltus.errors import MotionError
from saltus.flow import (
    RECURRENCE,
    Ending,
    EventKind,
    Recurrence,
    find_recurrence,
    simulate,
    start_with_sides,
)
from saltus.orbits import PeriodicOrbit
from saltus.progress import Progress, html_table, part_of, silent
from saltus.result import Result, result_dataset
from saltus.systems import System, arguments_of, rest_state, state_with_sides

if TYPE_CHECKING:
    import xarray

NAMES = ("relays", "periods", "transient", "max_period", "seed", "tol")  # arguments of `classify`
# states of a motion that does not repeat, enough to see the shape of its attractor
SECTION_STATES = 1000


@dataclass(frozen=True, eq=False)
class Verdict(Result):
    """Where a motion ends.

    Attributes
    ----------
    system
        What moves.
    kind
        The kind of motion on which it ends.
    cause
        The reason for this kind.
    reason
        The sentence of the reason, with its numbers.
    period
        The forcing periods after which it repeats itself, of a cycle without a load the time; None
        if it does not.
    orbit
        The attracting orbit on which the motion is, solved by its own equations; else None.
    exponents
        The Lyapunov exponents of a chaotic or quasi-periodic motion; else None.
    zero_one
        The 0-1 test of the states at phase 0 of such a motion, a witness without a vote; else None.
    state
        The state at the end, at phase 0, as arguments of `simulate`.
    periods
        The number of forcing periods for which the motion was followed in all.
    evidence
        The evidence: numbers and sentences by their names.

    Examples
    --------
    >>> verdict = saltus.classify(system, theta=0.3)
    >>> str(verdict.kind), verdict.period
    ('periodic', 1)
    """

    system: System
    kind: Ending
    cause: Reason
    reason: str
    period: Any
    orbit: PeriodicOrbit | None
    exponents: Exponents | None
    zero_one: ZeroOne | None
    state: dict[str, Any]
    periods: int
    evidence: dict[str, Any] = field(default_factory=dict)

    def to_xarray(self) -> xarray.Dataset:
        """The verdict and its evidence as single values, and the motion at its end.

        `section_<variable>` are its states at phase 0 over `state`; if it is on an orbit,
        `curve_<variable>` is one period of the orbit over `time`.
        """
        known = {
            "kind": str(self.kind),
            "reason": self.reason,
            "period": self.period or 0,
            "followed": self.periods,
        }
        columns: dict[str, tuple[Any, ...]] = {
            name: ((), value, "1", name.replace("_", " "))
            for name, value in (known | self.evidence).items()
        }
        plane = state_plane(self.system)
        units = state_units(self.system)
        for i, name in zip((0, self.system.dimension // 2), plane, strict=True):
            columns[f"section_{name}"] = (
                "state",
                self._section()[:, i],
                units[name],
                f"{name} at phase 0",
            )
        if self.orbit is not None:
            curve = self.orbit.motion().to_xarray()
            columns |= {
                f"curve_{name}": ("time", curve[name].values, units[name], f"{name} on its orbit")
                for name in plane
            }
        return result_dataset("verdict", columns, None, self.system, plane=list(plane))

    def _section(self) -> np.ndarray:
        """States at phase 0 from the end of the motion on, (n, d): those of one period, or many if
        it does not repeat itself.
        """
        end = state_with_sides(self.system, self.state)
        lasting = (
            self.kind not in (Ending.REST, Ending.UNDECIDED) and self.system.load.period is not None
        )
        if not lasting:
            return end[None]
        count = self.period or SECTION_STATES
        ends = find_recurrence(self.system, end[None], count, kept=count, stop_early=False)
        return np.asarray(ends.states[0])

    def _repr_html_(self) -> str:
        known = {
            "period": self.period or "none",
            "reason": self.reason,
            "forcing periods followed": self.periods,
        }
        return html_table(f"Verdict: {self.kind}", known | self.evidence)

    def __repr__(self) -> str:
        what = f"{self.kind}{f' {self.period:.9g}' if self.period else ''}"
        if self.cause is Reason.EQUILIBRIUM:
            what = "equilibrium"
        return f"Verdict({what}: {self.reason})"


@dataclass(frozen=True)
class _Case:
    """The arguments of `classify`: the system, and how long and how exactly its motion is
    followed.
    """

    system: System
    clock: System  # the same system, with a forcing period also under a constant load
    periods: int
    max_period: int
    seed: int
    tol: float
    progress: Progress

    @property
    def settings(self) -> JudgementSettings:
        """How the judge looks at a motion that has not settled: for periods as long as are asked
        for.
        """
        return replace(JUDGEMENT, longest_period=max(JUDGEMENT.longest_period, self.max_period))

    def ends_of(self, state: np.ndarray, periods: int, part: tuple[float, float]) -> Recurrence:
        """How the motion from a state (d,) ends within so many forcing periods; `part` is the share
        of the progress.
        """
        kept = min(periods, max(self.periods, 4 * self.max_period))
        return find_recurrence(
            self.clock,
            state[None],
            periods,
            max_period=self.max_period,
            kept=kept,
            tol=self.tol,
            progress=part_of(self.progress, *part),
        )

    def verdict(
        self, kind: Ending, cause: Reason, ends: Recurrence, numbers: dict[str, Any], **more: Any
    ) -> Verdict:
        """A verdict on a motion with these `ends`, for a cause whose sentence is filled with these
        numbers.
        """
        given: dict[str, Any] = (
            dict.fromkeys(("period", "orbit", "exponents", "zero_one"))
            | {"state": arguments_of(self.system, ends.states[0, -1]), "reason": ""}
            | more
        )
        given["reason"] = given["reason"] or cause.sentence.format(**numbers)
        given.setdefault("periods", round(float(ends.periods[0])))
        return Verdict(system=self.system, kind=kind, cause=cause, **given)

    def undecided(
        self, cause: Reason, ends: Recurrence, numbers: dict[str, Any], **more: Any
    ) -> Verdict:
        """The verdict that a motion is undecided, for a cause whose sentence is filled with these
        numbers.
        """
        return self.verdict(Ending.UNDECIDED, cause, ends, numbers, **more)


def classify(
    system: System,
    *,
    velocity: Speeds = 0.0,
    relays: Mapping[str, bool] | None = None,
    periods: int = 4000,
    transient: int = 500,
    max_period: int = RECURRENCE.compiled_max_period,
    seed: int = 0,
    tol: float = 1e-12,
    progress: Progress = silent,
    **coordinates: float,
) -> Verdict:
    """Where a motion ends: at rest, on a periodic orbit, on a torus, in chaos, or undecided, each
    with its evidence.

    * `rest`: proved to stay at the contact for all later loads (`capture_speed`), or at rest there
      where the load never pulls.
    * `periodic`: it repeats itself, and is on an orbit that solves its own equations, has all
      multipliers inside the unit circle
      and repeats itself in direct simulation. Under constant loads an equilibrium is such an orbit,
      of period 1; a cycle, as of a mass on a belt, is one whose period is a time.
    * `chaotic`: it has not settled after transient + periods. Also `judge`, the judge of charts and
      diagrams, finds the largest Lyapunov exponent above 0 by more than its error and what regular
      motion may show. Of 16 companions, which begin in the motion's last states, none settles in
      100 000 forcing periods in all. A chaotic transient would be noticed with a probability of 95
      % if its mean life was below 33 000.
    * `quasi-periodic`: the exponent may be 0, the 0-1 test shows a regular motion, also on every
      n-th state, and `excludes_tori`
      knows no reason against it.
    * `undecided`: everything else, with the reason.

    Parameters
    ----------
    system
        What moves, under constant or harmonic loads.
    velocity, coordinates
        The state at the start, at phase 0.
    relays
        Whether each `Relay` of the model is on at the start, as `simulate` takes it. A motion has
        settled where its relays have the same sides again too.
    periods
        Forcing periods in which it may settle, after the transient, and as many again after it was
        judged; at least 32.
    transient
        Forcing periods at the beginning.
    max_period
        The longest period looked for, at least 16.
    seed
        The seed of the frequencies of the 0-1 test.
    tol
        The error that one step may make.
    progress
        Called with the fraction done and what is being done.

    Raises
    ------
    ParameterError
        An argument without meaning.

    Examples
    --------
    >>> str(saltus.classify(system, theta=0.3).kind)
    'periodic'
    """
    clock = with_clock(system)
    start = start_with_sides(system, velocity, relays, coordinates, NAMES)
    check_count("periods", periods, 2 * LYAPUNOV.batches)
    check_count("transient", transient, 0)
    check_count("max_period", max_period, RECURRENCE.compiled_max_period)
    check_count("seed", seed, 0)
    check_number("tol", tol, at_least=1e-15, at_most=1e-6)
    case = _Case(system, clock, int(periods), int(max_period), int(seed), float(tol), progress)
    ends = case.ends_of(start, int(transient + periods), (0.0, 0.3))
    verdict = _settled(case, ends, start) or _judged(case, ends)
    progress(1.0, "verdict")
    return verdict


def _settled(case: _Case, ends: Recurrence, start: np.ndarray) -> Verdict | None:
    """The verdict on a motion from a state (d,) that has come to rest, has ended or repeats itself;
    None if it goes on moving.
    """
    if ends.rest[0] or (ends.period[0] == 1 and stays_at_rest(case.clock, ends.last[0])):
        numbers = {"periods": round(float(ends.periods[0]))}
        point = rest_state(case.system, ends.last[0])
        cause = Reason.STANDS if case.system.model.frictions else Reason.CAPTURED
        return case.verdict(
            Ending.REST, cause, ends, numbers, state=arguments_of(case.system, point)
        )
    if ends.ended[0]:
        return _ended(case, ends, start)
    if not ends.periodic[0]:
        return None
    period = int(ends.period[0])
    cycle = reason_cycle(case.clock, ends.last[0])
    if cycle is not None:
        return _on_cycle(case, ends, cycle)
    seen = "it repeats itself"
    found = certify(case.clock, ends.states[0, -1], period)
    every = f"every {period} forcing periods" if period > 1 else ""
    if not found.sound and (other := _period_by_the_judge(case, ends)) not in (None, period):
        again = f"every {other}" if other else "not at all"
        facts: dict[str, Any] = {
            "seen": f"{seen} {every}",
            "tol": case.tol,
            "looser": JUDGEMENT.tol,
            "other": again,
        }
        return case.undecided(Reason.ROUNDING, ends, facts)
    return _on_orbit(case, ends, found, f"{seen} {every}".rstrip())


def _period_by_the_judge(case: _Case, ends: Recurrence) -> int | None:
    """The period of the motion from the same state with the judge's steps, 0 if it then does not
    repeat itself; None if the motion does not rest within its period.

    A motion that rests now and then returns to one state exactly, also where what it does in
    between is too sensitive to be computed: its period is then another with every change of
    rounding.
    """
    start = arguments_of(case.system, ends.states[0, -1])
    period = int(ends.period[0])
    if not len(
        simulate(case.clock, **start, periods=period, dense=False).events.of(EventKind.REST)
    ):
        return None
    longest = max(case.max_period, RECURRENCE.compiled_max_period)
    options: dict[str, Any] = {"max_period": longest, "kept": 2 * longest + 2, "tol": JUDGEMENT.tol}
    again = find_recurrence(
        case.clock, ends.states[:, -1], max(case.periods, 2 * longest), **options
    )
    return int(again.period[0])


def _ended(case: _Case, ends: Recurrence, start: np.ndarray) -> Verdict:
    """The verdict on a motion that cannot be followed further; `simulate` gives the reason."""
    periods = round(float(ends.periods[0]))
    try:
        motion = simulate(
            case.clock,
            **arguments_of(case.system, start),
            periods=periods + 1,
            tol=case.tol,
            dense=False,
        )
    except MotionError as error:
        return case.undecided(Reason.CANNOT_GO_ON, ends, {"error": error})
    if motion.limit is not None:
        return case.undecided(Reason.MARGIN, ends, {"time": motion.time, "limit": motion.limit})
    return case.undecided(Reason.NOT_FOLLOWED, ends, {"periods": periods})


def _on_orbit(case: _Case, ends: Recurrence, found: Certificate, seen: str, **more: Any) -> Verdict:
    """The verdict on a motion near an orbit, which is certified or not; `seen` says what was seen
    of the motion.
    """
    more["evidence"] = more.get("evidence", {}) | found.evidence
    if found.orbit is None or not found.sound:
        return case.undecided(
            Reason.DOUBTFUL_ORBIT, ends, {"seen": seen, "doubt": found.doubt}, **more
        )
    period = found.orbit.period
    cause = Reason.ON_ORBIT if case.system.load.period is not None else Reason.EQUILIBRIUM
    numbers = {
        "seen": seen,
        "period": period,
        "multiplier": abs(found.orbit.multipliers[0]),
        "place": ends.states[0, -1, 0],
    }
    return case.verdict(
        Ending.PERIODIC, cause, ends, numbers, period=period, orbit=found.orbit, **more
    )


def _on_cycle(case: _Case, ends: Recurrence, otherwise: Reason) -> Verdict:
    """The verdict on a motion that goes on moving although nothing acts that varies: on the cycle on
    which it settles, if that is found and attracts; else undecided.
    """
    found = certify_cycle(case.system, ends.last[0])
    orbit = found.orbit
    if orbit is None or not found.sound:
        return case.undecided(otherwise, ends, {}, evidence=found.evidence)
    numbers = {"time": orbit.period, "multiplier": orbit.largest_multiplier}
    more: dict[str, Any] = {"period": orbit.period, "orbit": orbit, "evidence": found.evidence}
    return case.verdict(Ending.PERIODIC, Reason.CYCLE, ends, numbers, **more)


def _judged(case: _Case, ends: Recurrence) -> Verdict:
    """The verdict on a motion that has neither come to rest nor repeated itself."""
    unforced = reason_unforced(case.system)
    if unforced is not None:
        return _on_cycle(case, ends, unforced)
    states = ends.states[:, -JUDGEMENT.companions :]
    answer = judge(
        case.system, states, {}, settings=case.settings, progress=part_of(case.progress, 0.3, 0.6)
    )
    before = round(float(ends.periods[0]))
    later = case.ends_of(ends.states[0, -1], case.periods, (0.6, 0.7))
    evidence = _evidence(answer)
    after_all = _settled(case, later, ends.states[0, -1])
    if after_all is not None:
        return _after_all(after_all, answer, before, evidence)
    ending = Ending(answer.ending[0])
    periods = before + round(float(later.periods[0]))
    if ending is Ending.PERIODIC or answer.reason[0] == Reason.NOT_SURE:
        approached = _approaching(case, later, answer, {"periods": periods, "evidence": evidence})
        if approached is not None:
            return approached
    against = excludes_tori(case.system) if answer.reason[0] == Reason.NOT_SURE else None
    evidence |= {} if against is None else {"no_tori": against}
    reason = answer.sentence(0, case.settings, "" if against is None else "; a torus is excluded")
    given: dict[str, Any] = {"periods": periods, "evidence": evidence, "reason": reason}
    if ending in (Ending.CHAOTIC, Ending.QUASI_PERIODIC):
        given |= _witnesses(case, later)
        evidence |= {"zero_one": given["zero_one"].K} if given["zero_one"] is not None else {}
        return case.verdict(ending, Reason(answer.reason[0]), later, {}, **given)
    return case.undecided(Reason(answer.reason[0]), later, {}, **given)


def _evidence(answer: Judged) -> dict[str, Any]:
    """The numbers on which the judge's answer rests."""
    return {
        "largest_exponent": float(answer.exponent[0]),
        "largest_exponent_error": float(answer.error[0]),
        "exponent_resolution": float(answer.resolution[0]),
        "companions": JUDGEMENT.companions,
        "companions_settled": int(answer.settled_count[0]),
        "life": float(answer.mean_life[0]),
    }


def _witnesses(case: _Case, ends: Recurrence) -> dict[str, Any]:
    """What is told beside a verdict on which it does not rest: all exponents of the motion, and the
    0-1 test of its states.
    """
    series = ends.states[0, :, 0]
    series = series[np.isfinite(series)]
    run: dict[str, Any] = {
        "periods": case.periods,
        "transient": 0,
        "tol": case.tol,
        "two_trajectories": False,
    }
    start = arguments_of(case.system, ends.states[0, -1])
    exponents = lyapunov_spectrum(
        case.system, **start, **run, progress=part_of(case.progress, 0.7, 1.0)
    )
    opinion = zero_one_of_bands(series, seed=case.seed) if series.size >= FEWEST_ENTRIES else None
    return {"exponents": exponents, "zero_one": opinion}


def _after_all(verdict: Verdict, answer: Judged, before: int, evidence: dict[str, Any]) -> Verdict:
    """The verdict on a motion that has settled after all, after it was judged."""
    chaos = (
        f" of transient chaos with an exponent of {answer.exponent[0]:.4g}"
        if answer.ending[0] == Ending.TRANSIENT
        else ""
    )
    return replace(
        verdict,
        reason=f"after more than {before} forcing periods{chaos}: {verdict.reason}",
        periods=before + verdict.periods,
        evidence=evidence | {"transient": before} | verdict.evidence,
    )


def _approaching(
    case: _Case, ends: Recurrence, answer: Judged, given: dict[str, Any]
) -> Verdict | None:
    """The verdict on a motion that is or may be periodic: on its orbit, if the orbit is found and
    attracts.
    """
    period = int(answer.period[0]) or None
    state = answer.settled.state[answer.settled.question == 0][-1] if period else ends.last[0]
    found = certify(case.clock, state, period, max_period=case.max_period)
    if not found.sound:
        return None
    long = period is not None and period > case.max_period
    seen = f"it repeats itself every {period} forcing periods" if long else "it approaches slowly"
    return _on_orbit(case, ends, found, seen, **given)
