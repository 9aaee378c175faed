"""Test functions: they vanish at special points, which are located by bracketing and carry their evidence."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np

from saltus.continuation.predictor import between
from saltus.continuation.zero import Evidence, Zero


@dataclass(frozen=True)
class TestFunction:
    """A function of the points of a curve whose zeros are special points of one kind."""

    kind: str
    value: Callable[[Any], float]
    width: float = 1e-11  # of the bracket of the zero, as a share of the step; the best point found in it is nearer still


def located(test: TestFunction, a: Any, b: Any) -> Zero | None:
    """The point between a and b at which a test function goes through zero; None if the curve cannot be followed between."""
    from scipy.optimize import brentq

    chord = b.place - a.place
    direction = chord / a.curve.norm(chord)
    known = {0.0: (a, test.value(a)), 1.0: (b, test.value(b))}

    def value_at(share: float) -> float:
        if share not in known:
            point = a.curve.solve(between(a, b, share), direction)
            known[share] = (point, np.nan if point is None else test.value(point))
            if not np.isfinite(known[share][1]):
                raise ArithmeticError
        return known[share][1]

    before, after = value_at(0.0), value_at(1.0)
    if before * after > 0.0 or not np.isfinite([before, after]).all():
        return None
    try:
        brentq(value_at, 0.0, 1.0, xtol=test.width, rtol=1e-15)
    except (ArithmeticError, RuntimeError):
        return None
    point, value = min(known.values(), key=lambda pair: abs(pair[1]))
    return point.zero_type(
        test.kind, point, Evidence(point.residual, _brackets(point, before, known.values()), before, after, value)
    )


def _brackets(point: Any, before: float, known: Iterable[tuple[Any, float]]) -> tuple[float, ...]:
    """How near to a zero the test function is known to have either sign, in each parameter."""
    sides: dict[bool, list[np.ndarray]] = {True: [], False: []}
    for other, value in known:
        sides[(value > 0) == (before > 0)].append(np.abs(other.parameters - point.parameters))
    widths = np.max([np.min(side, axis=0) for side in sides.values() if side], axis=0)
    return tuple(map(float, widths))
