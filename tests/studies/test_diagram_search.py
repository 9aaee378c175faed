"""What a diagram finds: all that simulation shows lies on its branches, and what it leaves out is
in its estimate.
"""

from itertools import pairwise

import numpy as np
import pytest
from shared_systems import forced, under
from study_cases import FREQUENCY

from saltus import response_spectrum, search_orbits
from saltus.branch_tables import branches_of
from saltus.flow import find_recurrence
from saltus.orbits import continue_orbit, orbits_of
from saltus.orbits.orbit import solve
from saltus.studies.diagram.diagram_search import MissedShare
from saltus.studies.diagram.simulated import starts_at
from saltus.systems import Harmonic, check_window

WINDOW = ((-4.0, 4.0), (-4.0, 4.0))
SYSTEM = forced(1.0)


def test_starts_at_a_value_depend_on_it_alone_and_more_of_them_begin_with_the_fewer():
    values, area = np.linspace(0.1, 3.0, 7), check_window(WINDOW, SYSTEM)
    few, many = (starts_at(SYSTEM, values, count, area, 5) for count in (6, 20))
    assert np.array_equal(few, many[:, :6])
    assert np.array_equal(few[[2, 5]], starts_at(SYSTEM, values[[2, 5]], 6, area, 5))
    assert np.abs(many).max() <= 4.0
    assert len(np.unique(many[:, 0], axis=0)) == len(values)  # other states at each value
    assert not np.array_equal(few, starts_at(SYSTEM, values, 6, area, 6))


@pytest.mark.parametrize(
    ("missed", "sample", "low", "high"),
    # tables of Wilson's interval
    [(0, 1000, 0.0, 0.0038), (10, 100, 0.0552, 0.1744), (1, 10, 0.0179, 0.4042)],
)
def test_the_interval_of_the_missed_share_is_wilsons(missed, sample, low, high):
    found = MissedShare(missed, sample)
    assert found.interval == pytest.approx((low, high), abs=1e-4)
    assert found.interval[0] <= found.share <= found.interval[1]


def independent_attractors(bounds, values, starts, seed, system=SYSTEM):
    """What random states lead to, by another seed and tolerance: value, period, highest, lowest,
    share of the starts.
    """
    rng = np.random.default_rng(seed)
    grid = rng.uniform(*bounds, values)
    column = np.repeat(grid, starts)
    ends = find_recurrence(
        system,
        rng.uniform(-4, 4, (len(column), 2)),
        800,
        parameters={FREQUENCY: column},
        kept=0,
        extrema=True,
        tol=1e-13,
    )
    rows = []
    for value in grid:
        here = [
            i
            for i in np.flatnonzero(column == value)
            if ends.period[i] and max(ends.highest[i], -ends.lowest[i]) > 1e-6
        ]
        keys = [
            (ends.period[i], *np.round(sorted([ends.highest[i], -ends.lowest[i]]), 5)) for i in here
        ]
        for key in set(keys):
            i = here[keys.index(key)]
            rows.append(
                (value, ends.period[i], ends.highest[i], ends.lowest[i], keys.count(key) / starts)
            )
    return rows


def lies_on_a_stable_branch(tree, row):
    """Whether a stable orbit of the dataset alone, solved at the value, has the extrema of a motion
    or of its mirror image.
    """
    value, period, highest, lowest, _ = row
    for _, branch in branches_of(tree):
        if int(branch["period"][0]) != period:
            continue
        orbits = orbits_of(branch)
        for a, b in pairwise(orbits):
            start, end = a.solution.values[0], b.solution.values[0]
            if (
                a.signature != b.signature
                or start == end
                or not min(start, end) <= value <= max(start, end)
            ):
                continue
            guess = a.solution.unknowns + (value - start) / (end - start) * (
                b.solution.unknowns - a.solution.unknowns
            )
            solution = solve(a.equations, guess, np.array([value]))
            orbit = None if solution is None else type(a)(a.equations, solution)
            if orbit is not None and orbit.stable:
                apart = max(abs(orbit.highest - highest), abs(orbit.lowest - lowest))
                mirrored = max(abs(orbit.highest + lowest), abs(orbit.lowest + highest))
                if min(apart, mirrored) < 1e-5:
                    return True
    return False


@pytest.fixture(scope="module")
def diagram():
    return response_spectrum(
        SYSTEM, FREQUENCY, (2.0, 2.8), window=WINDOW, effort="quick", repelling=0, bands=False
    )


def test_what_an_independent_simulation_finds_lies_on_the_stable_branches(diagram):
    """At H = 1 there are motions of periods 1 and 3, on the main branch and on detached loops."""
    rows = [
        row
        for row in independent_attractors((2.0, 2.8), 12, 60, seed=11)
        if row[1] <= 6 and row[4] >= 0.01
    ]
    assert {row[1] for row in rows} >= {1, 3}
    assert len(rows) > 20
    assert [row for row in rows if not lies_on_a_stable_branch(diagram, row)] == []


def test_all_that_was_simulated_lies_on_a_branch_or_is_listed_with_its_reason(diagram):
    assert diagram["attractors"]["placed"].values.all()
    assert set(diagram["unplaced"]["reason"].values.tolist()) <= {"rare"}
    assert (diagram["unplaced"]["period"].values > 6).all()
    assert diagram.attrs["values"] == len(diagram["search"]["searched"]) == 61


def test_what_a_diagram_leaves_out_is_in_its_estimate(diagram):
    """With max_period=1 the loops of period 3 are missing: the share of the states that they take
    must be in the estimate.
    """
    small = response_spectrum(
        SYSTEM,
        FREQUENCY,
        (2.0, 2.8),
        window=WINDOW,
        effort="quick",
        max_period=1,
        values=[2.2, 2.4],
        repelling=0,
        bands=False,
    )
    rows = independent_attractors((2.0, 2.8), 12, 60, seed=12)
    share = sum(row[4] for row in rows if row[1] > 1) / 12
    assert share > 0.05
    assert small.attrs["missed_low"] - 0.1 < share < small.attrs["missed_high"] + 0.1
    assert small.attrs["missed_low"] > diagram.attrs["missed_high"]
    assert "longer" in small["unplaced"]["reason"].values


@pytest.mark.thorough
def test_motions_of_long_periods_are_followed_where_random_ones_end_on_them():
    """On a ground that moves by 0.5 one of nine forcing periods takes a quarter of the states."""
    system = under(ground_horizontal=Harmonic(0.5), vertical=-0.5)
    bounds, options = (
        (2.92, 2.96),
        {"window": WINDOW, "effort": "quick", "repelling": 0, "bands": False, "switch": False},
    )
    rows = [
        row
        for row in independent_attractors(bounds, 3, 50, 13, system)
        if row[1] == 9 and row[4] >= 0.1
    ]
    assert len(rows) >= 3
    found = response_spectrum(system, FREQUENCY, bounds, **options)
    assert [row for row in rows if not lies_on_a_stable_branch(found, row)] == []
    shorter = response_spectrum(system, FREQUENCY, bounds, max_period=6, **options)
    assert "longer" in shorter["unplaced"]["reason"].values
    assert shorter.attrs["missed"] > 0


def test_a_closed_curve_passes_every_value_an_even_number_of_times():
    """Also within the step with which it closes."""
    found = search_orbits(SYSTEM, FREQUENCY, [2.4], max_period=3, starts=16, repelling=0).orbits
    loop = continue_orbit(
        next(orbit for orbit in found if orbit.period == 3), FREQUENCY, (0.5, 60.0)
    )
    assert loop.closed
    before, last = loop.parameters[-2:]
    assert len(loop.at(0.5 * (before + last))) % 2 == 0
    assert loop.is_joined(len(loop.points) - 2)
