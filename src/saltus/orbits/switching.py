"""Onto the branches that are born at a special point: the doubled orbit at a PD, the unsymmetric ones at a BPC."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from saltus.checks import check_bounds
from saltus.errors import ParameterError
from saltus.orbits.branch import STEP, Branch, follow_from
from saltus.orbits.newton import Solution, solve
from saltus.orbits.path import Curve, Point
from saltus.orbits.problem import Problem
from saltus.orbits.signature import Signature
from saltus.orbits.special import SpecialPoint, UserFunction
from saltus.orbits.symmetry import whole

LONGEST = 64  # forcing periods of an orbit: periods double six times


def switch_branch(
    special: SpecialPoint,
    bounds: tuple[float, float],
    *,
    functions: dict[str, UserFunction] | None = None,
    step: float = STEP,
    both: bool = True,
) -> tuple[Branch, ...]:
    """The branches that begin at a special point of another one.

    At a PD that of the doubled orbit; at a BPC those of the two unsymmetric orbits, mirror images of one another, or, where two
    branches cross, the two halves of the other branch.

    Args:
        special: where to begin.
        bounds, functions, step: as for `continue_orbit`.
        both: whether both of two mirror images are followed, which differ in nothing but their phase and sign.

    Raises:
        ParameterError: a special point where no branch begins.
    """
    low, high = check_bounds(bounds)
    path = special.point.curve.problem.paths[0]
    origin = f"{special.kind} at {special.parameter:.9g}"
    if special.kind not in ("PD", "BPC"):
        raise ParameterError(f"no branch begins at a {special.kind}; switch at a PD or a BPC (grazings are gone through anyway)")
    if special.kind == "BPC" and not special.orbit.symmetric:
        starts = _crossing_branch(special.point)
    else:
        starts = (_doubled(special.point),) if special.kind == "PD" else _unsymmetric(special.point)[: 2 if both else 1]
    branches = [follow_from(start, path, (low, high), origin, functions, step) for start in starts if start is not None]
    return tuple(branches)


def _kernel(matrix: np.ndarray) -> np.ndarray:
    vector: np.ndarray = np.linalg.svd(matrix)[2][-1]
    return vector


def _doubled(point: Point) -> Point | None:
    """The orbit gone round twice, and the direction in which the two rounds differ."""
    problem, signature = point.curve.problem, point.curve.problem.signature
    if 2 * signature.period > LONGEST:
        return None
    twice = Signature((*signature.sides, *signature.sides), 2 * signature.period, False, signature.side)
    unknowns, direction = point.solution.unknowns, _kernel(point.solution.equations.jacobian(-1.0))
    if not signature.sides:
        return _along(point, problem.with_signature(twice), unknowns, direction)
    later = unknowns.copy()
    later[::2] += problem.closing
    return _along(
        point, problem.with_signature(twice), np.concatenate([unknowns, later]), np.concatenate([direction, -direction])
    )


def _unsymmetric(point: Point) -> tuple[Point | None, ...]:
    """The symmetric orbit over its whole period, and the two directions in which its halves differ."""
    problem, solution = whole(point.curve.problem, point.solution)
    direction = _kernel(point.solution.equations.jacobian(-1.0))
    if point.curve.problem.signature.sides:
        direction = np.concatenate([direction, -direction])
    return tuple(_along(point, problem, solution.unknowns, sign * direction) for sign in (1.0, -1.0))


def _along(point: Point, problem: Problem, unknowns: np.ndarray, direction: np.ndarray) -> Point | None:
    """The first point of the new branch, to be followed in a direction of the unknowns."""
    values = point.solution.values
    equations = problem.evaluate(unknowns, values, look=True)
    if equations is None:
        return None
    curve = Curve(problem, point.curve.scale, point.curve.symmetric)
    tangent = np.append(direction, 0.0)
    return Point(curve, Solution(unknowns, values, equations, 0), tangent / curve.norm(tangent))


def _crossing_branch(point: Point) -> tuple[Point | None, ...]:
    """Where two branches cross: the direction in the two-dimensional kernel that is not the branch's own, both ways."""
    equations, curve = point.solution.equations, point.curve
    matrix = np.column_stack([equations.jacobian(), equations.parameters[:, 0]]) / curve.weights
    own = point.tangent * curve.weights
    kernel = np.linalg.svd(matrix)[2][-2:]
    other = kernel[int(np.argmin(np.abs(kernel @ own)))]
    other = other - (other @ own) * own
    tangent = other / curve.weights
    tangent = tangent / curve.norm(tangent)
    return tuple(Point(curve, point.solution, sign * tangent) for sign in (1.0, -1.0))


def mirror_image(orbit_problem: Problem, solution: Solution) -> tuple[Problem, Solution] | None:
    """The mirror image of an orbit of a symmetric system, itself an orbit half a forcing period later."""
    signature = orbit_problem.signature
    if signature.symmetric:
        return orbit_problem, solution
    if not signature.sides:
        return None
    other = orbit_problem.with_signature(Signature(tuple(-s for s in signature.sides), signature.period, False, -signature.side))
    unknowns = solution.unknowns.copy()
    unknowns[::2] += np.pi
    found = solve(other, unknowns, solution.values)
    return None if found is None else (other, found)


@dataclass(frozen=True)
class Cascade:
    """Period doublings one after the other, and how fast they follow: the ratios tend to Feigenbaum's 4.6692."""

    points: tuple[SpecialPoint, ...]

    @property
    def parameters(self) -> np.ndarray:
        """Where the period doubles, from q to 2 q, 4 q, ..."""
        return np.array([point.parameter for point in self.points])

    @property
    def periods(self) -> np.ndarray:
        """Of the orbits that double."""
        return np.array([point.orbit.period for point in self.points])

    @property
    def ratios(self) -> np.ndarray:
        """(p_{n+1} - p_n) / (p_{n+2} - p_{n+1})."""
        steps = np.diff(self.parameters)
        return np.asarray(steps[:-1] / steps[1:])


def doubling_cascade(first: SpecialPoint, bounds: tuple[float, float], *, max_period: int = 32, step: float = STEP) -> Cascade:
    """The period doublings that follow one, each on the branch born at the one before, up to `max_period` forcing periods.

    It ends early where a doubled branch has no further doubling within the bounds.

    Raises:
        ParameterError: a special point that is no PD.
    """
    if first.kind != "PD":
        raise ParameterError(f"a cascade begins at a PD, not at a {first.kind}")
    low, high = check_bounds(bounds)
    points = [first]
    while 2 * points[-1].orbit.period <= max_period:
        start = _doubled(points[-1].point)
        if start is None:
            break
        path = start.curve.problem.paths[0]
        branch = follow_from(start, path, (low, high), f"PD at {points[-1].parameter:.9g}", None, step, until="PD")
        if not branch.special or branch.special[-1].kind != "PD" or branch.ends[1] != "the first PD":
            break
        points.append(branch.special[-1])
    return Cascade(tuple(points))
