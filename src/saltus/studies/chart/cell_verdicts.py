"""The judgement of the motions in a chart's cells that have not settled: chaos, a transient, a long period, or undecided."""

from __future__ import annotations

import numpy as np

from saltus.attractors import JudgementSettings, judge
from saltus.flow import Ending
from saltus.studies.chart.request import ChartRequest

ASKED = 3  # motions of a cell that have not settled, from which the judgement starts at most
COMPANIONS = 6  # motions that are followed for each cell that is judged


class CellVerdicts:
    """The judgement of the motions that have not settled, an entry for each cell in `cell`.

    `later` holds the cells (k,) and states (k, d) of motions on which companions have settled after all.
    """

    def __init__(self, request: ChartRequest, motions: np.ndarray) -> None:
        motions = motions[np.argsort(motions["cell"], kind="stable")]
        self.cell, first = np.unique(motions["cell"], return_index=True)
        last = np.append(first[1:], len(motions))
        states = np.full((len(self.cell), ASKED, request.system.dimension), np.nan)
        for i in range(ASKED):
            there = first + i < last
            states[there, i] = motions["state"][(first + i)[there]]
        parameters = {path: values[self.cell] for path, values in request.parameters.items()}
        found = judge(request.system, states, parameters, settings=judgement(request.periods, request.tol))
        self.verdict, self.exponent, self.error = found.ending.copy(), found.exponent, found.error
        longer = np.unique(found.settled.question[found.settled.period > request.max_period])
        # A transient to an orbit of a longer period than the chart looks for leads to none of its motions.
        self.verdict[longer[self.verdict[longer] == Ending.TRANSIENT]] = Ending.PERIODIC
        self.later = self.cell[found.settled.question], found.settled.state

        known = (found.period > 0) & (found.period <= request.max_period)
        # Such starts end on motions that the cell has through `later`, or come to rest.
        self.settles = (self.verdict == Ending.TRANSIENT) | ((self.verdict == Ending.PERIODIC) & known)


def judgement(periods: int, tol: float) -> JudgementSettings:
    """The settings by which motions of a chart are judged that have not settled within so many forcing periods.

    As a chart has thousands of cells, each gets a few companions only, and transients are excluded with mean lives up to eight
    times the periods.
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
