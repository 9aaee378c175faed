"""The segments of an orbit with one contact, or without contacts, as expressions for its proof.

The unknowns of an impact are its time t and the speed s at which the gap closes.
The unknowns of an orbit without impacts are its state at phase 0.
"""

from __future__ import annotations

import numpy as np

from saltus.bounds import Gap, Segment, Tape, Unknowns, as_ball, coordinate, velocity
from saltus.orbits.segments.segments import CannotProve, OrbitSegments, names_of_states
from saltus.orbits.signature import Signature
from saltus.systems import System, numbers
from saltus.taylor import Expr, Trace, number, substitute, trace

SIDE = Expr("side")
POSITION = coordinate(0)
RATE = velocity(0)
IMPACT = ("time", "speed")  # the unknowns of an impact


def one_contact_segments(
    system: System,
    signature: Signature,
    unknowns: np.ndarray,
    frequency: float,
    touch: float | None = None,
) -> OrbitSegments | CannotProve:
    """The segments of an orbit of `OneContactEquations`, from their unknowns (phases and speeds of
    impacts, or the state at phase 0); with a `touch` of the contact at this time.
    """
    reason = refused(trace(system))
    if reason is not None:
        return CannotProve(reason)
    maker = _Maker(system)
    states = names_of_states(system.model.coordinates)
    if not signature.sides:
        if touch is not None:
            guess = np.array([[touch, 0.0]])
            touching = maker.touching(signature)
            return OrbitSegments((touching,), guess, (IMPACT,), states, touching=0)
        section = maker.section(signature)
        return OrbitSegments((section,), unknowns[None], (states,), states, free_time=False)
    guess = unknowns.reshape(-1, 2).copy()
    guess[:, 0] /= frequency
    if touch is None:
        names = (IMPACT,) * len(guess)
        return OrbitSegments(maker.between_impacts(signature), guess, names, states)
    closing = 2.0 * np.pi * signature.span / frequency
    time = guess[0, 0] + (touch - guess[0, 0]) % closing
    before = int(np.searchsorted(guess[:, 0], time)) - 1
    guess = np.insert(guess, before + 1, [time, 0.0], axis=0)
    segments = maker.between_impacts(signature, before)
    return OrbitSegments(segments, guess, (IMPACT,) * len(guess), states, touching=before + 1)


def refused(traced: Trace) -> str | None:
    """Why a system's motions with at most one contact cannot be enclosed; None if they can."""
    if traced.records:
        return "a load with a record or a pulse is not periodic"
    if traced.modes is not None:
        return "the modes of a Structure are loops, which have no ball arithmetic"
    if traced.first_order:
        return "coordinates of first order are not enclosed yet"
    if traced.several:
        return "contacts or frictions that hold coordinates are not enclosed yet"
    return None


class _Maker:
    """Makes the segments of one system."""

    def __init__(self, system: System) -> None:
        self.system = system
        self.traced = trace(system)
        self.speed = Unknowns(system)[1]
        self.parameters = np.array([float(value) for _, value in numbers(system)])

    def between_impacts(
        self, signature: Signature, touch: int | None = None
    ) -> tuple[Segment, ...]:
        """The segments between the impacts of a signature; the one of number `touch` is cut in two
        by an event without a jump.
        """
        result: list[Segment] = []
        for i, before in enumerate(signature.sides):
            side = int(self._value(self._on(self.traced.next_side, before)))
            start = self._after_impact(before)
            if i != touch:
                result.append(self._segment(side, start, 1, 1))
                continue
            result.append(self._segment(side, start, 1, 2))
            result.append(self._segment(side, self._after_touch(side), 2, 1))
        return tuple(result)

    def touching(self, signature: Signature) -> Segment:
        """The segment of an orbit without impacts, from a touch to the next one."""
        side = signature.side
        return self._segment(side, self._after_touch(side), 2, 2)

    def section(self, signature: Signature) -> Segment:
        """The segment of an orbit without impacts, from phase 0 over its (half) period."""
        unknowns = Unknowns(self.system, free_time=False)
        d = self.traced.dof
        side = signature.side
        acceleration = tuple(self._on(root, side) for root in self.traced.acceleration)
        sign = -1.0 if signature.symmetric else 1.0
        start = tuple(unknowns[j] for j in range(2 * d))
        state = [*map(coordinate, range(d)), *map(velocity, range(d))]
        end = tuple(state[j] - sign * unknowns[j] for j in range(2 * d))
        gaps: tuple[Gap, ...] = ()
        if self.traced.gap_rate is not None:
            gaps = (self._gap(side, 0, 0),)
        return Segment(acceleration, start, end, gaps)

    def _segment(self, side: int, start: tuple[Expr, ...], first: int, last: int) -> Segment:
        """A segment on a side, which ends where the gap closes with the speed of the next event."""
        acceleration = self._on(self.traced.acceleration[0], side)
        rate = self._on(self.traced.gap_rate, side)
        end = (POSITION - self.contact, RATE + self.speed / rate)
        return Segment((acceleration,), start, end, (self._gap(side, first, last),))

    def _gap(self, side: int, first: int, last: int) -> Gap:
        sign = float(np.sign(self._value(self._on(self.traced.gap_rate, side))))
        return Gap(0, sign, self.contact, first, last)

    def _after_impact(self, before: int) -> tuple[Expr, ...]:
        rate = self._on(self.traced.gap_rate, before)
        closing = number(-1.0) / rate * self.speed
        places = {RATE: closing, POSITION: self.contact}
        after = substitute(self._on(self.traced.velocity_after, before), places)
        return (self.contact, after)

    def _after_touch(self, side: int) -> tuple[Expr, ...]:
        rate = self._on(self.traced.gap_rate, side)
        return (self.contact, number(-1.0) / rate * self.speed)

    @property
    def contact(self) -> Expr:
        """The coordinate at the contact."""
        assert self.traced.contact is not None
        return self.traced.contact

    def _on(self, root: Expr | None, side: int) -> Expr:
        """An expression on a side."""
        assert root is not None
        return substitute(root, {SIDE: float(side)})

    def _value(self, root: Expr) -> float:
        """The number of an expression of parameters alone."""
        nothing = as_ball(np.zeros((1, 1)))
        known = as_ball(self.parameters[None])
        values = Tape([root]).values(known, as_ball(np.zeros(1)), nothing, nothing)
        return float(values.middle[0, 0])
