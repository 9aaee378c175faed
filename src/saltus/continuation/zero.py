"""Special points of any curve: zeros of test functions, with their evidence."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class Evidence:
    """The numbers that show that a special point is there.

    Examples
    --------
    >>> fold = next(point for point in branch.special if point.kind == "LP")
    >>> fold.evidence.bracket < 1e-9, fold.evidence.before * fold.evidence.after < 0
    (True, True)
    """

    residual: float  # of the equations
    brackets: tuple[float, ...]  # the width in each parameter within which the test function changes its sign
    before: float  # the test function at the beginning of the step that contains the point
    after: float  # the test function at the end of that step
    value: float  # the test function at the point itself

    @property
    def bracket(self) -> float:
        """The largest of these widths."""
        return max(self.brackets)


@dataclass(frozen=True, eq=False)
class Zero:
    """A special point of a curve: the kind of its test function, the point, and the evidence."""

    kind: str
    point: Any
    evidence: Evidence

    @property
    def parameter(self) -> float:
        """The first parameter."""
        return float(self.point.parameter)

    @property
    def parameters(self) -> tuple[float, ...]:
        """All parameters."""
        return tuple(map(float, self.point.parameters))
