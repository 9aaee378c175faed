"""Whether a branch has come back along itself: its last points are orbits that it has already."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from saltus.orbits.branches.orbit_curve import OrbitPoint
from saltus.orbits.branches.symmetry import nearest
from saltus.orbits.signature import TOLERANCES

FEWEST_POINTS = 6  # a branch of fewer cannot have turned round
# A point is compared with a step whose chord it is beside by at most this share of the step.
BESIDE = 0.1


def comes_along_itself(points: Sequence[OrbitPoint]) -> bool:
    """Whether the last two points of a branch lie on earlier steps of it.

    One point alone may be where a branch crosses itself.

    Parameters
    ----------
    points
        The points in order, the newest last.
    """
    if len(points) < FEWEST_POINTS:
        return False
    return all(_lies_on(points[: -2 - place], points[-1 - place]) for place in (0, 1))


def _lies_on(earlier: Sequence[OrbitPoint], point: OrbitPoint) -> bool:
    """Whether a point lies on one of the steps between earlier points."""
    return any(_is_on_step(a, b, point) for a, b in pairwise(earlier) if _may_be_on(a, b, point))


def _may_be_on(a: OrbitPoint, b: OrbitPoint, point: OrbitPoint) -> bool:
    """Whether the parameters and the amplitude of a point lie between those of the ends of a step,
    as far as a step is straight."""
    low, high = np.minimum(a.parameters, b.parameters), np.maximum(a.parameters, b.parameters)
    room = BESIDE * (high - low)
    if not ((low - room <= point.parameters) & (point.parameters <= high + room)).all():
        return False
    sizes = a.orbit.amplitude, b.orbit.amplitude
    rounding = TOLERANCES.same_orbit * max(sizes)
    reach = (max(sizes) - min(sizes)) + rounding
    return min(sizes) - reach <= point.orbit.amplitude <= max(sizes) + reach


def _is_on_step(a: OrbitPoint, b: OrbitPoint, point: OrbitPoint) -> bool:
    """Whether a point is the orbit that a step has beside it: solved for in the hyperplane through
    the point that is normal to the step's chord."""
    curve = point.curve
    ends = [
        one.place if curve.joins(one.curve) else nearest(one, one.place, point) for one in (a, b)
    ]
    if ends[0] is None or ends[1] is None:
        return False
    first, last = ends
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
