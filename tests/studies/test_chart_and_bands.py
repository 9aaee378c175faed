"""A chart and a diagram through the same points agree on where there is chaos: one judgement, each
by motions of its own.
"""

from dataclasses import replace

import numpy as np
import pytest
from shared_systems import forced

from saltus import classify, stability_chart
from saltus.attractors import Judged, SettledLater
from saltus.flow import Ending
from saltus.studies.chart import cells
from saltus.studies.chart.chart_request import ChartRequest
from saltus.studies.chart.motions import CellOutcome, motion_type, outcomes
from saltus.studies.diagram.chaos_search import BandSearch
from saltus.studies.diagram.diagram_work import DiagramWork
from saltus.studies.diagram.effort import CHAOS
from saltus.studies.diagram.simulated import simulate_from

AMPLITUDE = "load.horizontal.amplitude"


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("frequency", "low", "high"),
    [(0.5, 0.08, 0.18), pytest.param(0.75, 0.08, 0.12, marks=pytest.mark.thorough)],
)
def test_a_row_of_fig_14_and_the_diagram_along_it_have_chaos_at_the_same_values(
    frequency, low, high
):
    """V = -0.5.

    Where they differ the value lies beside an edge, or the judgement of one of them is open.
    """
    system, values = forced(0.1, frequency), np.linspace(low, high, 21)
    chart = stability_chart(
        system,
        horizontal=values,
        vertical=[-0.5, -0.499],
        window=((-2.0, 2.0), (-2.0, 2.0)),
        starts=8,
    )
    row = chart.isel(vertical=0)
    open_ = row["unsettled"].values > 0
    in_chart = open_ & (row["verdict"].values == Ending.CHAOTIC)
    states = np.random.default_rng(4).uniform(-1.5, 1.5, (len(values) * 24, 2))
    begun = simulate_from(system, AMPLITUDE, np.repeat(values, 24), states, 300)
    settings = replace(CHAOS, step=0.02, fine_step=0.02, edge=2e-3)
    search = BandSearch(DiagramWork(system, AMPLITUDE), (low, high), settings)
    search.look(begun)
    bands = search.bands
    in_diagram = np.array([any(value in band for band in bands.bands) for value in values])
    at = np.searchsorted(bands.tried.values, values)
    long_transient = (bands.tried.verdict[at] == Ending.TRANSIENT) & (
        bands.tried.mean_life[at] > 1000.0
    )  # a chart looks less long
    left_open = (
        (open_ & (row["verdict"].values == Ending.UNDECIDED))
        | bands.tried.undecided[at]
        | long_transient
    )
    assert in_diagram.any()
    assert not in_diagram.all()
    assert not (in_chart & ~in_diagram & ~left_open).any()
    # a chart has few starts in a cell, and no motions of its neighbours' chaos
    missed = in_diagram & ~in_chart & ~left_open
    assert missed.sum() <= max(1, 0.1 * in_diagram.sum())


def test_a_chart_of_few_periods_does_not_take_long_transients_for_chaos():
    """At Omega = 4 and Hhat from 7.2 to 8 there are transients (numerics.md); at 60 forcing periods
    a cell judges them for mean lives up to 480 only, and their chaos was drawn until it was
    confirmed."""
    heights = np.array([6.9, 7.2, 7.5, 7.7, 8.0, 8.5])
    chart = stability_chart(
        forced(1.0, 4.0), horizontal=heights, vertical=[-0.5], periods=60, seed=1
    )
    assert (chart["verdict"].values != Ending.CHAOTIC).all()
    assert (chart["verdict"].values == Ending.TRANSIENT).sum() >= 4
    assert (chart["count"].values > 0).all()  # what companions settled on is a motion of the cell
    settled = classify(forced(7.2, 4.0), theta=1.0, velocity=0.3)
    assert settled.kind is Ending.PERIODIC


def test_a_motion_that_comes_to_no_known_orbit_is_as_undecided_in_a_chart_as_by_classify(
    monkeypatch,
):
    """The exponent is below 0, and no period was found: `classify` says undecided, a chart said a
    long period.
    """

    def judged(system, states, parameters, **options):
        n = len(states)
        number, none = np.full(n, -0.01), np.zeros(n, dtype=int)
        # of every other cell the period is known, and longer than was looked for
        of_period = np.where(np.arange(n) % 2, 90, 0)
        settled = SettledLater(
            np.flatnonzero(of_period), np.zeros((n // 2, 2)), of_period[of_period > 0]
        )
        return Judged(
            np.full(n, Ending.PERIODIC),
            none,
            number,
            number,
            number,
            number,
            none,
            number,
            of_period,
            states,
            settled,
        )

    monkeypatch.setattr(cells, "judge", judged)
    request = ChartRequest(
        system=forced(0.1), horizontal=[0.1, 0.2, 0.3, 0.4], vertical=[-0.5], paths=(AMPLITUDE, "load.vertical"), max_period=6,
        starts=4, window=None, least=1e-3, periods=100, tol=1e-10, seed=0,
    )  # fmt: skip
    motions = np.zeros(4, motion_type(2))
    motions["cell"] = np.arange(4)
    found = cells.CellVerdicts(request, motions)
    assert found.verdict.tolist() == [Ending.UNDECIDED, Ending.PERIODIC] * 2
    shown = outcomes(np.zeros(4, dtype=int), np.ones(4, dtype=int), found.verdict)
    assert shown.tolist() == [CellOutcome.UNDECIDED, CellOutcome.LONG] * 2
