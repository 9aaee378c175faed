"""Recurrence: rest, periods, extrema and impacts of many motions at once, against single
motions.
"""

import numpy as np
import pytest
from shared_systems import forced

import saltus
from saltus.flow import (
    RECURRENCE,
    Ending,
    find_recurrence,
    load_releases,
    nearest_return,
    return_distances,
    return_period,
)
from saltus.flow.long_time.recurrence import _long_period
from saltus.systems import Harmonic, Load, RockingBlock, System, VelocityReduction

STATES = np.random.default_rng(1).uniform(-1.5, 1.5, (32, 2))
AMPLITUDE = "load.horizontal.amplitude"


def test_the_numbers_are_those_of_the_compiled_lanes():
    from saltus.flow.lane_steps.sampling import LONGEST_RECURRENCE

    assert RECURRENCE.compiled_max_period == LONGEST_RECURRENCE


def test_a_motion_that_repeats_itself_comes_back_to_its_state_after_its_period_and_not_before():
    system = forced()
    ends = find_recurrence(system, STATES, 400)
    assert ends.periodic.sum() > 5
    for row in np.flatnonzero(ends.periodic):
        state, q = ends.last[row], int(ends.period[row])
        motion = saltus.simulate(system, theta=state[0], velocity=state[1], periods=q)
        assert abs(motion.theta - state[0]) < 1e-9
        assert abs(motion.velocity - state[1]) < 1e-9
        shorter = return_distances(ends.states[row], 16)[: q - 1]
        assert (shorter > 1e-7).all()


def test_extrema_and_impacts_are_those_of_one_period():
    system = forced()
    ends = find_recurrence(system, STATES, 400, kept=0, extrema=True, impact_count=True)
    assert ends.states.shape == (32, 0, 2)
    seen = 0
    for row in np.flatnonzero(ends.periodic):
        state = ends.last[row]
        motion = saltus.simulate(
            system, theta=state[0], velocity=state[1], periods=int(ends.period[row])
        )
        dense = motion.at(np.linspace(motion.start, motion.time, 4001))[0]
        assert dense.max() == pytest.approx(ends.highest[row], abs=1e-5)
        assert dense.min() == pytest.approx(ends.lowest[row], abs=1e-5)
        assert len(motion.impacts) == ends.impact_count[row]
        seen += 1
    assert seen > 5


def test_extrema_are_those_of_what_is_kept_whatever_else_is_recorded():
    system, periods, kept = forced(), 14, 4
    ends = find_recurrence(system, STATES, periods, kept=kept, max_period=2, extrema=True)
    whole = find_recurrence(
        system, STATES, periods, kept=kept, max_period=2, extrema=True, from_start=True
    )
    rows = np.flatnonzero(ends.unsettled)
    assert rows.size > 5
    assert np.array_equal(ends.extrema[rows], whole.extrema[rows])
    for row in rows[:8]:
        motion = saltus.simulate(
            system, theta=STATES[row, 0], velocity=STATES[row, 1], periods=periods
        )
        length = (motion.time - motion.start) / periods
        for back in range(kept):
            end = motion.time - back * length
            dense = motion.at(np.linspace(end - length, end, 2001))[0]
            assert (dense.max(), dense.min()) == pytest.approx(
                ends.extrema[row, -1 - back], abs=2e-5
            )


def test_motions_that_come_to_rest_have_no_extrema_unless_they_are_recorded_from_the_start():
    system = forced(0.015)  # below the load of the fold at which motions begin
    ends, all_of_it = (
        find_recurrence(system, STATES, 200, kept=2, extrema=True, from_start=start)
        for start in (False, True)
    )
    assert np.count_nonzero(ends.rest) > 5
    assert np.isnan(ends.extrema[ends.rest]).all()
    assert np.isfinite(all_of_it.extrema[ends.rest, -2:]).all()


def test_extrema_of_a_motion_that_a_limit_ends_are_those_before_its_end():
    load = Load(frequency=4.0, ground_horizontal=Harmonic(0.05))
    system = System(model=RockingBlock(alpha=0.3), load=load, impact=VelocityReduction(1.0))
    states = np.random.default_rng(1).uniform(-0.1, 0.1, (4, 2))
    ends = find_recurrence(system, states, 60, kept=3, max_period=2, extrema=True)
    assert ends.ended.all()
    for state, count, found in zip(states, ends.periods, ends.extrema, strict=True):
        motion = saltus.simulate(system, theta=state[0], velocity=state[1], periods=60)
        # of the last whole period
        begin = motion.start + (np.ceil(count) - 2.0) * 2.0 * np.pi / 4.0
        dense = motion.at(np.linspace(begin, begin + 2.0 * np.pi / 4.0, 2001))[0]
        assert (dense.max(), dense.min()) == pytest.approx(found[-2], abs=2e-5)


def test_parameters_of_their_own_are_those_of_a_system_of_their_own():
    amplitudes = np.linspace(0.3, 0.9, len(STATES))
    together = find_recurrence(forced(), STATES, 100, parameters={AMPLITUDE: amplitudes})
    for row in (0, 7, 31):
        single = find_recurrence(forced(H=float(amplitudes[row])), STATES[row : row + 1], 100)
        assert single.outcome[0] == together.outcome[row]
        assert np.array_equal(single.last[0], together.last[row])


def test_rest_is_for_good_only_where_no_load_pulls():
    loose, held = forced(H=0.5, e=0.2), forced(H=0.01, e=0.2)
    assert load_releases(loose)
    assert not load_releases(held)
    quiet = find_recurrence(held, np.array([[1e-3, 0.0]]), 50)
    assert quiet.rest.all()
    moved = find_recurrence(loose, np.array([[0.0, 0.0]]), 1)
    assert not moved.rest.any()


def test_longer_periods_than_the_lanes_look_for_are_read_off_the_states():
    states = np.tile(np.arange(20.0), 6)[:, None] * [1.0, -2.0]
    assert _long_period(states, 32, RECURRENCE) == 20
    assert _long_period(states, 19, RECURRENCE) == 0
    assert _long_period(states + np.arange(120)[:, None] * 1e-6, 32, RECURRENCE) == 0


def test_returns_are_measured_back_from_the_last_state():
    states = np.array([[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [1.0, 1e-7]])
    assert return_distances(states, 3) == pytest.approx([1.0, 1e-7, 1.0], rel=1e-6)
    assert return_distances(states, 9).shape == (3,)
    assert return_period(
        np.stack([states, states + np.array([0, 0, 0, 0.5])[:, None]]), 3
    ).tolist() == [2, 0]
    assert nearest_return(states, 3) == 2


def test_a_motion_followed_to_the_end_has_the_period_that_is_found_on_the_way():
    system = forced()
    early, late = (
        find_recurrence(system, STATES, 600, kept=20),
        find_recurrence(system, STATES, 600, kept=20, stop_early=False),
    )
    settled = early.periodic
    assert settled.sum() > 5
    assert (late.period[settled] == early.period[settled]).all()
    assert (late.periods == 600).all()


def test_each_outcome_says_what_it_is():
    assert len({str(outcome) for outcome in Ending}) == len(Ending)
