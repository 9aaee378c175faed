"""Points of a curve, between two others, at which one component of the place has a given value; points of other curves
excluded."""

from __future__ import annotations

from typing import Any

import numpy as np

from saltus.continuation.predictor import between, cubic
from saltus.continuation.step_length import STEPS
from saltus.continuation.test_functions import TestFunction, located


def solved_between(a: Any, b: Any, index: int, value: float) -> list[Any]:
    """The points from a up to before b at which the component `index` of the place has a value, solved there.

    Each lies near the cubic through a and b. If Newton's method at this value leads to another solution, the curve is followed to
    the value first.
    """
    found = []
    for first, last in _rising_parts(a, b, index):
        start, end = first.place[index] - value, last.place[index] - value
        if end == 0.0 or start * end > 0.0:
            continue
        point = first if start == 0.0 else _solved(first, last, index, value)
        found += [] if point is None else [point]
    return found


def _rising_parts(a: Any, b: Any, index: int) -> list[tuple[Any, Any]]:
    """The way from a to b, divided at the extremum of a component of the place."""
    turn = turning_point(a, b, index)
    return [(a, b)] if turn is None else [(a, turn), (turn, b)]


def turning_point(a: Any, b: Any, index: int) -> Any:
    """The point near which a component of the place has an extremum between a and b; None if it has none."""
    if not a.tangent[index] * b.tangent[index] < 0.0:
        return None
    shares = np.linspace(0.0, 1.0, 33)
    values = cubic(a, b, index)(shares)
    place = int(np.argmax(values) if a.tangent[index] > 0.0 else np.argmin(values))
    return None if place in (0, len(shares) - 1) else _at_share(a, b, float(shares[place]))


def _solved(a: Any, b: Any, index: int, value: float) -> Any:
    """The point between a and b at which a component that is monotonic between them has a value; None if it cannot be found."""
    share = _share(a, b, index, value)
    point = _near(a, b, between(a, b, share), index, value)
    if point is not None:
        return point
    zero = located(TestFunction("value", lambda other: other.place[index] - value), a, b)
    if zero is None:
        return None
    return _near(a, b, zero.point.place, index, value)


def _near(a: Any, b: Any, guess: np.ndarray, index: int, value: float) -> Any:
    """The solution at a value, near to a guess and with a tangent along a to b; None if Newton's method finds another one."""
    guess = guess.copy()
    guess[index] = value
    chord = b.place - a.place
    point, length = a.curve.solve_at(guess, chord, index), a.curve.norm(chord)
    if point is None or a.curve.norm(point.place - guess) > STEPS.beside * length:
        return None
    return point if max(a.curve.turn(a, point), a.curve.turn(point, b)) < STEPS.most else None


def _at_share(a: Any, b: Any, share: float) -> Any:
    """The point at a share of the way."""
    chord = b.place - a.place
    return a.curve.solve(between(a, b, share), chord / a.curve.norm(chord))


def _share(a: Any, b: Any, index: int, value: float) -> float:
    """The share of the way at which the cubic has the value, by bisection."""
    low, high, component = 0.0, 1.0, cubic(a, b, index)
    below = a.place[index] < value
    while high - low > 1e-9:
        middle = 0.5 * (low + high)
        if (component(middle) < value) == below:
            low = middle
        else:
            high = middle
    return 0.5 * (low + high)
