"""A branch of periodic orbits along one parameter, followed through folds and grazings."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from saltus.checks import check_bounds
from saltus.errors import ParameterError
from saltus.orbits.newton import solve
from saltus.orbits.orbit import PeriodicOrbit
from saltus.orbits.path import Point, start
from saltus.orbits.problem import Problem
from saltus.orbits.resting import RestingOrbit
from saltus.orbits.special import SpecialPoint, UserFunction
from saltus.orbits.symmetry import half, keeps_symmetry, whole
from saltus.orbits.walk import CLOSED, STEP, UNSTABLE, Walk

if TYPE_CHECKING:
    import xarray


NEARBY = 1.0  # the longest step towards a value not far away, of the way there and of the units of the phases and the speeds


@dataclass(frozen=True, eq=False)
class Branch:
    """A branch: its points in order, the special ones among them, and why it ends on both sides."""

    path: str
    points: tuple[Point, ...]
    special: tuple[SpecialPoint, ...]
    ends: tuple[str, str]
    origin: str = "start"  # what it was begun from: a start, or the special point of another branch
    missed: tuple[str, ...] = ()  # special points whose test function changed its sign where no zero was found

    @property
    def orbits(self) -> list[PeriodicOrbit]:
        """The orbits, in order."""
        return [point.orbit for point in self.points]

    @cached_property
    def parameters(self) -> np.ndarray:
        """The parameter along it, (n,)."""
        return np.array([point.parameter for point in self.points])

    @cached_property
    def amplitudes(self) -> np.ndarray:
        """max abs(theta) along it, (n,)."""
        return np.array([point.orbit.amplitude for point in self.points])

    @cached_property
    def stable(self) -> np.ndarray:
        """Whether each orbit is stable, (n,)."""
        return np.array([point.orbit.stable for point in self.points])

    @property
    def closed(self) -> bool:
        """Whether it is a loop."""
        return self.ends == (CLOSED, CLOSED)

    def at(self, value: float) -> list[PeriodicOrbit]:
        """All orbits of the branch at a value of the parameter, solved there."""
        found = []
        for a, b in zip(self.points, self.points[1:], strict=False):
            if (
                a.curve.problem is not b.curve.problem
                or (a.parameter - value) * (b.parameter - value) > 0
                or b.parameter == value
            ):
                continue
            share = (value - a.parameter) / (b.parameter - a.parameter)
            point = a.curve.solve_at(a.place + share * (b.place - a.place), a.tangent)
            found += [] if point is None else [point.orbit]
        if self.points and self.points[-1].parameter == value:
            found.append(self.points[-1].orbit)
        return found

    def to_xarray(self) -> xarray.Dataset:
        """The branch as a dataset, see `dataset.py`."""
        from saltus.orbits.branch_dataset import branch_dataset

        return branch_dataset(self)

    def __repr__(self) -> str:
        kinds = ", ".join(f"{p.kind} {p.parameter:.6g}" for p in self.special)
        span = f"{self.path} from {self.parameters.min():.6g} to {self.parameters.max():.6g}" if len(self.points) else self.path
        missed = f"; not located: {', '.join(self.missed)}" if self.missed else ""
        ends = f"ends: {self.ends[0]} | {self.ends[1]}"
        return f"Branch({span}, {len(self.points)} points, special: {kinds or 'none'}; {ends}{missed})"


def continue_orbit(
    orbit: PeriodicOrbit,
    path: str,
    bounds: tuple[float, float],
    *,
    functions: dict[str, UserFunction] | None = None,
    step: float = STEP,
    progress: Callable[[float], object] | None = None,
) -> Branch:
    """The branch of an orbit along a parameter, both ways, until it closes, reaches a bound, shrinks to rest or cannot go on.

    Args:
        orbit: where to begin, as from `find_orbit`.
        path: dotted path of the parameter, such as "load.frequency".
        bounds: the least and the largest value of the parameter.
        functions: further functions of an orbit whose zeros are special points, by name. Those of the model's margins are
            found anyway.
        step: the longest step, in the norm of `path.py`.
        progress: called with the parameter of each new point.

    Raises:
        ParameterError: an unknown parameter, bounds that exclude the orbit.
    """
    low, high = _checked(orbit, path, bounds)
    if isinstance(orbit, RestingOrbit):
        from saltus.orbits.resting_branch import continue_resting  # which gives a Branch

        return continue_resting(orbit, path, (low, high), functions or {}, step, progress)
    begin, symmetric = along(orbit, path)
    scale = (high - low) / 3.0
    walks = []
    for upwards in (False, True):
        walk = Walk((low, high), functions or {}, step, progress)
        first = start(begin, scale, symmetric, upwards)
        if (first.parameter <= low and not upwards) or (first.parameter >= high and upwards):
            walk.points, walk.reason = [first], f"bound {first.parameter:g}"
        else:
            walk.follow(first)
        walks.append(walk)
        if walk.reason == CLOSED:
            return Branch(path, tuple(walk.points), tuple(walk.special), (CLOSED, CLOSED), missed=tuple(walk.missed))
    back, ahead = walks
    points = [point.turned() for point in reversed(back.points[1:])] + ahead.points
    return Branch(
        path,
        tuple(points),
        (*reversed(back.special), *ahead.special),
        (back.reason, ahead.reason),
        missed=(*back.missed, *ahead.missed),
    )


def follow_stable(orbit: PeriodicOrbit, path: str, target: float) -> Branch:
    """The branch of a stable orbit towards a value of the parameter not far away, up to there or to just beyond the loss of
    its stability; in long steps, to find that out."""
    value = float(orbit.system.get(path))
    low, high = _checked(orbit, path, (min(value, target), max(value, target)))
    if isinstance(orbit, RestingOrbit):
        from saltus.orbits.resting_branch import continue_resting

        branch = continue_resting(orbit, path, (low, high), {}, NEARBY, None)
        if target > value:
            return branch
        return replace(branch, points=branch.points[::-1], special=branch.special[::-1], ends=(branch.ends[1], branch.ends[0]))
    begin, symmetric = along(orbit, path)
    walk = Walk((low, high), {}, NEARBY, None, UNSTABLE)
    walk.follow(start(begin, high - low, symmetric, target > value), step=0.1 * NEARBY)
    return Branch(path, tuple(walk.points), tuple(walk.special), ("start", walk.reason), missed=tuple(walk.missed))


def follow_from(
    first: Point,
    path: str,
    bounds: tuple[float, float],
    origin: str,
    functions: dict[str, UserFunction] | None = None,
    step: float = STEP,
    until: str | None = None,
) -> Branch:
    """The branch that begins at a special point of another one, in the direction of its tangent."""
    walk = Walk(bounds, functions or {}, step, None, until)
    walk.follow(first, born=True)
    return Branch(path, tuple(walk.points), tuple(walk.special), (origin, walk.reason), origin, tuple(walk.missed))


def _checked(orbit: PeriodicOrbit, path: str, bounds: Any) -> tuple[float, float]:
    """Bounds of a parameter that the system allows and between which the orbit lies."""
    low, high = check_bounds(bounds)
    value = orbit.system.get(path) if path in orbit.system.parameters else None
    if value is None:
        orbit.system.get(path)  # refuses what leads nowhere
        raise ParameterError(f"{path} is not a number, so an orbit cannot be continued along it")
    if not low <= value <= high:
        raise ParameterError(f"the orbit has {path} = {value:g}, which is outside ({low:g}, {high:g}); widen the range")
    for bound in (low, high):
        orbit.system.with_({path: bound})  # refuses bounds beyond what the system allows
    return low, high


def along(orbit: PeriodicOrbit, path: str) -> tuple[PeriodicOrbit, bool]:
    """An orbit as a solution of the problem along a parameter, halved where it and the system are and stay symmetric."""
    system, signature = orbit.system, orbit.signature
    symmetric = keeps_symmetry(system, path)
    problem = Problem(system, signature, (path,))
    found = solve(problem, orbit.solution.unknowns, problem.values)
    if found is None:
        raise ParameterError(f"the orbit does not solve its own equations to be continued along {path}; find it again")
    if signature.symmetric and not symmetric:
        problem, found = whole(problem, found)
    elif symmetric and not signature.symmetric:
        problem, found = half(problem, found) or (problem, found)
    return PeriodicOrbit(problem, found), symmetric
