"""Signals and loads: values, derivatives, ends of records, and what is refused."""

import dataclasses
import math
import pickle

import numpy as np
import pytest
import sympy as sp
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import quad
from scipy.interpolate import CubicSpline

from saltus.errors import ParameterError
from saltus.systems import Constant, Harmonic, Load, Record, Sum, System

number = st.floats(-5, 5)
TIMES = np.array([0.5, 0.9, 1.6, 2.0, 3.1, 3.3])
VALUES = np.array([0.3, -1.0, 2.0, 0.0, 0.7, -0.2])
GROUND = ("displacement", "velocity", "acceleration")


@settings(deadline=None)
@given(number, number, number, st.integers(1, 5), st.floats(0.1, 5), st.floats(-10, 10))
def test_harmonic_and_its_derivatives_are_sympys(amplitude, mean, phase, order, omega, t):
    tau = sp.Symbol("tau")
    expression = mean + amplitude * sp.sin(order * omega * tau + phase)
    signal = Harmonic(amplitude, mean, phase, order)
    for n in (0, 1, 2):
        expected = float(sp.diff(expression, tau, n).subs(tau, t))
        assert signal.derivative(t, omega, n) == pytest.approx(
            expected, abs=1e-10 * (1 + (order * omega) ** n * 5)
        )


def test_the_papers_loads_are_written_as_its_equations():
    """(i) H sin(W tau), (iii) V = mean + amplitude cos(W tau): `loadpatha`, `loadpathb`."""
    omega, t = 1.3, np.linspace(0, 7, 15)
    first = Load(frequency=omega, horizontal=Harmonic(amplitude=0.5), vertical=-0.5)
    third = Load(
        frequency=omega,
        horizontal=Harmonic(amplitude=0.5),
        vertical=Harmonic(mean=-0.5, amplitude=0.25, phase=np.pi / 2),
    )
    assert first.horizontal(t) == pytest.approx(0.5 * np.sin(omega * t))
    assert first.vertical(t) == -0.5
    assert third.vertical(t) == pytest.approx(-0.5 + 0.25 * np.cos(omega * t))
    assert first.period == pytest.approx(2 * math.pi / omega)
    assert first.ground_vertical(t) == first.ground_vertical.acceleration(t) == 0.0


@settings(deadline=None)
@given(
    st.lists(st.tuples(number, number, st.integers(1, 4)), min_size=1, max_size=4),
    number,
    st.floats(0, 9),
)
def test_a_sum_is_the_sum_of_its_terms(terms, constant, t):
    signals = [Harmonic(a, phase=p, order=n) for a, p, n in terms]
    total = signals[0]
    for signal in signals[1:]:
        total = total + signal
    total = constant + (total + 0.5)
    assert isinstance(total, Sum)
    for n in (0, 1, 2):
        expected = sum(s.derivative(t, 1.1, n) for s in signals) + (constant + 0.5 if n == 0 else 0)
        assert total.derivative(t, 1.1, n) == pytest.approx(expected, abs=1e-9)


def test_a_force_record_is_linear_between_samples_and_zero_outside():
    record = Record(TIMES, VALUES, scale=2.0)
    t = np.linspace(0.5, 3.3, 200)
    assert record.derivative(t, None) == pytest.approx(2 * np.interp(t, TIMES, VALUES), abs=1e-14)
    assert record.derivative(1.0, None, 1) == pytest.approx(2 * 3.0 / 0.7)
    for outside in (0.49, 3.31, -100.0, 100.0):
        assert record.derivative(outside, None) == 0.0
    assert isinstance(record.derivative(1.0, None), float)


@pytest.mark.parametrize("quantity", GROUND)
def test_a_ground_record_gives_back_its_samples_and_its_derivatives_are_consistent(quantity):
    record = Record(TIMES, VALUES, quantity=quantity, scale=0.5)
    order = GROUND.index(quantity)
    assert record.derivative(TIMES, None, order) == pytest.approx(0.5 * VALUES, abs=1e-13)
    for n in (0, 1):  # each derivative integrates to the one before
        for a, b in ((0.6, 1.4), (1.0, 3.2)):
            breaks = TIMES[(a < TIMES) & (b > TIMES)]
            area, _ = quad(
                lambda x, n=n: record.derivative(x, None, n + 1),
                a,
                b,
                points=list(breaks),
                epsabs=1e-12,
            )
            change = record.derivative(b, None, n) - record.derivative(a, None, n)
            assert change == pytest.approx(area, abs=1e-10)


def test_a_displacement_record_is_a_cubic_spline_with_continuous_acceleration():
    record = Record(TIMES, VALUES, quantity="displacement")
    spline = CubicSpline(TIMES, VALUES)
    t = np.linspace(0.5, 3.3, 101)
    for n in (0, 1, 2):
        assert record.derivative(t, None, n) == pytest.approx(spline(t, n), abs=1e-12)
    for sample in TIMES[1:-1]:
        left, right = (record.derivative(sample + d, None, 2) for d in (-1e-9, 1e-9))
        assert left == pytest.approx(right, abs=1e-5)


def test_an_acceleration_record_starts_from_rest_and_integrates_exactly():
    """Constant acceleration 2 over [1, 2, 4]: velocity 2 (t - 1), displacement (t - 1)^2."""
    record = Record([1.0, 2.0, 4.0], [2.0, 2.0, 2.0], quantity="acceleration")
    t = np.linspace(1, 4, 31)
    assert record.derivative(t, None, 1) == pytest.approx(2 * (t - 1), abs=1e-14)
    assert record.derivative(t, None, 0) == pytest.approx((t - 1) ** 2, abs=1e-13)


@pytest.mark.parametrize("quantity", GROUND)
def test_outside_its_samples_the_ground_moves_on_at_constant_velocity(quantity):
    record = Record(TIMES, VALUES, quantity=quantity)
    for end, step in ((TIMES[0], -0.75), (TIMES[-1], 0.75)):
        velocity = record.derivative(end, None, 1)
        assert record.derivative(end + step, None, 2) == 0.0
        assert record.derivative(end + step, None, 1) == pytest.approx(velocity)
        expected = record.derivative(end, None, 0) + step * velocity
        assert record.derivative(end + step, None, 0) == pytest.approx(expected, abs=1e-12)


def test_records_keep_their_own_copy_and_compare_by_value():
    times, values = TIMES.copy(), VALUES.copy()
    record = Record(times, values)
    values[0] = 99.0
    assert record.value[0] == VALUES[0]
    with pytest.raises(ValueError, match="read-only"):
        record.value[0] = 1.0
    same = Record(list(TIMES), list(VALUES), source="quake.csv")
    assert record == same
    assert hash(record) == hash(same)
    assert record != Record(TIMES, VALUES, scale=2.0)
    assert pickle.loads(pickle.dumps(record)) == record


@pytest.mark.parametrize(
    ("time", "value", "options", "message"),
    [
        (
            [0, 2, 1],
            [0, 0, 0],
            {},
            r"record: times must increase, but sample 2 has 1 after 2; sort the file",
        ),
        ([0, 1, 1], [0, 0, 0], {}, "sample 2 has 1 after 1"),
        ([0], [1], {}, "a record of force needs at least 2 samples, got 1"),
        (
            [0, 1, 2],
            [0, 0, 0],
            {"quantity": "velocity"},
            "a record of velocity needs at least 4 samples, got 3",
        ),
        ([0, 1, 2], [0, math.nan, 0], {}, "sample 1 is not a finite number"),
        (
            [0, math.inf, 2],
            [0, 1, 0],
            {"source": "q.csv"},
            "record 'q.csv': sample 1 is not a finite number",
        ),
        ([0, 1, 2], [0, 1], {}, "time and value must have one length, got 3 and 2"),
        ([[0, 1]], [[0, 1]], {}, "time must be a list of numbers"),
        (["a", "b"], [0, 1], {}, "time must be a list of numbers"),
        ([0, 1], [0, 1], {"quantity": "speed"}, "quantity must be one of force, displacement"),
        ([0, 1], [0, 1], {"scale": math.nan}, "scale must be finite, got nan"),
    ],
)
def test_impossible_records_are_refused_in_a_sentence(time, value, options, message):
    with pytest.raises(ParameterError, match=message):
        Record(time, value, **options)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Harmonic(math.nan), "amplitude must be finite, got nan"),
        (lambda: Harmonic(1.0, phase=math.inf), "phase must be finite"),
        (lambda: Harmonic(1.0, order=1.5), "order must be a whole number, got 1.5"),
        (lambda: Harmonic(1.0, order=0), "order"),
        (lambda: Harmonic(1.0, order=True), "order"),
        (lambda: Harmonic("0.5"), "amplitude must be"),
        (lambda: Sum(()), "a Sum needs signals"),
        (lambda: Sum(0.5), "a Sum needs signals"),
        (lambda: Load(force=[]), "load.force is an empty list"),
        (lambda: Load(force=[0.5, [Harmonic]]), "load.force.1.0 must be a number, a Harmonic"),
        (
            lambda: Record([-1e308, 1e308], [0.0, 1.0]),
            r"times and values must be at most 1e\+100 in size, got 1e\+308",
        ),
        (lambda: Record([0.0, 1e-320], [0.0, 1e10]), "samples 0 and 1 are too near in time"),
        (
            lambda: Load(horizontal=Harmonic(0.5)),
            "load.horizontal repeats itself, so load.frequency must be given",
        ),
        (lambda: Load(horizontal=0.5 + Harmonic(0.5)), "load.horizontal repeats itself"),
        (lambda: Load(frequency=0.0), r"load.frequency must lie in \(0, inf\), got 0.0"),
        (lambda: Load(frequency=-1.0), "load.frequency"),
        (lambda: Load(vertical=math.nan), "load.vertical must be finite, got nan"),
        (lambda: Load(vertical="-0.5"), "load.vertical must be"),
        (
            lambda: Load(horizontal=Record(TIMES, VALUES, "velocity")),
            "load.horizontal takes a record of force",
        ),
        (
            lambda: Load(ground_vertical=Record(TIMES, VALUES)),
            "load.ground_vertical takes a record of displacement, velocity",
        ),
        (
            lambda: Load(ground_vertical=Record(TIMES, VALUES) + 0.1),
            "load.ground_vertical takes a record",
        ),
    ],
)
def test_impossible_signals_and_loads_are_refused_in_a_sentence(make, message):
    with pytest.raises(ParameterError, match=message):
        make()


@pytest.mark.parametrize("order", ["1", None, math.nan, math.inf, [1]])
def test_an_order_that_is_no_number_is_refused_in_a_sentence(order):
    with pytest.raises(ParameterError, match=r"order must (be a whole number|lie in)"):
        Harmonic(1.0, order=order)


def test_a_load_is_frozen():
    load = Load(vertical=-0.5)
    with pytest.raises(dataclasses.FrozenInstanceError):
        load.vertical = 1.0
    assert load == Load(vertical=Constant(-0.5))
    assert hash(load) == hash(Load(vertical=-0.5))
    assert eval(repr(load)) == load
    assert pickle.loads(pickle.dumps(load)) == load


def test_a_list_is_the_sum_of_its_entries_however_they_are_nested():
    base, second, gust = (
        Harmonic(0.5),
        Harmonic(0.1, order=2),
        Record([0.0, 1.0, 2.0], [0.0, 3.0, 0.0]),
    )
    total = base + second + 0.25 + gust
    for nested in (
        [base, second, 0.25, gust],
        (base, [second, [0.25, gust]]),
        [[base + second], [[0.25]], gust],
    ):
        assert Load(frequency=1.0, force=nested) == Load(frequency=1.0, force=total)
    load = Load(frequency=1.0, force=[base, 0.25])
    assert load.force(0.7) == base.derivative(0.7, 1.0) + 0.25


def test_a_list_in_a_list_on_a_ground_channel_is_read():
    ground = {"time": [0, 1, 2], "value": [0, 0.1, 0], "quantity": "acceleration"}
    data = {
        "model": {"type": "RockingBlock", "alpha": 0.2},
        "load": {"ground_horizontal": [[ground]]},
    }
    assert (
        System.from_dict(data).load.channels["ground_horizontal"].terms[0].quantity
        == "acceleration"
    )
    wrong = {**data, "load": {"ground_horizontal": [[{**ground, "quantity": "force"}]]}}
    with pytest.raises(
        ParameterError,
        match=r"load\.ground_horizontal takes a record of displacement, velocity or acceleration",
    ):
        System.from_dict(wrong)
