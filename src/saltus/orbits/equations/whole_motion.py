"""Orbits that are followed through all of their events, x = Phi(x): those with accumulations of
impacts, with dry friction, or under a load with corners.

The unknowns are the state at a section, a phase of the load at which no event happens. The motion
Phi may have any events. Its derivatives come from `sensitivities`, in which an accumulation of
impacts is a single map with the derivatives of its end. Derivatives to coordinates that contacts
hold at the section are 0, and so are those to the speed of a sticking coordinate.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import Any, cast

import numpy as np

from saltus.continuation import Bounds, Cut, End, TestFunction, Zero
from saltus.errors import MotionError, SaltusError
from saltus.flow import (
    EventCode,
    Motion,
    MotionRequest,
    RowValues,
    SegmentColumn,
    Stop,
    continuous_surfaces,
    derivatives_of,
    follow,
    program,
    state_rates,
)
from saltus.orbits.beyond.events import (
    beyond,
    change_at,
    events_of,
    first_step,
    jump_over,
    located_beyond,
    parent_at,
    refused_beyond,
    same_events,
    stalled_at,
)
from saltus.orbits.beyond.orbit_curve import STEEPEST, OrbitPoint
from saltus.orbits.beyond.rest import last_release
from saltus.orbits.beyond.special_point import OrbitEnd
from saltus.orbits.beyond.symmetry import nearest
from saltus.orbits.contract.equations import (
    MotionToRead,
    OrbitEquations,
    OrbitEvaluation,
    Solution,
)
from saltus.orbits.contract.event_sequence import (
    STAYS,
    EventSequence,
    held_at,
    relays_at,
    relays_over_round,
    section_of,
    section_time,
    sequence_of,
)
from saltus.orbits.contract.sampled_motion import SampledMotion, modes_in
from saltus.orbits.orbit import PeriodicOrbit
from saltus.orbits.segments.resting_segments import resting_segments
from saltus.orbits.segments.segments import CannotProve, OrbitSegments
from saltus.orbits.signature import Signature
from saltus.progress import silent
from saltus.systems import System, arguments_of, held_values, substitute
from saltus.taylor import FREQUENCY, record_table

# A contact is closed at the section if its gap and the gap's rate are smaller than this there, in
# natural units.
CLOSED = 1e-9
# How near a branch comes to where a relay turns before its steps shrink, and how far ahead it is
# looked for, in natural units.
NEAR_RELAY = 1e-6


@dataclass(eq=False)
class WholeMotionEvaluation(OrbitEvaluation):
    """The equations at one point, with the events along the motion."""

    events: EventSequence | None  # None if extremes were not asked for
    # the state after half of the time; None if extremes were not asked for, or relays have other
    # sides there
    middle: np.ndarray | None


class WholeMotionEquations(OrbitEquations):
    """The equations x = Phi(x) of a whole motion; for a symmetric orbit x is the mirror image of
    Phi(x) over half a period.
    """

    # Where the map jumps, the corrector wanders; this is ten times the accepted distance from the
    # predicted point.
    corrector_radius = 0.5
    # What rounding leaves where multipliers are 1e8 to 1e9, as they become towards some changes of
    # events.
    residual_floor = 1e-7
    # The last place at which the equations were evaluated, with the result: they are often asked
    # for again with the extremes.
    _latest: tuple[np.ndarray, tuple[Motion, WholeMotionEvaluation] | None] | None = None

    @classmethod
    def solves(cls, system: System, signature: Signature) -> bool:
        return signature.section is not None

    @classmethod
    def read(
        cls, base: OrbitEquations, motion: MotionToRead
    ) -> tuple[OrbitEquations, np.ndarray] | None:
        """With a section chosen along the motion, and the motion's state there."""
        system = base.system
        twice = motion.twice
        periods = motion.periods
        if (
            not ((base.has_corners or modes_in(system).needs_whole(twice)) and twice.phase_known)
            or twice.limit is not None
        ):
            return None
        if slides_along(twice):
            raise MotionError(
                "the motion slides along a surface that is a function, and such orbits are not"
                " followed so far; where it is dry friction, give the model a Friction"
            )
        end = twice.start + motion.duration
        within = (twice.start < twice.events.times) & (twice.events.times < end)
        if not within.any() and 0 in twice.sliding.values():
            raise MotionError(
                "the motion sticks for good, as it could at any state nearby: this is not an "
                "isolated orbit"
            )
        if twice.stop is Stop.REST and not (
            len(twice.events) and twice.events[-1].time > 0.5 * (twice.start + twice.time)
        ):
            raise MotionError(STAYS)
        phase, state = section_of(twice, base.frequency(base.values), duration=motion.duration)
        time = section_time(twice, motion.duration)
        held = held_at(twice, time)
        relays = relays_over_round(twice, time, motion.duration)
        signature = Signature((), periods, closed=held, section=phase, relays=relays)
        return cls(base.given, signature, base.paths, base.tol), state

    def section_along(self, motion: Motion, solution: Solution) -> tuple[Signature, np.ndarray]:
        """The signature with its section far from the events of an orbit's motion, and the unknowns
        there.
        """
        phase, state = section_of(motion, self.frequency(solution.values))
        time = section_time(motion)
        held = held_at(motion, time)
        relays = tuple(relays_at(motion, np.array([time]))[0].tolist())
        return replace(self.signature, closed=held, section=phase, relays=relays), state

    @property
    def size(self) -> int:
        return 2 * self.own

    def section_time(self, values: np.ndarray) -> float:
        """The time at the section, at which the motion begins."""
        return float(self.signature.section or 0.0) / self.frequency(values)

    def _lasting(self, unknowns: np.ndarray) -> dict[str, float | None]:
        """How long the motion lasts that the equations cover."""
        return {"periods": self.signature.span, "duration": None}

    def _may_solve(self, unknowns: np.ndarray, values: np.ndarray) -> bool:
        """Whether a motion can be asked for at a place."""
        return bool(
            self.frequency(values) > 0.0
            and np.isfinite(unknowns).all()
            and np.isfinite(values).all()
        )

    def _apart(self, after: np.ndarray, unknowns: np.ndarray) -> np.ndarray:
        """The residual, from the state at the end of the motion."""
        return np.asarray(after - unknowns)

    def _evaluation(
        self, motion: Motion, after: np.ndarray, unknowns: np.ndarray, slopes: np.ndarray
    ) -> WholeMotionEvaluation:
        """The equations, from the state at the end of a motion and its derivatives to the state at
        the start and to the parameters.
        """
        n = len(after)
        here = slopes[None, :, :n].copy()
        parameters = slopes[:, n:].copy()
        here[:, self.following] = parameters[self.following] = 0.0
        return WholeMotionEvaluation(
            self._apart(after, unknowns),
            here,
            -np.eye(n)[None],
            parameters,
            modes_in(self.system).listed(motion),
            self._extremes(None),
            None,
            None,
        )

    def _seen_from_section(self, events: EventSequence, motion: Motion) -> EventSequence:
        """The events, with how well the section lies."""
        return events

    def _middle(self, state: np.ndarray, unknowns: np.ndarray) -> np.ndarray:
        """The state after half of the time as unknowns of the halved equations."""
        return state

    def start(self, solution: Solution) -> dict[str, Any]:
        """At the section."""
        system = self.system_at(solution.values)
        state = self.start_state(solution.unknowns, system)
        start = {**arguments_of(system, state), "time": self.section_time(solution.values)}
        if self.signature.relays:
            start["relays"] = {name: side > 0 for name, side in self._relays.items()}
        return start

    @cached_property
    def _relays(self) -> dict[str, int]:
        """The side of each relay at the section."""
        names = [relay.name for relay in self.system.model.relays]
        return dict(zip(names, self.signature.relays, strict=True))

    def _keeps_relays(self, request: MotionRequest, motion: Motion) -> bool:
        """Whether the relays of a motion have the sides of the section at its start and at its
        end."""
        relays = self._relays
        if not relays:
            return True
        ends = motion.sides
        return request.relays == relays and all(ends[name] == relays[name] for name in relays)

    def impacts(self, solution: Solution) -> tuple[np.ndarray, np.ndarray]:
        times = solution.evaluation.ends[:, 0]
        speeds = solution.evaluation.ends[:, 1]
        return times * self.frequency_of(solution), speeds

    def rests(self, solution: Solution) -> np.ndarray:
        found = events_of(solution.evaluation)
        return np.array(
            modes_in(self.system).rests(found.events, found.times, found.period)
        ).reshape(-1, 2)

    def counted_impacts(self, solution: Solution) -> int:
        return events_of(solution.evaluation).impact_count // (2 if self.signature.symmetric else 1)

    def segments_to_prove(self, solution: Solution) -> OrbitSegments | CannotProve:
        excursions = self.rests(solution)
        if not len(excursions) or self.signature.symmetric:
            return super().segments_to_prove(solution)
        ends = solution.evaluation.ends
        system = self.system_at(solution.values)
        return resting_segments(system, excursions, ends[:, 0], ends[:, 1], self.signature.period)

    def touching_speed(self, solution: Solution) -> float:
        return math.inf

    def halves(self, solution: Solution, mirrored: bool) -> np.ndarray | None:
        odd = self.signature.period % 2
        unknowns = solution.unknowns
        if self.signature.symmetric or (odd and not mirrored):
            return None
        evaluation: Any = solution.evaluation
        middle = evaluation.middle
        if middle is None:
            found = self.halved.evaluate(unknowns, solution.values)
            return None if found is None else np.stack([unknowns, unknowns + found.residual])
        return np.stack([unknowns, self.image_of(middle) if odd else middle])

    def nearest(
        self, unknowns: np.ndarray, values: np.ndarray, other: OrbitPoint
    ) -> np.ndarray | None:
        """At the section of `other`, in the forcing period in which it is nearest to its state."""
        target = other.orbit.signature
        if target.section is None or (target.period, target.symmetric) != (
            self.signature.period,
            self.signature.symmetric,
        ):
            return None
        return self.unknowns_at(target, unknowns, values, other.solution.unknowns)

    def has_events_of(self, solution: Solution, other: Solution) -> bool:
        return events_of(solution.evaluation).sequence == events_of(other.evaluation).sequence

    def at_section_of(self, point: OrbitPoint, other: OrbitPoint) -> OrbitPoint:
        place = None if point.curve.joins(other.curve) else nearest(point, point.place, other)
        found = (
            None
            if place is None
            else other.curve.known(*np.split(place, [other.curve.equations.size]))
        )
        return point if found is None else other.curve.with_tangent(found, other.tangent) or point

    def at_another_section(self, orbit: PeriodicOrbit) -> PeriodicOrbit | None:
        signature, unknowns = self.section_along(orbit.followed, orbit.solution)
        return PeriodicOrbit.near(self.with_signature(signature), unknowns, orbit.solution.values)

    def barrier(self, point: OrbitPoint) -> TestFunction:
        return same_events(point)

    def accepts(self, ahead: OrbitPoint, cut: Callable[[], Cut | End | None]) -> bool:
        """Not where multipliers grow without bound, as they do towards some changes of events:
        further steps would be rounding. Nor if no change of events leads to the orbits ahead, which
        then belong to another branch."""
        return ahead.orbit.largest_multiplier <= STEEPEST and not isinstance(cut(), End)

    def change(self, zero: Zero, point: OrbitPoint) -> Cut | End:
        return change_at(zero, point)

    def beyond(self, cut: Cut, points: list[OrbitPoint]) -> OrbitPoint | End:
        return beyond(cut, points)

    def born_at(self, cut: Cut, points: list[OrbitPoint]) -> Zero | None:
        return parent_at(cut, points)

    def located_beyond(self, cut: Cut, following: OrbitPoint) -> Zero | None:
        return located_beyond(cut, following)

    def also_at(self, cut: Cut, following: OrbitPoint) -> Zero | None:
        return jump_over(cut, following)

    def lost_ahead(self, point: OrbitPoint) -> Zero | None:
        return last_release(point)

    def first_step(self, point: OrbitPoint, ahead: OrbitPoint) -> float:
        return first_step(point, ahead)

    def stalled(
        self, point: OrbitPoint, step: float, points: list[OrbitPoint], bounds: Bounds
    ) -> Cut | End | None:
        """Events may change there, so that the branch turns round; or the system ends."""
        found = refused_beyond(point, step, bounds) or stalled_at(point, step, points)
        if found is None and self._relay_turns(point):
            return End(OrbitEnd.RELAY_TURNS, point.parameter)
        limit = None if found is not None else point.orbit.motion().limit
        return found if limit is None else End(OrbitEnd.REFUSED, point.parameter, detail=limit)

    def _relay_turns(self, point: OrbitPoint) -> bool:
        """Whether a relay that only just keeps its side at an orbit ends a round on the other side
        a little farther ahead."""
        if not self.signature.relays or events_of(point.evaluation).distance > NEAR_RELAY:
            return False
        unknowns, values = np.split(point.place + NEAR_RELAY * point.tangent, [self.size])
        try:
            request, run = self._request(self.system_at(values), unknowns, values, None)
            return not self._keeps_relays(request, follow(request, silent, run).motion)
        except SaltusError:
            return False

    def curve_barrier(self, kind: str, point: Any) -> TestFunction:
        return same_events(point)

    def held(self, unknowns: np.ndarray, system: System) -> dict[int, float]:
        """The state variables that are fixed at the section, up to rounding, with their values; none
        of what multipliers hold, onto which each start is taken."""
        if self.system.model.has_multipliers:
            return {}
        state = self._completed(unknowns, system)
        return held_values(system, state, CLOSED, units=self.natural.state)

    def start_state(self, unknowns: np.ndarray, system: System) -> np.ndarray:
        """The state at the section, in which contacts that are closed, and frictions that stick, up
        to rounding do so exactly. Those that multipliers hold are known from the signature.
        """
        if self.system.model.has_multipliers:
            time = float(self.signature.section or 0.0) / (system.load.frequency or 1.0)
            values = RowValues(system)
            held = self.signature.closed >> np.arange(values.size) & 1 == 1
            return values.onto(time, unknowns, held)
        held = self.held(unknowns, system)
        state = self._completed(unknowns, system, held)
        for place, value in held.items():
            state[place] = value
        return state

    def _completed(
        self, unknowns: np.ndarray, system: System, held: Iterable[int] = ()
    ) -> np.ndarray:
        """The unknowns, or a copy of them with the dependent sums that follow from them at the
        section (`InGapCoordinates`).
        """
        state = unknowns.copy()
        twin = cast("Any", system)
        if not self.system.dependent:
            return state
        time = float(self.signature.section or 0.0) / (twin.load.frequency or 1.0)
        return np.asarray(
            twin.model.completed(
                time, twin.load, state, [place for place in held if place < self.own]
            )
        )

    def _start_slopes(self, unknowns: np.ndarray, system: System) -> tuple[np.ndarray, np.ndarray]:
        """The derivatives of the start state to the unknowns and to the parameters, at complex
        numbers, where sums follow from other coordinates; those to what is held are 0."""
        held = self.held(unknowns, system)
        step = 1e-100
        found = []
        for j, path in enumerate([*range(len(unknowns)), *self.paths]):
            beside = unknowns.astype(complex)
            twin = system
            if path in self.paths:
                twin = substitute(system, partial(_raised, path, 1j * step))
            else:
                beside[j] += 1j * step
            found.append(np.imag(self._completed(beside, twin, held)) / step)
        columns = np.stack(found, axis=1)
        return columns[:, : len(unknowns)], columns[:, len(unknowns) :]

    def evaluate(
        self,
        unknowns: np.ndarray,
        values: np.ndarray,
        with_extremes: bool = False,
        *,
        later: np.ndarray | None = None,
    ) -> WholeMotionEvaluation | None:
        if later is not None:
            evaluation = self.evaluate(unknowns, values, with_extremes)
            return (
                None
                if evaluation is None
                else replace(evaluation, residual=evaluation.residual + unknowns - later)
            )
        place = np.append(unknowns, values)
        if self._latest is None or not np.array_equal(self._latest[0], place):
            self._latest = place, self._evaluated(unknowns, values)
        _, found = self._latest
        if found is None or not with_extremes:
            return None if found is None else found[1]
        motion, evaluation = found
        if evaluation.events is None:
            sampled = SampledMotion.of(motion)
            time = 0.5 * (motion.start + motion.time)
            half = motion.at(time)
            images = self.images if self.signature.symmetric else None
            events = sequence_of(motion, sampled, self.natural, images, self.smooth_surfaces)
            events = self._seen_from_section(events, motion)
            middle = np.concatenate([np.atleast_1d(part) for part in half])
            extremes = self._extremes(sampled)
            middle[self.following] = 0.0
            middle = self._middle(middle, unknowns)
            begin, later = relays_at(motion, np.array([motion.start, time]))
            turned = None if (begin != later).any() else middle  # other sides are another state
            evaluation = replace(evaluation, extremes=extremes, events=events, middle=turned)
            self._latest = place, (motion, evaluation)
        return evaluation

    def residual(self, unknowns: np.ndarray, values: np.ndarray) -> np.ndarray | None:
        if not self._may_solve(unknowns, values):
            return None
        try:
            system = self.system_at(values)
            request, run = self._request(system, unknowns, values, None)
            motion = follow(request, silent, run).motion
        except SaltusError:
            return None
        if motion.limit is not None or not self._keeps_relays(request, motion):
            return None
        after = np.append(np.atleast_1d(motion.position), np.atleast_1d(motion.velocity))
        after = self.image_of(after) if self.signature.symmetric else after
        after[self.following] = 0.0
        return self._apart(after, unknowns)

    def _evaluated(
        self, unknowns: np.ndarray, values: np.ndarray
    ) -> tuple[Motion, WholeMotionEvaluation] | None:
        """The motion over the time that the equations cover, and the equations without extremes;
        None where the motion cannot be followed."""
        if not self._may_solve(unknowns, values):
            return None
        try:
            system = self.system_at(values)
            request, run = self._request(system, unknowns, values, self.model_paths)
            found = derivatives_of(request, run)
        except SaltusError:  # such parameters or such a state are refused, or the motion is
            return None
        motion = found.motion
        parameters = found.parameters.copy()
        if motion.limit is not None or found.undefined is not None or slides_along(motion):
            return None
        if not self._keeps_relays(request, motion):  # its end is no return
            return None
        if FREQUENCY in self.paths:  # the section stays at its phase
            rates = state_rates(motion)
            assert motion.dense is not None
            # not those at the end, which differ where perturbations return with the other sign
            first = motion.dense.series[0]
            before = np.concatenate([first[:, 1], 2.0 * first[:, 2]])
            parameters[:, self.paths.index(FREQUENCY)] -= (
                (rates - found.state @ before) * self.section_time(values) / self.frequency(values)
            )
        after = np.append(np.atleast_1d(motion.position), np.atleast_1d(motion.velocity))
        state = found.state
        if self.system.dependent:
            by_unknowns, by_parameters = self._start_slopes(unknowns[: len(after)], system)
            state, parameters = state @ by_unknowns, parameters + state @ by_parameters
        if self.signature.symmetric:
            after = self.image_of(after)
            state, parameters = (self.turned(numbers.T).T for numbers in (state, parameters))
        after[self.following] = 0.0
        return motion, self._evaluation(motion, after, unknowns, np.hstack([state, parameters]))

    def unknowns_at(
        self, target: Signature, unknowns: np.ndarray, values: np.ndarray, near: np.ndarray
    ) -> np.ndarray | None:
        """The unknowns of the orbit at the section of another signature: of one such state in each
        forcing period, the nearest to the state `near`. None where the motion cannot be
        followed."""
        phase = float(target.section or 0.0)
        if (
            self.evaluate(unknowns, values) is None
            or self._latest is None
            or self._latest[1] is None
        ):
            return None
        motion = self._latest[1][0]
        signature = self.signature
        ahead = (phase - float(signature.section or 0.0)) % math.tau + math.tau * np.arange(
            signature.period
        )
        # in the second half of a symmetric orbit, the image of the first half
        later = ahead >= math.tau * signature.span
        times = motion.start + np.where(
            later, ahead - math.tau * signature.span, ahead
        ) / self.frequency(values)
        states = np.array(
            [
                np.concatenate([np.atleast_1d(part) for part in motion.at(time)])
                for time in times.tolist()
            ]
        )
        states[:, self.following] = 0.0
        states = np.where(later[:, None], self.image_of(states) if later.any() else states, states)
        apart = np.abs((states - near) / self.natural.state).max(axis=1)
        if target.relays:
            apart[(relays_at(motion, times) != target.relays).any(axis=1)] = math.inf
        return np.asarray(states[apart.argmin()]) if np.isfinite(apart).any() else None

    @cached_property
    def smooth_surfaces(self) -> frozenset[int]:
        """The surfaces whose touch is no event, as forces are continuous across them, for any
        values of the parameters at `paths`.
        """
        if not self.system.model.surfaces:
            return frozenset()
        values = self._values.copy()
        values[self._places] = 0.0  # The answer holds for all of them, and is then computed once.
        return continuous_surfaces(self._run.trace, tuple(values), self.model_paths)

    @cached_property
    def _program(self) -> Any:
        return program(self.system, sensitivities=self.model_paths)

    @cached_property
    def _plain_program(self) -> Any:
        """The program without derivatives."""
        return program(self.system)

    def _request(
        self,
        system: System,
        unknowns: np.ndarray,
        values: np.ndarray,
        paths: tuple[str, ...] | None,
    ) -> tuple[MotionRequest, Any]:
        """The motion over the time that the equations cover, dense if it has derivatives to
        `paths`, and its program.
        """
        names = system.model.coordinates
        own = self.own
        state = self.start_state(unknowns, system)
        velocity: Any = tuple(state[own:].tolist())
        if own == 1:  # which has no velocity of its own if it is of first order
            velocity = velocity[0] if system.model.moving else ()
        parameters = self._values.copy()
        parameters[self._places] = values
        request = MotionRequest(
            system=system,
            coordinates=dict(zip(names, state[:own].tolist(), strict=True)),
            velocity=velocity,
            **cast("dict[str, Any]", self._lasting(unknowns)),
            tol=self.tol,
            time=self.section_time(values),
            side=None,
            stop_at=(),
            dense=paths is not None,
            sensitivities=paths,
            dense_tangent=False,
            relays=self._relays or None,
        )
        run = self._plain_program if paths is None else self._program
        # breakpoints are shares of the forcing period, whatever the numbers are
        records = record_table(system, run.trace.records) if self.has_corners else self._records
        return request, run.with_numbers(parameters, records)

    def _extremes(self, sampled: SampledMotion | None) -> np.ndarray:
        """The extrema of all coordinates and the least values of the margins, in the columns that
        other orbits use.
        """
        extremes = np.full(
            (int(sampled is not None), SegmentColumn.LEAST_MARGIN + max(1, len(self.margins))),
            np.inf,
        )
        if sampled is not None:
            extremes[:, SegmentColumn.CROSSINGS] = 0.0
            extremes[0, SegmentColumn.LOWEST_GAP] = sampled.lowest_gap()
            extremes[0, SegmentColumn.HIGHEST] = sampled.highest()
            extremes[0, SegmentColumn.LOWEST] = sampled.lowest()
            least = sampled.margins() if self.margins else {}
            extremes[
                0, SegmentColumn.LEAST_MARGIN : SegmentColumn.LEAST_MARGIN + len(self.margins)
            ] = [least[name] for name in self.margins]
        return extremes


def slides_along(motion: Motion) -> bool:
    """Whether a motion slides along a function: one sticks to it, or leaves it."""
    model = motion.system.model
    if not (model.surfaces or model.has_switches):
        return False
    codes = motion.events.codes
    surfaces = codes[:, 1] >> (len(model.contacts) + len(model.frictions))
    return bool(np.any(np.isin(codes[:, 0], (EventCode.STICK, EventCode.SLIP)) & (surfaces != 0)))


def _raised(path: str, by: complex, at: str, value: Any) -> Any:
    """A number of a system, raised if it is the one at a path."""
    return value + by if at == path else value
