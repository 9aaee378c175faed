"""What an orbit's equations give for a proof: segments with their events as expressions, or the
reason why there is no proof.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from saltus.bounds import Ball, Segment, Shooting
from saltus.taylor import Expr


@dataclass(frozen=True)
class OrbitSegments:
    """The segments of an orbit, with a guess of the unknowns of its events, (events, P).

    `event_names` and `state_names` name the kinds of unknowns: of each event, (events, P), and of
    the states at the nodes, (2 D); radii are told by these names.
    `free_time` says whether an event's time is its first unknown; `touching` is the number of the
    event that only touches the contact.
    `releases` are the numbers of the events at which the contact opens after a rest, and `rests` say
    what is to be proved of each rest.
    """

    segments: tuple[Segment, ...]
    guess: np.ndarray
    event_names: tuple[tuple[str, ...], ...]
    state_names: tuple[str, ...]
    free_time: bool = True
    touching: int | None = None
    releases: tuple[int, ...] = ()
    rests: tuple[Rest, ...] = ()


@dataclass(frozen=True)
class Rest:
    """A rest at a contact, after infinitely many impacts of which some are events.

    `last` and `release` are the numbers of the last of these events and of the release after it.
    The expressions are the acceleration of the gap, that at the closed contact and its rate, and
    the speed after an impact with its slope to the speed before. The last two are the contact's
    position, and the slope of the gap to the coordinate.
    """

    last: int
    release: int
    pull: Expr
    held_pull: Expr
    held_rate: Expr
    speed_after: Expr
    restitution: Expr
    position: Expr
    rate: Expr


def names_of_states(coordinates: Sequence[str]) -> tuple[str, ...]:
    """The names of the coordinates, then those of their velocities."""
    return (*coordinates, *(f"{name}'" for name in coordinates))


@dataclass(frozen=True)
class CannotProve:
    """Why there is no proof for a kind of orbit yet, in words."""

    reason: str


def events_of(shooting: Shooting, box: Ball, made: OrbitSegments) -> Ball:
    """Balls of the unknowns of the impacts, without those of releases, (impacts, P)."""
    events = box[: shooting.event_unknowns].reshape(-1, shooting.event_size)
    return events[np.setdiff1d(np.arange(shooting.event_count), made.releases)]


def least_speed(shooting: Shooting, box: Ball, made: OrbitSegments) -> float:
    """A lower bound of the speeds of all impacts that are events; inf without impacts."""
    return float(events_of(shooting, box, made)[:, 1].low.min()) if made.free_time else np.inf
