"""A motion sampled so densely in each of its steps that all extrema can be found."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from saltus.flow import Motion, contact_pull, modes_of
from saltus.systems import reactions, stick_margins

SAMPLES = 33  # in each step; minima of parabolas through them have errors of the fourth power of their distance
NEWTON_STEPS = 4  # from the largest sample of a coordinate to its extremum; each squares the error
NARROWER = (0.3, 1e-3)  # distances between the instants at which a force is evaluated near its least sample, in those of samples
MOST_ORDER = 24  # the highest order of a step's series
# Events nearer to each other than this share of the motion's duration happen at one instant, and steps between them are left out.
ONE_INSTANT = 1e-9

SHARES = np.linspace(0.0, 1.0, SAMPLES)
ORDERS = np.arange(MOST_ORDER + 1)
POWERS = SHARES ** ORDERS[:, None]  # of a series over a step of length 1, then of its derivatives
SLOPES = ORDERS[:, None] * SHARES ** np.maximum(ORDERS - 1, 0)[:, None]
BENDS = (ORDERS * (ORDERS - 1))[:, None] * SHARES ** np.maximum(ORDERS - 2, 0)[:, None]


@dataclass(frozen=True, eq=False)
class SampledMotion:
    """The steps of a motion with the states at evenly spaced instants of each step, its ends included. `position`, `velocity` and
    `acceleration` are (coordinates, steps, samples)."""

    motion: Motion
    series: np.ndarray
    tau: np.ndarray  # (steps, samples): the time since the start of the step
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
        steps = np.flatnonzero(dense.length > ONE_INSTANT * (motion.time - motion.start))
        length, count = dense.length[steps, None, None], dense.series.shape[2]
        scaled = (dense.series[steps] * length ** ORDERS[:count]).transpose(1, 0, 2)
        position, velocity, acceleration = (scaled @ table[:count] for table in (POWERS, SLOPES, BENDS))
        tau, start, each = length[:, 0] * SHARES, dense.start[steps], length[:, 0]
        begins = np.isin(start, motion.events.times)
        velocity, acceleration, time = velocity / each, acceleration / each**2, start[:, None] + tau
        return cls(motion, dense.series[steps], tau, time, position, velocity, acceleration, dense.side[steps], begins)

    def only(self, steps: np.ndarray) -> SampledMotion:
        """The samples of some of the steps."""
        position, velocity, acceleration = self.position[:, steps], self.velocity[:, steps], self.acceleration[:, steps]
        series, tau, side = self.series[steps], self.tau[steps], self.side[steps]
        return SampledMotion(
            self.motion, series, tau, self.time[steps], position, velocity, acceleration, side, self.begins[steps]
        )

    def within_step(self, step: int, tau: np.ndarray) -> SampledMotion:
        """One step at other instants since its start."""
        c = self.series[step]
        powers, orders = np.vander(tau, c.shape[1], increasing=True).T, ORDERS[: c.shape[1]]
        position, velocity = (c @ powers)[:, None], ((c * orders)[:, 1:] @ powers[:-1])[:, None]
        acceleration = ((c * orders * (orders - 1))[:, 2:] @ powers[:-2])[:, None]
        time, one = (self.time[step, :1] - self.tau[step, :1] + tau)[None], [step]
        side, begins = self.side[one], self.begins[one]
        return SampledMotion(self.motion, c[None], tau[None], time, position, velocity, acceleration, side, begins)

    def _state(self) -> tuple[Any, Any, Any]:
        """Coordinates, velocities and accelerations as a model takes them."""
        parts = (self.position, self.velocity, self.acceleration)
        q, v, a = (x[0] if len(x) == 1 else tuple(x) for x in parts)
        return q, v, a

    def lowest(self) -> float:
        """The least value of any coordinate."""
        coordinate, step, sample = np.unravel_index(int(np.argmin(self.position)), self.position.shape)
        turned = _turned(self.series[step, coordinate], float(self.tau[step, sample]), self.tau[step])
        return min(turned, float(self.position[coordinate, step, sample]))

    def highest(self) -> float:
        """The largest value of any coordinate."""
        coordinate, step, sample = np.unravel_index(int(np.argmax(self.position)), self.position.shape)
        turned = _turned(-self.series[step, coordinate], float(self.tau[step, sample]), self.tau[step])
        return -min(turned, -float(self.position[coordinate, step, sample]))

    def margins(self) -> dict[str, float]:
        """The least value of each of the model's margins."""
        system = self.motion.system
        least = dict.fromkeys(system.model.margin_names(system.load), np.inf)
        for side in system.model.every_side:
            own = self if system.model.holds_coordinates else self.only(np.flatnonzero(self.side == side))
            values = system.model.margins(own.time, *own._state(), side, system.load) if own.time.size else {}
            for name, value in values.items():
                least[name] = min(least[name], _least(np.broadcast_to(value, own.time.shape)))
        return least

    def lowest_gap(self) -> float:
        """The lowest inner minimum of the gap of a single contact, inf without one."""
        if self.motion.system.model.holds_coordinates:
            return np.inf
        least, one = [np.inf], self.motion.system.one_contact
        for side in one.sides:
            inward = one.inward(side)
            course = inward * self.series[:, 0]
            course[:, 0] -= inward * float(one.contact)
            least.append(self._turning_of(course, inward * self.velocity[0], self.side == side))
        return float(min(least))

    def _nearest_of_one(self) -> float:
        """`nearest_touch` with a single contact: its gap's minima, and how far the load is from pulling it open while it is at
        rest."""
        system, steps, least = self.motion.system, np.flatnonzero(self.side == 0), [self.lowest_gap()]
        pulls = [contact_pull(system, side) for side in system.model.sides]
        if steps.size:
            resting = [np.ones(steps.size, dtype=bool) for _ in pulls]
            least.append(self.only(steps)._dip(steps, resting, lambda model, t, *_: [-pull(t) for pull in pulls]))
        return float(min(least))

    def nearest_touch(self) -> float:
        """How near the motion comes to a further change of its mode: the least of the inner minima of the gaps of open contacts,
        the speeds of sliding frictions, the reactions of closed contacts, and the forces that sticking frictions still lack to
        slip.

        For reactions and sticking frictions the value just after an event counts too. inf without such minima.
        """
        model, names = self.motion.system.model, self.motion.system.model.coordinates
        if not model.holds_coordinates:
            return self._nearest_of_one()
        closed, slides = modes_of(model, self.side)
        least = [np.inf]
        for i, contact in enumerate(model.contacts):
            place, is_open = names.index(contact.coordinate), closed >> i & 1 == 0
            course = contact.sign * self.series[:, place]
            course[:, 0] -= contact.sign * float(contact.position)
            least.append(self._turning_of(course, contact.sign * self.velocity[place], is_open))
        for friction, s in zip(model.frictions, slides, strict=True):
            place = names.index(friction.coordinate)
            course = s[:, None] * (self.series[:, place] * ORDERS[: self.series.shape[2]])[:, 1:]
            course[:, 0] -= s * float(friction.ground_speed)
            least.append(self._turning_of(course, s[:, None] * self.acceleration[place], s != 0))
        holds = [closed >> i & 1 == 1 for i in range(len(model.contacts))]
        sticks = [s == 0 for s in slides for _ in range(2)]
        for chosen, forces in ((holds, reactions), (sticks, stick_margins)):
            steps = np.flatnonzero(np.any(chosen, axis=0)) if chosen else np.empty(0, dtype=int)
            if steps.size:
                least.append(self.only(steps)._dip(steps, [mask[steps] for mask in chosen], forces))
        return float(min(least))

    def _turning_of(self, course: np.ndarray, rates: np.ndarray, chosen: np.ndarray) -> float:
        """The least of the minima of series (steps, orders), where their rates turn from negative to positive in chosen steps."""
        low, high = rates[:, :-1], rates[:, 1:]
        turns = (low < 0.0) & (high >= 0.0) & chosen[:, None]
        turns[self.begins, 0] = False  # after an event the value leaves 0, and the sign of its rate is rounding
        step, sample = np.nonzero(turns)
        if not step.size:
            return np.inf
        begin, end = self.tau[step, sample], self.tau[step, sample + 1]
        when = begin + low[step, sample] / (low[step, sample] - high[step, sample]) * (end - begin)
        powers = when[:, None] ** ORDERS[: course.shape[1]]
        least = int(np.argmin((course[step] * powers).sum(axis=1)))
        return _turned(course[step[least]], float(when[least]), np.array([begin[least], end[least]]))

    def _dip(self, steps: np.ndarray, chosen: list[np.ndarray], forces: Callable[..., list[Any]]) -> float:
        """The least inner minimum of any of several forces within stretches of successive chosen steps, or the force just after
        the event with which a stretch begins, if that is less. `steps` are the numbers of the steps in the whole motion.
        """
        least, lowest, where = np.inf, np.inf, (0, 0, 0)
        for number, (values, mask) in enumerate(zip(self._forces(forces), chosen, strict=True)):
            follows = np.append(False, mask[:-1] & (np.diff(steps) == 1))
            stretch = np.cumsum(mask & ~follows)
            for each in range(1, int(stretch[-1]) + 1):
                rows = np.flatnonzero(mask & (stretch == each))
                course = np.append(values[rows, :-1].ravel(), values[rows[-1], -1])
                least = min(least, float(course[0])) if self.begins[rows[0]] else least
                inner = 1 + np.flatnonzero((course[1:-1] <= course[:-2]) & (course[1:-1] < course[2:]))
                if inner.size and course[inner].min() < lowest:
                    place = int(inner[np.argmin(course[inner])])
                    row, sample = divmod(place, SAMPLES - 1)
                    lowest, where = float(course[place]), (number, int(rows[row]), sample)
        return min(least, lowest if lowest == np.inf else self._narrowed(*where, forces))

    def _forces(self, forces: Callable[..., list[Any]]) -> list[np.ndarray]:
        """The forces that the function `forces` gives along the samples, each (steps, samples)."""
        q, v, _ = self._state()
        values = forces(self.motion.system.model, self.time, q, v, list(self.acceleration), self.motion.system.load)
        return [np.broadcast_to(np.asarray(value, dtype=float), self.time.shape) for value in values]

    def _narrowed(self, number: int, step: int, sample: int, forces: Callable[..., list[Any]]) -> float:
        """The minimum of a force near a sample, from parabolas through three instants that lie ever closer together."""
        middle, apart, least = float(self.tau[step, sample]), float(self.tau[step, 1]), np.inf
        for share in NARROWER:
            offset = share * apart
            instants = self.within_step(step, middle + offset * np.array([-1.0, 0.0, 1.0]))
            low, here, high = instants._forces(forces)[number][0]
            bend, slope = high - 2.0 * here + low, 0.5 * (high - low)
            ahead = float(np.clip(-slope / bend, -1.0 / share, 1.0 / share)) if bend > 0.0 else 0.0
            middle, least = middle + ahead * offset, here + 0.5 * slope * ahead
        return float(least)


def _turned(c: np.ndarray, t: float, between: np.ndarray) -> float:
    """The minimum of a series, by Newton's method on its slope from an instant nearby, within the times `between`."""
    orders = ORDERS[: len(c)]
    slope, bend = (c * orders)[1:], (c * orders * (orders - 1))[2:]
    for _ in range(NEWTON_STEPS):
        powers = t**orders
        curved = float(bend @ powers[:-2])
        t = min(max(t - float(slope @ powers[:-1]) / curved, float(between[0])), float(between[-1])) if curved > 0.0 else t
    return float(c @ t**orders)


def _least(values: np.ndarray) -> float:
    """The least value along samples (..., samples), with the minima of the parabolas through each three of them."""
    low, middle, high = values[..., :-2], values[..., 1:-1], values[..., 2:]
    bend, slope = high - 2.0 * middle + low, 0.5 * (high - low)
    with np.errstate(divide="ignore", invalid="ignore"):
        turned = np.where((bend > 0.0) & (np.abs(slope) < bend), middle - 0.5 * slope**2 / bend, middle)
    return float(min(values.min(), turned.min()))
