"""What equations read from a motion: the signature of its events, and a section at which its state is given."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from saltus.errors import MotionError
from saltus.flow import EventKind, Motion, modes_of
from saltus.orbits.signature import ModeChange, Signature
from saltus.systems import Model

STAYS = "the motion comes to rest with all coordinates held at contacts for good, which is no orbit to follow"


@dataclass(frozen=True)
class ReadingSettings:
    """How a signature is read from the events of a motion."""

    together: float = 1e-9  # Events nearer to each other than this share of a forcing period happen at one instant.


SETTINGS = ReadingSettings()


def section_of(
    motion: Motion, frequency: float, phase: float | None = None, duration: float | None = None
) -> tuple[float, np.ndarray]:
    """The phase and the state of a motion at a section: the middle of its longest smooth stretch within the first `duration` in
    which not all coordinates are held; or the state at a phase that is given.

    The longer that stretch, the longer a branch can be followed before an event comes to the section.
    """
    assert motion.dense is not None
    end = motion.time if duration is None else motion.start + duration
    if phase is None:
        bounds = np.unique([motion.start, *(event.time for event in motion.events if motion.start < event.time < end), end])
        spans, middles = np.diff(bounds), 0.5 * (bounds[1:] + bounds[:-1])
        moves = _moves(motion.system.model, motion.dense.states(middles)[2])
        time = float(middles[max(range(len(spans)), key=lambda i: (moves[i], spans[i]))])
    else:
        time = motion.start + (phase / frequency - motion.start) % (2.0 * np.pi / frequency)
    state = np.concatenate([np.atleast_1d(x) for x in motion.at(time)])
    return time * frequency % (2.0 * np.pi), state


def _moves(model: Model, sides: np.ndarray) -> np.ndarray:
    """Whether a motion with these numbers `side` is not held altogether, (n,)."""
    if not model.holds_coordinates:
        return np.asarray(sides != 0)
    closed, slides = modes_of(model, sides)
    held = sum((closed >> i & 1 for i in range(len(model.contacts))), sum(s == 0 for s in slides))
    return np.asarray(held < len(model.coordinates))


def read_signature(motion: Motion, periods: int, frequency: float) -> tuple[Signature, np.ndarray, np.ndarray]:
    """The signature of a motion that was followed for twice `periods`, the state after its first event, and the events' phases.

    The events are those of a span of `periods` forcing periods that begins in the middle between two events.
    """
    period = motion.system.load.period
    assert period is not None
    changes = _mode_changes(motion, SETTINGS.together * period)
    times = np.array([time for time, _ in changes])
    start, length = motion.start, periods * period
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
    """The events at which contacts open or close, each with its time and the contacts that are closed after it.

    Contacts of different groups, such as the cells of a chain that move alike, may act at one instant. These count as events one
    after the other, in any order, as their impulses do not act on one another.

    Raises
    ------
    MotionError
        There are events for which orbits have no equations.
    """
    changes: list[tuple[float, ModeChange]] = []
    for time, acting in _instants(motion, together):
        closed = int(motion.closed_at(time))
        for contact, is_impact in acting.items():  # before the first of these events all their contacts are as they were
            closed = closed & ~(1 << contact) if is_impact else closed | 1 << contact
        after = int(motion.closed_at(time))
        for contact, is_impact in acting.items():
            closed = closed & ~(1 << contact) | after & 1 << contact
            changes.append((time, ModeChange(is_impact, contact, closed)))
    return changes


def _instants(motion: Motion, together: float) -> list[tuple[float, dict[int, bool]]]:
    """The instants at which contacts act: for each of them the contacts, and whether it is an impact (else a release)."""
    contacts = motion.system.model.contacts
    names, instants = [contact.name for contact in contacts], list[tuple[float, dict[int, bool]]]()
    events: Sequence[Any] = motion.events
    for event in events:
        if event.kind not in (EventKind.IMPACT, EventKind.RELEASE):
            continue
        if not instants or event.time - instants[-1][0] >= together:
            instants.append((event.time, {}))
        time, acting = instants[-1]
        instants[-1] = event.time, acting
        for contact in range(len(names)) if event.contact == "both" else map(names.index, event.contact.split("+")):
            is_impact = event.kind is EventKind.IMPACT
            groups = {contacts[other].group for other in acting if other != contact}
            if contacts[contact].group in groups or (contact in acting and is_impact):
                raise MotionError(f"two events at one instant, {time:.6g}: an orbit has no equations for that")
            acting.setdefault(contact, is_impact)
    return instants
