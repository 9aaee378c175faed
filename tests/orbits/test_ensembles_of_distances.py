"""Ensembles, verdicts and attractors of models whose contacts are distances: the same as of models
written with coordinates, which lanes follow.
"""

import numpy as np
import pytest
from flow.test_held_rows import Pressed
from orbits.test_orbits_of_distances import RubsAtADistance, RubsOnAFloor

import saltus
from saltus import Harmonic, Load, NewtonImpact, System

LOAD = Load(frequency=0.8, force=Harmonic(0.4), lift=Harmonic(1.5))
STARTS = {
    "x": [0.1, 0.2, 0.3],
    "y": [0.1, 0.0, 0.5],
    "velocity": ([0.0, 0.0, 0.1], [0.0, 0.0, 0.0]),
}


def both():
    return [
        System(model=model, load=LOAD, impact=NewtonImpact(0.3))
        for model in (RubsOnAFloor(), RubsAtADistance())
    ]


@pytest.mark.parametrize(
    "asked",
    [
        {"periods": 7.3, "sample": ("state", "extrema", "impact_count"), "last": 3},
        {"periods": 300, "until": "settled", "sample": ("state", "extrema"), "last": 3},
        {"duration": 5.0, "parameters": {"model.friction": [0.1, 0.2, 0.3]}},
    ],
)
def test_coordinates_and_distances_give_the_same_ensembles(asked):
    """Beside gains at impacts, which are not looked for, and the limit at which a reaction is no
    longer the only one."""
    one, other = (saltus.simulate_many(system, **STARTS, **asked) for system in both())
    assert {*one.data_vars} - {"gaining_contacts"} == {*other.data_vars} - {"limit"}
    for name in {*other.data_vars} - {"limit"}:
        np.testing.assert_allclose(
            np.asarray(other[name], float), np.asarray(one[name], float), atol=1e-10, err_msg=name
        )


def test_coordinates_and_distances_give_the_same_verdicts_and_attractors():
    window = ((-0.5, 0.5), (0.0, 1.0), (-0.5, 0.5), (-0.5, 0.5))
    found = [saltus.find_attractors(system, window=window, starts=4) for system in both()]
    assert [len(each) for each in found] == [1, 1]
    (one,), (other,) = found
    assert abs(one.amplitude - other.amplitude) < 1e-9
    assert one.starts == other.starts == 4
    verdicts = [
        saltus.classify(system, x=0.1, y=0.1, periods=100, transient=20) for system in both()
    ]
    assert [(str(each.kind), each.period) for each in verdicts] == [("periodic", 1)] * 2


def test_what_cannot_be_followed_ends_with_its_reason():
    """A start beyond a contact, and a ball that a table crushes at a ceiling."""
    load = Load(frequency=1.0, ground=Harmonic(1.5))
    system = System(model=Pressed(), load=load, impact=NewtonImpact(e=0.6))
    ends = saltus.simulate_many(system, y=[-0.5, 0.6], velocity=0.0, duration=3.0)
    names = [str(stop) for stop in saltus.flow.Stop]
    stops = [names[number] for number in ends.stop.values.tolist()]
    assert stops == ["outside", "unresolved"]  # it is hit ever more often
