"""What an ensemble keeps of each forcing period, against the dense output of the scalar motion, and
when it ends one early.
"""

import itertools
import math

import numpy as np
import pytest
from lane_cases import FAMILIES, Cases, Duffing

import saltus
from saltus.flow import stop_names
from saltus.systems import Harmonic, Load, Metainterface, System, VelocityReduction

KINDS = ("state", "extrema", "impact_count", "speed")
PERIODS = 5.0


def long_cases(family, n, periods=PERIODS):
    """Starts at time 0 and at any other, over whole forcing periods."""
    rng = np.random.default_rng([6, *family.encode()])
    cases = FAMILIES[family](rng, n)
    times = np.where(rng.random(n) < 0.5, 0.0, rng.uniform(-20.0, 20.0, n))
    return Cases(
        cases.system, cases.columns, cases.state, cases.velocity, times, {"periods": periods}
    )


def extrema(motion, begin, end):
    """Largest and smallest coordinate in [begin, end]: polynomials of the dense output, at their
    ends and turning points.
    """
    dense, values = motion.dense, []
    for start, length, series in zip(dense.start, dense.length, dense.series[:, 0], strict=True):
        low, high = max(begin - start, 0.0), min(end - start, length)
        if high <= low:
            continue
        polynomial = np.polynomial.Polynomial(series)
        turns = polynomial.deriv().roots()
        real = turns[np.abs(turns.imag) < 1e-9 * length].real
        # rounding may leave a root a little outside of the step, or split a double one: its
        # neighbours are as good
        values += [polynomial(np.clip(np.concatenate([real, [low, high]]), low, high))]
    values = np.concatenate(values)
    return values.max(), values.min()


@pytest.mark.parametrize(
    "family",
    [
        "paper",
        "wall",
        "rocking",
        *(pytest.param(each, marks=pytest.mark.thorough) for each in ("every_channel", "duffing")),
    ],
)
def test_samples_are_those_of_the_dense_output(family):
    """Of every forcing period from the start, and of the part of one in which a margin ends the
    motion.
    """
    cases = long_cases(family, 40)
    ensemble = cases.in_lanes(tol=1e-14, sample=KINDS, last="all")
    name, calm, cut = cases.system.model.coordinates[0], 0, 0
    assert ensemble.sizes["period"] == PERIODS
    for i in range(len(cases)):
        motion = cases.alone(i, tol=1e-14, dense=True)
        if isinstance(motion, str) or motion.time == motion.start:
            continue
        here = ensemble.isel(trajectory=i)
        length = motion.system.load.period
        edges = motion.start + length * np.arange(
            math.ceil((motion.time - motion.start) / length - 1e-9) + 1
        )
        edges[-1] = motion.time
        samples = here.isel(period=slice(-(len(edges) - 1), None))
        position, velocity = motion.at(edges[1:])
        size = max(1.0, np.abs(position).max())
        apart = np.abs(
            [
                samples[f"sampled_{name}"].values - position,
                samples.sampled_velocity.values - velocity,
            ]
        ).max()
        if apart > 1e-11 * size:
            # a motion that magnifies its rounding: what it samples is compared where it does not
            continue
        calm, cut = calm + 1, cut + (motion.stop == "limit")
        assert np.isnan(here[f"sampled_{name}"].values[: -(len(edges) - 1)]).all()
        check_records(samples, motion, edges, name, 2e-11 * size)
        assert samples.period_impact_count.sum() == here.impact_count
    assert calm >= 12
    assert cut >= (5 if family == "rocking" else 0)


def check_records(samples, motion, edges, name, close):
    """Extrema, impacts and the least speed between the edges, which the last ones end."""
    times, speeds = motion.impacts.time, np.abs(motion.impacts.velocity_before)
    near_an_edge = np.abs(times[:, None] - edges[None, :-1]).min(initial=1.0) < 1e-9
    for leg, (begin, end) in enumerate(itertools.pairwise(edges)):
        top, bottom = extrema(motion, begin, end)
        assert float(samples[f"largest_{name}"][leg]) == pytest.approx(top, abs=close)
        assert float(samples[f"smallest_{name}"][leg]) == pytest.approx(bottom, abs=close)
        inside = (times > begin) & (times <= end)
        if not near_an_edge:
            assert int(samples.period_impact_count[leg]) == inside.sum()
            assert float(samples.least_speed[leg]) == pytest.approx(
                speeds[inside].min(initial=np.inf), rel=1e-8, abs=1e-11
            )


def test_extrema_of_long_steps_are_those_of_short_ones():
    """Steps of a low order's tolerance, in which a fast load turns the velocity several times, or
    nearly.
    """
    rng = np.random.default_rng(12)
    load, n = Load(frequency=4.0, horizontal=Harmonic(1.0), vertical=-0.1), 400
    system = System(model=Metainterface(beta0=math.radians(80.0), damping=0.1), load=load)
    parameters = {
        "load.horizontal.amplitude": rng.uniform(0.02, 0.5, n),
        "load.vertical": rng.uniform(-0.3, -0.01, n),
    }
    starts = {
        "theta": rng.uniform(-0.3, 0.3, n),
        "velocity": rng.uniform(-0.3, 0.3, n),
        "parameters": parameters,
    }
    options = {"periods": 3, "sample": ("state", "extrema"), "last": "all"}
    long, short = (
        saltus.simulate_many(system, **starts, **options, tol=tol) for tol in (1e-8, 1e-15)
    )
    apart = np.abs(long.sampled_theta - short.sampled_theta)
    assert float((apart < 1e-7).mean()) > 0.99
    for name in ("largest_theta", "smallest_theta"):
        assert (
            float(np.abs(long[name] - short[name]).where(apart.max("period") < 1e-7).max()) < 1e-7
        )


def test_the_whole_motion_has_the_extremes_of_its_periods():
    cases = long_cases("rocking", 200)
    everything = cases.in_lanes(sample=KINDS, last="all")
    few = cases.in_lanes(sample=("extrema", "speed"), last=1)
    started = stop_names(everything).values != "outside"
    for name, best in (("largest_theta", "max"), ("smallest_theta", "min"), ("least_speed", "min")):
        expected = getattr(everything[name], best)("period").values
        np.testing.assert_array_equal(
            everything[f"overall_{name}"].values[started], expected[started]
        )
        np.testing.assert_array_equal(few[f"overall_{name}"], everything[f"overall_{name}"])


def test_the_period_in_which_a_motion_is_captured_is_kept():
    cases = attracted(150, 0.8)
    ensemble = cases.in_lanes(until="rest", sample=KINDS, last="all")
    captured = ensemble.isel(trajectory=np.flatnonzero(stop_names(ensemble).values == "captured"))
    assert captured.sizes["trajectory"] >= 8
    np.testing.assert_array_equal(captured.sampled_theta[:, -1], captured.theta)
    np.testing.assert_array_equal(captured.sampled_velocity[:, -1], captured.velocity)
    np.testing.assert_array_equal(captured.period_impact_count.sum("period"), captured.impact_count)
    np.testing.assert_array_equal(
        captured.sampled_theta.notnull().sum("period"), np.ceil(captured.periods)
    )
    assert (captured.periods % 1 > 0).any()


def test_the_last_periods_are_the_tail_of_all_of_them():
    cases = long_cases("paper", 60, periods=7.0)
    everything = cases.in_lanes(sample=KINDS, last="all")
    assert everything.sizes["period"] == 7
    for last in (1, 2, 6, 7, 50):
        tail = cases.in_lanes(sample=KINDS, last=last)
        assert tail.sizes["period"] == min(last, 7)
        for name in (
            "sampled_theta",
            "sampled_velocity",
            "largest_theta",
            "smallest_theta",
            "least_speed",
            "period_impact_count",
        ):
            np.testing.assert_array_equal(tail[name], everything[name].values[:, -last:])
    ended = stop_names(everything).values == "horizon"
    np.testing.assert_array_equal(everything.sampled_theta[ended, -1], everything.theta[ended])
    np.testing.assert_array_equal(
        everything.sampled_velocity[ended, -1], everything.velocity[ended]
    )


def test_periods_that_a_motion_did_not_reach_are_nan_and_come_first():
    block = FAMILIES["rocking"](np.random.default_rng(2), 200)
    cases = Cases(
        block.system, block.columns, block.state, block.velocity, np.zeros(200), {"periods": 6.0}
    )
    ensemble = cases.in_lanes(sample=KINDS, last="all")
    early = stop_names(ensemble).values == "limit"
    assert early.sum() > 20
    for row in (
        ensemble.isel(trajectory=np.flatnonzero(early))
        .transpose("trajectory", ...)
        .sampled_theta.values
    ):
        missing = np.isnan(row)
        assert (np.diff(missing.astype(int)) <= 0).all()  # nan first, then numbers
    started = stop_names(ensemble).values != "outside"
    there = np.isfinite(ensemble.sampled_theta.values).sum(axis=1)
    np.testing.assert_array_equal(
        there[started], np.maximum(np.ceil(ensemble.periods.values - 1e-9), 1)[started]
    )
    np.testing.assert_array_equal(ensemble.sampled_theta[started, -1], ensemble.theta[started])


@pytest.mark.parametrize(
    "span",
    [{"periods": 2}, {"duration": 2.0}, {"duration": 2.0 - 1e-15}, {"duration": 2.0 + 1e-15}],
)
def test_whole_periods_from_any_time_are_as_many_samples(span):
    for start in (-3.0, -1.0 + 1e-16, 0.0, 1.0 - 1e-16, 20.0, 0.3, 1e6 + 0.1):
        ensemble = saltus.simulate_many(
            System(
                model=Metainterface(beta0=1.4, damping=0.1),
                load=Load(frequency=2 * math.pi, horizontal=Harmonic(0.3)),
            ),
            theta=np.array([0.3, 0.1]),
            time=start,
            **span,
            sample=KINDS,
            last="all",
        )
        assert ensemble.sizes["period"] == 2
        np.testing.assert_allclose(ensemble.periods, 2, rtol=1e-9)
        assert not np.isnan(ensemble.sampled_theta).any()


def test_periods_are_counted_in_parts():
    system = attracted(1).system
    for periods in (0, 0.4, 1, 2.5, 3):
        ensemble = saltus.simulate_many(
            system, theta=0.3, time=np.array([0.0, 1.7, -4.0]), periods=periods, last="all"
        )
        np.testing.assert_allclose(ensemble.periods, periods, rtol=1e-14)
        assert ensemble.sizes["period"] == max(1, math.ceil(periods))
        np.testing.assert_array_equal(ensemble.sampled_theta[:, -1], ensemble.theta)


def test_a_resting_system_has_extrema_zero_and_no_speed():
    system = System(
        model=Metainterface(beta0=1.4),
        load=Load(frequency=1.0, horizontal=Harmonic(0.01), vertical=-0.5),
    )
    here = saltus.simulate_many(system, theta=0.0, periods=3, sample=KINDS, last="all")
    assert not here.largest_theta.any()
    assert not here.smallest_theta.any()
    assert np.isinf(here.least_speed).all()
    assert not here.period_impact_count.any()
    assert str(stop_names(here).values) == "rest"


# --- ending early ------------------------------------------------------------


def attracted(n, e=0.8, V=-0.5, damping=0.2):
    """Paper's system over a range of loads, from many states."""
    rng = np.random.default_rng(12)
    system = System(
        model=Metainterface(beta0=1.4, damping=damping),
        load=Load(frequency=1.0, horizontal=Harmonic(0.0), vertical=V),
        impact=VelocityReduction(e),
    )
    columns = {
        "load.horizontal.amplitude": rng.uniform(0.0, 1.0, n),
        "load.frequency": rng.uniform(0.5, 2.0, n),
    }
    return Cases(
        system,
        columns,
        {"theta": rng.normal(size=n)},
        rng.normal(size=n),
        np.zeros(n),
        {"periods": 200.0},
    )


@pytest.mark.parametrize("e", [0.8, 1.0])
def test_cycles_that_are_found_go_on_repeating_themselves(e):
    cases = attracted(60, e)
    ensemble = cases.in_lanes(until="settled", last=2, tol=1e-13)
    settled = np.flatnonzero(stop_names(ensemble).values == "settled")
    assert settled.size >= 10
    assert (ensemble.recurrence_period.values[settled] > 0).all()
    assert not ensemble.recurrence_period.values[np.setdiff1d(np.arange(60), settled)].any()
    for i in settled[:25]:
        system, _ = cases.one(i)
        state = {"theta": float(ensemble.theta[i]), "velocity": float(ensemble.velocity[i])}
        if float(ensemble.chatter_speed[i]) > 0:
            continue  # its phase is not known
        cycle = int(ensemble.recurrence_period[i])
        after = saltus.simulate(system, **state, periods=cycle, tol=1e-14, dense=False)
        assert abs(after.theta - state["theta"]) + abs(after.velocity - state["velocity"]) < 1e-8


def test_the_shortest_cycle_is_reported():
    cases, longer = attracted(60, 1.0), []
    ensemble = cases.in_lanes(until="settled", tol=1e-13)
    for i in np.flatnonzero(ensemble.recurrence_period.values > 1):
        system, _ = cases.one(i)
        state, cycle = (
            {"theta": float(ensemble.theta[i]), "velocity": float(ensemble.velocity[i])},
            int(ensemble.recurrence_period[i]),
        )
        for shorter in (q for q in range(1, cycle) if cycle % q == 0):
            other = saltus.simulate(system, **state, periods=shorter, tol=1e-14, dense=False)
            if abs(other.theta - state["theta"]) + abs(other.velocity - state["velocity"]) < 1e-6:
                longer.append((i, cycle, shorter))
    assert not longer


def test_chaos_does_not_settle():
    """Ueda's oscillator: where nearby motions separate by more than exp(0.05 t) from then on, no
    cycle is reported.
    """
    system = System(model=Duffing(damping=0.1), load=Load(frequency=1.0, force=Harmonic(1.0)))
    amplitude = {"load.force.amplitude": np.linspace(5.0, 60.0, 24)}
    ensemble = saltus.simulate_many(
        system, x=0.3, periods=300, parameters=amplitude, until="settled", tol=1e-10
    )
    ends = {"x": ensemble.x.values, "velocity": ensemble.velocity.values}  # chaos may pass
    tangent = saltus.simulate_many(
        system, **ends, periods=150, parameters=amplitude, sensitivities=(), tol=1e-10
    )
    exponent = np.log(np.abs(tangent.derivative.values).max(axis=(1, 2))) / tangent.time.values
    chaotic, settled = exponent > 0.05, stop_names(ensemble).values == "settled"
    assert chaotic.sum() >= 3
    assert settled.sum() >= 8
    assert not (chaotic & settled).any()


def test_what_is_captured_comes_to_rest_and_never_leaves():
    cases = attracted(150, 0.8)
    ensemble = cases.in_lanes(until="rest", tol=1e-12)
    captured = np.flatnonzero(stop_names(ensemble).values == "captured")
    assert captured.size >= 8
    for i in captured[:60]:
        system, _ = cases.one(i)
        motion = saltus.simulate(
            system,
            theta=float(ensemble.theta[i]),
            velocity=float(ensemble.velocity[i]),
            time=float(ensemble.time[i]),
            periods=25,
            dense=False,
        )
        assert motion.stop == "rest"
        assert not motion.events.of(saltus.EventKind.RELEASE)
    free = cases.in_lanes(tol=1e-12)
    assert (stop_names(free).values[captured] == "rest").all()
    others = np.setdiff1d(np.arange(150), captured)
    assert not (stop_names(ensemble).values[others] == "captured").any()
    np.testing.assert_array_equal(free.theta.values[others], ensemble.theta.values[others])


def test_nothing_is_captured_where_the_load_lifts_off():
    """Rest is left at every half wave where H sin(beta0) > abs(V) cos(beta0)."""
    system = System(
        model=Metainterface(beta0=1.4, damping=0.5),
        load=Load(frequency=0.05, horizontal=Harmonic(0.0), vertical=-0.5),
        impact=VelocityReduction(0.3),
    )
    border = 0.5 / math.tan(1.4)
    amplitude = border * np.array([0.9, 0.999, 1.001, 1.1])
    ensemble = saltus.simulate_many(
        system,
        theta=0.01,
        periods=3,
        parameters={"load.horizontal.amplitude": amplitude},
        until="rest",
    )
    assert stop_names(ensemble).values[0] == "captured"
    assert not (stop_names(ensemble).values[2:] == "captured").any()


def test_zero_time_keeps_the_state():
    system = attracted(1).system
    for span in ({"periods": 0}, {"duration": 0.0}):
        ensemble = saltus.simulate_many(
            system, theta=np.array([0.3, 0.0, -0.1]), velocity=np.array([0.1, 0.0, 0.0]), **span
        )
        np.testing.assert_array_equal(ensemble.theta, [0.3, 0.0, -0.1])
        np.testing.assert_array_equal(ensemble.velocity, [0.1, 0.0, 0.0])
        assert not ensemble.impact_count.any()
