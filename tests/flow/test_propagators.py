"""Derivatives of structures that propagators carry are those of their Taylor series, which a dense
motion keeps, and of a mesh that series cannot follow.
"""

import numpy as np
import pytest

import saltus
from saltus.flow.programs.compiled import program
from saltus.systems.structures import eigenmodes

LOAD = saltus.Load(frequency=1.1, drive=[saltus.Harmonic(amplitude=0.6, phase=0.4), 0.1])
NUMBERS = ["load.frequency", "load.drive.0.amplitude", "load.drive.0.phase", "load.drive.1"]


def chain(n, *, damping, seed=0, **parts):
    """A chain of n masses between walls, driven at its first one."""
    rng = np.random.default_rng(seed)
    stiffness = 2.0 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1)
    mass = np.diag(rng.uniform(0.5, 1.5, n))
    return saltus.Structure(
        mass=mass,
        stiffness=stiffness,
        damping=damping * stiffness + 0.02 * mass,
        forces={"drive": 0},
        **parts,
    )


def stop(row, position, sign=-1):
    return saltus.Contact(name=f"stop_{row}", coordinate=row, position=position, sign=sign)


STRUCTURES = {
    "one stop": chain(5, damping=0.01, contacts=[stop(4, 0.3)]),
    "two stops": chain(6, damping=0.05, contacts=[stop(5, 0.2), stop(2, -0.4, 1)]),
    "fast modes die": chain(5, damping=3.0, contacts=[stop(4, 0.002)]),
    "a soft stop": chain(
        5,
        damping=0.02,
        contacts=[stop(1, 0.5)],
        surfaces=[saltus.Surface(name="rubber", coordinate=4, position=0.2, stiffness=3.0)],
    ),
}


@pytest.fixture
def of_any_size(monkeypatch):
    """Propagators for structures of any size."""
    monkeypatch.setattr(eigenmodes, "FEWEST", 1)


@pytest.mark.parametrize("e", [0.0, 0.6])
@pytest.mark.parametrize("name", STRUCTURES)
def test_derivatives_are_those_of_the_series(of_any_size, name, e):
    model = STRUCTURES[name]
    system = saltus.System(model=model, load=LOAD, impact=saltus.NewtonImpact(e=e))
    contact = model.contacts[0].name
    asked = {
        "parameters": [*NUMBERS, "impact.e", f"model.contacts.{contact}.position"],
        "duration": 40.0,
        **model.start(),
    }
    run = program(system, (), tuple(asked["parameters"]))
    assert run.model.eigenmodes.size > 0
    carried = saltus.sensitivities(system, dense=False, **asked)
    series = saltus.sensitivities(system, dense=True, **asked)
    assert len(carried.motion.impacts) == len(series.motion.impacts) > 2
    for one, other, accuracy in (
        (carried.state, series.state, 1e-11),
        (carried.parameters, series.parameters, 1e-11),
        # ends of accumulations among them have central differences
        (carried.event_times, series.event_times, 1e-7),
    ):
        size = np.nanmax(np.abs(other), initial=1.0)
        assert np.array_equal(np.isnan(one), np.isnan(other))
        assert np.allclose(one, other, rtol=0, atol=accuracy * size, equal_nan=True)


def test_an_orbit_has_the_multipliers_of_the_series(of_any_size, monkeypatch):
    """Event to event, with rests and excursions from the stop."""
    system = saltus.System(
        model=STRUCTURES["one stop"], load=LOAD, impact=saltus.NewtonImpact(e=0.0)
    )
    found = saltus.find_orbit(system, **system.model.start())
    assert found.impact_count > 0
    monkeypatch.setattr(eigenmodes, "FEWEST", 1000)
    other = saltus.System.from_json(system.to_json())  # nothing is remembered of it
    again = saltus.find_orbit(other, **other.model.start())
    assert np.allclose(
        np.sort_complex(found.multipliers), np.sort_complex(again.multipliers), atol=1e-10
    )


def beam(elements):
    """A cantilever of finite elements whose tip meets a stop, with damping of the stiffness."""
    h = 1.0 / elements
    size = 2 * (elements + 1)
    mass = np.zeros((size, size))
    stiffness = np.zeros((size, size))
    inertia = (h / 420.0) * np.array(
        [
            [156.0, 22.0 * h, 54.0, -13.0 * h],
            [22.0 * h, 4.0 * h * h, 13.0 * h, -3.0 * h * h],
            [54.0, 13.0 * h, 156.0, -22.0 * h],
            [-13.0 * h, -3.0 * h * h, -22.0 * h, 4.0 * h * h],
        ]
    )
    bending = (1.0 / h**3) * np.array(
        [
            [12.0, 6.0 * h, -12.0, 6.0 * h],
            [6.0 * h, 4.0 * h * h, -6.0 * h, 2.0 * h * h],
            [-12.0, -6.0 * h, 12.0, -6.0 * h],
            [6.0 * h, 2.0 * h * h, -6.0 * h, 4.0 * h * h],
        ]
    )
    for i in range(elements):
        rows = slice(2 * i, 2 * i + 4)
        mass[rows, rows] += inertia
        stiffness[rows, rows] += bending
    mass, stiffness = mass[2:, 2:], stiffness[2:, 2:]
    first = 1.8751**2  # the first frequency of a cantilever
    tip = size - 4
    return first, saltus.Structure(
        mass=mass,
        stiffness=stiffness,
        damping=0.02 / first * stiffness + 0.02 * first * mass,
        contacts=[saltus.Contact(name="stop", coordinate=tip, position=0.02, sign=-1)],
        forces={"f": tip},
    )


@pytest.mark.parametrize("frequency", [0.9, 0.95])
def test_a_cantilever_of_twenty_elements_has_its_orbit(frequency):
    """Its fastest mode dies in 1e-8 of a period. The multipliers are those of differences of the
    motion over one period."""
    first, model = beam(20)
    system = saltus.System(
        model=model,
        load=saltus.Load(frequency=frequency * first, f=saltus.Harmonic(0.01)),
        impact=saltus.NewtonImpact(0.0),
    )
    orbit = saltus.find_orbit(system, **model.start())
    assert (orbit.impact_count > 0) == (frequency > 0.92)
    start = orbit.start()
    values = [start[name] for name in model.coordinates], start["velocity"]
    state = np.concatenate([np.ravel(x) for x in values])
    n = len(model.coordinates)
    # along the slowest modes, in which displacements of 1e-7 excite nothing that rounding hides
    picked = [n + 1, n + 2, 1, 2]
    columns = []
    for i in picked:
        ends = []
        for sign in (1.0, -1.0):
            moved = state.copy()
            moved[i] += sign * 1e-6
            motion = saltus.simulate(
                system,
                **dict(zip(model.coordinates, moved[:n], strict=True)),
                velocity=moved[n:],
                time=start.get("time", 0.0),
                periods=1,
            )
            ends.append(motion.final_state)
        columns.append((ends[0] - ends[1]) / 2e-6)
    derivatives = saltus.sensitivities(
        system,
        **dict(zip(model.coordinates, state[:n], strict=True)),
        velocity=state[n:],
        time=start.get("time", 0.0),
        periods=1,
        dense=False,
    ).state
    assert np.allclose(derivatives[:, picked], np.transpose(columns), atol=2e-5)
