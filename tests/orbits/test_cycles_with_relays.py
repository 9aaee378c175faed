"""Orbits of models with relays, whose sides are remembered, beside closed forms and DOP853."""

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import pytest
from machines_with_memory import PushedServo, ThermostatInWeather
from scipy.integrate import solve_ivp
from scipy.optimize import brentq, fsolve

import saltus
from saltus import Relay
from saltus.errors import MotionError, ParameterError
from saltus.systems import ContactModel, Harmonic, Load, System


@dataclass(frozen=True, kw_only=True)
class AntiWindup(ContactModel):
    """An integrator that is held at 1 as long as its input pushes on."""

    bias: float = 0.3

    coordinates: ClassVar[tuple[str, ...]] = ("out",)
    first_order: ClassVar[tuple[str, ...]] = ("out",)
    channels: ClassVar[tuple[str, ...]] = ("input",)
    surfaces: ClassVar[tuple[Relay, ...]] = (Relay(name="held", on="full", off="falls"),)

    def full(self, t, out, velocity, load):
        return out - 1.0

    def falls(self, t, out, velocity, load):
        return -load.input(t) - self.bias

    def force(self, t, out, velocity, load, sides):
        return (load.input(t) + self.bias) * (1.0 - sides.held) / 2.0


FREE = 10.0 * math.log(21.0 / 19.0) + 10.0 * math.log(11.0 / 9.0)  # the thermostat's own period


def cycle_of_room(below, above):
    """On: 40 - (40 - T) exp(-t / 10); off: 10 + (T - 10) exp(-t / 10)."""
    heating = math.log((40.0 - below) / (40.0 - above))
    return 10.0 * (heating + math.log((above - 10.0) / (below - 10.0)))


def half_of_servo(width):
    """tau - 2 tanh(tau / 2) = 2 h: in the half period tau the speed goes from tanh(tau / 2) to minus
    that, and y from h to -h."""
    return brentq(lambda tau: tau - 2.0 * math.tanh(0.5 * tau) - 2.0 * width, 1e-9, 100.0)


def test_a_thermostat_has_its_cycle_and_its_branch_over_a_threshold():
    room = System(model=ThermostatInWeather(), load=Load())
    orbit = saltus.find_orbit(room, T=20.0, relays={"heater": True})
    assert orbit.period == pytest.approx(FREE, abs=1e-12)
    assert orbit.multipliers.size == 0
    assert orbit.stable
    assert orbit.defect < 1e-12
    again = saltus.find_orbit(room, **orbit.start())
    assert again.period == pytest.approx(FREE, abs=1e-12)
    branch = saltus.continue_orbit(orbit, "model.above", (18.5, 41.0))
    for at in branch.orbits:
        above = float(at.system.model.above)
        # near 40 it takes rounding by the distance from 40
        accuracy = 1e-11 + 1e-13 / (40.0 - above)
        assert at.period == pytest.approx(cycle_of_room(19.0, above), abs=accuracy)
    low, high = map(str, branch.ends)
    assert low.startswith("at 19 the two functions of a relay meet")
    assert high.startswith("its period grows without end at 40,")


def test_a_servo_has_its_limit_cycle_over_the_width_of_its_hysteresis():
    orbit = saltus.find_orbit(System(model=PushedServo(), load=Load()), y=0.5)
    assert orbit.period == pytest.approx(2.0 * half_of_servo(0.2), abs=1e-12)
    # each half multiplies deviations by exp(-tau)
    assert orbit.multipliers == pytest.approx([math.exp(-orbit.period)], abs=1e-12)
    branch = saltus.continue_orbit(orbit, "model.width", (-0.1, 2.0))
    for at in branch.orbits:
        width = float(at.system.model.width)
        # the period is as the third root of the width
        accuracy = 1e-11 + 1e-15 * width ** (-2.0 / 3.0)
        assert at.period == pytest.approx(2.0 * half_of_servo(width), abs=accuracy)
        assert at.multipliers.real == pytest.approx([math.exp(-at.period)], abs=1e-9)
    assert "the two functions of a relay meet" in str(branch.ends[0])
    assert branch.ends[0].parameter == pytest.approx(0.0, abs=1e-9)


def test_a_branch_with_relays_is_read_from_its_dataset():
    saltus.register(PushedServo)
    orbit = saltus.find_orbit(System(model=PushedServo(), load=Load()), y=0.5)
    branch = saltus.continue_orbit(orbit, "model.width", (0.1, 0.3))
    read = saltus.orbits.orbits_of(branch.to_xarray())
    assert [at.signature for at in read] == [at.signature for at in branch.orbits]
    assert {at.signature.relays for at in read} <= {(1,), (-1,)}
    assert [at.period for at in read] == [at.period for at in branch.orbits]


def test_a_room_that_is_locked_to_the_weather_has_the_multiplier_of_its_saltation():
    """exp(-t / 10) times T' behind by T' before each switching."""
    frequency = 1.02 * 2.0 * math.pi / FREE
    room = System(
        model=ThermostatInWeather(), load=Load(frequency=frequency, weather=Harmonic(0.3))
    )
    orbit = saltus.find_orbit(room, T=18.0)
    assert orbit.period == 1
    expected = math.exp(-0.1 * orbit.duration)
    motion = orbit.motion()
    for event in motion.events:
        cold = abs(motion.at(event.time)[0] - 19.0) < 1e-9
        without = -0.1 * ((19.0 if cold else 21.0) - 10.0) + 0.3 * math.sin(frequency * event.time)
        expected *= (without + 3.0) / without if cold else without / (without + 3.0)
    assert len(motion.events) == 2
    assert orbit.multipliers.real == pytest.approx([expected], rel=1e-10)


def test_a_relay_that_turns_ends_a_branch():
    """Of two periods of the weather the room is heated in one; with more weather it comes to 19 in
    the other one too, where T' = 0."""
    frequency = 2.04 * 2.0 * math.pi / FREE
    room = System(
        model=ThermostatInWeather(), load=Load(frequency=frequency, weather=Harmonic(0.3))
    )
    orbit = saltus.find_orbit(room, T=18.0)
    assert orbit.period == 2
    assert orbit.signature.relays == (-1,)
    branch = saltus.continue_orbit(orbit, "load.weather.amplitude", (0.2, 3.0))
    last = branch.orbits[-1]
    assert "the relay has its other side at the end of the round" in str(branch.ends[1])
    motion = last.motion()
    times = np.linspace(motion.start, motion.time, 4001)
    place = motion.at(times)[0]
    low = [
        i
        for i in range(1, 4000)
        if place[i] < min(place[i - 1], place[i + 1]) and 18.99 < place[i] < 19.01
    ]
    assert len(low) == 1
    near = np.linspace(times[low[0] - 1], times[low[0] + 1], 4001)
    assert motion.at(near)[0].min() == pytest.approx(19.0, abs=1e-6)


def test_a_start_that_ends_its_round_on_the_other_side_is_refused():
    frequency = 2.0 * 2.0 * math.pi / FREE
    room = System(
        model=ThermostatInWeather(), load=Load(frequency=frequency, weather=Harmonic(0.01))
    )
    sentence = "the relay 'heater' is off at the start of a round .* and on at its end"
    with pytest.raises(MotionError, match=sentence):
        saltus.find_orbit(room, T=21.0, relays={"heater": False}, settle=0, period=1)
    with pytest.raises(ParameterError, match="does not say whether the relay 'heater' is on"):
        saltus.find_orbit(room, T=20.0)


def test_an_integrator_at_its_limit_forgets_its_start():
    """It leaves 1 where sin t + b falls below 0, and falls by the integral of that."""
    bias = 0.3
    limited = System(model=AntiWindup(bias=bias), load=Load(frequency=1.0, input=Harmonic(1.0)))
    orbit = saltus.find_orbit(limited, out=0.5, relays={"held": False})
    turn = math.asin(bias)
    fall = 2.0 * math.cos(turn) - bias * (math.pi - 2.0 * turn)
    assert orbit.multipliers == pytest.approx([0.0], abs=1e-12)
    assert orbit.extrema[0] == pytest.approx([1.0 - fall, 1.0], abs=1e-11)
    branch = saltus.continue_orbit(orbit, "model.bias", (0.1, 1.5))
    assert branch.parameters.max() == pytest.approx(1.0, abs=1e-6)  # it is never left beyond


def driven_map(width, frequency, size, start, relay, period):
    """The state of the driven servo after a time, by DOP853 with the relay as a state machine."""
    t, state = 0.0, np.array(start, dtype=float)
    while t < period:

        def threshold(t, x, relay=relay):
            return x[0] - width if relay < 0 else -width - x[0]

        threshold.terminal = True
        threshold.direction = 1.0
        run = solve_ivp(
            lambda t, x, relay=relay: [x[1], size * math.sin(frequency * t) - x[1] - relay],
            (t, period),
            state,
            "DOP853",
            events=threshold,
            rtol=1e-13,
            atol=1e-14,
            max_step=0.1,
        )
        t, state = run.t[-1], run.y[:, -1]
        relay = -relay if run.status == 1 else relay
    return state, relay


def test_a_driven_servo_is_that_of_dop853():
    """The fixed point of the map over a period, and the eigenvalues of its differences."""
    width, size = 0.2, 0.4
    frequency = 1.05 * math.pi / half_of_servo(width)
    driven = System(
        model=PushedServo(width=width), load=Load(frequency=frequency, push=Harmonic(size))
    )
    orbit = saltus.find_orbit(driven, y=0.5)
    assert orbit.period == 1
    assert len(orbit.motion().events) == 2
    period = 2.0 * math.pi / frequency
    relay = 1 if orbit.remembered["relays"]["drive"] else -1

    def mapped(state):
        found, end = driven_map(width, frequency, size, state, relay, period)
        assert end == relay
        return found

    fixed = fsolve(lambda state: mapped(state) - state, orbit.section_state, xtol=1e-13)
    assert orbit.section_state == pytest.approx(fixed, abs=1e-10)
    h = 1e-4
    columns = [(mapped(fixed + step) - mapped(fixed - step)) / (2.0 * h) for step in h * np.eye(2)]
    expected = np.linalg.eigvals(np.stack(columns, axis=1))
    assert np.sort_complex(orbit.multipliers) == pytest.approx(np.sort_complex(expected), abs=1e-6)
    # sums of multipliers do not change by order; their product is that of all areas
    assert np.prod(orbit.multipliers).real == pytest.approx(np.prod(expected).real, abs=1e-7)
