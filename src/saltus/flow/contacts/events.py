"""The events of a motion with several contacts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from saltus.flow.motion.motion import EVENT_KINDS, EventKind, Impacts, MotionEvents


@dataclass(frozen=True, slots=True)
class ContactEvent:
    """One event: its time, its contacts or frictions, the velocities of all coordinates before and after it, and all impulses."""

    time: float
    kind: EventKind
    contact: str  # the name of the contact or friction, or several with "+" between them; "both" for two of two contacts
    velocity_before: tuple[float, ...]
    velocity_after: tuple[float, ...]
    impulse: tuple[float, ...]  # of each contact, along its sign


class ContactEvents(MotionEvents):
    """The events of a motion with several contacts or frictions, in order of time."""

    def __init__(
        self, times: np.ndarray, labels: np.ndarray, values: np.ndarray, contacts: Sequence[str], frictions: Sequence[str]
    ) -> None:
        super().__init__(times, labels, values)
        self._contacts, self._frictions, self._own = contacts, frictions, (values.shape[1] - 1 - len(contacts)) // 2

    def _only(self, chosen: Any) -> ContactEvents:
        return ContactEvents(self.times[chosen], self._labels[chosen], self._values[chosen], self._contacts, self._frictions)

    def _event(self, index: int) -> ContactEvent:
        kind, bits = (int(x) for x in self._labels[index, 1:3])
        before, after, impulse = (tuple(x.tolist()) for x in self._parts(index))
        return ContactEvent(float(self.times[index]), EVENT_KINDS[kind], self._called(bits), before, after, impulse)

    def _parts(self, index: Any) -> list[np.ndarray]:
        return np.split(self._values[index, 1:], [self._own, 2 * self._own], axis=-1)

    def _called(self, bits: int) -> str:
        chosen = [name for i, name in enumerate((*self._contacts, *self._frictions)) if bits >> i & 1]
        return "both" if chosen == list(self._contacts) and len(chosen) == 2 else "+".join(chosen)

    def impacts(self) -> Impacts:
        """The impacts, as arrays; `side` has the bits of the contacts that were hit, velocities are (n, coordinates)."""
        impacts = self.of(EventKind.IMPACT)
        before, after, _ = impacts._parts(slice(None))
        return Impacts(impacts.times, impacts._labels[:, 2].astype(np.int16), before, after)
