"""The verdict on motions that do not settle: chaos, a torus, or undecided."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from saltus.attractors.kind import AttractorKind
from saltus.attractors.lyapunov.spectrum import Exponents, lyapunov_spectrum
from saltus.attractors.orbit_certificate import certify
from saltus.attractors.verdict.reason import Reason
from saltus.attractors.verdict.tori import excludes_tori
from saltus.attractors.verdict.verdict import Verdict, VerdictRequest, on_orbit, settled
from saltus.attractors.verdict.zero_one_test import FEWEST_ENTRIES, ZeroOne, zero_one_test
from saltus.flow import Recurrence
from saltus.orbits import start_at, state_vector, states_beside
from saltus.progress import part_of


@dataclass(frozen=True)
class NonsettlingSettings:
    """How motions that do not settle are judged."""

    thirds: int = 3  # The first estimate of the exponents takes one of three parts of `periods`, the second one the other two.
    states: int = 2000  # Number of stroboscopic states for the 0-1 test.
    chaos: float = 0.8  # The 0-1 test shows chaos where its K is above this.
    order: float = 0.2  # It shows a regular motion where its K is below this; between the two values it decides nothing.
    # The least number of forcing periods for which companions are followed: it takes hundreds of periods on an orbit until this
    # is recognised.
    least: int = 2000
    # Number of companions: motions from states beside the last state, which show whether the chaos is transient.
    companions: int = 128
    # Distance of their first states from the last state: chaos of exponent 0.03 separates them within 500 units of time.
    aside: float = 1e-6


SETTINGS = NonsettlingSettings()


@dataclass(frozen=True)
class _Judged:
    """The results for a motion that has not settled, from which its verdict follows."""

    case: VerdictRequest
    ends: Recurrence
    last: Exponents  # those of the last and longest run
    opinion: ZeroOne | None
    periods: int  # forcing periods for which it was followed in all
    evidence: dict[str, Any]

    @property
    def given(self) -> dict[str, Any]:
        """The fields that are the same in every verdict on the motion."""
        return {
            "exponents": self.last,
            "zero_one": self.opinion,
            "state": self.last.state,
            "periods": self.periods,
            "evidence": self.evidence,
        }

    @property
    def ordered(self) -> bool:
        """Whether the 0-1 test shows a regular motion."""
        return self.opinion is not None and SETTINGS.order > self.opinion.K

    @property
    def numbers(self) -> dict[str, Any]:
        """The numbers that are filled into the sentences of the reasons."""
        return {
            "size": f"{self.last.values[0]:.4g} +- {self.last.errors[0]:.1g}",
            "K": float("nan") if self.opinion is None else self.opinion.K,
            "companions": SETTINGS.companions,
            "left": self.evidence["companions_settled"],
            "followed": max(self.case.periods, SETTINGS.least),
            "note": self.last.note,
        }


def unsettled(case: VerdictRequest, ends: Recurrence) -> Verdict:
    """The verdict on a motion that has not settled."""
    if case.system.load.period is None:
        return case.undecided(Reason.SELF_EXCITED if case.system.model.frictions else Reason.CONSERVATIVE, ends, {})
    runs, series = _runs(case, ends.states[0, -1]), ends.states[0, :, 0]
    series = series[np.isfinite(series)]
    opinion = zero_one_test(series, seed=case.seed) if series.size >= FEWEST_ENTRIES else None
    periods = round(float(ends.periods[0])) + sum(run.periods for run in runs if run.note is None)
    later = _beside(case, runs[-1].state)
    evidence = _evidence(runs, opinion) | {"companions_settled": int((~later.unsettled[1:]).sum())}
    judged = _Judged(case, ends, runs[-1], opinion, periods, evidence)
    verdict = settled(case, later.only(slice(1)), state_vector(case.system, runs[-1].state))
    if verdict is not None:
        return _after_all(verdict, judged)
    if runs[-1].note is not None:
        return case.undecided(Reason.NO_EXPONENTS, ends, judged.numbers | {"periods": periods}, **judged.given)
    return _chaotic(judged) if all(run.positive for run in runs) else _regular(judged)


def _runs(case: VerdictRequest, state: np.ndarray) -> list[Exponents]:
    """The exponents of a run, and of a second one, twice as long, that continues the first."""
    third, at = case.periods // SETTINGS.thirds, start_at(case.system, state)
    runs: list[Exponents] = []
    for span, part in ((third, (0.1, 0.1 + 0.8 / 3)), (2 * third, (0.1 + 0.8 / 3, 0.9))):
        progress = part_of(case.progress, *part)
        options: dict[str, Any] = {"periods": span, "transient": 0, "tol": case.tol, "two_trajectories": not runs}
        runs.append(lyapunov_spectrum(case.system, **at, **options, progress=progress))
        at = runs[-1].state
        if runs[-1].note is not None:
            break
    return runs


def _evidence(runs: list[Exponents], opinion: ZeroOne | None) -> dict[str, Any]:
    last = runs[-1]
    return {
        "largest_exponent": float(last.values[0]),
        "largest_exponent_error": float(last.errors[0]),
        "smallest_exponent": float(last.values[-1]),
        "mean_divergence": last.divergence,
        "exponent_resolution": last.resolution,
        "stroboscopic_exponent": runs[0].stroboscopic,
        "stroboscopic_exponent_error": runs[0].stroboscopic_error,
        "runs": len(runs),
        "zero_one": float("nan") if opinion is None else opinion.K,
        "zero_one_spread": float("nan") if opinion is None else opinion.spread,
        "companions": SETTINGS.companions,
    }


def _beside(case: VerdictRequest, state: dict[str, Any]) -> Recurrence:
    """The ends of motions from a state (the first row) and from states beside it."""
    row = state_vector(case.system, state)
    around = np.random.default_rng(int(case.seed)).uniform(-SETTINGS.aside, SETTINGS.aside, (SETTINGS.companions, row.size))
    states = states_beside(case.system, row, np.concatenate([np.zeros((1, row.size)), around]))
    return case.follow(states, max(case.periods, SETTINGS.least), 4 * case.max_period, (0.9, 1.0))


def _after_all(verdict: Verdict, judged: _Judged) -> Verdict:
    """The verdict on a motion that has settled after all, after the exponents of its transient were computed."""
    last, before = judged.last, judged.periods
    chaos = f" of transient chaos with an exponent of {last.values[0]:.4g}" if last.positive else ""
    return replace(
        verdict,
        reason=f"after more than {before} forcing periods{chaos}: {verdict.reason}",
        periods=before + verdict.periods,
        evidence=judged.evidence | {"transient": before} | verdict.evidence,
    )


def _chaotic(judged: _Judged) -> Verdict:
    """The verdict chaos, or undecided if companions have settled or the 0-1 test shows a regular motion."""
    case, ends, opinion = judged.case, judged.ends, judged.opinion
    if judged.evidence["companions_settled"]:
        return case.undecided(Reason.TRANSIENT, ends, judged.numbers, **judged.given)
    if judged.ordered:
        return case.undecided(Reason.CONTRADICTED, ends, judged.numbers, **judged.given)
    second = ""
    if opinion is not None:
        second = f"; the 0-1 test {'agrees' if SETTINGS.chaos < opinion.K else 'is not sure'} (K = {opinion.K:.3g})"
    numbers = judged.numbers | {"periods": judged.last.periods, "second": second}
    return case.verdict(AttractorKind.CHAOTIC, Reason.CHAOS, ends, numbers, **judged.given)


def _regular(judged: _Judged) -> Verdict:
    """The verdict on a motion that has not settled and whose largest exponent is not surely above 0."""
    case, last, given = judged.case, judged.last, judged.given
    against = excludes_tori(case.system)
    if against is None and judged.ordered and abs(last.values[0]) <= float(last.errors[0] + last.resolution):
        return case.verdict(AttractorKind.QUASI_PERIODIC, Reason.TORUS, judged.ends, judged.numbers, **given)
    found = certify(case.clock, state_vector(case.system, last.state), None, max_period=case.max_period)
    if found.sound:
        return on_orbit(case, judged.ends, found, "it approaches slowly", **given)
    given["evidence"] |= {} if against is None else {"no_tori": against}
    numbers = judged.numbers | {"periods": judged.periods, "torus": "; a torus is excluded" if against else ""}
    return case.undecided(Reason.NOT_SURE, judged.ends, numbers, **given)
