"""The next step: its length, and the prediction of its end on the cubic through the last two points with their tangents."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from saltus.continuation.curve import Point


@dataclass(frozen=True)
class StepSettings:
    """The control of the steps, whose lengths are in the norm of the curve."""

    aim: float = 0.12  # the angle between the tangents of neighbouring points that a step aims at, rad
    most: float = 0.5  # the angle above which a step is taken again, shorter, rad
    longest: float = 0.1  # a thirtieth of the range of the parameter, or a tenth of a unit of the unknowns
    first: float = 1e-3  # the length of the first step
    restart: float = 1e-3  # the largest length of the first step after the equations have changed
    # The least length of this step: steps that end at a change of equations may be extremely short, as there are no solutions
    # beyond it.
    renewed: float = 1e-6
    least: float = 1e-11  # the length below which steps have shrunk to nothing
    shrink: float = 0.4  # the length of a step that has to be taken again, as a share of the one that failed
    grow: tuple[float, float] = (0.5, 2.0)  # the least and the largest ratio of a step to the one before
    easy: int = 5  # iterations of the corrector up to which the next step may grow
    hard: float = 0.7  # after more iterations, the largest length of the next step as a share of this one
    most_points: int = 20_000  # points after which the curve is given up
    most_stretched: float = 3.0  # the largest ratio to the last step for which the curvature of the last step is used
    off: float = 0.05  # the largest distance of a step's end from the predicted place, as a share of the step; farther is a jump
    off_tangent: float = 0.3  # the same share for predictions along the tangent alone, which may itself be inexact
    beside: float = 0.1  # the largest distance of a point within a step from the cubic through its ends, as a share of the step
    closing: float = 0.2  # the largest distance of the curve's first point from a step that closes it, as a share of the step
    ahead: float = 1e-6  # distance of a second point that gives the tangent's direction after the impacts are renumbered

    def following(self, step: float, turn: float, iterations: int) -> float:
        """The length of the step after one that was accepted."""
        factor = min(self.grow[1], max(self.grow[0], self.aim / max(turn, 1e-3)))
        return min(self.longest, step * (factor if iterations <= self.easy else min(factor, self.hard)))


STEPS = StepSettings()


def predicted(before: Point | None, point: Point, step: float) -> np.ndarray:
    """The place a step beyond a point, on the cubic through the last two points with their tangents.

    Its error is of fourth order in the step. If there is no point before, or the equations have changed since, the place is on
    the tangent, with an error of second order.
    """
    straight = point.place + step * point.tangent
    if before is None or not before.curve.joins(point.curve):
        return straight
    chord = point.place - before.place
    length = arc(before, point)
    if not 0.0 < step <= STEPS.most_stretched * length:
        return straight
    u = step / length
    bend = point.tangent * length - chord  # the deviation of the cubic from the tangent has terms of second and of third order
    twist = before.tangent * length - chord
    return np.asarray(straight + u**2 * (2.0 * bend + twist) + u**3 * (bend + twist))


def between(a: Point, b: Point, share: float) -> np.ndarray:
    """The place at a share of the way from a to b, on the cubic through both, or on their chord if the equations have changed."""
    return np.asarray(cubic(a, b)(share))


def cubic(a: Point, b: Point, index: Any = slice(None)) -> Callable[[Any], Any]:
    """`between` as a function of the share, or one component of it."""
    start, chord = a.place[index], b.place[index] - a.place[index]
    if not a.curve.joins(b.curve):
        return lambda share: start + share * chord
    length = arc(a, b)
    begin, end = length * a.tangent[index] - chord, length * b.tangent[index] - chord
    return lambda share: start + share * chord + share * (1.0 - share) * ((1.0 - share) * begin - share * end)


def arc(a: Point, b: Point) -> float:
    """The length of the curve between two points, to the order that the cubic needs."""
    turn = float(a.curve.norm(b.tangent - a.tangent))
    return float(a.curve.norm(b.place - a.place) * (1.0 + turn**2 / 24.0))
