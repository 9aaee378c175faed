"""Orbits of models that reset their state at events, beside closed forms and differences."""

import math

import pytest
from machines_with_memory import DrivenNeuron, RimlessWheel
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

import saltus
from saltus.systems import Harmonic, Load, System


def settled_speed(a, g):
    """The speed just after a strike of the cycle: w^2 = cos^2(2 a) (w^2 + 4 sin(g) sin(a))."""
    share = math.cos(2.0 * a) ** 2
    return math.sqrt(share * 4.0 * math.sin(g) * math.sin(a) / (1.0 - share))


def step_time(a, g):
    """How long the spoke turns from g - a to g + a, by the energy."""
    square = settled_speed(a, g) ** 2
    top = math.cos(g - a)
    run = solve_ivp(
        lambda angle, t: [1.0 / math.sqrt(square + 2.0 * (top - math.cos(angle)))],
        (g - a, g + a),
        [0.0],
        "DOP853",
        rtol=1e-13,
        atol=1e-14,
    )
    return run.y[0, -1]


def test_a_rimless_wheel_has_its_cycle_and_stands_still_where_the_slope_ends():
    a, g = 0.4, 0.1
    wheel = System(model=RimlessWheel(half_angle=a, slope=g))
    orbit = saltus.find_orbit(wheel, angle=g - a, velocity=0.5)
    assert orbit.period == pytest.approx(step_time(a, g), abs=1e-11)
    assert orbit.multipliers == pytest.approx([math.cos(2.0 * a) ** 2], abs=1e-10)
    assert orbit.stable
    branch = saltus.continue_orbit(orbit, "model.slope", (0.05, 0.2))
    # below it the spoke does not pass the vertical: w^2 = 2 (1 - cos(g - a))
    least = brentq(
        lambda slope: settled_speed(a, slope) ** 2 - 2.0 * (1.0 - math.cos(slope - a)), 0.01, 0.2
    )
    assert "its period grows without end" in str(branch.ends[0])
    assert branch.parameters.min() == pytest.approx(least, abs=1e-6)
    middle = branch.orbits[len(branch.orbits) // 2]
    slope = float(middle.system.model.slope)
    assert middle.period == pytest.approx(step_time(a, slope), abs=1e-9)


def test_a_neuron_without_input_has_a_cycle_and_no_multiplier():
    neuron = System(model=DrivenNeuron(), load=Load())
    orbit = saltus.find_orbit(neuron, u=0.0)
    assert orbit.period == pytest.approx(math.log(1.3 / 0.3), abs=1e-12)
    assert orbit.multipliers.size == 0
    assert orbit.stable
    assert "no multipliers" in repr(orbit)


def test_a_locked_neuron_has_the_multiplier_of_its_saltation():
    """exp(-T) times u' behind by u' before each spike."""
    frequency, size, drive = 4.3, 0.4, 1.3
    locked = System(
        model=DrivenNeuron(drive=drive), load=Load(frequency=frequency, input=Harmonic(size))
    )
    orbit = saltus.find_orbit(locked, u=0.2)
    times = [event.time for event in orbit.motion().events]
    expected = math.exp(-orbit.duration)
    for time in times:
        after = drive + size * math.sin(frequency * time)
        expected *= after / (after - 1.0)
    assert orbit.multipliers.real == pytest.approx([expected], rel=1e-9)
    branch = saltus.continue_orbit(orbit, "model.drive", (1.2, 1.4))
    folds = [point for point in branch.special if str(point.kind) == "LP"]
    assert all(abs(point.orbit.multipliers[0] - 1.0) < 1e-6 for point in folds)
