"""The part of a continuation that depends on the problem: its test functions, changes of its equations, and its own ends."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from saltus.continuation.curve import Zero
from saltus.continuation.end import CurveEnd, End
from saltus.continuation.test_functions import TestFunction, located

if TYPE_CHECKING:
    from saltus.continuation.continuation_loop import Continuation


@dataclass(frozen=True)
class Cut:
    """A point at which a step is cut short because the equations change there, and the special point there, if it is one."""

    point: Any
    special: Zero | None


class Events:
    """The hooks of the loop for a problem. Subclasses replace some methods; with those given here a curve has no events."""

    name = "curve"  # what the curve is called in the sentences of its ends
    keeps_special = False  # whether special points are points of the curve as well

    def accepts(self, point: Any, ahead: Any) -> bool:
        """Whether a step has stayed on its curve."""
        return True

    def barrier(self, point: Any) -> TestFunction | None:
        """A function that is negative where the equations of a point do not hold; its zeros are special points too."""
        return None

    def cut(self, point: Any, ahead: Any) -> Cut | End | None:
        """The cut of a step beyond which its equations do not hold, by default at the zero of the barrier; None without one."""
        barrier = self.barrier(point)
        if barrier is None or barrier.value(ahead) >= 0.0:
            return None
        zero = located(barrier, point, ahead)
        return End(CurveEnd.NOT_LOCATED, ahead.parameter, barrier.kind) if zero is None else Cut(zero.point, zero)

    def interrupted(self, run: Continuation, point: Any, ahead: Any) -> End | None:
        """The end of the curve if it ends within a step, which is then not taken; else None."""
        return None

    def tests(self, point: Any) -> Iterable[TestFunction]:
        """The test functions for the step that begins at a point."""
        return ()

    def outside(self, point: Any) -> int | None:
        """A count that changes at special points only, as of multipliers outside the unit circle; None where it has none."""
        return None

    def distinct(self, found: list[Zero]) -> list[Zero]:
        """The special points of a step, each once, as one point may be the zero of two test functions."""
        return found

    def ended(self, run: Continuation, ahead: Any, cut: Cut | None) -> End | None:
        """The end of the curve if it ends at a point that was just reached; else None."""
        return None

    def last(self, special: Zero) -> End | None:
        """The end of the curve if it ends at a special point that was just located; else None."""
        return None

    def across(self, run: Continuation, cut: Cut) -> Any:
        """The point with which the curve goes on beyond a cut, or an end; None if it goes on with the same equations."""
        return None

    def first_step(self, points: Sequence[Any]) -> float:
        """The longest first step after a change of equations; the last of the points is the first that solves the new ones."""
        return math.inf

    def stalled(self, run: Continuation, point: Any, step: float) -> Cut | End:
        """The end of the curve at a point from which even the shortest step fails, or the cut beyond which it goes on."""
        return End(CurveEnd.NO_STEP, point.parameter, detail=self.name)

    def nearest(self, point: Any, place: np.ndarray, other: Any) -> np.ndarray | None:
        """A place that solves the equations of `point`, in the unknowns that are nearest to those of `other`; None if the two
        cannot be compared."""
        return place

    def closing(self, first: Any, ahead: Any) -> Any:
        """The first point of a curve that closes, in the equations that the curve has when it returns, if that is possible."""
        return first
