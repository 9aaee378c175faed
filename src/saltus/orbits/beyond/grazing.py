"""The continuation of a branch through a grazing: the signature on its other side, and the
direction with admissible orbits.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from saltus.continuation import End
from saltus.flow import SegmentColumn
from saltus.orbits.beyond.orbit_curve import OrbitPoint, grazing
from saltus.orbits.beyond.special_point import OrbitEnd
from saltus.orbits.contract.equations import OrbitEquations
from saltus.orbits.signature import TOLERANCES, Signature

PROBES: tuple[float, ...] = tuple(
    10.0 ** -np.arange(2, 12.0)
)  # distances along the new branch, tried in turn until one direction has admissible orbits


def repeats(signature: Signature, periods: int) -> bool:
    """Whether an orbit of a signature that touches alike after so many forcing periods repeats
    itself after them.
    """
    return signature.part(periods) is not None


def ends_at_another(point: OrbitPoint, periods: int) -> End:
    """The end of a branch at a grazing of an orbit of so many forcing periods."""
    return End(OrbitEnd.GRAZES_ANOTHER, point.parameter, detail=f"orbit of period {periods}")


def other_side(point: OrbitPoint) -> OrbitPoint | End:
    """The point of the branch beyond a grazing, with the direction in which it goes on; or why
    there is none.

    Where the gap touches zero between impacts, the new signature has a pair of impacts without
    speed there, or a single one at a wall, which turns the motion round. Impacts that have lost
    their speed are left out of it.

    Where the orbit repeats a shorter one that grazes, several families meet, which differ in the
    touches that are impacts. By one rule, for one contact and for several, orbits keep their
    period: one of the touches changes, and the new orbit must not repeat the shorter one. Else the
    branch ends at the grazing of that orbit, whose own branch goes on by itself.
    """
    covered = point.orbit.equations.covered(point.solution)
    if covered is not None and _turns_round(
        point.orbit.equations, point.orbit.signature.along()[0]
    ):
        for changed in _with_one_touch_changed(point, covered):
            if isinstance(following := _begun(point, *changed), OrbitPoint):
                return following
        return ends_at_another(point, covered)
    found = removed(point) if is_slow(point) else inserted(point)
    return found if isinstance(found, End) else _begun(point, *found)


def _with_one_touch_changed(
    point: OrbitPoint, covered: int
) -> Iterator[tuple[OrbitEquations, np.ndarray]]:
    """The problems, with their unknowns, in which one touch of a grazing orbit that repeats itself
    after `covered` forcing periods becomes an impact, or no longer is one. The orbits of each have
    the period of the point's, and are not those of the point seen some periods later.
    """
    equations = point.orbit.equations
    signature = point.orbit.signature
    pairs = point.solution.unknowns.reshape(-1, 2) if signature.sides else np.empty((0, 2))
    slow = pairs[:, 1] < TOLERANCES.touch * equations.natural.speed
    phase = pairs[slow][0, 0] if slow.any() else _lowest_touch(point)[1]
    touches = phase + math.tau * covered * np.arange(signature.period // covered)
    apart = (pairs[slow][:, 0] - touches[:, None] + math.pi) % equations.closing - math.pi
    struck = [bool(near.any()) for near in np.abs(apart) < TOLERANCES.pair]
    turned = [struck[i:] + struck[:i] for i in range(len(struck))]
    for i in range(len(struck)):
        changed = [is_impact != (j == i) for j, is_impact in enumerate(struck)]
        if changed in turned or any(
            changed[k:] + changed[:k] == changed for k in range(1, len(changed))
        ):
            continue
        chosen = [
            [touch, 0.0] for touch, is_impact in zip(touches, changed, strict=True) if is_impact
        ]
        places = np.array([*pairs[~slow].tolist(), *chosen])
        begin = places[0, 0]
        places[:, 0] = begin + (places[:, 0] - begin) % equations.closing
        places = places[np.argsort(places[:, 0], kind="stable")]
        sides = (signature.along()[0],) * len(places)
        yield equations.with_signature(Signature(sides, signature.period)), places.ravel()


def _lowest_touch(point: OrbitPoint) -> tuple[int, float]:
    """The segment in which the gap has its least minimum, and the phase of this minimum."""
    extremes = point.evaluation.extremes
    segment = int(np.argmin(extremes[:, SegmentColumn.LOWEST_GAP]))
    frequency = point.orbit.equations.frequency(point.solution.values)
    return segment, float(extremes[segment, SegmentColumn.LOWEST_GAP_TIME]) * frequency


def _begun(point: OrbitPoint, equations: OrbitEquations, unknowns: np.ndarray) -> OrbitPoint | End:
    """The point of a grazing in the equations of another signature, with the direction in which it
    has orbits; or why there is none.
    """
    curve = point.curve.with_equations(equations)
    known = curve.known(unknowns, point.parameters)
    if known is None:
        return End(OrbitEnd.NO_MOTION, point.parameter, detail="on the other side of")
    return admissible_direction(curve.along_kernel(known)) or End(
        OrbitEnd.NO_DIRECTION, point.parameter
    )


def is_slow(point: OrbitPoint) -> bool:
    """Whether an impact has lost its speed, so that the grazing is not one between impacts."""
    orbit = point.orbit
    return orbit.slowest < TOLERANCES.touch * orbit.equations.natural.speed


def admissible_direction(
    start: OrbitPoint, probes: Sequence[float] = PROBES, begun: bool = False
) -> OrbitPoint | None:
    """The point with the direction in which orbits are admissible; with `begun` the first such
    orbit itself, as the equations are degenerate at `start`."""
    for probe in probes:
        for point in (start, start.turned()):
            ahead = point.beside(probe)
            if ahead is not None and ahead.orbit.admissible and grazing(ahead) > 0.0:
                return ahead if begun else point
    return None


def _turns_round(equations: OrbitEquations, side: int) -> bool:
    """Whether an impact stays on its side, as at a wall."""
    model = equations.system.one_contact
    load = equations.system.load
    impact = equations.system.impact
    return bool(model.reset(0.0, 1.0, side, load, impact)[0] == side)


def inserted(point: OrbitPoint) -> tuple[Any, np.ndarray]:
    """The problem whose signature has additional impacts where the gap touches zero, and its
    unknowns: they have no speed.
    """
    equations = point.orbit.equations
    signature = point.orbit.signature
    segment, phase = _lowest_touch(point)
    side = signature.along()[segment]
    sides = (side,) if _turns_round(equations, side) else (side, -side)
    touches = np.array([phase, 0.0] * len(sides))
    if not signature.sides:
        return equations.with_signature(Signature(sides, signature.period)), touches
    place = segment + 1
    longer = Signature(
        (*signature.sides[:place], *sides, *signature.sides[place:]),
        signature.period,
        signature.symmetric,
    )
    unknowns = point.solution.unknowns
    return equations.with_signature(longer), np.concatenate(
        [unknowns[: 2 * place], touches, unknowns[2 * place :]]
    )


def removed(point: OrbitPoint) -> tuple[Any, np.ndarray] | End:
    """The problem whose signature lacks the impacts that have lost their speed, and its unknowns;
    or why there is none.
    """
    equations = point.orbit.equations
    signature = point.orbit.signature
    n = len(signature.sides)
    phases = point.solution.unknowns[::2]
    speeds = point.solution.unknowns[1::2]
    slow = int(np.argmin(speeds))
    if _turns_round(equations, signature.sides[slow]):
        gone = [slow]
    else:
        gone = _vanishing_pair(phases, speeds / equations.natural.speed, slow, equations.closing)
        if not gone:
            return End(OrbitEnd.NOT_UNIQUE, point.parameter)
    kept = [i for i in range(n) if i not in gone]
    if not kept:
        return _without_impacts(point, slow)
    shorter = Signature(
        tuple(signature.sides[i] for i in kept), signature.period, signature.symmetric
    )
    return equations.with_signature(shorter), point.solution.unknowns.reshape(n, 2)[kept].ravel()


def _vanishing_pair(phases: np.ndarray, speeds: np.ndarray, slow: int, closing: float) -> list[int]:
    """The impact without speed, in natural units, and the neighbour that vanishes with it."""
    n = len(phases)
    if n < 2:
        return []
    later = phases[(slow + 1) % n] + (closing if slow + 1 == n else 0.0) - phases[slow]
    earlier = phases[slow] - phases[slow - 1] + (closing if slow == 0 else 0.0)
    neighbour, distance = (
        ((slow + 1) % n, later) if abs(later) < abs(earlier) else ((slow - 1) % n, earlier)
    )
    return (
        [slow, neighbour]
        if abs(distance) < TOLERANCES.pair and speeds[neighbour] < TOLERANCES.pair
        else []
    )


def _without_impacts(point: OrbitPoint, slow: int) -> tuple[Any, np.ndarray] | End:
    """An orbit that only touches the contact once a period, as an orbit without impacts: the
    problem and the state at phase 0.
    """
    equations = point.orbit.equations
    signature = point.orbit.signature
    if signature.symmetric:
        return End(OrbitEnd.GRAZES_INTO_REST, point.parameter)
    touch = point.solution.unknowns[2 * slow]
    lengths = np.diff(
        np.append(point.solution.unknowns[::2], point.solution.unknowns[0] + equations.closing)
    )
    side = signature.along()[int(np.argmax(lengths))]
    phase_zero = 2.0 * np.pi * np.ceil(touch / (2.0 * np.pi))
    contact = np.array([float(equations.system_at(point.solution.values).model.contact), 0.0])
    # families of several periods may meet here: take the shortest period
    for periods in range(1, signature.period + 1):
        other: Any = equations.with_signature(Signature((), periods, False, side))
        state = other.carried(contact, touch, phase_zero, point.solution.values)
        later = other.carried(contact, touch, phase_zero + other.closing, point.solution.values)
        if (
            state is not None
            and later is not None
            and np.abs((later - state) / equations.natural.state).max() < TOLERANCES.touching_state
        ):
            return other, state
    return End(OrbitEnd.NO_MOTION, point.parameter, detail="from")
