"""What a run of AUTO says of the branch, held against what is known of it."""

from __future__ import annotations

from collections import Counter
from typing import Any

from auto.case import HIGHEST, LOWEST, Known
from auto.diagram import Point
from auto.program import Run

# abs(mean of theta) up to which an orbit counts as symmetric: the coarsest mesh errs by 1.4e-3
# where no other orbit is near, and the asymmetric orbits that double here have 3e-3 and more
SYMMETRIC = 2e-3
NEAR = 1e-2  # relative: a fold farther than this from the exact one is another fold, or none
NEAR_GRAZING = 2e-3  # in Omega


def fold_errors(branch: list[Point], known: Known) -> list[float | None]:
    """For each known fold the error in Omega of the nearest LP; None where no LP is near."""
    folds = [point.omega for point in branch if point.kind == "LP"]
    errors = [min((abs(fold - exact) for fold in folds), default=exact) for exact in known.folds]
    return [
        error if error < NEAR * exact else None
        for error, exact in zip(errors, known.folds, strict=True)
    ]


def impossible(branch: list[Point]) -> int:
    """Labels that no orbit can deserve, each an artefact of the discretisation.

    TR: the product of the multipliers is exp(-C T) < 1, so no pair lies on the unit circle. PD on a
    symmetric orbit: its multipliers are squares of those of the half map, and -1 would be the
    square of such a pair.
    """
    return sum(
        point.kind == "TR" or (point.kind == "PD" and abs(point.mean) < SYMMETRIC)
        for point in branch
    )


def at_grazing(branch: list[Point], known: Known) -> dict[str, Any] | None:
    """The first passage of the exact grazing: the amplitude on arrival, and the folds around it
    before the branch leaves.

    The exact branch turns at the grazing and again a little above it; a smoothed one may show that
    as two folds, or pass. None where nothing grazes; `arrives` is False where the branch never gets
    there.
    """
    if known.grazing is None:
        return None
    first = next(
        (i for i, point in enumerate(branch) if point.omega < known.grazing + NEAR_GRAZING), None
    )
    if first is None:
        return {"arrives": False, "turns": [], "beyond": False}
    stay = next(
        (
            i
            for i in range(first, len(branch))
            if abs(branch[i].omega - known.grazing) > NEAR_GRAZING
        ),
        len(branch),
    )
    turns = [[point.omega, point.amplitude] for point in branch[first:stay] if point.kind == "LP"]
    return {
        "arrives": True,
        "turns": turns,
        "beyond": stay < len(branch) and branch[stay].omega < known.grazing,
    }


def end(run: Run) -> str:
    """How the run ended, in words."""
    if run.fails or not run.branch:
        return run.fails or "no point"
    last = run.branch[-1]
    if last.kind == "MX":
        return f"no convergence at Omega = {last.omega:.4f}"
    if last.omega <= LOWEST:
        return f"reaches {LOWEST:g}"
    if last.omega >= HIGHEST:
        return f"turns round, back at {HIGHEST:g}"
    return f"gives up after {len(run.branch)} points at Omega = {last.omega:.4f}"


def row(run: Run, known: Known) -> dict[str, Any]:
    """One line of the table."""
    labels = Counter(point.kind for point in run.branch)
    return {
        "seconds": run.seconds,
        "points": len(run.branch),
        "fold_errors": fold_errors(run.branch, known),
        "grazing": at_grazing(run.branch, known),
        "labels": {kind: labels[kind] for kind in ("LP", "BP", "PD", "TR")},
        "impossible": impossible(run.branch),
        "end": end(run),
    }
