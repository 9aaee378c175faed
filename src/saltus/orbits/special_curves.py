"""Curves of special points in two parameters: the borders between regions with other numbers of orbits, or of other stability."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from saltus.checks import check_bounds
from saltus.errors import ParameterError
from saltus.orbits.codimension import CodimensionTwo, located, room, tests_of
from saltus.orbits.conditions import Condition, Singular, Slow, matrix
from saltus.orbits.find import divide
from saltus.orbits.grazing import TOGETHER, inserted
from saltus.orbits.newton import Solution
from saltus.orbits.orbit import TOUCH
from saltus.orbits.problem import Problem
from saltus.orbits.resting import RestingOrbit
from saltus.orbits.signature import Signature
from saltus.orbits.special import SpecialPoint
from saltus.orbits.special_curve import CLOSED, Locus, LocusPoint, Plane
from saltus.orbits.symmetry import half, keeps_symmetry
from saltus.orbits.walk import ANGLE, FAR, FIRST_STEP, LEAST_STEP, MOST_POINTS, SHARPEST, SMALLEST, STEP, separation

FOLLOWED = ("LP", "PD", "BPC", "GR")
TENFOLD = 10.0  # a parameter without bounds is followed to so many times its value, and to that part of it


@dataclass
class _Walk:
    """One direction of a curve while it is being followed."""

    kind: str
    bounds: np.ndarray  # (2, 2): of each parameter, the least and the largest value
    longest: float
    progress: Callable[[tuple[float, float]], object] | None
    points: list[LocusPoint] = field(default_factory=list)
    special: list[CodimensionTwo] = field(default_factory=list)
    reason: str = ""

    def follow(self, first: LocusPoint) -> None:
        """Follow the curve from a point until it ends."""
        self.points.append(first)
        step = min(FIRST_STEP, self.longest)
        while not self.reason:
            ahead, step = self._step(self.points[-1], step)
            if ahead is not None:
                self._take(self.points[-1], ahead)
            if len(self.points) > MOST_POINTS:
                self.reason = f"more than {MOST_POINTS} points"

    def _step(self, point: LocusPoint, step: float) -> tuple[LocusPoint | None, float]:
        """The next point, and the length of the step after it."""
        weights = point.curve.weights
        while step > LEAST_STEP:
            ahead = point.near(point.place + step * point.tangent, point.tangent)
            if ahead is not None and point.curve.norm(ahead.place - point.place - step * point.tangent) < FAR * step:
                angle = math.acos(min(1.0, max(-1.0, float(ahead.tangent @ (weights**2 * point.tangent)))))
                if angle < SHARPEST:
                    factor = min(2.0, max(0.5, ANGLE / max(angle, 1e-3)))
                    return ahead, min(self.longest, step * (factor if ahead.solution.iterations <= 5 else min(factor, 0.7)))
            step *= 0.4
        self.reason = "the steps shrink to nothing: the curve has a singularity that is none of the known kinds"
        return None, step

    def _take(self, point: LocusPoint, ahead: LocusPoint) -> None:
        """Accept a step, up to the first of another grazing, a bound and the closing of the loop."""
        refused = self._refused(ahead)
        if refused:
            self.reason = refused
            return
        meeting = located(f"{self.kind}-GR", room, point, ahead) if room(ahead) < 0.0 else None
        if room(ahead) < 0.0 and meeting is None:
            self.reason = "a grazing that could not be located"
            return
        ahead = ahead if meeting is None else meeting.point
        beyond = self._beyond(point, ahead)
        if beyond is not None:
            ahead, self.reason = beyond
        elif len(self.points) > 3 and closes(self.points[0], point, ahead):
            ahead, self.reason = self.points[0], CLOSED
        elif meeting is not None:
            self.reason = f"meets another grazing: {meeting.kind}"
        elif ahead.orbit.amplitude < SMALLEST:
            self.reason = "shrinks to rest"
        self._note(point, ahead)
        self.special += [meeting] if meeting is not None and ahead is meeting.point else []
        self.points.append(ahead)
        if self.progress is not None:
            self.progress((float(ahead.solution.values[0]), float(ahead.solution.values[1])))

    def _refused(self, ahead: LocusPoint) -> str:
        """Why the system refuses the parameters, or nothing."""
        try:
            ahead.curve.problem.at(ahead.solution.values)
        except ParameterError as refusal:
            return f"the system ends there: {refusal}"
        return ""

    def _note(self, a: LocusPoint, b: LocusPoint) -> None:
        """Locate the codimension-two points of a step, in order."""
        found = []
        for kind, test in tests_of(self.kind, a.orbit.symmetric):
            try:
                special = located(kind, test, a, b) if test(a) * test(b) < 0.0 else None
            except ParameterError:  # a normal form beside another grazing
                special = None
            found += [] if special is None else [special]
        self.special += sorted(found, key=lambda s: a.curve.norm(s.point.place - a.place))

    def _beyond(self, a: LocusPoint, b: LocusPoint) -> tuple[LocusPoint, str] | None:
        """The point on the first bound that the step goes over, and which bound that is."""
        chord, shares = b.solution.values - a.solution.values, []
        for index in (0, 1):
            for bound in self.bounds[index]:
                share = (bound - a.solution.values[index]) / chord[index] if chord[index] != 0.0 else math.inf
                outside = (b.solution.values[index] - bound) * (bound - self.bounds[index].mean()) > 0.0
                if outside and 0.0 <= share <= 1.0:
                    shares.append((share, index, bound))
        if not shares:
            return None
        share, index, bound = min(shares)
        guess = a.place + share * (b.place - a.place)
        guess[index - 2] = bound
        return a.at(guess, index) or b, f"bound {a.curve.problem.paths[index]} = {bound:g}"


def closes(first: LocusPoint, a: LocusPoint, b: LocusPoint) -> bool:
    """Whether the step from a to b goes by the first point of the curve."""
    shifted = separation(first.curve.problem, first.solution.unknowns, _any(b))
    if shifted is None:
        return False
    along, across = np.append(shifted, first.solution.values) - a.place, b.place - a.place
    length = b.curve.norm(across)
    share = float(along @ (b.curve.weights**2 * across)) / length**2
    return 0.0 < share <= 1.0 and b.curve.norm(along - share * across) < 0.2 * length


def _any(point: Any) -> Any:
    return point


def continue_special(
    special: SpecialPoint,
    path: str,
    bounds: tuple[float, float] | None = None,
    *,
    first_bounds: tuple[float, float] | None = None,
    step: float = STEP,
    progress: Callable[[tuple[float, float]], object] | None = None,
) -> Locus:
    """The curve of LP, PD, BPC or GR through a special point of a branch, in the branch's parameter and a second one.

    It is followed both ways, through cusps, until it closes, reaches a bound, meets another grazing or cannot go on. PD, BPC:
    the orbits are those that lose their stability, not the ones born there.

    Args:
        special: where to begin, one of `branch.special`.
        path: dotted path of the second parameter, such as "load.horizontal.amplitude".
        bounds: its least and largest value; by default from a tenth to ten times what it is (from -1 to 1 for 0).
        first_bounds: those of the branch's own parameter; by default as far to both sides as its branch was wide, or to a tenth.
        step: the longest step, in the norm of `locus.py`.
        progress: called with both parameters of each new point.

    Raises:
        ParameterError: another kind of point, an unknown parameter or the branch's own, bounds that exclude the point, a second
            parameter that takes away the symmetry which a BPC or a grazing on both sides rests on.
    """
    if special.kind not in FOLLOWED:
        raise ParameterError(f"curves are followed of {', '.join(FOLLOWED)}, not of {special.kind}")
    if isinstance(special.orbit, RestingOrbit):
        raise ParameterError(
            "curves are followed of orbits between impacts only, and this one rests; continue it along one parameter"
        )
    first_path, system = special.point.curve.problem.paths[0], special.orbit.system
    if path == first_path:
        raise ParameterError(f"the branch already runs along {path}; name another parameter to follow its {special.kind} in")
    if path not in system.parameters:
        system.get(path)  # refuses what leads nowhere
        raise ParameterError(f"{path} is not a number, so a curve cannot be continued along it")
    limits = _limits(special, system.parameters[path], bounds, first_bounds)
    start = _start(special, (first_path, path), (limits[0], limits[1]))
    walks = []
    for point in (start.turned(), start):
        walk = _Walk(special.kind, np.array(limits), step, progress)
        walk.follow(point)
        if walk.reason == CLOSED:
            return Locus(special.kind, (first_path, path), tuple(walk.points), tuple(walk.special), (CLOSED, CLOSED))
        walks.append(walk)
    back, ahead = walks
    points = [point.turned() for point in reversed(back.points[1:])] + ahead.points
    special_points = (*reversed(back.special), *ahead.special)
    return Locus(special.kind, (first_path, path), tuple(points), special_points, (back.reason, ahead.reason))


def _limits(special: SpecialPoint, value: float, bounds: Any, first_bounds: Any) -> list[tuple[float, float]]:
    """The bounds of both parameters, which must include the point."""
    own, width = special.parameter, 3.0 * special.point.curve.scale
    low, high = own - width, own + width
    if first_bounds is None:
        first_bounds = (max(low, own / TENFOLD), high) if own > 0 else (low, min(high, own / TENFOLD) if own < 0 else high)
    if bounds is None:
        bounds = sorted((value / TENFOLD, value * TENFOLD)) if value else (-1.0, 1.0)
    limits = [check_bounds(first_bounds), check_bounds(bounds)]
    for (low, high), inside, name in zip(limits, (own, value), ("first", "second"), strict=True):
        if not low <= inside <= high:
            raise ParameterError(
                f"the special point has {inside:g} as its {name} parameter, outside ({low:g}, {high:g}); widen it"
            )
    return limits


def _start(special: SpecialPoint, paths: tuple[str, str], limits: tuple[tuple[float, float], tuple[float, float]]) -> LocusPoint:
    """The special point as a point of its curve."""
    problem, solution, condition = _defined(special, paths)
    judged = condition.judge(solution)
    if judged is None:
        raise ParameterError(f"the motion beside this {special.kind} cannot be followed, so its curve cannot; choose another")
    plane = Plane(problem, (np.diff(limits[0])[0] / 3.0, np.diff(limits[1])[0] / 3.0))
    rows = matrix(solution, judged, np.zeros(problem.size + 2)) / plane.weights
    tangent = np.linalg.svd(rows[:-1])[2][-1] / plane.weights
    point = LocusPoint(plane, condition, solution, judged, tangent / plane.norm(tangent))
    exact = point.near(point.place, point.tangent)
    if exact is None:
        raise ParameterError(
            f"Newton's method does not find this {special.kind} again; locate it on its branch with a smaller step"
        )
    return exact


def _defined(special: SpecialPoint, paths: tuple[str, str]) -> tuple[Problem, Solution, Condition]:
    """The problem along both parameters, the orbit as its solution, and the condition that singles it out."""
    old, unknowns = special.point.curve.problem, special.point.solution.unknowns
    system, values = special.orbit.system, np.array([special.parameter, special.orbit.system.parameters[paths[1]]])
    symmetric = keeps_symmetry(system, paths[0]) and keeps_symmetry(system, paths[1])
    if old.signature.symmetric and not symmetric and special.kind != "LP":
        raise ParameterError(
            f"{paths[1]} takes away the mirror symmetry on which this {special.kind} rests; change it a little, follow the "
            "branch again, and continue the special points into which this one splits"
        )
    if special.kind == "GR":
        signature, unknowns = _touching(special)
        problem = Problem(system, signature, paths)
        solution = _evaluated(problem, unknowns, values)
        return problem, solution, Slow(problem, _first_without_speed(problem, unknowns))
    problem = Problem(system, old.signature, paths)
    solution = _evaluated(problem, unknowns, values)
    if special.kind == "LP":
        if old.signature.symmetric and not symmetric:
            problem, solution = _over_whole_period(problem, solution)
        return problem, solution, Singular.near(problem, solution, 1.0)
    if special.kind == "PD":
        problem, solution = divide(problem, solution) or (problem, solution)
    elif not old.signature.symmetric:
        halved = half(problem, solution) if symmetric else None
        if halved is None:
            raise ParameterError("this BPC is a crossing of branches that no symmetry keeps: it does not persist along a curve")
        problem, solution = halved
    return problem, solution, Singular.near(problem, solution, -1.0)


def _evaluated(problem: Problem, unknowns: np.ndarray, values: np.ndarray) -> Solution:
    equations = problem.evaluate(unknowns, values, look=True)
    if equations is None:
        raise ParameterError("the motion of the special point cannot be followed; locate it again on its branch")
    return Solution(unknowns, values, equations, 0)


def _over_whole_period(problem: Problem, solution: Solution) -> tuple[Problem, Solution]:
    """A symmetric orbit, at a fold too, as a solution of the problem of its whole period."""
    signature, unknowns = problem.signature, solution.unknowns
    sides = (*signature.sides, *(-s for s in signature.sides))
    other = problem.with_signature(Signature(sides, signature.period, False, signature.side))
    if sides:
        later = unknowns.copy()
        later[::2] += problem.closing
        unknowns = np.concatenate([unknowns, later])
    return other, _evaluated(other, unknowns, solution.values)


def _touching(special: SpecialPoint) -> tuple[Signature, np.ndarray]:
    """The signature with more impacts of the two that meet at a grazing, and the orbit's unknowns in it."""
    point = special.point
    if point.orbit.slowest < TOUCH:  # then the touch is an impact of its own, whose gap has its minimum there too
        return point.curve.problem.signature, point.solution.unknowns
    changed = inserted(point)
    if isinstance(changed, str):
        raise ParameterError(f"this grazing cannot be followed: {changed}")
    return changed[0].signature, changed[1]


def _first_without_speed(problem: Problem, unknowns: np.ndarray) -> int:
    """The impact without speed, of a pair the first."""
    phases, speeds = unknowns[::2], unknowns[1::2]
    slow = int(np.argmin(np.abs(speeds)))
    before = phases[slow] - phases[slow - 1] + (problem.closing if slow == 0 else 0.0)
    return (slow - 1) % len(speeds) if len(speeds) > 1 and abs(before) < TOGETHER and abs(speeds[slow - 1]) < TOGETHER else slow
