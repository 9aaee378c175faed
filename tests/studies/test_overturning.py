"""Overturning: borders against closed forms of the slender, linear block and DOP853 for the
nonlinear one, and fragility.
"""

import math
from dataclasses import dataclass
from functools import cache
from typing import ClassVar

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

import saltus
from saltus import HalfSine, OneContactModel, OneSine, Ramp
from saltus.errors import ParameterError
from saltus.systems import Load, Record, RockingBlock, System, VelocityReduction

E = 0.9


@dataclass(frozen=True, kw_only=True)
class LinearBlock(OneContactModel):
    """A slender rocking block for small angles over its slenderness: theta'' = -zeta'' - s (1 - s
    theta).
    """

    channels: ClassVar[tuple[str, ...]] = ("ground_horizontal",)
    stops: ClassVar[tuple[str, ...]] = ("overturned",)

    def acceleration(self, t, theta, velocity, side, load):
        return -load.ground_horizontal.acceleration(t) - side * (1 - side * theta)

    def margins(self, t, theta, velocity, acceleration, side, load):
        return {"overturned": 3.0 - side * theta}


def shaken(pulse=HalfSine, model=None, **more):
    signal = pulse(amplitude=1.0, frequency=1.0, quantity="acceleration", **more)
    return System(
        model=model or LinearBlock(),
        load=Load(ground_horizontal=signal),
        impact=VelocityReduction(E),
    )


def growth(A, w, impacts, halves):
    """(theta - s) + theta' after `impacts`, when the sine is over: the part of the linear motion
    that grows as exp(tau).

    On the side s the motion is s + C exp(tau) + D exp(-tau) + A / (1 + w^2) sin(w tau) during the
    pulse, from theta = theta' = 0 where A sin(w tau) = 1, with s = -1.
    """
    end, force = halves * math.pi / w, A / (1 + w * w)

    def go(state, since, to, side, on):
        f, rate = (
            (force * math.sin(w * since), force * w * math.cos(w * since)) if on else (0.0, 0.0)
        )
        x, v = state[0] - side - f, state[1] - rate
        plus, minus = 0.5 * (x + v) * math.exp(to - since), 0.5 * (x - v) * math.exp(since - to)
        g, gate = (force * math.sin(w * to), force * w * math.cos(w * to)) if on else (0.0, 0.0)
        return side + plus + minus + g, plus - minus + gate

    def height(t, state, since, side, on):
        return go(state, since, t, side, on)[0]

    since, state, side = math.asin(1 / A) / w, (0.0, 0.0), -1
    for _ in range(impacts):
        for on, last in ((True, end), (False, end + 40.0)):
            if since >= last:
                continue
            times = np.linspace(since + 1e-9, last, 4001)
            values = [side * go(state, since, t, side, on)[0] for t in times]
            below = next((i for i in range(1, len(times)) if values[i - 1] > 0 >= values[i]), None)
            if below is not None:
                at = brentq(
                    height,
                    times[below - 1],
                    times[below],
                    args=(state, since, side, on),
                    xtol=1e-15,
                )
                state, since, side = (0.0, E * go(state, since, at, side, on)[1]), at, -side
                break
            state, since = go(state, since, last, side, on), last
        else:
            return math.nan
    if since < end:
        state = go(state, since, end, side, True)
    return state[0] - side + state[1]


@cache
def linear(pulse):
    return saltus.overturning_spectrum(
        shaken(pulse), amplitude=np.linspace(1.0, 6.0, 11), frequency=np.linspace(1.5, 4.0, 6)
    )


@pytest.mark.parametrize(
    ("pulse", "impacts"),
    [(HalfSine, 0), pytest.param(OneSine, 0, marks=pytest.mark.thorough), (OneSine, 1)],
)
def test_borders_of_the_linear_block_are_those_of_the_closed_form(pulse, impacts):
    """Zhang and Makris (2001), Dimitrakopoulos and DeJong (2012): overturning without an impact and
    after one.
    """
    data = linear(pulse)
    own = data.border_impacts.values == impacts
    w, found = data.border_frequency.values[own], data.border_amplitude.values[own]
    assert own.sum() > 10
    for i in range(0, own.sum(), 5):
        near = found[i] * (1 - 1e-6), found[i] * (1 + 1e-6)
        exact = brentq(
            lambda A, i=i: growth(A, w[i], impacts, 1 if pulse is HalfSine else 2),
            *near,
            xtol=1e-14,
        )
        assert found[i] == pytest.approx(exact, rel=1e-8)
    # in closed form: w sin(psi) = cos(psi) + exp(-(pi - psi) / w), sin(psi) = 1 / A
    if pulse is HalfSine:
        psi = np.arcsin(1 / found)
        assert w * np.sin(psi) == pytest.approx(np.cos(psi) + np.exp(-(np.pi - psi) / w), abs=1e-9)


def test_the_map_changes_across_the_borders_alone():
    """Along each column, what overturns and what does not are parted by as many borders as the map
    has changes, or more.
    """
    data = linear(OneSine)
    for i, w in enumerate(data.frequency.values):
        changes = np.flatnonzero(np.diff((data.overturned[i] != 0).astype(int)))
        for k in changes:
            low, high = data.amplitude.values[k], data.amplitude.values[k + 1]
            near = np.abs(data.border_frequency - w) < 0.25
            crossing = data.border_amplitude[
                near & (data.border_amplitude > low - 0.5) & (data.border_amplitude < high + 0.5)
            ]
            assert crossing.size > 0


@pytest.mark.thorough
def test_a_border_of_the_nonlinear_block_is_where_dop853_changes_its_mind():
    alpha = 0.3
    system = shaken(OneSine, RockingBlock(alpha=alpha))
    data = saltus.overturning_spectrum(
        system, amplitude=np.linspace(0.2, 2.0, 10), frequency=np.linspace(1.0, 4.0, 7)
    )
    assert set(data.border_impacts.values.tolist()) >= {0, 1}

    def falls(A, w):
        """The side to which the block falls, by DOP853 and the impact law, or 0."""
        length, begin, side, state = (
            2 * math.pi / w,
            math.asin(math.tan(alpha) / A) / w,
            -1,
            [0.0, 0.0],
        )
        while begin < length + 25.0:

            def rates(t, x, side=side):
                ground = A * math.sin(w * t) if t < length else 0.0
                return [
                    x[1],
                    -ground * math.cos(alpha - side * x[0]) - side * math.sin(alpha - side * x[0]),
                ]

            def contact(t, x, side=side, begin=begin):
                return side * x[0] if t > begin + 1e-5 else 1.0

            def down(t, x, side=side):
                return math.pi / 2 - side * x[0]

            contact.terminal = down.terminal = True
            last = length if begin < length else length + 25.0
            found = solve_ivp(
                rates,
                (begin, last),
                state,
                "DOP853",
                rtol=1e-11,
                atol=1e-12,
                events=(contact, down),
            )
            begin, state = found.t[-1], list(found.y[:, -1])
            if found.t_events[1].size:
                return side
            if found.t_events[0].size:
                state, side = [0.0, E * state[1]], -side
                if abs(state[1]) < 1e-2:
                    return 0
        return 0

    for impacts in (0, 1):
        rows = np.flatnonzero(data.border_impacts.values == impacts)
        for k in rows[len(rows) // 3 :: len(rows) // 2][:2]:
            A, w = float(data.border_amplitude[k]), float(data.border_frequency[k])
            beside = {falls(A * (1 + shift), w) for shift in (-1e-6, 1e-6)}
            assert len(beside) == 2
            assert int(data.border_side[k]) in beside


def test_a_record_of_the_same_shape_has_nearly_the_same_borders():
    """A half sine in 400 linear pieces: its thresholds are those of the pulse to the square of the
    step.
    """
    time = np.linspace(0.0, np.pi, 401)
    record = Record(time, np.sin(time), quantity="acceleration")
    system = System(
        model=LinearBlock(), load=Load(ground_horizontal=record), impact=VelocityReduction(E)
    )
    data = saltus.overturning_spectrum(
        system, amplitude=np.linspace(1.0, 9.0, 9), frequency=[1.0, 2.0]
    )
    for w in (1.0, 2.0):
        own = (data.border_frequency == w) & (data.border_impacts == 0)
        psi = brentq(
            lambda psi, w=w: w * np.sin(psi) - np.cos(psi) - np.exp(-(np.pi - psi) / w),
            1e-6,
            np.pi / 2,
        )
        assert data.border_amplitude[own].values.max() == pytest.approx(1 / np.sin(psi), rel=2e-5)


def test_a_factor_of_a_record_is_the_same_in_the_spectrum_in_fragility_and_in_ensembles():
    """Whatever scale the record has in the system, as SI records of a block have 1 / g."""
    time = np.linspace(0.0, 2.0, 41)
    record = Record(time, np.sin(np.pi * time), quantity="acceleration")
    factors = np.array([1.0, 2.0, 4.0, 8.0, 16.0])
    body = saltus.PhysicalBlock(half_width=0.2, half_height=0.8)
    block = body.system(Load(ground_horizontal=record))
    scale = block.get("load.ground_horizontal.scale")
    assert scale != 1.0
    data = saltus.overturning_spectrum(block, amplitude=factors, frequency=[0.9, 1.0], curves=False)
    own = data.overturned.sel(frequency=1.0).values
    np.testing.assert_array_equal(own, saltus.fragility([block], factors).overturned.values[0])
    ends = saltus.simulate_many(
        block,
        theta=0.0,
        duration=2.0 * body.frequency + 60.0,
        parameters={"load.ground_horizontal.scale": scale * factors},
    )
    np.testing.assert_array_equal(own != 0, saltus.stop_names(ends).values == "limit")
    assert 0 < np.count_nonzero(own) < factors.size
    # a record that is written twice as large overturns at half of the factor
    twice = block.with_({"load.ground_horizontal.scale": 2.0 * scale})
    again = saltus.overturning_spectrum(
        twice, amplitude=factors / 2.0, frequency=[0.9, 1.0], curves=True
    )
    np.testing.assert_array_equal(again.overturned.values, data.overturned.values)
    borders = saltus.overturning_spectrum(block, amplitude=factors, frequency=[0.9, 1.0])
    np.testing.assert_allclose(
        again.border_amplitude, borders.border_amplitude.values / 2.0, rtol=1e-12
    )
    assert borders.amplitude.attrs["long_name"].startswith("factor of the record")
    # borders after many impacts have one row of the legend
    labels = [text.get_text() for text in saltus.plot(borders).figure.legends[0].get_texts()]
    assert len(labels) == len(set(labels)) <= 6


def test_a_pulse_of_a_physical_block_has_its_amplitude_over_g_and_its_frequency_over_p():
    """A point of the map overturns where the motion under the same pulse in SI units does."""
    body = saltus.PhysicalBlock(half_width=0.2, half_height=0.8)

    def shaken(amplitude, frequency):  # m/s^2, rad/s
        pulse = saltus.HalfSine(amplitude=amplitude, frequency=frequency, quantity="acceleration")
        return body.system(Load(ground_horizontal=pulse))

    amplitude, frequency = np.linspace(2.0, 12.0, 6), np.array([4.0, 8.0])
    data = saltus.overturning_spectrum(
        shaken(1.0, 4.0),
        amplitude=amplitude / body.gravity,
        frequency=frequency / body.frequency,
        curves=False,
    )
    fallen = [
        [saltus.simulate(shaken(a, w), theta=0.0, duration=60.0).stop == "limit" for a in amplitude]
        for w in frequency
    ]
    np.testing.assert_array_equal(data.overturned.values != 0, fallen)
    assert 0 < np.count_nonzero(fallen) < data.overturned.size
    assert "of a PhysicalBlock" in data.frequency.attrs["long_name"]
    axes = saltus.plot(data)
    assert axes.get_xlabel().count("/ p") == axes.get_ylabel().count("/ g") == 1


def test_fragility_is_the_share_of_loads_with_its_interval():
    """Pulses whose thresholds are known: the share is that of the thresholds below each scale, the
    interval Wilson's.
    """
    rates = np.array([1.0, 2.0, 3.0, 4.0])

    def threshold(w):
        psi = brentq(
            lambda psi: w * np.sin(psi) - np.cos(psi) - np.exp(-(np.pi - psi) / w), 1e-6, np.pi / 2
        )
        return 1 / np.sin(psi)

    known = np.array([threshold(w) for w in rates])
    systems = [shaken().with_({"load.ground_horizontal.frequency": float(w)}) for w in rates]
    scales = np.sort(np.concatenate([known * (1 - 1e-4), known * (1 + 1e-4)]))
    data = saltus.fragility(systems, scales)
    again = data.overturned.values != 0
    assert (again.sum(axis=0) / 4 == data.share.values).all()
    above = scales[None, :] > known[:, None]
    assert again[above].all()  # beyond the threshold without an impact, pulses go on to overturn
    z, n, p = 1.959963984540054, 4, data.share.values
    middle, half = (
        (p + z * z / (2 * n)) / (1 + z * z / n),
        z / (1 + z * z / n) * np.sqrt(p * (1 - p) / n + z * z / (4 * n * n)),
    )
    np.testing.assert_allclose(
        [data.lower, data.upper],
        [np.maximum(middle - half, 0), np.minimum(middle + half, 1)],
        atol=2e-5,
    )


@pytest.mark.parametrize(
    ("system", "problem"),
    [
        (System(model=RockingBlock(alpha=0.2)), "needs a load with one pulse or record"),
        (
            System(
                model=LinearBlock(),
                load=Load(
                    ground_horizontal=Ramp(amplitude=1.0, duration=1.0, quantity="acceleration")
                ),
            ),
            "a Ramp has no frequency",
        ),
        (
            System(
                model=saltus.WallOscillator(),
                load=Load(force=HalfSine(amplitude=1.0, frequency=1.0)),
            ),
            "WallOscillator cannot overturn",
        ),
    ],
)
def test_what_cannot_overturn_is_refused(system, problem):
    with pytest.raises(ParameterError, match=problem):
        saltus.overturning_spectrum(system, amplitude=[1.0, 2.0], frequency=[1.0, 2.0])


def test_axes_and_lists_without_meaning_are_refused():
    with pytest.raises(ParameterError, match="amplitude must be two or more numbers above 0"):
        saltus.overturning_spectrum(shaken(), amplitude=[0.0, 2.0], frequency=[1.0, 2.0])
    with pytest.raises(ParameterError, match="systems must be a list of systems"):
        saltus.fragility(shaken(), [1.0])
