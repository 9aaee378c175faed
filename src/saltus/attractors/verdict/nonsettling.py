"""Motions that do not settle: chaos, a torus, or nothing that the numbers support."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from saltus.attractors.lyapunov.spectrum import Exponents, lyapunov_spectrum
from saltus.attractors.orbit_certificate import certify
from saltus.attractors.verdict.tori import excludes_tori
from saltus.attractors.verdict.verdict import Case, Verdict, on_cycle, settled
from saltus.attractors.verdict.zero_one_test import SHORTEST, ZeroOne, zero_one_test
from saltus.flow import Recurrence

STAGES = 3  # the first estimate of the exponents takes a third of `periods`, the second one the rest, twice as many
STROBES = 2000  # states at phase 0 that the 0-1 test looks at
CHAOS, ORDER = 0.8, 0.2  # values of K above and below which the 0-1 test has an opinion
LEAST = 2000  # forcing periods that they are followed: an orbit that they reach is recognised hundreds of periods later
COMPANIONS = 128  # motions from states beside the last one, to see whether the chaos has a way out
ASIDE = 1e-6  # how far: a chaotic motion of exponent 0.03 forgets it within 500 units of time


def wandering(case: Case, ends: Recurrence) -> Verdict:
    """The verdict on a motion that has not settled."""
    if case.system.load.period is None:
        text = "under constant loads it goes on moving: it has not lost its energy, or has none to lose"
        return case.verdict("undecided", text, ends)
    stages = _stages(case, ends.states[0, -1])
    last, series = stages[-1], ends.states[0, :, 0]
    series = series[np.isfinite(series)]
    opinion = zero_one_test(series, seed=case.seed) if series.size >= SHORTEST else None
    followed = round(float(ends.periods[0])) + sum(stage.periods for stage in stages if stage.note is None)
    evidence = _numbers(stages, opinion)
    given: dict[str, Any] = {"exponents": last, "zero_one": opinion, "state": last.state}
    given |= {"periods": followed, "evidence": evidence}
    later = _beside(case, last.state)
    evidence |= {"companions": COMPANIONS, "companions_settled": int((~later.unsettled[1:]).sum())}
    verdict = settled(case, later.only(slice(1)), _row(case, last.state))
    if verdict is not None:
        return _after_all(verdict, given)
    if last.note is not None:
        return case.verdict("undecided", f"after {followed} forcing periods {last.note}", ends, **given)
    if all(stage.positive for stage in stages):
        return _chaotic(case, ends, last, opinion, given)
    return _regular(case, ends, last, opinion, given)


def _stages(case: Case, state: np.ndarray) -> list[Exponents]:
    """Exponents of a run and of one twice as long that goes on from there."""
    spans = [case.periods // STAGES, 2 * (case.periods // STAGES)]
    stages: list[Exponents] = []
    at: dict[str, Any] = {case.system.model.coordinates[0]: float(state[0]), "velocity": float(state[1])}
    for i, span in enumerate(spans):
        done = sum(spans[:i]) / sum(spans)
        part = case.part(0.1 + 0.8 * done, 0.1 + 0.8 * (done + span / sum(spans)))
        stages.append(lyapunov_spectrum(case.system, **at, periods=span, transient=0, tol=case.tol, shadow=i == 0, progress=part))
        at = stages[-1].state
        if stages[-1].note is not None:
            break
    return stages


def _numbers(stages: list[Exponents], opinion: ZeroOne | None) -> dict[str, Any]:
    last = stages[-1]
    return {
        "largest_exponent": float(last.values[0]),
        "largest_exponent_error": float(last.errors[0]),
        "smallest_exponent": float(last.values[-1]),
        "mean_divergence": last.divergence,
        "exponent_resolution": last.resolution,
        "stroboscopic_exponent": stages[0].stroboscopic,
        "stroboscopic_exponent_error": stages[0].stroboscopic_error,
        "runs": len(stages),
        "zero_one": float("nan") if opinion is None else opinion.K,
        "zero_one_spread": float("nan") if opinion is None else opinion.spread,
    }


def _beside(case: Case, state: dict[str, Any]) -> Recurrence:
    """How motions end that begin at a state, the first, and beside it."""
    around = np.random.default_rng(case.seed).uniform(-ASIDE, ASIDE, (COMPANIONS, 2))
    states = _row(case, state) + np.concatenate([[[0.0, 0.0]], around])
    return case.follow(states, max(case.periods, LEAST), 4 * case.max_period, (0.9, 1.0))


def _row(case: Case, state: dict[str, Any]) -> np.ndarray:
    return np.array([state[case.system.model.coordinates[0]], state["velocity"]])


def _after_all(verdict: Verdict, given: dict[str, Any]) -> Verdict:
    """The verdict on a motion that has settled in the end, after the exponents of its transient were taken."""
    before, exponents = given["periods"], given["exponents"]
    chaos = f" of transient chaos with an exponent of {exponents.values[0]:.4g}" if exponents.positive else ""
    reason = f"after more than {before} forcing periods{chaos}: {verdict.reason}"
    return replace(
        verdict,
        reason=reason,
        periods=before + verdict.periods,
        evidence=given["evidence"] | {"transient": before} | verdict.evidence,
    )


def _chaotic(case: Case, ends: Recurrence, last: Exponents, opinion: ZeroOne | None, given: dict[str, Any]) -> Verdict:
    """Chaos, unless it has a way out or the 0-1 test sees order."""
    size = f"{last.values[0]:.4g} +- {last.errors[0]:.1g}"
    left = given["evidence"]["companions_settled"]
    if left:
        text = (
            f"{left} of {COMPANIONS} motions from beside its last state settle within {max(case.periods, LEAST)} forcing periods"
        )
        return case.verdict("undecided", f"its largest exponent is {size}, but {text}: the chaos is a transient", ends, **given)
    if opinion is not None and opinion.K < ORDER:
        text = f"its largest exponent is {size}, but the 0-1 test sees order (K = {opinion.K:.3g})"
        return case.verdict("undecided", text, ends, **given)
    second = "" if opinion is None else f"; the 0-1 test {'agrees' if opinion.K > CHAOS else 'is not sure'} (K = {opinion.K:.3g})"
    text = f"its largest exponent is {size} over {last.periods} forcing periods"
    text += f", and nothing near it settles in {max(case.periods, LEAST)} more{second}"
    return case.verdict("chaotic", text, ends, **given)


def _regular(case: Case, ends: Recurrence, last: Exponents, opinion: ZeroOne | None, given: dict[str, Any]) -> Verdict:
    """A motion that has not settled and whose largest exponent is not surely above 0."""
    top, error = float(last.values[0]), float(last.errors[0] + last.resolution)
    size = f"{top:.4g} +- {float(last.errors[0]):.1g}"
    against = excludes_tori(case.system)
    ordered = opinion is not None and opinion.K < ORDER
    if against is None and abs(top) <= error and ordered:
        assert opinion is not None
        text = f"its exponents are 0 ({size}), it does not repeat itself, and the 0-1 test sees order (K = {opinion.K:.3g})"
        return case.verdict("quasi-periodic", text, ends, **given)
    found = certify(case.clock, _row(case, last.state), None, max_period=case.max_period)
    if found.sound:
        return on_cycle(case, ends, found, "it approaches slowly", **given)
    given["evidence"] |= {} if against is None else {"no_tori": against}
    text = f"it has not settled in {given['periods']} forcing periods, and an exponent of {size} is not surely above 0"
    return case.verdict("undecided", text + ("; a torus is excluded" if against else ""), ends, **given)
