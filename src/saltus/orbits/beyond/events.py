"""Orbits that are followed through their events: where an event appears or is lost, and the orbits
on the other side.

The map over a period is smooth as long as the events and their order stay the same. Where they
change, the map is continuous with other derivatives on the other side, or it jumps. With dry
friction the changes are the four sliding bifurcations (M. di Bernardo, P. Kowalczyk, A. Nordmark,
Physica D 170, 2002).
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise, product
from typing import Any

import numpy as np

from saltus.continuation import (
    Bounds,
    Corrected,
    Course,
    CurveEnd,
    Cut,
    End,
    Evidence,
    TestFunction,
    Zero,
)
from saltus.errors import SaltusError
from saltus.flow import EventCode, EventKind, RowValues
from saltus.orbits.beyond.orbit_curve import FLIP, OrbitPoint
from saltus.orbits.beyond.special_point import OrbitEnd, SpecialKind, SpecialPoint
from saltus.orbits.beyond.symmetry import is_image, nearest, parent_of
from saltus.orbits.contract.event_sequence import (
    CORNER,
    TIME_BETWEEN,
    EventSequence,
    OrbitEvent,
)
from saltus.orbits.contract.event_sequence import SETTINGS as EVENTS
from saltus.orbits.contract.sampled_motion import REACTION
from saltus.orbits.orbit import PeriodicOrbit
from saltus.orbits.signature import TOLERANCES

Events = tuple[OrbitEvent, ...]
# replaces a distance of 0 before a change of events, to keep the test function negative there
TINY = float(np.finfo(float).tiny)


@dataclass(frozen=True)
class OtherSideSettings:
    """How orbits with other events are looked for beside an orbit at which its events change."""

    # Distances from the point at which the equations are evaluated to see the events on the other
    # side, tried in turn.
    beside: tuple[float, ...] = (1e-9, 1e-8, 1e-7)
    # Distances from the point at which an orbit is solved for on the other side, tried in turn: at
    # the least ones no further event has changed yet.
    probes: tuple[float, ...] = (1e-6, 1e-5, 1e-4, 1e-3, 1e-2)
    # Such distances, in the order in which they are tried, where the map has a square root: below
    # 1e-4 rounding is large.
    steep_probes: tuple[float, ...] = (1e-4, 1e-3, 1e-5)
    # With a square root, the place of the change along a line is extrapolated by secants from two
    # places before it, at these shares of a probe's distance, at most so many times. The search for
    # an orbit begins beyond this place by `inside` times the square of the distance.
    approach: tuple[float, float] = (0.1, 0.01)
    secants: int = 8
    inside: float = 1e-3
    # A change is located from its other side up to this distance, through places that are nearer
    # to it than the one before by this factor.
    touching: float = 1e-11
    just_before: float = 1e-3
    # How far from the point an orbit found at a probe may be, in units of the probe's distance.
    near: float = 3.0
    # If the least probe leads to no orbit, the branch may fold just as near to the change: its
    # first step is at most this many times the distance of the orbit that was found. A longer step
    # would jump beyond the fold.
    first: float = 10.0
    # Neighbours that end up nearer to one another than this are no sign of a jump.
    jump: float = 5e-3
    # Where the map is continuous, even with a square root, neighbours end up apart by no more than
    # their distance times the largest multiplier times this; and by less than this share of it at a
    # tenth of the distance.
    stretched: float = 10.0
    shrunk: float = 0.7
    # The way to a change is extrapolated from orbits whose distances from it have at least this
    # ratio.
    fall: float = 10.0
    # An orbit with a larger residual is not used for this: its distance from the change is
    # rounding.
    rounded: float = 1e-10
    doubt: float = 2.0  # The bracket of such a change, in units of the extrapolated way.
    # Events of two neighbouring orbits are the same if their times differ by less than this, in
    # natural times.
    together: float = 1e-2
    # Where no step leads on, parameters so many steps ahead are tried: the system may refuse them.
    refused: float = 10.0
    # A motion smaller than this, in natural units, sticks for good: slips grow as the third power
    # of their duration.
    standing: float = 1e-11
    # The largest speed of an impact that has just appeared, in natural units.
    slow: float = 1e-2
    # At a change of events something vanishes: it is at most this there, in natural units.
    witness: float = 1e-6
    # A rest that is shorter than this at a change of events, in natural times, vanishes there: it
    # is nearly as short as the root of the change's bracket.
    short_rest: float = 1e-2
    # An orbit that is farther than this from a change of events, and has no orbits with other
    # events beside it, is at no change: the two orbits between which it was solved for lie on two
    # branches.
    far: float = 1e-3
    # Two orbits at one value of the parameter are the same within this share of a probe's distance.
    same: float = 0.01
    # The distance to a second orbit on the branch, which gives the tangent at another section.
    along: float = 1e-6


SETTINGS = OtherSideSettings()


def events_at(point: OrbitPoint) -> EventSequence:
    """The events of a point's orbit."""
    return events_of(point.evaluation)


def events_of(evaluation: Any) -> EventSequence:
    """The events in equations that were evaluated with extremes."""
    found: EventSequence | None = evaluation.events
    assert found is not None
    return found


def same_events(reference: OrbitPoint) -> TestFunction:
    """The test function of changes of events: how far an orbit is from having other events than a
    reference, or an event at its section. It is negative where the events are others."""
    sequence = events_at(reference).sequence

    def value(point: OrbitPoint) -> float:
        found = events_at(point)
        if found.sequence != sequence:
            return -max(found.distance, TINY)
        return float(min(found.distance, found.section_distance - EVENTS.section_distance))

    return TestFunction(SpecialKind.SW, value, 1e-12, one_sided=True)


def change_at(zero: Zero, reference: OrbitPoint) -> Cut | End:
    """The cut at a zero of `same_events`, with a special point of the kind of change, or without
    one if nothing changes but the section or an accumulation. An end if no change is located
    because the orbits beyond belong to another branch."""
    if _stands(zero.point):
        return Cut(zero.point, SpecialPoint(SpecialKind.AS, zero.point, zero.evidence))
    if _section_comes(zero.point):
        return Cut(zero.point, None)
    # both halves of an orbit that is its own image change at once: look at one of them
    parent = parent_of(zero.point)
    here, before = (
        (zero.point, events_at(reference)) if parent is None else (parent, events_at(parent))
    )
    place, other = next(_beside(here, before.sequence), (here.place, None))
    if other is None and events_at(zero.point).distance > SETTINGS.far:
        return End(CurveEnd.NOT_LOCATED, zero.parameter, SpecialKind.SW)
    if other is None:
        kind: SpecialKind | None = SpecialKind.SW
    elif _rest_vanishes(events_at(here), events_of(other)):
        kind = SpecialKind.CH
    elif _is_discontinuous(here, place, other):
        kind = first_change(events_at(here), events_of(other))
    else:
        kind = kind_between(before, events_of(other))
    if other is None and events_at(zero.point).distance > SETTINGS.witness:
        return Cut(zero.point, None)  # nothing vanishes there
    evidence = replace(zero.evidence, witness=events_at(zero.point).witness)
    return Cut(zero.point, None if kind is None else SpecialPoint(kind, zero.point, evidence))


def refused_beyond(point: OrbitPoint, step: float, bounds: Bounds) -> End | None:
    """The end of a branch beyond which the system refuses the parameters; it is a bound if the
    refusal begins there. None if the system accepts the parameters ahead, so that something else
    stops the steps."""
    ahead = point.parameters + SETTINGS.refused * step * point.tangent[-len(point.parameters) :]
    try:
        point.curve.equations.system_at(ahead)
    except SaltusError as refusal:
        near = [
            (name, bound)
            for name, pair in bounds.items()
            for bound in pair
            if np.isclose(bound, point.parameter, rtol=1e-9)
        ]
        return (
            End(CurveEnd.BOUND, near[0][1])
            if near
            else End(OrbitEnd.REFUSED, point.parameter, detail=str(refusal))
        )
    return None


def stalled_at(
    point: OrbitPoint, step: float, points: Sequence[OrbitPoint] = ()
) -> Cut | End | None:
    """The cut at the last point of a branch, beyond which no step leads, if events change there:
    the branch turns round or ends.

    Where multipliers grow without bound towards the change, orbits cannot be solved for all the way
    to it; the rest of the way is part of the bracket.
    """
    here = parent_of(point) or point
    _, beside = next(_beside(here, events_at(here).sequence), (None, None))
    if beside is None:
        return End(OrbitEnd.TURNS, point.parameter) if _turns_at_an_impact(point) else None
    test = same_events(point)
    width = step * np.abs(np.array(point.curve.scales))
    there = -max(events_of(beside).distance, TINY)
    value = test.value(point)
    known = [(value, point.parameters)]
    for before in reversed(points):
        if before.curve.joins(point.curve) and test.value(before) > SETTINGS.fall * max(
            known[-1][0], TINY
        ):
            known.append((test.value(before), before.parameters))
    if len(known) > 1:
        # if rounding keeps the residual of the last orbit large, its distance from the change is
        # not known: use earlier ones
        (near, place), (far, other) = (
            known[1:3] if len(known) > 2 and point.residual > SETTINGS.rounded else known[:2]
        )
        width = np.maximum(
            width,
            SETTINGS.doubt
            * np.abs(place - near / (far - near) * (other - place) - point.parameters),
        )
    evidence = Evidence(point.residual, tuple(map(float, width)), value, there, value)
    return change_at(SpecialPoint(SpecialKind.SW, point, evidence), point)


def _turns_at_an_impact(point: OrbitPoint) -> bool:
    """Whether a friction in a contact stops sliding just at an impact, up to a small speed."""
    system = point.orbit.system
    inner = system.in_gap_coordinates.model
    pressed = [friction for friction in inner.frictions if friction.contact is not None]
    if not pressed:
        return False
    motion = point.orbit.motion()
    for event in motion.events.of(EventKind.IMPACT):
        position = motion.at(event.time)[0]
        if inner.has_multipliers:
            after = np.append(np.atleast_1d(position), np.atleast_1d(event.velocity_after))
            values = RowValues(system)
            rates = values.along(np.array([event.time]), after[None])[1][0, values.count :]
            slips = [
                abs(rate)
                for each, rate in zip(inner.frictions, rates.tolist(), strict=True)
                if each in pressed
            ]
        else:
            _, speed = system.to_gaps(event.time, position, event.velocity_after)
            slips = [
                abs(speed[inner.coordinates.index(each.coordinate)] - float(each.ground_speed))
                for each in pressed
            ]
        if min(slips) < SETTINGS.probes[0] * point.orbit.equations.natural.speed:
            return True
    return False


def _stands(point: OrbitPoint) -> bool:
    """Whether a system with friction does not move, up to rounding: it sticks, and may do so at any
    position nearby.
    """
    orbit = point.orbit
    return (
        bool(orbit.equations.system.model.frictions)
        and orbit.reach[1] - orbit.reach[0] < SETTINGS.standing * orbit.equations.natural.length
    )


def beyond(cut: Cut, points: Sequence[OrbitPoint]) -> OrbitPoint | End:
    """The point with which a branch, whose last point is at a cut, goes on beyond it: with other
    events, or from another section. Or the reason why it ends."""
    if _stands(cut.point):
        return End(OrbitEnd.STICKS, cut.point.parameter)
    # at the parent's orbit rounding decides which events are found: exclude none
    born = parent_of(cut.point) is not None
    sequence = None if born else events_at(cut.point).sequence
    if cut.special is not None and cut.special.kind == SpecialKind.CH:
        return End(OrbitEnd.REST_VANISHES, cut.point.parameter, SpecialKind.CH)
    if _section_comes(cut.point):
        return _from_another_section(cut.point) or End(OrbitEnd.NO_SECTION, cut.point.parameter)
    found = other_events(cut.point, sequence, points)
    if isinstance(found, End) and cut.special is None:
        return _from_another_section(cut.point) or found
    return found


def other_events(
    point: OrbitPoint, sequence: Events | None, points: Sequence[OrbitPoint] = ()
) -> OrbitPoint | End:
    """An orbit beside a point that has other events than `sequence`, with the direction away from
    the point; or why there is none.

    Orbits of the branch itself (`points`) are excluded: between two changes that nearly coincide
    the search could find the way back.
    """
    reason = OrbitEnd.NO_OTHER_EVENTS
    detail = ""
    sides = list[tuple[np.ndarray, np.ndarray]]()
    curve = point.curve.with_equations(point.curve.equations)

    def solved(place: np.ndarray, direction: np.ndarray, probe: float) -> OrbitPoint | None:
        ahead: OrbitPoint | None = curve.solve_within(place, direction, SETTINGS.near * probe)
        if (
            ahead is None
            or events_at(ahead).sequence == sequence
            or not _leads_away(point, ahead, probe)
        ):
            return None
        return None if is_image(ahead) or _lies_on(points, ahead, SETTINGS.same * probe) else ahead

    for beside, evaluation in _beside(point, sequence):
        if _is_discontinuous(point, beside, evaluation):
            reason = OrbitEnd.NOT_CONTINUOUS
            detail = f"{np.abs(evaluation.residual).max():.3g}"
            continue
        tangent = curve.along_kernel(Corrected(point.place, evaluation, 0)).tangent
        sides.append((beside, tangent))
        for probe, direction in product(SETTINGS.probes, (tangent, -tangent)):
            if (ahead := solved(point.place + probe * direction, direction, probe)) is not None:
                return _clear_of_section(ahead)
    for (beside, tangent), probe, sign in product(sides[:2], SETTINGS.steep_probes, (1.0, -1.0)):
        place = _just_beyond(
            point, point.place + sign * probe * tangent, beside - point.place, probe
        )
        if place is not None and (ahead := solved(place, sign * tangent, probe)) is not None:
            return _clear_of_section(ahead)
    return End(reason, point.parameter, detail=detail)


def _just_beyond(
    point: OrbitPoint, place: np.ndarray, way: np.ndarray, probe: float
) -> np.ndarray | None:
    """The place just beyond the change of events on a line through `place`, in the direction `way`
    in which they change beside the point; None if it cannot be found.

    Where the map has a square root, an orbit beyond may be as near to the change as the square of
    its distance from the point. Newton's method then converges only if it begins between the change
    and this orbit.
    """
    axis = way / point.curve.norm(way)
    known = list[tuple[float, float]]()
    for _ in range(SETTINGS.secants):
        at = (
            -SETTINGS.approach[len(known)] * probe if len(known) < 2 else _zero_of_line(*known[-2:])
        )
        if len(known) > 1 and not abs(at - known[-1][0]) > SETTINGS.inside * probe**2:
            return np.asarray(place + (at + SETTINGS.inside * probe**2) * axis)
        evaluation = point.curve.evaluate(place + at * axis, thorough=True)
        if evaluation is None or events_of(evaluation).sequence != events_at(point).sequence:
            return (
                np.asarray(place + (at + SETTINGS.inside * probe**2) * axis)
                if len(known) > 1
                else None
            )
        known.append((at, events_of(evaluation).distance))
    return None


def first_step(point: OrbitPoint, ahead: OrbitPoint) -> float:
    """The longest first step beyond a change of events or of the section, from the first orbit
    `ahead` of it.
    """
    way = ahead.curve.norm(ahead.place - point.place)
    return SETTINGS.first * way if way > SETTINGS.near * SETTINGS.probes[0] else np.inf


def parent_at(cut: Cut, points: Sequence[OrbitPoint]) -> SpecialPoint | None:
    """The special point of the parent's branch if a family ends there at a change of events, at
    which multipliers jump (see `jump_over`); else None."""
    near = TOLERANCES.grazing_orbits
    point = cut.point
    if cut.special is None or all(is_image(known, near) for known in points):
        return None
    # how far the change itself may still be
    way = cut.special.evidence.bracket / max(abs(point.tangent[-1]), TINY)
    parent = parent_of(point, max(near, way * float(np.abs(point.tangent[:-1]).max())))
    if parent is None:
        return None
    return SpecialPoint(
        SpecialKind.BPC if cut.point.orbit.signature.period % 2 else SpecialKind.PD,
        parent,
        cut.special.evidence,
    )


def located_beyond(cut: Cut, following: OrbitPoint) -> SpecialPoint | None:
    """The special point of a change of events from its other side, where multipliers are smaller
    by far: there the distance from the change is a smooth function, whose zero is extrapolated from
    orbits that are ever nearer to it. None where this side is no better.

    At a grazing the map has a square root on the side with the impact, and none on the other.
    """
    special = cut.special
    assert special is not None
    own, other = (p.orbit.largest_multiplier for p in (cut.point, following))
    if not own > SETTINGS.fall * max(1.0, float(other)):
        return None
    sequence = events_at(following).sequence
    way = following.curve.norm(following.place - cut.point.place)
    far = following.beside(0.5 * way)
    if far is None or events_at(far).sequence != sequence:
        return None
    # places along the tangent of `following`, and the distances from the change there
    near, known = (
        following,
        [(0.5 * way, events_at(far).distance), (0.0, events_at(following).distance)],
    )
    for _ in range(SETTINGS.secants):
        if known[-1][1] <= SETTINGS.touching:
            break
        zero = _zero_of_line(*known[-2:])
        # just before the zero, so that the events are still those of this side
        at = zero + SETTINGS.just_before * (known[-1][0] - zero)
        ahead = following.beside(at) if np.isfinite(at) else None
        if ahead is None or events_at(ahead).sequence != sequence:
            break
        near = ahead
        known.append((at, events_at(ahead).distance))
    value = known[-1][1]
    if near is following or value > SETTINGS.touching:
        return None
    left = abs(_zero_of_line(*known[-2:]) - known[-1][0])
    widths = SETTINGS.doubt * left * np.abs(near.tangent[-len(near.parameters) :])
    witness = events_at(near).witness
    brackets = tuple(map(float, widths))
    evidence = Evidence(near.residual, brackets, known[0][1], -TINY, value, witness)
    return SpecialPoint(special.kind, near, evidence)


def jump_over(cut: Cut, following: OrbitPoint) -> SpecialPoint | None:
    """The period doubling (for a symmetric orbit, the symmetry breaking) at a change of events
    where a multiplier jumps over -1.

    At a grazing-sliding the map is continuous and its derivative is not. Let the numbers of
    multipliers below -1 on the two sides add up to an odd number. Then the branch of the doubled
    orbit begins there, although no orbit has a multiplier of -1 (M. I. Feigin 1970; M. di Bernardo,
    M. Feigin, S. Hogan, M. Homer, Chaos, Solitons and Fractals 10 (1999) 1881).
    """
    if cut.special is None or cut.special.kind != SpecialKind.GS:
        return None
    test = FLIP[cut.point.orbit.symmetric]
    way = following.place - cut.point.place
    place = cut.point.place + SETTINGS.beside[-1] / following.curve.norm(way) * way
    evaluation = following.curve.evaluate(place, thorough=True)
    if evaluation is None or events_of(evaluation).sequence != events_at(following).sequence:
        return None
    before, after = (
        test.value(point)
        for point in (cut.point, replace(following, place=place, evaluation=evaluation))
    )
    evidence = replace(cut.special.evidence, before=before, after=after, value=before)
    return SpecialPoint(test.kind, cut.point, evidence) if before * after < 0.0 else None


def _zero_of_line(first: tuple[float, float], second: tuple[float, float]) -> float:
    """The zero of the straight line through two pairs (place, value); nan if the values are
    equal.
    """
    rise = second[1] - first[1]
    return second[0] - second[1] * (second[0] - first[0]) / rise if rise else np.nan


def _lies_on(points: Sequence[OrbitPoint], ahead: OrbitPoint, same: float) -> bool:
    """Whether an orbit lies on the branch of these points: the branch, solved at its parameter,
    passes it no farther than `same`."""
    begun = End(OrbitEnd.START)
    sequence = events_at(ahead).sequence
    course: Course[OrbitPoint, SpecialPoint] = Course(tuple(points), (), (begun, begun), ())
    for i, (a, b) in enumerate(pairwise(points)):
        passed = min(a.parameter, b.parameter) <= ahead.parameter <= max(a.parameter, b.parameter)
        if passed and sequence in (events_at(a).sequence, events_at(b).sequence):
            places = [
                nearest(known, known.place, ahead)
                for known in course.solved_between(i, ahead.parameter)
            ]
            if any(
                place is not None and ahead.curve.norm(place - ahead.place) < same
                for place in places
            ):
                return True
    return False


def _leads_away(point: OrbitPoint, ahead: OrbitPoint, probe: float) -> bool:
    """Whether a solution is near to where it was looked for, and its tangent leads away from the
    point.
    """
    chord = ahead.place - point.place
    return (
        point.curve.norm(chord) < SETTINGS.near * probe
        and float(ahead.tangent @ (point.curve.weights**2 * chord)) > 0.0
    )


def _is_discontinuous(point: OrbitPoint, place: np.ndarray, evaluation: Any) -> bool:
    """Whether the map jumps at an orbit: a motion from a place very near to it ends away from it,
    farther than its multipliers, or those of the motion, stretch this distance; and no less far
    from a place that is nearer still.
    """
    units = point.curve.equations.units
    apart = units.residual(evaluation.residual)
    if apart <= SETTINGS.jump:
        return False
    way = place - point.place
    size = units.unknowns * np.ones(len(evaluation.residual))
    largest = max(1.0, point.orbit.largest_multiplier)
    monodromy = evaluation.monodromy() / np.outer(size, 1.0 / size)
    if np.isfinite(monodromy).all():  # a motion that passes a grazing has no derivatives
        largest = max(largest, float(np.linalg.norm(monodromy, 2)))
    if apart <= SETTINGS.stretched * largest * point.curve.norm(way):
        return False
    nearer = point.curve.evaluate(point.place + 0.1 * way, thorough=True)
    if nearer is None or events_of(nearer).sequence != events_of(evaluation).sequence:
        return True
    return bool(units.residual(nearer.residual) > SETTINGS.shrunk * apart)


def _beside(point: OrbitPoint, sequence: Events | None) -> Iterator[tuple[np.ndarray, Any]]:
    """Places beside a point, with the equations evaluated there, where the events differ from
    `sequence` or the map jumps: one place for each such sequence at each distance. State variables
    that are held at the section stay held, as on all nearby orbits."""
    equations = point.curve.equations
    held = equations.held(point.solution.unknowns, equations.system_at(point.parameters))
    axes = np.delete(np.eye(len(point.place)) / point.curve.weights, list(held), axis=0)
    for distance in SETTINGS.beside:
        known = set()
        for direction in (point.tangent, -point.tangent, *axes, *-axes):
            place = point.place + distance * direction
            evaluation = point.curve.evaluate(place, thorough=True)
            if evaluation is None:
                continue
            kind = events_of(evaluation).sequence, _is_discontinuous(point, place, evaluation)
            if kind != (sequence, False) and kind not in known:
                known.add(kind)
                yield place, evaluation


def _section_comes(point: OrbitPoint) -> bool:
    """Whether a zero of `same_events` only means that an event has come to the section."""
    found = events_at(point)
    return found.section_distance - EVENTS.section_distance < min(
        found.distance, EVENTS.section_distance
    )


def _clear_of_section(ahead: OrbitPoint) -> OrbitPoint:
    """The first point beyond a change, at another section if an event has appeared too near to its
    own.
    """
    near = events_at(ahead).section_distance < EVENTS.section_distance
    return (_from_another_section(ahead) if near else None) or ahead


def _from_another_section(point: OrbitPoint) -> OrbitPoint | None:
    """The same orbit with its section farther from all events, and with its tangent there."""
    equations: Any = point.orbit.equations
    signature, unknowns = equations.section_along(point.orbit.followed, point.solution)
    moved = equations.with_signature(signature)
    near = point.beside(SETTINGS.along)
    first = PeriodicOrbit.near(moved, unknowns, point.parameters)
    if near is None or first is None:
        return None
    # both states in the same forcing period: otherwise the tangent would lead from one state of the
    # orbit to another state of it
    guess = equations.unknowns_at(
        signature, near.solution.unknowns, near.parameters, first.solution.unknowns
    )
    second = None if guess is None else PeriodicOrbit.near(moved, guess, near.parameters)
    if second is None:
        return None
    solution = first.solution
    apart = second.solution.unknowns - first.solution.unknowns
    found = Corrected(
        np.append(solution.unknowns, solution.values), solution.evaluation, solution.iterations
    )
    curve = point.curve.with_equations(moved)
    there: OrbitPoint | None = curve.with_tangent(
        found, np.append(apart, near.parameters - point.parameters) / SETTINGS.along
    )
    return there


def kind_between(before: EventSequence, after: EventSequence) -> SpecialKind | None:
    """The kind of change between two neighbouring orbits; None if only the number of impacts of an
    accumulation changes.
    """
    kinds = [
        Counter(event.kind for event in found.sequence if event.kind > CORNER)
        for found in (before, after)
    ]
    more = {
        kind: kinds[1][kind] - kinds[0][kind]
        for kind in {*kinds[0], *kinds[1]}
        if kinds[1][kind] != kinds[0][kind]
    }
    sticks = more.get(EventCode.STICK, 0)
    reversals = more.get(EventCode.REVERSAL, 0)
    if reversals:
        return SpecialKind.CS if sticks * reversals < 0 else SpecialKind.SS
    if sticks:
        richer = after if sticks > 0 else before
        stuck = richer.until_next((EventCode.STICK, EventCode.SLIP))
        slid = richer.until_next((EventCode.SLIP, EventCode.STICK))
        return SpecialKind.GS if stuck < slid else SpecialKind.AS
    rests = more.get(EventCode.HELD, 0)
    impacts = more.get(EventCode.IMPACT, 0)
    if rests and rests == more.get(EventCode.RELEASE, 0):
        return SpecialKind.CH if impacts * rests < 0 else SpecialKind.RL
    if set(more) != {EventCode.IMPACT}:
        return SpecialKind.SW
    return SpecialKind.GR if min(before.distance, after.distance) < SETTINGS.slow else None


def _rest_vanishes(here: EventSequence, other: EventSequence) -> bool:
    """Whether the rest after an accumulation has no duration left in an orbit at a change of
    events, beyond which impacts of the accumulation count.

    Beyond it the impacts grow again, and may then die away a second time: whether the motion rests
    there hangs on the last bits, so that the number of rests on the other side decides nothing.
    """
    force_or_time = here.witness in (REACTION, TIME_BETWEEN)
    rest = here.until_next((EventCode.HELD, EventCode.RELEASE))
    vanishes = force_or_time and rest < SETTINGS.short_rest * here.natural_time
    return vanishes and other.impact_count > here.impact_count


def first_change(before: EventSequence, after: EventSequence) -> SpecialKind:
    """The kind of change at which two motions from one section part, by the first event that only
    one of them has.
    """
    together = SETTINGS.together * before.natural_time
    for i in range(max(len(before.events), len(after.events))):
        here = [
            (found.times[i], found.events[i]) for found in (before, after) if i < len(found.events)
        ]
        if len(here) == 2 and here[0][1] == here[1][1] and abs(here[0][0] - here[1][0]) < together:
            continue
        kinds = {event.kind for time, event in here if time - min(here)[0] < together}
        if EventCode.REVERSAL in kinds:
            return SpecialKind.CS
        names = {
            EventCode.STICK: SpecialKind.GS,
            EventCode.SLIP: SpecialKind.AS,
            EventCode.IMPACT: SpecialKind.GR,
        }
        return next(
            (kind for code, kind in names.items() if code == min(here)[1].kind), SpecialKind.SW
        )
    return SpecialKind.SW
