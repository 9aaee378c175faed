"""The segments of an orbit with several contacts between which none is closed, for its proof.

The unknowns of an impact at contact c, which holds the coordinate q_c, are its time, the speed s at
which the gap closes, the other coordinates, and their velocities before it.
Newton's law turns the velocity of the gap, and the impulse acts along M^-1 e_c:

    v+ = v- + (1 + e) sigma_c s M^-1 e_c / (M^-1)_cc,     sigma_c q_c' = -s before.

A law that transfers velocity between contacts acts only on those that are closed, of which there is
none.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from saltus.bounds import Gap, Segment, Unknowns, coordinate, velocity
from saltus.orbits.segments.segments import CannotProve, OrbitSegments, names_of_states
from saltus.orbits.signature import Signature
from saltus.systems import Mirror, System
from saltus.taylor import Expr, Trace, number, substitute, trace

MOST_COORDINATES = 6  # whose mass matrix is solved in symbols


def contact_segments(
    system: System,
    signature: Signature,
    mirror: Mirror | None,
    phases: np.ndarray,
    states: np.ndarray,
    frequency: float,
    touching: int | None = None,
) -> OrbitSegments | CannotProve:
    """The segments of an orbit of `ContactsEquations`.

    Parameters
    ----------
    system
        The system in gap coordinates.
    signature
        The orbit's events.
    mirror
        The system's mirror symmetry, which a symmetric orbit needs.
    phases
        The phases of its events, (events,).
    states
        The states just before the events, or at phase 0 without events, (events, 2 D).
    frequency
        The forcing frequency.
    touching
        The number of the event that is a touch without a jump, if there is one.
    """
    traced = trace(system)
    reason = _refused(traced, signature)
    if reason is not None:
        return CannotProve(reason)
    maker = _Maker(system, traced)
    names = names_of_states(system.model.coordinates)
    if not signature.events:
        section = maker.section(mirror if signature.symmetric else None)
        return OrbitSegments((section,), states[:1], (names,), names, free_time=False)
    events = list(signature.events)
    half = mirror if signature.symmetric else None
    last = events[0] if half is None else events[0].image(half.parts)
    segments = []
    for i, event in enumerate(events):
        closes = i == len(events) - 1
        following = last if closes else events[i + 1]
        touches = (i == touching, (i + 1) % len(events) == touching)
        segments.append(
            maker.segment(event.contact, following.contact, half if closes else None, touches)
        )
    guess = np.array(
        [
            maker.unknowns_of(event.contact, phase / frequency, state)
            for event, phase, state in zip(events, phases, states, strict=True)
        ]
    )
    event_names = tuple(maker.names_of(event.contact, names) for event in events)
    return OrbitSegments(tuple(segments), guess, event_names, names, touching=touching)


def _refused(traced: Trace, signature: Signature) -> str | None:
    """Why an orbit cannot be enclosed; None if it can."""
    if traced.records:
        return "a load with a record or a pulse is not periodic"
    if traced.modes is not None:
        return "structures, which move in modal coordinates, are not enclosed yet"
    if traced.dof > MOST_COORDINATES:
        return f"models of more than {MOST_COORDINATES} coordinates are not enclosed yet"
    if traced.first_order or traced.dependent:
        return "coordinates of first order and dependent gaps are not enclosed yet"
    if traced.sided:
        return "frictions and surfaces are not enclosed yet"
    if signature.closed or any(not e.is_impact or e.closed for e in signature.events):
        return "orbits on which a contact stays closed are not proved yet"
    return None


class _Maker:
    """Makes the segments of one system."""

    def __init__(self, system: System, traced: Trace) -> None:
        self.traced = traced
        self.dof = traced.dof
        self.unknowns = Unknowns(system)
        self.fixed = Unknowns(system, free_time=False)
        free = {Expr("free", (), i): 1.0 for i in range(self.dof)}
        self.acceleration = tuple(substitute(root, free) for root in traced.acceleration)

    def unknowns_of(self, contact: int, time: float, state: np.ndarray) -> list[float]:
        """The numbers of an impact's unknowns, from the state before it."""
        held = self.traced.contact_coordinates[contact]
        others = self._others(held)
        speed = -self.traced.signs[contact] * state[self.dof + held]
        inner = [*state[others], *state[[self.dof + i for i in others]]]
        return [time, float(speed), *map(float, inner)]

    def names_of(self, contact: int, states: Sequence[str]) -> tuple[str, ...]:
        """The names of an impact's unknowns."""
        held = self.traced.contact_coordinates[contact]
        inner = [states[i] for i in self._others(held)]
        return ("time", "speed", *inner, *(states[self.dof + i] for i in self._others(held)))

    def segment(
        self, begin: int, end: int, mirror: Mirror | None, touches: tuple[bool, bool]
    ) -> Segment:
        """The segment from an impact at contact `begin` to one at contact `end`; the unknowns of
        the latter stand for its image in `mirror`, if there is one, and each may be a touch.
        """
        gaps = tuple(
            Gap(
                self.traced.contact_coordinates[c],
                float(self.traced.signs[c]),
                self.traced.positions[c],
                int(c == begin) + int(c == begin and touches[0]),
                int(c == end) + int(c == end and touches[1]),
            )
            for c in range(len(self.traced.signs))
        )
        start = self._start(begin, touches[0])
        return Segment(self.acceleration, start, self._end(end, mirror), gaps)

    def section(self, mirror: Mirror | None) -> Segment:
        """The segment of an orbit without events over its period, or half of it to its image in
        `mirror`."""
        width = 2 * self.dof
        start = tuple(self.fixed[j] for j in range(width))
        state = [*map(coordinate, range(self.dof)), *map(velocity, range(self.dof))]
        closing = start if mirror is None else _image(mirror, start)
        end = tuple(state[j] - closing[j] for j in range(width))
        gaps = tuple(
            Gap(held, float(sign), position, 0, 0)
            for held, sign, position in zip(
                self.traced.contact_coordinates,
                self.traced.signs,
                self.traced.positions,
                strict=True,
            )
        )
        return Segment(self.acceleration, start, end, gaps)

    def _others(self, held: int) -> list[int]:
        return [i for i in range(self.dof) if i != held]

    def _start(self, contact: int, touch: bool) -> tuple[Expr, ...]:
        """S of an impact, positions and velocities after it; a touch changes no velocity."""
        held = self.traced.contact_coordinates[contact]
        others = self._others(held)
        count = len(self.traced.signs)
        restitution = self.traced.restitution[contact * count + contact]
        if touch:
            restitution = number(-1.0)
        speed = float(self.traced.signs[contact]) * self.unknowns[1]
        positions = [self.traced.positions[contact]] * self.dof
        velocities = [restitution * speed] * self.dof
        for k, i in enumerate(others):
            positions[i] = self.unknowns[2 + k]
        jump = (restitution + 1.0) * speed
        shares = self._shares(held, positions)
        for k, i in enumerate(others):
            before = self.unknowns[2 + len(others) + k]
            velocities[i] = before + shares[k] * jump
        return (*positions, *velocities)

    def _shares(self, held: int, positions: Sequence[Expr]) -> list[Expr]:
        """(M^-1 e_c)_o / (M^-1)_cc for the other coordinates o: M_oo x = -M_oc."""
        others = self._others(held)
        places = {coordinate(i): positions[i] for i in range(self.dof)}
        mass = [substitute(entry, places) for entry in self.traced.mass]
        rows = [
            [*(mass[i * self.dof + j] for j in others), -1.0 * mass[i * self.dof + held]]
            for i in others
        ]
        return _solved(rows)

    def _end(self, contact: int, mirror: Mirror | None) -> tuple[Expr, ...]:
        """E of an impact."""
        held = self.traced.contact_coordinates[contact]
        sign = float(self.traced.signs[contact])
        first = held
        state = [number(0.0)] * (2 * self.dof)  # the held coordinate has equations of its own
        if mirror is not None:
            image = mirror.parts[contact]
            first = self.traced.contact_coordinates[image]
            state[first] = self.traced.positions[image]
            state[self.dof + first] = -float(self.traced.signs[image]) * self.unknowns[1]
        others = self._others(first)
        for k, i in enumerate(others):
            state[i] = self.unknowns[2 + k]
            state[self.dof + i] = self.unknowns[2 + len(others) + k]
        closing = tuple(state) if mirror is None else _image(mirror, tuple(state))
        positions = [coordinate(i) - closing[i] for i in range(self.dof)]
        velocities = [velocity(i) - closing[self.dof + i] for i in range(self.dof)]
        positions[held] = coordinate(held) - self.traced.positions[contact]
        velocities[held] = velocity(held) + sign * self.unknowns[1]
        return (*positions, *velocities)


def _image(mirror: Mirror, state: tuple[Expr, ...]) -> tuple[Expr, ...]:
    """The image of a state, coordinates and then velocities, in symbols."""
    n = len(mirror.centre)
    halves = (state[:n], state[n:])
    positions, velocities = ([_sum(row, half) for row in mirror.turn.tolist()] for half in halves)
    moved = [2.0 * centre + place for centre, place in zip(mirror.centre, positions, strict=True)]
    return (*moved, *velocities)


def _sum(factors: Sequence[float], values: Sequence[Expr]) -> Expr:
    """A sum of values times factors, of which those that are 0 are left out."""
    total = None
    for factor, value in zip(factors, values, strict=True):
        if factor:
            term = factor * value
            total = term if total is None else total + term
    return number(0.0) if total is None else total


def _solved(rows: list[list[Expr]]) -> list[Expr]:
    """The solution of a linear system in symbols, by elimination; the matrix is positive definite,
    so that no pivot vanishes.
    """
    rows = [list(row) for row in rows]
    count = len(rows)
    zero = number(0.0)
    for i in range(count):
        for j in range(i + 1, count):
            if rows[j][i] is zero:
                continue
            factor = rows[j][i] / rows[i][i]
            rows[j] = [a - factor * b for a, b in zip(rows[j], rows[i], strict=True)]
    solution: list[Expr] = [zero] * count
    for i in reversed(range(count)):
        total = rows[i][-1]
        for j in range(i + 1, count):
            total = total - rows[i][j] * solution[j]
        solution[i] = total / rows[i][i]
    return solution
