"""Orbits that are followed through all of their events, x = Phi(x): those with accumulations of impacts, or with dry friction.

The unknowns are the state at a section, a phase of the load at which no event happens. The motion Phi has whatever events it
has, and its derivatives are those of `sensitivities`, in which an accumulation of impacts is a single map with the derivatives of
its end. Derivatives to coordinates that contacts hold at the section are 0, and so are those to the speed of a sticking
coordinate.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from saltus.errors import SaltusError
from saltus.flow import (
    Motion,
    MotionRequest,
    Program,
    SegmentColumn,
    Sensitivities,
    derivatives_of,
    limits_of,
    program,
    state_rates,
)
from saltus.orbits.equations.event_sequence import FollowedEvents, events_of
from saltus.orbits.equations.one_contact import OneContactEquations, OrbitEvaluation
from saltus.orbits.equations.sampled_motion import SampledMotion
from saltus.systems import System, image_of
from saltus.taylor import FREQUENCY

DYING = 1e-5  # Slower impacts are not listed: they belong to an accumulation.
CLOSED = 1e-9  # A contact is closed at the section if its gap and the gap's rate are smaller than this there.


@dataclass(frozen=True)
class WholeMotionEvaluation(OrbitEvaluation):
    """The problem at one point, with the events along the motion."""

    followed: FollowedEvents | None  # None if extremes were not asked for
    middle: np.ndarray | None  # the state after half of the time; None if extremes were not asked for


class WholeMotionEquations(OneContactEquations):
    """The equations x = Phi(x) of a system with contacts or frictions; for a symmetric orbit x is the mirror image of Phi(x) over
    half a period."""

    stray = 0.5  # Where the map jumps, the corrector wanders; this is ten times the accepted distance from the predicted point.
    rounded = 1e-7  # What rounding leaves where multipliers are 1e8 to 1e9, as they become towards some changes of events.
    # The last place at which the equations were evaluated, with the result: they are often asked for again with the extremes.
    _latest: tuple[np.ndarray, tuple[Motion, WholeMotionEvaluation] | None] | None = None

    @property
    def size(self) -> int:
        return 2 * self.own

    def impacts(self, unknowns: np.ndarray, evaluation: OrbitEvaluation) -> tuple[np.ndarray, np.ndarray]:
        times, speeds = evaluation.ends[:, 0], evaluation.ends[:, 1]
        return times * self.frequency(self.values), speeds

    def touching_speed(self, unknowns: np.ndarray, evaluation: OrbitEvaluation) -> float:
        return math.inf

    def held(self, state: np.ndarray, system: System) -> dict[int, float]:
        """The state variables that are fixed at the section, up to rounding, with their values: coordinates that contacts hold,
        their velocities, and the velocities of coordinates that stick."""
        found, own, names = dict[int, float](), self.own, system.model.coordinates
        for contact in system.model.contacts:
            place = names.index(contact.coordinate)
            if abs(contact.gap(state[place])) < CLOSED and abs(state[own + place]) < CLOSED:
                found |= {place: float(contact.position), own + place: 0.0}
        for friction in system.model.frictions:
            place, speed = own + names.index(friction.coordinate), float(friction.ground_speed)
            found |= {place: speed} if abs(state[place] - speed) < CLOSED else {}
        return found

    def start_state(self, unknowns: np.ndarray, system: System) -> np.ndarray:
        """The state at the section, in which contacts that are closed, and frictions that stick, up to rounding do so exactly."""
        state = unknowns.copy()
        for place, value in self.held(unknowns, system).items():
            state[place] = value
        return state

    def within(self, unknowns: np.ndarray, evaluation: OrbitEvaluation, values: np.ndarray) -> tuple[np.ndarray, float]:
        """The state at the section, and its time."""
        return self.start_state(unknowns, self.at(values)), float(self.signature.section or 0.0) / self.frequency(values)

    def evaluate(
        self, unknowns: np.ndarray, values: np.ndarray, with_extremes: bool = False, *, later: np.ndarray | None = None
    ) -> WholeMotionEvaluation | None:
        if later is not None:
            evaluation = self.evaluate(unknowns, values, with_extremes)
            return None if evaluation is None else replace(evaluation, residual=evaluation.residual + unknowns - later)
        place = np.append(unknowns, values)
        if self._latest is None or not np.array_equal(self._latest[0], place):
            self._latest = place, self._evaluated(unknowns, values)
        _, found = self._latest
        if found is None or not with_extremes:
            return None if found is None else found[1]
        motion, evaluation = found
        if evaluation.followed is None:
            sampled, half = SampledMotion.of(motion), motion.at(0.5 * (motion.start + motion.time))
            events = events_of(motion, sampled, self.images if self.signature.symmetric else None)
            middle, extremes = np.concatenate([np.atleast_1d(part) for part in half]), self._extremes(sampled)
            evaluation = replace(evaluation, extremes=extremes, followed=events, middle=middle)
            self._latest = place, (motion, evaluation)
        return evaluation

    def _evaluated(self, unknowns: np.ndarray, values: np.ndarray) -> tuple[Motion, WholeMotionEvaluation] | None:
        """The motion over the time that the equations cover, and the equations without extremes; None where the motion cannot be
        followed."""
        frequency = self.frequency(values)
        if not (frequency > 0.0 and np.isfinite(unknowns).all() and np.isfinite(values).all()):
            return None
        phase = float(self.signature.section or 0.0)
        try:
            system = self.at(values)
            found = self._followed(system, self.start_state(unknowns, system), phase / frequency, values)
        except SaltusError:  # such parameters or such a state are refused, or the motion is
            return None
        motion, parameters = found.motion, found.parameters.copy()
        if motion.limit is not None or found.undefined is not None:
            return None
        if FREQUENCY in self.paths:  # the section stays at its phase
            rates = state_rates(motion)
            before = image_of(system.model, rates) if self.signature.symmetric else rates
            parameters[:, self.paths.index(FREQUENCY)] -= (rates - found.state @ before) * phase / frequency**2
        after, state = np.append(np.atleast_1d(motion.position), np.atleast_1d(motion.velocity)), found.state
        if self.signature.symmetric:
            after, state, parameters = (image_of(system.model, numbers.T).T for numbers in (after, state, parameters))
        here, there = state[None], -np.eye(len(after))[None]
        residual, impacts = after - unknowns, self._impacts(motion)
        return motion, WholeMotionEvaluation(residual, here, there, parameters, impacts, self._extremes(None), None, None)

    def half_way(self, unknowns: np.ndarray, values: np.ndarray, evaluation: OrbitEvaluation) -> np.ndarray | None:
        assert isinstance(evaluation, WholeMotionEvaluation)
        if evaluation.middle is None:
            return super().half_way(unknowns, values, evaluation)
        middle = evaluation.middle
        return np.asarray((image_of(self.system.model, middle) if self.signature.period % 2 else middle) - unknowns)

    def state_at(self, phase: float, unknowns: np.ndarray, values: np.ndarray, near: np.ndarray) -> np.ndarray | None:
        """The state of the orbit at a phase of the load: of one such state in each forcing period, the nearest to the state
        `near`. None where the motion cannot be followed."""
        if self.evaluate(unknowns, values) is None or self._latest is None or self._latest[1] is None:
            return None
        motion, signature = self._latest[1][0], self.signature
        ahead = (phase - float(signature.section or 0.0)) % math.tau + math.tau * np.arange(signature.period)
        later = ahead >= math.tau * signature.span  # in the second half of a symmetric orbit, the image of the first half
        times = motion.start + np.where(later, ahead - math.tau * signature.span, ahead) / self.frequency(values)
        states = np.array([np.concatenate([np.atleast_1d(part) for part in motion.at(time)]) for time in times.tolist()])
        states = np.where(later[:, None], image_of(self.system.model, states) if later.any() else states, states)
        return np.asarray(states[np.abs(states - near).max(axis=1).argmin()])

    @cached_property
    def _program(self) -> Program:
        return program(self.system, limits_of(self.system, ()), self.paths)

    def _followed(self, system: System, state: np.ndarray, time: float, values: np.ndarray) -> Sensitivities:
        """The motion over the time that the equations cover, with its derivatives."""
        names, own = system.model.coordinates, self.own
        parameters = self._values.copy()
        parameters[self._places] = values
        request = MotionRequest(
            system=system,
            coordinates=dict(zip(names, state[:own].tolist(), strict=True)),
            velocity=float(state[own]) if own == 1 else tuple(state[own:].tolist()),
            periods=self.signature.span,
            duration=None,
            tol=self.tol,
            time=time,
            side=None,
            stop_at=(),
            dense=True,
            sensitivities=self.paths,
        )
        return derivatives_of(request, self._program.at(parameters, self._records))

    def _impacts(self, motion: Motion) -> np.ndarray:
        """Times and speeds of the impacts, (n, 2), without those of accumulations; if several contacts close at one instant, each
        has its own row."""
        impacts, names, rows = motion.impacts, self.system.model.coordinates, [np.empty((0, 2))]
        for i, contact in enumerate(self.system.model.contacts):
            speeds = np.abs(impacts.velocity_before[:, names.index(contact.coordinate)])
            rows.append(np.column_stack([impacts.time, speeds])[(impacts.side >> i & 1 == 1) & (speeds > DYING)])
        found = np.concatenate(rows)
        return np.asarray(found[np.argsort(found[:, 0], kind="stable")])

    def _extremes(self, sampled: SampledMotion | None) -> np.ndarray:
        """The extrema of all coordinates and the least values of the margins, in the columns that other orbits use."""
        extremes = np.full((int(sampled is not None), SegmentColumn.LEAST_MARGIN + max(1, len(self.margins))), np.inf)
        if sampled is not None:
            extremes[:, SegmentColumn.CROSSINGS] = 0.0
            extremes[0, SegmentColumn.HIGHEST], extremes[0, SegmentColumn.LOWEST] = sampled.highest(), sampled.lowest()
            least = sampled.margins() if self.margins else {}
            extremes[0, SegmentColumn.LEAST_MARGIN : SegmentColumn.LEAST_MARGIN + len(self.margins)] = [
                least[name] for name in self.margins
            ]
        return extremes
