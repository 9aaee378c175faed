"""Orbits that are followed through all of their events, x = Phi(x): those whose impacts die away, and those with dry friction.

The unknowns are the state at a phase of the load at which nothing happens. Events between are those of the motion, whatever
they are; their derivatives are those of `sensitivities`. An accumulation of impacts is a map of its own there, with the
derivatives of its end. What contacts hold at the section has the derivatives 0, and so has the speed of what sticks.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from saltus.errors import SaltusError
from saltus.flow import Motion, Sensitivities, sensitivities, state_rates
from saltus.flow import segments as at
from saltus.orbits.followed_events import FollowedEvents, events_of, impact_speeds
from saltus.orbits.problem import Equations, Problem
from saltus.orbits.sampled_motion import SampledMotion
from saltus.systems import System, image_of
from saltus.taylor import FREQUENCY

DYING = 1e-5  # Slower impacts are not listed: they are of an accumulation.
CLOSED = 1e-9  # A contact whose gap and rate are smaller at the section is closed there.


@dataclass(frozen=True)
class FollowedEquations(Equations):
    """The problem at one point, with the events on the way round."""

    followed: FollowedEvents | None  # None if extremes were not asked for


class FollowedProblem(Problem):
    """The equations x = Phi(x) of a system with contacts or frictions; of a symmetric orbit, x is the image of Phi(x) of half a
    period."""

    @property
    def size(self) -> int:
        return 2 * self.own

    def impacts(self, unknowns: np.ndarray, equations: Equations) -> tuple[np.ndarray, np.ndarray]:
        times, speeds = equations.ends[:, 0], equations.ends[:, 1]
        return times * self.frequency(self.values), speeds

    def touching_speed(self, unknowns: np.ndarray, equations: Equations) -> float:
        return math.inf

    def start_state(self, unknowns: np.ndarray, system: System) -> np.ndarray:
        """The state at the section, with contacts closed, and frictions that stick, that are so but for rounding."""
        state, own, names = unknowns.copy(), self.own, system.model.coordinates
        for contact in system.model.contacts:
            place = names.index(contact.coordinate)
            if abs(contact.gap(state[place])) < CLOSED and abs(state[own + place]) < CLOSED:
                state[place], state[own + place] = float(contact.position), 0.0
        for friction in system.model.frictions:
            place, speed = own + names.index(friction.coordinate), float(friction.ground_speed)
            state[place] = speed if abs(state[place] - speed) < CLOSED else state[place]
        return state

    def within(self, unknowns: np.ndarray, equations: Equations, values: np.ndarray) -> tuple[np.ndarray, float]:
        """The state at the section, and its time."""
        return self.start_state(unknowns, self.at(values)), float(self.signature.section or 0.0) / self.frequency(values)

    def evaluate(self, unknowns: np.ndarray, values: np.ndarray, with_extremes: bool = False) -> FollowedEquations | None:
        frequency = self.frequency(values)
        if not (frequency > 0.0 and np.isfinite(unknowns).all() and np.isfinite(values).all()):
            return None
        phase = float(self.signature.section or 0.0)
        try:
            system = self.at(values)
            found = self._followed(system, self.start_state(unknowns, system), phase / frequency)
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
        sampled = SampledMotion.of(motion) if with_extremes else None
        events = None if sampled is None else events_of(motion, sampled, self.images if self.signature.symmetric else None)
        residual, impacts = after - unknowns, self._impacts(motion)
        return FollowedEquations(residual, here, there, parameters, impacts, self._extremes(sampled), events)

    def _followed(self, system: System, state: np.ndarray, time: float) -> Sensitivities:
        """The motion over the time that the equations cover, with its derivatives."""
        names, own = system.model.coordinates, self.own
        start: dict[str, Any] = dict(zip(names, state[:own].tolist(), strict=True))
        velocity: Any = float(state[own]) if own == 1 else tuple(state[own:].tolist())
        more: dict[str, Any] = {"parameters": self.paths, "periods": self.signature.span, "time": time, "tol": self.tol}
        return sensitivities(system, **start, velocity=velocity, **more)

    def _impacts(self, motion: Motion) -> np.ndarray:
        """Times and least speeds of the impacts that do not die away, (n, 2)."""
        rows = np.column_stack([motion.impacts.time, impact_speeds(motion)])
        return np.asarray(rows[rows[:, 1] > DYING])

    def _extremes(self, sampled: SampledMotion | None) -> np.ndarray:
        """The extrema of all coordinates and the least values of the margins, in the places of the other orbits'."""
        extremes = np.full((int(sampled is not None), at.LEAST_MARGIN + max(1, len(self.margins))), np.inf)
        if sampled is not None:
            extremes[:, at.CROSSINGS] = 0.0
            extremes[0, at.TOP], extremes[0, at.BOTTOM] = sampled.highest(), sampled.lowest()
            least = sampled.margins() if self.margins else {}
            extremes[0, at.LEAST_MARGIN : at.LEAST_MARGIN + len(self.margins)] = [least[name] for name in self.margins]
        return extremes
