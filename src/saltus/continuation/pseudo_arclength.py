"""Pseudo-arclength continuation: curves of equations with derivatives, which may fold in every
parameter; and the corrector, which is Newton's method.

The next step's end is predicted on the cubic through the last two points with their tangents.
"""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Generic, Protocol, TypeVar

import numpy as np

from saltus.continuation.curve import Curve, P, Point
from saltus.continuation.step_arithmetic import arithmetic, as_floats


@dataclass(frozen=True)
class NewtonSettings:
    """When Newton's method has converged and when it is given up."""

    converged: float = 5e-14  # residual relative to the unknowns: a few dozen rounding errors
    stalled: float = 1e-10  # residual that is accepted where rounding keeps it above `converged`
    # rounding stops the method if a step leaves more than this share of the residual before it
    slowdown: float = 0.3
    # if two steps leave more than this share, the method circles between two smooth parts of the
    # equations
    circling: float = 0.5
    diverged: float = 1e6  # residual above which the iteration is given up
    longest: float = 1.0  # largest component of a step: beyond it the equations are far from linear
    # below this residual the next step is probably the last one, as it squares the error: evaluate
    # thoroughly
    last: float = 1e-6


NEWTON = NewtonSettings()


class Evaluation(Protocol):
    """The equations of a curve at one place."""

    @property
    def residual(self) -> np.ndarray:
        """F, (m,)."""

    def derivatives(self) -> np.ndarray:
        """The derivatives of F to all unknowns and parameters, (m, m + 1)."""


@dataclass(frozen=True, eq=False)
class Units:
    """The natural units of equations: their numbers are compared with thresholds in these."""

    unknowns: Any = 1.0  # of the unknowns, an array or a number
    residuals: Any = 1.0  # of the residuals, an array (m,) or a number
    # Which unknowns may move by no more than their unit in a step of Newton's method, an array, or
    # True for all; others, such as the coordinates of a large orbit, by as much as the largest of
    # them is.
    bounded: Any = True
    # Whether linear equations are solved in these units, as they must be where units differ much.
    scaled: bool = True
    # How many units the terms are of which a residual is the difference, an array (m,) or a number.
    terms: Any = 1.0

    def residual(self, values: np.ndarray) -> float:
        """The largest of residuals (m,) in their units."""
        return float(np.abs(values / self.residuals).max(initial=0.0))

    def vanish(self, values: np.ndarray, tolerance: float) -> bool:
        """Whether residuals (m,) are below a tolerance in their units, or rounding of their
        terms."""
        bounds = np.maximum(tolerance, NEWTON.converged * np.asarray(self.terms))
        return bool((np.abs(values / self.residuals) < bounds).all())

    def of_unknowns(self, count: int) -> tuple[np.ndarray, np.ndarray]:
        """The units of so many unknowns, and which of them are bounded."""
        return _full(self.unknowns, count), _full(self.bounded, count, bool)

    def of_residuals(self, count: int) -> tuple[np.ndarray, np.ndarray]:
        """The units of so many residuals, and how many of these their terms are."""
        return _full(self.residuals, count), _full(self.terms, count)


def _full(value: Any, count: int, kind: type = float) -> np.ndarray:
    """An array of so many equal numbers, or the array that is given already."""
    if isinstance(value, np.ndarray) and value.dtype == kind and value.shape == (count,):
        return value
    return np.full(count, value, kind)


ONES = Units()
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
    before: float = np.inf,
    units: Units = ONES,
) -> Corrected[E] | None:
    """The zero of a system near a guess, or None where Newton's method does not converge.

    Parameters
    ----------
    evaluate
        The equations at (place, thorough), None where they have no value. A thorough evaluation has
        all that is needed of a solution; the one that is returned is thorough.
    linear
        The matrix and the right-hand side of the equations for a step, from an evaluation and its
        place.
    guess
        Where to begin.
    iterations
        The most steps.
    residual_floor
        The largest residual that rounding may leave if derivatives are large. It is accepted if a
        further step would move the unknowns by no more than `converged`.
    near
        Whether the guess itself is probably a solution: it is then evaluated thoroughly at once.
    before
        The residual at the guess where it is known already, up to rounding.
    units
        The natural units in which unknowns and residuals are measured.
    """
    place = np.array(guess, dtype=float)
    sizes_of = arithmetic().sizes_of
    sizes, bounded = units.of_unknowns(len(place))
    of_residuals: tuple[np.ndarray, ...] = ()
    for iteration in range(iterations + 1):
        thorough = before <= NEWTON.last or (near and iteration == 0)
        found = evaluate(place, thorough)
        if found is None:
            return None
        (residual,) = as_floats(found.residual)
        of_residuals = of_residuals or units.of_residuals(len(residual))
        error, share, scale = sizes_of(residual, place, sizes, *of_residuals)
        slow = error > NEWTON.slowdown * before
        rounded = slow and (error <= NEWTON.stalled * scale or share <= NEWTON.converged * scale)
        if error <= NEWTON.converged * scale or rounded:
            looked = found if thorough else evaluate(place, True)
            return None if looked is None else Corrected(place, looked, iteration)
        if not error < NEWTON.diverged:
            return None
        taken = _step(*linear(found, place), place, sizes, bounded, units.scaled)
        if taken is None:
            return None
        step, moved = taken
        if slow and error <= residual_floor and moved <= NEWTON.converged * scale:
            looked = found if thorough else evaluate(place, True)
            return None if looked is None else Corrected(place, looked, iteration)
        before, place = error, place + step
    return None


def _step(
    matrix: np.ndarray,
    right: np.ndarray,
    place: np.ndarray,
    sizes: np.ndarray,
    bounded: np.ndarray,
    scaled: bool,
) -> tuple[np.ndarray, float] | None:
    """Newton's step, shortened where it is too long, and its largest component in units; None where
    there is none. `sizes` and `bounded` are `Units.of_unknowns`.
    """
    step = np.empty(len(right))
    numbers = as_floats(matrix, right, place)
    moved = arithmetic().newton_step(*numbers, sizes, bounded, scaled, NEWTON.longest, step)
    return None if math.isnan(moved) else (step, moved)


WIDE = math.log(1e3)  # Units that differ by more than this factor differ much.


class EquationCurve(Curve[P]):
    """A curve of equations: each point is predicted from the last ones and corrected by Newton's
    method in a hyperplane.
    """

    # the most iterations of Newton's method in a hyperplane: if it needs more, the step is too long
    iterations = 7
    # the most iterations with one component fixed, where the guess may be farther away
    iterations_at = 12
    # Share of a step: a corrector that leads farther than this from where the step was predicted is
    # given up.
    corrector_radius: float = math.inf
    # The largest residual that rounding may leave, where derivatives are large.
    residual_floor: float = 0.0

    @property
    def units(self) -> Units:
        """The natural units of the unknowns without the parameters, and of the residuals."""
        return ONES

    def units_at(self, place: np.ndarray) -> Units:
        """The units of all components of a place: of a parameter the larger of its size and of the
        range that its weight stands for.
        """
        least = self._least_units
        sizes = [abs(value) for value in place[-self.count :].tolist()]
        units = least.unknowns[-self.count :].tolist()
        if all(size <= unit for size, unit in zip(sizes, units, strict=True)):
            return least
        unknowns = least.unknowns.copy()
        unknowns[-self.count :] = np.maximum(sizes, units)
        return replace(least, unknowns=unknowns)

    @cached_property
    def _least_units(self) -> Units:
        """These units where the parameters are smaller than their ranges."""
        own = self.units
        unknowns = np.asarray(3.0 / self.weights, dtype=float)
        unknowns[: len(unknowns) - self.count] = own.unknowns
        residuals, terms = own.of_residuals(len(unknowns) - 1)
        return Units(unknowns, residuals, self._bounded, self._scaled, terms)

    @cached_property
    def _scaled(self) -> bool:
        """Whether the units differ so much that linear equations have to be solved in them; else
        only rounding, and some time, would change."""
        sizes = 1.0 / self.weights
        residuals = np.atleast_1d(self.units.residuals)
        return bool(max(np.ptp(np.log(sizes)), np.ptp(np.log(residuals))) > WIDE)

    @cached_property
    def _bounded(self) -> np.ndarray:
        """`Units.bounded` of all components of a place."""
        bounded = np.ones(len(self.weights), dtype=bool)
        bounded[: len(self.weights) - self.count] = self.units.bounded
        return bounded

    @abstractmethod
    def evaluate(self, place: np.ndarray, thorough: bool) -> Evaluation | None:
        """The equations at a place, with all that is wanted of a solution if `thorough`; None where
        they have no value.
        """

    @abstractmethod
    def point_at(self, found: Corrected[Any], tangent: np.ndarray) -> P:
        """A solution as a point."""

    def residual(self, place: np.ndarray) -> np.ndarray | None:
        """F alone at a place, up to rounding, where that takes far less time than with its
        derivatives; else None.
        """
        return None

    def derivatives_at(self, point: P) -> np.ndarray:
        """The derivatives at a point of the curve, for curves that have `residual`."""
        raise NotImplementedError

    def approached(
        self, guess: np.ndarray, direction: np.ndarray, point: P, reach: float = math.inf
    ) -> tuple[np.ndarray, float]:
        """A place in the hyperplane of `solve` that is nearer to the curve than the guess, by
        Broyden's method from the derivatives at a point beside it, with its residual; the guess and
        inf without `residual`."""
        found = self.residual(guess) if point.curve.joins(self) else None
        if found is None:
            return guess, math.inf
        normal = direction * self.weights**2
        place = guess
        right = bordered(found, 0.0)
        matrix = bordered(self.derivatives_at(point), normal)
        units = self.units_at(guess)
        sizes = units.of_unknowns(len(guess))
        error = units.residual(found)
        for _ in range(self.iterations_at):
            near = not NEWTON.converged < error < NEWTON.diverged
            taken = None if near else _step(matrix, -right, place, *sizes, units.scaled)
            if taken is None or self.norm(place + taken[0] - guess) > reach:
                break
            step = taken[0]
            found = self.residual(place + step)
            if found is None or not (left := units.residual(found)) < NEWTON.circling * error:
                break
            place, before, right, error = (
                place + step,
                right,
                bordered(found, normal @ (place + step - guess)),
                left,
            )
            along = step * self.weights**2
            matrix += np.outer(right - before - matrix @ step, along) / (along @ step)
        return place, error

    def solve_beside(self, guess: np.ndarray, direction: np.ndarray, point: P) -> P | None:
        place, before = self.approached(guess, direction, point)
        return (
            self.solve(guess, direction)
            if place is guess
            else self.solve_within(place, direction, math.inf, before=before)
        )

    def solve(self, guess: np.ndarray, direction: np.ndarray) -> P | None:
        # most guesses lie between points that are known
        return self.solve_within(guess, direction, math.inf, near=True)

    def solve_within(
        self,
        guess: np.ndarray,
        direction: np.ndarray,
        reach: float,
        near: bool = False,
        before: float = math.inf,
    ) -> P | None:
        """`solve`, but None if Newton's method leads farther than `reach` from the guess or, for a
        finite `reach`, in circles. `near` and `before` are those of `newton`."""
        normal = direction * self.weights**2
        border = arithmetic().border
        errors = list[float]()
        units = self.units_at(guess)

        def within_reach(place: np.ndarray, thorough: bool) -> Evaluation | None:
            found = self.evaluate(place, thorough) if self.norm(place - guess) <= reach else None
            if found is not None:
                errors.append(units.residual(found.residual))
                if len(errors) > 2 and NEWTON.stalled < errors[-1] > NEWTON.circling * errors[-3]:
                    return None
            return found

        def linear(found: Evaluation, place: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
            matrix = np.empty((len(place), len(place)))
            right = np.empty(len(place))
            numbers = as_floats(found.derivatives(), found.residual, normal, place, guess)
            border(*numbers, matrix, right)
            return matrix, right

        evaluate = self.evaluate if reach == math.inf else within_reach
        floor = self.residual_floor
        found = newton(evaluate, linear, guess, self.iterations, floor, near, before, units)
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

        units = self.units_at(guess)
        of_free = Units(
            units.unknowns[free], units.residuals, units.bounded[free], units.scaled, units.terms
        )
        floor = self.residual_floor
        found = newton(evaluate, linear, guess[free], self.iterations_at, floor, units=of_free)
        if found is None:
            return None
        return self.with_tangent(
            Corrected(filled(found.place), found.evaluation, found.iterations), direction
        )

    def beside_singular(self, place: np.ndarray, direction: np.ndarray) -> P | None:
        """The point at a place that solves the equations to rounding, with the direction of its
        tangent; None if it does not.
        """
        evaluation = self.evaluate(place, True)
        units = self.units_at(place)
        scale = max(1.0, np.abs(place / units.unknowns).max())
        if evaluation is None or not units.residual(evaluation.residual) <= NEWTON.stalled * scale:
            return None
        return self.point_at(Corrected(place, evaluation, 0), direction / self.norm(direction))

    def with_tangent(self, found: Corrected[Any], direction: np.ndarray) -> P | None:
        """A solution as a point, with the tangent that goes along a direction; None where the
        tangent is not unique.
        """
        tangent = np.empty(len(direction))
        numbers = as_floats(found.evaluation.derivatives(), direction, self.weights)
        length = arithmetic().tangent_along(*numbers, self._scaled, tangent)
        return self.point_at(found, tangent) if 0.0 < length < math.inf else None

    def along_kernel(self, found: Corrected[Any]) -> P:
        """A solution as a point, with its tangent from the kernel of the derivatives, where no
        direction is known.
        """
        rows = found.evaluation.derivatives() / np.reshape(self.units.residuals, (-1, 1))
        tangent = np.linalg.svd(rows / self.weights)[2][-1] / self.weights
        return self.point_at(found, tangent / self.norm(tangent))

    def advance(self, before: P | None, point: P, step: float) -> P | None:
        """The point a step further; None if Newton's method does not converge, or converges too far
        from the predicted place.
        """
        guess = predicted(before, point, step)
        reach = self.corrector_radius * step
        begin, before_it = self.approached(guess, point.tangent, point, reach)
        ahead = self.solve_within(begin, point.tangent, reach, before=before_it)
        if ahead is not None and begin is not guess:
            ahead = replace(ahead, iterations=ahead.iterations + 1)
        straight = before is None or not before.curve.joins(point.curve)
        off = STEPS.off_tangent if straight else STEPS.off
        return None if ahead is None or self.norm(ahead.place - guess) >= off * step else ahead

    def turn(self, a: P, b: P) -> float:
        """The angle between the tangents, rad."""
        cosine = float(b.tangent @ (self.weights**2 * a.tangent))
        return math.acos(min(1.0, max(-1.0, cosine)))


def bordered(rows: np.ndarray, last: Any) -> np.ndarray:
    """An array (n, ...) with one more row below it; NumPy's functions for this would take longer
    than the rest of a step.
    """
    result = np.empty((len(rows) + 1, *rows.shape[1:]))
    result[:-1] = rows
    result[-1] = last
    return result


# --- the next step: its length, and the prediction of its end ----------------


@dataclass(frozen=True)
class StepSettings:
    """The control of the steps, whose lengths are in the norm of the curve."""

    # the angle between the tangents of neighbouring points that a step aims at, rad
    aim: float = 0.12
    most: float = 0.5  # the angle above which a step is taken again, shorter, rad
    # a thirtieth of the range of the parameter, or a tenth of a unit of the unknowns
    longest: float = 0.1
    first: float = 1e-3  # the length of the first step
    restart: float = 1e-3  # the largest length of the first step after the equations have changed
    # The least length of this step: steps that end at a change of equations may be extremely short,
    # as there are no solutions beyond it.
    renewed: float = 1e-6
    least: float = 1e-11  # the length below which steps have shrunk to nothing
    # the length of a step that has to be taken again, as a share of the one that failed
    shrink: float = 0.4
    # the least and the largest ratio of a step to the one before
    grow: tuple[float, float] = (0.5, 2.0)
    easy: int = 5  # iterations of the corrector up to which the next step may grow
    # after more iterations, the largest length of the next step as a share of this one
    hard: float = 0.7
    most_points: int = 20_000  # points after which the curve is given up
    # the largest ratio to the last step for which the curvature of the last step is used
    most_stretched: float = 3.0
    # the largest distance of a step's end from the predicted place, as a share of the step; farther
    # is a jump
    off: float = 0.05
    # the same share for predictions along the tangent alone, which may itself be inexact
    off_tangent: float = 0.3
    # the largest distance of a point within a step from the cubic through its ends, as a share of
    # the step
    beside: float = 0.1
    # the largest distance of the curve's first point from a step that closes it, as a share of the
    # step
    closing: float = 0.2
    # distance of a second point that gives the tangent's direction after the impacts are renumbered
    ahead: float = 1e-6

    def following(self, step: float, turn: float, iterations: int) -> float:
        """The length of the step after one that was accepted."""
        factor = min(self.grow[1], max(self.grow[0], self.aim / max(turn, 1e-3)))
        return min(
            self.longest, step * (factor if iterations <= self.easy else min(factor, self.hard))
        )


STEPS = StepSettings()


def predicted(before: Point | None, point: Point, step: float) -> np.ndarray:
    """The place a step beyond a point, on the cubic through the last two points with their
    tangents.

    Its error is of fourth order in the step. If there is no point before, or the equations have
    changed since, the place is on the tangent, with an error of second order.
    """
    if before is None or not before.curve.joins(point.curve):
        return np.asarray(point.place + step * point.tangent)
    length = arc(before, point)
    if not 0.0 < step <= STEPS.most_stretched * length:
        return np.asarray(point.place + step * point.tangent)
    ahead = np.empty(len(point.place))
    numbers = as_floats(before.place, before.tangent, point.place, point.tangent)
    arithmetic().place_ahead(*numbers, length, step, ahead)
    return ahead


def between(a: Point, b: Point, share: float) -> np.ndarray:
    """The place at a share of the way from a to b, on the cubic through both, or on their chord if
    the equations have changed.
    """
    return np.asarray(cubic(a, b)(share))


def cubic(a: Point, b: Point, index: Any = slice(None)) -> Callable[[Any], Any]:
    """`between` as a function of the share, or one component of it."""
    start = a.place[index]
    chord = b.place[index] - a.place[index]
    if not a.curve.joins(b.curve):
        return lambda share: start + share * chord
    length = arc(a, b)
    begin = length * a.tangent[index] - chord
    end = length * b.tangent[index] - chord
    return lambda share: (
        start + share * chord + share * (1.0 - share) * ((1.0 - share) * begin - share * end)
    )


def arc(a: Point, b: Point) -> float:
    """The length of the curve between two points, to the order that the cubic needs."""
    numbers = as_floats(a.curve.weights, a.place, a.tangent, b.place, b.tangent)
    return arithmetic().arc_length(*numbers)
