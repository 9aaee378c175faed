"""Pseudo-arclength continuation: curves of equations with derivatives, which may fold in every parameter."""

from __future__ import annotations

import math
from abc import abstractmethod
from typing import Any

import numpy as np

from saltus.continuation.corrector import NEWTON, Corrected, Evaluation, newton
from saltus.continuation.curve import Curve, P
from saltus.continuation.predictor import predicted
from saltus.continuation.step_length import STEPS


class EquationCurve(Curve[P]):
    """A curve of equations: each point is predicted from the last ones and corrected by Newton's method in a hyperplane."""

    iterations = 7  # the most iterations of Newton's method in a hyperplane: if it needs more, the step is too long
    iterations_at = 12  # the most iterations with one component fixed, where the guess may be farther away
    # Share of a step: a corrector that leads farther than this from where the step was predicted is given up.
    corrector_radius: float = math.inf
    residual_floor: float = 0.0  # The largest residual that rounding may leave, where derivatives are large.

    @abstractmethod
    def evaluate(self, place: np.ndarray, thorough: bool) -> Evaluation | None:
        """The equations at a place, with all that is wanted of a solution if `thorough`; None where they have no value."""

    @abstractmethod
    def point_at(self, found: Corrected[Any], tangent: np.ndarray) -> P:
        """A solution as a point."""

    def solve(self, guess: np.ndarray, direction: np.ndarray) -> P | None:
        return self.solve_within(guess, direction, math.inf, near=True)  # most guesses lie between points that are known

    def solve_within(self, guess: np.ndarray, direction: np.ndarray, reach: float, near: bool = False) -> P | None:
        """`solve`, but None if Newton's method leads farther than `reach` from the guess or, for a finite `reach`, in circles.
        `near` is that of `newton`."""
        normal, errors = direction * self.weights**2, list[float]()

        def within_reach(place: np.ndarray, thorough: bool) -> Evaluation | None:
            found = self.evaluate(place, thorough) if self.norm(place - guess) <= reach else None
            if found is not None:
                errors.append(float(np.abs(found.residual).max()))
                if len(errors) > 2 and NEWTON.stalled < errors[-1] > NEWTON.circling * errors[-3]:
                    return None
            return found

        def linear(found: Evaluation, place: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
            return bordered(found.derivatives(), normal), -bordered(found.residual, normal @ (place - guess))

        evaluate = self.evaluate if reach == math.inf else within_reach
        found = newton(evaluate, linear, guess, self.iterations, self.residual_floor, near)
        return None if found is None else self.with_tangent(found, direction)

    def solve_at(self, guess: np.ndarray, direction: np.ndarray, index: int = -1) -> P | None:
        free = np.arange(guess.size) != index % guess.size

        def filled(numbers: np.ndarray) -> np.ndarray:
            place = guess.copy()
            place[free] = numbers
            return place

        def evaluate(numbers: np.ndarray, thorough: bool) -> Evaluation | None:
            return self.evaluate(filled(numbers), thorough)

        def linear(found: Evaluation, _: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
            return found.derivatives()[:, free], -found.residual

        found = newton(evaluate, linear, guess[free], self.iterations_at, self.residual_floor)
        if found is None:
            return None
        return self.with_tangent(Corrected(filled(found.place), found.evaluation, found.iterations), direction)

    def beside_singular(self, place: np.ndarray, direction: np.ndarray) -> P | None:
        """The point at a place that solves the equations to rounding, with the direction of its tangent; None if it does not."""
        evaluation = self.evaluate(place, True)
        if evaluation is None or not np.abs(evaluation.residual).max() <= NEWTON.stalled * max(1.0, np.abs(place).max()):
            return None
        return self.point_at(Corrected(place, evaluation, 0), direction / self.norm(direction))

    def with_tangent(self, found: Corrected[Any], direction: np.ndarray) -> P | None:
        """A solution as a point, with the tangent that goes along a direction; None where the tangent is not unique."""
        matrix = bordered(found.evaluation.derivatives(), direction * self.weights**2)
        right = np.zeros(len(matrix))
        right[-1] = 1.0
        try:
            tangent = np.linalg.solve(matrix, right)
        except np.linalg.LinAlgError:
            return None
        length = self.norm(tangent)
        return self.point_at(found, tangent / length) if 0.0 < length < np.inf else None

    def along_kernel(self, found: Corrected[Any]) -> P:
        """A solution as a point, with its tangent from the kernel of the derivatives, where no direction is known."""
        tangent = np.linalg.svd(found.evaluation.derivatives() / self.weights)[2][-1] / self.weights
        return self.point_at(found, tangent / self.norm(tangent))

    def advance(self, before: P | None, point: P, step: float) -> P | None:
        """The point a step further; None if Newton's method does not converge, or converges too far from the predicted place."""
        guess = predicted(before, point, step)
        ahead = self.solve_within(guess, point.tangent, self.corrector_radius * step)
        straight = before is None or not before.curve.joins(point.curve)
        off = STEPS.off_tangent if straight else STEPS.off
        return None if ahead is None or self.norm(ahead.place - guess) >= off * step else ahead

    def turn(self, a: P, b: P) -> float:
        """The angle between the tangents, rad."""
        cosine = float(b.tangent @ (self.weights**2 * a.tangent))
        return math.acos(min(1.0, max(-1.0, cosine)))


def bordered(rows: np.ndarray, last: Any) -> np.ndarray:
    """An array (n, ...) with one more row below it; NumPy's functions for this would take longer than the rest of a step."""
    result = np.empty((len(rows) + 1, *rows.shape[1:]))
    result[:-1], result[-1] = rows, last
    return result
