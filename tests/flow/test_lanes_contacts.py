"""Ensembles of models with several contacts: the same motions as the scalar kernel's, in lanes and
on all cores.
"""

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import pytest
from test_contacts import BETA80, layers

import saltus
from saltus import InelasticImpact, NewtonImpact, TwoStops
from saltus.errors import MotionError
from saltus.flow import Ending, find_recurrence, stop_names
from saltus.systems import Harmonic, Load, Metainterface, System, VelocityReduction

CASES = 150


def random_parameters(count, seed):
    """Numbers of as many systems of one structure, and states from which they start: at rest, open,
    or both closed.
    """
    rng = np.random.default_rng(seed)
    numbers = {
        "impact.e.0": rng.uniform(0, 0.9, count) * (rng.random(count) < 0.7),
        "impact.e.1": rng.uniform(0, 0.9, count) * (rng.random(count) < 0.7),
        "load.vertical": rng.uniform(-1.5, 0.3, count),
        "load.horizontal.amplitude": rng.uniform(0, 1.0, count),
        "load.frequency": rng.uniform(0.3, 3.0, count),
        "load.ground_horizontal.amplitude": rng.uniform(0, 0.2, count),
        "model.beta0": np.radians(rng.uniform(20, 160, count)),
        "model.mass_ratio": 10 ** rng.uniform(-2, 1, count),
        "model.damping": rng.uniform(0, 0.3, count),
        "model.stiffness_ratio": rng.uniform(0.3, 2.0, count),
        "model.dissipation_ratio": rng.uniform(0, 2.0, count),
    }
    x = rng.uniform(0.02, 0.6, (2, count)) * (rng.random((2, count)) < 0.7)
    v = np.where(x > 0, rng.uniform(-0.5, 0.5, (2, count)), 0.0)
    return numbers, x, v


def end(result):
    """The states at the end of an ensemble, (n, 4)."""
    names = ("theta_1", "theta_2", "theta_1_velocity", "theta_2_velocity")
    return np.stack([result[name].values for name in names], axis=-1)


def test_ensembles_of_random_systems_are_the_scalar_motions():
    """States to 1e-9, and exactly what is counted, wherever a change of the start by 1e-9 shows no
    amplification above 100.
    """
    system, (numbers, x, v) = layers(e=(0.1, 0.1)), random_parameters(CASES, seed=5)
    options = {"duration": 8.0, "tol": 1e-13, "parameters": numbers}
    result = saltus.simulate_many(
        system, theta_1=x[0], theta_2=-x[1], velocity=(v[0], -v[1]), **options
    )
    moved = saltus.simulate_many(
        system,
        theta_1=x[0] * (1 + 1e-9),
        theta_2=-x[1] * (1 + 1e-9),
        velocity=(v[0], -v[1]),
        **options,
    )
    calm = (np.abs(end(moved) - end(result)).max(axis=1) < 1e-7) & (
        moved.impact_count == result.impact_count
    ).values
    assert calm.sum() > 0.7 * CASES
    for i in np.flatnonzero(calm):
        one = system.with_({path: float(values[i]) for path, values in numbers.items()})
        state = {"theta": (x[0, i], -x[1, i]), "velocity": (v[0, i], -v[1, i])}
        try:
            motion = saltus.simulate(one, **state, duration=8.0, tol=1e-13)
        except MotionError:
            assert stop_names(result).values[i] in (
                "not_unique",
                "no_impact",
                "not_finite",
                "stalled",
            )
            continue
        assert stop_names(result).values[i] == motion.stop.value.split()[0], i
        assert int(result.impact_count[i]) == len(motion.impacts), i
        np.testing.assert_allclose(
            end(result)[i], [*motion.position, *motion.velocity], rtol=0, atol=1e-9
        )
        names = {
            name
            for bit, name in enumerate(("lower", "upper"))
            if int(result.closed_contacts[i]) >> bit & 1
        }
        assert names == set(motion.closed), i


def test_lanes_do_not_depend_on_what_else_is_computed():
    system, (numbers, x, v) = layers(e=(0.1, 0.1)), random_parameters(40, seed=6)
    together = end(
        saltus.simulate_many(
            system,
            theta_1=x[0],
            theta_2=-x[1],
            velocity=(v[0], -v[1]),
            duration=5.0,
            parameters=numbers,
        )
    )
    for i in (0, 7, 39):
        of_one = {path: values[i] for path, values in numbers.items()}
        alone = saltus.simulate_many(
            system,
            theta_1=x[0, i],
            theta_2=-x[1, i],
            velocity=(v[0, i], -v[1, i]),
            duration=5.0,
            parameters=of_one,
            threads=1,
        )
        assert (end(alone) == together[i]).all()


def test_the_reduced_model_is_met_where_its_closed_layer_stays_closed():
    """H = 0.1 keeps the closed layer closed (contacts.md): equal states after 50 periods, to 1e-13,
    and as many impacts.
    """
    theta = np.linspace(-0.3, 0.3, 60)
    theta = theta[np.abs(theta) > 0.02]
    load = Load(frequency=1.0, vertical=-0.5, horizontal=Harmonic(amplitude=0.1))
    reduced = System(
        model=Metainterface(beta0=BETA80, damping=0.1), load=load, impact=VelocityReduction(1.0)
    )
    both = System(
        model=saltus.TwoLayer(beta0=BETA80, damping=0.1), load=load, impact=VelocityReduction(1.0)
    )
    options = {"periods": 50, "sample": ("state", "extrema", "impact_count", "speed"), "last": 2}
    one = saltus.simulate_many(reduced, theta=theta, **options)
    two = saltus.simulate_many(
        both,
        theta_1=np.maximum(theta, 0),
        theta_2=np.minimum(theta, 0),
        velocity=(0.0, 0.0),
        **options,
    )
    np.testing.assert_allclose(
        (two.theta_1 + two.theta_2).values, one.theta.values, rtol=0, atol=1e-13
    )
    np.testing.assert_allclose(
        two.sampled_theta_1, np.maximum(one.sampled_theta, 0), rtol=0, atol=1e-13
    )
    np.testing.assert_allclose(
        two.sampled_theta_2, np.minimum(one.sampled_theta, 0), rtol=0, atol=1e-13
    )
    np.testing.assert_allclose(two.smallest_coordinate, one.smallest_theta, rtol=0, atol=1e-12)
    np.testing.assert_allclose(two.largest_coordinate, one.largest_theta, rtol=0, atol=1e-12)
    np.testing.assert_allclose(two.smallest_coordinate, one.smallest_theta, rtol=0, atol=1e-12)
    np.testing.assert_allclose(two.overall_least_speed, one.overall_least_speed, rtol=0, atol=1e-12)
    assert (two.impact_count == one.impact_count).all()
    assert (two.period_impact_count.values == one.period_impact_count.values).all()


def test_the_extrema_of_a_period_are_those_of_all_coordinates():
    """Of an impact pair the largest and the least of z and x over each of the last periods, from
    dense output at 4000 instants and at the impacts."""
    system = System(
        model=saltus.ImpactPair(mass_ratio=0.3, clearance=0.7, damping=0.05),
        load=Load(frequency=1.1, force=Harmonic(amplitude=0.2)),
        impact=NewtonImpact(e=0.6),
    )
    z = np.linspace(-0.5, 0.5, 9)
    found = saltus.simulate_many(
        system, z=z, x=0.1, velocity=(0.2, -0.1), periods=12, sample=("extrema",), last=3
    )
    for i in range(len(z)):
        motion = saltus.simulate(system, z=float(z[i]), x=0.1, velocity=(0.2, -0.1), periods=12)
        for k in range(3):
            span = system.load.period * np.array([9 + k, 10 + k])
            hits = motion.impacts.time[
                (motion.impacts.time > span[0]) & (motion.impacts.time < span[1])
            ]
            values = np.asarray(motion.at(np.append(np.linspace(*span, 4000), hits))[0])
            assert (
                values.max() - 1e-9 <= float(found.largest_coordinate[i, k]) < values.max() + 1e-5
            )
            assert (
                values.min() - 1e-5 < float(found.smallest_coordinate[i, k]) <= values.min() + 1e-9
            )


def test_two_stops_of_one_coordinate_are_two_contacts_in_lanes():
    system = System(
        model=TwoStops(stiffness=0.0, damping=0.1),
        load=Load(frequency=1.0, force=Harmonic(amplitude=0.8)),
        impact=NewtonImpact(e=0.7),
    )
    x = np.linspace(-0.9, 0.9, 37)
    result = saltus.simulate_many(system, x=x, velocity=0.5, periods=3)
    for i in range(len(x)):
        motion = saltus.simulate(system, x=x[i], velocity=0.5, periods=3)
        assert int(result.impact_count[i]) == len(motion.impacts)
        assert abs(float(result.x[i]) - motion.position) < 1e-9
        assert abs(float(result.velocity[i]) - motion.velocity) < 1e-9


def test_both_layers_at_rest_are_captured_where_no_load_ever_opens_them():
    """A reaction at rest is abs(V) cos(beta0) - H sin(beta0) sin(tau): it stays positive up to H =
    abs(V) / tan(beta0).
    """
    limit = 0.5 / math.tan(BETA80)
    system = layers(e=(0.0, 0.0), damping=0.1)
    H = np.array([0.0, 0.9 * limit, 0.99 * limit, 1.01 * limit, 1.1 * limit])
    result = saltus.simulate_many(
        system,
        theta_1=0.0,
        theta_2=0.0,
        velocity=(0.0, 0.0),
        periods=30,
        until="rest",
        parameters={"load.horizontal.amplitude": H},
    )
    assert ([str(stop) == "captured" for stop in stop_names(result).values]) == [
        True,
        True,
        True,
        False,
        False,
    ]
    assert (result.impact_count.values[3:] > 0).all()


def test_recurrence_finds_motions_of_both_layers():
    """At H = 0.2 the steady amplitude of the full motion is 0.5694 (contacts.md), once in each
    forcing period.
    """
    load = Load(frequency=1.0, vertical=-0.5, horizontal=Harmonic(amplitude=0.2))
    system = System(
        model=saltus.TwoLayer(beta0=BETA80, damping=0.1), load=load, impact=InelasticImpact()
    )
    states = np.array([[0.1, 0.0, 0.0, 0.0], [0.0, -0.3, 0.0, 0.0]])
    found = find_recurrence(system, states, 400, kept=4, extrema=True)
    assert (found.outcome == Ending.PERIODIC).all()
    assert (found.period == 1).all()
    np.testing.assert_allclose(found.highest, 0.5694, atol=5e-5)
    assert found.states.shape[2] == 4


def test_the_massless_hinge_is_named():
    """With m = 0 and both layers open the mass matrix has no inverse where beta_1 + beta_2 = pi."""
    result = saltus.simulate_many(
        layers(), theta_1=0.6, theta_2=-0.5, velocity=(0.0, 0.0), duration=2.0
    )
    assert str(stop_names(result).values) == "singular"


@pytest.mark.parametrize(
    "state", [{"theta_1": -0.1, "theta_2": 0.0}, {"theta_1": 0.1, "theta_2": 0.1}]
)
def test_states_beyond_a_contact_are_outside(state):
    result = saltus.simulate_many(layers(), **state, velocity=(0.0, 0.0), duration=1.0)
    assert str(stop_names(result).values) == "outside"


OF_LAYERS = (
    "load.frequency",
    "impact.e.1",
    "impact.transfer",
    "model.beta0",
    "load.vertical",
    "impact.e.0",
)


@pytest.mark.parametrize(
    "paths",
    [OF_LAYERS[:3], pytest.param(OF_LAYERS, marks=pytest.mark.thorough)],
    ids=["some", "all"],
)
def test_derivatives_of_ensembles_are_those_of_single_motions(paths):
    """The lanes take other steps than the scalar kernel does; where the motion is calm both agree
    to 1e-7 of the largest.
    """
    system, (numbers, x, v) = layers(e=(0.1, 0.1), transfer=0.2), random_parameters(24, seed=7)
    options = {"duration": 4.0, "tol": 1e-13}
    result = saltus.simulate_many(
        system,
        theta_1=x[0],
        theta_2=-x[1],
        velocity=(v[0], -v[1]),
        parameters=numbers,
        sensitivities=paths,
        **options,
    )
    compared = 0
    for i in range(len(x[0])):
        one = system.with_({path: float(values[i]) for path, values in numbers.items()})
        try:
            alone = saltus.sensitivities(
                one,
                theta=(x[0, i], -x[1, i]),
                velocity=(v[0, i], -v[1, i]),
                parameters=paths,
                dense=False,
                **options,
            )
        except MotionError:
            continue
        expected = np.hstack([alone.state, alone.parameters])
        scale = np.abs(expected).max()
        if int(result.impact_count[i]) != len(alone.motion.impacts) or not 0.0 < scale < 1e3:
            continue
        np.testing.assert_allclose(
            result.derivative.values[i] / scale, expected / scale, rtol=0, atol=1e-7
        )
        compared += len(alone.motion.impacts) > 0
    assert compared >= 8


def test_a_tangent_changes_no_motion():
    system, (numbers, x, v) = layers(e=(0.1, 0.1)), random_parameters(24, seed=8)
    start = {
        "theta_1": x[0],
        "theta_2": -x[1],
        "velocity": (v[0], -v[1]),
        "parameters": numbers,
        "duration": 3.0,
        "tol": 1e-13,
    }
    plain, beside = (
        saltus.simulate_many(system, **start),
        saltus.simulate_many(system, sensitivities=(), **start),
    )
    same = (plain.impact_count == beside.impact_count).values
    assert same.sum() >= 20
    np.testing.assert_allclose(end(beside)[same], end(plain)[same], rtol=0, atol=1e-7)


def test_laws_that_may_gain_energy_are_flagged():
    """g = 1 gains where M_jj > M_ss, s the layer that is hit: from the upper to the lower one for
    every m > 0 (contacts.md).
    """
    system, m = layers(e=(0.0, 0.0), transfer=1.0, mass_ratio=0.1), np.array([0.0, 1e-6, 0.3])
    result = saltus.simulate_many(
        system,
        theta_1=0.1,
        theta_2=0.0,
        velocity=(0.0, 0.0),
        duration=0.1,
        parameters={"model.mass_ratio": m},
    )
    assert result.gaining_contacts.values.tolist() == [0, 2, 2]
    motion = saltus.simulate(system, theta=(0.1, 0.0), velocity=(0.0, 0.0), duration=0.1)
    assert set(motion.validity.gains) == {"upper"}


@pytest.mark.parametrize(("gap", "speed"), [(1e-17, 0.0), (0.0, 1e-17)])
def test_a_gap_of_rounding_on_a_pressed_contact_without_loss_ends_a_lane_as_it_ends_a_motion(
    gap, speed
):
    """It would bounce 1e8 times and more in a unit of time; with any loss it is at rest after as
    few as in a motion by itself.
    """
    start = {"theta_1": 0.1, "theta_2": -gap, "velocity": (0.0, -speed), "duration": 2.0}
    with pytest.raises(MotionError, match="more than 20000 impacts"):
        saltus.simulate(layers(e=(1.0, 1.0)), **start)
    ends = saltus.simulate_many(layers(e=(1.0, 1.0)), **start)
    assert str(stop_names(ends).values) == "unresolved"
    assert int(ends.impact_count) < 25_000
    kept = saltus.simulate_many(layers(e=(0.5, 0.5)), **start)
    assert str(stop_names(kept).values) == "horizon"
    assert int(kept.impact_count) == len(saltus.simulate(layers(e=(0.5, 0.5)), **start).impacts)


@dataclass(frozen=True, kw_only=True)
class ManyBalls(saltus.ContactModel):
    """Balls that fall through a little drag, each over a floor of its own: as many as bits of a
    whole number.
    """

    weight: float = 1.0

    coordinates: ClassVar[tuple[str, ...]] = tuple(f"x{i}" for i in range(64))
    contacts: ClassVar[tuple[saltus.Contact, ...]] = tuple(
        saltus.Contact(name=f"floor{i}", coordinate=f"x{i}") for i in range(64)
    )

    def force(self, t, q, v, load, *sides):
        return tuple(-self.weight - 0.1 * rate for rate in v)


@pytest.mark.thorough
def test_lanes_know_which_of_64_contacts_are_closed():
    """A number with a double's 53 bits would not: every third ball lies on its floor, the last one
    among them.
    """
    system, factors = (
        saltus.System(model=ManyBalls(), impact=saltus.NewtonImpact(e=0.6)),
        np.array([1.0, 1.05, 0.9]),
    )
    heights = {f"x{i}": (0.0 if i % 3 == 0 else 0.3 + 0.01 * i) for i in range(64)}
    found = saltus.simulate_many(
        system, **{name: height * factors for name, height in heights.items()}, duration=1.2
    )
    for i, factor in enumerate(factors):
        alone = saltus.simulate(
            system, **{name: height * factor for name, height in heights.items()}, duration=1.2
        )
        closed = [
            name
            for j, name in enumerate(found.closed_contacts.attrs["flag_meanings"].split())
            if int(found.closed_contacts[i]) >> j & 1
        ]
        assert closed == list(alone.closed) == [f"floor{j}" for j in range(0, 64, 3)]
        assert found.impact_count[i] == len(alone.impacts) > 20
        assert np.abs([found[name][i] for name in heights] - np.array(alone.position)).max() < 1e-14
