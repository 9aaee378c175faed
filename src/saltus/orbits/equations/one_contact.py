"""The boundary-value problem of a periodic orbit with a given signature, and its derivatives (see
docs/method.md).

The unknowns of an orbit with impacts are, for each impact i, its phase phi_i = Omega t_i and the
speed v_i at which the gap closes. Segment i is the smooth motion on its side from impact i, with
the velocity after the reset, to impact i+1, whatever the sign of the gap w between them. The last
segment ends with the first impact of the next period. The equations of each segment are

    w(t_{i+1}) / (t_{i+1} - t_i) = 0,        -w'(t_{i+1}) - v_{i+1} = 0,

which are regular also at v_i = 0, where the signature changes. The unknowns of an orbit without
impacts are its state at phase 0, and the equation says that the state a period later is the same.
Orbits of a system whose contact is no singularity (`flow/one_contact/regularity.py`) have this
equation too, whatever sides they pass through; grazing is then nothing special. The equations of a
symmetric orbit cover half a period, after which it is its mirror image.
"""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from saltus.continuation import Cut, End, TestFunction, Units, Zero
from saltus.flow import (
    ContactRegularity,
    EventKind,
    SegmentColumn,
    SegmentValue,
    contact_regularity,
    load_segments,
)
from saltus.orbits.beyond.conditions import room
from saltus.orbits.beyond.grazing import inserted, other_side, removed
from saltus.orbits.beyond.orbit_curve import GRAZING, OrbitPoint, curve_test, with_witness
from saltus.orbits.beyond.special_point import SpecialKind
from saltus.orbits.contract.equations import (
    MotionToRead,
    OrbitEquations,
    OrbitEvaluation,
    Solution,
    Witness,
)
from saltus.orbits.segments.one_contact_segments import one_contact_segments
from saltus.orbits.segments.segments import CannotProve, OrbitSegments
from saltus.orbits.signature import TOLERANCES, Signature
from saltus.systems import System, arguments_of, state_of


class Segments(NamedTuple):
    """Smooth segments, in the form that the flow's `follow_segments` takes."""

    # (n, 3): when each segment begins and ends, and the speed of the impact with which it begins
    spans: np.ndarray
    # (n, 2): the side before the impact with which it begins (0 without impact), and the side along
    # it
    sides: np.ndarray
    states: np.ndarray  # (n, 2 d): its first state, if it begins without an impact


class FollowedSegments(NamedTuple):
    """The results of the flow's `follow_segments`."""

    ends: np.ndarray
    columns: np.ndarray  # the derivatives of the ends
    extremes: np.ndarray
    rates: np.ndarray  # the sign of the gap's derivative to the coordinate, on each side


class OneContactEquations(OrbitEquations):
    """The equations from impact to impact of a system with one contact, or without contacts."""

    @classmethod
    def solves(cls, system: System, signature: Signature) -> bool:
        return signature.section is None

    @classmethod
    def read(
        cls, base: OrbitEquations, motion: MotionToRead
    ) -> tuple[OrbitEquations, np.ndarray] | None:
        if not isinstance(base, cls) or base.has_corners:
            return None
        once = motion.once
        periods = motion.periods
        if once.side == 0 or len(once.events.of(EventKind.REST)) or not once.phase_known:
            return None
        if base.passes_contact:
            return base.with_signature(Signature((), periods)), state_of(base.system, motion.state)
        impacts = once.impacts
        # with two sides the number of impacts is even: an impact near the section may have been
        # counted twice, or not at all
        count = len(impacts) - len(impacts) % len(base.system.model.every_side)
        if not count:
            signature = Signature((), periods, False, once.side)
            return base.with_signature(signature), state_of(base.system, motion.state)
        rate = np.abs(impacts.velocity_before[:count])
        sides = tuple(int(s) for s in impacts.side[:count])
        unknowns = np.stack(
            [impacts.time[:count] * base.frequency(base.values), rate], axis=1
        ).ravel()
        return base.with_signature(Signature(sides, periods)), unknowns

    @property
    def has_contact(self) -> bool:
        """Whether the equations of the motion have a gap."""
        return self._run.trace.gap is not None

    def pressing(self, solution: Solution) -> float:
        """Without impacts the gap at the section: where nothing moves it has no minimum that could
        be negative.
        """
        if self.signature.sides or not self.has_contact or self.passes_contact:
            return math.inf
        model: Any = self.system_at(solution.values).model
        gap = float(model.gap(solution.unknowns[0], self.signature.side))
        return gap / self.natural.length

    @cached_property
    def passes_contact(self) -> bool:  # type: ignore[override]
        """Whether the contact is no singularity for any values of the parameters at `paths`, so
        that orbits pass through it.
        """
        if self.signature.sides or not self.has_contact:
            return False
        values = self._values.copy()
        values[self._places] = 0.0  # The answer holds for all of them, and is then computed once.
        return (
            contact_regularity(self._run.trace, tuple(values), self.paths)
            is ContactRegularity.CONTINUOUS
        )

    @property
    def size(self) -> int:
        return 2 * (len(self.signature.sides) or self.own)

    @cached_property
    def units(self) -> Units:
        """Phases and speeds of impacts; at their ends gaps over durations, and speeds."""
        count = len(self.signature.sides)
        if not count:
            return super().units
        _, speed = self.natural.state
        return Units(np.tile([1.0, speed], count), np.full(2 * count, speed), self.is_phase)

    @cached_property
    def is_phase(self) -> np.ndarray:
        places = np.arange(self.size)
        return np.asarray((places % 2 == 0) & bool(self.signature.sides))

    def start(self, solution: Solution) -> dict[str, Any]:
        """Just after the first impact or, without impacts, at phase 0."""
        system = self.system_at(solution.values)
        if not self.signature.sides:
            return arguments_of(system, solution.unknowns)
        model = system.one_contact
        side = self.signature.sides[0]
        frequency = self.frequency(solution.values)
        phase, speed = solution.unknowns[:2]
        time = float((phase - 2.0 * math.pi * math.floor(phase / (2.0 * math.pi))) / frequency)
        _, after = model.reset(
            time, -model.inward(side) * float(speed), side, system.load, system.impact
        )
        return {model.coordinates[0]: float(model.contact), "velocity": float(after), "time": time}

    def impacts(self, solution: Solution) -> tuple[np.ndarray, np.ndarray]:
        unknowns = solution.unknowns
        return (
            (unknowns[::2], unknowns[1::2]) if self.signature.sides else (np.empty(0), np.empty(0))
        )

    def halves(self, solution: Solution, mirrored: bool) -> np.ndarray | None:
        signature = self.signature
        unknowns = solution.unknowns
        n = len(self.signature.sides)
        odd = signature.period % 2
        if signature.symmetric or n % 2 or (odd and not mirrored):
            return None
        if n == 0:
            if odd and self.has_contact and not self.passes_contact:
                return None  # such an orbit stays on one side, and its image on the other one
            found = self.halved.evaluate(unknowns, solution.values)
            return None if found is None else np.stack([unknowns, unknowns + found.residual])
        first = signature.sides[: n // 2]
        second = signature.sides[n // 2 :]
        if second != (tuple(-s for s in first) if odd else first):
            return None
        both = unknowns.reshape(2, n // 2, 2).copy()
        both[1, :, 0] -= np.pi * signature.period
        return np.asarray(both.reshape(2, n))

    def repeated(self, unknowns: np.ndarray) -> np.ndarray:
        if not self.signature.sides:
            return unknowns
        later = unknowns.copy()
        later[::2] += self.closing
        return np.concatenate([unknowns, later])

    def alternating(self, direction: np.ndarray) -> np.ndarray:
        return np.concatenate([direction, -direction]) if self.signature.sides else direction

    def shorter_period(self, solution: Solution, within: float) -> int | None:
        signature = self.signature
        n = len(self.signature.sides)
        for periods in range(1, signature.period):
            part = n * periods // signature.period
            if (
                signature.period % periods
                or n * periods % signature.period
                or part == 0
                or signature.symmetric
            ):
                continue
            pairs = solution.unknowns.reshape(-1, part, 2).copy()
            pairs[:, :, 0] -= 2.0 * math.pi * periods * np.arange(len(pairs))[:, None]
            if (
                signature.sides == signature.sides[:part] * len(pairs)
                and (np.ptp(pairs, axis=0) / self.units.unknowns[:2]).max() < within
            ):
                return periods
        return None

    def covered(self, solution: Solution) -> int | None:
        signature = self.signature
        if signature.symmetric or self.passes_contact:
            return None
        unknowns = solution.unknowns
        pairs = unknowns.reshape(-1, 2) if signature.sides else np.empty((0, 2))
        fast = pairs[:, 1] >= TOLERANCES.touch * self.natural.speed
        sides = np.array(signature.sides, dtype=int)[fast]
        for periods in range(1, signature.period):
            if signature.period % periods or len(sides) * periods % signature.period:
                continue
            part = len(sides) * periods // signature.period
            if len(sides):
                later = np.roll(pairs[fast], -part, axis=0)
                later[len(sides) - part :, 0] += self.closing
                later[:, 0] -= math.tau * periods
                apart = np.abs((later - pairs[fast]) / [1.0, self.natural.speed]).max()
                if (np.roll(sides, -part) == sides).all() and apart < TOLERANCES.grazing_orbits:
                    return periods
                continue
            phase = float(pairs[0, 0]) if len(pairs) else 0.0
            state = (
                np.array([float(self.system_at(solution.values).model.contact), 0.0])
                if len(pairs)
                else unknowns
            )
            again = self.carried(state, phase, phase + math.tau * periods, solution.values)
            moved = (
                math.inf if again is None else np.abs((again - state) / self.natural.state).max()
            )
            if moved < TOLERANCES.touching_state:
                return periods
        return None

    def nearest(
        self, unknowns: np.ndarray, values: np.ndarray, other: OrbitPoint
    ) -> np.ndarray | None:
        """Begun at another impact, and shifted by whole forcing periods."""
        target = other.orbit.signature
        signature = self.signature
        n = len(signature.sides)
        if (n, signature.period, signature.symmetric) != (
            len(target.sides),
            target.period,
            target.symmetric,
        ):
            return None
        if n == 0:
            return unknowns if signature == target else None
        pairs = unknowns.reshape(n, 2)
        best = None
        least = math.inf
        goal = other.solution.unknowns.reshape(n, 2)
        once = [np.array([turn * self.closing, 0.0]) for turn in range(3)]
        # the impacts of three (half) periods
        later = np.concatenate([pairs + shift for shift in once])
        next_sides = (
            tuple(-side for side in signature.sides) if signature.symmetric else signature.sides
        )
        sides = signature.sides + next_sides + signature.sides
        for turn in range(n * (2 if signature.symmetric else 1)):
            if sides[turn : turn + n] != target.sides:
                continue
            rolled = later[turn : turn + n].copy()
            rolled[:, 0] += 2.0 * math.pi * round((goal[0, 0] - rolled[0, 0]) / (2.0 * math.pi))
            distance = float(np.abs((rolled - goal) / self.units.unknowns[:2]).max())
            if distance < least:
                best = rolled.ravel()
                least = distance
        return best

    def witnesses(self, solution: Solution) -> list[Witness]:
        natural = self.natural
        extremes: Any = solution.evaluation.extremes
        gaps = extremes[:, SegmentColumn.LOWEST_GAP] / natural.length
        found = [Witness("gap", True, float(gap)) for gap in gaps]
        speeds = self.impacts(solution)[1] / natural.speed
        found += [Witness("speed of an impact", True, float(speed)) for speed in speeds]
        pressing = self.pressing(solution)
        return [*found, Witness("gap at phase 0", True, pressing)]

    def barrier(self, point: OrbitPoint) -> TestFunction:
        return GRAZING

    def change(self, zero: Zero, point: OrbitPoint) -> Cut | End:
        return Cut(zero.point, with_witness(zero))

    def beyond(self, cut: Cut, points: list[OrbitPoint]) -> OrbitPoint | End:
        return other_side(cut.point)

    def curve_barrier(self, kind: str, point: Any) -> TestFunction:
        return curve_test(SpecialKind[f"{kind}_GR"], room)

    def touched(self, special: Zero) -> tuple[Signature, np.ndarray] | None:
        point = special.point
        # its own signature has the impact, and the gap has a minimum
        if point.orbit.slowest < TOLERANCES.touch * self.natural.speed:
            return point.orbit.signature, point.solution.unknowns
        equations, unknowns = inserted(point)
        return equations.signature, unknowns

    def segments_to_prove(self, solution: Solution) -> OrbitSegments | CannotProve:
        return self._to_prove(solution, None)

    def touching_segments(self, point: OrbitPoint) -> OrbitSegments | CannotProve:
        """In the signature with fewer impacts."""
        orbit = point.orbit
        if orbit.slowest >= TOLERANCES.touch * self.natural.speed:
            extremes = point.evaluation.extremes
            segment = int(np.argmin(extremes[:, SegmentColumn.LOWEST_GAP]))
            time = float(extremes[segment, SegmentColumn.LOWEST_GAP_TIME])
            return self._to_prove(point.solution, time)
        phases, speeds = self.impacts(point.solution)
        time = float(phases[int(np.argmin(speeds))]) / orbit.frequency
        shorter = removed(point)
        if isinstance(shorter, End):
            return CannotProve("the impacts that lose their speed leave no orbit without them")
        fewer: OneContactEquations = shorter[0]
        return fewer._to_prove(replace(point.solution, unknowns=shorter[1]), time)

    def _to_prove(self, solution: Solution, touch: float | None) -> OrbitSegments | CannotProve:
        if self.passes_contact:
            return CannotProve("orbits that pass through their contact are not proved yet")
        system = self.system_at(solution.values)
        frequency = self.frequency(solution.values)
        return one_contact_segments(system, self.signature, solution.unknowns, frequency, touch)

    def evaluate(
        self,
        unknowns: np.ndarray,
        values: np.ndarray,
        with_extremes: bool = False,
        *,
        later: np.ndarray | None = None,
    ) -> OrbitEvaluation | None:
        """The equations at a point, or None where the motion cannot be followed.

        `later` are the unknowns asked for at the end of the period, if they differ from those at
        its beginning.
        """
        frequency, later = self.frequency(values), unknowns if later is None else later
        if not frequency > 0.0:
            return None
        segments = self._segments(unknowns, later, frequency)
        followed = self.follow_segments(segments, values, with_extremes)
        if followed is None:
            return None
        if not self.signature.sides:
            return self._shooting(later, frequency, followed)
        following = np.empty(len(segments.spans))
        following[:-1] = unknowns[3::2]
        following[-1] = later[1]
        return self._crossing(following, frequency, segments, followed)

    def carried(
        self, state: np.ndarray, begin: float, end: float, values: np.ndarray
    ) -> np.ndarray | None:
        """The state at phase `end` of the smooth motion without impacts from a state at phase
        `begin`.
        """
        frequency = self.frequency(values)
        spans = np.array([[begin / frequency, end / frequency, 0.0]])
        sides = np.array([[0, *self._along()]])
        followed = self.follow_segments(Segments(spans, sides, state.reshape(1, -1)), values)
        return (
            None
            if followed is None
            else followed.ends[
                0, SegmentValue.FIRST_STATE : SegmentValue.FIRST_STATE + 2 * self.own
            ]
        )

    def follow_segments(
        self, segments: Segments, values: np.ndarray, with_extremes: bool = False
    ) -> FollowedSegments | None:
        """The smooth motion along segments, with its extremes if asked for; None where a segment
        cannot be followed.
        """
        parameters = self._values.copy()
        for place, value in zip(self._places, values.tolist(), strict=True):
            parameters[place] = value
        env, functions = self._run.structure.prepare(parameters, self._records)
        followed = self._follower.follow_segments((env, functions), segments, with_extremes)
        return (
            None
            if followed is None
            else FollowedSegments(*followed, np.sign(functions.geometry[1:]))
        )

    def _segments(self, unknowns: np.ndarray, later: np.ndarray, frequency: float) -> Segments:
        """The segments between the impacts, the last one up to the first impact of the next
        period.
        """
        n = len(self.signature.sides)
        if not n:
            spans = np.array([[0.0, self.closing / frequency, 0.0]])
            return Segments(spans, self._sides, unknowns.reshape(1, -1).copy())
        spans = np.empty((n, 3))
        spans[:, 0] = unknowns[::2]
        spans[:-1, 1] = unknowns[2::2]
        spans[-1, 1] = later[0] + self.closing
        spans[:, :2] /= frequency
        spans[:, 2] = unknowns[1::2]
        return Segments(spans, self._sides, self._no_states)

    @cached_property
    def _no_states(self) -> np.ndarray:
        """First states of segments that begin with an impact: they are not read."""
        return np.zeros((len(self.signature.sides), 2))

    @cached_property
    def _sides(self) -> np.ndarray:
        """The sides before and along each segment, (n, 2)."""
        sides = self.signature.sides
        along = self._along()
        return np.array(list(zip(sides or (0,), along, strict=True)), dtype=np.int64)

    @cached_property
    def _rate_of(self) -> np.ndarray:
        """The place of each segment's side in `FollowedSegments.rates`, (n,)."""
        return np.where(self._sides[:, 1] > 0, 0, 1)

    def _along(self) -> tuple[int, ...]:
        """The side of each segment; 0 stands for all sides, where the contact is passed through."""
        return (0,) if self.passes_contact else self.signature.along()

    def _shooting(
        self, later: np.ndarray, frequency: float, followed: FollowedSegments
    ) -> OrbitEvaluation:
        own = self.own
        sign = -1.0 if self.signature.symmetric else 1.0
        ends, columns, extremes, _ = followed
        state = ends[0, SegmentValue.FIRST_STATE : SegmentValue.FIRST_STATE + 2 * own]
        rates = ends[0, SegmentValue.FIRST_STATE + own : SegmentValue.FIRST_STATE + 3 * own]
        parameters = sign * columns[0, : 2 * own, 2 * own :]
        place = self._place_of_frequency
        if place >= 0:
            parameters[:, place] -= sign * rates * self.closing / frequency**2
        here = sign * columns[:, : 2 * own, : 2 * own]
        there = -np.eye(2 * own)[None]
        end = self.image_of(state) if self.signature.symmetric else state.copy()
        here[:, self.following] = parameters[self.following] = end[self.following] = 0.0
        return OrbitEvaluation(end - later, here, there, parameters, ends, extremes)

    def _crossing(
        self,
        following: np.ndarray,
        frequency: float,
        segments: Segments,
        followed: FollowedSegments,
    ) -> OrbitEvaluation:
        """The equations of the impacts at the ends of the segments, at which the gap closes with
        the speeds `following`.
        """
        spans = segments.spans
        ends, columns, extremes, rates = followed
        n = len(spans)
        count = len(self.paths)
        sign = rates[self._rate_of]
        residual = np.empty((n, 2))
        here = np.empty((n, 2, 2))
        there = np.empty((n, 2, 2))
        parameters = np.empty((n, 2, count))
        request = (spans, sign, following, float(frequency), self._place_of_frequency)
        load_segments()[1](request, (ends, columns, extremes), (residual, here, there, parameters))
        return OrbitEvaluation(
            residual.ravel(), here, there, parameters.reshape(2 * n, count), ends, extremes
        )
