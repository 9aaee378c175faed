"""Whether a branch has come back along itself: its last points are orbits that it has already."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

from saltus.orbits.beyond.orbit_curve import OrbitPoint
from saltus.orbits.beyond.symmetry import nearest
from saltus.orbits.signature import TOLERANCES

FEWEST_POINTS = 6  # a branch of fewer cannot have turned round
# A point is compared with a step whose chord it is beside by at most this share of the step.
BESIDE = 0.1


def comes_along_itself(points: Sequence[OrbitPoint], values: Sequence[float] | None = None) -> bool:
    """Whether the last two points of a branch lie on earlier steps of it.

    One point alone may be where a branch crosses itself.

    Parameters
    ----------
    points
        The points in order, the newest last.
    values
        Their parameters, if these are known.
    """
    if len(points) < FEWEST_POINTS:
        return False
    known = [point.parameter for point in points] if values is None else values
    return all(_lies_on(points, len(points) - 1 - place, known) for place in (0, 1))


def _lies_on(points: Sequence[OrbitPoint], index: int, values: Sequence[float]) -> bool:
    """Whether a point lies on one of the steps before it, of which those that end at its neighbour
    do not count."""
    value = values[index]
    last = max(0, index - 2)
    earlier = values[: last + 1]
    if not min(earlier) <= value <= max(earlier):
        return False
    passed = [
        i for i, (a, b) in enumerate(pairwise(earlier)) if (a <= value <= b) or (b <= value <= a)
    ]
    point = points[index]
    steps = ((points[i], points[i + 1]) for i in passed)
    return any(
        _may_be_on(a, b, point) and _has_events_of(a, b, point) and _is_on_step(a, b, point)
        for a, b in steps
    )


def _has_events_of(a: OrbitPoint, b: OrbitPoint, point: OrbitPoint) -> bool:
    """Whether a point has the events of one of the ends of a step.

    Beside a change of events orbits with and without it are ever more alike, and equations that do
    not list events have both as solutions.
    """
    equations = point.orbit.equations
    return any(
        isinstance(end.orbit.equations, type(equations))
        and equations.has_events_of(point.solution, end.solution)
        for end in (a, b)
    )


def _may_be_on(a: OrbitPoint, b: OrbitPoint, point: OrbitPoint) -> bool:
    """Whether the amplitude of a point lies between those of the ends of a step, as far as a step
    is straight."""
    sizes = a.orbit.size, b.orbit.size
    rounding = TOLERANCES.same_orbit * max(sizes)
    reach = (max(sizes) - min(sizes)) + rounding
    return min(sizes) - reach <= point.orbit.size <= max(sizes) + reach


def _is_on_step(a: OrbitPoint, b: OrbitPoint, point: OrbitPoint) -> bool:
    """Whether a point is the orbit that a step has beside it: solved for in the hyperplane through
    the point that is normal to the step's chord."""
    curve = point.curve
    ends = [
        one.place if curve.joins(one.curve) else nearest(one, one.place, point) for one in (a, b)
    ]
    first, last = ends
    if first is None or last is None:
        return False
    chord = last - first
    length = curve.norm(chord)
    if length == 0.0:
        return False
    share = float((point.place - first) @ (curve.weights**2 * chord)) / length**2
    place = first + share * chord
    if not (0.0 <= share <= 1.0 and curve.norm(point.place - place) < BESIDE * length):
        return False
    there = curve.solve(place, chord / length)
    return there is not None and curve.norm(there.place - point.place) < TOLERANCES.halves
