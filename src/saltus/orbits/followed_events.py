"""What happens along an orbit that is followed through its events: in which order, and how near that is to being another one."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from saltus.flow import EventCode, Motion, modes_of
from saltus.orbits.sampled_motion import SampledMotion
from saltus.systems import Model

CHANGES = (
    EventCode.IMPACT,
    EventCode.RESTING,
    EventCode.RELEASE,
    EventCode.HELD,
    EventCode.STICK,
    EventCode.SLIP,
    EventCode.REVERSAL,
)


@dataclass(frozen=True)
class EventSettings:
    """Which events are one, and when a section has to be moved."""

    together: float = 1e-9  # Events nearer to each other than this share of the orbit's duration have no order.
    grows: float = 1e-6  # Share by which an impact is faster than the one before if its train has not begun to die away.
    # The section is moved where it is nearer to an event than this share of the time between the events before and after it.
    section_room: float = 0.02
    farthest: float = 1.0  # The largest room that is told: it would be infinite for an orbit that never turns.


SETTINGS = EventSettings()


class OrbitEvent(NamedTuple):
    """An event: its kind as in `EventCode`, the contacts and frictions as bits, and the mode after it (`modes_of`)."""

    kind: int
    parts: int
    mode: int


@dataclass(frozen=True)
class FollowedEvents:
    """The events of an orbit from its section on, and how near they are to others."""

    events: tuple[OrbitEvent, ...]
    times: tuple[float, ...]
    period: float
    room: float  # the least of gaps, speeds, reactions and durations that are 0 where an event appears or is lost
    section_room: float  # where the section lies between its neighbouring events: 0 on one of them, 1/2 in the middle

    @property
    def order(self) -> tuple[OrbitEvent, ...]:
        """The events from the same one on wherever the section lies."""
        return min((self.events[i:] + self.events[:i] for i in range(len(self.events))), default=())

    @property
    def impact_count(self) -> int:
        """How many impacts there are, but for those that die away."""
        return sum(event.kind == EventCode.IMPACT for event in self.events)

    def until_next(self, kinds: tuple[int, int]) -> float:
        """The least time from an event of the first kind to the next event, of the same parts, if that is of the second kind."""
        n, least = len(self.events), math.inf
        for i, event in enumerate(self.events):
            later = next(j for j in range(i + 1, i + n + 1) if self.events[j % n].parts & event.parts)
            if (event.kind, self.events[later % n].kind) == kinds:
                least = min(least, self.times[later % n] - self.times[i] + (self.period if later >= n else 0.0))
        return least


def events_of(motion: Motion, sampled: SampledMotion, images: Sequence[int] | None = None) -> FollowedEvents:
    """The events of one period of an orbit, which begins at its section; with the number of the image of each contact and
    friction, of one that is its own mirror image after the motion.
    """
    period = motion.time - motion.start
    rows = _without_trains(_listed(motion))
    events, times = tuple(row[0] for row in rows), tuple(row[1] for row in rows)
    speeds = [row[2] for row in rows if row[0].kind == EventCode.IMPACT]
    section_room = _section_room(motion, period)
    if images is not None:
        events += tuple(_image(event, motion.system.model, images) for event in events)
        times, period = times + tuple(time + period for time in times), 2.0 * period
    apart = np.diff([*times, times[0] + period]) if len(times) > 1 else np.empty(0)
    apart = apart[apart > SETTINGS.together * period]
    room = float(min([SETTINGS.farthest, sampled.nearest_touch(), *speeds, *apart]))
    events, times = _in_order(events, times, SETTINGS.together * period)
    return FollowedEvents(events, times, period, max(room, 0.0), section_room)


def _image(event: OrbitEvent, model: Model, images: Sequence[int]) -> OrbitEvent:
    """The mirror image of an event."""
    closed, slides = modes_of(model, np.array(event.mode))
    count, mode = len(model.contacts), 1
    for i, image in enumerate(images):
        if i < count:
            mode += (int(closed) >> i & 1) << image
        else:
            mode += (1 - int(slides[i - count])) << (count + 2 * (image - count))
    return OrbitEvent(event.kind, sum(1 << image for i, image in enumerate(images) if event.parts >> i & 1), mode)


Row = tuple[OrbitEvent, float, float]  # an event, its time, and the least speed at which it closes a contact


def _listed(motion: Motion) -> list[Row]:
    """All events that change the mode."""
    found = motion.events
    chosen = np.isin(found.codes[:, 0], CHANGES)
    alone = np.array([np.count_nonzero(found.times == time) == 1 for time in found.times], dtype=bool)
    # rest is told apart from the event that brings it, and at the start of a motion
    chosen &= (alone & (found.times > motion.start)) | (found.codes[:, 0] != EventCode.RESTING)
    if not chosen.any():
        return []
    assert motion.dense is not None
    times, codes = found.times[chosen], found.codes[chosen]
    modes = motion.dense.states(times)[2]
    speeds = np.full(len(times), math.inf)
    speeds[codes[:, 0] == EventCode.IMPACT] = impact_speeds(motion)
    return [
        (OrbitEvent(int(kind), int(parts), int(mode)), float(time), float(speed))
        for (kind, parts), mode, time, speed in zip(codes, modes, times, speeds, strict=True)
    ]


def impact_speeds(motion: Motion) -> np.ndarray:
    """The least speed at which each impact closes one of its contacts, (n,)."""
    impacts, contacts = motion.impacts, motion.system.model.contacts
    names, speeds = motion.system.model.coordinates, []
    for hit, before in zip(impacts.side, impacts.velocity_before, strict=True):
        rates = [abs(before[names.index(c.coordinate)]) for i, c in enumerate(contacts) if int(hit) >> i & 1]
        speeds.append(min(rates, default=0.0))
    return np.array(speeds)


def _without_trains(rows: list[Row]) -> list[Row]:
    """Events without the impacts of a contact that die away until it is held: there are infinitely many.

    They die away after the last one that is slower than the one after it.
    """
    kept: list[Row] = []
    for row in rows:
        train: list[Row] = []
        if row[0].kind in (EventCode.HELD, EventCode.RESTING):
            while kept and kept[-1][0].kind == EventCode.IMPACT and not kept[-1][0].parts & ~row[0].parts:
                train.insert(0, kept.pop())
        speeds = np.array([impact[2] for impact in train])
        growing = np.flatnonzero(speeds[1:] > (1.0 + SETTINGS.grows) * speeds[:-1])
        kept += train[: growing[-1] + 1] if growing.size else []
        kept.append(row)
    return kept


def _in_order(
    events: tuple[OrbitEvent, ...], times: tuple[float, ...], together: float
) -> tuple[tuple[OrbitEvent, ...], tuple[float, ...]]:
    """Events of different parts at one instant, as of cells that move alike, in an order that rounding does not decide."""
    keys, first = [], -math.inf
    for event, time in zip(events, times, strict=True):
        first = time if time - first > together else first
        keys.append((first, event.parts))
    places = sorted(range(len(events)), key=keys.__getitem__)
    return tuple(events[i] for i in places), tuple(times[i] for i in places)


def _section_room(motion: Motion, period: float) -> float:
    times = motion.events.times[np.isin(motion.events.codes[:, 0], CHANGES)]
    if not times.size:
        return 0.5
    after, before = times[0] - motion.start, motion.start + period - times[-1]
    return float(min(after, before) / (after + before))
