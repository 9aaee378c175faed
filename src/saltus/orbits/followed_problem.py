"""Orbits that are followed through all of their events, x = Phi(x): those whose impacts die away, and those with dry friction.

The unknowns are the state at a phase of the load at which nothing happens. Events between are those of the motion, whatever
they are; their derivatives are those of `sensitivities`. An accumulation of impacts is a map of its own there, with the
derivatives of its end. What contacts hold at the section has the derivatives 0, and so has the speed of what sticks.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from saltus.errors import MotionError
from saltus.flow import Motion, Sensitivities, sensitivities, state_rates
from saltus.flow import segments as at
from saltus.orbits.problem import Equations, Problem
from saltus.systems import System
from saltus.taylor import FREQUENCY

SAMPLES = 33  # of each step, between which the least margins are those of parabolas, to the fourth power of the distance
NEWTON_STEPS = 4  # from the largest sample of a coordinate to its extremum, whose error each of them squares
DYING = 1e-5  # Slower impacts are not listed: they are of an accumulation.
CLOSED = 1e-9  # A contact whose gap and rate are smaller at the section is closed there.


class FollowedProblem(Problem):
    """The equations x = Phi(x) of a system with contacts or frictions."""

    @property
    def size(self) -> int:
        return 2 * self.own

    def impacts(self, unknowns: np.ndarray, equations: Equations) -> tuple[np.ndarray, np.ndarray]:
        times, speeds = equations.ends[:, 0], equations.ends[:, 1]
        return times * self.frequency(self.values), speeds

    def touching_speed(self, unknowns: np.ndarray, equations: Equations) -> float:
        return math.inf

    def start_state(self, unknowns: np.ndarray, system: System) -> np.ndarray:
        """The state at the section, with contacts closed that are so but for rounding."""
        state, own, names = unknowns.copy(), self.own, system.model.coordinates
        for contact in system.model.contacts:
            place = names.index(contact.coordinate)
            if abs(contact.gap(state[place])) < CLOSED and abs(state[own + place]) < CLOSED:
                state[place], state[own + place] = float(contact.position), 0.0
        return state

    def within(self, unknowns: np.ndarray, equations: Equations, values: np.ndarray) -> tuple[np.ndarray, float]:
        """The state at the section, and its time."""
        return self.start_state(unknowns, self.at(values)), float(self.signature.section or 0.0) / self.frequency(values)

    def evaluate(self, unknowns: np.ndarray, values: np.ndarray, with_extremes: bool = False) -> Equations | None:
        frequency = self.frequency(values)
        if not (frequency > 0.0 and np.isfinite(unknowns).all() and np.isfinite(values).all()):
            return None
        system, phase = self.at(values), float(self.signature.section or 0.0)
        state = self.start_state(unknowns, system)
        try:
            found = self._followed(system, state, phase / frequency)
        except MotionError:
            return None
        motion, parameters = found.motion, found.parameters.copy()
        if motion.limit is not None or found.undefined is not None:
            return None
        if FREQUENCY in self.paths:  # the section stays at its phase
            rates = state_rates(motion)
            parameters[:, self.paths.index(FREQUENCY)] -= (rates - found.state @ rates) * phase / frequency**2
        after = np.append(np.atleast_1d(motion.position), np.atleast_1d(motion.velocity))
        here, there = found.state[None], -np.eye(len(after))[None]
        return Equations(after - unknowns, here, there, parameters, self._impacts(motion), self._extremes(motion, with_extremes))

    def _followed(self, system: System, state: np.ndarray, time: float) -> Sensitivities:
        """The motion over the time that the equations cover, with its derivatives."""
        names, own = system.model.coordinates, self.own
        start: dict[str, Any] = dict(zip(names, state[:own].tolist(), strict=True))
        velocity: Any = float(state[own]) if own == 1 else tuple(state[own:].tolist())
        more: dict[str, Any] = {"parameters": self.paths, "periods": self.signature.span, "time": time, "tol": self.tol}
        return sensitivities(system, **start, velocity=velocity, **more)

    def _impacts(self, motion: Motion) -> np.ndarray:
        """Times and least speeds of the impacts that do not die away, (n, 2)."""
        impacts, contacts = motion.impacts, motion.system.model.contacts
        names, rows = motion.system.model.coordinates, []
        for time, hit, before in zip(impacts.time, impacts.side, impacts.velocity_before, strict=True):
            speeds = [abs(before[names.index(c.coordinate)]) for i, c in enumerate(contacts) if int(hit) >> i & 1]
            if min(speeds, default=0.0) > DYING:
                rows.append((time, min(speeds)))
        return np.array(rows).reshape(-1, 2)

    def _extremes(self, motion: Motion, with_extremes: bool) -> np.ndarray:
        """The extrema of all coordinates and the least values of the margins, in the places of the other orbits'."""
        extremes = np.full((int(with_extremes), at.LEAST_MARGIN + max(1, len(self.margins))), np.inf)
        if not with_extremes or motion.dense is None:
            return extremes
        extremes[:, at.CROSSINGS] = 0.0
        dense = motion.dense
        share = np.linspace(0.0, 1.0, SAMPLES)
        steps = np.flatnonzero(dense.length > 0.0)
        tau = dense.length[steps, None] * share
        series, powers = dense.series[steps], np.arange(dense.series.shape[2])
        position = np.einsum("sdk,spk->dsp", series, tau[:, :, None] ** powers)
        velocity = np.einsum("sdk,spk->dsp", series[:, :, 1:] * powers[1:], tau[:, :, None] ** powers[:-1])
        extremes[0, at.TOP], extremes[0, at.BOTTOM] = -_turning(-series, -position, tau), _turning(series, position, tau)
        if self.margins:
            bends = series[:, :, 2:] * (powers[2:] * powers[1:-1])
            acceleration = np.einsum("sdk,spk->dsp", bends, tau[:, :, None] ** powers[:-2])
            q, v, a = (x[0] if self.own == 1 else x for x in (position, velocity, acceleration))
            t, side = dense.start[steps, None] + tau, (*motion.system.model.sides, 1)[0]
            margins = motion.system.model.margins(t, q, v, a, side, motion.system.load)
            for j, name in enumerate(self.margins):
                extremes[0, at.LEAST_MARGIN + j] = _least(np.broadcast_to(margins[name], t.shape))
        return extremes


def _turning(series: np.ndarray, values: np.ndarray, tau: np.ndarray) -> float:
    """The least value of series (steps, coordinates, orders), from samples (coordinates, steps, samples) by Newton's method."""
    coordinate, step, sample = np.unravel_index(int(np.argmin(values)), values.shape)
    q = np.polynomial.Polynomial(series[step, coordinate])
    v, a, t = q.deriv(), q.deriv(2), float(tau[step, sample])
    for _ in range(NEWTON_STEPS):
        bend = float(a(t))
        t = float(np.clip(t - v(t) / bend, tau[step, 0], tau[step, -1])) if bend > 0.0 else t
    return min(float(q(t)), float(values.min()))


def _least(values: np.ndarray) -> float:
    """The least of samples along steps (..., samples), between them as on parabolas."""
    low, middle, high = values[..., :-2], values[..., 1:-1], values[..., 2:]
    bend, slope = high - 2.0 * middle + low, 0.5 * (high - low)
    with np.errstate(divide="ignore", invalid="ignore"):
        turned = np.where((bend > 0.0) & (np.abs(slope) < bend), middle - 0.5 * slope**2 / bend, middle)
    return float(min(values.min(), turned.min()))
