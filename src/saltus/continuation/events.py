"""What a problem adds to the loop of a continuation: its test functions, where equations change, and its own ends."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Generic

import numpy as np

from saltus.continuation.curve import P
from saltus.continuation.end import CurveEnd, End
from saltus.continuation.test_functions import TestFunction, Zero

if TYPE_CHECKING:
    from saltus.continuation.continuation_loop import Continuation


@dataclass(frozen=True)
class Cut(Generic[P]):
    """A point at which a step is cut short as the equations change there, and the special point that this may be."""

    point: P
    special: Zero[P] | None


class Events(Generic[P]):
    """What the problem adds to the loop. Each method may be replaced; as they are here nothing is special along a curve."""

    name = "curve"  # what the curve is called in the sentences of its ends
    keeps_special = False  # whether special points are points of the curve as well

    def accepts(self, point: P, ahead: P) -> bool:
        """Whether a step has stayed on its curve."""
        return True

    def cut(self, point: P, ahead: P) -> Cut[P] | End | None:
        """Where a step is cut short, as the equations do not hold beyond."""
        return None

    def interrupted(self, run: Continuation[P], point: P, ahead: P) -> End | None:
        """The end of the curve within a step, which is then not taken."""
        return None

    def tests(self, point: P) -> Iterable[TestFunction[P]]:
        """The test functions on the step that begins at a point."""
        return ()

    def distinct(self, found: list[Zero[P]]) -> list[Zero[P]]:
        """The special points of a step without those that are others under another name."""
        return found

    def ended(self, run: Continuation[P], ahead: P, cut: Cut[P] | None) -> End | None:
        """The end at a point that was just reached."""
        return None

    def last(self, special: Zero[P]) -> End | None:
        """The end at a special point."""
        return None

    def across(self, run: Continuation[P], cut: Cut[P]) -> P | End | None:
        """Where the curve goes on beyond a cut: at another point, or, if None, as it is."""
        return None

    def stalled(self, run: Continuation[P], point: P, step: float) -> End:
        """The end at a point from which a step so short is still too long."""
        return End(CurveEnd.NO_STEP, point.parameter, detail=self.name)

    def nearest(self, point: P, place: np.ndarray, other: P) -> np.ndarray | None:
        """A place on the equations of a point in the numbers in which it lies nearest to another point; None if it cannot."""
        return place
