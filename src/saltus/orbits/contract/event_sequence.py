"""The events of an orbit that is followed through them: their order, how near the orbit is to
having other events, and how they are read from a motion."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from saltus.errors import MotionError
from saltus.flow import EventCode, EventKind, Motion, modes_of
from saltus.orbits.contract.equations import FARTHEST
from saltus.orbits.contract.sampled_motion import ONE_INSTANT, Group, SampledMotion, modes_in
from saltus.orbits.signature import ModeChange, Signature
from saltus.systems import Load, NaturalUnits, System, corners_between, mass_rows

CHANGES = (
    EventCode.IMPACT,
    EventCode.REST,
    EventCode.RELEASE,
    EventCode.HELD,
    EventCode.STICK,
    EventCode.SLIP,
    EventCode.REVERSAL,
    EventCode.CROSSING,
)


# The kind of the first corner of the load in a forcing period, beside those of `EventCode`; the kinds
# of others are lower. Where an impact comes to one, the map over a period gets other derivatives.
CORNER = -1


@dataclass(frozen=True)
class EventSettings:
    """Which events happen at one instant, which impacts belong to an accumulation, and when a
    section has to be moved.
    """

    # Impacts have not begun to die away if one is faster than its predecessor by more than this
    # share.
    grows: float = 1e-6
    # The section is moved if it is nearer to an event than this share of the time between the
    # events before and after it.
    section_distance: float = 0.02


SETTINGS = EventSettings()
TIME_BETWEEN = "time between events"  # one of the quantities that vanish at a change of events
TIME_TO_CORNER = "time between an event and a corner of the load"


class OrbitEvent(NamedTuple):
    """An event: its kind as in `EventCode`, or CORNER; the contacts and frictions as bits, and the
    number of the mode after it.
    """

    kind: int
    parts: int
    mode: int


@dataclass(frozen=True)
class EventSequence:
    """The events of an orbit from its section on, and how near it is to an orbit with other
    events.
    """

    events: tuple[OrbitEvent, ...]
    times: tuple[float, ...]
    period: float
    natural_time: float
    # the least of the gaps, speeds, reactions and durations that become 0 where an event appears or
    # is lost, in natural units
    distance: float
    # where the section lies between its neighbouring events: 0 on one of them, 1/2 in the middle
    section_distance: float

    groups: tuple[Group, ...]  # the groups of contacts and frictions
    witness: str  # which of these quantities `distance` is

    @property
    def sequence(self) -> tuple[OrbitEvent, ...]:
        """The events of one group after the other, each begun with the same event wherever the
        section lies, so that the sequences of two orbits can be compared. The order of events of
        different groups makes no difference and is left out."""
        found: tuple[OrbitEvent, ...] = ()
        for parts, modes in self.groups:
            events = tuple(
                event._replace(mode=event.mode - 1 & modes)
                for event in self.events
                if event.parts & parts
            )
            found += min((events[i:] + events[:i] for i in range(len(events))), default=())
        return found

    @property
    def impact_count(self) -> int:
        """The number of impacts, without those of accumulations."""
        return sum(event.kind == EventCode.IMPACT for event in self.events)

    def until_next(self, kinds: tuple[int, int]) -> float:
        """The least time between two successive events of one contact or friction that are of these
        two kinds; inf without such."""
        n = len(self.events)
        least = math.inf
        for i, event in enumerate(self.events):
            if event.kind <= CORNER:
                continue
            later = next(
                j
                for j in range(i + 1, i + n + 1)
                if self.events[j % n].parts & event.parts and self.events[j % n].kind > CORNER
            )
            if (event.kind, self.events[later % n].kind) == kinds:
                least = min(
                    least,
                    self.times[later % n] - self.times[i] + (self.period if later >= n else 0.0),
                )
        return least


def sequence_of(
    motion: Motion,
    sampled: SampledMotion,
    units: NaturalUnits,
    images: Sequence[int] | None = None,
    smooth: frozenset[int] = frozenset(),
) -> EventSequence:
    """The events of one period of an orbit, whose motion begins at its section. Crossings of the
    surfaces `smooth`, across which forces are continuous, are none.

    With `images`, the number of the mirror image of each contact and friction, the motion is half a
    period of a symmetric orbit: the images of its events follow.
    """
    period = motion.time - motion.start
    modes = modes_in(motion.system)
    listed, when, all_speeds = _listed(motion, smooth)
    events = tuple(listed)
    times = tuple(when.tolist())
    groups = modes.groups(motion.position, smooth)
    speeds = [
        speed
        for event, speed in zip(events, all_speeds.tolist(), strict=True)
        if event.kind == EventCode.IMPACT
    ]
    section_distance = _section_distance(motion, period)
    if images is not None:
        events += tuple(
            OrbitEvent(event.kind, *modes.image(event.parts, event.mode, images))
            for event in events
        )
        times, period = times + tuple(time + period for time in times), 2.0 * period
    apart = [FARTHEST * units.time]
    for group in groups:
        own = [time for event, time in zip(events, times, strict=True) if event.parts & group.parts]
        apart += np.diff([*own, own[0] + period]).tolist() if len(own) > 1 else []
    later = min(time for time in apart if time > ONE_INSTANT * period)
    quantities = [
        sampled.nearest_touch(units, smooth),
        (min(speeds, default=math.inf) / units.speed, "speed of an impact"),
        (float(later) / units.time, TIME_BETWEEN),
    ]
    events, times = _in_order(events, times, ONE_INSTANT * period)
    halves = [0.0] if images is None else [0.0, 0.5 * period]
    corners = _corners(motion, events, times, period, halves)
    if corners.size and events:
        to_corner = np.abs(np.array(times)[:, None] - corners)
        quantities.append((float(to_corner.min()) / units.time, TIME_TO_CORNER))
        events, times = _with_corners(motion.system.load, events, times, corners, groups)
    distance, witness = min(quantities)
    return EventSequence(
        events, times, period, units.time, max(distance, 0.0), section_distance, groups, witness
    )


def _listed(
    motion: Motion, smooth: frozenset[int]
) -> tuple[list[OrbitEvent], np.ndarray, np.ndarray]:
    """The events that change the mode, without the impacts of accumulations and the crossings of
    the surfaces `smooth`; their times; and how fast each closes a contact.
    """
    found = motion.events
    dense = motion.dense
    reading = modes_in(motion.system)
    times = found.times
    codes = reading.codes(motion)
    speeds = np.full(len(found), math.inf)
    speeds[codes[:, 0] == EventCode.IMPACT] = reading.impact_speeds(motion)
    # a rest is recorded besides the event that brings it, and at the start of a motion: it counts
    # only if it stands alone
    alone = (np.searchsorted(times, times, side="right") - np.searchsorted(times, times) == 1) & (
        times > motion.start
    )
    chosen = np.isin(codes[:, 0], CHANGES) & (alone | (codes[:, 0] != EventCode.REST))
    groups = reading.groups(motion.position, smooth)
    chosen &= codes[:, 1] & sum(parts for parts, _ in groups) != 0
    kept = np.flatnonzero(chosen)
    together = ONE_INSTANT * (motion.time - motion.start)
    for parts, _ in groups:
        own = kept[codes[kept, 1] & parts != 0]
        own_codes = np.column_stack([codes[own, 0], codes[own, 1] & parts])
        chosen[own[_dying(own_codes, speeds[own])]] = False
        chosen[own[_repeated(own_codes, times[own], together)]] = False
    times, codes = times[chosen], codes[chosen]
    if dense is None or not times.size:
        return [], times, speeds[chosen]
    modes = reading.numbers(dense.side[np.searchsorted(dense.start, times, side="right") - 1])
    events = [OrbitEvent(*numbers) for numbers in np.column_stack([codes, modes]).tolist()]
    return events, times, speeds[chosen]


def _corners(
    motion: Motion,
    events: tuple[OrbitEvent, ...],
    times: tuple[float, ...],
    period: float,
    halves: list[float],
) -> np.ndarray:
    """The times of the load's corners in a period, without those whose jump is an event itself, as
    it releases what rests."""
    corners = corners_between(motion.system.load, motion.start, motion.time)
    corners = np.concatenate([corners + later for later in halves])
    jumps = [
        time
        for event, time in zip(events, times, strict=True)
        if event.kind not in (EventCode.IMPACT, EventCode.CROSSING)
    ]
    apart = np.abs(corners[:, None] - np.array(jumps)).min(axis=1, initial=math.inf)
    return np.asarray(corners[apart > ONE_INSTANT * period])


def _with_corners(
    load: Load,
    events: tuple[OrbitEvent, ...],
    times: tuple[float, ...],
    corners: np.ndarray,
    groups: tuple[Group, ...],
) -> tuple[tuple[OrbitEvent, ...], tuple[float, ...]]:
    """Events with the corners of the load between them, each of which acts on all parts and has
    the mode before it."""
    parts = 0
    for group in groups:
        parts |= group.parts
    modes = [events[int(np.searchsorted(times, corner)) - 1].mode for corner in corners]
    shares = load.corners
    frequency = float(load.frequency or 0.0)
    ahead = (corners[:, None] * frequency / math.tau - shares + 0.5) % 1.0 - 0.5
    numbers = np.abs(ahead).argmin(axis=1)
    added = [
        OrbitEvent(CORNER - int(number), parts, mode)
        for number, mode in zip(numbers, modes, strict=True)
    ]
    order = np.argsort([*times, *corners], kind="stable")
    together = [*zip(events, times, strict=True), *zip(added, corners.tolist(), strict=True)]
    return tuple(together[i][0] for i in order), tuple(together[i][1] for i in order)


def _dying(codes: np.ndarray, speeds: np.ndarray) -> np.ndarray:
    """Which events of a group, (n, 2), belong to an accumulation: infinitely many impacts that die
    away until contacts are held.

    The accumulation begins after the last impact that is slower than its successor.
    """
    dying = np.zeros(len(codes), dtype=bool)
    for last in np.flatnonzero(np.isin(codes[:, 0], (EventCode.HELD, EventCode.REST))):
        others = (codes[:last, 0] != EventCode.IMPACT) | (codes[:last, 1] & ~codes[last, 1] != 0)
        first = 1 + int(np.flatnonzero(others)[-1]) if others.any() else 0
        run = speeds[first:last]
        growing = np.flatnonzero(run[1:] > (1.0 + SETTINGS.grows) * run[:-1])
        dying[first + growing[-1] + 1 if growing.size else first : last] = True
    return dying


def _repeated(codes: np.ndarray, times: np.ndarray, together: float) -> np.ndarray:
    """Which events of a group, (n, 2), are impacts at the instant of an earlier event of their
    contacts: what is held or released just before an event of another group may touch again there,
    by rounding and without speed.
    """
    again = np.zeros(len(codes), dtype=bool)
    # few events are so close, of many impacts of accumulations too
    later = 1 + np.flatnonzero(np.diff(times) <= together)
    for i in later[codes[later, 0] == EventCode.IMPACT]:
        same = codes[:i, 1] & codes[i, 1] == codes[i, 1]
        again[i] = (same & (times[i] - times[:i] <= together)).any()
    return again


def _in_order(
    events: tuple[OrbitEvent, ...], times: tuple[float, ...], together: float
) -> tuple[tuple[OrbitEvent, ...], tuple[float, ...]]:
    """Events in an order that does not depend on rounding: those of different contacts at one
    instant, as of cells that move alike, are sorted by contact, and each has the mode after all of
    them.

    Rounding decides which of them the motion records first, and which of them it records as one
    event.
    """
    found = list[tuple[OrbitEvent, float]]()
    begin = 0
    for end in range(1, len(events) + 1):
        if end < len(events) and times[end] - times[begin] <= together:
            continue
        here = list(zip(events[begin:end], times[begin:end], strict=True))
        parts = [
            1 << i for i in range(max(event.parts for event in events[begin:end]).bit_length())
        ]
        split = [
            (OrbitEvent(e.kind, part, events[end - 1].mode), t)
            for part in parts
            for e, t in here
            if e.parts & part
        ]
        found += split if len({event.parts for event, _ in split}) > 1 else here
        begin = end
    return tuple(event for event, _ in found), tuple(time for _, time in found)


def _section_distance(motion: Motion, period: float) -> float:
    times = motion.events.times[np.isin(motion.events.codes[:, 0], CHANGES)]
    corners = corners_between(motion.system.load, motion.start, motion.start + period)
    times = np.sort(np.concatenate([times, corners])) if times.size else times
    if not times.size:
        return 0.5
    after = times[0] - motion.start
    before = motion.start + period - times[-1]
    return float(min(after, before) / (after + before))


# A mass matrix that depends on the coordinates is looked at where they have these sizes.
PLACES_OF_MASS = 0.13, 0.21
STAYS = (
    "the motion comes to rest with all coordinates held at contacts for good, which is no "
    "orbit to follow; start elsewhere"
)


def section_of(
    motion: Motion, frequency: float, phase: float | None = None, duration: float | None = None
) -> tuple[float, np.ndarray]:
    """The phase and the state of a motion at a section: the middle of its longest smooth stretch
    within the first `duration`, also between corners of its load, in which not all coordinates are
    held; or the state at a phase that is given.

    The longer that stretch, the longer a branch can be followed before an event comes to the
    section.
    """
    time = (
        section_time(motion, duration)
        if phase is None
        else motion.start + (phase / frequency - motion.start) % (2.0 * np.pi / frequency)
    )
    state = np.concatenate([np.atleast_1d(x) for x in motion.at(time)])
    return time * frequency % (2.0 * np.pi), state


def section_time(motion: Motion, duration: float | None = None) -> float:
    """The middle of a motion's longest smooth stretch within the first `duration`, also between
    corners of its load, in which not all coordinates are held.
    """
    assert motion.dense is not None
    end = motion.time if duration is None else motion.start + duration
    bounds = np.unique(
        [
            motion.start,
            *corners_between(motion.system.load, motion.start, end),
            *(event.time for event in motion.events if motion.start < event.time < end),
            end,
        ]
    )
    spans = np.diff(bounds)
    middles = 0.5 * (bounds[1:] + bounds[:-1])
    moves = _moves(motion.system, motion.dense.states(middles)[2])
    return float(middles[max(range(len(spans)), key=lambda i: (moves[i], spans[i]))])


def held_at(motion: Motion, time: float) -> int:
    """The contacts that are closed at a time, and behind them the frictions that stick, as bits, of
    a motion in which multipliers hold them; else 0."""
    model = motion.system.model
    if not model.has_multipliers:
        return 0
    assert motion.dense is not None
    side = motion.dense.states(np.array([time]))[2]
    bits, slides, _ = modes_of(model, side)
    sticks = sum(1 << k for k, way in enumerate(slides) if way[0] == 0)
    return int(bits[0]) | sticks << len(model.contacts)


def relays_at(motion: Motion, times: np.ndarray) -> np.ndarray:
    """The side of each relay of a motion's model, +1 or -1, at times (n,) between its events,
    (n, relays)."""
    model: Any = motion.system.model
    if not model.relays:
        return np.zeros((len(times), 0), dtype=int)
    assert motion.dense is not None
    sides = modes_of(model, motion.dense.states(times)[2])[2]
    known = zip(model.surfaces, sides, strict=True)
    return np.stack([side for part, side in known if part in model.relays], axis=1).astype(int)


def remembered_at(motion: Motion, time: float | None = None) -> dict[str, Any]:
    """The argument `relays` of `simulate` at a time of a motion, by default at its end; nothing for
    a model without relays."""
    relays = motion.system.model.relays
    if not relays:
        return {}
    if time is None:
        ends = motion.sides
        sides = [ends[relay.name] for relay in relays]
    else:
        sides = relays_at(motion, np.array([time]))[0].tolist()
    return {"relays": {relay.name: side > 0 for relay, side in zip(relays, sides, strict=True)}}


def relays_over_round(motion: Motion, time: float, duration: float) -> tuple[int, ...]:
    """The side of each relay at a time of a motion, which a round later has the same ones.

    Raises
    ------
    MotionError
        It has others.
    """
    begin, end = relays_at(motion, np.array([time, min(time + duration, motion.time)])).tolist()
    for relay, before, after in zip(motion.system.model.relays, begin, end, strict=True):
        if before != after:
            states = ("off", "on") if after > 0 else ("on", "off")
            raise MotionError(
                f"the relay {relay.name!r} is {states[0]} at the start of a round of"
                f" {duration:.9g}, at time {time:.9g}, and {states[1]} at its end: that is no"
                " orbit; try another period=..., or let the motion settle first (settle=...)"
            )
    return tuple(begin)


def _moves(system: System, side: np.ndarray) -> np.ndarray:
    """Whether a motion with these numbers `side` is not held altogether, (n,)."""
    modes = modes_in(system)
    held = np.sum(
        [
            np.zeros(np.shape(side)),
            *modes.closed(side),
            *(direction == 0 for direction in modes.slides(side)),
        ],
        axis=0,
    )
    return np.asarray(held < len(system.model.coordinates) - system.dependent)


def read_signature(
    motion: Motion, periods: int, frequency: float
) -> tuple[Signature, np.ndarray, np.ndarray]:
    """The signature of a motion that was followed for twice `periods`, the state after its first
    event, and the events' phases.

    The events are those of a span of `periods` forcing periods that begins in the middle between
    two events.
    """
    period = motion.system.load.period
    assert period is not None
    changes = _mode_changes(motion, ONE_INSTANT * period)
    times = np.array([time for time, _ in changes])
    start = motion.start
    length = periods * period
    bounds = np.concatenate([[start], times[times < start + length], [start + length]])
    longest = int(np.argmax(np.diff(bounds)))
    begin = bounds[longest : longest + 2].mean()
    chosen = [(time, change) for time, change in changes if begin <= time < begin + length]
    events = tuple(change for _, change in chosen)
    signature = Signature((), periods, events=events, closed=0 if events else motion.side - 1)
    position, velocity = motion.at(chosen[0][0] if chosen else motion.start)
    after = np.append(np.atleast_1d(position), np.atleast_1d(velocity))
    return signature, after, np.array([time for time, _ in chosen]) * frequency


def _mode_changes(motion: Motion, together: float) -> list[tuple[float, ModeChange]]:
    """The events at which contacts open or close, each with its time and the contacts that are
    closed after it.

    Contacts that do not act on one another, such as those of the cells of a chain that move alike
    or of the two ends of a pipe, may act at one instant. These count as events one after the other,
    in the order of the contacts.

    Raises
    ------
    MotionError
        There are events for which orbits have no equations.
    """
    blocks = contact_blocks(motion.system)
    last = motion.start
    changes: list[tuple[float, ModeChange]] = []
    for time, acting in _instants(motion, together, blocks):
        before = int(motion.closed_at(0.5 * (last + time)))
        closed = int(motion.closed_at(time))
        here = list[tuple[float, ModeChange]]()
        # before its event all contacts of a block are as they were
        for contact in sorted(acting, reverse=True):
            here.append((time, ModeChange(acting[contact], contact, closed)))
            closed = closed & ~blocks[contact] | before & blocks[contact]
        changes += reversed(here)
        last = time
    return changes


def contact_blocks(system: System) -> list[int]:
    """For each contact the contacts, as bits, on which it acts at an impact: those that the mass
    matrix or the restitution couples with it.

    Contacts of different blocks may act at one instant, as no impulse of one changes the rate of
    another one's gap.
    """
    model = system.contact_model
    size = len(model.coordinates)
    places = [model.coordinates.index(contact.coordinate) for contact in model.contacts]
    coupled = np.eye(size, dtype=bool)
    for x in PLACES_OF_MASS:
        q = x if size == 1 else tuple(x / (1 + i) for i in range(size))
        coupled |= np.asarray(mass_rows(model, q), dtype=float) != 0.0
    for i, row in enumerate(system.impact.restitution_matrix(model)):
        for j, entry in enumerate(row):
            coupled[places[i], places[j]] |= float(entry) != 0.0
    for _ in range(size):
        coupled = coupled @ (coupled | coupled.T)
    return [sum(1 << j for j, b in enumerate(places) if coupled[a, b]) for a in places]


def _instants(
    motion: Motion, together: float, blocks: Sequence[int]
) -> list[tuple[float, dict[int, bool]]]:
    """The instants at which contacts act: for each of them the contacts, and whether it is an
    impact (else a release).
    """
    names = [contact.name for contact in motion.system.contact_model.contacts]
    instants = list[tuple[float, dict[int, bool]]]()
    events: Sequence[Any] = motion.events
    for event in events:
        if event.kind not in (EventKind.IMPACT, EventKind.RELEASE):
            continue
        if not instants or event.time - instants[-1][0] >= together:
            instants.append((event.time, {}))
        time, acting = instants[-1]
        instants[-1] = event.time, acting
        for contact in (
            range(len(names))
            if event.contact == "both"
            else map(names.index, event.contact.split("+"))
        ):
            is_impact = event.kind is EventKind.IMPACT
            beside = [i for i in acting if i != contact and blocks[contact] >> i & 1]
            if beside or (contact in acting and is_impact):
                both = " and ".join(repr(names[i]) for i in sorted({contact, *beside}))
                raise MotionError(
                    f"two events at {both} at one instant, {time:.6g}: their order matters, so "
                    f"that an orbit has no equations there"
                )
            acting.setdefault(contact, is_impact)
    return instants
