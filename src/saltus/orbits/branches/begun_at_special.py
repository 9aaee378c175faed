"""A branch that is begun at one of its special points: what vanishes there is looked for, and the
branch is followed to both sides.
"""

from __future__ import annotations

from saltus.continuation import Course, Cut, Evidence, Zero, located
from saltus.orbits.beyond.orbit_curve import OrbitPoint
from saltus.orbits.beyond.special_point import SpecialPoint
from saltus.orbits.branches.branch_events import BranchEvents
from saltus.orbits.signature import TOLERANCES

# Distances along the branch at which the sides of a change at its first point are told apart.
PROBES = (1e-6, 1e-5, 1e-4)
# A test function vanishes at the first point if it is below the first number there, and changes
# its sign within this distance, at whose ends it is larger by the last number.
SMALL = 1e-6
AROUND = 1e-4
CLEARLY = 1e3
SAME_PLACE = 1e-7  # Parameters of one special point that was found twice, in the curve's scale.


def from_a_change(first: OrbitPoint) -> tuple[OrbitPoint, Cut | None]:
    """The first point of a branch, and the change of equations there if the orbit grazes, or its
    events change, just there. The point's tangent then leads to that change from the side on which
    its own equations hold.
    """
    equations = first.orbit.equations
    barrier = equations.barrier(first)
    value = barrier.value(first)
    if not abs(value) <= TOLERANCES.touch:
        return first, None
    evidence = Evidence(first.residual, (0.0,) * len(first.parameters), value, value, value)
    cut = equations.change(SpecialPoint(barrier.kind, first, evidence), first)
    if not isinstance(cut, Cut) or cut.special is None:
        return first, None
    for probe in PROBES:
        for point in (first, first.turned()):
            ahead = point.beside(probe)
            if ahead is not None and ahead.orbit.admissible and barrier.value(ahead) > abs(value):
                towards = point.turned()
                special = SpecialPoint(cut.special.kind, towards, cut.special.evidence)
                return towards, Cut(towards, special)
    return first, None


def with_special_start(
    course: Course[OrbitPoint, SpecialPoint], first: OrbitPoint, events: BranchEvents
) -> tuple[SpecialPoint, ...]:
    """The special points of a branch, with those at its first point: rounding decides there on
    which side of it a test function changes its sign, or whether it does so at all.
    """
    special = list(course.special)
    found = [zero for zero in _vanishing(first, events) if not _is_listed(zero, special)]
    # a point that is followed the other way keeps the array of its place
    places = [id(point.place) for point in course.points]
    own = places.index(id(first.place)) if id(first.place) in places else 0
    before = sum(id(zero.point.place) in places[:own] for zero in special)
    new = [SpecialPoint(zero.kind, zero.point, zero.evidence) for zero in events.distinct(found)]
    return (*special[:before], *new, *special[before:])


def _vanishing(first: OrbitPoint, events: BranchEvents) -> list[Zero]:
    """The zeros of test functions at the first point of a branch."""
    tests = [test for test in events.tests(first) if abs(test.value(first)) < SMALL]
    if not tests or first.orbit.grazes:
        return []
    ends = [first.beside(sign * AROUND) for sign in (-1.0, 1.0)]
    if ends[0] is None or ends[1] is None:
        return []
    found = []
    for test in tests:
        values = [test.value(end) for end in ends]
        least = min(abs(values[0]), abs(values[1]))
        if values[0] * values[1] < 0.0 and CLEARLY * abs(test.value(first)) < least:
            found.append(located(test, ends[0], ends[1], test.singular))
    return [zero for zero in found if zero is not None]


def _is_listed(zero: Zero, special: list[SpecialPoint]) -> bool:
    """Whether a special point at the first point of a branch was found on the way from there."""
    near = SAME_PLACE * zero.point.curve.scales[0]
    return any(
        zero.kind == other.kind and abs(zero.parameter - other.parameter) < near
        for other in special
    )
