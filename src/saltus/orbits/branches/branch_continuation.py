"""Following orbits along one parameter, through folds and grazings."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import Any

from saltus.checks import check_bounds, check_step
from saltus.continuation import STEPS, Continuation, End, Watch, both_ways
from saltus.errors import ParameterError, shown
from saltus.orbits.branches.branch import START, Branch
from saltus.orbits.branches.branch_events import BranchEvents
from saltus.orbits.branches.images import full_period, half
from saltus.orbits.branches.orbit_curve import OrbitPoint, start
from saltus.orbits.branches.special_point import SpecialKind, UserFunction
from saltus.orbits.equations.kinds import equations_of
from saltus.orbits.finding.from_motion import orbit_near
from saltus.orbits.orbit import PeriodicOrbit
from saltus.orbits.signature import Signature
from saltus.orbits.symmetry import keeps_symmetry
from saltus.progress import Progress, silent
from saltus.systems import check_along, check_path

STEP = STEPS.longest  # the longest step: a thirtieth of the parameter's range, or a tenth of a radian and of a unit of speed
# To a nearby value of the parameter a single step may go all the way, and change phases and speeds by 1.
NEARBY_STEPS = replace(STEPS, longest=1.0, first=0.1)


def continue_orbit(
    orbit: PeriodicOrbit,
    path: str,
    bounds: tuple[float, float],
    *,
    functions: dict[str, UserFunction] | None = None,
    step: float = STEP,
    while_stable: bool = False,
    progress: Progress = silent,
) -> Branch:
    """The branch of an orbit along a parameter, both ways, until it closes, reaches a bound, shrinks to rest or cannot go on.

    Parameters
    ----------
    orbit
        Where to begin, as from `find_orbit`.
    path
        Dotted path of the parameter, such as "load.frequency".
    bounds
        The least and the largest value of the parameter.
    functions
        Further functions of an orbit whose zeros are special points, by name. Zeros of the model's margins are
        found in any case.
    step
        The longest step, in the norm of `OrbitCurve`.
    while_stable
        Whether to end just beyond the loss of stability; orbits that rest for a part of their period never lose it.
    progress
        Called with the share of the range that has been seen and the value of the parameter.

    Raises
    ------
    ParameterError
        `orbit` is no orbit, the parameter is unknown, the bounds exclude the orbit, or the step is outside [1e-6, 1].

    Examples
    --------
    >>> branch = saltus.continue_orbit(orbit, "load.frequency", (0.8, 1.0))
    >>> [(str(point.kind), round(point.parameter, 6)) for point in branch.special]
    [('LP', 0.908811), ('LP', 0.848485), ('line_limit', 0.863778)]
    """
    check_step(step)
    for name, function in (functions or {}).items():
        if not callable(function):
            raise ParameterError(f"functions must be functions of an orbit, and {name!r} is {shown(function)}", "functions")
    low, high = _checked(orbit, path, bounds)
    first, steps = start(*along(orbit, path), scale=(high - low) / 3.0), replace(STEPS, longest=step)
    events = partial(BranchEvents, while_stable=while_stable)
    course = both_ways(first, lambda: events(functions or {}), {path: (low, high)}, steps, progress)
    return Branch(**vars(course), path=path)


def follow_stable(orbit: PeriodicOrbit, path: str, target: float) -> Branch:
    """The branch of a stable orbit up to a nearby value of the parameter, or to just beyond its loss of stability if that comes
    first. The steps are long, because only this outcome is asked for."""
    value = float(orbit.system.get(path))
    low, high = _checked(orbit, path, (min(value, target), max(value, target)))
    first, events = start(*along(orbit, path), scale=high - low), BranchEvents(while_stable=True)
    run = Continuation({path: (low, high)}, events, NEARBY_STEPS)
    run.follow(first if target > value else first.turned())
    return Branch(**vars(run.course(START)), path=path)


def follow_from(
    first: OrbitPoint,
    bounds: tuple[float, float],
    origin: End,
    functions: dict[str, UserFunction] | None = None,
    step: float = STEP,
    until: SpecialKind | None = None,
    progress: Progress = silent,
) -> Branch:
    """The branch that begins at a special point of another one, in the direction of its tangent."""
    path, steps = first.orbit.equations.paths[0], replace(STEPS, longest=step)
    within = {path: bounds}
    run = Continuation(within, BranchEvents(functions or {}, until), steps, Watch(progress, within, steps.most_points))
    run.follow(first, born=True)
    return Branch(**vars(run.course(origin)), path=path, origin=origin)


def _checked(orbit: PeriodicOrbit, path: str, bounds: Any) -> tuple[float, float]:
    """Bounds of a parameter that the system allows and between which the orbit lies."""
    low, high = check_bounds(bounds)
    check_path(orbit.system, path)
    value = orbit.system.get(path)
    if not low <= value <= high:
        raise ParameterError(f"the orbit has {path} = {value:g}, which is outside ({low:g}, {high:g}); widen the range", "bounds")
    check_along(orbit.system, path, (low, high), "bounds")
    return low, high


def along(orbit: PeriodicOrbit, path: str) -> tuple[PeriodicOrbit, bool]:
    """An orbit as a solution of the problem along a parameter, and whether the system keeps its mirror symmetry along it.

    A symmetric orbit is given by half of its period if the system keeps its symmetry, otherwise by all of it.
    """
    system, signature = orbit.system, orbit.signature
    symmetric = keeps_symmetry(system, path)
    equations = equations_of(system, signature, (path,))
    if equations_of(system, Signature((), 1), (path,)).passes_contact != orbit.equations.passes_contact:
        found = _in_other_equations(orbit, path)
    else:
        found = PeriodicOrbit.near(equations, orbit.solution.unknowns, equations.values)
    if found is None:
        raise ParameterError(f"the orbit does not solve its own equations to be continued along {path}; find it again", "orbit")
    if found.symmetric and not symmetric:
        found = full_period(found)
    elif symmetric:
        found = half(found) or found
    return found, symmetric


def _in_other_equations(orbit: PeriodicOrbit, path: str) -> PeriodicOrbit | None:
    """The orbit solved for again, if the parameter that is now varied decides whether its contact is a singularity."""
    position, velocity = orbit.state
    state = {orbit.system.model.coordinates[0]: position, "velocity": velocity}
    return orbit_near(equations_of(orbit.system, Signature((), 1), (path,)), state, orbit.period)
