"""A curve of solutions in (unknowns, parameter): its norm, its tangent, and points on it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from saltus.orbits.newton import Solution, solve, solve_along
from saltus.orbits.orbit import PeriodicOrbit
from saltus.orbits.problem import Problem

MOST_STRETCHED = 3.0  # times the last step, beyond which its curvature says nothing about the next one


@dataclass(frozen=True, eq=False)
class Curve:
    """The solutions of one problem along its first parameter, measured by a norm that depends neither on the number of impacts
    nor on the parameter's unit."""

    problem: Problem
    scale: float  # of the parameter
    symmetric: bool = False  # whether the system has the mirror symmetry all along it

    @cached_property
    def weights(self) -> np.ndarray:
        """Of the unknowns and the parameter in the norm."""
        n = self.problem.size
        return np.append(np.full(n, (2.0 / n) ** 0.5), 1.0 / self.scale)

    def norm(self, step: np.ndarray) -> float:
        """The length of a step."""
        return float(np.linalg.norm(self.weights * step))

    def solve(self, guess: np.ndarray, normal: np.ndarray) -> Point | None:
        """The point of the curve near a guess, in the hyperplane through it normal to a direction."""
        found = solve_along(self.problem, guess[:-1], guess[-1:], normal * self.weights**2, guess, iterations=7)
        return None if found is None else self.point(found, normal)

    def solve_at(self, guess: np.ndarray, normal: np.ndarray) -> Point | None:
        """The point of the curve near a guess at the parameter of the guess."""
        found = solve(self.problem, guess[:-1], guess[-1:])
        return None if found is None else self.point(found, normal)

    def point(self, solution: Solution, along: np.ndarray) -> Point | None:
        """A solution as a point, with the tangent that goes `along` a direction; None where the tangent is not unique."""
        equations = solution.equations
        matrix = np.vstack([np.column_stack([equations.jacobian(), equations.parameters[:, 0]]), along * self.weights**2])
        try:
            tangent = np.linalg.solve(matrix, np.append(np.zeros(self.problem.size), 1.0))
        except np.linalg.LinAlgError:
            return None
        length = self.norm(tangent)
        return Point(self, solution, tangent / length) if 0.0 < length < np.inf else None


@dataclass(frozen=True, eq=False)
class Point:
    """A point of a curve, and the direction in which the curve is followed there."""

    curve: Curve
    solution: Solution
    tangent: np.ndarray  # of length 1

    @cached_property
    def place(self) -> np.ndarray:
        """The unknowns and the parameter."""
        return np.append(self.solution.unknowns, self.solution.values[0])

    @property
    def parameter(self) -> float:
        """The parameter."""
        return float(self.solution.values[0])

    @cached_property
    def orbit(self) -> PeriodicOrbit:
        """The orbit."""
        return PeriodicOrbit(self.curve.problem, self.solution)

    def turned(self) -> Point:
        """The same point, followed the other way."""
        return Point(self.curve, self.solution, -self.tangent)


def predicted(before: Point | None, point: Point, step: float) -> np.ndarray:
    """Where the curve is expected to be a step further: on the cubic through the last two points with their tangents.

    Its error is of fourth order in the step, the tangent's, which is all there is at a curve's first point, of second.
    """
    straight = point.place + step * point.tangent
    if before is None or before.curve is not point.curve:
        return straight
    curve, chord = point.curve, point.place - before.place
    turn = float(curve.norm(point.tangent - before.tangent))
    length = curve.norm(chord) * (1.0 + turn**2 / 24.0)  # of the arc, to the order that the cubic needs
    if not 0.0 < step <= MOST_STRETCHED * length:
        return straight
    u = step / length
    bend = point.tangent * length - chord  # the cubic is the tangent and what bends it: of second and of third order
    twist = before.tangent * length - chord
    return np.asarray(straight + u**2 * (2.0 * bend + twist) + u**3 * (bend + twist))


def between(a: Point, b: Point, share: float) -> np.ndarray:
    """Where the curve is expected at a share of the way from a to b: on the cubic through both with their tangents."""
    if a.curve is not b.curve:
        return a.place + share * (b.place - a.place)
    chord = b.place - a.place
    length = a.curve.norm(chord) * (1.0 + float(a.curve.norm(b.tangent - a.tangent)) ** 2 / 24.0)
    start_, end = length * a.tangent - chord, length * b.tangent - chord
    rest = 1.0 - share
    return np.asarray(a.place + share * chord + share * rest * (rest * start_ - share * end))


def start(orbit: PeriodicOrbit, scale: float, symmetric: bool, upwards: bool) -> Point:
    """A known orbit as the first point of its curve, to be followed towards larger or smaller parameters."""
    curve = Curve(orbit.problem, scale, symmetric)
    direction = np.zeros(orbit.problem.size + 1)
    direction[-1] = scale if upwards else -scale
    return curve.point(orbit.solution, direction) or along_kernel(curve, orbit.solution)


def along_kernel(curve: Curve, solution: Solution) -> Point:
    """A solution as a point, its tangent from the kernel of the derivatives: where the parameter stands still, at a fold."""
    equations = solution.equations
    matrix = np.column_stack([equations.jacobian(), equations.parameters[:, 0]]) / curve.weights
    tangent = np.linalg.svd(matrix)[2][-1] / curve.weights
    return Point(curve, solution, tangent / curve.norm(tangent))
