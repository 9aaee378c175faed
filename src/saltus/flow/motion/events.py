"""The events of a motion, what they say of the contacts, and why motions end: the one place in
Python that knows all kinds.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from enum import StrEnum
from functools import cached_property
from typing import Any, Self, overload

import numpy as np

from saltus.result import RowTable
from saltus.systems import Model, System


class EventKind(StrEnum):
    """What happens at an instant of a motion, in the order of the kernel's numbers.

    Examples
    --------
    >>> [str(kind) for kind in saltus.EventKind][:2]
    ['impact', 'grazing']
    """

    IMPACT = "impact"  #: an impact: the gap closes with a speed
    GRAZING = "grazing"  #: the gap touches zero without a speed, to within the working precision
    REST = "rest"  #: the system comes to rest at contact, at once or as the limit of impacts
    RELEASE = "release"  #: the system leaves contact from rest
    # : impacts without loss became too small to follow; the phase is lost from here on
    CHATTER = "chatter"
    LIMIT = "limit"  #: a margin reached zero
    HELD = "held"  #: of several contacts, some come to rest as the limit of impacts
    STICK = "stick"  #: a friction changes from sliding to sticking
    SLIP = "slip"  #: a friction changes from sticking to sliding
    REVERSAL = "reversal"  #: a friction slides the other way without having stuck
    CROSSING = "crossing"  #: the motion passes a surface to its other side


EVENT_KINDS = tuple(EventKind)  # by the kernel's numbers


@dataclass(frozen=True, slots=True)
class Event:
    """One event: its time, and the velocities before and after it (equal where nothing jumps).

    Attributes
    ----------
    time
        The dimensionless time.
    kind
        What happened.
    side
        The side on which the motion was before it.
    velocity_before
        The velocity just before it.
    velocity_after
        The velocity just after it.

    Examples
    --------
    >>> event = saltus.simulate(system, theta=0.3, periods=1).events[0]
    >>> str(event.kind), event.time > 0
    ('impact', True)
    """

    time: float
    kind: EventKind
    side: int
    velocity_before: float
    velocity_after: float


@dataclass(frozen=True)
class Impacts(RowTable):
    """The impacts of a motion, as arrays of one length.

    Attributes
    ----------
    time
        The dimensionless times, (n,).
    side
        The sides before the impacts, (n,).
    velocity_before
        The velocities just before the impacts, (n,).
    velocity_after
        The velocities just after the impacts, (n,).

    Examples
    --------
    >>> impacts = saltus.simulate(system, theta=0.3, periods=2).impacts
    >>> bool(np.all(np.diff(impacts.time) > 0)), len(impacts) == len(impacts.velocity_before)
    (True, True)
    """

    time: np.ndarray
    side: np.ndarray
    velocity_before: np.ndarray
    velocity_after: np.ndarray

    def __len__(self) -> int:
        return self.time.size

    def _table(self) -> dict[str, Any]:
        columns: dict[str, Any] = {"time": self.time, "side": self.side}
        for name in ("velocity_before", "velocity_after"):
            values = getattr(self, name)
            columns |= (
                {name: values}
                if values.ndim == 1
                else {f"{name}_{i}": values[:, i] for i in range(values.shape[1])}
            )
        return columns


class MotionEvents(RowTable, Sequence[Event]):
    """The events of a motion in order of time, made one by one from the kernel's arrays."""

    def __init__(self, length: float, labels: np.ndarray, values: np.ndarray) -> None:
        self._length = length
        self._labels = labels
        self._values = values

    @cached_property
    def times(self) -> np.ndarray:
        """The dimensionless times, (n,): the kernel counts forcing periods of a `length` apart from
        the time within them.
        """
        times: np.ndarray = self._labels[:, 0] * self._length + self._values[:, 0]
        return times

    def __len__(self) -> int:
        return len(self._labels)

    @overload
    def __getitem__(self, index: int) -> Event: ...
    @overload
    def __getitem__(self, index: slice) -> Sequence[Event]: ...
    def __getitem__(self, index: Any) -> Any:
        return self._only(index) if isinstance(index, slice) else self._event(index)

    def _only(self, chosen: Any) -> Self:
        return type(self)(self._length, self._labels[chosen], self._values[chosen])

    def _event(self, index: int) -> Any:
        kind, side = self._labels[index, 1:3]
        before, after = self._values[index, 1:].tolist()
        return Event(float(self.times[index]), EVENT_KINDS[kind], int(side), before, after)

    def __repr__(self) -> str:
        counts = {
            kind.value: int(np.sum(self._labels[:, 1] == i)) for i, kind in enumerate(EVENT_KINDS)
        }
        return f"MotionEvents({', '.join(f'{n} {kind}' for kind, n in counts.items() if n)})"

    def _table(self) -> dict[str, Any]:
        names = (
            [field.name for field in fields(self[0])]
            if len(self)
            else [field.name for field in fields(Event)]
        )
        columns: dict[str, Any] = {}
        for name in names:
            values = [
                str(value) if isinstance(value, EventKind) else value
                for value in (getattr(each, name) for each in self)
            ]
            if values and isinstance(values[0], tuple):
                columns |= {
                    f"{name}_{i}": [value[i] for value in values] for i in range(len(values[0]))
                }
            else:
                columns[name] = values
        return columns

    def of(self, kind: EventKind) -> Self:
        """The events of one kind."""
        return self._of_kinds(kind)

    def _of_kinds(self, *kinds: EventKind) -> Self:
        return self._only(
            np.any([self._labels[:, 1] == EVENT_KINDS.index(kind) for kind in kinds], axis=0)
        )

    @property
    def codes(self) -> np.ndarray:
        """(n, 2): the number of each kind in the order of `EventKind`, and the side, or the
        contacts and frictions as bits.
        """
        return self._labels[:, 1:3]

    @property
    def details(self) -> np.ndarray:
        """The detail that the kernel recorded with each event, see `kernel/layout.py`; for a limit
        the number of the margin."""
        return self._labels[:, 3]

    def in_own_coordinates(self, system: System) -> MotionEvents:
        """The events with velocities of a system's own coordinates, from those of
        `system.in_gap_coordinates`.
        """
        return self

    def closed_together(self) -> list[float]:
        """The times of impacts at which contacts that act on one another close at one instant."""
        return []

    def impacts(self, *also: EventKind) -> Impacts:
        """The impacts, and the events of other kinds if wanted, as arrays."""
        impacts = self._of_kinds(EventKind.IMPACT, *also)
        labels = impacts._labels
        values = impacts._values
        return Impacts(impacts.times, labels[:, 2].astype(np.int8), values[:, 1], values[:, 2])


@dataclass(frozen=True, slots=True)
class ContactEvent:
    """One event: its time, its contacts or frictions, the velocities of all coordinates before and
    after it, and all impulses.
    """

    time: float
    kind: EventKind
    # the name of the contact or friction, or several with "+" between them; "both" for two of two
    # contacts
    contact: str
    velocity_before: tuple[float, ...]
    velocity_after: tuple[float, ...]
    impulse: tuple[float, ...]  # of each contact, along its sign


class ContactEvents(MotionEvents):
    """The events of a motion with several contacts or frictions, in order of time."""

    def __init__(
        self,
        length: float,
        labels: np.ndarray,
        values: np.ndarray,
        names: Sequence[Sequence[str]],
        places: np.ndarray,
    ) -> None:
        super().__init__(length, labels, values)
        self._contacts, self._frictions = names
        # positions, if velocities need them
        self._own = (values.shape[1] - 1 - len(self._contacts)) // 2
        self._places = places

    def _only(self, chosen: Any) -> ContactEvents:
        values = self._values[chosen]
        places = self._places[chosen] if self._places.size else self._places
        return ContactEvents(
            self._length, self._labels[chosen], values, (self._contacts, self._frictions), places
        )

    def _event(self, index: int) -> ContactEvent:
        kind, bits = (int(x) for x in self._labels[index, 1:3])
        before, after, impulse = (tuple(x.tolist()) for x in self._parts(index))
        return ContactEvent(
            float(self.times[index]), EVENT_KINDS[kind], self._called(bits), before, after, impulse
        )

    def _parts(self, index: Any) -> list[np.ndarray]:
        return np.split(self._values[index, 1:], [self._own, 2 * self._own], axis=-1)

    def in_own_coordinates(self, system: System) -> ContactEvents:
        """The events with velocities of a system's own coordinates, from those of
        `system.in_gap_coordinates`.
        """
        before, after, impulses = self._parts(slice(None))
        led = [
            system.from_gaps(
                self.times, self._places.T if self._places.size else velocity.T, velocity.T
            )[1].T
            for velocity in (before, after)
        ]
        values = np.concatenate([self._values[:, :1], *led, impulses], axis=1)
        return ContactEvents(
            self._length, self._labels, values, (self._contacts, self._frictions), self._places
        )

    def _called(self, bits: int) -> str:
        chosen = [
            name for i, name in enumerate((*self._contacts, *self._frictions)) if bits >> i & 1
        ]
        return "both" if chosen == list(self._contacts) and len(chosen) == 2 else "+".join(chosen)

    def closed_together(self) -> list[float]:
        """The times of impacts at which contacts that act on one another close at one instant."""
        bits = self._labels[:, 2]
        several = (self._labels[:, 1] == EVENT_KINDS.index(EventKind.IMPACT)) & (
            bits & (bits - 1) != 0
        )
        return [float(time) for time in self.times[several]]

    def impacts(self, *also: EventKind) -> Impacts:
        """The impacts, as arrays; `side` has the bits of the contacts that were hit, velocities are
        (n, coordinates).
        """
        impacts = self._of_kinds(EventKind.IMPACT, *also)
        before, after, _ = impacts._parts(slice(None))
        return Impacts(
            impacts.times,
            impacts._labels[:, 2].astype(type_of_bits(len(self._contacts))),
            before,
            after,
        )


def type_of_bits(count: int) -> type[np.signedinteger[Any]]:
    """The type of numbers with a bit for each of so many contacts."""
    return np.int16 if count < 16 else np.int64


def masks_of(names: Sequence[str]) -> dict[str, Any]:
    """The attributes of the CF conventions that say what the bits of a number stand for."""
    masks = np.left_shift(np.int64(1), np.arange(len(names))).astype(type_of_bits(len(names)))
    return {"flag_masks": masks, "flag_meanings": " ".join(names)}


def modes_of(
    model: Model, side: np.ndarray
) -> tuple[np.ndarray, list[np.ndarray], list[np.ndarray]]:
    """Closed contacts as bits, the direction in which each friction slides, and the side of each
    surface, +1 or -1, from the numbers `side` of motions. A friction slides to +1 or -1; 0 where it
    sticks, 2 where its contact is open or its coefficients are 0."""
    count = len(model.contacts)
    number = np.asarray(side).astype(np.int64) - 1
    pairs = [
        (number >> (count + 2 * k) & 3) - 1
        for k in range(len(model.frictions) + len(model.surfaces))
    ]
    beside = [
        each.sign * pair
        for each, pair in zip(model.surfaces, pairs[len(model.frictions) :], strict=True)
    ]
    return (
        number & np.int64((1 << count) - 1 if count < 64 else -1),
        pairs[: len(model.frictions)],
        beside,
    )


class Stop(StrEnum):
    """Why a motion ended: a word, and its `meaning` in a sentence.

    Examples
    --------
    >>> str(saltus.simulate(system, theta=0.3, periods=2).stop)
    'horizon'
    """

    meaning: str

    def __new__(cls, word: str, meaning: str) -> Stop:
        member = str.__new__(cls, word)
        member._value_ = word
        member.meaning = meaning
        return member

    HORIZON = "horizon", "the time asked for"
    REST = "rest", "the time asked for, at rest"
    LIMIT = "limit", "a margin of the model reached zero"
    CAPTURED = "captured", "proved to be captured at rest for all later loads"
    SETTLED = "settled", "repeats itself every `recurrence_period` forcing periods"
    NOT_UNIQUE = "not_unique", "the motion from rest at contact is not unique"
    NO_IMPACT = "no_impact", "the impact law has no velocity after the impact"
    NOT_FINITE = "not_finite", "the motion leaves the range of numbers"
    STALLED = "stalled", "the acceleration is singular"
    SINGULAR = "singular", "the mass matrix has no inverse"
    OUTSIDE = "outside", "the state at the start lies beyond the contact"
    PASSED = "passed", "an event was lost in the rounding of positions that are far from 0"
    UNRESOLVED = (
        "unresolved",
        "impacts accumulate too slowly to be followed: more than a million in a unit of time",
    )
