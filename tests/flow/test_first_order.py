"""Coordinates of first order: a voltage or a temperature beside the others, or alone."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest
from harvesters import Lorenz, Piezo, SwitchedPiezo, by_dop853, shaken
from scipy.integrate import solve_ivp

import saltus

START = {"x": 0.1, "voltage": 0.3, "velocity": 0.2}


def test_a_filter_follows_its_closed_form() -> None:
    @dataclass(frozen=True, kw_only=True)
    class Filter(saltus.Model):
        coordinates = ("voltage",)
        first_order = ("voltage",)
        channels = ("source",)
        time_constant: float = 0.7

        def acceleration(self, t: Any, theta: Any, velocity: Any, side: Any, load: Any) -> Any:
            return (load.source(t) - theta) / self.time_constant

    system = saltus.System(
        model=Filter(), load=saltus.Load(frequency=2.0, source=saltus.Harmonic(amplitude=1.5))
    )
    motion = saltus.simulate(system, voltage=0.4, duration=9.0)
    times = np.linspace(0.0, 9.0, 41)
    forced = 1.5 * np.exp(2j * (times + 0.0)) / (1.0 + 2j * 0.7)
    # cos or sin: the value at time 0
    phase = system.load.channels["source"].derivative(0.0, 2.0) / 1.5
    wave = forced.real if phase == 1.0 else forced.imag
    exact = wave + (0.4 - wave[0]) * np.exp(-times / 0.7)
    assert motion.at(times)[0] == pytest.approx(exact, abs=1e-13)
    assert motion.at(times)[1] == pytest.approx(
        (system.load.source(times) - exact) / 0.7, abs=1e-12
    )
    orbit = saltus.find_orbit(system, voltage=0.0)
    assert orbit.voltage == pytest.approx(wave[0], abs=1e-13)
    assert orbit.multipliers == pytest.approx([np.exp(-np.pi / 0.7)], abs=1e-14)
    many = saltus.simulate_many(system, voltage=[0.4, 1.0], duration=9.0)
    assert many.voltage.values == pytest.approx(
        wave[-1] + (np.array([0.4, 1.0]) - wave[0]) * np.exp(-9.0 / 0.7), abs=1e-12
    )


def test_a_model_of_first_order_alone_agrees_with_dop853() -> None:
    start, model = (1.0, 2.0, 20.0), Lorenz()
    motion = saltus.simulate(
        saltus.System(model=model), **dict(zip("xyz", start, strict=True)), duration=3.0
    )
    found = solve_ivp(
        lambda t, q: model.acceleration(t, q, None, 1, None),
        (0, 3),
        start,
        method="DOP853",
        rtol=3e-14,
        atol=1e-14,
    )
    assert motion.position == pytest.approx(found.y[:, -1], abs=1e-11)
    assert motion.velocity == pytest.approx(
        model.acceleration(3.0, motion.position, None, 1, None), abs=1e-10
    )


@pytest.mark.parametrize("model", [Piezo(), SwitchedPiezo()], ids=["kept", "jumps"])
def test_a_harvester_that_hits_a_stop_agrees_with_dop853(model: Piezo) -> None:
    system = shaken(model)
    motion = saltus.simulate(system, **START, duration=40.0)
    end, times = by_dop853(system, (0.1, 0.3, 0.2), 40.0)
    assert len(times) > 4
    assert motion.impacts.time == pytest.approx(times, abs=1e-11)
    assert (motion.x, motion.voltage, motion.velocity[0]) == pytest.approx(end, abs=1e-11)
    dataset = motion.to_xarray()
    before = zip(
        dataset.impact_voltage_before.values, dataset.impact_x_velocity_before.values, strict=True
    )
    jumps = [
        np.atleast_1d(model.after_impact("stop", (model.stop, u), (v, None)))[0] for u, v in before
    ]
    assert dataset.impact_voltage_after.values == pytest.approx(jumps)
    starts = np.linspace(0.0, 0.3, 11)
    many = saltus.simulate_many(system, x=starts, voltage=0.3, velocity=0.2, duration=40.0)
    for i in (0, 4, 10):
        alone = saltus.simulate(system, x=starts[i], voltage=0.3, velocity=0.2, duration=40.0)
        found = [
            many[name].values[i] for name in ("x", "voltage", "x_velocity", "voltage_velocity")
        ]
        assert found == pytest.approx([*alone.position, *alone.velocity], abs=1e-11)


@pytest.mark.parametrize("model", [Piezo(), SwitchedPiezo()], ids=["kept", "jumps"])
def test_sensitivities_pass_impacts(model: Piezo) -> None:
    system, paths = shaken(model), ["model.resistance", "load.frequency", "model.stop", "impact.e"]
    paths += ["model.kept", "model.gain"] if isinstance(model, SwitchedPiezo) else []
    found = saltus.sensitivities(system, **START, duration=20.0, parameters=paths)

    def end(system: saltus.System, **changes: float) -> np.ndarray:
        return saltus.simulate(system, **START | changes, duration=20.0).final_state

    def slope(along: Callable[[float], np.ndarray], step: float = 1e-4) -> np.ndarray:
        return (8.0 * (along(step) - along(-step)) - along(2.0 * step) + along(-2.0 * step)) / (
            12.0 * step
        )

    for column, name in ((0, "x"), (1, "voltage"), (2, "velocity")):
        moved = slope(lambda h, name=name: end(system, **{name: START[name] + h}))  # type: ignore[misc]
        assert found.state[:, column] == pytest.approx(moved, rel=1e-8, abs=1e-9)
    for column, path in enumerate(paths):
        moved = slope(lambda h, path=path: end(system.with_({path: system.get(path) + h})))  # type: ignore[misc]
        assert found.parameters[:, column] == pytest.approx(moved, rel=1e-8, abs=1e-9)
    assert not found.state[:, 3].any()  # the velocity of a coordinate of first order is not chosen


def test_a_capacitor_that_each_bounce_charges() -> None:
    @dataclass(frozen=True, kw_only=True)
    class Charger(saltus.ContactModel):
        coordinates = ("height", "charge")
        first_order = ("charge",)
        contacts = (saltus.Contact(name="floor", coordinate="height"),)
        leak: float = 0.25
        gain: float = 0.5

        def force(self, t: Any, theta: Any, velocity: Any, load: Any) -> Any:
            return -1.0, -self.leak * theta[1]

        def after_impact(self, contact: str, theta: Any, velocity: Any) -> Any:
            return theta[1] - self.gain * velocity[0]

    system = saltus.System(model=Charger(), impact=saltus.NewtonImpact(0.5))
    motion = saltus.simulate(system, height=0.5, charge=0.2, duration=3.5)
    # of a fall from 1/2 with e = 1/2, until 3
    times, speeds = np.array([1.0, 2.0, 2.5]), np.array([1.0, 0.5, 0.25])
    charge = 0.2 * np.exp(-0.25 * 2.6) + np.sum(0.5 * speeds * np.exp(-0.25 * (2.6 - times)))
    assert motion.at(2.6)[0][1] == pytest.approx(charge, abs=1e-13)
    assert motion.at(3.4)[1][0] == 0.0  # at rest, while the charge leaks on
    assert motion.at(3.4)[0][1] == pytest.approx(
        motion.at(3.1)[0][1] * np.exp(-0.25 * 0.3), abs=1e-13
    )


def test_a_heater_is_switched_by_a_surface_of_the_temperature() -> None:
    @dataclass(frozen=True, kw_only=True)
    class Heater(saltus.ContactModel):
        coordinates = ("temperature",)
        first_order = ("temperature",)
        surfaces = (saltus.Surface(name="limit", coordinate="temperature", position=1.0),)

        def force(self, t: Any, theta: Any, velocity: Any, load: Any, sides: Any) -> Any:
            # 2 below, 1 above the limit: it is passed once, and approached no more
            return 1.5 - 0.5 * sides.limit - theta

    motion = saltus.simulate(saltus.System(model=Heater()), temperature=0.0, duration=3.0)
    assert [event.time for event in motion.events] == pytest.approx([np.log(2.0)], abs=1e-14)
    assert motion.temperature == pytest.approx(1.0, abs=1e-14)


def _changed(**body: Any) -> saltus.Model:
    return dataclass(frozen=True, kw_only=True)(type("Changed", (Piezo,), body))()  # type: ignore[no-any-return]


@pytest.mark.parametrize(
    ("body", "words"),
    [
        ({"first_order": "voltage"}, "tuple of the last of the coordinates"),
        ({"first_order": ("x",)}, "tuple of the last of the coordinates"),
        ({"force": lambda self, t, q, v, load: (-q[0], v[1])}, "reads the velocity of voltage"),
        (
            {"kinetic_energy": lambda self, t, q, v, side, load: sum(x * x for x in v)},
            "reads the velocity of voltage",
        ),
        (
            {"contacts": (saltus.Contact(name="c", coordinate="voltage"),)},
            "holds voltage, which is of first order",
        ),
        (
            {"mass_matrix": lambda self, q: [[1.0, 0.2], [0.2, 1.0]]},
            "rows of the unit matrix for voltage",
        ),
        ({"after_impact": lambda self, contact, q, v: (0.0, 1.0)}, "must return 1 value"),
        ({"contacts": (), "after_impact": lambda self, contact, q, v: 0.0}, "has no contact"),
        (
            {"first_order": (), "after_impact": lambda self, contact, q, v: 0.0},
            "no coordinate of first order",
        ),
    ],
)
def test_what_has_no_meaning_is_refused_when_the_system_is_made(
    body: dict[str, Any], words: str
) -> None:
    with pytest.raises(saltus.ParameterError, match=words):
        saltus.System(model=_changed(**body))


def test_a_wall_needs_a_velocity() -> None:
    class Wall(saltus.OneContactModel):
        coordinates = ("x",)
        first_order = ("x",)

        def acceleration(self, t: Any, theta: Any, velocity: Any, side: Any, load: Any) -> Any:
            return -theta

    with pytest.raises(saltus.ParameterError, match="no velocity with which to hit"):
        saltus.System(model=Wall())


def test_starts_have_one_velocity_for_each_coordinate_that_has_one() -> None:
    system = shaken(Piezo())
    motion = saltus.simulate(system, **START, duration=1.0)
    again = saltus.simulate(
        system, x=motion.x, voltage=motion.voltage, velocity=motion.velocity, time=1.0, duration=1.0
    )
    assert again.final_state == pytest.approx(
        saltus.simulate(system, **START, duration=2.0).final_state, abs=1e-13
    )
    with pytest.raises(saltus.ParameterError, match="velocity must have 1 value"):
        saltus.simulate(system, x=0.0, voltage=0.0, velocity=(0.1, 0.2, 0.3), duration=1.0)
