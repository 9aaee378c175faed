"""What there is in a cell of a chart."""

from __future__ import annotations

from enum import IntEnum
from typing import Any

import numpy as np

from saltus.attractors import Unsettled


class CellOutcome(IntEnum):
    """What there is in a cell."""

    REST = 0
    ONE_MOTION = 1
    SEVERAL_MOTIONS = 2
    CHAOS = 3
    MOTIONS_AND_CHAOS = 4
    LONG = 5
    UNDECIDED = 6

    def __str__(self) -> str:
        return SENTENCES[self]


SENTENCES = {
    CellOutcome.REST: "every motion comes to rest",
    CellOutcome.ONE_MOTION: "one stable motion",
    CellOutcome.SEVERAL_MOTIONS: "several stable motions",
    CellOutcome.CHAOS: "chaos, and no stable motion",
    CellOutcome.MOTIONS_AND_CHAOS: "chaos beside stable motions",
    CellOutcome.LONG: "a motion of a longer period than is looked for, or a slow one",
    CellOutcome.UNDECIDED: "motions of which it is not decided what they are",
}


def flags(kind: type[IntEnum]) -> dict[str, Any]:
    """The attributes that say what the numbers of a variable mean, after the CF conventions."""
    return {"flag_values": [int(member) for member in kind], "flag_meanings": " ".join(member.name.lower() for member in kind)}


def outcomes(count: np.ndarray, unsettled: np.ndarray, verdict: np.ndarray) -> np.ndarray:
    """What there is in cells with so many stable motions, so many starts that have not settled, and this verdict on these."""
    outcome = np.where(count > 1, CellOutcome.SEVERAL_MOTIONS, np.where(count == 1, CellOutcome.ONE_MOTION, CellOutcome.REST))
    open_ = unsettled > 0
    chaotic = open_ & (verdict == Unsettled.CHAOTIC)
    outcome[chaotic] = np.where(count[chaotic] > 0, CellOutcome.MOTIONS_AND_CHAOS, CellOutcome.CHAOS)
    left = open_ & ~chaotic & (count == 0)
    outcome[left] = np.where(verdict[left] == Unsettled.PERIODIC, CellOutcome.LONG, CellOutcome.UNDECIDED)
    return np.asarray(outcome)
