"""Verdicts: where one motion ends, with the evidence."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from saltus.attractors.attractors_dataset import state_plane, state_units
from saltus.attractors.kind import AttractorKind
from saltus.attractors.lyapunov.spectrum import Exponents
from saltus.attractors.orbit_certificate import Certificate, certify, stays_at_rest
from saltus.attractors.verdict.reason import Reason
from saltus.attractors.verdict.zero_one_test import ZeroOne
from saltus.errors import MotionError
from saltus.flow import Recurrence, find_recurrence, simulate
from saltus.notebook import html_table
from saltus.orbits import PeriodicOrbit, start_at, state_vector
from saltus.progress import Progress, part_of
from saltus.result import Result, result_dataset
from saltus.systems import System

if TYPE_CHECKING:
    import xarray

SECTION_STATES = 1000  # states of a motion that does not repeat, enough to see the shape of its attractor


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
        The forcing periods after which it repeats itself; None if it does not.
    orbit
        The attracting orbit on which the motion is, solved by its own equations; else None.
    exponents
        The Lyapunov exponents of the last and longest run; None if the motion has settled.
    zero_one
        The 0-1 test of the states at phase 0, as a second opinion; None if the motion has settled.
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
    kind: AttractorKind
    cause: Reason
    reason: str
    period: int | None
    orbit: PeriodicOrbit | None
    exponents: Exponents | None
    zero_one: ZeroOne | None
    state: dict[str, Any]
    periods: int
    evidence: dict[str, Any] = field(default_factory=dict)

    def to_xarray(self) -> xarray.Dataset:
        """The verdict and its evidence as single values, and the motion at its end.

        `section_<variable>` are its states at phase 0 over `state`; if it is on an orbit, `curve_<variable>` is one period of the
        orbit over `time`.
        """
        known = {"kind": str(self.kind), "reason": self.reason, "period": self.period or 0, "followed": self.periods}
        columns: dict[str, tuple[Any, ...]] = {
            name: ((), value, "1", name.replace("_", " ")) for name, value in (known | self.evidence).items()
        }
        plane, units = state_plane(self.system), state_units(self.system)
        for i, name in zip((0, self.system.dimension // 2), plane, strict=True):
            columns[f"section_{name}"] = ("state", self._section()[:, i], units[name], f"{name} at phase 0")
        if self.orbit is not None:
            curve = self.orbit.motion().to_xarray()
            columns |= {f"curve_{name}": ("time", curve[name].values, units[name], f"{name} on its orbit") for name in plane}
        return result_dataset("verdict", columns, None, self.system, plane=list(plane))

    def _section(self) -> np.ndarray:
        """States at phase 0 from the end of the motion on, (n, d): those of one period, or many if it does not repeat itself."""
        end = state_vector(self.system, self.state)
        lasting = self.kind not in (AttractorKind.REST, AttractorKind.UNDECIDED) and self.system.load.period is not None
        if not lasting:
            return end[None]
        count = self.period or SECTION_STATES
        ends = find_recurrence(self.system, end[None], count, kept=count, stop_early=False)
        return np.asarray(ends.states[0])

    def _repr_html_(self) -> str:
        known = {"period": self.period or "none", "reason": self.reason, "forcing periods followed": self.periods}
        return html_table(f"Verdict: {self.kind}", known | self.evidence)

    def __repr__(self) -> str:
        return f"Verdict({self.kind}{f' {self.period}' if self.period else ''}: {self.reason})"


@dataclass(frozen=True)
class VerdictRequest:
    """The arguments of `classify`: the system, and how long and how exactly its motion is followed."""

    system: System
    clock: System  # the same system, with a forcing period also under a constant load
    periods: int
    max_period: int
    seed: int
    tol: float
    progress: Progress

    def follow(self, states: np.ndarray, periods: int, kept: int, part: tuple[float, float]) -> Recurrence:
        """How motions from states (n, d) end within so many forcing periods; `part` is the share of the progress, from and to."""
        progress = part_of(self.progress, *part)
        return find_recurrence(
            self.clock, states, periods, max_period=self.max_period, kept=kept, tol=self.tol, progress=progress
        )

    def verdict(self, kind: AttractorKind, cause: Reason, ends: Recurrence, numbers: dict[str, Any], **more: Any) -> Verdict:
        """A verdict on a motion with these `ends`, for a cause whose sentence is filled with these numbers."""
        given = (
            dict.fromkeys(("period", "orbit", "exponents", "zero_one"))
            | {"state": start_at(self.system, ends.states[0, -1])}
            | more
        )
        given.setdefault("periods", round(float(ends.periods[0])))
        return Verdict(system=self.system, kind=kind, cause=cause, reason=cause.format(**numbers), **given)

    def undecided(self, cause: Reason, ends: Recurrence, numbers: dict[str, Any], **more: Any) -> Verdict:
        """The verdict that a motion is undecided, for a cause whose sentence is filled with these numbers."""
        return self.verdict(AttractorKind.UNDECIDED, cause, ends, numbers, **more)


def settled(case: VerdictRequest, ends: Recurrence, start: np.ndarray) -> Verdict | None:
    """The verdict on a motion from a state (d,) that has come to rest, has ended or repeats itself; None if it goes on moving."""
    if ends.rest[0] or (ends.period[0] == 1 and stays_at_rest(case.clock, ends.last[0])):
        held, numbers = case.system.model.held, {"periods": round(float(ends.periods[0]))}
        point = ends.last[0] if held else np.array([float(case.system.model.contact), 0.0])
        cause = Reason.STANDS if case.system.model.frictions else Reason.CAPTURED
        return case.verdict(AttractorKind.REST, cause, ends, numbers, state=start_at(case.system, point))
    if ends.ended[0]:
        return _ended(case, ends, start)
    if not ends.periodic[0]:
        return None
    period = int(ends.period[0])
    found = certify(case.clock, ends.states[0, -1], period)
    return on_orbit(case, ends, found, "it repeats itself" + (f" every {period} forcing periods" if period > 1 else ""))


def _ended(case: VerdictRequest, ends: Recurrence, start: np.ndarray) -> Verdict:
    """The verdict on a motion that cannot be followed further; `simulate` gives the reason."""
    periods = round(float(ends.periods[0]))
    try:
        motion = simulate(case.clock, **start_at(case.system, start), periods=periods + 1, tol=case.tol, dense=False)
    except MotionError as error:
        return case.undecided(Reason.CANNOT_GO_ON, ends, {"error": error})
    if motion.limit is not None:
        return case.undecided(Reason.LIMIT, ends, {"time": motion.time, "limit": motion.limit})
    return case.undecided(Reason.NOT_FOLLOWED, ends, {"periods": periods})


def on_orbit(case: VerdictRequest, ends: Recurrence, found: Certificate, seen: str, **more: Any) -> Verdict:
    """The verdict on a motion near an orbit, which is certified or not; `seen` says what was seen of the motion."""
    more["evidence"] = more.get("evidence", {}) | found.evidence
    if found.orbit is None or not found.sound:
        return case.undecided(Reason.DOUBTFUL_ORBIT, ends, {"seen": seen, "doubt": found.doubt}, **more)
    period = found.orbit.period
    cause = Reason.ON_ORBIT if case.system.load.period is not None else Reason.EQUILIBRIUM
    numbers = {"seen": seen, "period": period, "multiplier": abs(found.orbit.multipliers[0]), "place": ends.states[0, -1, 0]}
    return case.verdict(AttractorKind.PERIODIC, cause, ends, numbers, period=period, orbit=found.orbit, **more)
