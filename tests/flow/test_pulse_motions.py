"""Motions under pulses: against Duhamel's integral, in lanes with a span of each, and the
overturning of a rigid block.
"""

import itertools
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import pytest
import xarray
from scipy.integrate import quad
from scipy.optimize import brentq

from saltus import (
    Chirp,
    HalfSine,
    MavroeidisPapageorgiou,
    OneContactModel,
    OneCosine,
    OneSine,
    Ramp,
    Ricker,
    simulate,
    simulate_many,
)
from saltus.errors import ParameterError
from saltus.flow import sensitivities
from saltus.orbits import find_orbit
from saltus.systems import Harmonic, Load, RockingBlock, System, VelocityReduction, WallOscillator

W = 2.3
PULSES = {
    "half sine": HalfSine(amplitude=0.7, frequency=W, start=0.4),
    "one sine": OneSine(amplitude=0.7, frequency=W, start=0.4),
    "one cosine": OneCosine(amplitude=0.7, frequency=W, start=0.4),
    "near fault": MavroeidisPapageorgiou(
        amplitude=0.7, frequency=W, gamma=2.3, phase=0.6, start=0.4
    ),
    "ricker": Ricker(amplitude=0.7, frequency=W, start=0.4),
    "ramp": Ramp(amplitude=0.7, duration=1.9, start=0.4),
    "chirp": Chirp(amplitude=0.7, frequency=W, end_frequency=5.1, duration=1.9, start=0.4),
}


def oscillator(*pulses, frequency=None):
    """A linear oscillator far from its wall under forces."""
    force = sum(pulses[1:], start=pulses[0])
    return System(
        model=WallOscillator(stiffness=1.3, damping=0.2, wall=1e3),
        load=Load(frequency=frequency, force=force),
    )


def duhamel(pulses, end, x=0.2, v=-0.3):
    """x and v of x'' + 0.2 x' + 1.3 x = f at `end`: the free motion and the convolution of f with
    the impulse response.
    """
    w = np.sqrt(1.3 - 0.01)

    def response(s):
        return np.exp(-0.1 * s) * np.sin(w * s) / w

    def rate(s):
        return np.exp(-0.1 * s) * (np.cos(w * s) - 0.1 * np.sin(w * s) / w)

    edges = sorted(
        {0.0, end, *(t for p in pulses for t in (p.start, p.start + p.length) if 0.0 < t < end)}
    )

    def of(kernel):
        def integrand(t):
            return kernel(end - t) * sum(float(p.derivative(t, None)) for p in pulses)

        parts = itertools.pairwise(edges)
        return sum(
            quad(integrand, a + 1e-14, b - 1e-14, epsabs=1e-13, limit=500)[0] for a, b in parts
        )

    free = x * rate(end) + (v + 0.2 * x) * response(end)
    free_rate = v * rate(end) - 1.3 * x * response(end)
    return free + of(response), free_rate + of(rate)


@pytest.mark.parametrize("name", PULSES)
@pytest.mark.parametrize("end", [1.1, 15.0])  # within the pulse, and after it
def test_motion_under_a_pulse_is_duhamels_integral(name, end):
    motion = simulate(oscillator(PULSES[name]), x=0.2, velocity=-0.3, duration=end)
    assert (motion.x, motion.velocity) == pytest.approx(duhamel([PULSES[name]], end), abs=2e-11)


def test_pulses_that_overlap_add_and_forcing_periods_change_nothing():
    pulses = [
        PULSES["one cosine"],
        Ramp(amplitude=-0.3, duration=0.7, start=1.1),
        PULSES["near fault"],
    ]
    expected = duhamel(pulses, 9.0)
    for system in (
        oscillator(*pulses),
        oscillator(*pulses, Harmonic(amplitude=0.0), frequency=3.1),
    ):
        motion = simulate(system, x=0.2, velocity=-0.3, duration=9.0)
        assert (motion.x, motion.velocity) == pytest.approx(expected, abs=2e-11)


def test_each_lane_has_the_span_of_its_own_pulse():
    system = oscillator(PULSES["one cosine"], PULSES["ramp"])
    rng = np.random.default_rng(5)
    names = (
        "load.force.0.start",
        "load.force.0.frequency",
        "load.force.1.start",
        "load.force.1.duration",
    )
    columns = {name: rng.uniform(0.2, 3.0, 37) for name in names}
    many = simulate_many(system, x=0.2, velocity=-0.3, duration=8.0, parameters=columns)
    for i in (0, 1, 7, 8, 20, 36):
        own = system.with_({name: float(column[i]) for name, column in columns.items()})
        expected = duhamel(own.load.channels["force"].terms, 8.0)
        assert (float(many.x[i]), float(many.velocity[i])) == pytest.approx(expected, abs=2e-11)


def test_lanes_of_blocks_under_pulses_are_the_single_motions():
    pulse = MavroeidisPapageorgiou(
        amplitude=0.2, frequency=3.0, gamma=1.6, phase=0.3, quantity="velocity"
    )
    system = System(
        model=RockingBlock(alpha=0.2),
        load=Load(ground_horizontal=pulse),
        impact=VelocityReduction(e=0.9),
    )
    starts, sizes = np.linspace(0.0, 4.0, 9), np.linspace(0.1, 0.4, 9)
    columns = {"load.ground_horizontal.start": starts, "load.ground_horizontal.amplitude": sizes}
    many = simulate_many(system, theta=0.05, duration=12.0, parameters=columns)
    for i in range(9):
        one = simulate(
            system.with_({path: float(column[i]) for path, column in columns.items()}),
            theta=0.05,
            duration=12.0,
        )
        assert float(many.theta[i]) == pytest.approx(one.theta, abs=1e-10)
        assert int(many.impact_count[i]) == len(one.impacts)


@pytest.mark.parametrize("start", [1.0, 1000.0])
@pytest.mark.parametrize("duration", [1e-3, 1e-6, 1e-9, 1e-12])
def test_a_short_ramp_is_a_step(start, duration):
    if start + duration == start:
        return
    load = Load(force=Ramp(amplitude=0.7, duration=duration, start=start))
    model = WallOscillator(stiffness=0.0, wall=1e9)
    system = System(model=model, load=load, impact=VelocityReduction())
    motion = simulate(system, x=0.0, duration=start + 10.0)
    # 0.7 for 10 units of time, less half of the ramp; its end is rounded to 2e-16 of the time
    exact = 0.7 * (10.0 - 0.5 * duration)
    assert motion.velocity == pytest.approx(exact, abs=1e-12 * max(1.0, start * 0.1), rel=0)
    assert load.force(start + 5.0) == 0.7


def test_no_motion_is_said_to_rest_for_ever_before_its_own_pulse():
    pulse = HalfSine(amplitude=0.4, frequency=3.0, quantity="acceleration", start=1.0)
    system = System(
        model=RockingBlock(alpha=0.2),
        load=Load(ground_horizontal=pulse),
        impact=VelocityReduction(e=0.5),
    )
    starts = np.array([1.0, 60.0, 61.0])
    many = simulate_many(
        system,
        theta=0.0,
        duration=80.0,
        parameters={"load.ground_horizontal.start": starts},
        until=["rest"],
    )
    assert (many.impact_count > 0).all()


def test_derivatives_to_the_numbers_of_a_pulse():
    system = oscillator(PULSES["near fault"])
    found = sensitivities(
        system,
        parameters=["load.force.amplitude", "load.force.phase"],
        x=0.2,
        velocity=-0.3,
        duration=9.0,
    )
    for j, path in enumerate(("load.force.amplitude", "load.force.phase")):
        value = float(system.get(path))
        ends = [
            simulate(system.with_({path: value + h}), x=0.2, velocity=-0.3, duration=9.0).x
            for h in (1e-4, -1e-4)
        ]
        assert found.parameters[0, j] == pytest.approx((ends[0] - ends[1]) / 2e-4, rel=1e-6)
    for path in ("load.force.start", "load.force.frequency", "load.force.gamma"):
        with pytest.raises(
            ParameterError, match=f"{path} moves the instants at which the load is not smooth"
        ):
            sensitivities(system, parameters=[path], x=0.2, duration=9.0)


def test_periodic_orbits_under_a_pulse_are_refused():
    with pytest.raises(ParameterError, match=r"not periodic|does not repeat"):
        find_orbit(oscillator(PULSES["ramp"], Harmonic(amplitude=0.2), frequency=1.0), x=0.1)


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


def test_half_sine_overturning_thresholds_of_a_rigid_block():
    """w sin(psi) = cos(psi) + exp(-(pi - psi) / w), sin(psi) = 1 / A."""
    rates = xarray.DataArray(np.array([0.3, 0.5, 0.8, 1.0, 1.5, 2.0, 3.0, 4.0, 6.0, 9.0]), dims="w")
    pulse = HalfSine(amplitude=1.0, frequency=1.0, quantity="acceleration")
    system = System(
        model=LinearBlock(), load=Load(ground_horizontal=pulse), impact=VelocityReduction(e=0.9)
    )
    low, high = xarray.ones_like(rates), 1.0 + 2.0 * rates
    share = xarray.DataArray(np.linspace(0.0, 1.0, 65), dims="share")
    for _ in range(4):
        sizes = low + (high - low) * share
        columns = {
            "load.ground_horizontal.amplitude": sizes,
            "load.ground_horizontal.frequency": rates,
        }
        overturned = simulate_many(system, theta=0.0, duration=60.0, parameters=columns).limit >= 0
        first = overturned.argmax("share")
        assert (first > 0).all()
        low, high = sizes.isel(share=first - 1), sizes.isel(share=first)
    for w, found in zip(rates.values, high.values, strict=True):
        psi = brentq(
            lambda psi, w=w: w * np.sin(psi) - np.cos(psi) - np.exp(-(np.pi - psi) / w),
            1e-6,
            np.pi / 2,
        )
        assert found == pytest.approx(1 / np.sin(psi), rel=1e-6)
