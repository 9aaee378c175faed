"""The comparison of the benchmarks at equal achieved error, on power laws whose answers are known."""

import math
import sys
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

BENCHMARKS = Path(__file__).parents[1] / "benchmarks"
sys.path.insert(0, str(BENCHMARKS))
equal, measure, reference, report = (__import__(name) for name in ("equal", "measure", "reference", "report"))

ERRORS = np.array([1e-4, 1e-6, 1e-9, 1e-13])


@settings(deadline=None, max_examples=50)
@given(order=st.floats(0.5, 20.0), cost=st.floats(1e-3, 1e3), target=st.floats(1e-13, 1e-4))
def test_a_power_law_is_interpolated_exactly(order: float, cost: float, target: float) -> None:
    (time,) = measure.equal_error(ERRORS, cost * ERRORS ** (-1 / order), [target])
    assert time == pytest.approx(cost * target ** (-1 / order), rel=1e-9)


def test_a_looser_target_costs_the_cheapest_point_and_a_tighter_one_is_not_reached() -> None:
    times = measure.equal_error(ERRORS, [1.0, 2.0, 3.0, 4.0], [1e-2, 1e-13, 1e-14])
    assert times[0] == 1.0
    assert times[1] == pytest.approx(4.0)
    assert math.isnan(times[2])


def test_a_setting_that_another_one_beats_in_error_and_time_does_not_count() -> None:
    # 1e-3 at 2 s is dearer and worse than 1e-5 at 1 s, as where a loose tolerance loses a motion
    errors, times = [1e-3, 1e-5, 1e-9], [2.0, 1.0, 3.0]
    assert measure.equal_error(errors, times, [1e-3])[0] == 1.0
    assert measure.equal_error([*errors, float("nan")], [*times, 0.1], [1e-9])[0] == pytest.approx(3.0)


def test_a_code_that_never_ran_right_has_no_time() -> None:
    assert np.isnan(measure.equal_error([float("nan")], [1.0], [1e-6, 1e-9])).all()


def test_tasks_take_turns_and_every_round_counts() -> None:
    calls: list[str] = []
    timings = measure.interleave({"a": lambda: calls.append("a"), "b": lambda: calls.append("b")}, 3)
    assert calls == ["a", "b"] * 4  # the first round warms up
    assert timings["a"].rounds == 3
    assert timings["a"].least <= timings["a"].low <= timings["a"].median <= timings["a"].high


def test_ratios_and_verdicts_follow_from_the_times() -> None:
    lanes = [{"peer": equal.OURS, "error": e, "median": 1.0} for e in (1e-7, 1e-15)]
    heyoka = [{"peer": "heyoka.py batch", "error": e, "median": t} for e, t in ((1e-7, 4.0), (1e-13, 8.0))]
    found = equal.at_equal_error(lanes + heyoka)["heyoka.py batch"]
    assert found[0] == 4.0
    assert found[equal.TARGETS.index(1e-10)] == pytest.approx(math.sqrt(32.0))
    assert math.isnan(found[equal.TARGETS.index(1e-14)])
    (line,) = equal.asked({"work": lanes + heyoka, "startup": []})
    assert line == ("at equal error at least 5 times heyoka.py batch", "4 to 8 times", "no")


@pytest.mark.parametrize(("x", "text"), [(0.0, "0"), (1.2345, "1.23"), (12345.6, "12,346"), (1e-9, "1.00e-09"), (math.nan, "-")])
def test_numbers_are_written_to_three_digits(x: float, text: str) -> None:
    assert report.number(x) == text


def test_the_reference_ends_are_those_of_saltus() -> None:
    import saltus

    system = saltus.System(
        model=saltus.Metainterface(beta0=reference.BETA0, damping=reference.DAMPING),
        load=saltus.Load(
            frequency=reference.FREQUENCY,
            horizontal=saltus.Harmonic(amplitude=reference.AMPLITUDE),
            vertical=reference.VERTICAL,
        ),
    )
    starts, known = reference.states(reference.MOTIONS), reference.exact()
    motions = [saltus.simulate(system, theta=x, velocity=v, periods=reference.PERIODS) for x, v in zip(*starts, strict=True)]
    assert reference.errors([m.theta for m in motions], [m.velocity for m in motions]).max() < 1e-12
    assert [len(m.crossings) for m in motions] == known["impacts"].tolist()
