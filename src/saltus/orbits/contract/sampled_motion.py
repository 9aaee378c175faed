"""What the modes of a motion are, and a motion sampled so densely in each of its steps that all
extrema can be found.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import combinations
from typing import Any, NamedTuple

import numpy as np

from saltus.flow import (
    EventCode,
    EventKind,
    Motion,
    RowValues,
    closing_rates,
    contact_pull,
    modes_of,
)
from saltus.systems import NaturalUnits, System, natural_units, reactions, stick_margins

# in each step; minima of parabolas through them have errors of the fourth power of their distance
SAMPLES = 33
NEWTON_STEPS = 4  # from the largest sample of a coordinate to its extremum; each squares the error
# distances between the instants at which a force is evaluated near its least sample, in those of
# samples
NARROWER = (0.3, 1e-3)
MOST_ORDER = 24  # the highest order of a step's series
# Events nearer to each other than this share of the period happen at one instant, and steps between
# them are left out.
ONE_INSTANT = 1e-9
# The name of what a closed contact or a sticking friction lacks to open or to slip.
REACTION = "reaction or friction force"
# Samples after an event at which what begins with 0 there may be rounding.
AT_BEGIN = 2
# Slower impacts, in natural units, are not listed: they belong to an accumulation.
DYING = 1e-5

SHARES = np.linspace(0.0, 1.0, SAMPLES)
ORDERS = np.arange(MOST_ORDER + 1)
POWERS = SHARES ** ORDERS[:, None]  # of a series over a step of length 1, then of its derivatives
SLOPES = ORDERS[:, None] * SHARES ** np.maximum(ORDERS - 1, 0)[:, None]
BENDS = (ORDERS * (ORDERS - 1))[:, None] * SHARES ** np.maximum(ORDERS - 2, 0)[:, None]


class Group(NamedTuple):
    """Contacts and frictions that act on one another: their bits in an event's `parts`, and in its
    `mode` less 1.
    """

    parts: int
    modes: int


class GapAlong(NamedTuple):
    """The gap sign (q - p) of a contact, or of a surface from one of its sides, along a motion."""

    coordinate: int  # the place of q among the coordinates
    sign: float
    position: float  # p
    is_open: np.ndarray  # where it is open; of a surface, where the motion is on this side


class SideModes:
    """How motions on the sides of one contact, or without contacts, are read: their numbers `side`,
    their events and gaps.
    """

    def __init__(self, system: System) -> None:
        self.system = system

    def needs_whole(self, motion: Motion) -> bool:
        """Whether equations from event to event are not enough: where it rests, or where parts may
        hold single coordinates.
        """
        return len(motion.events.of(EventKind.REST)) > 0

    def numbers(self, side: np.ndarray) -> np.ndarray:
        """The numbers of the modes, from 1 on: 2 at rest, 1 and 3 on the sides -1 and +1."""
        return side + 2

    def equation_sides(self, side: np.ndarray) -> np.ndarray:
        """What the model's equations get as `side`."""
        return side

    def closed(self, side: np.ndarray) -> list[np.ndarray]:
        """Whether each contact is closed."""
        return [side == 0]

    def slides(self, side: np.ndarray) -> list[np.ndarray]:
        """The direction in which each friction slides, 0 where it sticks."""
        return []

    def image(self, parts: int, mode: int, images: Sequence[int]) -> tuple[int, int]:
        """The mirror images of the parts and the mode of an event; `images` are the numbers of the
        images of contacts, frictions and surfaces."""
        return parts, 4 - mode

    def groups(self, position: Any, smooth: frozenset[int] = frozenset()) -> tuple[Group, ...]:
        """The groups of contacts, frictions and surfaces, at a position, without the surfaces of
        the numbers `smooth`.
        """
        return (Group(1, 3),)

    def codes(self, motion: Motion) -> np.ndarray:
        """The kinds of the events, and the contacts and frictions that act as bits, (n, 2). A
        single contact is the first bit, and its rest is that of one that is held."""
        kinds = motion.events.codes[:, 0]
        return np.column_stack(
            [np.where(kinds == EventCode.REST, EventCode.HELD, kinds), np.ones(len(kinds), int)]
        )

    def impact_speeds(self, motion: Motion) -> np.ndarray:
        """The least speed at which each impact closes one of its contacts, (n,)."""
        return np.asarray(np.abs(motion.impacts.velocity_before))

    def listed(self, motion: Motion) -> np.ndarray:
        """Times and speeds of the impacts, (n, 2); if several contacts close at one instant, each
        has its own row.
        """
        return np.column_stack([motion.impacts.time, np.abs(motion.impacts.velocity_before)])

    def rests(
        self, events: Sequence[Any], times: Sequence[float], period: float
    ) -> list[tuple[float, float]]:
        """When a motion with these events, of a period, leaves each rest at a single contact, and
        when it comes to the next.
        """
        landed = [
            time for event, time in zip(events, times, strict=True) if event.kind == EventCode.HELD
        ]
        pairs = []
        for event, time in zip(events, times, strict=True):
            if event.kind == EventCode.RELEASE:
                pairs.append(
                    (time, min(later if later > time else later + period for later in landed))
                )
        return pairs

    def gaps(self, side: np.ndarray, smooth: frozenset[int] = frozenset()) -> list[GapAlong]:
        """The gaps of the contacts, that of a single contact on each side; and the distances from
        surfaces, without those of the numbers `smooth`.
        """
        if not self.system.model.has_one_contact:  # or none
            return []
        one = self.system.one_contact
        return [
            GapAlong(0, one.inward(number), float(one.contact), side == number)
            for number in one.sides
        ]

    def grazed(self, side: np.ndarray) -> list[GapAlong]:
        """The gaps whose least value is a quantity of an orbit; where one of several contacts
        closes, its events change.
        """
        return self.gaps(side)

    def slidings(self, side: np.ndarray) -> list[tuple[int, float, np.ndarray]]:
        """The place of the coordinate of each friction, the speed of its ground, and the direction
        in which it slides.
        """
        return []

    def functions(
        self, side: np.ndarray, smooth: frozenset[int]
    ) -> list[tuple[list[np.ndarray], Callable[..., list[Any]]]]:
        """The same for the sides of surfaces that are functions, without the numbers `smooth`."""
        return []

    def holding(self, side: np.ndarray) -> list[tuple[list[np.ndarray], Callable[..., list[Any]]]]:
        """Where coordinates are held, and the function of (model, t, q, v, a, load) whose values
        then are positive.
        """
        if not self.system.model.has_one_contact:
            return []
        pulls = [contact_pull(self.system, one) for one in self.system.one_contact.sides]
        return [([side == 0 for _ in pulls], lambda model, t, *_: [-pull(t) for pull in pulls])]


class ContactModes(SideModes):
    """How motions with several contacts or frictions are read, whose modes are 1 plus the bits that
    `modes_of` reads.
    """

    def needs_whole(self, motion: Motion) -> bool:
        return True

    def numbers(self, side: np.ndarray) -> np.ndarray:
        return side

    def equation_sides(self, side: np.ndarray) -> np.ndarray:
        return np.ones_like(side)

    def closed(self, side: np.ndarray) -> list[np.ndarray]:
        bits = modes_of(self.system.model, side)[0]
        return [bits >> i & 1 == 1 for i in range(len(self.system.contact_model.contacts))]

    def slides(self, side: np.ndarray) -> list[np.ndarray]:
        return modes_of(self.system.model, side)[1]

    def image(self, parts: int, mode: int, images: Sequence[int]) -> tuple[int, int]:
        model = self.system.contact_model
        closed = self.closed(np.array(mode))
        count = len(closed)
        # a surface is passed from its other side in the image: the direction along the coordinate
        slides = [
            *self.slides(np.array(mode)),
            *(
                surface.sign * side
                for surface, side in zip(
                    model.surfaces, modes_of(model, np.array(mode))[2], strict=True
                )
            ),
        ]
        found = 1
        for is_closed, image in zip(closed, images[:count], strict=True):
            found += int(is_closed) << image
        for direction, image in zip(slides, images[count:], strict=True):
            found += (3 if direction == 2 else 1 - int(direction)) << (count + 2 * (image - count))
        return sum(1 << image for i, image in enumerate(images) if parts >> i & 1), found

    def groups(self, position: Any, smooth: frozenset[int] = frozenset()) -> tuple[Group, ...]:
        """The contacts of each group if the mass matrix couples no coordinates of different groups;
        else one group of all.
        """
        model = self.system.contact_model
        known = self.system.contact_model
        contacts = known.contacts
        frictions = len(known.frictions) + len(known.surfaces)
        left_out = [len(known.frictions) + number for number in smooth]
        everything = (
            Group(
                (1 << len(contacts) + frictions)
                - 1
                - sum(1 << len(contacts) + place for place in left_out),
                (1 << len(contacts) + 2 * frictions)
                - 1
                - sum(3 << len(contacts) + 2 * place for place in left_out),
            ),
        )
        names = dict.fromkeys(contact.group for contact in contacts)
        if len(names) < 2 or frictions or model.has_multipliers:
            return everything
        mass = np.asarray(model.mass_matrix(position), dtype=float)
        places = [
            [model.coordinates.index(c.coordinate) for c in contacts if c.group == name]
            for name in names
        ]
        if any(mass[np.ix_(own, other)].any() for own, other in combinations(places, 2)):
            return everything
        bits = [
            sum(1 << i for i, contact in enumerate(contacts) if contact.group == name)
            for name in names
        ]
        return tuple(Group(own, own) for own in bits)

    def codes(self, motion: Motion) -> np.ndarray:
        return motion.events.codes

    def impact_speeds(self, motion: Motion) -> np.ndarray:
        return np.asarray(self._closing_speeds(motion).min(axis=0, initial=math.inf))

    def listed(self, motion: Motion) -> np.ndarray:
        """Without those of accumulations."""
        impacts = motion.impacts
        speeds = self._closing_speeds(motion)
        slowest = DYING * natural_units(self.system).speed
        contact, impact = np.nonzero((speeds > slowest) & np.isfinite(speeds))
        found = np.column_stack([impacts.time[impact], speeds[contact, impact]])
        return np.asarray(found[np.argsort(found[:, 0], kind="stable")])

    def _closing_speeds(self, motion: Motion) -> np.ndarray:
        """The speed at which each contact is closed by each impact, (contacts, n); inf where it is
        not.
        """
        impacts = motion.impacts
        names = self.system.model.coordinates
        contacts = self.system.contact_model.contacts
        rates = (
            closing_rates(motion)
            if self.system.model.has_multipliers
            else [impacts.velocity_before[:, names.index(c.coordinate)] for c in contacts]
        )
        speeds = np.full((len(contacts), len(impacts)), math.inf)
        for i in range(len(contacts)):
            speeds[i] = np.where(impacts.side >> i & 1 == 1, np.abs(rates[i]), math.inf)
        return speeds

    def rests(
        self, events: Sequence[Any], times: Sequence[float], period: float
    ) -> list[tuple[float, float]]:
        resting = [any(closed.item() for closed in self.closed(np.array(e.mode))) for e in events]
        return excursions(times, resting, period)

    def gaps(self, side: np.ndarray, smooth: frozenset[int] = frozenset()) -> list[GapAlong]:
        names = self.system.model.coordinates
        known = self.system.contact_model
        found = zip(known.contacts, self.closed(side), strict=True)
        gaps = [
            GapAlong(names.index(c.coordinate), c.sign, float(c.position), ~closed)
            for c, closed in found
            if not known.has_multipliers
        ]
        surfaces = zip(known.surfaces, modes_of(known, side)[2], strict=True)
        for number, (surface, beside) in enumerate(surfaces):
            if number in smooth or surface.function is not None:
                continue
            place = names.index(surface.coordinate)
            position = float(surface.position)
            # `beside` is the side as the surface counts it, the gap that of its coordinate
            side_of = surface.sign * beside
            gaps += [GapAlong(place, sign, position, side_of == sign) for sign in (1.0, -1.0)]
        return gaps

    def grazed(self, side: np.ndarray) -> list[GapAlong]:
        return []

    def slidings(self, side: np.ndarray) -> list[tuple[int, float, np.ndarray]]:
        names = self.system.model.coordinates
        pairs = zip(self.system.contact_model.frictions, self.slides(side), strict=True)
        return [
            (names.index(f.coordinate), float(f.ground_speed), np.where(s == 2, 0, s))
            for f, s in pairs
        ]

    def functions(
        self, side: np.ndarray, smooth: frozenset[int]
    ) -> list[tuple[list[np.ndarray], Callable[..., list[Any]]]]:
        known = self.system.contact_model
        found = list[tuple[list[np.ndarray], Callable[..., list[Any]]]]()
        surfaces = zip(known.surfaces, modes_of(known, side)[2], strict=True)
        for number, (surface, beside) in enumerate(surfaces):
            if surface.function is not None and number not in smooth:
                found.append(([beside > 0, beside < 0], partial(_of_function, surface)))
        return found

    def holding(self, side: np.ndarray) -> list[tuple[list[np.ndarray], Callable[..., list[Any]]]]:
        known = self.system.contact_model
        closed = self.closed(side)
        sticks = list[np.ndarray]()
        for friction, direction in zip(known.frictions, self.slides(side), strict=True):
            leans = [
                own
                for c, own in zip(known.contacts, closed, strict=True)
                if c.coordinate == friction.coordinate
            ]
            sticks += [
                (direction == 0) & ~np.any([*leans, np.zeros_like(direction, dtype=bool)], axis=0)
            ] * 2
        return [(closed, reactions), (sticks, stick_margins)]


def _of_function(
    surface: Any, model: Any, t: Any, q: Any, v: Any, a: Any, load: Any, *_: Any
) -> list[Any]:
    """What is positive along a motion while a surface that is a function has the side +1, and what
    is while it has -1."""
    return [
        side * np.asarray(surface.guard(model, side, t, q, v, load), dtype=float)
        for side in (1.0, -1.0)
    ]


def excursions(
    times: Sequence[float], resting: Sequence[bool], period: float
) -> list[tuple[float, float]]:
    """When a periodic motion leaves rest and when it comes to rest again, from the times of its
    events and whether a contact is closed after each.
    """
    count = len(times)
    pairs = []
    for i in range(count):
        if resting[i] or not resting[i - 1]:
            continue
        end = next(j for j in range(i + 1, i + count + 1) if resting[j % count])
        pairs.append((times[i], times[end % count] + period * (end >= count)))
    return pairs


def modes_in(system: System) -> SideModes:
    """How the motions of a system are read."""
    return (ContactModes if system.model.holds_coordinates else SideModes)(system)


@dataclass(frozen=True, eq=False)
class SampledMotion:
    """The steps of a motion with the states at evenly spaced instants of each step, its ends
    included. `position`, `velocity` and `acceleration` are (coordinates, steps, samples)."""

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
        length = dense.length[steps, None, None]
        count = dense.series.shape[2]
        scaled = (dense.series[steps] * length ** ORDERS[:count]).transpose(1, 0, 2)
        position, velocity, acceleration = (
            scaled @ table[:count] for table in (POWERS, SLOPES, BENDS)
        )
        tau = length[:, 0] * SHARES
        start = dense.start[steps]
        each = length[:, 0]
        begins = np.isin(start, motion.events.times)
        velocity, acceleration, time = velocity / each, acceleration / each**2, start[:, None] + tau
        return cls(
            motion,
            dense.series[steps],
            tau,
            time,
            position,
            velocity,
            acceleration,
            dense.side[steps],
            begins,
        )

    def only(self, steps: np.ndarray) -> SampledMotion:
        """The samples of some of the steps."""
        position = self.position[:, steps]
        velocity = self.velocity[:, steps]
        acceleration = self.acceleration[:, steps]
        series = self.series[steps]
        tau = self.tau[steps]
        side = self.side[steps]
        return SampledMotion(
            self.motion,
            series,
            tau,
            self.time[steps],
            position,
            velocity,
            acceleration,
            side,
            self.begins[steps],
        )

    def within_step(self, step: int, tau: np.ndarray) -> SampledMotion:
        """One step at other instants since its start."""
        c = self.series[step]
        powers = np.vander(tau, c.shape[1], increasing=True).T
        orders = ORDERS[: c.shape[1]]
        position = (c @ powers)[:, None]
        velocity = ((c * orders)[:, 1:] @ powers[:-1])[:, None]
        acceleration = ((c * orders * (orders - 1))[:, 2:] @ powers[:-2])[:, None]
        time = (self.time[step, :1] - self.tau[step, :1] + tau)[None]
        one = [step]
        side = self.side[one]
        begins = self.begins[one]
        return SampledMotion(
            self.motion, c[None], tau[None], time, position, velocity, acceleration, side, begins
        )

    def _state(self) -> tuple[Any, Any, Any]:
        """Coordinates, velocities and accelerations as a model takes them."""
        q, v, a = (
            x[0] if len(x) == 1 else tuple(x)
            for x in (self.position, self.velocity, self.acceleration)
        )
        return q, v, a

    def lowest(self) -> float:
        """The least value of any coordinate."""
        coordinate, step, sample = np.unravel_index(
            int(np.argmin(self.position)), self.position.shape
        )
        turned = _turned(
            self.series[step, coordinate], float(self.tau[step, sample]), self.tau[step]
        )
        return min(turned, float(self.position[coordinate, step, sample]))

    def highest(self) -> float:
        """The largest value of any coordinate."""
        coordinate, step, sample = np.unravel_index(
            int(np.argmax(self.position)), self.position.shape
        )
        turned = _turned(
            -self.series[step, coordinate], float(self.tau[step, sample]), self.tau[step]
        )
        return -min(turned, -float(self.position[coordinate, step, sample]))

    def margins(self) -> dict[str, float]:
        """The least value of each of the model's margins."""
        system = self.motion.system
        least = dict.fromkeys(system.model.margin_names(system.load), np.inf)
        sides = modes_in(system).equation_sides(self.side)
        for side in system.model.every_side:
            own = self.only(np.flatnonzero(sides == side))
            values = (
                system.model.margins(own.time, *own._state(), side, system.load)
                if own.time.size
                else {}
            )
            for name, value in values.items():
                least[name] = min(least[name], _least(np.broadcast_to(value, own.time.shape)))
        return least

    def lowest_gap(self) -> float:
        """The lowest inner minimum of the gap of a single contact, inf without one."""
        return self._lowest_of(modes_in(self.motion.system).grazed(self.side))

    def _lowest_of(self, gaps: list[GapAlong]) -> float:
        """The lowest inner minimum of any of these gaps, inf without one."""
        least = [np.inf]
        for place, sign, position, is_open in gaps:
            course = np.asarray(sign * self.series[:, place], dtype=float)
            course[:, 0] -= sign * position
            least.append(self._turning_of(course, sign * self.velocity[place], is_open))
        return float(min(least))

    def nearest_touch(
        self, units: NaturalUnits, smooth: frozenset[int] = frozenset()
    ) -> tuple[float, str]:
        """How near the motion comes to a further change of its mode: the least of the inner minima
        of the gaps of open contacts and of the distances from surfaces, the speeds of sliding
        frictions, the reactions of closed contacts; the forces that sticking frictions still lack
        to slip; all are in natural units. Surfaces of the numbers `smooth` do not count.

        For reactions and sticking frictions the value just after an event counts too. inf without
        such minima. The second part of the result names the quantity.
        """
        modes = modes_in(self.motion.system)
        least = [(self._lowest_of(modes.gaps(self.side, smooth)) / units.length, "gap")]
        if self.motion.system.model.has_multipliers:
            return min([*least, *self._nearest_of_rows(units)])
        for place, ground_speed, s in modes.slidings(self.side):
            course = s[:, None] * (self.series[:, place] * ORDERS[: self.series.shape[2]])[:, 1:]
            course[:, 0] = course[:, 0] - s * ground_speed
            speed = self._turning_of(course, s[:, None] * self.acceleration[place], s != 0)
            least.append((speed / units.speed, "sliding speed"))
        for chosen, values in modes.functions(self.side, smooth):
            everywhere = self.only(np.arange(len(self.side)))
            largest = float(np.abs(everywhere._forces(values)[0]).max(initial=0.0))
            for mask, number in zip(chosen, (0, 1), strict=True):
                steps = np.flatnonzero(mask)
                if steps.size and largest > 0.0:
                    one = lambda *given, n=number, f=values: [f(*given)[n]]  # noqa: E731
                    part = self.only(steps)
                    lowest = part._dip(steps, [mask[steps]], one, at_begin=False)
                    least.append((lowest / largest, "switching function"))
        # what holds a single contact is given as an acceleration
        alone = self.motion.system.model.has_one_contact
        largest = units.acceleration if alone else units.force
        for chosen, forces in modes.holding(self.side):
            steps = np.flatnonzero(np.any(chosen, axis=0)) if chosen else np.empty(0, dtype=int)
            if steps.size:
                force = self.only(steps)._dip(steps, [mask[steps] for mask in chosen], forces)
                least.append((force / largest, REACTION))
        value, what = min(least)
        return float(value), what

    def _nearest_of_rows(self, units: NaturalUnits) -> list[tuple[float, str]]:
        """`nearest_touch` of contacts and frictions that multipliers hold."""
        values = RowValues(self.motion.system)
        steps = np.arange(len(self.side))
        held = values.held_in(self.side)
        count = values.count
        closed = [held[:, i] for i in range(count)]
        slides = np.array(modes_of(self.motion.system.model, self.side)[1]).reshape(-1, len(steps))
        sliding = [np.abs(way) == 1 for way in slides]

        def rows_of(sampled: SampledMotion) -> list[np.ndarray]:
            """The gaps, then the sliding speeds."""
            times, states, _, side = sampled._instants()
            _, rates, gaps = values.along(times, states)
            ways = np.array(modes_of(values.model, side)[1]).reshape(-1, len(side))
            speeds = ways * rates[:, count:].T
            return [x.reshape(sampled.time.shape) for x in (*gaps.T, *speeds)]

        def forces_of(sampled: SampledMotion) -> list[np.ndarray]:
            found = values.forces_along(*sampled._instants())
            return [x.reshape(sampled.time.shape) for x in found.T]

        opened = [~mask for mask in closed]
        everywhere = [np.ones(len(steps), dtype=bool)] * (2 * len(slides) + 2)
        gaps, speeds = (
            self._dip(steps, chosen, rows_of, at_begin=False, lowest_hump=DYING**2 * unit)
            for unit, chosen in (
                (units.length, [*opened, *(np.zeros_like(mask) for mask in sliding)]),
                (units.speed, [*(np.zeros_like(mask) for mask in opened), *sliding]),
            )
        )
        force = self._dip(steps, [*closed, *everywhere], forces_of)
        return [
            (gaps / units.length, "gap"),
            (speeds / units.speed, "sliding speed"),
            (force / units.force, REACTION),
        ]

    def _instants(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """The times (n,), states (n, d) and accelerations of all samples, and the numbers of their
        modes."""
        size = len(self.position)
        states = np.concatenate([self.position, self.velocity]).reshape(2 * size, -1).T
        accelerations = self.acceleration.reshape(size, -1).T
        side = np.repeat(self.side, self.time.shape[1])
        return self.time.ravel(), states, accelerations, side

    def _turning_of(self, course: np.ndarray, rates: np.ndarray, chosen: np.ndarray) -> float:
        """The least of the minima of series (steps, orders), where their rates turn from negative
        to positive in chosen steps.
        """
        low = rates[:, :-1]
        high = rates[:, 1:]
        turns = (low < 0.0) & (high >= 0.0) & chosen[:, None]
        # after an event the value leaves 0, and the sign of its rate is rounding
        turns[self.begins, 0] = False
        step, sample = np.nonzero(turns)
        if not step.size:
            return np.inf
        begin = self.tau[step, sample]
        end = self.tau[step, sample + 1]
        when = begin + low[step, sample] / (low[step, sample] - high[step, sample]) * (end - begin)
        powers = when[:, None] ** ORDERS[: course.shape[1]]
        least = int(np.argmin((course[step] * powers).sum(axis=1)))
        return _turned(
            course[step[least]], float(when[least]), np.array([begin[least], end[least]])
        )

    def _dip(
        self,
        steps: np.ndarray,
        chosen: list[np.ndarray],
        forces: Callable[..., list[Any]],
        at_begin: bool = True,
        lowest_hump: float = 0.0,
    ) -> float:
        """The least inner minimum of any of several forces within stretches of successive chosen
        steps, or the force just after the event with which a stretch begins, if that is less.
        `steps` are the numbers of the steps in the whole motion.

        Not `at_begin`, of what is 0 there: then each stretch ends with an event, and minima just
        after one, which are rounding, do not count either. Nor do those of a stretch that stays
        below `lowest_hump`, such as the last bounces of an accumulation.
        """
        least = np.inf
        lowest = np.inf
        where = (0, 0, 0)
        for number, (values, mask) in enumerate(zip(self._forces(forces), chosen, strict=True)):
            mask = mask & ~np.isnan(values).any(axis=1)
            if not mask.any():
                continue
            follows = np.append(False, mask[:-1] & (np.diff(steps) == 1))
            follows &= at_begin | ~self.begins
            stretch = np.cumsum(mask & ~follows)
            for each in range(1, int(stretch[-1]) + 1):
                rows = np.flatnonzero(mask & (stretch == each))
                course = np.append(values[rows, :-1].ravel(), values[rows[-1], -1])
                if course.max() < lowest_hump:
                    continue
                begins = bool(self.begins[rows[0]])
                least = min(least, float(course[0])) if begins and at_begin else least
                inner = 1 + np.flatnonzero(
                    (course[1:-1] <= course[:-2]) & (course[1:-1] < course[2:])
                )
                if not at_begin and begins:
                    inner = inner[inner > AT_BEGIN]
                if inner.size and course[inner].min() < lowest:
                    place = int(inner[np.argmin(course[inner])])
                    row, sample = divmod(place, SAMPLES - 1)
                    lowest = float(course[place])
                    where = (number, int(rows[row]), sample)
        return min(least, lowest if lowest == np.inf else self._narrowed(*where, forces))

    def _forces(self, forces: Callable[..., list[Any]]) -> list[np.ndarray]:
        """The forces that the function `forces` gives along the samples, each (steps, samples)."""
        system = self.motion.system
        if system.model.has_multipliers:
            return forces(self)
        given = (self.time, *self._state()[:2])
        model: Any = system.model
        more = (
            ((), model.forces_along(*given, system.load, modes_in(system).closed(self.side)))
            if system.dependent
            else ()
        )
        values = forces(model, *given, list(self.acceleration), system.load, *more)
        return [
            np.broadcast_to(np.asarray(value, dtype=float), self.time.shape) for value in values
        ]

    def _narrowed(
        self, number: int, step: int, sample: int, forces: Callable[..., list[Any]]
    ) -> float:
        """The minimum of a force near a sample, from parabolas through three instants that lie ever
        closer together.
        """
        middle = float(self.tau[step, sample])
        apart = float(self.tau[step, 1])
        least = np.inf
        for share in NARROWER:
            offset = share * apart
            instants = self.within_step(step, middle + offset * np.array([-1.0, 0.0, 1.0]))
            low, here, high = instants._forces(forces)[number][0]
            bend = high - 2.0 * here + low
            slope = 0.5 * (high - low)
            ahead = float(np.clip(-slope / bend, -1.0 / share, 1.0 / share)) if bend > 0.0 else 0.0
            middle, least = middle + ahead * offset, here + 0.5 * slope * ahead
        return float(least)


def _turned(c: np.ndarray, t: float, between: np.ndarray) -> float:
    """The minimum of a series, by Newton's method on its slope from an instant nearby, within the
    times `between`.
    """
    orders = ORDERS[: len(c)]
    slope = (c * orders)[1:]
    bend = (c * orders * (orders - 1))[2:]
    for _ in range(NEWTON_STEPS):
        powers = t**orders
        curved = float(bend @ powers[:-2])
        t = (
            min(max(t - float(slope @ powers[:-1]) / curved, float(between[0])), float(between[-1]))
            if curved > 0.0
            else t
        )
    return float(c @ t**orders)


def _least(values: np.ndarray) -> float:
    """The least value along samples (..., samples), with the minima of the parabolas through each
    three of them.
    """
    low = values[..., :-2]
    middle = values[..., 1:-1]
    high = values[..., 2:]
    bend = high - 2.0 * middle + low
    slope = 0.5 * (high - low)
    with np.errstate(divide="ignore", invalid="ignore"):
        turned = np.where(
            (bend > 0.0) & (np.abs(slope) < bend), middle - 0.5 * slope**2 / bend, middle
        )
    return float(min(values.min(), turned.min()))
