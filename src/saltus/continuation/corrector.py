"""Newton's method for a square system of equations, with a criterion for convergence that takes rounding into account."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Generic, Protocol, TypeVar

import numpy as np


@dataclass(frozen=True)
class NewtonSettings:
    """When Newton's method has converged and when it is given up."""

    converged: float = 5e-14  # residual relative to the unknowns: a few dozen rounding errors
    stalled: float = 1e-10  # residual that is accepted where rounding keeps it above `converged`
    slowdown: float = 0.3  # rounding stops the method if a step leaves more than this share of the residual before it
    circling: float = 0.5  # if two steps leave more than this share, the method circles between two smooth parts of the equations
    diverged: float = 1e6  # residual above which the iteration is given up
    longest: float = 1.0  # largest component of a step: beyond it the equations are far from linear
    last: float = 1e-6  # below this residual the next step is probably the last one, as it squares the error: evaluate thoroughly


NEWTON = NewtonSettings()


class Evaluation(Protocol):
    """The equations of a curve at one place."""

    @property
    def residual(self) -> np.ndarray:
        """F, (m,)."""

    def derivatives(self) -> np.ndarray:
        """The derivatives of F to all unknowns and parameters, (m, m + 1)."""


E = TypeVar("E", bound=Evaluation)
Linear = Callable[[E, np.ndarray], tuple[np.ndarray, np.ndarray]]


@dataclass(frozen=True)
class Corrected(Generic[E]):
    """The place to which Newton's method has converged, with the equations evaluated there."""

    place: np.ndarray
    evaluation: E
    iterations: int


def newton(
    evaluate: Callable[[np.ndarray, bool], E | None],
    linear: Linear[E],
    guess: np.ndarray,
    iterations: int,
    residual_floor: float = 0.0,
    near: bool = False,
) -> Corrected[E] | None:
    """The zero of a system near a guess, or None where Newton's method does not converge.

    Parameters
    ----------
    evaluate
        The equations at (place, thorough), None where they have no value. A thorough evaluation has all that is needed of a
        solution; the one that is returned is thorough.
    linear
        The matrix and the right-hand side of the equations for a step, from an evaluation and its place.
    guess
        Where to begin.
    iterations
        The most steps.
    residual_floor
        The largest residual that rounding may leave if derivatives are large. It is accepted if a further step would move the
        unknowns by no more than `converged`.
    near
        Whether the guess itself is probably a solution: it is then evaluated thoroughly at once.
    """
    place, before = guess.copy(), np.inf
    for iteration in range(iterations + 1):
        thorough = before <= NEWTON.last or (near and iteration == 0)
        found = evaluate(place, thorough)
        if found is None:
            return None
        error, scale = np.abs(found.residual).max(), max(1.0, np.abs(place).max())
        slow = error > NEWTON.slowdown * before
        if error <= NEWTON.converged * scale or (slow and error <= NEWTON.stalled * scale):
            looked = found if thorough else evaluate(place, True)
            return None if looked is None else Corrected(place, looked, iteration)
        step = _step(*linear(found, place)) if error < NEWTON.diverged else None
        if step is None:
            return None
        if slow and error <= residual_floor and np.abs(step).max() <= NEWTON.converged * scale:
            looked = found if thorough else evaluate(place, True)
            return None if looked is None else Corrected(place, looked, iteration)
        before, place = error, place + step
    return None


def _step(matrix: np.ndarray, right: np.ndarray) -> np.ndarray | None:
    """Newton's step, shortened where it is too long; None where there is none."""
    try:
        step = np.linalg.solve(matrix, right)
    except np.linalg.LinAlgError:
        return None
    longest = np.abs(step).max()
    if not np.isfinite(longest):
        return None
    return np.asarray(step * min(1.0, NEWTON.longest / longest if longest > 0 else 1.0))
