"""What the motions in a cell of a chart end on."""

from __future__ import annotations

import numpy as np

from saltus.enumerations import NumberedSentence
from saltus.flow import Ending


class CellOutcome(NumberedSentence):
    """What there is in a cell."""

    REST = 0, "every motion comes to rest"
    ONE_MOTION = 1, "one stable motion"
    SEVERAL_MOTIONS = 2, "several stable motions"
    CHAOS = 3, "chaos, and no stable motion"
    MOTIONS_AND_CHAOS = 4, "chaos beside stable motions"
    LONG = 5, "a motion of a longer period than is looked for, or a slow one"
    UNDECIDED = 6, "motions of which it is not decided what they are"
    QUASI_PERIODIC = 7, "a quasi-periodic motion"


def outcomes(count: np.ndarray, unsettled: np.ndarray, verdict: np.ndarray) -> np.ndarray:
    """The `CellOutcome` of cells, from their numbers of stable motions and of unsettled starts, and the verdict on the latter."""
    outcome = np.where(count > 1, CellOutcome.SEVERAL_MOTIONS, np.where(count == 1, CellOutcome.ONE_MOTION, CellOutcome.REST))
    open_ = unsettled > 0
    chaotic = open_ & (verdict == Ending.CHAOTIC)
    outcome[chaotic] = np.where(count[chaotic] > 0, CellOutcome.MOTIONS_AND_CHAOS, CellOutcome.CHAOS)
    left = open_ & ~chaotic & (count == 0)
    shown = {Ending.PERIODIC: CellOutcome.LONG, Ending.QUASI_PERIODIC: CellOutcome.QUASI_PERIODIC}
    outcome[left] = [shown.get(Ending(one), CellOutcome.UNDECIDED) for one in verdict[left]]
    return np.asarray(outcome)
