"""Orbits, branches, verdicts, attractors and exponents of models with coordinates of first
order.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest
from harvesters import Lorenz, Piezo, SwitchedPiezo, by_dop853, shaken

import saltus


def linear(model: Piezo, amplitude: float, frequency: Any) -> tuple[Any, Any]:
    """The complex amplitudes of x and of the voltage without impacts."""
    ratio = model.coupling * 1j * frequency / (1j * frequency + 1.0 / model.resistance)
    push = amplitude * frequency**2
    return (
        push / (1.0 - frequency**2 + 1j * frequency * model.damping + model.coupling * ratio),
        ratio,
    )


def test_a_linear_harvester_has_the_amplitude_the_multipliers_and_the_power_of_its_closed_form() -> (
    None
):
    model = Piezo()
    system, (x, ratio) = shaken(model, 0.05), linear(model, 0.05, 1.05)
    orbit = saltus.find_orbit(system, x=0.0, voltage=0.0)
    assert orbit.amplitude == pytest.approx(abs(x), abs=1e-13)
    matrix = np.array(
        [
            [0.0, 1.0, 0.0],
            [-1.0, -model.damping, -model.coupling],
            [0.0, model.coupling, -1.0 / model.resistance],
        ]
    )
    exact = np.exp(np.linalg.eigvals(matrix) * system.load.period)
    assert np.sort_complex(orbit.multipliers) == pytest.approx(np.sort_complex(exact), abs=1e-12)
    power = saltus.energies(orbit).power.sel(part="first_order.voltage")
    assert float(power) == pytest.approx(abs(ratio * x) ** 2 / (2.0 * model.resistance), rel=1e-10)
    motion = saltus.simulate(system, x=0.0, voltage=0.0, periods=300)
    assert float(saltus.energies(motion).power.sel(part="first_order.voltage")) == pytest.approx(
        float(power), rel=1e-10
    )
    exponents = saltus.lyapunov_spectrum(
        system, x=0.0, voltage=0.0, periods=40, transient=0, two_trajectories=False
    )
    assert exponents.values.sum() == pytest.approx(np.trace(matrix), abs=1e-9)


@pytest.mark.parametrize("model", [Piezo(), SwitchedPiezo()], ids=["kept", "jumps"])
def test_an_orbit_with_an_impact_closes_by_dop853(model: Piezo) -> None:
    system = shaken(model)
    orbit = saltus.find_orbit(system, x=0.0, voltage=0.0)
    assert orbit.impact_count == 1
    (x, u), (v, _) = orbit.state
    end, times = by_dop853(system, (x, u, v), orbit.duration)
    assert len(times) == 1
    assert end == pytest.approx([x, u, v], abs=1e-11)
    found = saltus.sensitivities(system, x=x, voltage=u, velocity=v, periods=1).state[:3, :3]
    assert np.abs(np.linalg.eigvals(found)).max() == pytest.approx(
        abs(orbit.multipliers[0]), rel=1e-9
    )
    balance = saltus.energies(orbit)
    assert abs(balance.defect) < 1e-12 * float(balance.energy.max())


def test_a_branch_grazes_where_the_linear_amplitude_is_the_gap() -> None:
    model = Piezo()
    system = shaken(model).with_({"load.frequency": 0.8})
    orbit = saltus.find_orbit(system, x=0.0, voltage=0.0)
    branch = saltus.continue_orbit(orbit, "load.frequency", (0.8, 1.05))
    grazing = next(point for point in branch.special if point.kind == "GR")
    assert abs(linear(model, 0.2, grazing.parameter)[0]) == pytest.approx(model.stop, abs=1e-10)
    doubling = next(point for point in branch.special if point.kind == "PD")
    (x, u), (v, _) = doubling.orbit.state
    there = system.with_({"load.frequency": doubling.parameter})
    found = saltus.sensitivities(there, x=x, voltage=u, velocity=v, periods=1).state[:3, :3]
    assert np.abs(np.linalg.eigvals(found) + 1.0).min() < 1e-8


def test_without_coupling_the_voltage_changes_nothing() -> None:
    alone = saltus.System(
        model=saltus.WallOscillator(damping=0.05, wall=0.6),
        load=saltus.Load(frequency=1.05, ground=saltus.Harmonic(amplitude=0.2)),
        impact=saltus.NewtonImpact(0.7),
    )
    with_voltage = shaken(Piezo(coupling=0.0))
    one = saltus.simulate(alone, x=0.1, velocity=0.2, duration=30.0)
    two = saltus.simulate(with_voltage, x=0.1, velocity=0.2, voltage=0.3, duration=30.0)
    assert two.impacts.time == pytest.approx(one.impacts.time, abs=1e-11)
    assert two.voltage == pytest.approx(0.3 * np.exp(-30.0 / 1.4), abs=1e-13)


def test_a_verdict_attractors_and_basins_of_a_harvester() -> None:
    system = shaken(Piezo())
    verdict = saltus.classify(system, x=0.0, voltage=0.0)
    assert (verdict.kind.name, verdict.period) == ("PERIODIC", 1)
    found = saltus.find_attractors(system, starts=32)
    (only,) = found
    assert only.orbit.impact_count == 1
    basins = saltus.basins_of_attraction(
        system,
        x=np.linspace(-0.5, 0.5, 4),
        x_velocity=np.linspace(-0.5, 0.5, 4),
        voltage=0.0,
        found=found,
    )
    assert (basins.label.values == only.label).all()
    with pytest.raises(saltus.ParameterError, match="no state variable 'voltage_velocity'"):
        saltus.basins_of_attraction(system, x=[0.0, 0.1], voltage_velocity=[0.0, 0.1], found=found)


def test_exponents_of_lorenz_sum_to_its_divergence() -> None:
    system = saltus.System(model=Lorenz())
    found = saltus.lyapunov_spectrum(
        system, x=1.0, y=2.0, z=20.0, periods=32, transient=10, two_trajectories=False
    )
    assert found.values.shape == (3,)
    assert found.values.sum() == pytest.approx(-(10.0 + 1.0 + 8.0 / 3.0), abs=1e-6)


def test_what_is_of_one_plane_or_drawn_refuses() -> None:
    lorenz = saltus.System(model=Lorenz())
    with pytest.raises(saltus.ParameterError, match="move nothing"):
        saltus.systems.drawing_of(lorenz, [0.0, 0.0, 0.0])
    with pytest.raises(saltus.ParameterError, match="coordinates of first order"):
        saltus.page(shaken(Piezo()), x=0.0, voltage=0.0)
    shapes = saltus.systems.drawing_of(shaken(Piezo()), [0.1, 5.0])
    assert [shape.role for shape in shapes].count("mass") == 1


def test_a_rectifier_conducts_beyond_a_surface_of_the_voltage() -> None:
    @dataclass(frozen=True, kw_only=True)
    class Rectified(Piezo):
        surfaces = (saltus.Surface(name="diode", coordinate="voltage", position=0.12),)

        def force(self, t: Any, theta: Any, velocity: Any, load: Any, sides: Any) -> Any:
            push, rate = super().force(t, theta, velocity, load)
            return push, rate - (1.0 + sides.diode) * (theta[1] - 0.12)

    system = shaken(Rectified())
    orbit = saltus.find_orbit(system, x=0.0, voltage=0.0)
    kinds = [event.kind.value for event in orbit.motion().events]
    assert sorted(kinds) == ["crossing", "crossing", "impact"]
    assert orbit.defect < 1e-12
    start = orbit.start()
    found = saltus.sensitivities(system, **start, periods=1).state[:3, :3]
    exact = np.linalg.eigvals(found)
    assert np.sort_complex(orbit.multipliers) == pytest.approx(np.sort_complex(exact), abs=1e-9)
    step, moved = 1e-6, []
    for name in ("x", "voltage", "velocity"):
        ends = [
            saltus.simulate(system, **start | {name: start[name] + h}, periods=1).final_state
            for h in (step, -step)
        ]
        moved.append((ends[0] - ends[1])[:3] / (2.0 * step))
    assert np.transpose(moved) == pytest.approx(found, abs=1e-7)
    branch = saltus.continue_orbit(orbit, "load.frequency", (1.04, 1.06))
    assert len(branch.orbits) > 2


def test_a_symmetric_harvester_has_symmetric_orbits() -> None:
    @dataclass(frozen=True, kw_only=True)
    class Both(Piezo):
        @property
        def contacts(self) -> tuple[saltus.Contact, ...]:
            places = (("left", -1.0, 1), ("right", 1.0, -1))
            return tuple(
                saltus.Contact(name=n, coordinate="x", position=s * self.stop, sign=d)
                for n, s, d in places
            )

        def mirror(self, load: Any) -> Any:
            return saltus.Load(
                frequency=load.frequency,
                ground=saltus.Harmonic(amplitude=-load.channels["ground"].amplitude),
            )

    orbit = saltus.find_orbit(shaken(Both(), 0.3), x=0.0, voltage=0.0)
    assert orbit.symmetric
    assert orbit.impact_count == 2
    found = saltus.sensitivities(orbit.system, **orbit.start(), periods=1).state[:3, :3]
    largest = np.sort(np.abs(np.linalg.eigvals(found)))[::-1]
    assert np.abs(orbit.multipliers)[:3] == pytest.approx(largest, abs=1e-9)
    free = saltus.find_orbit(shaken(Both(stop=9.0), 0.3), x=0.0, voltage=0.0)
    assert free.symmetric
    assert free.amplitude == pytest.approx(abs(linear(Piezo(), 0.3, 1.05)[0]), abs=1e-12)


def test_a_sweep_gives_the_power_of_the_closed_form() -> None:
    model, values = Piezo(), np.array([0.9, 1.0, 1.1])

    def electric(motion: saltus.Motion) -> Any:
        return saltus.energies(motion).power.sel(part="first_order.voltage")

    sweep = saltus.frequency_sweep(
        shaken(model, 0.05), values, x=0.0, voltage=0.0, functions={"electric": electric}
    )
    x, ratio = linear(model, 0.05, values)
    assert sweep.electric.sel(direction="up").values == pytest.approx(
        np.abs(ratio * x) ** 2 / 2.8, rel=1e-7
    )
