"""Special points of any curve: zeros of test functions, with their evidence."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class Evidence:
    """The numbers that show that a special point is there.

    Attributes
    ----------
    residual
        The residual of the equations.
    brackets
        The width in each parameter within which the test function changes its sign.
    before
        The test function at the beginning of the step that contains the point.
    after
        The test function at the end of that step.
    value
        The test function at the point itself.

    Examples
    --------
    >>> fold = next(point for point in branch.special if point.kind == "LP")
    >>> fold.evidence.bracket < 1e-9, fold.evidence.before * fold.evidence.after < 0
    (True, True)
    """

    residual: float
    brackets: tuple[float, ...]
    before: float
    after: float
    value: float

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
