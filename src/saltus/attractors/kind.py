"""The kinds of motion on which motions end."""

from __future__ import annotations

from enum import StrEnum


class AttractorKind(StrEnum):
    """What an attractor is, or what one motion ends on."""

    REST = "rest"
    PERIODIC = "periodic"
    QUASI_PERIODIC = "quasi-periodic"
    CHAOTIC = "chaotic"
    UNDECIDED = "undecided"  # for motions only: the numbers bear out none of the others
