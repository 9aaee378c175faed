"""The prediction of the next point: on the cubic through the last two points with their tangents."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from saltus.continuation.curve import Point
from saltus.continuation.step_length import STEPS


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
