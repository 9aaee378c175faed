"""What the motions in a cell of a chart end on."""

from __future__ import annotations

from typing import Any

import numpy as np

from saltus.attractors import Unsettled
from saltus.enumerations import NumberedSentence


class CellOutcome(NumberedSentence):
    """What there is in a cell."""

    REST = 0, "every motion comes to rest"
    ONE_MOTION = 1, "one stable motion"
    SEVERAL_MOTIONS = 2, "several stable motions"
    CHAOS = 3, "chaos, and no stable motion"
    MOTIONS_AND_CHAOS = 4, "chaos beside stable motions"
    LONG = 5, "a motion of a longer period than is looked for, or a slow one"
    UNDECIDED = 6, "motions of which it is not decided what they are"


def flags(kind: type[NumberedSentence]) -> dict[str, Any]:
    """The attributes that say what the numbers of a variable mean, after the CF conventions."""
    return {"flag_values": [int(member) for member in kind], "flag_meanings": " ".join(member.name.lower() for member in kind)}


def outcomes(count: np.ndarray, unsettled: np.ndarray, verdict: np.ndarray) -> np.ndarray:
    """The `CellOutcome` of cells, from their numbers of stable motions and of unsettled starts, and the verdict on the latter."""
    outcome = np.where(count > 1, CellOutcome.SEVERAL_MOTIONS, np.where(count == 1, CellOutcome.ONE_MOTION, CellOutcome.REST))
    open_ = unsettled > 0
    chaotic = open_ & (verdict == Unsettled.CHAOTIC)
    outcome[chaotic] = np.where(count[chaotic] > 0, CellOutcome.MOTIONS_AND_CHAOS, CellOutcome.CHAOS)
    left = open_ & ~chaotic & (count == 0)
    outcome[left] = np.where(verdict[left] == Unsettled.PERIODIC, CellOutcome.LONG, CellOutcome.UNDECIDED)
    return np.asarray(outcome)
