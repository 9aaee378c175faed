"""Lanes whose contact is far away: each motion is that of the linear system without a contact, by
its matrix exponential.
"""

import math

import numpy as np
import pytest
from scipy.linalg import expm

import saltus
from saltus import ImpactPair, NewtonImpact, TwoStops
from saltus.flow import stop_names
from saltus.systems import Harmonic, Load, System, VelocityReduction, WallOscillator

DISTANCES = [1e3, 1e6, 1e9, 1e12, 1e15]
DAMPING, AMPLITUDE, FREQUENCY = 0.1, 2.0, 1.3
LOAD = Load(frequency=FREQUENCY, force=Harmonic(amplitude=AMPLITUDE))


def one_mass(make):
    """A model of x'' + c x' + x = A sin(w t), and the matrix of (x, x', sin w t, cos w t)."""
    rows = [[0, 1, 0, 0], [-1, -DAMPING, AMPLITUDE, 0], [0, 0, 0, FREQUENCY], [0, 0, -FREQUENCY, 0]]
    return make, np.array(rows, dtype=float), ["x"]


def pair():
    """The case on its spring, z'' + c z' + z = A sin(w t), and the mass that slides in it, x'' =
    -z''.
    """
    spring, forced = np.array([-1, 0, -DAMPING, 0, AMPLITUDE, 0]), np.zeros((6, 6))
    forced[0, 2] = forced[1, 3] = 1.0
    forced[2], forced[3] = spring, -spring
    forced[4, 5], forced[5, 4] = FREQUENCY, -FREQUENCY
    return between_walls, forced, ["z", "x"]


def between_walls(d):
    return System(
        model=ImpactPair(damping=DAMPING, clearance=d), load=LOAD, impact=NewtonImpact(0.8)
    )


def wall(d):
    return System(
        model=WallOscillator(damping=DAMPING, wall=d), load=LOAD, impact=VelocityReduction(0.8)
    )


def stops(d):
    return System(
        model=TwoStops(damping=DAMPING, left=-d, right=d), load=LOAD, impact=NewtonImpact(0.8)
    )


MODELS = {
    "one wall": one_mass(wall),
    "two stops": one_mass(stops),
    "a mass between two walls": pair(),
}


def starts(names):
    """Three motions: arguments of `simulate_many`, and their initial states (3, d)."""
    rng, own = np.random.default_rng(5), len(names)
    states = rng.uniform(-1.0, 1.0, (3, 2 * own))
    velocity = tuple(states[:, own + i] for i in range(own))
    return dict(zip(names, states.T, strict=False)) | {
        "velocity": velocity if own > 1 else velocity[0]
    }, states


def exact(matrix, states, time):
    """The states after a time that begins with sin w t = 0."""
    augmented = np.hstack([states, np.zeros((len(states), 1)), np.ones((len(states), 1))])
    return (augmented @ expm(matrix * time).T)[:, : states.shape[1]]


@pytest.mark.parametrize("distance", DISTANCES)
@pytest.mark.parametrize("name", MODELS)
def test_states_samples_and_derivatives_are_those_of_the_free_motion(name, distance):
    make, matrix, names = MODELS[name]
    arguments, states = starts(names)
    period = 2 * math.pi / FREQUENCY
    ends = saltus.simulate_many(
        make(distance),
        **arguments,
        periods=3,
        last="all",
        sample=("state", "extrema"),
        sensitivities=(),
    )
    own = len(names)
    for n in (1, 2, 3):
        found = np.stack(
            [ends[f"sampled_{coordinate}"].values[..., n - 1] for coordinate in names], axis=-1
        )
        expected = exact(matrix, states, n * period)[:, :own]
        np.testing.assert_allclose(found, expected, rtol=0, atol=3e-12)
    assert set(stop_names(ends).values) == {"horizon"}
    assert (ends.impact_count.values == 0).all()
    slopes = np.broadcast_to(expm(matrix * 3 * period)[: 2 * own, : 2 * own], ends.derivative.shape)
    np.testing.assert_allclose(ends.derivative.values, slopes, rtol=0, atol=1e-11)


@pytest.mark.parametrize("distance", DISTANCES)
@pytest.mark.parametrize("name", ["one wall", "two stops"])
def test_extrema_are_those_of_the_free_motion(name, distance):
    """By the closed form at 20 000 instants of a period, whose extrema are exact to the square of
    their distance.
    """
    make, matrix, names = MODELS[name]
    arguments, states = starts(names)
    duration, count = 5.0, 20_000
    ends = saltus.simulate_many(make(distance), **arguments, duration=duration, sample=("extrema",))
    step, course = (
        expm(matrix * duration / count),
        [np.hstack([states, np.zeros((3, 1)), np.ones((3, 1))])],
    )
    for _ in range(count):
        course.append(course[-1] @ step.T)
    x = np.array(course)[:, :, 0]
    np.testing.assert_allclose(ends.overall_largest_x.values, x.max(axis=0), rtol=0, atol=1e-6)
    np.testing.assert_allclose(ends.overall_smallest_x.values, x.min(axis=0), rtol=0, atol=1e-6)


@pytest.mark.parametrize("distance", DISTANCES)
def test_a_motion_settles_as_without_a_wall(distance):
    """On the steady response P sin(w t - phi)."""
    system = System(
        model=WallOscillator(damping=1.0, wall=distance), load=LOAD, impact=VelocityReduction(0.8)
    )
    end = saltus.simulate_many(system, x=0.2, periods=100, until=("settled",))
    assert str(stop_names(end).values) == "settled"
    stiff, damped = 1 - FREQUENCY**2, FREQUENCY
    assert float(end.x) == pytest.approx(-AMPLITUDE * damped / (stiff**2 + damped**2), abs=1e-9)


def test_a_wall_far_from_zero_is_met_where_it_is():
    """A fall over the distance d under the acceleration 2: the impact at sqrt(d), and the way back
    with half of its speed.
    """
    for d in (1e3, 1e6, 1e9):
        system = System(
            model=WallOscillator(stiffness=0.0, wall=d),
            load=Load(force=2.0),
            impact=VelocityReduction(0.5),
        )
        end = saltus.simulate_many(system, x=0.0, duration=1.5 * math.sqrt(d))
        assert int(end.impact_count) == 1
        # d - sqrt(d) * sqrt(d) / 2 + d / 4
        assert float(end.x) == pytest.approx(0.75 * d, rel=1e-13)
        assert float(end.velocity) == pytest.approx(0.0, abs=1e-9 * math.sqrt(d))
