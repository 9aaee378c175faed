"""The time in which a system moves by itself is looked for once in a loop over numbers, and copies
of a system move as systems that are made anew.
"""

import numpy as np
import pytest

import saltus
from saltus.flow.motion import kernel_state

SMALL = 1e-6  # kg: numbers of very different sizes


def bar(frequency: float) -> tuple[saltus.Structure, saltus.System]:
    """Three masses between springs, one of which hits a stop."""
    spring = 2.0 * np.eye(3) - np.eye(3, k=1) - np.eye(3, k=-1)
    model = saltus.Structure(
        mass=SMALL * np.eye(3),
        stiffness=SMALL * 9.0 * spring,
        damping=SMALL * 0.02 * spring,
        contacts=[saltus.Contact(name="stop", coordinate=2, position=0.1, sign=-1)],
        forces={"push": 2},
    )
    load = saltus.Load(frequency=frequency, push=saltus.Harmonic(amplitude=SMALL * 5.0))
    return model, saltus.System(model=model, load=load, impact=saltus.NewtonImpact(e=0.5))


def fresh(system: saltus.System) -> saltus.System:
    """The same system, which remembers nothing."""
    load = saltus.Load(frequency=system.load.frequency, **system.load.channels)
    return saltus.System(model=system.model, load=load, impact=system.impact)


def test_a_branch_looks_for_the_own_time_once(monkeypatch):
    model, system = bar(2.0)
    looked = []
    own = kernel_state._own_time
    monkeypatch.setattr(kernel_state, "_own_time", lambda of: looked.append(of) or own(of))
    saltus.simulate(system, **model.start(displacement=0.0), periods=2)
    assert len(looked) == 1, "numbers of such sizes are no longer looked at: take others"
    for frequency in np.linspace(1.8, 2.2, 9):
        copy = system.with_({"load.frequency": float(frequency)})
        saltus.simulate(copy, **model.start(displacement=0.0), periods=2)
    assert len(looked) == 1


@pytest.mark.parametrize(
    "changes",
    [
        {"load.frequency": 2.1},
        {"load.frequency": 2e-3},
        {"load.frequency": 2e-5},  # a slow load: the system's own time counts
        {"load.push.amplitude": SMALL * 500.0},
        {"load.push.amplitude": 0.0},
        {"impact.e": 0.9, "load.frequency": 3.0},
    ],
)
def test_a_copy_has_the_natural_time_of_a_system_made_anew(changes):
    model, system = bar(2.0)
    start = model.start(displacement=0.0, velocity=1.0)
    saltus.simulate(system, **start, periods=2)
    copy = system.with_(changes)
    one, other = (
        saltus.simulate(each, **start, duration=5.0, dense=False) for each in (copy, fresh(copy))
    )
    np.testing.assert_array_equal(one.position, other.position)
    np.testing.assert_array_equal(one.velocity, other.velocity)


def test_numbers_are_compared_by_ratios():
    ratio = kernel_state._largest_ratio
    numbers = np.array([1.0, 0.0, -4.0])
    assert ratio(numbers, numbers) == 1.0
    assert ratio(numbers, np.array([1.0, 0.0, -1.0])) == pytest.approx(4.0)
    assert ratio(numbers, np.array([3.0, 0.0, -4.0])) == pytest.approx(3.0)
    assert ratio(numbers, np.array([1.0, 0.0, 4.0])) == np.inf
    assert ratio(numbers, np.array([1.0, 1e-300, -4.0])) == np.inf
    assert ratio(numbers, np.array([1.0, 0.0, np.nextafter(-4.0, 0.0)])) > 1.0
