"""What an orbit's equations give for a proof: segments with their events as expressions, or the
reason why there is no proof.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from saltus.bounds import Segment


@dataclass(frozen=True)
class OrbitSegments:
    """The segments of an orbit, with a guess of the unknowns of its events, (events, P).

    `free_time` says whether an event's time is its first unknown; `touching` is the number of the
    event that only touches the contact.
    """

    segments: tuple[Segment, ...]
    guess: np.ndarray
    free_time: bool = True
    touching: int | None = None


@dataclass(frozen=True)
class CannotProve:
    """Why there is no proof for a kind of orbit yet, in words."""

    reason: str
