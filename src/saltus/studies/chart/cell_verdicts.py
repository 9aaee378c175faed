"""The judgement of the motions of a chart's cells that have not settled: chaos, a transient, a long period, or undecided."""

from __future__ import annotations

import numpy as np

from saltus.attractors import JudgementSettings, Unsettled, judge_unsettled
from saltus.studies.chart.request import ChartRequest

ASKED = 3  # motions of a cell that have not settled, from which the judgement starts at most
COMPANIONS = 6  # motions that are followed for each cell that is judged


class CellVerdicts:
    """The judgement of the motions that have not settled, an entry for each of `cell`; of `later`, cells (k,) and states (k, d),
    on which such motions have settled after all."""

    def __init__(self, request: ChartRequest, motions: np.ndarray) -> None:
        motions = motions[np.argsort(motions["cell"], kind="stable")]
        self.cell, first = np.unique(motions["cell"], return_index=True)
        last = np.append(first[1:], len(motions))
        states = np.full((len(self.cell), ASKED, request.system.dimension), np.nan)
        for i in range(ASKED):
            there = first + i < last
            states[there, i] = motions["state"][(first + i)[there]]
        parameters = {path: values[self.cell] for path, values in request.parameters.items()}
        found = judge_unsettled(request.system, states, parameters, settings=judgement(request.periods, request.tol))
        self.verdict, self.exponent, self.error = found.verdict.copy(), found.exponent, found.error
        longer = np.unique(found.settled.question[found.settled.period > request.max_period])
        self.verdict[longer[self.verdict[longer] == Unsettled.TRANSIENT]] = Unsettled.PERIODIC  # on no known one
        self.later = self.cell[found.settled.question], found.settled.state

        known = (found.period > 0) & (found.period <= request.max_period)
        # These are among the motions of the cell after all, or come to rest.
        self.settles = (self.verdict == Unsettled.TRANSIENT) | ((self.verdict == Unsettled.PERIODIC) & known)


def judgement(periods: int, tol: float) -> JudgementSettings:
    """How long motions of a chart are followed that have not settled within so many forcing periods.

    Of the thousands of cells of a chart each gets a few companions, and transients are excluded of a mean life up to eight times
    the periods.
    """
    return JudgementSettings(
        companions=COMPANIONS,
        first_periods=periods,
        round_periods=3 * periods,
        rounds=3,
        exposure=4 * COMPANIONS * periods,
        measured=COMPANIONS,
        shortest_run=max(16, periods // 2),
        longest_run=3 * periods,
        regular_run=periods,
        longest_period=64,
        patience=10 * periods,
        tol=tol,
    )
