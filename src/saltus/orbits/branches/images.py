"""The image of an orbit, orbits that are their own images or repeat a shorter one, and unknowns counted from another impact.

The image of an orbit is the same orbit half a period later and, if its period q is odd, mirrored. An orbit that is its own image
is symmetric (q odd), or a shorter one that is gone round twice (q even).
"""

from __future__ import annotations

import math

import numpy as np

from saltus.continuation import between
from saltus.orbits.branches.orbit_curve import OrbitPoint
from saltus.orbits.equations.contacts import ContactsEquations
from saltus.orbits.equations.one_contact import OneContactEquations
from saltus.orbits.equations.whole_motion import WholeMotionEquations
from saltus.orbits.tolerances import TOLERANCES

NEAR_THE_END = (0.99, 0.95, 0.9)  # Shares of the last step: at the end itself the equations are singular.


def asymmetry(point: OrbitPoint) -> np.ndarray | None:
    """The difference of an orbit's image from the orbit itself.

    None where the signature rules out that the orbit is its own image, or its equations imply it (a symmetric signature).
    """
    both = halves(point)
    return None if both is None else np.asarray(both[1] - both[0])


def halves(point: OrbitPoint) -> np.ndarray | None:
    """The unknowns of both halves of a period, each as unknowns of the equations over one half, (2, n); None as for
    `asymmetry`."""
    signature, equations, unknowns = point.orbit.signature, point.orbit.equations, point.solution.unknowns
    n, odd = len(signature.sides), signature.period % 2
    if signature.symmetric or n % 2:
        return None
    if signature.events:
        assert isinstance(equations, ContactsEquations)
        return None if odd and not point.curve.symmetric else equations.halves(unknowns, point.evaluation)
    if n == 0:
        return None if point.half_way is None else np.stack([unknowns, unknowns + point.half_way])
    first, second = signature.sides[: n // 2], signature.sides[n // 2 :]
    expected = tuple(-s for s in first) if odd else first
    if second != expected or (odd and not point.curve.symmetric):
        return None
    both = unknowns.reshape(2, n // 2, 2).copy()
    both[1, :, 0] -= np.pi * signature.period
    return np.asarray(both.reshape(2, n))


def on_family(point: OrbitPoint, parent: OrbitPoint) -> OrbitPoint | None:
    """The parent's orbit at which a family ends, as a solution of the family's own equations, in which both its halves are alike.

    There the family turns back along its images: the tangent leads from the family's `point` beside it to that point's image.

    Returns
    -------
    OrbitPoint | None
        The last point of the family's branch; None where the motion cannot be followed.
    """
    signature, difference = point.orbit.signature, asymmetry(point)
    assert difference is not None
    unknowns, tangent = parent.solution.unknowns, difference
    if signature.sides or signature.events:
        unknowns = parent.orbit.equations.repeated(unknowns)
        tangent = parent.orbit.equations.alternating(difference)
    found = point.curve.known(unknowns, parent.solution.values)
    if found is None:
        return None
    tangent = np.append(tangent, np.zeros(len(parent.solution.values)))
    last: OrbitPoint = point.curve.point_at(found, tangent / point.curve.norm(tangent))
    return last


def beside_image(point: OrbitPoint, last: OrbitPoint) -> OrbitPoint | None:
    """A point of a family between `point` and its end `last`, as near to the end as the equations can be solved."""
    chord = last.place - point.place
    for share in NEAR_THE_END:
        beside: OrbitPoint | None = point.curve.solve(between(point, last, share), chord / point.curve.norm(chord))
        if beside is not None and not falls_onto_image(point, beside):
            return beside
    return None


def passes_image(a: OrbitPoint, b: OrbitPoint) -> bool:
    """Whether a step goes through an orbit that is its own image."""
    before, after = asymmetry(a), asymmetry(b)
    return before is not None and after is not None and bool(before @ after < 0.0) and np.abs(before).max() > TOLERANCES.image


def falls_onto_image(a: OrbitPoint, b: OrbitPoint) -> bool:
    """Whether a step has jumped from an orbit that is not its own image onto the branch of orbits that are."""
    before, after = asymmetry(a), asymmetry(b)
    return (
        before is not None and after is not None and bool(np.abs(before).max() > TOLERANCES.image > 100.0 * np.abs(after).max())
    )


def is_image(point: OrbitPoint, within: float = 1e-2 * TOLERANCES.image) -> bool:
    """Whether an orbit is its own image, although its equations do not imply it."""
    difference = asymmetry(point)
    return difference is not None and bool(np.abs(difference).max() < within)


def parent_of(point: OrbitPoint, within: float = TOLERANCES.grazing_orbits) -> OrbitPoint | None:
    """The orbit of the parent, over half of the period, of an orbit that is its own image up to `within`; None for other
    orbits."""
    equations = point.curve.equations.halved
    if equations is None or not is_image(point, within):
        return None
    curve = point.curve.with_equations(equations)
    parent: OrbitPoint | None = curve.solve_at(point.place, np.append(np.zeros(equations.size), 1.0))
    return parent


def repetition(point: OrbitPoint) -> str | None:
    """Which other orbit an orbit repeats, in words: a symmetric one, or one of a shorter period; None if it repeats none."""
    signature, n = point.orbit.signature, len(point.orbit.signature.sides)
    difference = asymmetry(point)
    if signature.period % 2 and difference is not None and np.abs(difference).max() < TOLERANCES.grazing_orbits:
        return "symmetric orbit"
    for periods in range(1, signature.period):
        part = n * periods // signature.period
        if signature.period % periods or n * periods % signature.period or part == 0 or signature.symmetric:
            continue
        pairs = point.solution.unknowns.reshape(-1, part, 2).copy()
        pairs[:, :, 0] -= 2.0 * math.pi * periods * np.arange(len(pairs))[:, None]
        if signature.sides == signature.sides[:part] * len(pairs) and np.ptp(pairs, axis=0).max() < TOLERANCES.grazing_orbits:
            return f"orbit of period {periods}"
    return None


def renumbered(equations: OneContactEquations, unknowns: np.ndarray, other: OrbitPoint) -> np.ndarray | None:
    """The unknowns of an orbit, begun at another impact and shifted by whole forcing periods such that they are nearest to those
    of the point `other`; None where the signatures differ.
    """
    target, signature = other.orbit.signature, equations.signature
    n = len(signature.sides)
    if (n, signature.period, signature.symmetric) != (len(target.sides), target.period, target.symmetric):
        return None
    if n == 0:
        return unknowns if signature == target else None
    pairs, best, least = unknowns.reshape(n, 2), None, math.inf
    goal = other.solution.unknowns.reshape(n, 2)
    once = [np.array([turn * equations.closing, 0.0]) for turn in range(3)]
    later = np.concatenate([pairs + shift for shift in once])  # the impacts of three (half) periods
    next_sides = tuple(-side for side in signature.sides) if signature.symmetric else signature.sides
    sides = signature.sides + next_sides + signature.sides
    for turn in range(n * (2 if signature.symmetric else 1)):
        if sides[turn : turn + n] != target.sides:
            continue
        rolled = later[turn : turn + n].copy()
        rolled[:, 0] += 2.0 * math.pi * round((goal[0, 0] - rolled[0, 0]) / (2.0 * math.pi))
        distance = float(np.abs(rolled - goal).max())
        if distance < least:
            best, least = rolled.ravel(), distance
    return best


def nearest(point: OrbitPoint, place: np.ndarray, other: OrbitPoint) -> np.ndarray | None:
    """A place on the curve of `point`, in the unknowns that are nearest to those of `other`: begun at another impact, or given at
    the section of `other`. None if the orbits cannot be compared so."""
    equations, n = point.curve.equations, point.curve.equations.size
    if isinstance(equations, WholeMotionEquations):
        unknowns = _at_section_of(equations, place, other)
    else:
        unknowns = renumbered(equations, place[:n], other)
    return None if unknowns is None else np.concatenate([unknowns, place[n:]])


def _at_section_of(equations: WholeMotionEquations, place: np.ndarray, other: OrbitPoint) -> np.ndarray | None:
    """The state of an orbit at the section of the point `other`, in the forcing period in which it is nearest to that of `other`;
    None where `other` has no section, or another period or symmetry."""
    target, n = other.orbit.signature, equations.size
    if target.section is None or (target.period, target.symmetric) != (equations.signature.period, equations.signature.symmetric):
        return None
    return equations.state_at(target.section, place[:n], place[n:], other.solution.unknowns)


def with_section_of(point: OrbitPoint, other: OrbitPoint) -> OrbitPoint:
    """A point whose orbit is followed through its events, given at the section of another point; other points are unchanged."""
    place = None
    if isinstance(point.curve.equations, WholeMotionEquations) and not point.curve.joins(other.curve):
        place = nearest(point, point.place, other)
    found = None if place is None else other.curve.known(*np.split(place, [other.curve.equations.size]))
    return point if found is None else other.curve.with_tangent(found, other.tangent) or point
