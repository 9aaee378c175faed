"""Verdicts: where one motion ends, with the evidence."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from saltus.attractors.lyapunov.spectrum import Exponents
from saltus.attractors.orbit_certificate import Certificate, certify
from saltus.attractors.verdict.zero_one_test import ZeroOne
from saltus.errors import MotionError
from saltus.flow import Recurrence, find_recurrence, simulate
from saltus.orbits import PeriodicOrbit
from saltus.systems import System

if TYPE_CHECKING:
    import xarray

KINDS = ("rest", "periodic", "quasi-periodic", "chaotic", "undecided")
DRIVEN_MAX_PERIOD = 16  # the longest cycle that `settle` looks for


@dataclass(frozen=True, eq=False)
class Verdict:
    """Where a motion ends."""

    system: System
    kind: str  # one of KINDS
    reason: str
    period: int | None  # forcing periods after which it repeats; None where it does not
    orbit: PeriodicOrbit | None  # solved by its own equations, attracting, and met by the motion
    exponents: Exponents | None  # of the last and longest run; None where the motion has settled
    zero_one: ZeroOne | None  # the second opinion, from the states at phase 0; None where the motion has settled
    state: dict[str, Any]  # at the end, at phase 0: arguments of `simulate`
    periods: int  # forcing periods that the motion was followed in all
    evidence: dict[str, Any] = field(default_factory=dict)  # numbers and sentences by name

    def to_xarray(self) -> xarray.Dataset:
        """The verdict and its evidence as a Dataset of single values."""
        import xarray

        from saltus import __version__

        known = {"kind": self.kind, "reason": self.reason, "period": self.period or 0, "followed": self.periods}
        values = {name: ((), value) for name, value in (known | self.evidence).items()}
        about = {"title": "verdict by saltus", "saltus_version": __version__, "system": self.system.to_json()}
        data = xarray.Dataset(values, attrs=about)
        for variable in data.variables.values():
            variable.attrs["units"] = "1"
        return data

    def __repr__(self) -> str:
        return f"Verdict({self.kind}{f' {self.period}' if self.period else ''}: {self.reason})"


@dataclass(frozen=True)
class Case:
    """One question: a motion's system, and how long and how exactly it is looked at."""

    system: System
    clock: System  # the same, with a forcing period
    periods: int
    max_period: int
    seed: int
    tol: float
    progress: Callable[[float], object]

    def part(self, begin: float, end: float) -> Callable[[float], object]:
        """The progress of a part of the work."""
        return lambda done: self.progress(begin + (end - begin) * done)

    def follow(self, states: np.ndarray, periods: int, kept: int, part: tuple[float, float]) -> Recurrence:
        """How motions end from states (n, 2) within so many forcing periods; with the part of the work that this is."""
        done = self.part(*part)
        return find_recurrence(
            self.clock, states, periods, max_period=self.max_period, kept=kept, tol=self.tol, progress=lambda x, _: done(x)
        )

    def verdict(self, kind: str, reason: str, ends: Recurrence, **more: Any) -> Verdict:
        """A verdict on a motion that ended so."""
        last = ends.states[0, -1]
        state = {self.system.model.coordinates[0]: float(last[0]), "velocity": float(last[1])}
        given = {"period": None, "orbit": None, "exponents": None, "zero_one": None, "state": state} | more
        given.setdefault("periods", round(float(ends.periods[0])))
        return Verdict(system=self.system, kind=kind, reason=reason, **given)


def settled(case: Case, ends: Recurrence, start: np.ndarray) -> Verdict | None:
    """The verdict on a motion from a state (2,) that has come to rest, ended or repeats itself; None where it wanders on."""
    done = round(float(ends.periods[0]))
    if ends.rest[0]:
        point = {case.system.model.coordinates[0]: float(case.system.model.contact), "velocity": 0.0}
        text = f"within {done} forcing periods it is captured by the contact, from where no later load pulls it"
        return case.verdict("rest", text, ends, state=point)
    if ends.ended[0]:
        return case.verdict("undecided", _why_ended(case, start, done), ends)
    cycle = int(ends.period[0])
    if not cycle:
        return None
    found = certify(case.clock, ends.states[0, -1], cycle)
    return on_cycle(case, ends, found, "it repeats itself" + (f" every {cycle} forcing periods" if cycle > 1 else ""))


def _why_ended(case: Case, start: np.ndarray, periods: int) -> str:
    """The sentence of `simulate` on a motion that ends."""
    begin: dict[str, Any] = {case.system.model.coordinates[0]: float(start[0]), "velocity": float(start[1])}
    try:
        motion = simulate(case.clock, **begin, periods=periods + 1, tol=case.tol, dense=False)
    except MotionError as error:
        return f"the motion cannot go on: {error}"
    if motion.limit is not None:
        return f"the motion ends at time {motion.time:.6g}, where its margin {motion.limit} reaches 0"
    return f"the motion cannot be followed beyond some {periods} forcing periods"


def on_cycle(case: Case, ends: Recurrence, found: Certificate, seen: str, **more: Any) -> Verdict:
    """The verdict on a motion with an orbit under it, certified or not."""
    more["evidence"] = more.get("evidence", {}) | found.evidence
    if found.orbit is None or not found.sound:
        return case.verdict("undecided", f"{seen}, but {found.doubt}", ends, **more)
    q = found.orbit.period
    text = f"{seen}, on an orbit of period {q} with the largest multiplier {abs(found.orbit.multipliers[0]):.6g}"
    if case.system.load.period is None:
        text = f"it comes to the equilibrium at {float(ends.states[0, -1, 0]):.9g}, which attracts"
    return case.verdict("periodic", text, ends, period=q, orbit=found.orbit, **more)
