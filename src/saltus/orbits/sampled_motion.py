"""The steps of a motion at so many instants that extrema between them can be told."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from saltus.flow import Motion, modes_of
from saltus.systems import reactions, stick_margins

SAMPLES = 33  # of each step, between which the least values are those of parabolas, to the fourth power of the distance
NEWTON_STEPS = 4  # from the largest sample of a coordinate to its extremum, whose error each of them squares


@dataclass(frozen=True, eq=False)
class SampledMotion:
    """The steps of a motion with its states at even instants of each, its ends included: `position` is (coordinates, steps,
    samples), and so are its derivatives."""

    motion: Motion
    series: np.ndarray
    tau: np.ndarray  # (steps, samples): since the start of the step
    time: np.ndarray
    position: np.ndarray
    velocity: np.ndarray
    acceleration: np.ndarray
    side: np.ndarray  # (steps,)
    begins: np.ndarray  # (steps,): whether a step begins with an event

    @classmethod
    def of(cls, motion: Motion) -> SampledMotion:
        """The samples of a motion that was kept densely."""
        dense = motion.dense
        assert dense is not None
        steps = np.flatnonzero(dense.length > 0.0)
        tau = dense.length[steps, None] * np.linspace(0.0, 1.0, SAMPLES)
        series, powers = dense.series[steps], np.arange(dense.series.shape[2])
        exponents = tau[:, :, None] ** powers
        position = np.einsum("sdk,spk->dsp", series, exponents)
        velocity = np.einsum("sdk,spk->dsp", series[:, :, 1:] * powers[1:], exponents[:, :, :-1])
        acceleration = np.einsum("sdk,spk->dsp", series[:, :, 2:] * (powers[2:] * powers[1:-1]), exponents[:, :, :-2])
        begins = np.isin(dense.start[steps], motion.events.times)
        return cls(
            motion, series, tau, dense.start[steps, None] + tau, position, velocity, acceleration, dense.side[steps], begins
        )

    def _state(self) -> tuple[Any, Any, Any]:
        """Coordinates, velocities and accelerations as a model takes them."""
        parts = (self.position, self.velocity, self.acceleration)
        q, v, a = (x[0] if len(x) == 1 else tuple(x) for x in parts)
        return q, v, a

    def lowest(self) -> float:
        """The least value of any coordinate."""
        return _turning(self.series, self.position, self.tau)

    def highest(self) -> float:
        """The largest value of any coordinate."""
        return -_turning(-self.series, -self.position, self.tau)

    def margins(self) -> dict[str, float]:
        """The least value of each of the model's margins."""
        system, side = self.motion.system, (*self.motion.system.model.sides, 1)[0]
        values = system.model.margins(self.time, *self._state(), side, system.load)
        return {name: _least(np.broadcast_to(value, self.time.shape)) for name, value in values.items()}

    def nearest_touch(self) -> float:
        """The least of the inner minima at which the motion all but changes its mode; inf where it has none.

        They are those of the gaps of open contacts, of the speeds of what slides, of the reactions of closed contacts and of
        what a friction that sticks could bear beyond its force. Of the last two the value just after an event counts too.
        """
        model, names = self.motion.system.model, self.motion.system.model.coordinates
        closed, slides = modes_of(model, self.side)
        least = [np.inf]
        for i, contact in enumerate(model.contacts):
            place, is_open = names.index(contact.coordinate), closed >> i & 1 == 0
            gap, rate = contact.gap(self.position[place]), contact.sign * self.velocity[place]
            least.append(self._turning_of(gap, rate, is_open))
        for friction, s in zip(model.frictions, slides, strict=True):
            place = names.index(friction.coordinate)
            speed = s[:, None] * (self.velocity[place] - float(friction.ground_speed))
            least.append(self._turning_of(speed, s[:, None] * self.acceleration[place], s != 0))
        return float(min([*least, *self._holding(closed, slides)]))

    def _holding(self, closed: np.ndarray, slides: list[np.ndarray]) -> list[float]:
        """The least inner minima of what holds closed contacts, and what sticks."""
        system, (q, v, _) = self.motion.system, self._state()
        model, accelerations = system.model, list(self.acceleration)
        masks = [closed >> i & 1 == 1 for i in range(len(model.contacts))]
        forces = list(reactions(model, self.time, q, v, accelerations, system.load)) if any(map(np.any, masks)) else []
        masks = masks if forces else []
        if any((s == 0).any() for s in slides):
            forces += stick_margins(model, self.time, q, v, accelerations, system.load)
            masks += [s == 0 for s in slides for _ in range(2)]
        return [self._dip(force, mask) for force, mask in zip(forces, masks, strict=True)]

    def _turning_of(self, values: np.ndarray, rates: np.ndarray, chosen: np.ndarray) -> float:
        """The least value (steps, samples) where it turns from falling to rising within one of the chosen steps."""
        low, high = rates[:, :-1], rates[:, 1:]
        turns = (low < 0.0) & (high >= 0.0) & chosen[:, None]
        turns[self.begins, 0] = False  # there the value leaves 0, with rates that are 0 to rounding
        step, sample = np.nonzero(turns)
        if not step.size:
            return np.inf
        ahead = low[step, sample] / (low[step, sample] - high[step, sample]) * np.diff(self.tau[step, :2], axis=1)[:, 0]
        return float((values[step, sample] + 0.5 * low[step, sample] * ahead).min())

    def _dip(self, force: Any, chosen: np.ndarray) -> float:
        """The least inner minimum of a force over each stretch of chosen steps, or its value just after the event before it."""
        values = np.broadcast_to(np.asarray(force, dtype=float), self.time.shape)
        least = np.inf
        edges = np.flatnonzero(np.diff(np.concatenate([[False], chosen, [False]])))
        for first, last in edges.reshape(-1, 2):
            course = np.append(values[first:last, :-1].ravel(), values[last - 1, -1])
            least = min(least, course[0]) if self.begins[first] else least
            inner = (course[1:-1] <= course[:-2]) & (course[1:-1] < course[2:])
            least = min(least, course[1:-1][inner].min(initial=np.inf))
        return float(least)


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
