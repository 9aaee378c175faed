"""What a simulation returns: states at any time, events, margins and stops, files, and a phase that
does not drift.
"""

import copy
import math
import pickle
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import pytest
import xarray
from scipy.integrate import quad
from scipy.optimize import brentq
from shared_systems import BETA80, forced

from saltus.errors import ParameterError
from saltus.flow import EventKind, Motion, Stop, simulate
from saltus.systems import Harmonic, Load, Model, RockingBlock, System, WallOscillator

SYSTEM = forced(H=0.5, e=0.9)
WALL = System(
    model=WallOscillator(damping=0.1, wall=1e6), load=Load(frequency=1.3, force=Harmonic(0.4))
)


@dataclass(frozen=True)
class Runaway(Model):
    """x'' = x + F: e^t grows beyond every number."""

    coordinates: ClassVar[tuple[str, ...]] = ("x",)
    channels: ClassVar[tuple[str, ...]] = ("force",)

    def acceleration(self, t, x, velocity, side, load):
        return x + load.force(t)


@pytest.fixture(scope="module")
def motion():
    """A motion with impacts over three periods."""
    return simulate(SYSTEM, theta=0.3, periods=3)


# --- states ------------------------------------------------------------------


def test_end_state_is_that_of_the_dense_output(motion):
    assert motion.at(motion.time) == (motion.theta, motion.velocity)
    assert motion.at(motion.time - 1e-12) == pytest.approx(
        (motion.theta, motion.velocity), abs=1e-11
    )
    assert motion.position == motion.theta
    assert motion.time == pytest.approx(3 * 2 * math.pi, abs=1e-14)
    assert (motion.stop, motion.limit, motion.periods, motion.side) == (
        Stop.HORIZON,
        None,
        3,
        int(np.sign(motion.theta)),
    )
    assert f"impacts={len(motion.impacts)}" in repr(motion)


def test_velocity_at_an_impact_is_the_one_after_it(motion):
    crossings = motion.impacts
    theta, velocity = motion.at(crossings.time)
    assert theta == pytest.approx(np.zeros(len(crossings)), abs=1e-15)
    assert velocity == pytest.approx(crossings.velocity_after, abs=1e-15)
    _, before = motion.at(crossings.time - 1e-9)
    assert before == pytest.approx(crossings.velocity_before, abs=1e-8)


def test_motion_that_ends_at_an_impact_ends_after_it():
    wall = WALL.with_({"model.wall": 1.0, "load.force.amplitude": 0.9, "impact.e": 0.8})
    impact = simulate(wall, x=0.0, periods=2).impacts
    # the impact is in by one of these: rounding says which
    ends = impact.time[0] + np.arange(8) * np.spacing(impact.time[0])
    kept = next(
        m
        for m in (simulate(wall, x=0.0, duration=float(end)) for end in ends)
        if len(m.impacts) == 1
    )
    motion = simulate(wall, x=0.0, duration=kept.time, times=[0.0, kept.time])
    assert len(motion.impacts) == 1
    assert kept.at(kept.time) == (kept.x, kept.velocity)
    assert kept.x == pytest.approx(1.0, abs=1e-14)
    assert (motion.kept.velocity[0, -1], kept.velocity) == pytest.approx(
        [impact.velocity_after[0]] * 2, abs=1e-13
    )


def test_states_take_the_shape_of_the_times(motion):
    one = motion.at(1.0)
    assert all(type(x) is float for x in one)
    theta, velocity = motion.at([0.5, 1.0])
    assert theta.shape == velocity.shape == (2,)
    assert (theta[1], velocity[1]) == one
    assert [x.shape for x in motion.at(np.array([]))] == [(0,), (0,)]


def test_dense_output_satisfies_the_equation(motion):
    times = np.linspace(0.01, motion.time - 0.01, 400)
    times = times[np.abs(times[:, None] - motion.impacts.time).min(axis=1) > 1e-3]
    h = 1e-3
    theta, velocity = motion.at(times)
    left, right = motion.at(times - h / 2)[1], motion.at(times + h / 2)[1]
    expected = SYSTEM.model.acceleration(times, theta, velocity, np.sign(theta), SYSTEM.load)
    assert (right - left) / h == pytest.approx(expected, abs=1e-5)  # of the difference, h^2


@pytest.mark.parametrize("time", [-1e-3, 3 * 2 * math.pi + 1e-3, math.nan, [0.0, 100.0]])
def test_times_outside_the_motion_are_refused(motion, time):
    with pytest.raises(
        ParameterError, match=r"times must lie in \[0, 18.8496\], the span of the motion"
    ):
        motion.at(time)


def test_motion_that_was_not_kept_says_so():
    kept, thrown = (simulate(SYSTEM, theta=0.3, periods=3, dense=dense) for dense in (True, False))
    assert (thrown.theta, thrown.velocity) == (kept.theta, kept.velocity)
    assert np.array_equal(thrown.impacts.time, kept.impacts.time)
    for use in (lambda: thrown.at(1.0), lambda: thrown.to_xarray()):
        with pytest.raises(ParameterError, match="this motion has no dense output"):
            use()
    with pytest.raises(ParameterError, match="a motion computed with dense=False has no validity"):
        _ = thrown.validity


def test_samples_are_the_states_of_the_whole_motion(motion):
    times = np.concatenate(
        [[0.0], motion.impacts.time[:2], np.linspace(3.0, motion.time, 50), [motion.time + 1.0]]
    )
    sampled = simulate(SYSTEM, theta=0.3, periods=3, times=np.sort(times)).kept
    inside = np.sort(times)[:-1]
    assert sampled.time == pytest.approx(inside, abs=0)
    assert np.stack([sampled.position[0], sampled.velocity[0]]) == pytest.approx(
        np.stack(motion.at(inside)), abs=1e-15
    )


@pytest.mark.parametrize("start", [-2.0, 0.0, 5.0])
@pytest.mark.parametrize("duration", [0.0, 1.0])
def test_samples_include_the_start_and_the_end(start, duration):
    end = start + duration
    motion = simulate(
        SYSTEM, theta=0.3, velocity=0.1, time=start, duration=duration, times=[start, end]
    )
    assert motion.kept.position[0] == pytest.approx([0.3, motion.theta], abs=1e-14)
    assert motion.kept.velocity[0] == pytest.approx([0.1, motion.velocity], abs=1e-14)


def test_motion_of_no_length_is_its_start():
    motion = simulate(SYSTEM, theta=0.3, velocity=-0.2, duration=0.0, time=1.5)
    assert (motion.time, motion.theta, motion.velocity, motion.side) == (1.5, 0.3, -0.2, 1)
    assert motion.at(1.5) == (0.3, -0.2)
    assert len(motion.events) == len(motion.impacts) == 0
    assert motion.validity.respected


def test_part_of_a_period_ends_where_it_should():
    length = SYSTEM.load.period
    for start in (0.0, 0.7 * length, 3.2 * length, -1.6 * length):
        for periods in (0.4, 1.0, 2.5):
            by_periods = simulate(SYSTEM, theta=0.3, time=start, periods=periods)
            by_time = simulate(SYSTEM, theta=0.3, time=start, duration=periods * length)
            assert by_periods.time == pytest.approx(start + periods * length, abs=1e-13)
            assert (by_periods.theta, by_periods.velocity) == pytest.approx(
                (by_time.theta, by_time.velocity), abs=1e-11
            )


def test_motion_can_be_copied_and_pickled(motion):
    for twin in (copy.copy(motion), copy.deepcopy(motion), pickle.loads(pickle.dumps(motion))):
        assert isinstance(twin, Motion)
        assert twin.system == motion.system
        assert twin.at(1.0) == motion.at(1.0)
        assert list(twin.events) == list(motion.events)
    with pytest.raises(AttributeError, match="a Motion has no 'phi'"):
        _ = motion.phi


# --- events ------------------------------------------------------------------


def test_impacts_alternate_between_the_sides_and_lose_the_same_share(motion):
    crossings = motion.impacts
    assert len(crossings) == crossings.time.size == crossings.velocity_after.size > 3
    assert (np.diff(crossings.time) > 0).all()
    assert crossings.side.dtype == np.int8
    assert (crossings.side[1:] == -crossings.side[:-1]).all()
    assert (np.sign(crossings.velocity_before) == -crossings.side).all()
    assert (crossings.velocity_after == 0.9 * crossings.velocity_before).all()


def test_events_come_in_order_of_time():
    system = forced(H=0.12, W=0.15, e=0.5)  # comes to rest and is released, over and over
    motion = simulate(system, theta=0.3, periods=3)
    kinds = [event.kind for event in motion.events]
    times = np.array([event.time for event in motion.events])
    assert {EventKind.IMPACT, EventKind.REST, EventKind.RELEASE} <= set(kinds)
    assert (np.diff(times) >= 0).all()
    assert 0 <= times[0] <= times[-1] <= motion.time
    for here, following in zip(motion.events, motion.events[1:], strict=False):
        assert (following.kind is EventKind.RELEASE) == (here.kind is EventKind.REST)
    assert [
        e.time for e in motion.events if e.kind is EventKind.IMPACT
    ] == motion.impacts.time.tolist()


# --- margins -----------------------------------------------------------------

LARGE = forced(H=1.0, W=0.8)
OPENING = math.pi - BETA80


def reaction(t, theta, velocity, system):
    """The closed layer's reaction with the sign that keeps it closed (errata 21), for equal layers,
    written again.
    """
    b, s, load = BETA80, np.sign(theta), system.load
    horizontal, vertical = load.horizontal(t), -0.5
    acceleration = (
        np.sin(abs(theta) + b) * horizontal
        + s * np.cos(abs(theta) + b) * vertical
        - 0.1 * velocity
        - theta
    )
    # R2 on the lower layer, and its mirror image (theta, H -> -theta, -H) on the upper one
    bend = np.cos(2 * b + abs(theta)) * s * acceleration - np.sin(2 * b + abs(theta)) * velocity**2
    return bend + s * horizontal * np.sin(b) - vertical * np.cos(b)


@pytest.fixture(scope="module")
def large():
    """A motion that passes all its limits."""
    return simulate(LARGE, theta=1.0, velocity=4.5, periods=8)


def test_first_passage_of_the_limits_is_where_the_angle_reaches_them(large):
    times = np.linspace(0, large.time, 400_001)
    theta = np.abs(large.at(times)[0])
    for name, limit in (("line_limit", OPENING), ("kinematic_limit", 2 * OPENING)):
        beyond = theta > limit
        first = int(np.argmax(beyond))
        assert beyond.any()
        exact = brentq(
            lambda t, limit=limit: abs(large.at(t)[0]) - limit,
            times[first - 1],
            times[first],
            xtol=1e-14,
        )
        assert large.validity.first[name] == pytest.approx(exact, abs=1e-12)
        assert large.validity.share[name] == pytest.approx(beyond.mean(), abs=1e-5)


def test_share_of_the_wrong_reaction_is_that_of_fine_samples(large):
    for motion, system in (
        (large, LARGE),
        (simulate(forced(H=0.5), theta=0.3, periods=30), forced(H=0.5)),
    ):
        times = np.linspace(0, motion.time, 400_001)
        value = reaction(times, *motion.at(times), system)
        wrong = value < 0
        assert motion.validity.share["reaction"] == pytest.approx(wrong.mean(), abs=2e-5)
        first = int(np.argmax(wrong))
        assert motion.validity.first["reaction"] == pytest.approx(times[first], abs=times[1])
        if (
            value[first - 1] > 0
            and not (
                (motion.impacts.time > times[first - 1]) & (motion.impacts.time < times[first])
            ).any()
        ):
            exact = brentq(
                lambda t, m=motion, s=system: float(reaction(t, *m.at(t), s)),
                times[first - 1],
                times[first],
            )
            assert motion.validity.first["reaction"] == pytest.approx(exact, abs=1e-11)


def test_paper_s_motion_violates_the_reaction_for_eight_percent_of_the_time():
    # Errata 21: 8 % at H = 0.5, Omega = 1, on the periodic motion.
    settled = simulate(forced(H=0.5), theta=0.3, periods=200, dense=False)
    motion = simulate(forced(H=0.5), theta=settled.theta, velocity=settled.velocity, periods=10)
    assert motion.validity.share["reaction"] == pytest.approx(0.08, abs=0.005)


@pytest.mark.parametrize("name", ["line_limit", "kinematic_limit", "reaction"])
def test_motion_stops_where_its_margin_is_first_passed(large, name):
    stopped = simulate(LARGE, theta=1.0, velocity=4.5, periods=8, stop_at=(name,))
    assert (stopped.stop, stopped.limit) == (Stop.LIMIT, name)
    assert stopped.time == pytest.approx(large.validity.first[name], abs=1e-12)
    assert stopped.events[-1].kind is EventKind.LIMIT
    assert stopped.events[-1].time == stopped.time
    assert (stopped.theta, stopped.velocity) == pytest.approx(large.at(stopped.time), abs=1e-11)
    assert f"limit ({name})" in repr(stopped)


def test_one_margin_may_be_named_without_a_tuple():
    stopped = simulate(LARGE, theta=1.0, velocity=4.5, periods=8, stop_at="line_limit")
    assert stopped.limit == "line_limit"


def test_motion_that_starts_beyond_a_limit_stops_at_once():
    stopped = simulate(LARGE, theta=2.0, periods=8, stop_at="line_limit")
    assert (stopped.time, stopped.theta, stopped.limit) == (0.0, 2.0, "line_limit")


def test_margins_that_are_not_passed_are_reported_as_such():
    quiet = simulate(forced(H=0.0), theta=0.05, duration=1.0)
    assert quiet.validity.respected
    assert (
        str(quiet.validity)
        == "line_limit: not passed; kinematic_limit: not passed; reaction: not passed"
    )
    passed = simulate(LARGE, theta=1.7, velocity=1.3, duration=1.0)
    assert "line_limit: passed first at" in str(passed.validity)
    assert str(simulate(WALL, x=0.0, duration=1.0).validity) == "the model has no margins"


def test_block_that_overturns_stops_on_its_side():
    # From rest at theta0 > alpha: theta' = sqrt(2 (cos(theta0 - alpha) - cos(theta - alpha))), and
    # the time by quadrature.
    alpha, start = 0.3, 0.31
    motion = simulate(System(model=RockingBlock(alpha=alpha)), theta=start, duration=50.0)

    def slowness(u):  # theta = start + u^2 takes the square root's singularity away
        fall = math.cos(start - alpha) - math.cos(start + u * u - alpha)
        return 2 * u / math.sqrt(2 * fall)

    expected = quad(slowness, 0, math.sqrt(math.pi / 2 - start), epsabs=1e-11, epsrel=1e-11)[0]
    assert (motion.stop, motion.limit) == (Stop.LIMIT, "overturned")
    assert motion.time == pytest.approx(expected, abs=1e-9)
    assert motion.theta == pytest.approx(math.pi / 2, abs=1e-14)
    assert motion.velocity == pytest.approx(
        math.sqrt(2 * (math.cos(start - alpha) - math.sin(alpha))), abs=1e-12
    )


# --- files -------------------------------------------------------------------


def test_dataset_repeats_the_motion(motion):
    data = motion.to_xarray()
    again = simulate(
        System.from_json(data.attrs["system"]), theta=0.3, periods=3, tol=data.attrs["tol"]
    )
    assert (again.theta, again.velocity, again.time) == (
        motion.theta,
        motion.velocity,
        data.attrs["end_time"],
    )
    assert data.theta.values[-1] == pytest.approx(motion.theta, abs=1e-14)
    assert data.sizes == {"time": 601, "impact": len(motion.impacts)}
    assert np.stack([data.theta, data.velocity]) == pytest.approx(
        np.stack(motion.at(data.time.values)), abs=0
    )
    assert set(np.unique(data.side)) == {-1, 1}
    assert data.theta.attrs["units"] == "rad"
    assert data.attrs["stop"] == "horizon"
    assert data.attrs["phase_known"] == "True"
    assert data.attrs["validity"] == str(motion.validity)


def test_dataset_survives_netcdf(motion, tmp_path):
    data = motion.to_xarray(times=np.linspace(1.0, 2.0, 11))
    data.to_netcdf(tmp_path / "motion.nc", engine="h5netcdf")
    with xarray.open_dataset(tmp_path / "motion.nc", engine="h5netcdf") as read:
        xarray.testing.assert_identical(read.load(), data)
        assert System.from_json(read.attrs["system"]) == motion.system


def test_dataset_of_a_motion_at_rest_has_its_rest_time():
    motion = simulate(forced(H=0.0, e=0.5), theta=0.3, duration=30.0)
    data = motion.to_xarray()
    assert motion.stop is Stop.REST
    assert motion.side == 0
    assert (
        data.attrs["rest_time"]
        == motion.rest_time
        == next(e.time for e in motion.events if e.kind is EventKind.REST)
    )
    assert data.sizes["time"] == math.ceil(200 * 30.0 / (2 * math.pi)) + 1
    assert (data.side.values[data.time.values > motion.rest_time + 1e-9] == 0).all()


# --- phase -------------------------------------------------------------------


def steady(t, frequency, amplitude, damping):
    """The periodic solution of x'' + damping x' + x = amplitude sin(frequency t)."""
    response = amplitude / complex(1 - frequency**2, damping * frequency)
    z = response * np.exp(1j * frequency * t)
    return z.imag, (1j * frequency * z).imag


def test_steady_state_of_a_linear_oscillator_holds_over_a_hundred_thousand_periods():
    x, velocity = steady(0.0, 1.3, 0.4, 0.1)
    motion = simulate(WALL, x=float(x), velocity=float(velocity), periods=100_000, dense=False)
    assert motion.periods == 100_000
    assert (motion.x, motion.velocity) == pytest.approx((x, velocity), abs=1e-11)
    half = simulate(WALL, x=float(x), velocity=float(velocity), periods=10_000.25, dense=False)
    assert (half.x, half.velocity) == pytest.approx(
        steady(0.25 * WALL.load.period, 1.3, 0.4, 0.1), abs=1e-11
    )


def test_motion_after_ten_thousand_periods_goes_on_as_from_time_zero():
    # Local time within a period: the ten thousand and first period is computed with the same
    # numbers as the first.
    before = simulate(SYSTEM, theta=0.3, periods=10_000, dense=False)
    after = simulate(SYSTEM, theta=0.3, periods=10_005, dense=False)
    restarted = simulate(
        SYSTEM, theta=before.theta, velocity=before.velocity, periods=5, dense=False
    )
    assert (after.theta, after.velocity) == (restarted.theta, restarted.velocity)
    state = before
    for _ in range(5):
        state = simulate(SYSTEM, theta=state.theta, velocity=state.velocity, periods=1, dense=False)
    assert (after.theta, after.velocity) == (state.theta, state.velocity)


# --- refusals ----------------------------------------------------------------


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        ({}, "the state at the start needs theta=..."),
        ({"x": 0.3}, "Metainterface has no coordinate 'x'; known here: theta"),
        (
            {"theta": 0.3, "period": 2},
            "Metainterface has no coordinate 'period'; did you mean 'periods'?",
        ),
        ({"thete": 0.3}, "Metainterface has no coordinate 'thete'; did you mean 'theta'?"),
        ({"theta": 0.3, "periods": None}, "say how long: either periods=... or duration=..."),
        ({"theta": 0.3, "duration": 1.0}, "say how long: either periods=... or duration=..."),
        ({"theta": 0.3, "periods": -1}, "periods must lie in [0, 1e+12], got -1"),
        ({"theta": 0.3, "periods": math.inf}, "periods must lie in [0, 1e+12], got inf"),
        (
            {"theta": 0.3, "periods": None, "duration": -0.5},
            "duration must lie in [0, 1e+12], got -0.5",
        ),
        (
            {"theta": 0.3, "periods": None, "duration": math.nan},
            "duration must lie in [0, 1e+12], got nan",
        ),
        ({"theta": 0.3, "periods": "3"}, "periods must be a number in [0, 1e+12], got '3'"),
        ({"theta": 0.3, "tol": 1e-16}, "tol must lie in [1e-15, 1e-06], got 1e-16"),
        ({"theta": 0.3, "tol": 1e-5}, "tol must lie in [1e-15, 1e-06], got 1e-05"),
        ({"theta": 0.3, "tol": 0}, "tol must lie in [1e-15, 1e-06], got 0"),
        ({"theta": math.nan}, "theta must be finite, got nan"),
        ({"theta": math.inf}, "theta must be finite, got inf"),
        ({"theta": "a"}, "theta must be a finite number, got 'a'"),
        ({"theta": 0.3, "velocity": math.nan}, "velocity must be finite, got"),
        ({"theta": 0.3, "velocity": "fast"}, "velocity must be a finite number, got 'fast'"),
        ({"theta": 0.3, "velocity": None}, "velocity must be a finite number, got None"),
        ({"theta": 0.3, "velocity": (0.0, 1.0)}, "velocity must have 1 value(s), got (0.0, 1.0)"),
        (
            {"theta": 0.3, "velocity": [0.0, [1.0]]},
            "velocity must have 1 value(s), got [0.0, [1.0]]",
        ),
        ({"theta": 0.3, "time": math.inf}, "time must be finite, got inf"),
        ({"theta": 0.3, "side": 0}, "side must be +1 or -1, got 0"),
        ({"theta": 0.3, "side": "left"}, "side must be +1 or -1, got 'left'"),
        (
            {"theta": 0.3, "stop_at": ("kinematic",)},
            "Metainterface has no margin 'kinematic' to stop at; did you mean 'kinematic_limit'?",
        ),
        (
            {"theta": 0.3, "stop_at": "reactions"},
            "Metainterface has no margin 'reactions' to stop at; did you mean 'reaction'?",
        ),
        (
            {"theta": 0.3, "times": [2.0, 1.0]},
            "times must be numbers that do not decrease, from the start 0 on, got [2.0, 1.0]",
        ),
        (
            {"theta": 0.3, "times": [-1.0]},
            "times must be numbers that do not decrease, from the start 0 on",
        ),
        (
            {"theta": 0.3, "times": "all"},
            "times must be numbers that do not decrease, from the start 0 on, got 'all'",
        ),
    ],
)
def test_arguments_without_meaning_are_refused_in_a_sentence(arguments, sentence):
    with pytest.raises(ParameterError) as refusal:
        simulate(SYSTEM, **{"periods": 1, **arguments})
    assert sentence in str(refusal.value)
    assert "\n" not in str(refusal.value)


def test_periods_of_a_load_without_frequency_are_refused():
    system = System(model=WallOscillator(), load=Load(force=1.0))
    with pytest.raises(
        ParameterError,
        match=r"the load has no frequency, so there are no forcing periods; give duration=\.\.\.",
    ):
        simulate(system, x=0.0, periods=3)


def test_start_beyond_the_wall_is_refused():
    with pytest.raises(ParameterError, match=r"x = 1\.5 lies beyond the contact at x = 1$"):
        simulate(WALL.with_({"model.wall": 1.0}), x=1.5, duration=1.0)


def test_motion_that_leaves_the_range_of_numbers_is_refused_with_the_instant():
    from saltus.errors import MotionError

    runaway = System(model=Runaway(), load=Load(frequency=1.0, force=Harmonic(0.0)))
    # e^709 is the largest
    with pytest.raises(
        MotionError, match=r"the motion leaves the range of numbers at time (7[01]\d)"
    ):
        simulate(runaway, x=1.0, velocity=1.0, duration=1000.0, dense=False)


def test_a_stiff_motion_that_does_not_fit_into_memory_is_refused_with_what_helps(monkeypatch):
    """Its steps are so short that forcing periods say nothing about the memory."""
    from saltus.checks import Limits
    from saltus.errors import MotionError

    monkeypatch.setattr("saltus.flow.motion.kernel_state.LIMITS", Limits(any_machine=1e5))
    monkeypatch.setattr("saltus.flow.motion.kernel_state.free_memory", lambda: 2e6)
    stiff = WALL.with_({"model.damping": 1e5})
    with pytest.raises(
        MotionError, match=r"GB of memory, and 0\.002 GB are left; give times=\.\.\."
    ):
        simulate(stiff, x=0.1, duration=1.0)
    simulate(stiff, x=0.1, duration=1.0, times=[1.0])


@pytest.mark.parametrize("far", [1e6, 1e9, 1e12])
def test_the_phase_far_from_0_is_that_of_the_rounded_time(far):
    """As the docstring says: two starts one period apart differ by the rounding of the time, and
    not by more.
    """
    period = 2 * math.pi / WALL.load.frequency
    start = round(far / period) * period
    near = simulate(WALL, x=0.3, velocity=0.0, periods=2, dense=False)
    moved = simulate(WALL, x=0.3, velocity=0.0, periods=2, dense=False, time=start)
    assert abs(moved.position - near.position) < 4 * math.ulp(far) + 1e-12
