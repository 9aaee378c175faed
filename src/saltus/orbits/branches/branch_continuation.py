"""Following orbits along one parameter, through folds and grazings, and from there the branches
that are born on the way.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from saltus.checks import check_bounds, check_step
from saltus.continuation import STEPS, Continuation, End, Watch, both_ways
from saltus.errors import ParameterError, shown
from saltus.flow import unit_of
from saltus.orbits.beyond.orbit_curve import OrbitPoint, start
from saltus.orbits.beyond.rest import as_the_motion_goes_on
from saltus.orbits.beyond.special_point import OrbitEnd, SpecialKind, SpecialPoint, UserFunction
from saltus.orbits.beyond.symmetry import divide, full_period, half, keeps_symmetry
from saltus.orbits.branches.begun_at_special import from_a_change, with_special_start
from saltus.orbits.branches.branch import START, Branch
from saltus.orbits.branches.branch_events import (
    BranchEvents,
    ended_where_grazings_accumulate,
    restarted,
)
from saltus.orbits.contract.equations import OrbitEquations
from saltus.orbits.equations.cycles import PERIOD
from saltus.orbits.equations.kinds import equations_of
from saltus.orbits.finding.from_motion import orbit_near
from saltus.orbits.orbit import PeriodicOrbit
from saltus.orbits.signature import TOLERANCES, Signature
from saltus.progress import Progress, silent
from saltus.result import Result, result_dataset
from saltus.systems import check_along, check_path, driven_displacement

if TYPE_CHECKING:
    import xarray

# the longest step: a thirtieth of the parameter's range, or a tenth of a radian and of a unit of
# speed
STEP = STEPS.longest
# To a nearby value of the parameter a single step may go all the way, and change phases and speeds
# by 1.
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
    growing: Callable[[Branch], object] | None = None,
) -> Branch:
    """The branch of an orbit along a parameter, both ways, until it closes, reaches a bound,
    shrinks to rest or cannot go on.

    Parameters
    ----------
    orbit
        Where to begin, as from `find_orbit`.
    path
        Dotted path of the parameter, such as "load.frequency"; or "period" for the family of cycles
        of a system without loss and without a load.
    bounds
        The least and the largest value of the parameter.
    functions
        Further functions of an orbit whose zeros are special points, by name. Zeros of the model's
        margins are found in any case.
    step
        The longest step, in the norm of `OrbitCurve`.
    while_stable
        Whether to end just beyond the loss of stability; orbits that rest for a part of their
        period never lose it.
    progress
        Called with the share of the range that has been seen and the value of the parameter.
    growing
        Called with the branch so far, which has no special points yet, at each new orbit, and with
        the whole branch at the end.

    Raises
    ------
    ParameterError
        `orbit` is none, or not `isolated`; the parameter is unknown, the bounds exclude the orbit,
        or the step is outside [1e-6, 1].

    Examples
    --------
    >>> branch = saltus.continue_orbit(orbit, "load.frequency", (0.8, 1.0))
    >>> [(str(point.kind), round(point.parameter, 6)) for point in branch.special]
    [('LP', 0.908811), ('LP', 0.848485), ('line_limit', 0.863778)]
    """
    check_step(step)
    for name, function in (functions or {}).items():
        if not callable(function):
            raise ParameterError(
                f"functions must be functions of an orbit, and {name!r} is {shown(function)}",
                "functions",
            )
    if path == PERIOD:
        begun = _of_family(orbit)
        low, high = check_bounds(bounds)
        _check_inside(path, begun.duration / begun.signature.period, low, high)
        first = start(begun, False, scale=(high - low) / 3.0)
    else:
        low, high = _checked(orbit, path, bounds)
        first = start(*along(orbit, path), scale=(high - low) / 3.0)
    steps = replace(STEPS, longest=step)
    events = partial(BranchEvents, while_stable=while_stable)
    show = growing or _unseen
    first, cut = from_a_change(first)
    unfinished = End(OrbitEnd.GROWING)

    def grown(points: tuple[OrbitPoint, ...]) -> None:
        show(Branch(points, (), (unfinished, unfinished), (), path))

    course = both_ways(
        first,
        lambda: events(functions or {}),
        {path: (low, high)},
        steps,
        progress,
        growing and grown,
        cut,
    )
    course = replace(course, special=with_special_start(course, first, events(functions or {})))
    course = ended_where_grazings_accumulate(course, first)
    branch = Branch(**vars(course), path=path)
    recounted = _of_doubled_rounds(orbit, branch)
    if recounted is not None:
        return continue_orbit(
            recounted,
            path,
            bounds,
            functions=functions,
            step=step,
            while_stable=while_stable,
            progress=progress,
            growing=growing,
        )
    show(branch)
    return branch


def _of_doubled_rounds(orbit: PeriodicOrbit, branch: Branch) -> PeriodicOrbit | None:
    """A cycle without a load with its round counted as two, if its branch turns back where it
    repeats itself after half a round: it is born there by period doubling. Else None.
    """
    counted = orbit.equations.counted_twice(orbit.solution)
    if counted is None or not any(
        point.kind is SpecialKind.LP and _repeats_halves(point.orbit) for point in branch.special
    ):
        return None
    return PeriodicOrbit.near(*counted, orbit.solution.values)


def _repeats_halves(orbit: PeriodicOrbit) -> bool:
    """Whether a cycle has the same state after half a round."""
    motion = orbit.followed
    states = [
        np.concatenate([np.atleast_1d(part) for part in motion.at(time)])
        for time in (motion.start, motion.start + 0.5 * orbit.duration / orbit.signature.period)
    ]
    apart = (states[1] - states[0]) / orbit.equations.natural.state
    return bool(np.abs(apart).max() < TOLERANCES.grazing_orbits)


def _unseen(branch: Branch) -> None:
    """What a branch is given to that nobody watches."""


def follow_stable(orbit: PeriodicOrbit, path: str, target: float) -> Branch:
    """The branch of a stable orbit up to a nearby value of the parameter, or to just beyond its
    loss of stability if that comes first. The steps are long, because only this outcome is asked
    for."""
    value = float(orbit.system.get(path))
    low, high = _checked(orbit, path, (min(value, target), max(value, target)))
    first = start(*along(orbit, path), scale=high - low)
    events = BranchEvents(while_stable=True)
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
    path = first.orbit.equations.paths[0]
    steps = replace(STEPS, longest=step)
    within = {path: bounds}
    run = Continuation(
        within,
        BranchEvents(functions or {}, until),
        steps,
        Watch(progress, within, steps.most_points),
    )
    run.follow(first, born=True)
    return Branch(**vars(run.course(origin)), path=path, origin=origin)


def _checked(orbit: PeriodicOrbit, path: str, bounds: Any) -> tuple[float, float]:
    """Bounds of a parameter that the system allows and between which the orbit lies."""
    low, high = check_bounds(bounds)
    check_path(orbit.system, path)
    _check_inside(path, orbit.system.get(path), low, high)
    check_along(orbit.system, path, (low, high), "bounds")
    return low, high


def _check_inside(path: str, value: float, low: float, high: float) -> None:
    if not low <= value <= high:
        raise ParameterError(
            f"the orbit has {path} = {value:g}, which is outside ({low:g}, {high:g}); widen the"
            " range",
            "bounds",
        )


def _of_family(orbit: PeriodicOrbit) -> PeriodicOrbit:
    """A cycle of a system without loss as one of its family, along the period."""
    found = PeriodicOrbit.near(*orbit.equations.family(orbit.solution))
    if orbit.isolated and orbit.equations.paths != (PERIOD,):
        raise ParameterError(
            "the cycle has no others beside it with other periods, as its system has a loss or"
            " gains energy; follow it along a parameter of the model",
            "path",
        )
    if found is None:
        raise ParameterError(
            "the orbit does not satisfy the equations of its family; find it again", "orbit"
        )
    return found


def along(orbit: PeriodicOrbit, path: str) -> tuple[PeriodicOrbit, bool]:
    """An orbit as a solution of the problem along a parameter, and whether the system keeps its
    mirror symmetry along it.

    A symmetric orbit is given by half of its period if the system keeps its symmetry, otherwise by
    all of it.
    """
    system = orbit.system
    signature = orbit.signature
    symmetric = keeps_symmetry(system, path)
    equations = equations_of(system, signature, (path,))
    if (
        equations_of(system, Signature((), 1), (path,)).passes_contact
        != orbit.equations.passes_contact
    ):
        found = _in_other_equations(orbit, path)
    else:
        found = PeriodicOrbit.near(equations, orbit.solution.unknowns, equations.values)
    if found is None:
        raise ParameterError(
            f"the orbit does not satisfy its equations along {path}; find it again",
            "orbit",
        )
    if found.symmetric and not symmetric:
        found = full_period(found)
    elif symmetric:
        found = half(found) or found
    if not found.isolated:
        # the last orbit of a family of longer periods is its parent's
        found = divide(found) or found
        found = (half(found) if symmetric else None) or found
    if not found.isolated:
        raise ParameterError(
            "the orbit is not isolated, as a free mass has others beside it at the same "
            "parameters: these form no branch; begin with an orbit on which the mass is in "
            "contact or is hit",
            "orbit",
        )
    return found, symmetric


def _in_other_equations(orbit: PeriodicOrbit, path: str) -> PeriodicOrbit | None:
    """The orbit solved for again, if the parameter that is now varied decides whether its contact
    is a singularity.
    """
    position, velocity = orbit.state
    state = {orbit.system.model.coordinates[0]: position, "velocity": velocity}
    return orbit_near(
        equations_of(orbit.system, Signature((), 1), (path,)), state, orbit.signature.period
    )


MOST_DOUBLED = 64  # forcing periods of an orbit: periods double six times


def switch_branch(
    special: SpecialPoint,
    bounds: tuple[float, float],
    *,
    functions: dict[str, UserFunction] | None = None,
    step: float = STEP,
    both: bool = True,
    progress: Progress = silent,
) -> tuple[Branch, ...]:
    """The branches that begin at a special point of another branch.

    At a PD this is the branch of the doubled orbit. At a BPC these are the branches of the two
    unsymmetric orbits, which are mirror images of one another. Where two branches cross, they are
    the two halves of the other branch. Beyond a CH it is the branch of the orbits on which the
    motion settles there, if there are any.

    Parameters
    ----------
    special
        Where to begin.
    bounds, functions, step
        As for `continue_orbit`.
    both
        Whether both of two branches of mirror images are followed, whose orbits differ in phase and
        sign only.
    progress
        Called at every point with the fraction of the range that is done.

    Raises
    ------
    ParameterError
        No branch begins at this special point.

    Examples
    --------
    >>> unsymmetric = system.with_({"load.horizontal.amplitude": 1.4})
    >>> one = saltus.find_orbit(unsymmetric, theta=0.3)
    >>> path = saltus.continue_orbit(one, "load.horizontal.amplitude", (1.35, 1.55))
    >>> breaking = next(point for point in path.special if point.kind == "BPC")
    >>> [new.orbits[-1].symmetric for new in saltus.switch_branch(breaking, (1.35, 1.55))]
    [False, False]
    """
    check_step(step)
    bounds = check_bounds(bounds)
    if special.kind not in (SpecialKind.PD, SpecialKind.BPC, SpecialKind.CH):
        raise ParameterError(
            f"no branch begins at a {special.kind}; switch at a PD, a BPC or a CH (grazings are"
            " gone through anyway)",
            "special",
        )
    if special.kind == SpecialKind.PD:
        starts: tuple[OrbitPoint | None, ...] = (_doubled(special.point),)
    elif special.kind == SpecialKind.CH:
        starts = (restarted(as_the_motion_goes_on(special.point), special.point),)
    elif special.orbit.symmetric:
        starts = _unsymmetric(special.point)[: 2 if both else 1]
    else:
        starts = _crossing_branch(special.point)
    origin = _origin(special)
    begun = [start for start in starts if start is not None]
    return tuple(
        follow_from(start, bounds, origin, functions, step, progress=progress) for start in begun
    )


def _origin(special: SpecialPoint) -> End:
    return End(OrbitEnd.BORN, special.parameter, special.kind)


def _kernel(point: OrbitPoint) -> np.ndarray:
    """The perturbation of the unknowns that returns with the other sign after a (half) period."""
    equations = point.orbit.equations
    rows = equations.in_units(point.evaluation.jacobian(-1.0))
    return np.asarray(np.linalg.svd(rows)[2][-1] * equations.units.unknowns)


def _doubled(point: OrbitPoint) -> OrbitPoint | None:
    """The orbit gone round twice, and the direction in which the two rounds differ."""
    equations = point.orbit.equations
    signature = point.orbit.signature
    if 2 * signature.period > MOST_DOUBLED:
        return None
    direction = equations.alternating(_kernel(point))
    return _along(
        point,
        equations.with_signature(signature.repeated()),
        equations.repeated(point.solution.unknowns),
        direction,
    )


def _unsymmetric(point: OrbitPoint) -> tuple[OrbitPoint | None, ...]:
    """The symmetric orbit over its full period, and the two directions in which its halves
    differ.
    """
    orbit = full_period(point.orbit)
    direction = point.orbit.equations.alternating(_kernel(point))
    return tuple(
        _along(point, orbit.equations, orbit.solution.unknowns, sign * direction)
        for sign in (1.0, -1.0)
    )


def _along(
    point: OrbitPoint, equations: OrbitEquations, unknowns: np.ndarray, direction: np.ndarray
) -> OrbitPoint | None:
    """The first point of the new branch, to be followed in a direction of the unknowns."""
    curve = point.curve.with_equations(equations)
    tangent = np.append(direction, 0.0)
    known = curve.known(unknowns, point.parameters)
    return None if known is None else curve.point_at(known, tangent / curve.norm(tangent))


def _crossing_branch(point: OrbitPoint) -> tuple[OrbitPoint | None, ...]:
    """The two halves of the other branch at a crossing: both ways along the direction in the
    two-dimensional kernel that is orthogonal to the branch's own."""
    curve = point.curve
    own = point.tangent * curve.weights
    rows = point.evaluation.derivatives() / np.reshape(curve.units.residuals, (-1, 1))
    kernel = np.linalg.svd(rows / curve.weights)[2][-2:]
    other = kernel[int(np.argmin(np.abs(kernel @ own)))]
    other = other - (other @ own) * own
    tangent = other / curve.weights
    first = replace(point, tangent=tangent / curve.norm(tangent))
    return first, first.turned()


@dataclass(frozen=True)
class Cascade(Result):
    """A cascade of period doublings, with the ratios of their distances, which tend to Feigenbaum's
    4.6692.

    Attributes
    ----------
    points
        The period doublings, in order.

    Examples
    --------
    >>> [field for field in ("parameters", "ratios") if hasattr(saltus.orbits.Cascade, field)]
    ['parameters', 'ratios']
    """

    points: tuple[SpecialPoint, ...]

    @property
    def parameters(self) -> np.ndarray:
        """The parameters at which the period doubles, from q to 2 q, 4 q, ..."""
        return np.array([point.parameter for point in self.points])

    @property
    def periods(self) -> np.ndarray:
        """The periods of the orbits that double."""
        return np.array([point.orbit.signature.period for point in self.points])

    @property
    def ratios(self) -> np.ndarray:
        """(p_{n+1} - p_n) / (p_{n+2} - p_{n+1})."""
        steps = np.diff(self.parameters)
        return np.asarray(steps[:-1] / steps[1:])

    def to_xarray(self) -> xarray.Dataset:
        """`parameter`, `period` and `amplitude` of the doublings over `doubling`, and their `ratio`
        over `step`.
        """
        orbit = self.points[0].orbit
        path = self.points[0].orbit.equations.paths[0]
        name = driven_displacement(orbit.equations.given)
        amplitudes = [point.amplitude for point in self.points]
        columns: dict[str, tuple[Any, ...]] = {
            "parameter": ("doubling", self.parameters, "1", path),
            "period": ("doubling", self.periods, "1", "forcing periods of the orbits that double"),
            "amplitude": (
                "doubling",
                amplitudes,
                unit_of(orbit.equations.given, name),
                f"max abs({name})",
            ),
            "ratio": (
                "step",
                self.ratios,
                "1",
                "(p_{n+1} - p_n) / (p_{n+2} - p_{n+1}), which tends to 4.6692",
            ),
        }
        return result_dataset("cascade", columns, None, orbit.system, path=path)


def doubling_cascade(
    first: SpecialPoint, bounds: tuple[float, float], *, max_period: int = 32, step: float = STEP
) -> Cascade:
    """The period doublings that follow a first one, each on the branch born at its predecessor, up
    to `max_period` forcing periods.

    The cascade ends earlier if a doubled branch has no further doubling within the bounds.

    Parameters
    ----------
    first
        The first period doubling (PD).
    bounds
        The values of the parameter between which branches are followed.
    max_period
        The longest period, in forcing periods.
    step
        The longest step along a branch.

    Raises
    ------
    ParameterError
        The special point is no PD.

    Examples
    --------
    >>> unsymmetric = system.with_({"load.horizontal.amplitude": 1.6})
    >>> one = saltus.find_orbit(unsymmetric, theta=0.3)
    >>> path = saltus.continue_orbit(one, "load.horizontal.amplitude", (1.55, 1.75))
    >>> first = next(point for point in path.special if point.kind == "PD")
    >>> saltus.doubling_cascade(first, (1.6, 1.8), max_period=4).parameters.round(6)
    array([1.684394, 1.742241, 1.750439])
    """
    check_step(step)
    if first.kind != SpecialKind.PD:
        raise ParameterError(f"a cascade begins at a PD, not at a {first.kind}", "first")
    bounds, points = check_bounds(bounds), [first]
    while 2 * points[-1].orbit.signature.period <= max_period:
        start = _doubled(points[-1].point)
        if start is None:
            break
        branch = follow_from(start, bounds, _origin(points[-1]), None, step, until=SpecialKind.PD)
        if branch.ends[1].reason is not OrbitEnd.FIRST:
            break
        points.append(branch.special[-1])
    return Cascade(tuple(points))
