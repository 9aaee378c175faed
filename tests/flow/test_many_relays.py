"""Ensembles of models with relays and resets: each motion is that which `simulate` follows."""

import math

import numpy as np
import pytest
import xarray as xr
from machines_with_memory import Neuron, Thermostat
from test_relays_and_resets import Machine

import saltus
from saltus import Harmonic, Load, NewtonImpact, ParameterError, System, simulate, simulate_many
from saltus.flow.lanes.one_by_one import _Record, _recurs

LOAD = Load(frequency=1.3, force=Harmonic(1.0))


@pytest.mark.parametrize("lasting", [{"periods": 5}, {"periods": 2.5}, {"duration": 11.0}])
def test_motions_of_machines_are_those_followed_alone_to_the_last_bit(lasting):
    starts = [(0.1, 0.0, True), (0.2, 0.1, False), (-0.3, 0.4, True)]
    x, y, motors = (np.array(part) for part in zip(*starts, strict=True))
    stiffness = np.array([2.0, 2.2, 1.9])
    system = System(model=Machine(), load=LOAD, impact=NewtonImpact(0.6))
    many = simulate_many(
        system,
        x=x,
        y=y,
        w=0.0,
        relays={"motor": motors, "valve": False},
        parameters={"model.stiffness": stiffness},
        sample=("state", "extrema", "speed", "impact_count"),
        last="all",
        **lasting,
    )
    names = saltus.flow.state_names(("x", "y", "w"))
    crossed = 0
    for row, (x0, y0, motor) in enumerate(starts):
        one = system.with_({"model.stiffness": float(stiffness[row])})
        asked = {"x": x0, "y": y0, "w": 0.0, "relays": {"motor": motor, "valve": False}}
        motion = simulate(one, **asked, **lasting)
        found = np.array([many[name].values[row] for name in names])
        assert np.array_equal(found, motion.final_state)
        assert many.time.values[row] == motion.time
        for relay in ("motor", "valve"):
            assert many[f"side_{relay}"].values[row] == motion.sides[relay]
        assert many.impact_count.values[row] == len(motion.impacts)
        crossed += sum(event.contact in ("motor", "valve", "fire") for event in motion.events)
        # a motion that ends with the first period is where the other one was then
        first = simulate(one, **asked, periods=1)
        inside = first.final_state - [many[f"sampled_{name}"].values[row, 0] for name in names]
        assert abs(inside).max() < 1e-11
        assert many.sampled_side_motor.values[row, 0] == first.sides["motor"]
        if len(motion.impacts):
            speeds = np.abs(motion.impacts.velocity_before[:, 1])
            assert many.overall_least_speed.values[row] == speeds.min()
    assert crossed > 6


def test_rooms_have_the_temperatures_of_their_closed_form():
    """On: 40 - (40 - T) exp(-t / 10); off: 10 + (T - 10) exp(-t / 10)."""
    starts = xr.DataArray([19.5, 20.0, 20.5], dims="room")
    on = xr.DataArray([True, False], dims="heating")
    found = simulate_many(System(model=Thermostat()), T=starts, relays={"heater": on}, duration=0.2)
    T = found["T"].transpose("room", "heating").values
    share = math.exp(-0.02)
    assert np.allclose(T[:, 0], 40.0 - (40.0 - starts) * share, rtol=0.0, atol=1e-13)
    assert np.allclose(T[:, 1], 10.0 + (starts - 10.0) * share, rtol=0.0, atol=1e-13)
    sides = found.side_heater.transpose("room", "heating").values
    assert np.array_equal(sides, np.tile([1, -1], (3, 1)))


def test_neurons_fire_with_their_own_periods():
    drives = np.array([1.2, 1.5, 2.0, 4.0])
    found = simulate_many(
        System(model=Neuron()), u=0.0, duration=100.0, parameters={"model.drive": drives}
    )
    period = 2.0 * np.log(drives / (drives - 1.0))
    since = 100.0 - period * np.floor(100.0 / period)
    assert np.allclose(found.u, drives * (1.0 - np.exp(-since / 2.0)), rtol=0.0, atol=1e-11)


@pytest.mark.parametrize(("sides", "period"), [([1], 1), ([1, -1], 2), ([1, 1, -1], 3)])
def test_a_motion_has_settled_where_its_relays_return_too(sides, period):
    """One state at each phase 0, and a relay on one side after the other."""
    record = _Record(
        np.array([20.0, 0.0]), 0.0, np.zeros((1, 7)), np.zeros((32, 4)), np.zeros(17, dtype=int)
    )
    system = System(model=Thermostat(), load=Load(frequency=1.0))
    for number in range(32):
        record.done = number + 1
        record.sides = (sides[number % len(sides)],)
        if _recurs(system, record):
            break
    assert record.detail == period


def test_starts_that_do_not_say_the_side_are_refused():
    room = System(model=Thermostat())
    for given, words in [
        ({"T": 20.0}, "the start does not say whether the relay 'heater' is on"),
        ({"T": 20.0, "relays": {"motor": True}}, "Thermostat has heater"),
        ({"T": [20.0, 20.0], "relays": {"heater": [True, 2]}}, "or as an array of these"),
        ({"T": [20.0, 20.0], "relays": {"heater": [True] * 3}}, "do not broadcast"),
    ]:
        with pytest.raises(ParameterError, match=words):
            simulate_many(room, duration=1.0, **given)


def test_a_motion_without_a_duration_is_its_start():
    room = System(model=Thermostat(), load=Load(frequency=1.0))
    for lasting in ({"duration": 0.0}, {"periods": 0}):
        found = simulate_many(room, T=[19.5, 20.5], relays={"heater": [True, False]}, **lasting)
        assert found["T"].values.tolist() == [19.5, 20.5]
        assert found.side_heater.values.tolist() == [1, -1]
        assert found.time.values.tolist() == [0.0, 0.0]


def test_a_card_follows_no_relays():
    room = System(model=Thermostat())
    with pytest.raises(ParameterError, match="one by one, not on a card: leave device out"):
        simulate_many(room, T=[18.0], relays={"heater": True}, duration=1.0, device="cuda")
