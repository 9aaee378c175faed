"""A branch of periodic orbits along one parameter: its points, its special points and why it ends."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from saltus.checks import check_number
from saltus.continuation import Course, End
from saltus.notebook import html_table
from saltus.orbits.branches.orbit_curve import OrbitPoint
from saltus.orbits.branches.special_point import OrbitEnd, SpecialPoint
from saltus.orbits.orbit import PeriodicOrbit
from saltus.result import Result

if TYPE_CHECKING:
    import xarray


START = End(OrbitEnd.START)


@dataclass(frozen=True, eq=False)
class Branch(Result, Course[OrbitPoint, SpecialPoint]):
    """A branch: its points in order, its special points, and why it ends on both sides.

    Attributes
    ----------
    points
        The points in order, each with its `orbit` and its parameters.
    special
        The special points, each a `SpecialPoint`.
    ends
        Why the branch ends at its first point and at its last one.
    missed
        The special points that were noticed on the way and could not be located, each with its reason.
    path
        The dotted path of the parameter.
    origin
        Where the branch begins: at an orbit that was given, or at a special point of another branch.

    Examples
    --------
    >>> branch.ends[0].parameter, len(branch.at(0.88))
    (0.8, 3)
    """

    path: str
    origin: End = START

    @property
    def orbits(self) -> list[PeriodicOrbit]:
        """The orbits, in order."""
        return [point.orbit for point in self.points]

    @cached_property
    def amplitudes(self) -> np.ndarray:
        """max abs(theta) along it, (n,)."""
        return np.array([point.orbit.amplitude for point in self.points])

    @cached_property
    def stable(self) -> np.ndarray:
        """Whether each orbit is stable, (n,)."""
        return np.array([point.orbit.stable for point in self.points])

    def at(self, value: float) -> list[PeriodicOrbit]:
        """All orbits of the branch at a value of the parameter, solved there.

        Parameters
        ----------
        value
            The parameter's value.

        Raises
        ------
        ParameterError
            `value` is no finite number.
        """
        check_number("value", value)
        return [point.orbit for point in self.solved_at(value)]

    def to_xarray(self) -> xarray.Dataset:
        """The branch as a dataset, see `branch_dataset.py`."""
        from saltus.orbits.branches.branch_dataset import branch_dataset

        return branch_dataset(self)

    def _repr_html_(self) -> str:
        facts = {
            f"{i + 1}. {p.kind}": f"{self.path} = {p.parameter:.9g}, amplitude {p.orbit.amplitude:.6g}"
            for i, p in enumerate(self.special)
        }
        ends = {"begins": str(self.ends[0]), "ends": str(self.ends[1])}
        span = f"{self.parameters.min():.6g} to {self.parameters.max():.6g}" if len(self.points) else "none"
        return html_table(f"Branch along {self.path}", {"points": len(self.points), "from": span, **facts, **ends})

    def __repr__(self) -> str:
        kinds = ", ".join(f"{p.kind} {p.parameter:.6g}" for p in self.special)
        span = f"{self.path} from {self.parameters.min():.6g} to {self.parameters.max():.6g}" if len(self.points) else self.path
        missed = f"; not located: {', '.join(map(str, self.missed))}" if self.missed else ""
        ends = f"ends: {self.ends[0]} | {self.ends[1]}"
        return f"Branch({span}, {len(self.points)} points, special: {kinds or 'none'}; {ends}{missed})"
