"""Motions that have not settled: chaos, transients with their lives, and slow or long periodic
motions.
"""

from dataclasses import replace

import numpy as np
import pytest
from shared_systems import forced

from saltus import WallOscillator, simulate_many
from saltus.attractors import (
    JUDGEMENT,
    EarlierJudgement,
    JudgementSettings,
    SettledLater,
    judge,
    judgement,
)
from saltus.attractors.judgement import Reason
from saltus.flow import Ending, Recurrence, find_recurrence
from saltus.systems import Harmonic, Load, System

FREQUENCY, AMPLITUDE = "load.frequency", "load.horizontal.amplitude"
BRIEF = JudgementSettings(companions=8, exposure=2000, round_periods=1000, rounds=2)


def unsettled_states(system, path, value, periods=300, starts=6, kept=16):
    """The last states of the motions from random states that have not settled at one value, (1, n,
    2).
    """
    states = np.random.default_rng(1).uniform(-2.0, 2.0, (starts, 2))
    ends = find_recurrence(
        system, states, periods, parameters={path: np.full(starts, value)}, kept=kept
    )
    return ends.states[ends.outcome == Ending.UNDECIDED].reshape(1, -1, 2)


def judged(system, path, value, **options):
    return judge(
        system, unsettled_states(system, path, value, **options), {path: np.array([value])}
    )


def test_the_motion_that_erratum_32_overlooked_is_chaotic():
    """The review of the results, section 2: Omega = 0.5, Hhat = 0.105, exponent about 0.07 by two
    integrators.
    """
    found = judged(forced(0.105, 0.5), AMPLITUDE, 0.105)
    assert found.ending.tolist() == [Ending.CHAOTIC]
    assert found.exponent[0] == pytest.approx(0.07, abs=0.01)
    assert found.error[0] < 0.01
    assert found.reason.tolist() == [Reason.CHAOS]


def test_a_transient_is_one_and_its_life_is_that_of_an_ensemble():
    """numerics.md: transients at Omega = 4, Hhat between 7.2 and 7.7; the life by plain simulation
    without any judgement.
    """
    system = forced(7.2, 4.0)
    found = judged(system, AMPLITUDE, 7.2, starts=24)
    assert found.ending.tolist() == [Ending.TRANSIENT]
    states = np.random.default_rng(2).uniform(-2.0, 2.0, (400, 2))
    ends = simulate_many(
        system,
        theta=states[:, 0],
        velocity=states[:, 1],
        periods=3000,
        until=("settled",),
        tol=1e-11,
    )
    late = ends["periods"].values
    late = late[late > 300]
    life = (late - 300).sum() / (late < 3000).sum()
    assert len(late) > 100
    assert found.mean_life[0] == pytest.approx(life, rel=0.6)


def test_what_companions_settle_on_repeats_itself():
    system = forced(7.2, 4.0)
    settled = judged(system, AMPLITUDE, 7.2).settled
    assert len(settled.period) > 0
    for state, period in zip(settled.state, settled.period, strict=True):
        later = simulate_many(
            system, theta=state[0], velocity=state[1], periods=int(period), tol=1e-12
        )
        assert [later["theta"].item(), later["velocity"].item()] == pytest.approx(state, abs=1e-8)


def test_a_slow_linear_oscillator_is_periodic_with_half_its_damping_as_exponent():
    system = System(
        model=WallOscillator(stiffness=1.0, damping=0.005, wall=50.0),
        load=Load(frequency=1.7, force=Harmonic(amplitude=0.1)),
    )
    found = judged(system, FREQUENCY, 1.7)
    assert found.ending.tolist() == [Ending.PERIODIC]
    assert found.exponent[0] == pytest.approx(-0.0025, rel=0.01)
    assert found.period.tolist() == [1]


def test_weak_chaos_is_chaos_and_a_period_longer_than_was_looked_for_is_none():
    """Both near the end of the cascade of period doublings at Omega = 0.3994, Hhat = 0.2
    (numerics.md).
    """
    values, system = np.array([0.397, 0.397875]), forced(0.2)
    states = np.concatenate(
        [unsettled_states(system, FREQUENCY, value)[:, :16] for value in values]
    )
    found = judge(system, states, {FREQUENCY: values})
    assert found.ending.tolist() == [Ending.CHAOTIC, Ending.PERIODIC]
    assert 0.0 < found.error[0] < found.exponent[0] < 0.01
    (state,), (period,) = found.settled.state, found.settled.period
    later = simulate_many(
        system.with_({FREQUENCY: 0.397875}),
        theta=state[0],
        velocity=state[1],
        periods=int(period),
        last="all",
    )
    visited = later["sampled_theta"].values
    assert period > 16
    assert abs(visited[-1] - state[0]) < 1e-7
    assert np.abs(visited[:-1] - state[0]).min() > 1e-5


def test_what_is_looked_at_too_briefly_is_undecided():
    """20 motions a rounding apart, which lead apart: where all companions happen to settle, the
    motion is known to repeat itself; else it is undecided, and never called chaos or a transient.
    """
    short = JudgementSettings(companions=4, rounds=0)
    states = unsettled_states(forced(7.2, 4.0), AMPLITUDE, 7.2)
    beside = states + 1e-12 * np.random.default_rng(0).standard_normal((20, *states.shape[1:]))
    found = judge(forced(7.2, 4.0), beside, {}, settings=short)
    undecided = found.ending == Ending.UNDECIDED
    unknown = (Reason.FEW_SETTLED, Reason.NO_EXPONENTS)  # the latter where they settle at once
    assert np.all(np.isin(found.reason[undecided], unknown))
    assert np.all(found.reason[~undecided] == Reason.LONG_PERIOD)
    assert (found.reason == Reason.FEW_SETTLED).sum() >= 4


def test_a_question_is_answered_the_same_alone_and_among_others():
    system, values = forced(0.2), np.array([0.37, 0.38, 0.39])
    states = np.concatenate(
        [unsettled_states(system, FREQUENCY, value)[:, :16] for value in values]
    )
    many = judge(system, states, {FREQUENCY: values})
    one = judge(system, states[1:2], {FREQUENCY: values[1:2]})
    assert (many.ending[1], many.exponent[1], many.error[1]) == (
        one.ending[0],
        one.exponent[0],
        one.error[0],
    )
    assert np.array_equal(many.states[1], one.states[0])


def test_chaos_that_was_judged_before_is_judged_on_from_there():
    """What an earlier judgement has shown counts: its exponent stays, and fewer forcing periods
    exclude the same life.
    """
    system, value = forced(0.2), np.array([0.38])
    first = judge(
        system,
        unsettled_states(system, FREQUENCY, 0.38)[:, :16],
        {FREQUENCY: value},
        settings=BRIEF,
    )
    known = EarlierJudgement(first.exponent, first.error, 3.0 * first.mean_life)
    careful = replace(BRIEF, exposure=20_000, rounds=3)
    found = judge(system, first.states, {FREQUENCY: value}, settings=careful, earlier=known)
    assert first.ending.tolist() == found.ending.tolist() == [Ending.CHAOTIC]
    assert found.exponent[0] == first.exponent[0]
    assert 3.0 * first.mean_life[0] >= BRIEF.exposure
    assert 20_000 <= 3.0 * found.mean_life[0] < 20_000 + BRIEF.companions * BRIEF.round_periods


def test_an_earlier_judgement_that_was_wrong_is_corrected():
    system = forced(7.2, 4.0)
    wrong = EarlierJudgement(np.array([0.1]), np.array([0.01]), np.array([2000.0]))
    states = unsettled_states(system, AMPLITUDE, 7.2, starts=24)
    assert judge(system, states, {AMPLITUDE: np.array([7.2])}, earlier=wrong).ending.tolist() == [
        Ending.TRANSIENT
    ]


def test_few_keeps_so_many_motions_of_each_period_and_of_each_question():
    rng, k = np.random.default_rng(4), 60
    settled = SettledLater(rng.integers(0, 4, k), rng.normal(size=(k, 2)), rng.integers(1, 5, k))
    few = settled.few(2, 5)
    for question in range(4):
        periods, given = (
            few.period[few.question == question],
            settled.period[settled.question == question],
        )
        assert len(periods) == min(
            5, sum(min(2, np.count_nonzero(given == period)) for period in range(1, 5))
        )
        assert np.bincount(periods).max() <= 2
    rows = {
        tuple(row) for row in np.column_stack([settled.question, settled.period, settled.state])
    }
    assert {tuple(row) for row in np.column_stack([few.question, few.period, few.state])} <= rows


@pytest.fixture
def processes(monkeypatch):
    """Motions that settle by chance in place of simulated ones: those with a coordinate of 0 as a
    Poisson process of the mean life 2000, those with 1, which are on the attractor, never. Returns
    a list of the forcing periods that were asked for."""
    rng, asked = np.random.default_rng(8), []

    def settle_by_chance(system, states, periods, **options):
        n, when = (
            len(states),
            np.where(states[:, 0] > 0.5, np.inf, rng.exponential(2000.0, len(states))),
        )
        gone = when < periods
        asked.append(np.minimum(when, periods).sum())
        outcome = np.where(gone, Ending.PERIODIC, Ending.UNDECIDED).astype(np.int8)
        return Recurrence(
            outcome, gone.astype(int), np.minimum(when, periods), states, np.empty((n, 0, 2))
        )

    monkeypatch.setattr(judgement, "find_recurrence", settle_by_chance)
    return asked


def verdicts_of(on_attractor, settings=JUDGEMENT, count=200):
    """The verdicts of questions of which so many companions are on the attractor, whose exponent is
    known.
    """
    states = np.zeros((count, settings.companions, 2))
    states[:, :on_attractor, 0] = 1.0
    known = EarlierJudgement(np.full(count, 0.1), np.full(count, 0.01), np.zeros(count))
    return judge(
        forced(0.2), states, {AMPLITUDE: np.full(count, 0.2)}, settings=settings, earlier=known
    ).ending


def test_a_transient_is_told_without_waiting_for_an_attractor_that_is_not_there(processes):
    assert (verdicts_of(0) == Ending.TRANSIENT).all()
    early = sum(processes)
    processes.clear()
    assert (verdicts_of(0, replace(JUDGEMENT, fewest_rounds=100)) == Ending.TRANSIENT).all()
    assert early < 0.6 * sum(processes)


def test_an_attractor_beside_a_transient_is_seen_as_ever_fewer_motions_settle(processes):
    """Of the companions that are not on it exp(-3/4) are left after each round: after some rounds
    all but a few are on it.
    """
    assert (verdicts_of(JUDGEMENT.companions) == Ending.CHAOTIC).all()
    assert (verdicts_of(JUDGEMENT.companions // 3) == Ending.CHAOTIC).mean() > 0.8


def test_fewer_companions_in_longer_rounds_see_an_attractor_more_surely_in_less_time(processes):
    """At the same work in a round, transients have more time to end."""
    wrong, work = [], []
    for settings in (JUDGEMENT, replace(JUDGEMENT, companions=24, round_periods=1000)):
        processes.clear()
        wrong.append((verdicts_of(settings.companions // 3, settings) != Ending.CHAOTIC).mean())
        work.append(sum(processes))
    assert wrong[0] < 0.5 * wrong[1]
    assert work[0] < work[1]
