"""What an orbit's equations give for a proof: segments with their events as expressions, or the
reason why there is no proof.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from saltus.bounds import Segment


@dataclass(frozen=True)
class OrbitSegments:
    """The segments of an orbit, with a guess of the unknowns of its events, (events, P).

    `event_names` and `state_names` name the kinds of unknowns: of each event, (events, P), and of
    the states at the nodes, (2 D); radii are told by these names.
    `free_time` says whether an event's time is its first unknown; `touching` is the number of the
    event that only touches the contact.
    """

    segments: tuple[Segment, ...]
    guess: np.ndarray
    event_names: tuple[tuple[str, ...], ...]
    state_names: tuple[str, ...]
    free_time: bool = True
    touching: int | None = None


def names_of_states(coordinates: Sequence[str]) -> tuple[str, ...]:
    """The names of the coordinates, then those of their velocities."""
    return (*coordinates, *(f"{name}'" for name in coordinates))


@dataclass(frozen=True)
class CannotProve:
    """Why there is no proof for a kind of orbit yet, in words."""

    reason: str
