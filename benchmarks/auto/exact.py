"""The same branch by saltus: exact, with its special points."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Callable
from typing import Any

from measure import interleave

from auto.case import HIGHEST, LOWEST, TIMED, Known, first_state, system
from auto.diagram import Point
from auto.verdicts import fold_errors

LIMIT = 60.0  # seconds for one branch
DRAWN = 0.01  # the longest step of the curve that is drawn
KINDS = {"LP": "LP", "BPC": "BP", "PD": "PD", "NS": "TR"}  # saltus' names and AUTO's


class TooLongError(Exception):
    """The branch is not done within LIMIT."""


def exact_rows(amplitude: float, known: Known, rounds: int) -> list[dict[str, Any]]:
    """The lines of the table for the branch down to TIMED and to LOWEST; `fails` with the reason
    where there is none.

    The first one is timed by processor time, over `rounds` rounds after one in which code is
    compiled; the second one once.
    """
    first = _attempt(lambda: _timed(amplitude, rounds))
    second = _attempt(lambda: _once(amplitude))
    lows = (TIMED, LOWEST)
    return [
        {"lowest": low} | _row(outcome, known)
        for low, outcome in zip(lows, (first, second), strict=True)
    ]


def exact_curve(amplitude: float) -> dict[str, list[float]]:
    """Omega and max abs(theta) down to TIMED in small steps, to be drawn; empty lists where that
    fails.
    """
    found = _attempt(lambda: (follow(amplitude, TIMED, step=DRAWN), 0.0))
    if isinstance(found, str):
        return {"omega": [], "amplitude": []}
    return {"omega": found[0].parameters.tolist(), "amplitude": found[0].amplitudes.tolist()}


def follow(amplitude: float, lowest: float, **options: float) -> Any:
    """The branch from Omega = 3 down to `lowest`."""
    import saltus

    theta, velocity = first_state(amplitude)
    orbit = saltus.find_orbit(system(amplitude), theta=theta, velocity=velocity, period=1, settle=0)
    start = time.perf_counter()

    def watch(done: float, what: str) -> None:
        if time.perf_counter() - start > LIMIT:
            raise TooLongError(f"not done in {LIMIT:g} s, {what}, {done:.0%}")

    return saltus.continue_orbit(
        orbit, "load.frequency", (lowest, HIGHEST), progress=watch, **options
    )


def _timed(amplitude: float, rounds: int) -> tuple[Any, float]:
    branches: list[Any] = []
    timings = interleave(
        {0: lambda: branches.append(follow(amplitude, TIMED))}, rounds, one_core=True
    )
    return branches[-1], timings[0].median


def _once(amplitude: float) -> tuple[Any, float]:
    start = time.process_time()
    branch = follow(amplitude, LOWEST)
    return branch, time.process_time() - start


def _attempt(task: Callable[[], tuple[Any, float]]) -> tuple[Any, float] | str:
    try:
        return task()
    except Exception as reason:  # a benchmark says what fails, whatever it is
        return f"{reason}"[:200]


def _row(outcome: tuple[Any, float] | str, known: Known) -> dict[str, Any]:
    if isinstance(outcome, str):
        return {"fails": outcome}
    branch, seconds = outcome
    special = list(reversed(branch.special))  # downwards, as the branch is followed
    labels = Counter(KINDS.get(point.kind, point.kind) for point in special)
    folds = [
        Point(point.parameter, point.amplitude, 0.0, False, "LP")
        for point in special
        if point.kind == "LP"
    ]
    grazings = [[point.parameter, point.amplitude] for point in special if point.kind == "GR"]
    return {
        "seconds": seconds,
        "points": len(branch.points),
        "fold_errors": fold_errors(folds, known),
        "folds": [[fold.omega, fold.amplitude] for fold in folds],
        "grazings": grazings,
        "labels": {kind: labels[kind] for kind in ("LP", "BP", "PD", "TR")},
        "impossible": sum(
            point.kind == "NS" or (point.kind == "PD" and point.orbit.symmetric)
            for point in special
        ),
        "end": str(branch.ends[0]),
    }
